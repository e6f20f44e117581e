"""The state of a control while it follows a program: what is in force, positions, what its numbers count from, and what
is not known.
"""

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
from ncfix.control.frames import WORLD, FrameStack, handed, mixed_into
from ncfix.control.moves import AT_START, Arc, FeedMode, UnknownAxes
from ncfix.control.pointing import Pair
from ncfix.control.posture import NEAREST, SQUARE, MachinePosture, Postures, WayRules, normal_of
from ncfix.control.setup import Run, SetupLookup
from ncfix.diagnostics import Message, Place
from ncfix.text.dialect import Dialect
from ncfix.text.reach import Deletable
from ncfix.values import frozen, mutable

NO_MOTION = 800
"""G80: no motion code is in force; the state at the start of a program."""


@mutable
class Cycle:
    """What of a canned cycle stays in force.

    depth    the word of the axis across the plane, as written
    r        the R word, as written
    level    R in the program's frame, mm
    initial  where the series of holes began, across the plane, mm in the program's frame; None while none is in force
    unknown  one of these is known only at run time
    """

    depth: float = 0.0
    r: float = 0.0
    level: float = 0.0
    initial: float | None = None
    unknown: bool = False


@mutable
class Modal:
    """What is in force. G codes in tenths.

    motion        motion code
    straight      the last of G0 and G1
    plane         of arcs and cycles
    unit          mm per unit of linear words
    diameter      X words are diameters (G7)
    incremental   G91
    arc_absolute  G90.1
    feed_mode     93, 94 or 95
    feed          mm/min, 1/min or mm/rev; NaN where none is set, or one that is known only at run time
    feed_given    a feed other than zero is set
    speed         S
    retract_to_r  G99: canned cycles end at R
    compensated   41, 42 or 0: cutter radius compensation
    system        1..9: G54..G59.3
    tool_code     430 while a tool length offset is in force, 490 without
    spindle       3, 4 or 5
    exact_stop    the control comes to a stop at the end of every motion
    """

    motion: int = NO_MOTION
    straight: int = NO_MOTION
    plane: Plane = PLANES[170]
    unit: float = 1.0
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
    """A modal state that M70 or M73 has saved; `at_return`: it is restored when the subprogram returns."""

    modal: Modal
    at_return: bool


@mutable
class Tools:
    """Tool numbers: prepared with T, in the spindle, and of the length offset in force.

    vector    the length offset in force, mm along each axis (rad)
    register  the number by which contours get their radius (D), where that is not the tool's
    cutter    the radius by which contours are offset, mm, where the program says it; NaN where it does not
    lengths   lengths that the program has set (G10 L1), mm
    measured  tools whose length it has set from what is known only at run time
    unsure    which tool is in the spindle is known only at run time; `doubtful`: which one is selected
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

    def select(self, number: int, *, unsure: bool = False) -> None:
        """The tool that is changed next; `unsure`: the number is only a nominal one."""
        self.selected, self.doubtful = number, unsure

    def change(self) -> None:
        """The tool that is selected comes into the spindle."""
        self.spindle, self.unsure = self.selected, self.doubtful


BLOCK_DELETE = "NCF235"
TOOL_AT_RUN_TIME = "which tool is in the spindle is known only at run time, and no length offset says how long it is"
XYZ = (X, Y, Z)
SPATIAL = 1 << X | 1 << Y | 1 << Z


def named_switches(switches: Collection[int]) -> str:
    """Switches of block delete as they are written in blocks: `/2 /3`."""
    return " ".join(f"/{number}" for number in sorted(switches))


class ControlState(ABC):
    """Where the axes stand, in commands and in the coordinates of the program.

    axis_indices  letter indices of the axes of the machine, in the order of its columns
    rotary     for each letter whether it turns; `turning`: the letter indices of the machine's rotary axes
    posture    where the machine points its tool and its axes
    modal      what is in force of modal codes; `tools` likewise
    frames     the frames in force, in `frame_order`; `composed`: all of them as one
    offset     what is added to the numbers of the program, turned and scaled: that of `composed`, and the tool length
    stretch    mm per program unit of length in the frames in force
    position   the command of every letter, mm and rad; a nominal value where `unknown` has the letter's index
    unknown    letter index -> why the position is not known
    frame_unknown  the same along the axes of a turned frame, where its words tell more than the axes of the machine do;
                   None: these tell all
    places     which axes the program itself has brought to where they stand
    knowledge  what was asked of the setup, and what it does not give
    offset_checked  it has been asked for the work offset in force
    unit_said  the program has said whether it is in inches or millimetres, by `unit_codes`
    tcp        X Y Z are those of the tip (tool-centre-point control)
    tilted     a tilted plane is in force, in which they are
    switches   the switches of block delete that have been asked, where that matters to the path
    increments what a number without a decimal point counts, linear and rotary words
    locate     where in the program we are; `messages` are the remarks so far, by their text, and `rolled` those about
               axes that may roll over, which come behind them
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
        self.composed = WORLD
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
        self.rotation: Rotation = IDENTITY
        self.position = zeros()
        self.unknown: UnknownAxes = {}
        for axis in run.axes:
            index = INDEX[axis]
            if axis in self.setup.initial:
                self.position[index] = self.setup.initial[axis] * (DEGREE if self.rotary[index] else 1.0)
            else:
                self.unknown[index] = AT_START

    def place(self) -> Place:
        """Where in the program we are."""
        return self.locate()

    def warn(self, code: str, text: str, hint: str = "") -> None:
        """A remark, once per text."""
        if text not in self.messages:
            self.messages[text] = Message(code, text, self.place(), hint)

    def is_deleted(self, block: Deletable) -> bool:
        """Whether a block that may be skipped is passed over."""
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

    def set_unit(self, unit: float) -> None:
        """Inch or mm comes into force, `unit` in mm.

        What a feed from before is then is not known: a rotary axis keeps its degrees, and not every control the rest.
        """
        modal = self.modal
        if unit != modal.unit and modal.feed_mode != FeedMode.INVERSE_TIME:
            modal.feed = math.nan
        self.unit_said, modal.unit = True, unit
        self.refresh()

    @property
    def feed_in_force(self) -> Value:
        """The number of the F in force; zero without one."""
        modal = self.modal
        if math.isnan(modal.feed):
            return Unknown("F") if modal.feed_given else 0.0
        return modal.feed / (1.0 if modal.feed_mode == FeedMode.INVERSE_TIME else modal.unit)

    # -- frames -------------------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Compose the frames; to be called after any of them, the tool, the unit or the diameter mode has changed."""
        whole = self.composed = self.frames.whole
        self.offset: Vector = [a + b for a, b in zip(whole.shift, self.tool_shift, strict=True)]
        if self.rotation != whole.rotation:
            self.frame_unknown = None
        self.rotation = whole.rotation
        self.is_rotated = self.rotation != IDENTITY
        self.inverse = transposed(self.rotation)
        self.stretch = self.modal.unit * whole.scale
        self.scale = [DEGREE if turning else self.stretch for turning in self.rotary]
        if self.modal.diameter:
            self.scale[0] /= 2
        self._frame = -1
        self.places.watch(self.anchors(), self.rotation)

    @property
    def tool_shift(self) -> Vector:
        """What the tool length adds to the numbers of the program; under TCP they are those of the tip."""
        return zeros() if self.tcp else self.tools.vector

    @abstractmethod
    def anchors(self) -> list[Hashable]:
        """For each letter what its numbers count from, besides shifts and turns that the program states in numbers."""

    def spatial_anchor(self, index: int) -> Hashable:
        """What else the numbers of X, Y and Z count from: whether they are those of the tip, and the tool's length."""
        return self.tcp, self.tools.offset if (self.tcp and not self.tilted) or index == Z else None

    def program_position(self) -> Vector:
        """Where the control stands in the frame of the program, mm and rad."""
        inner = [p - o for p, o in zip(self.position, self.offset, strict=True)]
        return rotated(self.inverse, inner) if self.is_rotated else inner

    def in_frame(self, step: Vector) -> Vector:
        """X, Y and Z of a difference of commands, along the axes of the program's frame, mm."""
        return [dot(row, step) for row in self.inverse] if self.is_rotated else step[:3]

    def way_to(self, target: Vector) -> Vector:
        """The way of X, Y and Z from where the control stands to a command, along those of its frame, mm."""
        return self.in_frame([b - a for a, b in zip(self.position, target, strict=True)])

    def circle(self, plane: Plane, centre: Point, sweep: float) -> Arc:
        """An arc in command coordinates; NaN along axes of which it is not known where it starts.

        centre  from the start of the arc, in a plane of the program's frame, mm
        sweep   rad, as the commands turn
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
        """The command of a position in the program's frame; axes that no word of `axes` moves stay where they are.

        axes  bits of the axes of the frame that have a word
        """
        if self.is_rotated:
            program, turned = rotated(self.rotation, program), axes & SPATIAL
            axes |= mask_of(i for i, row in enumerate(self.rotation) if mask_of(k for k in XYZ if row[k]) & turned)
        places = enumerate(zip(program, self.offset, self.position, strict=True))
        return [value + offset if axes >> index & 1 else here for index, (value, offset, here) in places]

    def unit_of(self, index: int) -> float:
        """mm or rad per program unit of an axis, X not as a diameter."""
        return DEGREE if self.rotary[index] else self.stretch

    # -- what is known ------------------------------------------------------------------------------------------------

    def use_start_positions(self, indices: Sequence[int]) -> None:
        """The start positions of these axes matter: they are given, or lacking and taken as zero."""
        for index in indices:
            if self.unknown.get(index) is AT_START:
                self.knowledge.start_position(LETTERS[index])
                del self.unknown[index]
        if self.frame_unknown is not None:
            self.frame_unknown = self.without_start(self.frame_unknown)

    def without_start(self, in_frame: UnknownAxes) -> UnknownAxes:
        """What is not known along the axes of the frame, without start positions that have been asked for."""
        return {i: why for i, why in in_frame.items() if why is not AT_START or i in self.unknown}

    def stand(self, position: Vector, unknown: UnknownAxes, in_frame: UnknownAxes | None = None) -> None:
        """The control stands there by itself: behind a hole, or where it comes back to.

        in_frame  what is not known along the axes of the program's frame, where that says more than `unknown` does
        """
        self.position, self.unknown, self.frame_unknown = position, unknown, in_frame

    def lose(self, indices: Sequence[int], reason: str) -> None:
        """These axes stand somewhere that is not known from here on; `reason` has a `{}` for the axis letter."""
        gone = {index: reason for index in indices if index in self.axis_indices}
        if self.frame_unknown is not None:
            self.frame_unknown = self.frame_unknown | self.along_frame(gone)
        self.unknown.update(gone)

    def lose_in_machine(self, indices: Sequence[int], reason: str) -> int:
        """These axes of the machine stand somewhere that is not known: under TCP so does the tip, in X, Y and Z.

        Returns all that are not known for that reason, as bits.
        """
        gone = {index for index in indices if index in self.axis_indices}
        lost = sorted(gone | {*XYZ} if gone and self.tcp else gone)
        self.lose(lost, reason)
        return mask_of(lost)

    def lost_in_frame(self) -> UnknownAxes:
        """What is not known along the axes of the program's frame."""
        if self.frame_unknown is not None and self.unknown:
            return self.frame_unknown
        return self.along_frame(self.unknown)

    def along_frame(self, unknown: UnknownAxes) -> UnknownAxes:
        """Which axes of the program's frame are not known where these of the machine are not.

        In a turned frame one hides all that it has a part in.
        """
        return mixed_into(unknown, self.inverse) if unknown and self.is_rotated else dict(unknown)

    @property
    def handedness(self) -> float:
        """-1 where coordinates are mirrored, so that arcs turn the other way and left is right; else 1."""
        return handed(self.rotation)

    def axes_of(self, lost: UnknownAxes) -> UnknownAxes:
        """Which axes of the machine are not known where this is not known along those of the program's frame."""
        mixed = mixed_into(lost, self.rotation) if lost and self.is_rotated else lost
        return {index: why for index, why in mixed.items() if index in self.axis_indices}

    def stands_square(self) -> bool:
        """Whether the tool is known to lie along Z of a tilted plane that is in force."""
        return False

    def postures(
        self, direction: Sequence[float], rules: WayRules = NEAREST, here: Pair | None = None
    ) -> Postures | None:
        """The ways to point the tool along a unit vector in the workpiece.

        None where the kinematics are not known, or those of two rotary axes, or where these stand, unless there is one
        way wherever that is. `here` says so where the control does not ask.
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
        return None if found is None else math.dist(found.tool, normal_of(frame)) < SQUARE

    @property
    def plane_axes(self) -> int:
        """The axes of the plane that the machine has, as bits."""
        return self.modal.plane.axes & mask_of(self.axis_indices)

    def tool_length(self) -> tuple[int, float]:
        """Number and length (mm) of the tool of the active length offset, else of that in the spindle; NaN unknown."""
        if self.tools.offset is not None:
            return self.tools.offset, self.tools.vector[2]
        return self.tools.spindle, self.spindle_length()

    def spindle_length(self) -> float:
        """The length of the tool in the spindle, mm, whether it is in force or not; NaN unknown."""
        known = self.tools.lengths.get(self.tools.spindle, self.knowledge.known_tool_length(self.tools.spindle))
        return math.nan if known is None else known

    @property
    def length_under_tcp(self) -> float:
        """The length of tool that X Y Z are of under TCP, mm."""
        return self.length_under_tcp_with(self.tools.vector, self.tools.offset)

    def length_under_tcp_with(self, tool: Vector, number: int | None) -> float:
        """The length of tool that X Y Z are of with an offset in force, and the number of its tool (None without one).

        Without one the control leads the spindle reference; if the setup says that X Y Z are those of the tip, the tip.
        """
        known = self.spindle_length() if number is None and self.setup.tcp else math.nan
        return tool[Z] if math.isnan(known) else known

    def tool_radius(self) -> float:
        """The radius by which the control offsets contours, mm; NaN where it is not known."""
        if not math.isnan(self.tools.cutter):
            return self.tools.cutter
        number = self.tool_length()[0] if self.tools.register is None else self.tools.register
        known = self.knowledge.known_tool_radius(number)
        return math.nan if known is None else known
