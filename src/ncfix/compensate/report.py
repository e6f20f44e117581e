"""The report of a correction: figures, refusals and warnings, added up over the parts of a program."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING

import numpy as np

from ncfix.arrays import Mask, lengths
from ncfix.compensate import FixOptions
from ncfix.compensate.account import (
    Account,
    LeftAxis,
    either,
    in_sequence,
    left_where_they_stand,
    said_of,
    without_figure,
)
from ncfix.compensate.block_delete import JointPlan, worst_findings
from ncfix.compensate.following import LOOKED, Numbers, numbers_of, numbers_together
from ncfix.compensate.plan.figure_tally import PathError
from ncfix.compensate.plan.findings import Finding, FindingKind, Notes
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.plan.written import rounding_along
from ncfix.compensate.solve import WrittenPlan, increments
from ncfix.control.interpreter import NEVER
from ncfix.control.moves import Moves
from ncfix.diagnostics import Message, Place
from ncfix.machine import Machine
from ncfix.text.tree import Program
from ncfix.values import frozen, mutable

if TYPE_CHECKING:
    from ncfix.control.flatten import Flat

TIMED = "this motion of rotary axes alone, and others whose correction moves linear axes, get inverse time (G93)"
HAS_G93 = "check that the control has G93"
STOPS = "this motion and others under exact stop (G60, G61) are split: the control stops at the end of every piece"
MARKS = "if stops may leave marks, program continuous path mode (G64)"
SEEN_UM = 0.001
"""Difference, um, up to which two figures count as equal: they are taken at sample points and computed to 1 nm."""


WRITTEN_FLAT = "NCF445"
NOTHING_SEEN: Mapping[str, None] = {"max": None, "rms": None}
"""The figures of a program in which no place was examined."""


@frozen
class Refusal:
    """A motion block that was refused, that is, left uncorrected although it needs a correction, and why."""

    line: int
    code: str
    reason: str

    def as_dict(self) -> dict[str, object]:
        """Plain data, for `--json`."""
        return {"line": self.line, "code": self.code, "reason": self.reason}


@frozen
class FixReport:
    """The report of the correction of one program.

    error_before_um, error_after_um  tip error along the path: "max" and "rms" in um, after also "where" (line); None
            if no place was examined, empty without `verify`
    max_correction_um  largest shift of a linear command; None if nothing was corrected
    rounding_um  largest deviation that the control's digits may add to the planned path
    left    axes that got no word although a correction needed one, and so were left where they stand
    block_delete  the positions of block delete for which the program is right: the switches that are on in each
    passed_by_rule  number of blocks that were passed, by rule
    no_figure  number of feeds, arcs and holes that the figures leave out, by reason
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
    left: tuple[LeftAxis, ...] = ()
    rounding_um: float = 0.0
    block_delete: tuple[list[int], ...] = ()
    passed_by_rule: Mapping[str, int] = field(default_factory=dict)
    no_figure: Mapping[str, int] = field(default_factory=dict)

    @property
    def refusals(self) -> list[Message]:
        """The refused blocks, as messages."""
        return [Message(each.code, each.reason, Place(self.path, each.line)) for each in self.refused]

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

    def with_what_is_left(self, tolerance_um: float) -> FixReport:
        """The report with warnings about the tip error that is left.

        NCF416: it exceeds tolerance and rounding. NCF418: it is larger than without the correction, both max and rms.
        """
        left, line, found = self.error_after_um.get("max"), self.error_after_um.get("where"), list[Message]()
        if left is None:
            return self
        if left > tolerance_um + self.rounding_um + SEEN_UM:
            text = (
                f"a tip error of {left:.2f} um is left here, more than the tolerance of {tolerance_um:g} um and the "
                f"{self.rounding_um:.2f} um of the control's digits"
            )
            hint = "the reason is an adjacent motion that is not corrected, or that the control calculates"
            found.append(Message("NCF416", text, Place(self.path, int(line or 0)), hint))
        sides = [
            (self.error_before_um.get(figure) or 0.0, self.error_after_um.get(figure) or 0.0)
            for figure in ("max", "rms")
        ]
        if self.changed and self.error_before_um and all(after > before + SEEN_UM for before, after in sides):
            (max_before, max_after), (rms_before, rms_after) = sides
            text = (
                f"the tip errors of this program grow: max {max_before:.2f} um and rms {rms_before:.2f} um before, "
                f"max {max_after:.2f} um and rms {rms_after:.2f} um after the correction"
            )
            hint = "use a smaller --tolerance-um, or the original program"
            found.append(Message("NCF418", text, Place(self.path), hint))
        return replace(self, warnings=(*self.warnings, *found))


@mutable
class Side:
    """Tip errors before, or after, the correction.

    max      largest, mm, at `line`
    squares  mean square times length of path, mm^3
    """

    max: float = 0.0
    line: int | None = None
    squares: float = 0.0

    def take(self, other: Side) -> None:
        """Add the tip errors of a later part."""
        self.squares += other.squares
        if other.max > self.max:
            self.max, self.line = other.max, other.line

    def as_dict(self, way: float, samples: int) -> dict[str, float | int | None]:
        """The figures "max" and "rms", um; None without samples. `way`: length of the path, mm."""
        if not samples:
            return dict(NOTHING_SEEN)
        rms = math.sqrt(self.squares / way) if way else 0.0
        return {"max": round(self.max * 1e3, 4), "rms": round(rms * 1e3, 4)}


SUMS = ("blocks", "moves", "compensated", "passed", "unseen", "samples", "inserted", "way", "refused")
"""The fields of a tally that are summed over the parts."""


def as_written(solution: WrittenPlan) -> Iterator[Finding]:
    """Findings about the text: turns that are written with inverse time, and split motions under exact stop."""
    if timed := solution.emission.timed:
        yield Finding.of("NCF456", np.array(timed, dtype=np.intp), TIMED, HAS_G93, FindingKind.ONCE)
    stops, pieces = solution.moves.exact_stop, solution.plan.pieces
    if (rows := np.flatnonzero(stops & (np.bincount(pieces.move, minlength=len(stops)) > 1))).size:
        yield Finding.of("NCF283", rows, STOPS, MARKS, FindingKind.ONCE)


@mutable
class Tally:
    """The figures of the parts that have been corrected so far.

    step      least increment of the control, mm
    passed    number of passed blocks, by rule; `unseen`: number of motions without a figure, by reason
    samples   number of places at which the path was examined; `way`: its length, mm
    largest   largest shift of a linear command, mm
    rounding  largest deviation that the control's digits add to the path, mm
    numbers   the commands in the first lines, which tell whether the program was corrected before
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
    left: dict[str, LeftAxis] = field(default_factory=dict)
    numbers: Numbers = field(default_factory=dict)

    def add(self, program: Program, joint: JointPlan, own: Mask | None, machine: Machine) -> None:
        """Add a part, in all positions of block delete; `own` (n,): the motions to count, None: all."""
        every, steps = joint.plans, increments(machine)
        lacking = [each.lacking(steps, own) for each in every]
        left = [left_where_they_stand(program, each.moves, lack) for each, lack in zip(every, lacking, strict=True)]
        self.left = in_sequence(self.left, either(left))
        account = Account.together([Account.of(each.moves, each.unchanged, each.reasons) for each in every])
        unseen = Counter[str]()
        for k, (solution, lack, found) in enumerate(zip(every, lacking, worst_findings(every), strict=True)):
            moves, plan, intent = solution.moves, solution.plan, solution.intent
            self.rounding = max(self.rounding, rounding_along(intent, plan.pieces, plan.corners, own))
            done = ~solution.unchanged if own is None else own & ~solution.unchanged
            shift = lengths(solution.shift[:, ~moves.rotary])[done]
            self.largest = float(np.nanmax(shift, initial=self.largest))
            unseen |= without_figure(moves, solution.unchanged, lack.axes if lack else None, own)
            for finding in (*found, *as_written(solution)):
                self.found.add(finding, program, moves, own, k)
        self.unseen += unseen
        theirs = set() if own is None else set(every[0].moves.block[~own].tolist())
        self.moves += max(len(each.moves) for each in every) if own is None else int(own.sum())
        self.compensated += len(account.compensated - theirs)
        self.passed += Counter(rule for block, rule in account.rules.items() if block not in theirs)
        self.inserted += joint.added_blocks
        self.changed |= len(joint.splices) > 0
        refused = {block: reason for block, reason in account.refused.items() if block not in theirs}
        self.refused += refusals(program, replace(account, refused=refused))
        self._look_at_numbers(program, every[0], True if own is None else own)

    def add_plain(self, program: Program, solution: WrittenPlan, largest: float, intent: Intent) -> None:
        """Add a part of dwells and corrected motions, each in a block of its own.

        largest  largest shift of a linear command, mm
        """
        self.rounding = max(self.rounding, rounding_along(intent, solution.plan.pieces, solution.plan.corners))
        self.moves += len(solution.moves)
        self.compensated += int(np.count_nonzero(~solution.unchanged))
        self.inserted += solution.emission.added_blocks
        self.largest = max(self.largest, largest)
        self.changed |= len(solution.emission.splices) > 0
        self._look_at_numbers(program, solution)
        for finding in (*solution.plan.findings, *as_written(solution)):
            self.found.add(finding, program, solution.moves)

    def _look_at_numbers(self, program: Program, solution: WrittenPlan, own: Mask | bool = True) -> None:
        """Note the commands in the first lines of the program; `own` (n,): the motions of this part."""
        if program.first_line <= LOOKED:
            among = ~solution.unchanged & own & (program.lines(solution.moves.block) <= LOOKED)
            self.numbers = numbers_of(solution.moves, solution.shift, among, self.step)

    def take(self, other: Tally) -> None:
        """Add the tally of the next part."""
        for name in SUMS:
            total = getattr(self, name)
            total += getattr(other, name)
            setattr(self, name, total)
        self.changed |= other.changed
        self.largest = max(self.largest, other.largest)
        self.rounding = max(self.rounding, other.rounding)
        self.before.take(other.before)
        self.after.take(other.after)
        self.notes = other.notes | self.notes
        self.left = in_sequence(self.left, other.left)
        self.found.take(other.found)
        if other.numbers:
            self.numbers = numbers_together(self.numbers, other.numbers, self.step)

    def figures(self, program: Program, errors: Sequence[tuple[Moves, PathError]]) -> list[int | None]:
        """Add the tip errors of a part in each position of block delete.

        Returns the line of the largest error after the correction in each position; None if no motion has one.
        """
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
        """The report. `messages`: the messages from following the program."""
        figures = options.figures
        after = self.after.as_dict(self.way, self.samples) | {"where": self.after.line}
        alone = not (self.compensated or self.refused)
        still = [each for each in messages if alone and each.code == NEVER]
        uncorrected = [  # if nothing else is corrected, what was meant stays uncorrected
            Refusal(each.place.line if each.place else 0, each.code, f"{each.text}; nothing else in it is corrected")
            for each in still
        ]
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
            refused=(*self.refused, *uncorrected),
            warnings=(
                *(each for each in messages if each not in still),
                *self.notes.values(),
                *said_of(self.left.values(), path),
                *self.found.messages(),
            ),
            strategy=options.strategy,
            leaves=get_strategy(options.strategy).leaves,
            left=tuple(self.left.values()),
            rounding_um=self.rounding * 1e3,
            passed_by_rule=self.passed,
            no_figure=self.unseen,
        )
        return report.with_what_is_left(options.tolerance_um)


def refusals(program: Program, account: Account) -> list[Refusal]:
    """The refused blocks, in the order of their lines."""
    blocks = sorted(account.refused)
    lines = program.lines(np.array(blocks, dtype=np.int64)).tolist()
    reasons = [account.refused[block] for block in blocks]
    causes = program.lines(np.array([max(reason.cause, 0) for reason in reasons], dtype=np.int64)).tolist()
    return [
        Refusal(line, reason.code, reason.text if reason.cause < 0 else f"{reason.text} (line {cause})")
        for line, reason, cause in zip(lines, reasons, causes, strict=True)
    ]


LEFT_OUT = (
    "the flat program does not have them: if they are another program, put it in a file of its own and correct that"
)
"""Hint about blocks that the program never goes through."""


def in_lines(report: FixReport, flat: Flat, program: Program, said: Sequence[Message]) -> FixReport:
    """The report of a flat program, with the lines of the original, and of what `said` of that the blocks left out."""

    def with_lines(message: Message) -> Message:
        place = message.place
        if place is None or not 1 <= place.line <= len(flat.lines):
            return message
        return replace(message, place=replace(place, line=flat.lines[place.line - 1]))

    refused = tuple(replace(each, line=flat.lines[each.line - 1]) for each in report.refused)
    text = f"the program is written out flat: {len(program)} lines become {len(flat.lines)}"
    note = Message(WRITTEN_FLAT, text, Place(program.path), "blocks executed several times are corrected one by one")
    after = dict(report.error_after_um)
    if after.get("where"):
        after["where"] = flat.lines[int(after["where"] or 1) - 1]
    left_out = (replace(each, hint=LEFT_OUT) for each in said if each.code == NEVER)
    warnings = note, *map(with_lines, report.warnings), *left_out
    return replace(report, refused=refused, error_after_um=after, warnings=warnings)
