"""System variables: variables of the control that a program of Macro B can read and set.

Source: Fanuc 30i operator's manual, "Custom macro", "System variables". All other system variables are known only on
the machine: a value read from one is known at run time only; after one is set, the rest of the program is refused,
unless it is an output or a message.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from ncfix.control.expressions import Fault, Unknown, Value, nominal, scaled
from ncfix_fanuc.macro.data import keep_length
from ncfix_fanuc.macro.variables import is_system
from ncfix_iso.rs274.systems import activate, before_persistent

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl

Getter = Callable[[], Value]

OFFSETS = range(5221, 5327)
"""Work offsets G54 (5221) to G59 (5321), twenty numbers each."""

LENGTHS, RADII = range(11001, 12000), range(13001, 14000)
"""Tool lengths and radii (geometry). Whether #2001 and #10001 are lengths or wear depends on the kind of offset
memory."""

SPATIAL = range(3)
ALARM, ALARM_RAISED = 3000, "NCF216"

HARMLESS = (range(1000, 2000), range(3000, 3030), range(12001, 14000))
"""Interface signals, alarms and messages, clocks, and tool radii."""

SYSTEM_CODES = {1: 54, 2: 55, 3: 56, 4: 57, 5: 58, 6: 59, 0: 54.1}


def positions(control: MacroControl) -> dict[int, Getter]:
    """Variables of positions of each axis: end of the block before (5001), machine (5021), present position (5041)."""
    found: dict[int, Getter] = {}
    for place, index in enumerate(sorted(control.axis_indices)):
        found[5001 + place] = found[5041 + place] = partial(control.coordinate, index)
        found[5021 + place] = partial(machine_position, control, index)
    return found


def machine_position(control: MacroControl, index: int) -> float:
    """The position of an axis in machine coordinates, program units."""
    control.use_start_positions((index,))
    return control.position[index] / control.unit_of(index)


def offsets(control: MacroControl) -> dict[int, Getter]:
    """Variables of the work offsets of X, Y and Z, program units; those of rotary axes depend on the machine."""
    return {number: partial(offset, control, number) for number in OFFSETS if (number - OFFSETS.start) % 20 in SPATIAL}


def offset(control: MacroControl, number: int) -> Value:
    """The value of a work offset variable, program units; the offset must be given."""
    before_persistent(control, number)
    found = control.parameters.numbers.get(number, 0.0)
    value = nominal(found) / control.modal.unit
    return Unknown(found.why, value) if isinstance(found, Unknown) else value


def modes(control: MacroControl) -> dict[int, Getter]:
    """Variables of the codes and words in force: before the block (4001), and of the running block (4201, 4301).

    Words that the program has not given are those of the program before, or the operator's.
    """
    tools = control.tools
    state: dict[int, Getter] = {
        1: lambda: control.modal.motion / 10,
        2: lambda: control.modal.plane.code / 10,
        3: lambda: 91.0 if control.modal.incremental else 90.0,
        5: lambda: float(control.modal.feed_mode),
        6: lambda: 21.0 if control.modal.unit == 1.0 else 20.0,
        7: lambda: float(control.modal.compensated or 40),
        8: lambda: control.modal.tool_code / 10,
        10: lambda: 99.0 if control.modal.retract_to_r else 98.0,
        control.rules.offset_group: lambda: float(SYSTEM_CODES.get(control.modal.system, 54)),
        109: lambda: control.feed_in_force or Unknown("F"),
        111: lambda: Unknown("H") if control.length_number is None else float(control.length_number),
        119: lambda: control.modal.speed or Unknown("S"),
        120: lambda: Unknown("T", tools.selected) if tools.doubtful or not tools.selected else float(tools.selected),
    }
    return {base + number: getter for base in (4000, 4200, 4300) for number, getter in state.items()}


def is_harmless(number: int) -> bool:
    """Whether setting a variable moves nothing and changes no coordinates."""
    return not is_system(number) or any(number in each for each in HARMLESS)


def was_set(control: MacroControl, number: int, value: Value) -> None:
    """Apply the effect of setting a variable of the control."""
    if number == ALARM:
        raise Fault(ALARM_RAISED, "the program raises an alarm here (#3000)", "the control stops")
    system, place = divmod(number - OFFSETS.start, 20)
    if number in OFFSETS and place in SPATIAL:
        control.parameters.assign(number, scaled(control.modal.unit, value))
        if control.modal.system == 1 + system:
            activate(control, control.modal.system)
    elif number in LENGTHS:
        keep_length(control, number - LENGTHS.start + 1, scaled(control.modal.unit, value))
    elif number in RADII:
        control.tools.resized.add(number - RADII.start + 1)
    elif not is_harmless(number):
        control.refuse_rest(f"the program sets #{number}, which ncfix does not support")
