"""Properties, assumptions and settings of SINUMERIK tables, and two probe files that verify assumptions on the machine.

No public text states the sign of the values or what a product adds. The probes move an axis, read by a dial gauge.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from ncfix.diagnostics import RefusedError
from ncfix.machine import Machine
from ncfix.tables.control import Assumption, Option, Properties, one_of, whole, wrong_setting
from ncfix.tables.scheme import Limits
from ncfix.tables.table_files import DEGREE, in_order
from ncfix.values import frozen
from ncfix_siemens.tables import PLACES, CecStyle, CecTable, cec_text

PROPERTIES = Properties(
    value_sign="CEC: as --set value_sign says; EEC: error",
    input_signal="CEC: setpoint; EEC: actual position of the encoder",
    position_frame="machine coordinates",
    unit="mm, degree; multipliers are plain numbers",
    quantum=(1e-7, 1e-7 * DEGREE),
    extrapolation="the value of the first or last point is held; tables over a whole turn repeat",
    bidirectional=True,
    max_points=5000,
    max_tables=128,
    combine="sum of all tables for an axis, and of products of pairs",
)
ASSUMPTIONS = (
    Assumption(
        "SIEMENS-1",
        "The sign of CEC values is what --set value_sign says. (EEC values are errors: the manual says so.)",
        "none public; figures and the thesis's Eq. 51 lean to errors",
        "none: it must be given",
        "ncfix export siemens --probe; PROBE_SIGN_CEC.INI moves X by 0.01 mm.",
    ),
    Assumption(
        "SIEMENS-2",
        "A product adds what --set product_terms says: itself only, or its factors by themselves, too.",
        "open; the 802D manual's boring mill and Esmaeili (2021), section 7.4, only make sense as `only`",
        "none: it must be given where tables are multiplied",
        "ncfix export siemens --probe; PROBE_PRODUCT_CEC.INI: 0.02, 0.22, 0.12 or 0.32 mm.",
    ),
    Assumption(
        "SIEMENS-3",
        "MULT_BY_TABLE is the number of a table, its index plus one; a table that multiplies may serve several others "
        "for the same output axis.",
        "Function Manual Extended Functions K3; Esmaeili (2021), section 2.4.5.3",
        "so",
        "The same probe: 0.30 mm or an alarm if it were otherwise.",
    ),
    Assumption(
        "SIEMENS-4",
        "Of a pair with a DIRECTION, the table that points has it, and the product acts that way only.",
        "none public for products",
        "so; the multiplier always has DIRECTION 0",
        "PROBE_PRODUCT_CEC.INI with $AN_CEC_DIRECTION[0] = 1: X moves while it is jogged towards plus only.",
    ),
    Assumption(
        "SIEMENS-5",
        "The control has as many tables and points as the model has, or as --set tables, points say.",
        "828D: 8 x 200, 802D sl: 2 x 350 (manuals); 840D: 40 tables were run by Esmaeili (2021), points are not public",
        "840D: 40 tables of 1000 points",
        "The range of MD18342 $MN_MM_CEC_MAX_POINTS[t] on the machine.",
    ),
    Assumption(
        "SIEMENS-6",
        "Axes are AX1, AX2, ... in the order X Y Z A B C U V W of those that the machine has.",
        "general machine axis names: the manual recommends them",
        "so; --set axes=... gives others",
        "MD10000 $MN_AXCONF_MACHAX_NAME_TAB.",
    ),
    Assumption(
        "SIEMENS-7",
        "Comments are allowed, and a line METRIC is not needed.",
        "comments: 802D manual's example; METRIC: in the thesis's sample only",
        "so; --set metric_line=yes writes it",
        "The control reports a line that it does not understand.",
    ),
)
STEPS = (
    "Back up the control: changing MD18342 formats the static user memory.",
    "Check the assumptions below on the machine, sign and products first (ncfix export siemens --probe).",
    "MD18342 $MN_MM_CEC_MAX_POINTS[t] (EEC: MD38000 $MA_MM_ENC_COMP_MAX_POINTS) at least as in the remarks; NCK reset.",
    "MD32710 $MA_CEC_ENABLE = 0 (EEC: MD32700 $MA_ENC_COMP_ENABLE = 0) for all axes.",
    "MD32720 $MA_CEC_MAX_SUM as in the remarks: it limits the damage if an assumption is wrong.",
    "Run the files as part programs, or load them as archives.",
    "SD41300 $SN_CEC_TABLE_ENABLE[t] = 1 for every table, MD32710 = 1 (EEC: MD32700 = 1); NCK reset.",
    "Reference all axes: only then tables act. The display of machine coordinates does not show them.",
    "Measure one line again: the error must have become smaller, not twice as large.",
)
SWITCH_OFF = (
    "MD32710 $MA_CEC_ENABLE = 0 for every axis (EEC: MD32700 = 0), or SD41300 $SN_CEC_TABLE_ENABLE[t] = 0 by table."
)
MODELS = {"840D": (40, 1000), "828D": (8, 200), "802D": (2, 350)}
"""Model -> tables, points per table. 828D, 802D sl: manuals; 40 tables have been run on an 840D (Esmaeili, 2021)."""
BESIDE = {"plus_multiplier": (1, 0), "plus_base": (0, 1), "plus_both": (1, 1)}
"""Setting -> further tables that cancel what a control adds besides a product: per multiplier, and per base."""
MOST_TABLES, MOST_POINTS = 128, 5000
SCHEMES = ("auto", "poly25", "trigo23", "fik40", "fik20")
SIGNS = ("error", "correction")
TERMS = ("only", "plus_multiplier", "plus_base", "plus_both")
"""What a control adds for a product: only the product, or also its multiplier, its base, or both."""
AXIS_NAME = re.compile(r"\w{1,16}", re.ASCII)
YES_NO = one_of("yes", "no")
OPTIONS: Mapping[str, Option] = {
    "value_sign": Option(
        None, "error: values are subtracted from the command; correction: they are added", one_of(*SIGNS), "SIEMENS-1"
    ),
    "product_terms": Option(
        "", "what a product adds: only, plus_multiplier, plus_base, plus_both", one_of(*TERMS), "SIEMENS-2"
    ),
    "scheme": Option("auto", "auto, or the thesis's poly25, trigo23, fik40, fik20", one_of(*SCHEMES)),
    "model": Option("840D", "840D (40 tables of 1000 points), 828D (8 of 200), 802D (2 of 350)", one_of(*MODELS)),
    "tables": Option("", "number of tables, if not that of the model", whole(1, MOST_TABLES)),
    "points": Option("", "number of points of a table, if not that of the model", whole(3, MOST_POINTS)),
    "rotary": Option(
        "auto",
        "rotary axes: correct, keep, or auto (correct them unless the tip error is smaller without)",
        one_of("auto", "correct", "keep"),
    ),
    "positioning": Option(
        "cec", "where the tables of an axis over itself are written: cec, or eec (encoder tables)", one_of("cec", "eec")
    ),
    "axes": Option("", "machine axes, e.g. X:AX1,Y:AX2,Z:AX3,A:AX4,C:AX5"),
    "brackets": Option("yes", "axis names in brackets, (AX1), as in the manuals", YES_NO),
    "metric_line": Option("no", "a line METRIC at the top", YES_NO),
    "path_line": Option("", "a path for a line ;$PATH=..."),
}
SIGN_PROBE, PRODUCT_PROBE, PROBE_SHEET = "PROBE_SIGN_CEC.INI", "PROBE_PRODUCT_CEC.INI", "probe.md"
PROBE_SHIFT = 0.01
PROBE_BASE, PROBE_MULTIPLIER = 0.1, 0.2
PROBE_READINGS = {"only": 0.02, "plus_multiplier": 0.22, "plus_base": 0.12, "plus_both": 0.32}
"""Setting `product_terms` -> motion of X in the second probe, mm."""


@frozen
class Settings:
    """The settings, parsed."""

    sign: str
    terms: str
    scheme: str
    model: str
    limits: Limits
    rotary: str
    axes: Mapping[str, str]
    style: CecStyle

    @property
    def eec(self) -> bool:
        """Whether encoder tables are used."""
        return self.limits.own_free


def checked_settings(given: Mapping[str, str], machine: Machine) -> Settings:
    """The settings for a machine; raises `UsageError` NCF485, `RefusedError` NCF484."""
    model = given["model"]
    tables, points = MODELS[model]
    most = int(given["tables"] or tables), int(given["points"] or points)
    limits = Limits(*most, given["positioning"] == "eec", BESIDE.get(given["product_terms"], (0, 0)))
    style = CecStyle(given["brackets"] == "yes", given["metric_line"] == "yes", given["path_line"])
    axes = machine_axes(given["axes"], machine)
    terms, rotary = given["product_terms"], given["rotary"]
    return Settings(given["value_sign"], terms, given["scheme"], model, limits, rotary, axes, style)


def machine_axes(given: str, machine: Machine) -> dict[str, str]:
    """Axis letter -> machine axis, from the setting `axes` or by default; raises `UsageError` NCF485.

    The letter tells whether positions are in mm or degree, so it must fit the axis.
    """
    names = machine.axis_names
    ordered = in_order(machine)
    if not given:
        return {name: f"AX{number}" for number, name in enumerate(ordered, 1)}
    pairs = [pair.strip().partition(":")[::2] for pair in given.split(",")]
    found = {letter.strip().upper(): axis.strip().upper() for letter, axis in pairs}
    fine = all(AXIS_NAME.fullmatch(axis) for axis in found.values()) and len(set(found.values())) == len(pairs)
    if not fine or sorted(found) != sorted(names):
        raise wrong_setting({"axes": given}, "axes", f"LETTER:AXIS for each of {' '.join(names)}, separated by commas")
    return {name: found[name] for name in ordered}


def probe_files(axes: dict[str, str], ranges: dict[str, tuple[float, float]], style: CecStyle) -> dict[str, bytes]:
    """The probe files and their instructions. They move X by a constant, wherever the axes are."""
    if not {"X", "Z"} <= set(axes):
        raise RefusedError.of("NCF484", f"the probe moves X and looks up Z; the machine has {' '.join(axes)}")
    x, z = (_whole(axis, ranges) for axis in "XZ")
    sign = _constant(0, axes["X"], axes["X"], x, PROBE_SHIFT)
    base = _constant(0, axes["X"], axes["X"], x, PROBE_BASE, multiply=2)
    multiplier = _constant(1, axes["Z"], axes["X"], z, PROBE_MULTIPLIER)
    return {
        SIGN_PROBE: cec_text([sign], ["ncfix probe of the sign: X moves by 0.01 mm"], {}, style),
        PRODUCT_PROBE: cec_text([base, multiplier], ["ncfix probe of products: 0.1 times 0.2"], {}, style),
        PROBE_SHEET: _sheet(axes["X"]).encode(),
    }


def _whole(axis: str, ranges: dict[str, tuple[float, float]]) -> tuple[float, float]:
    """The range of an axis, widened to whole millimetres."""
    low, high = ranges[axis]
    return float(np.floor(low)), float(np.ceil(high))


def _constant(
    index: int, source: str, output: str, ends: tuple[float, float], value: float, multiply: int = 0
) -> CecTable:
    step = round(ends[1] - ends[0], PLACES)
    return CecTable(index, source, output, ends[0], step, np.array([value, value]), multiply=multiply)


def _sheet(axis: str) -> str:
    rows = "\n".join(f"| {value:.2f} mm | `product_terms={terms}` |" for terms, value in PROBE_READINGS.items())
    return f"""# Two probes for the compensation of this control

They move {axis} (X) by a constant of at most 0.32 mm; the display of the machine coordinates does not show it. Put a
dial gauge against the spindle in X, with all other compensation tables off. Back up the control first: raising
MD18342 formats memory.

1. MD18342 $MN_MM_CEC_MAX_POINTS[0] and [1] at least 2; NCK reset.
2. MD32710 $MA_CEC_ENABLE[{axis}] = 0; run `{SIGN_PROBE}`; SD41300 $SN_CEC_TABLE_ENABLE[0] = 1; the gauge to zero.
3. MD32710 = 1, reset, reference {axis}. The gauge shows 0.01 mm:

| X moves towards | setting |
|---|---|
| minus | `value_sign=error` |
| plus | `value_sign=correction` |

4. MD32710 = 0; the gauge to zero; run `{PRODUCT_PROBE}`; SD41300 = 1 for tables 0 and 1; MD32710 = 1, reset, reference.

| X moves by | setting |
|---|---|
{rows}
| 0.30 mm, or an alarm | the control multiplies by another rule: do not load products, `--set scheme=poly25` |

5. MD32710 = 0, and take the tables out again.
"""
