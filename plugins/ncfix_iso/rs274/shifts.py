"""Shifts and rotations of all coordinate systems: G52, G92 to G92.3, and G68 of ISO controls.

Source: LinuxCNC documentation, "G52", "G92", which are one shift there; for G52 and G92 of ISO controls, which are two,
and for G68 and G69 the Fanuc 30i programming manual.
"""

from __future__ import annotations

from dataclasses import replace

from ncfix.control.coordinates import IDENTITY, LETTERS, N_LETTERS, Rotation, about, mask_of, product
from ncfix.control.expressions import Fault
from ncfix.control.frames import WORLD, Affine, turned_about
from ncfix_iso.rs274.control import Block, RS274Control
from ncfix_iso.rs274.settings import ENDS, unfollowed
from ncfix_iso.rs274.systems import (
    RUNTIME_OFFSET,
    SHIFT,
    compose,
    moved_while_turned,
    store,
    stored,
    turned_back,
    words_of,
)

SHIFT_ACTIVE = 5210


def shift_system(control: RS274Control, block: Block, code: int) -> None:
    """G52 and G92: shift all coordinate systems, by the words or so that the position gets their values."""
    if code in (520, 920) and not block.axes:
        if control.rules.strict:
            raise Fault("NCF221", f"G{code // 10} needs an axis word")
        return
    moved_while_turned(control, f"G{code // 10}")
    if not control.rules.strict and code in (520, 920):
        set_local(control, block, cancelled=code == 920)
    if code == 520 and not control.rules.strict:
        return
    before, doubtful = control.frames.additive.shift, {*control.composed.unknown}
    if code in (520, 920):
        set_shift(control, block, from_position=code == 920)
    else:
        control.frames = replace(
            control.frames, additive=Affine(tuple(stored(control, SHIFT))) if code == 923 else WORLD
        )
    if code == 921:
        for index in range(N_LETTERS):
            store(control, SHIFT, index, 0.0, runtime=False)
    control.parameters.assign(SHIFT_ACTIVE, float(code in (520, 920, 923)))
    compose(control)
    if code == 920:
        control.places.settle(mask_of(words_of(block)))
    elif code == 520:
        control.places.shift(mask_of(words_of(block)))
    else:
        after, doubtful = control.frames.additive.shift, doubtful | {*control.composed.unknown}
        control.places.shift(mask_of(i for i in control.machine if before[i] != after[i] or i in doubtful))


def set_local(control: RS274Control, block: Block, *, cancelled: bool) -> None:
    """G52 of ISO controls, which is not the shift of G92; G92 takes it away along the axes that it names."""
    local, unknown = [*control.frames.local.shift], dict(control.frames.local.unknown)
    for index in words_of(block):
        local[index] = 0.0 if cancelled else control.scale[index] * block.values[LETTERS[index]]
        unknown.pop(index, None)
        runtime = LETTERS[index] in block.runtime and not cancelled and not control.probes_nominally
        if runtime and index in control.machine:
            unknown[index] = RUNTIME_OFFSET
    control.frames = replace(control.frames, local=Affine(tuple(local), unknown=unknown))
    compose(control)


def set_shift(control: RS274Control, block: Block, *, from_position: bool) -> None:
    """The shift that the words ask for."""
    shift = [*control.frames.additive.shift]
    if from_position:
        control.settle(tuple(control.unknown) if control.is_rotated else words_of(block))
    position = control.program_position()
    doubtful = {*control.unknown, *control.composed.unknown} if from_position else set()
    for index in words_of(block):
        value = control.scale[index] * block.values[LETTERS[index]]
        shift[index] = position[index] + shift[index] - value if from_position else value
        store(control, SHIFT, index, shift[index], index in doubtful or LETTERS[index] in block.runtime)
    control.frames = replace(control.frames, additive=Affine(tuple(shift)))


def rotate_system(control: RS274Control, block: Block, code: int) -> None:
    """G68 X Y R turns the coordinates of the plane about a point, G69 ends it."""
    before = control.frames.rotation.rotation
    if code == 680 and (why := uncertain(control, block)):
        control.suspended[ENDS[690]] = why
        return
    control.frames = replace(control.frames, rotation=WORLD)
    if code == 680:
        turn_about_point(control, block, before if control.modal.incremental else IDENTITY)
    else:
        unfollowed(control, block, code)
    if control.frames.rotation.rotation != before:
        control.unnamed = frozenset((control.modal.plane.first, control.modal.plane.second))
    turned_back(control)
    control.refresh()
    control.places.shift(mask_of(control.unnamed))


def uncertain(control: RS274Control, block: Block) -> str:
    """Why a rotation (G68) is not certain; empty if it is."""
    if "R" not in block.values:
        return "the angle of the rotation (G68) is not in the program"
    centred = any(LETTERS[index] in block.values for index in (control.modal.plane.first, control.modal.plane.second))
    again = control.frames.rotation.rotation != IDENTITY and not control.rules.adds_rotations
    if control.modal.incremental and (centred or again):
        return "what the words of a rotation (G68) count from in G91 differs from control to control"
    return ""


def turn_about_point(control: RS274Control, block: Block, before: Rotation) -> None:
    """Put a rotation by R about the words of the plane into force, on top of another."""
    plane = control.modal.plane
    centre = control.program_position()
    for index in (plane.first, plane.second):
        letter = LETTERS[index]
        if letter in block.values:
            step = centre[index] if control.modal.incremental else 0.0
            centre[index] = control.scale[index] * block.values[letter] + step
        else:
            control.settle((index,))
    if block.runtime or control.unknown.keys() & {plane.first, plane.second}:
        control.refusal = control.refusal or "the centre or angle of a rotation (G68) is known only at run time"
    turned = turned_about(product(before, about(plane, block.get("R"))), centre)
    control.frames = replace(control.frames, rotation=turned)
