"""A family of controls, as the functions in which they differ: how its programs are followed."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from ncfix.text.language import Language

if TYPE_CHECKING:
    from ncfix.control.control import ProgramControl
    from ncfix.control.interpreter import Interpreter
    from ncfix.control.setup import Run
    from ncfix.text.dialect import Dialect


class FlatLine(NamedTuple):
    """A line of a flat program, and the line of the original that it comes from."""

    text: str
    line: int


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowedLanguage(Language):
    """How the programs of one family of controls are followed.

    control   what the control keeps while it follows a program of a dialect
    interpreter  (control, program, run) -> the walk through a program; `in_parts`: this is the first of its parts
    unroll    (interpreter, least increments, limit) -> the blocks of a program as they are executed, see `flatten`;
              None if the language cannot write them
    """

    control: Callable[[Run, Dialect], ProgramControl]
    interpreter: Callable[..., Interpreter[Any]]
    unroll: Callable[[Any, Mapping[str, float], int], Sequence[FlatLine]] | None = None
