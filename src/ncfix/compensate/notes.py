"""Findings of parts put together: the first few are written out, the rest is counted, as of one plan for all."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ncfix.compensate.findings import MOST, Finding, Mask
from ncfix.control.moves import Moves
from ncfix.diagnostics import Message
from ncfix.text.tree import Program

ORDER = (
    *("NCF408", "NCF405", "NCF404", "NCF406", "NCF407"),
    *("NCF414", "NCF402", "NCF403", "NCF415", "NCF454", "NCF413", "NCF455", "NCF409", "NCF410"),
)
"""Findings in the order in which they are reported: those of limits, then those of a plan."""
ONCE = frozenset({"NCF409"})
"""Findings that hold for the whole program, and are told of its first motion only."""


@dataclass(slots=True)
class Found:
    """Messages of one kind, the first few, and how many there are."""

    shown: list[Message] = field(default_factory=list)
    count: int = 0


@dataclass(slots=True)
class Notes:
    """Findings so far, by code, text and hint."""

    found: dict[tuple[str, str, str], Found] = field(default_factory=dict)

    def add(self, finding: Finding, program: Program, moves: Moves, own: Mask | None = None) -> None:
        """Take in a finding of a part; of motions `own` (n,) if given."""
        rows = np.arange(len(finding)) if own is None else np.flatnonzero(own[finding.moves])
        shown = []
        for k in rows[:MOST].tolist():
            place = program.place(int(moves.block[finding.moves[k]]))
            shown.append(Message(finding.code, finding.sentence(k), place, finding.hint))
        self._take((finding.code, finding.text, finding.hint), Found(shown, len(rows)))

    def take(self, other: Notes) -> None:
        """Take in the findings of what comes behind."""
        for key, found in other.found.items():
            self._take(key, found)

    def _take(self, key: tuple[str, str, str], found: Found) -> None:
        if key[0] in ONCE and key in self.found:
            return
        note = self.found.setdefault(key, Found())
        note.shown += found.shown[: max(MOST - note.count, 0)]
        note.count += found.count

    def messages(self) -> tuple[Message, ...]:
        """What was found, in the order of one plan."""
        messages: list[Message] = []
        for code, note in sorted(
            ((key[0], note) for key, note in self.found.items()), key=lambda each: ORDER.index(each[0])
        ):
            messages += note.shown
            if note.count > MOST:
                messages.append(Message(code, f"and {note.count - MOST} more motions like these"))
        return tuple(messages)
