"""The second reader: the effect of the words of word addresses and SINUMERIK."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

from ncfix.certificate.coordinates import Given
from ncfix.certificate.following import (
    CENTRES,
    INCH,
    NO_CENTRE,
    UNKNOWN_WORDS,
    AxisFollower,
)
from ncfix.certificate.formulas import value_of, variable_name
from ncfix.certificate.holes import HoleCall
from ncfix.certificate.klartext import KlartextFollower
from ncfix.certificate.model import TipModel
from ncfix.certificate.reading import AXES, CYCLE_CALL, Family, TextLine, TextWord
from ncfix.certificate.steps import NAN, PLANES, AxisStep, Kind
from ncfix.certificate.turning import SwivelCall, turned

QUIET = frozenset((51, 80, 90, 150, 501, 600, 610, 611, 620, 640, 800, 911, 960, 970, 980, 990)) | frozenset(
    (4500, 4510, 6010, 6020, 6030, 6410, 6420, 6430, 6440, 6450)
)
"""G codes, in tenths, that move nothing and change no coordinates, or are handled elsewhere."""
WORDS_QUIET = re.compile(
    r"MSG|SETMS|ORI(WKS|MKS|AXES|VECT|VIRT1)|SOFT|BRISK|DRIVE|FFWO(N|F)|COMP(OF|CAD|ON)|CFC|CFTCP|CFIN|"
    r"FNORM|FLIN|SUPA|ADIS|ADISPOS|CYCLE832|WALIMO(N|F)|STOPRE|PTP|CP|UPATH|SPOS|KONT|NORM"
)
"""Words of SINUMERIK that move nothing and change no coordinates."""
DECLARES = frozenset(("DEF", "EXTERN"))
STORED_CYCLES, OF_THE_CONTROL = 10001, 2000
"""Least P of G5 that moves axes, by data in the control, and least number of a variable that may be the control's."""
SINGLE = frozenset("GNFSTDMHPLEQO")
"""Letters of words that are handled, or have no effect here."""


class WordAddressFollower(AxisFollower):
    """Follows word addresses and SINUMERIK."""

    def block(self, row: int, line: TextLine) -> AxisStep | None:
        """The step of one line; None if it moves nothing."""
        if line.plain and line.path and not self.lost and self.modal_call is None and self._leads_straight(line):
            return self.straight(row, line)
        if self.family is Family.SINUMERIK:
            for word in line.codes:
                if re.fullmatch(CYCLE_CALL, word.name):
                    return self._call(row, line, word.name)
        elif line.codes and line.codes[-1].name.startswith("#"):
            self._give(line.codes[-1])
            return None
        if line.odd and "=" in line.rest:
            self.variables.clear()
        line = self.settled(line)
        codes = [round(10 * word.value) for word in line.codes if word.name == "G" and word.value is not None]
        if line.odd and (codes or line.path):
            self.lose(line.odd, rewritten=True)
        if self._smooths(line, codes) or self._changed_coordinates(line, codes):
            return None
        apart, fixed = self._modes(line, codes)
        words = {word.name: word for word in line.path if word.name in AXES}
        if apart:
            moves = line.path and apart != "dwell"
            return self.step(row, Kind.FIXED, dict(self.at), line, apart) if moves else None
        if fixed:
            return self._fixed(row, line, words, codes)
        return self._motion(row, line, words) if line.path else None

    def _motion(self, row: int, line: TextLine, words: Mapping[str, TextWord]) -> AxisStep:
        """The step of a line with a path, by the kind of motion in force."""
        if not words and self.kind is not Kind.ARC:
            self.lose(UNKNOWN_WORDS, rewritten=True)
            return self.step(row, Kind.FEED, dict(self.at), line, UNKNOWN_WORDS)
        if self.kind is None:
            return self.step(row, Kind.FEED, dict(self.at), line, "which motion this is")
        if self.kind is Kind.HOLE:
            return self._hole(row, line, words)
        arc = self.kind is Kind.ARC
        if self.modal_call is not None:
            return self._hole_after(row, line, words, self.modal_call)
        if len(line.path) > len(words) and not arc:  # such as R or RND
            return self.step(row, self.kind, dict(self.at), line, UNKNOWN_WORDS)
        start = dict(self.at)
        step = self.step(row, self.kind, self.target({k: v for k, v in words.items() if k in self.at}), line)
        return self._arc_of_words(step, line, start) if arc and not step.why else step

    def _call(self, row: int, line: TextLine, cycle: str) -> AxisStep | None:
        """A line with a drilling cycle: a hole where the axes stand, or, with MCALL, one behind each later motion."""
        names = [word.name for word in line.codes if word.name != "N"]
        call = HoleCall.of_arguments(cycle)
        if call is not None and names == ["MCALL", cycle] and not line.path:
            self.modal_call = call
        elif call is not None and names == [cycle] and not line.path and self.modal_call is None:
            return self.called_hole(row, line, dict(self.at), call)
        else:
            self.foreign.add(row)
            self.lose("a drilling cycle not known to the second reader", rewritten=True, modal=True)
        return None

    def _hole_after(self, row: int, line: TextLine, words: Mapping[str, TextWord], call: HoleCall) -> AxisStep:
        """The step of a motion that is followed by a modal drilling cycle."""
        if self.kind is Kind.ARC or len(line.path) > len(words):
            step = self.step(row, Kind.HOLE, dict(self.at), line, UNKNOWN_WORDS)
            step.foreign = True
            return step
        return self.called_hole(row, line, self.target({k: v for k, v in words.items() if k in self.at}), call)

    def _give(self, word: TextWord) -> None:
        """Assign a value to a variable; one with a high number belongs to the control."""
        name = variable_name(word.name)
        self.variables[name] = value_of(word.number, self.variables)
        if name[1:].isdecimal() and int(name[1:]) >= OF_THE_CONTROL:
            self.lose("the program sets a variable of the control")

    def _smooths(self, line: TextLine, codes: Sequence[int]) -> bool:
        """Whether a line only sets the smoothing of the path, and its axes (G5.1 Q2 X0 Y0)."""
        own = {word.name for word in line.codes}
        if self.family is not Family.WORDS or line.odd:
            return False
        ahead = codes == [1870] or (codes == [50] and (line.code("P") or 0.0) < STORED_CYCLES)
        return (codes == [51] and "Q" in own) or (ahead and not line.path)

    def _changed_coordinates(self, line: TextLine, codes: Sequence[int]) -> bool:
        """Apply a line that only shifts or turns the coordinates, by plain numbers; False if it does not."""
        values = {word.name: word.value for word in line.path if word.value is not None and not word.counted}
        if len(values) < len(line.path) or self.lost or line.odd or self.beside:
            return False
        names = [word.name for word in line.codes if word.name != "N"]
        if self.family is Family.SINUMERIK:
            return self._shifted_frame(names, values) or self._turned_frame(line, names, values)
        return self._shifted(line, codes, values) or self._turned(names, codes, values)

    def _shifted(self, line: TextLine, codes: Sequence[int], values: Mapping[str, float]) -> bool:
        """Apply G52, G92 or G92.1 without other G or M codes; False for any other line."""
        if [word.name for word in line.codes if word.name not in "NTSF"] != ["G"]:
            return False
        if self.tcp or self.turn is not None or self.counting or not values.keys() <= self.at.keys():
            return False
        numbers = {axis: value * self.scale(axis) for axis, value in values.items()}
        match codes:
            case [520] if numbers and not any(self.shifts.get(axis) for axis in numbers):
                self.local |= numbers
            case [920] if numbers and not any(math.isnan(self.at[axis]) for axis in numbers):
                for axis, value in numbers.items():
                    self.local[axis] = self.shifts[axis] = 0.0  # the place gets this number, whatever was in force
                    self.shifts[axis] = self.at[axis] - value - self.offset(axis)
                self.unsay(tuple(numbers))
            case [921] if not numbers and not any(self.local.values()):
                self.shifts = {}
                self.unsay()
            case _:
                return False
        self._other_words(line)
        return True

    def _shifted_frame(self, names: Sequence[str], values: Mapping[str, float]) -> bool:
        """Apply TRANS, which replaces all shifts and turns except a tilted plane, or ATRANS, which adds a shift."""
        tilted = self.turn is not None and self.turn.tilted
        if self.counting or (self.tcp and not tilted) or not values.keys() <= self.at.keys():
            return False
        numbers = {axis: value * self.scale(axis) for axis, value in values.items()}
        match names:
            case ["TRANS"]:
                if not tilted:
                    self.end_turn()
                self.shifts = numbers
            case ["ATRANS"]:
                self.shifts |= {axis: self.shifts.get(axis, 0.0) + number for axis, number in numbers.items()}
            case _:
                return False
        return True

    def _turned(self, names: Sequence[str], codes: Sequence[int], values: Mapping[str, float]) -> bool:
        """Apply G68 in its plane, G68.2 or G53.1 without other words; False for any other line."""
        if names != ["G"] * len(codes):
            return False
        match sorted(codes):
            case [680] | [170, 680] | [680, 900] if not self.counting and self.turn is None:
                one, two, up = PLANES[self.plane]
                if values.keys() != {"R", one, two} or (170 in codes and self.plane != 17):
                    return False
                centre = {axis: self.offset(axis) + values[axis] * self.unit for axis in (one, two)}
                self.begin_turn_about(turned((up, values["R"])), centre)
            case [682] if values.keys() <= {*"XYZIJK"}:
                turns = zip("ZXZ", (values.get(letter, 0.0) for letter in "IJK"), strict=True)
                self.begin_turn(turned(*turns), [values.get(axis, 0.0) * self.unit for axis in "XYZ"], tilted=True)
            case [531] if not values and self.turn is not None and self.turn.tilted:
                self.at |= self.square_to(self.turn.rotation)
                self.forget_place()
            case _:
                return False
        return True

    def _turned_frame(self, line: TextLine, names: Sequence[str], values: Mapping[str, float]) -> bool:
        """Apply ROT, AROT or CYCLE800; False for any other line, and for forms that this reader does not know."""
        angle = line.code("RPL")
        match sorted(names):
            case ["ROT" | "AROT" as name] if values.keys() <= {*"XYZ"}:
                return self._turn_on(name, [(axis, values.get(axis, 0.0)) for axis in "ZYX"])
            case ["ROT" | "AROT" as name, "RPL"] | ["RPL", "ROT" as name] if not values and angle is not None:
                return self._turn_on(name, [(PLANES[self.plane][2], angle)])
            case [call] if call.startswith("CYCLE800(") and not values and not any(self.shifts.values()):
                return self._swivel(call)
            case _:
                return False

    def _turn_on(self, name: str, turns: Sequence[tuple[str, float]]) -> bool:
        """Apply ROT, which replaces all shifts and turns, or AROT, which adds a turn to shifts."""
        if self.tcp or (name == "AROT" and self.turn is not None):
            return False
        if name == "ROT":
            self.end_turn()
            self.shifts = {}
        if any(angle for _, angle in turns):
            self.begin_turn(turned(*turns), tilted=False)
        return True

    def _swivel(self, call: str) -> bool:
        """Apply CYCLE800: begin a tilted plane, or end it; False for forms that this reader does not know."""
        if self.turn is not None and not self.turn.tilted:
            return False
        if re.match(r'CYCLE800\([^,]*,[ \t]*"0"', call):
            self.forget_place()
            self.end_turn()
            return True
        found = SwivelCall.of(call)
        if found is None:
            return False
        self.begin_turn(found.rotation, (found.origin * self.unit).tolist(), tilted=True)
        if self.turn is not None:
            self.at |= self.square_to(found.rotation, sense=found.sense)
            self.forget_place()
        return True

    def _leads_straight(self, line: TextLine) -> bool:
        """Whether a line is only a straight motion; if so, its kind and feed are applied."""
        kind, feed = self.kind, self.feed
        for name, _, value, _ in line.codes:
            if name == "G" and (value == 0 or value == 1):
                kind = Kind.FEED if value else Kind.RAPID
            elif name == "F":
                feed = value
            elif name != "N":
                return False
        if kind is not Kind.RAPID and kind is not Kind.FEED:
            return False
        for name, *_ in line.path:
            if name not in self.at:
                return False
        self.kind, self.feed = kind, feed
        return True

    def _arc_of_words(self, step: AxisStep, line: TextLine, start: Mapping[str, float]) -> AxisStep:
        radius = line.word("R") or line.word("CR")
        one, two, _ = PLANES[self.plane]
        centre = {}
        for axis in (one, two):
            word = line.word(CENTRES[axis])
            value = 0.0 if word is None or word.value is None else word.value * self.unit
            absolute = word is not None and word.counted == "="
            centre[axis] = (self.offset(axis) if absolute else start[axis]) + value
        if line.code("P") is not None:
            step.why, step.foreign = UNKNOWN_WORDS, True
        elif any(word.name in ("AR", "AP", "RP", "I1", "J1", "K1", "TURN") for word in line.path):
            step.why = UNKNOWN_WORDS
        elif radius is None and not any(word.name in "IJK" for word in line.path):
            step.why = NO_CENTRE
        if step.why:
            return step
        size = None if radius is None or radius.value is None else radius.value * self.unit
        return step.lead_round(self.axes, self.plane, centre, self.clockwise, size)

    def _modes(self, line: TextLine, codes: Sequence[int]) -> tuple[str, bool]:
        """Apply the codes of a block. Returns why its motion is unknown to this reader ("": it is known), and whether
        it is in machine coordinates or to a reference point.
        """
        apart, fixed, length_set = "", False, False
        self._other_words(line)
        if self.family is Family.WORDS and self._doubts_length(line, codes):
            self.lose("H0, H without G43, or G43 without H behind another tool")
        for code in codes:
            match code:
                case 40:
                    apart = "dwell"
                case 530 | 1530:
                    fixed = True
                case 280 | 300 if self.family is Family.WORDS:
                    fixed = True
                case 540 if self._is_extended(line, codes):
                    self.lose_by("G54 with P")
                case 430 | 434 if self.family is Family.WORDS:
                    length_set = True
                    self._length_offset(line, code == 434)
                case _ if self._took_mode(code) or self._took_system(code) or self._took_cycle(code) or code in QUIET:
                    pass
                case _:
                    self.lose_by(f"G{code / 10:g}")
                    apart = apart or f"G{code / 10:g} is not known to the second reader"
        if self.tcp and not length_set and any(code in (540, 550, 560, 570) for code in codes):
            self.unsay("XYZ")
        return apart, fixed or any(word.name == "SUPA" for word in line.codes)

    def _doubts_length(self, line: TextLine, codes: Sequence[int]) -> bool:
        """Whether a line selects a tool length in a way that differs from control to control."""
        number, sets = line.code("H"), not {430, 434, 435, 440}.isdisjoint(codes)
        if number is None:
            return sets and self.last_length not in (None, self.tool)
        return (number == 0 or not sets) and 490 not in codes

    def _is_extended(self, line: TextLine, codes: Sequence[int]) -> bool:
        """Whether G54 is an additional work offset, G54.1 Pn: its P belongs to no other code."""
        return self.family is Family.WORDS and line.code("P") is not None and line.code("M") is None and 40 not in codes

    def _took_mode(self, code: int) -> bool:
        """Apply a code of motion, plane, unit, distance, feed or cutter compensation; False for any other code."""
        match code:
            case 0 | 10 | 20 | 30:
                self.kind = (Kind.RAPID, Kind.FEED, Kind.ARC, Kind.ARC)[code // 10]
                self.clockwise = code == 20
            case 170 | 180 | 190:
                self.plane = code // 10
            case 200 | 210 | 700 | 710 | 7000 | 7100:
                if code in (700, 710) and self.family is Family.WORDS:
                    self.lose_by(f"G{code / 10:g}")
                self.unit = INCH if code in (200, 700, 7000) else 1.0
            case 900 | 910:
                self.counting = code == 910
            case 930 | 940 | 950:
                self.feed_mode = code // 10
            case 400 | 410 | 420:
                self.beside = code != 400
                if not self.beside:
                    self.unsay()
            case _:
                return False
        return True

    def _took_system(self, code: int) -> bool:
        """Apply a code of a work offset, G69 or G49; False for any other code."""
        match code:
            case 540 | 550 | 560 | 570 | 580 | 590 if self.family is Family.WORDS or code < 580:
                self._system(f"G{code // 10}")
            case 5000:
                self._system("G500")
            case 690:
                self.end_turn()
            case 490 if self.family is Family.WORDS:
                self.lead(False)
                self.new_length(0.0)
            case _:
                return False
        return True

    def _took_cycle(self, code: int) -> bool:
        """Apply a code of drilling cycles; False for any other code."""
        match code:
            case 730 | 740 | 810 | 820 | 830 | 840 | 850 | 860 | 870 | 880 | 890 if self.family is Family.WORDS:
                if self.kind != Kind.HOLE:
                    self.cycle = {}
                    self.before_cycle, self.said_before = self.at.get("Z", NAN), self.said.get("Z", False)
                self.kind = Kind.HOLE
            case 800 if self.family is Family.WORDS:
                self.kind = None if self.kind == Kind.HOLE else self.kind
            case 980 | 990:
                self.returns_to_level = code == 990
            case _:
                return False
        return True

    def _other_words(self, line: TextLine) -> None:
        """Apply the words that are neither G codes nor words of axes."""
        if any(word.name in DECLARES for word in line.codes):
            return
        for word in line.codes:
            match word.name:
                case "G" if word.value is None:
                    self.lose("a G code is a formula")
                case "F":
                    self.feed = word.value
                case "T":
                    self.next_tool = word.number.strip('"').upper() if word.value is None else int(word.value)
                    if self.family is Family.SINUMERIK:
                        self.tool = self.next_tool  # put into the spindle; its length acts at once if one is in force
                        self.choose_edge(1)
                        self.unsay()
                case "D" if self.family is Family.SINUMERIK:
                    self.choose_edge(word.value)
                case "M":
                    self.auxiliary(word)
                case "TRAORI" | "TRAFOOF" as name:
                    self.lead(name == "TRAORI")
                    self.unsay()
                case "CYCLE800()" if not any(self.shifts.values()):
                    if self.turn is None or self.turn.tilted:
                        self.end_turn()
                    else:
                        self.lose("CYCLE800 in rotated coordinates")
                case "MCALL":
                    self._modal_call(alone=[other.name for other in line.codes if other.name != "N"] == ["MCALL"])
                case name if len(name) > 1:
                    self._sinumerik_word(word)
                case name if name not in SINGLE:
                    self.lose_by(name)

    def _modal_call(self, alone: bool) -> None:
        """MCALL: alone it ends the modal call, also one that this reader could not follow."""
        if alone:
            left = dict.fromkeys(loss for loss in self.lost if not loss.modal)
            if len(left) < len(self.lost):
                self.forget()
            self.lost, self.modal_call = left, None
        else:
            self.lose("a modal call", rewritten=True, modal=True)
            self.modal_call = None

    def _sinumerik_word(self, word: TextWord) -> None:
        """Apply an assignment to a variable, or a word of SINUMERIK."""
        known = self.variables
        known[word.name] = value_of(word.number, known) if word.value is None and word.number else word.value
        name = word.name.partition("(")[0].strip()
        if not word.number and not WORDS_QUIET.fullmatch(name) and not name.startswith(("%", "_N_", "$")):
            self.lose_by(name)

    def _system(self, name: str) -> None:
        if name != self.system:
            self.system = name
            if self.turn is not None:
                self.lose("another work offset in rotated coordinates")
        self.unsay()

    def _length_offset(self, line: TextLine, tcp: bool) -> None:
        number = line.code("H")
        tool = int(number) if number is not None else self.tool
        self.last_length = self.last_length if number is None else int(number)
        if any(word.name == "H" and word.value is None for word in line.codes):
            self.lose("a length offset is a formula")
        if self.turn is not None and self.turn.tilted:
            self.forget_place("XY" if self.is_square() else "")  # the tip moves along the tool
        elif self.tcp and (tcp or self.given.tcp):
            self.at.update(dict.fromkeys("XYZ", NAN))  # with another tool, the same place has other numbers
        self.tool, self.between = tool, False
        self.lead(tcp)
        self.new_length(self.length_of(tool))

    def _fixed(self, row: int, line: TextLine, words: Mapping[str, TextWord], codes: Sequence[int]) -> AxisStep:
        """A motion in machine coordinates, or to a reference point."""
        named = {axis: word for axis, word in words.items() if axis in self.at}
        if 280 in codes or 300 in codes:
            name = "G28" if 280 in codes else "G30" if line.code("P") in (None, 2.0) else ""
            point = self.given.references.get(name, {})
            end = dict(self.at)
            for axis in named or self.axes:
                end[axis] = point.get(axis, NAN)
        else:
            end = self.target(named, machine=True)
        if self.tcp or self.turn is not None:
            end |= dict.fromkeys("XYZ", NAN)
        step = self.step(row, Kind.FIXED, end, line)
        self.unsay(tuple(named) or self.axes)
        if 280 in codes and self.given.reference_ends_length:
            self.lead(False)
            self.new_length(0.0)
        return step

    def _hole(self, row: int, line: TextLine, words: Mapping[str, TextWord]) -> AxisStep:
        """The step of a hole by a drilling cycle of word addresses: in G17, with absolute words."""
        if self.counting or self.plane != 17 or line.code("K") or line.code("L") or line.word("I") or line.word("K"):
            step = self.step(row, Kind.HOLE, dict(self.at), line, "a drilling cycle not known to the second reader")
            step.foreign = True  # a correction may write a repeated one out
            return step
        for name in "ZR":
            word = line.word(name)
            if word is not None:
                depth = NAN if word.value is None else word.value * self.unit
                self.cycle[name] = self.offset("Z") + depth
        over = self.target({axis: word for axis, word in words.items() if axis in self.at and axis != "Z"})
        bottom = {**over, "Z": self.cycle.get("Z", NAN)}
        self.said["Z"] = True
        step = self.step(row, Kind.HOLE, bottom, line)
        level = self.cycle.get("R", NAN)
        back = level
        if not self.returns_to_level and not level >= self.before_cycle:
            # until G98 or G99 is programmed, each control has its own way back
            back = NAN if self.returns_to_level is None else self.before_cycle
        if not step.why and not math.isnan(level):
            zero = self.offset("Z")
            begin, deep, after = ((place - zero) / self.unit for place in (level, bottom["Z"], back))
            self.calls[row] = HoleCall("", (begin,), {0: 1}, deep, after)
        self.at = {**bottom, "Z": back}
        self.said["Z"] = self.said_before or back != self.before_cycle
        return step


def follower_of(family: Family, axes: Sequence[str], given: Given, model: TipModel | None) -> AxisFollower:
    """The follower for programs of a family."""
    kind = KlartextFollower if family is Family.KLARTEXT else WordAddressFollower
    return kind(axes, family, given, model)
