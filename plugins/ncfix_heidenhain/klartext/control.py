"""The state of a TNC control while a program is followed: what blocks change, and later blocks depend on."""

from __future__ import annotations

import math
from collections.abc import Collection, Hashable
from dataclasses import field, replace

from ncfix.control import control as base
from ncfix.control.coordinates import DEGREE, INDEX, LETTERS, PLANES, Plane, X, Y, Z, mask_of
from ncfix.control.frames import shifted
from ncfix.control.moves import AT_START, Motion, MotionEnd, MotionKind, Pass, Passing, UnknownAxes, first_reason
from ncfix.control.setup import WORK_OFFSET, Run, Tool
from ncfix.control.tcp import TURNED, switch
from ncfix.text.dialect import Dialect
from ncfix.values import frozen, mutable
from ncfix_heidenhain.klartext.free import ContourElement
from ncfix_heidenhain.klartext.plans import ALWAYS_MOVING, LEADING, MOVING, FormulaScope, QParameters

START = "PRESET"
"""The setup's name for the preset that is active when the program starts; without it the setup's G54 is used."""

BY_DEPTH, FROM_START = 2000, 1000
"""Motion codes of holes: with depth from the datum, and with depth from where the cycle is called."""

TILTED, DOUBTFUL, TOOL, PRESET, TURNED_DATUM = "tilt", "doubt", "tool", "preset", "turned datum"
SPATIAL_MODE = "axis spat"
"""The keys under which corrections are suspended."""

WHICH_WAY = (
    "the axis {} has a datum of its own under M128 or PLANE: a machine parameter (presetToAlignAxis) decides whether "
    "X and Y turn with that datum"
)

RETRACTED = "the position of the axis {} after M140 is not known"
MOVED_ALONG = "the position of the axis {} after PLANE ... MOVE, or TURN with MB, is not known"
DEPARTED = "the position of the axis {} after a departure (DEP) depends on the radius of the tool"
AFTER_PROBING = "the position of the axis {} after a probing cycle is known only at run time"
FREELY = "the control calculates the position of the axis {} after a free contour (FK)"
AFTER_CYCLE = "the position of the axis {} after a cycle with a path of its own is not known"
SPATIAL_ANGLES = "FUNCTION TCPM AXIS SPAT: A B C are spatial angles, not positions of axes"
SPATIAL = "the control calculates the position of the axis {} from spatial angles (AXIS SPAT)"
LED_BY_CONTROL = frozenset({SPATIAL, RETRACTED, MOVED_ALONG, DEPARTED, AFTER_PROBING, FREELY, AFTER_CYCLE})
"""Reasons why an axis is not known that mean: the control itself has moved it.

Rapids from there are passed, since the tool is off the workpiece; the next block that names the axis is corrected.
"""


@frozen
class HolePosition:
    """The place of a hole, program units; `height`: how far its surface is above that of the cycle."""

    x: float
    y: float
    height: float = 0.0


@mutable
class PathFunctionState:
    """What path functions and blocks before leave to the next path function.

    pole       pole, mm along the axes of its plane in the program's frame; None if it is not known
    pole_in    the frame in which the pole was set: datum along its axes, rotation, unit
    plane      the plane of the pole
    tangent    the direction in which the last path element ended, in commands; None if there is none
    corner     the block before is a corner (RND, CHF)
    ahead      the next block is a corner
    doubtful   the block has M127 while M126 is in force; whether M127 acts at its end is not certain
    by_vector  the tool turns in a plane (PATHCTRL VECTOR); else its axes turn evenly
    spatial    A B C are spatial angles, not positions of axes (FUNCTION TCPM AXIS SPAT)
    free       (program, block) -> element of the free contour (FK) that is being made; None if it is not certain
    """

    pole: tuple[float, float] | None = None
    pole_in: object = None
    plane: Plane = PLANES[170]
    tangent: tuple[float, float, float] | None = None
    corner: bool = False
    ahead: bool = False
    doubtful: bool = False
    by_vector: bool = False
    spatial: bool = False
    free: dict[tuple[str, int], ContourElement | None] = field(default_factory=dict)


@mutable
class CycleInForce:
    """The cycle that CYCL CALL, M99 and M89 execute.

    number  number of the cycle; 0 if none was defined
    steps   `part:address` -> value, for the words of the parts (1.1, 1.2, ...) of an old cycle
    modal   M89 is in force: every positioning block executes the cycle
    places  the holes of the last PATTERN DEF; None if there was none, or it is not followed
    """

    number: int = 0
    steps: dict[str, float] = field(default_factory=dict)
    modal: bool = False
    places: tuple[HolePosition, ...] | None = None


class KlartextControl(base.ProgramControl):
    """A TNC control: its transformations, Q parameters, path functions and cycles.

    plane_tilted    PLANE or cycle 19 has tilted the plane
    turn            rotation in the working plane (cycle 10), degrees
    doubtful        why the transformations in force are not certain; empty if they are
    functions       the transformations that were set by a TRANS function, not by a cycle
    m128            tool-centre-point control is on (M128, FUNCTION TCPM)
    shortest        rotary axes take the shorter way (M126)
    per_revolution  F is per revolution (M136)
    auto_feed       feed of the last TOOL CALL, mm/min
    oversize        DL of the last TOOL CALL, mm
    preset_checked  the active preset is given in the setup, or a lack of it has been reported
    tool_called     a TOOL CALL was executed, or the length of the first tool has been asked for
    defined_tools   tool number -> what TOOL DEF says of it
    """

    frame_order = ("datum", "programmable", "plane", "local", "rotation", "mirror", "scaling")

    def __init__(self, run: Run, dialect: Dialect) -> None:
        super().__init__(run, dialect)
        self.plane_tilted = False
        self.turn = 0.0
        self.doubtful = ""
        self.functions: frozenset[str] = frozenset()
        self.scope = FormulaScope(
            parameters=QParameters(
                {name.upper(): value for name, value in run.setup.variables.items() if name[:1] in "Qq"}
            )
        )
        self.path = PathFunctionState()
        self.cycle = CycleInForce()
        self.m128 = run.setup.tcp
        self.shortest = self.per_revolution = False
        self.auto_feed = math.nan
        self.oversize = 0.0
        self.preset_checked = False
        self.tool_called = False
        self.defined_tools: dict[int, Tool] = {}
        self.load_preset(START if START in run.setup.work_offsets else "G54")

    # -- coordinates --------------------------------------------------------------------------------------------------

    def load_preset(self, name: str) -> None:
        """Activate a preset of the setup; one that the setup lacks counts as zero, and `use` asks for it."""
        given = self.setup.work_offsets.get(name)
        self.preset_checked = given is not None
        self.places.shift(mask_of(self.axis_indices))
        turning = {letter: self.rotary[INDEX[letter]] for letter in given or {}}
        datum = shifted({INDEX[a]: value * (DEGREE if turning[a] else 1.0) for a, value in (given or {}).items()})
        self.frames = replace(self.frames, name=name, datum=datum)
        self.recompose()

    def recompose(self) -> None:
        """Put the frames, and doubts about them, into force; to be called after any of them has changed."""
        self.doubt_turned_datum()
        if self.doubtful:
            self.suspend(DOUBTFUL, self.doubtful)
        else:
            self.resume(DOUBTFUL)
        self.refresh()

    def switch_tip(self) -> None:
        """Put tip control on or off, as M128 and tilted planes now ask; to be called after either has changed."""
        on = self.m128 or self.plane_tilted
        self.doubt_turned_datum()
        if on != self.tcp:
            self.ask_for_tool()
            why = next(iter(self.unknown.values())) if self.is_led(self.unknown) else TURNED
            switch(self, self.tools.vector, on, self.tools.offset)
            self.unknown = {i: why if reason is TURNED else reason for i, reason in self.unknown.items()}
        self.refresh()

    def doubt_turned_datum(self) -> None:
        """Suspend corrections under tip control if a rotary axis has a datum, which may turn the coordinates."""
        self.resume(TURNED_DATUM)
        datum = [a + b for a, b in zip(self.frames.datum.shift, self.frames.programmable.shift, strict=True)]
        turned = next((i for i in self.turning if datum[i]), None)
        if turned is not None and (self.m128 or self.plane_tilted):
            self.suspend(TURNED_DATUM, WHICH_WAY.format(LETTERS[turned]))

    def anchors(self) -> list[Hashable]:
        """See `ProgramControl`; shift, rotation, mirror and scale are no part: the program states them in numbers."""
        frames, tool = self.frames, self.tool_shift
        stated = self.tcp, frames.plane.rotation if self.plane_tilted else None
        length = [self.tools.offset if self.tcp or index == Z else None for index in (X, Y, Z)]
        return [
            (frames.name, datum, tool[i], (*stated, length[i]) if i in (X, Y, Z) else None)
            for i, datum in enumerate(frames.datum.shift)
        ]

    def use(self) -> None:
        """Note a motion in workpiece coordinates, for which preset and tool length have to be known."""
        if not self.preset_checked:
            self.preset_checked = True
            preset = self.frames.name
            name = "the active preset" if preset in (START, "G54") else f"preset {preset[6:]}"
            option = START if preset in (START, "G54") else preset
            self.knowledge.lack(WORK_OFFSET, name, "is used", f"--offset {option}=x,y,z")
        self.ask_for_tool()

    def ask_for_tool(self) -> None:
        """Before the first TOOL CALL, ask for the length of the tool in the spindle."""
        if not self.tool_called:
            self.tool_called = True
            self.tools.vector[Z] = self.knowledge.tool_length(0)
            self.refresh()

    # -- motions ------------------------------------------------------------------------------------------------------

    def make(self, motion: Motion) -> None:
        """See `ProgramControl`; some motions are marked that must not be split.

        They are: elements beside a corner that the control makes (RND, CHF); turns of the tool in a plane (PATHCTRL
        VECTOR) or in a block with M127; motions whose time is given (FT); and motions of axes whose datum is not known.
        """
        if motion.kind == MotionKind.RAPID and not motion.refusal and AT_START in motion.end.unknown.values():
            motion = motion._replace(passing=motion.passing or Passing(Pass.UNSAID, first_reason(motion.end.unknown)))
        whole = self.whole
        self.tilted = self.plane_tilted and not self.m128
        turns = any(motion.axes >> index & 1 for index in self.turning)
        if self.path.corner or self.path.ahead or {"FT", "T"}.intersection(self.block_words):
            self.whole = True
        if turns and (self.path.by_vector or self.path.doubtful):
            self.whole = True
        if motion.axes & mask_of(self.composed.unknown):
            self.whole = True
        super().make(motion)
        if self.is_rotated:
            self.places.place(self.placed_by(motion))
        self.whole = whole

    def placed_by(self, motion: Motion) -> int:
        """See `ProgramControl`; a cycle with depth from the datum states the position of the tool axis, too."""
        if motion.placed is not None:
            return motion.placed
        own = motion.axes | (1 << Z if motion.code == BY_DEPTH else 0)
        machine = motion.passing is not None and motion.passing.rule is Pass.MACHINE_COORDINATES
        return 0 if self.modal.incremental or machine else own

    def is_led(self, unknown: UnknownAxes) -> bool:
        """Whether all that is not known is so because the control itself has moved the axes (`LED_BY_CONTROL`)."""
        return bool(unknown) and LED_BY_CONTROL.issuperset(unknown.values())

    def path_word(self, words: Collection[str]) -> str:
        """One of the words that make a block move: of axes, polar coordinates, directions, or path functions.

        Empty if the block does not move.
        """
        names = (word for word in words if word in ALWAYS_MOVING or word.startswith(LEADING))
        return min(MOVING.intersection(words), default="") or next(names, "").upper()

    def refuse_here(self, reason: str) -> None:
        """See `ProgramControl`; the direction of the path is not known after it."""
        super().refuse_here(reason)
        self.path.tangent = None

    def pass_here(self, passing: Passing, lost: str, letters: str) -> None:
        """Note a motion that the control makes by itself; `letters`: axes that are not known after it, for `lost`."""
        unknown = dict(self.unknown)
        unknown |= {INDEX[letter]: lost for letter in letters if INDEX[letter] in self.axis_indices}
        super().make(Motion(MotionKind.RAPID, 0, MotionEnd(self.position[:], unknown), 0, passing=passing))
        self.path.tangent = None
