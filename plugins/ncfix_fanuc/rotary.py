"""Three-dimensional compensation with angles (`cnc_wrrotvolc`): three lengths and three angles at every point.

The record, `IODBROTVOLC` of fwlib32.h, has `lin[3]` and `rot[3]`; what the control makes of them is not public. Taken
for true, as in US patent 7969111, where lattice vectors of six components that depend on the linear axes and on the
rotary axes are added up and move the linear axes: a lattice over X, Y and Z, whose lengths are what is added with a
tool of no length and whose angles turn the tool about the gauge line, so that it holds for tools of any length; and a
second lattice over the rotary axes of a table, whose angles turn the workpiece about the table's centre.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ncfix.diagnostics import Message, RefusedError
from ncfix.machine import Machine
from ncfix.tables.axis_tables import reversal_note
from ncfix.tables.compensation import NOTHING, Compensation, Tables
from ncfix.tables.control import Assumption, Control, Files, Option, Properties, Request, Written, one_of, whole
from ncfix.tables.correction import corners, residual
from ncfix.tables.grid import Array, Grid
from ncfix.tables.table_files import DEGREE, Remarks, in_order
from ncfix.tables.volume import Mesh
from ncfix_fanuc.backlash import ASSUMPTION, OPTIONS, STEP, Backlash, read_backlash
from ncfix_fanuc.placing import OPTIONS as PLACES
from ncfix_fanuc.placing import STEP as PLACING
from ncfix_fanuc.placing import assumption
from ncfix_fanuc.rotary_fill import PART, LatticeFilling, table_axes
from ncfix_fanuc.rotary_records import LARGEST, LINEAR, MOST_ROTARY, SIDE, Lattice, read_lattice
from ncfix_fanuc.units import UNITS, sign_option, units_of

NAME, SECOND = "rotary.json", "rotary-axes.json"


@dataclass(frozen=True, slots=True)
class Turning:
    """Lattices of lengths and angles, both corrections; the tool is along Z.

    lengths  over X, Y and Z: X, Y, Z at the gauge line, mm
    angles   about X, Y and Z, rad, under the names A, B and C
    table    the same two over the rotary axes, if there is a second lattice
    centre   about which angles of the second turn, as X, Y and Z of the tip, mm
    play     what else is done when an axis turns round
    """

    lengths: Grid
    angles: Grid
    table: tuple[Grid, Grid] | None = None
    centre: tuple[float, ...] = (0.0, 0.0, 0.0)
    play: Compensation = NOTHING
    length: float = 0.0

    def for_tool(self, length: float) -> Turning:
        """With a tool of this length."""
        return replace(self, length=length)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """All of them."""
        return (self.lengths, self.angles, *(self.table or ()), *self.play.grids)

    @property
    def axes(self) -> frozenset[str]:
        """X, Y and Z, and the rotary axes that are looked up."""
        return frozenset(LINEAR) | frozenset(self.table[0].inputs if self.table else ())

    @property
    def points(self) -> int:
        """The points of the lattices; lengths and angles share them."""
        return self.lengths.points + (self.table[0].points if self.table else 0) + self.play.points

    def at(self, names: Sequence[str], q: Array, direction: Array | None = None) -> Array:
        """See `Tables.at`: shifts, what the turned tool adds at its tip, and what the turned table adds there."""
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


class FanucRotary(Control):
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
        extrapolation="taken as held at the outermost nodes",
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
            f"Points are numbered from 1, X fastest; values are whole numbers from -{LARGEST} to {LARGEST}.",
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
        ASSUMPTION,
        assumption("FROT-5"),
    )
    options: ClassVar[Mapping[str, Option]] = {
        "sign": sign_option("FROT-1"),
        **UNITS,
        "rotary": Option(
            "yes", "yes: a second lattice, over the rotary axes of a table (FROT-4); no: none", one_of("yes", "no")
        ),
        **PLACES,
        **OPTIONS,
        "rotary_points": Option(
            "72",
            "most points along a rotary axis; how many the control takes is not public",
            whole(2, MOST_ROTARY),
        ),
    }
    steps = (
        "Settle FROT-1 to FROT-5 on the machine.",
        PLACING,
        "Set the magnifications as rotary.json, and rotary-axes.json if it is there, have them.",
        STEP,
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
        backlash = Backlash.of(request, settings, units[0])
        filling = LatticeFilling(request, sign, units, backlash, settings)
        two = rotary == "yes" and bool(table_axes(request))
        lattices = [filling.linear(PART if two else 1.0)]
        if two and (second := filling.rotary(PART, most)):
            lattices.append(second)
        names = (NAME, SECOND)[: len(lattices)]
        files = {name: lattice.text() for name, (lattice, _) in zip(names, lattices, strict=True)}
        files |= backlash.files()
        return Written(files, tuple(_notes(request, lattices, backlash.tables(units[0]), backlash.notes(units[0]))))

    def read(self, files: Files) -> Turning:
        """As the control is taken to add them. Raises `ConfigError` NCF491."""
        lattices, backlash, remarks = _read(files)
        for each in remarks:
            each.check()
        first, *more = lattices
        play = backlash.tables(first.scale.units[0])
        if not more:
            return Turning(*first.grids(), play=play)
        return Turning(*first.grids(), more[0].grids(), more[0].centre, play)

    def lint(self, files: Files) -> tuple[Message, ...]:
        """Records that do not fit, and values beyond the range."""
        return tuple(message for remarks in _read(files)[2] for message in remarks.messages)

    def reached(self, machine: Machine, tables: Tables) -> str:
        """Without a lattice over rotary axes, nothing that they do is in it."""
        both = isinstance(tables, Turning) and tables.table is not None
        return self.reaches if both else "L-VOL"

    def knows(self, name: str, content: bytes) -> bool:
        """Records of lengths and angles as ncfix writes them."""
        return content.lstrip()[:1] == b"{" and b'"lin"' in content


def _read(files: Files) -> tuple[list[Lattice], Backlash, list[Remarks]]:
    """The lattices of a folder that can be used, play, and remarks on every file."""
    found = [read_lattice(NAME, files.get(NAME, b""), linear=True)]
    if SECOND in files:
        found.append(read_lattice(SECOND, files[SECOND], linear=False))
    lattices = [lattice for lattice, _ in found if lattice is not None]
    if len({lattice.scale.sign for lattice in lattices}) > 1:
        found[1][1].refuse(0, f"the sign is another one than that of {NAME}")
    backlash, more = read_backlash(files, lattices[0].home_minus if lattices else "")
    return lattices, backlash, [*(remarks for _, remarks in found), *more]


def _rounding(request: Request, lattice: Lattice) -> float:
    """How far rounding can put the tip off where it is farthest from where angles turn about, mm."""
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
    request: Request, lattices: Sequence[tuple[Lattice, Mesh]], play: Compensation, said: Iterator[str]
) -> Iterator[str]:
    """What the lattices are, and what is left with the first one and with both."""
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
        yield f"{kind}: {left['max']:.2f} um at most are left, {left['rms']:.2f} rms."
        if not mesh.reached:
            yield f"Its share of the target of {1e3 * request.target:g} um is not reached with the points allowed."
    if len(lattices) == 1 and request.machine.rotary.any():
        yield "The lattice is that of rotary axes at zero; at other angles more is left."
    yield from said
    yield from reversal_note(request.machine, request.space, request.tool_length, play)
