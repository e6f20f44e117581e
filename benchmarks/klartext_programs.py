"""Five-axis programs of any length in Heidenhain Klartext: the surface of `programs`, milled row by row.

full   every block has its number and all its words
modal  what did not change is left out, without block numbers
mixed  as full, with what interrupts programs of CAM systems: comments, FMAX, arcs, tool changes, normals, tilted planes
tcp    as mixed, half as large, under control of the tip (M128)
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from programs import point, save, surface

STYLES = ("full", "modal", "mixed", "tcp")
START = "L X+200 Y+200 Z+50 B+0 C+0 FMAX"


def half_as_wide(k: int, per_row: int, rows: int) -> tuple[float, ...]:
    """The surface half as wide and about the middle of the table."""
    x, y, *others = point(k, per_row, rows)
    return 100 + x / 2, 100 + y / 2, *others


def odd_blocks(k: int, at: tuple[float, ...], on: list[str], off: list[str]) -> list[str]:
    """What interrupts a mixed program at some of its points; `on`, `off`: what switches control of the tip."""
    x, y, z, b, c = at
    here = f"L X{x:+.4f} Y{y:+.4f} Z{z:+.4f} B{b:+.4f} C{c:+.4f} F2000"
    match k % 4001:
        case 700:
            return [f"; POINT {k}"]
        case 1000:
            return [f"* - ROW {k}"]
        case 1500:
            return [f"L Z{z + 20:+.3f} FMAX", f"L X{x:+.4f} Y{y:+.4f} FMAX M8"]
        case 2000:
            return [here, f"CC X{x + 2:+.4f} Y{y:+.4f}", f"C X{x + 2:+.4f} Y{y + 2:+.4f} DR- F800"]
        case 2500:
            return [*off, "TOOL CALL 2 Z S8000", *on, START, here]
        case 3000:
            normal = f"LN X{x:+.4f} Y{y:+.4f} Z{z:+.4f} NX+0 NY+0 NZ+1 F2000"
            return [*off, normal, "L R0", *([*on, START, here] if on else [])]
        case 3500:
            lay = ["PLANE SPATIAL SPA+0 SPB+0 SPC+20 STAY", "L X+60 Y+60 Z+50 R0 FMAX", "PLANE RESET STAY"]
            return [*off, "L B+0 C+0 FMAX", *lay, *on, START, here]
    return []


def lines(blocks: int, style: str) -> Iterator[str]:
    """The lines of a program with about so many blocks."""
    body = _body(blocks, style)
    return body if style == "modal" else (f"{number} {text}" for number, text in enumerate(body))


def _body(blocks: int, style: str) -> Iterator[str]:
    on, off = (["M128"], ["M129"]) if style == "tcp" else ([], [])
    yield "BEGIN PGM LONG MM"
    yield from ("BLK FORM 0.1 Z X-10 Y-10 Z-30", "BLK FORM 0.2 X+410 Y+410 Z+20", "TOOL CALL 1 Z S12000", *on, START)
    last: dict[str, str] = {}
    for k, at in surface(blocks, half_as_wide if style == "tcp" else point):
        words = dict(zip("XYZBC", (f"{value:+.4f}" for value in at), strict=True))
        yield from odd_blocks(k, at, on, off) if style in ("mixed", "tcp") else []
        if style == "modal":
            changed = [letter + value for letter, value in words.items() if last.get(letter) != value]
            last = words
            yield " ".join(["L", *(changed or ["X" + words["X"]])] + ["F2400"] * (k % 211 == 0))
        else:
            text = " ".join(letter + value for letter, value in words.items())
            yield f"L {text} F{2400 + 10 * (k * 7919 % 60)}"
    yield from (*off, "L Z+100 R0 FMAX M30", "END PGM LONG MM")


def write(path: Path, blocks: int, style: str) -> None:
    """Write a program."""
    save(path, lines(blocks, style))
