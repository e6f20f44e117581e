"""Many programs: which they are, who does the work, what is done, and how to go on after a stop."""
