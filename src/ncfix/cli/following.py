"""Follows programs as the control would, for the verbs that examine their motions.

Long programs are processed part by part while they are read, if possible; others as a whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from ncfix import core
from ncfix.batch.programs import subprograms
from ncfix.cli import console
from ncfix.cli.options import dialect_of, load_machine, read_program
from ncfix.cli.setup_options import SetupOptions
from ncfix.cli.streams import Source, part_bytes
from ncfix.cli.targets import shown
from ncfix.diagnostics import DifferenceError, NcfixError, UsageError
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.compensate.checking import Checked
    from ncfix.compensate.following import Followed, Task
    from ncfix.compensate.parts import Part, Parts
    from ncfix.control.moves import Trace
    from ncfix.control.setup import Setup
    from ncfix.machine import Machine
    from ncfix.text.dialect import Dialect
    from ncfix.text.tree import Program, Template

LINEAR = ("X", "Y", "Z")
ROTARY = ("A", "B", "C")
PARALLEL = ("U", "V", "W")
Found = TypeVar("Found")


@frozen
class FollowingSetup:
    """What is needed to follow programs. For a machine without errors, missing data count as zero."""

    machine: Machine | None
    setup: Setup
    dialect: str | None

    @classmethod
    def of(cls, machine_path: str | None, dialect: str | None, given: SetupOptions) -> FollowingSetup:
        """Load the machine and the setup named by options."""
        machine = load_machine(machine_path) if machine_path else None
        setup = given.load(machine)
        exacting = machine is not None and not machine.is_perfect
        return cls(machine, setup if exacting else replace(setup, assume_zero=True), dialect)

    def read(self, path: str, text: bytes | None = None) -> Program:
        """Read a program; `text`: content of the file, if already read."""
        return read_program(path, self.dialect, self.machine, text)

    def trace(self, program: Program, path: str) -> Trace:
        """The motions of a program."""
        from ncfix.compensate.following import traced
        from ncfix.control.trace import trace

        if self.machine is not None:
            return traced(program, self.machine, self.setup, subprograms(self.setup, path))
        return trace(program, self.setup, *self._axes(program), subprograms(self.setup, path))

    def checked(self, program: Program, path: str, flatten: bool = False) -> Checked:
        """The findings in a program; `flatten`: whether it may be written out flat."""
        from ncfix.compensate.checking import check_alone, check_on

        if self.machine is None:
            return check_alone(program, self.setup, *self._axes(program), subprograms(self.setup, path))
        return check_on(program, self.machine, self.setup, subprograms(self.setup, path), flatten)

    def _axes(self, program: Program) -> tuple[tuple[str, ...], frozenset[str]]:
        """The axes of the machine, else those that the program names; and which of them are rotary."""
        from ncfix.compensate.following import rotary_names

        if self.machine is None:
            return axes_of(program.templates), frozenset(ROTARY)
        return self.machine.axis_names, rotary_names(self.machine)

    def on_machine(self, program: Program, *paths: str) -> Followed:
        """A program as this machine follows it; `paths`: files beside which its subprograms may be."""
        from ncfix.compensate.following import follow

        assert self.machine is not None
        return follow(program, self.machine, self.setup, subprograms(self.setup, *paths))


def axes_of(templates: Sequence[Template]) -> tuple[str, ...]:
    """X Y Z and the other axes for which a program with these block shapes has words."""
    words = {word.address for template in templates for word in template.words}
    return LINEAR + tuple(letter for letter in ROTARY + PARALLEL if letter in words)


def through(sources: Sequence[Source], in_parts: Callable[[], Found], as_wholes: Callable[[], Found]) -> Found:
    """Process programs in parts if one is long, else as a whole; also as a whole if that fails or an error is found.

    in_parts  processes them from their beginnings; may raise any error, and `NotInPartsError`
    """
    long = [source.looked_into() for source in sources]
    if any(long):
        from ncfix.control.trace import NotInPartsError

        core.forewarn(console.forewarn)
        try:
            found = in_parts()
            for source in sources:
                source.check_unchanged()
            return found
        except DifferenceError:
            raise
        except (NcfixError, NotInPartsError):
            pass  # as wholes then; what is wrong with one of them is said there
    return as_wholes()


def tell_of_stamp(source: Source) -> None:
    """Warn that a program taken as the intended one has been corrected already."""
    if source.stamp:
        from ncfix.text.stamp import remark

        console.tell(remark(source.stamp))


def dialect_in(following: FollowingSetup, source: Source) -> Dialect:
    """The dialect of a program whose beginning has been read."""
    return dialect_of(source.head, shown(source.path), following.dialect, following.machine)


def task_of(following: FollowingSetup, source: Source, dialect: Dialect, *beside: str) -> Task:
    """The task for a long program on the machine; `beside`: further files beside which its subprograms may be."""
    from ncfix.compensate.checking import OPTIONS
    from ncfix.compensate.following import Task

    assert following.machine is not None
    find, path = subprograms(following.setup, source.path, *beside), shown(source.path)
    return Task(following.machine, following.setup, OPTIONS, find, path, dialect, part_bytes(), source.head)


def parts_of(following: FollowingSetup, source: Source, dialect: Dialect) -> tuple[Parts, Iterator[Part]]:
    """The parts of a long program as the control follows it; without a machine, for the axes in its first lines.

    Iterating over the parts raises errors of following, and `NotInPartsError`.
    """
    from ncfix.compensate.checking import OPTIONS
    from ncfix.compensate.following import follower_of
    from ncfix.compensate.parts import Parts
    from ncfix.control.setup import Run
    from ncfix.control.trace import NotInPartsError, PartReader

    reader = PartReader(shown(source.path), dialect, source.head)
    axes: tuple[str, ...] | None = None
    if following.machine is not None:
        follower = task_of(following, source, dialect).follower()
    else:
        axes = axes_of(PartReader(reader.path, dialect, source.head).read(source.first_lines).templates)
        find = subprograms(following.setup, source.path)
        follower = follower_of(dialect, Run(following.setup, axes, frozenset(ROTARY), find))
    parts = Parts(OPTIONS, reader, follower, source.read, part_bytes())

    def found() -> Iterator[Part]:
        for part in parts.parts():
            if axes is not None and axes_of(reader.templates) != axes:
                raise NotInPartsError("an axis is named for the first time")
            yield part
        if follower.lacking:
            raise UsageError.collected(follower.lacking)

    return parts, found()
