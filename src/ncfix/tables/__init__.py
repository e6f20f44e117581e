"""Compensation tables of controls: made from a machine, written, read back and run."""
