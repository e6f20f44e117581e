"""What each kind of measurement has for columns and header lines. docs/formats.md, section 3."""

from __future__ import annotations

import re
from dataclasses import dataclass

STATES = re.compile(r"time_s|load_kgm?|feed_mm_min|spindle_rpm|tool_length|spindle_deg|temp_[a-z0-9_]+")
"""Optional columns of the state that are numbers; directions and labels are apart."""
NOTES = ("instrument", "date", "origin", "operator", "note")
"""Header lines for people."""
COMMON = ("ncfix-measurement", "kind", "noise_um", "noise_urad", *NOTES)


@dataclass(frozen=True, slots=True)
class Kind:
    """The columns of a kind of measurement besides axes and state.

    groups    alternative forms; each is (columns that must be there, what else it may have)
    measured  the columns that the instrument filled in: empty in a plan
    labels    columns that are names, not numbers
    headers   header lines besides the common ones
    any_of    at least one of `measured` is enough
    """

    name: str
    title: str
    required: tuple[str, ...]
    measured: tuple[str, ...]
    optional: tuple[str, ...] = ()
    labels: tuple[str, ...] = ()
    headers: tuple[str, ...] = ()
    any_of: bool = False

    @property
    def columns(self) -> tuple[str, ...]:
        """All columns of its own."""
        return (*self.required, *self.measured, *self.optional)


SHIFTS, TURNS = ("dx", "dy", "dz"), ("rx", "ry", "rz")
CENTRE, ENDS = ("cx", "cy", "cz"), ("ax", "ay", "az", "bx", "by", "bz")

KINDS = {
    kind.name: kind
    for kind in (
        Kind("tcp", "position error of the tool point", (), SHIFTS, headers=("frame", "setup"), any_of=True),
        Kind("tcp6", "position and orientation error", (), SHIFTS + TURNS, headers=("frame", "setup"), any_of=True),
        Kind(
            "probe",
            "axis positions with the stylus in a ball's centre",
            ("ball",),
            ("mx", "my", "mz"),
            labels=("ball",),
            headers=("distance",),
        ),
        Kind(
            "axis",
            "one error motion of one axis",
            ("axis", "component", "position"),
            ("value",),
            optional=("run", "direction"),
            labels=("axis", "component"),
            headers=("point", "setup"),
        ),
        Kind(
            "points",
            "targets in the frame of an instrument that stands on the foundation",
            ("target",),
            ("x", "y", "z"),
            labels=("target",),
            headers=("carried_by", "target", "frame"),
        ),
        Kind(
            "length",
            "distances: a gauge between two positions, or a ball-bar",
            (),
            ("length",),
            optional=("nominal", "radius", *ENDS, *CENTRE),
            headers=("setup",),
        ),
    )
}
CHOICES: dict[str, dict[str, tuple[str, ...]]] = {
    "setup": {
        "tcp": ("ball", "none", "rigid"),
        "tcp6": ("ball", "none", "rigid"),
        "axis": ("line", "none"),
        "length": ("known", "unknown", "none"),
    },
    "frame": {"tcp": ("workpiece", "base"), "tcp6": ("workpiece", "base"), "points": ("instrument", "base")},
    "carried_by": {"points": ("tool", "spindle", "workpiece")},
}
"""What a header line may say, by kind; the first is the default."""
