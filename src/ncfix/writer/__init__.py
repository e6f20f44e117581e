"""Corrected motions put into the text of a program: which bytes change, and the proof that nothing else does."""
