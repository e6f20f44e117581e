"""What the numerical core finds wrong: coded, by motion, in bulk. The caller knows the program and adds the places."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnostics import Message, Place, RefusedError

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Index = NDArray[np.intp]

MOST = 20
"""So many messages are written out; the rest is counted."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One kind of trouble and the motions that have it.

    code    stable code, explained in `codes.py`
    moves   (k,) indices of the motions, ascending
    values  (k,) one figure per motion, in the unit that `text` names
    text    sentence with the fields `{value}`, `{axis}` and `{unit}`
    axes    (k,) axis letter per motion, or empty
    hint    what to do about it
    turns   (k,) whether that axis is rotary, and the value in degrees; or empty
    """

    code: str
    moves: Index
    values: Array
    text: str
    axes: tuple[str, ...] = ()
    hint: str = ""
    turns: tuple[bool, ...] = ()

    def __len__(self) -> int:
        return len(self.moves)

    def sentence(self, k: int) -> str:
        """What is the matter with the k-th motion."""
        axis = self.axes[k] if self.axes else ""
        unit = "degrees" if self.turns and self.turns[k] else "mm"
        return self.text.format(value=float(self.values[k]), axis=axis, unit=unit)

    def among(self, chosen: Sequence[bool]) -> Finding:
        """Some of the motions, (k,)."""
        rows = np.flatnonzero(np.array(chosen, dtype=np.bool_))
        axes = tuple(self.axes[row] for row in rows) if self.axes else ()
        turns = tuple(self.turns[row] for row in rows) if self.turns else ()
        return replace(self, moves=self.moves[rows], values=self.values[rows], axes=axes, turns=turns)

    def messages(self, place_of: Callable[[int], Place | None], most: int = MOST) -> tuple[Message, ...]:
        """One message per motion, at most `most`; the last one says how many more there are."""
        shown = [
            Message(self.code, self.sentence(k), place_of(int(self.moves[k])), self.hint)
            for k in range(min(most, len(self)))
        ]
        if len(self) > most:
            shown.append(Message(self.code, f"and {len(self) - most} more motions like these"))
        return tuple(shown)


@dataclass(eq=False)
class PoseError(RefusedError):
    """Poses that cannot be corrected; `rows` (n,) tells which of those given."""

    rows: Mask | None = None


def pose_error(code: str, text: str, rows: Mask, hint: str = "") -> PoseError:
    """A `PoseError` that counts the rows and names the first."""
    many = int(np.count_nonzero(rows))
    return PoseError(
        (Message(code, f"{text} ({many} of {rows.size}, first: {int(np.argmax(rows))})", None, hint),), rows
    )
