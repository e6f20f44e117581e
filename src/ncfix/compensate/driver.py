"""A program in, a corrected program out, and the proof of what that does to the path.

    Program --trace--> Moves --plan--> Pieces --emit--> edits --apply--> text --read, trace--> Moves again

The text that comes out is read and followed again before anybody gets it: the control must understand exactly what the
plan meant. If it would not, that is a fault of ncfix, and nothing is written.

A long program is corrected while it is read: part after part, in memory that does not depend on its length. Every part
goes through the same plan, emitter, checks and proof as a whole program does, and what comes out is the same, byte for
byte. A part begins with the last motion of the one before it, which is written already: all that one part has to know
of the earlier ones is what that motion left (`Before`). What cannot be done that way raises `NotInPartsError`, and the
caller takes the program as a whole. Several processes can work on a program (see `workers`): each corrects parts in
turn, and follows what it has to of others.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ncfix.compensate import FixOptions
from ncfix.compensate.account import (
    NOTHING_SEEN,
    Account,
    FixReport,
    either,
    left_where_they_stand,
    with_what_is_left,
    without_figure,
)
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
from ncfix.compensate.following import (
    Resolve,
    kinematics_of,
    numbers_at_the_beginning,
    placed,
    refuse_stamped,
    rotary_names,
    stamp_of,
    suspected,
    traced,
    with_tool_lengths,
)
from ncfix.compensate.plan.arrays import Mask
from ncfix.compensate.plan.deviation import Figures, PathError, path_error
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.plan.written import rounding_along
from ncfix.compensate.report import largest_correction, refusals
from ncfix.compensate.solve import Settled, differences, increments
from ncfix.control.flatten import Flat, flatten
from ncfix.control.moves import Moves, Trace
from ncfix.control.setup import Setup
from ncfix.diagnostics import Message, NcfixError, Place
from ncfix.machine import Machine, State
from ncfix.text import stamp
from ncfix.text.language import language_of
from ncfix.text.reader import read
from ncfix.text.tree import Program
from ncfix.text.writer import Splices, spliced
from ncfix.writer.second_reading import SecondReading

ATTEMPTS = 16
"""The second attempt knows the frames that moved with the first, each further one a frame that depends on others."""

Attempt = Callable[[Readings], tuple[Together, bytes]]
Follow = Callable[[Program], Trace]


class SelfCheckError(Exception):
    """The text that was written does not mean what was planned: a fault of ncfix. Nothing may be written."""


@dataclass(frozen=True, slots=True)
class Proven:
    """A text that a second reading has confirmed in each position of block delete, and what was settled for each."""

    text: bytes
    together: Together


def proven(program: Program, attempt: Attempt, follows: Sequence[Follow]) -> Proven:
    """Write, read what was written, and write again with what the reading taught, until both agree.

    attempt  settles and writes, given what a control made of the last attempt in each position of block delete
    follows  traces a program, in each of them

    Raises `SelfCheckError` if they never agree.
    """
    readings: Readings = [None] * len(follows)
    for _ in range(ATTEMPTS):
        together, text = attempt(readings)
        if text == program.source:
            return Proven(text, together)
        pairs = [
            (own, _read_and_followed(program, text, own, follow))
            for own, follow in zip(together.settled, follows, strict=True)
        ]
        wrong = [_wrong(*each) for each in pairs]
        if not any(each.any() for each in wrong):
            return Proven(text, together)
        readings = [SecondReading.of(again, own.plan.pieces) for own, again in pairs]
    at = next(k for k, each in enumerate(wrong) if each.any())
    raise SelfCheckError(_what_is_wrong(program, *pairs[at], int(np.argmax(wrong[at]))))


def _wrong(settled: Settled, again: Moves) -> Mask:
    wrong = differences(settled, again)
    assert wrong is not None, "the numbers of motions have been compared"
    return wrong


def _what_is_wrong(program: Program, settled: Settled, again: Moves, piece: int) -> str:
    """Where a piece would lead, and was not meant to."""
    move = int(settled.plan.pieces.move[piece])
    line = program.line(int(settled.moves.block[move]))
    meant = settled.moves.end[move] if settled.plan.pieces.kept[piece] else settled.emission.end[piece]
    return f"line {line} would lead to {again.end[piece]}, not to {meant}"


def _read_and_followed(program: Program, text: bytes, settled: Settled, follow: Follow) -> Moves:
    try:
        again = follow(read(text, program.path, program.dialect)).moves
    except NcfixError as error:
        raise SelfCheckError(f"the corrected program cannot be read: {error}") from error
    pieces = settled.plan.pieces
    if len(again) != len(pieces):
        raise SelfCheckError(f"the corrected program has {len(again)} motions, {len(pieces)} were written")
    return again


ASTRAY = 1.0
"""mm; no correction and no remainder of one is so large."""


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


def _written(program: Program, splices: Splices, words: str) -> bytes:
    """The corrected text, with a stamp of these words."""
    if not len(splices):
        return program.source
    return spliced(program.source, Splices.joined([splices, Splices.of([stamp.insertion(program, words)])]))


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
    lacking = [each.lacking(steps) for each in every]
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


FLATTENED = "NCF445"
ONE_POSITION = "NCF447"


def fix_flat(
    program: Program, machine: Machine, setup: Setup, options: FixOptions, resolve: Resolve | None = None
) -> Fixed:
    """As `fix_program`; where that refuses motions, the program is written out flat and corrected so.

    The flat program is kept only if it helps. The report speaks of the lines of the original. A flat program has the
    numbers of one position of block delete, so a program that is to be right in several stays as it is.
    Raises what `fix_program` and `flatten` raise.
    """
    fixed = fix_program(program, machine, setup, options, resolve)
    if not fixed.report.refused:
        return fixed
    if len(fixed.report.block_delete) > 1:
        text = "not written out flat: its numbers would be those of one position of block delete"
        note = Message(ONE_POSITION, text, Place(program.path), "--block-skip on or off says which one")
        return replace(fixed, report=replace(fixed.report, warnings=(note, *fixed.report.warnings)))
    steps = steps_of(machine)
    flat = flatten(program, setup, machine.axis_names, rotary_names(machine), steps, resolve, kinematics_of(machine))
    again = fix_program(flat.program, machine, setup, options, resolve)
    if {each.line for each in fixed.report.refused} <= {flat.lines[each.line - 1] for each in again.report.refused}:
        return fixed
    return replace(again, changed=True, report=in_lines(again, flat, program))


def in_lines(fixed: Fixed, flat: Flat, program: Program) -> FixReport:
    """The report of a flat program with the lines of the original."""
    refused = tuple(replace(each, line=flat.lines[each.line - 1]) for each in fixed.report.refused)
    text = f"the program is written out flat: {len(program)} lines become {len(flat.lines)}"
    note = Message(FLATTENED, text, Place(program.path), "blocks executed several times are corrected one by one")
    after = dict(fixed.report.error_after_um)
    if after.get("where"):
        after["where"] = flat.lines[int(after["where"] or 1) - 1]
    warnings = (note, *(placed_in_original(each, flat) for each in fixed.report.warnings))
    return replace(fixed.report, refused=refused, error_after_um=after, warnings=warnings)


def placed_in_original(message: Message, flat: Flat) -> Message:
    """A message with the line of the original."""
    place = message.place
    if place is None or not 1 <= place.line <= len(flat.lines):
        return message
    return replace(message, place=replace(place, line=flat.lines[place.line - 1]))


def steps_of(machine: Machine) -> dict[str, float]:
    """The least increment of each axis, mm or degree."""
    linear, rotary = machine.least_increment
    return {
        name: float(np.degrees(rotary)) if turning else linear
        for name, turning in zip(machine.axis_names, machine.rotary.tolist(), strict=True)
    }
