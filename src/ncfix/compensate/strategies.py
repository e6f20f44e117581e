"""Strategies: which command makes the erroneous machine do what the program meant, and what each of them leaves.

All of them take axis positions and give corrected axis positions, many poses at a time, by the exact forward model of
the machine. A strategy is stateless; `solve` tells for each pose how it went, `correct` raises where it did not.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from ncfix.compensate.findings import Array, pose_error
from ncfix.compensate.kinematics import affine_tip, linear_columns, regular, solve
from ncfix.compensate.rates import Path
from ncfix.compensate.steer import Correction, moved, steered
from ncfix.diagnostics import UsageError
from ncfix.machine import Machine, State


class Strategy(ABC):
    """A way to correct poses.

    name                  as in `--strategy`
    leaves                one sentence: what error remains
    corrects_orientation  the rotary axes are changed too
    follows_path          motions may be split to keep the path between their ends
    """

    name: ClassVar[str]
    leaves: ClassVar[str]
    corrects_orientation: ClassVar[bool] = False
    follows_path: ClassVar[bool] = True

    @abstractmethod
    def solve(self, machine: Machine, q: Array, state: State, path: Path | None = None) -> Correction:
        """Corrected axis positions for poses q (n, n_axes) [mm, rad] that were meant for a perfect machine.

        `path` tells how the poses lie along the path, for strategies with limits on rates. The state broadcasts.
        """

    def correct(self, machine: Machine, q: Array, state: State) -> Array:
        """Corrected axis positions (n, n_axes) such that the erroneous machine does what a perfect one does at q.

        Raises `PoseError` NCF403 if a pose cannot be corrected, `RefusedError` NCF401 if the machine cannot be.
        """
        correction = self.solve(machine, q, state)
        if not correction.converged.all():
            text = f"no command found that brings the tool tip where it should be (strategy {self.name})"
            raise pose_error("NCF403", text, ~correction.converged, "the error model may have a jump there")
        return correction.q


class Position(Strategy):
    """The tool tip exactly, by Newton's method on the whole model; rotary axes keep their values."""

    name = "position"
    leaves = "The orientation of the tool is left as the machine makes it; rotary axes keep their values."

    def solve(self, machine: Machine, q: Array, state: State, path: Path | None = None) -> Correction:
        """See `Strategy.solve`."""
        return _position(machine, q, state)


class RotaryThenLinear(Strategy):
    """Ellingsdalen's order: the error of the rotary axes first, then the linear axes' error where that leads.

    S. H. Ellingsdalen (NTNU, 2021), sections 3.5 and 3.6, with its signs put right. Pass 1: X Y Z are moved so that a
    machine with the errors of its rotary axes only brings the tip to the intended point; the errors of all other
    joints are read there and taken off. Later passes take off what the whole machine still leaves, until that is below
    1 nm: the linear errors are then those at the commanded coordinates, and products of rotary and linear errors are
    in. `passes = 1` stops after the first. Where later passes follow it does not matter how the first one began, so
    they begin at the program's position. Works on any chain: it does not matter which side a rotary axis is on.
    """

    name = "rotary-then-linear"
    leaves = "The orientation of the tool is left as the machine makes it; rotary axes keep their values."

    def __init__(self, passes: int | None = None) -> None:
        self.passes = passes

    def solve(self, machine: Machine, q: Array, state: State, path: Path | None = None) -> Correction:
        """See `Strategy.solve`."""
        if machine.is_perfect:
            return untouched(q)
        if self.passes != 1:
            return _position(machine, q, state)
        columns = linear_columns(machine)
        turning, rest = parted(machine)
        target = machine.tip(q, state.tool_length)
        maps, fine = regular(affine_tip(machine, q, state.tool_length)[0])
        shift = -solve(maps, turning.actual_tip(q, state) - target)
        shifted = moved(q, columns, shift)
        nominal = target + np.einsum("...ij,...j->...i", maps, shift)
        first = moved(shifted, columns, -solve(maps, rest.actual_tip(shifted, state) - nominal))
        return Correction(first, np.isfinite(first.sum(axis=1)) & fine, np.zeros(len(q), dtype=bool))


def parted(machine: Machine) -> tuple[Machine, Machine]:
    """The machine with the errors of its rotary axes only, and with all others (linear axes and spindle)."""
    rotary = {axis.name for axis in machine.axes if axis.rotary}
    turning = tuple(effect for effect in machine.effects if effect.joint in rotary)
    rest = tuple(effect for effect in machine.effects if effect.joint not in rotary)
    return machine.replace(effects=turning), machine.replace(effects=rest)


def _position(machine: Machine, q: Array, state: State) -> Correction:
    if machine.is_perfect:
        return untouched(q)
    return steered(machine, q, None, state)


def untouched(q: Array) -> Correction:
    """Nothing to correct: exactly the poses as they are."""
    return Correction(q.copy(), np.isfinite(q.sum(axis=1)), np.ones(len(q), dtype=bool))


def strategies() -> dict[str, Strategy]:
    """All strategies by name, in the order in which the command line lists them."""
    from ncfix.compensate.orientation import Full
    from ncfix.compensate.thesis import Thesis

    found: tuple[Strategy, ...] = (RotaryThenLinear(), Full(), Position(), Thesis())
    return {strategy.name: strategy for strategy in found}


def get_strategy(name: str) -> Strategy:
    """The strategy of that name. Raises `UsageError` NCF411."""
    found = strategies()
    if name not in found:
        raise UsageError.of("NCF411", f"there is no strategy {name!r}", hint=f"one of {', '.join(found)}")
    return found[name]
