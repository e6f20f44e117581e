"""Reading tool lengths and radii: tool tables of controls, and tool data written as a program."""
