"""The second reader: the motion of the axes, block by block, in plain programs of three families.

It follows straight motions, arcs, drilling cycles, work offsets, tool lengths and tool-centre-point control. If a
program uses anything else, it gives the reason in `AxisStep.why` and follows no further. It never guesses.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from ncfix.arrays import Array, stops
from ncfix.certificate.coordinates import FollowedAxes, Given
from ncfix.certificate.flow import LineOrder
from ncfix.certificate.formulas import value_of
from ncfix.certificate.holes import HoleCall
from ncfix.certificate.model import TipModel
from ncfix.certificate.reading import AXES, JUMPS, Family, TextLine, TextWord
from ncfix.certificate.steps import NAN, AxisStep, Kind, ModesInForce, ProgramSteps, StraightRun
from ncfix.certificate.text import StraightLines, Text

INCH = 25.4
CENTRES = {"X": "I", "Y": "J", "Z": "K"}


def skips(switches: bool | frozenset[int] | None, line: TextLine) -> bool:
    """Whether a line is skipped if these switches of block delete are on; True: all are, False or None: none is."""
    on = line.skipped in switches if isinstance(switches, frozenset) else bool(switches)
    return bool(line.skipped) and on and not line.odd


def positions(text: Text, given: Given) -> list[Given]:
    """The given values for each position of the program's switches of block delete, first with all of them off."""
    asked = sorted({line.skipped for _, line in text.apart()} - {0}) if given.skip is None else []
    if not asked or len(asked) > MOST_SWITCHES:
        return [given]
    every = (on for count in range(len(asked) + 1) for on in combinations(asked, count))
    return [replace(given, skip=frozenset(on)) for on in every]


MOST_TURNS = 4
"""Number of executions of a line that are examined; further ones must do the same as the last of these."""
MOST_SWITCHES = 4
"""Largest number of switches of block delete whose positions are all examined, as by `fix`."""
LEAST = 6
"""Least number of consecutive straight lines that are followed in columns."""
UNKNOWN_WORDS = "words that the second reader does not know here"
ROUND = 179.0
"""Turn, degrees, above which the shorter way may be the other one: half a turn minus a correction."""
NO_POLE, NO_CENTRE = "the pole is not known", "an arc without a centre"


class AxisFollower(FollowedAxes):
    """A simple model of a control, one for each program; `run` returns the steps of the program.

    shortest   M126: rotary axes go the shorter way, which is ambiguous at half a turn
    by_vector  under tool-centre-point control the tool turns in a plane, instead of the axes evenly
    ended      the program has ended
    """

    shortest = by_vector = ended = False

    def __init__(self, axes: Sequence[str], family: Family, given: Given, model: TipModel | None) -> None:
        super().__init__(axes, family, given, model)
        self.kind: Kind | None = None
        self.clockwise = False
        self.plane = 17
        self.next_tool: int | str = 0
        self.beside = False
        self.feed: float | None = None
        self.feed_mode = 94
        self.cycle: dict[str, float] = {}
        self.returns_to_level: bool | None = None
        self.before_cycle, self.said_before = NAN, False
        """Position of Z before the cycles, and whether the program has set it."""
        self.calls: dict[int, HoleCall] = {}
        """Line -> the drilling cycle of its hole."""
        self.modal_call: HoleCall | None = None
        """The cycle of MCALL, which follows each motion."""
        self.pole: dict[str, float] = {}
        self.last_length: int | None = None
        """The last H of G43."""
        self.variables: dict[str, float | None] = {}
        """Values of variables and parameters; None: not known."""
        self.foreign: set[int] = set()
        """Lines that a correction may rewrite in a form unknown to this reader."""
        self.turns: dict[int, int] = {}
        """Line -> number of its executions, in a program with loops or subprograms that are followed; else empty."""
        if given.pointless:
            self.lose("numbers without a decimal point count increments")

    def run(self, text: Text, turn: int | None = None) -> ProgramSteps:
        """Follow the lines of a program.

        turn  in a program with loops or subprograms, the execution of each line whose step is returned: 0 the first,
              1 the second, ...; the last if there are fewer. None: loops and subprograms are not followed

        Raises `NotPlainError`.
        """
        order = None if turn is None else LineOrder.of(text)
        if turn is not None and order is not None:
            return self._run_along(order, text.lines, turn)
        lines = text.lines
        if any(line.odd is JUMPS for _, line in text.apart()):
            self.lose(JUMPS, rewritten=True)
        log = ProgramSteps(lines, self.axes)
        straight = None if text.read is None or self.lost else text.read.straight(self.axes)
        ends = [] if straight is None else stops(straight.is_straight).tolist()
        row, tried = 0, 0
        while row < len(lines):
            if straight is not None and not self.lost and row >= tried and ends[row] - row >= LEAST:
                run = self.straight_run(straight, row, ends[row])
                if run is not None:
                    log.add_run(run)
                    row = ends[row]
                    continue
                tried = row + 1 if self.kind is None or self.kind > Kind.FEED else ends[row]
            if (step := self._line(row, lines[row])) is not None:
                log.add(step)
            row += 1
        return log.done()

    def _run_along(self, order: LineOrder, lines: Sequence[TextLine], turn: int) -> ProgramSteps:
        """Follow a program in the order in which its lines are executed; `turn` as in `run`."""
        made: dict[int, list[AxisStep | None]] = {}
        row = 0
        while row < len(lines) and not self.ended:
            call = self.calls.get(row)
            made.setdefault(row, []).append(None if row in order.lines else self._line(row, lines[row]))
            if call is not None and self.calls.get(row) != call:
                self.foreign.add(row)
            row = order.line_after(row, self.variables)
        self.lose("after the end of the program", rewritten=True)
        for row in range(len(lines)):
            if row not in made and row not in order.lines:
                made[row] = [self._line(row, lines[row])]
        log = ProgramSteps(lines, self.axes)
        for _, steps in sorted(made.items()):
            step = steps[min(turn, len(steps) - 1)]
            if step is not None:
                last, *further = steps[MOST_TURNS - 1 :] or [step]
                if last is None or not all(other is not None and last.is_like(other) for other in further):
                    step.why = step.why or "a motion with more possible paths than the second reader checks"
                log.add(step)
        self.turns = {row: len(steps) for row, steps in made.items()}
        return log.done()

    def _line(self, row: int, line: TextLine) -> AxisStep | None:
        """Follow one line. Returns its step; None if it is skipped, or moves nothing."""
        behind = self.ended and not (line.path or line.codes)  # the last % is kept
        if line.odd or (not behind and self.is_rewritten):
            self.foreign.add(row)
        if line.skipped and self.given.skip is None:
            self.lose("the program has too many switches of block delete")
        if skips(self.given.skip, line):
            return None
        found = self.block(row, line)
        if self.ended:
            self.lose("after the end of the program", rewritten=True)
        if found is not None:
            if self.turn is not None and not found.why and found.kind is not Kind.FIXED:
                found = self.turn.step(found)
                if self.turn.tilted and self.length != found.length:
                    found.why = "the tool length is not in force in a tilted plane"
            if found.why:
                self.forget()
        return found

    def straight_run(self, lines: StraightLines, row: int, stop: int) -> StraightRun | None:
        """The steps of consecutive straight motions; None if they cannot be followed in columns."""
        klartext = self.family is Family.KLARTEXT
        if not klartext and (self.kind is None or self.kind > Kind.FEED) and lines.code[row] < 0:
            return None
        if self.modal_call is not None:
            return None
        if self.turn is not None and self.turn.tilted and self.length != self.tip_length():
            return None
        modes = ModesInForce(
            np.array([self.offset(axis) for axis in self.axes]),
            np.array([self.scale(axis) for axis in self.axes]),
            self.counting,
            self.tcp,
            self.tip_length(),
            self.feed_mode,
            self.unit,
            self.beside,
            self.by_vector and self.tcp,
        )
        at, said = list(self.at.values()), list(self.said.values())
        before = (at, said, self.kind == Kind.RAPID, NAN if self.feed is None else self.feed)
        run = StraightRun.of(lines, (row, stop), before, modes, klartext)
        if run is not None and self.shortest and self._goes_round(np.vstack([at, run.end])):
            return None
        if run is not None:
            self.at = dict(zip(self.axes, run.end[-1].tolist(), strict=True))
            self.said = dict(zip(self.axes, run.said[-1].tolist(), strict=True))
            self.kind = Kind.RAPID if run.rapid[-1] else Kind.FEED
            feed = float(run.feed[-1])
            self.feed = None if math.isnan(feed) else feed
            if self.turn is not None:
                return self.turn.run(run)
        return run

    def _goes_round(self, places: Array) -> bool:
        """Whether a rotary axis turns by about half a turn or more from one of places (n, n_axes) to the next."""
        turns = [column for column, axis in enumerate(self.axes) if axis in "ABC"]
        return bool((np.abs(np.diff(places[:, turns], axis=0)) >= ROUND).any())

    def block(self, row: int, line: TextLine) -> AxisStep | None:
        """The step of one line; None if it moves nothing."""
        raise NotImplementedError

    # -- common to all families ---------------------------------------------------------------------------------------

    def settled(self, line: TextLine) -> TextLine:
        """The line with formulas replaced by their values, if the variables in them are known."""
        if line.plain or all(word.value is not None for word in line.path):
            return line
        given_here = {word.name for word in line.codes}  # the path may use the old or the new value
        known = {name: value for name, value in self.variables.items() if name not in given_here}
        values = (word.value if word.value is not None else value_of(word.number, known) for word in line.path)
        path = [
            word if word.value == value else word._replace(number="", value=value)
            for word, value in zip(line.path, values, strict=True)
        ]
        return replace(line, path=path)

    def step(self, row: int, kind: Kind, end: dict[str, float], line: TextLine, why: str = "") -> AxisStep:
        """The step of a line that ends at `end`; `why`: the reason why it cannot be followed, if there is one."""
        named = {word.name: word for word in line.path if word.name in self.at}
        strange = next((word.name for word in line.path if word.name in AXES and word.name not in self.at), "")
        if not why and strange:
            why = f"the machine has no axis {strange}"
        foreign = bool(line.odd) or self.is_rewritten
        if not why and line.odd:
            why = line.odd
        if not why and (twice := line.doubled()):
            why = f"two words {twice}"
        if not why and kind is not Kind.FIXED and any(word.value is None for word in line.path):
            why = "a word is a formula"
        if not why:
            why = next((loss.why for loss in self.lost), "")
        if not why and self.shortest and self._goes_round(np.array([[*self.at.values()], [*end.values()]])):
            why = "a rotary axis takes the shorter path (M126)"
        step = AxisStep(
            row,
            kind,
            [self.at[axis] for axis in self.axes],
            [end[axis] for axis in self.axes],
            [self.said[axis] for axis in self.axes],
            named,
            why,
            self.tcp,
            self.tip_length(),
            self.feed,
            self.feed_mode,
            self.unit,
            foreign=foreign,
            unsteady=self.beside,
            by_vector=self.by_vector and self.tcp,
        )
        self.at = end
        return step

    def straight(self, row: int, line: TextLine) -> AxisStep:
        """The step of a straight motion, as `step` returns it, but faster: no other state is in force."""
        at, said, counting = self.at, self.said, self.counting
        start = list(at.values())
        named = {}
        for word in line.path:
            name, _, value, counted = word
            named[name] = word
            scaled = value * (self.unit if name in "XYZUVW" else 1.0)  # type: ignore[operator]  # plain words have one
            if counted == "+" or (counting and not counted):
                at[name] += scaled
            else:
                at[name] = self.offset(name) + scaled
                said[name] = True
        return AxisStep(
            row,
            self.kind or Kind.RAPID,
            start,
            list(at.values()),
            list(said.values()),
            named,
            "",
            self.tcp,
            self.tip_length(),
            self.feed,
            self.feed_mode,
            self.unit,
            unsteady=self.beside,
            by_vector=self.by_vector and self.tcp,
        )

    def called_hole(self, row: int, line: TextLine, over: dict[str, float], call: HoleCall) -> AxisStep:
        """The step of a hole whose cycle is called over a place, in G17."""
        offset, unit = self.offset("Z"), self.scale("Z")
        self.said["Z"] = True
        why = "" if self.plane == 17 and not self.counting else "a drilling cycle not known to the second reader"
        step = self.step(row, Kind.HOLE, {**over, "Z": offset + unit * call.bottom}, line, why)
        step.foreign |= bool(why)
        self.at = {**over, "Z": offset + unit * call.level}
        self.calls[row] = call
        return step

    def auxiliary(self, word: TextWord) -> None:
        """Apply an M word."""
        match word.value:
            case 6:
                self.between = self.family is Family.WORDS and bool(self.length) and self.next_tool != self.tool
                self.tool = self.next_tool
                if self.family is Family.SINUMERIK:
                    self.choose_edge(1)
                self.unsay()
            case 2 | 30:
                self.ended = True
            case 96 | 97 | 98 | 99 | 198 if self.family is not Family.KLARTEXT:
                self.lose(JUMPS, rewritten=True)
            case None:
                self.lose("an M code is a formula")
            case _:
                pass
