"""VOLCOMP of the ISG kernel and Beckhoff TwinCAT CNC (TF5280): a configuration list and a grid in ISG_CSV.

The grid holds the error of each linear axis over all axes that matter, rotary ones too, so that the kinematic model of
the control is not needed: with `workpiece_axes 0` and no angles the control takes EXX off the command of X, EYY off
that of Y and EZZ off that of Z. What the grid says is therefore ncfix's exact correction with the opposite sign.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from ncfix.diagnostics import Message, RefusedError, UsageError
from ncfix.tables.control import Assumption, Control, Files, Option, Properties, Request, Written
from ncfix.tables.lines import Remarks
from ncfix.tables.mesh import Mesh, search
from ncfix.tables.neutral import Compensation, Term
from ncfix.tables.volume import Volume, inputs_that_matter
from ncfix_isg.configuration import LETTERS, config_text, read_configuration
from ncfix_isg.csv_file import grid_text, read_grids

TABLE = "volcomp0.csv"
CONFIG = "volcomp.lis"


class Isg(Control):
    """The control `isg`."""

    name = "isg"
    title = "ISG kernel / Beckhoff TwinCAT CNC volumetric compensation"
    reaches = "L-VOL, and the position part of R-VOL"
    properties = Properties(
        value_sign="error",
        input_signal="setpoint",
        position_frame="machine coordinates",
        unit="values mm, positions mm and degree",
        quantum=(1e-6, 1e-6),
        extrapolation="taken as held at the outermost nodes (ISG-2)",
        bidirectional=False,
        max_points=1_000_000,
        max_tables=50,
        combine="sum of the files of a compensation",
    )
    assumptions = (
        Assumption(
            "ISG-1",
            "With workpiece_axes 0 and no angular parameters the control takes EXX, EYY and EZZ off the commands of X, "
            "Y and Z as they are.",
            "TF5280 documentation: values are errors",
            "so",
            "Load a grid with EXX 0.010 everywhere: X must move by 0.010 mm towards minus.",
        ),
        Assumption(
            "ISG-2",
            "Outside the grid the value of its edge holds.",
            "TF5280 documentation says so of the plane compensation only",
            "edge value",
            "Move beyond the grid and read the compensation in the diagnosis file.",
        ),
        Assumption(
            "ISG-3",
            "Rotary axes are numbered in the configuration as the linear ones are: letter and logical axis number.",
            "the documentation's example has linear axes only",
            "numbers 1, 2, 3, ... in the order X Y Z A B C of the axes that the machine has",
            "The control reports unknown names with error 70468; --set axes=X:1,Y:2,... gives other numbers.",
        ),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "folder": Option("C:\\vc", "where the control finds the grid file"),
        "axes": Option("", "logical axis numbers, e.g. X:1,Y:2,Z:3,B:4,C:5"),
        "filter_steps": Option("20", "over how many cycles the control spreads a change"),
        "fit": Option("nodes", "nodes: exact at the nodes; area: least squares over what is around them"),
        "points": Option("20000", "most nodes of the grid; vol_comp[0].max_records must allow them"),
    }
    steps = (
        "Copy the grid file to the folder that file[0] of volcomp.lis names.",
        "Enter volcomp.lis in the start-up list as vol_comp[0].file_name; vol_comp[0].max_records must be at least the "
        "number of nodes.",
        "Start the control, home all axes, and switch on: #VOLCOMP ON [ID0].",
        "Read the compensation values at one pose and compare them with ncfix emulate.",
        "Measure one line again: the error must have become smaller, not twice as large.",
    )
    switch_off = "#VOLCOMP OFF in the program, or take vol_comp[0] out of the start-up list."

    def write(self, request: Request) -> Written:
        """`volcomp.lis` and one grid over the axes that matter."""
        settings = self.settings(request.settings)
        most = _whole(settings, "points", 8)
        filter_steps = _whole(settings, "filter_steps", 0)
        numbers = _numbers(request, settings["axes"])
        inputs = inputs_that_matter(request.machine, request.space, request.tool_length)
        inputs = tuple(sorted(inputs, key=LETTERS.index))
        if settings["fit"] not in ("nodes", "area"):
            raise UsageError.of("NCF485", f"fit={settings['fit']}", hint="nodes or area")
        volume = Volume(request.machine, inputs, request.space, request.tool_length, settings["fit"] == "area")
        mesh = search(volume, request.target, [most] * len(inputs), most)
        files = {
            CONFIG: config_text(numbers, settings["folder"], TABLE, filter_steps),
            TABLE: grid_text(mesh.grid),
        }
        return Written(files, _notes(mesh, request.target))

    def read(self, files: Files) -> Compensation:
        """As the control would take them. Raises `ConfigError` NCF491."""
        grids, remarks = self._read(files)
        for each in remarks:
            each.check()
        return grids

    def lint(self, files: Files) -> tuple[Message, ...]:
        """What the control would report, and what is rarely meant."""
        _, remarks = self._read(files)
        return tuple(message for each in remarks for message in each.messages)

    def _read(self, files: Files) -> tuple[Compensation, list[Remarks]]:
        names, config = read_configuration(files)
        grids, remarks = read_grids(names, files)
        return Compensation(tuple(Term((grid,)) for grid in grids)), [config, *remarks]


def _numbers(request: Request, given: str) -> dict[str, int]:
    """Axis letter -> logical axis number."""
    names = request.machine.axis_names
    odd = [name for name in names if name not in LETTERS]
    if odd or not {"X", "Y", "Z"} <= set(names):
        text = f"VOLCOMP needs X, Y and Z and knows A, B and C; the machine has {' '.join(names)}"
        raise RefusedError.of("NCF484", text, hint="correct its programs instead: ncfix fix")
    if not given:
        return {name: number for number, name in enumerate(sorted(names, key=LETTERS.index), 1)}
    pairs = [pair.strip().split(":") for pair in given.split(",")]
    wrong = any(len(pair) != 2 or not (pair[1].isascii() and pair[1].isdigit()) for pair in pairs)
    if wrong or sorted(pair[0] for pair in pairs) != sorted(names):
        raise UsageError.of("NCF485", f"axes={given}", hint="LETTER:NUMBER for each axis, separated by commas")
    return {name: int(number) for name, number in sorted(pairs, key=lambda pair: LETTERS.index(pair[0]))}


def _whole(settings: Mapping[str, str], key: str, low: int) -> int:
    text = settings[key]
    if not (text.isascii() and text.isdigit() and low <= int(text) <= Isg.properties.max_points):
        raise UsageError.of("NCF485", f"{key}={text}", hint=f"a whole number from {low}")
    return int(text)


def _notes(mesh: Mesh, target: float) -> tuple[str, ...]:
    counts = " x ".join(f"{name} {count}" for name, count in zip(mesh.grid.inputs, mesh.grid.counts, strict=True))
    notes = [f"Grid {counts}: {mesh.grid.points} nodes; it misses {1e3 * mesh.left:.2f} um at most between them."]
    if not mesh.reached:
        notes.append(
            f"The target of {1e3 * target:g} um is not reached with the nodes allowed: --set points=N allows more."
        )
    notes.append("The orientation of the tool is not corrected.")
    return tuple(notes)
