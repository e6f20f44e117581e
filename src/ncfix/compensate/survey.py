"""A long program looked at while it is read: with the findings of `checking`, in bounded memory.

What a correction would refuse comes from correcting the parts (see `corrector`); nothing is written.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from ncfix.compensate.checking import Checked, refused, remarks_of, stamped, together, travel_findings
from ncfix.compensate.corrector import Corrector
from ncfix.compensate.crew import Read, Share
from ncfix.compensate.double import suspected
from ncfix.compensate.partition import Part, Parts
from ncfix.compensate.plan.findings import Notes
from ncfix.compensate.plan.strategies import get_strategy
from ncfix.compensate.tally import Tally
from ncfix.compensate.task import Task
from ncfix.compensate.units import Units
from ncfix.diagnostics import Message
from ncfix.machine import Machine


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
        return _corrected(task, read)
    units = Units.of(task, read)
    survey = Survey(units.placed)
    units.look = survey.look
    for _ in units:
        pass
    return survey.checked(units)


def _corrected(task: Task, read: Read) -> Checked:
    """On a machine with errors."""
    task.check()
    corrector, tally = Corrector(task, read), Tally(task.machine.least_increment[0])
    survey = Survey(corrector.machine)
    corrector.units.look = survey.look
    for _, done in corrector.work(Share()):
        tally.take(done.tally)
    tally.notes = corrector.units.notes
    suspicion = suspected(tally.numbers, tally.step, task.path, task.options.force)
    messages = (*suspicion, *corrector.units.follower.messages)
    report = tally.report(task.path, messages, get_strategy(task.options.strategy).leaves, task.options)
    return survey.checked(corrector.units, remarks_of(report))
