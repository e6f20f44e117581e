"""A long program looked at while it is read: with the findings of `checking`, in bounded memory.

What a correction would refuse comes from correcting the parts (see `corrector`); nothing is written.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from ncfix.compensate.checking import OPTIONS, Checked, refused, remarks_of, stamped, together, travel_findings
from ncfix.compensate.corrector import Corrector
from ncfix.compensate.crew import Read, Share
from ncfix.compensate.notes import Notes
from ncfix.compensate.partition import Part, Parts
from ncfix.compensate.strategies import get_strategy
from ncfix.compensate.tally import Tally
from ncfix.compensate.task import Task, follower_of
from ncfix.compensate.units import Units
from ncfix.diagnostics import Message, UsageError
from ncfix.machine import Machine
from ncfix.program.dialect import Dialect
from ncfix.program.language import Run
from ncfix.program.parts import NotInPartsError, PartReader
from ncfix.program.tree import Template

Axes = Callable[[list[Template]], tuple[str, ...]]
"""The axes that a program names, by the shapes of its blocks."""


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
        blocks = parts.blocks + lines_behind(parts)
        if remarks is None:
            follower = parts.follower
            remarks = (*follower.messages[len(follower.assumed) :], *self.refused)
        return Checked(blocks, self.moves, together(self.stamp, remarks, self.travel.messages()))


def survey_alone(path: str, dialect: Dialect, run: Run, named: Axes, read: Read, size: int) -> Checked:
    """As `check_alone`, of the text that is read; raises what following does, and `NotInPartsError`.

    run  with the axes that the beginning of the text names
    """
    parts = Parts(OPTIONS, PartReader(path, dialect), follower_of(dialect, run), read, size)
    survey = Survey()
    for part in parts.parts():
        if named(parts.reader.templates) != run.axes:
            raise NotInPartsError("an axis is named for the first time")
        survey.look(part)
    if parts.follower.lacking:
        raise UsageError.collected(parts.follower.lacking)
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
    if error := units.missing():
        raise error
    return survey.checked(units)


def _corrected(task: Task, read: Read) -> Checked:
    """On a machine with errors."""
    task.check()
    corrector, tally = Corrector(task, read), Tally()
    survey = Survey(corrector.machine)
    corrector.units.look = survey.look
    suspicion: tuple[Message, ...] = ()
    for _, done in corrector.work(Share()):
        suspicion += done.suspicion
        tally.take(done.tally)
    tally.notes = corrector.units.notes
    messages = (*suspicion, *corrector.units.follower.messages)
    report = tally.report(task.path, messages, get_strategy(task.options.strategy).leaves, task.options)
    return survey.checked(corrector.units, remarks_of(report))


def lines_behind(parts: Parts) -> int:
    """Blocks behind the end of the program; raises `NotInPartsError` if there is more in them than the tape mark."""
    count, text = 0, parts.rest
    while text:
        if text.strip(b"% \t\r\n"):
            raise NotInPartsError("text comes after the end of the program")
        ended = text.endswith(b"\n")
        count += text.count(b"\n")
        text = parts.read(parts.size)
        count += not text and not ended
    return count
