"""Five-axis programs of any length for Fanuc: the surface of `programs`, milled row by row under G43.4.

full   every block has its number and all its words
mixed  as full, with what interrupts programs of CAM systems: comments, rapids, arcs, tool changes, tilted planes, a
       canned cycle, increments, a variable
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from programs import nearer, save, surface

STYLES = ("full", "mixed")
START = "G0 X100. Y100. B0. C0."


def begin(tool: int) -> list[str]:
    """A tool is taken up, and its tip is in control."""
    return [f"T{tool} M6", "S12000 M3", START, f"G43.4 H{tool} Z50."]


def odd_blocks(k: int, at: tuple[float, ...]) -> list[str]:
    """What interrupts a mixed program at some of its points."""
    x, y, z, b, c = at
    here = f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} B{b:.4f} C{c:.4f} F2000."
    plane = ["G68.2 X10. Y10. Z0. I0. J0. K0.", "G53.1", "G43 H1 G0 X20. Y20. Z60.", "G1 X25. F900.", "G49", "G69"]
    match k % 4001:
        case 700:
            return [f"(POINT {k})"]
        case 1000:
            return [f"G0 Z{z + 20:.3f}", f"G0 X{x:.4f} Y{y:.4f} M8", here]
        case 1500:
            return [here, f"G2 X{x + 2:.4f} Y{y + 2:.4f} I2. J0. F800.", f"G3 X{x:.4f} Y{y:.4f} R2.", here]
        case 2000:
            return ["G49", "G53 G0 Z300.", *begin(2), here]
        case 2500:
            return ["G49", "G0 B0. C0.", *plane, "G0 Z100.", *begin(1)[2:], here]
        case 3000:
            return [
                "G49",
                "G0 X20. Y20. Z50. B0. C0.",
                "G81 X25. Y25. Z-3. R2. F200.",
                "X30.",
                "G80",
                *begin(1)[2:],
                here,
            ]
        case 3300:
            return ["G91", *["G1 X.01 Y-.01", "G1 X-.01 Y.01"] * 20, "G90", here]
        case 3600:
            return [f"#100={z + 10:.3f}", "G0 Z[#100+5.]", here]
    return []


def lines(blocks: int, style: str) -> Iterator[str]:
    """The lines of a program with about so many blocks."""
    yield from ("%", "O1234(FIVE-AXIS FINISH)")
    for number, text in enumerate(_body(blocks, style)):
        yield text if text[0] == "(" else f"N{number % 9999 + 1} {text}"
    yield "%"


def _body(blocks: int, style: str) -> Iterator[str]:
    yield from ("G17 G21 G40 G49 G80 G90 G94", "G54", "G5.1 Q1", *begin(1))
    for k, at in surface(blocks, nearer):
        x, y, z, b, c = at
        if style == "mixed":
            yield from odd_blocks(k, at)
        yield f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} B{b:.4f} C{c:.4f} F{2400 + 10 * (k * 7919 % 60)}.0"
    yield from ("G49", "G53 G0 Z300.", "G5.1 Q0", "M30")


def write(path: Path, blocks: int, style: str) -> None:
    """Write a program."""
    save(path, lines(blocks, style))
