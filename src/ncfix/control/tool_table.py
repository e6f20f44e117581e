"""Tool tables: LinuxCNC's `.tbl`, Heidenhain's TOOL.T, and CSV with a header.

- LinuxCNC: one tool a line, `T1 P1 Z120.5 D10 ; comment`. Z is the length offset and D the diameter, both in mm here,
  since the machine's unit is mm. Source: LinuxCNC documentation, "Tool table format".
- TOOL.T: columns at fixed places under a line of names. L and R count with their oversizes DL and DR. A tool with an
  index (5.1) and a row without a length are left out. Source: TNC 640 user's manual, "Entering tool data in the table".
"""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator
from pathlib import PurePath

from ncfix.control.setup import Tool
from ncfix.diagnostics import ConfigError, Message, Place
from ncfix.files import read_bytes
from ncfix.inputs import MOST_SAID

BAD_TABLE = "NCF385"
ENTRY = re.compile(r"([A-Za-z])\s*([+-]?(?:\d+\.?\d*|\.\d+))")
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)\Z")
LONGEST = 1e6
"""mm; a number beyond it is a slip."""
COLUMNS = ("tool", "length", "radius", "diameter")


def load_tool_table(path: str) -> dict[int, Tool]:
    """The tools in a control's table, by number: Heidenhain's by its first line, CSV by its suffix, else LinuxCNC's.

    Raises SourceError NCF002, ConfigError NCF385 with every line that is wrong.
    """
    text = read_bytes(path, MOST_SAID).decode("utf-8-sig", "replace")
    reader = csv_rows if PurePath(path).suffix.lower() == ".csv" else linuxcnc_rows
    if is_tool_t(text):
        reader = tool_t_rows
    faults: list[Message] = []
    tools: dict[int, Tool] = {}
    for line, content in reader(text):
        if isinstance(content, str):
            rows = text.splitlines()
            row = rows[line - 1] if 0 < line <= len(rows) else ""
            faults.append(Message(BAD_TABLE, content, Place(path, line, 0, row)))
        elif max(abs(content[1].length or 0.0), abs(content[1].radius or 0.0)) > LONGEST:
            faults.append(Message(BAD_TABLE, f"no tool is longer than {LONGEST:g} mm", Place(path, line)))
        elif content[0] in tools:
            faults.append(Message(BAD_TABLE, f"tool {content[0]} stands twice", Place(path, line)))
        else:
            tools[content[0]] = content[1]
    if not tools and not faults:
        faults.append(Message(BAD_TABLE, "there is no tool in it", Place(path)))
    if faults:
        raise ConfigError.collected(faults)
    return tools


Row = tuple[int, tuple[int, Tool] | str]
"""Line number, and a tool or what is wrong."""


def linuxcnc_rows(text: str) -> Iterator[Row]:
    """The lines of a LinuxCNC table."""
    for line, content in enumerate(text.splitlines(), 1):
        entry = content.partition(";")[0].strip()
        if not entry:
            continue
        rest = ENTRY.sub("", entry).strip()
        values = {letter.upper(): float(number) for letter, number in ENTRY.findall(entry)}
        if rest:
            yield line, f"{rest!r} is not understood in a tool table"
        elif "T" not in values or not values["T"].is_integer():
            yield line, "the line names no tool (T)"
        else:
            radius = values["D"] / 2 if "D" in values else None
            yield line, (int(values["T"]), Tool(values.get("Z", 0.0), radius))


def csv_rows(text: str) -> Iterator[Row]:
    """The rows of a CSV table with a header: `tool`, `length`, and `radius` or `diameter`, mm."""
    rows = [
        (line, row) for line, row in enumerate(csv.reader(text.splitlines()), 1) if any(part.strip() for part in row)
    ]
    if not rows:
        return
    first, names = rows[0][0], [name.strip().lower() for name in rows[0][1]]
    strangers = [name for name in names if name not in COLUMNS]
    if strangers or not {"tool", "length"} <= set(names):
        yield first, f"the columns are {', '.join(COLUMNS)}; found {', '.join(names)}"
        return
    for line, row in rows[1:]:
        yield line, csv_tool(names, [part.strip() for part in row])


def csv_tool(names: list[str], row: list[str]) -> tuple[int, Tool] | str:
    """One tool, or what is wrong with its row."""
    if len(row) != len(names):
        return f"{len(row)} values for {len(names)} columns"
    for name, part in zip(names, row, strict=True):
        if not NUMBER.match(part):
            return f"{name}: {part!r} is not a number (with a decimal point)"
    values = {name: float(part) for name, part in zip(names, row, strict=True)}
    if not values["tool"].is_integer() or values["tool"] < 0:
        return f"{values['tool']:g} is not a tool number"
    radius = values.get("radius", values.get("diameter", math.nan) / 2)
    return int(values["tool"]), Tool(values["length"], None if math.isnan(radius) else radius)


BEGIN = re.compile(r"\s*BEGIN\s+\S*TOOL\S*\s*\.T\b\s*(?P<unit>MM|INCH)?", re.IGNORECASE)
END = re.compile(r"\s*(\[END\]|END\b)", re.IGNORECASE)
TOOL_T_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)\Z")
WANTED = ("L", "R", "DL", "DR")
INCH = 25.4

ToolTRow = tuple[int, tuple[int, Tool] | str]
"""Line number, and a tool or what is wrong."""


def is_tool_t(text: str) -> bool:
    """Whether a text is such a table."""
    return BEGIN.match(text) is not None


def tool_t_rows(text: str) -> Iterator[ToolTRow]:
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
    wrong = [name for name in WANTED if cells.get(name) and not TOOL_T_NUMBER.match(cells[name])]
    if wrong:
        return f"{wrong[0]}: {cells[wrong[0]]!r} is not a number"
    length, radius, longer, wider = (float(cells.get(name, "").replace(",", ".") or 0) * scale for name in WANTED)
    return int(cells["T"]), Tool(length + longer, radius + wider)
