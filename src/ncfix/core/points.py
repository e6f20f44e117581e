# cython: boundscheck=False, cdivision=True
"""Rigid motions of many points and directions, as `machine.chain` computes them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def fit(moved: Array, weight: Array, out: Array) -> bool:
    """Whether results have the shape of the points, and there is a weight for each of them."""
    same = moved.shape[0] == out.shape[0] == 3 and moved.shape[1] == out.shape[1] == weight.shape[0]
    return bool(same and moved.shape[2] == out.shape[2])


def advanced(d: Array, p: Array, sine: Array, versine: Array, moved: Array, weight: Array, out: Array) -> int:
    """Rotate points (weight 1) and directions (weight 0), (3, m, n), about an axis with direction d through p."""
    if not (
        fit(moved, weight, out)
        and d.shape[0] == p.shape[0] == 3
        and sine.shape[0] == versine.shape[0] == moved.shape[2]
    ):
        raise IndexError("columns of other shapes")
    dx, dy, dz = d[0], d[1], d[2]
    for i in range(moved.shape[1]):
        px, py, pz = p[0] * weight[i], p[1] * weight[i], p[2] * weight[i]
        for k in range(moved.shape[2]):
            x, y, z, s, v = moved[0, i, k], moved[1, i, k], moved[2, i, k], sine[k], versine[k]
            ax, ay, az = x - px, y - py, z - pz
            ox, oy, oz = dy * az - dz * ay, dz * ax - dx * az, dx * ay - dy * ax
            tx, ty, tz = dy * oz - dz * oy, dz * ox - dx * oz, dx * oy - dy * ox
            out[0, i, k] = (x + s * ox) + v * tx
            out[1, i, k] = (y + s * oy) + v * ty
            out[2, i, k] = (z + s * oz) + v * tz
    return 0


def moved_small(r: Array, t: Array, c: Array, back: bool, moved: Array, weight: Array, out: Array) -> int:
    """Move points by rotations r and translations t (3, n) about c (3, n), as `SmallMotion.forth`, or as its `back`."""
    n = moved.shape[2]
    if not (
        fit(moved, weight, out)
        and r.shape[0] == t.shape[0] == c.shape[0] == 3
        and r.shape[1] == t.shape[1] == c.shape[1] == n
    ):
        raise IndexError("columns of other shapes")
    for i in range(moved.shape[1]):
        weighed = weight[i]
        for k in range(n):
            x, y, z = moved[0, i, k], moved[1, i, k], moved[2, i, k]
            u, v, w, tx, ty, tz = r[0, k], r[1, k], r[2, k], t[0, k] * weighed, t[1, k] * weighed, t[2, k] * weighed
            if back:
                x, y, z, u, v, w = x - tx, y - ty, z - tz, -u, -v, -w
            ax, ay, az = x - c[0, k] * weighed, y - c[1, k] * weighed, z - c[2, k] * weighed
            s = (u * u + v * v) + w * w
            first = 1 - s / 6 * (1 - s / 20 * (1 - s / 42 * (1 - s / 72)))
            second = 0.5 - s / 24 * (1 - s / 30 * (1 - s / 56 * (1 - s / 90)))
            ox, oy, oz = v * az - w * ay, w * ax - u * az, u * ay - v * ax
            ex, ey, ez = v * oz - w * oy, w * ox - u * oz, u * oy - v * ox
            x, y, z = x + (first * ox + second * ex), y + (first * oy + second * ey), z + (first * oz + second * ez)
            if not back:
                x, y, z = x + tx, y + ty, z + tz
            out[0, i, k], out[1, i, k], out[2, i, k] = x, y, z
    return 0


def turned(r: Array, first: float, second: float, c: Array, moved: Array, weight: Array, out: Array) -> int:
    """Rotate points by one rotation r about c, as `SmallMotion.forth`; `first`, `second`: the factors of its series."""
    if not (fit(moved, weight, out) and r.shape[0] == c.shape[0] == 3):
        raise IndexError("columns of other shapes")
    u, v, w = r[0], r[1], r[2]
    for i in range(moved.shape[1]):
        cx, cy, cz = c[0] * weight[i], c[1] * weight[i], c[2] * weight[i]
        for k in range(moved.shape[2]):
            x, y, z = moved[0, i, k], moved[1, i, k], moved[2, i, k]
            ax, ay, az = x - cx, y - cy, z - cz
            ox, oy, oz = v * az - w * ay, w * ax - u * az, u * ay - v * ax
            tx, ty, tz = v * oz - w * oy, w * ox - u * oz, u * oy - v * ox
            out[0, i, k] = x + (first * ox + second * tx)
            out[1, i, k] = y + (first * oy + second * ty)
            out[2, i, k] = z + (first * oz + second * tz)
    return 0
