"""The functions of `import ncfix`: what the verbs of the command line do, on values.

Programs, machines and measurements are values, or the paths of files with them. No file is touched unless its path is
given: `output=` writes the result, whole or not at all; never in the place of an input, and in that of another file
only if `force` says so. That is looked at before anything is computed. docs/api.md shows each function at work.

What is refused stands in the result; to write a result of which something is refused raises `RefusedError`, unless it
is allowed. All errors are `ncfix.diagnostics.NcfixError`, with codes; a function called as no function can be, with two
sources for one, say, raises TypeError.
"""
