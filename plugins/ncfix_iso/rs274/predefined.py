"""Parameters that the control maintains: positions, modes, tool data.

Source: LinuxCNC documentation, "Predefined named parameters" and "Numbered parameters".
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

from ncfix.control.coordinates import LETTERS
from ncfix.control.expressions import Unknown, Value
from ncfix_iso.rs274.control import RS274Control
from ncfix_iso.rs274.flow import OWords

VERSION = 2.9
"""Version of LinuxCNC that programs read: that of the interpreter on which this one is modelled."""

Getter = Callable[[], Value]


def install(control: RS274Control, flow: OWords) -> None:
    """Install the control's own parameters."""
    control.parameters.live = numbered(control)
    control.parameters.predefined = positions(control) | modes(control) | machine(control) | program(control, flow)


def numbered(control: RS274Control) -> dict[int, Getter]:
    """Numbered parameters: tool number and data (5400 ..), position in program units (5420 ..)."""
    getters: dict[int, Getter] = {
        number: partial(control.read_position, f"#{number}", number - 5420) for number in range(5420, 5429)
    }
    getters[5400] = lambda: of_tool(control, control.tools.spindle)
    getters[5403] = lambda: of_tool(control, number_or_zero(control.tool_length()[1]))
    getters[5410] = lambda: of_tool(control, 2.0 * (control.knowledge.known_tool_radius(control.tools.spindle) or 0.0))
    getters[5220] = lambda: float(control.modal.system)
    return getters


def of_tool(control: RS274Control, value: float) -> Value:
    """A value that depends on the tool in the spindle; `Unknown` if that is known only at run time."""
    return Unknown("tool", value) if control.tools.unsure else float(value)


def number_or_zero(value: float) -> float:
    """Zero for NaN."""
    return 0.0 if math.isnan(value) else value


def positions(control: RS274Control) -> dict[str, Getter]:
    """`_x` to `_w`: the current position in program units."""
    names = [f"_{letter.lower()}" for letter in LETTERS]
    return {name: partial(control.read_position, f"#<{name}>", index) for index, name in enumerate(names)}


def modes(control: RS274Control) -> dict[str, Getter]:
    """The modal state."""

    def flag(name: str, value: object) -> Getter:
        return lambda: float(getattr(control.modal, name) == value)

    return {
        "_motion_mode": lambda: float(control.modal.motion),
        "_plane": lambda: float(control.modal.plane.code),
        "_ccomp": lambda: float(control.modal.compensated * 10 or 400),
        "_metric": flag("unit", 1.0),
        "_imperial": lambda: float(control.modal.unit != 1.0),
        "_absolute": flag("incremental", False),
        "_incremental": flag("incremental", True),
        "_inverse_time": flag("feed_mode", 93),
        "_units_per_minute": flag("feed_mode", 94),
        "_units_per_rev": flag("feed_mode", 95),
        "_coord_system": lambda: float(system_code(control.modal.system)),
        "_tool_offset": lambda: float(any(control.tools.vector)),
        "_retract_r_plane": flag("retract_to_r", True),
        "_retract_old_z": flag("retract_to_r", False),
        "_ijk_absolute_mode": flag("arc_absolute", True),
        "_lathe_diameter_mode": flag("diameter", True),
        "_lathe_radius_mode": flag("diameter", False),
        "_spindle_on": lambda: float(control.modal.spindle != 5),
        "_spindle_cw": flag("spindle", 3),
        "_feed": lambda: control.feed_in_force,
        "_rpm": lambda: abs(control.modal.speed),
    }


def system_code(system: int) -> int:
    """The G code of a coordinate system in tenths."""
    return 530 + 10 * system if system < 7 else 584 + system


def machine(control: RS274Control) -> dict[str, Getter]:
    """What the control knows of itself. `_task` is 0, because the program is previewed, not run."""
    constants = {
        "_vmajor": VERSION,
        "_vminor": 0.0,
        "_task": 0.0,
        "_remap_level": 0.0,
        "_spindle_rpm_mode": 1.0,
        "_spindle_css_mode": 0.0,
        "_mist": 0.0,
        "_flood": 0.0,
        "_speed_override": 1.0,
        "_feed_override": 1.0,
        "_adaptive_feed": 0.0,
        "_feed_hold": 0.0,
        "_selected_pocket": -1.0,
        "_current_pocket": 1.0,
        "_metric_machine": 1.0,
        "_imperial_machine": 0.0,
    }
    getters: dict[str, Getter] = {name: partial(float, value) for name, value in constants.items()}
    tools = control.tools
    getters["_current_tool"] = lambda: of_tool(control, tools.spindle)
    getters["_selected_tool"] = lambda: Unknown("tool", tools.selected) if tools.doubtful else float(tools.selected)
    return getters


def program(control: RS274Control, flow: OWords) -> dict[str, Getter]:
    """The place of execution, and the value returned by the last subprogram."""
    return {
        "_line": lambda: float(flow.unit.program.line(flow.block - 1)),
        "_call_level": lambda: float(len(flow.calls)),
        "_value": lambda: control.parameters.returned[0],
        "_value_returned": lambda: float(control.parameters.returned[1]),
    }
