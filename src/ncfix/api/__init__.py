"""The functions of `import ncfix`: the commands of the command line as Python functions.

Programs, machines and measurements are given as values or as paths of files. No file is written unless its path is
given: `output=` writes the result, completely or not at all. It never replaces an input, and another existing file only
with `force`. This is checked before anything is computed. docs/api.md shows each function at work.

Refused motions are listed in the result; writing a result with refused motions raises `RefusedError`, unless they are
allowed. All errors are `ncfix.diagnostics.NcfixError`, with codes. Wrong calls, for example with two sources for one
argument, raise TypeError.
"""
