"""Patterns of holes of Haas and Mitsubishi controls: the control executes the canned cycle in force at each place.

One block cannot hold different corrections for all holes, so patterns are refused, and `--flatten` writes them out.
Source: Haas, "Mill operator's manual": G70, G71; Mitsubishi, "M800/M80, programming manual (machining centre)",
"Special fixed cycle": G34 to G37.1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, NamedTuple

from ncfix.control.expressions import Fault
from ncfix.control.operations import make_up
from ncfix.control.setup import POINTLESS
from ncfix_fanuc.macro.control import NO_POINT
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.cycles import PATTERN_WORDS, cycle

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl
    from ncfix_iso.rs274.plans import RS274Plan

Words = dict[str, float]
Places = Iterator[tuple[float, float]]
"""(x, y) of each hole, relative to the centre or the first place of the pattern, in program units."""


def around(words: Words, step: float, count: int) -> Places:
    """Holes on a circle of radius I, from angle J on, `step` degrees apart, counter-clockwise."""
    radius, start = words.get("I", 0.0), words.get("J", 0.0)
    turns = (math.radians(start + step * place) for place in range(count))
    return ((radius * math.cos(turn), radius * math.sin(turn)) for turn in turns)


def bolt_circle(words: Words, count: int) -> Places:
    """Holes evenly round a circle; a negative number means clockwise."""
    return around(words, 360.0 / count, abs(count))


def line(words: Words, count: int) -> Places:
    """Holes on a line at angle J, a distance I apart, the first at the place itself."""
    along, turn = words.get("I", 0.0), math.radians(words.get("J", 0.0))
    return ((along * place * math.cos(turn), along * place * math.sin(turn)) for place in range(count))


def grid(words: Words, count: int) -> Places:
    """Holes in a grid of P by K places, I and J apart, the first at the place itself; every second row runs back."""
    across = round(words.get("P", 0.0))
    for row in range(count):
        columns = range(across) if row % 2 == 0 else range(across - 1, -1, -1)
        yield from ((column * words.get("I", 0.0), row * words.get("J", 0.0)) for column in columns)


class Pattern(NamedTuple):
    """A pattern code.

    name    its name in words
    many    address of the number of holes
    needs   addresses of the words that it needs
    places  returns the places of the holes
    """

    name: str
    many: str
    needs: str
    places: Callable[[Words, int], Places]


PATTERNS = {
    700: Pattern("holes on a bolt circle (G70)", "L", "IL", bolt_circle),
    710: Pattern("holes on an arc (G71)", "L", "IKL", lambda words, count: around(words, words["K"], count)),
    340: Pattern("holes on a bolt circle (G34)", "K", "IJK", bolt_circle),
    350: Pattern("holes along a line (G35)", "K", "IJK", line),
    360: Pattern("holes on an arc (G36)", "K", "IJPK", lambda words, count: around(words, words["P"], count)),
    371: Pattern("a grid of holes (G37.1)", "K", "IPJK", grid),
}
EITHER_WAY, GRID = 340, 371
G17, MOST = 170, 1000
FLATTEN = "{}: the control calculates their positions; with --flatten ncfix writes them out"
PATTERN = "pattern"
AFTER_PATTERN = "the position of the axis {} after a pattern of holes is not known"


def pattern(control: RS274Control, block: Block, code: int) -> None:
    """Execute the canned cycle in force at each place; the block, or the position, gives the centre or first place."""
    made, modal = PATTERNS[code], control.modal
    count = block.get(made.many)
    plain = not (modal.incremental or modal.diameter or block.unknown) and modal.plane.code == G17
    plain = plain and modal.motion in control.rules.cycles and modal.cycle.initial is not None
    known = not any(index in control.lost_in_frame() for index, letter in enumerate("XY") if letter not in block.values)
    counts = [abs(count) if code == EITHER_WAY else count, block.get("P") if code == GRID else 1.0]
    said = frozenset(made.needs) <= block.values.keys() <= PATTERN_WORDS | {*"FS"}
    said = said and all(each == round(each) and 1 <= each <= MOST for each in counts)
    if not (plain and known and said):
        make_up(control, block, made.name)
        return
    program = control.program_position()
    middle = [block.get(letter, program[index] / modal.unit) for index, letter in enumerate("XY")]
    control.suspend(PATTERN, FLATTEN.format(made.name), followed=True)
    for x, y in made.places(block.values, round(count)):
        hole = Block(block.index, {"X": middle[0] + x, "Y": middle[1] + y}, frozenset(), 0b11)
        cycle(control, hole, modal.motion)
    control.resume(PATTERN)
    control.pattern = code
    control.lose(range(2), AFTER_PATTERN)


def check_points(control: MacroControl, plan: RS274Plan, block: Block, code: int) -> None:
    """Check lengths and angles of a pattern that have no decimal point: the setup must say what they mean.

    Raises `Fault` if numbers without a point count increments, because it is not sure which of these words do.
    """
    counts = {PATTERNS[code].many, "P" if code == GRID else ""}
    for letter in sorted({*plan.pointless} & {*"IJKP"} - counts):
        value = block.values[letter]
        if value == 0.0 or control.setup.no_point == "calculator":
            continue
        if control.setup.no_point in POINTLESS:
            text = f"{letter} of {PATTERNS[code].name} has no decimal point, so its unit is not certain"
            raise Fault(NO_POINT, text, "give it a decimal point")
        control.without_point(letter, value)
