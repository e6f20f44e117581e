"""The control while it follows a program: frames, modes, tool, variables, and where the axes stand.

Positions, motions, what is known and what is asked of the setup are those of all controls. SINUMERIK has of its own a
chain of frames, and a book of what is not known that is kept in the coordinates of the program, since in a turned frame
one unknown coordinate would hide three axes.

Increments (G91, IC), after a frame or a tool length has changed: an axis stands, and its frame or the length of its
tool changes. Whether the next increment takes that change along is for setting data, one for frames and one for tools;
as a control is delivered it does. So such an increment is refused, until the axis is brought somewhere absolutely,
unless the setup says that increments leave it out.
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
"""Machine data: which of `DIAMETERS` is in force at the start."""

DIAMETERS: Mapping[Value, str] = {1.0: "diamof", 2.0: "diamon", 3.0: "diam90"}


FRAME_COUNTS, TOOL_COUNTS = "$sc_frame_offset_incr_prog", "$sc_tool_offset_incr_prog"
UNSTEADY = (
    "whether the increment takes along that {} has changed is for setting data: "
    'variables."{}" = 0 in the setup file says that it does not'
)

TURNED_AWAY = "a rotary axis turns in a swivelled plane, which does not turn with it: CYCLE800 has to be called anew"

TAKEN_ALONG = ("by machine coordinates",)
"""What an axis of a turned frame counts from that an axis of the machine has moved: neither frames nor none."""

Footing = tuple[tuple[object, ...], tuple[object, ...]]
"""What the numbers of an axis count from: by its frame, and by the tool."""

IN_PLANE = frozenset({"orivect", "oriplane"})

NO_SYSTEM = "G500"
"""The name under which the setup may give what is in force while no settable frame is."""


class Sinumerik(ProgramControl):
    """Everything that the steps of a block read and change.

    over        rotary axes that the last motion took past a full turn
    edge        cutting edge in force (D), 0 for none
    allowance   what contours are offset by besides the radius of the tool (OFFN), mm; NaN where that is not known
    at_start    the tool is still that with which the program began, with its edge D1
    whole       the motion must not be split
    cornered    the last motion ended at a corner that the control rounds or breaks
    acting      a synchronized action without ID has come since the last motion: it acts in the block of the next
    pattern     the places to which the last pattern of holes has led
    contours    those that CYCLE62 has named for the next cycle; `milled`: one has used them
    contour     the blocks that are executed are those of a contour, which a cycle mills
    solitary    blocks after which no line may be put, since REPEAT would leave it out
    fresh_tool  a tool has been called since the last motion
    changed_by_cycle  a name that is not known has followed a call of a tool at once, or a number (L6) one at any time:
                it may be what changes the tool
    counted     for each letter what its numbers counted from when the axis was last brought somewhere
    footing     the same of the frames that are in force now
    stated      the motion code is what the program itself has said, not what something that is not followed may leave
    heading     in which direction of the program's frame the last motion ended (X Y Z); None where that is not known
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
        """DIAMON, DIAM90 or DIAMOF, in lower case: X counts in diameters or not."""
        self.modes.diameter = "" if name == "diamof" else name.upper()
        self.modes.said, self.modal.diameter = True, name != "diamof"
        self.resume("diameter")
        self.refresh()

    # -- frames -------------------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """As of every control, with what the numbers of the program count from."""
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
        """As of every control."""
        return self.modes.transformed and self.modes.orientation in IN_PLANE

    def spatial_anchor(self, index: int) -> Hashable:
        """Whether these are coordinates of the tip, and the edge that is in force across the plane."""
        if index not in GEOMETRY:
            return None
        return self.tcp, (self.tools.offset, self.edge) if self.tcp or index == Z else None

    def select(self, name: str) -> None:
        """A settable frame comes into force."""
        given = self.setup.work_offsets.get(name, {})
        stored = {INDEX[letter]: value * self.of_setup(letter) for letter, value in given.items()}
        self.frames = replace(self.frames, name=name, datum=shifted(stored))
        self.offset_checked = False
        self.refresh()

    def of_setup(self, letter: str) -> float:
        """mm or rad per unit of the setup."""
        return DEGREE if self.rotary[INDEX[letter]] else 1.0

    def check_offset(self) -> None:
        """The settable frame is used: it is given, or lacking."""
        if self.offset_checked:
            return
        self.offset_checked = True
        if self.frames.name not in self.setup.work_offsets:
            self.knowledge.work_offset(self.frames.name)

    def restore(self, modal: Modal, modes: Modes, frames: FrameStack) -> None:
        """Bring back what was in force before a subprogram that says SAVE."""
        motion, straight, feed = self.modal.motion, self.modal.straight, self.modal.feed
        if frames.plane != self.frames.plane:
            self.suspend("tilt", "a swivelled plane (CYCLE800) of a subprogram with SAVE, which may stay in force")
        self.modal, self.frames = modal, replace(frames, plane=self.frames.plane)
        self.modal.motion, self.modal.straight, self.modal.feed = motion, straight, feed
        transformed, swivelled = self.modes.transformed, self.modes.swivelled
        self.modes = modes
        self.modes.transformed, self.modes.swivelled = transformed, swivelled
        self.refresh()

    # -- tool-centre-point control ------------------------------------------------------------------------------------

    def switch_tcp(self, tool: Vector | None = None) -> None:
        """Take TRAORI, a swivelled plane or another tool into force: the machine stands still, its tip may not."""
        on = self.setup.tcp or self.modes.transformed or self.modes.swivelled
        new = self.tools.vector if tool is None else tool
        if on or self.tcp:
            switch(self, new, on, self.tools.offset)
        self.tcp = on
        self.tools.vector = new
        self.refresh()

    # -- what is known ------------------------------------------------------------------------------------------------

    def lose_all(self, reason: str) -> None:
        """No axis stands where it is known to from here on; `reason` has a `{}` for the axis letter.

        Nor is the motion code known to be what it was.
        """
        self.stated = False
        self.lose(self.axis_indices, reason)

    def path_word(self, words: Collection[str]) -> str:
        """See `PATH_WORDS`; I J K are words of arcs, and lead nowhere beside a straight motion."""
        leading = min(PATH_WORDS.intersection(words), default="")
        if not leading and self.modal.motion in ROUND:
            leading = min({*CENTRE_LETTERS}.intersection(words), default="")
        return leading

    def refuse_here(self, reason: str) -> None:
        """As of every control."""
        super().refuse_here(reason)
        self.lose_all(AFTER_THAT.format(reason))

    def use_all_start_positions(self) -> None:
        """All start positions matter: they are given, or lacking and taken as zero."""
        self.use_start_positions(tuple(self.unknown))

    # -- increments ---------------------------------------------------------------------------------------------------

    def _footings(self, whole: Affine) -> list[Footing]:
        """The footing of every letter while these frames are in force."""
        tool = self.tools.vector
        return [
            (frame_of(whole, index), (self.tcp, tuple(tool[:3])) if self.tcp and index < 3 else (tool[index],))
            for index in range(len(LETTERS))
        ]

    def unsteady(self, index: int, *, by_machine: bool = False) -> str:
        """Why nobody can say where an increment of an axis leads; empty if all is well."""
        before, now = self.counted[index], (self._footings(WORLD) if by_machine else self.footing)[index]
        if before == now:
            return ""
        if before[0] != now[0] and self.variables.value(FRAME_COUNTS) != 0.0:
            return UNSTEADY.format("the frame", FRAME_COUNTS.upper())
        if before[1] != now[1] and self.variables.value(TOOL_COUNTS) != 0.0:
            return UNSTEADY.format("the tool length", TOOL_COUNTS.upper())
        return ""

    def count_from_here(self, axes: int, *, by_machine: bool = False) -> None:
        """These axes, a bit mask, have been brought somewhere: in the frames in force, or in machine coordinates.

        An axis of the machine takes X, Y and Z of a turned frame along, and the frame was off meanwhile.
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
        """Where the axes stand; `lost`: what is not known along the axes of the program's frame, if not what is now."""
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
        """Make a motion of a block, and keep where it leads in coordinates of the program.

        code        the motion code, in tenths
        refusal, passing, arc  as in `Motion`
        placed      as there; None: the axes of its words, but for increments, and none where the motion is passed
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
        """Whether a rotary axis turns in a swivelled plane: without TRAORI the plane stays where it was."""
        target, here = end.target, self.position
        moved = (target[i] != here[i] or (i in self.unknown and i not in end.unknown) for i in self.turning)
        return self.held and any(moved)

    @property
    def held(self) -> bool:
        """Whether the plane is swivelled (CYCLE800), and the control does not lead the tip."""
        return self.modes.swivelled and not (self.modes.transformed or self.setup.tcp)

    def _heading(self, end: MotionEnd, arc: Arc | None) -> Sequence[float] | None:
        """The direction in which a motion is about to end; None where it is not known."""
        step = [b - a for a, b in zip(self.position, end.target, strict=True)]
        if any(index in self.unknown or index in end.unknown for index in GEOMETRY):
            return None
        if arc is not None:
            return self.in_frame(departing(arc, end.target, step))
        if any(step[:3]):
            return self.in_frame(step)
        return None if any(step) else self.heading

    def head_as_latest(self) -> None:
        """Keep the direction in which the last of many motions of the fast lane ended, as that of single ones."""
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
        """As for all controls; whether it is a rapid, the program has to have said."""
        return self.stated and super()._leaves_unknown(rapid)

    def counted_words(self, words: BlockWordValues) -> list[int]:
        """The axes whose words count from where they stand."""
        named = ((index, words.forms.get(letter, "")) for letter, index in INDEX.items() if letter in words.values)
        return [index for index, form in named if self.counts_on(form)]

    def counts_on(self, form: str) -> bool:
        """Whether a word in this form is an increment."""
        return form == INCREMENTAL or (not form and self.modal.incremental)

    def ends_in_hole(self, motion: Motion) -> bool:
        """As of every control; a modal cycle (MCALL) drills where motions end."""
        return super().ends_in_hole(motion) or self.modes.modal_cycle is not None

    def _style(self, kind: MotionKind, rule: Rule, reason: str, code: int, passing: Pass = Pass.NONE) -> int:
        index = super()._style(kind, rule, reason, code, passing)
        if not self.held and not self.whole:
            return index
        style = self.builder.styles[index]
        return self.builder.style(
            style._replace(rotary_as_programmed=self.held, compensated=style.compensated or self.whole)
        )

    def _passes_zero(self, words: BlockWordValues, target: Vector) -> bool:
        """Whether DC, ACP, ACN or IC leads an axis past a full turn: then pieces of the way would count otherwise."""
        turn, endless = 2 * math.pi, self.builder.endless
        steps = [] if self.modal.incremental else [index for index in self.counted_words(words) if endless >> index & 1]
        places = ((self.position[index], target[index]) for index in (*self.over, *steps))
        return any(not 0 <= place < turn for pair in places for place in pair)

    def goes_to_number(self, index: int, angle: float) -> bool:
        """Whether the shortest way to an angle, degrees, leads to the number itself, within the same turn."""
        here, step = self.position[index], self.scale[index] * angle
        counts = self.rotary[index] and not self.modal.incremental and self.offset[index] == 0.0
        return counts and 0.0 <= here < 2 * math.pi and abs(step - here) < math.radians(HALF_A_TURN)

    def wrap(self) -> None:
        """A rotary axis that went past a full turn with DC, ACP or ACN counts from 0 to 360 degrees again."""
        if self.over:
            self.position = [
                value % (2 * math.pi) if index in self.over else value for index, value in enumerate(self.position)
            ]
            self.over = ()

    # -- tools --------------------------------------------------------------------------------------------------------

    def length_of(self, number: int, edge: int) -> float:
        """The length of a tool for its cutting edge, mm; zero if it is lacking."""
        if number == 0:
            return 0.0
        name = self.named.name(number) if edge == 1 else f"{self.named.name(number)} D{edge}"
        known = self.given_length(number, edge)
        if known is None:
            self.knowledge.lack("NCF202", f"length of tool {name}", "is used", f'--tool "{name}"=LENGTH')
            return 0.0
        return known

    def ask_for_length(self) -> None:
        """A tool called by name that moves without its length offset: the machine's errors may depend on its length."""
        number = self.tools.spindle
        if self.tools.offset is None and self.named.name(number) != str(number) and self.given_length(number) is None:
            self.length_of(number, 1)

    def given_length(self, number: int, edge: int = 1) -> float | None:
        """The length of a tool, mm, if the setup gives it."""
        tool = self._given(number, edge)
        return None if tool is None else tool.length

    def tool_radius(self) -> float:
        """As of every control; of the cutting edge in force, and with the allowance of the contour (OFFN)."""
        tool = self._given(self.tools.spindle, self.edge)
        return math.nan if tool is None or tool.radius is None else tool.radius + self.allowance

    def _given(self, number: int, edge: int) -> Tool | None:
        """A tool with one of its edges, if the setup has it."""
        name = self.named.name(number)
        return self.setup.tool_called(name if edge == 1 else f"{name} D{edge}")

    def spindle_length(self) -> float:
        """As of every control, by the names of tools."""
        number = self.tools.spindle
        known = self.given_length(number)
        if known is None and f"length of tool {self.named.name(number)}" in self.knowledge.assumed:
            return 0.0  # asked for already, by its name
        return math.nan if known is None else known

    def length_under_tcp_with(self, tool: Vector, number: int | None) -> float:
        """With D0 a transformation leads the point where a tool of no length has its tip."""
        return tool[2]


def frame_of(whole: Affine, index: int) -> tuple[object, ...]:
    """What an axis counts from by frames; in a turned frame each of X Y Z counts from all three."""
    if index >= 3:
        return (whole.shift[index],)
    turned = whole.rotation != WORLD.rotation
    return (tuple(whole.shift[:3]) if turned else whole.shift[index], whole.rotation, whole.scale)


def departing(arc: Arc, end: Vector, step: Vector) -> Vector:
    """The direction in which an arc or helix that makes `step` ends, in commands; of any length."""
    nx, ny, nz = arc.normal
    x, y, z = (end[i] - arc.centre[i] for i in range(3))
    rise = nx * step[0] + ny * step[1] + nz * step[2]
    round_ = ny * z - nz * y, nz * x - nx * z, nx * y - ny * x
    return [arc.sweep * part + rise * across for part, across in zip(round_, arc.normal, strict=True)]
