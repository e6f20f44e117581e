"""Looking at a program without writing it: what the control or a correction would stumble over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.account import FixReport
from ncfix.compensate.assembly import untouched
from ncfix.compensate.findings import Finding
from ncfix.compensate.fix import fix_program
from ncfix.compensate.following import Resolve, follow
from ncfix.compensate.limits import findings
from ncfix.compensate.options import FixOptions
from ncfix.diagnostics import Message, Place
from ncfix.machine import Machine
from ncfix.program import stamp
from ncfix.program.moves import Kind, Moves, Rule
from ncfix.program.setup import Setup
from ncfix.program.trace import trace
from ncfix.program.tree import Program

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
    found = trace(program, setup, axes, rotary, resolve)
    said = found.messages[len(found.assumed) :]
    return Checked(len(program), len(found.moves), (*stamped(program), *said, *refused(program, found.moves)))


def check_on(program: Program, machine: Machine, setup: Setup, resolve: Resolve | None = None) -> Checked:
    """Check a program on a machine: besides, does it stay within the travel, and what would its correction refuse.

    Raises what `fix_program` raises, but for a stamp, which is a finding here.
    """
    followed = follow(program, machine, setup, resolve)
    found = followed.trace
    if machine.is_perfect:
        remarks = (*found.messages[len(found.assumed) :], *refused(program, found.moves))
    else:
        remarks = remarks_of(fix_program(program, machine, setup, OPTIONS, resolve).report)
    travel = tuple(
        message
        for finding in travel_findings(followed.machine, found.moves)
        for message in finding.messages(lambda row: program.place(int(found.moves.block[row])))
    )
    return Checked(len(program), len(found.moves), together(stamped(program), remarks, travel))


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
