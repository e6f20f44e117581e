"""The configuration list of VOLCOMP: a name and a value a line."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ncfix.tables.control import Files
from ncfix.tables.table_files import Remarks
from ncfix_isg.leadscrew import MARK, bare

LETTERS = "XYZABC"
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


def config_text(
    numbers: Mapping[str, int], folder: str, names: Sequence[str], filter_steps: int, negate: str = ""
) -> bytes:
    """The list: axis numbers, switches, and the files; negate: the axes whose compensation the control turns round."""
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


@dataclass(frozen=True, slots=True)
class Configuration:
    """What the list says: the grid files in their order, the logical number of each axis, and what is turned round.

    factors  linear axis -> -1 where `negate` names it, 0 where `set_to_zero` does (P-VOLC-00009 and what follows it)
    """

    files: tuple[str, ...] = ()
    numbers: Mapping[str, str] = field(default_factory=dict)
    factors: Mapping[str, float] = field(default_factory=dict)


def is_list(content: bytes) -> bool:
    """Whether a file is the list of VOLCOMP: it names files of grids, or how axes lie."""
    return LIST.search(content) is not None and MARK not in content


def read_configuration(files: Files) -> tuple[Configuration, Remarks]:
    """The list, and remarks on it; lists of single axes are none of its business."""
    lists = [name for name, content in files.items() if name.lower().endswith(".lis") and MARK not in content]
    path = lists[0] if len(lists) == 1 else "volcomp.lis"
    remarks = Remarks.of(path, files[path] if len(lists) == 1 else b"", "#")
    if len(lists) != 1:
        remarks.refuse(0, f"{len(lists)} configuration lists instead of one")
        return Configuration(), remarks
    entries = _entries(remarks)
    _check_switches(entries, remarks)
    axes = [name for name in entries if name in LETTERS]
    _check_axes(entries, axes, remarks)
    numbers = {axis: entries[axis][1] for axis in axes}
    return Configuration(tuple(_grid_files(entries, remarks, files)), numbers, _factors(entries, remarks)), remarks


Entries = dict[str, tuple[int, str]]
FACTORS = {"negate": -1.0, "set_to_zero": 0.0}
"""Entries that name linear axes, as in `negate XY`, and by what their compensation is multiplied."""
OTHERS = {"diagnosis_file": "", "use_axis_offsets": "0"}
"""Entries that may be there, and the value that they must have, if any."""
SPELT = {name.lower(): name for name in (*HEAD, *TAIL, *FACTORS, *OTHERS)}
"""The control does not tell small letters from large ones."""
TRUTH = {"1": "TRUE", "0": "FALSE"}


def _entries(remarks: Remarks) -> Entries:
    found: Entries = {}
    for number, row in enumerate(remarks.rows, 1):
        words = bare(row).split(None, 1)
        if len(words) == 1:
            remarks.refuse(number, f"{words[0]!r} has no value")
        elif words:
            name, value = _spelt(words[0]), words[1].strip()
            if name in found:
                remarks.refuse(number, f"{name} is there twice")
            if name not in SPELT.values() and name not in LETTERS and not name.startswith("file"):
                remarks.refuse(number, f"the name {name!r} is not known (error 70468)")
            found[name] = (number, value)
    return found


def _spelt(name: str) -> str:
    """A name as the documentation has it."""
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
    """The names in `files` of the grids that are listed, in their order."""
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
    """Files are numbered from 0 without a gap, and there is one at least."""
    known = {f"{key}[{index}]" for index in range(count) for key in ("file", "file_format")}
    stray = next((name for name in entries if name.startswith("file") and name not in known), None)
    if stray is not None:
        hint = f"file[0] to file[{MOST_FILES - 1}] in order"
        remarks.refuse(entries[stray][0], f"{stray} does not follow on", hint)
    elif not count:
        remarks.refuse(0, "names no file")
