"""Three-dimensional compensation with angles (`cnc_wrrotvolc`): three lengths and three angles at every point.

The record, `IODBROTVOLC` of fwlib32.h, has `lin[3]` and `rot[3]`; their use by the control is not documented publicly.
It is assumed to be as in US patent 7969111, where lattice vectors of six components, which depend on the linear and on
the rotary axes, are added up and move the linear axes. There is a lattice over X, Y and Z: its lengths are the
correction with a tool of length 0, and its angles turn the tool about the gauge line, so that it holds for tools of any
length. A second lattice, over the rotary axes of a table, has angles that turn the workpiece about the table's centre.

The first lattice holds the corrections with the rotary axes at rest, the second the change of the correction at other
angles of the table. The error of a table at an angle shifts and turns the workpiece. The linear axes must follow the
shift, plus the turn times the distance from its centre: six numbers for all positions of X, Y and Z.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from typing import ClassVar

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnostics import RefusedError
from ncfix.machine import Machine, State
from ncfix.tables.axis_tables import reversal_note
from ncfix.tables.compensation import NOTHING, Compensation, Tables
from ncfix.tables.control import Assumption, FileControl, Files, Option, Properties, Request, Written, one_of, whole
from ncfix.tables.correction import corners, exact_correction, linear_axes, residual
from ncfix.tables.grid import Grid
from ncfix.tables.table_files import DEGREE, Remarks, in_order
from ncfix.tables.volume import AIM, Mesh, Volume, inputs_that_matter, search, unseen_axes
from ncfix.values import frozen
from ncfix_fanuc.control import LEVEL
from ncfix_fanuc.parameters import (
    BACKLASH_ASSUMPTION,
    BACKLASH_OPTIONS,
    BACKLASH_STEP,
    LINEAR,
    PLACING_OPTIONS,
    PLACING_STEP,
    UNITS,
    BacklashAmounts,
    anchors,
    placing_assumption,
    read_backlash,
    sign_option,
    units_of,
)
from ncfix_fanuc.records import ANGLES, LARGEST_VALUE, MOST_ROTARY, SIDE, Lattice, read_lattice

LATTICE_FILE, TABLE_LATTICE_FILE = "rotary.json", "rotary-axes.json"
LENGTH = 100.0
"""Length, mm, of the tool by which angles are computed."""
PART = 0.6
"""Share of the target for each lattice, if there are two."""
TRIES = ((False, False), (True, True))
"""Ways to fill a lattice, tried in turn: (fitted by least squares around its points, points only where it bends)."""


@frozen
class Turning:
    """Tables of lengths and angles, both as corrections; the tool is along Z.

    lengths  corrections of X, Y and Z at the gauge line over X, Y and Z, mm
    angles   corrections about X, Y and Z over X, Y and Z, rad, under the names A, B and C
    table    the same two over the rotary axes, if there is a second lattice
    centre   point about which the angles of the second lattice turn, as X, Y and Z of the tip, mm
    play     backlash compensation
    length   tool length, mm
    """

    lengths: Grid
    angles: Grid
    table: tuple[Grid, Grid] | None = None
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)
    play: Compensation = NOTHING
    length: float = 0.0

    def for_tool(self, length: float) -> Turning:
        """The tables with a tool of this length, mm."""
        return replace(self, length=length)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """All grids."""
        return (self.lengths, self.angles, *(self.table or ()), *self.play.grids)

    @property
    def axes(self) -> frozenset[str]:
        """X, Y and Z, and the rotary axes of the second lattice."""
        return frozenset(LINEAR) | frozenset(self.table[0].inputs if self.table else ())

    @property
    def points(self) -> int:
        """Number of points of the lattices; lengths and angles share them."""
        return self.lengths.points + (self.table[0].points if self.table else 0) + self.play.points

    def at(self, names: Sequence[str], q: Array, direction: Array | None = None) -> Array:
        """See `Tables.at`: the shifts, plus the effects of the turned tool and the turned table at the tip."""
        columns = [names.index(axis) for axis in LINEAR]
        tool = np.array([0.0, 0.0, -self.length])
        place = q[:, columns]
        correction = self.play.at(names, q, direction)
        correction[:, columns] += self.lengths.at(place) + np.cross(self.angles.at(place), tool)
        if self.table:
            turned = q[:, [names.index(axis) for axis in self.table[0].inputs]]
            lever = place + tool - np.array(self.centre)
            correction[:, columns] += self.table[0].at(turned) + np.cross(self.table[1].at(turned), lever)
        return correction


class FanucRotary(FileControl):
    """The control `fanuc-rotary`."""

    name = "fanuc-rotary"
    title = "Fanuc Series 30i three-dimensional compensation with angles"
    reaches = "L-VOL, and the position part of R-VOL of tables"
    any_tool = True
    properties = Properties(
        value_sign="as --set sign says",
        input_signal="setpoint",
        position_frame="machine coordinates",
        unit="detection unit times magnification; positions mm",
        quantum=(1e-4, 1e-4 * DEGREE),
        extrapolation="the value of the outermost node is assumed to hold",
        bidirectional=True,
        max_points=SIDE**3,
        max_tables=2,
        combine="a lattice over X, Y and Z, and one over rotary axes",
    )
    assumptions = (
        Assumption(
            "FROT-1",
            "The sign of lengths and angles is what --set sign says.",
            "none public; patents speak of an amount that is added",
            "none: it must be given",
            "Load lin = [100, 0, 0] at all points: does X move towards plus (correction) or minus (error)?",
        ),
        Assumption(
            "FROT-2",
            "Lengths are what is added at the gauge line; angles turn the tool about it, right-handed about X, Y and "
            "Z, and the linear axes follow its tip.",
            "the record has three lengths and three angles (fwlib32.h); a patent (US 7969111) adds six-component "
            "vectors of a lattice to the linear positions",
            "so",
            "Load rot = [100, 0, 0] at all points and see how far Y moves with a short and with a long tool.",
        ),
        Assumption(
            "FROT-3",
            f"Points are numbered from 1, X fastest; values are whole numbers from "
            f"-{LARGEST_VALUE} to {LARGEST_VALUE}.",
            "none public",
            "so",
            "Write one point and read it back.",
        ),
        Assumption(
            "FROT-4",
            "There is a second lattice, over the rotary axes of a table: what it says is added, lengths as they are, "
            "angles times the distance of the tip from centre_mm (X, Y and Z as commanded, Z less the tool's length, "
            "minus centre_mm), right-handed about X, Y and Z.",
            "a patent (US 7969111) adds six-component vectors that depend on rotary axes to those that depend on "
            "linear axes; no public text says that the control has it so",
            "it is written; --set rotary=no leaves it out",
            "Load lin = [100, 0, 0] at one angle only, and see whether X moves there.",
        ),
        BACKLASH_ASSUMPTION,
        placing_assumption("FROT-5"),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "sign": sign_option("FROT-1"),
        **UNITS,
        "rotary": Option(
            "yes", "yes: a second lattice, over the rotary axes of a table (FROT-4); no: none", one_of("yes", "no")
        ),
        **PLACING_OPTIONS,
        **BACKLASH_OPTIONS,
        "rotary_points": Option(
            "72", "most points along a rotary axis; how many the control takes is not public", whole(2, MOST_ROTARY)
        ),
    }
    steps = (
        "Check FROT-1 to FROT-5 on the machine.",
        PLACING_STEP,
        "Set the magnifications as rotary.json, and rotary-axes.json if it is there, have them.",
        BACKLASH_STEP,
        "Write the records with cnc_wrrotvolc, switch power off and on, home all axes.",
        "Measure one line with a short and with a long tool: both errors must have become smaller.",
    )
    switch_off = (
        "Switch the function off by its parameter; give parameter 1851 its old values if backlash.txt was there. Power "
        "off and on, home all axes."
    )

    def write(self, request: Request) -> Written:
        """`rotary.json`, and `rotary-axes.json` for machines with a table that turns."""
        settings = self.settings(request.settings)
        sign, rotary = settings["sign"], settings["rotary"]
        machine = request.machine
        in_order(machine)
        if not set(LINEAR) <= set(machine.axis_names):
            raise RefusedError.of("NCF484", f"the grid is over X, Y and Z; the machine has {machine.axis_names}")
        if not np.allclose(machine.tool.direction, (0, 0, 1), atol=1e-9):
            raise RefusedError.of("NCF484", "the tool of this machine is not along Z", hint="use the control fanuc")
        units = units_of(settings)
        most = int(settings["rotary_points"])
        backlash = BacklashAmounts.of(request, settings, units[0])
        filling = LatticeFilling(request, sign, units, backlash, settings)
        two = rotary == "yes" and bool(table_axes(request))
        lattices = [filling.linear(PART if two else 1.0)]
        if two and (second := filling.rotary(PART, most)):
            lattices.append(second)
        names = (LATTICE_FILE, TABLE_LATTICE_FILE)[: len(lattices)]
        files = {name: lattice.text() for name, (lattice, _) in zip(names, lattices, strict=True)}
        files |= backlash.files()
        return Written(files, tuple(_notes(request, lattices, backlash.tables(units[0]), backlash.notes(units[0]))))

    def examined(self, files: Files) -> tuple[Turning | None, list[Remarks]]:
        """The lattices and backlash compensation, as the control is assumed to add them."""
        found = [read_lattice(LATTICE_FILE, files.get(LATTICE_FILE, b""), linear=True)]
        if TABLE_LATTICE_FILE in files:
            found.append(read_lattice(TABLE_LATTICE_FILE, files[TABLE_LATTICE_FILE], linear=False))
        lattices = [lattice for lattice, _ in found if lattice is not None]
        if len({lattice.scale.sign for lattice in lattices}) > 1:
            found[1][1].refuse(0, f"the sign differs from that of {LATTICE_FILE}")
        backlash, more = read_backlash(files, lattices[0].home_minus if lattices else "")
        remarks = [*(each for _, each in found), *more]
        if len(lattices) < len(found):
            return None, remarks
        first, *second = lattices
        play = backlash.tables(first.scale.units[0])
        if not second:
            return Turning(*first.grids(), play=play), remarks
        return Turning(*first.grids(), second[0].grids(), second[0].centre, play), remarks

    def reached(self, machine: Machine, tables: Tables) -> str:
        """The reach of these tables: without a lattice over rotary axes, only L-VOL."""
        both = isinstance(tables, Turning) and tables.table is not None
        return self.reaches if both else "L-VOL"

    def knows(self, name: str, content: bytes) -> bool:
        """Records of lengths and angles as ncfix writes them."""
        return content.lstrip()[:1] == b"{" and b'"lin"' in content


def _rounding(request: Request, lattice: Lattice) -> float:
    """Largest tip error by rounding, mm, at the place farthest from the centre of the angles."""
    length, angle = lattice.scale.rounding
    tool = np.array([0.0, 0.0, -request.tool_length])
    levers = tool[None]
    if lattice.centre:
        space = request.space[[request.machine.axis_names.index(axis) for axis in LINEAR]]
        levers = corners(space) + tool - np.array(lattice.centre)
    signs = corners(np.array([[-1.0, 1.0]] * 3))
    turned = [np.abs(np.cross(sign, levers)) for sign in signs]
    return float(np.linalg.norm(length + angle * np.max(turned, axis=0), axis=1).max())


def _notes(
    request: Request, lattices: Sequence[tuple[Lattice, Mesh]], play: Compensation, more: Iterator[str]
) -> Iterator[str]:
    """Notes: the lattices, and the error that is left with the first one, and with both."""
    tables = None
    for lattice, mesh in lattices:
        counts = " x ".join(f"{name} {count}" for name, count in zip(lattice.inputs, mesh.grid.counts, strict=True))
        length, angle = lattice.scale.rounding
        yield (
            f"Lattice {counts}: {mesh.grid.points} points; lengths are rounded by up to {1e3 * length:.2f} um, angles "
            f"by {1e6 * angle:.2f} urad: together up to {1e3 * _rounding(request, lattice):.2f} um at the tip."
        )
        if lattice.placing is not None:
            unit = "mm" if lattice.inputs == LINEAR else "degree"
            yield from lattice.placing.notes(lattice.inputs, mesh.grid.counts, lattice.step, unit)
        tables = (
            Turning(*lattice.grids(), play=play)
            if tables is None
            else replace(tables, table=lattice.grids(), centre=lattice.centre)
        )
        left = residual(request.machine, tables, request.space, request.tool_length).figures()["after"]
        kind = "L-VOL" if tables.table is None else "L-VOL and the position part of R-VOL"
        yield f"{kind}: {left['max']:.2f} um at most remain, {left['rms']:.2f} um rms."
        if not mesh.reached:
            yield f"Its share of the target of {1e3 * request.target:g} um is not reached with the points allowed."
    seen = [axis for lattice, _ in lattices for axis in lattice.inputs]
    if others := unseen_axes(request.machine, request.space, request.tool_length, seen):
        yield f"The lattice is exact with {others} at zero; at other angles the remaining error is larger."
    yield from more
    yield from reversal_note(request.machine, request.space, request.tool_length, play)


@frozen
class LatticeFilling:
    """The task of filling lattices, with its settings."""

    request: Request
    sign: str
    units: tuple[float, float]
    backlash: BacklashAmounts
    settings: Mapping[str, str]

    @property
    def machine(self) -> Machine:
        """The machine."""
        return self.request.machine

    def linear(self, share: float) -> tuple[Lattice, Mesh]:
        """The lattice over X, Y and Z: exact at its points if that reaches the target, else fitted around them."""
        target = share * AIM * self.request.target
        found: list[tuple[Lattice, Mesh]] = []
        for area, trimmed in TRIES:
            volume = self._volume(self.request.tool_length, area)
            for index in range(len(LINEAR)) if trimmed else ():
                volume = volume.trimmed(index, LEVEL * self.request.target)
            lattice = cache(partial(self._lattice, area=area, covered=volume.covered))
            volume.made = partial(self._as_written, lattice, volume)
            mesh = search(volume, target, [SIDE] * 3, SIDE**3)
            found.append((lattice(mesh.grid.counts), mesh))
            if mesh.reached:
                break
        return min(found, key=lambda each: each[1].left)

    def _volume(self, length: float, area: bool) -> Volume:
        volume = Volume.of(self.machine, LINEAR, self.request.space, length, area)
        shift = self.backlash.shift(self.units[0])[[LINEAR.index(axis) for axis in volume.outputs]]
        exact = volume.exact
        return replace(volume, exact=lambda places: exact(places) + shift, anchors=self._anchors(LINEAR))

    def _anchors(self, inputs: Sequence[str]) -> tuple[float, ...]:
        return anchors(self.request, self.settings, inputs)

    def _lattice(self, counts: tuple[int, ...], area: bool, covered: Array) -> Lattice:
        """A lattice with these numbers of points: tools of two lengths separate lengths from angles."""
        volumes = (replace(self._volume(length, area), covered=covered) for length in (0.0, LENGTH))
        bare, long = (volume.grid(counts) for volume in volumes)
        order = [bare.outputs.index(axis) for axis in LINEAR]
        lever = (long.values - bare.values)[..., order] / LENGTH
        angles = np.stack([lever[..., 1], -lever[..., 0], np.zeros(lever.shape[:-1])], axis=-1)
        lengths = replace(bare, outputs=LINEAR, values=bare.values[..., order])
        grids = lengths, replace(bare, outputs=ANGLES, values=angles)
        found = Lattice.of(grids, self.sign, self.units, self._anchors(LINEAR))
        return replace(found, home_minus=self.backlash.home_minus)

    def _as_written(
        self, lattice: Callable[[tuple[int, ...]], Lattice], volume: Volume, counts: tuple[int, ...]
    ) -> Grid:
        """The grid with these numbers of points, as rounded to whole numbers."""
        lengths, angles = lattice(counts).grids()
        total = lengths.values + np.cross(angles.values, (0.0, 0.0, -self.request.tool_length))
        values = total[..., [LINEAR.index(axis) for axis in volume.outputs]]
        nodes = tuple(volume.nodes(index, count) for index, count in enumerate(counts))
        return Grid(volume.inputs, nodes, volume.outputs, values)

    def rotary(self, share: float, most: int) -> tuple[Lattice, Mesh] | None:
        """The lattice over the rotary axes; None if no table turns, or its angle does not matter."""
        inputs = table_axes(self.request)
        if not inputs:
            return None
        table = TurningTable.of(self.request, inputs)
        reach = np.linalg.norm(table.levers, axis=1).max()
        space = self.request.space[list(table.columns)]
        units = tuple(self.machine.axes[column].unit for column in table.columns)
        names = (*LINEAR, *ANGLES)
        volume = Volume(inputs, space, units, names, lambda places: table.six(places) * ([1.0] * 3 + [reach] * 3))
        volume.anchors = self._anchors(inputs)
        mesh = search(volume, share * AIM * self.request.target, [most] * len(inputs), most ** len(inputs))
        lengths, angles = mesh.grid.values[..., :3], mesh.grid.values[..., 3:] / reach
        grids = (replace(mesh.grid, outputs=LINEAR, values=lengths), replace(mesh.grid, outputs=ANGLES, values=angles))
        return Lattice.of(grids, self.sign, self.units, volume.anchors, table.centre), mesh


def table_axes(request: Request) -> tuple[str, ...]:
    """The rotary axes on which the correction depends, if all of them turn the workpiece; else none."""
    machine = request.machine
    matter = inputs_that_matter(machine, request.space, request.tool_length)
    found = [axis.name for axis in machine.axes if axis.rotary and axis.name in matter]
    on_table = machine.topology.upper().split("F")[0]
    return tuple(sorted(found)) if found and all(name in on_table for name in found) else ()


@frozen
class TurningTable:
    """The change of the correction by the rotary axes of a table.

    columns  columns of the rotary axes
    centre   point about which the angles turn: on the table's outer axis, as X, Y and Z of the tip, mm
    places   (m, n_axes) sampled positions of all axes, the rotary ones at rest
    levers   (m, 3) vectors from the centre to the tip there, mm
    """

    machine: Machine
    columns: tuple[int, ...]
    state: State
    centre: Array
    places: Array
    levers: Array

    @classmethod
    def of(cls, request: Request, inputs: Sequence[str]) -> TurningTable:
        """The table, sampled in the corners of the space of X, Y and Z, and in its middle."""
        machine, space = request.machine, request.space
        columns = tuple(machine.axis_names.index(name) for name in inputs)
        outer = max(columns)
        centre = np.asarray(machine.axes[outer].point) - np.asarray(machine.tool.point)
        linear = [machine.axis_names.index(name) for name in LINEAR]
        points = np.concatenate([corners(space[linear]), space[linear].mean(axis=1)[None]])
        places = np.tile(np.clip(np.zeros(len(space)), space[:, 0], space[:, 1]), (len(points), 1))
        places[:, linear] = points
        levers = points - [0.0, 0.0, request.tool_length] - centre
        return cls(machine, columns, State(request.tool_length), np.round(centre, 4), places, levers)

    def six(self, positions: Array) -> Array:
        """(n, 6) three lengths, mm, and three angles, rad, at positions of the rotary axes (n, n_rotary)."""
        q = np.repeat(self.places[None], len(positions), axis=0)
        q[:, :, list(self.columns)] = positions[:, None]
        added = self._correction(q.reshape(-1, q.shape[-1])).reshape(len(positions), -1)
        added = added - self._correction(self.places).reshape(-1)
        turning = np.stack([np.cross(axis, self.levers) for axis in np.eye(3)], axis=-1)
        shifting = np.broadcast_to(np.eye(3), turning.shape)
        design = np.concatenate([shifting, turning], axis=-1).reshape(-1, 6)
        return np.linalg.lstsq(design, added.T, rcond=None)[0].T

    def _correction(self, q: Array) -> Array:
        linear = [self.machine.axis_names.index(name) for name in LINEAR]
        assert sorted(linear) == linear_axes(self.machine)
        return exact_correction(self.machine, q, self.state)[:, linear]
