"""A Renishaw `.rtl`: how far a linear axis is from its targets, run by run.

No text of the maker describes the format; public readers and writers agree on its sections and keys: `Targets` in mm,
over as many lines as it takes, until the next key; lines of run, target and deviation in micrometres. Which error was
measured is not in the file, but for its free texts: it is read as positioning, and refused where they say otherwise.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ncfix.diagnostics import ConfigError, Place

SECTION = re.compile(r"([A-Z][A-Z -]*)::")
KEY = re.compile(r"([A-Za-z][\w -]*?)\s*:(.*)")
LETTER = re.compile(r"(?:axis\b\s*)?([a-z])(?:[\s_-]*(?:axis|achse)?)", re.IGNORECASE)
OTHER = re.compile(r"straight|square|angular|flatness|diagonal|(?<![a-z])(?:pitch|yaw|roll)(?![a-z])", re.IGNORECASE)
"""Words of a title that speak of another error than positioning."""
ROTARY = "ABC"
MICROMETRE = 1e-3


@dataclass(frozen=True, slots=True)
class Reading:
    """One deviation: run and target from 1, mm, and the line of the file."""

    run: int
    target: int
    value: float
    line: int


@dataclass(slots=True)
class Rtl:
    """What stands in a file: texts of its keys with their lines, the targets (mm), and the readings."""

    path: str
    texts: dict[str, tuple[str, int]] = field(default_factory=dict)
    targets: list[float] = field(default_factory=list)
    readings: list[Reading] = field(default_factory=list)

    def axis(self) -> str:
        """The letter of the axis; raises `ConfigError` NCF618 if there is none, or another error was measured."""
        text, line = self.texts.get("axis", ("", 0))
        match = LETTER.fullmatch(text)
        if match is None:
            raise self.odd(f"the axis is {text!r}" if line else "there is no line `Axis:`", line, "a letter: Axis: X")
        if match[1].upper() in ROTARY:
            said = "the unit of a rotary axis's deviations is not public: give them as kind axis, in rad"
            raise self.odd(said, line, "docs/formats.md, section 3")
        for key in ("title", "filetype", "location"):
            other, where = self.texts.get(key, ("", 0))
            if OTHER.search(other):
                said = f"{other!r} speaks of another error than positioning, whose component and unit nobody says"
                raise self.odd(said, where, "give the readings as kind axis, with their component")
        return match[1].upper()

    def checked(self) -> Rtl:
        """The file, if its counts agree and its readings are of its targets; raises `ConfigError` NCF609, NCF618."""
        counts = {"target-count": len(self.targets), "run-count": len({each.run for each in self.readings})}
        if not self.targets:
            raise self.odd("there is no line `Targets:`, or nothing below it", 0)
        for each in self.readings:
            if not 1 <= each.target <= len(self.targets):
                raise self.odd(f"target {each.target} of {len(self.targets)}", each.line)
        for key, count in counts.items():
            text, line = self.texts.get(key, ("", 0))
            if text.isdecimal() and int(text) != count and self.readings:
                raise self.odd(f"{key} is {text}, and {count} are there: is a part of the file missing?", line)
        return self

    def runs(self) -> Iterator[tuple[int, list[Reading]]]:
        """The readings of each run, with the way in which it went: 1, -1, or 0 with a single reading."""
        for run in dict.fromkeys(each.run for each in self.readings):
            mine = [each for each in self.readings if each.run == run]
            yield int(np.sign(self.targets[mine[-1].target - 1] - self.targets[mine[0].target - 1])), mine

    def odd(self, text: str, line: int, hint: str = "") -> ConfigError:
        """The error NCF618."""
        return ConfigError.of("NCF618", text, Place(self.path, line), hint)


def read(text: str, path: str) -> Rtl:
    """The content of a file; raises `ConfigError` NCF608 and NCF618."""
    found, section, key = Rtl(path), "", ""
    for number, line in enumerate(text.splitlines(), 1):
        plain = line.strip()
        if match := SECTION.fullmatch(plain):
            section, key = match[1], ""
        elif match := KEY.match(plain):
            key = match[1].lower()
            found.texts.setdefault(key, (match[2].strip(), number))
            plain = match[2]
        if key == "targets":
            found.targets += [number_of(word, path, number) for word in plain.split()]
        elif section == "DEVIATIONS" and plain and not match:
            found.readings.append(_reading(found, plain.split(), number))
    return found.checked()


def _reading(rtl: Rtl, words: list[str], line: int) -> Reading:
    if len(words) != 3 or not words[0].isdecimal() or not words[1].isdecimal():
        raise rtl.odd("not a line of run, target and deviation", line, "three numbers: 1 12 -0.8")
    return Reading(int(words[0]), int(words[1]), number_of(words[2], rtl.path, line) * MICROMETRE, line)


def number_of(word: str, path: str, line: int) -> float:
    """A finite number; raises `ConfigError` NCF608."""
    try:
        value = float(word)
    except ValueError:
        value = np.nan
    if not np.isfinite(value):
        raise ConfigError.of("NCF608", f"{word!r} is not a number", Place(path, line), "numbers have a decimal point")
    return value
