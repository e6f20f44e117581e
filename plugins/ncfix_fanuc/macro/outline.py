"""The outline of a text of Macro B: where its programs, its loops and its numbered blocks are."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ncfix.text.tree import Comment, Flow, Literal, Opaque, Span, Template
from ncfix_iso.rs274.plans import RS274Unit


def named_programs(unit: RS274Unit) -> dict[int, str]:
    """The blocks that begin a program with a name: `<NAME>` stands alone there."""
    program = unit.program
    heads = {shape: span for shape, t in enumerate(program.templates) if (span := head_of(t)) is not None}
    named = (block for block, shape in enumerate(unit.template) if shape in heads) if heads else ()
    return {block: program.slice(block, heads[unit.template[block]]).strip("<> \t") for block in named}


def head_of(template: Template) -> Span | None:
    """Where the name stands that begins a program, if the block is nothing else."""
    items = [item for item in template.items if not isinstance(item, Comment)]
    alone = len(items) == 1 and isinstance(items[0], Opaque) and items[0].kind == "text word"
    return items[0].span if alone else None


@dataclass(slots=True, eq=False)
class Outline:
    """What control statements of one text refer to.

    programs  number (or name) of each program -> the block of its O-word
    starts    the blocks of O-words, ascending
    partner   block of a DO -> that of its END, and the other way round
    numbers   (n,) the N word of each block, NaN without
    """

    unit: RS274Unit
    programs: dict[str, int] = field(default_factory=dict)
    starts: list[int] = field(default_factory=list)
    partner: dict[int, int] = field(default_factory=dict)
    numbers: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        self.numbers = self.unit.program.column("N")
        open_loops: list[tuple[str, int]] = []
        names = named_programs(self.unit)
        for block in sorted({*self.unit.flows, *names}):
            if block in names:
                self.programs.setdefault(names[block], block)
                self.starts.append(block)
                open_loops = []
                continue
            flow = next(item for item in self.unit.program.items_of(block) if isinstance(item, Flow))
            if flow.keyword == "program":
                self.programs.setdefault(str(flow.label), block)
                self.starts.append(block)
                open_loops = []
            elif flow.keyword in ("do", "end"):
                self.note_loop(flow, block, open_loops)

    def note_loop(self, flow: Flow, block: int, open_loops: list[tuple[str, int]]) -> None:
        """Note the DO or END of a loop; `open_loops` are those begun so far in this program."""
        label = str(flow.label)
        if isinstance(flow.label, Literal):
            label = f"{self.unit.program.values_of(block)[flow.label.slot]:g}"
        if flow.keyword == "do":
            open_loops.append((label, block))
            return
        at = next((i for i in range(len(open_loops) - 1, -1, -1) if open_loops[i][0] == label), -1)
        if at >= 0:
            self.partner[block], self.partner[open_loops[at][1]] = open_loops[at][1], block
            del open_loops[at:]

    def bounds(self, block: int) -> tuple[int, int]:
        """The first block of the program that `block` stands in, and the one after its last."""
        at = bisect_right(self.starts, block)
        first = self.starts[at - 1] if at else 0
        return first, self.starts[at] if at < len(self.starts) else self.unit.stop

    def numbered(self, number: int, block: int) -> int | None:
        """The block with that N word in the program that `block` stands in: the next one, else the first."""
        first, stop = self.bounds(block)
        found = first + np.flatnonzero(self.numbers[first:stop] == number)
        later = found[found > block]
        if len(later):
            return int(later[0])
        return int(found[0]) if len(found) else None
