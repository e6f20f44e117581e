"""One program looked at, for `check`: a long one while it is read, if it can be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ncfix import fast
from ncfix.cli.following import ROTARY, Following, axes_of
from ncfix.cli.options import dialect_of, subprograms
from ncfix.cli.parts import Source, part_bytes, source_of
from ncfix.cli.targets import shown
from ncfix.diagnostics import NcfixError

if TYPE_CHECKING:
    from ncfix.compensate.checking import Checked
    from ncfix.program.dialect import Dialect


@dataclass(frozen=True, slots=True)
class Looked:
    """What was found in a program, and the dialect in which it was read."""

    dialect: str
    checked: Checked


def looked_at(following: Following, path: str) -> Looked:
    """Look at a program."""
    from ncfix.program.parts import NotInPartsError

    with source_of(path) as source:
        head, long = source.looked_into()
        if long:
            fast.engage()
            try:
                return _in_parts(following, source)
            except (NcfixError, NotInPartsError):
                pass  # as a whole then; what is wrong with it is said there
        program = following.read(path, source.everything() if long else head)
    return Looked(program.dialect.name, following.checked(program, path))


def _in_parts(following: Following, source: Source) -> Looked:
    """While it is read; raises what that does, and `NotInPartsError`."""
    from ncfix.compensate.checking import OPTIONS
    from ncfix.compensate.survey import survey_on
    from ncfix.compensate.task import Task

    name = shown(source.path)
    dialect = dialect_of(source.head, name, following.dialect, following.machine)
    if following.machine is None:
        found = _alone(following, source, dialect)
    else:
        find = subprograms(source.path)
        task = Task(following.machine, following.setup, OPTIONS, find, name, dialect, part_bytes())
        found = survey_on(task, source.read)
    source.check_unchanged()
    return Looked(dialect.name, found)


def _alone(following: Following, source: Source, dialect: Dialect) -> Checked:
    """Without a machine: with the axes that the beginning of the text names."""
    from ncfix.compensate.survey import survey_alone
    from ncfix.program.language import Run
    from ncfix.program.parts import PartReader

    name, begun = shown(source.path), source.head[: source.head.rfind(b"\n") + 1]
    axes = axes_of(PartReader(name, dialect).read(begun).templates)
    run = Run(following.setup, axes, frozenset(ROTARY), subprograms(source.path))
    return survey_alone(name, dialect, run, axes_of, source.read, part_bytes())
