"""NC programs as text: what is read without loss, its tree, numbers and shapes; no meaning of any control."""
