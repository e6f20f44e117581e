"""A program followed as the control would, for the verbs that look at its motions."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ncfix.cli.options import read_program, subprograms

if TYPE_CHECKING:
    from ncfix.machine import Machine
    from ncfix.program.moves import Trace
    from ncfix.program.setup import Setup
    from ncfix.program.tree import Program

LINEAR = ("X", "Y", "Z")
ROTARY = ("A", "B", "C")
PARALLEL = ("U", "V", "W")


def followed(program: Program, path: str, setup: Setup, machine: Machine | None) -> Trace:
    """The motions of a program, on the axes of the machine, or without one on those that the program names."""
    from ncfix.program.trace import trace

    if machine is None:
        axes = named_axes(program)
        rotary = frozenset(ROTARY)
    else:
        axes = machine.axis_names
        rotary = frozenset(axis.name for axis in machine.axes if axis.rotary)
    return trace(program, setup, axes, rotary, subprograms(path))


def named_axes(program: Program) -> tuple[str, ...]:
    """X Y Z, and what other axes the program has words for."""
    words = {word.address for template in program.templates for word in template.words}
    return LINEAR + tuple(letter for letter in ROTARY + PARALLEL if letter in words)


def read_and_follow(path: str, dialect: str | None, setup: Setup, machine: Machine | None) -> tuple[Program, Trace]:
    """Read a program and follow it. Without a machine nothing is cut, so what is not given may be zero."""
    program = read_program(path, dialect, machine)
    if machine is None:
        setup = replace(setup, assume_zero=True)
    return program, followed(program, path, setup, machine)


def lines_of(program: Program, blocks: Any) -> list[int]:
    """The line numbers of blocks (n,), all at once."""
    import numpy as np

    text = np.frombuffer(program.source, dtype=np.uint8)
    ends = np.flatnonzero(text == ord("\n" if b"\n" in program.source else "\r"))
    lines: list[int] = (np.searchsorted(ends, program.blocks[blocks, 0]) + 1).tolist()
    return lines
