"""Short SINUMERIK programs followed on a machine whose frames, tools and start position are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from ncfix.control.moves import Kinematics, Trace
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.text.reader import read

ZERO = dict.fromkeys("XYZABC", 0.0)
SYSTEMS = ("G500", "G54", "G55", "G56", "G57", "G505", "G599")
KNOWN = Setup(
    work_offsets=dict.fromkeys(SYSTEMS, ZERO),
    tools={number: Tool(0.0, 5.0) for number in range(20)},
    initial=ZERO,
)
"""Everything is known and zero."""


def follow(
    text: str,
    axes: str = "XYZ",
    setup: Setup = KNOWN,
    files: Mapping[str, str] | None = None,
    kinematics: Kinematics | None = None,
    **given: object,
) -> Trace:
    """The trace of a program; an M30 is put at its end unless it has one. `given` replaces fields of the setup."""
    ended = text if "M30" in text else f"{text}\nM30\n"
    program = read(ended.encode("latin-1"), "part.mpf", "siemens")
    texts = {name.upper(): content.encode() for name, content in (files or {}).items()}
    resolve: Callable[[str], bytes | None] = texts.get
    rotary = frozenset("ABC") & set(axes)
    return trace(program, replace(setup, **given), tuple(axes), rotary, resolve, kinematics=kinematics)  # type: ignore[arg-type]
