"""Motions: what a block asks for, what the control does, and by which rule a motion may stay uncorrected.

`Moves` holds them as columns, one row per motion, in the order in which the control makes them. Positions are
*commands*: what the control is told in its own coordinate system of axes, with work offsets, G92 and tool offsets
added. Without tool-centre-point control a command is the machine's axis positions. With it (`tcp`), X Y Z of the
command are the coordinates of the tool tip in the workpiece, turned with it; only the machine model can make axis
positions of that.

`Motion` is one motion as its block means it, with what is not known of its end.

`Pass` lists all rules by which a motion may stay as it is, whatever the language of its program, with the motions that
each may pass and the reason. The reports count such motions by rule. A motion that no rule may pass is corrected or
refused. A feed, for example, never passes because its axis has no known position.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Mask, Signs
from ncfix.control.coordinates import LETTERS, Vector
from ncfix.control.pointing import Pointing
from ncfix.diagnostics import Message
from ncfix.values import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping


class MotionKind(IntEnum):
    """What sort of motion."""

    RAPID = 0
    FEED = 1
    ARC = 2
    CYCLE = 3
    """A canned cycle's motion to one hole: `end` is the position over the hole at the depth it reaches, `approach` that
    at the level from which it feeds."""
    DWELL = 4
    """No motion, kept for time."""


class Rule(IntEnum):
    """What may be done to the block of a motion."""

    CORRECT = 0
    """May be corrected."""
    PASS = 1
    """Passed as it is, by rule: machine coordinates, reference points, probing, parking. `reason` says which."""
    REFUSE = 2
    """Must not be changed, and is not right: `reason` says why."""


class FeedMode(IntEnum):
    """How F is meant."""

    PER_MINUTE = 94
    INVERSE_TIME = 93
    PER_REVOLUTION = 95


@frozen
class TcpState:
    """Whether tool-centre-point control is on, and the length of the tool that the control knows of, mm."""

    on: bool
    tool_length: float

    @property
    def shift(self) -> float:
        """How far a command along Z is from the axis position while all rotary axes stand at zero, mm."""
        return self.tool_length if self.on else 0.0


class Kinematics(Protocol):
    """What a machine's own kinematics say about positions of its axes."""

    @property
    def travel(self) -> Sequence[tuple[float, float]]:
        """How far each axis goes, mm and rad; infinite where it is endless."""

    def __call__(self, command: Sequence[float], before: TcpState, after: TcpState, /) -> Sequence[float]:
        """A command (one number per axis) as it is under one state, said as it is under another."""


@frozen
class Frame:
    """How the numbers in the program become a command: `command = offset + rotation @ (unit * program)`.

    offset    (n_axes,) mm, rad: work offset, G52/G92, tool offset, rotated where the control rotates them
    rotation  (3, 3) acts on X Y Z (G68, G10 R)
    unit      mm per program unit of linear words: 1.0 or 25.4
    diameter  X is programmed as a diameter (G7)
    increments  what one unit of a number without a decimal point is worth, linear and rotary words, in those of a
              number with one: 0.001 where the control counts least increments in such words
    """

    offset: Array
    rotation: Array
    unit: float
    diameter: bool = False
    increments: tuple[float, float] = (1.0, 1.0)


@frozen
class CycleCall:
    """The call of a cycle in a block by itself: what it takes to give one hole, or pocket, a depth or place of its own.

    name       as it is written
    arguments  their values when it was called; None where one is left out
    depths     (place, sense): the arguments that say how deep the hole is, 1 for heights, -1 for ways down
    across     the letter of the axis along which it drills
    modal      it stands before the motion to the hole, and holds for others, too; else it drills where the axes stand
    fixed      why no other call may be written in its place, or beside it; empty: it may
    bound      an argument is known only at run time: the depth stays as the program has it
    points     (place, letter): the arguments that are coordinates of where it works; empty: where the axes stand
    led        letters of axes that other blocks lead to where it works: those of a contour
    """

    name: str
    arguments: tuple[float | str | None, ...]
    depths: tuple[tuple[int, int], ...]
    across: str
    modal: bool
    fixed: str = ""
    bound: bool = False
    points: tuple[tuple[int, str], ...] = ()
    led: tuple[str, ...] = ()


@frozen
class Moves:
    """The motions of a program, struct of arrays; n rows, one per motion, in order of execution.

    axes         names of the columns of positions, e.g. ("X", "Y", "Z", "B", "C")
    rotary       (n_axes,) which of them are rotary
    start, end   (n, n_axes) commands in mm and rad; NaN where not known. A rapid that may be corrected has a known
                 end, but its start need not be; other motions that may be corrected have both
    programmed   (n, n_axes) True where the block has a word for the axis
    kind         (n,) `MotionKind`
    rule         (n,) `Rule`
    reason       (n,) index into `reasons`; 0 is the empty reason
    block        (n,) index of the block in the program
    frame        (n,) index into `frames`
    incremental  (n,) the block's words are increments (G91)
    arc_absolute (n,) the centre of an arc is given absolutely (G90.1)
    tcp          (n,) X Y Z are tool-tip coordinates in the workpiece
    compensated  (n,) cutter radius compensation is active (G41/G42): the control offsets the contour
    tool         (n,) number of the tool whose length that is: of the active length offset, else in the spindle
    tool_length  (n,) mm, spindle reference to tip; NaN where not known
    feed         (n,) mm/min, 1/min or mm/rev according to `feed_mode`; NaN where none is set, in mm
    feed_mode    (n,) `FeedMode`
    centre       (n, 3) of arcs: centre in command coordinates (mm), NaN elsewhere
    normal       (n, 3) of arcs: unit normal of the plane; the sweep is right-handed about it
    sweep        (n,) of arcs: signed angle, full turns included, rad
    modal        (n,) of straight moves and arcs: the motion G code in tenths (0, 10, 20, 30) in force
    frames       the frames that occur
    reasons      the reasons that occur
    rotary_as_programmed  (n,) rotary axes must stay so: linear axes would not follow them (a swivelled plane without
                 tool-centre-point control); None: nowhere
    pointing     how rotary axes point the tool, where programs give its direction as a vector
    approach     (n, n_axes) of canned cycles: the command over the hole at the level R from which it feeds, and to
                 which it may return; NaN elsewhere and where such a level is not a word of the block's. None: nowhere
    placed       (n, n_axes) the program itself has brought the axis to where it stands, in the coordinates in force:
                 only then may it get a word that its block lacks (see `Places`). None: all are
    fixed_centre (n,) of arcs: a word says where the centre is, not how far from the start. None: where `arc_absolute`
    counted      (n, n_axes) where words are increments for some axes of a block only. None: as `incremental` says
    resting      (n, n_axes) axes that stay where they stand, whatever words say (see `control.control`), or that have
                 no words in such a block: rotary axes in many cycles. None: none
    beside       (n,) radius by which the control offsets the contour to the left of the way, mm: negative to the right,
                 NaN where it is not known, 0 where nothing is offset. None: nowhere
    across       (n,) which of X Y Z of the program is normal to the plane of such contours. None: nothing is offset
    passing      (n,) the rule by which a motion passes (`Pass`). None: none does, or nobody says by which
    measured     (n, n_axes) axes whose words are computed from what the machine has measured itself: `end` is nominal,
                 and the words stay as they are, since what was measured has the machine's error in it. None: none
    angles       (n_axes, 2) smallest and largest angle, rad, to which plain words lead rotary axes that a control
                 may count from 0 to 360 degrees; NaN for others. None: none
    call         (n,) of canned cycles whose depth stands in a call of its own: index into `calls`; -1 of others.
                 None: of none
    calls        the calls that occur
    spelled      (n, n_axes) axes that get a word even if they stand where it would lead them. None: none
    tcp_length   (n,) mm, the length by which the control leads X Y Z under TCP, where that is not the tool's: zero
                 while none is in force, so that it leads the spindle reference, not the tip; else NaN. None: nowhere
    exact_stop   (n,) the control comes to a stop at the end of every motion (G60, G61). None: nowhere
    words_alone_turn  (n,) rotary axes get a word only if the motion has one for some of them. None: nowhere
    """

    axes: tuple[str, ...]
    rotary: Mask
    start: Array
    end: Array
    programmed: Mask
    kind: Signs
    rule: Signs
    reason: NDArray[np.int16]
    block: NDArray[np.int32]
    frame: NDArray[np.int32]
    incremental: Mask
    arc_absolute: Mask
    tcp: Mask
    compensated: Mask
    tool: NDArray[np.int32]
    tool_length: Array
    feed: Array
    feed_mode: Signs
    centre: Array
    normal: Array
    sweep: Array
    modal: NDArray[np.int16]
    frames: tuple[Frame, ...]
    reasons: tuple[str, ...]
    rotary_as_programmed: Mask | None = None
    pointing: Pointing | None = None
    approach: Array | None = None
    placed: Mask | None = None
    fixed_centre: Mask | None = None
    counted: Mask | None = None
    measured: Mask | None = None
    resting: Mask | None = None
    angles: Array | None = None
    passing: Signs | None = None
    beside: Array | None = None
    across: Signs | None = None
    call: NDArray[np.int32] | None = None
    calls: tuple[CycleCall, ...] = ()
    spelled: Mask | None = None
    tcp_length: Array | None = None
    exact_stop: Mask | None = None
    words_alone_turn: Mask | None = None

    def __len__(self) -> int:
        return len(self.block)

    @property
    def length_under_tcp(self) -> Array:
        """(n,) mm, the length of tool that the control has X Y Z of under TCP."""
        own = self.tcp_length
        return self.tool_length if own is None else np.where(np.isnan(own), self.tool_length, own)

    @property
    def beside_tip(self) -> Mask:
        """(n,) X Y Z are those of another point than the tip, though TCP is on."""
        return np.zeros(len(self), dtype=bool) if self.tcp_length is None else self.tcp & ~np.isnan(self.tcp_length)

    @property
    def wordless(self) -> Mask:
        """(n, n_axes) axes that have no word, and must get none: nobody knows but the machine where they stand.

        Those that rest have one, which must lead them nowhere else.
        """
        wordless: Mask = np.zeros(self.end.shape, dtype=bool)
        if self.placed is not None:
            wordless = ~(self.placed | self.programmed)
        return wordless if self.resting is None else wordless | self.resting

    @property
    def idle(self) -> Mask:
        """(n, n_axes) axes that no correction moves: those without words, and rotary axes that get none here."""
        if self.words_alone_turn is None:
            return self.wordless
        rests = self.words_alone_turn & ~self.programmed[:, self.rotary].any(axis=1)
        return self.wordless | (self.rotary & rests[:, None])

    @property
    def increments(self) -> Mask:
        """(n, n_axes) axes along which a motion makes the same way wherever it starts."""
        counted = self.incremental[:, None] if self.counted is None else self.counted
        return np.broadcast_to(counted & (self.rule != Rule.PASS)[:, None], self.end.shape)

    @property
    def about_fixed_point(self) -> Mask:
        """(n,) arcs whose centre is where a word says, wherever they start."""
        if self.fixed_centre is None:
            return self.arc_absolute
        return self.arc_absolute | self.fixed_centre

    def call_of(self, row: int) -> CycleCall | None:
        """The call with which the cycle of a motion is called, if that has a block of its own."""
        return None if self.call is None or self.call[row] < 0 else self.calls[self.call[row]]

    def refused(self, rows: Mask, why: str) -> Moves:
        """The motions with those of `rows` (n,) refused that would be corrected."""
        rows = rows & (self.rule == Rule.CORRECT)
        if not rows.any():
            return self
        reasons = self.reasons if why in self.reasons else (*self.reasons, why)
        rule = np.where(rows, Rule.REFUSE, self.rule).astype(self.rule.dtype)
        reason = np.where(rows, reasons.index(why), self.reason).astype(self.reason.dtype)
        return replace(self, rule=rule, reason=reason, reasons=reasons)

    @property
    def cutting(self) -> Mask:
        """(n,) motions at feed: straight ones, arcs and canned cycles, but for what is passed by rule."""
        return (self.kind != MotionKind.RAPID) & (self.kind != MotionKind.DWELL) & (self.rule != Rule.PASS)

    @property
    def moved(self) -> Mask:
        """(n, n_axes) axes that a motion takes to its end; a reference point without words takes all of them."""
        moved: Mask = self.programmed | (self.end != self.start)
        passed = np.flatnonzero((self.rule == Rule.PASS) & (self.kind != MotionKind.DWELL))
        moved[passed[~self.programmed[passed].any(axis=1)]] = True
        return moved


@frozen
class Trace:
    """A program followed as the control would: its motions and what there is to say about them."""

    moves: Moves
    messages: tuple[Message, ...] = ()
    assumed: tuple[str, ...] = ()
    """What was not given and was taken as zero (`assume_zero`), in words, e.g. "work offset G54"."""
    stamp: str = ""
    """The text of the stamp comment if the program carries one."""
    switches: frozenset[int] = frozenset()
    """The switches of block delete that were asked: blocks with `/`, `/2`, ... stand where the control got to."""


class Pass(IntEnum):
    """A rule by which a motion passes, as columns hold it; `NONE` for all that do not pass."""

    NONE = 0
    DWELL = 1
    MACHINE_COORDINATES = 2
    REFERENCE_POINT = 3
    PROBING = 4
    UNSAID = 5
    LED = 6
    ALIGNMENT = 7
    ROTARY_ALONE = 8
    RETRACTION = 9
    DEPARTURE = 10
    SKIPPED = 11


class PassRule(NamedTuple):
    """What a rule may pass.

    name   in reports
    kinds  of motions; all others are refused instead
    cuts   at feed they may cut something, and the program is not known to cut right there
    why    it is right to leave them alone
    """

    name: str
    kinds: frozenset[MotionKind]
    cuts: bool
    why: str


class Passing(NamedTuple):
    """Why one motion passes: the rule, and that in the words of its program."""

    rule: Pass
    words: str


RAPIDS = frozenset({MotionKind.RAPID})
STRAIGHT = frozenset({MotionKind.RAPID, MotionKind.FEED})

PASS_RULES: Mapping[Pass, PassRule] = {
    Pass.DWELL: PassRule("dwell", frozenset({MotionKind.DWELL}), False, "Nothing moves."),
    Pass.MACHINE_COORDINATES: PassRule(
        "machine coordinates",
        STRAIGHT | {MotionKind.ARC},
        True,
        "The program means places of the machine's axes (a tool changer, a limit), not places on the workpiece.",
    ),
    Pass.REFERENCE_POINT: PassRule(
        "reference point", RAPIDS, False, "The machine goes to a place of its own, and cuts nothing."
    ),
    Pass.PROBING: PassRule(
        "probing", STRAIGHT, False, "It ends where the probe switches, and what it measures must stay comparable."
    ),
    Pass.UNSAID: PassRule(
        "rapid while an axis has not been said",
        RAPIDS,
        False,
        "Its correction would need a word for an axis that the program has not brought to a place of its own yet. It "
        "cuts nothing, and the first block that names the axis is corrected.",
    ),
    Pass.SKIPPED: PassRule(
        "rapid behind a block with /",
        RAPIDS,
        False,
        "It needs another correction where that block is skipped than where it is executed. It cuts nothing, and no "
        "cut begins where it ends.",
    ),
    Pass.LED: PassRule(
        "rapid from where the control has led the tool",
        RAPIDS,
        False,
        "Only the control knows where it begins. It cuts nothing, and the next block that names the axes is corrected.",
    ),
    Pass.ALIGNMENT: PassRule(
        "rotary axes positioned by the control",
        RAPIDS,
        False,
        "The control works out the angles (PLANE, CYCLE800, G53.1); the tip is corrected where it moves next.",
    ),
    Pass.ROTARY_ALONE: PassRule(
        "rotary axes alone in a tilted plane",
        STRAIGHT,
        True,
        "Linear axes stand still, and words for them would mean the plane; the tip is corrected where it moves next.",
    ),
    Pass.RETRACTION: PassRule(
        "retraction by the control", RAPIDS, False, "The control works out where it ends (M140). It cuts nothing."
    ),
    Pass.DEPARTURE: PassRule(
        "departure from a contour",
        frozenset({MotionKind.FEED}),
        True,
        "The control goes on from the corrected end of the contour (DEP); no word says where that leads.",
    ),
}
"""The list: nothing else may pass."""


AT_START = "where the axis {} stands when the program starts is not given"
"""Why a position is not known at first; asked of the setup when it matters."""

UnknownAxes = dict[int, str]
"""Letter index -> why the position of the axis is not known, with a `{}` for its letter."""


class Arc(NamedTuple):
    """The circle of an arc in command coordinates: centre (3), unit normal (3), signed sweep.

    fixed  a word says where its centre is, not how far that is from the start
    """

    centre: tuple[float, float, float]
    normal: tuple[float, float, float]
    sweep: float
    fixed: bool = False


class MotionEnd(NamedTuple):
    """Where a motion ends.

    target      the command, of every letter; a nominal value along `unknown`
    unknown     why an axis of the machine is not known there
    in_frame    the same along the axes of the program's frame, where its words tell more than the axes of the machine
                do; None: `unknown` tells all
    in_machine  under TCP, where words mean places of the machine: the same place in axes of the machine, where all of
                it, and where the motion starts, is known
    """

    target: Vector
    unknown: UnknownAxes
    in_frame: UnknownAxes | None = None
    in_machine: Vector | None = None

    @property
    def lost(self) -> UnknownAxes:
        """What is not known along the axes of the program's frame, where that is kept for every motion."""
        return self.unknown if self.in_frame is None else self.in_frame


class Motion(NamedTuple):
    """One motion of the control.

    axes     axes with a word, as bits
    end      where it ends
    code     the motion code, in tenths
    refusal  why it is refused; empty if it is not
    passing  why it is passed as it is; None if it is not
    placed  the axes whose words say where they stand afterwards; None: those of absolute words
    """

    kind: MotionKind
    axes: int
    end: MotionEnd
    code: int
    refusal: str = ""
    passing: Passing | None = None
    arc: Arc | None = None
    placed: int | None = None


def blanked(position: Vector, unknown: UnknownAxes) -> Vector:
    """A position with NaN where it is not known."""
    if not unknown:
        return position
    return [math.nan if index in unknown else value for index, value in enumerate(position)]


def first_reason(unknown: UnknownAxes) -> str:
    """The reason for the first axis whose position is not known."""
    index = min(unknown)
    return unknown[index].format(LETTERS[index])
