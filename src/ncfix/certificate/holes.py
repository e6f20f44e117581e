"""The second reader: drilling cycles of SINUMERIK and Klartext, and the lines in which a correction writes one hole.

In both languages the call of a cycle gives the depth. A correction moves the tool over the place by words of axes. For
another depth it gives a hole a call of its own (MCALL before and behind it), or moves the surface to which the depth
refers (FN 1 and FN 2 on Q203).
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
"""Places of common arguments of all drilling cycles of SINUMERIK: retraction plane, reference plane, final depth
absolute, and final depth relative to the reference plane."""
KNOWN = {81: 6, 82: 6, 83: 12, 84: 12, 85: 8, 86: 11, 87: 6, 88: 7, 89: 6, 840: 11}
"""Number of arguments that change neither the axis of the hole nor the meaning of its depth."""
FIRST_DEPTH = {83: {5: 1, 6: -1}}
"""Places of the first drilling depth: absolute, which rises with the bottom (1), and relative, which falls (-1)."""
ADDED = re.compile(rf"FN ?([12]): ?(Q203) ?= ?\+?\2 ?([+-]) ?({DECIMAL})", re.IGNORECASE)
ASSIGNED = re.compile(rf"(?<!\w)(Q\d+) ?= ?(?:({DECIMAL})(?=[ \t]*(?:~|$|Q\d+ ?=)))?", re.IGNORECASE)
"""An assignment to a Q parameter, with its value if that is a plain number."""
FORMULA = re.compile(r"(?:FN ?[0-7] ?: ?)?(Q[LR]?\d+) ?= ?([^=]+)", re.IGNORECASE)
"""An assignment of a formula to a Q parameter."""
BUSY = re.compile(r"Q1\d\d")
"""Q parameters that are set by the control itself."""
CALLS = {
    Family.SINUMERIK: re.compile(rf"[ \t]*(?:\bMCALL\b(?:[ \t]*{CYCLE_CALL})?|{CYCLE_CALL})", re.IGNORECASE),
    Family.KLARTEXT: re.compile(rf"[ \t]*(?:CYCL CALL(?![ \t]*\w)|{ADDED.pattern}(?=[ \t]*$)|\bM99\b)", re.IGNORECASE),
}
"""Text that calls a drilling cycle, or changes the depth of a hole."""
NOTHING = re.compile(r"[ \t]*/?\d?[ \t]*(?:N[ \t]*\d+)?[ \t]*(?:;.*)?", re.IGNORECASE)
"""Further text of a line without effect: block delete, number, comment."""


class HoleCall(NamedTuple):
    """A drilling cycle with plain numbers, in units of the program.

    values  arguments; in Klartext Q200, Q201, Q203 and Q204; in word addresses R
    depths  place in `values` of a depth that a correction changes -> whether it rises (1) or falls (-1) with the bottom
    bottom  bottom of the hole; NaN: not known
    level   level of the tool after the cycle
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
        said = {DP: 1, DPR: -1} | FIRST_DEPTH.get(number, {})  # a way of 0 counts as not given
        given = {at: values[at] for at in said if at < len(values)}
        depths = {at: said[at] for at, value in given.items() if value is not None and (value or said[at] > 0)}
        return cls(name.strip(), values, depths, deep, clear)

    @classmethod
    def of_parameters(cls, number: int, parameters: Mapping[str, float | None]) -> HoleCall:
        """The call of cycle 200 or a similar cycle of Klartext, with the present values of its parameters."""
        values = tuple(parameters.get(name) for name in ("Q200", "Q201", "Q203", "Q204"))
        gap, deep, surface, second = (NAN if value is None else value for value in values)
        if not deep or (number == 240 and parameters.get("Q343", 0.0) != 0.0):
            surface = NAN
        return cls(str(number), values, {2: 1}, surface + deep, surface + max(gap, second))

    def differs_in_depth_only(self, other: HoleCall, digit: float) -> bool:
        """Whether another call makes the same hole at another depth: all changed values follow it within `digit`."""
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
    """Apply the assignments to Q parameters in a line of Klartext; a value that is not known becomes None."""
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
    """The words of the lines of a hole, without the call of the cycle."""
    return " ".join(CALLS[family].sub("", line.rest) for line in lines).split()


def puts_back(call: HoleCall, lines: Sequence[TextLine]) -> bool:
    """Whether the lines of a hole leave the state of the cycle unchanged: Q203, or a modal call."""
    changes = (found for line in lines if not line.path and (found := ADDED.search(line.rest)))
    risen = sum(float(found[4].replace(",", ".")) * (1 if found[1] == "1" else -1) for found in changes)
    later = (found for line in lines[1:] if (found := re.search(CYCLE_CALL, line.rest.upper())))
    return abs(risen) < 1e-9 and all(HoleCall.of_arguments(found[0]) == call for found in later)


def calls_only(family: Family, line: TextLine) -> bool:
    """Whether a line only calls a drilling cycle, or changes the depth of a hole."""
    if line.path or family not in CALLS:
        return False
    left = CALLS[family].sub("", line.rest, 1)
    return left != line.rest and NOTHING.fullmatch(left) is not None
