"""Which shapes of blocks are nothing but a straight motion with plain numbers, and where their numbers are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ncfix.program.follow import lane_tables as shared
from ncfix.program.follow.coordinates import INDEX
from ncfix.program.follow.lane_tables import Lane
from ncfix.program.klartext.plans import LETTERS, Plan
from ncfix.program.tree import Constant, Literal, Template

STRAIGHT = frozenset({"", "l", "ln"})
IDLE = frozenset({"F", "S", "NX", "NY", "NZ"})
"""Addresses that lead nowhere."""

SIDES = {"r0": 0, "rl": 41, "rr": 42}
"""What radius compensation is from a block on."""

FLAGS = frozenset({"fmax", *SIDES})
HARMLESS = frozenset({3, 4, 5, 7, 8, 9, 13, 14})
"""M codes of spindle and coolant: they change nothing that motions depend on."""

NOTHING = Lane((), -1, -1)
RAPID, FEED = 0, 10


@dataclass(frozen=True, slots=True)
class LaneTables:
    """The shapes of a program as columns.

    open   (s,) blocks of the shape may go through the fast lane
    empty  (s,) they do nothing
    side   (s,) what radius compensation is from them on, -1 if it stays
    words  axes, feed and motion as in every lane; motion is that of blocks with axis words
    """

    open: NDArray[np.bool_]
    empty: NDArray[np.bool_]
    side: NDArray[np.int64]
    words: shared.LaneTables

    @classmethod
    def of(cls, templates: Sequence[Template], plans: Sequence[Plan], axes: int) -> LaneTables:
        """The tables of some shapes; `axes`: bit mask of the letters that the machine has."""
        lanes = [lane_of(template, plan, axes) for template, plan in zip(templates, plans, strict=True)]
        sides = [max((SIDES[flag] for flag in plan.flags & SIDES.keys()), default=-1) for plan in plans]
        return cls(
            np.array([lane is not None for lane in lanes], dtype=np.bool_),
            np.array([plan.empty for plan in plans], dtype=np.bool_),
            np.array(sides, dtype=np.int64),
            shared.LaneTables.of(lanes),
        )


def lane_of(template: Template, plan: Plan, axes: int) -> Lane | None:
    """The fast lane's view of a shape; None if its blocks are more than a straight motion with plain numbers."""
    if plan.empty:
        return NOTHING
    if not is_straight(plan):
        return None
    values = {word.address: word.value for word in template.words if not isinstance(word.value, Constant)}
    slots = {address: value.slot for address, value in values.items() if isinstance(value, Literal) and address != "N"}
    if not slots.keys() == plan.words.keys() <= LETTERS | IDLE:
        return None
    words = tuple((INDEX[letter], slot) for letter, slot in slots.items() if letter in INDEX)
    if any(not axes >> index & 1 for index, _ in words):
        return None
    return Lane(words, slots.get("F", -1), RAPID if "fmax" in plan.flags else FEED)


def is_straight(plan: Plan) -> bool:
    """Whether a block does nothing but move straight, by what it has besides words with numbers."""
    if plan.skip or plan.flow or plan.assignments or plan.tool is not None or plan.statement:
        return False
    if plan.name not in STRAIGHT or (plan.name == "ln" and not plan.moves):
        return False
    if any(code not in HARMLESS or own for code, own in plan.codes):
        return False
    return plan.flags <= FLAGS and len(plan.flags & SIDES.keys()) <= 1
