"""Programs gone through: long ones part by part while they are read, if that can be, others as wholes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeVar

from ncfix import fast
from ncfix.cli import console
from ncfix.cli.following import ROTARY, Following, axes_of
from ncfix.cli.options import dialect_of, subprograms
from ncfix.cli.parts import Source, looked_bytes
from ncfix.cli.targets import shown
from ncfix.diagnostics import DifferenceError, Message, NcfixError, UsageError

if TYPE_CHECKING:
    from ncfix.compensate.partition import Part, Parts
    from ncfix.compensate.task import Task
    from ncfix.text.dialect import Dialect

Found = TypeVar("Found")


def through(sources: Sequence[Source], in_parts: Callable[[], Found], as_wholes: Callable[[], Found]) -> Found:
    """What is found in programs; in what is wrong with them, or cannot be found in parts, they are taken as wholes.

    in_parts  reads them from their beginnings; raises what that does, and `NotInPartsError`
    """
    long = [source.looked_into() for source in sources]
    if any(long):
        from ncfix.control.parts import NotInPartsError

        fast.engage(console.forewarn)
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
    """Say of a program whose numbers are to be what is meant that they have been corrected."""
    if source.stamp:
        text = "the program has been corrected already, and its corrected numbers are taken for what is meant"
        console.tell(Message("NCF430", text, source.stamp, "give the original program"))


def dialect_in(following: Following, source: Source) -> Dialect:
    """The dialect of a program of which the beginning has been read."""
    return dialect_of(source.head, shown(source.path), following.dialect, following.machine)


def task_of(following: Following, source: Source, dialect: Dialect, *beside: str) -> Task:
    """A long program on the machine; `beside`: files beside which its subprograms may be, too."""
    from ncfix.compensate.checking import OPTIONS
    from ncfix.compensate.task import Task

    assert following.machine is not None
    find, path = subprograms(following.setup, source.path, *beside), shown(source.path)
    return Task(following.machine, following.setup, OPTIONS, find, path, dialect, looked_bytes(), source.head)


def parts_of(following: Following, source: Source, dialect: Dialect) -> tuple[Parts, Iterator[Part]]:
    """A long program as the control follows it, and its parts; without a machine, with the axes that it names first.

    Going through the parts raises what following does, and `NotInPartsError`.
    """
    from ncfix.compensate.checking import OPTIONS
    from ncfix.compensate.partition import Parts
    from ncfix.compensate.task import follower_of
    from ncfix.control.parts import NotInPartsError, PartReader
    from ncfix.text.language import Run

    reader = PartReader(shown(source.path), dialect, source.head)
    axes: tuple[str, ...] | None = None
    if following.machine is not None:
        follower = task_of(following, source, dialect).follower()
    else:
        axes = axes_of(PartReader(reader.path, dialect, source.head).read(source.first_lines).templates)
        find = subprograms(following.setup, source.path)
        follower = follower_of(dialect, Run(following.setup, axes, frozenset(ROTARY), find))
    parts = Parts(OPTIONS, reader, follower, source.read, looked_bytes())

    def found() -> Iterator[Part]:
        for part in parts.parts():
            if axes is not None and axes_of(reader.templates) != axes:
                raise NotInPartsError("an axis is named for the first time")
            yield part
        if follower.lacking:
            raise UsageError.collected(follower.lacking)

    return parts, found()
