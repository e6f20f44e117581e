"""The command line, verbs by topic; nothing but arguments, files, messages and exit codes.

Numeric packages are imported inside the commands, so that `--help` answers at once.
"""
