"""From a layout known at a few nodes to its functions at any position.

At a new position of one axis the correction is linear in the values there of all functions of that axis, with factors
that are known from the nodes of the others: a least-squares problem with a handful of unknowns and one matrix for all
positions. The functions so found are the exact ones where the layout is exact, and the best there are where it is not.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from ncfix.tables.grid import Array
from ncfix.tables.scheme_layout import Layout, Star

SAMPLES = 7
"""Two to this power combinations of nodes of the other axes are looked at for each position."""

Slot = tuple[int, int | None]
"""A function of one axis in a layout: (star, leaf axis), (star, None) its centre, or (-1, axis) a sum."""
Curves = dict[Slot, Array]


@dataclass(frozen=True, slots=True)
class Sample:
    """Where functions of one axis are looked for: combinations of nodes of all axes, (m, n_axes), their numbers."""

    nodes: Sequence[Array]
    places: NDArray[np.intp]

    @classmethod
    def of(cls, nodes: Sequence[Array]) -> Sample:
        """Spread evenly over pairs and triples of axes (a Sobol net)."""
        unit = qmc.Sobol(len(nodes), scramble=False).random_base2(SAMPLES)
        counts = np.array([len(line) for line in nodes])
        return cls(nodes, np.floor(unit * counts).astype(np.intp))

    def poses(self, axis: int, positions: Array) -> Array:
        """The poses with one axis at positions (n,): (n * m, n_axes)."""
        rest = np.stack([line[column] for line, column in zip(self.nodes, self.places.T, strict=True)], axis=1)
        q = np.repeat(rest[None], len(positions), axis=0)
        q[:, :, axis] = positions[:, None]
        return q.reshape(-1, q.shape[-1])

    def curves(self, layout: Layout, axis: int, values: Array) -> Curves:
        """All functions of the layout over this axis, from its values (n, m) at `poses`: slot -> (n,)."""
        slots, known = self._columns(layout, axis)
        if not slots:
            return {}
        design = np.stack(list(slots.values()), axis=1)
        found = np.linalg.lstsq(design, (values - known).T, rcond=None)[0]
        return dict(zip(slots, found, strict=True))

    def _columns(self, layout: Layout, axis: int) -> tuple[Curves, Array]:
        """The factors of the unknown functions, and the sum of all that does not depend on the axis, (m,) each."""
        slots: Curves = {}
        known = np.full(len(self.places), layout.constant)
        for other, values in layout.sums.items():
            if other == axis:
                slots[-1, axis] = np.ones(len(self.places))
            else:
                known += values[self.places[:, other]]
        for number, star in enumerate(layout.stars):
            leaves = {leaf: values[self.places[:, leaf]] for leaf, values in star.leaves.items() if leaf != axis}
            together = sum(leaves.values(), np.zeros(len(self.places)))
            if star.axis == axis:
                slots[number, None] = together
                continue
            centre = star.centre[self.places[:, star.axis]]
            known += centre * together
            if axis in star.leaves:
                slots[number, axis] = centre
        return slots, known


Evaluate = Callable[[Array, int | None], Array]
"""Corrections of all outputs at poses (n, n_axes), (n, n_outputs): without direction, or what changes with a way."""
Layouts = Mapping[int, Sequence[Layout]]
"""Output -> its layouts. The outputs are in the order in which `Evaluate` has them."""


Left = Callable[[int, Array, NDArray[np.intp]], Array]
"""What no layout is to say, without direction, at positions of an axis and nodes of the others: `Remainder.along`."""


def followed(
    sample: Sample, layouts: Layouts, fine: Sequence[Array], evaluate: Evaluate, left: Left | None = None
) -> dict[int, list[Layout]]:
    """The same layouts with their functions at the positions `fine` of each axis."""
    curves: dict[tuple[int, int | None], Curves] = {}
    for axis, positions in enumerate(fine):
        concerned = [(output, one) for output, each in layouts.items() for one in each if axis in one.axes]
        for way in dict.fromkeys(layout.way for _, layout in concerned):
            values = evaluate(sample.poses(axis, positions), way).reshape(len(positions), len(sample.places), -1)
            if left is not None and way is None:
                values = values - left(axis, positions, sample.places)
            for column, output in enumerate(layouts):
                for layout in (one for key, one in concerned if key == output and one.way == way):
                    found = sample.curves(layout, axis, values[:, :, column])
                    curves[output, way] = {**curves.get((output, way), {}), **found}
    return {output: [_with(one, curves.get((output, one.way), {})) for one in each] for output, each in layouts.items()}


def _with(layout: Layout, curves: Curves) -> Layout:
    """The layout with other values."""
    stars = [
        Star(star.axis, curves[number, None], {leaf: curves[number, leaf] for leaf in star.leaves})
        for number, star in enumerate(layout.stars)
    ]
    return Layout({axis: curves[-1, axis] for axis in layout.sums}, tuple(stars), layout.way, layout.constant)
