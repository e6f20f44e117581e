"""The lines of a compensation file, without loss: what is written back is what was read, to the byte.

Function Manual Extended Functions, chapter K3: assignments to system variables, executed like a part program.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from ncfix.tables.table_files import Remarks

NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][xX]?[-+]?[0-9]+)?")
ASSIGNMENT = re.compile(
    r"(\s*)\$(\w+\s*)\[([^\]]*)\](\s*=\s*)((?:\([^)]*\)|[^;$(]|\b(?i:SET|REP)\([^)]*\))*?)(?=\s*(?:[;$]|$))"
)
BLOCK = re.compile(r"\s*(?:/[0-9]?\s*)?(?:N[0-9]+)?", re.IGNORECASE)
COMMENT = re.compile(r"\s*(?:;.*)?")
HEADER = re.compile(r"%_N_(\w+)_(?:INI|SPF|MPF)\s*", re.IGNORECASE)
ENDS = re.compile(r"\s*(?:N\d+\s*)?(?:M(?:17|0?2|30)|RET)\s*(?:;.*)?", re.IGNORECASE)
HARMLESS = re.compile(
    r"\s*(?:N\d+)?\s*(?:METRIC|CHANDATA\s*\(\s*\d+\s*\)|M0?[01]|G710?|STOPRE|MSG\s*\(.*\))?\s*(?:;.*)?", re.IGNORECASE
)
INCH = re.compile(r"\s*(?:N\d+\s*)?(?:INCH|G700?)\s*(?:;.*)?", re.IGNORECASE)
VALUE_FILES = {"eec": b"$AA_ENC_COMP"}
"""What tells an EEC file from a CEC file."""
LIST = re.compile(r"SET\s*\(([^()]*)\)", re.IGNORECASE)
SETTINGS = re.compile(r"\s*;\s*ncfix:\s*(.*)")


@dataclass(frozen=True, slots=True)
class Assignment:
    """`$NAME[index, ...]=value`, with what stands before it in its line, and the blanks and the comment after it."""

    line: int
    name: str
    indices: tuple[str, ...]
    value: str
    lead: str = ""
    equals: str = "="
    tail: str = ""
    gap: str = ""

    @property
    def text(self) -> str:
        """The line again."""
        return f"{self.lead}${self.name}{self.gap}[{','.join(self.indices)}]{self.equals}{self.value}{self.tail}"

    @property
    def number(self) -> float | None:
        """The value, if it is a finite number; the control writes exponents with EX."""
        found = float(self.value.upper().replace("EX", "E")) if NUMBER.fullmatch(self.value) else math.inf
        return found if math.isfinite(found) else None

    def listed(self) -> Iterator[Assignment]:
        """Itself; or, of SET(a, b, ...), one for each value, with the last index counting on."""
        match = LIST.fullmatch(self.value)
        if match is None or not self.indices[-1].strip().isdecimal():
            yield self
            return
        for place, value in enumerate(match[1].split(","), int(self.indices[-1])):
            yield replace(self, indices=(*self.indices[:-1], str(place)), value=value.strip())


@dataclass(frozen=True, slots=True)
class Other:
    """Any other line, as it is."""

    line: int
    text: str


Line = Assignment | Other


def parsed(text: str) -> list[Line]:
    """The lines of a file; assignments are told from everything else, also several in a line."""
    return [line for number, row in enumerate(text.split("\n"), 1) for line in _lines(number, row)]


def written(lines: Iterable[Line]) -> str:
    """The file that the lines come from."""
    found, last = "", 1
    for line in lines:
        found += "\n" * (line.line - last) + line.text
        last = line.line
    return found


def _lines(number: int, row: str) -> list[Line]:
    """The assignments of a line, if it has nothing else; or the line as it is."""
    body = row.removesuffix("\r")
    block = BLOCK.match(body)
    at = block.end() if block else 0
    found: list[Line] = []
    lead = body[:at]
    while match := ASSIGNMENT.match(body, at):
        before, name, indices, equals, value = match.groups()
        word = name.rstrip()
        found.append(
            Assignment(number, word, tuple(indices.split(",")), value, lead + before, equals, gap=name[len(word) :])
        )
        at, lead = match.end(), ""
    if not found or not COMMENT.fullmatch(body, at):
        return [Other(number, row)]
    assert isinstance(found[-1], Assignment)
    return [*found[:-1], replace(found[-1], tail=row[at:])]


def assignments(lines: Iterable[Line], remarks: Remarks) -> Iterator[Assignment]:
    """The assignments that the control executes, with remarks on everything that it would stumble over."""
    found = list(lines)
    first = next((place for place, line in enumerate(found) if not COMMENT.fullmatch(line.text)), 0)
    if found and HEADER.fullmatch(found[first].text.strip()):
        rest = iter(found[first + 1 :])
    else:
        remarks.doubt(1, "the first line does not name the file", "%_N_NC_CEC_INI, as the control archives it")
        rest = iter(found)
    ended = False
    for line in rest:
        if ended:
            if line.text.strip() and not line.text.lstrip().startswith(";"):
                remarks.refuse(line.line, "stands after the end of the file", "M17 goes last")
        elif isinstance(line, Assignment):
            yield from line.listed()
        elif ENDS.fullmatch(line.text):
            ended = True
        elif not HARMLESS.fullmatch(line.text):
            _stumbled(line, remarks)
    if not ended:
        remarks.refuse(0, "does not end with M17", "a file that was cut off?")


def _stumbled(line: Line, remarks: Remarks) -> None:
    if INCH.fullmatch(line.text):
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
