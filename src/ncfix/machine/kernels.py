"""What `chain` does to columns of points and directions, compiled: one pass over memory for many operations.

The operations and their order are those of the plain way, so that the results are the same to the last bit; a test
holds the two together.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library
from ncfix.machine import aim_loops, loops, steps

Array = NDArray[np.float64]

LIBRARY = Library(__name__, (*steps.FORMULAS, *loops.HELPERS, *aim_loops.HELPERS))
ROUTE = "i8[:]", "f8[:]"
COLUMNS = loops.PoseColumns, "f8[:,:]", "f8[:,:]", "f8[:,:]", "f8[:,:]", "f8[:]"

tips = LIBRARY.kernel(*ROUTE, COLUMNS, "f8[:,:]", "f8[:,:]")(loops.tips)
gaps = LIBRARY.kernel(ROUTE, ROUTE, COLUMNS, "f8[:,:]", "i8[:]", "f8[:,:]", "f8[:,:,:]", "f8[:,:]")(loops.gaps)
aim = LIBRARY.kernel(ROUTE, ROUTE, ROUTE, COLUMNS, "i8[:]", "f8[:,:]", "f8[:]", "f8[:,:]", "f8[:,:]")(aim_loops.aim)
placed = LIBRARY.kernel(ROUTE, COLUMNS, "i8[:]", "f8[:,:]", "f8[:,:]", "f8[:,:]", "f8[:,:]")(aim_loops.placed)


@LIBRARY.helper
def small_turn(u: float, v: float, w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """By how much a small rotation vector moves the end of an arm: as `chain.rotated_by`."""
    s = (u * u + v * v) + w * w
    first = 1 - s / 6 * (1 - s / 20 * (1 - s / 42 * (1 - s / 72)))
    second = 0.5 - s / 24 * (1 - s / 30 * (1 - s / 56 * (1 - s / 90)))
    ox, oy, oz = v * z - w * y, w * x - u * z, u * y - v * x
    tx, ty, tz = v * oz - w * oy, w * ox - u * oz, u * oy - v * ox
    return first * ox + second * tx, first * oy + second * ty, first * oz + second * tz


@LIBRARY.kernel("f8[:]", "f8[:]", "f8[:]", "f8[:]", "f8[:,:,:]", "f8[:]", "f8[:,:,:]")
def advanced(d: Array, p: Array, sine: Array, versine: Array, moved: Array, weight: Array, out: Array) -> None:
    """Columns (3, m, n) of weights (m,) after a rotary axis with direction d through p has turned."""
    dx, dy, dz = d[0], d[1], d[2]
    for i in range(moved.shape[1]):
        px, py, pz = p[0] * weight[i], p[1] * weight[i], p[2] * weight[i]
        for k in range(moved.shape[2]):
            x, y, z = moved[0, i, k], moved[1, i, k], moved[2, i, k]
            ax, ay, az = x - px, y - py, z - pz
            ox, oy, oz = dy * az - dz * ay, dz * ax - dx * az, dx * ay - dy * ax
            tx, ty, tz = dy * oz - dz * oy, dz * ox - dx * oz, dx * oy - dy * ox
            s, v = sine[k], versine[k]
            out[0, i, k] = (x + s * ox) + v * tx
            out[1, i, k] = (y + s * oy) + v * ty
            out[2, i, k] = (z + s * oz) + v * tz


@LIBRARY.kernel("f8[:,:]", "f8[:,:]", "f8[:,:]", "f8[:,:,:]", "f8[:]", "f8[:,:,:]")
def forth(r: Array, t: Array, c: Array, moved: Array, weight: Array, out: Array) -> None:
    """Columns (3, m, n) after small motions r, t (3, n) about c (3, n): as `SmallMotion.forth`."""
    for i in range(moved.shape[1]):
        w = weight[i]
        for k in range(moved.shape[2]):
            x, y, z = moved[0, i, k], moved[1, i, k], moved[2, i, k]
            dx, dy, dz = small_turn(r[0, k], r[1, k], r[2, k], x - c[0, k] * w, y - c[1, k] * w, z - c[2, k] * w)
            out[0, i, k] = (x + dx) + t[0, k] * w
            out[1, i, k] = (y + dy) + t[1, k] * w
            out[2, i, k] = (z + dz) + t[2, k] * w


@LIBRARY.kernel("f8[:,:]", "f8[:,:]", "f8[:,:]", "f8[:,:,:]", "f8[:]", "f8[:,:,:]")
def back(r: Array, t: Array, c: Array, moved: Array, weight: Array, out: Array) -> None:
    """The inverse: as `SmallMotion.back`."""
    for i in range(moved.shape[1]):
        w = weight[i]
        for k in range(moved.shape[2]):
            x, y, z = moved[0, i, k] - t[0, k] * w, moved[1, i, k] - t[1, k] * w, moved[2, i, k] - t[2, k] * w
            dx, dy, dz = small_turn(-r[0, k], -r[1, k], -r[2, k], x - c[0, k] * w, y - c[1, k] * w, z - c[2, k] * w)
            out[0, i, k] = x + dx
            out[1, i, k] = y + dy
            out[2, i, k] = z + dz


@LIBRARY.kernel("f8[:]", "f8", "f8", "f8[:]", "f8[:,:,:]", "f8[:]", "f8[:,:,:]")
def turned(r: Array, first: float, second: float, c: Array, moved: Array, weight: Array, out: Array) -> None:
    """Columns (3, m, n) after one rotation r with its factors about c: as `SmallMotion.forth` without translation."""
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
