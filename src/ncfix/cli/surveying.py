"""One program looked at, for `check`: a long one while it is read, if it can be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ncfix.cli.following import Following
from ncfix.cli.parts import Source, source_of
from ncfix.cli.through import dialect_in, parts_of, task_of, through

if TYPE_CHECKING:
    from ncfix.compensate.checking import Checked


@dataclass(frozen=True, slots=True)
class Looked:
    """What was found in a program, and the dialect in which it was read."""

    dialect: str
    checked: Checked


def looked_at(following: Following, path: str) -> Looked:
    """Look at a program."""
    with source_of(path) as source:
        return through([source], lambda: _in_parts(following, source), lambda: _whole(following, source))


def _in_parts(following: Following, source: Source) -> Looked:
    """While it is read; raises what that does, and `NotInPartsError`."""
    from ncfix.compensate.survey import survey_alone, survey_on

    dialect = dialect_in(following, source)
    if following.machine is None:
        return Looked(dialect.name, survey_alone(*parts_of(following, source, dialect)))
    return Looked(dialect.name, survey_on(task_of(following, source, dialect), source.read))


def _whole(following: Following, source: Source) -> Looked:
    program = following.read(source.path, source.everything())
    return Looked(program.dialect.name, following.checked(program, source.path))
