"""Canned cycles where Fanuc differs from LinuxCNC: R and the depth stay in force as levels, whatever G90 or G91 says.

Source: Fanuc 30i operator's manual (machining centre), "Canned cycle for drilling": in G91 R counts from the initial
level and the depth from R, in the block that names them.
"""

from __future__ import annotations

from ncfix.control.coordinates import LETTERS
from ncfix.control.expressions import Fault
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.cycles import BAD_CYCLE, drill, place_hole, repeats
from ncfix_iso.rs274.systems import check_system

BACK_BORING = 870
"""G87 goes in to R, below, and cuts upwards to its depth."""


def cycle(control: RS274Control, block: Block, code: int) -> None:
    """Drill the holes of one block."""
    modal, across = control.modal, control.modal.plane.across
    if not modal.incremental and not control.offset_checked:
        check_system(control)
    control.use_start_positions(tuple(control.unknown))
    program = control.program_position()
    initial = program[across] if modal.cycle.initial is None else modal.cycle.initial
    take_levels(control, block, initial, control.dialect.cycle_of(code).level)
    modal.cycle.initial, modal.cycle.level, modal.motion = initial, modal.cycle.r, code
    if modal.cycle.r < modal.cycle.depth and code != BACK_BORING:
        levels = f"{modal.cycle.r:g} and {modal.cycle.depth:g} mm"
        raise Fault(BAD_CYCLE, f"R is below the bottom of the hole ({levels})")
    at_level = control.dialect.cycle_of(code).ends_at_level(modal.retract_to_r)
    clear = modal.cycle.r if at_level else max(initial, modal.cycle.r)
    for _ in range(repeats(control, block, code)):
        place_hole(control, block, program)
        drill(control, block, code, program, modal.cycle.depth, modal.cycle.r, clear)


def take_levels(control: RS274Control, block: Block, initial: float, letter: str = "R") -> None:
    """R and the depth of the block as levels in the program's frame, mm; those not named stay in force.

    letter  the address of R
    """
    modal, across = control.modal, control.modal.plane.across
    sticky, depth = modal.cycle, LETTERS[across]
    in_force = sticky.initial is not None
    if not in_force:
        sticky.runtime = False
        if depth not in block.values:
            raise Fault(BAD_CYCLE, f"{depth} is missing: a canned cycle cannot begin without it")
        if letter not in block.values:
            sticky.r = initial
    if letter in block.values:
        sticky.r = modal.unit * block.values[letter] + (initial if modal.incremental else 0.0)
    if depth in block.values:
        sticky.depth = control.scale[across] * block.values[depth] + (sticky.r if modal.incremental else 0.0)
    sticky.runtime |= bool(block.runtime & {letter, depth})
