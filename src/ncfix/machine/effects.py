"""Physical effects by name, and effects in human terms: extent over the travel, curves, units, titles.

`spindle-growth`, `backlash-X`, ... stand for one or more components with the basis and the input that the physics
requires, with coefficients zero until they are estimated. `calibrate --effects` and the selection of effects accept
these names as well as those of ISO 230-1. Dead weight acts on an axis by the positions of axes that it carries, not of
those that carry it (Soons 1993, section 2.5, rule 1).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import combinations
from math import nan
from typing import Any, Protocol

import numpy as np

from ncfix.arrays import Array
from ncfix.machine.axes import SPINDLE, Axis, Effect, component_title, is_arm
from ncfix.machine.basis import SMOOTH, Backlash, Basis, ConstantBasis, Fourier, Periodic, Polynomial
from ncfix.machine.error_model import dependence_of, signals_of
from ncfix.machine.machine import Machine
from ncfix.machine.piecewise import PIECEWISE
from ncfix.machine.state import SUM, State, flatten
from ncfix.plugins import called, handed, registry
from ncfix.values import frozen

WARM = 20.0
"""Temperature, degrees C, at which thermal effects are zero."""
HOUR = 3600.0
LEVER = 100.0
"""Lever arm, mm, by which a large length is converted into a large angle."""
STATES_S = (900.0, 7200.0)
"""Start values of the time constants of thermal states, s."""
LINEAR = Polynomial(degree=(1,))
NO_TIMES: Mapping[str, Any] = {"times": None, "times_center": None, "times_scale": None}


class PluginEffect(Protocol):
    """The object that a plugin registers with `register_effects`: name, title, and effects with zero coefficients."""

    name: str
    title: str

    def effects(self, machine: Machine) -> Sequence[Effect]:
        """The components of the effect on this machine; none if the machine cannot have it."""


@frozen
class PhysicalEffect:
    """A physical effect of one machine.

    effects      its components
    largest      size over the travel that would be large, mm or rad; NaN if not known
    instruments  kinds of measurement in which it is visible
    needs        state columns that a measurement must have for it
    """

    name: str
    title: str
    effects: tuple[Effect, ...]
    largest: float
    instruments: tuple[str, ...]
    needs: tuple[str, ...] = ()


SEEN = ("tcp", "tcp6", "probe", "length")


def library(machine: Machine) -> dict[str, PhysicalEffect]:
    """Name -> physical effect, for all that this machine can have, including those of plugins."""
    found = [each for axis in machine.axes for each in _of_axis(axis)]
    found += [each for pair in _carried(machine) for each in _dead_weight(*pair)]
    found += [each for axis in machine.axes for each in _of_joint(machine, axis)]
    known = {each.name: each for each in (*found, *_of_spindle(machine))}
    for name, plugin in registry("effects").items():
        if hasattr(plugin, "effects"):
            brought = called("effects", name, plugin.effects, machine, gives=Iterable)
            effects = tuple(handed("effects", name, each, Effect) for each in brought)
            if effects and name not in known:
                needs = tuple(getattr(plugin, "needs", ()))
                known[name] = PhysicalEffect(name, plugin.title, effects, nan, (), needs)
    return known


@lru_cache(maxsize=1)
def kinds() -> dict[str, type[Basis]]:
    """Name -> basis, for the built-in ones and those of plugins."""
    return registry("bases", {basis.name: basis for basis in (*SMOOTH, *PIECEWISE)})


def _of_axis(axis: Axis) -> Iterator[PhysicalEffect]:
    component = _along(axis)
    if component is None:
        return
    name, q = f"E{component}{axis.name}", axis.name
    center, scale = _span(axis)
    lever = 1 / LEVER if axis.rotary else 1.0
    for kind, degree, largest, title in (
        ("backlash", (0,), 0.01, "when it reverses"),
        ("worn", (0, 1, 2), 0.01, "that differs along it"),
        ("wind-up", (1,), 0.005, "that grows along its screw"),
    ):
        play = Effect(name, (0.0,) * len(degree), Backlash(degree), *((center, scale) if any(degree) else ()))
        sides = (f"dir_{q}",)
        yield PhysicalEffect(f"{kind}-{q}", f"play of {q} {title}", (play,), largest * lever, (*SEEN, "axis"), sides)
    if axis.pitch is not None:
        screw = Effect(name, (0.0,) * 4, Periodic(order=(1, 2), period=axis.pitch))
        title = f"screw of {q}, once and twice a turn"
        yield PhysicalEffect(f"screw-{q}", title, (screw,), 0.003 * lever, (*SEEN, "axis"))
    if axis.rotary:
        return
    sensor = f"temp_{q.lower()}"
    warm = Effect(name, (0.0,), LINEAR, center, scale, times=sensor, times_center=WARM, times_scale=1.0)
    yield PhysicalEffect(f"expansion-{q}", f"scale of {q} that grows with {sensor}", (warm,), 0.02, SEEN, (sensor,))
    if axis.workpiece_side:  # linear in the load and along the axis (Soons, section 2.6)
        for kind, load, what in (
            ("load", "load_kg", "the workpiece"),
            ("moment", "load_kgm", "the workpiece's moment, mass times height"),
        ):
            by_load = Effect(
                "", (0.0,) * 2, Polynomial((0, 1)), center, scale, times=load, times_center=0, times_scale=1
            )
            tilts = tuple(replace(by_load, name=f"E{turn}{q}") for turn in "ABC")
            yield PhysicalEffect(f"{kind}-{q}", f"guide of {q} that tilts under {what}", tilts, 1e-4, SEEN, (load,))


def _dead_weight(own: Axis, carried: Axis) -> Iterator[PhysicalEffect]:
    """Tilts of axis `own` by the weight of axis `carried`: f(own) times the position of `carried`.

    Terms of one of the two axes alone are not included.
    """
    center, scale = _span(own)
    middle, half = _span(carried)
    basis = Polynomial(degree=(1, 2))
    for turn, about in zip("ABC", "XYZ", strict=True):
        component = f"E{turn}{own.name}"
        bent = Effect(
            component, (0.0,) * 2, basis, center, scale, times=carried.name, times_center=middle, times_scale=half
        )
        title = f"tilt of {own.name} about {about} by the weight of {carried.name}"
        yield PhysicalEffect(f"weight-{component}-{carried.name}", title, (bent,), 5e-5, SEEN)


def _of_spindle(machine: Machine) -> Iterator[PhysicalEffect]:
    along = "XYZ"[int(np.abs(np.asarray(machine.tool.direction)).argmax())]
    warm, late, seen = "temp_spindle", 1800.0, SEEN[:3]
    grown = Effect(f"E{along}{SPINDLE}", (0.0,), LINEAR, center=WARM, input=warm)
    yield PhysicalEffect("spindle-growth", f"spindle that grows with {warm}", (grown,), 0.05, seen, (warm,))
    lagged = replace(grown, time_constant_s=late)
    title = f"spindle that grows after {warm}, time constant {late:g} s"
    yield PhysicalEffect("spindle-growth-late", title, (lagged,), 0.05, seen, (warm, "time_s"))
    hours = " and ".join(f"{seconds / HOUR:g} h" for seconds in STATES_S)
    for axis in "XYZ":
        moved = Effect(f"E{axis}{SPINDLE}", (0.0,), LINEAR, scale=HOUR, input="time_s")
        title = f"structure that drifts in {axis}, per hour"
        yield PhysicalEffect(f"drift-{axis}", title, (moved,), 0.03, seen, ("time_s",))
        heated = Effect(moved.name, (0.0,), LINEAR, center=WARM, input="temp_structure")
        states = tuple(replace(heated, time_constant_s=constant) for constant in STATES_S)
        title = f"structure that moves in {axis} after temp_structure, two thermal states, {hours}"
        yield PhysicalEffect(f"warming-{axis}", title, states, 0.03, seen, ("temp_structure", "time_s"))


def _of_joint(machine: Machine, axis: Axis) -> Iterator[PhysicalEffect]:
    """The yielding of a joint's gear under the weight of an arm: proportional to sine and cosine of the links' lean."""
    component, signals = _along(axis), leaning(machine.axes, axis)
    if component is None or not signals:
        return
    effects = tuple(yielding(f"E{component}{axis.name}", axis, signal) for signal in signals)
    title = f"joint {axis.name} that yields under the weight of what it carries"
    yield PhysicalEffect(f"compliance-{axis.name}", title, effects, 2e-3, ("tcp", "tcp6", "points", "length"))


def yielding(name: str, axis: Axis, signal: str) -> Effect:
    """The angle of a joint by the weight of one link, zero until it is estimated."""
    return Effect(name, (0.0, 0.0), Fourier(order=(1,)), input=None if signal == axis.name else signal)


def leaning(axes: tuple[Axis, ...], axis: Axis) -> tuple[str, ...]:
    """The signals of the lean of the links whose weight a joint of an arm bears: sums of the angles of consecutive
    joints with parallel axes (B, B+C). Empty for other joints, whose rotation changes no lean.
    """
    if not is_arm(axes) or not axis.rotary:
        return ()
    branch = [each for each in axes if each.rotary and each.workpiece_side == axis.workpiece_side]
    outwards = branch[::-1] if axis.workpiece_side else branch
    runs: list[list[Axis]] = [[]]
    for each in outwards:
        if runs[-1] and np.asarray(runs[-1][0].direction) @ np.asarray(each.direction) < 1 - 1e-9:
            runs.append([])
        runs[-1].append(each)
    run = next(each for each in runs if axis in each)
    sums = tuple(SUM.join(each.name for each in run[: k + 1]) for k in range(len(run)))
    return sums[run.index(axis) :] if len(run) > 1 else ()


def _carried(machine: Machine) -> Iterator[tuple[Axis, Axis]]:
    """Pairs of linear axes of one branch: an axis, and one that it carries."""
    for held in (True, False):
        branch = [axis for axis in machine.axes if axis.workpiece_side == held and not axis.rotary]
        yield from combinations(branch[::-1] if held else branch, 2)


def runs_ahead(axis: Axis, effect: Effect) -> bool:
    """Whether an effect is a play with the wrong sign: the body would be ahead of its axis in both directions.

    Lost motion leaves the body behind, on either side of the chain.
    """
    component = _along(axis)
    if component is None or effect.name != f"E{component}{axis.name}" or not isinstance(effect.basis, Backlash):
        return False
    play = sum(size for size, power in zip(effect.coefficients, effect.basis.degree, strict=True) if power == 0)
    sense = np.asarray(axis.error_axes)["XYZABC".index(component) % 3] @ np.asarray(axis.direction)
    return bool(play * sense > 0)


def _along(axis: Axis) -> str | None:
    """The letter of the component along or about the axis itself; None if the axis is along none of its error axes."""
    shares = np.abs(np.asarray(axis.error_axes) @ np.asarray(axis.direction))
    index = int(shares.argmax())
    return ("ABC" if axis.rotary else "XYZ")[index] if shares[index] > 1 - 1e-9 else None


def _span(axis: Axis) -> tuple[float, float]:
    """Centre and half of the travel, in the unit of the machine file; (0, 180 degrees or 100 mm) without limits."""
    low, high = (limit / axis.unit for limit in axis.range)
    bounded = bool(np.isfinite([low, high]).all())
    return ((low + high) / 2, (high - low) / 2) if bounded else (0.0, 180.0 if axis.rotary else 100.0)


SAMPLES = 361
"""Number of sampled positions along an axis."""


def extent(machine: Machine, effect: Effect) -> tuple[float, float] | None:
    """Lowest and highest value of an effect over the travel, mm or rad.

    None if it depends on a signal that is no axis, or on an axis without a range.
    """
    axes = _axes_of(machine, effect)
    if None in axes:
        return None
    columns = sorted({axis for axis in axes if axis is not None})
    mesh = np.meshgrid(*(travel(machine, axis) for axis in columns))
    q = np.zeros((mesh[0].size if mesh else 1, len(machine.axes)))
    for axis, places in zip(columns, mesh, strict=True):
        q[:, axis] = places.ravel()
    if not np.isfinite(q).all():
        return None
    values = [_values(machine, effect, q, way) for way in ((-1, 1) if effect.basis.needs_direction else (0,))]
    return float(np.min(values)), float(np.max(values))


def at_the_ends(machine: Machine, effect: Effect) -> Array:
    """(2,) values of an effect with all axes at their lowest, and at their highest, positions, mm or rad.

    Empty if it depends on a signal that is no axis.
    """
    if None in _axes_of(machine, effect):
        return np.empty(0)
    ranges = machine.ranges
    return _values(machine, effect, np.where(np.isfinite(ranges), ranges, [0.0, 2 * np.pi]).T, 1)


def _axes_of(machine: Machine, effect: Effect) -> list[int | None]:
    """The axes (columns) that an effect depends on; None for a signal that is no axis."""
    signals = [signal for signal in signals_of(machine.axes, effect) if signal is not None]
    return [axis for signal in signals for axis in (signal.axes or (None,))]


def _values(machine: Machine, effect: Effect, q: Array, direction: int) -> Array:
    return np.asarray(effect.coefficients) @ functions_at(machine, effect, q, State(direction=direction))


def functions_at(machine: Machine, effect: Effect, q: Array, state: State, inputs: Iterable[str] = ()) -> Array:
    """(k, n) the functions of an effect at positions q (n, n_axes); `inputs`: the state inputs that it may have."""
    _, poses = flatten(q, state, machine.axes, frozenset(inputs))
    return dependence_of(machine.axes, effect).rows(poses)


def at_inputs(machine: Machine, inputs: Mapping[str, float]) -> Machine:
    """The machine with inputs such as temperatures fixed at these values: its effects no longer depend on them.

    Lags are taken as settled. Inputs that the machine does not have are ignored; effects of other inputs stay.
    """
    if machine.inputs.isdisjoint(inputs):
        return machine
    return machine.replace(effects=tuple(_at_inputs(effect, inputs) for effect in machine.effects))


def _at_inputs(effect: Effect, inputs: Mapping[str, float]) -> Effect:
    if effect.times is not None and effect.times in inputs:
        center, scale = _of_times(effect)
        factor = (inputs[effect.times] - center) / scale
        spread = effect.covariance and tuple(tuple(factor**2 * value for value in row) for row in effect.covariance)
        coefficients = tuple(factor * value for value in effect.coefficients)
        effect = replace(effect, coefficients=coefficients, covariance=spread, **NO_TIMES)
    if effect.input is None or effect.input not in inputs or effect.basis.needs_direction:
        return effect
    low, high = effect.range or (-np.inf, np.inf)
    u = (np.clip(inputs[effect.input], low, high) - effect.center) / effect.scale
    rows = effect.basis.rows(np.array([u]), np.zeros(1))[:, 0]
    value = float(np.asarray(effect.coefficients) @ rows)
    spread = None if effect.covariance is None else ((float(rows @ np.asarray(effect.covariance) @ rows),),)
    fixed = replace(effect, coefficients=(value,), covariance=spread, range=None, input=None, time_constant_s=None)
    if effect.times is None:
        return replace(fixed, basis=ConstantBasis(), center=0.0, scale=1.0)
    center, scale = _of_times(effect)
    over = None if effect.times == effect.name[2:] else effect.times
    return replace(fixed, basis=LINEAR, center=center, scale=scale, input=over, **NO_TIMES)


def _of_times(effect: Effect) -> tuple[float, float]:
    """Centre and scale of the second signal, `times`."""
    center = effect.center if effect.times_center is None else effect.times_center
    return center, effect.scale if effect.times_scale is None else effect.times_scale


def with_unit(machine: Machine, name: str) -> str:
    """The name of an axis with the unit of its positions; the name of any other signal unchanged."""
    units = {axis.name: "degree" if axis.rotary else "mm" for axis in machine.axes}
    return f"{name}, {units[name]}" if name in units else name


def travel(machine: Machine, axis: int) -> Array:
    """(n,) positions of an axis over its travel, including its kinks, mm or rad; NaN without limits."""
    low, high = (0.0, 2 * np.pi) if machine.axes[axis].endless else machine.ranges[axis]
    kinks = machine.breakpoints(machine.axis_names[axis])
    inside = kinks[(kinks >= low) & (kinks <= high)]
    return np.concatenate([np.linspace(low, high, SAMPLES), inside]) if np.isfinite(high - low) else np.array([np.nan])


def vector(values: Sequence[float]) -> str:
    """Three numbers as text."""
    return f"({', '.join(f'{value:.6g}' for value in values)})"


def facts(machine: Machine) -> dict[str, str]:
    """The settings and provenance of a machine file as text, by name."""
    sizes = {"least increment": machine.least_increment, "largest correction": machine.max_correction}
    rows = {"topology": machine.topology, "control": machine.control or ""}
    rows |= {name: f"{linear:g} mm, {np.degrees(rotary):g} deg" for name, (linear, rotary) in sizes.items()}
    for name, value in machine.provenance.items():
        rows[str(name)] = "; ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
    return {name: value for name, value in rows.items() if value}


def travel_of(axis: Axis) -> str:
    """The range of an axis as text, with its unit."""
    low, high = (limit / axis.unit for limit in axis.range)
    return f"{low:g} ... {high:g} {'deg' if axis.rotary else 'mm'}" if np.isfinite(high - low) else "no limits"


def title_of(machine: Machine, effect: Effect) -> str:
    """The title of an effect, e.g. "straightness of X in Y"."""
    return component_title(effect.name, machine.axis(effect.joint))


def depends_on(effect: Effect) -> str:
    """The basis and the signals of an effect as text, e.g. "polynomial of X"."""
    signals = [signal for signal in (effect.signal, effect.times) if signal is not None]
    return f"{effect.basis.name} of {', '.join(signals)}" if signals else "constant"


@frozen
class EffectCurve:
    """An effect over the axis on which it depends.

    axis       letter of the axis
    x          (n,) positions, mm or degree
    value      (n,) value of the effect, mm or rad
    sigma      (n,) standard deviation by the effect's covariance, mm or rad; None if it has none
    direction  direction of approach: 1 or -1; 0 if the effect does not depend on it
    """

    axis: str
    x: Array
    value: Array
    sigma: Array | None
    direction: int = 0


@frozen
class TipCurve:
    """The error of the tool tip along the travel of one axis, with the other axes in the middle of their travel.

    x      (n,) positions, mm or degree
    error  (n, 3) actual minus nominal position of the tip, workpiece frame, mm
    """

    axis: str
    x: Array
    error: Array


def effect_curves(machine: Machine, effect: Effect) -> list[EffectCurve]:
    """The curve of an effect over the travel of its axis; two curves if it depends on the direction of approach.

    Empty if it depends on no axis, on two signals, or on an axis without a range.
    """
    match _axes_of(machine, effect):
        case [int(axis)] if (q := _moved(machine, axis)) is not None:
            ways = (1, -1) if effect.basis.needs_direction else (0,)
            return [_curve(machine, effect, q, axis, way) for way in ways]
    return []


def rest_of(machine: Machine) -> dict[str, float]:
    """Input -> the value at which its effects are zero: the `center` of the first effect of this input."""
    found: dict[str, float] = {}
    for effect in machine.effects:
        for name, value in ((effect.times, _of_times(effect)[0]), (effect.input, effect.center)):
            if name is not None and name in machine.inputs:
                found.setdefault(name, value)
    return {name: found.get(name, 0.0) for name in sorted(machine.inputs)}


def tip_curves(machine: Machine, tool_length: float = 0.0) -> list[TipCurve]:
    """The curves of the tip error along each axis, approached from below, with all inputs as in `rest_of`."""
    found = []
    inputs = rest_of(machine)
    for index, axis in enumerate(machine.axes):
        q = _moved(machine, index)
        if q is not None and np.isfinite(q).all():
            state = State(tool_length=tool_length, direction=1, inputs=inputs)
            error = machine.actual_tip(q, state) - machine.tip(q, tool_length)
            found.append(TipCurve(axis.name, q[:, index] / axis.unit, error))
    return found


def _curve(machine: Machine, effect: Effect, q: Array, axis: int, direction: int) -> EffectCurve:
    rows = functions_at(machine, effect, q, State(direction=direction))
    value: Array = np.asarray(effect.coefficients) @ rows
    sigma = None
    if effect.covariance is not None:
        sigma = np.sqrt(np.maximum(np.einsum("kn,kl,ln->n", rows, np.asarray(effect.covariance), rows), 0.0))
    return EffectCurve(machine.axis_names[axis], q[:, axis] / machine.axes[axis].unit, value, sigma, direction)


def _moved(machine: Machine, axis: int) -> Array | None:
    """(n, n_axes) positions: one axis over its travel, in order, the others in their middle; None without a range."""
    x = travel(machine, axis)
    if not np.isfinite(x).all():
        return None
    middle = [float(low + high) / 2 if np.isfinite([low, high]).all() else 0.0 for low, high in machine.ranges]
    q = np.tile(middle, (len(x), 1))
    q[:, axis] = np.sort(x)
    return q


UM, URAD = 1e3, 1e6
METRE = 1000.0
COUNTED = {"time_s": ("h", 3600.0), "load_kg": ("kg", 1.0), "load_kgm": ("kg m", 1.0), "tool_length": ("m", METRE)}
"""Signal that is no position -> its unit, and the amount of the signal that this unit is."""
KELVIN = ("K", 1.0)

Unit = tuple[float, str]
"""(factor from mm or rad, name of the unit)."""


def units(machine: Machine, effect: Effect) -> tuple[Unit, ...]:
    """The customary units of the coefficients of an effect: a gain in um/m, growth in um/K, play in um.

    A coefficient belongs to a power of u = (x - center) / scale. If u is a share of the travel of an axis, the unit is
    um, at u = 1, the end of the travel. If u counts mm, degrees, kelvins, hours or kilograms, the unit includes it.
    """
    size, name = (URAD, "urad") if effect.rotational else (UM, "um")
    factor, times = _per(machine, effect.times, effect.times_scale or effect.scale)
    powers = effect.basis.degree if isinstance(effect.basis, Polynomial | Backlash) else (0,) * effect.basis.size
    found = []
    for power in powers:
        each, signal = _per(machine, effect.signal, effect.scale) if power else (1.0, "")
        below = [f"{signal}^{power}" if signal and power > 1 else signal, times]
        shown = " ".join(part for part in below if part)
        unit = f"{name}/({shown})" if " " in shown else f"{name}/{shown}" if shown else name
        found.append((size * each**power * factor, unit))
    return tuple(found)


def _per(machine: Machine, signal: str | None, scale: float) -> Unit:
    """Factor and unit from "per u" to "per unit of the signal"; no unit if u is a share of a travel, or not known."""
    unit, size = "", 1.0
    if signal in machine.axis_names:
        if np.isclose(scale, 1.0):
            unit, size = ("deg", 1.0) if machine.rotary[machine.axis_names.index(signal)] else ("m", METRE)
    elif signal is not None:
        unit, size = KELVIN if signal.startswith("temp_") else COUNTED.get(signal, ("", 1.0))
    return (size / scale, unit) if unit else (1.0, "")
