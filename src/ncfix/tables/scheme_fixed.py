"""Table schemes of a fixed form, by S. Esmaeili Marzdashti (PhD thesis, Polytechnique Montreal, 2021).

25Poly-T   chapter 5: each axis is corrected by a cubic polynomial of each axis; sums only.
23Trigo-T  chapter 6: a linear function of each linear axis times a function of one rotary axis, for each linear axis;
           Eq. 44, plus functions of the rotary axis alone, which it lacks (L1, L8 and L15 are constants there, so that
           neither EY0C nor the tool length can be represented).
forward-inverse, chapter 7, for the chain w C A Y F X Z t with A tilted by any angle: exact for the eight location
           errors, the spindle's place and the three gains. In 40 tables, the thesis's number: one for each of the
           functions sin A, cos A, sin 2A, cos^2 A (or sin^2 A), by which linear tables are multiplied. In 20: the
           functions of A are put together, and multiplied by X, Y and Z.

The coefficients are fitted to the exact correction over the working space by least squares.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import RefusedError
from ncfix.machine import Machine
from ncfix.tables.compensation import Compensation
from ncfix.tables.correction import linear_axes, random_poses
from ncfix.tables.scheme import LEVER, Scheme, SchemeTask, lines_of, moving, turning
from ncfix.tables.scheme_tables import Corrections, StagedTables, checked
from ncfix.tables.separable import Star, TableLayout
from ncfix.values import frozen

POSES = 6000
CHAIN = ("C", "A", "Y", "X", "Z")
"""Axes of the chain that the forward-inverse tables are for, from the workpiece to the tool."""
FORWARD_INVERSE_40: Mapping[str, Mapping[str, str]] = {
    "X": {"cos^2": "YZ", "sin 2": "YZ", "sin": "Y", "cos": "Z", "": "XY"},
    "Y": {"sin^2": "XZ", "sin 2": "XZ", "sin": "XZ", "": "Y"},
    "Z": {"cos^2": "XY", "sin 2": "XY", "sin": "Y", "cos": "X", "": "XYZ"},
}
"""Output -> function of A -> the axes whose linear tables are multiplied by it; "": added."""
Function = Callable[[Array], Array]
Basis = Callable[[Array], Array]
"""Positions (n,) -> functions (n, k)."""
TURNS: Mapping[str, Function] = {
    "sin": np.sin,
    "cos": np.cos,
    "sin 2": lambda a: np.sin(2 * a),
    "sin^2": lambda a: np.sin(a) ** 2,
    "cos^2": lambda a: np.cos(a) ** 2,
}


def trigonometric(angle: Array) -> Array:
    """1, cos, sin, cos sin, cos^2 of angles (n,), rad: (n, 5), Eq. 44; its sin^2 is 1 - cos^2 and left out."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.ones_like(c), c, s, c * s, c * c], axis=1)


def _powers(*degrees: int) -> Basis:
    return lambda q: np.stack([(q / 100) ** degree for degree in degrees], axis=1)


def _cubic(rotary: bool, constant: bool) -> Basis:
    degrees = (0, 1, 2, 3) if constant else (1, 2, 3)
    unit = 1.0 if rotary else 100.0
    return lambda q: np.stack([(q / unit) ** degree for degree in degrees], axis=1)


@frozen
class Piece:
    """A table of a fixed form: basis functions of an axis, times a known function of another axis, `centre`, if any."""

    axis: int
    basis: Basis
    centre: tuple[int, Function] | None = None

    def columns(self, q: Array) -> Array:
        """Values of the basis functions at poses q (n, n_axes), (n, k)."""
        own = self.basis(q[:, self.axis])
        if self.centre is None:
            return own
        axis, function = self.centre
        return own * function(q[:, axis])[:, None]


Form = Callable[[int], Sequence[Piece]]
"""Column of an axis -> the tables that correct it."""


def fixed(task: SchemeTask, name: str) -> Scheme:
    """The tables of a scheme: "poly25", "trigo23", "fik40" or "fik20". Raises `RefusedError` NCF484."""
    if name == "trigo23":
        tried = [_made(task, _trigo(task.machine, pivot)) for pivot in _rotary(task.machine, name)]
        return min(tried, key=lambda scheme: scheme.rest)
    return _made(task, _poly(task.machine) if name == "poly25" else _forward_inverse(task.machine, name))


def _poly(machine: Machine) -> Form:
    names = range(len(machine.axes))
    return lambda output: [Piece(axis, _cubic(bool(machine.rotary[axis]), axis == 0)) for axis in names]


def _trigo(machine: Machine, pivot: int) -> Form:
    def form(output: int) -> Sequence[Piece]:
        alone = Piece(pivot, trigonometric)
        if machine.rotary[output]:
            return [alone]
        return [alone, *(Piece(pivot, trigonometric, (axis, _hundreds)) for axis in linear_axes(machine))]

    return form


def _forward_inverse(machine: Machine, name: str) -> Form:
    sides = [axis.workpiece_side for axis in machine.axes]
    if machine.axis_names != CHAIN or sides != [True, True, True, False, False]:
        text = f"{name} needs the topology w C A Y F X Z t; this machine has {machine.topology}"
        raise RefusedError.of("NCF484", text, hint="scheme=auto works for any machine")
    index = {letter: place for place, letter in enumerate(CHAIN)}
    pivot = index["A"]

    def form(output: int) -> Sequence[Piece]:
        alone, letter = Piece(pivot, trigonometric), CHAIN[output]
        if machine.rotary[output]:
            return [alone]
        if name == "fik20":
            others = [index[axis] for axis in "XYZ" if axis != letter]
            return [
                alone,
                Piece(output, _powers(1)),
                *(Piece(pivot, trigonometric, (axis, _hundreds)) for axis in others),
            ]
        pieces = [alone]
        for turn, axes in FORWARD_INVERSE_40[letter].items():
            centre = (pivot, TURNS[turn]) if turn else None
            pieces += [Piece(index[axis], _powers(1), centre) for axis in axes]
        return pieces

    return form


def _hundreds(q: Array) -> Array:
    return q / 100


def _rotary(machine: Machine, name: str) -> list[int]:
    found = np.flatnonzero(machine.rotary).tolist()
    if not found:
        raise RefusedError.of("NCF484", f"{name} needs a rotary axis", hint="scheme=auto works for any machine")
    return found


def _made(task: SchemeTask, form: Form) -> Scheme:
    """The tables of a form: first for rotary axes; linear axes then correct the rest. Raises `RefusedError` NCF484."""
    done = _fitted(task, np.flatnonzero(task.machine.rotary).tolist(), form, turning(task), LEVER)
    moved = _fitted(task, linear_axes(task.machine), form, moving(task, done.tables), 1.0)
    tables = Compensation((*done.tables.terms, *moved.tables.terms))
    count = len({id(grid) for grid in tables.grids})
    if count > task.limits.tables:
        text = f"this scheme needs {count} tables, but the control has {task.limits.tables}"
        raise RefusedError.of("NCF484", text, hint="scheme=auto uses only the tables that the control has")
    return Scheme(tables, moved.missed, moved.rest, 0.0)


def _fitted(task: SchemeTask, outputs: Sequence[int], form: Form, correct: Corrections, scale: float) -> Scheme:
    """The tables that correct some axes, with coefficients by least squares."""
    if not outputs:
        return Scheme(Compensation(()), 0.0, 0.0, 0.0)
    q = random_poses(task.space, POSES, seed=21)
    values, lines = correct(q, np.zeros(q.shape[1])), lines_of(task)
    layouts, missed = {}, 0.0
    for output, target in zip(outputs, values.T, strict=True):
        pieces = list(form(output))
        columns = [piece.columns(q) for piece in pieces]
        design = np.concatenate(columns, axis=1)
        shares = np.linalg.lstsq(design, target, rcond=None)[0]
        missed += float(np.mean((design @ shares - target) ** 2))
        parts = np.split(shares, np.cumsum([column.shape[1] for column in columns])[:-1])
        layouts[output] = [_layout(pieces, parts, [line.fine for line in lines])]
    rest = scale * float(np.sqrt(missed))
    stage = StagedTables(lines, layouts, checked(lines, correct), scale)
    tables, left = stage.settled(max(task.target, rest), task.limits.points)
    return Scheme(tables, left, rest, 0.0)


def _layout(pieces: Sequence[Piece], shares: Sequence[Array], fine: Sequence[Array]) -> TableLayout:
    sums: dict[int, Array] = {}
    stars: dict[tuple[int, Function], dict[int, Array]] = {}
    for piece, share in zip(pieces, shares, strict=True):
        values = piece.basis(fine[piece.axis]) @ share
        if piece.centre is None:
            sums[piece.axis] = sums.get(piece.axis, np.zeros_like(values)) + values
        else:
            stars.setdefault(piece.centre, {})[piece.axis] = values
    made = [Star(axis, function(fine[axis]), leaves) for (axis, function), leaves in stars.items()]
    return TableLayout(dict(sorted(sums.items())), tuple(made))
