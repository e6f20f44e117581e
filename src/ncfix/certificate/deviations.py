"""How far the tip is from the intended way where a motion, or a piece of one, has got to."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.certificate.expected import SLACK, Expected, PoseColumns
from ncfix.certificate.following import AxisStep, Given, Kind
from ncfix.certificate.model import LEVER, Array, Ways
from ncfix.certificate.pairing import LinePair
from ncfix.certificate.reading import Text
from ncfix.machine import Machine

MANY, FEW = 11, 3
"""At so many places on a motion, or a piece of one, its way is looked at: on long and on short ones."""
WIDER = 1.05
"""Of the tolerance: a way farther out is beyond it for sure."""


class MovedPair(NamedTuple):
    """A motion of the original, and the pieces in its place."""

    pair: LinePair
    step: AxisStep
    pieces: list[AxisStep]

    @property
    def begins(self) -> bool:
        """Whether it is known where it begins, in both programs."""
        return not any(map(math.isnan, (*self.step.start, *self.pieces[0].start)))


class Deviations(Expected):
    """What ways are judged by."""

    def __init__(self, first: Text, second: Text, machine: Machine, given: Given, tolerance_um: float) -> None:
        super().__init__(first, second, machine, given, tolerance_um)
        self._digits: dict[float, float] = {}

    def gaps(self, meant: Array, done: Array, rows: NDArray[np.intp], given: PoseColumns) -> Array:
        """How far the tip is from where it is meant to be, mm; with play, on the better side of each axis."""
        assert self.model is not None
        tcp, length, direction = given[0][rows], given[1][rows], given[2][rows]
        sides = [direction]
        for column in self.machine.directed:
            turned = np.where(np.arange(direction.shape[1]) == column, -1.0, 1.0)
            sides += [side * turned for side in sides]
        gap: Array = np.min([self.model.gaps(meant, done, tcp, length, side) for side in sides], axis=0)
        return gap

    def allowed(self, step: AxisStep) -> float:
        """How far the tip may be from the intended way, mm: the tolerance, and what digits add."""
        digits = self._digits.get(step.unit)
        if digits is None:
            halves = self.half_steps(step, True)[~self.machine.rotary]
            digits = self._digits[step.unit] = float(np.linalg.norm(halves))
        if step.kind == Kind.ARC:
            digits *= 3
        return WIDER * self.tolerance + digits + SLACK

    def shares(
        self,
        meant: Ways,
        done: Ways,
        owner: NDArray[np.intp],
        inner: NDArray[np.intp],
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
