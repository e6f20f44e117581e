"""LinuxCNC (RS274NGC): the dialect `linuxcnc`, and screw compensation files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ncfix.plugin import FOREIGN, Dialect, Register, hookimpl, made_by

if TYPE_CHECKING:
    from collections.abc import Callable

    from ncfix.plugin import Control

LINUXCNC = Dialect(
    name="linuxcnc",
    title="LinuxCNC (RS274NGC)",
    grammar="linuxcnc.lark",
    suffixes=(".ngc",),
    signature=(
        rb"(?im)^[ \t]*o[ \t]*(<[^>\n]+>|\d+)[ \t]*(sub|call|if|while|do|repeat)\b",
        rb"#[ \t]*<[ \t]*_?\w+[ \t]*>",
    ),
    line_limit=252,
    foreign=FOREIGN,
    language="ncfix_iso.rs274.language:RS274",
    semantics="linuxcnc",
    returns=rb"(?i)M[ \t]*0*99(?!\d)|o[ \t]*(?:<[^>]*>|\d+)[ \t]*(?:endsub|return)\b",
    understands=(
        "G0 G1 G2 G3 with centre or radius, helices, full circles, G17 G18 G19",
        "G90 G91, G20 G21, modal words and codes",
        "G54 ... G59.3, G52, G92, G10 L2 L20 (also with R), tool lengths (G43, G43.1, G43.2, G49)",
        "canned cycles G73 G74 G81 ... G89, G98 G99",
        "O-words, parameters and expressions; blocks executed from several states with --flatten",
        "G41 G42: the programmed contour is corrected, the control offsets it",
    ),
    passes=("G53, G28, G30, probing (G38.x), dwell, tool change and other M codes",),
    refuses=(
        "splines (G5), threads (G33, G76), turning cycles, canned cycles with G91 without --flatten",
        "motions that depend on probed or other run-time values, blocks executed from several states without --flatten",
    ),
    feed_of="linear",
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Register the dialect `linuxcnc`."""
    register(LINUXCNC)


@hookimpl
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Register the control `linuxcnc` (`.comp` files)."""
    register(made_by("ncfix_linuxcnc.control:LinuxCnc"), name="linuxcnc")
