"""The second reader: drilling cycles of SINUMERIK and Klartext, and the lines in which a correction puts one hole.

Both say in a call how deep a hole is. A correction leads the tool over the place by words of axes, and gives a hole
that needs another depth a call of its own (MCALL before and behind it), or moves the surface from which the cycle
counts (FN 1 and FN 2 on Q203).
Source: Siemens, "SINUMERIK, cycles"; Heidenhain TNC 640, "Cycle programming".
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ncfix.certificate.formulas import value_of
from ncfix.certificate.reading import CYCLE_CALL, DECIMAL, Family, TextLine
from ncfix.certificate.steps import NAN

RTP, RFP, DP, DPR = 0, 1, 3, 4
"""Arguments of all drilling cycles of SINUMERIK: where the tool ends, the reference plane, and the two ways to say how
deep the hole is."""
KNOWN = {81: 6, 82: 6, 83: 12, 84: 12, 85: 8, 86: 11, 87: 6, 88: 7, 89: 6, 840: 11}
"""How many arguments change neither the axis of the hole nor what its depth means."""
FIRST_DEPTH = {83: {5: 1, 6: -1}}
"""Where a cycle says how deep it goes first, as a place, which rises with the bottom, and as a way, which falls."""
ADDED = re.compile(rf"FN ?([12]): ?(Q203) ?= ?\+?\2 ?([+-]) ?({DECIMAL})", re.IGNORECASE)
ASSIGNED = re.compile(rf"(?<!\w)(Q\d+) ?= ?(?:({DECIMAL})(?=[ \t]*(?:~|$|Q\d+ ?=)))?", re.IGNORECASE)
"""A Q parameter that gets a value, and that value if it is a plain number."""
FORMULA = re.compile(r"(?:FN ?[0-7] ?: ?)?(Q[LR]?\d+) ?= ?([^=]+)", re.IGNORECASE)
"""A Q parameter that gets the value of a formula."""
BUSY = re.compile(r"Q1\d\d")
"""Q parameters to which the control itself gives values."""
CALLS = {
    Family.SINUMERIK: re.compile(rf"[ \t]*(?:\bMCALL\b(?:[ \t]*{CYCLE_CALL})?|{CYCLE_CALL})", re.IGNORECASE),
    Family.KLARTEXT: re.compile(rf"[ \t]*(?:CYCL CALL(?![ \t]*\w)|{ADDED.pattern}(?=[ \t]*$)|\bM99\b)", re.IGNORECASE),
}
"""What calls a hole, or gives it another depth."""
NOTHING = re.compile(r"[ \t]*/?\d?[ \t]*(?:N[ \t]*\d+)?[ \t]*(?:;.*)?", re.IGNORECASE)
"""What a line has besides that does nothing."""


class HoleCall(NamedTuple):
    """A drilling cycle with plain numbers, in units of the program.

    values  arguments, or Q200, Q201, Q203 and Q204; of word addresses R
    depths  which of them a correction changes, and whether they rise (1) or fall (-1) with the bottom
    bottom  where the hole ends; NaN: not known
    level   where the tool stands after it
    """

    name: str
    values: tuple[float | None, ...]
    depths: Mapping[int, int]
    bottom: float
    level: float

    @classmethod
    def of_arguments(cls, text: str) -> HoleCall | None:
        """The call of a cycle of SINUMERIK; None if it has arguments that this reader does not know."""
        name, _, inside = text.upper().rstrip(" \t)").partition("(")
        number = int(name.strip().removeprefix("CYCLE"))
        values = tuple(float(each) if each.strip() else None for each in inside.split(","))
        if len(values) <= DP or any(values[KNOWN[number] :]):
            return None
        clear, reference, deep, way = ((*values, None)[place] for place in (RTP, RFP, DP, DPR))
        if clear is None or (deep is None and not way) or (deep is not None and way) or (way and reference is None):
            return None
        if way and reference is not None:
            deep = reference - way if clear >= reference else reference + way
        assert deep is not None
        said = {DP: 1, DPR: -1} | FIRST_DEPTH.get(number, {})  # a way of zero is none
        given = {at: values[at] for at in said if at < len(values)}
        depths = {at: said[at] for at, value in given.items() if value is not None and (value or said[at] > 0)}
        return cls(name.strip(), values, depths, deep, clear)

    @classmethod
    def of_parameters(cls, number: int, parameters: Mapping[str, float | None]) -> HoleCall:
        """Cycle 200 and its like of Klartext, as its parameters stand."""
        values = tuple(parameters.get(name) for name in ("Q200", "Q201", "Q203", "Q204"))
        gap, deep, surface, second = (NAN if value is None else value for value in values)
        if not deep or (number == 240 and parameters.get("Q343", 0.0) != 0.0):
            surface = NAN
        return cls(str(number), values, {2: 1}, surface + deep, surface + max(gap, second))

    def differs_in_depth_only(self, other: HoleCall, digit: float) -> bool:
        """Whether another call makes the same hole up to its depth: what changes follows that to a digit."""
        if self.name != other.name or len(self.values) != len(other.values):
            return False
        risen = other.bottom - self.bottom
        for place, (mine, its) in enumerate(zip(self.values, other.values, strict=True)):
            sense = self.depths.get(place, 0)
            if mine == its:
                continue
            if mine is None or its is None or not sense or not abs(its - mine - sense * risen) <= digit:
                return False
        return True


def assign(text: str, parameters: dict[str, float | None]) -> None:
    """Take in what a line of Klartext says of Q parameters; of those whose value is not known it takes in that."""
    code = text.partition(";")[0].strip(" \t~")
    if found := ADDED.match(code):
        before, change = parameters.get("Q203"), float(found[4].replace(",", "."))
        if (found[1] == "1") != (found[3] == "+") or before is None:
            parameters["Q203"] = None
        else:
            parameters["Q203"] = before + (change if found[1] == "1" else -change)
        return
    if found := FORMULA.fullmatch(code):
        formula = found[2].replace(",", ".").replace("DIV", "/")
        parameters[found[1].upper()] = None if BUSY.fullmatch(found[1]) else value_of(formula, parameters)
        return
    for name, number in ASSIGNED.findall(code):
        parameters[name.upper()] = float(number.replace(",", ".")) if number else None


def hole_text(family: Family, lines: Sequence[TextLine]) -> list[str]:
    """What the lines of a hole say besides the call of the cycle, word by word."""
    return " ".join(CALLS[family].sub("", line.rest) for line in lines).split()


def puts_back(call: HoleCall, lines: Sequence[TextLine]) -> bool:
    """Whether the lines that stand for a hole leave the cycle as it was: Q203 for one, or a modal call."""
    changes = (found for line in lines if not line.path and (found := ADDED.search(line.rest)))
    risen = sum(float(found[4].replace(",", ".")) * (1 if found[1] == "1" else -1) for found in changes)
    later = (found for line in lines[1:] if (found := re.search(CYCLE_CALL, line.rest.upper())))
    return abs(risen) < 1e-9 and all(HoleCall.of_arguments(found[0]) == call for found in later)


def calls_only(family: Family, line: TextLine) -> bool:
    """Whether a line does nothing but call a hole, or give it another depth."""
    if line.path or family not in CALLS:
        return False
    left = CALLS[family].sub("", line.rest, 1)
    return left != line.rest and NOTHING.fullmatch(left) is not None
