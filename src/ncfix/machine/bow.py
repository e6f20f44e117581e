"""How far the error of the tool tip may bow on a straight motion, from above, by bounds on curves and their slopes.

Along a motion the tip's error is the sum over all joints of Q (t + r x a): t and r the joint's small motion, a the arm
from its reference point to the tip, Q the rotation from there to the workpiece. Of a product the second derivative is
bounded by those of its factors; so that of the error is, by the ways of the axes. A curve whose second derivative stays
below b leaves its chord by at most b / 8. Linear axes that do not move evenly are faster at times by as much as their
acceleration, which also bends the error by its slopes. Products of errors are parts in ten thousand of errors; `MORE`
has room for them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.machine.axis import Axis, Tool
from ncfix.machine.effect import Effect
from ncfix.machine.error_model import signals_of, slot_of
from ncfix.machine.se3 import Array

MORE = 1.1
"""For products of errors."""
TWICE = 2.0
"""A location error acts before the motion of its axis and, the other way, behind it."""


@dataclass(frozen=True, slots=True)
class Bow:
    """Bounds of all small motions of a machine together.

    shift, turn       what translations (mm) and rotations (rad) add up to
    slopes            (2, n_axes) of translations and rotations per mm or rad of each axis
    curvatures        (2, n_axes) per mm or rad squared
    reach             mm from any reference point to the tip with all axes at zero and no tool
    """

    shift: float
    turn: float
    slopes: Array
    curvatures: Array
    reach: float

    def arm(self, farthest: Array, tool_length: float, rotary: NDArray[np.bool_]) -> float:
        """How far the tip is at most from any reference point, mm; arguments as in `of`."""
        return self.reach + abs(tool_length) + float(farthest[~rotary].sum())

    def of(
        self,
        ways: Array,
        farthest: Array,
        tool_length: float,
        rotary: NDArray[np.bool_],
        acceleration: Array | None = None,
    ) -> tuple[Array, Array]:
        """How far the error may leave its chord, (k,) mm, and the angles turned by, (k,) rad.

        ways          (k, n_axes) of motions, not negative, mm and rad
        farthest      (n_axes,) from zero that they go
        tool_length   the largest, mm
        acceleration  (k,) mm per motion squared: of each linear axis on the way at most; all axes move evenly if not
                      given
        """
        arm: Array | float = self.arm(farthest, tool_length, rotary)
        bent: Array | float = 0.0
        if acceleration is not None:
            linear = ~rotary
            ways = ways + np.where(linear, acceleration[:, None], 0.0)
            arm = arm + linear.sum() * acceleration / 8
            bent = acceleration * ((self.slopes[0] + self.turn)[linear].sum() + arm * self.slopes[1, linear].sum())
        way, angle = ways[:, ~rotary].sum(axis=1), ways[:, rotary].sum(axis=1)
        shifting, turning = ways @ self.slopes.T[:, 0], ways @ self.slopes.T[:, 1]
        swing = way + arm * angle
        first = shifting + arm * turning + self.turn * swing
        second = (ways * ways) @ self.curvatures[0] + arm * ((ways * ways) @ self.curvatures[1])
        second += 2 * turning * swing + self.turn * (2 * way * angle + arm * angle * angle)
        whole = second + 2 * first * angle + (self.shift + arm * self.turn) * angle * angle
        bow: Array = MORE * (whole + bent) / 8
        return bow, angle


def bow_of(axes: tuple[Axis, ...], tool: Tool, effects: tuple[Effect, ...]) -> Bow | None:
    """The bounds of a machine; None if one of its effects does not say its own, or depends on more than one axis."""
    sizes, slopes, curvatures = np.zeros(2), np.zeros((2, len(axes))), np.zeros((2, len(axes)))
    for effect in effects:
        if not effect.active:
            continue
        signal, factor = signals_of(axes, effect)
        span = (0.0, 0.0) if signal is None else (signal.low, signal.high)
        ends = sorted((x - effect.center) / effect.scale for x in span) if signal is not None else span
        bounds = effect.basis.bounds(effect.coefficients, *ends)
        if bounds is None or factor is not None or (signal is not None and signal.constant_s):
            return None
        kind, double = int(effect.rotational), TWICE if effect.location else 1.0
        sizes[kind] += double * bounds[0]
        if signal is not None and signal.axis is not None:
            if effect.location:
                return None
            rate = 1 / abs(signal.scale * signal.unit)
            slopes[kind, signal.axis] += bounds[1] * rate
            curvatures[kind, signal.axis] += bounds[2] * rate * rate
    return Bow(float(sizes[0]), float(sizes[1]), slopes, curvatures, _reach(axes, tool, effects))


def _reach(axes: tuple[Axis, ...], tool: Tool, effects: tuple[Effect, ...]) -> float:
    """`Bow.reach`: from a reference point over the rotary axes between it and the tool, along the chain.

    However an axis turns what is behind it, it keeps its distance from that axis.
    """
    slots = {slot_of(axes, tool, effect) for effect in effects if effect.active}
    ways = [[slot.reference, *(axis.point for axis in axes[slot.joint :] if axis.rotary), tool.point] for slot in slots]
    return max((sum(float(np.linalg.norm(step)) for step in np.diff(way, axis=0)) for way in ways), default=0.0)
