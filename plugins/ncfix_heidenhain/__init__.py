"""Heidenhain controls: the dialect `heidenhain` (Klartext), axis tables (`.COM`, `.CMA`) and KinematicsComp."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.plugin import Dialect, Register, hookimpl, made_by

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ncfix.plugin import Code, Control

BEGIN_PGM = rb"(?im)^[ \t]*(?:/?[ \t]*\d+[ \t]*)?BEGIN[ \t]+PGM\b"
"""The block with which every Klartext program begins."""

HEIDENHAIN = Dialect(
    name="heidenhain",
    title="Heidenhain Klartext",
    grammar="klartext.lark",
    suffixes=(".h",),
    signature=(BEGIN_PGM,),
    foreign=(
        ("a text without BEGIN PGM", rb"(?is)\A(?!.*\bBEGIN[ \t]+PGM\b)"),
        (
            "Klartext with an N before each block number, which must be removed",
            rb"(?im)^[ \t]*/?[ \t]*(N\d+[ \t]+(?:L|CC|TOOL|CYCL|BEGIN|BLK)\b)",
        ),
    ),
    comment="; {}",
    closure_mm=0.016,
    closure_relative=0.0,
    feed_of="all",
    understands=(
        "L, LN, LP, CC with C, CR, CP (helices too), CT, CTP, blocks of words without L; absolute, incremental and "
        "polar words",
        "R0 RL RR, APPR and DEP, RND and CHF: the contour is corrected, the control offsets and rounds it",
        "FMAX, F, decimal points and commas, `~`, block numbers of any kind, MM and INCH",
        "presets (CYCL DEF 247), datum shift (7, TRANS DATUM), mirror (8), rotation (10), scale (11), tool lengths",
        "PRESET SELECT; TRANS MIRROR, ROTATION, SCALE",
        "PLANE SPATIAL, PROJECTED, EULER, VECTOR, POINTS, RELATIV, AXIAL, RESET with STAY, TURN, MOVE, and cycle 19",
        "M128, M129, FUNCTION TCPM; LN with TX TY TZ; M126 and M127",
        "drilling cycles 1, 2, 17, 18, 200-203, 205-209, 240, 241 with M99, M89, CYCL CALL POS",
        "pockets, slots, studs, threads (251-253, 256-258, 262-265, 267): their position and bottom, as a whole",
        "Q parameters, formulas, FN 0 ... FN 13, LBL, CALL LBL with REP, jumps; CALL PGM",
    ),
    passes=(
        "M91 and M92, M140, TCH PROBE, the turn of PLANE ... TURN, DEP without an end, rapids after these",
        "rotary axes that are positioned in a tilted plane, TOOL CALL, BLK FORM, other M codes",
    ),
    refuses=(
        "other cycles with a path of their own, motions in called programs (ncfix does not rewrite them)",
        "free contours (FK): --flatten writes those that have one solution as lines and arcs",
        "patterns (PATTERN DEF with CYCL CALL PAT, cycles 220, 221) without --flatten, which writes their holes out",
        "tables of datums, TCPM with spatial angles or another point than the tip, M114, M138, M144",
        "rotary axes with a datum of their own under M128 or PLANE; increments of more than half a turn under M126",
        "motions after a probing cycle that sets a datum or a rotation, until the program selects a preset",
        "a shift in a rotated frame, mirror with rotation, a scale of single axes: how the control combines them is "
        "not certain",
        "motions that depend on Q parameters that the control sets, blocks executed from several states",
        "a line that is not Klartext, where the control stops; an unknown line, by what it may contain",
    ),
    language="ncfix_heidenhain.klartext.language:KLARTEXT",
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Register the dialect `heidenhain`."""
    register(HEIDENHAIN)


def klartext_codes() -> Mapping[str, Code]:
    """The codes of the messages about Klartext programs, with their explanations."""
    from ncfix_heidenhain.codes import KLARTEXT_CODES

    return KLARTEXT_CODES


@hookimpl
def register_codes(register: Register[Callable[[], Mapping[str, Code]]]) -> None:
    """Register the codes of the messages about Klartext programs."""
    register(klartext_codes, name="klartext")


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Register two controls: `heidenhain` (axis tables) and `heidenhain-kinematics` (KinematicsComp)."""
    register(made_by("ncfix_heidenhain.control:Heidenhain"), name="heidenhain")
    register(made_by("ncfix_heidenhain.kinematics:KinematicsComp"), name="heidenhain-kinematics")
