"""A dialect as a small declarative table: which grammar, which words, which limits."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Dialect:
    """One control's language, as data; the grammar says what a block is, this says what the control makes of it.

    name                short name, as in `--dialect`
    title               for people
    grammar             file name under `grammars/`
    suffixes            file extensions that suggest it, lower case with the point
    signature           regular expressions (bytes) in a file that suggest it, strongest first
    line_limit          characters a line may have; 0 = no limit
    comment             how to write a one-line comment, with `{}` for the text
    closure_mm          an arc whose start and end radii differ by more is refused by the control
    closure_relative    the same relative to the radius (both must be exceeded)
    block_skip_executed blocks with `/` run unless the operator asks otherwise
    needs_end           the control wants M2/M30 or `%` at the end
    """

    name: str
    title: str
    grammar: str
    suffixes: tuple[str, ...]
    signature: tuple[bytes, ...] = ()
    line_limit: int = 0
    comment: str = "({})"
    closure_mm: float = 0.0283
    closure_relative: float = 0.001
    block_skip_executed: bool = True
    needs_end: bool = False
