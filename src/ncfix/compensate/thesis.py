"""Ellingsdalen's compensation as it is printed, to reproduce its numbers: one pass, points only.

S. H. Ellingsdalen, "Improving the Accuracy of a Five-Axis Machine Tool by Laser Tracker Calibration" (NTNU, 2021),
sections 3.5 and 3.6 and listings 3.3 and 3.4. What differs from a sound correction, on purpose:

- errors are read at the nearest whole millimetre or degree (halves to even), their value at zero taken off;
- angles of linear axes do nothing, squareness of Y and Z with X as datum is all that is known of their location;
- errors of the rotary axes act in base axes about the base origin, in whatever frame they were identified;
- the listing reads the positioning error E_C. of a rotary axis from the file of E_B., and turns about Y the wrong way;
- the first point is never touched, arcs are not done, nothing is repeated and nothing rounded.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.findings import Array
from ncfix.compensate.kinematics import affine_tip, linear_columns, solve
from ncfix.compensate.rates import Path
from ncfix.compensate.steer import Correction
from ncfix.compensate.strategies import Strategy
from ncfix.diagnostics import UsageError
from ncfix.machine import Axis, Effect, Machine, State


class Thesis(Strategy):
    """The printed procedure, for linear axes on the tool side and rotary axes under the workpiece."""

    name = "thesis"
    leaves = (
        "Made to reproduce printed numbers, not to cut by: angles of linear axes, orientation, errors between points "
        "and whatever rounding to whole millimetres and degrees misses are left."
    )
    follows_path = False

    def solve(self, machine: Machine, q: Array, state: State, path: Path | None = None) -> Correction:
        """See `Strategy.solve`. Raises `UsageError` NCF412 for machines of another kind."""
        if any(axis.workpiece_side is not axis.rotary for axis in machine.axes):
            raise UsageError.of(
                "NCF412",
                "the thesis' procedure is for linear axes on the tool side and rotary axes under the workpiece",
                hint="`--strategy rotary-then-linear` is the same idea for any machine",
            )
        still = np.where(machine.rotary, 0.0, q)
        point = machine.tip(still, state.tool_length) + np.asarray(machine.workpiece_offset)
        rotary = rotary_shift([motion_errors(machine, axis, q) for axis in turning_axes(machine)], point)
        axes_from_base = affine_tip(machine, still[:1])[0]
        shifted = q.copy()
        shifted[:, linear_columns(machine)] += solve(axes_from_base, rotary)
        corrected = shifted.copy()
        corrected[:, linear_columns(machine)] -= solve(axes_from_base, linear_deviation(machine, shifted))
        corrected[:1] = q[:1]
        return Correction(corrected, np.isfinite(corrected.sum(axis=1)), np.zeros(len(q), dtype=bool))


def turning_axes(machine: Machine) -> list[Axis]:
    """The rotary axes from the foundation to the workpiece: B, then C."""
    return [axis for axis in reversed(machine.axes) if axis.rotary]


def motion_errors(machine: Machine, axis: Axis, q: Array) -> Array:
    """The six error motions of an axis at the nearest whole millimetre or degree, (n, 6) mm and rad; none at zero."""
    position = np.rint(q[:, machine.axis_names.index(axis.name)] / axis.unit)
    errors = np.zeros((len(q), 6))
    for effect in machine.effects:
        if effect.joint == axis.name and not effect.location:
            errors[:, effect.component] += _value(effect, position) - _value(effect, np.zeros(1))
    return errors


def linear_deviation(machine: Machine, q: Array) -> Array:
    """What the translations of the linear axes and the squareness of Y and Z do to the tip, (n, 3) mm, base axes."""
    linear = [axis for axis in machine.axes if not axis.rotary]
    total: Array = sum((motion_errors(machine, axis, q)[:, :3] for axis in linear), np.zeros((len(q), 3)))
    x_y, x_z, y_z = (squareness(machine, name) for name in ("EC0Y", "EB0Z", "EA0Z"))
    _, y, z = linear_columns(machine)
    total[:, 0] += -x_y * q[:, y] + x_z * q[:, z]
    total[:, 1] -= y_z * q[:, z]
    return total


def squareness(machine: Machine, name: str) -> float:
    """The location error of that name, rad; 0 if the machine has none."""
    return sum(sum(effect.coefficients) for effect in machine.effects if effect.name == name)


def rotary_shift(errors: list[Array], point: Array, as_printed: bool = True) -> Array:
    """What to add to X Y Z for the errors of the rotary axes: actual minus ideal point, (n, 3) mm.

    errors      (n, 6) of each rotary axis, from the foundation to the workpiece
    point       (n, 3) the ideal point in the base frame
    as_printed  with the two slips of listing 3.3 (E_C. read from E_B.'s file, the wrong way about Y)
    """
    actual = point
    for each in reversed(errors):
        actual = actual + each[:, :3]
    for each in reversed(errors):
        a, b, c = each[:, 3], each[:, 4], each[:, 5]
        actual = _about(actual, 2, b if as_printed else c)
        actual = _about(actual, 1, -b if as_printed else b)
        actual = _about(actual, 0, a)
    result: Array = actual - point
    return result


def _about(points: Array, axis: int, angle: Array) -> Array:
    """Points turned about a base axis, right-handed, (n, 3)."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turned = points.copy()
    turned[:, first] = np.cos(angle) * points[:, first] - np.sin(angle) * points[:, second]
    turned[:, second] = np.sin(angle) * points[:, first] + np.cos(angle) * points[:, second]
    return turned


def _value(effect: Effect, position: Array) -> Array:
    """An effect at axis positions in mm or degrees, (n,)."""
    value: Array = effect.basis.design((position - effect.center) / effect.scale) @ np.asarray(effect.coefficients)
    return value
