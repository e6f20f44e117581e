"""Fanuc and its like: what differs from the RS274 family, whose interpreter and writer this one uses.

A number may mean something else without its decimal point (`blocks`), flow control is Macro B (`flow`, `variables`,
`system`), and some codes set other things (`data`, `lengths`, `tilt`, `coordinates`).
Sources: Fanuc 30i operator's manual (lathe and machining centre, "Custom macro"; machining centre, "Tilted working
plane indexing", "Polar coordinate command"), Haas mill operator's manual.
"""
