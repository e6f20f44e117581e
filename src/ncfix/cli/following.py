"""A program followed as the control would, for the verbs that look at its motions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ncfix.cli.options import load_machine, read_program, subprograms
from ncfix.cli.setup_options import SetupOptions
from ncfix.cli.targets import STREAM
from ncfix.diagnostics import SourceError

if TYPE_CHECKING:
    from ncfix.compensate.checking import Checked
    from ncfix.compensate.comparison import Gaps
    from ncfix.compensate.simulation import TipError
    from ncfix.machine import Machine
    from ncfix.program.moves import Moves, Trace
    from ncfix.program.setup import Setup
    from ncfix.program.tree import Program

LINEAR = ("X", "Y", "Z")
ROTARY = ("A", "B", "C")
PARALLEL = ("U", "V", "W")


@dataclass(frozen=True, slots=True)
class Compared:
    """Two programs on one machine: figures of the original, of the other along its own path, and along the original's.

    beyond       lines of the other with errors larger than the tolerance
    not_reached  lines of the original from which the other is farther away
    unseen       lines of the original that cut, nobody knows where
    left         linear axis -> lines of the original that cut, and nobody but the machine knows where that axis stands:
                 nothing can be corrected along it there
    """

    before: dict[str, Any]
    after: dict[str, Any]
    left_out: dict[str, Any]
    beyond: list[int]
    not_reached: list[int]
    unseen: list[int]
    left: dict[str, list[int]]

    @property
    def within(self) -> bool:
        """Nothing is farther from the intended path than the tolerance."""
        return not self.beyond and not self.not_reached


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

    def read(self, path: str) -> Program:
        """Read a program."""
        return read_program(path, self.dialect, self.machine)

    def trace(self, program: Program, path: str) -> Trace:
        """The motions of a program."""
        from ncfix.compensate.following import traced
        from ncfix.program.trace import trace

        if self.machine is not None:
            return traced(program, self.machine, self.setup, subprograms(path))
        return trace(program, self.setup, *self._axes(program), subprograms(path))

    def checked(self, program: Program, path: str) -> Checked:
        """What is found in a program."""
        from ncfix.compensate.checking import check_alone, check_on

        if self.machine is None:
            return check_alone(program, self.setup, *self._axes(program), subprograms(path))
        return check_on(program, self.machine, self.setup, subprograms(path))

    def _axes(self, program: Program) -> tuple[tuple[str, ...], frozenset[str]]:
        """The axes of the machine, or without one those that the program names; and which of them turn."""
        from ncfix.compensate.following import rotary_names

        if self.machine is None:
            return named_axes(program), frozenset(ROTARY)
        return self.machine.axis_names, rotary_names(self.machine)

    def simulated(self, path: str) -> tuple[Program, Moves, TipError]:
        """A program, its motions, and the error of the tool tip along them."""
        from ncfix.compensate.simulation import tip_error

        program, machine, moves = self._on_machine(path)
        return program, moves, tip_error(machine, moves)

    def compared(self, original: str, fixed: str, tolerance_um: float) -> Compared:
        """What this machine does with two programs, measured against what the first one means."""
        from ncfix.compensate.comparison import compare, error_of
        from ncfix.compensate.simulation import unseen
        from ncfix.compensate.wordless import left_in_cuts

        program, machine, meant = self._on_machine(original)
        other, _, done = self._on_machine(fixed, original, like=program)
        limit = tolerance_um / 1e3
        there, back = compare(machine, meant, done, near=limit)
        before = error_of(machine, meant, near=limit)
        lines, other_lines = lines_of(program, meant.block), lines_of(other, done.block)
        return Compared(
            before=figures(before, lines),
            after=figures(there, other_lines),
            left_out=figures(back, lines),
            beyond=_lines_at(there.rows_beyond(limit), other_lines),
            not_reached=_lines_at(back.rows_beyond(limit), lines),
            unseen=_lines_at(unseen(meant), lines),
            left={axis: _lines_at(rows, lines) for axis, rows in left_in_cuts(meant).items()},
        )

    def _read_like(self, path: str, other: Program) -> Program:
        """A program in the dialect of another one, unless one is given, or its text shows that it is of another family.

        What was written out flat may have lost all that shows a dialect.
        """
        if self.dialect is not None or path == STREAM:
            return self.read(path)
        try:
            return read_program(path, other.dialect.name, self.machine)
        except SourceError:
            return self.read(path)

    def _on_machine(self, path: str, *others: str, like: Program | None = None) -> tuple[Program, Machine, Moves]:
        """A program as this machine follows it.

        others  programs beside which its subprograms may be, too: `fix` writes the program alone
        like    one in whose dialect it is, if its text does not forbid it
        """
        from ncfix.compensate.following import follow

        assert self.machine is not None
        program = self.read(path) if like is None else self._read_like(path, like)
        found = follow(program, self.machine, self.setup, subprograms(path, *others))
        return program, found.machine, found.trace.moves


def _lines_at(rows: Any, lines: list[int]) -> list[int]:
    """The lines of motions, each once, in order."""
    return sorted({lines[row] for row in rows.tolist()})


def named_axes(program: Program) -> tuple[str, ...]:
    """X Y Z, and what other axes the program has words for."""
    words = {word.address for template in program.templates for word in template.words}
    return LINEAR + tuple(letter for letter in ROTARY + PARALLEL if letter in words)


def lines_of(program: Program, blocks: Any) -> list[int]:
    """The line numbers of blocks (n,), all at once."""
    import numpy as np

    text = np.frombuffer(program.source, dtype=np.uint8)
    ends = np.flatnonzero(text == ord("\n" if b"\n" in program.source else "\r"))
    lines: list[int] = (np.searchsorted(ends, program.blocks[blocks, 0]) + 1).tolist()
    return lines


def figures(error: TipError | Gaps, lines: list[int]) -> dict[str, Any]:
    """The error along a path in two figures, um, and the line of the worst."""
    row = error.worst_row
    return {"max": 1e3 * error.max_mm, "rms": 1e3 * error.rms_mm, "where": None if row is None else lines[row]}
