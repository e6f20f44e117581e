"""The nearest point of a path to each of many points.

It repeats the numpy code of `compensate.figures.nearest` operation by operation, so the results agree; a test compares
them.
"""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Bytes = NDArray[np.uint8]
    Ints = NDArray[np.int64]
    Array = NDArray[np.float64]


class CurveColumns:
    """The fields of a `figures.curve.Curve`, by the same names."""

    def __init__(self, parabolas: Array, lengths: Array, ways: Array, opens: Bytes, upto: Ints, lying: Ints) -> None:
        self.parabolas, self.lengths, self.ways = parabolas, lengths, ways
        self.opens, self.upto, self.lying = opens, upto, lying
        self.share = self.gap = self.push = 0.0

    def place(self, way: float) -> int:
        """The parabola at an arc length, as `Curve.place`."""
        low, high = 0, self.lengths.shape[0]
        while low < high:
            middle = (low + high) // 2
            if self.lengths[middle] <= way:
                low = middle + 1
            else:
                high = middle
        return max(low - 1, 0)

    def hop(self, piece: int, push: float, one: bool) -> int:
        """The parabola to be searched next, as `Search._hop`."""
        end = self.lengths[piece] + (self.ways[piece] if push > 0 else 0.0)
        at, after = self.upto[self.place(end + (0.0 if one else push))] - 1, self.upto[piece]
        at = max(at, after) if push > 0 else min(at, after - (1 if self.ways[piece] > 0 else 0) - 1)
        return int(self.lying[min(max(at, 0), self.lying.shape[0] - 1)])

    def newton(self, px: float, py: float, pz: float, k: int, share: float, close: float, steps: int) -> int:
        """Find the nearest point of parabola k, as `nearest._newton`.

        `share` and `gap` receive its parameter and its distance, mm; `push` how far the search points beyond the end of
        the parabola, mm.
        """
        p = self.parabolas
        while True:
            x = px - p[0, k] - share * (p[3, k] + share * p[6, k])
            y = py - p[1, k] - share * (p[4, k] + share * p[7, k])
            z = pz - p[2, k] - share * (p[5, k] + share * p[8, k])
            u, v, w = p[3, k] + 2 * share * p[6, k], p[4, k] + 2 * share * p[7, k], p[5, k] + 2 * share * p[8, k]
            square = u * u + v * v + w * w
            size = sqrt(square)
            ahead = (x * u + y * v + z * w) / (size if size > 0 else 1.0)
            outside = (share == 1 and ahead > 0) or (share == 0 and ahead < 0)
            if outside or not abs(ahead) > close or steps == 0:
                self.share, self.gap = share, sqrt(x * x + y * y + z * z)
                self.push = ahead if outside else 0.0
                return 0
            bowed = square - 2 * (x * p[6, k] + y * p[7, k] + z * p[8, k])
            share += ahead * size / (bowed if bowed > square / 4 else square)
            share, steps = min(max(share, 0.0), 1.0), steps - 1

    def down(
        self,
        points: Array,
        expected: Array,
        near: float,
        close: float,
        steps: int,
        hops: int,
        pieces: Ints,
        shares: Array,
        gaps: Array,
    ) -> int:
        """Descend from an expected arc length to the nearest points of the path, as `Search._down`.

        points                (3, n) mm
        expected              (n,) mm, arc length at which each search begins
        near, close           `Search.near` and `nearest.CLOSE`
        steps, hops           `nearest.STEPS` and `HOPS`
        pieces, shares, gaps  (n,) receive parabolas, parameters, and distances, mm
        """
        for row in range(expected.shape[0]):
            x, y, z, piece = points[0, row], points[1, row], points[2, row], self.place(expected[row])
            start = (expected[row] - self.lengths[piece]) / (self.ways[piece] if self.ways[piece] > 0 else 1.0)
            self.newton(x, y, z, piece, min(max(start, 0.0), 1.0), close, steps)
            share, gap, push = self.share, self.gap, self.push
            if gap > near and share == 1 and self.opens[min(piece + 1, self.opens.shape[0] - 1)]:
                push += close
            if gap > near and share == 0 and self.opens[piece]:
                push -= close
            one = False
            for _ in range(hops if self.lying.shape[0] else 0):
                if push == 0:
                    break
                new = self.hop(piece, push, one)
                self.newton(x, y, z, new, 0.0 if push > 0 else 1.0, close, steps)
                if self.gap < gap:
                    piece, share, gap, push, one = new, self.share, self.gap, self.push, False
                elif one:
                    break
                else:
                    one = True
            pieces[row], shares[row], gaps[row] = piece, share, gap
        return 0
