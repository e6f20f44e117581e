"""Poses on offer for a further measurement, where axes and tool have been or may go, and what is new about them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ncfix.diagnose.addition import Mask
from ncfix.diagnose.view import View
from ncfix.machine import Machine
from ncfix.measure.candidates import Room, candidates
from ncfix.measure.kinds import STATES
from ncfix.measure.measurement import Array, Measurement

OFFERED = 320
"""Poses among which those to be measured are chosen."""
DRAWN, FEW = 10, 60
"""Times as many are drawn to find those whose tip stays where it was; if these are fewer than so many, others, too."""
LENGTHS = (100.0, 300.0)
"""mm: a short tool, and one as long as a test mandrel; of these one more is used, that which differs most from any."""
OTHER = 50.0
"""mm: a tool that differs by less from one that is there adds nothing."""
ROUNDED = 1e-3
"""mm, degree: by which a pose may be rounded beyond a travel."""
Span = tuple[float, float]


def one_tool_more(tools: tuple[float, ...]) -> tuple[float, ...]:
    """The lengths of the tools, mm, and of one that differs as much as tools do."""
    if tools == (0.0,):
        return (0.0, LENGTHS[0])
    other = max(LENGTHS, key=lambda length: min(abs(length - own) for own in tools))
    apart = min(abs(other - own) for own in tools)
    return (*tools, other) if apart >= OTHER else tools


def travels_of(machine: Machine, spans: Mapping[str, Span], kept: Collection[str] = ()) -> dict[str, Span]:
    """The ranges of the machine where it has them, else what was measured; the latter also of axes that are kept."""
    found = {}
    for axis in machine.axes:
        low, high = (limit / axis.unit for limit in axis.range)
        first, last = spans[axis.name]
        bounded = np.isfinite([low, high]).all() and axis.name not in kept
        found[axis.name] = (min(low, first), max(high, last)) if bounded else (first, last)
    return found


def poses_on_offer(
    view: View, ranges: Mapping[str, Span], lengths: Sequence[float], roaming: bool = False
) -> Measurement:
    """Poses within these ranges, with these tools, whose tip stays where it has been if there are such.

    Of tools that are shorter than one that was used it may also be elsewhere where they are `roaming`.
    """
    loads = view.column("load_kg")
    inputs = {"load_kg": (float(loads.min()), float(loads.max()))} if "load_kg" in view.reach.columns else {}
    room = Room(ranges=ranges, tool_lengths=lengths, inputs=inputs)
    drawn = candidates(view.machine, "tcp", DRAWN * OFFERED, room)
    inside = stays_where_it_was(view, drawn)
    if roaming:
        inside |= drawn.column("tool_length") < view.column("tool_length").max() - ROUNDED
    kept = drawn.rows(inside) if inside.sum() >= FEW else drawn
    plan = kept.rows(range(min(OFFERED, len(kept))))
    known = {name for each in view.measurements for name in each.columns if STATES.fullmatch(name)}
    held = {name: np.full(len(plan), view.column(name)[-1]) for name in known if name not in plan.columns}
    sets = tuple(f"tool {length:g}" for length in plan.column("tool_length"))
    return replace(plan, columns={**plan.columns, **held}, labels={"set": sets})


def stays_where_it_was(view: View, plan: Measurement) -> Mask:
    """The rows whose tool tip is within the block that it has been in so far, seen from the workpiece."""
    been = view.machine.tip(view.q, view.column("tool_length"))
    tip = view.machine.tip(plan.positions(view.machine), plan.column("tool_length"))
    inside: Mask = ((tip >= been.min(axis=0) - ROUNDED) & (tip <= been.max(axis=0) + ROUNDED)).all(axis=1)
    return inside


def axes_beyond(plan: Measurement, spans: Mapping[str, Span]) -> tuple[str, ...]:
    """The axes along which some of the poses lie beyond what was measured."""
    return tuple(
        name
        for name, (low, high) in spans.items()
        if plan.column(name).min() < low - ROUNDED or plan.column(name).max() > high + ROUNDED
    )


def new_tools(plan: Measurement, used: Array) -> tuple[float, ...]:
    """Lengths of tools that were not used so far, mm."""
    lengths = set(plan.column("tool_length").tolist())
    return tuple(sorted(each for each in lengths if np.abs(used - each).min() > ROUNDED))


def marked(plan: Measurement, beyond: Sequence[str], tools: Sequence[float] = (), strays: bool = False) -> Measurement:
    """Poses with lines in the file that say what goes further than before, and which tools are new."""
    far = [*beyond, *(["the tool tip"] if strays else [])]
    said = [f"{', '.join(far)} beyond the travels measured so far, mind the clearance"] if far else []
    lengths = " and ".join(f"{each:g} mm" for each in tools)
    said += [f"tool of {lengths}: or one that differs as much, with its own length in the file"] if tools else []
    return plan.with_header("note", "; ".join(said)) if said else plan
