"""Plausibility of a well-formed machine: sizes against those of real machines, likely units, axes that span space.

The size that is *much* for an error component is `axes.large_size`, for a machine of one metre. Errors along an axis
grow with its travel; location errors grow with the size of the machine; and arms of rotary joints have ten times the
errors of machines with slides: tenths of a millimetre rather than hundredths. So `much` scales with travel, reach and
the kind of chain; it is never less than for a machine of one metre.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import ConfigError, Message, Place, RefusedError
from ncfix.machine.axes import SPINDLE, Axis, Effect, component_title, is_arm, large_size
from ncfix.machine.effects import functions_at, travel
from ncfix.machine.error_model import signals_of
from ncfix.machine.machine import Machine
from ncfix.machine.state import State
from ncfix.toml_text import decoded, key_lines, line_of, parsed, place_of
from ncfix.values import frozen

BEYOND = 10.0
"""Largest possible error, as a multiple of `much`."""
METRE = 1000.0
"""Size, mm, of the machine to which `large_size` refers."""
ARM = 10.0
"""Factor of the errors of an arm over those of a machine with slides."""
UNLIMITED_MM = 100.0
"""Assumed half travel of a linear axis without a range, mm."""
PLANE = 0.05
"""Least singular value of the directions of X Y Z; below it, they are within some 3 degrees of one plane or line."""
SAME, SAME_MM = 1e-6, 1e-3
"""Differences of direction, and of place, mm, below which two axis lines are one."""
LEAST_TRAVEL, MOST_TRAVEL = 1.0, 200_000.0
"""Smallest and largest possible travel, mm. A travel below is probably in metres, one above in um."""
PITCHES = (0.1, 2000.0)
"""Smallest and largest possible pitch of a screw or rack, mm."""
COARSEST = (0.1, 1.0)
"""Largest possible least increment, mm and degree."""
MOST_CORRECTION = (50.0, 10.0)
"""Largest possible `max_correction`, mm and degree; a larger value is in another unit."""
INCH = 25.4
SMALL_TRAVEL = 42.0
"""Travel, mm, up to which the travels of all linear axes may be in inches."""
NEARLY = 0.02
"""Largest distance of positions in another unit from the ends of the travel, as a share of it."""
CORNER = 1 / 300
"""Least share of the travel that a table covers; one that covers less is in another unit."""
TURN_RAD = 2 * np.pi + 0.01
UNITS = {
    False: (("um", 1e-3),),
    True: (("degrees", np.pi / 180), ("seconds of arc", np.pi / 648000), ("urad", 1e-6)),
}
"""Whether it is an angle -> units in which it may have been written, with their size in mm or rad."""
LEAST = 1e-3
"""Least share of `much` of a value that was meant: units that make less of a number are not suggested."""


@frozen
class Doubt:
    """An implausible property of a machine; `impossible`: no real machine has it."""

    message: Message
    impossible: bool


def doubts(machine: Machine, path: str, lines: bool = False) -> list[Doubt]:
    """All implausible properties of a machine: NCF320 to NCF323, NCF325.

    path   path of its file
    lines  read the file again for the lines of the messages
    """
    found = [*_sizes(machine), *_span(machine), *_travels(machine), *_settings(machine), *_positions(machine)]
    places = _places(path) if found and lines else lambda keys: Place(path)
    return [Doubt(Message(code, text, places(keys), hint), impossible) for code, text, hint, impossible, *keys in found]


def _places(path: str) -> Callable[[Sequence[str]], Place]:
    """A function from keys to their place in a machine file: (axis, X, range), or (effect, EXX, positions).

    For several effects of a name, the first is meant. A file that cannot be read again (standard input, a pipe) has
    places without lines.
    """
    try:
        text = decoded(Path(path).read_bytes(), path, "NCF301") if Path(path).is_file() else ""
        names = [str(table.get("name")) for table in parsed(text, path, "NCF301").get("effect", ())]
    except (ConfigError, OSError, AttributeError):
        text, names = "", []
    lines = key_lines(text)

    def place(keys: Sequence[str]) -> Place:
        first, name, *rest = *keys, "", ""
        if not text or not keys or (first == "effect" and name not in names):
            return Place(path)
        way = (first, names.index(name) if first == "effect" else name, *rest)
        return place_of(line_of(tuple(key for key in way if key != ""), lines), text, path)

    return place


def required(machine: Machine, path: str, accepted: str) -> list[Message]:
    """The messages about implausible but possible properties of a machine that is to be used.

    Raises `RefusedError` with all impossible ones; `accepted`: words that say how the user can use it all the same.
    """
    found = doubts(machine, path)
    if any(each.impossible for each in found):
        impossible = [each.message for each in doubts(machine, path, lines=True) if each.impossible]
        text = f"this machine is impossible and is not used; {accepted}"
        raise RefusedError((*impossible, Message("NCF324", text, Place(path))))
    return [each.message for each in found]


Fault = tuple[str, str, str, bool, *tuple[str, ...]]
"""(code, text, hint, whether it is impossible, keys of the machine file...)."""


# -- sizes -------------------------------------------------------------------------------------------------------------


def much(machine: Machine, name: str) -> float:
    """The size that is much for an error component on this machine, mm or rad; see the module's docstring."""
    location, axis = len(name) == 4, machine.axis(name[-1])
    size = float(large_size(name)) * (ARM if is_arm(machine.axes) else 1.0)
    if axis is not None and not axis.rotary and not location:
        return size * max(1.0, _travel_mm(axis) / METRE)
    return size * max(1.0, reach(machine) / METRE) if name[1] in "XYZ" else size


def times_a_machining_centre(machine: Machine) -> float:
    """Factor of usual errors over those of a machining centre of one metre: a power of 2."""
    size = (ARM if is_arm(machine.axes) else 1.0) * max(1.0, reach(machine) / METRE)
    return float(2.0 ** np.round(np.log2(size)))


def reach(machine: Machine) -> float:
    """The size of a machine, mm: the diagonal of its travels plus the way over its axis points."""
    travels = [_travel_mm(axis) for axis in machine.axes if not axis.rotary]
    points = [np.asarray(axis.point) for axis in machine.axes if axis.rotary] + [np.asarray(machine.tool.point)]
    way = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(points))
    return float(np.hypot.reduce(travels, initial=0.0)) + min(way, MOST_TRAVEL)


def _travel_mm(axis: Axis) -> float:
    low, high = axis.range
    return float(high - low) if np.isfinite(high - low) else 2 * UNLIMITED_MM


def functions(machine: Machine, effect: Effect) -> Array:
    """(k, n) the functions of an effect over the range of its signals: over the travels of axes, and from one scale
    below to one above the centre of other signals. Lags are taken as settled.
    """
    effect = replace(effect, time_constant_s=None)
    signals = [signal for signal in signals_of(machine.axes, effect) if signal is not None]
    axes = sorted({axis for signal in signals for axis in signal.axes})
    about = {each.name: (each.center - each.scale, each.center, each.center + each.scale) for each in signals}
    inputs = sorted({each.name for each in signals if not each.axes})
    places = [travel(machine, axis) for axis in axes]
    places = [each if np.isfinite(each).all() else np.array([-1, 0, 1]) * UNLIMITED_MM for each in places]
    places = [each[:: 6 if effect.times is not None or len(axes) > 1 else 1] for each in places]
    ways = np.array([-1.0, 1.0]) if effect.basis.needs_direction else np.zeros(1)
    mesh = [each.ravel() for each in np.meshgrid(*places, *(np.asarray(about[name]) for name in inputs), ways)]
    q = np.zeros((mesh[0].size, len(machine.axes)))
    for axis, each in zip(axes, mesh, strict=False):
        q[:, axis] = each
    values = dict(zip(inputs, mesh[len(axes) : -1], strict=True))
    return functions_at(machine, effect, q, State(values.get("tool_length", 0.0), mesh[-1][:, None], values), inputs)


def _sizes(machine: Machine) -> Iterator[Fault]:
    """Error components that are larger than `much`. Effects of one name that depend on one axis only are added up."""
    groups: dict[str, dict[object, list[Effect]]] = {}
    for index, effect in enumerate(machine.effects):
        signals = [signal for signal in signals_of(machine.axes, effect) if signal is not None]
        plain = len(signals) == 1 and not signals[0].inputs and not effect.basis.needs_direction
        same = groups.setdefault(effect.name, {})
        same.setdefault(signals[0].name if plain else (index,), []).append(effect)
    for name, same in groups.items():
        size, limit, angle = (
            max(_largest(machine, each) for each in same.values()),
            much(machine, name),
            name[1] in "ABC",
        )
        if size <= limit:
            continue
        hint, impossible, extent = "", size > BEYOND * limit, "more than"
        if impossible:
            meant = [f"{size:.4g} {unit}" for unit, factor in UNITS[angle] if LEAST * limit <= size * factor <= limit]
            hint = f"coefficients are in {'rad' if angle else 'mm'}; is {' or '.join(meant)} meant?"
            hint = hint if meant else "check the unit, `center`, `scale` and `range`"
            extent = f"{size / limit:.3g} times"
        title, most = component_title(name, machine.axis(name[-1])), sized(limit, angle)
        text = f"{name}, {title}: {sized(size, angle)} is {extent} {most}, which few machines exceed"
        yield "NCF320", text, hint, impossible, "effect", name, "coefficients"


def _largest(machine: Machine, effects: Sequence[Effect]) -> float:
    """The largest size of the sum of effects, mm or rad; of effects with different samples, the sum of the sizes."""
    values = [np.asarray(effect.coefficients) @ functions(machine, effect) for effect in effects]
    if len({each.shape for each in values}) > 1:
        values = [np.abs(each).max(keepdims=True) for each in values]
    return float(np.abs(sum(values)).max(initial=0.0))


def sized(value: float, angle: bool) -> str:
    """A length or an angle as text, with a suitable unit."""
    if angle:
        return f"{value:.4g} rad" if value >= 1e-2 else f"{1e6 * value:.4g} urad"
    return f"{value:.4g} mm" if value >= 1 else f"{1e3 * value:.4g} um"


# -- axes --------------------------------------------------------------------------------------------------------------


LEFT_HAND = "for an axis that moves the workpiece, `direction` is the motion of its body: X' has [-1, 0, 0]"


def _span(machine: Machine) -> Iterator[Fault]:
    """Axes that do not span space, or are left-handed. U V W and further axes may be parallel to X Y Z."""
    linear = [axis for axis in machine.axes if not axis.rotary and axis.name in "XYZ"]
    directions = np.array([axis.direction for axis in linear]).reshape(-1, 3)
    if len(linear) > 1 and np.linalg.svd(directions, compute_uv=False).min() < PLANE:
        parallel = (
            [a, b] for a, b in combinations(linear, 2) if np.linalg.norm(np.cross(a.direction, b.direction)) < PLANE
        )
        dependent = next(parallel, linear)
        names = " and ".join(axis.name for axis in dependent)
        text = (
            f"{names} do not span {'a plane' if len(dependent) == 2 else 'space'}: one axis only repeats the motion "
            "of the others"
        )
        yield "NCF321", text, "check `direction` of these axes", True, "axis", dependent[-1].name, "direction"
    elif len(linear) == 3:
        toward = {axis.name: np.array(axis.direction) * (-1 if axis.workpiece_side else 1) for axis in linear}
        if np.linalg.det([toward[name] for name in "XYZ"]) < 0:
            text = "X, Y and Z are left-handed, seen from the workpiece: one of them has the wrong sign"
            below = next((axis.name for axis in linear if axis.workpiece_side), linear[0].name)
            yield "NCF325", text, LEFT_HAND, False, "axis", below, "direction"
    for first, second in pairwise(machine.axes):
        if not (first.rotary and second.rotary and first.workpiece_side == second.workpiece_side):
            continue
        apart = np.cross(np.asarray(second.point) - np.asarray(first.point), first.direction)
        if np.linalg.norm(np.cross(first.direction, second.direction)) < SAME and np.linalg.norm(apart) < SAME_MM:
            text = f"{first.name} and {second.name} turn about the same line, with no axis between them"
            yield "NCF321", text, "check `direction` and `point` of both axes", True, "axis", second.name, "direction"


def _travels(machine: Machine) -> Iterator[Fault]:
    travels = [axis.range[1] - axis.range[0] for axis in machine.axes if axis.name in "XYZ" and not axis.rotary]
    if len(travels) == 3 and min(travels) >= LEAST_TRAVEL and max(travels) < SMALL_TRAVEL:
        text = f"the travels of all linear axes are at most {max(travels):g} mm"
        yield (
            "NCF322",
            text,
            f"`range` is in mm; is it given in inches? That would be {INCH * max(travels):g} mm",
            False,
        )
    for axis in machine.axes:
        low, high = (limit / axis.unit for limit in axis.range)
        range_of = ("axis", axis.name, "range")
        if axis.rotary:
            if np.isfinite(high - low) and _radians((low, high)):
                text = f"{axis.name}: the range {low:g} ... {high:g} looks like radians; `range` is in degrees"
                hint = f"is {np.degrees(low):.4g} ... {np.degrees(high):.4g} degrees meant?"
                yield "NCF322", text, hint, True, *range_of
        elif np.isfinite(high - low) and not LEAST_TRAVEL <= high - low <= MOST_TRAVEL:
            meant = "metres" if high - low < LEAST_TRAVEL else "um"
            text = f"{axis.name}: no axis has a travel of {high - low:g} mm"
            yield "NCF322", text, f"`range` is in mm; is it given in {meant}?", True, *range_of
        if axis.pitch is not None and not PITCHES[0] <= axis.pitch <= PITCHES[1]:
            text = f"{axis.name}: no screw or rack has a pitch of {axis.pitch:g} mm"
            yield "NCF322", text, "`pitch` is in mm per turn", True, "axis", axis.name, "pitch"
        if np.abs(axis.point).max() > MOST_TRAVEL:
            text = f"{axis.name}: its point is {np.abs(axis.point).max():g} mm from the origin"
            yield "NCF322", text, "`point` is in mm", True, "axis", axis.name, "point"


def _inches(places: Array, low: float, high: float) -> str:
    """The question to the user if positions or the travel seem to be in inches, one of the two; else ""."""
    ends, close = places[[0, -1]], NEARLY * (high - low)
    if np.abs(INCH * ends - (low, high)).max() < close:
        return "are the positions in inches? All lengths are in mm"
    far = np.abs(ends - INCH * np.array([low, high])).max() >= close
    return "" if far else "is the range in inches? All lengths are in mm"


def _radians(limits: tuple[float, float]) -> bool:
    """Whether the ends of a range look like radians: not round as written, but multiples of 5 degrees if converted."""
    parts = np.array([limit for limit in limits if limit])
    uneven = np.abs(parts - np.round(parts, 1)) > 1e-6
    steps = np.degrees(parts) / 5
    return bool(np.abs(parts).max(initial=0.0) < TURN_RAD and (uneven & (np.abs(steps - np.round(steps)) < 0.02)).all())


def _settings(machine: Machine) -> Iterator[Fault]:
    """Impossible settings: least increment, largest correction, offsets."""
    for key, values, limits in (
        ("least_increment", machine.least_increment, COARSEST),
        ("max_correction", machine.max_correction, MOST_CORRECTION),
    ):
        for value, limit, unit in zip((values[0], np.degrees(values[1])), limits, ("mm", "degree"), strict=True):
            if value > limit:
                text = f"{key}: {value:.4g} {unit} is larger than on any machine"
                yield "NCF322", text, "the values are in mm and degrees: 0.001 is one micrometre", True, key
    for name, place in ("workpiece_offset", machine.workpiece_offset), ("tool.point", machine.tool.point):
        if np.abs(place).max() > MOST_TRAVEL:
            text = f"{name}: {np.abs(place).max():g} mm is beyond the reach of any machine"
            yield "NCF322", text, "it is in mm", True, *name.split(".")


# -- positions of tables and curves ------------------------------------------------------------------------------------


def _positions(machine: Machine) -> Iterator[Fault]:
    """Positions of tables and knots that are in another unit than the axis, or outside its range."""
    for effect in machine.effects:
        axis = machine.axis(effect.input or effect.joint)
        positions = np.array(sorted({*getattr(effect.basis, "positions", ()), *getattr(effect.basis, "knots", ())}))
        if axis is None or effect.joint == SPINDLE or len(positions) < 3:
            continue
        places = effect.center + effect.scale * positions
        low, high = (limit / axis.unit for limit in axis.range)
        if axis.endless:
            low, high = 0.0, 360.0
        if not np.isfinite(high - low):
            continue
        keys = ("effect", effect.name, "positions" if hasattr(effect.basis, "positions") else "knots")
        shown = f"{effect.name}: its positions, {places[0]:g} ... {places[-1]:g},"
        if (places[-1] <= low and not axis.endless) or (places[0] >= high and not axis.endless):
            yield "NCF323", f"{shown} are outside the range of {axis.name}, {low:g} ... {high:g}", "", True, *keys
        elif axis.rotary and high - low > 45 and np.abs(places).max() <= TURN_RAD and _radians((places[0], places[-1])):
            yield "NCF323", f"{shown} look like radians; positions of {axis.name} are in degrees", "", True, *keys
        elif not axis.rotary and (whose := _inches(places, low, high)):
            yield "NCF323", f"{shown} beside the range of {axis.name}, {low:g} ... {high:g}", whose, True, *keys
        elif np.ptp(places) < CORNER * (high - low):
            text = f"{shown} cover almost nothing of the range of {axis.name}, {low:g} ... {high:g}"
            yield "NCF323", text, f"positions are in {'degrees' if axis.rotary else 'mm'}", True, *keys
