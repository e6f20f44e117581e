"""Looking at a program without writing it: what the control or a correction would stumble over.

A long program is looked at while it is read, in bounded memory. What a correction would refuse comes from correcting
it; nothing is written.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ncfix.compensate import FixOptions
from ncfix.compensate.account import FixReport
from ncfix.compensate.block_delete import Position, messages_of, most_moves, positions_of
from ncfix.compensate.driver import PartCorrector, fix_program
from ncfix.compensate.following import Resolve, Task, follow, placed, suspected
from ncfix.compensate.parts import Part, Parts, Units
from ncfix.compensate.plan.findings import Finding, Notes
from ncfix.compensate.plan.limits import findings
from ncfix.compensate.plan.path import untouched
from ncfix.compensate.report import Tally
from ncfix.compensate.workers import Read, Share
from ncfix.control.moves import Kind, Moves, Rule
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.diagnostics import Message, Place
from ncfix.machine import Machine
from ncfix.text import stamp
from ncfix.text.tree import Program

SUSPECTED = "NCF438"
"""A program that seems to have been corrected: what nobody needs to guess of one that says so."""
OPTIONS = FixOptions(force=True, verify=False)
"""What is asked for of the correction that tells what it would refuse."""


@dataclass(frozen=True, slots=True)
class Checked:
    """What was looked at, and what was found."""

    blocks: int
    moves: int
    findings: tuple[Message, ...]


def check_alone(
    program: Program, setup: Setup, axes: tuple[str, ...], rotary: frozenset[str], resolve: Resolve | None = None
) -> Checked:
    """Check a program without a machine: can it be followed, was it corrected before, what could not be corrected.

    What the setup does not give is no finding. Raises what `trace` raises.
    """
    positions = positions_of(setup, lambda own: trace(program, own, axes, rotary, resolve))
    remarks = _followed(program, positions)
    return Checked(len(program), most_moves(positions), (*stamped(program), *remarks))


def check_on(program: Program, machine: Machine, setup: Setup, resolve: Resolve | None = None) -> Checked:
    """Check a program on a machine: besides, does it stay within the travel, and what would its correction refuse.

    Raises what `fix_program` raises, but for a stamp, which is a finding here.
    """
    positions = positions_of(setup, lambda own: follow(program, machine, own, resolve).trace)
    if machine.is_perfect:
        remarks = _followed(program, positions)
    else:
        remarks = remarks_of(fix_program(program, machine, setup, OPTIONS, resolve).report)
    travel = dict.fromkeys(
        message
        for position in positions
        for finding in travel_findings(placed(machine, setup), position.trace.moves)
        for message in finding.messages(partial(_place, program, position.trace.moves))
    )
    return Checked(len(program), most_moves(positions), together(stamped(program), remarks, tuple(travel)))


def _place(program: Program, moves: Moves, row: int) -> Place:
    """Where the block of a motion stands."""
    return program.place(int(moves.block[row]))


def _followed(program: Program, positions: Sequence[Position]) -> tuple[Message, ...]:
    """What there is to say of following a program in all positions of block delete; what was assumed is no finding."""
    assumed = {message for each in positions for message in each.trace.messages[: len(each.trace.assumed)]}
    said = (message for message in messages_of(positions) if message not in assumed)
    left = (message for each in positions for message in refused(program, each.trace.moves))
    return tuple(dict.fromkeys((*said, *left)))


def remarks_of(report: FixReport) -> tuple[Message, ...]:
    """What a correction would say and refuse, but for axes that stay where they stand and do not cut."""
    refusals = (Message(each.code, each.reason, Place(report.path, each.line)) for each in report.refused)
    harmless = {left.message(report.path) for left in report.left if not left.cuts}
    return (*(each for each in report.warnings if each not in harmless), *refusals)


def together(
    stamp: tuple[Message, ...], remarks: tuple[Message, ...], travel: tuple[Message, ...]
) -> tuple[Message, ...]:
    """All findings: nothing is told twice, and of a program that carries a stamp nobody needs to guess."""
    remarks = tuple(message for message in remarks if not (stamp and message.code == SUSPECTED))
    told = {_key(message) for message in remarks}
    return (*stamp, *remarks, *(message for message in travel if _key(message) not in told))


def _key(message: Message) -> tuple[str, int]:
    return message.code, message.place.line if message.place else 0


def stamped(program: Program) -> tuple[Message, ...]:
    """The stamp that a program carries, as a finding."""
    block = stamp.find(program)
    if block is None:
        return ()
    return (Message("NCF430", "the program has been corrected already", program.place(block), "fix the original"),)


def refused(program: Program, moves: Moves) -> tuple[Message, ...]:
    """The motions that must not be changed and are not right, one message per block."""
    blocks, rows = np.unique(np.where(moves.rule == Rule.REFUSE, moves.block, -1), return_index=True)
    reasons = [
        (int(block), moves.reasons[moves.reason[row]]) for block, row in zip(blocks, rows, strict=True) if block >= 0
    ]
    return tuple(Message("NCF432", reason, program.place(block)) for block, reason in reasons)


def travel_findings(machine: Machine, moves: Moves) -> tuple[Finding, ...]:
    """Motions that leave the travel as they are programmed."""
    adrift = (moves.kind == Kind.ARC) & ~np.isfinite(moves.centre).all(axis=1)
    kept = (moves.rule == Rule.PASS) | ~np.isfinite(moves.end).all(axis=1) | adrift
    return findings(machine, moves, untouched(moves, kept).pieces)


@dataclass(slots=True)
class Survey:
    """What has been found in the parts so far.

    machine  with the workpiece in its place; None: nothing is asked of the travel
    """

    machine: Machine | None = None
    moves: int = 0
    stamp: tuple[Message, ...] = ()
    refused: list[Message] = field(default_factory=list)
    travel: Notes = field(default_factory=Notes)

    def look(self, part: Part) -> None:
        """Take in the next part."""
        program, moves = part.program, part.moves
        self.moves += len(moves)
        self.stamp = self.stamp or stamped(program)
        self.refused += refused(program, moves)
        if self.machine is not None:
            for finding in travel_findings(self.machine, moves):
                self.travel.add(finding, program, moves)

    def checked(self, parts: Parts, remarks: tuple[Message, ...] | None = None) -> Checked:
        """What was found; `remarks` of a correction, else those of following the program."""
        blocks = parts.blocks + parts.blocks_behind()
        if remarks is None:
            follower = parts.follower
            remarks = (*follower.messages[len(follower.assumed) :], *self.refused)
        return Checked(blocks, self.moves, together(self.stamp, remarks, self.travel.messages()))


def survey_alone(parts: Parts, found: Iterable[Part]) -> Checked:
    """As `check_alone`, of the parts of a program; raises what following does, and `NotInPartsError`."""
    survey = Survey()
    for part in found:
        survey.look(part)
    return survey.checked(parts)


def survey_on(task: Task, read: Read) -> Checked:
    """As `check_on`, of the text that is read; raises what correcting does, and `NotInPartsError`."""
    if not task.machine.is_perfect:
        return _survey_corrected(task, read)
    units = Units.of(task, read)
    survey = Survey(units.placed)
    units.look = survey.look
    for _ in units:
        pass
    return survey.checked(units)


def _survey_corrected(task: Task, read: Read) -> Checked:
    """On a machine with errors."""
    task.check()
    corrector, tally = PartCorrector(task, read), Tally(task.machine.least_increment[0])
    survey = Survey(corrector.machine)
    corrector.units.look = survey.look
    for _, done in corrector.work(Share()):
        tally.take(done.tally)
    suspicion = suspected(tally.numbers, tally.step, task.path, task.options.force)
    return survey.checked(corrector.units, remarks_of(corrector.report(tally, suspicion)))
