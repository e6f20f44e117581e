"""LinuxCNC (RS274NGC): the dialect `linuxcnc`."""

from __future__ import annotations

from ncfix.hookspecs import Register, hookimpl
from ncfix.program.dialect import FOREIGN, Dialect

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
    needs_end=True,
    foreign=FOREIGN,
    semantics="linuxcnc",
)


@hookimpl
def register_dialects(register: Register[Dialect]) -> None:
    """Bring the dialect `linuxcnc`."""
    register(LINUXCNC)
