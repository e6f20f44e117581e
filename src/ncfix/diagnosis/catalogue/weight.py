"""Candidates caused by weight and load: sag, droop, nod, tilt. Rows 28 to 36 of the catalogue.

A beam that sags tilts what rides on it: the deflection f and its slope f' are one effect with one size. A machine file
does not say which way is down, so every direction across an axis is a form of the effect.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnosis.catalogue.candidate import (
    LETTERS,
    TURNS,
    Candidate,
    MeasuredRange,
    across,
    along,
    stacked,
    weighed,
    zero,
)
from ncfix.machine import Effect
from ncfix.machine.axes import SPINDLE, Axis, is_arm
from ncfix.machine.basis import Fourier, Polynomial
from ncfix.machine.effects import leaning, yielding

POWERS = (0, 1, 2, 3, 4)
FOOT = 30.0
"""Standard deviation of a nodding slide's pivot from the reference point, mm."""
TILTED = 0.2
"""Standard deviation of a slide's tilt from the slope of its beam, as a share: its carriages are some way apart."""
LOAD: dict[str, Any] = {"times": "load_kg", "times_center": 0.0, "times_scale": 100.0}
BOW = np.array([[0, 0, 0], [0, 0, 0], [1, 0, 0], [0, 0.5, 0], [0, 0, 0.3]])
"""Columns: u^2, u^3, u^4 with their sizes: a bed between its supports."""
FREE_END = np.array([[1, 0.3], [2, 0.9], [1, 0.9], [0, 0.3], [0, 0]])
"""Columns: (1 + u)^2 and (1 + u)^3 with their sizes: a cantilever that becomes longer towards u = 1."""
MIRROR = np.diag([1.0, -1.0, 1.0, -1.0, 1.0])


def weight_candidates(measured: MeasuredRange) -> Iterator[Candidate]:
    """Candidates caused by weight and load."""
    for axis in measured.linear:
        yield from _beam(measured, axis)
        yield from _nod(measured, axis)
        yield _foundation(measured, axis)
    for axis in measured.rotary:
        if along(axis) is not None:
            yield _table(axis)
            yield from _unbalanced(measured, axis)
            if not is_arm(measured.machine.axes):
                yield _sag(measured, axis)
            elif leaning(measured.machine.axes, axis):
                yield _yielding(measured, axis)
            yield from _twist(measured, axis)
    yield from _droop(measured)


def _beam(measured: MeasuredRange, axis: Axis) -> Iterator[Candidate]:
    q, family = axis.name, f"{axis.name} weight"
    sorts: list[tuple[str, str, tuple[Array, ...], str]] = [
        ("bed sag", f"bed of {q} sags under the slide", (BOW,), "re-level the bed")
    ]
    if not axis.workpiece_side:
        ends = (FREE_END, MIRROR @ FREE_END)
        sorts.append(
            ("ram droop", f"ram droop: {q} sags more the further it is out", ends, "a counterweight, or tables")
        )
    own = along(axis)
    if own is None:
        return
    for kind, title, forms, remedy in sorts:
        effects, loadings = _deflected(measured, axis, own, forms)
        yield Candidate(f"{kind} {q}", title, q, family, effects, loadings, (), remedy)


def _deflected(
    measured: MeasuredRange, axis: Axis, own: int, forms: tuple[Array, ...]
) -> tuple[tuple[Effect, ...], tuple[Array, ...]]:
    """Effects and loadings of a deflection and its slope, for both directions across the axis.

    There are no free shifts by an unknown pivot of the tilt. They would be small, and with them two unrelated curves
    would be taken for a sag.
    """
    span = measured.scaled(axis)
    basis, none = Polynomial(degree=POWERS), np.zeros((2 * len(POWERS), 0))
    effects: list[Effect] = []
    signs: list[float] = []
    for way in across(axis):
        turn = ({0, 1, 2} - {own, way}).pop()
        pair = np.zeros((2, 3))
        pair[0, :] = np.asarray(axis.error_axes[own]) * (np.asarray(axis.direction) @ np.asarray(axis.error_axes[own]))
        pair[1, :] = axis.error_axes[way]
        signs.append(float(np.cross(pair[0], pair[1]) @ np.asarray(axis.error_axes[turn])))
        effects += [Effect(f"E{letter}{axis.name}", (), basis, **span) for letter in (LETTERS[way], TURNS[turn])]
    first, second = ([_sloped(form, sign / span["scale"]) for form in forms] for sign in signs)
    return zero(effects), (*(stacked(each, none) for each in first), *(stacked(none, each) for each in second))


def _sloped(form: Array, factor: float) -> Array:
    """The loading of deflection and tilt, for columns `form` of powers of u; `factor` converts df/du to a tilt.

    The tilt may differ from the slope by the share `TILTED`. The shift has no mean and slope, which are constants.
    """
    slope = np.zeros_like(form)
    slope[:-1] = factor * form[1:] * np.arange(1, len(form))[:, None]
    both: Array = np.block([[_bent(form), np.zeros_like(form)], [slope, TILTED * slope]])
    return both


def _bent(form: Array) -> Array:
    """Columns of powers without their mean and slope over -1 ... 1."""
    powers = np.arange(len(form))[:, None]
    rest: Array = form.astype(np.float64)
    rest[0] -= (form / (powers + 1))[0::2].sum(axis=0)
    rest[1] -= (3 * form / (powers + 2))[1::2].sum(axis=0)
    return rest


def _nod(measured: MeasuredRange, axis: Axis) -> Iterator[Candidate]:
    """Tilt of a slide by the product of its own position and that of another slide."""
    others = [each for each in measured.linear if each is not axis and each.workpiece_side == axis.workpiece_side]
    others = others or [each for each in measured.linear if each is not axis]
    effects, count = [], 0
    for other in others:
        for turn in TURNS:
            common = measured.scaled(axis) | measured.factor(other)
            for name in (
                f"E{turn}{axis.name}",
                *(f"E{x}{axis.name}" for x in LETTERS if TURNS[LETTERS.index(x)] != turn),
            ):
                effects.append(Effect(name, (), Polynomial(degree=(1, 2)), **common))
            count += 1
    if not effects:
        return
    one = stacked(weighed((1.0, 0.1)), FOOT * weighed((1.0, 0.1)), FOOT * weighed((1.0, 0.1)))
    loadings = tuple(_placed(one, k, count) for k in range(count))
    title = f"column nod: {axis.name} tilts under a weight that moves, by the product of two positions"
    yield Candidate(
        f"column nod {axis.name}", title, axis.name, f"{axis.name} weight", zero(effects), loadings, (),
        "compensate with a table over both positions",
    )  # fmt: skip


def _placed(block: Array, index: int, count: int) -> Array:
    """A loading that is `block` at place `index` of `count`, and zero elsewhere."""
    whole = np.zeros((count * block.shape[0], block.shape[1]))
    whole[index * block.shape[0] : (index + 1) * block.shape[0]] = block
    return whole


def _foundation(measured: MeasuredRange, axis: Axis) -> Candidate:
    """Tilt of one branch against the other as the mass of a slide moves, about a fixed pivot."""
    basis = Polynomial(degree=(1, 2))
    held = by_foundation(measured)
    span = measured.scaled(axis)
    effects = [Effect(f"E{turn}0{held.name}", (), basis, input=axis.name, carried=True, **span) for turn in TURNS]
    loading = weighed((1.0, 0.15) * 3)
    title = f"foundation or frame tilts as {axis.name} moves"
    return Candidate(
        f"foundation tilt {axis.name}", title, axis.name, f"{axis.name} weight", zero(effects), (loading,), (),
        "check levelling feet and anchors",
    )  # fmt: skip


def by_foundation(measured: MeasuredRange) -> Axis:
    """The axis next to the foundation, on the tool side if there is one."""
    axes = measured.machine.axes
    tool = [axis for axis in axes if not axis.workpiece_side]
    return tool[0] if tool else axes[-1]


def _table(axis: Axis) -> Candidate:
    """A table of anisotropic stiffness: a tilt twice per turn, its direction rotating forward or backward."""
    first, second = across(axis)
    effects = zero([Effect(f"E{TURNS[k]}{axis.name}", (), Fourier(order=(2,))) for k in (first, second)])
    turning = np.array([[1, 0], [0, 1], [0, -1], [1, 0]], dtype=np.float64)
    back = np.array([[1, 0], [0, 1], [0, 1], [-1, 0]], dtype=np.float64)
    title = f"table of {axis.name} is less stiff in one direction: deflection twice a turn"
    return Candidate(
        f"table stiffness {axis.name}", title, axis.name, f"{axis.name} turning", effects, (turning, back), (),
        "put the load in the middle of the table",
    )  # fmt: skip


def _unbalanced(measured: MeasuredRange, axis: Axis) -> Iterator[Candidate]:
    """A once-per-turn angle error of a rotary axis in proportion to the load; none if the load was not logged."""
    own = along(axis)
    if own is None or "load_kg" not in measured.columns:
        return
    name, wave = f"E{TURNS[own]}{axis.name}", Fourier(order=(1,))
    tilting = [other for other in measured.rotary if other is not axis]
    effects = zero(
        [
            Effect(name, (), wave, **LOAD),
            *(Effect(name, (), wave, **measured.factor(other)) for other in tilting),
            Effect(name, (), wave),
        ]
    )
    rest = 2 * len(effects) - 2
    plain = np.eye(2 * len(effects))[:, :2]
    leaning = weighed((1.0, 1.0, *(0.5,) * rest))
    title = f"unbalanced load on {axis.name}: its weight turns the axis"
    yield Candidate(
        f"unbalanced load {axis.name}", title, axis.name, f"{axis.name} weight", effects, (plain, leaning),
        ("load_kg",), "balance the load",
    )  # fmt: skip


def _sag(measured: MeasuredRange, axis: Axis) -> Candidate:
    """Sag of a swivelling body by its own weight and its load, as sine and cosine of the angle."""
    first, second = across(axis)
    own = along(axis) or 0
    wave = Fourier(order=(1,))
    loaded: list[dict[str, Any]] = [{}, LOAD] if "load_kg" in measured.columns else [{}]
    forms = ((TURNS[own],), (LETTERS[first], LETTERS[second]), (TURNS[first], TURNS[second]), (LETTERS[own],))
    names = [f"E{letter}{axis.name}" for form in forms for letter in form]
    effects = zero([Effect(name, (), wave, **state) for state in loaded for name in names])
    loadings, at = [], 0
    for form in forms:
        size = np.zeros((len(loaded), len(names), 2))
        size[:, at : at + len(form)] = 1.0
        if len(loaded) == 2:
            size[0] *= 0.3
        columns = np.diag(size.ravel())
        loadings.append(columns[:, columns.any(axis=0)])
        at += len(form)
    title = f"gravity sag of {axis.name}: its body sags as sine and cosine of the angle, in proportion to the load"
    return Candidate(
        f"gravity sag {axis.name}", title, axis.name, f"{axis.name} weight", effects, tuple(loadings),
        ("load_kg",) if len(loaded) == 2 else (), "",
    )  # fmt: skip


def _yielding(measured: MeasuredRange, axis: Axis) -> Candidate:
    """Compliance of the gear of an arm's joint under links and load, as sine and cosine of their inclination."""
    own = along(axis) or 0
    plain = [yielding(f"E{TURNS[own]}{axis.name}", axis, lean) for lean in leaning(measured.machine.axes, axis)]
    loaded = "load_kg" in measured.columns
    effects = (*plain, *(replace(each, **LOAD) for each in plain if loaded))
    title = f"compliance of joint {axis.name}: its gear yields under the weight that it bears"
    return Candidate(
        f"compliance {axis.name}", title, axis.name, f"{axis.name} weight", effects,
        (weighed((1.0,) * 2 * len(effects)),), ("load_kg",) if loaded else (),
        "calibrate with the effect compliance, or have the control compensate the load",
    )  # fmt: skip


def _twist(measured: MeasuredRange, axis: Axis) -> Iterator[Candidate]:
    """Twist of a trunnion that is driven from one side: its angle lags in proportion to the position along it."""
    own = along(axis)
    line = np.abs(np.asarray(axis.direction))
    others = [each for each in measured.linear if line @ np.abs(np.asarray(each.direction)) > 0.3]
    if own is None or not others:
        return
    name = f"E{TURNS[own]}{axis.name}"
    effects = zero([Effect(name, (), Fourier(order=(1,)), **measured.factor(other)) for other in others])
    title = f"trunnion twist of {axis.name}: driven from one side, the angle lags along the axis"
    yield Candidate(
        f"trunnion twist {axis.name}", title, axis.name, f"{axis.name} weight", effects,
        (weighed((1.0,) * 2 * len(effects)),), (), "drive from both sides",
    )  # fmt: skip


def _droop(measured: MeasuredRange) -> Iterator[Candidate]:
    """Droop of tool and holder by their weight; visible only if rotary axes tilt the tool."""
    heads = [axis for axis in measured.rotary if not axis.workpiece_side]
    if "tool_length" not in measured.columns or not heads:
        return
    long: dict[str, Any] = {"times": "tool_length", "times_center": 0.0, "times_scale": 100.0}
    tool = int(np.abs(np.asarray(measured.machine.tool.direction)).argmax())
    names = [f"E{TURNS[k]}{SPINDLE}" for k in range(3) if k != tool]
    wave = Fourier(order=(1,))
    effects = zero([Effect(n, (), wave, input=head.name, **long) for head in heads for n in names])
    loading = weighed((1.0,) * 2 * len(effects))
    title = "tool droop: tool and holder sag by their weight as the head turns"
    yield Candidate("tool droop", title, "", "spindle", effects, (loading,), ("tool_length",), "use a stiffer holder")
