"""LinuxCNC's screw compensation: one `.comp` file for each joint, and the lines of the ini file that load them.

The rules are those of LinuxCNC's source (usrmotintf.cc, command.c, control.c): a correction that is added to the motor
position, looked up by the joint's own commanded position, forward or reverse by the way it moves, linear between the
points and held beyond them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ncfix.diagnostics import Message
from ncfix.tables.axis_tables import positioning
from ncfix.tables.compensation import Compensation
from ncfix.tables.control import (
    Assumption,
    Control,
    Files,
    Option,
    Properties,
    Request,
    Written,
    one_of,
    whole,
    wrong_setting,
)
from ncfix.tables.lower_bounds import least_of_own_axis
from ncfix.tables.table_files import DEGREE, in_order, unit_of
from ncfix_linuxcnc.comp_file import MOST, Joint, comp_text, ini_text, is_ini, is_table, look_at, read_joints


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
        max_points=MOST,
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
        "coordinates": Option("", "axis letters in the order of the joints, e.g. XYZBC"),
        "points": Option(str(MOST), "most points of one file, at most 256", whole(2, MOST)),
    }
    steps = (
        "Save the ini file, and note the values of BACKLASH: a joint with COMP_FILE ignores it.",
        "The files are in mm and degree: look that LINEAR_UNITS and ANGULAR_UNITS of the ini file are, too. A machine "
        "in inches would take them for 25.4 times as much.",
        "Copy the .comp files beside the ini file.",
        "Put the lines of comp.ini into the [JOINT_n] sections.",
        "Start LinuxCNC and home all joints.",
        "Measure one axis again: the positioning error must have become smaller, not twice as large.",
    )
    switch_off = "Take the COMP_FILE lines out of the ini file and start LinuxCNC again."

    def write(self, request: Request) -> Written:
        """One file for each axis that has something to correct, and `comp.ini`."""
        settings = self.settings(request.settings)
        kind = settings["type"]
        most = int(settings["points"])
        letters = _coordinates(request, settings["coordinates"])
        tables = positioning(request.machine, request.space, request.tool_length, most, request.target)
        joints = _joints(tables, letters)
        files = {joint.file: comp_text(joint, int(kind)) for joint in joints}
        files["comp.ini"] = ini_text(joints, letters, int(kind))
        return Written(files, _notes(), least_of_own_axis(request.machine, request.space, request.tool_length))

    def read(self, files: Files) -> Compensation:
        """As LinuxCNC loads them. Raises `ConfigError` NCF491."""
        joints, remarks = read_joints(files)
        for each in remarks:
            each.check()
        return Compensation(tuple(term for joint in joints for term in joint.terms()))

    def lint(self, files: Files) -> tuple[Message, ...]:
        """What would stop LinuxCNC's reader early, and what is rarely meant."""
        _, remarks = read_joints(files)
        return tuple(message for each in remarks for message in each.messages)

    def knows(self, name: str, content: bytes) -> bool:
        """An ini file that names tables, or a table: numbers by threes in the first line that has anything."""
        return is_ini(content) or is_table(content)

    def look(self, files: Files) -> tuple[Message, ...]:
        """The same, and of tables that no ini file loads what is wrong in them under either type."""
        return tuple(message for each in look_at(files) for message in each.messages)


def _joints(tables: Compensation, letters: str) -> list[Joint]:
    found = []
    for term in tables.terms[::2]:
        (axis,) = term.outputs
        pair = [each.factors[0] for each in tables.terms if each.outputs == (axis,)]
        unit = unit_of(axis)
        nodes = pair[0].nodes[0] / unit
        forward, reverse = (grid.values[:, 0] / unit for grid in pair)
        found.append(Joint(letters.index(axis), axis, nodes, forward, reverse))
    return sorted(found, key=lambda joint: joint.number)


def _coordinates(request: Request, given: str) -> str:
    names = "".join(in_order(request.machine))
    letters = given.replace(" ", "").upper() or names
    if sorted(letters) != sorted(names):
        raise wrong_setting({"coordinates": given}, "coordinates", f"the axes of the machine: {' '.join(names)}")
    return letters


def _notes() -> tuple[str, ...]:
    return (
        "Straightness, squareness, angles and where the rotary axes lie cannot be said in one-axis tables: that part "
        "of the error is left. ncfix fix corrects it in the program.",
    )
