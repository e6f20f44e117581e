"""The TNC while it follows a program: what a block changes and later blocks rely on."""

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
"""The name in the setup of the preset that is active when the program starts; G54 is taken for it."""

BY_DEPTH, FROM_START = 2000, 1000
"""Motion codes of holes: with depths from the datum, and with depths from where the cycle is called."""

TILTED, DOUBTFUL, TOOL, PRESET, TURNED_DATUM = "tilt", "doubt", "tool", "preset", "turned datum"
SPATIAL_MODE = "axis spat"
"""The keys under which motions are suspended."""


WHICH_WAY = (
    "the axis {} counts from a datum of its own while the tip leads (M128, PLANE): whether X and Y turn with that "
    "datum is for a parameter of the machine (presetToAlignAxis)"
)

RETRACTED = "where the axis {} stands after M140 is not followed"
MOVED_ALONG = "where the axis {} stands after PLANE ... MOVE, or TURN with MB, is not followed"
DEPARTED = "where the axis {} stands after a departure (DEP) depends on the radius of the tool"
AFTER_PROBING = "where the axis {} stands after a probing cycle is known only at run time"
FREELY = "where the axis {} stands after a free contour (FK) the control works out"
AFTER_CYCLE = "where the axis {} stands after a cycle with a path of its own is not followed"
SPATIAL_ANGLES = "FUNCTION TCPM AXIS SPAT: A B C are spatial angles, not positions of axes"
SPATIAL = "where the axis {} stands by spatial angles (AXIS SPAT) the control works out"
LED_BY_CONTROL = frozenset({SPATIAL, RETRACTED, MOVED_ALONG, DEPARTED, AFTER_PROBING, FREELY, AFTER_CYCLE})
"""Rapids while an axis stands where the control itself has led it are passed: the tool is off the workpiece, and the
next block that names the axis is corrected."""


@frozen
class HolePosition:
    """Where a hole is, and by how much its surface is above that of the cycle."""

    x: float
    y: float
    height: float = 0.0


@mutable
class PathFunctionState:
    """What the next path function may need of the ones before.

    pole     the pole, mm along the axes of its plane in the program's frame; None where not known
    pole_in  the frame in which it was set: datum along its axes, rotation, unit
    plane    the plane of the pole
    tangent  the direction in which the last path element ended, commands; None where there is none
    corner   the block before was a corner (RND, CHF)
    ahead    the block that follows is one
    doubtful  M127 stands in the block: it ends the shorter ways of M126, at the end of the block if manuals are right
    spatial  A B C are spatial angles, not positions of axes (FUNCTION TCPM AXIS SPAT)
    by_vector  the tool turns in a plane (PATHCTRL VECTOR), not its axes at even speed
    free     elements of the free contour (FK) that is being made: program and block -> what it is, None: not certain
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

    number  0: none was defined
    steps   of the old cycles, what 1.1, 1.2, ... say: address or word -> value
    modal   M89: every positioning block executes it
    places  of the last PATTERN DEF; None: there was none, or it is not followed
    """

    number: int = 0
    steps: dict[str, float] = field(default_factory=dict)
    modal: bool = False
    places: tuple[HolePosition, ...] | None = None


class KlartextControl(base.ProgramControl):
    """A TNC: its transformations, Q parameters, path functions and cycles.

    plane_tilted  PLANE or cycle 19 has tilted the plane
    turn          rotation in the working plane (cycle 10), degrees
    doubtful      why the transformations in force are not sure; empty while they are
    functions     the transformations that a TRANS function has set, and no cycle
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
        self.shortest = False
        self.auto_feed = math.nan
        self.oversize = 0.0
        self.preset_checked = False
        self.tool_called = False
        self.defined_tools: dict[int, Tool] = {}
        self.load_preset(START if START in run.setup.work_offsets else "G54")

    # -- coordinates --------------------------------------------------------------------------------------------------

    def load_preset(self, name: str) -> None:
        """Make a preset of the setup the active one; what is not given counts as zero, and is asked for when used."""
        given = self.setup.work_offsets.get(name)
        self.preset_checked = given is not None
        self.places.shift(mask_of(self.axis_indices))
        turning = {letter: self.rotary[INDEX[letter]] for letter in given or {}}
        datum = shifted({INDEX[a]: value * (DEGREE if turning[a] else 1.0) for a, value in (given or {}).items()})
        self.frames = replace(self.frames, name=name, datum=datum)
        self.recompose()

    def recompose(self) -> None:
        """Take frames into force, and what is doubtful of them; to be called after any of them has changed."""
        self.doubt_turned_datum()
        if self.doubtful:
            self.suspend(DOUBTFUL, self.doubtful)
        else:
            self.resume(DOUBTFUL)
        self.refresh()

    def switch_tip(self) -> None:
        """Whether X Y Z are tool-tip coordinates may have changed."""
        on = self.m128 or self.plane_tilted
        self.doubt_turned_datum()
        if on != self.tcp:
            self.ask_for_tool()
            why = next(iter(self.unknown.values())) if self.is_led(self.unknown) else TURNED
            switch(self, self.tools.vector, on, self.tools.offset)
            self.unknown = {i: why if reason is TURNED else reason for i, reason in self.unknown.items()}
        self.refresh()

    def doubt_turned_datum(self) -> None:
        """Rotary axes with a datum of their own: it may turn the coordinates in which the tip is led."""
        self.resume(TURNED_DATUM)
        datum = [a + b for a, b in zip(self.frames.datum.shift, self.frames.programmable.shift, strict=True)]
        turned = next((i for i in self.turning if datum[i]), None)
        if turned is not None and (self.m128 or self.plane_tilted):
            self.suspend(TURNED_DATUM, WHICH_WAY.format(LETTERS[turned]))

    def anchors(self) -> list[Hashable]:
        """As of every control; shift, rotation, mirror and scale are stated by the program in numbers."""
        frames, tool = self.frames, self.tool_shift
        stated = self.tcp, frames.plane.rotation if self.plane_tilted else None
        length = [self.tools.offset if self.tcp or index == Z else None for index in (X, Y, Z)]
        return [
            (frames.name, datum, tool[i], (*stated, length[i]) if i in (X, Y, Z) else None)
            for i, datum in enumerate(frames.datum.shift)
        ]

    def use(self) -> None:
        """A motion in workpiece coordinates: preset and tool length matter."""
        if not self.preset_checked:
            self.preset_checked = True
            preset = self.frames.name
            name = "the active preset" if preset in (START, "G54") else f"preset {preset[6:]}"
            option = START if preset in (START, "G54") else preset
            self.knowledge.lack(WORK_OFFSET, name, "is used", f"--offset {option}=x,y,z")
        self.ask_for_tool()

    def ask_for_tool(self) -> None:
        """Before the first TOOL CALL it matters which tool is in the spindle."""
        if not self.tool_called:
            self.tool_called = True
            self.tools.vector[Z] = self.knowledge.tool_length(0)
            self.refresh()

    # -- motions ------------------------------------------------------------------------------------------------------

    def make(self, motion: Motion) -> None:
        """As of every control.

        What must not be split: elements at a corner that the control makes (RND, CHF), turns of the tool in a plane
        (PATHCTRL VECTOR), which in pieces would be turns of axes, motions whose time is given (FT), and increments of
        an axis whose datum is not known, which further pieces would have to name.
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
        """As of every control; a cycle with depths from the datum says where the tool axis stands, too."""
        if motion.placed is not None:
            return motion.placed
        own = motion.axes | (1 << Z if motion.code == BY_DEPTH else 0)
        machine = motion.passing is not None and motion.passing.rule is Pass.MACHINE_COORDINATES
        return 0 if self.modal.incremental or machine else own

    def is_led(self, unknown: UnknownAxes) -> bool:
        """What is not known is so because the control itself has led the axes somewhere."""
        return bool(unknown) and LED_BY_CONTROL.issuperset(unknown.values())

    def path_word(self, words: Collection[str]) -> str:
        """Words of axes, polar coordinates and directions, and path functions that need none."""
        names = (word for word in words if word in ALWAYS_MOVING or word.startswith(LEADING))
        return min(MOVING.intersection(words), default="") or next(names, "").upper()

    def refuse_here(self, reason: str) -> None:
        """As of every control."""
        super().refuse_here(reason)
        self.path.tangent = None

    def pass_here(self, passing: Passing, lost: str, letters: str) -> None:
        """A motion of the control's own; these axes are not known afterwards."""
        unknown = dict(self.unknown)
        unknown |= {INDEX[letter]: lost for letter in letters if INDEX[letter] in self.axis_indices}
        super().make(Motion(MotionKind.RAPID, 0, MotionEnd(self.position[:], unknown), 0, passing=passing))
        self.path.tangent = None
