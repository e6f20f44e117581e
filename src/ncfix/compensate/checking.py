"""Checks of a program without writing it: problems for the control, and for a correction.

A long program is checked while it is read, in bounded memory. The refusals of a correction are found by correcting the
program; nothing is written.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import field

import numpy as np

from ncfix.compensate import FixOptions
from ncfix.compensate.account import said_of
from ncfix.compensate.block_delete import SwitchSetting, messages_of, positions_of
from ncfix.compensate.driver import PartCorrector, fix_flat, fix_program
from ncfix.compensate.following import Resolve, Task, follow, suspected, with_workpiece
from ncfix.compensate.parts import MachineParts, Part, Parts
from ncfix.compensate.plan.findings import Notes
from ncfix.compensate.plan.intent import Intent
from ncfix.compensate.plan.limits import findings
from ncfix.compensate.plan.path import untouched
from ncfix.compensate.plan.written import WrittenPieces
from ncfix.compensate.report import WRITTEN_FLAT, FixReport, Tally
from ncfix.compensate.workers import Read, WorkShare
from ncfix.control.moves import MotionKind, Rule
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.diagnostics import Message
from ncfix.machine import Machine, State
from ncfix.text import stamp
from ncfix.text.tree import Program
from ncfix.values import frozen, mutable

SUSPECTED = "NCF438"
"""Code of the suspicion that a program was corrected before; not reported for a program with a stamp."""
OPTIONS = FixOptions(force=True, figures=False)
"""Options of the trial correction that shows what would be refused."""


@frozen
class Checked:
    """The size of the checked program, and the findings."""

    blocks: int
    moves: int
    findings: tuple[Message, ...]


def check_alone(
    program: Program, setup: Setup, axes: tuple[str, ...], rotary: frozenset[str], resolve: Resolve | None = None
) -> Checked:
    """Check a program without a machine: can it be followed, does it carry a stamp, which motions cannot be corrected.

    A value that the setup does not give is no finding. Raises what `trace` raises.
    """
    return _checked(program, positions_of(setup, lambda own: trace(program, own, axes, rotary, resolve)), Survey())


def check_on(
    program: Program, machine: Machine, setup: Setup, resolve: Resolve | None = None, flatten: bool = False
) -> Checked:
    """Check a program on a machine: also, does it stay within the travel, and what would its correction refuse.

    flatten  the program may be written out flat for the correction

    Raises what `fix_program` and `fix_flat` raise, except NCF430: a stamp is a finding here.
    """
    positions = positions_of(setup, lambda own: follow(program, machine, own, resolve).trace)
    fix = fix_flat if flatten else fix_program
    report = None if machine.is_perfect else fix(program, machine, setup, OPTIONS, resolve).report
    return _checked(program, positions, Survey(with_workpiece(machine, setup)), report)


def survey_alone(parts: Parts, found: Iterable[Part]) -> Checked:
    """Like `check_alone`, for the parts of a program; raises what following raises, and `NotInPartsError`."""
    survey = Survey()
    for part in found:
        survey.look(part)
    return _surveyed(parts, survey)


def survey_on(task: Task, read: Read) -> Checked:
    """Like `check_on`, for the text that `read` returns; raises what correcting raises, and `NotInPartsError`."""
    if task.machine.is_perfect:
        parts = MachineParts.of(task, read)
        survey = Survey(parts.set_up)
        parts.look = survey.look
        for _ in parts:
            pass
        return _surveyed(parts, survey)
    task.check()
    corrector, tally = PartCorrector(task, read), Tally(task.step)
    survey = Survey(corrector.machine)
    corrector.parts.look = survey.look
    for _, done in corrector.work(WorkShare()):
        tally.take(done.tally)
    suspicion = suspected(tally.numbers, tally.step, task.path, task.options.force)
    return _surveyed(corrector.parts, survey, corrector.report(tally, suspicion))


@mutable
class Survey:
    """The findings about a program, or about its parts so far.

    machine  the machine with the workpiece at its place; None: the travel is not checked
    moves    number of motions
    stamp    the message that the program carries a stamp, if it does
    refused  motions that would need a correction but must not be changed, one message per block
    travel   motions that leave the travel as programmed
    """

    machine: Machine | None = None
    moves: int = 0
    stamp: tuple[Message, ...] = ()
    refused: list[Message] = field(default_factory=list)
    travel: Notes = field(default_factory=Notes)

    def look(self, part: Part, position: int = 0) -> None:
        """Check the next part, or the whole program in one position of block delete."""
        program, moves = part.program, part.moves
        self.moves += len(moves)
        found = None if self.stamp else stamp.find(program)
        if found is not None:
            text = "the program has been corrected already"
            self.stamp = (Message("NCF430", text, program.place(found), "correct the original program"),)
        blocks, rows = np.unique(np.where(moves.rule == Rule.REFUSE, moves.block, -1), return_index=True)
        for block, row in zip(blocks.tolist(), rows.tolist(), strict=True):
            if block >= 0:
                self.refused.append(Message("NCF432", moves.reasons[moves.reason[row]], program.place(block)))
        if self.machine is not None:
            lost_centre = (moves.kind == MotionKind.ARC) & ~np.isfinite(moves.centre).all(axis=1)
            unchanged = (moves.rule == Rule.PASS) | ~np.isfinite(moves.end).all(axis=1) | lost_centre
            pieces = untouched(moves, unchanged).pieces
            for finding in findings(WrittenPieces(Intent(self.machine, moves, State()), pieces, moves.start)):
                self.travel.add(finding, program, moves, position=position)

    def checked(self, blocks: int, remarks: Iterable[Message]) -> Checked:
        """All findings, `remarks` included, without duplicates, and without a suspicion if the program has a stamp."""
        remarks = [message for message in remarks if not (self.stamp and message.code == SUSPECTED)]
        told = {(message.code, message.place and message.place.line) for message in remarks}
        travel = (each for each in self.travel.messages() if (each.code, each.place and each.place.line) not in told)
        return Checked(blocks, self.moves, (*self.stamp, *remarks, *travel))


def _checked(
    program: Program, positions: Sequence[SwitchSetting], survey: Survey, report: FixReport | None = None
) -> Checked:
    """The findings about a program in all positions of block delete; a value assumed as zero is no finding."""
    for k, position in enumerate(positions):
        survey.look(Part(program, position.trace.moves, True), k)
    survey.moves = max(len(each.trace.moves) for each in positions)
    if report is not None:
        return survey.checked(len(program), _remarks_of(report))
    assumed = {message for each in positions for message in each.trace.messages[: len(each.trace.assumed)]}
    said = (message for message in messages_of(positions) if message not in assumed)
    return survey.checked(len(program), dict.fromkeys((*said, *survey.refused)))


def _surveyed(parts: Parts, survey: Survey, report: FixReport | None = None) -> Checked:
    """The findings about the parts of a program, with the remarks of a correction or, without one, of following."""
    parts.check_behind()
    follower = parts.follower
    said = (*follower.messages[len(follower.assumed) :], *survey.refused)
    return survey.checked(parts.blocks, said if report is None else _remarks_of(report))


def _remarks_of(report: FixReport) -> tuple[Message, ...]:
    """The warnings and refusals of a correction. Left out are axes that were left where they stand in motions that do
    not cut, and the note that the program is written out flat, which was requested.
    """
    harmless = said_of((left for left in report.left if not left.cuts), report.path)
    said = (each for each in report.warnings if each.code != WRITTEN_FLAT and each not in harmless)
    return (*said, *report.refusals)
