"""Common parts of the table files of controls: axis letters and units, numbers, and remarks with places.

The letter of an axis tells whether positions are in millimetres or degree. Linters collect faults in `Remarks`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import field
from functools import lru_cache

import numpy as np

from ncfix.diagnostics import ConfigError, Message, Place, RefusedError
from ncfix.machine import Machine
from ncfix.values import mutable

AGAIN = "export again"
"""Hint for a faulty file that ncfix has written."""
NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
"""The pattern of a decimal number as controls write it."""
ALONE = re.compile(r"\r(?!\n)")
BYTE_ORDER = "\u00ef\u00bb\u00bf"
"""The mark at the beginning of some UTF-8 files, taken as Latin-1."""
ORDER = "XYZABCUVW"
"""Axis letters in the order in which controls count axes."""
TURNING = "ABC"
DEGREE = np.pi / 180


@lru_cache(1 << 16)
def as_number(text: str) -> float | None:
    """A finite decimal number as controls write it; None for any other text."""
    if not re.fullmatch(NUMBER, text):
        return None
    found = float(text)
    return found if math.isfinite(found) else None


@mutable
class Remarks:
    """Faults found in one file.

    rows      the lines of the file
    wrong     faults for which the control would not load the file or would misread it
    doubtful  contents that are rarely intended
    open_end  the last line has no line end
    """

    path: str
    rows: list[str] = field(default_factory=list)
    wrong: list[Message] = field(default_factory=list)
    doubtful: list[Message] = field(default_factory=list)
    open_end: bool = False

    @classmethod
    def of(cls, path: str, content: bytes, comment: str = "") -> Remarks:
        """The remarks on a file before its content is checked: on byte order mark, line ends, non-ASCII characters.

        comment  pattern of the start of a comment, in which non-ASCII characters are only doubtful; "": no comments
        """
        text = content.decode("latin-1")
        remarks = cls(path, _rows(text.removeprefix(BYTE_ORDER)), open_end=not text.endswith(("\n", "\r")))
        if text.startswith(BYTE_ORDER):
            remarks.doubt(1, "begins with a byte order mark", "controls read plain ASCII only")
        if ALONE.search(text):
            remarks.doubt(0, "a line ends in CR alone", "LF or CR LF")
        for number, row in enumerate(remarks.rows, 1):
            if not row.isascii():
                inside = comment and re.split(comment, row, maxsplit=1)[0].isascii()
                note = remarks.doubt if inside else remarks.refuse
                note(number, "a character that is not ASCII", "controls read plain ASCII only")
                break
        return remarks

    def refuse(self, line: int, text: str, hint: str = AGAIN) -> None:
        """Note NCF491: the control would not load this line, or would misread it."""
        self.wrong.append(Message("NCF491", text, self._place(line), hint))

    def doubt(self, line: int, text: str, hint: str = "") -> None:
        """Note NCF492: this is rarely intended."""
        self.doubtful.append(Message("NCF492", text, self._place(line), hint))

    def doubt_end(self) -> None:
        """Note a missing line end, for a format without an end mark: the last number may lack digits."""
        if self.open_end and self.rows:
            self.doubt(len(self.rows), "the last line does not end: was the file cut off?", "add a line end")

    def check(self) -> None:
        """Raise `ConfigError` with all of `wrong`, if there are any."""
        if self.wrong:
            raise ConfigError.collected(self.wrong)

    @property
    def messages(self) -> tuple[Message, ...]:
        """All messages, `wrong` first."""
        return (*self.wrong, *self.doubtful)

    def _place(self, line: int) -> Place:
        return Place(self.path, line, 0, self.rows[line - 1] if 0 < line <= len(self.rows) else "")


def check_all(remarks: Iterable[Remarks]) -> None:
    """Raise `ConfigError` for the first file with a fault."""
    for each in remarks:
        each.check()


def messages_of(remarks: Iterable[Remarks]) -> tuple[Message, ...]:
    """All messages on several files."""
    return tuple(message for each in remarks for message in each.messages)


def _rows(text: str) -> list[str]:
    """The lines of a text with line ends LF, CR LF or CR."""
    rows = re.split("\r\n|\n|\r", text)
    return rows if rows[-1] else rows[:-1]


def unit_of(letter: str) -> float:
    """mm or rad per unit of a file (mm or degree), by the axis letter."""
    return DEGREE if letter in TURNING else 1.0


def in_order(machine: Machine, known: Sequence[str] = ORDER) -> tuple[str, ...]:
    """The axes of a machine in the order of its control; raises `RefusedError` NCF484 for an impossible axis.

    known  axis letters of the control, in its order
    """
    odd = [axis.name for axis in machine.axes if axis.name not in {*known} or (axis.name in TURNING) != axis.rotary]
    if odd:
        lengths = " ".join(letter for letter in known if letter not in TURNING)
        text = f"axes {' '.join(odd)}: linear axes are {lengths} here, rotary axes {' '.join(TURNING)}"
        hint = "name the axes like this in the machine file, or correct the programs: ncfix fix"
        raise RefusedError.of("NCF484", text, hint=hint)
    return tuple(letter for letter in known if letter in machine.axis_names)
