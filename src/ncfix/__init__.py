"""ncfix: knows how a particular machine tool is wrong, and makes it cut right."""

__version__ = "0.1.0"
