"""Which target can carry an effect: the rewriting of programs (`fix`), and the controls' own tables (`export`).

By what the effect depends on; how well a table of a given machine does it, `ncfix export` measures. The classes are
those of ISO/TR 16907 as docs/controllers.md lists them.
"""

from __future__ import annotations

from collections.abc import Sequence

from ncfix.machine import Effect, Machine
from ncfix.machine.axes import SPINDLE
from ncfix.machine.basis import Backlash

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
    signals = {name for effect in effects for name in (effect.signal, effect.times) if name}
    return tuple(sorted(signals - set(machine.axis_names)))


def _of_play(effect: Effect, basis: Backlash, rotary: set[str], alone: bool) -> Sequence[str]:
    """Those whose export writes play: of an axis along or about itself in their places for that, else in tables."""
    if effect.joint in rotary:
        turned = len({name for name in (effect.signal, effect.times, effect.joint) if name}) == 1
        return TURNED if turned and effect.name[1] == effect.joint and not effect.location else ("siemens",)
    if not alone:
        return ("siemens",)
    return REVERSAL if basis.degree == (0,) else ALONG


def _tables(machine: Machine, effect: Effect) -> Sequence[str]:
    if conditions(machine, [effect]) or effect.joint == SPINDLE:
        return ()
    rotary = {axis.name for axis in machine.axes if axis.rotary}
    signals = {name for name in (effect.signal, effect.times, effect.joint) if name}
    alone = len(signals) == 1 and effect.name[1] == effect.joint and not effect.location
    if isinstance(effect.basis, Backlash):
        return _of_play(effect, effect.basis, rotary, alone)
    if signals & rotary:
        return TURNING
    if alone:
        return POSITIONING
    return ACROSS if len(signals) == 1 and not effect.rotational else VOLUME
