"""Execution of the codes and names of a block, in order: settings, frames, tools, motion; and calls of subprograms.

Subprograms are called by name, by number or by a text. Unknown names are taken as cycles of the machine's builder.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from dataclasses import field

from ncfix.control.coordinates import INDEX
from ncfix.control.expressions import Evaluate, Fault, Unknown, nominal, number
from ncfix.control.frames import WORLD
from ncfix.text.tree import Expression, FunctionCall, NamedParameter, NumberedParameter
from ncfix.values import mutable
from ncfix_siemens.sinumerik import framing, motion
from ncfix_siemens.sinumerik.cycles.contour import contour_call
from ncfix_siemens.sinumerik.cycles.drilling import AFTER_CYCLE, cycle
from ncfix_siemens.sinumerik.cycles.milling import MILLING
from ncfix_siemens.sinumerik.destination import set_pole
from ncfix_siemens.sinumerik.expressions import compiled
from ncfix_siemens.sinumerik.framing import into_spindle, set_length
from ncfix_siemens.sinumerik.orientation import swivel
from ncfix_siemens.sinumerik.plans import LISTS, AssignedVariable, Calling, SinumerikPlan, evaluates, plain_text
from ncfix_siemens.sinumerik.state import DIAMETERS, GEOMETRY, Sinumerik
from ncfix_siemens.sinumerik.unit import SinumerikUnit
from ncfix_siemens.sinumerik.vocabulary import (
    COUPLED,
    DRILLING,
    ENDED_BY,
    HARMLESS,
    MADE_BY_THE_CONTROL,
    MOTIONS,
    PATH_WORDS,
    POLAR,
    POLES,
    PUNCHING,
    RESULTS,
    STROKES,
    TURNS_OF_THE_TOOL,
    UNFOLLOWED,
    UNFOLLOWED_MOTIONS,
    BlockWordValues,
)

Find = Callable[[str], SinumerikUnit | None]

UNKNOWN_CYCLE = "NCF252"
WHERE_IT_IS = "if it is a subprogram, give the folder of its file with --subprograms DIR"
TRANSFORMING = ("traori", "transmit", "tracyl", "traang", "tracon", "trafoo")
"""Prefixes of names of transformations by kinematic chains, such as `TRANSMIT_K`."""

SECTION = "ncfix does not support the call of a program section (CALL BLOCK)"
CALLED_BY_TEXT = frozenset({"call", "extcall"})
FILE = re.compile(r"(?:^|[/:])(?:_N_)?(?P<name>\w+?)(?:_(?:SPF|MPF)|\.(?:SPF|MPF))?$", re.IGNORECASE)
"""The name of a program in a text, perhaps with a path."""


def subprogram(control: Sinumerik, turn: Turn, step: Calling, find: Find) -> None:
    """Call a subprogram, or a cycle of the control or the machine's builder."""
    if turn.modal:
        kind = "cycle" if MADE_BY_THE_CONTROL.fullmatch(step.name) else "subprogram"
        control.suspend("cycle", f"the modal {kind} {step.name.upper()} is in force, which ncfix does not support")
        return
    unit = find(step.name)
    if unit is not None:
        turn.subprogram, turn.called, turn.arguments, turn.written = unit, step, step.arguments, step.written
        turn.times = round(turn.words.get("P", 1.0))
        return
    if step.name.startswith(TRANSFORMING):
        control.suspend(step.name, f"the transformation {step.name.upper()} is in force, which ncfix does not support")
        return
    if MADE_BY_THE_CONTROL.fullmatch(step.name):
        cycle(control, turn.words, step, modal=False)
        return
    turn.handed += step.written
    ran_elsewhere(control, step.name.upper(), changes_tool=control.fresh_tool)


def lose_arguments(control: Sinumerik, written: Iterable[Expression | None]) -> None:
    """Forget variables that are arguments of a program not at hand, which may change them (VAR)."""
    for part in written:
        match part:
            case NumberedParameter(index):
                control.variables.assign(("r", (nominal(compiled(index)(control)),)), Unknown())
            case NamedParameter(name) | FunctionCall(name, indexed=True):
                control.variables.forget(name)


def function(control: Sinumerik, turn: Turn, step: Calling) -> None:
    """Note a function in an expression of the block that only the control can evaluate."""
    if step.name in UNFOLLOWED:
        control.suspend(step.name, f"{UNFOLLOWED[step.name]} is in force, which ncfix does not support")
    turn.handed += step.written


def ran_elsewhere(control: Sinumerik, name: str, *, changes_tool: bool) -> None:
    """Treat a subprogram not at hand as a cycle of the builder (NCF252): positions are unknown afterwards.

    changes_tool  it may be the one that changes the tool
    """
    text = f"{name} is unknown: ncfix assumes a cycle that does not change coordinates"
    control.warn(UNKNOWN_CYCLE, text, WHERE_IT_IS)
    control.lose_all(AFTER_CYCLE)
    control.changed_by_cycle |= changes_tool
    if "tool" in control.suspended:
        into_spindle(control)
        set_length(control)


def call_by_text(control: Sinumerik, turn: Turn, step: Calling, find: Find) -> None:
    """Execute `CALL "NAME"` or `EXTCALL("NAME.SPF")`."""
    text = plain_text(step.written[0]) if step.written else None
    found = FILE.search(text or "")
    unit = find(found["name"]) if found else None
    if unit is not None:
        turn.subprogram, turn.called, turn.times = unit, step, round(turn.words.get("P", 1.0))
        return
    control.suspend(step.name, f"{UNFOLLOWED[step.name]} is in force, which ncfix does not support")
    told = f"the program {text}" if found else f"a program whose name {step.name.upper()} gets at run time"
    control.warn(UNKNOWN_CYCLE, f"{told} is not found: motions after it are refused", WHERE_IT_IS)


def call_word(control: Sinumerik, turn: Turn, find: Find) -> None:
    """Execute `L123`, the call of a subprogram by its number."""
    value = turn.words.values.get("L")
    if "L" not in turn.words.values:
        return
    if turn.modal:
        control.suspend("cycle", "a modal subprogram (MCALL L) is in force, which ncfix does not support")
        return
    if value is None:
        control.refuse_rest("which subprogram is called (L) is known only at run time")
        return
    unit = find(f"L{value:g}")
    if unit is None:
        turn.elsewhere = f"L{value:g}"
        return
    turn.subprogram, turn.times = unit, round(turn.words.get("P", 1.0))


CONFLICT = "NCF208"
FRAMES_STAY = "$mn_frame_geoax_change_mode"
FRAME_OVER = (
    "a programmed frame (TRANS, ROT, ...) was in force at {}, and machine data decide whether it stays: program it "
    'again, or set variables."$MN_FRAME_GEOAX_CHANGE_MODE" = 1 in the setup file'
)
OTHER_TRANSFORMATION = "NCF257"
SWITCHED_ON = (
    "whether CYCLE832 switches TRAORI on depends on the version of the control: older versions read it from the "
    "second argument"
)
ADDITIVE = "an additive tool offset (DL) is in force, whose value is in the control"
AFTER_ADDITIVE = "the position of the axis {} after an additive tool offset (DL) is not known"
RETURNS_ELSEWHERE = "ncfix does not support a return to another block than the one after the call (RET)"
AFTER_RESET = "the position of the axis {} after ORIRESET depends on machine data"
_PASSED = """
    G9 G62 G140 G141 G142 G143 G340 G341 G450 G451 G460 G461 G462 G601 G602 G603 G621 G972 G973 G290 G471 G472
"""
PASSED = frozenset(10 * int(code[1:]) for code in _PASSED.split())
"""G codes, in tenths, that do not affect positions."""

Handler = Callable[[Sinumerik, int], None]
SETTINGS: dict[int, Handler] = {
    **dict.fromkeys((170, 180, 190), framing.plane),
    **dict.fromkeys((700, 710, 7000, 7100), framing.units),
    **dict.fromkeys((930, 940, 950, 960, 9610, 9620, 970, 9710), framing.feed_mode),
    **dict.fromkeys((400, 410, 420), framing.compensation),
    **dict.fromkeys((600, 640, 6410, 6420, 6430, 6440, 6450), framing.path_mode),
    **dict.fromkeys((540, 550, 560, 570, 5000, *range(5050, 6000, 10)), framing.settable),
}
ANGLE_KINDS = frozenset({"orieuler", "orirpy", "orirpy2", "orivirt1", "orivirt2"})
"""The G code names that tell how A2 B2 C2 are meant."""

STRAIGHT_AND_ARCS = frozenset({0, 10, 20, 30})

WORKING_AREA = frozenset({250, 260})
"""G25 and G26, whose words are limits of the working area or of the spindle."""
FOR_THIS_BLOCK = {530: "g53", 1530: "g153", 630: "g63"} | dict.fromkeys(motion.SOFT_APPROACH, "soft")
TAKES_WORDS = frozenset({40, 580, 590, *motion.REFERENCE}) | POLES | WORKING_AREA


@mutable
class Turn:
    """The execution of one block.

    words       the values of its words; plan: of its shape
    at_once     T alone changes the tool
    special     statements that apply to this block only: `supa`, `g53`, `g63`, `meas`, `soft`
    frame       name of a frame instruction, which takes the axis words
    subprogram  the subprogram that is called after the block, with `arguments` (as `written`), `times` times
    called      the statement that calls it
    elsewhere   the number of a subprogram that is called after the block and is not at hand
    contour     the call of a cycle that mills along a contour
    modal       whether MCALL is in the block; ends: whether RET is
    used        whether another statement has taken the axis words
    handed      arguments of programs that are not at hand
    """

    words: BlockWordValues
    plan: SinumerikPlan
    at_once: bool
    special: set[str] = field(default_factory=set)
    frame: str = ""
    subprogram: SinumerikUnit | None = None
    called: Calling | None = None
    arguments: tuple[Evaluate, ...] = ()
    written: tuple[Expression | None, ...] = ()
    times: int = 1
    elsewhere: str = ""
    contour: Calling | None = None
    modal: bool = False
    ends: bool = False
    used: bool = False
    handed: list[Expression | None] = field(default_factory=list)

    @property
    def m(self) -> set[int]:
        """The M codes of the block in tenths, `M=6` among them."""
        value = self.words.values.get("M")
        return {*self.plan.m} if value is None else {*self.plan.m, round(10 * value)}


# -- names ------------------------------------------------------------------------------------------------------------


def act(control: Sinumerik, turn: Turn, step: Calling, find: Find) -> None:
    """Execute a name of a block at once, except for parts that need the other words (done in `finish_block`)."""
    name = step.name
    if {"call", "block"} <= turn.plan.names:
        if name == "call":
            control.refuse_rest(SECTION)
            control.refuse_here(SECTION)
            control.warn(UNKNOWN_CYCLE, SECTION, "motions after it are refused: write the section as a subprogram")
    elif name in SPECIAL:
        SPECIAL[name](control, turn, step)
    elif name in framing.PROGRAMMABLE:
        turn.frame = name
    elif name in MOTIONS:
        control.modal.motion, control.stated = MOTIONS[name], True
    elif name in DIAMETERS.values():
        control.count_in(name)
    elif name in CALLED_BY_TEXT:
        call_by_text(control, turn, step, find)
    elif name == "cycle832":
        tolerance(control, step)
    elif name in COUPLED and not names_axis(control, step):
        return
    elif name in UNFOLLOWED:
        control.suspend(name, f"{UNFOLLOWED[name]} is in force, which ncfix does not support")
    elif name in ("orimks", "oriwks"):
        control.modes.orientation_in_machine = name == "orimks"
        if name == "oriwks" and not control.modes.orientation:
            control.modes.orientation = "orivect"  # unless machine data leave that to ORIAXES and its like
    elif name in ANGLE_KINDS:
        control.modes.angles = name
    elif name in TURNS_OF_THE_TOOL:
        control.modes.orientation = name
    elif name == "orireset":
        control.lose_all(AFTER_RESET)
    elif name in PUNCHING:
        control.modes.by_block = control.modes.by_block - {STROKES} | PUNCHING[name]
    elif name in HARMLESS:
        turn.handed += step.written[RESULTS.get(name, len(step.written)) :]
    elif name == "cycle800":
        swivel(control, turn.words.block, step)
    elif name in MILLING and MILLING[name].named and not turn.modal and find(name) is None:
        turn.contour = step
    elif name in DRILLING or (name in MILLING and find(name) is None):
        cycle(control, turn.words, step, modal=turn.modal)
    else:
        subprogram(control, turn, step, find)


def names_axis(control: Sinumerik, step: Calling) -> bool:
    """Whether the first argument of a call may be an axis of the machine: no other name, and no `SPI(2)`."""
    if not step.written or (isinstance(step.written[0], FunctionCall) and step.written[0].name == "spi"):
        return False
    named = step.arguments[0](control)
    return not isinstance(named, str) or INDEX.get(named) in control.axis_indices


def supa(control: Sinumerik, turn: Turn, step: Calling) -> None:
    """SUPA: the words of this block are machine coordinates."""
    turn.special.add("supa")


def transformation(control: Sinumerik, turn: Turn, step: Calling) -> None:
    """TRAORI: switch tool-centre-point control on."""
    mind_frame(control, step)
    control.resume("traori")
    if len(step.written) > 1:
        control.suspend("traori", "TRAORI with a tool direction of its own is in force")
    number_of = number(step.arguments[0](control)) if step.written else None
    if number_of is not None and number_of != 1.0:
        text = f"TRAORI({number_of:g}): ncfix uses the kinematics of the machine file"
        control.warn(OTHER_TRANSFORMATION, text, "check that the machine file is that of this transformation")
    control.modes.transformed = True
    control.switch_tcp()


def tolerance(control: Sinumerik, step: Calling) -> None:
    """CYCLE832: on older controls the third digit of its second argument may switch TRAORI on."""
    kind = number(step.arguments[1](control)) if len(step.arguments) > 1 else None
    if kind is not None and round(kind) // 100 % 10 and not control.modes.transformed:
        control.suspend("traori", SWITCHED_ON)


def mind_frame(control: Sinumerik, step: Calling) -> None:
    """At a change of the transformation: a programmed frame becomes doubtful, as machine data tell whether it stays."""
    if control.frames.programmable != WORLD and control.variables.value(FRAMES_STAY) != 1.0:
        control.suspend("frame", FRAME_OVER.format(step.name.upper()))
    control.modes.carried = step.name.upper()


def no_transformation(control: Sinumerik, turn: Turn, step: Calling) -> None:
    """TRAFOOF: switch transformations off."""
    if control.modes.transformed:
        mind_frame(control, step)
    control.modes.transformed = False
    end_unfollowed(control, turn, step)
    control.switch_tcp()


def end_unfollowed(control: Sinumerik, turn: Turn, step: Calling) -> None:
    """TRAFOOF, TOROTOF, PAROTOF, CP: end suspended statements; positions are unknown afterwards."""
    over = ENDED_BY[step.name] & control.suspended.keys()
    for name in over:
        control.resume(name)
    if over:
        control.lose_all(framing.AFTER_UNFOLLOWED)


def modal_call(control: Sinumerik, turn: Turn, step: Calling) -> None:
    """MCALL: the call in this block becomes modal; without a call it ends the modal one."""
    turn.modal = True
    control.modes.modal_cycle = None
    if control.resume("cycle"):
        control.lose_all(AFTER_CYCLE)


def define(control: Sinumerik, turn: Turn, step: Calling) -> None:
    """DEF: define variables."""
    if not step.arguments:
        raise Fault("NCF110", "DEF needs a type and a name", "write DEF REAL NAME at the beginning of a block")
    kind = str(step.arguments[0](control))
    for place in range(1, len(step.written), 2):
        variable, value = step.written[place], step.written[place + 1]
        assert isinstance(variable, NamedParameter | FunctionCall)
        control.variables.define(kind, variable.name, sizes_of(control, variable))
        if isinstance(value, FunctionCall) and value.name in LISTS:
            values = [each(control) for each in evaluates(value.arguments)]
            start = (0.0,) * len(control.variables.scopes[-1].sizes[variable.name])
            control.variables.fill(variable.name, start, values, repeated=value.name == "rep")
        elif isinstance(variable, FunctionCall) and value is not None:
            control.variables.forget(variable.name)
        elif value is not None:
            control.variables.assign(variable.name, step.arguments[place + 1](control))


def sizes_of(control: Sinumerik, variable: NamedParameter | FunctionCall) -> tuple[int, ...]:
    """The sizes of an array; empty for a plain variable, or if they are known only at run time."""
    if isinstance(variable, NamedParameter):
        return ()
    found = [number(part(control)) for part in evaluates(variable.arguments)]
    return tuple(int(size) for size in found if size is not None) if None not in found else ()


def come_back(control: Sinumerik, turn: Turn, step: Calling) -> None:
    """RET: return; with a target in the caller the rest is refused."""
    turn.ends = True
    if any(part is not None for part in step.written):
        control.refuse_rest(RETURNS_ELSEWHERE)


def measure(control: Sinumerik, turn: Turn, step: Calling) -> None:
    """MEAS and MEAW without a value: the motion of the block measures."""
    turn.special.add("meas")


SPECIAL: dict[str, Callable[[Sinumerik, Turn, Calling], None]] = {
    "supa": supa,
    "traori": transformation,
    "trafoof": no_transformation,
    "mcall": modal_call,
    "def": define,
    "ret": come_back,
    "cycle62": lambda control, _, step: contour_call(control, step),
    "meas": measure,
    "meaw": measure,
    **dict.fromkeys(ENDED_BY.keys() - {"trafoof"}, end_unfollowed),
}


# -- the block --------------------------------------------------------------------------------------------------------


def finish_block(control: Sinumerik, turn: Turn) -> None:
    """Execute the codes and words of the block, and its motion."""
    words, plan = turn.words, turn.plan
    words.whole = turn.subprogram is not None or bool(turn.elsewhere)
    if "G" in words.values:
        control.refuse_rest("a calculated G code (G=..) is not supported")
    codes(control, turn)
    if turn.frame:
        framing.programmable(control, turn.frame, words)
        control.claim_words()
        return
    framing.tool(control, words, 60 in turn.m, turn.at_once and bool(words.values.keys() & {"T"} or words.texts))
    additive_offset(control, turn)
    feed(control, turn)
    if "OFFN" in words.values:
        allowance = words.values["OFFN"]
        control.allowance = math.nan if allowance is None else control.modal.unit * allowance
    if "RNDM" in words.values:
        control.modes.rounds = words.values["RNDM"] != 0.0
    if motion.REFERENCE.keys().isdisjoint(plan.g):
        strangers(control, words)
    if "MEAS" in words.values or "MEAW" in words.values:
        turn.special.add("meas")
    if turn.used:
        return
    if control.path_word(words.values):
        motion.moved(control, words, frozenset(turn.special))
    elif "soft" in turn.special:
        control.lose(GEOMETRY, motion.AFTER_APPROACH)  # the next block says where the approach leads


def additive_offset(control: Sinumerik, turn: Turn) -> None:
    """DL: an additive tool offset, whose value only the control knows, suspends motions; D without DL ends it."""
    letting = next((step for step in turn.plan.steps if isinstance(step, AssignedVariable) and step.name == "dl"), None)
    if letting is not None and (letting.value is None or letting.value(control) != 0.0):
        control.suspend("dl", ADDITIVE)
    elif (letting is not None or "D" in turn.words.values) and control.resume("dl"):
        control.lose_all(AFTER_ADDITIVE)


def codes(control: Sinumerik, turn: Turn) -> None:
    """Execute the G codes of a block."""
    chosen = [f"G{code // 10}" for code in turn.plan.g if code in STRAIGHT_AND_ARCS or code in UNFOLLOWED_MOTIONS]
    chosen += sorted(name.upper() for name in MOTIONS.keys() & turn.plan.names)
    if len(set(chosen)) > 1:
        raise Fault(CONFLICT, f"{chosen[0]} and {chosen[1]} exclude one another (both set the motion)")
    for code in turn.plan.g:
        if code in STRAIGHT_AND_ARCS or code in UNFOLLOWED_MOTIONS:
            control.modal.motion, control.stated = code, True
        elif code in SETTINGS:
            SETTINGS[code](control, code)
        elif code in (900, 910):
            control.modal.incremental = code == 910
        elif code in FOR_THIS_BLOCK:
            turn.special.add(FOR_THIS_BLOCK[code])
        elif code in TAKES_WORDS:
            takes_words(control, turn, code)
        elif code not in PASSED:
            control.refuse_after(code, moving=bool(turn.words.axes or POLAR & turn.words.values.keys()))


def takes_words(control: Sinumerik, turn: Turn, code: int) -> None:
    """Execute codes that take the axis words of the block: dwell, reference points, poles, G58, G59, G25, G26."""
    turn.used = True
    if code == 40:
        motion.dwell(control, turn.words)
    elif code in motion.REFERENCE:
        motion.to_reference(control, turn.words, code)
    elif code in POLES:
        set_pole(control, turn.words, code)
        control.claim_words()
    elif code in (580, 590):
        framing.programmed_shift(control, turn.words, code)
        control.claim_words()
    elif code in WORKING_AREA:
        control.claim_words()


def feed(control: Sinumerik, turn: Turn) -> None:
    """Set the feed by F, unless it is the time of a dwell."""
    if "F" not in turn.words.values or 40 in turn.plan.g:
        return
    value = turn.words.values["F"]
    control.modal.feed = float("nan") if value is None else control.feed_unit * value


def strangers(control: Sinumerik, words: BlockWordValues) -> None:
    """Note axes that the program moves but the machine lacks."""
    for address in words.values:
        extended = len(address) > 1 and address[0] in "XYZABCUVWQ" and address[1:].isdigit()
        if address in PATH_WORDS and address not in INDEX:
            continue
        lacking = address in INDEX and INDEX[address] not in control.axis_indices
        if (lacking or extended) and address not in control.foreign:
            control.note_foreign(address)


def say(text: str) -> str:
    """A block shortened for a message, in quotes."""
    short = " ".join(text.split(";")[0].split())
    return f"'{short[:40]}...'" if len(short) > 40 else f"'{short}'"
