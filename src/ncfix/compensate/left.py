"""What stays undone because an axis must get no word: counted by axis, and told in plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate.plan.arrays import Array, Mask
from ncfix.control.moves import Moves
from ncfix.diagnostics import Message, Place
from ncfix.text.tree import Program

if TYPE_CHECKING:
    from ncfix.compensate.settle import Settled

FEW = 4
"""So many stretches of lines are named one by one."""
HINT = "name it in one of the first blocks, and again after a change of tool or offsets, or after machine coordinates"


@dataclass(frozen=True, slots=True)
class Left:
    """One axis that was left where it stands.

    motions    how many motions would have moved it
    cuts       how many of these cut
    stretches  their lines, from and to
    most       how far it is from where it should be, at their ends and along cuts, at most, mm or rad
    """

    axis: str
    rotary: bool
    motions: int
    cuts: int
    stretches: tuple[tuple[int, int], ...]
    most: float

    @property
    def first(self) -> int:
        """The first of these lines."""
        return self.stretches[0][0]

    @property
    def last(self) -> int:
        """The last of them."""
        return self.stretches[-1][1]

    def with_later(self, other: Left) -> Left:
        """This and what comes later in the program."""
        motions, cuts = self.motions + other.motions, self.cuts + other.cuts
        stretches, most = merged(self.stretches, other.stretches), max(self.most, other.most)
        return Left(self.axis, self.rotary, motions, cuts, stretches, most)

    def message(self, path: str) -> Message:
        """In words."""
        if self.motions == 1:
            many = f"this motion, which {'cuts' if self.cuts else 'cuts nothing'}"
        else:
            many = f"{self.motions} motions ({self._where()}), {self.cuts or 'none'} of which cut"
        far = f"{np.degrees(self.most):.4g} degrees" if self.rotary else f"{self.most * 1e3:.2f} um"
        text = (
            f"{self.axis} is left where it stands in {many}, up to {far} beside where it should be: "
            "the program has not said where it is, or the control offsets or rounds the contour there"
        )
        return Message("NCF439", text, Place(path, self.first), HINT if self.cuts else "")

    def _where(self) -> str:
        if len(self.stretches) > FEW:
            return f"between lines {self.first} and {self.last}"
        return "lines " + ", ".join(str(a) if a == b else f"{a} to {b}" for a, b in self.stretches)

    def as_dict(self) -> dict[str, object]:
        """Plain data, for `--json`."""
        most = {"max_deg": float(np.degrees(self.most))} if self.rotary else {"max_um": round(self.most * 1e3, 4)}
        lines = [list(stretch) for stretch in self.stretches]
        return {"axis": self.axis, "motions": self.motions, "cuts": self.cuts, "lines": lines, **most}


@dataclass(frozen=True, slots=True)
class Lacking:
    """Which axes of motions were left, (n, n_axes), and how far they are from where they should be, mm or rad."""

    axes: Mask
    off: Array


def left_by_motion(settled: Settled, steps: Array, own: Mask | None = None) -> Lacking | None:
    """The axes that were left, of motions `own` (n,) if given; `steps` (n_axes,) what the control resolves.

    None if there are none.
    """
    moves, known = settled.moves, settled.plan.known
    wordless = moves.wordless
    if known is None or not wordless.any():
        return None
    off = np.abs(known.end - moves.end - settled.shift)
    if known.beside is not None:
        off = np.maximum(off, known.beside)
    lacking = wordless & (off >= steps / 2) & ~settled.kept[:, None]
    if own is not None:
        lacking &= own[:, None]
    return Lacking(lacking, off)


def left_where_they_stand(program: Program, moves: Moves, left: Lacking | None) -> dict[str, Left]:
    """The axes that were left, by name."""
    if left is None:
        return {}
    found, lacking, off = {}, left.axes, left.off
    for column in np.flatnonzero(lacking.any(axis=0)).tolist():
        rows = np.flatnonzero(lacking[:, column])
        axis, turns, most = moves.axes[column], bool(moves.rotary[column]), float(off[rows, column].max())
        cuts, stretches = int(moves.cuts[rows].sum()), stretches_of(program, moves.block[rows])
        found[axis] = Left(axis, turns, len(rows), cuts, stretches, most)
    return in_order(found)


def stretches_of(program: Program, blocks: NDArray[np.int32]) -> tuple[tuple[int, int], ...]:
    """The lines of blocks, as stretches without gaps, from and to."""
    return in_stretches(np.unique(program.lines(blocks)))


def in_stretches(lines: NDArray[np.int64]) -> tuple[tuple[int, int], ...]:
    """Lines in ascending order, as stretches without gaps, from and to."""
    begins = np.flatnonzero(np.diff(lines, prepend=-1) > 1)
    ends = np.append(begins[1:], len(lines)) - 1
    return tuple(zip(lines[begins].tolist(), lines[ends].tolist(), strict=True))


def merged(before: tuple[tuple[int, int], ...], later: tuple[tuple[int, int], ...]) -> tuple[tuple[int, int], ...]:
    """Stretches of lines, and those that follow them."""
    if later[0][0] > before[-1][1] + 1:
        return (*before, *later)
    return (*before[:-1], (before[-1][0], later[0][1]), *later[1:])


def joined(before: Mapping[str, Left], later: Mapping[str, Left]) -> dict[str, Left]:
    """What was left in two parts of a program, one behind the other."""
    both = {axis: before[axis].with_later(later[axis]) for axis in before.keys() & later.keys()}
    return in_order({**before, **later, **both})


def either(found: Sequence[Mapping[str, Left]]) -> tuple[Left, ...]:
    """What is left in any of several ways in which a program may run: the most of each axis."""
    together = dict(found[0])
    for other in found[1:]:
        for axis, left in other.items():
            own = together.setdefault(axis, left)
            lines = sorted({line for each in (own, left) for a, b in each.stretches for line in range(a, b + 1)})
            together[axis] = replace(
                own,
                motions=max(own.motions, left.motions),
                cuts=max(own.cuts, left.cuts),
                stretches=in_stretches(np.array(lines)),
                most=max(own.most, left.most),
            )
    return tuple(in_order(together).values())


def in_order(found: Mapping[str, Left]) -> dict[str, Left]:
    """Those that are left in the earliest lines first."""
    return dict(sorted(found.items(), key=lambda item: (item[1].first, item[0])))
