"""Software and set-up mistakes (catalogue rows 51 and 52): the machine is as it is, somebody told the computer
otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.random import Generator

from .chain import Joint, Machine
from .model import Model
from .motion import Array, turned

Control = Callable[[Array, Array], Array]
KINDS = ("table active", "wrong sign", "stale table", "rotary sign", "degree", "pivot", "inch")
NEEDS_ROTARY = ("rotary sign", "pivot")


@dataclass(frozen=True, slots=True)
class Mistake:
    """What is handed over instead of the truth, what the control adds to commands unasked, and columns in a wrong unit.

    `control(q, length)` gives the shift of the axis positions (n, n_axes); `factors` multiply columns of the file;
    `instrument` is the kind of data in which the mistake shows.
    """

    name: str
    kind: str
    axis: str
    machine: Machine
    model: Model
    control: Control | None = None
    factors: dict[str, float] = field(default_factory=dict)
    instrument: str = "tcp"


def draw(rng: Generator, kind: str, machine: Machine, model: Model) -> Mistake:
    """A specimen of that kind on a machine with a rich model (tables of the linear axes)."""
    return _DRAW[kind](rng, machine, model)


def correction(machine: Machine, model: Model, gain: float, shift: Array) -> Control:
    """A control that cancels the tip error of `model` with its linear axes, `gain` times, read `shift` beside the
    place.
    """

    def control(q: Array, length: Array) -> Array:
        error = model.displacement(machine, q + shift, length)
        columns = [i for i, joint in enumerate(machine.joints) if not joint.rotary]
        result = np.zeros_like(q)
        result[:, columns] = -gain * turned(machine.linear_steps(q, length), error)
        return result

    return control


def _active(rng: Generator, machine: Machine, model: Model) -> Mistake:
    """The control compensates already what the model predicts."""
    control = correction(machine, model, 1.0, np.zeros(len(machine.joints)))
    return Mistake("table active", "table active", "", machine, model, control)


def _sign(rng: Generator, machine: Machine, model: Model) -> Mistake:
    """The control's table doubles the error, or the model itself has the sign of a correction."""
    if rng.random() < 0.5:
        return Mistake("wrong sign", "wrong sign", "", machine, model.scaled(-1.0))
    control = correction(machine, model, -1.0, np.zeros(len(machine.joints)))
    return Mistake("wrong sign", "wrong sign", "", machine, model, control)


def _stale(rng: Generator, machine: Machine, model: Model) -> Mistake:
    """The table was made before the reference points were moved."""
    shift = np.zeros(len(machine.joints))
    for i, joint in enumerate(machine.joints):
        if not joint.rotary:
            shift[i] = rng.choice((-1, 1)) * rng.uniform(0.06, 0.12) * (joint.high - joint.low)
    return Mistake("stale table", "stale table", "", machine, model, correction(machine, model, 1.0, shift))


def _rotary_sign(rng: Generator, machine: Machine, model: Model) -> Mistake:
    """The file turns an axis the other way round."""
    joint = _rotary(rng, machine)
    x, y, z = joint.direction
    wrong = _exchanged(machine, replace(joint, direction=(-x, -y, -z)))
    kind = "probe" if rng.random() < 0.5 else "tcp"
    return Mistake(f"rotary sign {joint.name}", "rotary sign", joint.name, wrong, model, instrument=kind)


def _degree(rng: Generator, machine: Machine, model: Model) -> Mistake:
    """An angle of the model typed in degrees, or the rotary columns of the data in radians."""
    rotary = [joint.name for joint in machine.joints if joint.rotary]
    if rotary and rng.random() < 0.5:
        return Mistake("degree", "degree", "", machine, model, factors=dict.fromkeys(rotary, np.pi / 180))
    angles = [i for i, term in enumerate(model.terms) if term.located and term.component > 2]
    index = int(rng.choice(angles))
    term = model.terms[index]
    wrong = model.with_coefficient(index, 0, round(float(np.rad2deg(term.coefficients[0])), 7))
    return Mistake("degree", "degree", term.axis, machine, wrong)


def _pivot(rng: Generator, machine: Machine, model: Model) -> Mistake:
    """The point of a rotary axis was measured to the wrong face: some millimetres off."""
    joint = _rotary(rng, machine)
    line = np.asarray(joint.direction)
    off = rng.normal(size=3)
    off -= line * (line @ off)
    off *= rng.uniform(2, 15) / np.linalg.norm(off)
    x, y, z = (float(v) for v in np.round(np.asarray(joint.point) + off, 2))
    wrong = _exchanged(machine, replace(joint, point=(x, y, z)))
    return Mistake(f"pivot {joint.name}", "pivot", joint.name, wrong, model, instrument="probe")


def _inch(rng: Generator, machine: Machine, model: Model) -> Mistake:
    """The positions of the linear axes were exported in inches."""
    return Mistake("inch", "inch", "", machine, model, factors=dict.fromkeys("XYZ", 1 / 25.4))


def _rotary(rng: Generator, machine: Machine) -> Joint:
    joints = [joint for joint in machine.joints if joint.rotary]
    return joints[int(rng.integers(len(joints)))]


def _exchanged(machine: Machine, joint: Joint) -> Machine:
    return replace(machine, joints=tuple(joint if old.name == joint.name else old for old in machine.joints))


_DRAW = dict(zip(KINDS, (_active, _sign, _stale, _rotary_sign, _degree, _pivot, _inch), strict=True))
