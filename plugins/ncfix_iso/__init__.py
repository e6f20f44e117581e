"""Plain ISO 6983 G-code: the dialect `iso`, what the controls have in common."""

from __future__ import annotations

from ncfix.plugin import FOREIGN, TURNING, Dialect, Register, hookimpl

ISO = Dialect(
    name="iso",
    title="ISO 6983 (common G-code)",
    grammar="iso.lark",
    suffixes=(".nc", ".gcode", ".tap", ".cnc", ".ncc", ".iso", ".g", ".gc", ".din", ".eia", ".min"),
    foreign=(*FOREIGN, *TURNING),
    line_limit=65535,
    understands=(
        "G0 G1 G2 G3 with centre or radius, helices, full circles, G17 G18 G19",
        "G90 G91, G20 G21, modal words and codes",
        "G54 ... G59.3, G54.1 P, G52, G92, G10, G68 G69, tool lengths (G43 G44 G49), G43.4 (TCP)",
        "canned cycles G73 G74 G81 ... G89, G98 G99, L and K repeats",
        "M98 M99, parameters and expressions; blocks executed from several states with --flatten",
        "G41 G42: the programmed contour is corrected, the control offsets it",
    ),
    passes=("G53, G28, G30, G31, dwell, G5.1, G8, G61, tool change and other M codes",),
    language="ncfix_iso.rs274.language:RS274",
    semantics="iso",
    returns=rb"(?i)M[ \t]*0*99(?!\d)",
    refuses=(
        "G16, G51, G51.1, G12.1, G68.2 while in force, threads, canned cycles with G91 without --flatten",
        "everything after an unknown G code, or after a G10 whose meaning depends on the control (L10, L20)",
        "blocks executed from several states without --flatten",
        "programs for lathes: turning cycles, G50 S, or G96 and no Y",
    ),
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Register the dialect `iso`."""
    register(ISO)
