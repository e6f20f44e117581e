"""Five-axis programs of any length for the benchmarks: a smooth surface, milled row by row.

full   every block has all its words: N G1 X Y Z B C F
modal  what did not change is left out, as post-processors do it
mixed  modal, with rapids, comments, arcs, a dwell that may be skipped, a parameter and an expression
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

STYLES = ("full", "modal", "mixed")
HEAD = {
    "full": ["%", "N1 G21 G90 G17 G40 G49 G80 G94", "N5 G0 X0. Y0. Z50. B0. C0."],
    "modal": ["%", "G21 G90 G17 G40 G49 G80 G94", "G0 X0. Y0. Z50. B0. C0."],
    "mixed": [
        "%",
        "(FIVE-AXIS FINISH)",
        "N1 G21 G90 G17 G40 G49 G80 G94",
        "N3 S12000 M3",
        "N5 G0 X0. Y0. Z50. B0. C0.",
    ],
}


def point(k: int, per_row: int, rows: int) -> tuple[float, ...]:
    """X Y Z and the angles of the tool on point k of the surface, mm and degrees."""
    row, place = divmod(k, per_row)
    u = place / (per_row - 1)
    x, y = 400 * (1 - u if row % 2 else u), 400 * row / rows
    z = 12 * math.sin(x / 60) * math.cos(y / 75) + 4 * math.sin((x + y) / 25)
    by_x = 0.2 * math.cos(x / 60) * math.cos(y / 75) + 0.16 * math.cos((x + y) / 25)
    by_y = -0.16 * math.sin(x / 60) * math.sin(y / 75) + 0.16 * math.cos((x + y) / 25)
    b = math.degrees(math.acos(1 / math.sqrt(1 + by_x**2 + by_y**2)))
    return x, y, z, b, math.degrees(math.atan2(-by_y, -by_x)) % 360


def nearer(k: int, per_row: int, rows: int) -> tuple[float, ...]:
    """The same surface half as large and about the middle of the table, so that under TCP no axis leaves its travel."""
    x, y, z, b, c = point(k, per_row, rows)
    return 100 + x / 2, 100 + y / 2, z / 2, b, c


def surface(
    blocks: int, place: Callable[[int, int, int], tuple[float, ...]] = point
) -> Iterator[tuple[int, tuple[float, ...]]]:
    """So many points of the surface, or of the one that `place` gives, row by row: the number of each, and where."""
    rows = max(1, int(math.sqrt(blocks / 6)))
    per_row = max(2, blocks // rows)
    return ((k, place(k, per_row, rows)) for k in range(blocks))


def odd_blocks(k: int, at: tuple[float, ...]) -> list[str]:
    """What interrupts a mixed program at some of its points."""
    x, y, z, b, c = at
    match k % 4001:
        case 1000:
            return [f"(POINT {k})"]
        case 1500:
            return ["/G4 P0.01"]
        case 2000:
            return ["G0 Z60."]
        case 2500:
            here = f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} B{b:.4f} C{c:.4f} F2000."
            there = f"G2 X{x + 2:.4f} Y{y + 2:.4f} I2. J0. F800."
            return [here, there, f"G3 X{x:.4f} Y{y:.4f} Z{z - 0.5:.4f} I-2. J0."]
        case 3000:
            return [f"#100={z:.3f} (SAFE Z)", "G0 Z[#100+5.]"]
    return []


def lines(blocks: int, style: str) -> Iterator[str]:
    """The lines of a program with about so many blocks."""
    yield from HEAD[style]
    last: dict[str, str] = {}
    for k, at in surface(blocks):
        words = dict(zip("XYZBC", (f"{value:.4f}" for value in at), strict=True))
        if style == "full":
            text = " ".join(letter + value for letter, value in words.items())
            yield f"N{10 * (k % 9000) + 10} G1 {text} F{2400 + 10 * (k * 7919 % 60)}.0"
            continue
        odd = odd_blocks(k, at) if style == "mixed" else []
        yield from odd
        changed = [letter + value for letter, value in words.items() if last.get(letter) != value or odd]
        last = words
        yield " ".join((["G1"] if odd or not k else []) + (changed or ["X" + words["X"]]) + ["F2400."] * (k % 211 == 0))
    yield from ("G0 Z100.", "M2", "%")


def write(path: Path, blocks: int, style: str) -> None:
    """Write a program."""
    save(path, lines(blocks, style))


def save(path: Path, text: Iterator[str]) -> None:
    """Write lines into a file."""
    with path.open("w", newline="") as file:
        file.writelines(line + "\n" for line in text)
