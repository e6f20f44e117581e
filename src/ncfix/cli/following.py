"""A program followed as the control would, for the verbs that look at its motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ncfix.cli.options import load_machine, read_program, subprograms
from ncfix.cli.setup_options import SetupOptions

if TYPE_CHECKING:
    from ncfix.compensate.block_delete import Position
    from ncfix.compensate.checking import Checked
    from ncfix.compensate.figures.simulation import Along
    from ncfix.compensate.following import Followed
    from ncfix.control.moves import Trace
    from ncfix.control.setup import Setup
    from ncfix.machine import Machine
    from ncfix.text.tree import Program, Template

LINEAR = ("X", "Y", "Z")
ROTARY = ("A", "B", "C")
PARALLEL = ("U", "V", "W")


@dataclass(frozen=True, slots=True)
class Following:
    """What is needed to follow programs. Without errors to correct, what is not given may be zero."""

    machine: Machine | None
    setup: Setup
    dialect: str | None

    @classmethod
    def of(cls, machine_path: str | None, dialect: str | None, given: SetupOptions) -> Following:
        """Load what the options name."""
        machine = load_machine(machine_path) if machine_path else None
        setup = given.load()
        exacting = machine is not None and not machine.is_perfect
        return cls(machine, setup if exacting else replace(setup, assume_zero=True), dialect)

    def read(self, path: str, text: bytes | None = None) -> Program:
        """Read a program; `text`: what is in the file."""
        return read_program(path, self.dialect, self.machine, text)

    def trace(self, program: Program, path: str) -> Trace:
        """The motions of a program."""
        from ncfix.compensate.following import traced
        from ncfix.control.trace import trace

        if self.machine is not None:
            return traced(program, self.machine, self.setup, subprograms(self.setup, path))
        return trace(program, self.setup, *self._axes(program), subprograms(self.setup, path))

    def checked(self, program: Program, path: str) -> Checked:
        """What is found in a program."""
        from ncfix.compensate.checking import check_alone, check_on

        if self.machine is None:
            return check_alone(program, self.setup, *self._axes(program), subprograms(self.setup, path))
        return check_on(program, self.machine, self.setup, subprograms(self.setup, path))

    def _axes(self, program: Program) -> tuple[tuple[str, ...], frozenset[str]]:
        """The axes of the machine, or without one those that the program names; and which of them turn."""
        from ncfix.compensate.following import rotary_names

        if self.machine is None:
            return axes_of(program.templates), frozenset(ROTARY)
        return self.machine.axis_names, rotary_names(self.machine)

    def on_machine(self, program: Program, *paths: str) -> Followed:
        """A program as this machine follows it; `paths`: files beside which its subprograms may be."""
        from ncfix.compensate.following import follow

        assert self.machine is not None
        return follow(program, self.machine, self.setup, subprograms(self.setup, *paths))

    def in_positions(self, program: Program, *paths: str) -> tuple[Position, ...]:
        """A program as this machine follows it in all positions of block delete, or in the one that is stated."""
        from ncfix.compensate.block_delete import positions_of
        from ncfix.compensate.following import follow

        machine, find = self.machine, subprograms(self.setup, *paths)
        assert machine is not None
        return positions_of(self.setup, lambda own: follow(program, machine, own, find).trace)


def axes_of(templates: Sequence[Template]) -> tuple[str, ...]:
    """X Y Z, and what other axes a program with blocks of these shapes has words for."""
    words = {word.address for template in templates for word in template.words}
    return LINEAR + tuple(letter for letter in ROTARY + PARALLEL if letter in words)


def figures(along: Along) -> dict[str, Any]:
    """The error along a path in two figures, um, and the line of the worst; None where nothing was looked at."""
    if not along.count:
        return {"max": None, "rms": None, "where": None}
    return {"max": 1e3 * along.max, "rms": 1e3 * along.rms, "where": along.where}
