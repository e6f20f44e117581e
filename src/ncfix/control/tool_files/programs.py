"""Tool data that controls write as a program: `$TC_DP...` of SINUMERIK, G10 of Fanuc.

- SINUMERIK (`%_N_TO1_TOA` and the like): `$TC_DP3[T, D]=120.5` is length 1 of edge D of the tool with number T; wear
  ($TC_DP12) and base ($TC_DP21) are added to it, and wear $TC_DP15 to the radius $TC_DP6. A tool with lengths along
  the two other axes is taken as of unknown length. Turning tools are skipped, since their length 1 lies along another
  axis. A tool with a name ($TC_TP2) is listed by its name. Tools with the same name are replacement tools: only the
  control knows which one is in the spindle, so they are skipped. Source: Function Manual Tools (W1, WZV).
- Fanuc: `G10 L10 P1 R120.5` sets the length of offset number P; L11 (or L1) its wear, or the whole length in a file
  without L10. An offset that has only a wear is refused, or skipped if the wear is zero. L12 and L13 are radii or
  diameters, depending on a parameter (5004#2), and are skipped, like work offsets (L2, L20). G20 or G21 states the
  unit. A value without a decimal point counts in least increments, whose size the file does not state, and is refused.
  Source: operator's manuals, "Tool compensation values".
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from ncfix.control.coordinates import INCH
from ncfix.control.setup import Tool

Row = tuple[int, tuple[int | str, Tool] | str]
"""Line number, and the number or name of a tool with its data, or a message about the line."""

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
ASSIGNED = re.compile(
    r"\$TC_([A-Z]+)(\d*)\s*\[\s*(\d+)\s*(?:,\s*(\d+)\s*)?\]\s*=\s*(\"[^\"]*\"|[^\s;$]+)", re.IGNORECASE
)
UNIT = re.compile(r"CHANDATA\s*\(\s*(\d+)\s*\)", re.IGNORECASE)
LENGTHS, RADII = (3, 12, 21), (6, 15)
"""Numbers of $TC_DP for length 1 (geometry, wear, base) and for the radius (geometry, wear)."""
CROSS_LENGTHS = {"X": (5, 14, 23), "Y": (4, 13, 22)}
"""Axis -> numbers of $TC_DP for the length along it (lengths 3 and 2, with the plane G17)."""
TURNING = range(500, 600)
"""Numbers of the types of turning tools ($TC_DP1)."""
BESIDES = {"ADP": "adapters of tools", "SCP": "sum offsets", "ECP": "set-up offsets"}
"""Other $TC_ data that lengthen a tool."""

WORD = re.compile(rf"([A-Z])({NUMBER})")
AROUND = re.compile(
    r"(?:N\d+)?(?:[O:]\d+|(?:G(?:90|20|21|17|40|49|80|94))+|(?:G90)?G10(?:G90)?L(?:2|20)P.*|M(?:0?2|30|99))"
)
"""Blocks that may stand among tool offsets and do not change them: program number, settings, work offsets, end."""
INCHES = {"G20": INCH, "G21": 1.0}
GEOMETRY, WEAR, OLD, ACROSS = 10, 11, 1, (12, 13)
"""L of G10: geometry, wear, wear of controls with a single table (or no L at all), and those of cutter radii."""


def is_tool_data(text: str) -> bool:
    """Whether a text has tool data of SINUMERIK: it assigns data of edges ($TC_DP)."""
    return re.search(r"(?im)^[^;\n]*\$TC_DP\d+\s*\[", text) is not None


def tool_data_rows(text: str, scale: float) -> Iterator[Row]:
    """The tools of SINUMERIK's tool data; `scale`: mm per unit of length."""
    edges: dict[tuple[int, int], dict[int, float]] = {}
    names: dict[int, str] = {}
    lines: dict[int, int] = {}
    units: set[str] = set()
    for line, row in enumerate(text.splitlines(), 1):
        units |= {found[1] for found in UNIT.finditer(row.partition(";")[0])}
        for what, number, tool, edge, value in ASSIGNED.findall(row.partition(";")[0]):
            if what.upper() == "TP" and number == "2":
                names[int(tool)] = value.strip('"').strip().upper()
            elif what.upper() == "DP" and edge:
                if not re.fullmatch(NUMBER, value):
                    yield line, f"$TC_DP{number}[{tool},{edge}]: {value!r} is not a number"
                    continue
                edges.setdefault((int(tool), int(edge)), {})[int(number)] = float(value)
                lines.setdefault(int(tool), line)
            elif (more := BESIDES.get(what.upper())) and re.fullmatch(NUMBER, value) and float(value):
                yield line, f"{more} ($TC_{what.upper()}) are not supported"
    if len(units) > 1:
        yield 0, f"tools of several units: CHANDATA {', '.join(sorted(units))}; give those of one"
    taken = list(names.values())
    for (tool, edge), values in edges.items():
        name = names.get(tool, str(tool))
        if int(values.get(1, 0)) in TURNING or taken.count(name) > 1:
            continue
        length, radius = (sum(values.get(each, 0.0) for each in several) * scale for several in (LENGTHS, RADII))
        sizes = {
            letter: sum(values.get(each, 0.0) for each in several) * scale for letter, several in CROSS_LENGTHS.items()
        }
        aside = " ".join(f"{letter}{size:g}" for letter, size in sizes.items() if size)
        key: int | str = int(name) if name.isdecimal() and edge == 1 else name if edge == 1 else f"{name} D{edge}"
        yield lines[tool], (key, Tool(None if aside else length, radius, aside))


def is_offsets(text: str) -> bool:
    """Whether a text has tool offsets written with G10."""
    return any(_offset(block) for _, block in _blocks(text))


def _blocks(text: str) -> Iterator[tuple[int, str]]:
    """Line numbers and blocks of a program, in upper case, without comments, blanks and the marks `%` and `;`."""
    for line, row in enumerate(text.splitlines(), 1):
        plain = "".join(re.sub(r"\([^)]*\)?", "", row).split()).strip("%;").upper()
        if plain:
            yield line, plain


def _offset(block: str) -> dict[str, str]:
    """The values of L (optional), P and R, in any order, of a block that sets an offset; empty for any other block.

    `G` is "90" or "91" if the block has that code.
    """
    words = WORD.findall(block)
    codes = sorted(value for letter, value in words if letter == "G")
    found = [(letter, value) for letter, value in words if letter not in "GN"]
    whole = "".join(map("".join, words)) == block and codes in (["10"], ["10", "90"], ["10", "91"])
    if not whole or sorted(letter for letter, _ in found) not in (["P", "R"], ["L", "P", "R"]):
        return {}
    return dict([*found, *(("G", code) for code in codes[1:])])


def offset_rows(text: str, scale: float) -> Iterator[Row]:
    """The tools by offset number of a file of G10; `scale`: mm per unit of length if the file has no G20 or G21."""
    found: dict[tuple[int, int], tuple[int, float]] = {}
    units: set[float] = set()
    for line, plain in _blocks(text):
        if AROUND.fullmatch(plain):
            units |= {INCHES[code] for code in re.findall(r"G2[01](?!\d)", plain)}
            continue
        words = _offset(plain)
        kind = float(words.get("L", OLD)) if words else 0
        if kind not in (GEOMETRY, WEAR, OLD, *ACROSS) or not words["P"].isdecimal():
            yield line, "is not understood: tool offsets are written as G10 L10 P1 R120.5, with L10 to L13"
        elif words.get("G") == "91":
            yield line, "G91: adds to a value that the file does not give"
        elif "." not in words["R"] and float(words["R"]):
            yield line, "a value without a decimal point: its increment is not given"
        elif kind not in ACROSS:
            key = int(words["P"]), WEAR if kind == OLD else int(kind)
            if key in found:
                yield line, f"offset {key[0]} has two values"
            found[key] = line, float(words["R"])
    if len(units) > 1:
        yield 0, "G20 and G21 in one file"
    scale = min(units, default=scale)
    apart = any(kind == GEOMETRY for _, kind in found)
    for number in dict.fromkeys(number for number, _ in found):
        parts = [found[number, kind] for kind in (GEOMETRY, WEAR) if (number, kind) in found]
        if not apart or (number, GEOMETRY) in found:
            yield parts[0][0], (number, Tool(sum(value for _, value in parts) * scale))
        elif parts[0][1]:
            yield parts[0][0], f"offset {number} has a wear (L11) but no length (L10)"
