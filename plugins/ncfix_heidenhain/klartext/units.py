"""A Klartext program prepared for following it: the plans of its blocks, its labels, and where it begins.

Also which shapes of blocks the fast lane can take: those that are nothing but a motion with plain numbers, or a pole.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Ints, Mask
from ncfix.control.arcs import CLOCKWISE, COUNTER
from ncfix.control.coordinates import INDEX, mask_of
from ncfix.control.expressions import Fault
from ncfix.control.interpreter import TextUnit
from ncfix.control.lanes import block_rows as shared
from ncfix.control.lanes.block_rows import Lane
from ncfix.text.tree import Constant, Literal, Program, Template
from ncfix.values import frozen
from ncfix_heidenhain.klartext.arcs import IN_PLANE
from ncfix_heidenhain.klartext.plans import LETTERS, KlartextPlan, plan_of

STRAIGHT = frozenset({"", "l"})
ARCS = {"cr": "R", "c": "", "cp": "IPA"}
"""Arcs of the fast lane -> the address that each needs besides its axes."""

IDLE = frozenset({"F", "S"})
"""Addresses of a motion block that do not change where it leads: feed and speed."""

SIDES = {"r0": 0, "rl": 41, "rr": 42}
"""Word -> the radius compensation from its block on: 0 off, 41 left, 42 right."""

SENSES = {"dr-": CLOCKWISE, "dr+": COUNTER}
FLAGS = frozenset({"fmax", *SIDES})
HARMLESS = frozenset({3, 4, 5, 7, 8, 9, 13, 14})
"""M codes of spindle and coolant, which change nothing that motions depend on."""

NOTHING = Lane((), -1, -1)
RAPID, FEED = 0, 10


@frozen
class KlartextLaneTables:
    """What the fast lane needs of the s shapes of a program, as columns.

    open   (s,) blocks of the shape may go through the fast lane
    empty  (s,) blocks of the shape do nothing
    side   (s,) radius compensation from the block on; -1 if the block does not change it
    words  axes, feed and motion code, as in every fast lane; arcs always move X and Y
    arc    (s,) name of the arc; empty if the block makes none
    value  (s,) place of R (of CR) or IPA (of CP) among the numbers of the block; -1 without
    pole   (s, 2) places of X and Y of a pole (CC) among the numbers of the block; -1 without
    """

    open: Mask
    empty: Mask
    side: Ints
    words: shared.LaneTables
    arc: NDArray[np.str_]
    value: Ints
    pole: Ints

    @classmethod
    def of(cls, templates: Sequence[Template], plans: Sequence[KlartextPlan], axes: int) -> KlartextLaneTables:
        """The columns for some shapes; `axes`: bit mask of the axes that the machine has."""
        slots = [slots_of(template, plan) for template, plan in zip(templates, plans, strict=True)]
        lanes = [lane_of(plan, own, axes) for plan, own in zip(plans, slots, strict=True)]
        sides = [max((SIDES[flag] for flag in plan.flags & SIDES.keys()), default=-1) for plan in plans]
        tables = cls(
            np.array([lane is not None for lane in lanes], dtype=np.bool_),
            np.array([plan.empty for plan in plans], dtype=np.bool_),
            np.array(sides, dtype=np.int64),
            shared.LaneTables.of(lanes),
            np.array([plan.name if plan.name in ARCS else "" for plan in plans], dtype="U2"),
            np.full(len(plans), -1),
            np.full((len(plans), 2), -1),
        )
        for shape in np.flatnonzero(tables.open).tolist():
            plan, own = plans[shape], slots[shape] or {}
            if plan.name in ARCS:
                tables.words.mask[shape] |= IN_PLANE
                tables.value[shape] = own.get(ARCS[plan.name], -1)
            elif plan.name == "cc":
                tables.pole[shape] = own["X"], own["Y"]
        return tables


def slots_of(template: Template, plan: KlartextPlan) -> Mapping[str, int] | None:
    """Address -> slot of its number, for the words of a motion; None if a word is more than a plain number."""
    values = {word.address: word.value for word in template.words if not isinstance(word.value, Constant)}
    slots = {address: value.slot for address, value in values.items() if isinstance(value, Literal) and address != "N"}
    return slots if slots.keys() == plan.words.keys() else None


def lane_of(plan: KlartextPlan, slots: Mapping[str, int] | None, axes: int) -> Lane | None:
    """What the fast lane needs of a shape; None if its blocks are neither a motion with plain numbers nor a pole."""
    if plan.empty:
        return NOTHING
    if slots is None or not is_plain(plan):
        return None
    named = mask_of(INDEX[address] for address in slots if address in INDEX)
    if plan.name == "cc":
        return NOTHING if slots.keys() == {"X", "Y"} and not plan.flags and not plan.codes else None
    if plan.name in ARCS:
        return arc_of(plan, slots) if not (named | IN_PLANE) & ~axes else None
    if plan.name not in STRAIGHT:
        return None
    if not slots.keys() <= LETTERS | IDLE or named & ~axes:
        return None
    words = tuple((INDEX[letter], slot) for letter, slot in slots.items() if letter in INDEX)
    if not plan.flags <= FLAGS or len(plan.flags & SIDES.keys()) > 1:
        return None
    return Lane(words, slots.get("F", -1), RAPID if "fmax" in plan.flags else FEED)


def arc_of(plan: KlartextPlan, slots: Mapping[str, int]) -> Lane | None:
    """What the fast lane needs of an arc; None if it is not in the plane of X and Y, or lacks a word that it needs."""
    own, named = ARCS[plan.name], slots.keys() & LETTERS
    senses = plan.flags & SENSES.keys()
    if len(senses) != 1 or not plan.flags <= senses | {"r0"} or not slots.keys() <= {"X", "Y", "Z", "F", "S", own}:
        return None
    if (own and own not in slots) or not (named <= {"Z"} if plan.name == "cp" else named & {"X", "Y"}):
        return None
    if plan.name == "cr" and "Z" in named and len(named) < 3:
        return None
    words = tuple((INDEX[letter], slots[letter]) for letter in sorted(named))
    return Lane(words, slots.get("F", -1), SENSES[next(iter(senses))])


def is_plain(plan: KlartextPlan) -> bool:
    """Whether a block has only plain words and harmless M codes: no flow, assignment, tool, statement or block skip."""
    if plan.skip or plan.flow or plan.assignments or plan.tool is not None or plan.statement:
        return False
    return not any(code not in HARMLESS or own for code, own in plan.codes)


NO_BEGIN = "NCF275"
BEGIN = re.compile(r"BEGIN\s+PGM(?P<rest>.*)", re.IGNORECASE | re.DOTALL)
UNIT = re.compile(r"\b(MM|INCH)\s*\Z", re.IGNORECASE)
MM_PER_UNIT = {"MM": 1.0, "INCH": 25.4}


def unit_of_feed(unit: float) -> float:
    """mm per unit of a feed per minute: in inch programs a tenth of an inch; `unit`: mm per unit of length."""
    return unit if unit == MM_PER_UNIT["MM"] else unit / 10


class KlartextUnit(TextUnit[KlartextPlan]):
    """One Klartext program.

    axes    bit mask of the axes that the machine has
    labels  name of a label -> the first block with that label
    begin   the block after BEGIN PGM
    mm      mm per unit of length of the program
    """

    def __init__(self, program: Program, axes: int, external: str = "") -> None:
        self.axes = axes
        super().__init__(program, plan_of, external)
        self.begin, self.mm = self._beginning()

    def take(self, program: Program, begin: int, stop: int) -> None:
        """See `TextUnit.take`."""
        super().take(program, begin, stop)
        self.labels = self._found_labels()

    def tables(self) -> KlartextLaneTables:
        """See `TextUnit.tables`."""
        return KlartextLaneTables.of(self.program.templates, self.all_plans(), self.axes)

    def closed(self) -> Mask:
        """See `TextUnit.closed`."""
        return ~self.lanes.open

    def next_plan(self, block: int) -> KlartextPlan | None:
        """The plan of the first block, from `block` on, that does something other than set a pole."""
        plans = map(self.plan, range(block, self.stop))
        return next((plan for plan in plans if not plan.empty and plan.name != "cc"), None)

    def _found_labels(self) -> dict[str, int]:
        found: dict[str, int] = {}
        flows = [plan.flow for plan in self.all_plans()]
        for block in self.blocks_of(
            [i for i, flow in enumerate(flows) if flow is not None and flow.keyword == "label"]
        ):
            flow = flows[self.template[block]]
            assert flow is not None
            found.setdefault(str(flow.label), block)
        return found

    def _beginning(self) -> tuple[int, float]:
        """The block after BEGIN PGM, and the mm per unit of length that BEGIN PGM states."""
        statements = [plan.statement for plan in self.all_plans()]
        heads = [i for i, statement in enumerate(statements) if statement is not None and statement[0] == "program"]
        for block in self.blocks_of(heads):
            statement = statements[self.template[block]]
            assert statement is not None
            text = self.program.slice(block, statement[1])
            if found := BEGIN.match(text):
                return block + 1, self._unit(found["rest"])
        raise Fault(NO_BEGIN, "there is no BEGIN PGM: this is not a Klartext program")

    def _unit(self, rest: str) -> float:
        found = UNIT.search(rest.strip().strip('"'))
        if found is None:
            raise Fault(NO_BEGIN, "BEGIN PGM has no unit", "end it with MM or INCH")
        return MM_PER_UNIT[found[1].upper()]
