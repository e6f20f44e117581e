"""Motions: what a block demands, what the control does, and the rules by which a motion may stay uncorrected.

`Moves` holds motions as columns, one row per motion, in the order in which the control makes them. Positions are
*commands*: positions in the control's axis coordinate system, with work offsets, G92 and tool offsets added. Without
tool-centre-point control a command is the machine's axis positions. With it (`tcp`), X Y Z of the command are the
coordinates of the tool tip in the workpiece, and turn with it; the machine model converts them to axis positions.

`Motion` is one motion as its block states it, with reasons for what is unknown of its end.

`Pass` lists all rules by which a motion may stay uncorrected, in any language, with the kinds of motions that each may
pass and the reason. A motion that no rule may pass is corrected or refused. A feed motion, for example, never passes
because an axis position is unknown.
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
    """The kind of a motion."""

    RAPID = 0
    FEED = 1
    ARC = 2
    CYCLE = 3
    """The motion to one hole of a canned cycle: `end` is over the hole at the final depth, `approach` at the level from
    which it feeds."""
    DWELL = 4
    """No motion; kept for its time."""


class Rule(IntEnum):
    """What may be done with the block of a motion."""

    CORRECT = 0
    """May be corrected."""
    PASS = 1
    """Passed by rule, uncorrected: machine coordinates, reference points, probing, parking. `reason` says which."""
    REFUSE = 2
    """Must not be changed, and cannot be corrected: `reason` says why."""


class FeedMode(IntEnum):
    """The meaning of F."""

    PER_MINUTE = 94
    INVERSE_TIME = 93
    PER_REVOLUTION = 95


@frozen
class TcpState:
    """Whether tool-centre-point control is on, and the tool length that the control uses, mm."""

    on: bool
    tool_length: float

    @property
    def shift(self) -> float:
        """Difference along Z between command and axis position with all rotary axes at zero, mm."""
        return self.tool_length if self.on else 0.0


class Kinematics(Protocol):
    """The kinematics of a machine, as far as programs need them."""

    @property
    def travel(self) -> Sequence[tuple[float, float]]:
        """Travel of each axis (low, high), mm and rad; infinite for an endless axis."""

    def __call__(self, command: Sequence[float], before: TcpState, after: TcpState, /) -> Sequence[float]:
        """The command (one number per axis) for the same machine position after TCP has changed its state."""


@frozen
class Frame:
    """Conversion of program numbers to a command: `command = offset + rotation @ (unit * program)`.

    offset    (n_axes,) mm, rad: work offset, G52/G92, tool offset, rotated where the control rotates them
    rotation  (3, 3) acts on X Y Z (G68, G10 R)
    unit      mm per program unit of linear words: 1.0 or 25.4
    diameter  X is programmed as a diameter (G7)
    increments  weight of a number without a decimal point, for linear and rotary words: 0.001 where the control reads
              such numbers in least increments, else 1
    per_feed  mm per unit of a feed: without a scale of the program, and not always that of lengths
    """

    offset: Array
    rotation: Array
    unit: float
    diameter: bool = False
    increments: tuple[float, float] = (1.0, 1.0)
    per_feed: float = 1.0


@frozen
class CycleCall:
    """The call of a cycle in a block of its own: the data needed to give one hole, or pocket, its own depth or place.

    name       as written
    arguments  values at the time of the call; None for an omitted one
    depths     (index, sense) of the arguments that define the depth: sense 1 for heights, -1 for distances downwards
    across     letter of the drilling axis
    modal      the call stands before the motions to its holes and stays in force; else it drills where the axes stand
    fixed      why the call must not be replaced or supplemented by another; empty if it may
    bound      an argument is known only at run time: the depth stays as programmed
    points     (index, letter) of arguments that are coordinates of its place; empty: it works where the axes stand
    led        letters of axes that other blocks move to its place: those of a contour
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
    """The motions of a program as a struct of arrays; n rows, one per motion, in order of execution.

    axes         names of the position columns, e.g. ("X", "Y", "Z", "B", "C")
    rotary       (n_axes,) which of them are rotary
    start, end   (n, n_axes) commands in mm and rad; NaN where not known. A rapid that may be corrected has a known
                 end, but perhaps no known start; other motions that may be corrected have both
    programmed   (n, n_axes) the block has a word for the axis
    kind         (n,) `MotionKind`
    rule         (n,) `Rule`
    reason       (n,) index into `reasons`; 0 is the empty reason
    block        (n,) index of the block in the program
    frame        (n,) index into `frames`
    incremental  (n,) the block's words are increments (G91)
    arc_absolute (n,) the centre of an arc is given in absolute coordinates (G90.1)
    tcp          (n,) X Y Z are tool-tip coordinates in the workpiece
    whole        (n,) the motion must not be split: under cutter radius compensation (G41, G42), or for another reason
    tool         (n,) number of the tool of `tool_length`: of the active length offset, else of the tool in the spindle
    tool_length  (n,) mm, spindle reference to tip; NaN where not known
    feed         (n,) mm/min, 1/min or mm/rev according to `feed_mode`, always in mm; NaN where none is set
    feed_mode    (n,) `FeedMode`
    centre       (n, 3) of arcs: centre in command coordinates (mm), NaN elsewhere
    normal       (n, 3) of arcs: unit normal of the plane; the sweep is right-handed about it
    sweep        (n,) of arcs: signed angle, full turns included, rad
    modal        (n,) of straight moves and arcs: the motion G code in force, in tenths (0, 10, 20, 30)
    frames       all frames in use
    reasons      all reasons in use
    rotary_as_programmed  (n,) rotary axes must stay as programmed: linear axes would not follow them (a swivelled plane
                 without tool-centre-point control)
    approach     (n, n_axes) of canned cycles: the command over the hole at level R, from which it feeds and to which it
                 may return; NaN elsewhere, and if no word of the block gives such a level
    placed       (n, n_axes) the program itself has positioned the axis, in the coordinates in force: only then may it
                 get a word that its block lacks (see `Places`)
    fixed_centre (n,) of arcs: a word gives the centre itself, not its distance from the start
    counted      (n, n_axes) words of the axis are increments: those of all axes, or of some in a block
    resting      (n, n_axes) axes that must stay at rest whatever the words say (see `control.control`), or that cannot
                 have words in the block: rotary axes in many cycles
    beside       (n,) offset of a compensated contour to the left of the path, mm: negative to the right, NaN if not
                 known, 0 without compensation
    across       (n,) index (X Y Z of the program) of the normal to the plane of such contours
    passing      (n,) the rule by which a motion passes (`Pass`); `Pass.NONE` if it does not, or none is recorded
    measured     (n, n_axes) axes whose words are computed from measured values: `end` is nominal, and the words stay
                 unchanged, because the measured values contain the machine's error
    call         (n,) of canned cycles whose depth is in the block of a call: index into `calls`, else -1
    spelled      (n, n_axes) axes that get a word even if it would not move them
    tcp_length   (n,) mm, the length the control uses for X Y Z under TCP, if that is not the tool's: zero while no
                 length offset is in force, so that it moves the spindle reference, not the tip; else NaN
    exact_stop   (n,) the control stops at the end of every motion (G60, G61)
    words_alone_turn  (n,) rotary axes get a word only if the block has a word for one of them
    calls        all such calls
    pointing     how the rotary axes point the tool; None unless programs give its direction as a vector
    angles       (n_axes, 2) smallest and largest angle, rad, of absolute words for rotary axes that the control may
                 count from 0 to 360 degrees; NaN for other axes. None: no such axes
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
    whole: Mask
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
    rotary_as_programmed: Mask
    approach: Array
    placed: Mask
    fixed_centre: Mask
    counted: Mask
    resting: Mask
    beside: Array
    across: Signs
    passing: Signs
    measured: Mask
    call: NDArray[np.int32]
    spelled: Mask
    tcp_length: Array
    exact_stop: Mask
    words_alone_turn: Mask
    calls: tuple[CycleCall, ...] = ()
    pointing: Pointing | None = None
    angles: Array | None = None

    def __len__(self) -> int:
        return len(self.block)

    @property
    def length_under_tcp(self) -> Array:
        """(n,) mm, the tool length to which X Y Z refer under TCP."""
        return np.where(np.isnan(self.tcp_length), self.tool_length, self.tcp_length)

    @property
    def beside_tip(self) -> Mask:
        """(n,) whether X Y Z refer to a point other than the tip, although TCP is on."""
        return self.tcp & ~np.isnan(self.tcp_length)

    @property
    def wordless(self) -> Mask:
        """(n, n_axes) axes that must not be moved by a word: the program has not placed them, or they must rest.

        An axis that must rest may have a word, which must keep its position.
        """
        return ~(self.placed | self.programmed) | self.resting

    @property
    def idle(self) -> Mask:
        """(n, n_axes) axes that no correction can move: `wordless` ones, and rotary axes that get no words here."""
        rests = self.words_alone_turn & ~self.programmed[:, self.rotary].any(axis=1)
        return self.wordless | (self.rotary & rests[:, None])

    @property
    def increments(self) -> Mask:
        """(n, n_axes) axes along which the displacement does not depend on where the motion starts."""
        return self.counted & (self.rule != Rule.PASS)[:, None]

    @property
    def about_fixed_point(self) -> Mask:
        """(n,) arcs whose centre is given by words, wherever they start."""
        return self.arc_absolute | self.fixed_centre

    def call_of(self, row: int) -> CycleCall | None:
        """The cycle call that a motion belongs to, if the call has a block of its own; else None."""
        return None if self.call[row] < 0 else self.calls[self.call[row]]

    def refused(self, rows: Mask, why: str) -> Moves:
        """The motions with `rows` (n,) refused, as far as they would have been corrected."""
        rows = rows & (self.rule == Rule.CORRECT)
        if not rows.any():
            return self
        reasons = self.reasons if why in self.reasons else (*self.reasons, why)
        rule = np.where(rows, Rule.REFUSE, self.rule).astype(self.rule.dtype)
        reason = np.where(rows, reasons.index(why), self.reason).astype(self.reason.dtype)
        return replace(self, rule=rule, reason=reason, reasons=reasons)

    @property
    def cutting(self) -> Mask:
        """(n,) motions at feed (straight, arc or canned cycle) that are not passed by rule."""
        return (self.kind != MotionKind.RAPID) & (self.kind != MotionKind.DWELL) & (self.rule != Rule.PASS)

    @property
    def moved(self) -> Mask:
        """(n, n_axes) axes that a motion moves or names; one to a reference point without words moves all."""
        moved: Mask = self.programmed | (self.end != self.start)
        passed = np.flatnonzero((self.rule == Rule.PASS) & (self.kind != MotionKind.DWELL))
        moved[passed[~self.programmed[passed].any(axis=1)]] = True
        return moved


@frozen
class Trace:
    """Result of following a program: its motions and the messages about it."""

    moves: Moves
    messages: tuple[Message, ...] = ()
    assumed: tuple[str, ...] = ()
    """Names of missing data taken as zero (`assume_zero`), e.g. `work offset G54`."""
    stamp: str = ""
    """The text of the stamp comment if the program carries one."""
    switches: frozenset[int] = frozenset()
    """Numbers of the block delete switches that the program's path depends on (`/`, `/2`, ...)."""


class Pass(IntEnum):
    """A rule by which a motion passes, as stored in columns; `NONE` for motions that do not pass."""

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
    """The properties of a pass rule.

    name   in reports
    kinds  of motions that it may pass; others are refused instead
    cuts   whether a passed motion at feed may cut, uncorrected
    why    the reason why such motions may stay uncorrected
    """

    name: str
    kinds: frozenset[MotionKind]
    cuts: bool
    why: str


class Passing(NamedTuple):
    """Why a motion passes: the rule, and the reason in terms of its program."""

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
        "The program gives positions of the machine's axes (a tool changer, a travel limit), not positions on the "
        "workpiece.",
    ),
    Pass.REFERENCE_POINT: PassRule(
        "reference point", RAPIDS, False, "The machine moves to a fixed position and does not cut."
    ),
    Pass.PROBING: PassRule(
        "probing", STRAIGHT, False, "It ends where the probe triggers, and measured values must stay comparable."
    ),
    Pass.UNSAID: PassRule(
        "rapid while an axis position is not given",
        RAPIDS,
        False,
        "Its correction needs a word for an axis whose position the program has not yet given. It does not cut, and "
        "the first block that names the axis is corrected.",
    ),
    Pass.SKIPPED: PassRule(
        "rapid after a block with /",
        RAPIDS,
        False,
        "It needs another correction if that block is skipped than if it is executed. It does not cut, and no cut "
        "begins at its end.",
    ),
    Pass.LED: PassRule(
        "rapid from a position that the control calculates",
        RAPIDS,
        False,
        "Only the control knows its start. It does not cut, and the next block that names the axes is corrected.",
    ),
    Pass.ALIGNMENT: PassRule(
        "rotary axes positioned by the control",
        RAPIDS,
        False,
        "The control calculates the angles (PLANE, CYCLE800, G53.1). The tool tip is corrected in the next motion.",
    ),
    Pass.ROTARY_ALONE: PassRule(
        "rotary axes alone in a tilted plane",
        STRAIGHT,
        True,
        "The linear axes do not move, and words for them would count in the tilted plane. The tool tip is corrected "
        "in the next motion.",
    ),
    Pass.RETRACTION: PassRule(
        "retraction by the control", RAPIDS, False, "The control calculates its end (M140). It does not cut."
    ),
    Pass.DEPARTURE: PassRule(
        "departure from a contour",
        frozenset({MotionKind.FEED}),
        True,
        "The control calculates its path from the corrected end of the contour (DEP). No word gives its end.",
    ),
}
"""The complete list of pass rules."""


AT_START = "the position of the axis {} at the start of the program is not given"
"""Why a position is unknown at first; the setup is asked for it when it matters."""

UnknownAxes = dict[int, str]
"""Letter index -> why the position of the axis is unknown, with a `{}` for its letter."""


class Arc(NamedTuple):
    """The circle of an arc in command coordinates: centre (3), unit normal (3), signed sweep, rad.

    fixed  a word gives the centre itself, not its distance from the start
    """

    centre: tuple[float, float, float]
    normal: tuple[float, float, float]
    sweep: float
    fixed: bool = False


class MotionEnd(NamedTuple):
    """The end of a motion.

    target      the command of every letter; a nominal value where `unknown`
    unknown     reasons for unknown positions of machine axes
    in_frame    the same for the axes of the program's frame, if its words tell more than the machine axes; None:
                `unknown` tells all
    in_machine  under TCP, for words that are machine positions: the end as machine axis positions, if it and the start
                are completely known
    """

    target: Vector
    unknown: UnknownAxes
    in_frame: UnknownAxes | None = None
    in_machine: Vector | None = None

    @property
    def lost(self) -> UnknownAxes:
        """Reasons for unknown coordinates along the axes of the program's frame."""
        return self.unknown if self.in_frame is None else self.in_frame


class Motion(NamedTuple):
    """One motion of the control.

    axes     axes with a word, as bits
    end      its end
    code     the motion code, in tenths
    refusal  why it is refused; empty if it is not
    passing  why it is passed; None if it is not
    placed   axes whose positions its words set, as bits; None: those of absolute words
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
    """The position with NaN where it is unknown."""
    if not unknown:
        return position
    return [math.nan if index in unknown else value for index, value in enumerate(position)]


def first_reason(unknown: UnknownAxes) -> str:
    """The reason for the first axis whose position is unknown."""
    index = min(unknown)
    return unknown[index].format(LETTERS[index])
