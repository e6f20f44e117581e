"""Statements that are known by their first words: they move nothing, or are refused."""

from __future__ import annotations

import re

from ncfix.program.klartext.codes import tip_control
from ncfix.program.klartext.control import AFTER_PROBING, FREELY, PRESET, Control
from ncfix.program.klartext.flow import FlowControl
from ncfix.program.klartext.patterns import pattern_of
from ncfix.program.klartext.step import IN_PLANE, somewhere
from ncfix.program.klartext.targets import command_of, here
from ncfix.program.klartext.trans import transform
from ncfix.program.rs274.coordinates import X, Y
from ncfix.program.rs274.faults import Fault

PROBING = "probing"
MEASURED = "TCH PROBE {} makes what it measures the datum, a rotation or the kinematics: that is known only at run time"
SETTING = frozenset({*range(400, 406), *range(408, 420), 451, 452, 453, *range(1400, 1430)})
"""Probing cycles that do not only measure."""

FREE_CONTOUR = "free contour programming (FK): the control works out the contour from what is known of it"
ERROR = "NCF278"
PROBED = range(100, 200)
"""The Q parameters in which probing cycles and the control itself leave results."""

TARGET = re.compile(r"(Q[LRS]?)(\d+)")
CIRCLE = re.compile(r"FN\s*2[34]\b", re.IGNORECASE)
READING = re.compile(r"FN\s*(18|2[0348])\b", re.IGNORECASE)
PROGRAM_NAME = re.compile(r"CALL\s+PGM\s*(?P<name>.*)", re.IGNORECASE | re.DOTALL)
FREE = re.compile(r"F(LT|L|CT|C)\b", re.IGNORECASE)
TCPM = re.compile(r"FUNCTION\s+(?P<reset>RESET\s+)?TCPM\b(?P<rest>.*)", re.IGNORECASE | re.DOTALL)
STOPPING = re.compile(r"FN\s*14\s*:\s*ERROR\s*=?\s*(?P<number>\w*)", re.IGNORECASE)
HARMLESS_FUNCTIONS = re.compile(
    r"FUNCTION\s+(RESET\s+)?(FEED|S-PULSE|DCM|LIFTOFF|COUNT|MODE\s+MILL|MODE\s+SET|DRESS\s+END|FLUTES|FILE|TCPM)",
    re.IGNORECASE,
)
"""FUNCTION statements that leave coordinates as they are; others (turning, parallel axes, corrections) may not."""

WRITING = re.compile(r"FN\s*(17|25)\b", re.IGNORECASE)
"""They write into the control's own data: datums, presets, tools."""

CHOSEN_PRESET = re.compile(r"PRESET\s+SELECT\s+#\s*(?P<row>\d+)(?P<rest>.*)", re.IGNORECASE | re.DOTALL)
SELECTED = "PRESET SELECT with words of its own, or while coordinates are transformed, is not followed"
CHOSEN = re.compile(r"(SEL\s+(PGM|CYCLE|TABLE)|CALL\s+SELECTED|POLARKIN)", re.IGNORECASE)


def statement(control: Control, flow: FlowControl, text: str) -> None:
    """Do what a statement says."""
    if found := PROGRAM_NAME.match(text):
        flow.call_program(found["name"].strip())
    elif found := TCPM.match(text):
        tcpm(control, found)
    elif found := STOPPING.match(text):
        raise Fault(ERROR, f"the program stops with error {found['number']}", "its own checks refuse its parameters")
    elif FREE.match(text):
        free_contour(control)
    elif re.match(r"TCH\s*PROBE", text, re.IGNORECASE):
        probe(control, text)
    elif found := CHOSEN_PRESET.match(text):
        select_preset(control, found)
    elif re.match("TRANS", text, re.IGNORECASE):
        transform(control, text)
    elif CHOSEN.match(text):
        name = " ".join(text.split()[:2]).upper()
        control.refusal = control.refusal or f"{name} is not followed"
    elif WRITING.match(text) or (re.match("FUNCTION", text, re.IGNORECASE) and not HARMLESS_FUNCTIONS.match(text)):
        name = " ".join(text.partition(":")[0].split()[:3]).upper()
        control.refusal = control.refusal or f"{name} may change coordinates in a way that is not followed"
    elif re.match(r"PATTERN\s+DEF|SEL\s+PATTERN", text, re.IGNORECASE):
        control.cycle.places = pattern_of(text, control.scope.parameters)
    elif READING.match(text):
        read_values(control, text)


def select_preset(control: Control, found: re.Match[str]) -> None:
    """PRESET SELECT: a row of the preset table; it ends transformations, unless it is told to keep some."""
    trans = control.transformations
    control.suspended.pop(PRESET, None)
    if found["rest"].strip() or trans.tilted or not trans.plain or any(trans.shift) or trans.doubtful:
        control.suspended[PRESET] = SELECTED
        return
    control.load_preset(f"PRESET{int(found['row'])}")


def free_contour(control: Control) -> None:
    """An element of a free contour: as for an arc about a centre of its own, it matters where the one before ends.

    It lies in the working plane: only X and Y of the frame are not known after it.
    """
    where = here(control)
    where.unknown |= {X: FREELY, Y: FREELY}
    somewhere(control, 0, *command_of(control, where, IN_PLANE), FREE_CONTOUR)


def read_values(control: Control, text: str) -> None:
    """FN 18, 28 and their like put what they read into a Q parameter; FN 23 and 24 into three in a row."""
    for letters, number in TARGET.findall(text.partition("=")[0].upper()):
        for offset in range(3):
            control.scope.parameters.assign(f"{letters}{int(number) + offset}", 0.0, runtime=True)
            if not CIRCLE.match(text):
                break


def tcpm(control: Control, found: re.Match[str]) -> None:
    """FUNCTION TCPM and FUNCTION RESET TCPM."""
    control.suspended.pop("tcpm", None)
    control.path.by_vector = control.path.spatial = False
    if found["reset"]:
        tip_control(control, on=False)
        return
    words = found["rest"].upper()
    control.path.spatial = "AXIS SPAT" in " ".join(words.split())
    if control.path.spatial:
        control.suspended["tcpm"] = "FUNCTION TCPM AXIS SPAT: A B C are spatial angles, not positions of axes"
    if "REFPNT" in words and "TIP-TIP" not in words:
        control.suspended["tcpm"] = "FUNCTION TCPM with a reference point other than the tip"
    control.path.by_vector = "PATHCTRL VECTOR" in " ".join(words.split())
    tip_control(control, on=True)


def probe(control: Control, text: str) -> None:
    """TCH PROBE: the control moves on its own, and leaves results in Q parameters, or sets a datum by them."""
    found = re.match(r"TCH\s*PROBE\s*(\d+)", text, re.IGNORECASE)
    if found and int(found[1]) in SETTING:
        control.suspended[PRESET] = MEASURED.format(found[1])
    control.pass_here(PROBING, AFTER_PROBING, "XYZ")
    for number in PROBED:
        control.scope.parameters.assign(f"Q{number}", 0.0, runtime=True)
