"""A program text while it is executed: its plans, its control structures and labels, and what it is called with.

A file of an archive may hold several programs, each under its `%_N_NAME_SPF` line: each is a unit of its own.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ncfix.control.ahead import Ahead
from ncfix.control.faults import Fault
from ncfix.control.lane_tables import LaneTables
from ncfix.text.tree import Constant, Literal, Program, Word, view
from ncfix.text.tree import Text as Label
from ncfix_siemens.sinumerik.directions import Directions
from ncfix_siemens.sinumerik.plans import Branching, Plan, plan_of

HEAD = re.compile(r"[ \t]*%_N_(\w+?)(?:_(?:MPF|SPF|CYC|INI))?[ \t]*(?:;.*)?$", re.IGNORECASE)
PROCEDURE = re.compile(r"PROC[ \t]+(?P<name>\w+)[ \t]*(?:\((?P<parameters>.*)\))?(?P<rest>[^()]*)$", re.IGNORECASE)
PARAMETER = re.compile(
    r"[ \t]*(?P<var>VAR[ \t]+)?(?P<type>INT|REAL|BOOL|CHAR|STRING|AXIS|FRAME)[ \t]*(?:\[[^\]]*\])?[ \t]*"
    r"(?P<name>\$?[A-Z_]\w*)[ \t]*(?:\[[^\]]*\])?[ \t]*(?:=(?P<default>.*))?",
    re.IGNORECASE,
)

OPENING = {"if": "endif", "while": "endwhile", "for": "endfor", "loop": "endloop", "repeat": "until"}
CLOSING = {end: begin for begin, end in OPENING.items()}
BROKEN = "NCF230"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a `PROC`: its type and name; `by_reference`: the caller's variable may be changed (VAR)."""

    kind: str
    name: str
    by_reference: bool


@dataclass(frozen=True, slots=True)
class Text:
    """A program with the plans of its shapes, shared by the units in it."""

    program: Program
    plans: list[Plan]
    template: Sequence[int]
    first: Sequence[int]
    numbers: Sequence[float]

    @classmethod
    def of(cls, program: Program) -> Text:
        """The plans of a program."""
        plans = [plan_of(template) for template in program.templates]
        return cls(program, plans, view(program.template), view(program.first_number), view(program.numbers))

    def followed_by(self, program: Program) -> Text:
        """The next part of the same program: its templates are those of this one, and more."""
        self.plans.extend(plan_of(template) for template in program.templates[len(self.plans) :])
        return Text(program, self.plans, view(program.template), view(program.first_number), view(program.numbers))


@dataclass(slots=True, eq=False)
class Unit:
    """One program of a text, from block `begin` up to `stop`.

    name        upper case; empty where no head says it
    external    the file that it comes from, empty for the main program's own text
    ends        block of a structure's begin -> block of its end, and ELSE -> ENDIF
    others      block of an IF -> block of its ELSE, where it has one
    begins      block of a structure's end -> block of its begin
    labels      label -> the blocks where it stands
    parameters  of its PROC
    saves       the PROC says SAVE: modal codes and frames of the caller come back
    ahead       what the fast lane has seen of the blocks to come
    directions  where their vectors point the tool
    """

    text: Text
    begin: int
    stop: int
    name: str = ""
    external: str = ""
    ends: dict[int, int] = field(default_factory=dict)
    others: dict[int, int] = field(default_factory=dict)
    begins: dict[int, int] = field(default_factory=dict)
    labels: dict[str, list[int]] = field(default_factory=dict)
    parameters: tuple[Parameter, ...] = ()
    saves: bool = False
    ahead: Ahead = field(default_factory=Ahead)
    directions: Directions = field(default_factory=Directions)
    _lane_stops: NDArray[np.int64] | None = None
    _lanes: LaneTables | None = None
    _vector_stops: NDArray[np.int64] | None = None
    _vectors: NDArray[np.int64] | None = None

    def __post_init__(self) -> None:
        self._match_structures()
        self._read_procedure()

    def plan(self, block: int) -> Plan:
        """The plan of a block."""
        return self.text.plans[self.text.template[block]]

    @property
    def program(self) -> Program:
        """The program whose text it is."""
        return self.text.program

    # -- for the fast lane --------------------------------------------------------------------------------------------

    def plan_of_shape(self, shape: int) -> Plan:
        """The plan of a shape."""
        return self.text.plans[shape]

    def lane_end(self, block: int) -> int:
        """The first block from `block` on that cannot go through the fast lane."""
        if self._lane_stops is None:
            closed = np.array(
                [plan.lane is None or plan.vector is not None for plan in self.text.plans], dtype=np.bool_
            )
            blocked = np.flatnonzero(closed[self.program.template[self.begin : self.stop]]) + self.begin
            self._lane_stops = np.append(blocked, self.stop)
        return int(self._lane_stops[np.searchsorted(self._lane_stops, block)])

    def vector_end(self, block: int) -> int:
        """The first block from `block` on that gives no direction of the tool, or is not for the fast lane."""
        if self._vector_stops is None:
            other = np.array([plan.vector is None for plan in self.text.plans], dtype=np.bool_)
            blocked = np.flatnonzero(other[self.program.template[self.begin : self.stop]]) + self.begin
            self._vector_stops = np.append(blocked, self.stop)
        return int(self._vector_stops[np.searchsorted(self._vector_stops, block)])

    @property
    def vectors(self) -> NDArray[np.int64]:
        """(s, 3) the slots of A3 B3 C3 in the blocks of each shape, -1 for none."""
        if self._vectors is None:
            self._vectors = np.array([plan.vector or (-1, -1, -1) for plan in self.text.plans], dtype=np.int64)
        return self._vectors

    @property
    def lanes(self) -> LaneTables:
        """The lanes of all shapes as columns."""
        if self._lanes is None:
            self._lanes = LaneTables.of([plan.lane for plan in self.text.plans])
        return self._lanes

    # -- control structures -------------------------------------------------------------------------------------------

    def branchings(self, block: int) -> Iterator[Branching]:
        """The control structures and jumps of a block."""
        return (step for step in self.plan(block).steps if isinstance(step, Branching))

    def _match_structures(self) -> None:
        branching = {
            shape for shape, plan in enumerate(self.text.plans) if any(isinstance(s, Branching) for s in plan.steps)
        }
        shapes = self.program.template[self.begin : self.stop]
        rows = np.flatnonzero(np.isin(shapes, list(branching))) + self.begin
        stack: list[tuple[str, int]] = []
        for block in rows.tolist():
            steps = list(self.branchings(block))
            for step in steps:
                self._note(step, steps, block, stack)

    def _note(self, step: Branching, steps: list[Branching], block: int, stack: list[tuple[str, int]]) -> None:
        keyword = step.keyword
        jumps = keyword == "if" and any(other.keyword.startswith("goto") for other in steps)
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

    def end_of(self, block: int, keyword: str) -> int:
        """Where the structure that begins in a block ends; raises `Fault` if it does not."""
        if block not in self.ends:
            raise Fault(BROKEN, f"{OPENING.get(keyword, 'ENDIF').upper()} of this {keyword.upper()} is missing")
        return self.ends[block]

    def find(self, label: str, block: int, keyword: str) -> int | None:
        """The block that a jump leads to; None if there is none in the direction that it looks."""
        places = self.blocks_of(label)
        forward = [place for place in places if place > block]
        backward = [place for place in places if place <= block]
        if keyword.endswith("gotof"):
            return forward[0] if forward else None
        if keyword.endswith("gotob"):
            return backward[-1] if backward else None
        return forward[0] if forward else backward[-1] if backward else None

    def blocks_of(self, label: str) -> list[int]:
        """The blocks that bear a label, or a block number."""
        if label in self.labels or not (label[:1] == "N" and label[1:].isdigit()):
            return self.labels.get(label, [])
        wanted = float(label[1:])
        return [block for block in range(self.begin, self.stop) if self._number(block) == wanted]

    def _number(self, block: int) -> float | None:
        items = self.plan(block).template.items
        word = next((item for item in items[:3] if isinstance(item, Word) and item.address in ("N", ":")), None)
        if word is None or not isinstance(word.value, Literal | Constant):
            return None
        return float(self.text.numbers[self.text.first[block]])

    def solitary(self) -> Iterator[int]:
        """The blocks that REPEATB repeats, or with which a section of REPEAT ends."""
        for block in range(self.begin, self.stop) if self.labels else ():
            for step in self.branchings(block):
                if step.keyword == "repeatb":
                    yield from self.blocks_of(step.label)
                elif step.keyword == "repeat" and step.written and isinstance(step.written[0], Label):
                    yield from self.blocks_of(step.written[0].value)

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


def parameters(text: str) -> Iterator[Parameter]:
    """The parameters between the brackets of a PROC."""
    for part in text.split(","):
        if found := PARAMETER.match(part):
            yield Parameter(found["type"].lower(), found["name"].lower(), bool(found["var"]))


def is_remark(plan: Plan) -> bool:
    """Whether a block does nothing."""
    return not (plan.settings or plan.steps or plan.g or plan.m or plan.opaque)


def units_of(program: Program, external: str = "") -> list[Unit]:
    """The programs of a text, in the order written."""
    text = Text.of(program)
    heads: list[tuple[int, str]] = []
    shapes = {i for i, plan in enumerate(text.plans) if "program head" in plan.opaque}
    for block in np.flatnonzero(np.isin(program.template, list(shapes))).tolist():
        if found := HEAD.match(program.text_of(block)):
            heads.append((block, found[1].upper()))
    remarks = heads and all(is_remark(text.plans[shape]) for shape in text.template[: heads[0][0]])
    starts = [(0, heads[0][1]), *heads[1:]] if remarks else [(0, ""), *heads]
    stops = [block for block, _ in starts[1:]] + [len(program)]
    pairs = zip(starts, stops, strict=True)
    return [Unit(text, block, stop, name, external) for (block, name), stop in pairs if stop > block]
