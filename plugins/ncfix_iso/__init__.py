"""ISO 6983 G-code."""
