"""VOLCOMP of the ISG kernel and Beckhoff TwinCAT CNC (TF5280): a configuration list and grids in ISG_CSV.

Grids contain the error of each linear axis over all axes that matter, including rotary ones, so that the control's
kinematic model is not needed: with `workpiece_axes 0` and no angles the control subtracts EXX, EXY and EXZ from the
command of X, and so on. The sum of all grids is therefore ncfix's exact correction with the opposite sign. For more
than three axes a single grid would need too many nodes; then each linear axis has up to three grids over fewer axes.
Grids cannot represent play, which goes into the leadscrew compensation of the axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import ClassVar

from ncfix.plugin import (
    Assumption,
    Compensation,
    FileControl,
    Files,
    Grid,
    Message,
    Option,
    Properties,
    RefusedError,
    Remarks,
    Request,
    Reversal,
    Term,
    Written,
    in_order,
    messages_of,
    one_of,
    reversal_note,
    reversals,
    whole,
    wrong_setting,
)
from ncfix.tables.control import SettingForm
from ncfix.tables.grid_sums import faces, searched
from ncfix.tables.volume import AIM, Volume, inputs_that_matter, search
from ncfix.values import frozen
from ncfix_isg.volcomp_files import (
    LETTERS,
    MOST_SCREW_POINTS,
    SCREW_FILE,
    SCREW_MARK,
    config_text,
    grid_text,
    is_grid,
    is_list,
    list_text,
    parameters,
    read_configuration,
    read_grids,
    read_leadscrews,
)

TABLE = "volcomp{}.csv"
CONFIG = "volcomp.lis"
LINEAR = "XYZ"
MOST_NODES = 1_000_000
AXES = SettingForm(
    "axes of X, Y and Z, each once", lambda text: sorted(text.upper()) == sorted({*text.upper()} & {*LINEAR})
)
MAX_SINGLE_GRID_INPUTS = 3
"""Largest number of inputs for which a single grid is used."""


class Isg(FileControl):
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
        extrapolation="the value of the outermost node is assumed to hold (ISG-2)",
        bidirectional=True,
        max_points=MOST_NODES,
        max_tables=50,
        combine="sum: EXX, EXY and EXZ are all in the direction of X",
    )
    assumptions = (
        Assumption(
            "ISG-1",
            "With workpiece_axes 0 and no angular parameters the control takes EXX, EXY and EXZ off the command of X "
            "as they are, all together, and so with Y and Z.",
            "TF5280 documentation: values are errors; component errors of an axis may depend on other axes, too",
            "so",
            "Load two grids, EXX 0.010 and EXY 0.005 everywhere: X must move by 0.015 mm towards minus.",
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
        Assumption(
            "ISG-4",
            "The steps of a grid need not be even.",
            "TF5280 documentation: GRID expects the values on a grid, whose positions the file gives one by one; of "
            "even steps it says nothing",
            "uneven",
            "The control reports error 70471 if it wants even steps: --set steps=even.",
        ),
        Assumption(
            "ISG-5",
            "Leadscrew compensation (kw.ssfk) and VOLCOMP both change the setpoint, and their changes add up.",
            "TF5200 documentation: leadscrew compensation changes the setpoint of its axis; TF5280 says the same of "
            "VOLCOMP; of both together neither says anything",
            "so; --set play=no writes no axis lists",
            "Switch on one, then both, and read the setpoint of the drive while the axis stands still.",
        ),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "folder": Option("C:\\vc", "where the control finds the grid file"),
        "axes": Option("", "logical axis numbers, e.g. X:1,Y:2,Z:3,B:4,C:5"),
        "filter_steps": Option("20", "over how many cycles the control spreads a change", whole(0, MOST_NODES)),
        "fit": Option(
            "nodes", "nodes: exact at the nodes; area: least squares over what is around them", one_of("nodes", "area")
        ),
        "grids": Option(
            "auto",
            "one: a grid over all axes that matter; sum: several over fewer axes each; or auto",
            one_of("auto", "one", "sum"),
        ),
        "steps": Option(
            "uneven", "uneven: nodes where the error bends; even: evenly spaced (ISG-4)", one_of("uneven", "even")
        ),
        "negate": Option(
            "",
            "linear axes whose compensation the control is told to turn round (P-VOLC-00009), e.g. XY; their values "
            "are written with the other sign, so that the same is added",
            AXES,
        ),
        "play": Option(
            "yes",
            "yes: what the way of an axis changes goes into its leadscrew compensation; no: it is left",
            one_of("yes", "no"),
        ),
        "points": Option("20000", "most nodes in all; vol_comp[0].max_records must allow them", whole(8, MOST_NODES)),
    }
    steps = (
        "Copy the grid files, volcomp0.csv and on, to the folder that volcomp.lis names.",
        "Enter volcomp.lis in the start-up list as vol_comp[0].file_name; vol_comp[0].max_records must be at least the "
        "number of nodes of all files.",
        "Is there a leadscrew_*.lis? Enter its lines in the compensation list of that axis and set lr_param.ssfk 1 in "
        "the axis parameters. If that list holds values already, do not replace them: add these to both ways, since "
        "the machine was measured with them. Set no other backlash compensation for the same play.",
        "Start the control, home all axes, and switch on: #VOLCOMP ON [ID0].",
        "Read the compensation values at one pose and compare them with ncfix emulate.",
        "Measure one line again: the error must have become smaller, not twice as large.",
    )
    switch_off = (
        "#VOLCOMP OFF in the program, or take vol_comp[0] out of the start-up list; lr_param.ssfk 0 for axes with a "
        "leadscrew_*.lis."
    )

    def write(self, request: Request) -> Written:
        """`volcomp.lis` and the grids over the axes that matter; leadscrew lists for play."""
        settings = self.settings(request.settings)
        most = int(settings["points"])
        filter_steps = int(settings["filter_steps"])
        numbers = _numbers(request, settings["axes"])
        inputs = inputs_that_matter(request.machine, request.space, request.tool_length)
        inputs = tuple(sorted(inputs, key=LETTERS.index))
        volume = Volume.of(request.machine, inputs, request.space, request.tool_length, settings["fit"] == "area")
        volume.uneven = settings["steps"] == "uneven"
        made = _grid_set(volume, AIM * request.target, most, settings["grids"])
        names = [TABLE.format(number) for number in range(len(made.grids))]
        negate = "".join(sorted(settings["negate"].upper()))
        files = {CONFIG: config_text(numbers, settings["folder"], names, filter_steps, negate)}
        for name, owners, grid in zip(names, made.owners, made.grids, strict=True):
            files[name] = grid_text(_times(grid, dict.fromkeys(negate, -1.0)), owners)
        play: tuple[Reversal, ...] = ()
        if settings["play"] == "yes":
            space, length = request.space, request.tool_length
            play = reversals(request.machine, space, length, request.target, MOST_SCREW_POINTS)
        for each in play:
            files[SCREW_FILE.format(each.axis)] = list_text(each, numbers[each.axis])
        return Written(files, tuple(_notes(made, request, play)))

    def examined(self, files: Files) -> tuple[Compensation, list[Remarks]]:
        """The grids, with the signs of the configuration applied, and play."""
        listed, config = read_configuration(files)
        grids, remarks = read_grids(listed.files, listed.numbers, files)
        play, more = read_leadscrews(files, listed.numbers)
        turned = (_times(grid, listed.factors) for grid in grids)
        return Compensation((*(Term((grid,)) for grid in turned), *play)), [config, *remarks, *more]

    def knows(self, name: str, content: bytes) -> bool:
        """Whether a file is a list of VOLCOMP or of a leadscrew, or a table whose header has positions, then errors."""
        return SCREW_MARK in content or is_list(content) or is_grid(content)

    def look(self, files: Files) -> tuple[Message, ...]:
        """See `Control`; without a list of VOLCOMP, grids and axis lists are examined by themselves."""
        if any(is_list(content) for content in files.values()):
            return self.lint(files)
        grids = sorted(name for name, content in files.items() if is_grid(content))
        remarks = [*read_grids(grids, LETTERS, files)[1], *read_leadscrews(files, None)[1]]
        return messages_of(remarks)


@frozen
class GridSet:
    """Grids, the axis after which each one's parameters are named, and the largest error that all leave, mm."""

    grids: tuple[Grid, ...]
    owners: tuple[str, ...]
    left: float


def _grid_set(volume: Volume, target: float, most: int, how: str) -> GridSet:
    """One grid, or several whose sum is the correction."""
    found = None
    if how == "sum" or (how == "auto" and len(volume.inputs) > MAX_SINGLE_GRID_INPUTS):
        found = faces(volume, [volume.inputs.index(axis) for axis in LINEAR], target)
    if found is None:
        mesh = search(volume, target, [most] * len(volume.inputs), most)
        return GridSet((mesh.grid,), ("",), mesh.left)
    made = searched(volume, found, target, most)
    return GridSet(made.grids, tuple(volume.inputs[face.owner] for face in made.faces), made.left)


def _times(grid: Grid, factors: Mapping[str, float]) -> Grid:
    """The grid with the values of each output axis multiplied by its factor: -1 if reversed, 0 if switched off."""
    return replace(grid, values=grid.values * [factors.get(name, 1.0) for name in grid.outputs])


def _numbers(request: Request, given: str) -> dict[str, int]:
    """Axis letter -> logical axis number."""
    names = request.machine.axis_names
    ordered = in_order(request.machine, LETTERS)
    if not {"X", "Y", "Z"} <= set(names):
        text = f"VOLCOMP needs X, Y and Z; the machine has {' '.join(names)}"
        raise RefusedError.of("NCF484", text, hint="correct its programs instead: ncfix fix")
    if not given:
        return {name: number for number, name in enumerate(ordered, 1)}
    pairs = [pair.strip().split(":") for pair in given.split(",")]
    odd = any(len(pair) != 2 or not pair[1].isdecimal() for pair in pairs)
    if odd or sorted(pair[0] for pair in pairs) != sorted(names):
        raise wrong_setting({"axes": given}, "axes", "LETTER:NUMBER for each axis, separated by commas")
    return {name: int(number) for name, number in sorted(pairs, key=lambda pair: LETTERS.index(pair[0]))}


def _notes(made: GridSet, request: Request, play: tuple[Reversal, ...]) -> Iterator[str]:
    for grid, owner in zip(made.grids, made.owners, strict=True):
        counts = " x ".join(f"{name} {count}" for name, count in zip(grid.inputs, grid.counts, strict=True))
        yield f"Grid {counts}: {grid.points} nodes for {', '.join(parameters(grid, owner))}."
    yield f"Together they miss {1e3 * made.left:.2f} um at most between the nodes."
    if made.left > request.target:
        yield f"The target of {1e3 * request.target:g} um is not reached with these nodes: --set points=N allows more."
    for each in play:
        name = SCREW_FILE.format(each.axis)
        yield f"Play of {each.axis}, {1e3 * each.whole:+.2f} um from minus to plus, is in {name}."
    done = Compensation(tuple(term for each in play for term in each.terms()))
    yield from reversal_note(request.machine, request.space, request.tool_length, done)
    yield "The orientation of the tool is not corrected."
