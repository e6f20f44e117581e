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


def full_of_klartext_arcs(seed: int, blocks: int, *, comma: bool = False) -> list[str]:
    """Lines and arcs of Klartext: CR, C about poles that serve once or several times, CP with and without a height.

    Between them stand remarks, arcs of other kinds, and words that count from where the tool stands.
    """
    rng = np.random.default_rng(seed)
    place, pole, lines = dict.fromkeys("XYZ", 0.0), None, list[str]()
    while len(lines) < blocks:
        kind = rng.choice(["L", "CR", "C", "CP", "odd"], p=[0.35, 0.25, 0.25, 0.1, 0.05])
        if kind in ("C", "CP") and (pole is None or rng.random() < 0.7):
            angle, size = rng.uniform(0, 2 * math.pi), rng.uniform(1, 9)
            pole = round(place["X"] + size * math.cos(angle), 4), round(place["Y"] + size * math.sin(angle), 4)
            lines.append(f"CC X{pole[0]:+.4f} Y{pole[1]:+.4f}" + str(rng.choice(["", " ; 2.5"])))
            lines += [str(rng.choice(["; remark 3.5", "* - part", "L M8"]))] * (rng.random() < 0.1)
        if kind == "odd":
            lines.append(str(rng.choice(["CT X+1 Y+2", "L IX+1", "; remark", "RND R0.1", "L M9"])))
            place["X"], pole = 1.0, None
            lines.append("L X+1 Y+2")
            place["Y"] = 2.0
            continue
        lines.append(_klartext_arc(rng, place, kind, pole) if kind != "L" else _klartext_line(rng, place))
    numbered = [f"{number} {line}" if seed % 2 else line for number, line in enumerate(lines)]
    return [line.replace(".", ",") if comma else line for line in numbered]


def _klartext_line(rng: np.random.Generator, place: dict[str, float]) -> str:
    named = [letter for letter in "XYZ" if rng.random() < 0.8] or ["X"]
    for letter in named:
        place[letter] = round(place[letter] + float(rng.normal()), 4)
    return " ".join(
        ["L", *(f"{each}{place[each]:+.4f}" for each in named), str(rng.choice(["", "F800", "M8"]))]
    ).rstrip()


def _klartext_arc(
    rng: np.random.Generator, place: dict[str, float], kind: str, pole: tuple[float, float] | None
) -> str:
    """An arc from `place` on, which it is taken to."""
    turn, size = float(rng.choice([rng.uniform(0.1, 6.0), math.pi, math.pi / 2])), float(rng.uniform(1, 9))
    begin, sense = float(rng.uniform(0, 2 * math.pi)), int(rng.choice([-1, 1]))
    x, y = place["X"], place["Y"]
    centre = (x - size * math.cos(begin), y - size * math.sin(begin)) if kind == "CR" or pole is None else pole
    begin, size = math.atan2(y - centre[1], x - centre[0]), math.hypot(x - centre[0], y - centre[1])
    angle = round(math.degrees(turn), 4) * sense
    end = begin + math.radians(angle)
    place["X"], place["Y"] = (centre[0] + size * math.cos(end), centre[1] + size * math.sin(end))
    rises = rng.random() < (0.5 if kind == "CP" else 0.15)
    place["Z"] = round(place["Z"] + 0.25 * rises, 4)
    words = [f"Z{place['Z']:+.4f}"] * rises
    if kind == "CP":
        words = [f"IPA{angle:+.4f}", *words]
    else:
        place["X"], place["Y"] = round(place["X"], 4), round(place["Y"], 4)
        words = [f"X{place['X']:+.4f}", f"Y{place['Y']:+.4f}", *words]
    if kind == "CR":
        words.append(f"R{size if turn <= math.pi else -size:+.{int(rng.integers(4, 7))}f}")
    return " ".join([kind, *words, "DR+" if sense > 0 else "DR-", str(rng.choice(["", "F500", "R0", "M9"]))]).rstrip()
