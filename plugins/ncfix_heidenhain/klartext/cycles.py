"""CYCL DEF, and what executes cycles: CYCL CALL, M99, M89.

Of a drilling cycle one motion per hole is corrected, that to its bottom. The control makes a pocket, a stud or a thread
around the place of the call: that place and the bottom are corrected. Other cycles with a path of their own are
refused.

Patterns of holes: PATTERN DEF, whose holes CYCL CALL PAT makes, and the cycles 220 (on a circle) and 221 (on lines).
Their positions are in program units along the axes of the program's frame. In which order the control makes the holes
does not matter.

Source: TNC 640, "Cycle programming", also "Pattern definition" and "Point patterns".
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping

from ncfix.control.coordinates import X, Y, Z, mask_of
from ncfix.control.expressions import Fault, nominal, numbers
from ncfix.control.moves import Motion, MotionKind
from ncfix_heidenhain.klartext import transformations
from ncfix_heidenhain.klartext.arcs import IN_PLANE, Step
from ncfix_heidenhain.klartext.contours import LEFT_OUT, VALUE, number
from ncfix_heidenhain.klartext.control import AFTER_CYCLE, BY_DEPTH, FROM_START, HolePosition, KlartextControl
from ncfix_heidenhain.klartext.planes import cycle_19
from ncfix_heidenhain.klartext.plans import QParameters
from ncfix_heidenhain.klartext.targets import (
    FramePosition,
    MotionWords,
    command_of,
    polar,
    polar_axes,
    programmed_position,
)

NO_CYCLE = "NCF272"
DRILLING = frozenset({200, 201, 202, 203, 205, 206, 207, 208, 209, 240, 241})
"""Drilling cycles whose bottom is at Q203 + Q201; back boring (204) counts its depth differently."""

BORE_MILLING = 208
"""The cycle that mills a hole around the place of the call, and returns there."""

OLD_MILLING = frozenset({3, 4, 5})
MILLING = OLD_MILLING | {251, 252, 253, 256, 257, 258, 262, 263, 264, 265, 267}
"""Cycles for pockets, slots, studs and threads around the place of the call, down to Q203 + Q201 (or as in `OLD`).

A round slot (254) is not one of them: the cycle itself may state its place.
"""

IN_SPACE = frozenset({*range(20, 26), 204, *range(210, 216), 225, *range(230, 234), 254, *range(270, 278)})
"""Cycles with a path of their own that move X, Y and Z only; others (on cylinder surfaces) turn rotary axes, too."""

OLD = frozenset({1, 2, 17, 18}) | OLD_MILLING
"""Cycles that count their depth from the height at which they are called.

Their words are told apart by the number of the part (`1.2`), because their names depend on the language of the control.
"""
GAP_PART, DEPTH_PART, THREAD_CUTTING = "1", "2", 18
"""In old cycles part 1 (`1.1`) is the clearance, part 2 the depth; thread cutting starts with depth, no clearance."""

LAST = re.compile(rf"{VALUE}\s*\Z", re.IGNORECASE)
ADJUSTING = frozenset({291, 800, 801, 880, *range(1000, 1100)})
ADJUSTED = "cycle {} may change coordinates, for turning or grinding, in a way that ncfix does not support"
BUILDERS = range(300, 400)
LEADING = frozenset({224, 238})
"""Cycles that move where they are defined: a data matrix code of holes, and a measurement of the machine's state."""
TILT = 19
OF_BUILDER = "cycle {} is of the machine builder; what it does at its definition is not known"
BY_ITSELF = "cycle {} moves the axes at its definition"
CALLING = 12
CALLED = "cycle 12 calls a program, which ncfix does not read"
HARMLESS = frozenset({9, 13, 32, 239, 392})
"""Cycles that move nothing: dwell, spindle orientation, tolerance, load, and the like."""

OWN_PATH = "cycle {} makes a path of its own, which ncfix does not correct"
AFTER_HOLE = "the position of the axis {} after a hole of unknown depth is not known"
DEPTH_AT_RUN_TIME = "the depth of the cycle is known only at run time"
NOT_EXECUTED = "the depth of the cycle is zero: controls do not execute it, or stop"
PATTERN = "a pattern of holes ({}): the control calculates their positions; with --flatten ncfix writes them out"
FROM_INCREMENT = "an old cycle is called in a block with an incremental height (IZ)"


# -- definition -------------------------------------------------------------------------------------------------------


def define(control: KlartextControl, name: str, words: MotionWords, text: str) -> None:
    """Execute a CYCL DEF block: `name` is `200`, or `7.1` for part 1 of cycle 7."""
    whole, _, part = name.partition(".")
    cycle = int(whole)
    if cycle in transformations.ACTS:
        transformations.transform(control, cycle, part, words, text)
        return
    if cycle == TILT:
        if part == "1":
            cycle_19(control, words)
        return
    if cycle in HARMLESS:
        return
    if cycle in ADJUSTING:
        control.refuse_rest(ADJUSTED.format(cycle))
    if cycle in BUILDERS:
        control.refuse_here(OF_BUILDER.format(cycle))
    if cycle in LEADING:
        control.refuse_here(BY_ITSELF.format(cycle))
    if cycle in (ON_CIRCLE, ON_LINES):
        pattern(control, pattern_of_cycle(cycle, control.scope.parameters), f"cycle {cycle}")
        return
    if part in ("", "0"):
        control.cycle.number, control.cycle.steps = cycle, {}
    words_of_step = {**words.values}
    if words.unknown:
        words_of_step["?"] = 1.0
    if cycle in OLD and not words_of_step and (last := LAST.search(LEFT_OUT.sub(" ", text))):
        value = numbers([number(last[0], control.scope.parameters)])
        words_of_step["" if value else "?"] = value[0] if value else 1.0
    control.cycle.steps |= {f"{part}:{key}": value for key, value in words_of_step.items()}


# -- execution --------------------------------------------------------------------------------------------------------


def executes(control: KlartextControl, step: Step) -> bool:
    """Whether a positioning block executes the cycle in force: by M99, or by M89 in it or before it. M99 ends M89."""
    if 89 in step.codes:
        control.cycle.modal = True
    once, modal = 99 in step.codes, control.cycle.modal
    if once:
        control.cycle.modal = False
    return once or modal


def call(control: KlartextControl, step: Step) -> None:
    """Execute the cycle in force at the position to which a block leads, or where the axes stand."""
    cycle = control.cycle
    if cycle.number == 0:
        raise Fault(NO_CYCLE, "a cycle is called, but none is defined before")
    control.use()
    if cycle.number == CALLING:
        control.refuse_rest(CALLED)
    if cycle.number not in DRILLING | MILLING | OLD:
        own_path(control, step)
        return
    control.use_start_positions(tuple(control.unknown))
    is_polar = step.name == "lp"
    where = polar(control, step.words)[0] if is_polar else programmed_position(control, step.words)
    axes = polar_axes(control, step.words) if is_polar else step.words.axes
    height = where.inner[Z]
    bottom, clear, refusal = levels(control, height)
    old, by_height = cycle.number in OLD, step.name == "cycl call pos"
    if (old or by_height) and Z in where.unknown:
        refusal = refusal or where.unknown[Z].format("Z")
    if old and "IZ" in step.words.values:
        refusal = refusal or FROM_INCREMENT
    if by_height and not old:
        bottom, clear = bottom + height, clear + height
    if by_height or step.name == "cycl call":
        control.builder.rests(mask_of(control.turning))
    drill(control, where, axes, (bottom, clear, refusal))


def pattern(control: KlartextControl, places: tuple[HolePosition, ...] | None, name: str) -> None:
    """Execute the cycle in force at all places of a pattern; `places` is None if they are not known."""
    control.use()
    if control.cycle.number == 0:
        raise Fault(NO_CYCLE, "a pattern of holes, but no cycle is defined before")
    if places is None or control.cycle.number not in (DRILLING | MILLING) - OLD:
        reason = PATTERN.format(name) if places is None else OWN_PATH.format(control.cycle.number)
        control.refuse_here(reason)
        return
    control.use_start_positions(tuple(control.unknown))
    control.budget.spend(len(places))
    for place in places:
        where = programmed_position(control, MotionWords({"X": place.x, "Y": place.y}, frozenset()))
        bottom, clear, refusal = levels(control, where.inner[Z])
        height = control.scale[Z] * place.height
        drill(control, where, IN_PLANE, (bottom + height, clear + height, refusal or PATTERN.format(name)))


def drill(control: KlartextControl, where: FramePosition, axes: int, heights: tuple[float, float, str]) -> None:
    """Make one hole over a position; `heights`: bottom and clearance, mm, and why they are not known."""
    bottom, clear, refusal = heights
    over = FramePosition(where.inner[:], dict(where.unknown))
    where.inner[Z] = bottom
    if not refusal:
        where.unknown.pop(Z, None)
    end = command_of(control, where, axes | 1 << Z)
    programmed = axes & ~(1 << Z)
    code = FROM_START if control.cycle.number in OLD else BY_DEPTH
    control.make(Motion(MotionKind.CYCLE, programmed, end, code, refusal=refusal))
    over.inner[Z] = clear
    over.unknown.pop(Z, None)
    if refusal in (DEPTH_AT_RUN_TIME, NOT_EXECUTED):
        over.unknown[Z] = AFTER_HOLE
    if control.cycle.number in MILLING:
        over.unknown |= {X: AFTER_CYCLE, Y: AFTER_CYCLE}
    if not refusal and control.cycle.number in MILLING | {BORE_MILLING}:
        control.moved_as_a_whole(f"cycle {control.cycle.number}")
    above = command_of(control, over, axes | 1 << Z)
    control.stand(above.target, above.unknown, over.unknown)
    control.path.tangent = None


def levels(control: KlartextControl, height: float) -> tuple[float, float, str]:
    """Bottom and clearance height of the cycle in force along Z of the frame, mm, and why they are not known.

    height  the height at which the cycle is called, mm
    """
    cycle, unit = control.cycle, control.stretch
    if cycle.number in OLD:
        depth, gap = value_of_part(cycle.steps, DEPTH_PART), value_of_part(cycle.steps, GAP_PART)
        unsure = cycle.number == THREAD_CUTTING or any(key.endswith(":?") for key in cycle.steps)
        if depth is None or gap is None or unsure:
            return height, height, DEPTH_AT_RUN_TIME
        if depth == 0.0:
            return height, height, NOT_EXECUTED
        sign = -1.0 if depth < 0 else 1.0
        return height + sign * unit * (abs(gap) + abs(depth)), height, ""
    parameters = control.scope.parameters
    by_diameter = parameters.get("Q343") if cycle.number == 240 else 0.0
    known = numbers(parameters.get(name) for name in ("Q200", "Q201", "Q203", "Q204"))
    if known is None or by_diameter != 0.0:
        return height, height, DEPTH_AT_RUN_TIME
    gap, depth, surface, second = known
    if depth == 0.0:
        return height, height, NOT_EXECUTED
    clear = surface + max(gap, second)
    return unit * (surface + depth), unit * clear, ""


def value_of_part(steps: Mapping[str, float], part: str) -> float | None:
    """The value in one part of an old cycle; None if the part has no value, or several."""
    values = [value for key, value in steps.items() if key.partition(":")[0] == part]
    return values[0] if len(values) == 1 else None


def own_path(control: KlartextControl, step: Step) -> None:
    """Refuse a cycle with a path of its own: X, Y and Z are not known after it.

    The other axes are known only after cycles that move X, Y and Z alone (`IN_SPACE`).
    """
    position, unknown = control.position[:], dict(control.unknown)
    control.refuse_here(OWN_PATH.format(control.cycle.number))
    if control.cycle.number in IN_SPACE and not step.words.axes >> (Z + 1):
        control.stand(position, unknown)
    control.lose(range(3), AFTER_CYCLE)


# -- patterns of holes -------------------------------------------------------------------------------------------------

ON_CIRCLE, ON_LINES = 220, 221
MAX_HOLES = 100_000
"""The most holes of a pattern; those of a larger one count as not known."""

KINDS = re.compile(r"(POS|ROW|PAT|FRAME|PITCHCIRC|CIRC)\s*\d*\s*\(([^()]*)\)", re.IGNORECASE)
WORDS = re.compile(rf"(I?[XY]|Z|DX|DY|D|NUMX|NUMY|NUM|ROTX|ROTY|ROT|START|STEP|END)\s*({VALUE})", re.IGNORECASE)

Values = Mapping[str, float]


def pattern_of(text: str, parameters: QParameters) -> tuple[HolePosition, ...] | None:
    """The places of a PATTERN DEF; None if they are known only at run time, or some word is not understood."""
    code = LEFT_OUT.sub(" ", text)
    found: list[HolePosition] = []
    certain = True
    for kind, inside in KINDS.findall(code):
        said = {name.upper(): number(value, parameters) for name, value in WORDS.findall(inside)}
        certain &= numbers(said.values()) is not None
        values = {name: nominal(value) for name, value in said.items()}
        if not understood(inside, values) or holes(values) + len(found) > MAX_HOLES:
            return None
        found += FORMS[kind.upper()](values, found)
    rest = KINDS.sub(" ", code).split()
    return None if not certain or not found or len(rest) > 2 else tuple(found)


def understood(inside: str, values: Values) -> bool:
    """Whether every word was read, and the pattern is not distorted by ROTX or ROTY."""
    return not WORDS.sub(" ", inside).strip() and not values.get("ROTX") and not values.get("ROTY")


def holes(values: Values) -> float:
    """The most holes that a pattern with these words can have."""
    return max(values.get("NUM", 0.0), max(values.get("NUMX", 0.0), 1.0) * max(values.get("NUMY", 0.0), 1.0))


# -- forms ------------------------------------------------------------------------------------------------------------


def position(values: Values, before: list[HolePosition]) -> Iterator[HolePosition]:
    """POS: one hole; IX and IY count from the hole before."""
    x, y = (before[-1].x, before[-1].y) if before else (0.0, 0.0)
    x = values["X"] if "X" in values else x + values.get("IX", 0.0)
    y = values["Y"] if "Y" in values else y + values.get("IY", 0.0)
    yield HolePosition(x, y, values.get("Z", 0.0))


def grid(values: Values, steps: Iterator[tuple[float, float]]) -> Iterator[HolePosition]:
    """Holes at these distances from the first hole, along the axes of a pattern that is turned by ROT."""
    turn = math.radians(values.get("ROT", 0.0))
    for u, v in steps:
        x = values.get("X", 0.0) + u * math.cos(turn) - v * math.sin(turn)
        y = values.get("Y", 0.0) + u * math.sin(turn) + v * math.cos(turn)
        yield HolePosition(x, y, values.get("Z", 0.0))


def row(values: Values, before: list[HolePosition]) -> Iterator[HolePosition]:
    """ROW: holes on a straight line."""
    return grid(values, ((k * values.get("D", 0.0), 0.0) for k in range(int(values.get("NUM", 0)))))


def lines(values: Values, before: list[HolePosition]) -> Iterator[HolePosition]:
    """PAT: a grid of NUMX by NUMY holes."""
    across, along = int(values.get("NUMX", 0)), int(values.get("NUMY", 0))
    dx, dy = values.get("DX", 0.0), values.get("DY", 0.0)
    return grid(values, ((i * dx, j * dy) for j in range(along) for i in range(across)))


def frame(values: Values, before: list[HolePosition]) -> Iterator[HolePosition]:
    """FRAME: the outermost holes of such a grid."""
    across, along = int(values.get("NUMX", 0)), int(values.get("NUMY", 0))
    dx, dy = values.get("DX", 0.0), values.get("DY", 0.0)
    outer = ((i, j) for j in range(along) for i in range(across) if i in (0, across - 1) or j in (0, along - 1))
    return grid(values, ((i * dx, j * dy) for i, j in outer))


def circle(values: Values, before: list[HolePosition]) -> Iterator[HolePosition]:
    """CIRC: holes spread evenly over a circle. PITCHCIRC: with the angle STEP, or from START to END."""
    count = int(values.get("NUM", 0))
    start, step = values.get("START", 0.0), values.get("STEP")
    if step is None:
        step = (values["END"] - start) / max(1, count - 1) if "END" in values else 360.0 / max(1, count)
    for k in range(count):
        angle, radius = math.radians(start + k * step), values.get("D", 0.0) / 2
        x, y = values.get("X", 0.0) + radius * math.cos(angle), values.get("Y", 0.0) + radius * math.sin(angle)
        yield HolePosition(x, y, values.get("Z", 0.0))


FORMS: Mapping[str, Callable[[Values, list[HolePosition]], Iterator[HolePosition]]] = {
    "POS": position,
    "ROW": row,
    "PAT": lines,
    "FRAME": frame,
    "CIRC": circle,
    "PITCHCIRC": circle,
}


# -- cycles that are patterns ------------------------------------------------------------------------------------------


def pattern_of_cycle(cycle: int, parameters: QParameters) -> tuple[HolePosition, ...] | None:
    """The places of the holes of cycle 220 or 221, from Q parameters; None if they are not known, or too many."""
    names = CIRCLE_WORDS if cycle == ON_CIRCLE else LINE_WORDS
    known = numbers(parameters.get(name) for name in names.values())
    if known is None:
        return None
    values = dict(zip(names, known, strict=True))
    if holes(values) > MAX_HOLES:
        return None
    if cycle == ON_LINES:
        return tuple(lines(values, []))
    step, count, whole = values.pop("STEP"), int(values["NUM"]), values.pop("END") - values["START"]
    if step == 0.0:
        step = whole / count if abs(abs(whole) - 360.0) < 1e-9 else whole / max(1, count - 1)
    return tuple(circle({**values, "STEP": step}, []))


CIRCLE_WORDS = {"X": "Q216", "Y": "Q217", "D": "Q244", "START": "Q245", "END": "Q246", "STEP": "Q247", "NUM": "Q241"}
LINE_WORDS = {"X": "Q225", "Y": "Q226", "DX": "Q237", "DY": "Q238", "NUMX": "Q242", "NUMY": "Q243", "ROT": "Q224"}
