"""Names that a diagnosis may say and that are never hidden: what nearly every place of a machine could suffer.

The catalogue hides each kind of effect where it is usual. A diagnosis may look for it elsewhere: another slide sags,
another column nods, a slide turns about the tool's own line. To know the next of kin of a hidden effect, and of which
family a name is, these are needed too.
"""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from ..chain import Joint, Machine
from . import linear, thermal, weight
from .entry import Entry, Field, field, spread, symbol
from .linear import crossed
from .rotary import letters


def sayable(machine: Machine) -> tuple[Entry, ...]:
    """All of them; several may have one name, as forms of it."""
    straight = [joint for joint in machine.joints if not joint.rotary]
    turning = [joint for joint in machine.joints if joint.rotary]
    down = np.asarray(machine.gravity)
    flat = [joint for joint in straight if abs(down @ np.asarray(joint.direction)) < 0.5]
    found = [make(joint, turn) for joint in straight for turn in "ABC" for make in (linear.motion, linear.play)]
    found += [make(machine, joint) for joint in flat for make in (weight.bed_sag, weight.ram_droop)]
    found += [weight.foundation_tilt(machine, joint) for joint in flat]
    found += [_nod(a, b, turn) for a in straight for b in straight if a is not b for turn in "ABC"]
    found += [thermal.bend(joint, turn) for joint in straight for turn in "ABC"]
    found += [thermal.centre(joint, letter) for joint in turning for letter in letters(joint)[1:3]]
    for joint in turning:
        found += weight.of_weight(joint) if weight.feels_gravity(machine, joint) else ()
    return tuple(found)


def _nod(joint: Joint, other: Joint, turn: str) -> Entry:
    """A slide tilts by the product of its own position and that of another one."""

    def draw(rng: Generator) -> Field:
        product, lean = crossed(joint.name, other.name), spread(rng, 0.05, 0.5)
        return field({(joint.name, turn): lambda s: product(s) * (1 + lean * s.u(joint.name))})

    name, symbols = f"column nod {joint.name}", (symbol(turn, joint.name),)
    return Entry(name, 34, "column nod", joint.name, symbols, f"{joint.name} geometry", draw)
