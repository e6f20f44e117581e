"""The report of a correction that was made part by part: the same as of one that was made at once."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ncfix.compensate import FixOptions
from ncfix.compensate.account import (
    NOTHING_SEEN,
    Account,
    FixReport,
    Left,
    Refusal,
    either,
    joined,
    left_where_they_stand,
    with_what_is_left,
    without_figure,
)
from ncfix.compensate.block_delete import Together, worst_findings
from ncfix.compensate.following import Numbers, numbers_at_the_beginning, numbers_together
from ncfix.compensate.plan.arrays import Mask, lengths
from ncfix.compensate.plan.deviation import PathError
from ncfix.compensate.plan.findings import Notes
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.plan.written import rounding_along
from ncfix.compensate.solve import Settled, increments
from ncfix.control.flatten import Flat
from ncfix.control.moves import Moves
from ncfix.diagnostics import Message, Place
from ncfix.machine import Machine, State
from ncfix.text.tree import Program


@dataclass(slots=True)
class Side:
    """Tip errors on one side of the correction: largest, its line, sum of squares times way."""

    max: float = 0.0
    line: int | None = None
    squares: float = 0.0

    def take(self, other: Side) -> None:
        """Take in what comes behind."""
        self.squares += other.squares
        if other.max > self.max:
            self.max, self.line = other.max, other.line

    def as_dict(self, way: float, samples: int) -> dict[str, float | int | None]:
        """The figures, um, of so many places that were looked at."""
        if not samples:
            return dict(NOTHING_SEEN)
        rms = math.sqrt(self.squares / way) if way else 0.0
        return {"max": round(self.max * 1e3, 4), "rms": round(rms * 1e3, 4)}


@dataclass(slots=True)
class Tally:
    """What has been done to the parts so far.

    step     of the control's digits, mm
    rounding what these add to the path at most, mm
    passed   blocks, by rule; `unseen`: motions that have no figure, by reason
    samples  places that were looked at
    numbers  those in the first lines, by which a program is known that was corrected before
    """

    step: float
    blocks: int = 0
    moves: int = 0
    compensated: int = 0
    passed: Counter[str] = field(default_factory=Counter)
    unseen: Counter[str] = field(default_factory=Counter)
    samples: int = 0
    inserted: int = 0
    changed: bool = False
    largest: float = 0.0
    rounding: float = 0.0
    way: float = 0.0
    before: Side = field(default_factory=Side)
    after: Side = field(default_factory=Side)
    refused: list[Refusal] = field(default_factory=list)
    notes: dict[tuple[str, str], Message] = field(default_factory=dict)
    found: Notes = field(default_factory=Notes)
    left: dict[str, Left] = field(default_factory=dict)
    numbers: Numbers = field(default_factory=dict)

    def add(self, program: Program, together: Together, own: Mask | None, machine: Machine) -> None:
        """Take in a part, in all positions of block delete; of its motions those that are `own` (n,), if given."""
        every, steps = together.settled, increments(machine)
        lacking = [each.lacking(steps, own) for each in every]
        left = [left_where_they_stand(program, each.moves, lack) for each, lack in zip(every, lacking, strict=True)]
        self.left = joined(self.left, either(left))
        account, unseen = (
            Account.together([Account.of(each.moves, each.kept, each.reasons) for each in every]),
            Counter[str](),
        )
        for k, (settled, lack, found) in enumerate(zip(every, lacking, worst_findings(every), strict=True)):
            moves, plan, intent = settled.moves, settled.plan, Intent(machine, settled.moves, State())
            self.rounding = max(self.rounding, rounding_along(intent, plan.pieces, plan.corners, own))
            self.largest = max(self.largest, largest_correction(moves, settled, own))
            unseen |= without_figure(moves, settled.kept, lack.axes if lack else None, own)
            for finding in found:
                self.found.add(finding, program, moves, own, k)
        self.unseen += unseen
        theirs = set() if own is None else set(every[0].moves.block[~own].tolist())
        self.moves += max(len(each.moves) for each in every) if own is None else int(own.sum())
        self.compensated += len(account.compensated - theirs)
        self.passed += Counter(rule for block, rule in account.rules.items() if block not in theirs)
        self.inserted += together.added_blocks
        self.changed |= len(together.splices) > 0
        refused = {block: reason for block, reason in account.refused.items() if block not in theirs}
        self.refused += refusals(program, replace(account, refused=refused))
        self.numbers = numbers_at_the_beginning(program, every[0], self.step, True if own is None else own)

    def add_plain(self, program: Program, settled: Settled, largest: float, intent: Intent) -> None:
        """Take in a part of dwells and motions that were corrected, each in a block of its own.

        largest  shift of a linear command, mm
        """
        self.rounding = max(self.rounding, rounding_along(intent, settled.plan.pieces, settled.plan.corners))
        self.moves += len(settled.moves)
        self.compensated += int(np.count_nonzero(~settled.kept))
        self.inserted += settled.emission.added_blocks
        self.largest = max(self.largest, largest)
        self.changed |= len(settled.emission.splices) > 0
        self.numbers = numbers_at_the_beginning(program, settled, self.step)
        for finding in settled.plan.findings:
            self.found.add(finding, program, settled.moves)

    def take(self, other: Tally) -> None:
        """Take in what has been done to the part that comes next."""
        self.blocks += other.blocks
        self.moves += other.moves
        self.compensated += other.compensated
        self.passed += other.passed
        self.inserted += other.inserted
        self.changed |= other.changed
        self.largest = max(self.largest, other.largest)
        self.rounding = max(self.rounding, other.rounding)
        self.unseen += other.unseen
        self.samples += other.samples
        self.way += other.way
        self.before.take(other.before)
        self.after.take(other.after)
        self.refused += other.refused
        self.notes = other.notes | self.notes
        self.left = joined(self.left, other.left)
        self.found.take(other.found)
        if other.numbers:
            self.numbers = numbers_together(self.numbers, other.numbers, self.step)

    def figures(self, program: Program, errors: Sequence[tuple[Moves, PathError]]) -> list[int | None]:
        """Take in the tip errors of a part in each position of block delete; the lines of the largest ones after."""
        way = max(each.way for _, each in errors)
        self.way += way
        self.samples += max(each.samples for _, each in errors)
        for side, found in (
            (self.before, [(moves, each.before) for moves, each in errors]),
            (self.after, [(moves, each.after) for moves, each in errors]),
        ):
            lines = [program.line(int(moves.block[own.move])) if own.move >= 0 else None for moves, own in found]
            worst = max(range(len(found)), key=lambda k: found[k][1].max)
            side.take(Side(found[worst][1].max, lines[worst], max(own.rms for _, own in found) ** 2 * way))
        return lines

    def report(self, path: str, messages: tuple[Message, ...], options: FixOptions) -> FixReport:
        """The report; `messages` are those of following the program."""
        figures = options.verify
        after = self.after.as_dict(self.way, self.samples) | {"where": self.after.line}
        report = FixReport(
            path=path,
            blocks=self.blocks,
            moves=self.moves,
            compensated=self.compensated,
            passed=self.passed.total(),
            changed=self.changed,
            inserted_blocks=self.inserted,
            max_correction_um=self.largest * 1e3 if self.compensated else None,
            error_before_um=self.before.as_dict(self.way, self.samples) if figures else {},
            error_after_um=after if figures else {},
            refused=tuple(self.refused),
            warnings=(
                *messages,
                *self.notes.values(),
                *(left.message(path) for left in self.left.values()),
                *self.found.messages(),
            ),
            strategy=options.strategy,
            leaves=get_strategy(options.strategy).leaves,
            left=tuple(self.left.values()),
            rounding_um=self.rounding * 1e3,
            passed_by_rule=self.passed,
            no_figure=self.unseen,
        )
        return with_what_is_left(report, options.tolerance_um)


def refusals(program: Program, account: Account) -> list[Refusal]:
    """What was refused, by line."""
    blocks = sorted(account.refused)
    lines = program.lines(np.array(blocks, dtype=np.int64)).tolist()
    reasons = [account.refused[block] for block in blocks]
    causes = program.lines(np.array([max(reason.cause, 0) for reason in reasons], dtype=np.int64)).tolist()
    return [
        Refusal(line, reason.code, reason.text if reason.cause < 0 else f"{reason.text} (line {cause})")
        for line, reason, cause in zip(lines, reasons, causes, strict=True)
    ]


def largest_correction(moves: Moves, settled: Settled, own: Mask | None = None) -> float:
    """The largest shift of a linear command, mm; of motions `own` (n,) if given."""
    done = ~settled.kept if own is None else own & ~settled.kept
    return float(np.nanmax(lengths(settled.shift[:, ~moves.rotary])[done], initial=0.0)) if done.any() else 0.0


def in_lines(report: FixReport, flat: Flat, program: Program) -> FixReport:
    """The report of a flat program with the lines of the original."""

    def placed(message: Message) -> Message:
        place = message.place
        if place is None or not 1 <= place.line <= len(flat.lines):
            return message
        return replace(message, place=replace(place, line=flat.lines[place.line - 1]))

    refused = tuple(replace(each, line=flat.lines[each.line - 1]) for each in report.refused)
    text = f"the program is written out flat: {len(program)} lines become {len(flat.lines)}"
    note = Message("NCF445", text, Place(program.path), "blocks executed several times are corrected one by one")
    after = dict(report.error_after_um)
    if after.get("where"):
        after["where"] = flat.lines[int(after["where"] or 1) - 1]
    return replace(report, refused=refused, error_after_um=after, warnings=(note, *map(placed, report.warnings)))
