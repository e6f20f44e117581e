"""Figures of a path: where the tool tip goes, how far that is off, and whether two programs cut the same."""
