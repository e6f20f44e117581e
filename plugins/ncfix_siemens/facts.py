"""What is known of the format, what is assumed, and what to do at the machine."""

from __future__ import annotations

from ncfix.tables.control import Assumption, Properties
from ncfix.tables.table_files import DEGREE

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
    "Settle the assumptions below on the machine, sign and products first (ncfix export siemens --probe).",
    "MD18342 $MN_MM_CEC_MAX_POINTS[t] (EEC: MD38000 $MA_MM_ENC_COMP_MAX_POINTS) at least as in the remarks; NCK reset.",
    "MD32710 $MA_CEC_ENABLE = 0 (EEC: MD32700 $MA_ENC_COMP_ENABLE = 0) for all axes.",
    "MD32720 $MA_CEC_MAX_SUM as in the remarks: it stops the worst if an assumption is wrong.",
    "Run the files as part programs, or load them as archives.",
    "SD41300 $SN_CEC_TABLE_ENABLE[t] = 1 for every table, MD32710 = 1 (EEC: MD32700 = 1); NCK reset.",
    "Reference all axes: only then tables act. The display of machine coordinates does not show them.",
    "Measure one line again: the error must have become smaller, not twice as large.",
)
OFF = "MD32710 $MA_CEC_ENABLE = 0 for every axis (EEC: MD32700 = 0), or SD41300 $SN_CEC_TABLE_ENABLE[t] = 0 by table."
