"""The way to the nearest point of a curve, compiled: what `nearest.Search` does, one point after the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.kernel import Library

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Mask = NDArray[np.bool_]

LIBRARY = Library(__name__)


class Path(NamedTuple):
    """What a `Curve` calls by the same names."""

    parabolas: Array
    lengths: Array
    ways: Array
    opens: Mask
    upto: Ints
    lying: Ints


@LIBRARY.helper
def place(lengths: Array, way: float) -> int:
    """The parabola in which a way ends: as `Curve.place`."""
    low, high = 0, len(lengths)
    while low < high:
        middle = (low + high) // 2
        if lengths[middle] <= way:
            low = middle + 1
        else:
            high = middle
    return max(low - 1, 0)


@LIBRARY.helper
def hop(path: Path, piece: int, push: float, one: bool) -> int:
    """Where to look next: as `Search._hop`."""
    end = path.lengths[piece] + (path.ways[piece] if push > 0 else 0.0)
    at, after = path.upto[place(path.lengths, end + (0.0 if one else push))] - 1, path.upto[piece]
    at = max(at, after) if push > 0 else min(at, after - (1 if path.ways[piece] > 0 else 0) - 1)
    return int(path.lying[min(max(at, 0), len(path.lying) - 1)])


@LIBRARY.helper
def newton(
    p: Array, point: tuple[float, float, float], k: int, share: float, close: float, steps: int
) -> tuple[float, float, float]:
    """The nearest point of parabola k of `p`: its share, its distance, and how far the way to it goes on.

    As `nearest._newton`.
    """
    while True:
        x = point[0] - p[0, k] - share * (p[3, k] + share * p[6, k])
        y = point[1] - p[1, k] - share * (p[4, k] + share * p[7, k])
        z = point[2] - p[2, k] - share * (p[5, k] + share * p[8, k])
        u, v, w = p[3, k] + 2 * share * p[6, k], p[4, k] + 2 * share * p[7, k], p[5, k] + 2 * share * p[8, k]
        square = u * u + v * v + w * w
        size = np.sqrt(square)
        ahead = (x * u + y * v + z * w) / (size if size > 0 else 1.0)
        outside = (share == 1 and ahead > 0) or (share == 0 and ahead < 0)
        if outside or not abs(ahead) > close or steps == 0:
            return share, np.sqrt(x * x + y * y + z * z), ahead if outside else 0.0
        bowed = square - 2 * (x * p[6, k] + y * p[7, k] + z * p[8, k])
        share += ahead * size / (bowed if bowed > square / 4 else square)
        share, steps = min(max(share, 0.0), 1.0), steps - 1


@LIBRARY.kernel(
    "f8[:,:]",
    "f8[:]",
    (Path, "f8[:,:]", "f8[:]", "f8[:]", "b1[:]", "i8[:]", "i8[:]"),
    ("f8", "f8"),
    ("i8", "i8"),
    ("i8[:]", "f8[:]", "f8[:]"),
)
def down(
    points: Array,
    expected: Array,
    path: Path,
    limits: tuple[float, float],
    most: tuple[int, int],
    found: tuple[Ints, Array, Array],
) -> None:
    """The nearest points that are reached without going away from `points` (3, n): as `Search._down`.

    expected  (n,) mm, the way along the path from where to look
    limits    `Search.near` and `nearest.CLOSE`
    most      `nearest.STEPS` and `HOPS`
    found     parabolas, shares, and distances (n,) mm
    """
    (near, close), (steps, hops), (pieces, shares, gaps) = limits, most, found
    for row in range(len(expected)):
        point, piece = (points[0, row], points[1, row], points[2, row]), place(path.lengths, expected[row])
        share = (expected[row] - path.lengths[piece]) / (path.ways[piece] if path.ways[piece] > 0 else 1.0)
        share, gap, push = newton(path.parabolas, point, piece, min(max(share, 0.0), 1.0), close, steps)
        if gap > near and share == 1 and path.opens[min(piece + 1, len(path.opens) - 1)]:
            push += close
        if gap > near and share == 0 and path.opens[piece]:
            push -= close
        one = False
        for _ in range(hops if len(path.lying) else 0):
            if push == 0:
                break
            new = hop(path, piece, push, one)
            tried, way, further = newton(path.parabolas, point, new, 0.0 if push > 0 else 1.0, close, steps)
            if way < gap:
                piece, share, gap, push, one = new, tried, way, further, False
            elif one:
                break
            else:
                one = True
        pieces[row], shares[row], gaps[row] = piece, share, gap
