"""Plain ISO 6983 G-code: the dialect `iso`, what the controls have in common."""

from __future__ import annotations

from ncfix.hookspecs import Register, hookimpl
from ncfix.program.dialect import FOREIGN, Dialect

ISO = Dialect(
    name="iso",
    title="ISO 6983 (common G-code)",
    grammar="iso.lark",
    suffixes=(".nc", ".gcode", ".tap", ".cnc", ".ncc", ".iso", ".g", ".gc", ".din", ".eia", ".min"),
    foreign=FOREIGN,
    line_limit=65535,
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Bring the dialect `iso`."""
    register(ISO)
