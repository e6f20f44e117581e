"""The state of a control while it follows a program, and what may be done with each motion.

Cutter radius compensation: the control would offset even the smallest displacement in the plane by the radius, in
whatever direction it points. So a motion without displacement in the plane must stay without one when it is corrected:
axes of the plane that it does not name get no word, and axes that it names (`X40` where X stands at 40) stay where they
are. At a corner that the control rounds or chamfers, it inserts nothing if a motion leaves the plane; so a motion that
stays in the plane must stay in it when it is corrected.
Source: Siemens, "SINUMERIK 840D sl, NC programming, fundamentals": chamfer, rounding (CHF, CHR, RND, RNDM).
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np

from ncfix.arrays import Array, Ints
from ncfix.control.builder import MotionBuilder, MotionStyle
from ncfix.control.coordinates import LETTERS, Vector, mask_of, rotated
from ncfix.control.flow import BlockBudget
from ncfix.control.moves import (
    AT_START,
    PASS_RULES,
    Motion,
    MotionEnd,
    MotionKind,
    Moves,
    Pass,
    Passing,
    Rule,
    UnknownAxes,
    blanked,
    first_reason,
)
from ncfix.control.posture import MAX_PLANE_DEVIATION_RAD
from ncfix.control.setup import Run
from ncfix.control.state import TOOL_AT_RUN_TIME, ControlState
from ncfix.control.tcp import in_machine
from ncfix.control.turns import ROLLED, ROLLS, may_roll
from ncfix.diagnostics import Message, UsageError
from ncfix.text.dialect import Dialect
from ncfix.text.tree import Program

UNKNOWN_AXIS = "NCF206"
NEITHER = 'all motions after it are refused; if it does neither, write passed_codes = ["{}"] in the setup file'
TAKEN = "passed_codes lists it, but its block has axis words or H, which it may use: write them in a block of their own"

MOVED_AS_A_WHOLE = "NCF280"
AS_A_WHOLE = "{} is corrected at its position and at its bottom; the shape that it mills is shifted as a whole"

UNPLACED = "the program has not yet given the position of the axis {}, and this motion needs a word for it"
"""Why a motion that moves an axis without naming it is passed or refused."""

CUTTER_RIGHT = 42
"""G42: cutter radius compensation to the right of the path."""
NOT_ACCOUNTED = "ncfix does not know what the control does with the word {} in this block"
AFTER_THAT = "the position of the axis {{}} is not known after this: {}"
BLOCKS_AFTER_MISSING_AXIS = 5000
"""Blocks followed after the program has moved an axis that the machine lacks, to collect further missing data."""
ASTRAY = "the position of the axis {} after motions that were refused is not known"
NO_UNIT = "NCF215"
NO_UNIT_SAID = "the program does not set its unit, inches or millimetres; ncfix assumes millimetres"
MAX_AT_REST = 1e-9
"""Largest displacement, mm or rad, of an axis that is taken to stand still."""
MIN_COSINE = 1 - 1e-12
"""A turned axis whose component along the machine axis is at least this counts as parallel to it."""


class ProgramControl(ControlState):
    """State that every control keeps while it follows a program, in any language; motions are added to `builder`.

    budget     number of blocks that may still be executed
    needs_feed whether a feed motion without a feed is an error
    refusal    why all further motions are refused; empty while they are not
    suspended  modes during which motions are refused -> why
    followed   modes of `suspended` in which the end positions of motions are known nevertheless
    astray     axes, as bits, that moved to unknown positions in suspended modes
    foreign    axes that the program moves and the machine lacks
    external   name of the subprogram file being executed; empty in the main program
    row_block  main program block to which motions belong: for motions of a subprogram file, the calling block
    numbers, first  numbers of the text being executed, and index of the first number of the block
    ends       collects the end points of a block's motions; None: not wanted
    points     whether a block gave the tool direction as a vector
    whole      whether the motions of the block must not be split
    at_corner  whether the motion begins or ends at a corner that the control rounds or chamfers
    beside     axes, as bits, still offset from a contour after its compensation ended: the motion that leads off is not
               split
    block_words  addresses of the block being executed that no motion or setting has used yet
    """

    unit_codes = "G20 or G21"

    def __init__(self, run: Run, dialect: Dialect) -> None:
        super().__init__(run, dialect)
        self.builder = MotionBuilder(run.axes, run.rotary)
        self.budget = BlockBudget(run.setup.most_blocks, run.setup.most_blocks)
        self.needs_feed = False
        self.refusal = ""
        self.suspended: dict[str, str] = {}
        self.followed: set[str] = set()
        self.astray = 0
        self.foreign: dict[str, Message] = {}
        self.followed_in_vain = 0
        self.external = ""
        self.row_block = 0
        self.numbers: Sequence[float] = ()
        self.first = 0
        self.ends: list[Vector] | None = None
        self.points = False
        self.whole = self.at_corner = False
        self.beside = 0
        self.block_words: Collection[str] = ()

    def lasting(self) -> str | None:
        """The whole state except what a `Checkpoint` holds, in comparable form; None: not available."""
        return None

    def set_variables(self) -> Any:
        """The variables that the program may have set, in a form that can be sent to another process."""
        return None

    def take_variables(self, variables: Any) -> None:
        """Restore variables that another process obtained by `set_variables`."""

    @property
    def lacking(self) -> tuple[Message, ...]:
        """Errors for data that the program used and the setup does not give, and for axes that the machine lacks."""
        return (*self.foreign.values(), *self.knowledge.missing.values())

    @property
    def closure_mm(self) -> float:
        """Largest difference, mm, between the radii at both ends of an arc."""
        return self.dialect.closure_mm

    @property
    def turns_in_plane(self) -> bool:
        """Whether the tool turns in the plane of its two end directions, instead of each rotary axis evenly."""
        return False

    @property
    def takes_zero_across(self) -> bool:
        """Whether an arc may have a centre word of value zero for the axis across its plane (I, J and K together)."""
        return True

    def moves(self) -> Moves:
        """The motions so far."""
        moves = self.builder.moves()
        return replace(moves, pointing=self.posture.pointing) if self.points else moves

    def refuse_after(self, code: int, *, moving: bool) -> None:
        """Refuse all motions after an unknown G code (tenths), unless the setup says that it is harmless.

        moving  whether its block has words of axes or of a length, which the code might use: then it is refused
                nevertheless
        """
        passed = code in self.setup.passed_codes
        if self.refusal or (passed and not moving):
            return
        name = f"G{code / 10:g}"
        self.refusal = f"{name} is not known, and may move axes or change coordinates"
        self.warn("NCF228", self.refusal, TAKEN if passed else NEITHER.format(name))

    def refuse_rest(self, why: str) -> None:
        """Refuse every further motion; the first reason given is the one reported."""
        self.refusal = self.refusal or why

    def take_length(self, number: int) -> None:
        """Apply the length of tool `number` from here on (`SetLength`); for languages that accept plugin codes."""
        raise NotImplementedError

    def moved_as_a_whole(self, cycle: str) -> None:
        """Report that of a cycle with a path of its own only the place and the bottom are corrected."""
        self.warn(MOVED_AS_A_WHOLE, AS_A_WHOLE.format(cycle))

    def suspend(self, mode: str, why: str, *, followed: bool = False) -> None:
        """Refuse motions until `resume(mode)`; `followed`: their end positions are known nevertheless."""
        self.suspended[mode] = why
        (self.followed.add if followed else self.followed.discard)(mode)

    def resume(self, mode: str) -> bool:
        """End a suspended mode; returns whether it was in force. Axes that it led astray become unknown."""
        over = self.suspended.pop(mode, None) is not None
        if over and self.astray:
            self.lose([index for index in self.axis_indices if self.astray >> index & 1], ASTRAY)
            self.astray = self.astray if self.suspended.keys() - self.followed else 0
        return over

    @property
    def remarks(self) -> tuple[Message, ...]:
        """All remarks on the program, in an order that does not depend on whether it was followed in parts."""
        rolled = (self.rolled[text] for text in ROLLED if text in self.rolled)
        return (*self.knowledge.assumed.values(), *self.messages.values(), *rolled)

    def watch_rolling(self) -> None:
        """Watch for motions in which a rotary axis might roll over, as far as its known travel allows it."""
        self.builder.rolls = may_roll(None if self.kinematics is None else self.kinematics.travel, self.builder.rotary)

    def note_rolling(self, program: Program) -> None:
        """Report the first motion of each kind in which an axis might roll over."""
        for text, block in zip(ROLLED, (self.builder.overturned, self.builder.brought_back), strict=True):
            if block is not None and text not in self.rolled:
                self.rolled[text] = Message(ROLLS, text, program.place(block), ROLLED[text])

    # -- blocks -------------------------------------------------------------------------------------------------------

    def enter_block(self, words: Collection[str]) -> None:
        """Begin a block that has words of these addresses."""
        self.block_words = words

    def claim_words(self, words: Collection[str] | None = None) -> None:
        """Mark words of the block (None: all) as used by a setting, so that they demand no motion."""
        self.block_words = () if words is None else [word for word in self.block_words if word not in words]

    def leave_block(self) -> None:
        """End a block. If it has an unused path word and has made no motion, it is refused.

        This one rule holds for all languages: a path word is never ignored. Interpreters call it after every block;
        blocks of the fast lane contain only motions.

        Raises UsageError with everything in `lacking`, some blocks after the program moved an axis that the machine
        lacks.
        """
        if self.foreign:
            self.followed_in_vain += 1
            if self.followed_in_vain > BLOCKS_AFTER_MISSING_AXIS:
                raise UsageError.collected(self.lacking)
        words, self.block_words = self.block_words, ()
        word = self.path_word(words) if words else ""
        if word:
            self.refuse_here(NOT_ACCOUNTED.format(word))

    @abstractmethod
    def path_word(self, words: Collection[str]) -> str:
        """The first word that demands a motion in the modes in force; empty if there is none."""

    def refuse_here(self, reason: str) -> None:
        """Refuse a block whose motion is not known: the positions of all axes are unknown afterwards."""
        unknown = dict.fromkeys(self.axis_indices, AFTER_THAT.format(reason))
        self.make(Motion(MotionKind.FEED, 0, MotionEnd(self.position[:], unknown), 10, refusal=reason))

    @property
    def frame(self) -> int:
        """The index of the frame in force."""
        if self._frame < 0:
            self._frame = self.builder.frame(
                self.offset, self.rotation, self.stretch, self.modal.diameter, self.increments, self.modal.per_feed
            )
        return self._frame

    def make(self, motion: Motion) -> None:
        """Add a motion, and update positions and what is known of them.

        Every motion passes through here, except those of the fast lane.
        """
        if not motion.passing:
            self._ask_for_start(motion)
            if not self.unit_said:
                self.warn(NO_UNIT, NO_UNIT_SAID, f"program {self.unit_codes} at its beginning")
        if self.composed.unknown:
            self.places.lose(mask_of(self.composed.unknown))
        placed = self.placed_by(motion)
        unplaced = self.places.unplaced & ~placed
        if self.is_rotated and unplaced & (turned := self._turned()):
            unplaced |= turned  # turned axes go together
        unplaced |= self.still_beside(motion.axes)
        if not motion.passing and placed & motion.axes != (0 if self.modal.incremental else motion.axes):
            self.builder.counted(motion.axes & ~placed)  # some words count otherwise than the distance mode says
        fate = self._fate(motion, unplaced)
        self._keep_places(motion, placed)
        style = self._style_of(fate)
        self.beside &= ~fate.axes
        if fate.arc is not None:
            self.builder.arc(fate.arc)
        if not fate.passing and fate.kind != MotionKind.DWELL:
            self.builder.rests(self._resting(fate))
        if fate.kind != MotionKind.DWELL:
            self.block_words = ()
        start, end = blanked(self.position, self.unknown), blanked(fate.end.target, fate.end.unknown)
        if fate.end.in_machine is not None and (begin := in_machine(self)) is not None:
            start, end = begin, fate.end.in_machine
            style = self.builder.style(self.builder.styles[style]._replace(tcp=False, tcp_length=math.nan))
        self.builder.add(self.row_block, fate.axes, style, self.modal.feed, start, end, unplaced)
        if self.suspended.keys() - self.followed:
            self.astray |= self._moved_by(motion)
        if self.ends is not None:
            self.ends.append(fate.end.target[:])
        self.position, self.unknown = fate.end.target, fate.end.unknown

    def _ask_for_start(self, motion: Motion) -> None:
        """Resolve start positions that matter: at the end of a rapid, at both ends of other motions."""
        kind, unknown = motion.kind, motion.end.unknown
        if AT_START in unknown.values() or (kind != MotionKind.RAPID and AT_START in self.unknown.values()):
            everywhere = tuple(self.unknown) if kind != MotionKind.RAPID else tuple(unknown)
            self.use_start_positions(everywhere)
            for index in [index for index, why in unknown.items() if why is AT_START]:
                if index in self.unknown:
                    unknown[index] = self.unknown[index]
                else:
                    del unknown[index]

    def _moved_by(self, motion: Motion) -> int:
        """The axes that a motion names or moves, as a bit mask."""
        target, here = motion.end.target, self.position
        return mask_of(i for i in self.axis_indices if motion.axes >> i & 1 or target[i] != here[i])

    def placed_by(self, motion: Motion) -> int:
        """The axes whose positions at the end of the motion are set by its words, as a bit mask."""
        if motion.placed is not None:
            return motion.placed
        return 0 if motion.passing or self.modal.incremental else motion.axes

    def _keep_places(self, motion: Motion, placed: int) -> None:
        """Update which axes the program has placed; a motion passed by rule may end somewhere else."""
        if motion.passing and motion.kind != MotionKind.DWELL:
            self.places.lose(self._moved_by(motion))
        lost = self._lost_at_end(motion)
        if motion.kind != MotionKind.DWELL:
            self.frame_unknown = None if motion.end.in_frame is None else lost
        self.places.place(placed)
        self.places.lose(mask_of(lost))
        self.places.begun = True

    def _lost_at_end(self, motion: Motion) -> UnknownAxes:
        """Reasons why coordinates are unknown at the end of a motion, by axis of the program's frame."""
        if motion.end.in_frame is not None:
            return self.without_start(motion.end.in_frame)
        return self.lost_in_frame() if motion.kind == MotionKind.DWELL else self.along_frame(motion.end.unknown)

    def ends_in_hole(self, motion: Motion) -> bool:
        """Whether the motion ends in a hole: then its end position matters as in a cut."""
        return motion.kind == MotionKind.CYCLE

    def _fate(self, motion: Motion, unplaced: int) -> Motion:
        """The motion, passed or refused if it depends on axes whose positions the program has not set.

        If it moves an axis that has no word and must get none, a rapid is passed and any other motion refused.
        """
        if motion.passing is None and self._leaves_unknown(motion) and not self.ends_in_hole(motion):
            return motion._replace(passing=Passing(Pass.UNSAID, first_reason(motion.end.unknown)))
        wordless = unplaced & self.places.unplaced & ~motion.axes
        if not wordless or motion.passing or motion.refusal or motion.end.unknown:
            return motion
        moved = mask_of(i for i in self.axis_indices if motion.end.target[i] != self.position[i])
        if self.is_rotated and motion.axes & self._turned():
            moved |= self._turned()
        index = next((i for i in self.axis_indices if (wordless & moved) >> i & 1), None)
        if index is None:
            return motion
        why = UNPLACED.format(LETTERS[index])
        if motion.kind == MotionKind.RAPID and not self.ends_in_hole(motion):
            return motion._replace(passing=Passing(Pass.UNSAID, why))
        return motion._replace(refusal=why)

    def _leaves_unknown(self, rapid: Motion) -> bool:
        """Whether the motion is a rapid that leaves axes unknown that were unknown before, and names none of them.

        Its correction would depend on their positions. A rapid cuts nothing, and its axes can be corrected once the
        program has named the others: it is passed.
        """
        if not rapid.end.unknown or rapid.kind != MotionKind.RAPID or rapid.refusal or self.refusal or self.suspended:
            return False
        before = {*self.unknown.values(), *self.lost_in_frame().values()}
        named = any(rapid.axes >> index & 1 for index in self._lost_at_end(rapid))
        return before.issuperset(rapid.end.unknown.values()) and not named

    def still_beside(self, axes: int) -> int:
        """The axes of the plane, as bits, that get no word in a motion across it under radius compensation."""
        plane = self.plane_axes if self.modal.compensated else 0
        return 0 if axes & plane else plane

    def _resting(self, motion: Motion) -> int:
        """Axes, as bits, that must stay at rest in a motion.

        Those of the plane, if it names some of them without displacement in the plane; at a corner also all other axes
        without displacement.
        """
        plane = self.plane_axes
        beside = motion.arc is None and bool(self.modal.compensated and motion.axes & plane)
        if not (beside or self.at_corner):
            return 0
        way = [there - here for there, here in zip(motion.end.target, self.position, strict=True)]
        way = rotated(self.inverse, way) if self.is_rotated else way
        lacking = {*motion.end.unknown, *self.unknown}
        still = mask_of(index for index in self.axis_indices if abs(way[index]) <= MAX_AT_REST and index not in lacking)
        across = still & ~plane if self.at_corner else 0
        return across | (plane if beside and plane & ~still == 0 else 0)

    def resting_of_many(self, words: Ints, starts: Array, ends: Array) -> Ints:
        """Like `_resting`, for motions with `words` (n,) from `starts` to `ends` (n, 9); not in a rotated frame."""
        columns = list(self.modal.plane.pair)
        still = (np.abs(ends[:, columns] - starts[:, columns]) <= MAX_AT_REST).all(axis=1)
        return np.where(still & (words & self.plane_axes != 0), self.plane_axes, 0)

    def end_compensation(self) -> None:
        """End radius compensation: until the program names the axes of the plane, only the control knows them."""
        if self.modal.compensated:
            self.beside = self.plane_axes
            self.places.lose(self.beside)
        self.modal.compensated = 0

    def _turned(self) -> int:
        """Axes, as bits, that words of other axes move too, because the frame is rotated."""
        return mask_of(i for i, row in enumerate(self.rotation) if i in self.axis_indices and abs(row[i]) < MIN_COSINE)

    @contextmanager
    def in_one_piece(self) -> Iterator[None]:
        """Context in which motions must not be split."""
        whole, self.whole = self.whole, True
        try:
            yield
        finally:
            self.whole = whole

    def _style_of(self, motion: Motion) -> int:
        """The style of a motion; it stays whole if it leads off a contour, or if splitting would turn the tool."""
        passing, whole = motion.passing, self.whole
        self.whole = whole or bool(self.beside & motion.axes) or self._strays(motion)
        if passing is not None and motion.kind in PASS_RULES[passing.rule].kinds:
            style = self._style(motion.kind, Rule.PASS, passing.words, motion.code, passing.rule)
        else:
            wrong = motion.refusal if passing is None else passing.words
            style = self.style_of(motion.kind, motion.code, motion.end.unknown, wrong)
        self.whole = whole
        return style

    def _strays(self, motion: Motion) -> bool:
        """Whether evenly turning rotary axes, as in pieces of the motion, would lead the tool axis out of its plane."""
        pointing = self.posture.pointing if self.turns_in_plane and motion.kind != MotionKind.RAPID else None
        if pointing is None:
            return False
        first, second = (self.axis_indices[column] for column in pointing.columns)
        here, there = ((place[first], place[second]) for place in (self.position, motion.end.target))
        return pointing.stray(here, there) > MAX_PLANE_DEVIATION_RAD

    def style_of(self, kind: MotionKind, code: int, unknown: UnknownAxes | None = None, refusal: str = "") -> int:
        """The style of a motion that is corrected, or refused if there is a reason.

        The start of a rapid or a canned cycle does not matter, since a cycle begins with a rapid.

        unknown, refusal  as in `Motion`; not given for stretches of motions
        """
        reason = refusal or self.refusal or next(iter(self.suspended.values()), "")
        if not reason and self.tools.unsure and self.tools.offset is None:
            reason = TOOL_AT_RUN_TIME
        if not reason and unknown:
            reason = first_reason(unknown)
        if not reason and kind not in (MotionKind.RAPID, MotionKind.CYCLE) and self.unknown:
            reason = first_reason(self.unknown)
        if not reason and self.external:
            reason = f"the motion is in the subprogram file {self.external}, which ncfix does not rewrite"
        return self._style(kind, Rule.REFUSE if reason else Rule.CORRECT, reason, code)

    def note_foreign(self, letter: str, also: str = "") -> None:
        """Record that the program moves an axis that the machine lacks; `also`: another meaning, for the hint."""
        names = " ".join(self.builder.axes)
        text = f"the program moves the axis {letter}, and the machine has only {names}"
        self.foreign[letter] = Message(UNKNOWN_AXIS, text, self.place(), f"is it the right machine file?{also}")

    def _style(self, kind: MotionKind, rule: Rule, reason: str, code: int, passing: Pass = Pass.NONE) -> int:
        modal = self.modal
        tool, length = self.tool_length()
        return self.builder.style(
            MotionStyle(
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
                passing,
                self._beside(),
                modal.plane.across if modal.compensated else 2,
                math.nan if not self.tcp or self.length_under_tcp == length else self.length_under_tcp,
                modal.exact_stop,
            )
        )

    def _beside(self) -> float:
        """Offset of the compensated contour to the left of the path, mm; NaN if the tool radius is not known.

        In mirrored coordinates, left of the programmed path is right of the tool's path.
        """
        radius = self.tool_radius() if self.modal.compensated else 0.0
        if math.isnan(radius):
            return radius
        return (-radius if self.modal.compensated == CUTTER_RIGHT else radius) * self.handedness
