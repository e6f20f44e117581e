"""Fast execution of stretches of plain blocks, all at once; results are identical to those of the interpreter."""
