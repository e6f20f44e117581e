"""The second reader: the order in which the lines of a program are executed, if counts and conditions are plain.

It follows loops, jumps forwards and backwards, repeated sections, and subprograms in the same text. A program whose
flow depends on anything else is not followed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import NamedTuple

from ncfix.certificate.formulas import value_of
from ncfix.certificate.reading import JUMPS, Family
from ncfix.certificate.text import Text

MAX_LINES = 20_000
"""Largest number of executed lines; a longer program is not followed."""
EQUAL_TOLERANCE = 1e-6
"""Least difference of compared numbers that are not equal; below it, rounding in the control may decide."""


class FlowKind(Enum):
    """The ways in which a line directs the flow of a program."""

    JUMP = 0
    """Go on at a line, perhaps only if a condition holds."""
    REPEAT = 1
    """Execute lines a number of times more, then go on behind this line."""
    LOOP = 2
    """Execute the lines that begin behind this one a number of times in all, then go on behind their end."""
    CALL = 3
    RETURN = 4


class BranchingLine(NamedTuple):
    """The effect of one line on the flow of the program.

    to     index of the line to which a jump leads, or of the first line of what is repeated or called
    stop   index of the line behind the last one of what is repeated; -1 for a call, which M99 or LBL 0 ends
    times  number of repeats or calls, as a formula
    when   condition of a jump; empty: the jump is always made
    holds  True: the jump is made if the condition holds; False: if it does not hold
    """

    kind: FlowKind
    to: int = 0
    stop: int = 0
    times: str = "1"
    when: str = ""
    holds: bool = True


class NotPlainError(Exception):
    """Raised if the flow of a program cannot be followed: a count or condition is not plain, or it runs too long."""


class OpenSection(NamedTuple):
    """A section in execution: lines `start` to `stop` (-1: a call, without a last line).

    left  number of executions after the present one
    back  line at which the program goes on after all of them
    """

    start: int
    stop: int
    left: int
    back: int


class LineOrder:
    """Finds the next line to execute while a program is followed."""

    def __init__(self, lines: Mapping[int, BranchingLine]) -> None:
        """`lines`: the lines that direct the flow, by their index; each other line leads to the next one."""
        self.lines = lines
        self._open: list[OpenSection] = []
        self._executed = 0

    @classmethod
    def of(cls, text: Text) -> LineOrder | None:
        """The order of a program; None if no line directs the flow, one that does is not plain, or the text is long."""
        if len(text.lines) > MAX_LINES:
            return None
        odd = {row for row, line in text.apart() if line.odd is JUMPS}
        if not odd and not (text.family is Family.WORDS and SUBPROGRAM.search(text.source)):
            return None
        rows = text.source.decode("latin-1").upper().split("\n")[: len(text.lines)]
        try:
            lines = READ[text.family](rows)
        except (LookupError, ValueError):
            return None
        return cls(lines) if lines and odd <= lines.keys() else None

    @classmethod
    def are_alike(cls, first: Text, second: Text) -> bool:
        """Whether both programs have lines that direct the flow, and the same ones in the same order."""
        one = cls.of(first)
        other = None if one is None else cls.of(second)
        if one is None or other is None:
            return False
        said = [[each._replace(to=0, stop=0) for _, each in sorted(order.lines.items())] for order in (one, other)]
        return said[0] == said[1]

    def line_after(self, row: int, known: Mapping[str, float | None]) -> int:
        """The line that is executed after line `row`; raises `NotPlainError`.

        known  the values of variables
        """
        self._executed += 1
        found, to = self.lines.get(row), row + 1
        if self._executed > MAX_LINES:
            raise NotPlainError
        if found is not None:
            try:
                to = self._target_of(found, row, known)
            except (LookupError, ValueError):
                raise NotPlainError from None
        while self._open and to == self._open[-1].stop:
            to = self._again()
        return to

    def _target_of(self, line: BranchingLine, row: int, known: Mapping[str, float | None]) -> int:
        """The line to which a line leads; raises `ValueError` or `LookupError` if that is not plain."""
        if line.kind is FlowKind.JUMP:
            if line.when and _holds(line.when, known) != line.holds:
                return row + 1
            inside = not self._open or self._open[-1].stop < 0 or self._open[-1].start <= line.to < self._open[-1].stop
            if not inside:
                raise ValueError
            return line.to
        if line.kind is FlowKind.RETURN:
            if self._open[-1].stop >= 0:
                raise ValueError
            return self._again()
        times = value_of(line.times, known)
        if times is None or times != round(times) or times < 0:
            raise ValueError
        back, more = (line.stop + 1 if line.kind is FlowKind.LOOP else row + 1), round(times)
        if not more:
            return back
        self._open.append(OpenSection(line.to, line.stop, more - 1, back))
        return line.to

    def _again(self) -> int:
        """After the end of the innermost section: its first line if executions are left, else its `back`."""
        last = self._open.pop()
        if last.left:
            self._open.append(last._replace(left=last.left - 1))
        return last.start if last.left else last.back


COMPARED = {
    "EQ": (0,), "==": (0,), "EQU": (0,), "NE": (-1, 1), "<>": (-1, 1), "LT": (-1,), "<": (-1,),
    "LE": (-1, 0), "<=": (-1, 0), "GT": (1,), ">": (1,), "GE": (0, 1), ">=": (0, 1),
}  # fmt: skip
CONDITION = re.compile(r"(.+?)(==|<>|<=|>=|<|>|\b(?:EQU?|NE|LT|LE|GT|GE)\b)(.+)")


def _holds(condition: str, known: Mapping[str, float | None]) -> bool:
    """Whether a comparison holds; raises `ValueError` if that is not plain."""
    found = CONDITION.fullmatch(condition)
    left, right = (value_of(found[side], known) for side in (1, 3)) if found else (None, None)
    if found is None or left is None or right is None or 0 < abs(left - right) < EQUAL_TOLERANCE:
        raise ValueError
    return (left > right) - (left < right) in COMPARED[found[2]]


SUBPROGRAM = re.compile(rb"M[ \t]*0*9[89](?!\d)", re.IGNORECASE)
HEAD = re.compile(r"[ \t]*(?:N?[ \t]*\d+(?=[ \t]|[A-Z])[ \t]*)?")
COMMENT = re.compile(r";.*|\([A-Z][^()\[\]]*\)[ \t]*$")


def _bare(row: str) -> str:
    """A line without its number and its comment, with single blanks."""
    return " ".join(COMMENT.sub("", row[HEAD.match(row).end() :]).split())  # type: ignore[union-attr]  # it may be empty


def _one(rows: Sequence[str], pattern: str, within: range | None = None) -> int:
    """The only line that a pattern matches; raises `ValueError` if there is none or more than one."""
    (row,) = (row for row in within or range(len(rows)) if re.match(pattern, rows[row]))
    return row


def _klartext(texts: Sequence[str]) -> dict[int, BranchingLine]:
    found, rows = dict[int, BranchingLine](), [*map(_bare, texts)]
    for row, text in enumerate(rows):
        if text == "LBL 0":
            found[row] = BranchingLine(FlowKind.RETURN)
        elif call := re.fullmatch(r'CALL LBL (\d+|"[^"]*")(?: REP ?(\d+)(?:/\d+)?)?', text):
            to = _one(rows, rf"LBL {re.escape(call[1])}$")
            found[row] = (
                BranchingLine(FlowKind.REPEAT, to, row, call[2]) if call[2] else BranchingLine(FlowKind.CALL, to, -1)
            )
            if call[2] and to > row:
                raise ValueError
        elif jump := re.fullmatch(r'FN ?(?:9|1[0-2]) ?: IF (.+) GOTO LBL (\d+|"[^"]*")', text):
            found[row] = BranchingLine(FlowKind.JUMP, _one(rows, rf"LBL {re.escape(jump[2])}$"), when=jump[1])
    return found


def _sinumerik(texts: Sequence[str]) -> dict[int, BranchingLine]:
    found, rows = dict[int, BranchingLine](), [*map(_bare, texts)]
    for row, text in enumerate(rows):
        if jump := re.fullmatch(r"(?:IF ?(.+?) ?)?GOTO([BF]) ([A-Z_]\w+)", text):
            to = _one(rows, rf"{jump[3]}:")
            if (to > row) != (jump[2] == "F"):
                raise ValueError
            found[row] = BranchingLine(FlowKind.JUMP, to, when=_unbracketed(jump[1] or ""))
        elif again := re.fullmatch(r"REPEAT(B?) ([A-Z_]\w+)(?: ([A-Z_]\w+))?(?: P ?= ?(.+))?", text):
            start = _one(rows, rf"{again[2]}:")
            stop = row if not again[3] else _one(rows, rf"{again[3]}:") + 1
            inner = [at for at in range(start, row) if rows[at].startswith("ENDLABEL:")]
            if inner and not again[3]:
                stop = inner[0] + 1
            if again[1]:
                stop = start + 1
            if not start < stop <= row:
                raise ValueError
            found[row] = BranchingLine(FlowKind.REPEAT, start, stop, again[4] or "1")
    return found


def _unbracketed(condition: str) -> str:
    """A condition without brackets around the whole of it."""
    inside = condition[1:-1] if condition[:1] + condition[-1:] in ("()", "[]") else condition
    return condition if re.search(r"[()\[\]]", inside) else inside


def _word_address(texts: Sequence[str]) -> dict[int, BranchingLine]:
    found, rows = dict[int, BranchingLine](), [*map(_bare, texts)]
    heads = [row for row, text in enumerate(rows) if re.match(r"[O:] ?\d+(?: ?\(|$)", text)]
    for row, text in enumerate(rows):
        if loop := re.fullmatch(r"WHILE ?\[(.+)\] ?DO ?(\d)", text):
            end = next(at for at in range(row, len(rows)) if re.fullmatch(rf"END ?{loop[2]}", rows[at]))
            found[row] = BranchingLine(FlowKind.JUMP, end + 1, when=loop[1], holds=False)
            found[end] = BranchingLine(FlowKind.JUMP, row)
        elif jump := re.fullmatch(r"(?:IF ?(\[.+\]) ?)?GOTO ?(\d+)", text):
            begin = max((head for head in heads if head <= row), default=0)
            inside = range(begin, min((head for head in heads if head > row), default=len(rows)))
            to = _one(texts, rf"[ \t]*N[ \t]*0*{int(jump[2])}\b", inside)
            found[row] = BranchingLine(FlowKind.JUMP, to, when=_unbracketed(jump[1] or ""))
        elif call := re.fullmatch(r"M ?98 ?P ?(\d{1,4})(?: ?L ?(\d+))?", text):
            to = _one(rows, rf"[O:] ?0*{int(call[1])}\b")
            found[row] = BranchingLine(FlowKind.CALL, to, -1, call[2] or "1")
        elif text in ("M99", "M 99"):
            found[row] = BranchingLine(FlowKind.RETURN)
        elif loop := re.fullmatch(r"O ?(\d+) ?REPEAT ?\[(.+)\]", text):
            end = _one(rows, rf"O ?{loop[1]} ?ENDREPEAT$")
            found[row] = BranchingLine(FlowKind.LOOP, row + 1, end, loop[2])
            found[end] = BranchingLine(FlowKind.JUMP, end + 1)
    return found


READ = {Family.WORDS: _word_address, Family.SINUMERIK: _sinumerik, Family.KLARTEXT: _klartext}
