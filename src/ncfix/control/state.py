"""The state of a control while it follows a program: modal codes, frames, positions, and what is unknown."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Hashable, Sequence
from dataclasses import field

from ncfix.control.arcs import Point
from ncfix.control.coordinates import (
    DEGREE,
    IDENTITY,
    INDEX,
    LETTERS,
    PLANES,
    ROTARY_LETTERS,
    Places,
    Plane,
    Rotation,
    Vector,
    X,
    Y,
    Z,
    dot,
    mask_of,
    rotated,
    transposed,
    zeros,
)
from ncfix.control.expressions import Unknown, Value
from ncfix.control.frames import FrameStack, handed, mixed_into
from ncfix.control.moves import AT_START, Arc, FeedMode, UnknownAxes
from ncfix.control.pointing import Pair
from ncfix.control.posture import ALIGNMENT_TOLERANCE_RAD, NEAREST, MachinePosture, Postures, WayRules, normal_of
from ncfix.control.setup import Run, SetupLookup
from ncfix.diagnostics import Message, Place
from ncfix.text.dialect import Dialect
from ncfix.text.reach import Deletable
from ncfix.values import frozen, mutable

NO_MOTION = 800
"""G80: no motion code is in force; the state at the start of a program."""


@mutable
class Cycle:
    """Modal values of a canned cycle.

    depth    the word of the axis across the plane, as written
    r        the R word, as written
    level    R in the program's frame, mm
    initial  coordinate across the plane at which the series of holes began, mm in the program's frame; None outside of
             one
    unknown  one of these is known only at run time
    """

    depth: float = 0.0
    r: float = 0.0
    level: float = 0.0
    initial: float | None = None
    unknown: bool = False


@mutable
class Modal:
    """Modal state. G codes in tenths.

    motion        motion code
    straight      the last of G0 and G1
    plane         plane of arcs and cycles
    unit          mm per unit of linear words
    per_feed      mm per unit of feeds per minute or revolution
    diameter      X words are diameters (G7)
    incremental   G91
    arc_absolute  G90.1
    feed_mode     93, 94 or 95
    feed          mm/min, 1/min or mm/rev; NaN if none is set, or if it is known only at run time
    feed_given    a nonzero feed is set
    speed         S
    retract_to_r  G99: canned cycles end at R
    compensated   cutter radius compensation: 41, 42 or 0
    system        1..9: G54..G59.3
    tool_code     430 with, 490 without a tool length offset in force
    spindle       3, 4 or 5
    exact_stop    the control stops at the end of every motion
    """

    motion: int = NO_MOTION
    straight: int = NO_MOTION
    plane: Plane = PLANES[170]
    unit: float = 1.0
    per_feed: float = 1.0
    diameter: bool = False
    incremental: bool = False
    arc_absolute: bool = False
    feed_mode: int = 94
    feed: float = math.nan
    feed_given: bool = False
    speed: float = 0.0
    retract_to_r: bool = False
    compensated: int = 0
    system: int = 1
    tool_code: int = 490
    spindle: int = 5
    exact_stop: bool = False
    cycle: Cycle = field(default_factory=Cycle)


@frozen
class Saved:
    """A modal state saved by M70 or M73; `at_return`: restored when the subprogram returns."""

    modal: Modal
    at_return: bool


@mutable
class Tools:
    """Tool numbers: selected with T, in the spindle, and of the length offset in force (`offset`).

    vector    the length offset in force, mm along each axis (rad)
    register  number of the radius compensation register (D), if it is not the tool's
    cutter    radius for contour offsets, mm, if the program gives it; else NaN
    lengths   tool lengths set by the program (G10 L1), mm
    measured  tools whose length the program sets from values known only at run time
    resized   registers (D) whose radius the program sets; what the control makes of the number is not known
    unsure    the tool in the spindle is known only at run time; `doubtful`: the selected one
    """

    selected: int = 0
    spindle: int = 0
    doubtful: bool = False
    unsure: bool = False
    offset: int | None = None
    vector: Vector = field(default_factory=zeros)
    register: int | None = None
    cutter: float = math.nan
    lengths: dict[int, float] = field(default_factory=dict)
    measured: set[int] = field(default_factory=set)
    resized: set[int] = field(default_factory=set)

    def select(self, number: int, *, unsure: bool = False) -> None:
        """Select the tool for the next change; `unsure`: the number is only nominal."""
        self.selected, self.doubtful = number, unsure

    def change(self) -> None:
        """Put the selected tool into the spindle."""
        self.spindle, self.unsure = self.selected, self.doubtful


BLOCK_DELETE = "NCF235"
TOOL_AT_RUN_TIME = "which tool is in the spindle is known only at run time, and no length offset gives its length"
XYZ = (X, Y, Z)
SPATIAL = 1 << X | 1 << Y | 1 << Z


def named_switches(switches: Collection[int]) -> str:
    """Block delete switches as written in blocks: `/2 /3`."""
    return " ".join(f"/{number}" for number in sorted(switches))


class ControlState(ABC):
    """Positions of a control, in commands and in program coordinates, and everything they depend on.

    axis_indices  letter indices of the machine's axes, in column order
    rotary     for each letter, whether it is a rotary axis; `turning`: letter indices of the machine's rotary axes
    posture    directions of the machine's tool and axes
    modal      the modal codes in force; `tools`: the tools in use
    frames     the frames in force, stacked in `frame_order`; `composed`: all of them as one
    offset     what is added to program numbers after rotation and scaling: the shift of `composed` and the tool length
    stretch    mm per program unit of length in the frames in force
    position   the command of every letter, mm and rad; a nominal value for letters in `unknown`
    unknown    letter index -> why the position is unknown
    frame_unknown  the same along the axes of a rotated frame, if its words tell more than the machine axes; None: they
                   do not
    places     which axes the program itself has positioned
    knowledge  access to the setup, with a record of missing data
    offset_checked  whether the setup has been asked for the work offset in force
    unit_said  whether the program has stated inch or millimetre, by `unit_codes`
    tcp        whether X Y Z refer to the tip (tool-centre-point control)
    tilted     whether a tilted plane is in force
    switches   block delete switches on which the path depends
    increments weight of a number without a decimal point, for linear and rotary words
    locate     returns the current place in the program; `messages`: remarks so far, by text; `rolled`: remarks on axes
               that may roll over, which follow them
    """

    frame_order: tuple[str, ...] = ("datum",)

    def __init__(self, run: Run, dialect: Dialect) -> None:
        self.setup = run.setup
        self.kinematics = run.kinematics
        self.dialect = dialect
        self.axis_indices = tuple(INDEX[axis] for axis in run.axes)
        self.rotary = tuple(
            (letter in run.rotary) if letter in run.axes else letter in ROTARY_LETTERS for letter in LETTERS
        )
        self.turning = tuple(index for index in self.axis_indices if self.rotary[index])
        self.posture = MachinePosture(run.kinematics, self.axis_indices, self.rotary)
        self.modal = Modal()
        self.frames = FrameStack(self.frame_order)
        self.tools = Tools()
        self.knowledge = SetupLookup(run.setup, self.place)
        self.messages: dict[str, Message] = {}
        self.rolled: dict[str, Message] = {}
        self.increments = (1.0, 1.0)
        self.tilted = False
        self.switches = set[int]()
        self.tcp = run.setup.tcp
        self.frame_unknown: UnknownAxes | None = None
        self.locate: Callable[[], Place] = lambda: Place("")
        self.offset_checked = self.unit_said = False
        self._frame = -1
        given = () if run.setup.assume_zero else run.setup.initial
        self.places = Places(mask_of(INDEX[axis] for axis in run.axes if axis not in given))
        self._compose()
        self.position = zeros()
        self.unknown: UnknownAxes = {}
        for axis in run.axes:
            index = INDEX[axis]
            if axis in self.setup.initial:
                self.position[index] = self.setup.initial[axis] * (DEGREE if self.rotary[index] else 1.0)
            else:
                self.unknown[index] = AT_START

    def place(self) -> Place:
        """The current place in the program."""
        return self.locate()

    def warn(self, code: str, text: str, hint: str = "") -> None:
        """Record a warning; each text is recorded once."""
        if text not in self.messages:
            self.messages[text] = Message(code, text, self.place(), hint)

    def is_deleted(self, block: Deletable) -> bool:
        """Whether a block with block delete is skipped."""
        switches, stated = block.switches, self.setup.block_skip
        deleted = bool(switches & stated) if isinstance(stated, frozenset) else bool(stated)
        if not block.matters:
            return deleted
        self.switches |= switches
        told = "skipped" if deleted else "executed"
        name = "/" if stated is None or isinstance(stated, bool) else named_switches(switches)
        hint = "--block-skip off: they are executed" if deleted else "--block-skip on: they are skipped"
        self.warn(BLOCK_DELETE, f"blocks with {name} are taken as {told}", hint)
        return deleted

    def set_unit(self, unit: float, per_feed: float | None = None) -> None:
        """Set the unit of linear words, `unit` in mm, and that of feeds, if another, `per_feed` in mm.

        A feed set before in another unit is then unknown: a rotary axis keeps its degrees, and controls differ in what
        else they convert.
        """
        modal, per_feed = self.modal, unit if per_feed is None else per_feed
        if per_feed != modal.per_feed and modal.feed_mode != FeedMode.INVERSE_TIME:
            modal.feed = math.nan
        self.unit_said, modal.unit, modal.per_feed = True, unit, per_feed
        self.refresh()

    @property
    def feed_unit(self) -> float:
        """What the number of an F word counts in the feed mode in force."""
        return 1.0 if self.modal.feed_mode == FeedMode.INVERSE_TIME else self.modal.per_feed

    @property
    def feed_in_force(self) -> Value:
        """The number of the F word in force; zero without one."""
        modal = self.modal
        if math.isnan(modal.feed):
            return Unknown("F") if modal.feed_given else 0.0
        return modal.feed / self.feed_unit

    # -- frames -------------------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Compose the frames; must be called after a change of a frame, the tool, the unit or the diameter mode."""
        before = self.rotation
        self._compose()
        if self.rotation != before:
            self.frame_unknown = None
        self._frame = -1
        self.places.watch(self.anchors(), self.rotation)

    def _compose(self) -> None:
        whole = self.composed = self.frames.whole
        self.offset: Vector = [a + b for a, b in zip(whole.shift, self.tool_shift, strict=True)]
        self.rotation: Rotation = whole.rotation
        self.is_rotated = self.rotation != IDENTITY
        self.inverse = transposed(self.rotation)
        self.stretch = self.modal.unit * whole.scale
        self.scale = [DEGREE if turning else self.stretch for turning in self.rotary]
        if self.modal.diameter:
            self.scale[0] /= 2

    @property
    def tool_shift(self) -> Vector:
        """What the tool length adds to program numbers; nothing under TCP, where they refer to the tip."""
        return zeros() if self.tcp else self.tools.vector

    @abstractmethod
    def anchors(self) -> list[Hashable]:
        """For each letter, the references of its numbers other than shifts and rotations stated in the program."""

    def spatial_anchor(self, index: int) -> Hashable:
        """Further references of X, Y and Z: whether they refer to the tip, and the tool of the length offset."""
        return self.tcp, self.tools.offset if (self.tcp and not self.tilted) or index == Z else None

    def program_position(self) -> Vector:
        """The current position in program coordinates, mm and rad."""
        inner = [p - o for p, o in zip(self.position, self.offset, strict=True)]
        return rotated(self.inverse, inner) if self.is_rotated else inner

    def in_frame(self, step: Vector) -> Vector:
        """X, Y and Z of a difference of commands, along the axes of the program's frame, mm."""
        return [dot(row, step) for row in self.inverse] if self.is_rotated else step[:3]

    def way_to(self, target: Vector) -> Vector:
        """Displacement of X, Y and Z from here to the command `target`, along the axes of the program's frame, mm."""
        return self.in_frame([b - a for a, b in zip(self.position, target, strict=True)])

    def circle(self, plane: Plane, centre: Point, sweep: float) -> Arc:
        """An arc in command coordinates; NaN along axes whose start position is unknown.

        centre  relative to the start of the arc, in a plane of the program's frame, mm
        sweep   rad, in the sense in which the commands turn
        """
        away, normal = [0.0, 0.0, 0.0], IDENTITY[plane.across]
        away[plane.first], away[plane.second] = centre
        if self.is_rotated:
            away = rotated(self.rotation, away)
            a, b, c = (dot(row, normal) for row in self.rotation)
            normal = a, b, c
        x, y, z = (math.nan if i in self.unknown else self.position[i] + away[i] for i in XYZ)
        return Arc((x, y, z), normal, sweep)

    def command(self, program: Vector, axes: int) -> Vector:
        """The command for a position in program coordinates; axes not moved by the words `axes` keep their position.

        axes  bits of the axes of the frame that have a word
        """
        if self.is_rotated:
            program, turned = rotated(self.rotation, program), axes & SPATIAL
            axes |= mask_of(i for i, row in enumerate(self.rotation) if mask_of(k for k in XYZ if row[k]) & turned)
        places = enumerate(zip(program, self.offset, self.position, strict=True))
        return [value + offset if axes >> index & 1 else here for index, (value, offset, here) in places]

    def unit_of(self, index: int) -> float:
        """mm or rad per program unit of an axis; for X as a radius."""
        return DEGREE if self.rotary[index] else self.stretch

    # -- what is known ------------------------------------------------------------------------------------------------

    def use_start_positions(self, indices: Sequence[int]) -> None:
        """Resolve the start positions of these axes: those not given are recorded and count as zero."""
        for index in indices:
            if self.unknown.get(index) is AT_START:
                self.knowledge.start_position(LETTERS[index])
                del self.unknown[index]
        if self.frame_unknown is not None:
            self.frame_unknown = self.without_start(self.frame_unknown)

    def without_start(self, in_frame: UnknownAxes) -> UnknownAxes:
        """Unknown axes of the frame without start positions that have been resolved."""
        return {i: why for i, why in in_frame.items() if why is not AT_START or i in self.unknown}

    def stand(self, position: Vector, unknown: UnknownAxes, in_frame: UnknownAxes | None = None) -> None:
        """Set the position after a motion that the control makes by itself, for example after a hole or a return.

        in_frame  unknown axes of the program's frame, if that tells more than `unknown`
        """
        self.position, self.unknown, self.frame_unknown = position, unknown, in_frame

    def lose(self, indices: Sequence[int], reason: str) -> None:
        """Make the positions of these axes unknown; `reason` has a `{}` for the axis letter."""
        gone = {index: reason for index in indices if index in self.axis_indices}
        if self.frame_unknown is not None:
            self.frame_unknown = self.frame_unknown | self.along_frame(gone)
        self.unknown.update(gone)

    def lose_in_machine(self, indices: Sequence[int], reason: str) -> int:
        """Make the positions of these machine axes unknown; under TCP also those of the tip, X, Y and Z.

        Returns all axes that are unknown for that reason, as bits.
        """
        gone = {index for index in indices if index in self.axis_indices}
        lost = sorted(gone | {*XYZ} if gone and self.tcp else gone)
        self.lose(lost, reason)
        return mask_of(lost)

    def lost_in_frame(self) -> UnknownAxes:
        """Reasons for unknown coordinates along the axes of the program's frame."""
        if self.frame_unknown is not None and self.unknown:
            return self.frame_unknown
        return self.along_frame(self.unknown)

    def along_frame(self, unknown: UnknownAxes) -> UnknownAxes:
        """Reasons for unknown coordinates in the program's frame, from those of machine axes.

        In a rotated frame, an unknown machine axis makes every axis unknown that depends on it.
        """
        return mixed_into(unknown, self.inverse) if unknown and self.is_rotated else dict(unknown)

    @property
    def handedness(self) -> float:
        """-1 in mirrored coordinates, where arcs turn the other way and left becomes right; else 1."""
        return handed(self.rotation)

    def axes_of(self, lost: UnknownAxes) -> UnknownAxes:
        """Reasons for unknown machine axes, from those along the axes of the program's frame."""
        mixed = mixed_into(lost, self.rotation) if lost and self.is_rotated else lost
        return {index: why for index, why in mixed.items() if index in self.axis_indices}

    def stands_square(self) -> bool:
        """Whether the tool is known to lie along Z of the tilted plane in force."""
        return False

    def postures(
        self, direction: Sequence[float], rules: WayRules = NEAREST, here: Pair | None = None
    ) -> Postures | None:
        """The ways to point the tool along a unit vector in the workpiece, from angles `here` or the current ones, rad.

        None if the kinematics are not known or are not those of two rotary axes. None also if the current angles are
        unknown, unless there is only one way from anywhere.
        """
        if here is None and self.posture.pointing is not None:
            outer, inner = (self.axis_indices[column] for column in self.posture.pointing.columns)
            self.use_start_positions((outer, inner))
            if self.unknown.keys() & {outer, inner}:
                return self.posture.only_posture(direction, rules)
            here = self.position[outer], self.position[inner]
        return None if here is None else self.posture.postures(direction, rules, here)

    def square_to(self, frame: Rotation) -> bool | None:
        """Whether the tool lies along Z of a frame in the workpiece; None if that is not known."""
        if self.unknown.keys() & {*self.turning}:
            return None
        found = self.posture.directions(self.position)
        return None if found is None else math.dist(found.tool, normal_of(frame)) < ALIGNMENT_TOLERANCE_RAD

    @property
    def plane_axes(self) -> int:
        """The axes of the plane that the machine has, as bits."""
        return self.modal.plane.axes & mask_of(self.axis_indices)

    def tool_length(self) -> tuple[int, float]:
        """Number and length (mm; NaN: unknown) of the tool of the length offset in force, else in the spindle."""
        if self.tools.offset is not None:
            return self.tools.offset, self.tools.vector[2]
        return self.tools.spindle, self.spindle_length()

    def spindle_length(self) -> float:
        """The length of the tool in the spindle, mm, whether in force or not; NaN: unknown."""
        known = self.tools.lengths.get(self.tools.spindle, self.knowledge.known_tool_length(self.tools.spindle))
        return math.nan if known is None else known

    @property
    def length_under_tcp(self) -> float:
        """The tool length to which X Y Z refer under TCP, mm."""
        return self.length_under_tcp_with(self.tools.vector, self.tools.offset)

    def length_under_tcp_with(self, tool: Vector, number: int | None) -> float:
        """The tool length, mm, to which X Y Z refer with a given length offset and tool number (None: no offset).

        Without an offset X Y Z refer to the spindle reference; if the setup declares them as tip coordinates, to the
        tip.
        """
        known = self.spindle_length() if number is None and self.setup.tcp else math.nan
        return tool[Z] if math.isnan(known) else known

    def tool_radius(self) -> float:
        """The radius by which the control offsets contours, mm; NaN if unknown."""
        if not math.isnan(self.tools.cutter):
            return self.tools.cutter
        number = self.tool_length()[0] if self.tools.register is None else self.tools.register
        known = None if number in self.tools.resized else self.knowledge.known_tool_radius(number)
        return math.nan if known is None else known
