"""The account of a correction: every motion block ends in exactly one of compensated, passed, refused."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ncfix.compensate.coverage import rule_of
from ncfix.compensate.left import Left
from ncfix.control.moves import Kind, Moves, Rule
from ncfix.diagnostics import Message, Place

SEEN_UM = 0.001
"""By no more figures differ that are of the same path: they are of places looked at, and of errors to a nanometre."""


NOTHING_SEEN: Mapping[str, None] = {"max": None, "rms": None}
"""The figures where nothing was looked at."""


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a block is refused: a code that `ncfix explain` knows, a sentence, and the block that causes it (or -1)."""

    code: str
    text: str
    cause: int = -1


@dataclass(frozen=True, slots=True)
class Refusal:
    """A motion block that was left as it was although it is not right, and why."""

    line: int
    code: str
    reason: str

    def as_dict(self) -> dict[str, object]:
        """Plain data, for `--json`."""
        return {"line": self.line, "code": self.code, "reason": self.reason}


@dataclass(frozen=True, slots=True)
class Account:
    """Motion blocks by what became of them; every one is in exactly one of the three.

    passed   block -> why it was passed, in the words of its program
    refused  block -> why
    rules    block that was passed -> the rule (`program.passing`) by which
    """

    compensated: frozenset[int]
    passed: Mapping[int, str]
    refused: Mapping[int, Reason]
    rules: Mapping[int, str] = field(default_factory=dict)

    @classmethod
    def of(cls, moves: Moves, kept: NDArray[np.bool_], reasons: Mapping[int, Reason]) -> Account:
        """Account for the motions. A block with several motions is refused if any of them is, else passed if any is."""
        motion = moves.kind != Kind.DWELL
        by_rule = np.flatnonzero(motion & (moves.rule == Rule.PASS))
        refused = {block: reasons[block] for block in moves.block[motion & kept].tolist() if block in reasons}
        passed = {int(moves.block[row]): moves.reasons[moves.reason[row]] for row in by_rule}
        passed = {block: reason for block, reason in passed.items() if block not in refused}
        rules = {int(moves.block[row]): rule_of(moves, row).reason for row in by_rule.tolist()}
        compensated = frozenset(moves.block[motion & ~kept].tolist())
        others = refused.keys() | passed.keys()
        return cls(
            compensated - others if others else compensated, passed, refused, {each: rules[each] for each in passed}
        )

    @classmethod
    def together(cls, accounts: Sequence[Account]) -> Account:
        """One account of blocks that are executed in several ways: refused if in any, else passed if in any."""
        if len(accounts) == 1:
            return accounts[0]
        refused = {block: why for each in reversed(accounts) for block, why in each.refused.items()}
        passed = {block: why for each in reversed(accounts) for block, why in each.passed.items()}
        passed = {block: why for block, why in passed.items() if block not in refused}
        rules = {block: rule for each in reversed(accounts) for block, rule in each.rules.items() if block in passed}
        done = frozenset[int]().union(*(each.compensated for each in accounts))
        return cls(done - refused.keys() - passed.keys(), passed, refused, rules)

    @property
    def total(self) -> int:
        """Motion blocks in all."""
        return len(self.compensated) + len(self.passed) + len(self.refused)

    def reasons(self) -> Counter[str]:
        """How often each reason of refusal occurs, in blocks."""
        return Counter(reason.text for reason in self.refused.values())


@dataclass(frozen=True, slots=True)
class FixReport:
    """What was done to one program, as figures.

    error_before, error_after  tip error along the path: {"max", "rms"} in um, and "where" (line) after
            None where nothing was looked at
    max_correction_um  None where nothing was corrected
    rounding_um  what the control's digits may add to the path that was planned
    left    axes that had to stay where they stand, since the program has not said where that is
    block_delete  the positions of block delete for which it is right: the switches that are on in each
    passed_by_rule  blocks that were passed, by rule
    no_figure  motions at feed and holes of which the figures say nothing, by reason
    """

    path: str
    blocks: int
    moves: int
    compensated: int
    passed: int
    changed: bool
    inserted_blocks: int = 0
    max_correction_um: float | None = None
    error_before_um: Mapping[str, float | int | None] = field(default_factory=dict)
    error_after_um: Mapping[str, float | int | None] = field(default_factory=dict)
    refused: tuple[Refusal, ...] = ()
    warnings: tuple[Message, ...] = ()
    strategy: str = ""
    leaves: str = ""
    left: tuple[Left, ...] = ()
    rounding_um: float = 0.0
    block_delete: tuple[list[int], ...] = ()
    passed_by_rule: Mapping[str, int] = field(default_factory=dict)
    no_figure: Mapping[str, int] = field(default_factory=dict)

    def as_dict(self) -> dict[str, object]:
        """The per-file object of `fix --json`."""
        return {
            "path": self.path,
            "output": None,
            "changed": self.changed,
            "blocks": self.blocks,
            "moves": self.moves,
            "compensated": self.compensated,
            "passed": self.passed,
            "passed_by_rule": dict(sorted(self.passed_by_rule.items())),
            "inserted_blocks": self.inserted_blocks,
            "max_correction_um": self.max_correction_um,
            "error_before_um": dict(self.error_before_um),
            "error_after_um": dict(self.error_after_um),
            "rounding_um": round(self.rounding_um, 4),
            "no_figure": dict(sorted(self.no_figure.items())),
            "strategy": self.strategy,
            "leaves": self.leaves,
            "block_delete": list(self.block_delete),
            "left_where_it_stands": [left.as_dict() for left in self.left],
            "refused": [refusal.as_dict() for refusal in self.refused],
            "warnings": [warning.as_dict() for warning in self.warnings],
        }


def with_what_is_left(report: FixReport, tolerance_um: float) -> FixReport:
    """The report with a warning (NCF416) if more is left at the tool tip than tolerance and rounding allow."""
    left, line = report.error_after_um.get("max"), report.error_after_um.get("where")
    if left is None or left <= tolerance_um + report.rounding_um + SEEN_UM:
        return report
    text = (
        f"{left:.2f} um are left here at the tool tip, more than the tolerance of {tolerance_um:g} um "
        f"and the {report.rounding_um:.2f} um of the control's digits"
    )
    hint = "the reason is a motion near it that is not corrected, or that the control works out by itself"
    warning = Message("NCF416", text, Place(report.path, int(line or 0)), hint)
    return replace(report, warnings=(*report.warnings, warning))
