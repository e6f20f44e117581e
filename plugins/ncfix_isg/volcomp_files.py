"""Files of the ISG kernel: the configuration list of VOLCOMP, grids in ISG_CSV, and leadscrew lists of single axes.

The configuration list has a name and a value per line. A grid has a row for every combination of positions.

Play is written to the leadscrew compensation (`kw.ssfk`), one axis list for each axis with play, because VOLCOMP does
not depend on the direction of motion. The leadscrew compensation does if it is bilateral. By its own example in the
TF5200 documentation, values are actual position minus setpoint, that is errors, in tenths of a micrometre, linear
between points and constant beyond them. It changes the setpoint, and so does VOLCOMP. Positions are listed one by one,
or `interval` apart from `kw_startpos` on; a list that is not bilateral uses the values `pos` for both directions.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import field
from itertools import pairwise

import numpy as np

from ncfix.plugin import Array, Files, Grid, Remarks, Reversal, Term, as_number, full_grid, own_terms, unit_of
from ncfix.values import frozen

LETTERS = tuple("XYZABC")
HEAD = {"workpiece_axes": "0"}
TAIL = {
    "Interpolation": "GRID",
    "enable_splicing": "FALSE",
    "filter_steps": "20",
    "manual_activation": "FALSE",
    "alternative_model": "FALSE",
    "associate_to_channel": "FALSE",
}
FORMAT = "ISG_CSV"
MOST_FILES = 10
LIST = re.compile(rb"(?im)^[ \t]*(?:workpiece_axes|file(?:_format)?\[\d+\])[ \t]")
Entries = dict[str, tuple[int, str]]
FACTORS = {"negate": -1.0, "set_to_zero": 0.0}
"""Entries that name linear axes, such as `negate XY`, and the factor of their compensation."""
OTHERS = {"diagnosis_file": "", "use_axis_offsets": "0"}
"""Optional entries, and the value that each must have, if any."""
SPELT = {name.lower(): name for name in (*HEAD, *TAIL, *FACTORS, *OTHERS)}
"""Lower-case name -> name as documented, because the control ignores case."""
TRUTH = {"1": "TRUE", "0": "FALSE"}
PARAMETER = re.compile(r"E[XYZABC]0?[XYZABC]")
POSITION = re.compile(r"E([XYZ])([XYZABC])")
HEAD_LINES = 100
"""Number of lines among which the header is searched."""
MAX_ERROR_MM = 1.0
"""Largest plausible error, mm; a larger one probably has a wrong unit."""
MAX_SLOPE = 0.01
"""Largest plausible slope of an error, mm per mm or degree."""
Words = tuple[int, list[str]]
SCREW_UNIT = 1e-4
"""Unit of positions and values, mm."""
MOST_SCREW_POINTS = 1500
"""Largest number of points of a table (P-COMP-00059)."""
SCREW_MARK = b"kw.ssfk"
"""Text by which these lists are distinguished from that of VOLCOMP."""
SCREW_FILE = "leadscrew_{}.lis"
SCREW_HEAD = {"unit": ("", ("1",)), "bilateral": ("0", ("0", "1")), "modulo": ("0", ("0",))}
"""Entry -> its default, and the values that can be read. The documentation gives no default for the unit."""
INCREMENTS = "0"
"""Value of `unit` that ncfix cannot run."""
LARGE_SCREW = 10_000
"""Largest plausible value, 1 mm."""
SCREW_POINT = re.compile(r"kw\.ssfk\.table\[(\d{1,6})\]\.(setpoint|pos|neg)")
NOTE = re.compile(r"/\*.*?\*/|#.*")
LETTER = re.compile(r"[A-Za-z](?:[ _-].*)?")
WHOLE = re.compile(r"[-+]?\d{1,12}")


def config_text(
    numbers: Mapping[str, int], folder: str, names: Sequence[str], filter_steps: int, negate: str = ""
) -> bytes:
    """The list: axis numbers, switches, and files; negate: axes whose compensation the control reverses."""
    joint = "" if folder.endswith(("\\", "/")) else "\\"
    entries = {
        **HEAD,
        **{name: str(number) for name, number in numbers.items()},
        **TAIL,
        "filter_steps": str(filter_steps),
        **({"negate": negate} if negate else {}),
    }
    for number, name in enumerate(names):
        entries |= {f"file[{number}]": f"{folder}{joint}{name}", f"file_format[{number}]": FORMAT}
    return "".join(f"{name:<24}{value}\n" for name, value in entries.items()).encode()


@frozen
class Configuration:
    """The content of the list: grid files in order, the logical number of each axis, and factors.

    factors  linear axis -> -1 if named by `negate`, 0 if named by `set_to_zero` (P-VOLC-00009 and following)
    """

    files: tuple[str, ...] = ()
    numbers: Mapping[str, str] = field(default_factory=dict)
    factors: Mapping[str, float] = field(default_factory=dict)


def is_list(content: bytes) -> bool:
    """Whether a file is the list of VOLCOMP: it names grid files, or the position of axes."""
    return LIST.search(content) is not None and SCREW_MARK not in content


def read_configuration(files: Files) -> tuple[Configuration, Remarks]:
    """The list of VOLCOMP, with remarks on it; lists of single axes are ignored."""
    lists = [name for name, content in files.items() if name.lower().endswith(".lis") and SCREW_MARK not in content]
    path = lists[0] if len(lists) == 1 else "volcomp.lis"
    remarks = Remarks.of(path, files[path] if len(lists) == 1 else b"", "#")
    if len(lists) != 1:
        remarks.refuse(0, f"{len(lists)} configuration lists instead of one")
        return Configuration(), remarks
    known = {*SPELT.values(), *LETTERS}
    entries = _entries(remarks, _spelt, lambda name: name in known or name.startswith("file"))
    _check_switches(entries, remarks)
    axes = [name for name in entries if name in LETTERS]
    _check_axes(entries, axes, remarks)
    numbers = {axis: entries[axis][1] for axis in axes}
    return Configuration(tuple(_grid_files(entries, remarks, files)), numbers, _factors(entries, remarks)), remarks


def _entries(
    remarks: Remarks, spelt: Callable[[str], str] = str, known: Callable[[str], bool] = lambda name: True
) -> Entries:
    """Name -> entry of a list, without its comments, `# ...` and `/* ... */`."""
    found: Entries = {}
    for number, row in enumerate(remarks.rows, 1):
        words = NOTE.sub("", row).split(None, 1)
        if len(words) == 1:
            remarks.refuse(number, f"{words[0]!r} has no value")
        elif words:
            name = spelt(words[0])
            if name in found:
                remarks.refuse(number, f"{name} appears twice")
            if not known(name):
                remarks.refuse(number, f"the name {name!r} is not known (error 70468)")
            found[name] = (number, words[1].strip())
    return found


def _spelt(name: str) -> str:
    """A name as spelled in the documentation."""
    if len(name) == 1:
        return name.upper()
    return SPELT.get(name.lower(), name.lower() if name.lower().startswith("file") else name)


def _check_switches(entries: Entries, remarks: Remarks) -> None:
    for name, value in (("workpiece_axes", "0"), ("Interpolation", "GRID"), ("alternative_model", "FALSE")):
        line, found = entries.get(name, (0, ""))
        if _truth(found) != value and found != value:
            remarks.refuse(line, f"{name} is {found or 'missing'}", f"these grids need {name} {value}")
    line, steps = entries.get("filter_steps", (0, "0"))
    if not steps.isdecimal():
        remarks.refuse(line, f"filter_steps is {steps}", "a whole number")
    line, manual = entries.get("manual_activation", (0, "FALSE"))
    if _truth(manual) not in TRUTH.values():
        remarks.refuse(line, f"manual_activation is {manual}", "TRUE or FALSE")


def _factors(entries: Entries, remarks: Remarks) -> dict[str, float]:
    found: dict[str, float] = {}
    for name, factor in FACTORS.items():
        line, axes = entries.get(name, (0, ""))
        letters = axes.strip('"').upper()
        if not set(letters) <= set("XYZ"):
            remarks.refuse(line, f"{name} is {axes}", "linear axes of the list, such as XY")
        found |= dict.fromkeys(letters, factor)
    line, offsets = entries.get("use_axis_offsets", (0, "0"))
    if _truth(offsets) != "FALSE":
        remarks.refuse(line, f"use_axis_offsets is {offsets}: what the offsets are is in no file", "0")
    return found


def _truth(value: str) -> str:
    return TRUTH.get(value, value.upper())


def _check_axes(entries: Entries, axes: list[str], remarks: Remarks) -> None:
    seen: dict[str, str] = {}
    for axis in axes:
        line, number = entries[axis]
        if not number.isdecimal():
            remarks.refuse(line, f"the number of axis {axis} is {number}")
        elif number in seen:
            remarks.refuse(line, f"axes {seen[number]} and {axis} have the same number {number}")
        seen[number] = axis


def _grid_files(entries: Entries, remarks: Remarks, files: Files) -> list[str]:
    """Names, as in `files`, of the listed grids in their order."""
    found = []
    for index in range(MOST_FILES):
        line, path = entries.get(f"file[{index}]", (0, ""))
        if not path:
            break
        form_line, form = entries.get(f"file_format[{index}]", (line, ""))
        if form.upper() != FORMAT:
            remarks.refuse(form_line, f"file_format[{index}] is {form or 'missing'}", FORMAT)
        name = path.strip('"').replace("\\", "/").rsplit("/", 1)[-1]
        here = [each for each in files if each.lower() == name.lower()]
        if not here:
            remarks.refuse(line, f"the file {name} is missing")
        else:
            found.append(name if name in here else here[0])
    if not remarks.wrong:
        _check_listing(entries, remarks, len(found))
    return found


def _check_listing(entries: Entries, remarks: Remarks, count: int) -> None:
    """Check that files are numbered from 0 without a gap, and that there is at least one."""
    known = {f"{key}[{index}]" for index in range(count) for key in ("file", "file_format")}
    stray = next((name for name in entries if name.startswith("file") and name not in known), None)
    if stray is not None:
        hint = f"file[0] to file[{MOST_FILES - 1}] in order"
        remarks.refuse(entries[stray][0], f"{stray} does not follow on", hint)
    elif not count:
        remarks.refuse(0, "names no file")


def parameters(grid: Grid, owner: str = "") -> list[str]:
    """The names of a grid's values: errors along its outputs, of the axis `owner`, or each of its own axis."""
    return [f"E{name}{owner or name}" for name in grid.outputs]


def grid_text(grid: Grid, owner: str = "") -> bytes:
    """The file of a grid of corrections: errors (the opposite sign) in mm; positions in mm and degree."""
    units = [unit_of(name) for name in grid.inputs]
    lines = [nodes / unit for nodes, unit in zip(grid.nodes, units, strict=True)]
    values = np.round(-grid.values.reshape(-1, len(grid.outputs)), 6) + 0.0
    head = " ".join([*grid.inputs, *parameters(grid, owner)])
    places = np.round(full_grid(lines), 6) + 0.0
    rows = []
    for at, errors in zip(places.tolist(), values.tolist(), strict=True):
        position = (f"{place:g}" if place == round(place, 3) else f"{place:.6f}" for place in at)
        rows.append(" ".join([*position, *(f"{error:.6f}" for error in errors)]))
    comment = "// ncfix: errors in mm, positions in mm and degree; assumptions ISG-1 to ISG-5, see hand-over.md"
    return "".join(f"{row}\n" for row in [comment, head, *rows]).encode()


def is_grid(content: bytes) -> bool:
    """Whether the first line that is no comment names positions, then errors."""
    parts = _parts(content.decode("latin-1").splitlines()[:HEAD_LINES])
    words = [word.upper() for word in parts[0][0][1]] if parts else []
    return len(words) > 1 and words[0] in LETTERS and PARAMETER.fullmatch(words[-1]) is not None


def read_grids(names: Sequence[str], axes: Collection[str], files: Files) -> tuple[list[Grid], list[Remarks]]:
    """The grids of corrections in these files, with remarks on each file; axes: letters allowed as inputs."""
    grids: list[Grid] = []
    remarks = []
    seen: dict[str, str] = {}
    for name in names:
        found = Remarks.of(name, files[name], "//")
        found.doubt_end()
        remarks.append(found)
        parts = _parts(found.rows)
        if not parts:
            found.refuse(0, "is empty")
        for (head_line, names_of), *rows in parts:
            head = [word.upper() for word in names_of]
            inputs, outputs = _header(found, head_line, head, axes, seen)
            table = _numbers(found, rows, len(head))
            if not found.wrong:
                grids += _grids(found, [number for number, _ in rows], inputs, outputs, table)
    return grids, remarks


def _parts(rows: Sequence[str]) -> list[list[Words]]:
    """The lines of each table, split into words, without comments; a line that begins with # separates two tables."""
    parts: list[list[Words]] = [[]]
    for number, row in enumerate(rows, 1):
        if row.lstrip().startswith("#"):
            parts.append([])
        elif words := row.split("//", 1)[0].split():
            parts[-1].append((number, words))
    return [part for part in parts if part]


def _header(
    remarks: Remarks, line: int, head: Sequence[str], axes: Collection[str], seen: dict[str, str]
) -> tuple[list[str], list[str]]:
    inputs = [word for word in head if word in LETTERS]
    outputs = [word for word in head if word not in inputs]
    if list(head) != [*inputs, *outputs] or not inputs or not outputs:
        remarks.refuse(line, "the header should name arguments first, then parameters", "e.g. X Y Z EXX EYY EZZ")
    for word in sorted(set(inputs) - set(axes)):
        remarks.refuse(line, f"the argument {word} has no axis number in the configuration")
    for word in outputs:
        if not PARAMETER.fullmatch(word):
            remarks.refuse(line, f"the parameter {word!r} is not known (error 70468)", "ISO 230-1 names")
        elif not POSITION.fullmatch(word):
            remarks.refuse(line, f"{word}: ncfix runs position errors only, not angles and locations")
    for word in head:
        if list(head).count(word) > 1 or (word in outputs and word in seen):
            remarks.refuse(line, f"{word} appears twice (error 70469)")
            break
    seen.update(dict.fromkeys(outputs, remarks.path))
    return inputs, outputs


def _numbers(remarks: Remarks, rows: Sequence[tuple[int, list[str]]], width: int) -> Array:
    table = []
    for number, words in rows:
        if len(words) != width:
            remarks.refuse(number, f"{len(words)} values under {width} names")
            continue
        values = [as_number(word) for word in words]
        if None in values:
            comma = any("," in word for word in words)
            endless = any(word.strip("+-").lower() in ("nan", "inf", "infinity") for word in words)
            other = "a value that is not finite" if endless else "something that is not a number"
            remarks.refuse(number, "a decimal comma" if comma else other)
            continue
        table.append(values)
    return np.array(table, dtype=np.float64).reshape(-1, width)


def _grids(
    remarks: Remarks, lines: Sequence[int], inputs: Sequence[str], outputs: Sequence[str], table: Array
) -> list[Grid]:
    """One grid for all outputs, if the rows form a regular grid; errors in the same direction are added."""
    places, values = table[:, : len(inputs)], table[:, len(inputs) :]
    nodes = [np.unique(column) for column in places.T]
    counts = tuple(len(line) for line in nodes)
    at = tuple(np.searchsorted(line, column) for line, column in zip(nodes, places.T, strict=True))
    filled = np.zeros(counts, dtype=np.intp)
    np.add.at(filled, at, 1)
    if filled.size == 0 or (filled != 1).any():
        twice = int((filled > 1).sum())
        shape = " x ".join(map(str, counts))
        text = (
            f"{len(table)} rows are no regular grid {shape}: {int((filled == 0).sum())} nodes missing, {twice} double"
        )
        remarks.refuse(0, f"{text} (error 70471)", "GRID needs every combination of the positions once")
        return []
    for row in np.flatnonzero(np.abs(values).max(axis=1) > MAX_ERROR_MM)[:1]:
        text = f"an error of {np.abs(values[row]).max():g} mm, which no machine has"
        remarks.refuse(lines[row], text, "values are in mm, not um")
    ordered = np.zeros((*counts, len(outputs)))
    ordered[at] = values
    _look_for_jumps(remarks, nodes, ordered)
    units = [unit_of(name) for name in inputs]
    scaled = tuple(line * unit for line, unit in zip(nodes, units, strict=True))
    axes = tuple(sorted({name[1] for name in outputs}))
    error = np.stack([sum(ordered[..., i] for i, name in enumerate(outputs) if name[1] == axis) for axis in axes], -1)
    return [Grid(tuple(inputs), scaled, axes, -error)]


def _look_for_jumps(remarks: Remarks, nodes: Sequence[Array], values: Array) -> None:
    """Remark on an input along which neighbouring values differ by more than is plausible."""
    for axis, line in enumerate(nodes):
        if len(line) > 1:
            steps = np.diff(line).reshape([-1 if i == axis else 1 for i in range(values.ndim)])
            slope = float(np.abs(np.diff(values, axis=axis) / steps).max())
            if slope > MAX_SLOPE:
                remarks.doubt(0, f"an error changes by {slope:.3g} mm per unit along input {axis + 1}", "a slip?")


def list_text(reversal: Reversal, number: int) -> bytes:
    """The axis list: errors for both directions at the same positions."""
    places = np.rint(reversal.nodes / SCREW_UNIT).astype(np.int64).tolist()
    errors = np.rint(-reversal.half / SCREW_UNIT).astype(np.int64).tolist()
    entries: dict[str, object] = {"kopf.achs_nr": number, "kopf.log_achs_name": reversal.axis}
    entries |= {"kw.ssfk.interval": 0, "kw.ssfk.kw_startpos": places[0], "kw.ssfk.kw_nr_max": len(places)}
    entries |= {"kw.ssfk.unit": 1, "kw.ssfk.bilateral": 1}
    for index, (place, error) in enumerate(zip(places, errors, strict=True)):
        table = f"kw.ssfk.table[{index}]"
        entries |= {f"{table}.setpoint": place, f"{table}.pos": error, f"{table}.neg": -error}
    return "".join(f"{name:<32}{value}\n" for name, value in entries.items()).encode()


def read_leadscrews(files: Files, numbers: Mapping[str, str] | None) -> tuple[list[Term], list[Remarks]]:
    """The effect of the axis lists among the files, with remarks on each.

    numbers: axis -> number in VOLCOMP's list; None if there is none.
    """
    terms: list[Term] = []
    remarks = []
    for name, content in sorted(files.items()):
        if SCREW_MARK in content:
            found = Remarks.of(name, content, "#")
            remarks.append(found)
            terms += _terms(found, numbers)
    axes = [term.outputs[0] for term in terms[::2]]
    for axis in sorted({axis for axis in axes if axes.count(axis) > 1}):
        remarks[0].refuse(0, f"two lists are for axis {axis}")
    return terms, remarks


def _terms(remarks: Remarks, numbers: Mapping[str, str] | None) -> Iterator[Term]:
    entries = _entries(remarks)
    axis = _axis(remarks, entries, numbers)
    for name, (default, allowed) in SCREW_HEAD.items():
        line, found = entries.get(f"kw.ssfk.{name}", (0, default))
        if numbers is None and (name, found) == ("unit", INCREMENTS):
            remarks.doubt(line, "values are increments: how large they are only the control knows")
        elif found not in allowed:
            remarks.refuse(line, f"kw.ssfk.{name} is {found or 'missing'}", f"ncfix reads {' or '.join(allowed)}")
    both = entries.get("kw.ssfk.bilateral", (0, "0"))[1] == "1"
    points = _points(remarks, entries, ("pos", "neg") if both else ("pos",))
    if remarks.wrong:
        return
    if not both and any(point.get("neg", point["pos"]) != point["pos"] for point in points):
        remarks.doubt(0, "values neg that are never used, since kw.ssfk.bilateral is not 1")
    nodes = np.array([point["setpoint"] for point in points], dtype=np.float64) * SCREW_UNIT
    ahead, back = ([-point[key] for point in points] for key in ("pos", "neg" if both else "pos"))
    yield from own_terms(axis, nodes, *(np.array(way, dtype=np.float64) * SCREW_UNIT for way in (ahead, back)))


def _axis(remarks: Remarks, entries: Entries, numbers: Mapping[str, str] | None) -> str:
    """The letter of the axis; its name may be longer, `Y-ACHSE`. The number must agree with the configuration."""
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


def _even(remarks: Remarks, entries: Entries, points: dict[int, dict[str, int]]) -> None:
    """Give points without setpoints their positions from start and interval."""
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


def _points(remarks: Remarks, entries: Entries, ways: tuple[str, ...]) -> list[dict[str, int]]:
    """The points in their order; ways: the values that each must have."""
    points: dict[int, dict[str, int]] = {}
    for name, (line, value) in entries.items():
        match = SCREW_POINT.fullmatch(name)
        if match is None:
            continue
        if not WHOLE.fullmatch(value):
            remarks.refuse(line, f"{name} is {value}", "a whole number of tenths of a micrometre")
            continue
        if match[2] != "setpoint" and abs(int(value)) > LARGE_SCREW:
            remarks.refuse(line, f"an error of {int(value) * SCREW_UNIT:g} mm, which no machine has")
        points.setdefault(int(match[1]), {})[match[2]] = int(value)
    line, count = entries.get("kw.ssfk.kw_nr_max", (0, ""))
    if count != str(len(points)) or sorted(points) != list(range(len(points))):
        remarks.refuse(
            line, f"kw_nr_max is {count or 'missing'}, and there are {len(points)} points", "numbered from 0"
        )
    if not 2 <= len(points) <= MOST_SCREW_POINTS:
        remarks.refuse(0, f"{len(points)} points; 2 to {MOST_SCREW_POINTS} are possible")
    _even(remarks, entries, points)
    ordered = [points[index] for index in sorted(points)]
    if any(not {"setpoint", *ways} <= point.keys() for point in ordered):
        remarks.refuse(0, f"a point without setpoint, {' and '.join(ways)}")
        return []
    if any(after["setpoint"] <= before["setpoint"] for before, after in pairwise(ordered)):
        remarks.refuse(0, "the setpoints must ascend")
    return ordered
