"""Siemens SINUMERIK 840D: the dialect `siemens`, sag and angularity tables (CEC, sums, products), encoder tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.plugin import FOREIGN, Dialect, Register, hookimpl, made_by

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ncfix.plugin import Code, Control

SIEMENS = Dialect(
    name="siemens",
    title="Siemens SINUMERIK 840D",
    grammar="siemens.lark",
    suffixes=(".mpf", ".spf", ".arc"),
    signature=(
        *(pattern for family, pattern in FOREIGN if family.startswith("Siemens")),
        rb"(?im)^[ \t]*(?:N\d+[ \t]*)?(?:(?:TRAORI|TRAFOOF|SUPA|STOPRE|MCALL|FFWON|ORI[WM]KS)\b|GOTO[FB][ \t]+[A-Z_])",
        rb"(?im)^[^(;\n]*(?:\b[XYZABC]=(?:AC|IC|DC|ACP|ACN)[ \t]*\(|\b(?:CR|AR|[ABC]3)=[-+.\d])",
    ),
    foreign=(
        *((family, pattern) for family, pattern in FOREIGN if family.startswith("Heidenhain")),
        ("Fanuc-like code (--dialect fanuc)", rb"\A\s*%[ \t]*\r?\n\s*O\d+"),
        (
            "a program that changes to SINUMERIK's ISO language (G291)",
            rb"(?im)^[^(;\"\n]*(?<![A-Z])(G[ \t]*291)(?!\d)",
        ),
    ),
    comment="; {}",
    closure_mm=0.01,
    closure_relative=0.0,
    returns=rb"(?i)(?<![A-Z_])M0*17(?!\d)|(?<!\w)RET(?!\w)",
    understands=(
        "packed words, X=, AC IC DC ACP ACN, R parameters, DEF, arrays, arithmetic, functions of texts",
        "G0 G1 G2 G3 with I J K, CR=, AR=, TURN=; CIP, CT; G90 G91, G70 G71 G700 G710, DIAMON DIAM90",
        "IF WHILE FOR LOOP REPEAT CASE GOTO, labels, PROC with parameters, subprograms in the text or beside it, also "
        "by CALL and EXTCALL",
        "G54 ... G599, G500, TRANS ROT MIRROR and their additive forms, SCALE equal in all axes, G58 G59",
        "TRAORI with rotary words, A3= B3= C3= or A2= B2= C2= (--strategy full corrects the direction)",
        "CYCLE800 axis by axis, by solid or projected angles",
        "CYCLE81 ... CYCLE89, CYCLE840 at the present position or by MCALL",
        "pockets, slots, studs, faces, milled threads (POCKET3, CYCLE61, ...) at their position or by MCALL, as a "
        "whole",
        "polar AP= RP= with G110 ... G112, lines and arcs about the pole",
        "G41 G42 and CUT3D with surface normals: the programmed contour is corrected, the control offsets it",
    ),
    passes=(
        "SUPA, G53, G153, G74, G75, MEAS, the turn of CYCLE800, the depth of drilling cycles, dwell (G4), tool change, "
        "other M codes, feed and path modes (G64x, CYCLE832, COMPCAD, FFWON, SOFT ...)",
    ),
    refuses=(
        "motions that depend on values known only at run time: global data, $ variables, parameters of a PROC that is "
        "corrected by itself",
        "splines, POLY, threads, soft approach, POS and POSA, TRANSMIT, TRACYL, TOROT, coupled axes, fixed stops, axes "
        "and G codes named by variables",
        "LEAD and TILT, ORIPATH, directions under ORIMKS in turned frames; CYCLE800 by rotary axes, or without turning",
        "increments after a frame or tool length has changed; programmed frames over TRAORI; DIAM90 with increments",
        "contours (CYCLE63, CYCLE72), and patterns of holes except HOLES1, HOLES2, CYCLE802 with --flatten",
        "everything after an unknown block or a synchronized action",
        "blocks executed from several states, without --flatten",
    ),
    language="ncfix_siemens.sinumerik.language:SINUMERIK",
    most_inverse_time=999999.999,
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Register the dialect `siemens`."""
    register(SIEMENS)


def sinumerik_codes() -> Mapping[str, Code]:
    """What the messages about SINUMERIK programs mean."""
    from ncfix_siemens.codes import SINUMERIK_CODES

    return SINUMERIK_CODES


@hookimpl
def register_codes(register: Register[Callable[[], Mapping[str, Code]]]) -> None:
    """Register the codes of the messages about SINUMERIK programs."""
    register(sinumerik_codes, name="sinumerik")


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Register the control `siemens`: CEC and EEC tables."""
    register(made_by("ncfix_siemens.control:Siemens"), name="siemens")
