"""One motion block while it is executed, and what all path functions do with it."""

from __future__ import annotations

from dataclasses import dataclass

from ncfix.program.klartext.control import Control
from ncfix.program.klartext.targets import Words
from ncfix.program.moves import Kind


@dataclass(frozen=True, slots=True)
class Step:
    """One motion block while it is executed.

    name    its path function
    words   its words
    flags   `fmax`, `dr+`, ...
    codes   its M codes
    """

    name: str
    words: Words
    flags: frozenset[str]
    codes: frozenset[int]

    @property
    def kind(self) -> Kind:
        """At FMAX a rapid."""
        return Kind.RAPID if "fmax" in self.flags else Kind.FEED


def with_increments(control: Control, on: bool) -> None:
    """Whether the words of the next motion count from where it begins."""
    control.modal.incremental = on


def refuse(control: Control, reason: str) -> None:
    """A motion that is not followed."""
    control.refuse_here(reason)
