"""The hidden-effect benchmark: a machine, measured data, and a truth that the code under test never sees.

Nothing in this package imports ncfix. README.md says what is simulated and how it is scored;
`python -m tests.hidden --help` says how to run it.
"""
