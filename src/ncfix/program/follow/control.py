"""The control while it follows a program: modal state, offsets, what is known, and where the axes stand."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import cached_property

from ncfix.diagnostics import Message, Place
from ncfix.program.dialect import Dialect
from ncfix.program.follow import contour, tcp
from ncfix.program.follow.builder import Arc, Builder, Style
from ncfix.program.follow.coordinates import (
    DEGREE,
    IDENTITY,
    INDEX,
    LETTERS,
    ROTARY_LETTERS,
    Rotation,
    Vector,
    Z,
    dot,
    product,
    rotated,
    transposed,
    zeros,
)
from ncfix.program.follow.knowledge import Knowledge
from ncfix.program.follow.modal import Modal, Offsets, Tools
from ncfix.program.follow.motion import AT_START, Motion, Unknown, blanked, first_reason, leaves_unknown
from ncfix.program.follow.places import Places, mask_of
from ncfix.program.language import Run
from ncfix.program.moves import Kind, Moves, Rule
from ncfix.program.pointing import Pointing
from ncfix.program.recurrence import Budget

UNKNOWN_AXIS = "NCF206"
NEITHER = 'all motions after it are refused; if it does neither, say passed_codes = ["{}"] in the setup file'

ADRIFT = "the program has not said where the axis {} stands, and this motion would need a word for it"
"""Why a motion is left as it is, or refused, that moves an axis without naming it."""

SQUARE = 1 - 1e-12
"""A component of a turned axis that is no less lies along the axis itself."""


class Control(ABC):
    """What every control keeps while it follows a program, whatever its language.

    position   the command of every letter, mm and rad; a nominal value where `unknown` has the letter's index
    unknown    letter index -> why the position is not known
    shaky      letter index -> why the offset of the letter is not known
    needs_feed a motion at feed is an error where no feed is set
    refusal    why every motion from here on is refused; empty while all is well
    suspended  the same, for as long as a code is in force
    increments what a number without a decimal point counts, linear and rotary words
    points     a block gave the direction of the tool as a vector
    ends       where the motions of a block end, if somebody wants to know
    tilted     a tilted plane is in force, in which X Y Z are those of the tip
    whole      the motions of the block must not be split, as under cutter compensation
    at_corner  the motion begins or ends at a corner that the control rounds or breaks, see `contour`
    beside     axes that stand beside a contour whose compensation is over: the motion that leads off is not split
    said       what is not known along the axes of a tilted plane, where its words have said more than the machine's
               axes alone tell; None: they tell all. `saying`: the same at the end of the motion of this block
    places     which axes the program itself has brought to where they stand
    budget     how much may still be executed
    """

    def __init__(self, run: Run, dialect: Dialect) -> None:
        self.setup = run.setup
        self.kinematics = run.kinematics
        self.dialect = dialect
        self.machine = tuple(INDEX[axis] for axis in run.axes)
        self.rotary = tuple(
            (letter in run.rotary) if letter in run.axes else letter in ROTARY_LETTERS for letter in LETTERS
        )
        self.builder = Builder(run.axes, run.rotary)
        self.needs_feed = False
        self.modal = Modal()
        self.offsets = Offsets()
        self.knowledge = Knowledge(run.setup, self.place)
        self.budget = Budget(run.setup.most_blocks, run.setup.most_blocks)
        self.tools = Tools()
        self.messages: dict[str, Message] = {}
        self.foreign: dict[str, Message] = {}
        self.refusal = ""
        self.suspended: dict[str, str] = {}
        self.increments = (1.0, 1.0)
        self.tilted = False
        self.points = False
        self.whole = self.at_corner = False
        self.beside = 0
        self.ends: list[Vector] | None = None
        self.said: Unknown | None = None
        self.saying: Unknown | None = None
        self.external = ""
        self.tcp = run.setup.tcp
        self.shaky: Unknown = {}
        self.row_block = 0
        self.locate: Callable[[], Place] = lambda: Place("")
        self.numbers: Sequence[float] = ()
        self.first = 0
        self.offset_checked = False
        self._frame = -1
        self.places = Places.at_start(run.setup, run.axes, LETTERS)
        self.rotation: Rotation = IDENTITY
        self.position = zeros()
        self.unknown: Unknown = {}
        self._start(run.axes)

    def _start(self, axes: tuple[str, ...]) -> None:
        """The start position, as far as it is given."""
        for axis in axes:
            index = INDEX[axis]
            if axis in self.setup.initial:
                self.position[index] = self.setup.initial[axis] * (DEGREE if self.rotary[index] else 1.0)
            else:
                self.unknown[index] = AT_START

    @cached_property
    def pointing(self) -> Pointing | None:
        """How the machine's two rotary axes point the tool; None if that cannot be known."""
        return tcp.pointing_of(self)

    def moves(self) -> Moves:
        """The motions so far."""
        moves = self.builder.moves()
        return replace(moves, pointing=self.pointing) if self.points else moves

    def place(self) -> Place:
        """Where in the program we are."""
        return self.locate()

    def warn(self, code: str, text: str, hint: str = "") -> None:
        """A remark, once per text."""
        if text not in self.messages:
            self.messages[text] = Message(code, text, self.place(), hint)

    def refuse_after(self, code: int, *, with_axes: bool) -> None:
        """A G code (tenths) is not known: it may move or change coordinates. The setup may say that it does not."""
        if self.refusal or (code in self.setup.passed_codes and not with_axes):
            return
        name = f"G{code / 10:g}"
        self.refusal = f"{name} is not known, and may move axes or change coordinates"
        self.warn("NCF228", self.refusal, NEITHER.format(name))

    # -- frames -------------------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Compose the offsets; to be called after any of them, the unit or the diameter mode has changed."""
        offsets = self.offsets
        centre = offsets.centre
        if offsets.rotation is not IDENTITY:
            turned = rotated(offsets.rotation, centre)
            parts = zip(offsets.shift, offsets.local, centre, turned, offsets.feature, strict=True)
            inner = [shift + own + c - t + f for shift, own, c, t, f in parts]
        else:
            shifts = zip(offsets.shift, offsets.local, offsets.feature, strict=True)
            inner = [shift + own + f for shift, own, f in shifts]
        outer = inner if offsets.turn is IDENTITY else rotated(offsets.turn, inner)
        tool = zeros() if self.tcp else offsets.tool
        self.offset: Vector = [a + b + c for a, b, c in zip(offsets.origin, outer, tool, strict=True)]
        self.rotation = product(offsets.turn, offsets.rotation)
        self.is_rotated = self.rotation != IDENTITY
        self.inverse = transposed(self.rotation)
        self.scale = [DEGREE if turning else self.modal.unit for turning in self.rotary]
        if self.modal.diameter:
            self.scale[0] /= 2
        self._frame = -1
        self.places.watch(self.anchors(), self.rotation)

    @abstractmethod
    def anchors(self) -> list[Hashable]:
        """For each letter what its numbers count from, besides shifts and turns that the program states in numbers."""

    def spatial_anchor(self, index: int) -> Hashable:
        """The same for what X, Y and Z have of their own: whether they are those of the tip, and the tool's length."""
        return self.tcp, self.tools.offset if (self.tcp and not self.tilted) or index == Z else None

    @property
    def frame(self) -> int:
        """The index of the frame that is in force."""
        if self._frame < 0:
            self._frame = self.builder.frame(
                self.offset, self.rotation, self.modal.unit, self.modal.diameter, self.increments
            )
        return self._frame

    def program_position(self) -> Vector:
        """Where the control stands in the frame of the program, mm and rad."""
        inner = [p - o for p, o in zip(self.position, self.offset, strict=True)]
        return rotated(self.inverse, inner) if self.is_rotated else inner

    def in_frame(self, step: Vector) -> Vector:
        """A difference of commands in the axes of the program's frame, mm and rad."""
        if not self.is_rotated:
            return step
        return [dot(row, step) for row in self.inverse] + step[3:]

    def unit_of(self, index: int) -> float:
        """mm or rad per program unit of an axis, X not as a diameter."""
        return DEGREE if self.rotary[index] else self.modal.unit

    # -- what is known ------------------------------------------------------------------------------------------------

    def settle(self, indices: Sequence[int]) -> None:
        """The start positions of these axes matter: they are given, or lacking and taken as zero."""
        for index in indices:
            if self.unknown.get(index) is AT_START:
                self.knowledge.start_position(LETTERS[index])
                del self.unknown[index]

    def lose(self, indices: Sequence[int], reason: str) -> None:
        """These axes stand somewhere that is not known from here on; `reason` has a `{}` for the axis letter."""
        self.said = None
        for index in indices:
            if index in self.machine:
                self.unknown[index] = reason

    def stands_square(self) -> bool:
        """Whether the tool is known to lie along Z of a tilted plane that is in force."""
        return False

    def tool_length(self) -> tuple[int, float]:
        """Number and length (mm) of the tool of the active length offset, else of that in the spindle; NaN unknown."""
        if self.tools.offset is not None:
            return self.tools.offset, self.offsets.tool[2]
        known = self.tools.lengths.get(self.tools.spindle, self.knowledge.known_tool_length(self.tools.spindle))
        return self.tools.spindle, math.nan if known is None else known

    # -- motions ------------------------------------------------------------------------------------------------------

    def move(
        self,
        kind: Kind,
        axes: int,
        target: Vector,
        unknown: Unknown,
        code: int,
        *,
        refusal: str = "",
        passing: str = "",
        arc: Arc | None = None,
        settles: int | None = None,
    ) -> None:
        """Make a motion; the arguments are those of `Motion`."""
        self.make(Motion(kind, axes, target, unknown, code, refusal, passing, arc, settles))

    def make(self, motion: Motion) -> None:
        """Make a motion, and keep the book of what is known behind it. All motions that come singly come by here."""
        if not motion.passing:
            self._ask_for_start(motion)
        settles = self._settles(motion)
        if motion.kind == Kind.RAPID and not (motion.passing or motion.refusal) and self._leaves_unknown(motion):
            motion = motion._replace(passing=first_reason(motion.unknown))
        adrift = self._adrift(settles) | self.still_beside(motion.axes)
        self._note_increments(motion, settles)
        fate = self._dragged(motion, adrift)
        self._keep_places(motion, settles)
        style = self._style_of(fate)
        self.beside &= ~fate.axes
        if fate.arc is not None:
            self.builder.arc(fate.arc)
        if not fate.passing and fate.kind != Kind.DWELL:
            self.builder.rests(contour.resting(self, fate))
        start, end = blanked(self.position, self.unknown), blanked(fate.target, fate.unknown)
        self.builder.add(self.row_block, fate.axes, style, self.modal.feed, start, end, adrift)
        if self.ends is not None:
            self.ends.append(fate.target[:])
        self.position, self.unknown = fate.target, fate.unknown

    def _ask_for_start(self, motion: Motion) -> None:
        """Settle start positions that matter: where the motion ends, and for all but rapids where it begins."""
        kind, unknown = motion.kind, motion.unknown
        if AT_START in unknown.values() or (kind != Kind.RAPID and AT_START in self.unknown.values()):
            everywhere = tuple(self.unknown) if kind != Kind.RAPID else tuple(unknown)
            self.settle(everywhere)
            for index in [index for index, why in unknown.items() if why is AT_START]:
                del unknown[index]

    def _settles(self, motion: Motion) -> int:
        """The axes whose words say where they stand behind the motion."""
        if motion.settles is not None:
            return motion.settles
        return 0 if motion.passing or self.modal.incremental else motion.axes

    def _note_increments(self, motion: Motion, settles: int) -> None:
        """Some words of the motion count from where it starts, or do not, against the distance mode in force."""
        if not motion.passing and settles & motion.axes != (0 if self.modal.incremental else motion.axes):
            self.builder.counted(motion.axes & ~settles)

    def _keep_places(self, motion: Motion, settles: int) -> None:
        """What the program has said of where the axes stand; a motion that is passed may lead elsewhere."""
        if motion.passing and motion.kind != Kind.DWELL:
            target, here = motion.target, self.position
            self.places.lose(mask_of(i for i in self.machine if motion.axes >> i & 1 or target[i] != here[i]))
        self.said, self.saying = self.saying, None
        self.places.settle(settles)
        self.places.lose(mask_of(motion.unknown if self.said is None else self.said))
        self.places.begun = True

    def _leaves_unknown(self, rapid: Motion) -> bool:
        """Whether a rapid passes, see `motion.leaves_unknown`."""
        before = {*self.unknown.values(), *tcp.lost_in_frame(self).values()}
        return leaves_unknown(rapid, before, turned=self.is_rotated and not self.modal.incremental)

    def _adrift(self, settled: int) -> int:
        """Axes that must get no word in a motion that brings `settled` to their places; turned axes go together."""
        adrift = self.places.adrift & ~settled
        if adrift and self.is_rotated:
            turned = self._turned()
            adrift |= turned if adrift & turned else 0
        return adrift

    def still_beside(self, axes: int) -> int:
        """Axes of the plane that get no word in a motion across it, see `contour`."""
        plane = contour.plane_of(self) if self.modal.compensated else 0
        return 0 if axes & plane else plane

    def end_compensation(self) -> None:
        """Where the axes of the plane stand after the contour the control knows, until they are named."""
        if self.modal.compensated:
            self.beside = mask_of((self.modal.plane.first, self.modal.plane.second)) & mask_of(self.machine)
            self.places.lose(self.beside)
        self.modal.compensated = 0

    def _turned(self) -> int:
        """Axes that are moved by words of others, since the frame is turned."""
        return mask_of(i for i, row in enumerate(self.rotation) if i in self.machine and abs(row[i]) < SQUARE)

    def _dragged(self, motion: Motion, adrift: int) -> Motion:
        """The motion, left as it is or refused if it moves an axis that has no word and must get none."""
        if motion.passing or motion.refusal or motion.unknown:
            return motion
        moved = mask_of(i for i in self.machine if motion.target[i] != self.position[i])
        if self.is_rotated and motion.axes & self._turned():
            moved |= self._turned()
        dragged = adrift & moved & ~motion.axes & self.places.adrift
        index = next((i for i in self.machine if dragged >> i & 1), None)
        if index is None:
            return motion
        why = ADRIFT.format(LETTERS[index])
        straight = motion.kind in (Kind.RAPID, Kind.FEED)
        return motion._replace(passing=why) if straight else motion._replace(refusal=why)

    def _verdict(self, kind: Kind, unknown: Unknown, refusal: str, passing: str) -> tuple[Rule, str]:
        """What may be done to the motion, and why."""
        if passing:
            return Rule.PASS, passing
        reason = refusal or self.refusal or next(iter(self.suspended.values()), "")
        if not reason and unknown:
            reason = first_reason(unknown)
        if not reason and kind != Kind.RAPID and self.unknown:
            reason = first_reason(self.unknown)
        if not reason and self.external:
            reason = f"the motion is in the subprogram file {self.external}, which is not rewritten"
        return (Rule.REFUSE, reason) if reason else (Rule.CORRECT, "")

    def _style_of(self, motion: Motion) -> int:
        """The style of a motion; behind a contour the one that leads off stays whole."""
        rule, reason = self._verdict(motion.kind, motion.unknown, motion.refusal, motion.passing)
        whole, self.whole = self.whole, self.whole or bool(self.beside & motion.axes)
        style = self._style(motion.kind, rule, reason, motion.code)
        self.whole = whole
        return style

    def style_of(self, kind: Kind, code: int) -> int:
        """The style of motions whose start and end are known and that have no reason of their own."""
        rule, reason = self._verdict(kind, {}, "", "")
        return self._style(kind, rule, reason, code)

    def note_foreign(self, letter: str) -> None:
        """The program moves an axis that the machine lacks."""
        names = " ".join(self.builder.axes)
        text = f"the program moves the axis {letter}, and the machine has only {names}"
        self.foreign[letter] = Message(UNKNOWN_AXIS, text, self.place(), "is it the right machine file?")

    def _style(self, kind: Kind, rule: Rule, reason: str, code: int) -> int:
        modal = self.modal
        tool, length = self.tool_length()
        return self.builder.style(
            Style(
                kind,
                rule,
                self.builder.reason(reason),
                self.frame,
                modal.incremental,
                modal.arc_absolute,
                self.tcp,
                modal.compensated != 0 or self.whole,
                tool,
                length,
                modal.feed_mode,
                code,
                self.tilted,
            )
        )
