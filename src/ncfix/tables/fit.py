"""Values at nodes by least squares over their neighbourhood, for tables that are linear between nodes.

A node that holds the exact value leaves an error of one sign in both cells beside it; the node that is fitted to what
lies around it shares that error out, and leaves about half of the largest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ncfix.tables.grid import Array

WITHIN = 4
"""Places looked at in each cell along each axis."""


def hats(places: Array, nodes: Array) -> Array:
    """The weight of every node (m) at every place (n), linear between nodes and held beyond the ends: (n, m)."""
    found: Array = np.stack([np.interp(places, nodes, row) for row in np.eye(len(nodes))], axis=1)
    return found


def projector(places: Array, nodes: Array) -> Array:
    """What turns values at places (n) into the values at nodes (m) that come nearest to them in all: (m, n)."""
    found: Array = np.asarray(np.linalg.pinv(hats(places, nodes)), dtype=np.float64)
    return found


def between(nodes: Array, within: int = WITHIN) -> Array:
    """Nodes (n,) and evenly spaced places in the cells between them, ascending: (within (n - 1) + 1,)."""
    share = np.arange(within) / within
    inner = nodes[:-1, None] + share * np.diff(nodes)[:, None]
    found: Array = np.append(inner.reshape(-1), nodes[-1])
    return found


def fitted(values: Array, places: Sequence[Array], nodes: Sequence[Array]) -> Array:
    """Least squares over a regular grid of places: values (*places, k) -> (*nodes, k).

    The weights of a multilinear table are products of those along its axes, so that one axis after another will do.
    """
    for axis, (line, knots) in enumerate(zip(places, nodes, strict=True)):
        summed = np.tensordot(projector(line, knots), values, axes=(1, axis))
        values = np.moveaxis(summed, 0, axis)
    return values
