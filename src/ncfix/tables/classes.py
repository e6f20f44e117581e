"""The class (ISO/TR 16907) of tables: which errors they hold, by the axes that each of them looks up and corrects.

Not what a control could hold, but what was written: one table of X over itself is L-POS, whatever else there might be.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass

from ncfix.tables.neutral import Compensation, Term

LINEAR = ("X", "Y", "Z")
NOTHING = "none"
"""No table corrects anything."""


@dataclass(frozen=True, slots=True)
class Line:
    """An axis that a table or a product of tables corrects, over these."""

    output: str
    inputs: frozenset[str]
    product: bool


def of_terms(tables: Compensation, rotary: Collection[str]) -> str:
    """The class of sums and products of tables; rotary: the rotary axes of the machine."""
    lines = [line for term in tables.terms for line in _lines(term)]
    linear = [line for line in lines if line.output not in rotary]
    found = list(_linear([line for line in linear if line.inputs.isdisjoint(rotary)], linear))
    if any(not line.inputs.isdisjoint(rotary) for line in linear):
        together = any(len(line.inputs) > 2 and not line.inputs.isdisjoint(rotary) for line in linear)
        found.append("the position part of R-VOL" if together and _reach(linear, rotary) else "part of R-VOL")
    if any(line.output in rotary and line.output in line.inputs for line in lines):
        found.append("R-RAX")
    return joined(found)


def joined(names: Iterable[str]) -> str:
    """Classes as a text."""
    *head, last = list(names) or [NOTHING]
    return f"{', '.join(head)} and {last}" if head else last


def _linear(lines: Sequence[Line], all_lines: Sequence[Line]) -> Iterator[str]:
    """What tables of linear axes over linear axes are: all of it, or which parts."""
    if any(len(line.inputs) > 1 for line in all_lines) and _reach(all_lines, ()):
        yield "L-VOL"
        return
    if any(line.output in line.inputs and not line.product for line in lines):
        yield "L-POS"
    if any(line.inputs - {line.output} and not line.product for line in lines):
        yield from ("L-STR", "L-SQR")
    if any(line.inputs - {line.output} for line in lines):
        yield "part of L-ANG"


def _reach(lines: Sequence[Line], rotary: Collection[str]) -> bool:
    """Whether each axis that is corrected is so over X, Y and Z, and over a rotary axis if there are some."""
    for output in {line.output for line in lines}:
        reached = {name for line in lines if line.output == output for name in line.inputs}
        if not reached >= {*LINEAR} or (rotary and reached.isdisjoint(rotary)):
            return False
    return bool(lines)


def _lines(term: Term) -> Iterator[Line]:
    inputs = frozenset(name for factor in term.factors for name in factor.inputs)
    if all(factor.values.any() for factor in term.factors):
        for index, name in enumerate(term.outputs):
            if term.factors[0].values[..., index].any():
                yield Line(name, inputs, len(term.factors) > 1)
