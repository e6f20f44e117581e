"""Statements, which are told apart by their first words; M codes; TOOL CALL and TOOL DEF; and the program flow.

Labels, calls, repeats and jumps become operations of the program flow. Statements that are not listed here move
nothing.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from ncfix.control.coordinates import LETTERS, TURN, Z, mask_of, zeros
from ncfix.control.expressions import Fault, Unknown
from ncfix.control.flow import NO_SUBPROGRAM, Call, Jump, OpenCall, Operation, ProgramFlow, Repeat, Return
from ncfix.control.moves import Pass, Passing
from ncfix.control.setup import Tool
from ncfix.control.tcp import switch
from ncfix.text.tree import Constant
from ncfix_heidenhain.klartext.arcs import Step
from ncfix_heidenhain.klartext.contours import follow_free
from ncfix_heidenhain.klartext.control import (
    AFTER_PROBING,
    PRESET,
    RETRACTED,
    SPATIAL_ANGLES,
    SPATIAL_MODE,
    TOOL,
    KlartextControl,
)
from ncfix_heidenhain.klartext.cycles import pattern_of
from ncfix_heidenhain.klartext.plans import KlartextPlan
from ncfix_heidenhain.klartext.targets import MotionWords
from ncfix_heidenhain.klartext.transformations import is_plain, trans
from ncfix_heidenhain.klartext.units import KlartextUnit, unit_of_feed

NO_LABEL = "NCF276"
PROGRAM = "program"
"""The kind of an open call of another program."""


class KlartextFlow(ProgramFlow[KlartextUnit]):
    """Where the control is in the program.

    find      returns the program of a name, None if it is not found
    selected  the program that CALL SELECTED PGM calls; empty if that is known only at run time
    """

    most_calls = 64
    too_deep = f"more than {most_calls} calls are open"

    def __init__(
        self, control: KlartextControl, main: KlartextUnit, find: Callable[[str], KlartextUnit | None]
    ) -> None:
        super().__init__(main, control.budget)
        self.parameters = control.scope.parameters
        self.find = find
        self.selected = ""

    def operations(self, plan: KlartextPlan, holds: Callable[[], bool]) -> tuple[Operation, ...]:
        """The operations of a block with a label, a call or a condition; `holds` tells whether the condition is met."""
        assert plan.flow is not None
        label, unit = str(plan.flow.label), self.unit

        def place() -> int:
            if label not in unit.labels:
                raise Fault(NO_LABEL, f"there is no LBL {label}")
            return unit.labels[label]

        match plan.flow.keyword, plan.flow.arguments:
            case "label", _ if label == "0":
                return (Return(lambda: bool(self.calls) and self.calls[-1].kind != PROGRAM),)
            case "call", (Constant(times),):
                return (Repeat(place, lambda: int(times)),)
            case "call", _:
                return (Call(lambda: OpenCall(label, (unit, place()))),)
            case "if", _:
                return (Jump(place, holds),)
        return ()

    def call_program(self, name: str) -> None:
        """CALL PGM: enter another program, which has QL parameters of its own."""
        found = self.find(name)
        if found is None:
            hint = "copy its file to the folder of the program, or give its folder with --subprograms DIR"
            raise Fault(NO_SUBPROGRAM, f"the program {name} is not found", hint)
        if found.mm != self.unit.mm:
            raise Fault(NO_SUBPROGRAM, f"the program {name} has another unit of length")
        self.check_depth(name)
        local = self.parameters.enter()
        self.enter(OpenCall(name, (found, found.begin), kind=PROGRAM, leave=lambda: self.parameters.leave(local)))


SUSPENDING = {
    104: "M104: the datum that was set last comes into force again",
    114: "M114: the control adds the geometry of the machine to positions",
    144: "M144: the control adds the geometry of the machine to positions",
}
ENDING = {115: 114, 145: 144}
DELETED = "M142: the control deletes some of the transformations in force"
CHOSEN = "M138: the control includes only some of the rotary axes"
UNTILTED = "M130: coordinates of the untilted system in a tilted plane"
RETRACT = Passing(Pass.RETRACTION, "retract along the tool axis (M140)")
COUNTED = "the position of the axis {} after M126 depends on a machine parameter: it was moved beyond a full turn"
BESIDE_RETRACTION = (
    "M140 retracts the tool at the start of its block: the end position of the axis words in that block is not certain"
)
NAMED_AXES = frozenset({"axis a", "axis b", "axis c"})
"""Names of axes after M94 and M138."""

COMPENSATION = {"r0": 0, "rl": 41, "rr": 42, "r+": 41, "r-": 42}


def before_motion(control: KlartextControl, step: Step) -> None:
    """Execute what acts at the start of a block: radius compensation and some M codes."""
    for flag, side in COMPENSATION.items():
        if flag in step.flags:
            if not side:
                control.end_compensation()
            control.modal.compensated = side
    for code in step.codes:
        if code in SUSPENDING:
            control.suspend(f"M{code}", SUSPENDING[code])
    control.resume("M130")
    if 130 in step.codes and control.plane_tilted:
        control.suspend("M130", UNTILTED)
    if 126 in step.codes:
        control.shortest = True
    if 136 in step.codes:
        control.per_revolution, control.modal.feed_mode = True, 95
    if 128 in step.codes:
        tip_control(control, on=True)
    if 142 in step.codes and not is_untransformed(control):
        control.suspend("M142", DELETED)
    if 94 in step.codes:
        for index in control.turning:
            if f"axis {LETTERS[index].lower()}" in step.flags or not step.flags & NAMED_AXES:
                control.position[index] %= TURN
    if 138 in step.codes:
        choose_axes(control, step.flags)
    if 140 in step.codes and control.path_word(step.words.values):
        control.suspend("M140", BESIDE_RETRACTION)


def end_of_short_ways(control: KlartextControl) -> None:
    """M127 after M126: the position of an axis that went past a turn is not known any more.

    The control may keep counting past a turn, or reduce the angle to below one. The axis that tilts the tool cannot go
    round, so M126 means nothing to it: it may stand below zero.
    """
    pointing = control.posture.pointing if control.shortest else None
    tilts = None if pointing is None else control.axis_indices[pointing.columns[1]]
    for index in control.turning if control.shortest else ():
        below = control.position[index] < 0 and index != tilts
        if index not in control.unknown and (below or control.position[index] >= TURN):
            control.lose([index], COUNTED)
    control.shortest = False


def choose_axes(control: KlartextControl, flags: frozenset[str]) -> None:
    """M138: corrections are suspended if the control takes only some rotary axes into account, and resume with all."""
    control.resume("M138")
    turning = {f"axis {LETTERS[index].lower()}" for index in control.turning}
    if flags & NAMED_AXES not in (set(), turning):
        control.suspend("M138", CHOSEN)


def tip_control(control: KlartextControl, *, on: bool) -> None:
    """Turn tool-centre-point control on or off (M128, M129, FUNCTION TCPM)."""
    control.m128 = on
    control.switch_tip()


def after_motion(control: KlartextControl, code: int, own: MotionWords, flags: frozenset[str]) -> None:
    """Execute an M code that acts at the end of a block; `own`: the words that belong to it."""
    if code == 129:
        tip_control(control, on=False)
        control.path.by_vector = control.path.spatial = False
    elif code == 127:
        end_of_short_ways(control)
    elif code == 137:
        control.per_revolution, control.modal.feed_mode = False, 94
    elif code in ENDING:
        control.resume(f"M{ENDING[code]}")
    elif code == 140:
        control.resume("M140")
        control.pass_here(RETRACT, RETRACTED, "XYZ" if control.tcp else "Z")


NAMED = -1
"""The number of a tool that is called by name."""

OTHER_AXIS = "the tool axis is {}: ncfix supports tools along Z only"
OVERSIZE = "whether the oversize (DL) stays in force after a TOOL CALL without a tool is not certain"
AT_RUN_TIME = "the length of the tool is known only at run time"


def define_tool(
    control: KlartextControl, tool: str | float | Unknown | None, words: MotionWords, flags: frozenset[str]
) -> None:
    """TOOL DEF: note length and radius of a tool. A tool number known only at run time makes all of them unknown."""
    if isinstance(tool, Unknown) and "L" in words.values:
        control.defined_tools = dict.fromkeys(control.defined_tools, Tool())
    if isinstance(tool, float) and "L" in words.values:
        radius = None if "R" in words.unknown else words.values.get("R")
        length = None if "L" in words.unknown else words.values["L"] * control.modal.unit
        control.defined_tools[int(tool)] = Tool(length, None if radius is None else radius * control.modal.unit)


def call_tool(
    control: KlartextControl, tool: str | float | Unknown | None, words: MotionWords, flags: frozenset[str]
) -> None:
    """TOOL CALL: change the tool. Without a tool only speed, feed or oversizes change.

    A tool number that is known only at run time counts as a name.
    """
    if isinstance(tool, Unknown):
        tool = tool.why
    if "F" in words.values:
        control.auto_feed = words.values["F"] * unit_of_feed(control.modal.unit)
    if tool is None and "DR" in words.values:
        control.tools.cutter = math.nan
    if tool is None and "DL" not in words.values:
        if control.oversize:
            control.suspend(TOOL, OVERSIZE)
        return
    control.resume(TOOL)
    if isinstance(tool, float) and not tool.is_integer():
        tool = f"{tool:g}"
    axis = next((letter for letter in "xyuvw" if letter in flags), None)
    if axis is not None:
        control.suspend(TOOL, OTHER_AXIS.format(axis.upper()))
    if "DL" in words.unknown:
        control.suspend(TOOL, AT_RUN_TIME)
    if isinstance(tool, str):
        control.tools.spindle = NAMED
    if isinstance(tool, float):
        control.tools.select(int(tool))
        control.tools.change()
    if tool is not None:
        control.places.lose(mask_of(control.axis_indices))
    control.tool_called = True
    control.tools.offset = control.tools.spindle
    tell_radius(control, words.values.get("DR", 0.0))
    named = control.setup.tool_called(tool) if isinstance(tool, str) else None
    if named is not None and named.radius is not None:
        control.tools.cutter = named.radius + words.values.get("DR", 0.0) * control.modal.unit
    length = length_by_name(control, tool) if isinstance(tool, str) else length_of(control, int(control.tools.spindle))
    control.oversize = words.values.get("DL", 0.0) * control.modal.unit
    set_length(control, length + control.oversize)


def tell_radius(control: KlartextControl, oversize: float) -> None:
    """Note the radius of the active tool, by which contours are offset, and set Q108 to it in program units.

    oversize  DR, program units
    """
    number = int(control.tools.spindle)
    defined = control.defined_tools.get(number, Tool())
    radius = control.knowledge.known_tool_radius(number)
    radius = defined.radius if radius is None else radius
    control.tools.cutter = math.nan if radius is None else radius + oversize * control.modal.unit
    told = (radius or 0.0) / control.modal.unit + oversize
    control.scope.parameters.assign("Q108", Unknown("", told) if radius is None else told)


def set_length(control: KlartextControl, length: float) -> None:
    """Change the length of the active tool, mm: the machine stands still, so the tip moves."""
    tool = zeros()
    tool[Z] = length
    if control.tcp:
        switch(control, tool, True, control.tools.offset)
    control.tools.vector = tool
    control.refresh()


def length_by_name(control: KlartextControl, name: str) -> float:
    """The length of a tool that is called by name, mm; zero if the setup does not give it."""
    named = control.setup.tool_called(name)
    if named is not None and named.length is not None:
        return named.length
    control.knowledge.lack("NCF202", f"length of tool {name}", "is used", f'--tool "{name}"=LENGTH')
    return 0.0


def length_of(control: KlartextControl, number: int) -> float:
    """The length of a tool, mm: that of the setup, else that of TOOL DEF; zero for tool 0."""
    known = control.knowledge.known_tool_length(number)
    if known is not None:
        return known
    defined = control.defined_tools.get(number)
    if defined is not None and defined.length is not None:
        return defined.length
    return 0.0 if number == 0 else control.knowledge.tool_length(number)


PROBING = Passing(Pass.PROBING, "probing")
MEASURED = (
    "TCH PROBE {} sets the datum, a rotation or the kinematics from its measurement, which is known only at run time"
)
SETTING = frozenset({*range(400, 406), *range(408, 420), *range(450, 454), *range(1400, 1500)})
"""Probing cycles that not only measure but set a datum, a rotation or the kinematics.

Cycles from 500 on come from machine builders and makers of probes.
"""

OF_THE_TOOL = frozenset({31, 33, 481, 483, *range(580, 590)})
"""Probing cycles that measure the length of the tool in the spindle."""

TOOL_MEASURED = "NCF281"
LENGTH_MEASURED = "TCH PROBE {} measures the tool; ncfix assumes that the control finds the length of the setup"

OTHER_POINT = "FUNCTION TCPM with a reference point other than the tool tip"
SELECTED = "PRESET SELECT with a parameter, with other words, or while coordinates are transformed, is not supported"
ERROR = "NCF278"
PROBED = range(100, 200)
"""The Q parameters in which probing cycles and the control store results."""

IN_A_ROW = 4
"""The number of parameters, from the one that it names, that an old probing cycle (0 to 4) may write."""

TARGET = re.compile(r"(Q[LRS]?)(\d+)", re.IGNORECASE)
CIRCLE = re.compile(r"FN\s*2[34]\b", re.IGNORECASE)


def statement(control: KlartextControl, flow: KlartextFlow, text: str) -> None:
    """Execute a statement; one that is not listed in `STATEMENTS` moves nothing."""
    for form, do in STATEMENTS:
        if found := form.match(text):
            do(control, flow, found)
            return


# -- other programs ---------------------------------------------------------------------------------------------------


def select_program(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """SEL PGM: note the program for CALL SELECTED PGM; a name in a parameter is known only at run time."""
    name = match["name"].strip()
    flow.selected = "" if TARGET.fullmatch(name) else name


def call_selected(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """CALL SELECTED PGM: call the program that SEL PGM chose."""
    if flow.selected:
        flow.call_program(flow.selected)
    else:
        control.refuse_rest("which program is called is known only at run time")


def error(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """FN 14: the program stops with an error of its own."""
    raise Fault(
        ERROR,
        f"the program stops with error {match['number']}",
        "the program checks its parameters and does not accept them",
    )


# -- what is not followed ---------------------------------------------------------------------------------------------


def not_followed(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """Refuse the rest of the program: the statement may change coordinates, or what later blocks do."""
    name = " ".join(match[0].partition(":")[0].split()[:3]).upper()
    control.refuse_rest(f"{name} may change coordinates in a way that ncfix does not support")


# -- what is measured and read ----------------------------------------------------------------------------------------


def probe(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """TCH PROBE: the control moves by itself, stores results in Q parameters, and may set a datum by them."""
    number = int(match["number"])
    if number in OF_THE_TOOL:
        control.warn(TOOL_MEASURED, LENGTH_MEASURED.format(number), "give the length of the tool when it cuts")
    elif number in SETTING or 500 <= number < 1400:
        control.suspend(PRESET, MEASURED.format(number))
    control.pass_here(PROBING, AFTER_PROBING, "XYZ")
    for each in PROBED:
        control.scope.parameters.assign(f"Q{each}", Unknown())
    lose_parameters(control, match[0], IN_A_ROW if number < PROBED[0] else 1)


def read_values(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """FN functions that read: FN 18, 28 and the like write one Q parameter, FN 23 and 24 three in a row."""
    lose_parameters(control, match[0].partition("=")[0], 3 if CIRCLE.match(match[0]) else 1)


def lose_parameters(control: KlartextControl, text: str, in_a_row: int) -> None:
    """Make Q parameters unknown: those that a text names, and from each on `in_a_row` of them."""
    for letters, number in TARGET.findall(text):
        for offset in range(in_a_row):
            control.scope.parameters.assign(f"{letters.upper()}{int(number) + offset}", Unknown())


# -- coordinates ------------------------------------------------------------------------------------------------------


def holes(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """PATTERN DEF: note the places of the holes. Those of SEL PATTERN are in a table that is not read."""
    control.cycle.places = pattern_of(match[0], control.scope.parameters)


def is_untransformed(control: KlartextControl) -> bool:
    """Whether neither a transformation nor a tilted plane is in force."""
    return is_plain(control) and not (control.plane_tilted or any(control.frames.programmable.shift))


def select_preset(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """PRESET SELECT: activate a row of the preset table.

    It ends transformations unless its words keep some. So it is followed only without such words, without active
    transformations, and with a plain number for the row (not `#Q1`).
    """
    control.resume(PRESET)
    if match["row"] is None or match["rest"].strip() or control.doubtful or not is_untransformed(control):
        control.suspend(PRESET, SELECTED)
        return
    control.load_preset(f"PRESET{int(match['row'])}")


def tcpm(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """Execute FUNCTION TCPM and FUNCTION RESET TCPM."""
    control.resume("tcpm")
    control.resume(SPATIAL_MODE)
    words = "" if match["reset"] else " ".join(match["rest"].upper().split())
    control.path.by_vector, control.path.spatial = "PATHCTRL VECTOR" in words, "AXIS SPAT" in words
    if control.path.spatial:
        control.suspend(SPATIAL_MODE, SPATIAL_ANGLES)
    if "REFPNT" in words and "TIP-TIP" not in words:
        control.suspend("tcpm", OTHER_POINT)
    tip_control(control, on=not match["reset"])


Do = Callable[[KlartextControl, KlartextFlow, re.Match[str]], None]

FORMS: tuple[tuple[str, Do], ...] = (
    (r"CALL\s+PGM\s*(?P<name>.*)", lambda control, flow, match: flow.call_program(match["name"].strip())),
    (r"SEL\s+PGM\s*(?P<name>.*)", select_program),
    (r"CALL\s+SELECTED\b", call_selected),
    (r"FN\s*14\s*:\s*ERROR\s*=?\s*(?P<number>\w*)", error),
    (r"F(LT|L|CT|C)\b", lambda control, flow, _: follow_free(control, flow.unit, flow.block - 1)),
    (r"TCH\s*PROBE\s*(?P<number>\d+).*", probe),
    (r"FN\s*(18|2[0348])\b.*", read_values),
    (r"(PATTERN\s+DEF|SEL\s+PATTERN).*", holes),
    (r"TRANS\b.*", lambda control, _, match: trans(control, match[0])),
    (r"PRESET\s+SELECT\b(\s*#\s*(?P<row>\d+)\b)?(?P<rest>.*)", select_preset),
    (r"FUNCTION\s+(?P<reset>RESET\s+)?TCPM\b(?P<rest>.*)", tcpm),
    # FUNCTION statements that leave coordinates as they are; others (turning, parallel axes, corrections, another
    # kinematic model by MODE MILL) may not.
    (
        r"FUNCTION\s+(RESET\s+)?(AFC|CORRDATA\s+RESET|DWELL|FEED|S-PULSE|DCM|LIFTOFF|COUNT|MODE\s+MILL\s*\Z|DRESS\s+END|FLUTES|FILE)",
        lambda control, flow, found: None,
    ),
    # FN 17 and 25 write into the control's own data: datums, presets, tools.
    (r"(FUNCTION|FN\s*(17|25)\b|SEL\s+CYCLE|POLARKIN|TCH\s*PROBE).*", not_followed),
)
STATEMENTS = tuple((re.compile(form, re.IGNORECASE | re.DOTALL), do) for form, do in FORMS)
"""Pattern of a statement, and what executes it; the first that matches counts."""
