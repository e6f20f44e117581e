"""Fanuc and similar controls: dialects `fanuc`, `haas`, `mitsubishi`, and Fanuc's three-dimensional compensation."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ncfix.plugin import FOREIGN, TURNING, Dialect, Register, hookimpl, made_by

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.plugin import Control

VERICUT = ("the subroutine language of VERICUT", rb"(?im)^[ \t]*CGTECH_MACRO\b")
O_WORDS = (
    "LinuxCNC code",
    rb"(?im)^[ \t]*o[ \t]*(?:<[^>\n]+>|\d+)[ \t]*(?:sub|call|if|while|do|repeat)\b|#[ \t]*<[ \t]*_?\w",
)

FANUC = Dialect(
    name="fanuc",
    title="Fanuc (ISO with Macro B)",
    grammar="fanuc.lark",
    suffixes=(".fan", ".fnc"),
    signature=(
        rb"(?im)^[^(;\n]*(?<![A-Z])(?:IF|WHILE)[ \t]*\[[^\n]*\][ \t]*(?:GOTO|THEN|DO)[ \t]*[\d#\[]",
        rb"(?im)^[ \t/]*(?:N\d+[ \t]*)?GOTO[ \t]*[\d#]",
        rb"(?im)^[^(;\n]*(?<![A-Z])G[ \t]*(?:6[56][ \t]*P|5\.1[ \t]*Q|(?:66\.1|68\.2|43\.[45]|54\.1|53\.1)(?!\d))",
        rb"(?im)^[^(;\n]*(?<![A-Z])M[ \t]*98[ \t]*<",
        rb"(?im)^[^(;\n]*,[ \t]*[RCA][ \t]*[-+]?[\d.#\[]",
        rb"(?m)^[ \t/]*(?:N\d+[ \t]*)?#[ \t]*\d+[ \t]*=[ \t]*[-+]?[ \t]*[\d.#][\d.# \t]*[-+*/]",
    ),
    foreign=(*FOREIGN, VERICUT, O_WORDS, *TURNING),
    upper_case=True,
    closure_mm=0.01,
    decimal_inches=True,
    most_inverse_time=9999.999,
    language="ncfix_fanuc.macro.language:FANUC",
    semantics="fanuc",
    returns=rb"(?i)M[ \t]*0*99(?!\d)",
    understands=(
        "G0 G1 G2 G3 with centre or radius, helices, full circles, G17 G18 G19",
        "G90 G91, G20 G21, modal words; numbers without a decimal point by --no-point (never dropped, never added)",
        "G54 ... G59, G54.1 P, G52, G92, G10 L2 L10 L20, G68 G69, G51.1, tool lengths (G43 G44 G49, H alone)",
        "TCP (G43.4), the direction of the tool as a vector (G43.5 with I J K)",
        "tilted planes by angles, points and vectors (G68.2 P0 ... P3, G53.1, G53.6, G69)",
        "canned cycles G73 G74 G76 G81 ... G89, G98 G99, L and K repeats: depth and R are corrected hole by hole",
        "corners that the control rounds or breaks (,R ,C)",
        "M98 M99 M198, G65 G66 G67, Macro B: variables, vacancy, IF GOTO THEN WHILE DO END, functions, modal system "
        "variables; blocks executed from several states with --flatten",
        "polar coordinates (G15 G16) and scaling (G50 G51, one factor) with --flatten",
        "circular pockets (G12 G13) of Haas and Mitsubishi as a whole; patterns of holes (Haas: G70 G71, Mitsubishi: "
        "G34 ... G37.1) with --flatten",
        "G41 G42: the programmed contour is corrected, the control offsets it",
    ),
    passes=(
        "G53, G27, G28, G30, G31, the turn of G53.1, dwell (G4), G5.1, G8, G61 ... G64, tool change, other M codes",
        "calls of programs in the control (O8000 to O9999: of the probe's or the machine's builder)",
    ),
    refuses=(
        "G68.3, G68.4, G68.2 P4, G54.2, G54.4, G12.1 while in force, threads, lines by their angle (,A)",
        "arcs and rotary words under G43.5, and its Q",
        "G29, and pockets and texts that the control mills with one code (Haas: G47, G150)",
        "the first block after G68 or G69, if it names only one axis of the plane",
        "motions that depend on positions (#5001 ...), inputs or clocks: the correction or the machine changes these "
        "values",
        "everything after an unknown G code, command or setting (G10 L50, #5201)",
        "blocks executed from several states, and canned cycles with G91, without --flatten",
        "programs for lathes: turning cycles (G71 P Q), G50 S, or G96 and no Y",
    ),
)

HAAS = replace(
    FANUC,
    name="haas",
    title="Haas (mill)",
    variant_of="fanuc",
    suffixes=(),
    signature=(
        rb"(?im)^[^(;\n]*(?<![A-Z])G[ \t]*(?:(?:187|150)(?!\d)|154[ \t]*P|47[ \t]*[PE]|103[ \t]*P)",
        rb"(?im)^[^(;\n]*(?<![A-Z])M[ \t]*97[ \t]*P",
    ),
    understands=(*FANUC.understands, "G154 P and G110 ... G129, M97, TCP (G234), the dynamic work offset (G254 G255)"),
    semantics="haas",
)

MITSUBISHI = replace(
    FANUC,
    name="mitsubishi",
    title="Mitsubishi (M700/M800, ISO)",
    variant_of="fanuc",
    suffixes=(),
    signature=(),
    semantics="mitsubishi",
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Register the dialects."""
    for dialect in (FANUC, HAAS, MITSUBISHI):
        register(dialect)


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Register the controls `fanuc` and `fanuc-rotary`, grids in space, and `fanuc-pitch`, stored pitch errors."""
    register(made_by("ncfix_fanuc.control:Fanuc"), name="fanuc")
    register(made_by("ncfix_fanuc.rotary:FanucRotary"), name="fanuc-rotary")
    register(made_by("ncfix_fanuc.pitch:FanucPitch"), name="fanuc-pitch")
