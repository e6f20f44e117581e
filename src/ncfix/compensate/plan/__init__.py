"""The plan of a correction: which commands bring the tool tip where it should be, along the whole path."""
