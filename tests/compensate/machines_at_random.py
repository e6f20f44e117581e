"""Machines of four topologies with random errors of every kind, by code."""

from __future__ import annotations

import numpy as np

from ncfix.machine import Axis, Effect, GaugeLine, Machine
from ncfix.machine.basis import Backlash, ConstantBasis, Fourier, Periodic, Polynomial
from ncfix.machine.piecewise import PiecewiseConstant, PiecewiseLinear, Spline

TOPOLOGIES = {
    "table-table": "w C B F X Y Z S t",
    "table-head": "w C X F Y Z B S t",
    "head-head": "w X F Y Z C B S t",
    "three-axis": "w Y X F Z S t",
}
SMOOTH = ("polynomial", "fourier", "periodic", "spline", "table", "constant")
STROKE = 250.0
SWING = np.pi * 2 / 3
DIRECTIONS = {"X": (1.0, 0, 0), "Y": (0, 1.0, 0), "Z": (0, 0, 1.0), "B": (0, 1.0, 0), "C": (0, 0, 1.0)}


def perfect(topology: str, swivel: tuple[float, float, float] | None = None) -> Machine:
    """A machine of that topology without errors: linear travel +-250 mm, swivel +-120 degrees, endless C."""
    left, right = topology.split("F")
    axes = [_axis(name, True, swivel) for name in left.split()[1:]]
    axes += [_axis(name, False, swivel) for name in right.split() if name not in "St"]
    return Machine("random", topology, tuple(axes), GaugeLine((0.0, 0.0, 1.0), (0.0, 0.0, 100.0)))


def _axis(name: str, workpiece_side: bool, swivel: tuple[float, float, float] | None) -> Axis:
    direction = np.array(swivel if name == "B" and swivel else DIRECTIONS[name], dtype=float)
    if workpiece_side and name in "XYZ":
        direction = -direction
    ranges = {"C": (-np.inf, np.inf), "B": (-SWING, SWING)}
    reach = ranges.get(name, (-STROKE, STROKE))
    point = (0.0, 0.0, 50.0) if name == "B" else (0.0, 0.0, 0.0)
    return Axis(name, name in "BC", workpiece_side, tuple(direction.tolist()), point, reach)


def random_machine(
    rng: np.random.Generator,
    topology: str,
    bases: tuple[str, ...] = SMOOTH,
    micrometres: float = 100.0,
    microradians: float = 200.0,
    backlash: float = 0.0,
    share: float = 1.0,
) -> Machine:
    """All error motions and location errors; together about `micrometres` and `microradians` at most on each joint.

    `share` is the part of the effects that is there; `backlash` (um, urad) is the play of each axis.
    """
    machine = perfect(topology, (0.0, -np.sqrt(0.5), np.sqrt(0.5)) if rng.random() < 0.3 else None)
    effects: list[Effect] = []
    for axis in machine.axes:
        for component in "XYZABC":
            if rng.random() > share:
                continue
            size = micrometres * 1e-3 if component in "XYZ" else microradians * 1e-6
            effects.append(_motion(rng, axis, component, size * rng.uniform(0.2, 0.6), str(rng.choice(bases))))
            effects.append(Effect(f"E{component}0{axis.name}", (size * rng.uniform(-0.3, 0.3),)))
        if backlash:
            size = backlash * (1e-6 if axis.rotary else 1e-3)
            effects.append(Effect(f"E{axis.name}{axis.name}", (size,), Backlash()))
    effects += [Effect("EX0S", (0.02,)), Effect("EA0S", (1e-4,)), Effect("EZS", (-0.01,), ConstantBasis())]
    return machine.replace(effects=tuple(effects))


def _motion(rng: np.random.Generator, axis: Axis, component: str, size: float, basis: str) -> Effect:
    """One error motion whose values stay within about `size`."""
    name = f"E{component}{axis.name}"
    unit = 180 / np.pi if axis.rotary else 1.0
    low, high = (-180.0, 180.0) if not np.isfinite(axis.range[0]) else (axis.range[0] * unit, axis.range[1] * unit)
    span = high - low
    if not np.isfinite(axis.range[0]) and basis in ("polynomial", "spline"):
        basis = "fourier"
    if basis == "polynomial":
        degree = int(rng.integers(2, 7))
        return Effect(name, _shares(rng, size, degree), Polynomial(tuple(range(1, degree + 1))), 0.0, span / 2)
    if basis == "fourier" and axis.rotary:
        return Effect(name, _shares(rng, size, 8), Fourier((1, 2, 3, 4)))
    if basis in ("periodic", "fourier"):
        return Effect(name, _shares(rng, size, 4), Periodic((1, 2), float(_period(rng, axis, span))))
    if basis == "spline":
        inner = np.linspace(low, high, 8)
        knots = np.concatenate([[low] * 3, inner, [high] * 3])
        return Effect(name, tuple(rng.uniform(-size, size, len(knots) - 4).tolist()), Spline(tuple(knots.tolist()), 3))
    if basis == "table":
        places = np.linspace(low, high, 12)
        values = rng.uniform(-size, size, 12)
        values[-1] = values[0]
        return Effect(name, tuple(values.tolist()), PiecewiseLinear(tuple(places.tolist())))
    if basis == "step":
        return Effect(name, tuple(rng.uniform(-size, size, 3).tolist()), PiecewiseConstant((low / 3, high / 3)))
    return Effect(name, (size,))


def _period(rng: np.random.Generator, axis: Axis, span: float) -> float:
    """A fraction of the span; of an endless axis one that fits the turn."""
    return span / int(rng.integers(2, 5)) if axis.rotary else rng.uniform(span / 4, span / 2)


def _shares(rng: np.random.Generator, size: float, count: int) -> tuple[float, ...]:
    values = rng.uniform(-1, 1, count)
    return tuple((values * size / np.abs(values).sum()).tolist())
