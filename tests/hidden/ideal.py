"""An ideal observer: whether the data of a design can tell an effect's name at all, whoever looks at them.

It knows the machine, the set-up's unknowns, the size of the noise, every name that may be said and how its specimens
are drawn (their mean square, from DRAWS of them), that a micrometre of everything is there besides, and of temperatures
what sensors show. It does not know what is hidden. Its odds are those of Gaussian models in closed form, in the mean
over noise and clutter: for data y whitened by these, a name with specimens Z = U d V' (whitened, beside set-up and base
constants) in size s has the log evidence

    -1/2 sum ln(1 + l) + 1/2 sum (a^2 + 1) l / (1 + l),    l = s^2 d^2 / DRAWS,    a = U'y.

Where it cannot tell two names apart, the only right answer is both, and no benchmark may ask for the first of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.random import Generator
from scipy.linalg import cholesky, solve_triangular

from .motion import Array
from .physics import Entry
from .situation import Situation
from .visibility import View, first_order

DRAWS = 24
SIZES_UM = (2.5, 5.0, 10.0, 20.0)
TWENTY_TO_ONE = 3.0


@dataclass(frozen=True)
class Observer:
    """What an ideal observer expects of every name in the data of a design. Lengths in mm.

    `seen` holds, by name, its specimens of rms 1 as observed beside set-up and base constants, (m, draws of all forms);
    `clutter` is the size in which each of them is there anyway.
    """

    sight: View
    seen: Mapping[str, Array]
    sigma: float
    clutter: float

    @cached_property
    def _root(self) -> Array:
        """Cholesky factor of noise and clutter, (m, m)."""
        cover = self.sigma**2 * np.eye(next(iter(self.seen.values())).shape[0])
        for columns in self.seen.values():
            cover += self.clutter**2 / columns.shape[1] * (columns @ columns.T)
        result: Array = cholesky(cover, lower=True)
        return result

    @cached_property
    def _models(self) -> dict[str, tuple[Array, Array]]:
        """Directions and strengths of every name in whitened data."""
        result = {}
        for name, columns in self.seen.items():
            u, d, _ = np.linalg.svd(self._whitened(columns), full_matrices=False)
            result[name] = u, d**2 / columns.shape[1]
        return result

    def _whitened(self, values: Array) -> Array:
        result: Array = solve_triangular(self._root, values, lower=True)
        return result

    def evidence(self, truth: Array) -> dict[str, float]:
        """Expected log evidence of every name when the tip moves by `truth` (n, 3), the largest first."""
        target = self._whitened(self.sight.left(self.sight.observed(truth)))
        found = {name: _evidence(target, *model) for name, model in self._models.items()}
        return dict(sorted(found.items(), key=lambda item: -item[1]))

    def fellows(self, name: str, truth: Array, odds: float = TWENTY_TO_ONE) -> dict[str, float]:
        """Names that would stand beside the true one: those whose log odds against it are not below -`odds`."""
        found = self.evidence(truth)
        return {other: e - found[name] for other, e in found.items() if other != name and e - found[name] > -odds}


def _evidence(target: Array, directions: Array, strength: Array) -> float:
    """Mean over sizes, with the energy that noise and clutter bring in expectation."""
    energy = (directions.T @ target) ** 2 + 1.0
    grown = 1e-6 * np.square(SIZES_UM)[:, None] * strength
    logs = 0.5 * np.sum(energy * grown / (1 + grown) - np.log1p(grown), axis=1)
    return float(np.logaddexp.reduce(logs) - np.log(len(logs)))


def observer(
    rng: Generator,
    s: Situation,
    sight: View,
    sensitivity: Array,
    entries: Iterable[Entry],
    sigma: float,
    clutter: float,
) -> Observer:
    """The observer of a design; `sensitivity` as of `visibility.sensitivities`."""
    seen: dict[str, list[Array]] = {}
    seeds = rng.integers(2**32, size=DRAWS)
    for entry in entries:
        for (
            seed
        ) in seeds:  # the same for all: two names differ by what they do, not by the shapes that chance gave them
            chance = np.random.default_rng(seed)
            guess = replace(s, climate=s.climate.guessed(chance))
            moved = first_order(sensitivity, entry.draw(chance)(guess))
            size = np.sqrt(np.mean(np.sum(moved**2, axis=1))) + 1e-30
            seen.setdefault(entry.name, []).append(sight.observed(moved / size))
    left = {name: sight.left(np.stack(columns, axis=1)) for name, columns in seen.items()}
    return Observer(sight, left, sigma, clutter)
