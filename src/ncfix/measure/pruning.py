"""Stepwise regression: coefficients that cannot be told from zero are taken out, one at a time (Soons, section 3.3).

The least significant one goes first; one that went comes back if it has become significant. A coefficient that is out
is zero; one that the measurements cannot tell stays at what the machine file says. Tests are two-sided t-tests with the
noise that the residuals show.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import stdtr

from ncfix.machine import Effect
from ncfix.machine.basis import Polynomial
from ncfix.machine.piecewise import Truncated
from ncfix.measure import calibrate
from ncfix.measure.measurement import Array
from ncfix.measure.selection import Selection
from ncfix.measure.solve import without

if TYPE_CHECKING:
    from ncfix.measure.calibrate import Estimate, Problem


def pruned(problem: Problem, estimate: Estimate, level: float, loss: str) -> tuple[Problem, Estimate]:
    """The problem with only the coefficients that are significant at this level, and its solution."""
    chosen = _significant(problem, estimate, 1 - level)
    if chosen.all():
        return problem, estimate
    smaller = _without(problem, chosen)
    return smaller, calibrate.settle(smaller, loss)


def _significant(problem: Problem, estimate: Estimate, risk: float) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which coefficients stay, by backward elimination with a look back after each step."""
    inside = np.zeros(len(estimate.coefficients), dtype=np.bool_)
    inside[estimate.solution.kept] = True
    held = ~inside & (estimate.coefficients != 0)
    root = np.sqrt(estimate.weight) / problem.sigma
    basis = estimate.solution.nuisance
    design = without(basis, problem.design * root[:, None])
    asked = np.where(held, 0.0, estimate.coefficients)
    target = without(basis, (estimate.residual + problem.design @ asked) * root)
    start = int((estimate.weight > 0).sum()) - basis.shape[1]
    banned = set(np.flatnonzero(held).tolist())
    while inside.any():
        chances, left = _chances(design[:, inside], target, start)
        worst = int(np.flatnonzero(inside)[np.argmax(chances)])
        if chances.max() <= risk:
            back = _best_outside(design, left, inside, start, banned)
            if back is None or back[1] > risk:
                break
            inside[back[0]] = True
            banned.add(back[0])
            continue
        inside[worst] = False
    stays: np.ndarray[tuple[int], np.dtype[np.bool_]] = inside | held
    return stays


def _chances(design: Array, target: Array, start: int) -> tuple[Array, Array]:
    """The probability of each estimate by chance, and the residual."""
    orthogonal, triangle = np.linalg.qr(design)
    inverse = np.linalg.inv(triangle)
    value = inverse @ (orthogonal.T @ target)
    left = target - design @ value
    freedom = max(start - design.shape[1], 1)
    deviation = np.sqrt((inverse**2).sum(1) * float(left @ left) / freedom)
    chances: Array = 2 * stdtr(freedom, -np.abs(value) / np.maximum(deviation, 1e-300))
    return chances, left


def _best_outside(
    design: Array, left: Array, inside: np.ndarray[tuple[int], np.dtype[np.bool_]], start: int, banned: set[int]
) -> tuple[int, float] | None:
    """The coefficient outside that would be most significant, once each."""
    orthogonal, _ = np.linalg.qr(design[:, inside])
    best: tuple[int, float] | None = None
    for k in np.flatnonzero(~inside):
        column = without(orthogonal, design[:, k])
        size = float(np.linalg.norm(column))
        if int(k) in banned or size <= 1e-6 * float(np.linalg.norm(design[:, k])):
            continue
        explained = float(column @ left / size)
        freedom = max(start - int(inside.sum()) - 1, 1)
        rest = max(float(left @ left) - explained**2, 1e-300)
        chance = float(2 * stdtr(freedom, -abs(explained) / np.sqrt(rest / freedom)))
        if best is None or chance < best[1]:
            best = int(k), chance
    return best


def _without(problem: Problem, chosen: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Problem:
    """The same problem without the coefficients that are not chosen."""
    effects: list[Effect] = []
    free: list[bool] = []
    at = 0
    for effect, estimated in zip(problem.selection.effects, problem.selection.free, strict=True):
        keep = chosen[at : at + effect.basis.size] if estimated else None
        at += effect.basis.size if estimated else 0
        kept = effect if keep is None else _reduced(effect, keep)
        if kept is not None:
            effects.append(kept)
            free.append(estimated)
    selection = Selection(tuple(effects), tuple(free))
    machine = problem.machine.replace(effects=tuple(effects))
    return calibrate.Problem.of([each.measurement for each in problem.observations], machine, selection)


def _reduced(effect: Effect, keep: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> Effect | None:
    """The effect with fewer powers or knots; None if nothing is left of it. Other bases stay whole if any part does."""
    if not keep.any():
        return None
    if keep.all() or not isinstance(effect.basis, Polynomial | Truncated):
        return effect
    basis = _with_functions(effect.basis, keep)
    values = tuple(c for c, k in zip(effect.coefficients, keep, strict=True) if k)
    return replace(effect, basis=basis, coefficients=values, covariance=None)


def _with_functions(
    basis: Polynomial | Truncated, keep: np.ndarray[tuple[int], np.dtype[np.bool_]]
) -> Polynomial | Truncated:
    """The basis with some of its functions only."""
    if isinstance(basis, Truncated):
        return basis.without_knots(keep)
    return replace(basis, degree=tuple(d for d, k in zip(basis.degree, keep, strict=True) if k))
