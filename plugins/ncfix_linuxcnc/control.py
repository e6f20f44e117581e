"""LinuxCNC screw compensation: one `.comp` file for each joint, and the lines of the ini file that load them.

The rules are those of LinuxCNC's source (usrmotintf.cc, command.c, control.c): a correction is added to the motor
position. It is looked up by the joint's own commanded position, forward or reverse by its direction of motion, linear
between points and constant beyond them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import ClassVar

import numpy as np

from ncfix.plugin import (
    Array,
    Assumption,
    Compensation,
    Control,
    Files,
    Message,
    Option,
    Properties,
    Remarks,
    Request,
    Term,
    Written,
    check_all,
    in_order,
    least_of_own_axis,
    messages_of,
    one_of,
    own_terms,
    positioning,
    unit_of,
    whole,
    wrong_setting,
)
from ncfix.tables.table_files import ALONE, DEGREE, NUMBER, ORDER, TURNING
from ncfix.values import frozen

MAX_POINTS = 256
"""Largest number of points: EMCMOT_COMP_SIZE of LinuxCNC."""
MAX_LINE_CHARACTERS = 255
"""Largest number of characters of a line that LinuxCNC's reader accepts."""
MAX_SLOPE = 0.01
"""Slope of a correction above which it looks like a typing error; real screws stay below a thousandth."""
MAX_CORRECTION = 1.0
"""Largest plausible correction, mm or degree."""
GAP = r"(?:\s+|(?=[-+]))"
"""Separator of two numbers as sscanf accepts it."""
TRIPLE = re.compile(rf"\s*({NUMBER}){GAP}({NUMBER}){GAP}({NUMBER})(.*)")
SECTION = re.compile(r"\s*\[(\w+)\]\s*")
ENTRY = re.compile(r"\s*(\w+)\s*=\s*(.*?)\s*")
UNITS = {"mm": 1.0, "metric": 1.0, "inch": 25.4, "in": 25.4, "imperial": 25.4}
DECIMALS = {"mm": 6, "inch": 7}
"""Decimals in a file of that unit: one nanometre, and less than three."""
LOADS = re.compile(rb"(?im)^[ \t]*COMP_FILE[ \t]*=")
Entries = dict[str, tuple[int, str]]
ONCE = ("COMP_FILE", "COMP_FILE_TYPE", "COORDINATES", "LINEAR_UNITS", "ANGULAR_UNITS")
"""Entries of which LinuxCNC takes the first."""


@frozen
class JointTable:
    """The table of a joint: corrections (added) over its position, in mm or degree, (n,) each."""

    number: int
    axis: str
    nodes: Array
    forward: Array
    reverse: Array

    @property
    def file(self) -> str:
        """The name of its file."""
        return f"joint_{self.number}_{self.axis}.comp"

    def has_same_table(self, other: JointTable) -> bool:
        """Whether another table holds the same numbers."""
        columns = ((each.nodes, each.forward, each.reverse) for each in (self, other))
        return all(np.array_equal(*pair) for pair in zip(*columns, strict=True))

    def terms(self) -> tuple[Term, Term]:
        """The forward and reverse columns as terms, mm or rad."""
        unit = unit_of(self.axis)
        return own_terms(self.axis, self.nodes * unit, self.forward * unit, self.reverse * unit)


def comp_text(joint: JointTable, kind: int, unit: str = "mm") -> bytes:
    """A `.comp` file: nominal, forward, reverse. No comments: LinuxCNC stops reading at any line of another form."""
    columns = [joint.nodes, joint.forward, joint.reverse]
    if kind == 0:
        columns = [joint.nodes, joint.nodes - joint.forward, joint.nodes - joint.reverse]
    digits, scale = (DECIMALS["mm"], 1.0) if joint.axis in TURNING else (DECIMALS[unit], UNITS[unit])
    rows = zip(*(np.round(column / scale, digits) + 0.0 for column in columns), strict=True)
    return "".join(f"{a:.{digits}f} {b:.{digits}f} {c:.{digits}f}\n" for a, b, c in rows).encode()


def ini_text(joints: list[JointTable], letters: str, kind: int, unit: str = "mm") -> bytes:
    """The lines of the ini file that load the files."""
    head = ["[TRAJ]", f"COORDINATES = {' '.join(letters)}", f"LINEAR_UNITS = {unit}", "ANGULAR_UNITS = degree"]
    parts = [
        ["", f"[JOINT_{joint.number}]", f"COMP_FILE = {joint.file}", f"COMP_FILE_TYPE = {kind}"] for joint in joints
    ]
    return "".join(f"{line}\n" for line in [*head, *(line for part in parts for line in part)]).encode()


def read_joints(files: Files) -> tuple[list[JointTable], list[Remarks]]:
    """The tables loaded by the ini file among `files`, with remarks on every file."""
    inis = [name for name in files if name.lower().endswith(".ini")]
    path = inis[0] if len(inis) == 1 else "comp.ini"
    ini = Remarks.of(path, files[path] if len(inis) == 1 else b"", "#")
    if len(inis) != 1:
        ini.refuse(0, f"{len(inis)} ini files instead of one")
        return [], [ini]
    sections = _sections(ini)
    line, coordinates = sections.get("TRAJ", {}).get("COORDINATES", (0, ""))
    letters = "".join(coordinates.split()).upper()
    if not set(letters) <= set(ORDER):
        ini.refuse(line, f"COORDINATES = {coordinates}", f"letters of {ORDER}")
    scale = _scale(sections, ini)
    remarks, joints = [ini], []
    for name, entries in sections.items():
        if name.startswith("JOINT_") and "COMP_FILE" in entries:
            found = _joint(name, entries, letters, scale, files, ini, remarks)
            joints += [found] if found else []
        elif "COMP_FILE" in entries:
            text = f"COMP_FILE under [{name}]: LinuxCNC reads it under [JOINT_n] (2.7 and older under [AXIS_n])"
            ini.refuse(entries["COMP_FILE"][0], text, "the section of the joint")
    return joints, remarks


def is_ini(content: bytes) -> bool:
    """Whether a file is an ini file that loads tables."""
    return LOADS.search(content) is not None


def is_table(name: str, content: bytes) -> bool:
    """Whether a file looks like a table: its first line has three numbers and nothing else.

    A `.comp` file is also a table if most of its lines begin with a number, even if LinuxCNC would not read all of it.
    """
    rows = [row for row in content.decode("latin-1").splitlines() if row.strip()]
    match = TRIPLE.fullmatch(rows[0]) if rows else None
    begun = sum(re.match(rf"\s*{NUMBER}[\s,;]", row) is not None for row in rows)
    return (match is not None and not match[4].strip()) or (name.lower().endswith(".comp") and 2 * begun > len(rows))


def look_at(files: Files) -> list[Remarks]:
    """Remarks on ini files with their tables, and on other tables, for the file type that gives fewer remarks."""
    inis = {name: content for name, content in files.items() if is_ini(content)}
    found = [remarks for name in inis for remarks in read_joints({**_others(files, inis), name: inis[name]})[1]]
    loaded = {remarks.path for remarks in found}
    for name in _others(files, inis).keys() - loaded:
        kinds = []
        for measured in (False, True):
            kinds.append(Remarks.of(name, files[name]))
            _table(kinds[-1], 0, "X", measured, 1.0)
        found.append(min(kinds, key=lambda remarks: (len(remarks.wrong), len(remarks.doubtful))))
    return sorted(found, key=lambda remarks: remarks.path)


def _others(files: Files, inis: Files) -> dict[str, bytes]:
    return {name: content for name, content in files.items() if name not in inis}


def _sections(ini: Remarks) -> dict[str, Entries]:
    found: dict[str, Entries] = {}
    entries: Entries = found.setdefault("", {})
    for number, row in enumerate(ini.rows, 1):
        if section := SECTION.fullmatch(row):
            entries = found.setdefault(section[1].upper(), {})
        elif entry := ENTRY.fullmatch(row):
            key = entry[1].upper()
            if key in ONCE and key in entries:
                ini.refuse(number, f"{key} appears twice: LinuxCNC takes the first", "one line for each")
            entries[key] = (number, entry[2])
        elif row.strip() and not row.lstrip().startswith(("#", ";")):
            ini.refuse(number, "neither a section, nor NAME = VALUE, nor a comment")
    return found


def _scale(sections: dict[str, Entries], ini: Remarks) -> float:
    line, unit = sections.get("TRAJ", {}).get("LINEAR_UNITS", (0, ""))
    if unit.lower() not in UNITS:
        ini.refuse(line, f"LINEAR_UNITS = {unit or 'nothing'}", "mm or inch, under [TRAJ]")
    turn_line, turn = sections.get("TRAJ", {}).get("ANGULAR_UNITS", (0, "degree"))
    if turn.lower() not in ("deg", "degree"):
        ini.refuse(turn_line, f"ANGULAR_UNITS = {turn}: tables of rotary axes are read in degrees", "degree")
    return UNITS.get(unit.lower(), 1.0)


def _joint(
    section: str, entries: Entries, letters: str, scale: float, files: Files, ini: Remarks, remarks: list[Remarks]
) -> JointTable | None:
    line, name = entries["COMP_FILE"]
    number = section.removeprefix("JOINT_")
    if not number.isdecimal() or int(number[:4]) >= len(letters):
        ini.refuse(line, f"[{section}] is no axis of COORDINATES = {letters or 'nothing'}")
        return None
    kind_line, kind = entries.get("COMP_FILE_TYPE", (line, "0"))
    if "COMP_FILE_TYPE" not in entries:
        ini.doubt(line, f"[{section}] has no COMP_FILE_TYPE: LinuxCNC takes 0, actual positions")
    if kind not in ("0", "1"):
        ini.refuse(kind_line, f"COMP_FILE_TYPE = {kind or 'nothing'}", "1: corrections, 0: actual positions")
    if "BACKLASH" in entries:
        ini.doubt(entries["BACKLASH"][0], "BACKLASH is ignored where there is a COMP_FILE", "take the line out")
    if name not in files:
        ini.refuse(line, f"the file {name} is missing")
        return None
    found = Remarks.of(name, files[name])
    remarks.append(found)
    if ALONE.search(files[name].decode("latin-1")):
        found.refuse(0, "a line ends in CR alone: LinuxCNC takes what follows for the same line", "LF or CR LF")
    axis = letters[int(number)]
    return _table(found, int(number), axis, kind == "0", 1.0 if axis in TURNING else scale)


def _table(remarks: Remarks, number: int, axis: str, measured: bool, scale: float) -> JointTable | None:
    remarks.doubt_end()
    rows = np.array(list(_triples(remarks)), dtype=np.float64).reshape(-1, 3)
    if len(rows) > MAX_POINTS:
        remarks.refuse(MAX_POINTS + 1, f"{len(rows)} points, and LinuxCNC holds {MAX_POINTS}")
    if len(rows) < 2:
        remarks.refuse(0, f"{len(rows)} points")
        return None
    steps = np.diff(rows[:, 0])
    for row in np.flatnonzero(steps <= 0):
        remarks.refuse(int(row) + 2, "the nominal positions must ascend")
    if (steps <= 0).any():
        return None
    nodes, trims = rows[:, 0], rows[:, :1] - rows[:, 1:] if measured else rows[:, 1:]
    if not _too_large(remarks, trims * scale, measured, "degree" if axis in TURNING else "mm"):
        _look_for_jumps(remarks, steps, trims)
    stored: Array = trims.astype(np.float32).astype(np.float64) * scale
    return JointTable(number, axis, nodes * scale, stored[:, 0], stored[:, 1])


def _too_large(remarks: Remarks, trims: Array, measured: bool, unit: str) -> bool:
    """Refuse the first implausibly large correction (of a file of the other type?); returns whether there is one."""
    rows = np.flatnonzero(np.abs(trims).max(axis=1) > MAX_CORRECTION)
    if rows.size:
        size = trims[rows[0]][np.abs(trims[rows[0]]).argmax()]
        other = "1, corrections" if measured else "0, actual positions"
        text = f"a correction of {size:g} {unit}, which no machine needs: LinuxCNC would move there"
        remarks.refuse(int(rows[0]) + 1, text, f"is it a file of COMP_FILE_TYPE {other}?")
    return bool(rows.size)


def _triples(remarks: Remarks) -> Iterator[tuple[float, float, float]]:
    """The points up to the first line at which LinuxCNC's reader stops."""
    for number, row in enumerate(remarks.rows, 1):
        match = TRIPLE.fullmatch(row)
        if match is None and not any(each.strip() for each in remarks.rows[number - 1 :]):
            return
        if match is None:
            what = "a blank line" if not row.strip() else "a decimal comma" if "," in row else "not three numbers"
            remarks.refuse(number, f"{what}: LinuxCNC stops reading here", "three numbers on every line, no comments")
            return
        if len(row) > MAX_LINE_CHARACTERS:
            remarks.refuse(number, f"longer than {MAX_LINE_CHARACTERS} characters")
        if match[4].startswith(","):
            remarks.refuse(number, "a decimal comma: LinuxCNC takes what is before it for the whole number")
        elif match[4].strip():
            remarks.doubt(number, "more than three numbers: the rest is ignored")
        place, there, back = float(match[1]), float(match[2]), float(match[3])
        if not np.isfinite([place, there, back]).all():
            remarks.refuse(number, "a number beyond all bounds")
            return
        yield place, there, back


def _look_for_jumps(remarks: Remarks, steps: Array, trims: Array) -> None:
    """Remark on points where the correction changes faster than the error of a screw can."""
    slopes = np.abs(np.diff(trims, axis=0)).max(axis=1) / steps
    for row in np.flatnonzero(slopes > MAX_SLOPE):
        text = f"the correction changes by {slopes[row]:.3g} per unit of length from the line before"
        remarks.doubt(int(row) + 2, text, "a slip of the digits?")


class LinuxCnc(Control):
    """The control `linuxcnc`."""

    name = "linuxcnc"
    title = "LinuxCNC screw compensation"
    reaches = "L-POS"
    properties = Properties(
        value_sign="correction (type 1) or measured (type 0)",
        input_signal="setpoint",
        position_frame="machine coordinates of the joint",
        unit="machine units: mm, degree",
        quantum=(1e-6, 1e-6 * DEGREE),
        extrapolation="the value of the first or last point is held",
        bidirectional=True,
        max_points=MAX_POINTS,
        max_tables=9,
        combine="one file for each joint",
    )
    assumptions = (
        Assumption(
            "LCNC-1",
            "Joint n moves the n-th axis of COORDINATES, and nothing else.",
            "LinuxCNC documentation, trivial kinematics",
            "order XYZABCUVW of the axes that the machine has",
            "Jog each joint before homing and see which axis moves; --set coordinates=... gives another order.",
        ),
        Assumption(
            "LCNC-2",
            "The way an axis moves is known when its table is looked up; the filter that limits how fast the "
            "correction changes is not emulated.",
            "LinuxCNC source, control.c",
            "settled",
            "Watch the pin joint.N.motor-offset and the motor position while an axis turns round.",
        ),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "type": Option("1", "COMP_FILE_TYPE: 1 corrections, 0 actual positions", one_of("0", "1")),
        "coordinates": Option("", "axis letters in the order of the joints, e.g. XYZBC, or XYYZ for a gantry"),
        "points": Option(str(MAX_POINTS), "most points of one file, at most 256", whole(2, MAX_POINTS)),
        "unit": Option("mm", "LINEAR_UNITS of the machine: mm or inch", one_of("mm", "inch")),
    }
    steps = (
        "Save the ini file, and note the values of BACKLASH: a joint with COMP_FILE ignores it.",
        "Look that LINEAR_UNITS and ANGULAR_UNITS of the ini file are those of comp.ini (--set unit=inch for inches): "
        "otherwise it would take the files for 25.4 times as much, or as little.",
        "Copy the .comp files beside the ini file.",
        "Put the lines of comp.ini into the [JOINT_n] sections.",
        "Start LinuxCNC and home all joints.",
        "Measure one axis again: the positioning error must have become smaller, not twice as large.",
    )
    switch_off = "Take the COMP_FILE lines out of the ini file and start LinuxCNC again."

    def write(self, request: Request) -> Written:
        """One file for each axis with a correction, and `comp.ini`."""
        settings = self.settings(request.settings)
        kind = settings["type"]
        most = int(settings["points"])
        letters = _coordinates(request, settings["coordinates"])
        tables = positioning(request.machine, request.space, request.tool_length, most, request.target)
        joints, unit = _joints(tables, letters), settings["unit"]
        files = {joint.file: comp_text(joint, int(kind), unit) for joint in joints}
        files["comp.ini"] = ini_text(joints, letters, int(kind), unit)
        return Written(files, _notes(), least_of_own_axis(request.machine, request.space, request.tool_length))

    def read(self, files: Files) -> Compensation:
        """The tables as LinuxCNC loads them. Raises `ConfigError` NCF491."""
        joints, remarks = read_joints(files)
        moving: dict[str, list[JointTable]] = {}
        for joint in joints:
            moving.setdefault(joint.axis, []).append(joint)
        for axis, together in moving.items():
            if not all(together[0].has_same_table(other) for other in together[1:]):
                numbers = " and ".join(str(joint.number) for joint in together)
                text = f"joints {numbers} move {axis} together: two tables for one axis are not run"
                hint = "leave one of the two COMP_FILE lines to look at one side alone"
                remarks[0].refuse(0, text, hint)
        check_all(remarks)
        return Compensation(tuple(term for together in moving.values() for term in together[0].terms()))

    def lint(self, files: Files) -> tuple[Message, ...]:
        """Remarks on what stops LinuxCNC's reader early, and on unusual values."""
        _, remarks = read_joints(files)
        return messages_of(remarks)

    def knows(self, name: str, content: bytes) -> bool:
        """Whether a file is an ini file that loads tables, or a table."""
        return is_ini(content) or is_table(name, content)

    def look(self, files: Files) -> tuple[Message, ...]:
        """See `Control`; tables that no ini file loads are examined as both types."""
        return messages_of(look_at(files))


def _joints(tables: Compensation, letters: str) -> list[JointTable]:
    found = []
    for term in tables.terms[::2]:
        (axis,) = term.outputs
        pair = [each.factors[0] for each in tables.terms if each.outputs == (axis,)]
        unit = unit_of(axis)
        nodes = pair[0].nodes[0] / unit
        forward, reverse = (grid.values[:, 0] / unit for grid in pair)
        numbers = (number for number, letter in enumerate(letters) if letter == axis)
        found += [JointTable(number, axis, nodes, forward, reverse) for number in numbers]
    return sorted(found, key=lambda joint: joint.number)


def _coordinates(request: Request, given: str) -> str:
    names = "".join(in_order(request.machine))
    letters = given.replace(" ", "").upper() or names
    if {*letters} != {*names}:
        raise wrong_setting({"coordinates": given}, "coordinates", f"the axes of the machine: {' '.join(names)}")
    return letters


def _notes() -> tuple[str, ...]:
    return (
        "One-axis tables cannot hold straightness, squareness, angular errors and the location of rotary axes. That "
        "part of the error remains; ncfix fix corrects it in the program.",
    )
