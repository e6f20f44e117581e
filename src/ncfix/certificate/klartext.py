"""The second reader: the effect of the blocks of Klartext."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

import numpy as np

from ncfix.certificate.following import INCH, NO_POLE, AxisFollower
from ncfix.certificate.holes import HoleCall, assign
from ncfix.certificate.reading import AXES, DECIMAL, RETRACTS, TextLine, TextWord
from ncfix.certificate.steps import NAN, AxisStep, Kind, ProgramSteps
from ncfix.certificate.text import Text
from ncfix.certificate.turning import PlaneBlock, about

HOLES = re.compile(r"CYCL DEF (20[0-35-79]|24[01])\b")
"""Drilling cycles whose bottom is Q203 + Q201."""
FRAMES = re.compile(r"CYCL DEF (?:7|8|9|10|11|13|19|26)\b|PLANE|TRANS|FUNCTION")
"""Lines that this reader does not follow, but behind which a correction keeps the form of blocks."""


TRANSFORMS = re.compile(r"CYCL DEF (7|10)\.[1-9][ \t]*(.*)")
TRANSFORM_WORD = re.compile(rf"(I?(?:[XYZ]|ROT))[ \t]*({DECIMAL})(?![\d.,])")
DATUM = re.compile(r"Q339 ?= ?\+?(\d+)[ \t]*(?:[;~]|$)")
"""The datum number of CYCL DEF 247."""
TOOL = re.compile(r'TOOL CALL (?:(\d+)|"([^"]*)")')
SPEED = re.compile(r"TOOL CALL (?:Z )?[SF][\d ]")
"""TOOL CALL without a tool, for another speed or feed."""
OVERSIZE = re.compile(rf"\bDL ?(?:({DECIMAL})(?![\d.,])|[+-]?Q|.)")
"""The oversize of the tool length in TOOL CALL."""


GOES_ON = re.compile(rb"~[ \t]*\n(?![ \t]*Q)", re.IGNORECASE)
"""A block that continues in a line that is no parameter of a cycle."""


class KlartextFollower(AxisFollower):
    """Follows Klartext.

    datum     CYCL DEF 247 has begun, and its datum number is still to come
    drilling  number of the drilling cycle that is defined; 0: none
    oversize  oversize of the tool length (DL) in the last tool call, mm
    """

    datum = False
    drilling = 0
    oversize = 0.0

    def run(self, text: Text, turn: int | None = None) -> ProgramSteps:
        """Follow the lines of a program, as `AxisFollower` says."""
        if GOES_ON.search(text.source):
            self.lose("a block goes on in the next line (~)", rewritten=True)
        return super().run(text, turn)

    def block(self, row: int, line: TextLine) -> AxisStep | None:
        """The step of one line; None if it moves nothing."""
        if line.plain and line.path and not self.lost and not self.shortest and self._leads_straight(line):
            return self.straight(row, line)
        lead = line.codes[0].name if line.codes else ""
        if line.odd:
            return self._odd(row, line, lead)
        if lead.startswith("CYCL CALL"):
            return self._hole(row, line, dict(self.at))
        if self._took_statement(lead):
            return None
        self._klartext_words(line)
        line = self.settled(line)
        words = {word.name: word for word in line.path if word.name in AXES}
        if lead == "CC":
            self._set_pole(words)
            return None
        if not words and line.word("PA") is None:
            return None
        machine = [word.value for word in line.codes if word.name == "M" and word.value in (91, 92)]
        if machine:
            return self._fixed(row, line, words, self.given.references.get("M92", {}) if 92 in machine else None)
        return self._path(row, line, lead, words)

    def _odd(self, row: int, line: TextLine, lead: str) -> AxisStep | None:
        """The step of a line that cannot be parsed; behind M140, an axis is followed again once it gets a position."""
        if line.odd is not RETRACTS and line.rest.strip():
            self.lose(line.odd, rewritten=not FRAMES.match(lead))
        if line.odd is not RETRACTS and not line.path:
            return None
        return self.step(row, Kind.FEED, dict(self.at), line, line.odd)

    def _fixed(
        self, row: int, line: TextLine, words: Mapping[str, TextWord], zero: Mapping[str, float] | None
    ) -> AxisStep:
        """The step of a motion in machine coordinates; with M92, relative to `zero`, as far as that is given."""
        end = self.target(words, machine=True)
        if zero is not None:
            end |= {axis: end[axis] + zero.get(axis, NAN) for axis in words if axis in end}
        if self.tcp or self.turn is not None:
            end |= dict.fromkeys("XYZ", NAN)
        step = self.step(row, Kind.FIXED, end, line)
        self.unsay(tuple(words))
        return step

    def _took_statement(self, lead: str) -> bool:
        """Apply a line about tools, units, coordinates, parameters or TCP; False for any other line."""
        if lead.startswith("TOOL CALL"):
            self._call_tool(lead)
        elif lead.startswith(("CYCL DEF 247", "Q339")):
            self._set_datum(lead)
        elif lead.startswith("FUNCTION TCPM F"):
            self.by_vector = "VECTOR" in lead
            self.lead(True)
        elif lead.startswith("FUNCTION RESET TCPM"):
            self.lead(False)
        elif lead.startswith("BEGIN PGM"):
            self.unit = INCH if lead.endswith("INCH") else 1.0
        elif lead.startswith("PLANE"):
            self._tilt(lead)
        elif found := TRANSFORMS.match(lead):
            self._transform(*found.groups())
        elif lead in ("M128", "M129"):
            self.by_vector = False
            self.lead(lead == "M128")
        elif lead.startswith(("CYCL DEF 2", "FN", "Q")):
            if found := HOLES.match(lead):
                self.drilling = int(found[1])
            assign(lead, self.variables)
        else:
            return lead.startswith(
                ("BLK FORM", "END PGM", "TOOL DEF", "LBL ", "CYCL DEF 32", "CYCL DEF 7.0", "CYCL DEF 10.0")
            )
        return True

    def _tilt(self, lead: str) -> None:
        """Apply PLANE SPATIAL or RESET: begin a tilted plane, or end it; with TURN and MOVE the rotary axes turn."""
        plane = PlaneBlock.of(lead)
        if plane is None or (self.turn is not None and not self.turn.tilted):
            self.lose("a plane that the second reader does not know")
            return
        turning = [axis for axis in self.axes if axis in "ABC"]
        rotation = np.eye(3) if plane.rotation is None else plane.rotation
        if plane.rotation is None and self.turn is None and plane.positions == "STAY":
            return
        home = plane.rotation is None and plane.positions != "STAY"
        around = plane.table and rotation[2, 2] == 1.0 and rotation[0, 0] != 1.0
        way = self.square_to(rotation, sign=plane.sign, inside=True, stays=False)
        if home or around:
            unshifted = home and not any(self.offset(axis) for axis in turning)
            way = dict.fromkeys(turning, 0.0 if unshifted else NAN)
        self.variables |= {f"Q{120 + 'ABC'.index(axis)}": value for axis, value in way.items()}
        if plane.rotation is None:
            self.end_turn()
        else:
            self.begin_turn(rotation, tilted=True)
        if plane.positions != "STAY":
            self.at |= way
            self.said |= dict.fromkeys(way, False)
            self.forget_place()

    def _transform(self, cycle: str, text: str) -> None:
        """Apply a line of cycle 7, a datum shift, or of cycle 10, a rotation about the datum."""
        numbers = TRANSFORM_WORD.findall(text)
        if self.lost or self.tcp or "".join(map("".join, numbers)) != re.sub(r"[ \t]", "", text.partition(";")[0]):
            self.lose(f"cycle {cycle} in a form that the second reader does not know")
        elif cycle == "10" and "I" not in text:
            self.end_turn()
            if numbers and float(numbers[-1][1].replace(",", ".")):
                self.begin_turn(about("Z", float(numbers[-1][1].replace(",", "."))), tilted=False)
        elif self.turn is not None or any("ROT" in name for name, _ in numbers):
            self.lose(f"cycle {cycle} in rotated coordinates")
        else:
            for name, number in numbers:
                counted, axis = name.startswith("I"), name[-1]
                value = float(number.replace(",", ".")) * self.scale(axis)
                self.shifts[axis] = value + (self.shifts.get(axis, 0.0) if counted else 0.0)
            self.unsay()

    def _call_tool(self, lead: str) -> None:
        found, more = TOOL.match(lead), OVERSIZE.search(lead)
        if (more and more[1] is None) or not (found or more or (SPEED.match(lead) and not self.oversize)):
            self.lose("a tool call without a tool or an oversize that the second reader knows")
        elif found or more:
            if found:
                self.tool = int(found[1]) if found[1] else found[2]
            if self.tcp:
                self.lose("another tool under tool-centre-point control (M128, TCPM)")
            self.oversize = float(more[1].replace(",", ".")) * self.unit if more else 0.0
            self.new_length(self.length_of(self.tool))
            self.unsay()

    def length_of(self, tool: int | str) -> float | None:
        """The length of a tool with its oversize, mm; None if it is not given."""
        length = super().length_of(tool)
        return None if length is None else length + self.oversize

    def _set_datum(self, lead: str) -> None:
        """Apply CYCL DEF 247; its datum number may stand in the next line."""
        found = DATUM.search(lead)
        if found and (self.datum or lead.startswith("CYCL")):
            self.system = f"PRESET{found[1]}"
            self.unsay()
        self.datum = found is None and lead.startswith("CYCL")

    def _path(self, row: int, line: TextLine, lead: str, words: Mapping[str, TextWord]) -> AxisStep:
        """The step of a path function."""
        turn, keys = line.word("PA"), {word.name for word in line.codes}
        if lead == "LN":
            step = self.step(row, Kind.FEED, dict(self.at), line, "a surface normal or a tool direction (LN)")
            step.foreign = True
            return step
        if lead not in ("L", "C", "CR", "CP") or (lead == "CP") != (turn is not None):
            return self.step(row, Kind.FEED, dict(self.at), line, f"{lead} is not known to the second reader")
        self.kind = Kind.RAPID if "FMAX" in keys else Kind.FEED
        end = self.target({k: v for k, v in words.items() if k in self.at})
        if turn is not None:
            end |= self._turned_about_pole(turn)
        if any(word.name == "M" and word.value == 99 for word in line.codes):
            return self._hole(row, line, end)
        step = self.step(row, self.kind, end, line)
        if lead == "L" or step.why:
            return step
        if keys.isdisjoint(("DR+", "DR-")):
            step.why = "an arc without its direction (DR)"
            return step
        if lead != "CR":
            return self._arc_about_pole(step, turn, "DR-" in keys)
        radius = line.word("R")
        if radius is not None and radius.value is not None:
            return step.lead_round(self.axes, self.plane, {}, "DR-" in keys, radius.value * self.unit)
        step.why = "an arc without a radius"
        return step

    def _hole(self, row: int, line: TextLine, over: dict[str, float]) -> AxisStep:
        """The step of a hole by the defined drilling cycle, over a place."""
        call = HoleCall.of_parameters(self.drilling, self.variables)
        step = self.called_hole(row, line, over, call)
        if not self.drilling or math.isnan(call.bottom):
            step.why, step.foreign = step.why or "a drilling cycle not known to the second reader", True
        return step

    def _arc_about_pole(self, step: AxisStep, turn: TextWord | None, clockwise: bool) -> AxisStep:
        """The step of an arc about the pole: C to a place, or CP by an angle, which may be more than a turn."""
        if any(math.isnan(self.pole.get(axis, NAN)) for axis in "XY"):
            step.why = NO_POLE
            return step
        step = step.lead_round(self.axes, self.plane, self.pole, clockwise, None)
        if turn is not None and turn.value is not None:
            step.sweep = math.radians(turn.value)
            step.why = step.why or ("a helix of more than a turn" if abs(turn.value) > 360.0 else "")
        return step

    def _leads_straight(self, line: TextLine) -> bool:
        """Whether a line is only a straight motion; if so, its kind and feed are applied."""
        for name, *_ in line.path:
            if name not in self.at:
                return False
        kind, feed = Kind.FEED, self.feed
        for name, _, value, _ in line.codes[1:]:
            if name == "F":
                feed = value
            elif name == "FMAX":
                kind = Kind.RAPID
            else:
                return False
        self.kind, self.feed = kind, feed
        return True

    def _turned_about_pole(self, turn: TextWord) -> dict[str, float]:
        """The end, in the plane, of a turn about the pole."""
        x, y = self.pole.get("X", NAN), self.pole.get("Y", NAN)
        if turn.value is None or turn.counted != "+" or not {"X", "Y"} <= set(self.at):
            return dict.fromkeys(("X", "Y"), NAN)
        angle, dx, dy = math.radians(turn.value), self.at["X"] - x, self.at["Y"] - y
        cos, sin = math.cos(angle), math.sin(angle)
        return {"X": x + cos * dx - sin * dy, "Y": y + sin * dx + cos * dy}

    def _klartext_words(self, line: TextLine) -> None:
        for word in line.codes:
            if word.name == "F":
                self.feed = word.value
            elif word.name in ("FQ", "FAUTO", "F AUTO"):
                self.feed = None
            elif word.name in ("RL", "RR"):
                self.beside = True
            elif word.name == "R0":
                if self.beside:
                    self.unsay()
                self.beside = False
            elif word.name == "M":
                match word.value:
                    case 128 | 129:
                        self.by_vector = False
                        self.lead(word.value == 128)
                    case 126 | 127:
                        self.shortest = word.value == 126
                    case 0 | 1 | 2 | 3 | 4 | 5 | 6 | 7 | 8 | 9 | 13 | 14 | 30 | 91 | 92 | 99 | 107 | 108 | 120:
                        self.auxiliary(word)
                    case _:
                        self.lose_by(f"M{word.number}")

    def _set_pole(self, words: Mapping[str, TextWord]) -> None:
        if set(words) - {"X", "Y"}:
            self.lose("a pole in another plane")
        said = dict(self.said)
        target = self.target(words)
        self.said = said
        self.pole = {axis: target[axis] if words else self.at[axis] for axis in "XY" if axis in self.at}
        if words and len(words) < 2:
            self.pole = dict.fromkeys(self.pole, NAN)
