"""Follows programs of the RS274 family as the control would: LinuxCNC exactly, other ISO controls where they agree.

Order and meaning of the actions of a block are those of LinuxCNC's interpreter (documentation, "G-code overview",
"Order of execution", and its `rs274` program, which the tests compare with); differences of others are in `groups.py`.
"""
