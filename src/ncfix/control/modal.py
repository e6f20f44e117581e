"""The modal state: what one block sets and later blocks rely on."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from ncfix.control.coordinates import PLANES, Plane, Vector, zeros

NO_MOTION = 800
"""G80: no motion code is in force; the state at the start of a program."""


@dataclass(slots=True)
class Cycle:
    """What of a canned cycle stays in force.

    depth    the word of the axis across the plane, as written
    r        the R word, as written
    level    R in the program's frame, mm
    initial  where the series of holes began, across the plane, mm in the program's frame; None while none is in force
    runtime  one of these is known only at run time
    """

    depth: float = 0.0
    r: float = 0.0
    level: float = 0.0
    initial: float | None = None
    runtime: bool = False


@dataclass(slots=True)
class Modal:
    """What is in force. G codes in tenths.

    motion        motion code
    straight      the last of G0 and G1
    plane         of arcs and cycles
    unit          mm per unit of linear words
    diameter      X words are diameters (G7)
    incremental   G91
    arc_absolute  G90.1
    feed_mode     93, 94 or 95
    feed          mm/min, 1/min or mm/rev; NaN where none is set, or one that is known only at run time
    feed_given    a feed other than zero is set
    speed         S
    retract_to_r  G99: canned cycles end at R
    compensated   41, 42 or 0: cutter radius compensation
    system        1..9: G54..G59.3
    tool_code     430 while a tool length offset is in force, 490 without
    spindle       3, 4 or 5
    """

    motion: int = NO_MOTION
    straight: int = NO_MOTION
    plane: Plane = PLANES[170]
    unit: float = 1.0
    diameter: bool = False
    incremental: bool = False
    arc_absolute: bool = False
    feed_mode: int = 94
    feed: float = math.nan
    feed_given: bool = False
    speed: float = 0.0
    retract_to_r: bool = False
    compensated: int = 0
    system: int = 1
    tool_code: int = 490
    spindle: int = 5
    cycle: Cycle = field(default_factory=Cycle)


@dataclass(frozen=True, slots=True)
class Saved:
    """A modal state that M70 or M73 has saved; `at_return`: it is restored when the subprogram returns."""

    modal: Modal
    at_return: bool


@dataclass(slots=True)
class Tools:
    """Tool numbers: prepared with T, in the spindle, and of the length offset in force.

    vector    the length offset in force, mm along each axis (rad)
    register  the number by which contours get their radius (D), where that is not the tool's
    cutter    the radius by which contours are offset, mm, where the program says it; NaN where it does not
    lengths   lengths that the program has set (G10 L1), mm
    measured  tools whose length it has set from what is known only at run time
    """

    selected: int = 0
    spindle: int = 0
    offset: int | None = None
    vector: Vector = field(default_factory=zeros)
    register: int | None = None
    cutter: float = math.nan
    lengths: dict[int, float] = field(default_factory=dict)
    measured: set[int] = field(default_factory=set)
