"""Fanuc and similar controls: the differences from the RS274 family, whose interpreter and writer are used.

A number without a decimal point may have another meaning (`blocks`), flow control is Macro B (`flow`, `variables`,
`system`), and some codes have other effects (`data`, `lengths`, `tilt`, `coordinates`).
Sources: Fanuc 30i operator's manual (lathe and machining centre, "Custom macro"; machining centre, "Tilted working
plane indexing", "Polar coordinate command"), Haas mill operator's manual.
"""
