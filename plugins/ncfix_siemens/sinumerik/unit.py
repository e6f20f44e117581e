"""A program of a text: its plans, control structures, labels and parameters; and directions of tool vectors.

A file of an archive may hold several programs, each under its `%_N_NAME_SPF` line; each is a unit of its own.

`Directions` computes the rotary positions for the vectors A3 B3 C3 of many blocks at once. They do not depend on the
current axis positions or the way taken, so they stay valid. Rotated coordinates are not handled here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import field

import numpy as np

from ncfix.arrays import Array, Ints, Mask
from ncfix.control.coordinates import N_LETTERS
from ncfix.control.expressions import Fault, Unknown, Value
from ncfix.control.interpreter import TextUnit
from ncfix.control.lanes.block_rows import words
from ncfix.control.pointing import Pointing, Ways, to_each
from ncfix.text.tree import Constant, Literal, Program, Word
from ncfix.text.tree import StringLiteral as Label
from ncfix.values import frozen, mutable
from ncfix_siemens.sinumerik.expressions import INITIAL, constant
from ncfix_siemens.sinumerik.plans import Branching, SinumerikPlan, plan_of
from ncfix_siemens.sinumerik.vocabulary import HALF_A_TURN

HEAD = re.compile(r"[ \t]*%_N_(\w+?)(?:_(MPF|SPF|CYC|INI))?[ \t]*(?:;.*)?$", re.IGNORECASE)
PROCEDURE = re.compile(r"PROC[ \t]+(?P<name>\w+)[ \t]*(?:\((?P<parameters>.*)\))?(?P<rest>[^()]*)$", re.IGNORECASE)
PARAMETER = re.compile(
    r"[ \t]*(?P<var>VAR[ \t]+)?(?P<type>INT|REAL|BOOL|CHAR|STRING|AXIS|FRAME)[ \t]*(?:\[[^\]]*\])?[ \t]*"
    r"(?P<name>\$?[A-Z_]\w*)[ \t]*(?P<array>\[[^\]]*\]?)?[ \t]*(?:=[ \t]*(?P<default>.*?)[ \t]*)?$",
    re.IGNORECASE,
)

OPENING = {"if": "endif", "while": "endwhile", "for": "endfor", "loop": "endloop", "repeat": "until"}
CLOSING = {end: begin for begin, end in OPENING.items()}
BROKEN = "NCF230"

NO_LENGTH = 1e-9
"""Length below which a vector has no direction."""


@frozen
class ProcParameter:
    """A parameter of a `PROC`.

    kind, name    its type and name
    by_reference  whether the caller's variable may be changed (VAR)
    is_array      whether it is an array
    left_out      its value if the call omits it
    """

    kind: str
    name: str
    by_reference: bool
    is_array: bool
    left_out: Value


class SinumerikUnit(TextUnit[SinumerikPlan]):
    """One program of a text.

    name        name in upper case, "" without a head; kind: MPF, SPF, ... likewise
    ends        block of a structure's begin -> block of its end, and ELSE -> ENDIF
    others      block of an IF -> block of its ELSE, if it has one
    begins      block of a structure's end -> block of its begin
    some_deletable  whether a part of a structure has block skip (/)
    labels      label -> the blocks with it
    parameters  parameters of its PROC
    saves       whether the PROC has SAVE: modal codes and frames of the caller are restored
    directions  rotary positions for its tool vectors
    """

    def __init__(
        self,
        program: Program,
        blocks: tuple[int, int],
        plans: list[SinumerikPlan | None],
        name: tuple[str, str] = ("", ""),
        external: str = "",
    ) -> None:
        self.name, self.kind = name
        super().__init__(program, plan_of, external, blocks, plans)

    def take(self, program: Program, begin: int, stop: int) -> None:
        """See `TextUnit.take`."""
        super().take(program, begin, stop)
        self.ends: dict[int, int] = {}
        self.others: dict[int, int] = {}
        self.begins: dict[int, int] = {}
        self.some_deletable = False
        self.labels: dict[str, list[int]] = {}
        self.parameters: tuple[ProcParameter, ...] = ()
        self.saves = False
        self.directions = Directions()
        self._vector_stops: Ints | None = None
        self._long_ways: Ints | None = None
        self._shortest: Ints | None = None
        self._vectors: Ints | None = None
        self._match_structures()
        self._read_procedure()

    # -- for the fast lane --------------------------------------------------------------------------------------------

    def closed(self) -> Mask:
        """See `TextUnit.closed`."""
        return np.array([plan.lane is None or plan.vector is not None for plan in self.all_plans()], dtype=np.bool_)

    def lane_end(self, block: int) -> int:
        """See `TextUnit`; a block whose `DC` does not lead to the number in it is executed alone."""
        if self._long_ways is None:
            shortest = self.all_shortest()
            found = [self.long_ways(letter) for letter in range(N_LETTERS) if np.any(shortest >> letter & 1)]
            self._long_ways = np.unique(np.concatenate([*found, [self.stop]])).astype(np.int64)
        return min(super().lane_end(block), int(self._long_ways[np.searchsorted(self._long_ways, block)]))

    def all_shortest(self) -> Ints:
        """(s,) bit mask of the axes with `DC` in blocks of each shape."""
        if self._shortest is None:
            self._shortest = np.array([plan.shortest for plan in self.all_plans()], dtype=np.int64)
        return self._shortest

    def long_ways(self, letter: int) -> Ints:
        """The blocks in which `DC` may take an axis past a full turn, or where its words change between forms.

        In all others the shortest way from the last number of the axis leads to the number itself.
        """
        named = np.array([plan.axes >> letter & 1 for plan in self.all_plans()], dtype=np.bool_)
        rows = np.flatnonzero(named[self.program.template[self.begin : self.stop]]) + self.begin
        shapes, first = self.program.template[rows], self.program.first_number[rows]
        shortest = (self.all_shortest() >> letter & 1)[shapes] != 0
        angle = words(self.program.numbers, first, self.lanes.axes[shapes, letter])
        before, other = np.concatenate(([np.nan], angle[:-1])), np.concatenate(([False], shortest[:-1])) != shortest
        near = (angle >= 0.0) & (angle < 360.0) & (np.abs(angle - before) < HALF_A_TURN)
        return rows[other | (shortest & ~near)]

    def shortest_ways(self, block: int, stop: int) -> Iterator[tuple[int, float]]:
        """The axes with `DC` in these blocks, each with its first angle, degree."""
        if not self.all_shortest().any():
            return
        shapes = self.program.template[block:stop]
        bits = self.all_shortest()[shapes]
        for letter in range(N_LETTERS):
            if (found := np.flatnonzero(bits >> letter & 1)).size:
                slot = self.lanes.axes[shapes[found[0]], letter]
                yield letter, float(self.program.numbers[self.program.first_number[block + found[0]] + slot])

    def vector_end(self, block: int) -> int:
        """The first block from `block` on without a tool vector, or not for the fast lane."""
        if self._vector_stops is None:
            given = [shape for shape, plan in enumerate(self.all_plans()) if plan.vector is None]
            self._vector_stops = np.array([*self.blocks_of(given), self.stop])
        return int(self._vector_stops[np.searchsorted(self._vector_stops, block)])

    @property
    def vectors(self) -> Ints:
        """(s, 3) the slots of A3 B3 C3 in the blocks of each shape, -1 for none."""
        if self._vectors is None:
            self._vectors = np.array([plan.vector or (-1, -1, -1) for plan in self.all_plans()], dtype=np.int64)
        return self._vectors

    # -- control structures -------------------------------------------------------------------------------------------

    def branchings(self, block: int) -> Iterator[Branching]:
        """The control structures and jumps of a block."""
        return (step for step in self.plan(block).steps if isinstance(step, Branching))

    def _match_structures(self) -> None:
        branching = [
            shape for shape, plan in enumerate(self.all_plans()) if any(isinstance(s, Branching) for s in plan.steps)
        ]
        stack: list[tuple[str, int]] = []
        for block in self.blocks_of(branching):
            steps = list(self.branchings(block))
            for step in steps:
                self._note(step, steps, block, stack)

    def _note(self, step: Branching, steps: list[Branching], block: int, stack: list[tuple[str, int]]) -> None:
        keyword = step.keyword
        jumps = keyword == "if" and any(other.keyword.startswith("goto") for other in steps)
        self.some_deletable |= self.plan(block).skip is not None
        if keyword == "label":
            self.labels.setdefault(step.label, []).append(block)
        elif keyword in OPENING and not jumps and not (keyword == "repeat" and step.label):
            stack.append((keyword, block))
        elif keyword == "else" and stack and stack[-1][0] == "if":
            self.others[stack[-1][1]] = block
        elif keyword in CLOSING and stack and stack[-1][0] == CLOSING[keyword]:
            _, begin = stack.pop()
            self.ends[begin], self.begins[block] = block, begin
            if begin in self.others:
                self.ends[self.others[begin]] = block

    def parts_of(self, block: int) -> tuple[int, ...]:
        """The blocks of begin, ELSE and end of the structure of which `block` is one."""
        begin = next((each for each, other in self.others.items() if other == block), self.begins.get(block, block))
        parts = begin, self.others.get(begin), self.ends.get(begin)
        return tuple(each for each in parts if each is not None)

    def end_of(self, block: int, keyword: str) -> int:
        """The block in which the structure that begins in `block` ends; raises `Fault` if it does not end."""
        if block not in self.ends:
            raise Fault(BROKEN, f"{OPENING.get(keyword, 'ENDIF').upper()} of this {keyword.upper()} is missing")
        return self.ends[block]

    def begin_of(self, block: int, keyword: str) -> int:
        """The block in which the structure that ends in `block` begins; raises `Fault` if there is none."""
        if block not in self.begins:
            raise Fault(BROKEN, f"{keyword.upper()} without a {CLOSING[keyword].upper()} before it")
        return self.begins[block]

    def find(self, label: str, block: int, keyword: str) -> int | None:
        """The target block of a jump from `block`; None if there is none in the direction that it searches."""
        places = self.labelled(label)
        forward = [place for place in places if place > block]
        backward = [place for place in places if place <= block]
        if keyword.endswith("gotof"):
            return forward[0] if forward else None
        if keyword.endswith("gotob"):
            return backward[-1] if backward else None
        return forward[0] if forward else backward[-1] if backward else None

    def labelled(self, label: str) -> list[int]:
        """The blocks with a label, or with a block number `N100`."""
        if label in self.labels or not (label[:1] == "N" and label[1:].isdigit()):
            return self.labels.get(label, [])
        wanted = float(label[1:])
        return [block for block in range(self.begin, self.stop) if self._number(block) == wanted]

    def _number(self, block: int) -> float | None:
        items = self.plan(block).template.items
        word = next((item for item in items[:3] if isinstance(item, Word) and item.address in ("N", ":")), None)
        if word is None or not isinstance(word.value, Literal | Constant):
            return None
        return float(self.numbers[self.first[block]])

    def solitary(self) -> Iterator[int]:
        """The blocks that REPEATB repeats, or that end a section of REPEAT: no lines may be inserted after them."""
        for block in range(self.begin, self.stop) if self.labels else ():
            for step in self.branchings(block):
                if step.keyword == "repeatb":
                    yield from self.labelled(step.label)
                elif step.keyword == "repeat" and step.written and isinstance(step.written[0], Label):
                    yield from self.labelled(step.written[0].value)

    # -- the procedure ------------------------------------------------------------------------------------------------

    def _read_procedure(self) -> None:
        for block in range(self.begin, self.stop):
            plan = self.plan(block)
            if "program head" in plan.opaque:
                text = self.program.text_of(block).split(";")[0].strip()
                if found := PROCEDURE.search(text):
                    self.name = self.name or found["name"].upper()
                    self.parameters = tuple(parameters(found["parameters"] or ""))
                    self.saves = "SAVE" in (found["rest"] or "").upper().split()
                    return
            elif plan.settings or plan.steps or plan.g or plan.m:
                return


def parameters(text: str) -> Iterator[ProcParameter]:
    """The parameters between the brackets of a PROC."""
    for part in text.split(","):
        if found := PARAMETER.match(part):
            kind, default = found["type"].lower(), found["default"]
            value = INITIAL.get(kind, Unknown()) if default is None else constant(default)
            yield ProcParameter(kind, found["name"].lower(), bool(found["var"]), bool(found["array"]), value)


def is_remark(plan: SinumerikPlan) -> bool:
    """Whether a block has no effect."""
    return not (plan.settings or plan.steps or plan.g or plan.m or plan.opaque)


def units_of(program: Program, external: str = "") -> list[SinumerikUnit]:
    """The programs of a text, in the order written."""
    plans: list[SinumerikPlan | None] = [plan_of(template) for template in program.templates]
    heads: list[tuple[int, str, str]] = []
    shapes = {i for i, plan in enumerate(plans) if plan is not None and "program head" in plan.opaque}
    for block in np.flatnonzero(np.isin(program.template, list(shapes))).tolist():
        if found := HEAD.match(program.text_of(block)):
            heads.append((block, found[1].upper(), (found[2] or "").upper()))
    before = set(program.template[: heads[0][0]].tolist()) if heads else set()
    remarks = heads and all(is_remark(plan) for shape in before if (plan := plans[shape]) is not None)
    starts = [(0, *heads[0][1:]), *heads[1:]] if remarks else [(0, "", ""), *heads]
    stops = [block for block, *_ in starts[1:]] + [len(program)]
    return [
        SinumerikUnit(program, (block, stop), plans, (name, kind), external)
        for (block, name, kind), stop in zip(starts, stops, strict=True)
        if stop > block
    ]


# -- where the vectors A3 B3 C3 of the blocks to come point the tool ---------------------------------------------------


@mutable
class Directions:
    """Cached rotary positions for the tool vectors of blocks from `begin` on."""

    begin: int = 0
    ways: list[Ways] = field(default_factory=list)

    def known(self, pointing: Pointing, unit: SinumerikUnit, block: int, stop: int, least: int) -> list[Ways]:
        """The positions for blocks from `block` up to `stop`; shorter if a vector is not reached or has no length.

        least  recompute if fewer than this are cached
        """
        if not self.begin <= block <= self.begin + len(self.ways) - least:
            self.begin, self.ways = block, ways_of(pointing, vectors_of(unit, block, stop))
        return self.ways[block - self.begin : stop - self.begin]


def vectors_of(unit: SinumerikUnit, start: int, stop: int) -> Array:
    """The tool vectors of blocks, (n, 3); omitted components are zero."""
    program = unit.program
    slots = unit.vectors[program.template[start:stop]]
    values = program.numbers[program.first_number[start:stop, None] + np.maximum(slots, 0)]
    return np.where(slots >= 0, values, 0.0)


def ways_of(pointing: Pointing, vectors: Array) -> list[Ways]:
    """The two rotary positions for each vector (n, 3), up to the first one without length or out of reach."""
    x, y, z = vectors.T
    length = to_each(math.hypot, x, y, z)
    size = np.maximum(length, NO_LENGTH)
    reached, ways = pointing.ways_of_many((x / size, y / size, z / size))
    wrong = np.flatnonzero(~reached | (length < NO_LENGTH))
    return ways[: wrong[0]] if wrong.size else ways
