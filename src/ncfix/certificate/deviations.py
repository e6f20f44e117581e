"""How far the tip is from the intended way where a motion, or a piece of one, has got to."""

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
"""At so many places on a motion, or a piece of one, its way is looked at: on long and on short ones."""
ASIDE = math.radians(0.09)
"""From here on even turns of axes lead the tool out of its plane, and `fix` may leave a motion in one piece."""
HALF_TURN = 179.5
"""Degrees; a correction may make half a turn of as much."""
WIDER = 1.05
"""Of the tolerance: a way farther out is beyond it for sure."""


class Moved(NamedTuple):
    """Motions of the original, and the pieces in their places: steps by their indices, pairs (m,) one behind the other.

    row, first, last  lines, as in `LinePair`
    ours              (m,) step of the original
    begin, stop       (m,) the first of its pieces, and behind the last, among the steps of the corrected program
    """

    row: Indices
    first: Indices
    last: Indices
    ours: Indices
    begin: Indices
    stop: Indices

    def where(self, which: Mask | Indices) -> Moved:
        """Some of them."""
        return Moved(*(each[which] for each in self))

    @property
    def owner(self) -> Indices:
        """Which motion each piece belongs to."""
        return np.repeat(np.arange(len(self.row)), self.stop - self.begin)

    @property
    def pieces(self) -> Indices:
        """All pieces, one behind the other."""
        counts = self.stop - self.begin
        found: Indices = np.arange(int(counts.sum())) + np.repeat(self.begin - (np.cumsum(counts) - counts), counts)
        return found

    def pairs(self) -> Iterator[LinePair]:
        """Their lines."""
        return map(LinePair, self.row.tolist(), self.first.tolist(), self.last.tolist())


class Deviations(Expected):
    """What ways are judged by."""

    def calls_otherwise(self, pair: LinePair, call: HoleCall) -> bool:
        """Whether the lines for a hole call its cycle in another way than to another depth, or not once."""
        its = [self.calls_there[at] for at in range(pair.first, pair.last + 1) if at in self.calls_there]
        unit = float(self.ours.unit[self.ours.at[pair.row]])
        most = 2.1 * float(self.control_halves(unit).max())  # both numbers are rounded
        if self.first.family is Family.WORDS:
            most += self.tolerance  # where a hole begins (R) cuts nothing
        return len(its) != 1 or not call.differs_in_depth_only(its[0], most / unit)

    def gaps(self, meant: Array, done: Array, rows: Index, given: PoseColumns) -> Array:
        """How far the tip is from where it is meant to be, mm; with play, on the better side of each axis."""
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
        """How far the tip may be from the intended ways of steps (m,), mm: the tolerance, and what digits add."""
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
        """Where on the original motions pieces end: there the expected command is nearest to the written one."""
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
        """Why what stands for a motion cannot be followed."""
        for piece in pieces:
            if piece.why:
                return piece.why
            if any(map(math.isnan, piece.end)):
                return "where an axis stands is not known"
        if not self.sure[self.ours.at[step.row]]:
            return "the machine model has no answer"
        if self.machine.depends_on_direction and not self.sure_of_side(step):
            return "play: the side of an axis is not known to this reader"
        return ""

    def aside(self, at: Indices) -> Array:
        """How far even turns of axes lead the tool out of the plane in which it is to turn, of steps (m,), rad."""
        found, some = np.zeros(len(at)), np.flatnonzero(self.ours.by_vector[at])
        if some.size and self.model is not None:
            ways = Ways.of(self.model, self.ours, at[some])
            found[some] = self.model.strays(ways, np.nan_to_num(self.ours.length[at[some]]))
        return found

    def worst(self, off: Array, allowed: Array) -> tuple[str, str]:
        """The axis that is farthest off, and by how much."""
        worst = int(np.argmax(off / allowed))
        amount = float(off[worst])
        size = f"{math.degrees(amount):.4f} degree" if self.machine.rotary[worst] else f"{1e3 * amount:.2f} um"
        return self.machine.axis_names[worst], size
