"""The fixed order in which a control executes the words of a block, independent of their order in the text.

Source: LinuxCNC documentation, "G-code overview", "Order of execution".
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from ncfix.control.expressions import Unknown
from ncfix.text.dialect import CodeOperation
from ncfix_iso.rs274 import groups
from ncfix_iso.rs274.arc_motion import arc
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.cycles import cycle
from ncfix_iso.rs274.groups import Rules
from ncfix_iso.rs274.motion import (
    NO_CODE,
    at_power_on,
    cancel,
    destination,
    dwell,
    end_spline,
    feed,
    feed_mode,
    go_to_reference,
    high_speed,
    one_way,
    probe,
    refused,
    save_reference,
    speed,
    straight,
    turning_cycle,
)
from ncfix_iso.rs274.settings import (
    arc_distance,
    change_tool,
    compensation,
    diameter,
    distance,
    lone_length,
    path_mode,
    plane,
    retract,
    select_radius,
    select_tool,
    set_data,
    spindle_or_state,
    tool_offset,
    units,
)
from ncfix_iso.rs274.systems import rotate_system, select_system, shift_system, unfollowed

Step = Callable[[RS274Control, Block, int], None]

FIRST: tuple[tuple[str, Step], ...] = ((groups.FEED_MODE, feed_mode),)
"""Steps before the words F, S and T, by G group."""

WORDS: tuple[tuple[str, Step], ...] = (("F", feed), ("S", speed), ("T", select_tool), ("D", select_radius))
"""Steps for the words F, S, T and D."""

INPUTS = 5399
"""Parameter that contains the value read by M66."""


def read_input(control: RS274Control, block: Block, code: int) -> None:
    """M66 reads an input, whose value is known only at run time."""
    if code == 660:
        control.parameters.assign(INPUTS, Unknown())
        control.parameters.inputs = True


M_STEPS: tuple[tuple[str, Step], ...] = (
    (groups.INPUT_OUTPUT, read_input),
    (groups.TOOL, change_tool),
    (groups.SPINDLE, spindle_or_state),
)
"""Steps of M codes, by group; those of other groups have no effect here."""

G_STEPS: tuple[tuple[str, Step], ...] = (
    (groups.PLANE, plane),
    (groups.UNITS, units),
    (groups.DIAMETER, diameter),
    (groups.CUTTER, compensation),
    (groups.LENGTH, tool_offset),
    (groups.SYSTEM, select_system),
    (groups.DISTANCE, distance),
    (groups.ARC_DISTANCE, arc_distance),
    (groups.RETRACT, retract),
    (groups.CONTROL, path_mode),
    (groups.UNFOLLOWED, unfollowed),
    (groups.ROTATION, rotate_system),
    (groups.HIGH_SPEED, high_speed),
)
"""Steps of G codes other than motions, by group."""

NON_MODAL: Mapping[int, Step] = {
    53: end_spline,
    100: set_data,
    280: go_to_reference,
    300: go_to_reference,
    310: probe,
    281: save_reference,
    301: save_reference,
    520: shift_system,
    600: one_way,
    **dict.fromkeys((920, 921, 922, 923), shift_system),
}
"""Steps of non-modal codes after all settings; G4 is executed before them, G53 with the motion."""

DWELL = 40
MACHINE = 530

MOTIONS: Mapping[int, Step] = {
    0: straight,
    10: straight,
    20: arc,
    30: arc,
    800: cancel,
    NO_CODE: at_power_on,
    **dict.fromkeys(groups.PROBES, probe),
    **dict.fromkeys((*groups.SPLINES, *groups.THREADS), refused),
    **dict.fromkeys(groups.TURNING_CYCLES, turning_cycle),
    **dict.fromkeys(groups.CYCLES, cycle),
}
"""Steps of motion codes."""


Steps = tuple[tuple[Step, int], ...]


def carry_out(operations: Sequence[CodeOperation], control: RS274Control, block: Block, code: int) -> None:
    """Execute a dialect's own code."""
    for operation in operations:
        operation.carry_out(control, block, partial(destination, control, block))


def steps_of(g_codes: Mapping[str, int], m_codes: Mapping[str, int], letters: frozenset[str], rules: Rules) -> Steps:
    """The steps of a block before its motion, in order, with their codes.

    `g_codes` and `m_codes` by group; `letters`: addresses of the block's words.
    """
    own = rules.steps
    steps = [(step, g_codes[group]) for group, step in FIRST if group in g_codes]
    steps += [(step, 0) for letter, step in WORDS if letter in letters]
    steps += [(step, m_codes[group]) for group, step in M_STEPS if group in m_codes]
    single = g_codes.get(groups.NON_MODAL, -1)
    if single == DWELL:
        steps.append((dwell, single))
    steps += [(own.get(g_codes[group], step), g_codes[group]) for group, step in G_STEPS if group in g_codes]
    if "H" in letters and rules.length_by_h_alone and groups.LENGTH not in g_codes and groups.CALL not in m_codes:
        steps.append((lone_length, 0))
    if single in NON_MODAL or (single in own and single != DWELL):
        steps.append((own.get(single) or NON_MODAL[single], single))
    written = [*(("M", code) for code in m_codes.values()), *(("G", code) for code in g_codes.values())]
    for letter, code in written:
        if operations := rules.operations.get((letter, code)):
            steps.append((partial(carry_out, operations), code))
    return tuple(steps)
