"""Candidates as columns of the data: what each form of an effect would show, with a size of 1 um.

The size is the root mean square over rows of the length of what a row shows, before anything else is fitted. So all
effects compete on one scale, that of the tool tip.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ncfix.diagnose.catalogue import Candidate
from ncfix.diagnose.catalogue.candidate import stacked
from ncfix.diagnose.view import HARDLY, View
from ncfix.measure.measurement import Array
from ncfix.measure.solve import orthonormal, without

VISIBLE = 0.05
"""Share of an effect's squares that must be left beside what is free."""
NEGLIGIBLE = 3e-3
"""Share of a form's squares that may be dropped."""
UNSEEN_UM = 1e-9
HOLDS = tuple(product((-0.5, 0.5), repeat=3))
"""Where what grows is held, in times `view.FAR` its size: in the middle of each eighth of it."""
ABOUT = 0.5 / np.sqrt(3)
"""How far from there it may be, rms, in each direction."""
LED = 0.5
"""Share of a tilt's squares that must be the tilt, not the shifts of a pivot elsewhere: else it has no lever here."""


@dataclass(frozen=True, repr=False)
class Group:
    """One form of a candidate.

    owner     the candidate
    loading   (k, p) from p independent numbers to its coefficients, per um
    columns   (m, p) what those show, um
    """

    owner: Candidate
    loading: Array
    columns: Array


@dataclass(frozen=True, repr=False)
class Gathered:
    """The groups that the data show, and the candidates that they cannot show, with the share that is left."""

    groups: tuple[Group, ...]
    invisible: tuple[tuple[Candidate, float], ...]


def gather(view: View, candidates: Sequence[Candidate]) -> Gathered:
    """All forms of all candidates that can be seen."""
    basis = orthonormal(view.base / view.relative[:, None])
    groups: list[Group] = []
    invisible = []
    every = view.design([effect for candidate in candidates for effect in candidate.effects])
    ends = np.cumsum([0, *(sum(effect.basis.size for effect in each.effects) for each in candidates)])
    for candidate, start, stop in zip(candidates, ends[:-1], ends[1:], strict=True):
        design, loadings = every[:, start:stop], candidate.loadings
        if candidate.grows:
            design, loadings = view.expansion(candidate.effects), tuple(held(loadings))
        forms = [form for loading in loadings if (form := _form(view, candidate, loading, design)) is not None]
        shares = [_left(basis, form.columns / view.relative[:, None]) for form in forms]
        seen = [form for form, share in zip(forms, shares, strict=True) if share >= VISIBLE]
        groups += seen
        if not seen:
            invisible.append((candidate, max(shares, default=0.0)))
    return Gathered(tuple(groups), tuple(invisible))


def held(loadings: Sequence[Array]) -> Iterator[Array]:
    """Loadings of what grows from where it is held: there it stays, so all of it moves by one course.

    One of `HOLDS` in turn; the true place is somewhere about it.
    """
    for course in loadings:
        about = stacked(np.zeros((len(course), 0)), *[ABOUT * course] * 3)
        for place in HOLDS:
            yield np.hstack([np.kron(np.array([[1.0], *([x] for x in place)]), course), about])


def apart(view: View, columns: Array, named: Sequence[Group]) -> Array:
    """Columns without what constants that the machine file lacks would show: that is left to those."""
    constants = [group.columns for group in named if group.owner.constant]
    if not constants:
        return columns
    lacking = np.concatenate(constants, axis=1)
    free = np.concatenate([view.base, lacking], axis=1) / view.relative[:, None]
    size = np.linalg.norm(free, axis=0)
    size = np.where(size > 0, size, 1.0)
    shares = np.linalg.lstsq(free / size, columns / view.relative[:, None], rcond=HARDLY)[0] / size[:, None]
    rest: Array = columns - lacking @ shares[view.base.shape[1] :]
    return rest


def _form(view: View, candidate: Candidate, loading: Array, design: Array) -> Group | None:
    """The form at a size of 1 um, with as few columns as it needs."""
    used = loading.any(axis=1)
    columns = design[:, used] @ loading[used]
    size = view.rms(np.linalg.norm(columns, axis=1))
    if size < UNSEEN_UM or _led(candidate, loading, design) < LED * size**2 * view.count:
        return None
    turned = fewer(columns / size)
    return Group(candidate, loading @ turned / size, columns @ turned / size)


def _led(candidate: Candidate, loading: Array, design: Array) -> float:
    """Squares of what the effect itself shows, without what comes with it; all of it where nothing does."""
    if not candidate.lead:
        return np.inf
    own = slice(0, sum(effect.basis.size for effect in candidate.effects[: candidate.lead]))
    return float(((design[:, own] @ loading[own]) ** 2).sum())


def fewer(columns: Array) -> Array:
    """The rotation (p, r) to as few columns as carry nearly all of their squares."""
    squares, turned = np.linalg.eigh(columns.T @ columns)
    kept: Array = turned[:, np.cumsum(squares) > NEGLIGIBLE * squares.sum()]
    return kept


def _left(basis: Array, columns: Array) -> float:
    return float((without(basis, columns) ** 2).sum() / (columns**2).sum())
