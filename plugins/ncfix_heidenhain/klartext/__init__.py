"""Heidenhain Klartext: reading, following and writing programs of TNC controls.

Source: the user's manuals of the iTNC 530 and the TNC 640, chapters "Programming: contours", "Q parameters", "Multiple
axis machining", and "Cycle programming". What the manuals leave to machine parameters is refused, not guessed.
"""
