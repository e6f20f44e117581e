"""A program in, a corrected program out, and the proof of what that does to the path.

    Program --trace--> Moves --plan--> Pieces --emit--> edits --apply--> text --read, trace--> Moves again

The text that comes out is read and followed again before anybody gets it: the control must understand exactly what the
plan meant. If it would not, that is a fault of ncfix, and nothing is written.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ncfix import __version__
from ncfix.compensate.account import NOTHING_SEEN, Account, FixReport, Refusal, with_what_is_left
from ncfix.compensate.block_delete import (
    Position,
    Readings,
    Together,
    assumed_of,
    messages_of,
    most_moves,
    not_in_all,
    positions_of,
    settle_together,
    stamped,
    worst_findings,
)
from ncfix.compensate.coverage import without_figure
from ncfix.compensate.double import numbers_at_the_beginning, suspected
from ncfix.compensate.following import Resolve, placed, traced, with_tool_lengths
from ncfix.compensate.left import either, left_by_motion, left_where_they_stand
from ncfix.compensate.options import FixOptions
from ncfix.compensate.plan.arrays import Mask, lengths
from ncfix.compensate.plan.deviation import Figures, PathError, path_error
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.plan.written import rounding_along
from ncfix.compensate.proof import SelfCheckError, proven
from ncfix.compensate.settle import Settled, increments
from ncfix.control.knowledge import PROBED
from ncfix.control.moves import Moves, Trace
from ncfix.control.setup import Setup
from ncfix.diagnostics import Place, RefusedError
from ncfix.machine import Machine, State
from ncfix.text import stamp
from ncfix.text.language import language_of
from ncfix.text.tree import Program
from ncfix.text.writer import Splices, spliced

ASTRAY = 1.0
"""mm; no correction and no remainder of one is so large."""

__all__ = ["FixOptions", "Fixed", "fix_program"]


@dataclass(frozen=True, slots=True)
class Fixed:
    """The corrected program, whether it differs from the original, and what there is to report."""

    text: bytes
    changed: bool
    report: FixReport


def fix_program(
    program: Program,
    machine: Machine,
    setup: Setup,
    options: FixOptions = FixOptions(),  # noqa: B008
    resolve: Resolve | None = None,
) -> Fixed:
    """Correct a program for a machine. A program that needs no change comes back as it is, without a stamp.

    resolve  gives the text of a subprogram file by its name

    Raises SourceError for what cannot be followed or is not known, RefusedError NCF430 for a program that carries a
    stamp, NCF438 for one that seems to have been corrected without one. Motions that had to be left uncorrected are in
    `report.refused`; whether that is acceptable is for the caller to decide.
    """
    refuse_stamped(program, options)
    if machine.is_perfect:
        return _untouched(program)
    program = replace(program, dialect=replace(program.dialect, block_numbers=options.block_numbers))
    on_machine = placed(machine, setup)

    def follow(source: Program, own: Setup) -> Trace:
        return traced(source, machine, own, resolve)

    positions = positions_of(setup, lambda own: with_tool_lengths(program, follow(program, own), machine, own))
    moves, words = [each.trace.moves for each in positions], (stamped(positions), assumed_of(positions))

    def attempt(readings: Readings) -> tuple[Together, bytes]:
        together = settle_together(program, moves, on_machine, options, readings)
        return together, _written(program, together.splices, stamp_of(program, machine, options, *words))

    try:
        proof = proven(program, attempt, [partial(follow, own=each.setup) for each in positions])
    except SelfCheckError as why:
        if len(positions) == 1:
            raise
        raise not_in_all(why, program) from why
    step, every = machine.least_increment[0], proof.together.settled
    numbers = numbers_at_the_beginning(program, every[0], step)
    suspicion = suspected(numbers, step, program.path, options.force)
    errors = [_errors(on_machine, each, options.split_rapids) for each in every] if options.verify else []
    for settled, error in zip(every, errors, strict=options.verify):
        _check_sane(program, settled, error)
    report = _report(program, on_machine, positions, proof.together, errors, options)
    report = replace(report, warnings=(*suspicion, *report.warnings))
    changed = proof.text != program.source
    return Fixed(_numbered(program, proof.text) if changed else proof.text, changed, report)


def _numbered(program: Program, text: bytes) -> bytes:
    """The text with its blocks numbered anew, if that is asked for and the language has block numbers."""
    renumber = language_of(program.dialect).renumber
    return text if renumber is None or program.dialect.block_numbers != "renumber" else renumber(text)


def refuse_stamped(program: Program, options: FixOptions) -> None:
    """Raise RefusedError NCF430 for a program that carries a stamp, unless that is what the options want."""
    block = stamp.find(program)
    if block is not None and not options.force:
        text = "the program has been corrected already; correcting it again would put the error back in"
        raise RefusedError.of("NCF430", text, program.place(block), "fix the original program, or say --force")


def _written(program: Program, splices: Splices, words: str) -> bytes:
    """The corrected text, with a stamp of these words."""
    if not len(splices):
        return program.source
    return spliced(program.source, Splices.joined([splices, Splices.of([stamp.insertion(program, words)])]))


SHORT_LINE = 250
"""Characters that a line may have on any control."""


def stamp_of(
    program: Program, machine: Machine, options: FixOptions, block_delete: str = "", assumed: tuple[str, ...] = ()
) -> str:
    """The text of the stamp that a corrected program gets.

    block_delete  for which positions of its switches, in words; empty without
    assumed       names what was taken as zero
    """
    words = (
        f"ncfix {__version__} machine {machine.hash} strategy {options.strategy} tolerance {options.tolerance_um:g} um"
    )
    if block_delete:
        words += f", {block_delete}"
    if PROBED in assumed:
        words += ", nominal probing"
    if zeros := [each for each in assumed if each != PROBED]:
        words += f", assumed zero: {', '.join(zeros)}"
    return words[: min(program.dialect.line_limit or SHORT_LINE, SHORT_LINE) - 10]


def _errors(machine: Machine, settled: Settled, split_rapids: bool) -> PathError:
    """Tip errors before and after, with the numbers as the control will understand them."""
    emission = settled.emission
    pieces = replace(settled.plan.pieces, end=emission.end, centre=emission.centre)
    rows, known = settled.shown(split_rapids), settled.plan.known
    return path_error(machine, settled.moves, pieces, emission.start, rows=rows, tilts=False, known=known)


def strays(errors: PathError) -> bool:
    """Whether the corrected path is no longer that of the program at all."""
    return errors.after.max > max(ASTRAY, 10 * errors.before.max)


def _check_sane(program: Program, settled: Settled, errors: PathError) -> None:
    """Raise `SelfCheckError` for a path that strays."""
    if strays(errors):
        line = _line_of(program, settled.moves, errors.after)
        raise SelfCheckError(f"line {line} would lead {errors.after.max:.3f} mm away from where it should")


def _figures(figures: Sequence[Figures], seen: bool) -> dict[str, float | int | None]:
    """The worst of all positions of block delete; `seen`: something was looked at."""
    if not figures or not seen:
        return dict(NOTHING_SEEN) if figures else {}
    most, rms = max(each.max for each in figures), max(each.rms for each in figures)
    return {"max": round(most * 1e3, 4), "rms": round(rms * 1e3, 4)}


def place_of(program: Program, moves: Moves, row: int) -> Place:
    """Where the block of a motion stands."""
    return program.place(int(moves.block[row]))


def _line_of(program: Program, moves: Moves, figures: Figures) -> int | None:
    return program.line(int(moves.block[figures.move])) if figures.move >= 0 else None


def _untouched(program: Program) -> Fixed:
    report = FixReport(program.path, len(program), 0, 0, 0, False)
    return Fixed(program.source, False, report)


def _report(
    program: Program,
    machine: Machine,
    positions: Sequence[Position],
    together: Together,
    errors: Sequence[PathError],
    options: FixOptions,
) -> FixReport:
    every, steps = together.settled, increments(machine)
    lacking = [left_by_motion(each, steps) for each in every]
    left = either([left_where_they_stand(program, each.moves, own) for each, own in zip(every, lacking, strict=True)])
    account = Account.together([Account.of(each.moves, each.kept, each.reasons) for each in every])
    no_figure = Counter[str]()
    for settled, own in zip(every, lacking, strict=True):
        no_figure |= without_figure(settled.moves, settled.kept, own.axes if own else None)
    refused = refusals(program, account)
    findings = dict.fromkeys(
        message
        for settled, found in zip(every, worst_findings(every), strict=True)
        for finding in found
        for message in finding.messages(partial(place_of, program, settled.moves))
    )
    worst = max(range(len(errors)), key=lambda k: errors[k].after.max) if errors else 0
    seen = any(each.samples for each in errors)
    where = {"where": _line_of(program, every[worst].moves, errors[worst].after)} if errors else {}
    report = FixReport(
        path=program.path,
        blocks=len(program),
        moves=most_moves(positions),
        compensated=len(account.compensated),
        passed=len(account.passed),
        changed=bool(len(together.splices)),
        inserted_blocks=together.added_blocks,
        max_correction_um=max(largest_correction(each.moves, each) for each in every) * 1e3
        if account.compensated
        else None,
        error_before_um=_figures([each.before for each in errors], seen),
        error_after_um={**_figures([each.after for each in errors], seen), **where},
        refused=tuple(refused),
        warnings=(*messages_of(positions), *(each.message(program.path) for each in left), *findings),
        strategy=options.strategy,
        leaves=get_strategy(options.strategy).leaves,
        left=left,
        rounding_um=max(_rounding(machine, each) for each in every) * 1e3,
        block_delete=tuple(sorted(each.on) for each in positions if each.on is not None),
        passed_by_rule=Counter(account.rules.values()),
        no_figure=no_figure,
    )
    return with_what_is_left(report, options.tolerance_um)


def _rounding(machine: Machine, settled: Settled) -> float:
    """What rounded numbers may do along the path, mm."""
    return rounding_along(Intent(machine, settled.moves, State()), settled.plan.pieces, settled.plan.corners)


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
