"""The interpreter and the test machines, for every test of this folder."""

from differential.fixtures import machine, machine_file, rs274

__all__ = ["machine", "machine_file", "rs274"]
