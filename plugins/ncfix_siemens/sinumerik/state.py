"""The state of a SINUMERIK control that follows a program: frames, modes, tool, variables, axis positions.

Positions, motions, knowledge and questions to the setup are those of all controls (`ProgramControl`). SINUMERIK adds a
chain of frames. Unknown positions are kept in program coordinates, since in a rotated frame one unknown coordinate
would make three axes unknown.

Increments (G91, IC) after a change of frame or tool length: setting data, one for frames and one for tools, tell
whether the increment includes that change; by default it does. Such an increment is refused until the axis has moved to
an absolute position, unless the setup states that increments exclude the change.
Source: Siemens, "SINUMERIK 840D sl, axes, coordinate systems, frames (K2)": frames with G91, SD42440, SD42442.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ncfix.control.control import AFTER_THAT, ProgramControl
from ncfix.control.coordinates import CENTRE_LETTERS, DEGREE, INDEX, LETTERS, Vector, X, Y, Z, mask_of
from ncfix.control.expressions import Value
from ncfix.control.frames import WORLD, Affine, FrameStack, shifted
from ncfix.control.moves import Arc, Motion, MotionEnd, MotionKind, Pass, Passing, Rule, UnknownAxes
from ncfix.control.setup import Run, Tool
from ncfix.control.state import Modal
from ncfix.control.tcp import switch
from ncfix.control.turns import Winding
from ncfix.text.dialect import Dialect
from ncfix_siemens.sinumerik.expressions import SinumerikVariables, key_of
from ncfix_siemens.sinumerik.vocabulary import (
    HALF_A_TURN,
    INCREMENTAL,
    MOTIONS,
    PATH_WORDS,
    TURNING,
    BlockWordValues,
    Modes,
    NamedTools,
)

GEOMETRY = (X, Y, Z)
ROUND = frozenset({20, 30, MOTIONS["cip"], MOTIONS["ct"]})

RESET_OF_DIAMETER = "$MC_GCODE_RESET_VALUES[28]"
"""Machine data with the key of `DIAMETERS` that is in force at the start."""

DIAMETERS: Mapping[Value, str] = {1.0: "diamof", 2.0: "diamon", 3.0: "diam90"}


FRAME_COUNTS, TOOL_COUNTS = "$sc_frame_offset_incr_prog", "$sc_tool_offset_incr_prog"
UNSTEADY = (
    'setting data decide whether this increment includes the change of {}: variables."{}" = 0 in the setup file means '
    "that it does not"
)

TURNED_AWAY = "a rotary axis turns in a tilted plane, and the plane does not turn with it: call CYCLE800 again"

TAKEN_ALONG = ("by machine coordinates",)
"""Reference of an axis in a rotated frame after a motion of a machine axis: different from every frame."""

Footing = tuple[tuple[object, ...], tuple[object, ...]]
"""The reference of an axis's program position: (of its frame, of the tool)."""

IN_PLANE = frozenset({"orivect", "oriplane"})

NO_SYSTEM = "G500"
"""The name under which the setup may give the offset that is in force without a settable frame."""


class Sinumerik(ProgramControl):
    """The state that the steps of a block read and change.

    over        rotary axes that the last motion took past a full turn
    edge        active cutting edge (D), 0 for none
    allowance   offset of contours in addition to the tool radius (OFFN), mm; NaN if unknown
    at_start    the tool is still the one at the program start, with its edge D1
    whole       the current motion must not be split
    cornered    the last motion ended at a corner that the control rounds or chamfers
    acting      a synchronized action without ID came since the last motion, and acts in the next motion block
    pattern     places of the last pattern of holes
    contours    contours that CYCLE62 has named for the next cycle; milled: a cycle has used them
    contour     the current blocks are a contour that a cycle mills
    solitary    blocks after which no line may be inserted, since REPEAT would skip it
    fresh_tool  a tool has been called since the last motion
    changed_by_cycle  an unknown name directly after a tool call, or an unknown number (L6), may change the tool
    counted     for each letter, the reference of its position when the axis last moved
    footing     for each letter, the reference now in force
    stated      the motion code was set by the program, not possibly by a cycle that is not followed
    heading     direction (X Y Z) of the end of the last motion in the program's frame; None if unknown
    """

    frame_order = ("datum", "plane", "programmable")
    unit_codes = "G70 or G71"

    def __init__(self, run: Run, dialect: Dialect) -> None:
        super().__init__(run, dialect)
        self.frames = replace(self.frames, name=NO_SYSTEM)
        self.modes = Modes()
        self.over: tuple[int, ...] = ()
        self.edge = 0
        self.allowance = 0.0
        self.at_start = True
        self.fresh_tool = self.changed_by_cycle = False
        self.pattern: tuple[tuple[float, float], ...] = ()
        self.heading: Sequence[float] | None = None
        self.whole = self.cornered = self.acting = False
        self.stated = True
        self.contours: list[str] = []
        self.milled = self.contour = False
        self.solitary: frozenset[int] = frozenset()
        self.variables = SinumerikVariables.given(run.setup.variables)
        self.named = NamedTools()
        self.refresh()
        self.counted: list[Footing] = list(self.footing)
        self.watch_rolling()
        self.builder.winding = Winding(np.zeros(len(run.axes), dtype=np.bool_))
        at_start = DIAMETERS.get(self.variables.value(key_of(RESET_OF_DIAMETER)))
        if at_start:
            self.count_in(at_start)

    def count_in(self, name: str) -> None:
        """Execute DIAMON, DIAM90 or DIAMOF, in lower case: whether X is a diameter."""
        self.modes.diameter = "" if name == "diamof" else name.upper()
        self.modes.said, self.modal.diameter = True, name != "diamof"
        self.resume("diameter")
        self.refresh()

    # -- frames -------------------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """See `ProgramControl`; also updates `footing`."""
        super().refresh()
        self.footing = self._footings(self.composed)

    def anchors(self) -> list[Hashable]:
        """As for all controls, but shifts of the programmable frame (TRANS) are stated by the program."""
        frames, tool = self.frames, self.tool_shift
        return [
            (frames.name, frames.datum.shift[i], frames.plane.shift[i], tool[i], self.spatial_anchor(i))
            for i in range(len(LETTERS))
        ]

    @property
    def turns_in_plane(self) -> bool:
        """See `ProgramControl`."""
        return self.modes.transformed and self.modes.orientation in IN_PLANE

    def spatial_anchor(self, index: int) -> Hashable:
        """The tip control and tool edge on which an axis's positions depend; None for rotary and other axes."""
        if index not in GEOMETRY:
            return None
        return self.tcp, (self.tools.offset, self.edge) if self.tcp or index == Z else None

    def select(self, name: str) -> None:
        """Take a settable frame into force."""
        given = self.setup.work_offsets.get(name, {})
        stored = {INDEX[letter]: value * self.of_setup(letter) for letter, value in given.items()}
        self.frames = replace(self.frames, name=name, datum=shifted(stored))
        self.offset_checked = False
        self.refresh()

    def of_setup(self, letter: str) -> float:
        """mm or rad per unit of an axis in the setup (mm or degree)."""
        return DEGREE if self.rotary[INDEX[letter]] else 1.0

    def check_offset(self) -> None:
        """At the first use of the settable frame, ask the setup for it."""
        if self.offset_checked:
            return
        self.offset_checked = True
        if self.frames.name not in self.setup.work_offsets:
            self.knowledge.work_offset(self.frames.name)

    def restore(self, modal: Modal, modes: Modes, frames: FrameStack) -> None:
        """Restore the state before a subprogram with SAVE, except feed, spindle and transformations."""
        if frames.plane != self.frames.plane:
            self.suspend("tilt", "a tilted plane (CYCLE800) of a subprogram with SAVE, which may stay in force")
        if not modal.compensated:
            self.end_compensation()
        now, self.modal, self.frames = self.modal, modal, replace(frames, plane=self.frames.plane)
        modal.speed, modal.spindle, modal.feed, modal.feed_given = now.speed, now.spindle, now.feed, now.feed_given
        if (now.feed_mode, now.per_feed) != (modal.feed_mode, modal.per_feed):
            modal.feed, modal.feed_given = math.nan, False
        transformed, swivelled = self.modes.transformed, self.modes.swivelled
        self.modes = modes
        self.modes.transformed, self.modes.swivelled = transformed, swivelled
        self.refresh()

    # -- tool-centre-point control ------------------------------------------------------------------------------------

    def switch_tcp(self, tool: Vector | None = None) -> None:
        """Update tip control after a change of TRAORI, swivelled plane or tool; the machine axes do not move."""
        on = self.setup.tcp or self.modes.transformed or self.modes.swivelled
        new = self.tools.vector if tool is None else tool
        if on or self.tcp:
            switch(self, new, on, self.tools.offset)
        self.tcp = on
        self.tools.vector = new
        self.refresh()

    # -- what is known ------------------------------------------------------------------------------------------------

    def lose_all(self, reason: str) -> None:
        """Mark the positions of all axes, and the motion code, as unknown; `reason` has a `{}` for the axis letter."""
        self.stated = False
        self.lose(self.axis_indices, reason)

    def path_word(self, words: Collection[str]) -> str:
        """A word of the block that moves an axis, "" if none; I J K count only with an arc code in force."""
        leading = min(PATH_WORDS.intersection(words), default="")
        if not leading and self.modal.motion in ROUND:
            leading = min({*CENTRE_LETTERS}.intersection(words), default="")
        return leading

    def refuse_here(self, reason: str) -> None:
        """See `ProgramControl`."""
        super().refuse_here(reason)
        self.lose_all(AFTER_THAT.format(reason))

    def use_all_start_positions(self) -> None:
        """Ask the setup for all start positions still unknown; missing ones are taken as zero."""
        self.use_start_positions(tuple(self.unknown))

    # -- increments ---------------------------------------------------------------------------------------------------

    def _footings(self, whole: Affine) -> list[Footing]:
        """The reference of every letter with these frames in force."""
        tool = self.tools.vector
        return [
            (frame_of(whole, index), (self.tcp, tuple(tool[:3])) if self.tcp and index < 3 else (tool[index],))
            for index in range(len(LETTERS))
        ]

    def unsteady(self, index: int, *, by_machine: bool = False) -> str:
        """Why the end of an increment of an axis is uncertain; "" if it is not."""
        before, now = self.counted[index], (self._footings(WORLD) if by_machine else self.footing)[index]
        if before == now:
            return ""
        if before[0] != now[0] and self.variables.value(FRAME_COUNTS) != 0.0:
            return UNSTEADY.format("the frame", FRAME_COUNTS.upper())
        if before[1] != now[1] and self.variables.value(TOOL_COUNTS) != 0.0:
            return UNSTEADY.format("the tool length", TOOL_COUNTS.upper())
        return ""

    def count_from_here(self, axes: int, *, by_machine: bool = False) -> None:
        """Set the reference of increments of these axes (bit mask), which have moved to a position.

        by_machine  they moved in machine coordinates. With a rotated frame this also moves the other geometry axes of
                    the program, whose reference becomes `TAKEN_ALONG`
        """
        footing = self._footings(WORLD) if by_machine else self.footing
        moved = [index for index in GEOMETRY if by_machine and self.is_rotated and axes >> index & 1]
        for index in range(len(LETTERS)):
            if axes >> index & 1:
                self.counted[index] = footing[index]
            elif index in GEOMETRY and any(self.tcp or self.rotation[other][index] for other in moved):
                self.counted[index] = TAKEN_ALONG, footing[index][1]

    # -- motions ------------------------------------------------------------------------------------------------------

    def here(self, lost: UnknownAxes | None = None) -> MotionEnd:
        """The current position as the end of a motion; lost: unknown axes of the program's frame, by default as now."""
        if lost is None:
            return MotionEnd(self.position[:], dict(self.unknown), dict(self.lost_in_frame()))
        return MotionEnd(self.position[:], self.axes_of(lost), lost)

    def go(
        self,
        kind: MotionKind,
        words: BlockWordValues,
        end: MotionEnd,
        code: int,
        *,
        refusal: str = "",
        passing: Passing | None = None,
        arc: Arc | None = None,
        placed: int | None = None,
        by_machine: bool = False,
    ) -> None:
        """Add a motion of a block, and update the position.

        code        motion code, in tenths
        refusal, passing, arc  as in `Motion`
        placed      as in `Motion`; None: the axes of the words without increments, none if the motion is passed
        by_machine  the words are machine coordinates
        """
        polar = self.modal.plane.axes if words.values.keys() & {"AP", "RP"} else 0  # these name both axes of the plane
        axes = words.axes | polar
        if placed is None:
            placed = 0 if passing else axes & ~mask_of(self.counted_words(words))
        self.fresh_tool = False
        refusal, self.whole = refusal or words.refusal, words.whole or self._passes_zero(words, end.target)
        sure = (letter for letter, form in words.forms.items() if form in TURNING and letter in INDEX)
        self.builder.says_the_way(mask_of(INDEX[letter] for letter in sure))
        leaves = self._leaves_plane(end) and (passing is None or passing.rule != Pass.ALIGNMENT)
        if leaves and not passing:
            refusal = refusal or TURNED_AWAY
        follows = not passing and not refusal
        if follows:
            self.ask_for_length()
        if kind != MotionKind.DWELL:
            self.heading = self._heading(end, arc) if follows else None
        self.make(Motion(kind, axes, end, code, refusal, passing, arc, placed))
        self.whole = False
        self.count_from_here(axes, by_machine=by_machine)
        if leaves:
            self.suspend("tilt", TURNED_AWAY)

    def _leaves_plane(self, end: MotionEnd) -> bool:
        """Whether the motion turns a rotary axis in a swivelled plane that does not follow it (no TRAORI)."""
        target, here = end.target, self.position
        moved = (target[i] != here[i] or (i in self.unknown and i not in end.unknown) for i in self.turning)
        return self.held and any(moved)

    @property
    def held(self) -> bool:
        """Whether the plane is swivelled (CYCLE800) without tool-centre-point control."""
        return self.modes.swivelled and not (self.modes.transformed or self.setup.tcp)

    def _heading(self, end: MotionEnd, arc: Arc | None) -> Sequence[float] | None:
        """The direction of the end of a motion in the program's frame; None if unknown."""
        step = [b - a for a, b in zip(self.position, end.target, strict=True)]
        if any(index in self.unknown or index in end.unknown for index in GEOMETRY):
            return None
        if arc is not None:
            return self.in_frame(departing(arc, end.target, step))
        if any(step[:3]):
            return self.in_frame(step)
        return None if any(step) else self.heading

    def head_as_latest(self) -> None:
        """Set `heading` after motions of the fast lane, as after single motions."""
        stretch = self.builder.latest
        if stretch is None:
            return
        steps, (turned, arc) = stretch.end - stretch.start, self.builder.latest_arc() or (-1, None)
        rows = range(len(steps) - 1, -1, -1)
        last = next((row for row in rows if row == turned or steps[row].any()), -1)
        if arc is not None and last == turned:
            self.heading = departing(arc, stretch.end[last].tolist(), steps[last].tolist())[:3]
        elif last >= 0:
            self.heading = steps[last, :3].tolist() if steps[last, :3].any() else None

    def _leaves_unknown(self, rapid: Motion) -> bool:
        """See `ProgramControl`, but only if the program itself has set the motion code."""
        return self.stated and super()._leaves_unknown(rapid)

    def counted_words(self, words: BlockWordValues) -> list[int]:
        """The axes whose words are increments."""
        named = ((index, words.forms.get(letter, "")) for letter, index in INDEX.items() if letter in words.values)
        return [index for index, form in named if self.counts_on(form)]

    def counts_on(self, form: str) -> bool:
        """Whether a word in this form is an increment."""
        return form == INCREMENTAL or (not form and self.modal.incremental)

    def ends_in_hole(self, motion: Motion) -> bool:
        """See `ProgramControl`; a modal cycle (MCALL) drills where motions end."""
        return super().ends_in_hole(motion) or self.modes.modal_cycle is not None

    def _style(self, kind: MotionKind, rule: Rule, reason: str, code: int, passing: Pass = Pass.NONE) -> int:
        index = super()._style(kind, rule, reason, code, passing)
        if not self.held and not self.whole:
            return index
        style = self.builder.styles[index]
        return self.builder.style(style._replace(rotary_as_programmed=self.held, whole=style.whole or self.whole))

    def _passes_zero(self, words: BlockWordValues, target: Vector) -> bool:
        """Whether DC, ACP, ACN or IC leads an axis past a full turn, so that the motion must not be split."""
        turn, endless = 2 * math.pi, self.builder.endless
        steps = [] if self.modal.incremental else [index for index in self.counted_words(words) if endless >> index & 1]
        places = ((self.position[index], target[index]) for index in (*self.over, *steps))
        return any(not 0 <= place < turn for pair in places for place in pair)

    def goes_to_number(self, index: int, angle: float) -> bool:
        """Whether the shortest way to an angle, degree, stays within the same turn, so that DC leads to the number."""
        here, step = self.position[index], self.scale[index] * angle
        counts = self.rotary[index] and not self.modal.incremental and self.offset[index] == 0.0
        return counts and 0.0 <= here < 2 * math.pi and abs(step - here) < math.radians(HALF_A_TURN)

    def wrap(self) -> None:
        """Reduce the position of rotary axes that DC, ACP or ACN took past a full turn to 0 ... 360 degree."""
        if self.over:
            self.position = [
                value % (2 * math.pi) if index in self.over else value for index, value in enumerate(self.position)
            ]
            self.over = ()

    # -- tools --------------------------------------------------------------------------------------------------------

    def length_of(self, number: int, edge: int) -> float:
        """The length of a tool for its cutting edge, mm; if the setup lacks it, it is noted and zero."""
        if number == 0:
            return 0.0
        name = self.named.name(number) if edge == 1 else f"{self.named.name(number)} D{edge}"
        known = self.given_length(number, edge)
        if known is None:
            self.knowledge.lack("NCF202", f"length of tool {name}", "is used", f'--tool "{name}"=LENGTH')
            return 0.0
        return known

    def ask_for_length(self) -> None:
        """Ask for the length of a tool called by name that moves without length offset: errors may depend on it."""
        number = self.tools.spindle
        if self.tools.offset is None and self.named.name(number) != str(number) and self.given_length(number) is None:
            self.length_of(number, 1)

    def given_length(self, number: int, edge: int = 1) -> float | None:
        """The length of a tool, mm, if the setup gives it."""
        tool = self._given(number, edge)
        return None if tool is None else tool.length

    def tool_radius(self) -> float:
        """See `ProgramControl`: the radius of the active cutting edge plus the allowance (OFFN), mm."""
        tool = self._given(self.tools.spindle, self.edge)
        return math.nan if tool is None or tool.radius is None else tool.radius + self.allowance

    def _given(self, number: int, edge: int) -> Tool | None:
        """A tool with one of its edges, if the setup has it; else None."""
        name = self.named.name(number)
        return self.setup.tool_called(name if edge == 1 else f"{name} D{edge}")

    def spindle_length(self) -> float:
        """See `ProgramControl`, by the names of tools."""
        number = self.tools.spindle
        known = self.given_length(number)
        if known is None and f"length of tool {self.named.name(number)}" in self.knowledge.assumed:
            return 0.0  # asked for already, by its name
        return math.nan if known is None else known

    def length_under_tcp_with(self, tool: Vector, number: int | None) -> float:
        """See `ProgramControl`; with D0 the transformation leads the tip of a tool of length zero."""
        return tool[2]


def frame_of(whole: Affine, index: int) -> tuple[object, ...]:
    """The reference of an axis in a frame; in a rotated frame X, Y and Z each depend on all three shifts."""
    if index >= 3:
        return (whole.shift[index],)
    turned = whole.rotation != WORLD.rotation
    return (tuple(whole.shift[:3]) if turned else whole.shift[index], whole.rotation, whole.scale)


def departing(arc: Arc, end: Vector, step: Vector) -> Vector:
    """The direction of the end of an arc or helix with displacement `step`, in machine axes; not normalized."""
    nx, ny, nz = arc.normal
    x, y, z = (end[i] - arc.centre[i] for i in range(3))
    rise = nx * step[0] + ny * step[1] + nz * step[2]
    round_ = ny * z - nz * y, nz * x - nx * z, nx * y - ny * x
    return [arc.sweep * part + rise * across for part, across in zip(round_, arc.normal, strict=True)]
