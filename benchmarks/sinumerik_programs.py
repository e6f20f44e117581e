"""Five-axis programs of any length for SINUMERIK 840D: the surface of `programs`, milled row by row under TRAORI.

full     every block has its number and all its words
vectors  the direction of the tool is A3= B3= C3=, without block numbers
mixed    as full, with what interrupts programs of CAM systems: comments, rapids, arcs, tool changes by name, CYCLE800,
         a drilling cycle, increments, inches
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from programs import nearer, save, surface

STYLES = ("full", "vectors", "mixed")
START = "G0 X100. Y100. Z50. B0. C0."
HEAD = (
    "%_N_LONG_MPF",
    ";$PATH=/_N_WKS_DIR/_N_BLISK_WPD",
    "G17 G40 G71 G90 G94",
    "G54",
    'T="BALL_8" M6',
    "D1",
    "S12000 M3",
    "CYCLE832(0.01,_FINISH,1)",
    "TRAORI",
    "ORIWKS",
    "ORIAXES",
    "G642 COMPCAD FFWON",
    START,
)


def change(tool: str) -> list[str]:
    """Another tool, with the tip control off meanwhile."""
    return ["TRAFOOF", "G0 Z200. D0", f'T="{tool}" M6', "D1", "TRAORI", START]


def odd_blocks(k: int, at: tuple[float, ...]) -> list[str]:
    """What interrupts a mixed program at some of its points."""
    x, y, z, b, c = at
    here = f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} B{b:.4f} C{c:.4f} F2000."
    plane = ['CYCLE800(1,"TABLE",0,57,0,0,0,0,0,0,0,0,0,1)', "G0 X20. Y20. Z60.", "G1 X25. F900."]
    match k % 4001:
        case 700:
            return [f"; POINT {k}", f'MSG("ROW {k}")']
        case 1000:
            return [f"G0 Z{z + 20:.3f}", f"G0 X={x:.4f} Y={y:.4f} M8", here]
        case 1500:
            return [here, f"G2 X{x + 2:.4f} Y{y + 2:.4f} I2. J0. F800.", f"G3 X{x:.4f} Y{y:.4f} Z{z:.4f} CR=2.", here]
        case 2000:
            return [*change("BALL_6"), here]
        case 2500:
            return ["TRAFOOF", *plane, "CYCLE800()", "G0 Z100.", "TRAORI", START, here]
        case 3000:
            drilling = [
                "TRAFOOF",
                "G0 X20. Y20. Z50. B0. C0.",
                "MCALL CYCLE81(10,0,2,-3)",
                "X25. Y25.",
                "X30.",
                "MCALL",
            ]
            return [*drilling, "G0 Z60.", "TRAORI", START, here]
        case 3300:
            return ["G91", *["G1 X.01 Y-.01", "G1 X-.01 Y.01"] * 20, "G90", here]
        case 3600:
            return [f"R1={z + 10:.3f}", "G0 Z=R1+5", here]
    return []


def lines(blocks: int, style: str) -> Iterator[str]:
    """The lines of a program with about so many blocks."""
    body = _body(blocks, style)
    if style == "vectors":
        yield from body
        return
    for number, text in enumerate(body):
        yield text if text[0] in "%;" else f"N{10 * number} {text}"


def _body(blocks: int, style: str) -> Iterator[str]:
    yield from HEAD
    for k, at in surface(blocks, nearer):
        x, y, z, b, c = at
        if style == "mixed":
            yield from odd_blocks(k, at)
        if style == "vectors":
            tilt, turn = math.radians(b), math.radians(c)
            way = math.sin(tilt), 0.0, math.cos(tilt)
            i, j = way[0] * math.cos(turn), -way[0] * math.sin(turn)
            code = "G1 " if k == 0 else ""
            yield f"{code}X{x:.4f} Y{y:.4f} Z{z:.4f} A3={i:.7f} B3={j:.7f} C3={way[2]:.7f}" + " F2400." * (k % 211 == 0)
        else:
            yield f"G1 X{x:.4f} Y{y:.4f} Z{z:.4f} B{b:.4f} C{c:.4f} F{2400 + 10 * (k * 7919 % 60)}.0"
    yield from ("TRAFOOF", "G0 Z200.", "M30")


def write(path: Path, blocks: int, style: str) -> None:
    """Write a program."""
    save(path, lines(blocks, style))
