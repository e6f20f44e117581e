"""Are the fitted constants such as machines have? The bounds of every row of the catalogue, and the signs that mean
something.

The bounds are wide: what a machine that still cuts parts may have, not what it should have. Beyond them a name is not
taken back, but it is said: a collision, a wrong unit, or another effect that this one only imitates.

Which target can carry an effect: the rewriting of programs (`fix`), and the controls' own tables (`export`).

By what the effect depends on; how well a table of a given machine does it, `ncfix export` measures. The classes are
those of ISO/TR 16907 as docs/controllers.md lists them.
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
"""kind -> (um, urad) that the error of the joint reaches at most where it was measured, on a machine of a metre."""
FIX = "fix"
POSITIONING = ("linuxcnc", "fanuc-pitch", "heidenhain", "siemens", "isg", "fanuc", "heidenhain-kinematics")
"""Tables of one axis over itself."""
ALONG = ("linuxcnc", "heidenhain", "siemens", "isg", "heidenhain-kinematics")
"""Those that hold play of a linear axis that changes along it; both Heidenhain controls with `backlash=on`."""
REVERSAL = (*ALONG, "fanuc", "fanuc-rotary")
"""Those that hold play of a linear axis that is the same everywhere."""
TURNED = ("linuxcnc", "heidenhain", "siemens", "heidenhain-kinematics")
"""Those that hold play of a rotary axis about itself."""
VOLUME = ("fanuc", "fanuc-rotary", "isg", "siemens", "heidenhain-kinematics")
"""Those of all linear axes."""
ACROSS = ("heidenhain", *VOLUME)
"""Those of one axis over another, too."""
TURNING = ("fanuc-rotary", "isg", "siemens", "heidenhain-kinematics")
"""Those over rotary axes."""


@frozen(slots=False)
class Plausibility:
    """What the fitted constants amount to.

    largest  the error of the joint, largest where it was measured: um, and urad
    bounds   the same, of the catalogue's row; None for a row of a plugin
    remarks  what is odd about size or sign, in words
    """

    largest: tuple[float, float]
    bounds: tuple[float, float] | None
    remarks: tuple[str, ...]

    @property
    def plausible(self) -> bool:
        """Whether nothing is odd."""
        return not self.remarks


def catalogue_row(candidate: Candidate) -> str:
    """The row of the catalogue, without the axis."""
    name = candidate.name
    if len(name) == 3 and name.startswith("E"):
        return "curve"
    if len(name) == 4 and name.startswith("E"):
        return "line"
    return name.rsplit(" ", 1)[0] if name.rsplit(" ", 1)[0] in BOUNDS else name


def plausibility(data: ResidualData, candidate: Candidate, effects: Sequence[Effect]) -> Plausibility | None:
    """The constants of one finding; None where nothing is added to the machine."""
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
    """Play that is negative: the control takes out more than there is."""
    if any(runs_ahead(axis, effects[0]) for axis in machine.axes):
        return ["negative lost motion: the control's own backlash compensation takes out more than there is"]
    return []


def carriers(machine: Machine, effects: Sequence[Effect]) -> tuple[str, ...]:
    """`fix` and the controls of `export` that can hold all of the effects, or none where none is added."""
    if not effects:
        return ()
    kept = [set(_tables(machine, effect)) for effect in effects]
    together = set.intersection(*kept)
    order = dict.fromkeys((*POSITIONING, *ACROSS, *TURNING))
    return (FIX, *(f"export {name}" for name in order if name in together))


def conditions(machine: Machine, effects: Sequence[Effect]) -> tuple[str, ...]:
    """What must be stated for a program because no control looks it up: temperatures, time, load."""
    signals = {part for effect in effects for name in (effect.signal, effect.times) if name for part in name.split(SUM)}
    return tuple(sorted(signals - set(machine.axis_names)))


def _of_play(effect: Effect, basis: Backlash, rotary: set[str], alone: bool) -> Sequence[str]:
    """The controls that hold play: of an axis along or about itself in their places for that, else in tables."""
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
