"""Patterns of holes: PATTERN DEF, which CYCL CALL PAT works off, and the cycles 220 (on a circle) and 221 (on lines).

Source: TNC 640, "Cycle programming", "Pattern definition" and "Point patterns". Positions are in program units along
the axes of the program's frame; in which order the control takes them makes no difference to a hole.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from ncfix.control.expressions import Value, nominal, numbers, signed
from ncfix.text.spelling import value_of
from ncfix_heidenhain.klartext.plans import QParameters

ON_CIRCLE, ON_LINES = 220, 221
MOST_HOLES = 100_000
"""A pattern of more counts as one whose holes are not known."""

KINDS = re.compile(r"(POS|ROW|PAT|FRAME|PITCHCIRC|CIRC)\s*\d*\s*\(([^()]*)\)", re.IGNORECASE)
WORDS = re.compile(
    r"(I?[XY]|Z|DX|DY|D|NUMX|NUMY|NUM|ROTX|ROTY|ROT|START|STEP|END)\s*([+-]?)\s*(Q[LR]?\d+|\d+[.,]?\d*|[.,]\d+)",
    re.IGNORECASE,
)
LEFT_OUT = re.compile(r";[^\r\n]*|~(?=[ \t\r]*(?:\n|\Z))")


@dataclass(frozen=True, slots=True)
class HolePosition:
    """Where a hole is, and by how much its surface is above that of the cycle."""

    x: float
    y: float
    height: float = 0.0


Values = Mapping[str, float]


def pattern_of(text: str, parameters: QParameters) -> tuple[HolePosition, ...] | None:
    """The places of a PATTERN DEF; None if they are known only at run time, or their form is not."""
    code = LEFT_OUT.sub(" ", text)
    found: list[HolePosition] = []
    certain = True
    for kind, inside in KINDS.findall(code):
        said = {name.upper(): number(sign, value, parameters) for name, sign, value in WORDS.findall(inside)}
        certain &= numbers(said.values()) is not None
        values = {name: nominal(value) for name, value in said.items()}
        if not understood(inside, values) or holes(values) + len(found) > MOST_HOLES:
            return None
        found += FORMS[kind.upper()](values, found)
    rest = KINDS.sub(" ", code).split()
    return None if not certain or not found or len(rest) > 2 else tuple(found)


def understood(inside: str, values: Values) -> bool:
    """Every word was read, and the pattern is not bent."""
    return not WORDS.sub(" ", inside).strip() and not values.get("ROTX") and not values.get("ROTY")


def holes(values: Values) -> float:
    """How many holes a pattern has at most."""
    return max(values.get("NUM", 0.0), max(values.get("NUMX", 0.0), 1.0) * max(values.get("NUMY", 0.0), 1.0))


def number(sign: str, text: str, parameters: QParameters) -> Value:
    """The value of a number or a Q parameter."""
    value = parameters.get(text.upper()) if text[0] in "Qq" else value_of(text)
    return signed(-1.0 if sign == "-" else 1.0, value)


# -- forms ------------------------------------------------------------------------------------------------------------


def position(values: Values, before: list[HolePosition]) -> Iterator[HolePosition]:
    """POS: one hole, perhaps counted from the one before."""
    x, y = (before[-1].x, before[-1].y) if before else (0.0, 0.0)
    x = values["X"] if "X" in values else x + values.get("IX", 0.0)
    y = values["Y"] if "Y" in values else y + values.get("IY", 0.0)
    yield HolePosition(x, y, values.get("Z", 0.0))


def grid(values: Values, steps: Iterator[tuple[float, float]]) -> Iterator[HolePosition]:
    """Holes so far from the first along its axes."""
    turn = math.radians(values.get("ROT", 0.0))
    for u, v in steps:
        x = values.get("X", 0.0) + u * math.cos(turn) - v * math.sin(turn)
        y = values.get("Y", 0.0) + u * math.sin(turn) + v * math.cos(turn)
        yield HolePosition(x, y, values.get("Z", 0.0))


def row(values: Values, before: list[HolePosition]) -> Iterator[HolePosition]:
    """ROW: holes on a straight line."""
    return grid(values, ((k * values.get("D", 0.0), 0.0) for k in range(int(values.get("NUM", 0)))))


def lines(values: Values, before: list[HolePosition]) -> Iterator[HolePosition]:
    """PAT: lines of holes."""
    across, along = int(values.get("NUMX", 0)), int(values.get("NUMY", 0))
    dx, dy = values.get("DX", 0.0), values.get("DY", 0.0)
    return grid(values, ((i * dx, j * dy) for j in range(along) for i in range(across)))


def frame(values: Values, before: list[HolePosition]) -> Iterator[HolePosition]:
    """FRAME: the outer holes of PAT."""
    across, along = int(values.get("NUMX", 0)), int(values.get("NUMY", 0))
    dx, dy = values.get("DX", 0.0), values.get("DY", 0.0)
    outer = ((i, j) for j in range(along) for i in range(across) if i in (0, across - 1) or j in (0, along - 1))
    return grid(values, ((i * dx, j * dy) for i, j in outer))


def circle(values: Values, before: list[HolePosition]) -> Iterator[HolePosition]:
    """CIRC, and PITCHCIRC with the angle from hole to hole, or that of the last one."""
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


# -- cycles -----------------------------------------------------------------------------------------------------------


def pattern_of_cycle(cycle: int, parameters: QParameters) -> tuple[HolePosition, ...] | None:
    """The places of cycle 220 or 221, from the Q parameters; None if they are known only at run time."""
    names = CIRCLE_WORDS if cycle == ON_CIRCLE else LINE_WORDS
    known = numbers(parameters.get(name) for name in names.values())
    if known is None:
        return None
    values = dict(zip(names, known, strict=True))
    if holes(values) > MOST_HOLES:
        return None
    if cycle == ON_LINES:
        return tuple(lines(values, []))
    step, count, whole = values.pop("STEP"), int(values["NUM"]), values.pop("END") - values["START"]
    if step == 0.0:
        step = whole / count if abs(abs(whole) - 360.0) < 1e-9 else whole / max(1, count - 1)
    return tuple(circle({**values, "STEP": step}, []))


CIRCLE_WORDS = {"X": "Q216", "Y": "Q217", "D": "Q244", "START": "Q245", "END": "Q246", "STEP": "Q247", "NUM": "Q241"}
LINE_WORDS = {"X": "Q225", "Y": "Q226", "DX": "Q237", "DY": "Q238", "NUMX": "Q242", "NUMY": "Q243", "ROT": "Q224"}
