"""Findings of the planner: coded problems and remarks with the motions that they concern.

`Notes` collects the findings of the parts of a program, and makes messages of them: the first few are written out, the
rest are counted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from enum import Enum

import numpy as np

from ncfix.arrays import Array, Index, Mask
from ncfix.control.moves import Moves
from ncfix.diagnostics import Message, RefusedError
from ncfix.text.tree import Program
from ncfix.values import frozen, mutable

MOST = 20
"""Largest number of messages of one kind that are written out; the rest are counted."""


class FindingKind(Enum):
    """What a finding says about its motions, and how it is reported."""

    PROBLEM = "why they stay as they are; reported for each"
    REMARK = "about motions that are corrected nevertheless; reported for each"
    ONCE = "a remark that holds for the whole program; reported for the first motion only"
    COUNTED = "a remark reported for the first motion, with the number of motions, their axes, and the largest figure"


@frozen
class Finding:
    """A problem or remark, and the motions that it concerns.

    code    stable code, explained in `codes.py`
    moves   (k,) indices of the motions, ascending
    values  (k,) one figure per motion, in the unit that `text` names
    text    sentence with the fields `{value}`, `{axis}`, `{unit}` and `{range}`
    axes    (k,) axis letter per motion, or empty
    hint    what to do about it
    turns   (k,) whether that axis is rotary, so that the value is in degrees; or empty
    ranges  axis letter -> its range in words; or empty
    kind    problem or remark
    """

    code: str
    moves: Index
    values: Array
    text: str
    axes: tuple[str, ...] = ()
    hint: str = ""
    turns: tuple[bool, ...] = ()
    ranges: Mapping[str, str] = field(default_factory=dict)
    kind: FindingKind = FindingKind.PROBLEM

    @classmethod
    def of(cls, code: str, moves: Index, text: str, hint: str = "", kind: FindingKind = FindingKind.PROBLEM) -> Finding:
        """A finding without figures."""
        return cls(code, moves, np.zeros(len(moves)), text, hint=hint, kind=kind)

    def __len__(self) -> int:
        return len(self.moves)

    def sentence(self, k: int) -> str:
        """The sentence for the k-th motion, with its value, axis, unit and range."""
        axis = self.axes[k] if self.axes else ""
        unit = "degrees" if self.turns and self.turns[k] else "mm"
        range_ = self.ranges.get(axis, "")
        return self.text.format(value=float(self.values[k]), axis=axis, unit=unit, range=range_)

    def among(self, chosen: Sequence[bool]) -> Finding:
        """The finding for the chosen motions (k,) only."""
        rows = np.flatnonzero(np.array(chosen, dtype=np.bool_))
        axes = tuple(self.axes[row] for row in rows) if self.axes else ()
        turns = tuple(self.turns[row] for row in rows) if self.turns else ()
        return replace(self, moves=self.moves[rows], values=self.values[rows], axes=axes, turns=turns)


@mutable(eq=False, slots=False)
class PoseError(RefusedError):
    """Poses that cannot be corrected; `rows` (n,): which of the given poses."""

    rows: Mask | None = None


def pose_error(code: str, text: str, rows: Mask, hint: str = "") -> PoseError:
    """A `PoseError` that counts the rows and names the first."""
    many = int(np.count_nonzero(rows))
    return PoseError(
        (Message(code, f"{text} ({many} of {rows.size}, first: {int(np.argmax(rows))})", None, hint),), rows
    )


ORDER = (
    *("NCF408", "NCF405", "NCF404", "NCF406", "NCF407"),
    *("NCF414", "NCF402", "NCF403", "NCF415", "NCF454", "NCF413", "NCF455", "NCF456", "NCF283", "NCF285", "NCF409"),
    "NCF410",
)
"""Codes in the order in which they are reported: those of limits, then those of a plan."""

NoteKey = tuple[int, str, str, str]
"""(position of block delete, code, text, hint)."""


@mutable
class Found:
    """The first few messages of one finding, and the number of all; of counted ones axes and largest figure."""

    kind: FindingKind
    shown: list[Message] = field(default_factory=list)
    count: int = 0
    axes: frozenset[str] = frozenset()
    most: float = 0.0

    def counted(self) -> Message:
        """All of them as one message, at the first of them."""
        axes, more = sorted(self.axes), self.count - 1
        words = {
            "cuts": f"this cut and {more} more begin" if more else "this cut begins",
            "axis": " and ".join(filter(None, (", ".join(axes[:-1]), axes[-1]))),
        }
        return replace(self.shown[0], text=self.shown[0].text.format(value=self.most, **words))


@mutable
class Notes:
    """The findings so far, by position of block delete, code, text and hint."""

    found: dict[NoteKey, Found] = field(default_factory=dict)

    def add(self, finding: Finding, program: Program, moves: Moves, own: Mask | None = None, position: int = 0) -> None:
        """Add a finding of a part, in a position of block delete; `own` (n,): the motions to include, None: all."""
        rows = np.arange(len(finding)) if own is None else np.flatnonzero(own[finding.moves])
        rows = rows[:1] if finding.kind is FindingKind.ONCE else rows
        shown = []
        counted = finding.kind is FindingKind.COUNTED
        for k in rows[: 1 if counted else MOST].tolist():
            place = program.place(int(moves.block[finding.moves[k]]))
            text = finding.text if counted else finding.sentence(k)
            shown.append(Message(finding.code, text, place, finding.hint))
        axes = frozenset("".join(finding.axes[k] for k in rows.tolist())) if counted else frozenset[str]()
        most = float(finding.values[rows].max(initial=0.0))
        key = position, finding.code, finding.text, finding.hint
        self._take(key, Found(finding.kind, shown, len(rows), axes, most))

    def take(self, other: Notes) -> None:
        """Add the findings of a later part."""
        for key, found in other.found.items():
            self._take(key, found)

    def _take(self, key: NoteKey, found: Found) -> None:
        note = self.found.setdefault(key, Found(found.kind))
        if note.kind is FindingKind.ONCE and note.count:
            return
        note.shown += found.shown[: max(MOST - note.count, 0)]
        note.count += found.count
        note.axes, note.most = note.axes | found.axes, max(note.most, found.most)

    def messages(self) -> tuple[Message, ...]:
        """The messages, by position of block delete and in `ORDER`, without duplicates."""
        messages: list[Message] = []
        for (_, code, *_), note in sorted(self.found.items(), key=lambda each: (each[0][0], ORDER.index(each[0][1]))):
            if note.kind is FindingKind.COUNTED:
                messages += [note.counted()] if note.count else []
                continue
            messages += note.shown
            if note.count > MOST:
                messages.append(Message(code, f"and {note.count - MOST} more motions of this kind"))
        return tuple(dict.fromkeys(messages))
