"""Statements that are known by their first words: they move nothing, or are refused."""

from __future__ import annotations

import re
from collections.abc import Callable

from ncfix.control.expressions import Fault
from ncfix.control.moves import Pass, Passing
from ncfix_heidenhain.klartext.codes import tip_control
from ncfix_heidenhain.klartext.contours import follow_free
from ncfix_heidenhain.klartext.control import AFTER_PROBING, PRESET, KlartextControl
from ncfix_heidenhain.klartext.flow import KlartextFlow
from ncfix_heidenhain.klartext.patterns import pattern_of
from ncfix_heidenhain.klartext.transformations import is_plain, trans

PROBING = Passing(Pass.PROBING, "probing")
MEASURED = "TCH PROBE {} makes what it measures the datum, a rotation or the kinematics: that is known only at run time"
SETTING = frozenset({*range(400, 406), *range(408, 420), 451, 452, 453, *range(1400, 1430)})
"""Probing cycles that do not only measure."""

SPATIAL_ANGLES = "FUNCTION TCPM AXIS SPAT: A B C are spatial angles, not positions of axes"
OTHER_POINT = "FUNCTION TCPM with a reference point other than the tip"
SELECTED = "PRESET SELECT with words of its own, or while coordinates are transformed, is not followed"
ERROR = "NCF278"
PROBED = range(100, 200)
"""The Q parameters in which probing cycles and the control itself leave results."""

IN_A_ROW = 4
"""So many parameters, from the one that is named, an old probing cycle (0 to 4) may write."""

TARGET = re.compile(r"(Q[LRS]?)(\d+)", re.IGNORECASE)
CIRCLE = re.compile(r"FN\s*2[34]\b", re.IGNORECASE)


def statement(control: KlartextControl, flow: KlartextFlow, text: str) -> None:
    """Do what a statement says; one that is not listed moves nothing."""
    for form, do in STATEMENTS:
        if found := form.match(text):
            do(control, flow, found)
            return


# -- other programs ---------------------------------------------------------------------------------------------------


def call_program(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """CALL PGM."""
    flow.call_program(match["name"].strip())


def select_program(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """SEL PGM: the program that CALL SELECTED PGM calls; one whose name is in a parameter is known only at run time."""
    name = match["name"].strip()
    flow.selected = "" if TARGET.fullmatch(name) else name


def call_selected(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """CALL SELECTED PGM."""
    if flow.selected:
        flow.call_program(flow.selected)
    else:
        control.refusal = control.refusal or "the program that is called is chosen at run time"


def error(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """FN 14: the program stops with an error of its own."""
    raise Fault(ERROR, f"the program stops with error {match['number']}", "its own checks refuse its parameters")


# -- what is not followed ---------------------------------------------------------------------------------------------


def not_followed(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """What may change coordinates, or what later blocks do."""
    name = " ".join(match[0].partition(":")[0].split()[:3]).upper()
    control.refusal = control.refusal or f"{name} may change coordinates in a way that is not followed"


def free_contour(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """FL, FLT, FC, FCT."""
    follow_free(control, flow.unit, flow.block - 1)


# -- what is measured and read ----------------------------------------------------------------------------------------


def probe(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """TCH PROBE: the control moves on its own, and leaves results in Q parameters, or sets a datum by them."""
    number = int(match["number"])
    if number in SETTING:
        control.suspended[PRESET] = MEASURED.format(number)
    control.pass_here(PROBING, AFTER_PROBING, "XYZ")
    for each in PROBED:
        control.scope.parameters.assign(f"Q{each}", 0.0, runtime=True)
    lose_parameters(control, match[0], IN_A_ROW if number < PROBED[0] else 1)


def read_values(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """FN 18, 28 and their like put what they read into a Q parameter; FN 23 and 24 into three in a row."""
    lose_parameters(control, match[0].partition("=")[0], 3 if CIRCLE.match(match[0]) else 1)


def lose_parameters(control: KlartextControl, text: str, in_a_row: int) -> None:
    """The Q parameters that a text names, and those behind them, are known only at run time."""
    for letters, number in TARGET.findall(text):
        for offset in range(in_a_row):
            control.scope.parameters.assign(f"{letters.upper()}{int(number) + offset}", 0.0, runtime=True)


# -- coordinates ------------------------------------------------------------------------------------------------------


def holes(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """PATTERN DEF; the holes of SEL PATTERN are in a table that is not read."""
    control.cycle.places = pattern_of(match[0], control.scope.parameters)


def change_coordinates(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """TRANS."""
    trans(control, match[0])


def select_preset(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """PRESET SELECT: a row of the preset table; it ends transformations, unless it is told to keep some."""
    control.suspended.pop(PRESET, None)
    plain = is_plain(control) and not (control.plane_tilted or any(control.frames.programmable.shift))
    if match["rest"].strip() or control.doubtful or not plain:
        control.suspended[PRESET] = SELECTED
        return
    control.load_preset(f"PRESET{int(match['row'])}")


def tcpm(control: KlartextControl, flow: KlartextFlow, match: re.Match[str]) -> None:
    """FUNCTION TCPM and FUNCTION RESET TCPM."""
    control.suspended.pop("tcpm", None)
    words = "" if match["reset"] else " ".join(match["rest"].upper().split())
    control.path.by_vector, control.path.spatial = "PATHCTRL VECTOR" in words, "AXIS SPAT" in words
    if control.path.spatial:
        control.suspended["tcpm"] = SPATIAL_ANGLES
    if "REFPNT" in words and "TIP-TIP" not in words:
        control.suspended["tcpm"] = OTHER_POINT
    tip_control(control, on=not match["reset"])


Do = Callable[[KlartextControl, KlartextFlow, re.Match[str]], None]

FORMS: tuple[tuple[str, Do], ...] = (
    (r"CALL\s+PGM\s*(?P<name>.*)", call_program),
    (r"SEL\s+PGM\s*(?P<name>.*)", select_program),
    (r"CALL\s+SELECTED\b", call_selected),
    (r"FN\s*14\s*:\s*ERROR\s*=?\s*(?P<number>\w*)", error),
    (r"F(LT|L|CT|C)\b", free_contour),
    (r"TCH\s*PROBE\s*(?P<number>\d+).*", probe),
    (r"FN\s*(18|2[0348])\b.*", read_values),
    (r"(PATTERN\s+DEF|SEL\s+PATTERN).*", holes),
    (r"TRANS\b.*", change_coordinates),
    (r"PRESET\s+SELECT\s+#\s*(?P<row>\d+)(?P<rest>.*)", select_preset),
    (r"FUNCTION\s+(?P<reset>RESET\s+)?TCPM\b(?P<rest>.*)", tcpm),
    # FUNCTION statements that leave coordinates as they are; others (turning, parallel axes, corrections, another
    # kinematic model by MODE MILL) may not.
    (
        r"FUNCTION\s+(RESET\s+)?(AFC|DWELL|FEED|S-PULSE|DCM|LIFTOFF|COUNT|MODE\s+MILL\s*\Z|DRESS\s+END|FLUTES|FILE)",
        lambda control, flow, found: None,
    ),
    # FN 17 and 25 write into the control's own data: datums, presets, tools.
    (r"(FUNCTION|FN\s*(17|25)\b|SEL\s+CYCLE|POLARKIN|TCH\s*PROBE).*", not_followed),
)
STATEMENTS = tuple((re.compile(form, re.IGNORECASE | re.DOTALL), do) for form, do in FORMS)
"""Statements by their first words, and what they do."""
