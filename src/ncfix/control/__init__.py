"""Model of a control that executes a program: positions, modal state, and the motions that the program makes."""
