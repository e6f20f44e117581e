"""The second reader: where the axes go, block by block, in plain programs of three families.

It follows straight motions, arcs, drilling cycles, work offsets, tool lengths and tool-centre-point control. Whatever
else a program uses, it says so and follows no further: `AxisStep.why` has the reason. It never guesses.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from itertools import combinations

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.certificate.formulas import value_of
from ncfix.certificate.holes import HoleCall
from ncfix.certificate.model import TipModel
from ncfix.certificate.reading import AXES, JUMPS, Family, TextLine, TextWord
from ncfix.certificate.steps import NAN, AxisStep, Kind, ModesInForce, ProgramSteps, StraightRun
from ncfix.certificate.text import StraightLines, Text
from ncfix.certificate.turning import TurnedFrame
from ncfix.values import frozen

INCH = 25.4
CENTRES = {"X": "I", "Y": "J", "Z": "K"}


@frozen
class Given:
    """What a program cannot know: offsets, tool lengths, start and reference points by axis letter, mm and degree.

    tools  by number, or by name in upper case
    skip   which switches of block delete are on, or all or none; None: `prove` looks at every position
    """

    offsets: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    tools: Mapping[int | str, float | None] = field(default_factory=dict)
    initial: Mapping[str, float] = field(default_factory=dict)
    references: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    tcp: bool = False
    assume_zero: bool = False
    skip: bool | frozenset[int] | None = None
    workpiece_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    inputs: Mapping[str, float] = field(default_factory=dict)
    """What the errors of the machine depend on besides its axes."""
    pointless: bool = False
    """Numbers without a decimal point count increments: such programs are not followed."""
    decimal_inches: bool = False
    """A least increment of 0.001 mm is one of 0.0001 inch in blocks in inches."""


def skips(switches: bool | frozenset[int] | None, line: TextLine) -> bool:
    """Whether a line is skipped where these switches of block delete are on, or all or none; None is none."""
    on = line.skipped in switches if isinstance(switches, frozenset) else bool(switches)
    return bool(line.skipped) and on and not line.odd


def positions(text: Text, given: Given) -> list[Given]:
    """What is given in each position of the switches of block delete that a program asks, all of them off first."""
    asked = sorted({line.skipped for _, line in text.apart()} - {0}) if given.skip is None else []
    if not asked or len(asked) > MOST_SWITCHES:
        return [given]
    every = (on for count in range(len(asked) + 1) for on in combinations(asked, count))
    return [replace(given, skip=frozenset(on)) for on in every]


MOST_SWITCHES = 4
"""Of block delete, as many as `fix` looks at."""
LEAST = 6
"""So many straight lines one behind the other are followed in columns."""
REWRITTEN = re.compile(r"jumps|odd|end|MCALL|CYCLE|CYCL|HOLES|POCKET|SLOT|LONGHOLE|G11[012]|G16|CT|CIP|RND|CHF|AP|RP")
"""What a program uses, and is not followed behind; a correction may write further lines another way."""
UNKNOWN_WORDS = "words that this reader does not know here"
ROUND = 179.0
"""Degrees from which on the shorter way may be the other one: half a turn, less what a correction may be."""
SQUARE = 2e-4
"""rad; rotary words have three decimals of a degree."""
NO_POLE, NO_CENTRE = "the pole is not known", "an arc without a centre"


class AxisFollower:
    """A control that knows a few codes. One for each program; `run` gives its steps.

    shortest   M126: rotary axes go the shorter way, which is another one from half a turn on
    by_vector  under tool-centre-point control the tool turns in a plane, not its axes at even rates
    ended      the program has ended
    """

    shortest = by_vector = ended = False

    def __init__(self, axes: Sequence[str], family: Family, given: Given, model: TipModel | None) -> None:
        self.axes, self.family, self.given, self.model = tuple(axes), family, given, model
        start = 0.0 if given.assume_zero else NAN
        self.at = {axis: given.initial.get(axis, start) for axis in axes}
        self.said = {axis: axis in given.initial and not given.assume_zero for axis in axes}
        self.kind: Kind | None = None
        self.clockwise = False
        self.plane, self.unit, self.counting = 17, 1.0, False
        self.system = {Family.WORDS: "G54", Family.SINUMERIK: "G500", Family.KLARTEXT: "PRESET"}[family]
        if family is Family.KLARTEXT and "PRESET" not in given.offsets:
            self.system = "G54"
        self.tool: int | str = 0
        self.next_tool: int | str = 0
        self.length: float | None = 0.0 if family is Family.WORDS else self.length_of(self.tool)
        """The tool length in force in coordinates; SINUMERIK and Klartext begin with that of the tool in place."""
        self.between = False
        """The length offset in force is not of the tool in the spindle: which of them counts is not sure."""
        self.tcp = self.asks_tip = given.tcp
        self.turn: TurnedFrame | None = None
        """Where the coordinates are turned; `at` holds numbers then, not commands."""
        self.beside = False
        self.feed: float | None = None
        self.feed_mode = 94
        self.cycle: dict[str, float] = {}
        self.returns_to_level: bool | None = None
        self.before_cycle, self.said_before = NAN, False
        """Where Z stood before the cycles, and whether the program has brought it there."""
        self.calls: dict[int, HoleCall] = {}
        """The drilling cycles of holes, by their lines."""
        self.modal_call: HoleCall | None = None
        """MCALL: the cycle that follows each motion."""
        self.pole: dict[str, float] = {}
        self.shifts: dict[str, float] = {}
        """What the program itself adds to the numbers of axes, mm or degree: G92, TRANS."""
        self.local: dict[str, float] = {}
        """The same by G52."""
        self.variables: dict[str, float | None] = {}
        """What the program has given variables and parameters; None: not known."""
        self.lost: dict[str, str] = {}
        self.foreign: set[int] = set()
        """Lines that a correction may rewrite otherwise."""
        if given.pointless:
            self.lost["points"] = "numbers without a decimal point count increments"

    def run(self, text: Text) -> ProgramSteps:
        """Follow the lines of a program."""
        lines = text.lines
        if any(line.odd is JUMPS for _, line in text.apart()):
            self.lost["jumps"] = JUMPS
        log = ProgramSteps(lines, self.axes)
        straight = None if text.read is None or self.lost else text.read.straight(self.axes)
        stops = [] if straight is None else _stops(straight.is_straight)
        row, tried = 0, 0
        while row < len(lines):
            if straight is not None and not self.lost and row >= tried and stops[row] - row >= LEAST:
                run = self.straight_run(straight, row, stops[row])
                if run is not None:
                    log.add_run(run)
                    row = stops[row]
                    continue
                tried = row + 1 if self.kind is None or self.kind > Kind.FEED else stops[row]
            self._line(row, lines[row], log)
            row += 1
        return log.done()

    def _line(self, row: int, line: TextLine, log: ProgramSteps) -> None:
        """Follow one line."""
        behind = self.ended and not (line.path or line.codes)  # the % that is last stays where it is
        if line.odd or (self.lost and not behind and any(map(REWRITTEN.match, self.lost))):
            self.foreign.add(row)
        if line.skipped and self.given.skip is None:
            self.lost["switches"] = "the program has too many switches of block delete"
        if skips(self.given.skip, line):
            return
        found = self.block(row, line)
        if self.ended:
            self.lost["end"] = "behind the end of the program"
        if found is not None:
            if self.turn is not None and not found.why and found.kind is not Kind.FIXED:
                found = self.turn.step(found)
                if self.turn.tilted and self.length != found.length:
                    found.why = "the length of the tool is not in force in a tilted plane"
            log.add(found)
            if found.why:
                self.forget()

    def straight_run(self, lines: StraightLines, row: int, stop: int) -> StraightRun | None:
        """The steps of lines that only bring axes straight to places; None if that takes more than columns."""
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
        """Whether a rotary axis goes half a turn or more from one of places (n, n_axes) to the next."""
        turns = [column for column, axis in enumerate(self.axes) if axis in "ABC"]
        return bool((np.abs(np.diff(places[:, turns], axis=0)) >= ROUND).any())

    def block(self, row: int, line: TextLine) -> AxisStep | None:
        """What one line does; None if it moves nothing."""
        raise NotImplementedError

    # -- what all families share --------------------------------------------------------------------------------------

    def forget(self) -> None:
        """Nothing is known of where axes stand."""
        for axis in self.axes:
            self.at[axis], self.said[axis] = NAN, False

    def unsay(self, axes: str | tuple[str, ...] = ()) -> None:
        """The program has not brought these axes, or all, to where they stand."""
        for axis in axes or self.axes:
            if axis in self.said:
                self.said[axis] = False

    def offset(self, axis: str) -> float:
        """What is added to the numbers of an axis, mm or degree."""
        system = self.given.offsets.get(self.system)
        if system is None:
            shift = 0.0 if self.given.assume_zero or self.system == "G500" else NAN
        else:
            shift = system.get(axis, 0.0)
        if axis == "Z" and not self.tcp:
            shift += NAN if self.length is None else self.length
        if self.shifts or self.local:
            shift += self.shifts.get(axis, 0.0) + self.local.get(axis, 0.0)
        return shift

    def length_of(self, tool: int | str) -> float | None:
        """The length of a tool, mm, if it is given."""
        found = self.given.tools.get(tool)
        return 0.0 if found is None and self.given.assume_zero else found

    def tip_length(self) -> float:
        """How long the tool is whose tip is looked at, mm; NaN if that is not known."""
        length = None if self.between else self.length_of(self.tool)
        return NAN if length is None else length

    def lead(self, on: bool) -> None:
        """Tool-centre-point control goes on or off: the same place has other numbers.

        Where the setup says that X Y Z are those of the tip, only Klartext can say that they are not.
        """
        self.asks_tip = on
        on = on or (self.turn is not None and self.turn.tilted)
        if on == self.tcp or (self.given.tcp and self.family is not Family.KLARTEXT):
            return
        if self.turn is not None:
            self.lost["frame"] = "tool-centre-point control in turned coordinates"
        if self.family is not Family.KLARTEXT and (any(self.shifts.values()) or any(self.local.values())):
            self.lost["shift"] = "a shift under tool-centre-point control"
        self.tcp = on
        known = [self.at[axis] for axis in self.axes]
        numbers = self.model.turned(known, self.tip_length(), on) if self.model else [NAN] * len(known)
        self.at.update((axis, number) for axis, number in zip(self.axes, numbers, strict=True) if axis in "XYZ")
        self.unsay("XYZ")

    def begin_turn(self, rotation: Array, origin: Sequence[float] = (0.0, 0.0, 0.0), *, tilted: bool) -> None:
        """Coordinates are turned about the zero point, and moved to an origin (3,), mm from there.

        tilted  in a plane of the workpiece: then X Y Z are those of the tip
        """
        self.end_turn()
        if self.model is None or (tilted and not self.model.leads):
            self.lost["frame"] = "turned coordinates on a machine whose axes do not lead the tip everywhere"
            return
        if tilted:
            asked = self.asks_tip
            self.lead(True)
            self.asks_tip = asked
        zero = np.array([self.offset(axis) for axis in "XYZ"])
        self._enter(TurnedFrame(self.model.columns, rotation, zero, zero + np.array(origin), tilted))

    def begin_turn_about(self, rotation: Array, centre: Mapping[str, float]) -> None:
        """Coordinates are turned, and the numbers of some axes stay as they are at a centre, mm."""
        self.end_turn()
        middle = np.array([centre.get(axis, 0.0) for axis in "XYZ"])
        if self.model is None or self.tcp:
            self.lost["frame"] = "turned coordinates under tool-centre-point control"
        else:
            self._enter(TurnedFrame(self.model.columns, rotation, middle, middle, False))

    def end_turn(self) -> None:
        """Coordinates are not turned any more."""
        before, self.turn = self.turn, None
        if before is not None:
            self._stand_at(before.commands(np.array([[*self.at.values()]]))[0], before)
            self.lead(self.asks_tip)

    def _enter(self, turn: TurnedFrame) -> None:
        self.turn = turn
        self._stand_at(turn.numbers(np.array([*self.at.values()])), turn)

    def _stand_at(self, place: Array, turn: TurnedFrame) -> None:
        """The same place has these numbers (n_axes,) now; those that a turn changes the program has not said."""
        for k, axis in enumerate("XYZ"):
            number = float(place[turn.columns[k]])
            if number != self.at[axis]:
                self.at[axis], self.said[axis] = number, False

    def forget_place(self, but: str = "") -> None:
        """Where X, Y and Z stand, but for some of them, is not known until the program says it."""
        for axis in "XYZ":
            if axis not in but:
                self.at[axis], self.said[axis] = NAN, False

    def is_square(self) -> bool:
        """Whether the tool is square to the tilted plane in force."""
        way, here = None if self.model is None else self.model.rotary_way, self._turns()
        if way is None or self.turn is None or not np.isfinite(here).all():
            return False
        return bool(np.abs(way.directions(here[None])[0] - self.turn.rotation[:, 2]).max() < SQUARE)

    def _turns(self) -> Array:
        """Where the rotary axes stand, rad."""
        return np.radians([self.at[axis] for axis in self.axes if axis in "ABC"])

    def square_to(
        self, rotation: Array, *, sense: int = 0, sign: int = 0, inside: bool = False, stays: bool = True
    ) -> dict[str, float]:
        """Where the rotary axes go to square the tool to a plane, degrees, as `RotaryWay.to`; NaN if not known."""
        turning = [axis for axis in self.axes if axis in "ABC"]
        way, here = None if self.model is None else self.model.rotary_way, self._turns()
        if way is None or not np.isfinite(here).all():
            return dict.fromkeys(turning, NAN)
        found = way.to(rotation[:, 2], here, sense=sense, sign=sign, inside=inside, stays=stays)
        return dict(zip(turning, [NAN, NAN] if found is None else np.degrees(found).tolist(), strict=True))

    def settled(self, line: TextLine) -> TextLine:
        """A line whose words have the values of their formulas, where the variables in them are known."""
        if line.plain or all(word.value is not None for word in line.path):
            return line
        given_here = {word.name for word in line.codes}  # which of both values counts is not sure
        known = {name: value for name, value in self.variables.items() if name not in given_here}
        values = (word.value if word.value is not None else value_of(word.number, known) for word in line.path)
        path = [
            word if word.value == value else word._replace(number="", value=value)
            for word, value in zip(line.path, values, strict=True)
        ]
        return replace(line, path=path)

    def scale(self, axis: str) -> float:
        """Mm, or degree, in a unit of the words of an axis."""
        return self.unit if axis in "XYZUVW" else 1.0

    def target(self, words: Mapping[str, TextWord], machine: bool = False) -> dict[str, float]:
        """Where the words lead, and which axes they say."""
        end = dict(self.at)
        for axis, word in words.items():
            value = NAN if word.value is None else word.value * self.scale(axis)
            counted = word.counted == "+" or (word.counted == "" and self.counting)
            if machine:
                end[axis] = value
            elif counted:
                end[axis] = self.at[axis] + value
            else:
                end[axis] = self.offset(axis) + value
                self.said[axis] = True
        return end

    def step(self, row: int, kind: Kind, end: dict[str, float], line: TextLine, why: str = "") -> AxisStep:
        """What a line does, which ends at `end`, and why it cannot be followed, if so."""
        named = {word.name: word for word in line.path if word.name in self.at}
        strange = next((word.name for word in line.path if word.name in AXES and word.name not in self.at), "")
        if not why and strange:
            why = f"the machine has no axis {strange}"
        foreign = bool(line.odd) or any(REWRITTEN.match(key) for key in self.lost)
        if not why and line.odd:
            why = line.odd
        if not why and (twice := line.doubled()):
            why = f"two words {twice}"
        if not why and kind is not Kind.FIXED and any(word.value is None for word in line.path):
            why = "a word is a formula"
        if not why:
            why = next(iter(self.lost.values()), "")
        if not why and self.shortest and self._goes_round(np.array([[*self.at.values()], [*end.values()]])):
            why = "a rotary axis goes the shorter way (M126)"
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
        """The step of a line that only brings axes straight to places, as `step` gives it: nothing else is in force."""
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
        why = "" if self.plane == 17 and not self.counting else "a drilling cycle that this reader does not know"
        step = self.step(row, Kind.HOLE, {**over, "Z": offset + unit * call.bottom}, line, why)
        step.foreign |= bool(why)
        self.at = {**over, "Z": offset + unit * call.level}
        self.calls[row] = call
        return step

    def auxiliary(self, word: TextWord) -> None:
        """An M word."""
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
                self.lost["jumps"] = JUMPS
            case None:
                self.lost["M"] = "an M code is a formula"
            case _:
                pass

    def choose_edge(self, number: float | None) -> None:
        """D of SINUMERIK: its length is in force, and none of T0 or D0."""
        self.new_length(self.length_of(self.tool) if number and self.tool else 0.0)

    def new_length(self, length: float | None) -> None:
        """Another tool length is in force in coordinates; it lies along Z of the machine, however they are turned."""
        before, self.length, self.between = self.length, length, False
        if self.turn is not None and not self.tcp and self.turn.rotation[2, 2] != 1.0:
            place = self.turn.commands(np.array([[*self.at.values()]]))[0]
            longer = np.array([0.0, 0.0, NAN if before is None or length is None else length - before])
            self.turn = replace(self.turn, zero=self.turn.zero + longer, origin=self.turn.origin + longer)
            self._stand_at(self.turn.numbers(place), self.turn)
        self.unsay("Z" if not self.tcp or (self.turn is not None and self.is_square()) else "XYZ")


def _stops(flags: Mask) -> list[int]:
    """Where the run of true ones ends in which each of them stands; of others their own index."""
    n = len(flags)
    others = np.where(flags, n, np.arange(n))
    found: list[int] = np.minimum.accumulate(others[::-1])[::-1].tolist()
    return found
