"""Heidenhain's axis compensation: `.COM` tables of corrections, and the `.CMA` file that assigns them to axes.

The rule (MANUALplus 620 technical manual, of the same NCK family as TNC 640): `config.cma` has one column per axis, in
which a `.COM` file is entered. The position of that axis is looked up in the `.COM` file, and each column of the
`.COM` file moves the axis that it is named after.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import ClassVar

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import Message, RefusedError
from ncfix.tables.axis_tables import AxisTables, additive, reversal_note
from ncfix.tables.compensation import Compensation, Term, own_terms
from ncfix.tables.control import Assumption, FileControl, Files, Option, Properties, Request, Written, one_of, whole
from ncfix.tables.grid import Grid
from ncfix.tables.lower_bounds import least_of_sums
from ncfix.tables.table_files import DEGREE, ORDER, Remarks, in_order, messages_of, unit_of
from ncfix_heidenhain.table_files import CONFIG, ComTable, cma_text, nck_text, old_text, read_cma, read_com

MAX_ROWS = 256
"""The most rows of a `.COM` file on the older controls; for the newer ones no number is public."""
TABLES = re.compile(rb"\s*BEGIN[ \t]+\S+\.(?:COM|CMA)\b", re.IGNORECASE)
SIGN = "sign.txt"
"""The file, beside the tables, that keeps the sign which was settled for the machine (HEID-1)."""
SIGNS = ("error", "correction")
MAX_CELL = 9.9999
"""The largest value that fits into the columns of a public converter's files (HEID-5), mm or degree."""


class Heidenhain(FileControl):
    """The control `heidenhain`."""

    name = "heidenhain"
    title = "Heidenhain axis compensation (.COM, .CMA)"
    reaches = "L-POS, L-STR, L-SQR and part of L-ANG"
    properties = Properties(
        value_sign="as --set sign says; Heidenhain's own parameter MP720 is an error",
        input_signal="setpoint",
        position_frame="machine datum (MP_refPosition)",
        unit="mm, degree",
        quantum=(1e-4, 1e-4 * DEGREE),
        extrapolation="the value of the first and last row is assumed to hold (HEID-2)",
        bidirectional=True,
        max_points=MAX_ROWS,
        max_tables=len(ORDER),
        combine="sum over the axes that are looked up",
    )
    assumptions = (
        Assumption(
            "HEID-1",
            "The sign of the values is what --set sign says.",
            "MP720 of the TNC 407/415 is positive if the travel is too long, and a public converter writes mean "
            "deviations as they are: both speak for error; no text says it of these files",
            "none: it must be given",
            "Load a file with +0.010 in all rows: does the axis go 0.010 towards minus (error) or plus (correction)?",
        ),
        Assumption(
            "HEID-2",
            "Between rows the values are linear; beyond the first and last row they hold.",
            "none public",
            "so",
            "Move beyond the last row and compare the nominal position with the encoder.",
        ),
        Assumption(
            "HEID-3",
            "While the axis travels towards minus, the column BACKLASH counts for the axis itself instead of its own "
            "column.",
            "MANUALplus 620 technical manual: values measured in negative travel",
            "the column is left out, or (itnc530) repeats the axis's own; --set backlash=on writes it",
            "Load 0.000 in the axis column and 0.010 in BACKLASH, and read a dial gauge from both sides.",
        ),
        Assumption(
            "HEID-4",
            "Axis n of a column n=F() of the iTNC 530 is the n-th axis column of config.cma.",
            "none public",
            "the axes in the order X Y Z A B C U V W of those that the machine has",
            "The list of axes in the machine parameters.",
        ),
        Assumption(
            "HEID-5",
            "Four decimals, and columns as wide as those of a public converter.",
            "a public converter's files",
            "so",
            "Open the files in the table editor of the control.",
        ),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "sign": Option(
            None, "error: values are subtracted from the command; correction: they are added", one_of(*SIGNS), "HEID-1"
        ),
        "family": Option(
            "tnc640", "tnc640: NCK controls; itnc530: datum and distance in the first line", one_of("tnc640", "itnc530")
        ),
        "backlash": Option("off", "on: a column BACKLASH; off: the mean of both ways", one_of("off", "on")),
        "points": Option(str(MAX_ROWS), f"most rows of a file, at most {MAX_ROWS}", whole(2, MAX_ROWS)),
    }
    steps = (
        "Check HEID-1 on the machine.",
        "Save the present .COM and .CMA files; they are machine data behind the code number, so that the machine's "
        "maker or the service must load new ones.",
        "Load the .COM files, then config.cma; if there are lines of your own in it, add the columns to the active "
        "one.",
        "Cancel other compensation of the same axes: MP720/MP730, linear factors, KinematicsComp.",
        "Home all axes and compare the compensation of one position with ncfix emulate.",
        "Measure one axis again: the positioning error must have become smaller, not twice as large.",
    )
    switch_off = "Mark a line of config.cma that has no files as active, or empty the columns."

    def write(self, request: Request) -> Written:
        """One `.COM` file per axis on whose position any correction depends, `config.cma`, and the sign as a word."""
        settings = self.settings(request.settings)
        sense = sign_of(settings["sign"])
        old = settings["family"] == "itnc530"
        both = settings["backlash"] == "on"
        axes = in_order(request.machine)
        machine = request.machine
        most = int(settings["points"])
        lines = additive(machine, request.space, request.tool_length, most, request.target, both=both)
        needed = [line for line in map(_rounded, lines) if line.values.any() or line.reverse.any()]
        tables = {line.input: f"AXIS{'-' if old else '_'}{line.input}.COM" for line in needed}
        files = {}
        for line in needed:
            com = _as_file(line, sense, axes if old else None, both)
            largest = max(float(np.abs(values).max()) for values in com.columns.values())
            if largest > MAX_CELL:
                text = f"{tables[line.input]} would have to hold {largest:.3f}, but its columns hold at most {MAX_CELL}"
                raise RefusedError.of("NCF484", text, hint="check that the error is in mm")
            as_text = old_text if old else nck_text
            files[tables[line.input]] = as_text(tables[line.input], com, 4)
        files[CONFIG] = cma_text(axes, tables)
        files[SIGN] = f"{settings['sign']}\n".encode()
        least = least_of_sums(machine, request.space, request.tool_length)
        notes = (*_notes(lines, most), *play_left(request, self.examined(files)[0], both))
        return Written(files, notes, least)

    def examined(self, files: Files) -> tuple[Compensation, list[Remarks]]:
        """The compensation by the `.COM` files of the active line of `config.cma`, with the sign from `sign.txt`."""
        axes, tables, config = read_cma(files)
        remarks, terms = [config], []
        sign = files.get(SIGN, b"").decode("latin-1").strip()
        if sign not in SIGNS:
            config.refuse(0, f"{SIGN} says {sign!r}", "give error or correction; HEID-1 describes how to find out")
        sense = sign_of(sign)
        for axis, name in tables.items():
            com, found = read_com(name, files[name])
            remarks.append(found)
            if com is not None:
                terms += list(_terms(axis, com, axes, sense, found))
        for name in files:
            if name.upper().endswith(".COM") and name not in tables.values():
                config.doubt(0, f"{name} is not entered in the active line: the control does not use it")
        return Compensation(tuple(terms)), remarks

    def knows(self, name: str, content: bytes) -> bool:
        """Whether a file is a `.COM` or a `.CMA`, which the name in its first line tells."""
        return TABLES.match(content) is not None

    def look(self, files: Files) -> tuple[Message, ...]:
        """See `Control`; the sign may be missing, and without a `.CMA` each `.COM` file is checked by itself."""
        configs = [name for name in files if name.lower().endswith(".cma")]
        if SIGN in files:
            return self.lint(files)
        remarks = [read_cma(files)[2]] if configs else []
        remarks += [read_com(name, content)[1] for name, content in sorted(files.items()) if name not in configs]
        return messages_of(remarks)


def _terms(axis: str, com: ComTable, axes: tuple[str, ...], sense: float, remarks: Remarks) -> Iterator[Term]:
    nodes = com.nodes * unit_of(axis)
    for name, values in com.columns.items():
        output = _letter(name, axes, remarks)
        if output is None:
            continue
        scale = sense * unit_of(output)
        if output == axis and com.backlash is not None:
            if values.any() and not com.backlash.any():
                text = f"BACKLASH is zero in all rows, so {axis} would not be corrected while it travels towards minus"
                remarks.doubt(0, text, "without play, enter the values of its own column (HEID-3)")
            yield from own_terms(axis, nodes, scale * values, scale * com.backlash)
        else:
            yield Term((Grid((axis,), (nodes,), (output,), scale * values[:, None]),))
    if com.backlash is not None and com.backlash.any() and axis not in {_letter(n, axes, None) for n in com.columns}:
        remarks.doubt(0, f"BACKLASH without a column of {axis} itself is not used")


def _letter(name: str, axes: tuple[str, ...], remarks: Remarks | None) -> str | None:
    if not name.isdecimal():
        if name in axes:
            return name
        text = f"{name} is no axis of config.cma" if name in ORDER else f"{name} needs a kinematics table"
    elif 1 <= int(name) <= len(axes):
        return axes[int(name) - 1]
    else:
        text = f"config.cma has no axis number {name}"
    if remarks is not None:
        remarks.refuse(0, text)
    return None


def _rounded(line: AxisTables) -> AxisTables:
    """The tables of an axis with values of four decimals, without other axes' columns that then hold only zeros."""
    units = np.array([unit_of(name) for name in line.outputs])
    values = np.round(line.values / units, 4) * units
    columns = [i for i, name in enumerate(line.outputs) if values[:, i].any() or name == line.input]
    reverse = np.round(line.reverse / unit_of(line.input), 4) * unit_of(line.input)
    return AxisTables(line.input, line.nodes, tuple(line.outputs[i] for i in columns), values[:, columns], reverse)


def _as_file(line: AxisTables, sense: float, numbered: tuple[str, ...] | None, both: bool) -> ComTable:
    columns = {
        (str(numbered.index(name) + 1) if numbered else name): sense * line.values[:, i] / unit_of(name)
        for i, name in sorted(enumerate(line.outputs), key=lambda pair: ORDER.index(pair[1]))
    }
    unit = unit_of(line.input)
    own: Array = sense * line.reverse / unit
    if numbered and not both:
        own = columns[str(numbered.index(line.input) + 1)]
    return ComTable(line.nodes / unit, columns, own if both or numbered else None)


def sign_of(text: str) -> float:
    """The factor that turns a correction into a value of the file: 1 for `correction`, -1 for `error`."""
    return 1.0 if text == "correction" else -1.0


def play_left(request: Request, done: Compensation, both: bool) -> Iterator[str]:
    """Notes on play that the tables leave uncorrected; `both`: --set backlash=on was given.

    Where that setting would correct the play of an axis along itself, a note says so.
    """
    machine = request.machine
    left = list(reversal_note(machine, request.space, request.tool_length, done))
    yield from left
    own = (each for each in machine.effects if each.basis.needs_direction and each.joint == each.name[1])
    if left and not both and any(each.active for each in own):
        yield (
            "The values written are the mean of both directions; --set backlash=on also writes those for the "
            "direction towards minus."
        )


def _notes(lines: tuple[AxisTables, ...], most: int) -> tuple[str, ...]:
    notes = [
        "A sum of tables over one axis each cannot follow angular errors, whose lever changes as another axis moves. "
        "That part of the error remains, unless the control has KinematicsComp (heidenhain-kinematics)."
    ]
    notes.append("sign.txt is for ncfix emulate only; the control does not read it.")
    full = [line.input for line in lines if len(line.nodes) >= most > 2]
    if full:
        notes.append(f"With {most} rows the target is not reached along {', '.join(full)}.")
    return tuple(notes)
