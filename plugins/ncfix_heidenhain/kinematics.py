"""Heidenhain's KinematicsComp (iTNC 530, option 52): a kinematics table that contains the errors of every axis."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import Message, RefusedError
from ncfix.machine import Machine
from ncfix.tables.compensation import Compensation, Tables, Term, own_terms
from ncfix.tables.control import Assumption, FileControl, Files, Option, Properties, Request, Written, one_of, whole
from ncfix.tables.grid import Grid
from ncfix.tables.table_files import DEGREE, Remarks, in_order, messages_of, unit_of
from ncfix_heidenhain.chain import (
    LETTERS,
    AxisErrors,
    ChainRow,
    ErrorChain,
    axis_errors,
    chain_rows,
    kinematics_text,
    over_limits,
    read_rows,
)
from ncfix_heidenhain.control import MAX_ROWS, SIGNS, play_left, sign_of
from ncfix_heidenhain.table_files import CONFIG, MAX_CREDIBLE, ComTable, cma_text, old_text, read_cma, read_com

TABLE = "kinematics.tab"
UNITS = "units.txt"
CHAIN = re.compile(rb"(?im)^[ \t]*NR\b.*\bCOMPTAB\b")
ANGLES = {"deg": DEGREE, "rad": 1.0}


class KinematicsComp(FileControl):
    """The control `heidenhain-kinematics`."""

    name = "heidenhain-kinematics"
    title = "Heidenhain KinematicsComp (iTNC 530)"
    reaches = "L-VOL, and the position part of R-VOL"
    any_tool = True
    properties = Properties(
        value_sign="as --set sign says",
        input_signal="setpoint",
        position_frame="machine datum",
        unit="mm, degree; angles under C4 to C6 and COMPTAB as --set angle_unit says",
        quantum=(1e-7, 1e-7),
        extrapolation="the value of the first and last row is assumed to hold",
        bidirectional=True,
        max_points=MAX_ROWS,
        max_tables=18,
        combine="a kinematic chain with the errors of all axes",
    )
    assumptions = (
        Assumption(
            "KINE-1",
            "The chain is read from the machine base along the head, then from MachBase along the table; errors stand "
            "before their axis; a table axis moves the tool against the workpiece the way its letter says.",
            "iTNC 530 technical manual: errors are entered before the affected axis; the order of the rest is not "
            "public",
            "so",
            "Compare the rows without COMPTAB with the kinematics table that the machine has.",
        ),
        Assumption(
            "KINE-2",
            "The sign of errors is what --set sign says.",
            "none public",
            "none: it must be given",
            "Enter a fixed error of 0.010 under COMPTAB in X and see which way X moves.",
        ),
        Assumption(
            "KINE-3",
            "The unit of angles under C4 to C6 and COMPTAB is what --set angle_unit says.",
            "none public; the manual's example has 0.0015 for an angle",
            "none: it must be given",
            "Enter an angle of 0.01 before a rotary axis and see how far the tip moves at a known lever.",
        ),
        Assumption(
            "KINE-4",
            "Seven decimals are read.",
            "none public",
            "so",
            "Open the files in the table editor of the control.",
        ),
        Assumption(
            "KINE-5",
            "While the axis travels towards minus, the column BACKLASH counts for the axis itself instead of its own "
            "column.",
            "MANUALplus 620 technical manual: values measured in negative travel (see HEID-3)",
            "it repeats the own column; --set backlash=on writes what play changes",
            "Load 0.000 in the axis column and 0.010 in BACKLASH, and read a dial gauge from both sides.",
        ),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "sign": Option(
            None, "error: entries are the errors of the machine; correction: the opposite", one_of(*SIGNS), "KINE-2"
        ),
        "angle_unit": Option(None, "deg or rad", one_of(*ANGLES), "KINE-3"),
        "backlash": Option(
            "off",
            "on: play of the axes, in their own columns and BACKLASH; off: the mean of both ways",
            one_of("off", "on"),
        ),
        "points": Option(str(MAX_ROWS), f"most rows of an axis table, at most {MAX_ROWS}", whole(2, MAX_ROWS)),
    }
    steps = (
        "Check KINE-1 to KINE-3 on the machine.",
        "Have the machine's maker or the service enter the COMPTAB column in the kinematics table of the machine, "
        "with the rows that only errors need; do not replace it by the one written here.",
        "Load the .COM files and config.cma.",
        "Cancel other compensation of the same errors: .COM columns of axes, MP720/MP730, MP960.",
        "Home all axes and measure: the errors must have become smaller, not twice as large.",
    )
    switch_off = "Empty the COMPTAB column, and mark a line of config.cma that has no files as active."

    def write(self, request: Request) -> Written:
        """The kinematics table, one axis table per axis that has errors, `config.cma`, and sign and unit as words."""
        settings = self.settings(request.settings)
        sense = -sign_of(settings["sign"])
        angle = ANGLES[settings["angle_unit"]]
        machine, axes = request.machine, _axes(request.machine)
        most = int(settings["points"])
        play = settings["backlash"] == "on"
        found = [axis_errors(machine, request.space, i, most, request.target, play) for i in range(len(axes))]
        components = [each for each, _ in found]
        chain = chain_rows(machine, components, angle, sense)
        for text in over_limits(chain):
            raise RefusedError.of("NCF484", f"the kinematics table would have {text}", hint="ncfix fix has no limit")
        files, tables = {TABLE: kinematics_text(chain)}, {}
        for each in components:
            com = _com(each, axes, sense, angle)
            if any(np.abs(values).max() > MAX_CREDIBLE for values in com.columns.values()):
                text = f"an error of {each.axis} beyond {MAX_CREDIBLE} mm or degree"
                raise RefusedError.of("NCF484", text, hint="check that the errors are in mm and rad")
            if com.columns:
                tables[each.axis] = f"AXIS-{each.axis}.COM"
                files[tables[each.axis]] = old_text(tables[each.axis], com, 7)
        files[CONFIG] = cma_text(axes, tables)
        files[UNITS] = f"{settings['sign']} {settings['angle_unit']}\n".encode()
        notes = _notes(components, [flag for _, flag in found], most)
        done = Compensation(self.examined(files)[0].own)
        return Written(files, (*notes, *play_left(request, done, play)))

    def examined(self, files: Files) -> tuple[ErrorChain, list[Remarks]]:
        """The kinematic chain that the control would work out of the files, with remarks on them."""
        axes, tables, config = read_cma(files)
        table = Remarks.of(TABLE, files.get(TABLE, b""))
        chain = read_rows(table, files.get(TABLE, b""))
        remarks = [config, table]
        sense, angle = _read_units(files, config)
        components: dict[tuple[str, str], Grid] = {}
        own: list[Term] = []
        for axis, name in tables.items():
            com, found = read_com(name, files[name])
            remarks.append(found)
            if com is not None:
                grids, terms = _grids(axis, com, axes, sense, found)
                components |= grids
                own += terms
        _check_names(chain, components, table)
        return ErrorChain(chain, sense, angle, components, tuple(own)), remarks

    def reached(self, machine: Machine, tables: Tables) -> str:
        """See `Control`; rotary errors (R-VOL) are corrected only on machines with rotary axes."""
        return self.reaches if machine.rotary.any() else "L-VOL"

    def knows(self, name: str, content: bytes) -> bool:
        """Whether a file is a kinematics table with a column COMPTAB."""
        return CHAIN.search(content) is not None

    def look(self, files: Files) -> tuple[Message, ...]:
        """See `Control`; without `units.txt` each kinematics table is checked by itself."""
        if UNITS in files:
            return self.lint(files)
        remarks = [Remarks.of(name, content) for name, content in sorted(files.items())]
        for each in remarks:
            read_rows(each, files[each.path])
        return messages_of(remarks)


def _axes(machine: Machine) -> tuple[str, ...]:
    found = in_order(machine, LETTERS)
    if not {"X", "Y", "Z"} <= set(found):
        text = f"the kinematics table needs X, Y and Z; the machine has {' '.join(found)}"
        raise RefusedError.of("NCF484", text, hint="correct the programs instead: ncfix fix")
    return found


def _com(errors: AxisErrors, axes: tuple[str, ...], sense: float, angle: float) -> ComTable:
    """The axis table of an axis: those of its errors C1 to C6 that are not zero, and its own correction with BACKLASH.

    The own correction is that of a rotary axis's angle, or of the play of an axis.
    """
    columns, back = {}, None
    if max(np.abs(errors.own).max(), np.abs(errors.back).max()) > 1e-9:
        columns[str(axes.index(errors.axis) + 1)] = sense * errors.own / unit_of(errors.axis)
        back = sense * errors.back / unit_of(errors.axis)
    for index in range(6):
        if errors.used(index):
            columns[f"C{index + 1}"] = sense * errors.values[:, index] / (angle if index >= 3 else 1.0)
    return ComTable(errors.nodes / unit_of(errors.axis), columns, back)


def _grids(
    axis: str, com: ComTable, axes: tuple[str, ...], sense: float, remarks: Remarks
) -> tuple[dict[tuple[str, str], Grid], list[Term]]:
    """The columns C1 to C6 of an axis with the file's values, and the corrections of the axis by its own position."""
    components: dict[tuple[str, str], Grid] = {}
    own: list[Term] = []
    nodes = com.nodes * unit_of(axis)
    for name, values in com.columns.items():
        if name.startswith("C") and name != "C":
            components[axis, name] = Grid((axis,), (nodes,), (axis,), values[:, None])
        elif name.isdecimal() and 1 <= int(name) <= len(axes) and axes[int(name) - 1] == axis:
            own += _own(axis, nodes, -sense * unit_of(axis) * values, com, -sense * unit_of(axis))
        else:
            remarks.refuse(0, f"the column {name} is not that of the axis itself, nor C1 to C6")
    return components, own


def _own(axis: str, nodes: Array, values: Array, com: ComTable, factor: float) -> tuple[Term, ...]:
    """The corrections of an axis by its own position; while it travels towards minus, BACKLASH counts instead."""
    if com.backlash is None or np.array_equal(values, factor * com.backlash):
        return (Term((Grid((axis,), (nodes,), (axis,), values[:, None]),)),)
    return own_terms(axis, nodes, values, factor * com.backlash)


def _check_names(chain: tuple[ChainRow, ...], components: Mapping[tuple[str, str], Grid], remarks: Remarks) -> None:
    named = [error for error in (row.error for row in chain) if isinstance(error, tuple)]
    for error in named:
        if error not in components:
            remarks.refuse(0, f"{'..'.join(error)} is in no axis table of the active line")
    for axis, column in components:
        if (axis, column) not in named:
            remarks.doubt(0, f"the column {column} of axis {axis} is used nowhere in the chain")


def _read_units(files: Files, remarks: Remarks) -> tuple[float, float]:
    words = files.get(UNITS, b"").decode("latin-1").split()
    if len(words) != 2 or words[0] not in ("error", "correction") or words[1] not in ANGLES:
        remarks.refuse(
            0, f"{UNITS} says {' '.join(words)!r}", "give error or correction, and deg or rad; see KINE-2, KINE-3"
        )
        return 1.0, 1.0
    return 1.0 if words[0] == "error" else -1.0, ANGLES[words[1]]


def _notes(components: list[AxisErrors], depends: list[bool], most: int) -> list[str]:
    notes = ["The direction of the tool is corrected only as far as rotary axes can turn themselves right."]
    notes.append("units.txt is for ncfix emulate only; the control does not read it.")
    some = [each.axis for each, flag in zip(components, depends, strict=True) if flag]
    if some:
        notes.append(
            f"Errors of {', '.join(some)} depend on more than the position of the axis; their mean is written."
        )
    full = [each.axis for each in components if len(each.nodes) >= most]
    if full:
        notes.append(f"With {most} rows the target is not reached along {', '.join(full)}.")
    return notes
