"""Test whether the error curves of a machine file belong to this machine at all.

Hypothesis "foreign": no curve of the file holds; each is replaced by an unknown curve of the same size and smoothness.
Hypothesis "changed": the file is right, but some of its curves have changed; an unknown curve is added to each of
these, at the price of a further effect. If the file is right, dropping its curves costs far more than keeping them. If
it is foreign, keeping them costs the squares of two unrelated curves instead of one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.special import logsumexp

from ncfix.arrays import Array
from ncfix.diagnosis.evidence import FURTHER, marginal
from ncfix.diagnosis.residual_data import Misfit, is_free, misfit
from ncfix.machine import Effect, Machine
from ncfix.machine.piecewise import PiecewiseLinear
from ncfix.measure.least_squares import orthonormal, without
from ncfix.measure.measurement import Measurement
from ncfix.measure.selection import Selection
from ncfix.values import frozen

SMOOTH = 0.3
"""Correlation length of the values of a table, as a share of its length."""
CHANGES = (0.3, 0.7, 1.4)
"""Assumed sizes of a change, relative to its curve; two unrelated curves of one size differ by the last."""
CLEARLY = 25.0
"""Log odds of "foreign" against "changed" from which on the file is another machine's."""
FREEDOM = 1.0
"""Degrees of freedom of the prior noise."""


def without_foreign_tables(
    measurements: Sequence[Measurement], machine: Machine, now: Misfit
) -> Iterator[tuple[Machine, int, float]]:
    """If no curve of the file holds: the machine with fitted constants only, their number, and the gain of log odds."""
    if machine.is_perfect or all(map(is_free, machine.effects)):
        return
    curves = CurvesOfFile.of(now)
    foreign = curves.foreign
    if foreign - curves.changed < CLEARLY:
        return
    constants = [replace(e, coefficients=(0.0,) * len(e.coefficients)) for e in machine.effects if is_free(e)]
    own = misfit(measurements, machine.replace(effects=tuple(constants))).constants
    fitted = Selection(tuple(constants), (True,) * len(constants)).machine(machine.replace(effects=()), own.tolist())
    yield fitted, len(own), foreign - curves.as_given + now.count * float(np.log(now.left() / now.free))


@frozen(repr=False, slots=False)
class CurvesOfFile:
    """The curves of a machine file and the data, in units of the noise, orthogonal to set-up and constants.

    y        (n,) values minus the prediction of the file
    shown    for each curve, its effect on the values, (n,)
    drawn    for each curve, columns (n, k) of a random curve of its size and smoothness
    freedom  number of values less that of free parameters
    """

    y: Array
    shown: tuple[Array, ...]
    drawn: tuple[Array, ...]
    freedom: int

    @staticmethod
    def of(now: Misfit) -> CurvesOfFile:
        """The curves of the machine file of a misfit."""
        problem, scale = now.problem, now.problem.um / (now.noise * now.relative)
        free = np.concatenate([problem.nuisance(problem.start), problem.design], axis=1) * scale[:, None]
        basis = orthonormal(free)
        y = problem.residual(problem.selection.start, problem.start) * scale
        curves = [effect for effect in problem.machine.effects if effect.active and not is_free(effect)]
        shown, drawn = [], []
        for effect in curves:
            design = np.concatenate([each.design([effect]) for each in problem.observations]) * scale[:, None]
            shown.append(without(basis, design @ np.asarray(effect.coefficients)))
            drawn.append(without(basis, design @ _draws(effect)))
        return CurvesOfFile(without(basis, y), tuple(shown), tuple(drawn), len(y) - basis.shape[1])

    @property
    def as_given(self) -> float:
        """Log likelihood of the given file with free constants."""
        return self._likelihood(self.y, (), 0.0)

    @property
    def foreign(self) -> float:
        """Log likelihood if each curve of the file is replaced by an unknown one of its size."""
        return self._likelihood(self.y + np.sum(self.shown, axis=0), range(len(self.drawn)), 1.0)

    @property
    def changed(self) -> float:
        """Log likelihood if the likeliest set of curves has changed, less their price."""
        price, best = FURTHER + float(np.log(len(self.drawn))), self.as_given
        chosen: tuple[int, ...] = ()
        while len(chosen) < len(self.drawn):
            rest = [(*chosen, k) for k in range(len(self.drawn)) if k not in chosen]
            weights = [self._changed(each) - price * len(each) for each in rest]
            if max(weights) <= best:
                break
            best, chosen = max(weights), rest[int(np.argmax(weights))]
        return best

    def _changed(self, which: Sequence[int]) -> float:
        weights = [self._likelihood(self.y, which, size) for size in CHANGES]
        return float(logsumexp(weights) - np.log(len(CHANGES)))

    def _likelihood(self, y: Array, which: Sequence[int], size: float) -> float:
        """Log likelihood of y with a random curve of relative `size` for each index in `which`."""
        columns = np.concatenate([np.zeros((len(y), 0)), *(size * self.drawn[k] for k in which)], axis=1)
        factor = cholesky(np.eye(columns.shape[1]) + columns.T @ columns, lower=True) if which else np.eye(0)
        gained = solve_triangular(factor, columns.T @ y, lower=True) if which else np.zeros(0)
        determinant = 2 * float(np.log(np.diag(factor)).sum())
        return marginal(float(y @ y - gained @ gained), determinant, self.freedom, FREEDOM)


def _draws(effect: Effect) -> Array:
    """The loading (p, k) from k independent numbers of unit variance to the coefficients of a curve of this size."""
    size = float(np.sqrt(np.mean(np.square(effect.coefficients))))
    if not isinstance(effect.basis, PiecewiseLinear):
        return size * np.eye(effect.basis.size)
    places = np.asarray(effect.basis.positions)
    apart = np.abs(places[:, None] - places) / (SMOOTH * (places[-1] - places[0]))
    return size * np.linalg.cholesky(np.exp(-apart))
