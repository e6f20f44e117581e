"""The lines of a compensation file, without loss: what is written back is what was read, to the byte.

Function Manual Extended Functions, chapter K3: assignments to system variables, executed like a part program.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from ncfix.tables.lines import Remarks

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
ASSIGNMENT = re.compile(r"(\s*(?:[Nn]\d+\s*)?)\$(\w+)\[([^\]]*)\](\s*=\s*)([^;]*?)(\s*(?:;.*)?)", re.ASCII)
HEADER = re.compile(r"%_N_(\w+)_(?:INI|SPF|MPF)\s*", re.ASCII)
ENDS = re.compile(r"\s*(?:N\d+\s*)?M(?:17|0?2|30)\s*(?:;.*)?", re.IGNORECASE)
HARMLESS = re.compile(r"\s*(?:METRIC|CHANDATA\(\d+\)|M0?0)?\s*(?:;.*)?", re.IGNORECASE)
VALUE_FILES = {"eec": b"$AA_ENC_COMP"}
"""What tells an EEC file from a CEC file."""
SETTINGS = re.compile(r"\s*;\s*ncfix:\s*(.*)")


@dataclass(frozen=True, slots=True)
class Assignment:
    """`$NAME[index, ...]=value`, with the blanks and the comment around it."""

    line: int
    name: str
    indices: tuple[str, ...]
    value: str
    lead: str = ""
    equals: str = "="
    tail: str = ""

    @property
    def text(self) -> str:
        """The line again."""
        return f"{self.lead}${self.name}[{','.join(self.indices)}]{self.equals}{self.value}{self.tail}"

    @property
    def number(self) -> float | None:
        """The value, if it is a finite number."""
        found = float(self.value) if NUMBER.fullmatch(self.value) else math.inf
        return found if math.isfinite(found) else None


@dataclass(frozen=True, slots=True)
class Other:
    """Any other line, as it is."""

    line: int
    text: str


Line = Assignment | Other


def parsed(text: str) -> list[Line]:
    """The lines of a file; assignments are told from everything else."""
    return [_line(number, row) for number, row in enumerate(text.split("\n"), 1)]


def written(lines: Iterable[Line]) -> str:
    """The file that the lines come from."""
    return "\n".join(line.text for line in lines)


def _line(number: int, row: str) -> Line:
    body = row.removesuffix("\r")
    match = ASSIGNMENT.fullmatch(body)
    if match is None:
        return Other(number, row)
    lead, name, indices, equals, value, tail = match.groups()
    return Assignment(number, name, tuple(indices.split(",")), value, lead, equals, tail + row[len(body) :])


def assignments(lines: Iterable[Line], remarks: Remarks) -> Iterator[Assignment]:
    """The assignments that the control executes, with remarks on everything that it would stumble over."""
    rest = iter(lines)
    first = next(rest, Other(1, ""))
    if HEADER.fullmatch(first.text.strip()) is None:
        remarks.doubt(1, "the first line does not name the file", "%_N_NC_CEC_INI, as the control archives it")
        rest = iter([first, *rest])
    ended = False
    for line in rest:
        if ended:
            if line.text.strip() and not line.text.lstrip().startswith(";"):
                remarks.refuse(line.line, "stands after the end of the file", "M17 goes last")
        elif isinstance(line, Assignment):
            yield line
        elif ENDS.fullmatch(line.text):
            ended = True
        elif not HARMLESS.fullmatch(line.text):
            _stumbled(line, remarks)
    if not ended:
        remarks.refuse(0, "does not end with M17", "a file that was cut off?")


def _stumbled(line: Line, remarks: Remarks) -> None:
    if line.text.strip().upper() == "INCH":
        remarks.refuse(line.line, "INCH: ncfix writes and reads millimetres", "products change with the unit, too")
    elif "$" in line.text:
        remarks.refuse(line.line, "is not an assignment $NAME[index]=value")
    else:
        remarks.refuse(line.line, "is not understood", "assignments, comments, CHANDATA(1), METRIC, M17")


def settings(lines: Iterable[Line]) -> dict[str, str]:
    """What the comment `; ncfix: key=value ...` says."""
    found: dict[str, str] = {}
    for line in lines:
        if match := SETTINGS.fullmatch(line.text.removesuffix("\r")):
            pairs = (word.partition("=") for word in match[1].split() if "=" in word)
            found.update({key: value for key, _, value in pairs})
    return found
