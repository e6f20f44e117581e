"""Files of tools: tables of controls, and tool data that is written as a program."""
