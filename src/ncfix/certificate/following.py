"""The second reader: the motion of the axes, block by block, in plain programs of three families.

It follows straight motions, arcs, drilling cycles, work offsets, tool lengths and tool-centre-point control. If a
program uses anything else, it gives the reason in `AxisStep.why` and follows no further. It never guesses.
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
    """Values outside the program: offsets, tool lengths, start and reference points by axis letter, mm and degree.

    tools  tool lengths by number, or by name in upper case
    skip   the switches of block delete that are on, or True: all, False: none; None: `prove` examines every position
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
    """Inputs of the error model, by name."""
    pointless: bool = False
    """Numbers without a decimal point count least increments: such programs are not followed."""
    decimal_inches: bool = False
    """A least increment of 0.001 mm becomes 0.0001 inch in blocks in inches."""


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


MOST_SWITCHES = 4
"""Largest number of switches of block delete whose positions are all examined, as by `fix`."""
LEAST = 6
"""Least number of consecutive straight lines that are followed in columns."""
REWRITTEN = re.compile(r"jumps|odd|end|MCALL|CYCLE|CYCL|HOLES|POCKET|SLOT|LONGHOLE|G11[012]|G16|CT|CIP|RND|CHF|AP|RP")
"""Reasons for which a program is not followed any further, and behind which a correction may rewrite lines."""
UNKNOWN_WORDS = "words that this reader does not know here"
ROUND = 179.0
"""Turn, degrees, above which the shorter way may be the other one: half a turn minus a correction."""
SQUARE = 2e-4
"""Largest angle, rad, of a tool that is square to a plane: rotary words have three decimals of a degree."""
NO_POLE, NO_CENTRE = "the pole is not known", "an arc without a centre"


class AxisFollower:
    """A simple model of a control, one for each program; `run` returns the steps of the program.

    shortest   M126: rotary axes go the shorter way, which is ambiguous at half a turn
    by_vector  under tool-centre-point control the tool turns in a plane, instead of the axes evenly
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
        """The length offset in force is not that of the tool in the spindle, so the length of the tool is not sure."""
        self.tcp = self.asks_tip = given.tcp
        self.turn: TurnedFrame | None = None
        """The turned coordinates in force; then `at` holds numbers of the program, not commands."""
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
        self.shifts: dict[str, float] = {}
        """Shifts of axes by the program (G92, TRANS), mm or degree."""
        self.local: dict[str, float] = {}
        """Shifts of axes by G52, mm or degree."""
        self.variables: dict[str, float | None] = {}
        """Values of variables and parameters; None: not known."""
        self.lost: dict[str, str] = {}
        self.foreign: set[int] = set()
        """Lines that a correction may rewrite in a form unknown to this reader."""
        if given.pointless:
            self.lost["points"] = "numbers without a decimal point count increments"

    def run(self, text: Text) -> ProgramSteps:
        """The steps of a program."""
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
        """Follow one line, and log its step."""
        behind = self.ended and not (line.path or line.codes)  # the last % stays
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

    def forget(self) -> None:
        """Mark the positions of all axes as not known."""
        for axis in self.axes:
            self.at[axis], self.said[axis] = NAN, False

    def unsay(self, axes: str | tuple[str, ...] = ()) -> None:
        """Mark the positions of these axes, or of all, as not set by the program."""
        for axis in axes or self.axes:
            if axis in self.said:
                self.said[axis] = False

    def offset(self, axis: str) -> float:
        """The sum of all offsets that are added to the numbers of an axis, mm or degree; NaN if not known."""
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
        """The length of a tool, mm; None if it is not given."""
        found = self.given.tools.get(tool)
        return 0.0 if found is None and self.given.assume_zero else found

    def tip_length(self) -> float:
        """The length of the tool in the spindle, mm; NaN if not known."""
        length = None if self.between else self.length_of(self.tool)
        return NAN if length is None else length

    def lead(self, on: bool) -> None:
        """Switch tool-centre-point control on or off, and convert the position to the new coordinates.

        If the setup says that X Y Z are those of the tip, only Klartext can switch it off.
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
        """Turn the coordinates about the zero point, and move it by `origin` (3,), mm.

        tilted  they are fixed to the workpiece, so that X Y Z are those of the tip
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
        """Turn the coordinates about a centre, mm, whose numbers stay the same."""
        self.end_turn()
        middle = np.array([centre.get(axis, 0.0) for axis in "XYZ"])
        if self.model is None or self.tcp:
            self.lost["frame"] = "turned coordinates under tool-centre-point control"
        else:
            self._enter(TurnedFrame(self.model.columns, rotation, middle, middle, False))

    def end_turn(self) -> None:
        """End the turn of the coordinates."""
        before, self.turn = self.turn, None
        if before is not None:
            self._stand_at(before.commands(np.array([[*self.at.values()]]))[0], before)
            self.lead(self.asks_tip)

    def _enter(self, turn: TurnedFrame) -> None:
        self.turn = turn
        self._stand_at(turn.numbers(np.array([*self.at.values()])), turn)

    def _stand_at(self, place: Array, turn: TurnedFrame) -> None:
        """Set the position (n_axes,) in new coordinates; numbers that change count as not set by the program."""
        for k, axis in enumerate("XYZ"):
            number = float(place[turn.columns[k]])
            if number != self.at[axis]:
                self.at[axis], self.said[axis] = number, False

    def forget_place(self, but: str = "") -> None:
        """Mark the positions of X, Y and Z, except those in `but`, as not known."""
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
        """Positions of the rotary axes, rad."""
        return np.radians([self.at[axis] for axis in self.axes if axis in "ABC"])

    def square_to(
        self, rotation: Array, *, sense: int = 0, sign: int = 0, inside: bool = False, stays: bool = True
    ) -> dict[str, float]:
        """Rotary positions, degrees, with the tool square to a plane, see `RotaryWay.to`; NaN if not known."""
        turning = [axis for axis in self.axes if axis in "ABC"]
        way, here = None if self.model is None else self.model.rotary_way, self._turns()
        if way is None or not np.isfinite(here).all():
            return dict.fromkeys(turning, NAN)
        found = way.to(rotation[:, 2], here, sense=sense, sign=sign, inside=inside, stays=stays)
        return dict(zip(turning, [NAN, NAN] if found is None else np.degrees(found).tolist(), strict=True))

    def settled(self, line: TextLine) -> TextLine:
        """The line with formulas replaced by their values, if the variables in them are known."""
        if line.plain or all(word.value is not None for word in line.path):
            return line
        given_here = {word.name for word in line.codes}  # whether the old or the new value counts is not sure
        known = {name: value for name, value in self.variables.items() if name not in given_here}
        values = (word.value if word.value is not None else value_of(word.number, known) for word in line.path)
        path = [
            word if word.value == value else word._replace(number="", value=value)
            for word, value in zip(line.path, values, strict=True)
        ]
        return replace(line, path=path)

    def scale(self, axis: str) -> float:
        """The unit of the words of an axis, mm or degree."""
        return self.unit if axis in "XYZUVW" else 1.0

    def target(self, words: Mapping[str, TextWord], machine: bool = False) -> dict[str, float]:
        """The positions to which words lead, `machine`: in machine coordinates; marks axes that the program sets."""
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
        """The step of a line that ends at `end`; `why`: the reason why it cannot be followed, if there is one."""
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
        why = "" if self.plane == 17 and not self.counting else "a drilling cycle that this reader does not know"
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
                self.lost["jumps"] = JUMPS
            case None:
                self.lost["M"] = "an M code is a formula"
            case _:
                pass

    def choose_edge(self, number: float | None) -> None:
        """D of SINUMERIK: puts the length of the tool in force; with T0 or D0, none."""
        self.new_length(self.length_of(self.tool) if number and self.tool else 0.0)

    def new_length(self, length: float | None) -> None:
        """Put a tool length in force in coordinates; it lies along Z of the machine, however they are turned."""
        before, self.length, self.between = self.length, length, False
        if self.turn is not None and not self.tcp and self.turn.rotation[2, 2] != 1.0:
            place = self.turn.commands(np.array([[*self.at.values()]]))[0]
            longer = np.array([0.0, 0.0, NAN if before is None or length is None else length - before])
            self.turn = replace(self.turn, zero=self.turn.zero + longer, origin=self.turn.origin + longer)
            self._stand_at(self.turn.numbers(place), self.turn)
        self.unsay("Z" if not self.tcp or (self.turn is not None and self.is_square()) else "XYZ")


def _stops(flags: Mask) -> list[int]:
    """For each true flag, the end of the run of true flags in which it stands; for others, their own index."""
    n = len(flags)
    others = np.where(flags, n, np.arange(n))
    found: list[int] = np.minimum.accumulate(others[::-1])[::-1].tolist()
    return found
