"""Tool tables in the formats of controls: LinuxCNC's `.tbl`, Heidenhain's TOOL.T, and CSV with a header.

- LinuxCNC: one tool per line, `T1 P1 Z120.5 D10 ; comment`. Z is the length offset and D the diameter, both in the unit
  of the machine. G43 also adds the offsets of all other axes; a tool that has one is taken as of unknown length. I, J
  and Q describe the nose of a turning tool. Lines above the first tool that are no entries are skipped, as LinuxCNC
  does. Source: LinuxCNC documentation, "Tool table format".
- TOOL.T: columns at fixed places below a line of names; on newer controls, a description of the columns precedes it.
  The oversizes DL and DR are added to L and R. Indexed tools (5.1) and rows without a length are skipped. A word that
  begins in one column and ends in the next is refused, since the columns then are at other places. Source: TNC 640
  user's manual, "Entering tool data in the table".

`ncfix.control.tool_files.programs` reads tool data that is written as a program: of SINUMERIK, and G10 of Fanuc.
"""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping
from pathlib import PurePath

from ncfix.cells import MARKS, Cell, SeparatedText, other_form, plain_text
from ncfix.control.coordinates import INCH
from ncfix.control.setup import Tool
from ncfix.control.tool_files.programs import Row, is_offsets, is_tool_data, offset_rows, tool_data_rows
from ncfix.diagnostics import ConfigError, Message, Place
from ncfix.files import read_bytes
from ncfix.inputs import MAX_CONFIG_BYTES

BAD_TABLE = "NCF385"
ENTRY = re.compile(r"([TPXYZABCUVWDIJQ])\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:E[+-]?\d+)?)(?![\d.E])", re.IGNORECASE)
"""A word of LinuxCNC's tool table."""
OTHER_AXES = "XYABCUVW"
"""Axes other than Z: the length of a tool with an offset along one of them is taken as unknown."""
SHORTEST_TOOL_MM = 15.0
"""Length, mm, that at least one tool of a table in mm exceeds; a tool with its holder is never so short."""
NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)\Z")
MAX_LENGTH_MM = 1e6
"""Largest plausible length or radius, mm; a larger number is a typing error."""
COLUMNS = ("tool", "length", "radius", "diameter")
WORDS = ("name", "description", "comment", "note")
"""Columns of text for people; ncfix ignores them."""
UNITS = {"mm": 1.0, "inch": INCH}
OTHERWISE = "docs/formats.md lists the tables that are read; any other one as CSV with columns tool, length"


def load_tool_table(path: str, axes: Collection[str] = OTHER_AXES, unit: str = "mm") -> dict[int | str, Tool]:
    """The tools in a control's table, by number or by name, as the table calls them. The text shows the format.

    axes  axes of the machine: offsets along others have no effect
    unit  "mm" or "inch", for formats that do not state it

    Raises SourceError NCF002, and ConfigError NCF385 with every wrong line.
    """
    source = read_bytes(path, MAX_CONFIG_BYTES)
    text, (what, hint) = plain_text(source), other_form(source)
    if text is None or what:
        raise ConfigError.of(BAD_TABLE, f"{what or 'not plain text'}, not a tool table", Place(path), hint or OTHERWISE)
    rows = text.splitlines()
    faults: list[Message] = []
    tools: dict[int | str, Tool] = {}
    for line, content in _rows(text, path, axes, UNITS[unit]):
        if isinstance(content, str):
            row = rows[line - 1] if 0 < line <= len(rows) else ""
            faults.append(Message(BAD_TABLE, content, Place(path, line, 0, row)))
        elif max(abs(content[1].length or 0.0), abs(content[1].radius or 0.0)) > MAX_LENGTH_MM:
            faults.append(Message(BAD_TABLE, f"no tool is longer than {MAX_LENGTH_MM:g} mm", Place(path, line)))
        elif content[0] in tools:
            faults.append(Message(BAD_TABLE, f"tool {content[0]} appears twice", Place(path, line)))
        else:
            tools[content[0]] = content[1]
    if not tools and not faults:
        faults.append(Message(BAD_TABLE, "there is no tool in the table", Place(path), OTHERWISE))
    if faults:
        raise ConfigError.collected(faults)
    return tools


def _rows(text: str, path: str, axes: Collection[str], scale: float) -> Iterator[Row]:
    """The rows of a table, lengths in mm, by the reader for its format."""
    if TOOL_T_BEGIN.match(text):
        return tool_t_rows(text)
    if is_tool_data(text):
        return tool_data_rows(text, scale)
    if is_offsets(text):
        return offset_rows(text, scale)
    if PurePath(path).suffix.lower() == ".csv":
        return csv_rows(text, scale)
    return linuxcnc_rows(text, axes, scale)


def may_be_in_inches(tools: Mapping[int | str, Tool]) -> str:
    """A question to the user if all tools are too short for a table in mm; otherwise ""."""
    lengths = [tool.length for tool in tools.values() if tool.length is not None and tool.length > 0]
    if len(lengths) < 2 or max(lengths) > SHORTEST_TOOL_MM:
        return ""
    return f"no tool is longer than {max(lengths):g} mm: is the table in inches?"


def linuxcnc_rows(text: str, axes: Collection[str], scale: float) -> Iterator[Row]:
    """The entries of a LinuxCNC table, for a machine that has these axes."""
    begun = False
    for line, content in enumerate(text.splitlines(), 1):
        entry = content.partition(";")[0].strip()
        begun = begun or re.match(r"[TP]\s*\d", entry, re.IGNORECASE) is not None
        if not entry or not (begun or re.match(r"\d", entry)):
            continue
        rest, words = ENTRY.sub("", entry).strip(), ENTRY.findall(entry.upper())
        values = {letter: float(number) for letter, number in words}
        aside = [f"{letter}{values[letter]:g}" for letter in OTHER_AXES if letter in axes and values.get(letter)]
        if rest:
            yield line, f"{rest!r} does not belong in a tool table"
        elif len(values) < len(words):
            twice = next(letter for letter in values if [each for each, _ in words].count(letter) > 1)
            yield line, f"{twice} appears twice in the line"
        elif "T" not in values or not values["T"].is_integer():
            yield line, "the line names no tool (T)"
        else:
            length, radius = values.get("Z", 0.0) * scale, values["D"] / 2 * scale if "D" in values else None
            yield line, (int(values["T"]), Tool(None if aside else length, radius, " ".join(aside)))


def csv_rows(text: str, scale: float) -> Iterator[Row]:
    """The rows of a CSV table with a header: `tool`, `length`, and `radius` or `diameter`."""
    lines = [(line, row) for line, row in enumerate(text.splitlines(), 1) if row.strip(f"{MARKS} ")]
    if not lines:
        return
    separated = SeparatedText.of(lines[0][1])
    (first, row), *rows = lines
    names = [cell.text.lower() for cell in separated.cells(row, first)]
    strangers = [name for name in names if name not in (*COLUMNS, *WORDS)]
    if strangers or not {"tool", "length"} <= set(names):
        yield first, f"the columns are {', '.join(COLUMNS)}; found {', '.join(names)}"
        return
    if len(set(names)) < len(names):
        yield first, f"a column appears twice: {', '.join(names)}"
        return
    for line, row in rows:
        yield line, csv_tool(names, separated.cells(row, line), separated, scale)


def csv_tool(names: list[str], row: list[Cell], separated: SeparatedText, scale: float) -> tuple[int, Tool] | str:
    """One tool with its number, or a message about its row."""
    if len(row) != len(names):
        return f"{len(row)} values for {len(names)} columns"
    values = {}
    for name, cell in zip(names, row, strict=True):
        if name in WORDS:
            continue
        try:
            plain = separated.plain(cell.text)
        except ValueError as error:
            return f"{name}: {cell.text!r}: {error}"
        if not NUMBER.match(plain):
            return f"{name}: {cell.text!r} is not a number"
        values[name] = float(plain)
    if not values["tool"].is_integer() or values["tool"] < 0:
        return f"{values['tool']:g} is not a tool number"
    radius = values.get("radius", values.get("diameter", math.nan) / 2)
    if "diameter" in values and not math.isclose(radius, values["diameter"] / 2, abs_tol=1e-6):
        return f"radius {radius:g} and diameter {values['diameter']:g} contradict each other"
    return int(values["tool"]), Tool(values["length"] * scale, None if math.isnan(radius) else radius * scale)


TOOL_T_BEGIN = re.compile(r"\s*BEGIN\s+\S*TOOL\S*\s*\.T\b\s*(?P<unit>MM|INCH)?", re.IGNORECASE)
TOOL_T_END = re.compile(r"\s*(\[END\]|END\b)", re.IGNORECASE)
TOOL_T_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)\Z")
WANTED = ("L", "R", "DL", "DR")


def tool_t_rows(text: str) -> Iterator[Row]:
    """The rows of a TOOL.T."""
    lines = text.splitlines()
    head = TOOL_T_BEGIN.match(lines[0])
    at = _past_description(lines)
    names = [(name[0].upper(), name.start()) for name in re.finditer(r"\S+", "".join(lines[at : at + 1]))]
    if head is None or not {"T", "L"} <= {name for name, _ in names}:
        yield at + 1, "this line has no columns T and L"
        return
    if head["unit"] is None:
        yield 1, "the first line does not name the unit, MM or INCH"
        return
    scale = INCH if head["unit"].upper() == "INCH" else 1.0
    stops = [start for _, start in names[1:]] + [None]
    sides = ((start, stop) for (name, start), stop in zip(names, stops, strict=True) if name in ("T", *WANTED))
    edges = {edge for side in sides for edge in side if edge}
    for number, line in enumerate(lines[at:], at + 1):
        if TOOL_T_END.match(line):
            return
        if "\t" in line or any(re.match(r"\S\S", line[edge - 1 : edge + 1]) for edge in edges):
            yield number, "values are not below the names of their columns"
            continue
        if number == at + 1:
            continue
        cells = {name: line[start:stop].strip() for (name, start), stop in zip(names, stops, strict=True)}
        if cells["T"].isdigit() and cells["L"]:
            yield number, tool_of(cells, scale)
        elif line.strip() and not re.fullmatch(r"\d+(\.\d+)?", cells["T"]):
            yield number, f"{cells['T']!r} is not a tool number"


def _past_description(lines: list[str]) -> int:
    """The index of the line of column names: after the description of the columns that newer controls write."""
    begins = lines[1].split(maxsplit=1)[:1] if len(lines) > 1 else []
    end = {"#STRUCTBEGIN": "#STRUCTEND", "TableDescription": ")"}.get("".join(begins))
    if end is None:
        return 1
    return next((n for n, line in enumerate(lines[2:], 3) if line.startswith(end)), len(lines))


def tool_of(cells: dict[str, str], scale: float) -> tuple[int, Tool] | str:
    """One tool with its number, or a message about its row."""
    wrong = [name for name in WANTED if cells.get(name) and not TOOL_T_NUMBER.match(cells[name])]
    if wrong:
        return f"{wrong[0]}: {cells[wrong[0]]!r} is not a number"
    length, radius, longer, wider = (float(cells.get(name, "").replace(",", ".") or 0) * scale for name in WANTED)
    return int(cells["T"]), Tool(length + longer, radius + wider)
