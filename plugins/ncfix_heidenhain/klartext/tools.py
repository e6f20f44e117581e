"""TOOL CALL and TOOL DEF: which tool is in the spindle, and how long it is.

The control applies the length along the tool axis from TOOL CALL on; there is no code for it.
"""

from __future__ import annotations

import math

from ncfix.control.coordinates import Z, mask_of, zeros
from ncfix.control.setup import Tool
from ncfix.control.tcp import switch
from ncfix_heidenhain.klartext.control import TOOL, KlartextControl
from ncfix_heidenhain.klartext.targets import MotionWords

NAMED = -1
"""The number that stands for a tool that is called by name."""

OTHER_AXIS = "the tool axis is {}: only tools along Z are followed"
AT_RUN_TIME = "the length of the tool is known only at run time"


def define_tool(control: KlartextControl, tool: str | float | None, words: MotionWords, flags: frozenset[str]) -> None:
    """TOOL DEF: the length of a tool, where the program brings it."""
    if isinstance(tool, float) and "L" in words.values:
        radius = words.values.get("R")
        length = words.values["L"] * control.modal.unit
        control.defined_tools[int(tool)] = Tool(length, None if radius is None else radius * control.modal.unit)


def call_tool(control: KlartextControl, tool: str | float | None, words: MotionWords, flags: frozenset[str]) -> None:
    """TOOL CALL: without a number only speed, feed or oversizes are new."""
    if "F" in words.values:
        control.auto_feed = words.values["F"] * control.modal.unit
    if tool is None and "DR" in words.values:
        control.tools.cutter = math.nan
    if tool is None and "DL" not in words.values:
        return
    control.suspended.pop(TOOL, None)
    if isinstance(tool, float) and not tool.is_integer():
        tool = f"{tool:g}"
    axis = next((letter for letter in "xyuvw" if letter in flags), None)
    if axis is not None:
        control.suspended[TOOL] = OTHER_AXIS.format(axis.upper())
    if "DL" in words.runtime:
        control.suspended[TOOL] = AT_RUN_TIME
    if isinstance(tool, str):
        control.tools.spindle = NAMED
    if isinstance(tool, float):
        control.tools.spindle = control.tools.selected = int(tool)
    if tool is not None:
        control.places.lose(mask_of(control.machine))
    control.tool_called = True
    control.tools.offset = control.tools.spindle
    tell_radius(control, words.values.get("DR", 0.0))
    named = control.setup.named_tools.get(tool.upper()) if isinstance(tool, str) else None
    if named is not None and named.radius is not None:
        control.tools.cutter = named.radius + words.values.get("DR", 0.0) * control.modal.unit
    length = length_by_name(control, tool) if isinstance(tool, str) else length_of(control, int(control.tools.spindle))
    set_length(control, length + words.values.get("DL", 0.0) * control.modal.unit)


def tell_radius(control: KlartextControl, oversize: float) -> None:
    """Q108 is the radius of the active tool, in the unit of the program; and contours are offset by it."""
    number = int(control.tools.spindle)
    defined = control.defined_tools.get(number, Tool())
    radius = control.knowledge.known_tool_radius(number)
    radius = defined.radius if radius is None else radius
    control.tools.cutter = math.nan if radius is None else radius + oversize * control.modal.unit
    control.scope.parameters.assign("Q108", (radius or 0.0) / control.modal.unit + oversize, runtime=radius is None)


def set_length(control: KlartextControl, length: float) -> None:
    """The machine stands still when the length of the tool changes; the tip does not."""
    tool = zeros()
    tool[Z] = length
    if control.tcp:
        switch(control, tool, True)
    control.tools.vector = tool
    control.refresh()


def length_by_name(control: KlartextControl, name: str) -> float:
    """The length of a tool that is called by its name, mm; zero if it is lacking."""
    named = control.setup.named_tools.get(name.upper())
    if named is not None and named.length is not None:
        return named.length
    control.knowledge.lack("NCF202", f"length of tool {name}", "is used", f'--tool "{name}"=LENGTH')
    return 0.0


def length_of(control: KlartextControl, number: int) -> float:
    """The length of a tool, mm: as the setup has it, else as the program defines it; tool 0 has none."""
    known = control.knowledge.known_tool_length(number)
    if known is not None:
        return known
    defined = control.defined_tools.get(number)
    if defined is not None and defined.length is not None:
        return defined.length
    return 0.0 if number == 0 else control.knowledge.tool_length(number)
