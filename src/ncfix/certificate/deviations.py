"""Deviations of the tip from the intended path along motions and their pieces."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ncfix.arrays import Array, Index, Mask
from ncfix.certificate.expected import SLACK, Expected, PoseColumns
from ncfix.certificate.holes import HoleCall
from ncfix.certificate.model import LEVER, Ways
from ncfix.certificate.pairing import LinePair
from ncfix.certificate.reading import Family
from ncfix.certificate.steps import AxisStep, Kind
from ncfix.certificate.text import Indices

MANY, FEW = 11, 3
"""Number of samples on a long, and on a short, motion or piece."""
ASIDE = math.radians(0.09)
"""Deviation, rad, of the tool from its plane by evenly turning axes, above which `fix` may leave a motion in one piece.
"""
HALF_TURN = 179.5
"""Turn, degrees, that a correction may change into half a turn or more."""
NO_ANSWER = "the machine model gives no result"
WIDER = 1.05
"""Factor of the tolerance above which a way is surely beyond it."""


class Moved(NamedTuple):
    """m motions of the original, in order, and the pieces that replace them.

    row, first, last  (m,) lines, as in `LinePair`
    ours              (m,) numbers of the steps of the original
    begin, stop       (m,) numbers of the first piece, and of that behind the last, in the steps of the correction
    """

    row: Indices
    first: Indices
    last: Indices
    ours: Indices
    begin: Indices
    stop: Indices

    def where(self, which: Mask | Indices) -> Moved:
        """The motions `which`."""
        return Moved(*(each[which] for each in self))

    @property
    def owner(self) -> Indices:
        """For each piece, the index of its motion."""
        return np.repeat(np.arange(len(self.row)), self.stop - self.begin)

    @property
    def pieces(self) -> Indices:
        """The numbers of the steps of all pieces, in order."""
        counts = self.stop - self.begin
        found: Indices = np.arange(int(counts.sum())) + np.repeat(self.begin - (np.cumsum(counts) - counts), counts)
        return found

    def pairs(self) -> Iterator[LinePair]:
        """The pairs of lines of the motions."""
        return map(LinePair, self.row.tolist(), self.first.tolist(), self.last.tolist())


class Deviations(Expected):
    """The deviations and allowances by which motions and their ways are judged."""

    def calls_otherwise(self, pair: LinePair, call: HoleCall) -> bool:
        """Whether the lines of a hole call its cycle not exactly once, or with a change besides its depth."""
        its = [self.calls_there[at] for at in range(pair.first, pair.last + 1) if at in self.calls_there]
        unit = float(self.ours.unit[self.ours.at[pair.row]])
        most = 2.1 * float(self.control_halves(unit).max())  # both numbers are rounded
        if self.first.family is Family.WORDS:
            most += self.tolerance  # the level R does not cut
        return len(its) != 1 or not call.differs_in_depth_only(its[0], most / unit)

    def gaps(self, meant: Array, done: Array, rows: Index, given: PoseColumns) -> Array:
        """(k,) distance of the tip from its intended place, mm; with play, on the better side of each axis."""
        assert self.model is not None
        tcp, length, direction = given[0][rows], given[1][rows], given[2][rows]
        sides = [direction]
        for column in self.machine.directed:
            if not direction[:, column].any():
                continue
            turned = np.where(np.arange(direction.shape[1]) == column, -1.0, 1.0)
            sides += [side * turned for side in sides]
        gap: Array = np.min([self.model.gaps(meant, done, tcp, length, side) for side in sides], axis=0)
        return gap

    def allowed(self, at: Indices) -> Array:
        """(m,) allowed distance of the tip from the intended ways of steps (m,), mm: tolerance plus rounding."""
        units = self.ours.unit[at]
        digits = np.empty(len(at))
        for unit in set(units.tolist()):
            digits[units == unit] = np.linalg.norm(self.control_halves(unit)[~self.machine.rotary])
        digits[self.ours.kind[at] == Kind.ARC] *= 3
        return WIDER * self.tolerance + digits + SLACK

    def shares(
        self,
        meant: Ways,
        done: Ways,
        owner: Index,
        inner: Index,
        given: PoseColumns,
    ) -> Array:
        """(k,) shares of the original motions at which pieces `inner` end: where the expected command is nearest."""
        assert self.model is not None
        rows, place = owner[inner], done.end[inner]
        tcp, length, direction = given[0][rows], given[1][rows], given[2][rows]
        share = np.clip(meant.share(rows, place, self.machine.rotary), 0.0, 1.0)
        weight = np.where(self.machine.rotary, LEVER**2, 1.0)
        turned = place if self.strategy == "full" else None
        for _ in range(3):
            here = meant.at(rows, share)
            expected = self.model.aimed(here, tcp, length, direction, turned)
            off = np.where(np.isfinite(expected), place - expected, 0.0)
            ahead = meant.at(rows, np.clip(share + 1e-4, 0, 1)) - meant.at(rows, np.clip(share - 1e-4, 0, 1))
            way = ahead / np.maximum(np.clip(share + 1e-4, 0, 1) - np.clip(share - 1e-4, 0, 1), 1e-9)[:, None]
            square = np.maximum(np.einsum("ij,ij,j->i", way, way, weight), 1e-12)
            share = np.clip(share + np.einsum("ij,ij,j->i", off, way, weight) / square, 0.0, 1.0)
        return share

    def unfollowed(self, step: AxisStep, pieces: Sequence[AxisStep]) -> str:
        """The reason why the pieces of a motion cannot be judged; "" if there is none."""
        for piece in pieces:
            if piece.why:
                return piece.why
            if any(map(math.isnan, piece.end)):
                return "the position of an axis is not known"
        if not self.sure[self.ours.at[step.row]]:
            return NO_ANSWER
        if self.machine.depends_on_direction and not self.sure_of_side(step):
            return "backlash: the side of an axis is not known to the second reader"
        return ""

    def aside(self, at: Indices) -> Array:
        """(m,) deviation, rad, of the tool, with evenly turning axes, from the plane in which it is to turn."""
        found, some = np.zeros(len(at)), np.flatnonzero(self.ours.by_vector[at])
        if some.size and self.model is not None:
            ways = Ways.of(self.model, self.ours, at[some])
            found[some] = self.model.strays(ways, np.nan_to_num(self.ours.length[at[some]]))
        return found

    def worst(self, off: Array, allowed: Array) -> tuple[str, str]:
        """The axis with the largest error relative to the allowance, and that error as text."""
        worst = int(np.argmax(off / allowed))
        amount = float(off[worst])
        size = f"{math.degrees(amount):.4f} degree" if self.machine.rotary[worst] else f"{1e3 * amount:.2f} um"
        return self.machine.axis_names[worst], size
