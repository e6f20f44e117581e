"""Verification of a corrected program: both programs on a machine against the intent of the original, and a verdict."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from ncfix.arguments import TOLERANCE_UM
from ncfix.compensate.block_delete import SwitchSetting, in_pairs, messages_of, positions_of
from ncfix.compensate.figures.comparison import RunningComparison, whole
from ncfix.compensate.figures.simulation import lines_of
from ncfix.compensate.following import Resolve, follow, resolving, with_workpiece
from ncfix.compensate.plan.written import rounding
from ncfix.control.setup import Setup
from ncfix.diagnostics import Message
from ncfix.machine import Machine
from ncfix.text.tree import Program
from ncfix.values import frozen


@frozen
class Compared:
    """The comparison of two programs on one machine.

    before       figures of the original: from its actual path to its intended path
    after        figures of the other program: from its actual path to the original's intended path
    left_out     figures from the original's intended path to the actual path of the other program
    beyond       lines of the other program with errors larger than tolerance and rounding
    not_reached  lines of the original from which the other program is farther away than that
    unseen       lines of the original that may cut and were not examined
    no_figure    number of feeds, arcs and holes that were not examined, by reason
    blind        whether some of these may cut
    left         letter of a linear axis -> lines of the original that cut while only the machine knows where that axis
                 stands, so that nothing can be corrected along it
    rounding_um  largest deviation that the control's digits may add to the path
    messages     messages from following both programs
    """

    before: dict[str, Any]
    after: dict[str, Any]
    left_out: dict[str, Any]
    beyond: list[int]
    not_reached: list[int]
    unseen: list[int]
    left: dict[str, list[int]]
    rounding_um: float
    no_figure: dict[str, int]
    blind: bool
    messages: tuple[Message, ...] = ()

    @property
    def beyond_somewhere(self) -> bool:
        """Whether a place is farther from the intended path than tolerance and rounding allow, in either direction."""
        return bool(self.beyond or self.not_reached)

    @property
    def within(self) -> bool:
        """Whether every place is within tolerance and rounding, and no motion that may cut was left out."""
        return not self.beyond_somewhere and not self.blind

    @classmethod
    def of_all(cls, comparisons: Sequence[RunningComparison], said: Sequence[Sequence[Message]]) -> Compared:
        """The worst of all positions of block delete, with the messages from following both programs, once each."""
        of_first, of_second = said
        told = {(each.code, each.text) for each in of_first}
        messages = *of_first, *(each for each in of_second if (each.code, each.text) not in told)
        return replace(cls.together([cls.of(each) for each in comparisons]), messages=messages)

    @classmethod
    def of(cls, comparison: RunningComparison) -> Compared:
        """The result of one comparison."""
        before, there, back = (match.along for match in comparison.matches)
        return cls(
            before=before.figures(),
            after=there.figures(),
            left_out=back.figures(),
            beyond=there.lines_beyond,
            not_reached=back.lines_beyond,
            unseen=lines_of([lines for why, parts in comparison.unseen.items() if why.cuts for lines in parts]),
            left={axis: lines_of(lines) for axis, lines in comparison.left.items()},
            rounding_um=comparison.rounding * 1e3,
            no_figure={why.reason: count for why, count in sorted(comparison.no_figure.items())},
            blind=any(why.cuts for why in comparison.no_figure),
        )

    @classmethod
    def together(cls, several: Sequence[Compared]) -> Compared:
        """The worst of several comparisons, one for each position of block delete."""
        axes = dict.fromkeys(axis for each in several for axis in each.left)
        reasons = sorted({reason for each in several for reason in each.no_figure})
        return cls(
            before=_worst([each.before for each in several]),
            after=_worst([each.after for each in several]),
            left_out=_worst([each.left_out for each in several]),
            beyond=_lines(each.beyond for each in several),
            not_reached=_lines(each.not_reached for each in several),
            unseen=_lines(each.unseen for each in several),
            left={axis: _lines(each.left.get(axis, []) for each in several) for axis in axes},
            rounding_um=max(each.rounding_um for each in several),
            no_figure={reason: max(each.no_figure.get(reason, 0) for each in several) for reason in reasons},
            blind=any(each.blind for each in several),
        )


def _worst(several: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The figures with the largest error, and the largest rms of all; figures without samples do not count."""
    seen = [each for each in several if each["max"] is not None]
    if not seen:
        return several[0]
    return {**max(seen, key=lambda each: float(each["max"])), "rms": max(each["rms"] for each in seen)}


def _lines(several: Iterable[Sequence[int]]) -> list[int]:
    return sorted({line for each in several for line in each})


def side_by_side(
    original: Program,
    other: Program,
    machine: Machine,
    setup: Setup,
    tolerance_um: float,
    resolves: tuple[Resolve | None, Resolve | None] = (None, None),
) -> tuple[list[RunningComparison], tuple[Sequence[Message], Sequence[Message]]]:
    """Two programs compared in each position of block delete, and the messages from following each program.

    resolves  for each program, returns the text of a subprogram by its name

    Raises what `follow` raises, and `UsageError` NCF025 for an invalid tolerance.
    """
    TOLERANCE_UM.check("tolerance_um", tolerance_um)
    machine = resolving(machine, original.dialect, original.source)

    def positions(program: Program, resolve: Resolve | None) -> tuple[SwitchSetting, ...]:
        return positions_of(setup, lambda own: follow(program, machine, own, resolve).trace)

    known = with_workpiece(machine, setup)
    of_first, of_second = positions(original, resolves[0]), positions(other, resolves[1])
    found: list[RunningComparison] = []
    for first, second in in_pairs(of_first, of_second):
        found.append(RunningComparison(tolerance_um / 1e3, rounding(machine)))
        cuts = whole(known, original, first.trace.moves, meant=True)
        found[-1].run(cuts, whole(known, other, second.trace.moves))
    return found, (messages_of(of_first), messages_of(of_second))
