"""Two programs on one machine: does the second one cut what the first one means?

The paths are compared as curves in the workpiece, so this knows nothing of how the second program was made: from every
sample of the real path of the second program to the nearest point of the intended path of the first, and back, so that
nothing may be missing. Nearest is looked for near the same length of path, so that the next pass of a cut, a hair's
breadth beside it, is not taken for the one that is meant.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.curve import Curve, Samples
from ncfix.compensate.findings import Array, Index
from ncfix.compensate.flanks import Flank
from ncfix.compensate.intent import Intent
from ncfix.compensate.nearest import Nearest, Search
from ncfix.compensate.simulation import actual_tip
from ncfix.diagnostics import DifferenceError
from ncfix.machine import Machine, State
from ncfix.program.moves import Moves

UNLIKE = 0.02
"""Paths whose lengths differ by more than this share are not the same cut."""
NEAR = 1e-5
"""mm: nobody needs to know whether another point is nearer."""


@dataclass(frozen=True, slots=True)
class Gaps:
    """How far one path is from another, at k places in order.

    rows    (k,) the motion that is done there
    size    (k,) mm
    weight  (k,) mm of path that each place stands for
    """

    rows: Index
    size: Array
    weight: Array

    @property
    def max_mm(self) -> float:
        """The largest."""
        return float(self.size.max(initial=0.0))

    @property
    def rms_mm(self) -> float:
        """The root mean square along the path; over the places where the path has no length."""
        if not len(self.rows):
            return 0.0
        return float(np.sqrt(np.average(self.size**2, weights=self.weight if self.weight.sum() > 0 else None)))

    def rows_beyond(self, limit_mm: float) -> Index:
        """The motions that are farther away than a limit."""
        found: Index = np.unique(self.rows[self.size > limit_mm])
        return found

    @property
    def worst_row(self) -> int | None:
        """The motion that is farthest away; None without any."""
        return int(self.rows[np.argmax(self.size)]) if len(self.rows) else None


def compare(
    machine: Machine,
    original: Moves,
    other: Moves,
    state: State = State(),  # noqa: B008
    near: float = NEAR,
) -> tuple[Gaps, Gaps]:
    """How far `other` on this machine is from what `original` means: along `other`, and along `original`.

    The first has motions of `other` in `rows`, the second those of `original`. Of distances below `near`, mm, it is not
    found out whether another point is nearer. Raises `DifferenceError` NCF420 if the two are not the same cut at all.
    """
    meant, done = Intent(machine, original, state), Intent(machine, other, state)
    intended, actual = Curve.of(meant, meant.tip), as_made(done)
    check_alike((len(intended), intended.total), (len(actual), actual.total))
    flank = Flank.of(done, actual)
    return there(intended, actual, flank, near), back(intended, actual, flank, near)


def error_of(machine: Machine, moves: Moves, state: State = State(), near: float = NEAR) -> Gaps:  # noqa: B008
    """How far a program on this machine is from what it means, along what is made: in the measure of `compare`."""
    intent = Intent(machine, moves, state)
    actual = as_made(intent)
    return there(Curve.of(intent, intent.tip), actual, Flank.of(intent, actual), near)


def as_made(done: Intent) -> Curve:
    """The path of a program on the real machine."""
    return Curve.of(done, lambda rows, fraction: actual_tip(done, rows, fraction))


def there(intended: Curve, actual: Curve, flank: Flank | None, near: float) -> Gaps:
    """From what is made to what is meant."""
    samples = Samples.of(actual)
    found = _nearest(intended, actual, samples, near)
    gap = found.gap
    if flank is not None:
        gap = flank.there(Search(intended, near), samples, found)
    return Gaps(actual.rows[samples.piece], gap, samples.weight)


def back(intended: Curve, actual: Curve, flank: Flank | None, near: float) -> Gaps:
    """From what is meant to what is made."""
    samples = Samples.of(intended)
    found = _nearest(actual, intended, samples, near)
    gap = found.gap
    if flank is not None:
        gap = flank.back(near, samples.points, found)
    return Gaps(intended.rows[samples.piece], gap, samples.weight)


def _nearest(curve: Curve, other: Curve, samples: Samples, near: float) -> Nearest:
    """The points of a curve that are nearest to samples of another one."""
    if not len(curve):
        return Search(curve, near).all(np.empty((0, 3)), np.empty(0))
    return Search(curve, near).all(samples.points, other.way(samples.piece, samples.share))


def check_alike(intended: tuple[int, float], actual: tuple[int, float]) -> None:
    """Raise `DifferenceError` NCF420 if two paths are not the same cut: of so many parabolas, and so long, mm."""
    (many, meant), (others, made) = intended, actual
    if (many == 0) != (others == 0) or abs(meant - made) > UNLIKE * max(meant, made):
        text = f"the two programs do not cut the same: {meant:.3f} mm and {made:.3f} mm of path"
        raise DifferenceError.of("NCF420", text, hint="give the original program first, then the corrected one")
