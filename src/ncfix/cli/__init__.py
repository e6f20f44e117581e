"""The command line: arguments, files, messages and exit codes; nothing else.

Numeric packages are imported inside the commands, so that `--help` is fast.
"""
