"""Programmable mirror image: G51.1 X10. mirrors X at 10, G50.1 X0 ends that.

Source: Fanuc 30i operator's manual (machining centre), "Programmable mirror image".
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from ncfix.control.coordinates import LETTERS, X, Y, Z, zeros
from ncfix.control.frames import WORLD, handed, mirrored, turned_about
from ncfix_iso.rs274.settings import unfollowed
from ncfix_iso.rs274.systems import is_turned, turned_back, words_of

if TYPE_CHECKING:
    from ncfix_fanuc.macro.control import MacroControl
    from ncfix_iso.rs274.control import Block

OFF = 501
SPATIAL = (X, Y, Z)


def mirror(control: MacroControl, block: Block, code: int) -> None:
    """G51.1 and G50.1; mirrored rotary axes, and mirrors in turned coordinates, are not followed."""
    named, elsewhere = words_of(block), turned(control)
    if code == OFF:
        unfollowed(control, block, code)
        for index in named or SPATIAL:
            control.mirrored.pop(index, None)
    elif elsewhere or block.runtime or not set(named) <= {*SPATIAL}:
        unfollowed(control, block, code)
        return
    else:
        control.mirrored |= {index: control.scale[index] * block.values[LETTERS[index]] for index in named}
    if not elsewhere:
        put_up(control)


def turned(control: MacroControl) -> bool:
    """Whether coordinates are turned (G68, G68.2)."""
    return control.tilted or (not control.mirrored and is_turned(control))


def put_up(control: MacroControl) -> None:
    """Take the mirrors into force."""
    centre = zeros()
    for index, place in control.mirrored.items():
        centre[index] = place
    rotation = mirrored("".join(LETTERS[index] for index in control.mirrored))
    control.frames = replace(control.frames, mirror=turned_about(rotation, centre) if control.mirrored else WORLD)
    control.handedness = handed(rotation)
    turned_back(control)
    control.refresh()
