"""What is there for speed: stretches of plain blocks taken all at once, as the interpreter takes them one by one."""
