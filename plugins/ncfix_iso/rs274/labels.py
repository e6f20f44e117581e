"""The labels of o-words: where each was first met."""

from __future__ import annotations

from dataclasses import dataclass, field

from ncfix.control.faults import Fault
from ncfix_iso.rs274.plans import RS274Unit

BAD_FLOW = "NCF230"


@dataclass(slots=True)
class Label:
    """Where an o-word was first met, as what, and how many times a `repeat` is still to run."""

    unit: RS274Unit
    block: int
    keyword: str
    repeats: int = -1


@dataclass(slots=True)
class Labels:
    """All labels that have been met, by their full names."""

    entries: dict[str, Label] = field(default_factory=dict)

    def find(self, name: str) -> Label | None:
        """Where a label stands, if it has been met."""
        return self.entries.get(name)

    def enter(self, name: str, keyword: str, unit: RS274Unit, block: int) -> Label:
        """Note where a label stands; raises `Fault` if it stands elsewhere too."""
        known = self.entries.setdefault(name, Label(unit, block, keyword))
        if known.block != block or known.unit is not unit:
            line = known.unit.program.line(known.block)
            raise Fault(BAD_FLOW, f"the label {oword(name)} is used already, in line {line}")
        return known

    def known(self, name: str, keyword: str, *openings: str) -> Label:
        """The label that a line with this keyword belongs to; raises `Fault` if it was not met as one of `openings`."""
        known = self.entries.get(name)
        if known is None or known.keyword not in openings:
            raise Fault(BAD_FLOW, f"{oword(name)} {keyword} has no {' or '.join(openings)} before it")
        return known


def oword(name: str) -> str:
    """A label as it is written, without the subprogram that it stands in: `o100`, `o<name>`."""
    label = name.rpartition("#")[2]
    return f"o{label}" if label.isdigit() else f"o<{label}>"
