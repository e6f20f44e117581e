"""A machine in a report: its chain, its errors with their curves, and what they do to the tool tip."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ncfix.machine import Axis, Effect, Machine
from ncfix.machine.effects import (
    EffectCurve,
    TipCurve,
    depends_on,
    effect_curves,
    extent,
    facts,
    tip_curves,
    title_of,
    travel_of,
    vector,
    with_unit,
)
from ncfix.report.document import Line, Part, Plot, Section, Table, Text

WAYS = {1: "upwards", -1: "downwards", 0: ""}


def sections(machine: Machine, path: str) -> list[Section]:
    """What there is to say of a machine file."""
    head = Section(f"{machine.name}", [_facts(machine, path), _chain(machine)])
    if machine.is_perfect:
        return [head, Section("Errors", [Text("None: a perfect machine.")])]
    return [head, _tip(machine), Section("Errors", [_effects(machine)]), *_joints(machine)]


def _facts(machine: Machine, path: str) -> Table:
    return Table((), [("file", path), ("hash", machine.hash), *facts(machine).items()])


def _chain(machine: Machine) -> Table:
    header = ("axis", "kind", "carries", "direction", "through", "travel")
    return Table(header, [_axis(axis) for axis in machine.axes])


def _axis(axis: Axis) -> Sequence[str]:
    carries = "workpiece" if axis.workpiece_side else "tool"
    through = vector(axis.point) if axis.rotary else ""
    return axis.name, "rotary" if axis.rotary else "linear", carries, vector(axis.direction), through, travel_of(axis)


def _tip(machine: Machine) -> Section:
    words = (
        "Actual minus nominal position of the tool tip in the workpiece frame, as one axis moves and the others stand "
        "in the middle of their travel; tool length zero, approached from below."
    )
    return Section("Error of the tool tip", [Text(words), *(_drift(machine, each) for each in tip_curves(machine))])


def _drift(machine: Machine, drift: TipCurve) -> Plot:
    lines = [Line(drift.x, 1e3 * values, label=f"d{name}") for name, values in zip("xyz", drift.error.T, strict=True)]
    return Plot(f"um over {with_unit(machine, drift.axis)}", lines)


def _effects(machine: Machine) -> Table:
    return Table(("effect", "what it is", "depends on", "size"), [_effect(machine, each) for each in machine.effects])


def _effect(machine: Machine, effect: Effect) -> Sequence[str]:
    return effect.name, title_of(machine, effect), depends_on(effect), _size(machine, effect)


def _size(machine: Machine, effect: Effect) -> str:
    factor, unit = _unit(effect)
    found = extent(machine, effect)
    if found is None:
        return "not known from the file"
    low, high = (factor * value for value in found)
    spread = _constant_sigma(effect)
    sigma = f" (1 sigma {factor * spread:.2g})" if spread is not None else ""
    return f"{low:+.3g}{sigma} {unit}" if low == high else f"{low:+.3g} ... {high:+.3g} {unit}"


def _constant_sigma(effect: Effect) -> float | None:
    """The standard deviation of an effect that is one number."""
    if effect.covariance is None or len(effect.coefficients) != 1:
        return None
    return float(np.sqrt(max(effect.covariance[0][0], 0.0)))


def _unit(effect: Effect) -> tuple[float, str]:
    return (1e6, "urad") if effect.rotational else (1e3, "um")


def _joints(machine: Machine) -> Iterator[Section]:
    """The curves, joint by joint."""
    for joint in (*machine.axis_names, "S"):
        plots = [plot for effect in machine.effects if effect.joint == joint for plot in _plots(machine, effect)]
        if plots:
            yield Section(f"Errors of {joint}", plots)


def _plots(machine: Machine, effect: Effect) -> Iterator[Part]:
    found = effect_curves(machine, effect)
    if found:
        _, unit = _unit(effect)
        band = "; band: two standard deviations" if found[0].sigma is not None else ""
        caption = f"{effect.name} ({effect.basis.name}), {unit} over {with_unit(machine, found[0].axis)}{band}"
        yield Plot(caption, [_line(effect, curve) for curve in found])


def _line(effect: Effect, curve: EffectCurve) -> Line:
    factor, _ = _unit(effect)
    spread = None if curve.sigma is None else 2 * factor * curve.sigma
    return Line(curve.x, factor * curve.value, spread, WAYS[curve.direction])
