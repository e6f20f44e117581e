"""The version of ncfix."""

__version__ = "0.1.0"
