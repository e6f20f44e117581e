"""Plausibility of the size and sign of a finding, and the targets that can correct it.

The bounds of size are wide: a machine that still cuts parts may reach them. A finding beyond them is kept, with a
remark: a collision, a wrong unit, or another effect that this one only imitates.

The targets are the rewriting of programs (`fix`) and the controls' own tables (`export`). They follow from the inputs
of the effect and the classes of ISO/TR 16907 (docs/controllers.md); how well the tables of a given machine do it,
`ncfix export` measures.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ncfix.diagnosis.catalogue import Candidate
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import SPINDLE
from ncfix.machine.basis import Backlash
from ncfix.machine.effects import runs_ahead
from ncfix.machine.state import SUM
from ncfix.values import frozen

BOUNDS: dict[str, tuple[float, float]] = {
    "curve": (100.0, 100.0),
    "scale": (300.0, 0.0),
    "line": (500.0, 500.0),
    "pitch": (30.0, 0.0),
    "backlash": (100.0, 300.0),
    "lateral play": (30.0, 0.0),
    "angular play": (30.0, 100.0),
    "radial": (60.0, 0.0),
    "axial": (60.0, 0.0),
    "wobble": (0.0, 150.0),
    "encoder": (0.0, 300.0),
    "worm": (0.0, 150.0),
    "rotary seat": (60.0, 0.0),
    "bed sag": (200.0, 300.0),
    "ram droop": (200.0, 300.0),
    "column nod": (100.0, 200.0),
    "foundation tilt": (0.0, 100.0),
    "table stiffness": (0.0, 100.0),
    "unbalanced load": (0.0, 150.0),
    "gravity sag": (150.0, 300.0),
    "compliance": (0.0, 1000.0),
    "trunnion twist": (0.0, 300.0),
    "tool droop": (0.0, 150.0),
    "spindle growth": (200.0, 0.0),
    "drift": (200.0, 0.0),
    "ambient swing": (100.0, 0.0),
    "thermal scale": (150.0, 0.0),
    "thermal bend": (0.0, 150.0),
    "rotary centre drift": (150.0, 0.0),
    "slip": (1000.0, 0.0),
}
"""Kind of effect -> largest plausible error motion of the joint over the measured range, (um, urad), for a machine of
one metre. Zero: no bound."""
FIX = "fix"
POSITIONING = ("linuxcnc", "fanuc-pitch", "heidenhain", "siemens", "isg", "fanuc", "heidenhain-kinematics")
"""Exports that hold the positioning of an axis over its own position."""
ALONG = ("linuxcnc", "heidenhain", "siemens", "isg", "heidenhain-kinematics")
"""Exports that hold backlash of a linear axis that varies along it; both Heidenhain ones with `backlash=on`."""
REVERSAL = (*ALONG, "fanuc", "fanuc-rotary")
"""Exports that hold backlash of a linear axis that is the same everywhere."""
TURNED = ("linuxcnc", "heidenhain", "siemens", "heidenhain-kinematics")
"""Exports that hold backlash of a rotary axis about itself."""
VOLUME = ("fanuc", "fanuc-rotary", "isg", "siemens", "heidenhain-kinematics")
"""Exports that hold errors over the positions of all linear axes."""
ACROSS = ("heidenhain", *VOLUME)
"""Exports that hold a shift over the position of another axis."""
TURNING = ("fanuc-rotary", "isg", "siemens", "heidenhain-kinematics")
"""Exports that hold errors over the positions of rotary axes."""


@frozen(slots=False)
class Plausibility:
    """Plausibility of the fitted coefficients of a finding.

    largest  largest error motion of the joint over the measured range: (um, urad)
    bounds   plausible limits of `largest` by the catalogue; None for an effect of a plugin
    remarks  messages on an implausible size or sign
    """

    largest: tuple[float, float]
    bounds: tuple[float, float] | None
    remarks: tuple[str, ...]

    @property
    def plausible(self) -> bool:
        """Whether there are no remarks."""
        return not self.remarks


def catalogue_row(candidate: Candidate) -> str:
    """The key of a candidate in `BOUNDS`: its kind, without the axis."""
    name = candidate.name
    if len(name) == 3 and name.startswith("E"):
        return "curve"
    if len(name) == 4 and name.startswith("E"):
        return "line"
    return name.rsplit(" ", 1)[0] if name.rsplit(" ", 1)[0] in BOUNDS else name


def plausibility(data: ResidualData, candidate: Candidate, effects: Sequence[Effect]) -> Plausibility | None:
    """The plausibility of a finding; None if it adds no effects to the machine."""
    if not effects:
        return None
    machine = data.machine.replace(effects=tuple(effects))
    errors = np.concatenate([machine.joint_errors(each.q, each.state) for each in data.problem.observations])
    shifts, tilts = 1e3 * np.abs(errors[..., :3]).max(), 1e6 * np.abs(errors[..., 3:]).max()
    bounds = BOUNDS.get(catalogue_row(candidate))
    if bounds:
        bounds = data.large * bounds[0], data.large * bounds[1]
    largest = float(shifts), float(tilts)
    return Plausibility(largest, bounds, (*_size(largest, bounds), *_sign(machine, effects)))


def _size(largest: tuple[float, float], bounds: tuple[float, float] | None) -> list[str]:
    if bounds is None:
        return []
    named = zip(largest, bounds, ("um", "urad"), strict=True)
    return [f"{size:.0f} {unit} is more than {bound:g} {unit}" for size, bound, unit in named if 0 < bound < size]


def _sign(machine: Machine, effects: Sequence[Effect]) -> list[str]:
    """A remark if the backlash is negative: the control compensates more than there is."""
    if any(runs_ahead(axis, effects[0]) for axis in machine.axes):
        return ["negative lost motion: the control's own backlash compensation takes out more than there is"]
    return []


def carriers(machine: Machine, effects: Sequence[Effect]) -> tuple[str, ...]:
    """The targets that can correct all of the effects: `fix`, and exports; empty if there are no effects."""
    if not effects:
        return ()
    kept = [set(_tables(machine, effect)) for effect in effects]
    together = set.intersection(*kept)
    order = dict.fromkeys((*POSITIONING, *ACROSS, *TURNING))
    return (FIX, *(f"export {name}" for name in order if name in together))


def conditions(machine: Machine, effects: Sequence[Effect]) -> tuple[str, ...]:
    """Inputs of the effects that a user must state because no control knows them: temperatures, time, load."""
    signals = {part for effect in effects for name in (effect.signal, effect.times) if name for part in name.split(SUM)}
    return tuple(sorted(signals - set(machine.axis_names)))


def _of_play(effect: Effect, basis: Backlash, rotary: set[str], alone: bool) -> Sequence[str]:
    """The exports that hold a backlash effect; `alone`: it is a positioning error over its own axis only."""
    if not alone:
        return ("siemens",)
    if effect.joint in rotary:
        return TURNED
    return REVERSAL if basis.degree == (0,) else ALONG


def _tables(machine: Machine, effect: Effect) -> Sequence[str]:
    if conditions(machine, [effect]) or effect.joint == SPINDLE:
        return ()
    rotary = {axis.name for axis in machine.axes if axis.rotary}
    signals = {name for name in (effect.signal, effect.times, effect.joint) if name}
    alone = len(signals) == 1 and machine.is_positioning(effect.name)
    if isinstance(effect.basis, Backlash):
        return _of_play(effect, effect.basis, rotary, alone)
    if signals & rotary:
        return TURNING
    if alone:
        return POSITIONING
    return ACROSS if len(signals) == 1 and not effect.rotational else VOLUME
