"""The control while it follows a program: where the axes stand, what is in force, and the motions that come of it."""
