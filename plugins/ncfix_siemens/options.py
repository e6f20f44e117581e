"""The settings of the control `siemens`, checked."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from ncfix.machine import Machine
from ncfix.tables.control import Option, one_of, whole, wrong_setting
from ncfix.tables.scheme import Limits
from ncfix.tables.table_files import in_order
from ncfix_siemens.cec import Style
from ncfix_siemens.combine import TERMS

MODELS = {"840D": (40, 1000), "828D": (8, 200), "802D": (2, 350)}
"""Tables and points of each. 828D and 802D sl from the manuals; 40 tables have been run on an 840D (Esmaeili, 2021)."""
BESIDE = {"plus_multiplier": (1, 0), "plus_base": (0, 1), "plus_both": (1, 1)}
"""Tables that take off again what a control adds besides a product: of its multiplier, and of what it multiplies."""
MOST_TABLES, MOST_POINTS = 128, 5000
SCHEMES = ("auto", "poly25", "trigo23", "fik40", "fik20")
SIGNS = ("error", "correction")
AXIS = re.compile(r"\w{1,16}", re.ASCII)

YES_NO = one_of("yes", "no")

OPTIONS: Mapping[str, Option] = {
    "value_sign": Option(
        None, "error: values are taken off commands; correction: they are added", one_of(*SIGNS), "SIEMENS-1"
    ),
    "product_terms": Option(
        "", "what a product adds: only, plus_multiplier, plus_base, plus_both", one_of(*TERMS), "SIEMENS-2"
    ),
    "scheme": Option("auto", "auto, or the thesis's poly25, trigo23, fik40, fik20", one_of(*SCHEMES)),
    "model": Option("840D", "840D (40 tables of 1000 points), 828D (8 of 200), 802D (2 of 350)", one_of(*MODELS)),
    "tables": Option("", "most tables, if not those of the model", whole(1, MOST_TABLES)),
    "points": Option("", "most points of a table, if not those of the model", whole(3, MOST_POINTS)),
    "rotary": Option(
        "auto",
        "correct the rotary axes, too: correct, keep, or auto: unless the tip is better without",
        one_of("auto", "correct", "keep"),
    ),
    "positioning": Option(
        "cec", "where an axis over itself goes: cec, or eec, the encoder tables", one_of("cec", "eec")
    ),
    "axes": Option("", "machine axes, e.g. X:AX1,Y:AX2,Z:AX3,A:AX4,C:AX5"),
    "brackets": Option("yes", "axis names in brackets, (AX1), as in the manuals", YES_NO),
    "metric_line": Option("no", "a line METRIC at the top", YES_NO),
    "path_line": Option("", "a path for a line ;$PATH=..."),
}


@dataclass(frozen=True, slots=True)
class Settings:
    """All of them, in a form to work with."""

    sign: str
    terms: str
    scheme: str
    model: str
    limits: Limits
    rotary: str
    axes: Mapping[str, str]
    style: Style

    @property
    def eec(self) -> bool:
        """Whether encoder tables are used."""
        return self.limits.own_free


def checked(given: Mapping[str, str], machine: Machine) -> Settings:
    """The settings for a machine; raises `UsageError` NCF485, `RefusedError` NCF484."""
    model = given["model"]
    tables, points = MODELS[model]
    most = int(given["tables"] or tables), int(given["points"] or points)
    limits = Limits(*most, given["positioning"] == "eec", BESIDE.get(given["product_terms"], (0, 0)))
    style = Style(given["brackets"] == "yes", given["metric_line"] == "yes", given["path_line"])
    axes = machine_axes(given["axes"], machine)
    terms, rotary = given["product_terms"], given["rotary"]
    return Settings(given["value_sign"], terms, given["scheme"], model, limits, rotary, axes, style)


def machine_axes(given: str, machine: Machine) -> dict[str, str]:
    """Axis letter -> machine axis. The letter tells whether a position is in degree, so it must be one of its kind."""
    names = machine.axis_names
    ordered = in_order(machine)
    if not given:
        return {name: f"AX{number}" for number, name in enumerate(ordered, 1)}
    pairs = [pair.strip().partition(":")[::2] for pair in given.split(",")]
    found = {letter.strip().upper(): axis.strip().upper() for letter, axis in pairs}
    fine = all(AXIS.fullmatch(axis) for axis in found.values()) and len(set(found.values())) == len(pairs)
    if not fine or sorted(found) != sorted(names):
        raise wrong_setting({"axes": given}, "axes", f"LETTER:AXIS for each of {' '.join(names)}, separated by commas")
    return {name: found[name] for name in ordered}
