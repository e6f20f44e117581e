"""Programs full of arcs, written in many ways."""

from __future__ import annotations

import math

import numpy as np

PLANES = {"G17": ("X", "Y", "I", "J"), "G18": ("Z", "X", "K", "I"), "G19": ("Y", "Z", "J", "K")}


def full_of_arcs(seed: int, blocks: int, *, sinumerik: bool = False) -> list[str]:
    """Blocks of lines and arcs in all planes: by R or centre words, some left out, whole and half turns.

    sinumerik  R is CR=, and some centre words count from the origin: I=AC(5.2)
    """
    rng = np.random.default_rng(seed)
    place, plane, lines = dict.fromkeys("XYZ", 0.0), "G17", []
    for _ in range(blocks):
        if rng.random() < 0.1:
            plane = str(rng.choice(list(PLANES)))
            lines.append(plane)
        block = _line(rng, place) if rng.random() < 0.3 else _arc(rng, place, plane, sinumerik)
        lines.append(block.lower() if rng.random() < 0.1 else block)
    return lines


def _joined(rng: np.random.Generator, words: list[str]) -> str:
    return str(rng.choice([" ", " ", ""])).join(words)


def _line(rng: np.random.Generator, place: dict[str, float]) -> str:
    named = [letter for letter in "XYZ" if rng.random() < 0.6] or ["X"]
    for letter in named:
        place[letter] = round(place[letter] + float(rng.normal()), 4)
    return _joined(rng, [str(rng.choice(["G1", "G01", "G0"])), *(f"{each}{place[each]:.4f}" for each in named)])


def _arc(rng: np.random.Generator, place: dict[str, float], plane: str, sinumerik: bool) -> str:
    """An arc from `place` on, which it is taken to; the word of an axis that does not move may be left out."""
    first, second, *centre = PLANES[plane]
    digits, radius, begin = int(rng.integers(2, 5)), float(rng.uniform(1, 9)), float(rng.uniform(0, 2 * math.pi))
    turn = float(rng.choice([rng.uniform(0.1, 6.0), math.pi, math.pi / 2, 2 * math.pi], p=[0.7, 0.1, 0.1, 0.1]))
    begin = float(rng.choice([begin, 0.0, math.pi])) if rng.random() < 0.3 else begin
    code, sign = (("G2", -1), ("G3", 1))[rng.integers(2)]
    way = [round(-radius * each, digits) for each in (math.cos(begin), math.sin(begin))]
    radius, angle = math.hypot(*way), begin + sign * turn
    end = place[first] + way[0] + radius * math.cos(angle), place[second] + way[1] + radius * math.sin(angle)
    before = place.copy()
    place[first], place[second] = round(end[0], 4), round(end[1], 4)
    words = [
        f"{each}{place[each]:.4f}" for each in (first, second) if place[each] != before[each] or rng.random() < 0.5
    ]
    if rng.random() < 0.2:
        across = next(each for each in "XYZ" if each not in (first, second))
        place[across] = round(place[across] + 0.25, 4)
        words.append(f"{across}{place[across]:.4f}")
    by_radius = turn < 6.0 and rng.random() < 0.4
    if by_radius:
        words.append(
            f"{'CR=' if sinumerik else 'R'}{radius if turn <= math.pi else -radius:.{int(rng.integers(4, 7))}f}"
        )
    else:
        words += [f"{name}{value:.{digits}f}" for name, value in zip(centre, way, strict=True) if value]
    if sinumerik and not by_radius and rng.random() < 0.3:
        absolute = dict(zip(centre, (before[first] + way[0], before[second] + way[1]), strict=True))
        words = [f"{word[0]}=AC({absolute[word[0]]:.4f})" if word[0] in absolute else word for word in words]
    if rng.random() < 0.1:
        words.append("F800.")
    return _joined(rng, [code, *words])
