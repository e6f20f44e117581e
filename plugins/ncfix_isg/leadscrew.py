"""Play as leadscrew compensation of single axes (`kw.ssfk`), one axis list for each axis that has some.

What VOLCOMP holds does not know the way an axis moves. The leadscrew compensation of the control does, if it is
bilateral: TF5200 documentation, whose own example says that values are actual position less setpoint, that is errors,
in tenths of a micrometre, with straight lines between them and the end values beyond. It changes the setpoint, and so
does VOLCOMP. Positions are listed one by one, or `interval` apart from `kw_startpos` on; a list that is not bilateral
has the values `pos` for both ways.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np

from ncfix.tables.axis_tables import Reversal
from ncfix.tables.compensation import Term
from ncfix.tables.control import Files
from ncfix.tables.grid import Grid
from ncfix.tables.table_files import Remarks

UNIT = 1e-4
"""mm: of positions and values."""
MOST = 1500
"""Points of a table (P-COMP-00059)."""
MARK = b"kw.ssfk"
"""What tells these lists from that of VOLCOMP."""
NAME = "leadscrew_{}.lis"
HEAD = {"unit": ("", ("1",)), "bilateral": ("0", ("0", "1")), "modulo": ("0", ("0",))}
"""Entry -> its default, and what can be read. No text says which unit is meant if none is given."""
LARGE = 10_000
"""1 mm: no machine has so much."""
POINT = re.compile(r"kw\.ssfk\.table\[(\d{1,6})\]\.(setpoint|pos|neg)")
NOTE = re.compile(r"/\*.*?\*/|#.*")
LETTER = re.compile(r"[A-Za-z](?:[ _-].*)?")
WHOLE = re.compile(r"[-+]?\d{1,12}")


def list_text(reversal: Reversal, number: int) -> bytes:
    """The axis list: errors one way and the other, at the same positions."""
    places = np.rint(reversal.nodes / UNIT).astype(np.int64).tolist()
    errors = np.rint(-reversal.half / UNIT).astype(np.int64).tolist()
    entries: dict[str, object] = {"kopf.achs_nr": number, "kopf.log_achs_name": reversal.axis}
    entries |= {"kw.ssfk.interval": 0, "kw.ssfk.kw_startpos": places[0], "kw.ssfk.kw_nr_max": len(places)}
    entries |= {"kw.ssfk.unit": 1, "kw.ssfk.bilateral": 1}
    for index, (place, error) in enumerate(zip(places, errors, strict=True)):
        table = f"kw.ssfk.table[{index}]"
        entries |= {f"{table}.setpoint": place, f"{table}.pos": error, f"{table}.neg": -error}
    return "".join(f"{name:<32}{value}\n" for name, value in entries.items()).encode()


def read_leadscrews(files: Files, numbers: Mapping[str, str] | None) -> tuple[list[Term], list[Remarks]]:
    """What the axis lists among the files do, with remarks on each.

    numbers: axis -> number in VOLCOMP's list; None if there is none.
    """
    terms: list[Term] = []
    remarks = []
    for name, content in sorted(files.items()):
        if MARK in content:
            found = Remarks.of(name, content, "#")
            remarks.append(found)
            terms += _terms(found, numbers)
    axes = [term.outputs[0] for term in terms[::2]]
    for axis in sorted({axis for axis in axes if axes.count(axis) > 1}):
        remarks[0].refuse(0, f"two lists are for axis {axis}")
    return terms, remarks


def bare(row: str) -> str:
    """A line of a list without its notes, `# ...` and `/* ... */`."""
    return NOTE.sub("", row)


def _terms(remarks: Remarks, numbers: Mapping[str, str] | None) -> Iterator[Term]:
    entries = _entries(remarks)
    axis = _axis(remarks, entries, numbers)
    for name, (default, allowed) in HEAD.items():
        line, found = entries.get(f"kw.ssfk.{name}", (0, default))
        if found not in allowed:
            remarks.refuse(line, f"kw.ssfk.{name} is {found or 'missing'}", f"ncfix reads {' or '.join(allowed)}")
    both = entries.get("kw.ssfk.bilateral", (0, "0"))[1] == "1"
    points = _points(remarks, entries, ("pos", "neg") if both else ("pos",))
    if remarks.wrong:
        return
    if not both and any(point.get("neg", point["pos"]) != point["pos"] for point in points):
        remarks.doubt(0, "values neg that are never used, since kw.ssfk.bilateral is not 1")
    nodes = np.array([point["setpoint"] for point in points], dtype=np.float64) * UNIT
    for key, way in (("pos", 1), ("neg" if both else "pos", -1)):
        values = np.array([-point[key] for point in points], dtype=np.float64) * UNIT
        yield Term((Grid((axis,), (nodes,), (axis,), values[:, None]),), (axis, way))


def _entries(remarks: Remarks) -> dict[str, tuple[int, str]]:
    found: dict[str, tuple[int, str]] = {}
    for number, row in enumerate(remarks.rows, 1):
        words = bare(row).split(None, 1)
        if len(words) == 1:
            remarks.refuse(number, f"{words[0]!r} has no value")
        elif words:
            if words[0] in found:
                remarks.refuse(number, f"{words[0]} is there twice")
            found[words[0]] = (number, words[1].strip())
    return found


def _axis(remarks: Remarks, entries: Mapping[str, tuple[int, str]], numbers: Mapping[str, str] | None) -> str:
    """The letter of the axis: the name may say more than that, `Y-ACHSE`, and the number decides."""
    line, name = entries.get("kopf.log_achs_name", (0, ""))
    axis = name[:1].upper() if LETTER.fullmatch(name) else ""
    if numbers is None:
        return axis
    if axis not in numbers or axis not in "XYZ":
        remarks.refuse(line, f"kopf.log_achs_name is {name or 'missing'}", "a linear axis of the configuration list")
    line, number = entries.get("kopf.achs_nr", entries.get("kopf.log_achs_nr", (0, "")))
    if axis in numbers and number != numbers[axis]:
        remarks.refuse(line, f"kopf.achs_nr is {number or 'missing'}, and the configuration says {numbers[axis]}")
    return axis


def _even(remarks: Remarks, entries: Mapping[str, tuple[int, str]], points: dict[int, dict[str, int]]) -> None:
    """Give points that are an interval apart their positions."""
    line, interval = entries.get("kw.ssfk.interval", (0, "0"))
    start_line, start = entries.get("kw.ssfk.kw_startpos", (0, "0"))
    if not interval.isdecimal():
        remarks.refuse(line, f"kw.ssfk.interval is {interval}", "a whole number of tenths of a micrometre, or 0")
    elif not WHOLE.fullmatch(start):
        remarks.refuse(start_line, f"kw.ssfk.kw_startpos is {start}", "a whole number of tenths of a micrometre")
    elif int(interval):
        for index, point in points.items():
            place = int(start) + index * int(interval)
            if point.setdefault("setpoint", place) != place:
                text = f"point {index} is at {point['setpoint']}, and by start and interval at {place}"
                remarks.refuse(line, text, "interval 0, or no setpoints")
                return


def _points(remarks: Remarks, entries: Mapping[str, tuple[int, str]], ways: tuple[str, ...]) -> list[dict[str, int]]:
    """The points in their order; ways: the values that each must have."""
    points: dict[int, dict[str, int]] = {}
    for name, (line, value) in entries.items():
        match = POINT.fullmatch(name)
        if match is None:
            continue
        if not WHOLE.fullmatch(value):
            remarks.refuse(line, f"{name} is {value}", "a whole number of tenths of a micrometre")
            continue
        if match[2] != "setpoint" and abs(int(value)) > LARGE:
            remarks.refuse(line, f"an error of {int(value) * UNIT:g} mm, which no machine has")
        points.setdefault(int(match[1]), {})[match[2]] = int(value)
    line, count = entries.get("kw.ssfk.kw_nr_max", (0, ""))
    if count != str(len(points)) or sorted(points) != list(range(len(points))):
        remarks.refuse(
            line, f"kw_nr_max is {count or 'missing'}, and there are {len(points)} points", "numbered from 0"
        )
    if not 2 <= len(points) <= MOST:
        remarks.refuse(0, f"{len(points)} points; 2 to {MOST} are possible")
    _even(remarks, entries, points)
    ordered = [points[index] for index in sorted(points)]
    if any(not {"setpoint", *ways} <= point.keys() for point in ordered):
        remarks.refuse(0, f"a point without setpoint, {' and '.join(ways)}")
        return []
    if any(after["setpoint"] <= before["setpoint"] for before, after in pairwise(ordered)):
        remarks.refuse(0, "the setpoints must ascend")
    return ordered
