"""Input and output of writing one motion into a block, for `BlockWriter`.

In inverse time LinuxCNC moves linear axes no slower than `LEAST_PACE`. A rotation that this would speed up gets the F
of its small linear motion as feed per minute (G94), and G93 is restored after it.

`FrameMap` converts between commands and program numbers. `RetractLevels` tracks the level R of canned cycles: its value
for a block, the value in force, and the resulting position of the control.
"""

from __future__ import annotations

import math
from dataclasses import field, replace
from itertools import pairwise

import numpy as np

from ncfix.arrays import Array, Ints, Mask
from ncfix.control.moves import CycleCall, Frame, Moves
from ncfix.control.pointing import Pointing
from ncfix.text.spelling import decimals_for
from ncfix.values import frozen, mutable
from ncfix.writer.pieces import Pieces

LINE = 10
"""Motion code of straight feed motions, in tenths."""

TANGENTIAL = {1010: 30, 1011: 20}
"""Codes of tangential arcs, to the left and to the right, and the codes as which they are written: once the motion
before them is corrected, a tangential arc would not be the same arc any more."""


LEAST_PACE = 0.1
"""Smallest speed, units per minute, to which LinuxCNC raises motions in inverse time (`inverse_time_rate_straight`)."""
FEED_GROUPS = ("XYZ", "UVW", "ABC")
"""Axes to whose path F refers: those of the first group that moves (LinuxCNC, "Machining Center Overview", feed)."""
DIGITS = 6
"""Significant digits of a new F word."""


@frozen
class Level:
    """The level R of a canned cycle, in program numbers.

    across   column of the drilling axis
    wanted   intended R
    nominal  R as programmed
    before   R in force before the block; NaN if not known
    least    lower limit of R; NaN: none
    address  address of the level's word
    """

    across: int
    wanted: float
    nominal: float
    before: float
    least: float
    address: str = "R"


@frozen
class Target:
    """What one motion must become, in program numbers.

    letters      axis letters of the columns
    resolved     (n_axes,) the least increment
    decimals     (n_axes,) number of decimals that it needs
    start        (n_axes,) position of the control, as written so far (NaN unknown)
    nominal      (n_axes,) end of the motion as programmed
    original     (n_axes,) value of each programmed word: position or increment
    ends         (k, n_axes) intended ends of its pieces
    arc          whether the first piece is an arc
    centre       (3,) the intended centre of that arc
    original_centre (3,) the centre as programmed, absolute
    origin       (3,) the start of the motion as programmed, to which incremental centres referred
    plane        the arc's two axes in its plane and the one across it, as indices of X Y Z
    spatial      columns of X Y Z (-1: not an axis of the machine)
    diameter     X is a diameter; centres and radii are not
    incremental, centre_absolute   modes of axis and centre words
    shares       (k,) share of the block's time for each piece, for G93
    inverse_time the block's F is the time of the block
    code         motion code that the pieces need, tenths
    active_code  motion code in force before the block, as written
    feed         number of the F word in force, NaN if there is none
    turn_minutes time, min, of a rotation of rotary axes alone whose F is degrees per minute; NaN for other motions
    turn_by_feed that time is kept by an F for the axes to which the control applies it; else by inverse time
    back_to_inverse_time   the rotation was in inverse time, which is restored after it
    increments   weight of a number without a decimal point, linear and rotary words; 1.0 if the point makes no
                 difference
    rotary       (n_axes,) which axes are rotary
    arcs, centres (k,), (k, 3): for an arc split into several pieces, which of them are arcs, and their centres
    arc_code     motion code of these, tenths
    pointing     how rotary positions (rad) point the tool, if the program gives its direction
    rotation     (3, 3) rotation of the frame
    offset       (n_axes,) of the frame, mm and rad
    level        level of a canned cycle whose R is written
    measured     (n_axes,) axes whose words must stay computed at run time; empty: none
    wordless     (n_axes,) axes that have no word and must get none
    call         call, in a block of its own, of the canned cycle whose depth it contains
    spelled      (n_axes,) axes that get a word even if it does not move them; empty: none
    """

    letters: tuple[str, ...]
    resolved: Array
    decimals: Ints
    start: Array
    nominal: Array
    original: Array
    ends: Array
    arc: bool
    centre: Array
    original_centre: Array
    origin: Array
    plane: tuple[int, int, int]
    spatial: tuple[int, int, int]
    diameter: bool
    incremental: bool
    centre_absolute: bool
    shares: Array
    inverse_time: bool
    code: int
    active_code: int
    feed: float
    turn_minutes: float
    turn_by_feed: bool
    arcs: Mask | None
    centres: Array | None
    arc_code: int
    increments: tuple[float, float]
    rotary: tuple[bool, ...]
    pointing: Pointing | None
    rotation: Array
    offset: Array
    level: Level | None
    wordless: tuple[bool, ...]
    call: CycleCall | None
    measured: tuple[bool, ...]
    spelled: tuple[bool, ...]
    back_to_inverse_time: bool = False

    @property
    def last_code(self) -> int:
        """The motion code in force after the pieces, in tenths; a call in a block of its own does not change it."""
        if self.call is not None and not self.call.modal:
            return self.active_code
        if self.arcs is None:
            return TANGENTIAL.get(self.code, self.code)
        return self.arc_code if self.arcs[-1] else LINE

    def at_their_pace(self) -> Target:
        """This target, with feed per minute if LinuxCNC would speed up the rotation in inverse time."""
        path = np.vstack((self.start, np.round(self.ends * 10.0**self.decimals) / 10.0**self.decimals))
        linear = [letter not in FEED_GROUPS[-1] for letter in self.letters]
        steps = np.linalg.norm(np.diff(path, axis=0)[:, linear], axis=1)
        ways = np.array([feed_way(self.letters, *pair, self.diameter) for pair in pairwise(path)])
        if np.all((steps == 0) | (ways * self.feed / self.shares >= LEAST_PACE)):
            return self
        known = self.feed > 0
        return replace(
            self, inverse_time=False, turn_minutes=1.0 / self.feed if known else float("inf"), back_to_inverse_time=True
        )

    @property
    def is_dragged(self) -> bool:
        """Whether a rotation of rotary axes alone gets a linear motion, to which the control would apply its feed."""
        if np.isnan(self.turn_minutes):
            return False
        linear = np.array([letter not in FEED_GROUPS[-1] for letter in self.letters])
        steps = np.diff(np.vstack((self.start, self.ends)), axis=0)
        half = 0.5 * 10.0 ** -self.decimals.astype(float)
        return bool(np.any(np.abs(steps[:, linear]) >= half[linear]))


@mutable
class Rendered:
    """The edits (start, stop, text) of the source, the lines inserted after the block, and the resulting motion.

    centre, centres  centre of the first piece if it is an arc, and of further pieces by their index
    level            R in force after the block, if known
    conflict         why the motion cannot be written; empty if it can
    code             motion code in force after the block, in tenths, if it differs from the one asked for
    opens            whether the text begins with a cycle call, which replaces the one in force
    closing          line after it that restores the previous call, unless the next block opens with a call
    """

    edits: list[tuple[int, int, str]] = field(default_factory=list)
    lines: list[str] = field(default_factory=list)
    ends: list[Array] = field(default_factory=list)
    centre: Array | None = None
    centres: dict[int, Array] = field(default_factory=dict)
    level: float | None = None
    conflict: str = ""
    code: int | None = None
    opens: bool = False
    closing: str = ""

    def lines_before(self, next_block: Rendered | None) -> list[str]:
        """The lines to insert after the block, given what is written of the next one (None: nothing)."""
        called = next_block is not None and next_block.opens
        return [*self.lines, self.closing] if self.closing and not called else self.lines

    @property
    def text(self) -> tuple[object, ...]:
        """What the control reads; two executions of a block agree if this is equal."""
        return (tuple(self.edits), tuple(self.lines), self.closing)


def plane_across(normal: Array) -> tuple[int, int, int]:
    """The two axes of an arc's plane and the one across it, from the plane's normal in program axes."""
    across = int(np.argmax(np.abs(normal)))
    return ((1, 2, 0), (2, 0, 1), (0, 1, 2))[across]


def feed_way(letters: tuple[str, ...], begin: Array, end: Array, diameter: bool) -> float:
    """The length of path to which F refers, in program units: of linear axes; if none moves, of rotary axes.

    begin, end  (n_axes,) program numbers; `diameter`: X is a diameter
    """
    step = end - begin
    if diameter and "X" in letters:
        step[letters.index("X")] /= 2
    lengths = (np.linalg.norm(step[[letter in group for letter in letters]]) for group in FEED_GROUPS)
    return float(next((length for length in lengths if length > 0), 0.0))


def feed_number(value: float) -> str:
    """The number of a new F word."""
    return f"{value:.{max(3, DIGITS - 1 - int(np.floor(np.log10(value))))}f}"


class FrameMap:
    """Conversion between commands and program numbers in one frame. Positions have shape (..., n_axes)."""

    def __init__(self, frame: Frame, axes: tuple[str, ...], rotary: Mask) -> None:
        self.frame = frame
        self.scale = np.where(rotary, np.pi / 180, frame.unit)
        if frame.diameter and "X" in axes:
            self.scale[axes.index("X")] /= 2
        self.spatial = [axes.index(letter) for letter in "XYZ" if letter in axes]
        self.axes = ["XYZ".index(letter) for letter in "XYZ" if letter in axes]
        self.rotation = frame.rotation[np.ix_(self.axes, self.axes)]
        self.rotated = not np.array_equal(frame.rotation, np.eye(3))
        self.unit = frame.unit
        self.origin = np.array([frame.offset[axes.index(letter)] if letter in axes else 0.0 for letter in "XYZ"])

    def program(self, command: Array) -> Array:
        """Program numbers of a command (..., n_axes), mm and rad."""
        values = command - self.frame.offset
        if self.rotated:
            values[..., self.spatial] = _turned(values[..., self.spatial], self.rotation)
        return values / self.scale

    def decimals(self, steps: Array) -> Ints:
        """(n_axes,) decimals that program numbers need for the resolution `steps` of the control, mm and rad."""
        return np.array([decimals_for(step) for step in steps / self.scale], dtype=np.int64)

    def still(self, unmoved: Mask) -> Mask:
        """Axes that are exactly at their old position, unaffected by the rounding of the conversion.

        unmoved  (n_axes,) axes that the program does not move; in a rotated frame one of X Y Z moves them all
        """
        if not self.rotated or unmoved[self.spatial].all():
            return unmoved
        result = unmoved.copy()
        result[self.spatial] = False
        return result

    def command(self, program: Array) -> Array:
        """The inverse of `program`."""
        values = program * self.scale
        if self.rotated:
            values[..., self.spatial] = _turned(values[..., self.spatial], self.rotation.T)
        return values + self.frame.offset

    def program_point(self, point: Array) -> Array:
        """A point X Y Z (mm, command coordinates) in program numbers; centres are never diameters."""
        return np.asarray((point - self.origin) @ self.frame.rotation / self.unit)

    def point_of(self, program: Array) -> Array:
        """X Y Z (3,) of a position (n_axes,) in the numbers used for centres: never diameters."""
        point = np.zeros(3)
        point[self.axes] = program[self.spatial]
        if self.frame.diameter:
            point[0] /= 2
        return point

    def command_point(self, point: Array) -> Array:
        """The inverse of `program_point`, (..., 3)."""
        return np.asarray((point * self.unit) @ self.frame.rotation.T + self.origin)


def _turned(points: Array, rotation: Array) -> Array:
    """Points (..., k) times a rotation; NaN makes only those coordinates unknown that depend on it."""
    lost = np.isnan(points)
    if not lost.any():
        return np.asarray(points @ rotation)
    result: Array = np.where(lost, 0.0, points) @ rotation
    result[(lost.astype(float) @ (rotation != 0.0)) > 0] = np.nan
    return result


class RetractLevels:
    """Tracks the level R that the control has in force.

    If a control at R is to return to the level at which the series of holes began (G98), LinuxCNC rises to that level
    before it moves to the hole, but only if it is not above R: so R must not be lowered below the current position.

    in_force  the frame in whose numbers R was written, and R; None if not known
    approach  (n_axes,) the command over the last hole at that level
    """

    def __init__(self, moves: Moves, pieces: Pieces) -> None:
        self.moves = moves
        self.pieces = pieces
        self.in_force: tuple[int, float] | None = None
        self.approach: Array | None = None

    def forget(self) -> None:
        """R is no longer known, after anything but a corrected cycle."""
        self.in_force = self.approach = None

    def wanted(
        self,
        row: int,
        piece: int,
        number: int,
        frame: FrameMap,
        as_programmed: FrameMap,
        here: Array,
        address: str,
    ) -> Level | None:
        """The level R for a cycle in the numbers of `frame` (index `number`), with the axes at `here`; None: no cycle.

        address  address of the level's word
        """
        moves, approach = self.moves, self.pieces.approach
        if approach is None or not np.isfinite(approach[piece]).all():
            return None
        nominal = as_programmed.program(moves.approach[row].copy())
        across = int(np.argmax(np.abs(nominal - as_programmed.program(moves.end[row].copy()))))
        in_frame, level = self.in_force or (-1, math.nan)
        stands = bool(as_programmed.program(moves.start[row].copy())[across] == nominal[across])
        return Level(
            across,
            wanted=float(frame.program(approach[piece].copy())[across]),
            nominal=float(nominal[across]),
            before=level if in_frame == number else math.nan,
            least=float(frame.program(here.copy())[across]) if stands and not self.comes_back(row) else math.nan,
            address=address,
        )

    def comes_back(self, row: int) -> bool:
        """Whether the control ends at R (G99) after a cycle, and not where it began."""
        moves = self.moves
        if row + 1 == len(moves):
            return False
        on = moves.start[row + 1] == moves.approach[row]
        return bool(on[moves.end[row] != moves.approach[row]].all())

    def note(self, number: int, frame: FrameMap, target: Target, rendered: Rendered) -> None:
        """Record the level that was written."""
        self.forget()
        if rendered.level is not None and target.level is not None:
            over = rendered.ends[-1].copy()
            over[target.level.across] = rendered.level
            self.in_force, self.approach = (number, rendered.level), frame.command(over)

    def returns(self, row: int) -> Mask:
        """(n_axes,) axes that are at the level R at the start of the motion after a cycle."""
        if self.approach is None:
            return np.zeros(len(self.moves.axes), dtype=bool)
        level = self.moves.approach[row]
        return np.asarray((self.moves.start[row + 1] == level) & (self.moves.end[row] != level))
