"""Looking at a program without writing it: what the control or a correction would stumble over."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.assembly import untouched
from ncfix.compensate.findings import Finding
from ncfix.compensate.fix import fix_program
from ncfix.compensate.following import Followed, Resolve, follow
from ncfix.compensate.limits import findings
from ncfix.compensate.options import FixOptions
from ncfix.diagnostics import Message, Place
from ncfix.machine import Machine
from ncfix.program import stamp
from ncfix.program.moves import Kind, Moves, Rule, Trace
from ncfix.program.setup import Setup
from ncfix.program.trace import trace
from ncfix.program.tree import Program

SUSPECTED = "NCF438"
"""A program that seems to have been corrected: what nobody needs to guess of one that says so."""


@dataclass(frozen=True, slots=True)
class Checked:
    """What was looked at, and what was found."""

    moves: int
    findings: tuple[Message, ...]


def check_alone(
    program: Program, setup: Setup, axes: tuple[str, ...], rotary: frozenset[str], resolve: Resolve | None = None
) -> Checked:
    """Check a program without a machine: can it be followed, was it corrected before, what could not be corrected.

    What the setup does not give is no finding. Raises what `trace` raises.
    """
    found = trace(program, setup, axes, rotary, resolve)
    return Checked(len(found.moves), (*_stamped(program), *_said(found), *_refused(program, found)))


def check_on(program: Program, machine: Machine, setup: Setup, resolve: Resolve | None = None) -> Checked:
    """Check a program on a machine: besides, does it stay within the travel, and what would its correction refuse.

    Raises what `fix_program` raises, but for a stamp, which is a finding here.
    """
    followed = follow(program, machine, setup, resolve)
    if machine.is_perfect:
        remarks = (*_said(followed.trace), *_refused(program, followed.trace))
    else:
        report = fix_program(program, machine, setup, FixOptions(force=True, verify=False), resolve).report
        refusals = (Message(each.code, each.reason, Place(program.path, each.line)) for each in report.refused)
        harmless = {left.message(program.path) for left in report.left if not left.cuts}
        remarks = (*(each for each in report.warnings if each not in harmless), *refusals)
    stamped = _stamped(program)
    remarks = tuple(message for message in remarks if not (stamped and message.code == SUSPECTED))
    told = {(message.code, message.place.line if message.place else 0) for message in remarks}
    travel = (
        each for each in _travel(program, followed) if (each.code, each.place.line if each.place else 0) not in told
    )
    return Checked(len(followed.trace.moves), (*stamped, *remarks, *travel))


def _said(found: Trace) -> tuple[Message, ...]:
    """What following the program gave rise to, but for what was assumed."""
    return found.messages[len(found.assumed) :]


def _stamped(program: Program) -> tuple[Message, ...]:
    block = stamp.find(program)
    if block is None:
        return ()
    return (Message("NCF430", "the program has been corrected already", program.place(block), "fix the original"),)


def _refused(program: Program, found: Trace) -> tuple[Message, ...]:
    """The motions that must not be changed and are not right, one message per block."""
    moves = found.moves
    blocks, rows = np.unique(np.where(moves.rule == Rule.REFUSE, moves.block, -1), return_index=True)
    reasons = [
        (int(block), moves.reasons[moves.reason[row]]) for block, row in zip(blocks, rows, strict=True) if block >= 0
    ]
    return tuple(Message("NCF432", reason, program.place(block)) for block, reason in reasons)


def _travel(program: Program, followed: Followed) -> tuple[Message, ...]:
    """Motions that leave the travel as they are programmed."""
    moves = followed.trace.moves
    adrift = (moves.kind == Kind.ARC) & ~np.isfinite(moves.centre).all(axis=1)
    kept = (moves.rule == Rule.PASS) | ~np.isfinite(moves.end).all(axis=1) | adrift
    found = findings(followed.machine, moves, untouched(moves, kept).pieces)
    return tuple(message for finding in found for message in _messages(finding, program, moves))


def _messages(finding: Finding, program: Program, moves: Moves) -> tuple[Message, ...]:
    return finding.messages(lambda row: program.place(int(moves.block[row])))
