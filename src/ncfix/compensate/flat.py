"""`fix` with `--flatten`: what is refused because it runs from several states is corrected in a flat program.

Only if something is refused: a program that can be corrected as it is keeps its loops and subprograms.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ncfix.compensate.account import FixReport
from ncfix.compensate.fix import Fixed, fix_program
from ncfix.compensate.following import Resolve, kinematics_of, rotary_names
from ncfix.compensate.options import FixOptions
from ncfix.control.flatten import Flat, flatten
from ncfix.control.setup import Setup
from ncfix.diagnostics import Message, Place
from ncfix.machine import Machine
from ncfix.text.tree import Program

FLATTENED = "NCF445"
ONE_POSITION = "NCF447"


def fix_flat(
    program: Program, machine: Machine, setup: Setup, options: FixOptions, resolve: Resolve | None = None
) -> Fixed:
    """As `fix_program`; where that refuses motions, the program is written out flat and corrected so.

    The flat program is kept only if it helps. The report speaks of the lines of the original. A flat program has the
    numbers of one position of block delete, so a program that is to be right in several stays as it is.
    Raises what `fix_program` and `flatten` raise.
    """
    fixed = fix_program(program, machine, setup, options, resolve)
    if not fixed.report.refused:
        return fixed
    if len(fixed.report.block_delete) > 1:
        text = "not written out flat: its numbers would be those of one position of block delete"
        note = Message(ONE_POSITION, text, Place(program.path), "--block-skip on or off says which one")
        return replace(fixed, report=replace(fixed.report, warnings=(note, *fixed.report.warnings)))
    steps = steps_of(machine)
    flat = flatten(program, setup, machine.axis_names, rotary_names(machine), steps, resolve, kinematics_of(machine))
    again = fix_program(flat.program, machine, setup, options, resolve)
    if {each.line for each in fixed.report.refused} <= {flat.lines[each.line - 1] for each in again.report.refused}:
        return fixed
    return replace(again, changed=True, report=in_lines(again, flat, program))


def in_lines(fixed: Fixed, flat: Flat, program: Program) -> FixReport:
    """The report of a flat program with the lines of the original."""
    refused = tuple(replace(each, line=flat.lines[each.line - 1]) for each in fixed.report.refused)
    text = f"the program is written out flat: {len(program)} lines become {len(flat.lines)}"
    note = Message(FLATTENED, text, Place(program.path), "blocks executed several times are corrected one by one")
    after = dict(fixed.report.error_after_um)
    if after.get("where"):
        after["where"] = flat.lines[int(after["where"] or 1) - 1]
    warnings = (note, *(placed(each, flat) for each in fixed.report.warnings))
    return replace(fixed.report, refused=refused, error_after_um=after, warnings=warnings)


def placed(message: Message, flat: Flat) -> Message:
    """A message with the line of the original."""
    place = message.place
    if place is None or not 1 <= place.line <= len(flat.lines):
        return message
    return replace(message, place=replace(place, line=flat.lines[place.line - 1]))


def steps_of(machine: Machine) -> dict[str, float]:
    """The least increment of each axis, mm or degree."""
    linear, rotary = machine.least_increment
    return {
        name: float(np.degrees(rotary)) if turning else linear
        for name, turning in zip(machine.axis_names, machine.rotary.tolist(), strict=True)
    }
