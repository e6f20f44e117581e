"""Tables that controls understand, made from a machine and read back."""
