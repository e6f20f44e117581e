"""A skeleton of the program that takes a machine to the poses of a plan. Probing itself is the control's own cycle."""

from __future__ import annotations

import numpy as np

from ncfix.machine import Machine
from ncfix.measure.candidates import APPROACH
from ncfix.measure.measurement import Measurement
from ncfix.measure.writer import number

READ = dict(zip("XYZ", ("mx", "my", "mz"), strict=True))


def skeleton(plan: Measurement, machine: Machine) -> str:
    """G-code in machine coordinates, one stop a pose; each axis comes from the side that the plan asks for."""
    lines = [
        "%",
        f"(MEASUREMENT PLAN, KIND {plan.kind.upper()}, {len(plan)} POSES)",
        "(A SKELETON: CHECK FOR COLLISIONS, ADD SAFE HEIGHTS AND THE PROBING CYCLE)",
        *(f"({text.upper()})" for key, text in plan.headers if key == "note"),
        "G21 G90 G94",
    ]
    for row in range(len(plan)):
        lines += _pose(plan, machine, row)
    return "\n".join([*lines, "M30", "%", ""])


def _pose(plan: Measurement, machine: Machine, row: int) -> list[str]:
    """Go to one pose and stop."""
    words, back = [], []
    for axis in machine.axes:
        column = READ[axis.name] if axis.name in READ and READ[axis.name] in plan.columns else axis.name
        value = float(plan.column(column)[row])
        side = float(np.sign(plan.column(f"dir_{axis.name}")[row]))
        step = APPROACH["rotary" if axis.rotary else "linear"]
        words.append(f"{axis.name}{number(value)}")
        back.append(f"{axis.name}{number(value - side * step)}")
    what = " ".join(f"{name.upper()} {values[row]}" for name, values in plan.labels.items())
    tool = f" TOOL LENGTH {number(float(plan.columns['tool_length'][row]))}" if "tool_length" in plan.columns else ""
    head = [f"N{10 * (row + 1)} (POSE {row + 1} {what}{tool})"]
    if back != words:
        head.append(f"G53 G0 {' '.join(back)}")
    return [*head, f"G53 G0 {' '.join(words)}", "G4 P2", "(PROBE HERE)", "M0"]
