"""Contours under cutter radius compensation: made at random, run by LinuxCNC, and judged along the tool's own path.

The interpreter offsets the contour by itself, before and after the correction. Its canonical motions say where the
tool goes, and a machine says where its tip really is then. Nothing here knows how `ncfix` judges corners.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from differential import paths
from differential.canon import ARC, RAPID, Canon
from ncfix.machine import Machine, State

Floats = NDArray[np.float64]
STEP = 0.2
"""mm between places that are looked at."""
NEAR = 0.3
"""mm round a corner that belong to it."""
OFF = 400
"""The code of G40."""


def contour(rng: np.random.Generator, radius: float) -> str:
    """A closed contour of lines and arcs, acute and obtuse corners, fillets among them; with G41 or G42 D1."""
    count = int(rng.integers(4, 10))
    angles = np.sort(rng.uniform(0, 2 * np.pi, count))
    while np.diff(np.append(angles, angles[0] + 2 * np.pi)).max() > 2.6:
        angles = np.sort(rng.uniform(0, 2 * np.pi, count))
    size = rng.uniform(1.0, 12.0) * radius + 6
    middle = rng.uniform(-120, 120, 2)
    points = middle + (size * rng.uniform(0.6, 1.8, count))[:, None] * np.stack([np.cos(angles), np.sin(angles)], 1)
    if rng.random() < 0.5:
        points = points[::-1]
    inside = (rng.random() < 0.5) == (_area(points) > 0)
    side = "G41" if inside == (_area(points) > 0) else "G42"
    lines = [f"G1 X{points[0][0]:.3f} Y{points[0][1]:.3f} F500"]
    begin = (points[0] + points[-1]) / 2
    way = (points[0] - points[-1]) / np.linalg.norm(points[0] - points[-1])
    across = np.array([-way[1], way[0]]) * (1 if side == "G41" else -1)
    start = begin + across * (3.5 * radius) - way * 2 * radius
    lines = [f"G0 X{start[0]:.3f} Y{start[1]:.3f}", f"{side} D1 G1 X{begin[0]:.3f} Y{begin[1]:.3f}"]
    for k in range(count):
        here, there = points[k], points[(k + 1) % count]
        before = points[k - 1]
        lines += _corner(rng, before, here, there)
        if rng.random() < 0.15:
            lines.append(f"Z{rng.uniform(-2, 0):.3f}")
        if rng.random() < 0.2 and not lines[-1].startswith("("):
            lines.append(_bulge(rng, here, there))
    lines.append(f"X{begin[0]:.3f} Y{begin[1]:.3f}")
    away = begin + across * (4 * radius) + way * radius
    lines.append(f"G40 G1 X{away[0]:.3f} Y{away[1]:.3f}")
    return "G21 G17 G90 G94 F500\nT1 M6\nG43 H1\nG0 X0 Y0 Z0\n" + "\n".join(each for each in lines if each) + "\nM2\n"


def _area(points: Floats) -> float:
    x, y = points.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2


def _corner(rng: np.random.Generator, before: Floats, here: Floats, there: Floats) -> list[str]:
    """To a corner; one in three has a fillet that touches both lines."""
    sharp = [f"G1 X{here[0]:.3f} Y{here[1]:.3f}"]
    come, go = here - before, there - here
    lengths = np.linalg.norm(come), np.linalg.norm(go)
    come, go = come / lengths[0], go / lengths[1]
    turn = float(np.arctan2(come[0] * go[1] - come[1] * go[0], come @ go))
    if rng.random() > 0.33 or abs(turn) < 0.1 or abs(turn) > 2.7:
        return sharp
    cut = min(lengths) * rng.uniform(0.1, 0.45)
    size = cut / np.tan(abs(turn) / 2)
    a, b = here - cut * come, here + cut * go
    centre = a + size * np.sign(turn) * np.array([-come[1], come[0]])
    code = "G3" if turn > 0 else "G2"
    i, j = centre - a
    return [f"G1 X{a[0]:.4f} Y{a[1]:.4f}", f"{code} X{b[0]:.4f} Y{b[1]:.4f} I{i:.4f} J{j:.4f}"]


def _bulge(rng: np.random.Generator, here: Floats, there: Floats) -> str:
    """Nothing, or a small step across the way to the next corner: an obtuse corner."""
    way = there - here
    on = here + way * rng.uniform(0.3, 0.7) + np.array([-way[1], way[0]]) * rng.uniform(-0.04, 0.04)
    return f"G1 X{on[0]:.3f} Y{on[1]:.3f}"


# -- the judge --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Judged:
    """How far the tool is from where it should be beside a contour, both ways, um.

    most     anywhere
    corners  (c,) at each corner, within `NEAR` of it, of the path that is meant
    """

    most: float
    corners: Floats


def tips(canon: Canon, machine: Machine, length: float, *, real: bool) -> Floats:
    """Tips (k, 3) of a machine at places along the motions that are offset, in order."""
    rows = np.flatnonzero((canon.side != OFF) & (canon.kind != RAPID))
    way = np.linalg.norm(canon.end[rows, :3] - canon.start[rows, :3], axis=1)
    arcs = canon.kind[rows] == ARC
    if arcs.any():
        spoke = np.linalg.norm(canon.start[rows[arcs], :3] - canon.centre[rows[arcs]], axis=1)
        way[arcs] = spoke * np.abs(paths.sweep(canon, rows[arcs]))
    counts = np.ceil(way / STEP).astype(int) + 1
    share = np.concatenate([np.linspace(0, 1, each) for each in counts])
    at = paths.at(canon, np.repeat(rows, counts), share)[:, ["XYZ".index(letter) for letter in machine.axis_names]]
    return machine.actual_tip(at, State(length)) if real else machine.tip(at, length)


def corners(canon: Canon, machine: Machine, length: float) -> Floats:
    """(c, 3) where one offset motion goes on from another, but for the first, which leads in, and the last."""
    rows = np.flatnonzero((canon.side != OFF) & (canon.kind != RAPID))[1:-1]
    at = canon.end[rows][:, ["XYZ".index(letter) for letter in machine.axis_names]]
    return machine.tip(at, length)


def apart(points: Floats, path: Floats) -> Floats:
    """The distance of points (k, 3) from a path through other points (m, 3), mm."""
    begin, way = path[:-1], np.diff(path, axis=0)
    square = np.maximum((way * way).sum(axis=1), 1e-30)
    result = np.empty(len(points))
    for k, point in enumerate(points):
        share = np.clip(((point - begin) * way).sum(axis=1) / square, 0, 1)
        result[k] = np.sqrt((((begin + share[:, None] * way) - point) ** 2).sum(axis=1).min())
    return result


def judged(canon: Canon, meant: Canon, machine: Machine, length: float) -> Judged:
    """A run of the control on this machine against what another run means."""
    made, ideal = tips(canon, machine, length, real=True), tips(meant, machine, length, real=False)
    there, back = apart(made, ideal), apart(ideal, made)
    found = []
    for corner in corners(meant, machine, length):
        near = [np.linalg.norm(points - corner, axis=1) < NEAR for points in (made, ideal)]
        found.append(max(there[near[0]].max(initial=0.0), back[near[1]].max(initial=0.0)))
    return Judged(1e3 * float(max(there.max(), back.max())), 1e3 * np.array(found))
