"""Writing corrected motions into the text of a program, and proof that nothing else in the text changes."""
