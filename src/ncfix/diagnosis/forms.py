"""Forms of all candidates as columns of the data, at a size of 1 um; and unnamed alternatives to the candidates.

The size of a form is the root mean square, over rows, of the length of its effect on a row's values, over the sort of
rows where it is largest, before anything else is fitted. So all effects compete on one scale, that of the tool tip.

An unnamed alternative describes an effect that is in no catalogue. It is more flexible than any name and pays for that
in the evidence. There are two sorts. Smooth fields move the tool tip as a Gaussian process of pose, time or direction
of approach, with three independent components along the axes of tool, base or workpiece. Joint errors are the six error
motions of one joint, all together or one alone, as a function of its position or direction, another axis, time or load.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate, combinations, pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array
from ncfix.diagnosis.catalogue import Candidate
from ncfix.diagnosis.catalogue.candidate import (
    LETTERS,
    TURNS,
    MeasuredRange,
    bent_loading,
    smooth_loading,
    spline,
    stacked,
    weighed,
    zero,
)
from ncfix.diagnosis.effect_form import EffectForm, column_bounds, side_by_side
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.machine import Effect
from ncfix.machine.axes import SPINDLE, Axis, component_title
from ncfix.machine.basis import Backlash, Fourier, Polynomial
from ncfix.measure.least_squares import orthonormal, without
from ncfix.measure.observation import Observation, base_from_workpiece
from ncfix.values import frozen

EQUAL = 1e-6
"""Relative difference up to which eigenvalues count as equal."""
VISIBLE = 0.05
"""Smallest share of a form's squares that set-up and constants cannot absorb, for the form to be visible."""
SHARE_DIGITS = 9
"""Decimals of such a share; further ones are rounding errors."""
NEGLIGIBLE = 3e-3
"""Share of a form's squares that may be dropped to save columns."""
UNSEEN_UM = 1e-9
"""Size below which a form is not seen at all, um rms."""
HOLD_POINTS = tuple(product((-0.5, 0.5), repeat=3))
"""Assumed fixed points of an expanding part, in units of `residual_data.HOLD_REACH`: one for each octant."""
HOLD_SPREAD = 0.5 / np.sqrt(3)
"""Standard deviation of the true fixed point from the assumed one, per direction, in the same units."""
BATCH = 32
"""Candidates or forms whose columns are computed at once, to limit memory."""
LEAD_SHARE = 0.5
"""Smallest share of a tilt's squares that comes from the tilt and not from the shifts of its unknown pivot; with less
it has no lever in these data."""
UNNAMED_FAMILY = "unnamed"
"""Family of the unnamed alternatives."""
POSE = Candidate("unknown by pose", "something that depends on the positions of the axes", "", UNNAMED_FAMILY, (), ())
TIME = Candidate("unknown by time", "something that changes with time", "", UNNAMED_FAMILY, (), ())
DIRECTION = Candidate(
    "unknown by way", "something that depends on the directions of approach", "", UNNAMED_FAMILY, (), ()
)
POSE_LENGTHS = (0.8, 1.6)
"""Correlation lengths of a smooth field of all axes, in units of half their travels."""
PAIR_LENGTH = 0.7
"""Correlation length of a product of functions of two axes, in units of half their travels."""
JERK = 300.0
"""Correlation time of a smooth course that is faster than thermal effects, s."""
TIME_LENGTHS = (1200.0, 2400.0, 7200.0)
"""Correlation times of courses with kinks (Matern 3/2), as of the thermal effects of the catalogue, s."""
STEP_MEMORY = 3600.0
"""Correlation time of steps and random walks, s."""
MOST_FUNCTIONS = 50
"""Largest number of basis functions of a kernel, the smoothest ones."""
DROPPED = 0.01
"""Share of squares that may be dropped to save columns."""
VARIATION_LENGTH = 1.0
"""Correlation length of changes of an effect's shape, in units of half an axis's travel, or half of the time."""
VARIATIONS = 16
"""Largest number of basis functions of a change of shape."""
FULL_TURN = 270.0
"""A rotary axis that moved by more than this, degree, gets periodic functions."""
JOINT_BEND = 0.4
"""Correlation length of an unnamed error of a joint, in units of half its travel."""
TIME_BEND = 0.3
"""Correlation length over time of an unnamed error, in units of half of the time."""
WAVES = (1.0, 0.7, 0.5, 0.3, 0.2, 0.2)
"""Variances of the harmonics of an unnamed error of a rotary axis."""
PLAY = (1.0, 1.0, 0.5, 0.3)
"""Variances of the powers of position in an unnamed error that depends on the direction."""
JointPart = tuple[str, dict[str, Any], Array]
"""Component, options of the effect, and the loading of its coefficients."""
TOLD = 1e-6
"""Smallest ratio of eigenvalues at which columns are safely independent."""
SAME_AS_NAME = 0.8
"""Share of an alternative's squares that a name can show, from which on it is dropped as the same."""


CHANGE, CAME = "change of ", "came since: "
"""Prefixes of name and title of a change between two dates."""


@frozen(repr=False, slots=False)
class VisibleForms:
    """The forms that the data can show, and the candidates that they cannot show, with the visible share of these."""

    groups: tuple[EffectForm, ...]
    invisible: tuple[tuple[Candidate, float], ...]


def visible_forms(data: ResidualData, candidates: Sequence[Candidate]) -> VisibleForms:
    """The visible forms of all candidates."""
    basis = orthonormal(data.base / data.relative[:, None])
    groups: list[EffectForm] = []
    invisible = []
    for candidate, design in zip(candidates, _designs(data, [each.effects for each in candidates]), strict=True):
        loadings = candidate.loadings
        if candidate.grows:
            design, loadings = data.expansion(candidate.effects), tuple(expansion_loadings(loadings))
        forms = [form for loading in loadings if (form := _form(data, candidate, loading, design)) is not None]
        shares = _visible_shares(data, basis, forms)
        seen = [form for form, share in zip(forms, shares, strict=True) if share >= VISIBLE]
        groups += seen
        if not seen:
            invisible.append((candidate, max(shares, default=0.0)))
    return VisibleForms(tuple(groups), tuple(invisible))


def file_constants(data: ResidualData) -> tuple[EffectForm, ...]:
    """The free constants of the machine file as forms, one for each effect."""
    found = []
    for effect in data.problem.selection.estimated:
        title = f"constant of the machine file: {component_title(effect.name, data.machine.axis(effect.joint))}"
        own = zero([replace(effect, covariance=None)])
        owner = Candidate(f"constant {effect.name}", title, effect.joint, "constant of the file", own, ())
        found.append(_form(data, owner, np.eye(effect.basis.size), data.design(own)))
    return tuple(form for form in found if form is not None)


def changes(data: ResidualData, groups: Sequence[EffectForm], first: int) -> tuple[EffectForm, ...]:
    """The forms as changes between two dates: they act in the files from index `first` on only."""
    later = (data.file[np.maximum(data.row, 0)] >= first) & (data.row >= 0)
    basis, found = orthonormal(data.base / data.relative[:, None]), []
    for group in groups:
        columns = np.where(later[:, None], group.columns, 0.0)
        size = data.size(columns)
        if size > UNSEEN_UM:
            owner = replace(group.owner, name=CHANGE + group.owner.name, title=CAME + group.owner.title, constant=False)
            form = EffectForm.of(owner, group.loading / size, columns / size)
            found += [form] if _visible_shares(data, basis, [form])[0] >= VISIBLE else []
    return tuple(found)


def expansion_loadings(loadings: Sequence[Array]) -> Iterator[Array]:
    """Loadings of an expansion about each of `HOLD_POINTS`, with the spread of the true fixed point.

    All points of the part move with one course in time.
    """
    for course in loadings:
        about = stacked(np.zeros((len(course), 0)), *[HOLD_SPREAD * course] * 3)
        for place in HOLD_POINTS:
            yield np.hstack([np.kron(np.array([[1.0], *([x] for x in place)]), course), about])


def without_lacking_constants(
    data: ResidualData, parts: Iterable[Array], named: Sequence[EffectForm]
) -> Iterator[Array]:
    """The parts, columns (m, p) each, without the component that lacking constants of the machine file explain."""
    constants = [group.columns for group in named if group.owner.constant]
    if not constants:
        yield from parts
        return
    own, shares = np.concatenate(constants, axis=1), data.shares(constants)
    for columns in parts:
        yield columns - own @ (shares @ columns)


def _form(data: ResidualData, candidate: Candidate, loading: Array, design: Array) -> EffectForm | None:
    """The form scaled to 1 um, with as few columns as it needs; None if it is invisible or has no lever."""
    used = loading.any(axis=1)
    columns = design @ loading if used.all() else design[:, used] @ loading[used]
    size = data.size(columns)
    if size < UNSEEN_UM or _lead_squares(candidate, loading, design) < LEAD_SHARE * float((columns**2).sum()):
        return None
    turned = principal_rotation(columns) / size
    return EffectForm.of(candidate, loading @ turned, columns @ turned)


def _lead_squares(candidate: Candidate, loading: Array, design: Array) -> float:
    """Squares of the leading effects' part of the columns; infinite if all effects lead."""
    if not candidate.lead:
        return np.inf
    own = slice(0, sum(effect.basis.size for effect in candidate.effects[: candidate.lead]))
    return float(((design[:, own] @ loading[own]) ** 2).sum())


def principal_rotation(columns: Array) -> Array:
    """The rotation (p, r) to the fewest columns that carry nearly all of the squares."""
    if columns.shape[1] == 1:
        return np.ones((1, 1))
    squares, turned = np.linalg.eigh(columns.T @ columns)
    return turned[:, first_kept(squares, int(np.argmax(np.cumsum(squares) > NEGLIGIBLE * squares.sum()))) :]


def first_kept(squares: Array, first: int) -> int:
    """The first of ascending eigenvalues to keep, at most `first`, so that equal ones are kept or dropped together.

    The vectors of equal eigenvalues are any directions of the space that they span: of some of them, rounding decides.
    """
    while first > 0 and squares[first - 1] > (1 - EQUAL) * squares[first]:
        first -= 1
    return first


def _visible_shares(data: ResidualData, basis: Array, groups: Sequence[EffectForm]) -> list[float]:
    """For each form, the share of its squares that is orthogonal to `basis`, in units of each value's noise."""
    if not groups:
        return []
    columns = np.concatenate([group.columns.T for group in groups]) / data.relative
    squares, hidden = np.einsum("ij,ij->i", columns, columns), ((columns @ basis) ** 2).sum(axis=1)
    parts = [slice(start, stop) for start, stop in pairwise(column_bounds(groups))]
    return [max(0.0, round(float(1.0 - hidden[part].sum() / squares[part].sum()), SHARE_DIGITS)) for part in parts]


def _smooth_fields(data: ResidualData) -> Iterator[EffectForm | None]:
    """The smooth fields of the tool tip; none if the data do not depend on the tip."""
    tip = data.design([Effect(f"E{letter}{SPINDLE}", (0.0,)) for letter in LETTERS]) / 1e3
    if np.abs(tip).max() > 0:
        rows = np.maximum(data.row, 0)
        functions = [(owner, kernel_functions(kernel)[rows]) for owner, kernel in _kernels(data)]
        for way in tip_frames(data, tip):
            for owner, own in functions:
                yield combined_form(data, owner, [way[:, [k]] * own for k in range(way.shape[1])])


def tip_frames(data: ResidualData, tip: Array) -> tuple[Array, ...]:
    """Effect on the values, (m, 3), of a shift of the tip along the axes of tool, base and workpiece.

    A frame is left out if it is the same as another: tool and base if no rotary axis turns the tool, base and workpiece
    if none turns the workpiece.
    """
    sides = [axis.workpiece_side for axis in data.machine.axes if axis.rotary]
    found, row = [tip], np.maximum(data.row, 0)
    observed = data.problem.observations
    turned = np.concatenate([each.machine.nominal(each.q, each.state.tool_length)[:, :3, :3] for each in observed])
    if not all(sides):
        found.append(np.einsum("mj,mkj->mk", tip, (base_from_workpiece(data.machine, data.q) @ turned)[row]))
    if any(sides):
        found.append(np.einsum("mj,mkj->mk", tip, turned[row]))
    return tuple(found)


def _kernels(data: ResidualData) -> Iterator[tuple[Candidate, Array]]:
    """The alternatives with their covariances between rows, (n, n)."""
    u = scaled_axes(data)
    for length in POSE_LENGTHS:
        yield POSE, _squared_exponential(u, length)
    single = [_squared_exponential(u[:, [k]], PAIR_LENGTH) for k in range(u.shape[1])]
    if len(single) > 1:
        yield POSE, sum((a * b for a, b in combinations(single, 2)), np.zeros_like(single[0]))
    time = data.column("time_s")
    if np.ptp(time) > 0:
        yield TIME, _squared_exponential(time[:, None], JERK)
        for length in TIME_LENGTHS:
            apart = np.sqrt(3) * np.abs(time[:, None] - time) / length
            yield TIME, (1 + apart) * np.exp(-apart)
        yield TIME, np.exp(-np.abs(time[:, None] - time) / STEP_MEMORY)
    sides = _directions(data)
    if sides.shape[1]:
        yield DIRECTION, (sides @ sides.T) * (1 + sum(single, np.zeros_like(single[0])))


def _squared_exponential(u: Array, length: float) -> Array:
    apart = ((u[:, None] - u) ** 2).sum(axis=-1)
    kernel: Array = np.exp(-0.5 * apart / length**2)
    return kernel


def _directions(data: ResidualData) -> Array:
    """Directions of approach of the axes that were approached from both sides, (n, k)."""
    names = [f"dir_{axis.name}" for axis in data.machine.axes if f"dir_{axis.name}" in data.measured.columns]
    return np.stack([data.column(name) for name in names], axis=-1) if names else np.zeros((data.count, 0))


def scaled_axes(data: ResidualData, q: Array | None = None) -> Array:
    """Positions of the moved axes scaled to -1 ... 1, (n, k), of the rows or of `q`; full turns as cosine and sine."""
    columns = []
    for index, axis in enumerate(data.machine.axes):
        values = (data.q if q is None else q)[:, index]
        low, high = float(data.q[:, index].min()), float(data.q[:, index].max())
        if not data.measured.moved(axis) or high == low:  # `moved` counts both ends of a length, q has one of them
            continue
        if axis.rotary and high - low > 1.5 * np.pi:
            columns += [np.cos(values), np.sin(values)]
        else:
            columns.append((2 * values - low - high) / (high - low))
    return np.stack(columns, axis=-1) if columns else np.zeros((data.count, 1))


def kernel_functions(kernel: Array, most: int = MOST_FUNCTIONS) -> Array:
    """Basis functions (n, k) with F F' nearly equal to the covariance `kernel` (n, n), about `most` at most."""
    squares, vectors = np.linalg.eigh(kernel)
    least = int(np.searchsorted(squares, 1e-6 * squares[-1], side="right"))
    first = first_kept(squares, max(len(squares) - most, least))
    found: Array = vectors[:, first:] * np.sqrt(squares[first:])
    return found


def shape_variations(data: ResidualData) -> Array:
    """Smooth basis functions of each axis and of the time, with a total variance of one, (m, k)."""
    return _variations(data, scaled_axes(data), data.column("time_s"))[np.maximum(data.row, 0)]


def shape_variations_with(data: ResidualData, new: Observation) -> tuple[Array, Array]:
    """`shape_variations` of the values, (m, k), and the same functions for the values of further poses, (v, k)."""
    places = np.concatenate([scaled_axes(data), scaled_axes(data, new.q)])
    time = np.concatenate([data.column("time_s"), new.measurement.column("time_s")])
    both = _variations(data, places, time)
    return both[np.maximum(data.row, 0)], both[data.count + np.maximum(new.rows, 0)]


def _variations(data: ResidualData, places: Array, time: Array) -> Array:
    """The functions of `shape_variations` (n, k) for rows at scaled positions (n, a) and times (n,)."""
    known = data.column("time_s")
    signals = [*places.T, *([2 * (time - known.mean()) / np.ptp(known)] if np.ptp(known) > 0 else [])]
    kernel = sum(np.exp(-0.5 * (u[:, None] - u) ** 2 / VARIATION_LENGTH**2) for u in signals) / len(signals)
    return kernel_functions(np.asarray(kernel), VARIATIONS)


def combined_form(data: ResidualData, owner: Candidate, parts: Sequence[Array]) -> EffectForm | None:
    """One form of several parts of equal size, scaled to 1 um together, with as few columns as it needs."""
    sizes = [data.size(part) for part in parts]
    count = sum(size > 0 for size in sizes)
    if not count:
        return None
    scaled = (part / (size * np.sqrt(count)) for part, size in zip(parts, sizes, strict=True) if size > 0)
    whole = side_by_side(scaled)
    squares, vectors = np.linalg.eigh(whole.T @ whole)
    first = first_kept(squares, int(np.argmax(np.cumsum(squares) > DROPPED * squares.sum())))
    return EffectForm.of(owner, np.zeros((0, len(squares) - first)), whole @ vectors[:, first:])


def _joint_forms(data: ResidualData) -> Iterator[EffectForm | None]:
    """Unnamed errors of every joint, for each input: its six error motions together, and each alone."""
    sorts = [(axis, *sort) for axis in _moved(data.measured) for sort in _sorts(data.measured, axis)]
    parts = [part for _, _, components in sorts for component in components for part in component]
    designs = _designs(data, [zero([Effect(name, (), **options)]) for name, options, _ in parts])
    shown = (design @ loading for design, (_, _, loading) in zip(designs, parts, strict=True))
    for axis, what, components in sorts:
        own = [side_by_side([next(shown) for _ in component]) for component in components]
        yield combined_form(data, _something(axis, f"an error of {axis.name}", what), own)
        for component, part in zip(components, own, strict=True):
            effects = zero([Effect(name, (), **options) for name, options, _ in component])
            yield combined_form(data, replace(_something(axis, component[0][0], what), effects=effects), [part])


def _designs(data: ResidualData, effects: Sequence[Sequence[Effect]]) -> Iterator[Array]:
    """The design (m, k) of each group of effects, computed in batches."""
    for start in range(0, len(effects), BATCH):
        some = effects[start : start + BATCH]
        every = data.design([effect for group in some for effect in group])
        ends = accumulate(sum(effect.basis.size for effect in group) for group in some)
        yield from np.split(every, list(ends)[:-1], axis=1)


def _something(axis: Axis, error: str, what: str) -> Candidate:
    title = f"{error} by {what} that has no name in the catalogue"
    return Candidate(f"unknown of {axis.name}", title, axis.name, UNNAMED_FAMILY, (), ())


def _moved(measured: MeasuredRange) -> tuple[Axis, ...]:
    return (*measured.linear, *measured.rotary)


def _sorts(measured: MeasuredRange, axis: Axis) -> Iterator[tuple[str, list[list[JointPart]]]]:
    """The inputs on which errors of an axis may depend, each with the parts of its six components."""
    names = [f"E{letter}{axis.name}" for letter in LETTERS + TURNS]
    options, loading = _curve(measured, axis)
    yield "its position", [[(name, options, _curved(axis, name, loading))] for name in names]
    if f"dir_{axis.name}" in measured.columns:
        play = {"basis": Backlash(degree=(0, 1, 2, 3)), **measured.scaled(axis)}
        yield "its direction", [[(name, play, weighed(PLAY))] for name in names]
    others = [other for other in _moved(measured) if other is not axis]
    for other in others:
        yield f"its position and {other.name}", [[(name, options | measured.factor(other), loading)] for name in names]
    for what, driven in (("time or heat", _warm(measured)), ("load", _loaded(measured))):
        if driven:
            yield what, [[(name, *each) for each in driven] for name in names]
            product = [(options | measured.factor(axis), loading) for options, loading in driven]
            yield f"its position and {what}", [[(name, *each) for each in product] for name in names]


def _curve(measured: MeasuredRange, axis: Axis) -> tuple[dict[str, Any], Array]:
    if axis.rotary and np.ptp(measured.spans[axis.name]) > FULL_TURN:
        return {"basis": Fourier(order=tuple(range(1, len(WAVES) + 1)))}, weighed(np.repeat(WAVES, 2))
    return {"basis": spline(), **measured.scaled(axis)}, smooth_loading(JOINT_BEND)


def _curved(axis: Axis, name: str, loading: Array) -> Array:
    """The loading, for shifts of a linear axis without mean and slope, which are location errors and gains."""
    return loading if axis.rotary or name[1] in TURNS else bent_loading(JOINT_BEND)


def _warm(measured: MeasuredRange) -> list[tuple[dict[str, Any], Array]]:
    """Options and loadings of effects of time and temperatures."""
    found: list[tuple[dict[str, Any], Array]] = []
    if "time_s" in measured.columns:
        first, last = measured.clock
        middle = {"center": (first + last) / 2, "scale": (last - first) / 2}
        found.append(({"basis": spline(), "input": "time_s", **middle}, smooth_loading(TIME_BEND)))
    for name in measured.sensors:
        options = {"basis": Polynomial(degree=(1,)), "input": name, "center": measured.warmth[name][0], "scale": 5.0}
        found.append((options, np.eye(1)))
    return found


def _loaded(measured: MeasuredRange) -> list[tuple[dict[str, Any], Array]]:
    """Options and loading of effects of the load."""
    options = {"basis": Polynomial(degree=(1,)), "input": "load_kg", "center": 0.0, "scale": 100.0}
    return [(options, np.eye(1))] if "load_kg" in measured.columns else []


def unnamed_alternatives(data: ResidualData, named: Sequence[EffectForm]) -> tuple[EffectForm, ...]:
    """All unnamed alternatives; none if the data do not depend on the tool tip.

    The component that a lacking constant explains is removed from them.
    """
    anywhere = list(_smooth_fields(data))
    found = [group for group in (*anywhere, *(_joint_forms(data) if anywhere else ())) if group is not None]
    if any(group.owner.constant for group in named):
        parts = without_lacking_constants(data, (group.columns for group in found), named)
        found = [EffectForm.of(each.owner, each.loading, own) for each, own in zip(found, parts, strict=True)]
    return tuple(_not_in_catalogue(data, found, named))


def _not_in_catalogue(
    data: ResidualData, groups: Sequence[EffectForm], named: Sequence[EffectForm]
) -> list[EffectForm]:
    """The alternatives without single errors that a name can show: these are that name with another shape."""
    basis = orthonormal(data.base / data.relative[:, None])
    single = [(group, errors) for group in groups if (errors := _errors(group))]
    wanted = set().union(*(errors for _, errors in single))
    holding = [(group, errors) for group in named if (errors := _errors(group) & wanted)]
    spans = [_span(left).astype(np.float32) for left in _beside(data, basis, [group for group, _ in holding])]
    shown = [left.astype(np.float32) for left in _beside(data, basis, [group for group, _ in single])]
    held: set[int] = set()
    for error in sorted(wanted):
        by = [span for span, (_, errors) in zip(spans, holding, strict=True) if error in errors and span.shape[1]]
        asked = [k for k, (_, errors) in enumerate(single) if error in errors]
        most = _largest_shown([shown[k] for k in asked], by)
        held |= {k for k, squares in zip(asked, most, strict=True) if squares > SAME_AS_NAME * (shown[k] ** 2).sum()}
    same = {id(single[k][0]) for k in held}
    return [group for group in groups if id(group) not in same]


def _beside(data: ResidualData, basis: Array, groups: Sequence[EffectForm]) -> Iterator[Array]:
    """The columns of each form orthogonal to `basis`, in units of each value's noise."""
    for start in range(0, len(groups), BATCH):
        some = groups[start : start + BATCH]
        columns = side_by_side(group.columns for group in some) / data.relative[:, None]
        yield from np.split(without(basis, columns), column_bounds(some)[1:-1], axis=1)


def _span(columns: Array) -> Array:
    """An orthonormal basis of the span of columns; by their Gram matrix if that is well conditioned."""
    squares, turned = np.linalg.eigh(columns.T @ columns)
    if squares[0] > TOLD * squares[-1]:
        return np.asarray(columns @ (turned / np.sqrt(squares)))
    return orthonormal(columns)


def _largest_shown(parts: Sequence[NDArray[np.float32]], by: Sequence[NDArray[np.float32]]) -> list[float]:
    """For each part, the squares that the best of several orthonormal bases can show."""
    if not by:
        return [0.0] * len(parts)
    squares = (np.concatenate(by, axis=1).T @ np.concatenate(parts, axis=1)) ** 2
    rows = np.cumsum([0, *(each.shape[1] for each in by[:-1])])
    columns = np.cumsum([0, *(each.shape[1] for each in parts[:-1])])
    found: list[float] = np.add.reduceat(np.add.reduceat(squares, rows), columns, axis=1).max(axis=0).tolist()
    return found


def _errors(group: EffectForm) -> set[str]:
    """Names of the errors of a form's effects; with "slow" if these depend on time and temperatures only."""
    return {effect.name for effect in group.owner.effects} | ({"slow"} if group.owner.slow else set())
