"""Following programs of the RS274 family as the control would: LinuxCNC exactly, other ISO controls where they agree.

The order and the meaning of what a block does are those of LinuxCNC's interpreter (documentation, "G-code overview",
"Order of execution", and its `rs274` program, against which the tests run); `groups.py` holds where others differ.
"""
