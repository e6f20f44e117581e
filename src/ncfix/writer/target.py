"""What one corrected motion shall become in a block, and what became of it: what `BlockWriter` takes and gives back.

In inverse time LinuxCNC moves linear axes no slower than `LEAST_PACE`. A turn that this would hurry gets the F of its
little linear motion too, in feed per minute (G94), and G93 again behind it.

`FrameMap` goes from commands to the numbers of a program and back. `RetractLevels` knows the level R of canned cycles:
what it shall be in a block, what is in force, and where the control stands then.
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
"""The code of straight motions at feed, in tenths."""

TANGENTIAL = {1010: 30, 1011: 20}
"""Codes of arcs that go on in the direction of the motion before them, to the left and to the right: once that motion
is corrected they are not the same arcs any more, and are written as those that they were."""


LEAST_PACE = 0.1
"""Units per minute; what LinuxCNC makes of slower motions in inverse time (`inverse_time_rate_straight`)."""
FEED_GROUPS = ("XYZ", "UVW", "ABC")
"""The axes whose way F is the speed of: the first group that moves (LinuxCNC, "Machining Center Overview", feed)."""
DIGITS = 6
"""Significant digits of an F word of ours."""


@frozen
class Level:
    """What the level R of a canned cycle shall be, in program numbers.

    across   the column of the axis along which the cycle drills
    wanted   what R shall be
    nominal  what it was as programmed
    before   what is in force before the block, NaN where that is not known
    least    R must not be lower; NaN: it may
    address  what stands for R
    """

    across: int
    wanted: float
    nominal: float
    before: float
    least: float
    address: str = "R"


@frozen
class Target:
    """What one motion shall become, in program numbers.

    letters      axis letters of the columns
    resolved     (n_axes,) the least increment
    decimals     (n_axes,) digits after the point that it needs
    start        (n_axes,) where the control stands, as emitted so far (NaN unknown)
    nominal      (n_axes,) where the motion ended as programmed
    original     (n_axes,) value of each programmed word: target or increment
    ends         (k, n_axes) where its pieces shall end
    arc          the first piece is an arc
    centre       (3,) of that arc, and
    original_centre (3,) the centre as programmed, absolute
    origin       (3,) the start of the motion as programmed: what incremental centres were meant from
    plane        the arc's two axes in its plane and the one across it, as indices of X Y Z
    spatial      columns of X Y Z (-1: not an axis of the machine)
    diameter     X is a diameter; centres and radii are not
    incremental, centre_absolute   how words are meant
    shares       (k,) fraction of the block's time in each piece, for G93
    inverse_time the block's F is the time of the block
    code         motion code the pieces need, tenths
    active_code  motion code in force before the block, as emitted
    feed         the number after F that is in force, NaN where there is none
    turn_minutes the time of a turn of rotary axes alone whose F is degrees per minute; NaN for other motions
    turn_by_feed that time is kept by F, as the speed of the axes that the control goes by; else by inverse time
    back_to_inverse_time   the turn was in inverse time, and is again behind it
    increments   what a number without a decimal point counts, linear and rotary words; 1.0 where the point is nothing
    rotary       (n_axes,) which axes turn
    arcs, centres (k,), (k, 3): where an arc becomes several pieces, which of them are arcs, and about what
    arc_code     motion code of these, tenths
    pointing     how rotary positions (rad) point the tool, where the program gives its direction
    rotation     (3, 3) how the frame is turned
    offset       (n_axes,) of the frame, mm and rad
    level        of a canned cycle whose R is to be written: what it shall be
    measured     (n_axes,) axes whose words are computed at run time, and must be; empty: no axis
    wordless     (n_axes,) axes that have no word and must get none
    call         of a canned cycle whose depth stands in a call of its own
    spelled      (n_axes,) axes that get a word even if they stand where it leads; empty: no axis
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
        """The motion code in force after the pieces, in tenths; behind a call in a block of its own as before."""
        if self.call is not None and not self.call.modal:
            return self.active_code
        if self.arcs is None:
            return TANGENTIAL.get(self.code, self.code)
        return self.arc_code if self.arcs[-1] else LINE

    def at_their_pace(self) -> Target:
        """This target, with a feed per minute for a turn that LinuxCNC would hurry in inverse time."""
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
        """Whether a turn of rotary axes alone gets a linear motion, which would take its feed over."""
        if np.isnan(self.turn_minutes):
            return False
        linear = np.array([letter not in FEED_GROUPS[-1] for letter in self.letters])
        steps = np.diff(np.vstack((self.start, self.ends)), axis=0)
        half = 0.5 * 10.0 ** -self.decimals.astype(float)
        return bool(np.any(np.abs(steps[:, linear]) >= half[linear]))


@mutable
class Rendered:
    """The edits (start, stop, text) of the source, the lines to put after the block, and what they amount to.

    centre, centres  of the first piece if it is an arc, and of further ones by their number
    level            the R that is in force behind the block, if that is known
    conflict         why the motion cannot be written after all; empty if it is
    code             the motion code that is in force behind the block, in tenths, if it is another than was asked for
    opens            what is written begins with a call of a cycle, which replaces the one in force
    closing          the line behind it with which the call before comes back, unless the next block opens with its own
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
        """The lines to put after the block, where that is what is written of the next one; None: nothing."""
        called = next_block is not None and next_block.opens
        return [*self.lines, self.closing] if self.closing and not called else self.lines

    @property
    def text(self) -> tuple[object, ...]:
        """What the control reads; two executions of a block agree when this is equal."""
        return (tuple(self.edits), tuple(self.lines), self.closing)


def plane_across(normal: Array) -> tuple[int, int, int]:
    """The two columns of an arc's plane and the one across it, from the plane's normal in program axes."""
    across = int(np.argmax(np.abs(normal)))
    return ((1, 2, 0), (2, 0, 1), (0, 1, 2))[across]


def feed_way(letters: tuple[str, ...], begin: Array, end: Array, diameter: bool) -> float:
    """The way that F is the speed of, in program units: of linear axes, of rotary axes where none of those moves.

    begin, end  (n_axes,) program numbers; `diameter`: those of X are twice the way
    """
    step = end - begin
    if diameter and "X" in letters:
        step[letters.index("X")] /= 2
    lengths = (np.linalg.norm(step[[letter in group for letter in letters]]) for group in FEED_GROUPS)
    return float(next((length for length in lengths if length > 0), 0.0))


def feed_number(value: float) -> str:
    """The number after F."""
    return f"{value:.{max(3, DIGITS - 1 - int(np.floor(np.log10(value))))}f}"


class FrameMap:
    """One frame of a program for a given set of axes, with the maps both ways. Positions have shape (..., n_axes)."""

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
        """Program numbers of a command (..., n_axes), mm and rad: in units of the program, in its frame."""
        values = command - self.frame.offset
        if self.rotated:
            values[..., self.spatial] = _turned(values[..., self.spatial], self.rotation)
        return values / self.scale

    def decimals(self, steps: Array) -> Ints:
        """(n_axes,) digits behind the point that numbers need for what the control can resolve, mm and rad."""
        return np.array([decimals_for(step) for step in steps / self.scale], dtype=np.int64)

    def still(self, unmoved: Mask) -> Mask:
        """Axes that stand exactly where they stood, free of the rounding of these maps.

        unmoved  (n_axes,) those that the program did not tell to move; in a rotated frame one of X Y Z moves them all
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
        """A point X Y Z (mm, command coordinates) in program numbers; diameters do not apply to centres."""
        return np.asarray((point - self.origin) @ self.frame.rotation / self.unit)

    def point_of(self, program: Array) -> Array:
        """X Y Z (3,) of a position (n_axes,) in the numbers in which centres are given: no diameters."""
        point = np.zeros(3)
        point[self.axes] = program[self.spatial]
        if self.frame.diameter:
            point[0] /= 2
        return point

    def command_point(self, point: Array) -> Array:
        """The inverse of `program_point`, (..., 3)."""
        return np.asarray((point * self.unit) @ self.frame.rotation.T + self.origin)


def _turned(points: Array, rotation: Array) -> Array:
    """Points (..., k) times a rotation; what is not known (NaN) stays with the coordinates that are made of it."""
    lost = np.isnan(points)
    if not lost.any():
        return np.asarray(points @ rotation)
    result: Array = np.where(lost, 0.0, points) @ rotation
    result[(lost.astype(float) @ (rotation != 0.0)) > 0] = np.nan
    return result


class RetractLevels:
    """The book that the control keeps of R.

    Where a control stands at R and is to come back to where the series of holes began (G98), LinuxCNC goes up there
    before it goes to the hole, but not from any higher than R: so R must not sink below where it stands.

    in_force  the frame in whose numbers R was written, and R; None where that is not known
    approach  (n_axes,) the command over the last hole at that level
    """

    def __init__(self, moves: Moves, pieces: Pieces) -> None:
        self.moves = moves
        self.pieces = pieces
        self.in_force: tuple[int, float] | None = None
        self.approach: Array | None = None

    def forget(self) -> None:
        """Something else than a corrected cycle: R is not known any more."""
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
        """What R shall be in the numbers of `frame` (its `number`), while the axes stand `here`; None of no cycle.

        address  what stands for R
        """
        moves, approach = self.moves, self.pieces.approach
        if approach is None or moves.approach is None or not np.isfinite(approach[piece]).all():
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
        """Whether the control ends at R (G99) behind a cycle, and not where it began."""
        moves = self.moves
        if moves.approach is None or row + 1 == len(moves):
            return False
        on = moves.start[row + 1] == moves.approach[row]
        return bool(on[moves.end[row] != moves.approach[row]].all())

    def note(self, number: int, frame: FrameMap, target: Target, rendered: Rendered) -> None:
        """Note what was written."""
        self.forget()
        if rendered.level is not None and target.level is not None:
            over = rendered.ends[-1].copy()
            over[target.level.across] = rendered.level
            self.in_force, self.approach = (number, rendered.level), frame.command(over)

    def returns(self, row: int) -> Mask:
        """(n_axes,) axes that stand at that level where the motion behind a cycle begins."""
        if self.approach is None or self.moves.approach is None:
            return np.zeros(len(self.moves.axes), dtype=bool)
        level = self.moves.approach[row]
        return np.asarray((self.moves.start[row + 1] == level) & (self.moves.end[row] != level))
