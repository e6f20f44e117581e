"""What the table files of controls have in common: axes by their letters, numbers, and faults with their places.

A letter tells whether a position is in millimetres or degree. The linters of the plugins say what is wrong in a file
with `Remarks`.
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
"""What helps with a file that ncfix has written."""
NUMBER = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
"""The pattern of a decimal number as controls write it."""
ALONE = re.compile(r"\r(?!\n)")
BYTE_ORDER = "\u00ef\u00bb\u00bf"
"""The mark at the beginning of some UTF-8 files, taken as Latin-1."""
ORDER = "XYZABCUVW"
"""In which order controls count them."""
TURNING = "ABC"
DEGREE = np.pi / 180


@lru_cache(1 << 16)
def as_number(text: str) -> float | None:
    """A decimal number as controls write it, finite; None for anything else."""
    if not re.fullmatch(NUMBER, text):
        return None
    found = float(text)
    return found if math.isfinite(found) else None


@mutable
class Remarks:
    """What was found in one file so far. `wrong` is what the control would not load or would misread.

    open_end  the last line does not end as lines do
    """

    path: str
    rows: list[str] = field(default_factory=list)
    wrong: list[Message] = field(default_factory=list)
    doubtful: list[Message] = field(default_factory=list)
    open_end: bool = False

    @classmethod
    def of(cls, path: str, content: bytes, comment: str = "") -> Remarks:
        """An empty list for a file; a byte that is not ASCII is noted, once: after a `comment` it is only doubtful.

        comment  the pattern of what a comment begins with; "" where there are none
        """
        text = content.decode("latin-1")
        remarks = cls(path, _rows(text.removeprefix(BYTE_ORDER)), open_end=not text.endswith(("\n", "\r")))
        if text.startswith(BYTE_ORDER):
            remarks.doubt(1, "begins with a byte order mark", "controls read plain ASCII")
        if ALONE.search(text):
            remarks.doubt(0, "a line ends in CR alone", "LF or CR LF")
        for number, row in enumerate(remarks.rows, 1):
            if not row.isascii():
                inside = comment and re.split(comment, row, maxsplit=1)[0].isascii()
                note = remarks.doubt if inside else remarks.refuse
                note(number, "a character that is not ASCII", "controls read plain ASCII")
                break
        return remarks

    def refuse(self, line: int, text: str, hint: str = AGAIN) -> None:
        """NCF491: the control would not load this, or read it otherwise than it looks."""
        self.wrong.append(Message("NCF491", text, self._place(line), hint))

    def doubt(self, line: int, text: str, hint: str = "") -> None:
        """NCF492: this is rarely meant."""
        self.doubtful.append(Message("NCF492", text, self._place(line), hint))

    def doubt_end(self) -> None:
        """Remark on an open end of a file in which nothing says that it is whole: its last number may lack digits."""
        if self.open_end and self.rows:
            self.doubt(len(self.rows), "the last line does not end: was the file cut off?", "a line end behind it")

    def check(self) -> None:
        """Raise `ConfigError` with everything that is wrong, if anything is."""
        if self.wrong:
            raise ConfigError.collected(self.wrong)

    @property
    def messages(self) -> tuple[Message, ...]:
        """All, what is wrong first."""
        return (*self.wrong, *self.doubtful)

    def _place(self, line: int) -> Place:
        return Place(self.path, line, 0, self.rows[line - 1] if 0 < line <= len(self.rows) else "")


def check_all(remarks: Iterable[Remarks]) -> None:
    """Raise `ConfigError` for the first file in which anything is wrong."""
    for each in remarks:
        each.check()


def messages_of(remarks: Iterable[Remarks]) -> tuple[Message, ...]:
    """All of several files."""
    return tuple(message for each in remarks for message in each.messages)


def _rows(text: str) -> list[str]:
    """The lines, whether they end in LF, CR LF or CR."""
    rows = re.split("\r\n|\n|\r", text)
    return rows if rows[-1] else rows[:-1]


def unit_of(letter: str) -> float:
    """mm or rad per unit of a file."""
    return DEGREE if letter in TURNING else 1.0


def in_order(machine: Machine, known: Sequence[str] = ORDER) -> tuple[str, ...]:
    """The axes of a machine as its control counts them; raises `RefusedError` NCF484 for one that it cannot have."""
    odd = [axis.name for axis in machine.axes if axis.name not in {*known} or (axis.name in TURNING) != axis.rotary]
    if odd:
        lengths = " ".join(letter for letter in known if letter not in TURNING)
        text = f"axes {' '.join(odd)}: linear axes are {lengths} here, rotary axes {' '.join(TURNING)}"
        hint = "name them so in the machine file, or correct its programs: ncfix fix"
        raise RefusedError.of("NCF484", text, hint=hint)
    return tuple(letter for letter in known if letter in machine.axis_names)
