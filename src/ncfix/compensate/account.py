"""The account of a correction: every motion block ends in exactly one of compensated, passed, refused.

Two more things are counted.

- Feeds, arcs and holes that the figures of the report leave out, by reason: passed by rule, refused, or with a start or
  end that is not known. So no figure seems to cover a motion that was not examined.
- Corrections that were not made because an axis must get no word, by axis, with their lines (NCF439).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Index, Mask, in_stretches
from ncfix.control.moves import PASS_RULES, MotionKind, Moves, Pass, Rule
from ncfix.diagnostics import Message, Place, lines_named
from ncfix.text.tree import Program
from ncfix.values import frozen

REFUSED = "refused"
LEFT = "an axis gets no word"
UNKNOWN = "its start or end is not known"
MEASURED = "its end is a position that the machine has measured"
BY_RULE = "passed by rule"
"""Reason of motions that pass by a rule without a name."""


class NoFigureReason(NamedTuple):
    """Why motions have no figure; `cuts`: they may cut, so that their error matters."""

    reason: str
    cuts: bool


def rule_of(moves: Moves, row: int) -> NoFigureReason:
    """The rule by which motion `row` passes."""
    rule = Pass(int(moves.passing[row]))
    return (
        NoFigureReason(BY_RULE, True)
        if rule is Pass.NONE
        else NoFigureReason(PASS_RULES[rule].name, PASS_RULES[rule].cuts)
    )


def at_feed(moves: Moves) -> Mask:
    """(n,) whether a motion is a feed, an arc or a hole; motions that pass are included."""
    return (moves.kind != MotionKind.RAPID) & (moves.kind != MotionKind.DWELL)


def at_measured_places(moves: Moves) -> Mask:
    """(n,) motions with a word that is computed from the machine's own measurement, and so contains its errors."""
    return np.any(moves.measured, axis=1)


def without_figure(moves: Moves, unchanged: Mask, left: Mask | None, own: Mask | None = None) -> Counter[str]:
    """Number of feeds, arcs and holes that the figures before and after a correction leave out, by reason.

    unchanged  (n,) motions left as they were
    left       (n, n_axes) axes that were left where they stand: the figures say nothing along them; None: none
    own        (n,) the motions to count; None: all
    """
    fed = at_feed(moves) if own is None else at_feed(moves) & own
    beside = np.zeros(len(moves), dtype=bool) if left is None else left[:, ~moves.rotary].any(axis=1)
    passed, measured = moves.rule == Rule.PASS, at_measured_places(moves)
    counts = Counter(rule_of(moves, row).reason for row in np.flatnonzero(fed & passed).tolist())
    counts[REFUSED] += int(np.count_nonzero(fed & unchanged & ~passed))
    counts[MEASURED] += int(np.count_nonzero(fed & ~unchanged & ~passed & measured))
    counts[LEFT] += int(np.count_nonzero(fed & ~unchanged & ~passed & ~measured & beside))
    return +counts


def not_looked_at(moves: Moves) -> dict[NoFigureReason, Index]:
    """The feeds, arcs and holes that are left out when a path is examined: reason -> rows of the motions."""
    ends, starts = (np.isfinite(places).all(axis=1) for places in (moves.end, moves.start))
    lost = np.where(moves.kind == MotionKind.CYCLE, ~ends, ~(ends & starts))
    rows_of: dict[NoFigureReason, list[int]] = {}
    measured = at_measured_places(moves)
    for row in np.flatnonzero(at_feed(moves) & (lost | measured | (moves.rule == Rule.PASS))).tolist():
        if moves.rule[row] == Rule.PASS:
            why = rule_of(moves, row)
        else:
            why = NoFigureReason(UNKNOWN, True) if lost[row] else NoFigureReason(MEASURED, False)
        rows_of.setdefault(why, []).append(row)
    return {why: np.array(rows, dtype=np.intp) for why, rows in rows_of.items()}


MAX_STRETCHES = 4
"""Largest number of stretches of lines that a message names one by one."""
HINT = (
    "program it in one of the first blocks, and again after a change of tool or offsets, or after machine coordinates"
)


@frozen
class LeftAxis:
    """One axis that got no word although a correction needed one, so that it was left where it stands.

    motions    number of motions in which it should have moved
    cuts       number of these that cut
    stretches  their lines, as (first, last) of each stretch
    most       largest distance from where it should be, at the ends of these motions and along cuts, mm or rad
    """

    axis: str
    rotary: bool
    motions: int
    cuts: int
    stretches: tuple[tuple[int, int], ...]
    most: float

    @property
    def first(self) -> int:
        """The first line in which the axis was left."""
        return self.stretches[0][0]

    @property
    def last(self) -> int:
        """The last line in which the axis was left."""
        return self.stretches[-1][1]

    def with_later(self, other: LeftAxis) -> LeftAxis:
        """This entry and that of a later part of the program, as one."""
        motions, cuts = self.motions + other.motions, self.cuts + other.cuts
        stretches, most = merged(self.stretches, other.stretches), max(self.most, other.most)
        return LeftAxis(self.axis, self.rotary, motions, cuts, stretches, most)

    def message(self, path: str, *others: LeftAxis) -> Message:
        """Warning NCF439 for this axis and `others` that were left in the same motions."""
        if self.motions == 1:
            many = f"this motion, which {'cuts' if self.cuts else 'cuts nothing'}"
        else:
            cutting = {0: "none", self.motions: "all"}.get(self.cuts, self.cuts)
            many = f"{self.motions} motions ({lines_named(self.stretches, MAX_STRETCHES)}), {cutting} of which cut"
        most = max(each.most for each in (self, *others))
        far = f"{np.degrees(most):.4g} degrees" if self.rotary else f"{most * 1e3:.2f} um"
        get, are = ("get", "are") if others else ("gets", "is")
        axes = ", ".join(each.axis for each in (self, *others[:-1]))
        axes += f" and {others[-1].axis}" if others else ""
        text = (
            f"{axes} {get} no word in {many}, and {are} up to {far} from the corrected position: the program has not "
            "yet given the position, or the control offsets or rounds the contour there"
        )
        return Message("NCF439", text, Place(path, self.first), HINT if self.cuts else "")

    def as_dict(self) -> dict[str, object]:
        """Plain data, for `--json`."""
        most = {"max_deg": float(np.degrees(self.most))} if self.rotary else {"max_um": round(self.most * 1e3, 4)}
        lines = [list(stretch) for stretch in self.stretches]
        return {"axis": self.axis, "motions": self.motions, "cuts": self.cuts, "lines": lines, **most}


@frozen
class Lacking:
    """Axes left where they stand.

    axes  (n, n_axes) whether an axis was left in a motion
    off   (n, n_axes) distance of each axis from where it should be, mm or rad
    """

    axes: Mask
    off: Array


def left_where_they_stand(program: Program, moves: Moves, left: Lacking | None) -> dict[str, LeftAxis]:
    """The axes that were left where they stand, by name."""
    if left is None:
        return {}
    by_name, lacking, off = {}, left.axes, left.off
    for column in np.flatnonzero(lacking.any(axis=0)).tolist():
        rows = np.flatnonzero(lacking[:, column])
        axis, turns, most = moves.axes[column], bool(moves.rotary[column]), float(off[rows, column].max())
        cuts, stretches = int(moves.cutting[rows].sum()), stretches_of(program, moves.block[rows])
        by_name[axis] = LeftAxis(axis, turns, len(rows), cuts, stretches, most)
    return in_order(by_name)


def stretches_of(program: Program, blocks: NDArray[np.int32]) -> tuple[tuple[int, int], ...]:
    """The lines of blocks as (first, last) of each stretch without gaps."""
    lines = np.sort(program.lines(blocks))
    return in_stretches(lines[np.diff(lines, prepend=-1) != 0])


def merged(before: tuple[tuple[int, int], ...], later: tuple[tuple[int, int], ...]) -> tuple[tuple[int, int], ...]:
    """Two lists of stretches of lines as one; `later` begins at or behind the last line of `before`."""
    if later[0][0] > before[-1][1] + 1:
        return (*before, *later)
    return (*before[:-1], (before[-1][0], later[0][1]), *later[1:])


def in_sequence(before: Mapping[str, LeftAxis], later: Mapping[str, LeftAxis]) -> dict[str, LeftAxis]:
    """The axes that were left in two consecutive parts of a program."""
    both = {axis: before[axis].with_later(later[axis]) for axis in before.keys() & later.keys()}
    return in_order({**before, **later, **both})


def either(found: Sequence[Mapping[str, LeftAxis]]) -> dict[str, LeftAxis]:
    """The axes that are left in any position of block delete: the largest figures of each axis, and all its lines."""
    together = dict(found[0])
    for other in found[1:]:
        for axis, left in other.items():
            own = together.setdefault(axis, left)
            lines = sorted({line for each in (own, left) for a, b in each.stretches for line in range(a, b + 1)})
            together[axis] = replace(
                own,
                motions=max(own.motions, left.motions),
                cuts=max(own.cuts, left.cuts),
                stretches=in_stretches(np.array(lines)),
                most=max(own.most, left.most),
            )
    return in_order(together)


def said_of(left: Iterable[LeftAxis], path: str) -> list[Message]:
    """The messages about axes that were left: one for all axes that were left in the same motions."""
    alike: dict[object, list[LeftAxis]] = {}
    for each in left:
        alike.setdefault((each.rotary, each.motions, each.cuts, each.stretches), []).append(each)
    return [first.message(path, *others) for first, *others in alike.values()]


def in_order(found: Mapping[str, LeftAxis]) -> dict[str, LeftAxis]:
    """The axes, ordered by the first line in which each is left."""
    return dict(sorted(found.items(), key=lambda item: (item[1].first, item[0])))


@frozen
class Reason:
    """Why a block is refused: a code that `ncfix explain` knows, a sentence, and the block that causes it (or -1)."""

    code: str
    text: str
    cause: int = -1


@frozen
class Account:
    """The motion blocks of a program; each is in exactly one of `compensated`, `passed` and `refused`.

    passed   block -> why it was passed, in the words of its program
    refused  block -> why it was refused
    rules    passed block -> name of the rule (`Pass`) by which it was passed
    """

    compensated: frozenset[int]
    passed: Mapping[int, str]
    refused: Mapping[int, Reason]
    rules: Mapping[int, str] = field(default_factory=dict)

    @classmethod
    def of(cls, moves: Moves, unchanged: Mask, reasons: Mapping[int, Reason]) -> Account:
        """The account of these motions. A block is refused if any of its motions is, else passed if any is."""
        motion = moves.kind != MotionKind.DWELL
        by_rule = np.flatnonzero(motion & (moves.rule == Rule.PASS))
        refused = {block: reasons[block] for block in moves.block[motion & unchanged].tolist() if block in reasons}
        passed = {int(moves.block[row]): moves.reasons[moves.reason[row]] for row in by_rule}
        passed = {block: reason for block, reason in passed.items() if block not in refused}
        rules = {int(moves.block[row]): rule_of(moves, row).reason for row in by_rule.tolist()}
        compensated = frozenset(moves.block[motion & ~unchanged].tolist())
        others = refused.keys() | passed.keys()
        return cls(
            compensated - others if others else compensated, passed, refused, {each: rules[each] for each in passed}
        )

    @classmethod
    def together(cls, accounts: Sequence[Account]) -> Account:
        """One account for all positions of block delete: a block is refused if it is in any, else passed if in any."""
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
        """Number of motion blocks."""
        return len(self.compensated) + len(self.passed) + len(self.refused)

    def reasons(self) -> Counter[str]:
        """Number of refused blocks for each reason."""
        return Counter(reason.text for reason in self.refused.values())
