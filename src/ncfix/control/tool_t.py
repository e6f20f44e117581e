"""Heidenhain's tool table TOOL.T: columns at fixed places under a line of names.

Source: TNC 640 user's manual, "Entering tool data in the table". L and R with their oversizes DL and DR count; a tool
with an index (5.1) has no place in a table by number and is left out, and so is a row without a length.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from ncfix.control.setup import Tool

BEGIN = re.compile(r"\s*BEGIN\s+\S*TOOL\S*\s*\.T\b\s*(?P<unit>MM|INCH)?", re.IGNORECASE)
END = re.compile(r"\s*(\[END\]|END\b)", re.IGNORECASE)
NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)\Z")
WANTED = ("L", "R", "DL", "DR")
INCH = 25.4

Row = tuple[int, tuple[int, Tool] | str]
"""Line number, and a tool or what is wrong."""


def is_tool_t(text: str) -> bool:
    """Whether a text is such a table."""
    return BEGIN.match(text) is not None


def tool_t_rows(text: str) -> Iterator[Row]:
    """The rows of the table."""
    lines = text.splitlines()
    head = BEGIN.match(lines[0])
    names = [(name[0].upper(), name.start()) for name in re.finditer(r"\S+", lines[1])] if len(lines) > 1 else []
    if head is None or not {"T", "L"} <= {name for name, _ in names}:
        yield 2, "the second line names no columns T and L"
        return
    scale = INCH if (head["unit"] or "").upper() == "INCH" else 1.0
    stops = [start for _, start in names[1:]] + [None]
    for number, line in enumerate(lines[2:], 3):
        if END.match(line):
            return
        cells = {name: line[start:stop].strip() for (name, start), stop in zip(names, stops, strict=True)}
        if cells["T"].isdigit() and cells["L"]:
            yield number, tool_of(cells, scale)
        elif line.strip() and not re.fullmatch(r"\d+(\.\d+)?", cells["T"]):
            yield number, f"{cells['T']!r} is not a tool number"


def tool_of(cells: dict[str, str], scale: float) -> tuple[int, Tool] | str:
    """One tool, or what is wrong with its row."""
    wrong = [name for name in WANTED if cells.get(name) and not NUMBER.match(cells[name])]
    if wrong:
        return f"{wrong[0]}: {cells[wrong[0]]!r} is not a number"
    length, radius, longer, wider = (float(cells.get(name, "").replace(",", ".") or 0) * scale for name in WANTED)
    return int(cells["T"]), Tool(length + longer, radius + wider)
