"""The second reader: the lines of a program as words, parsed by regular expressions of its own.

It reads three families: word addresses (LinuxCNC, ISO 6983, Fanuc and similar), SINUMERIK and Klartext. It knows no
grammar and no meaning. For each line it keeps the words that a correction may change (axes, arc centres and radii), and
all other text byte for byte. A line that it cannot parse is marked as odd, with the reason.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import field
from enum import Enum
from typing import NamedTuple

from ncfix.values import mutable

AXES = frozenset("XYZABCUVW")


class Family(Enum):
    """The families of languages, by the form of their words."""

    WORDS = "word addresses"
    SINUMERIK = "SINUMERIK"
    KLARTEXT = "Klartext"

    @classmethod
    def of(cls, text: bytes, dialect: str) -> Family:
        """The family of a dialect by its name, or else by the beginning of the text."""
        head = text[:4096].upper()
        if dialect == "heidenhain" or re.search(rb"^\s*(?:\d+\s+)?BEGIN\s+PGM\b", head, re.MULTILINE):
            return cls.KLARTEXT
        if dialect == "siemens" or re.search(rb"^(?:%_N_|\s*;\$PATH)", head, re.MULTILINE):
            return cls.SINUMERIK
        return cls.WORDS


class TextWord(NamedTuple):
    """A word: its name, its number or formula as written, and its value.

    value    None for a formula
    counted  "+": an increment, "=": absolute, whatever the mode; "": by the mode
    """

    name: str
    number: str
    value: float | None
    counted: str = ""

    @property
    def decimals(self) -> int:
        """Number of decimals; for a formula, more than any control has."""
        return 99 if self.value is None else len(self.number.replace(",", ".").partition(".")[2])


@mutable
class TextLine:
    """A line of a program.

    number   counted from 1
    path     words that a correction may change or add, in order
    codes    all other words, in order
    rest     the text without the words of `path` and the blanks before them; Klartext: without the block number
    block    number of the block, Klartext only
    odd      why the line cannot be parsed; empty if it could be
    skipped  its switch of block delete, 1 for `/`; 0: none
    plain    all words are letters with numbers; the words of `path` are distinct axes
    """

    number: int
    path: list[TextWord] = field(default_factory=list)
    codes: list[TextWord] = field(default_factory=list)
    rest: str = ""
    block: str = ""
    odd: str = ""
    skipped: int = 0
    plain: bool = False

    def word(self, name: str) -> TextWord | None:
        """The word of `path` with this name."""
        return next((word for word in self.path if word.name == name), None)

    def code(self, name: str) -> float | None:
        """The value of the last word of `codes` with this name."""
        return next((word.value for word in reversed(self.codes) if word.name == name), None)

    def says(self, other: TextLine) -> bool:
        """Whether two lines have the same words and text."""
        return (self.rest, self.path, self.block) == (other.rest, other.path, other.block)

    def doubled(self) -> str:
        """The name of an axis or centre with two words; empty if there is none."""
        if self.plain:
            return ""
        names = [word.name for word in self.path]
        return next((name for name in names if names.count(name) > 1), "") if len(names) > 1 else ""


NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)"
FORMULA = r"[+-]?(?:\#+(?:\d+|<[^<>]*>)|\#?\[(?:[^\[\]]|\[(?:[^\[\]]|\[[^\[\]]*\])*\])*\])"
WORD_ADDRESS = re.compile(
    rf"(\([^()]*\)|;.*|%)|([A-Za-z])[ \t]*(?:({NUMBER})(?!\.?[\d\#\[])|({FORMULA}))|([^ \t])",
)
"""Groups: comment; letter; its number; its formula; anything else."""
FLOW = re.compile(
    r"\b(?:GOTO|IF|WHILE|END|THEN|DO)\d*\b|\bO[ \t]*(?:<|\d+[ \t]*(?:SUB|CALL|IF|WHILE|DO|REPEAT|END|ELSE|R))"
)
PATH_WORDS = AXES | frozenset("IJKR")
ASSIGNMENT = re.compile(
    r"[ \t]*(?:/\d?[ \t]*)?(?:N[ \t]*\d+[ \t]*)?(?:/\d?[ \t]*)?(\#\d+|\#<[^<>]*>)[ \t]*="
    r"((?:[^=();<>A-Z]|<[^<>=()]*>|[A-Z]{2,})+)(?:\([^()]*\)[ \t]*)*(?:;.*)?",
    re.IGNORECASE,
)
"""A line that only assigns the value of a formula to a variable."""


class _Rest:
    """The text of a line without the words that are cut out."""

    def __init__(self, text: str) -> None:
        self.text, self.pieces, self.at = text, list[str](), 0

    def cut(self, start: int, end: int) -> None:
        """Cut out a word, and the blanks before it."""
        self.pieces.append(self.text[self.at : start].rstrip(" \t"))
        self.at = end

    def __str__(self) -> str:
        return "".join([*self.pieces, self.text[self.at :]])


def _piece(text: str, start: int) -> str:
    """The text from a place of a line up to a blank; or one control character."""
    return (text[start:].split() or [text[start]])[0]


SKIPPED = re.compile(r"[ \t]*(?:N[ \t]*\d+[ \t]*)?/(\d?)", re.IGNORECASE)
"""The mark of block delete with its switch, at the start of a line or behind its number."""


def _marked(number: int, text: str) -> tuple[TextLine, int]:
    """A line object with its switch of block delete, and the end of that mark."""
    mark = SKIPPED.match(text)
    return (TextLine(number), 0) if mark is None else (TextLine(number, skipped=int(mark[1] or 1)), mark.end())


def _word_address(number: int, text: str) -> TextLine:
    line, marked = _marked(number, text)
    flows = FLOW.search(text.upper())
    if "=" in text and not flows and (found := ASSIGNMENT.fullmatch(text)):
        line.codes.append(TextWord(found[1], found[2].strip(), None))
        line.rest = text
        return line
    rest = _Rest(text)
    for found in WORD_ADDRESS.finditer(text):
        start, end = found.span()
        letter = found[2]
        if letter is None:
            if found[5] is not None and found[5] not in "/*:" and start >= marked:
                line.odd = line.odd or f"{_piece(text, start)!r} is not a plain word"
        else:
            name, digits = letter.upper(), found[3]
            word = TextWord(name, digits or found[4], float(digits) if digits else None)
            if name in PATH_WORDS:
                rest.cut(start, end)
                line.path.append(word)
                continue
            line.codes.append(word)
    line.rest = str(rest)
    if line.odd and flows:
        line.odd = JUMPS
    return line


CYCLE_CALL = rf"CYCLE(?:8[1-9]|840)[ \t]*\([ \t]*(?:{NUMBER})?[ \t]*(?:,[ \t]*(?:{NUMBER})?[ \t]*)*\)"
"""A drilling cycle of SINUMERIK with plain numbers."""
JUMPS = "the program has loops, jumps or subprograms"
RETRACTS = "M140 retracts the tool by a distance that the control calculates"
CODE = r"[A-Z]{1,2}\d*"
SINUMERIK_WORD = re.compile(
    rf"(;.*|\"[^\"]*\")"
    rf"|([A-Z]\d*|[A-Z_$]{{2}}[A-Z0-9_$]*)[ \t]*="
    rf"[ \t]*(?:(IC|AC|DC|ACP|ACN)\([ \t]*({NUMBER})[ \t]*\)|({NUMBER})(?![\w.(*/+])"
    rf"|(\"[^\"]*\"|[^;\s]+))"
    rf"|(?<![A-Z_$])([A-Z])({NUMBER})(?![\d.(_$])"
    rf"|([A-Z_$%][A-Z0-9_$]*(?:[ \t]*\((?:[^()]|\([^()]*\))*\))?)"
    rf"|([^ \t])",
    re.IGNORECASE,
)
SINUMERIK_PATH = AXES | frozenset(("I", "J", "K", "CR", "AR", "AP", "RP", "TURN", "LEAD", "TILT", "PHI", "PSI"))
SINUMERIK_PATH |= frozenset(("RND", "RNDM", "CHR", "CHF", "ANG", "X1", "Y1", "Z1", "I1", "J1", "K1"))
SINUMERIK_PATH |= frozenset(letter + digit for letter in "ABC" for digit in "2345")
SINUMERIK_FLOW = re.compile(
    r"^(?:GOTO[FBCS]?|IF|ELSE|ENDIF|FOR|ENDFOR|WHILE|ENDWHILE|LOOP|ENDLOOP|REPEATB?|UNTIL|CALL|CASE|PROC|RET|M17)\b"
)


LABEL = re.compile(r"[ \t]*(?:N[ \t]*\d+[ \t]*)?[A-Z_]\w+[ \t]*:(?!=)", re.IGNORECASE)


def _sinumerik(number: int, text: str) -> TextLine:
    line, marked = _marked(number, text)
    label = LABEL.match(text)
    rest = _Rest(text)
    for found in SINUMERIK_WORD.finditer(text, label.end() if label else 0):
        start, end = found.span()
        name = found[2] or found[7]
        if name is not None:
            name = name.upper()
            digits = found[4] or found[5] or found[8] or ""
            kind = (found[3] or "").upper()
            counted = "+" if kind == "IC" else "=" if kind == "AC" else ""
            value = float(digits) if digits and kind in ("", "IC", "AC") else None
            word = TextWord(name, digits or found[6] or "", value, counted)
            if name in SINUMERIK_PATH:
                rest.cut(start, end)
                line.path.append(word)
                continue
            line.codes.append(word)
        elif (key := found[9]) is not None:
            key = key.upper()
            line.codes.append(TextWord(key, "", None))
            if SINUMERIK_FLOW.match(key):
                line.odd = JUMPS
            elif re.match(r"[A-Z]\d", key):
                line.odd = line.odd or f"{key!r} is not a plain word"
            elif "(" in key and not key.startswith("CYCLE800(") and not re.fullmatch(CYCLE_CALL, key):
                line.odd = line.odd or f"{key.partition('(')[0].strip()} is not known to the second reader"
        elif found[10] is not None and found[10] not in "/%:" and start >= marked:
            line.odd = line.odd or f"{_piece(text, start)!r} is not a plain word"
    line.rest = str(rest)
    return line


DECIMAL = r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)"
KLARTEXT_WORD = re.compile(
    rf"(;.*)|(R0|RL|RR|FMAX|F ?AUTO|DR[+-])(?![\w.,])"
    rf"|(I?(?:[XYZABCUVW]|P[AR])|[NT][XYZ]|R|FQ?|LA|M|S)({DECIMAL}|[+-]?Q[LR]?\d+)(?![\w.,])"
    rf"|([A-Z]+)|([^ \t])",
    re.IGNORECASE,
)
KLARTEXT_LEAD = frozenset(("L", "LN", "C", "CC", "CP", "CR", "M", "STOP"))
KLARTEXT_STATEMENT = re.compile(
    r"(?:BEGIN|END) PGM\b|BLK FORM|TOOL (?:CALL|DEF)|LBL \d|LBL \"|M12[89]$|FN ?[0-8]\b"
    r"|CYCL DEF (?:32|247|20[0-35-79]|24[01])\b|Q[LRS]?\d+ ?=|PLANE (?:SPATIAL|RESET)\b|CYCL DEF (?:7|10)\.\d"
    r"|CYCL CALL[ \t]*(?:;|$)"
    r"|FUNCTION (?:TCPM F (?:TCP|CONT) AXIS POS PATHCTRL (?:AXIS|VECTOR)|RESET TCPM)[ \t]*(?:;|$)"
)
"""Statements of Klartext that move no axis, and that the follower knows."""
KLARTEXT_FLOW = re.compile(r"^(?:CALL (?:LBL|PGM)|FN ?(?:9|1[0-2])\b|SEL PGM|CALL SELECTED|PATTERN|CYCL CALL)")


def _klartext(number: int, text: str) -> TextLine:
    line = TextLine(number)
    head = re.match(r"[ \t]*(/[ \t]*)?(\d+)(?=[ \t]|$)", text)
    body = text
    if head:
        line.block = head[2]
        body = text[head.end() :]
    line.skipped = int("/" in text[: head.end()] if head else body.lstrip().startswith("/"))
    body_upper = (body if head else body.lstrip(" \t/")).strip().upper()
    first = body_upper.split(None, 1)[0] if body_upper else ""
    if body_upper.startswith("*"):
        line.rest = body
        return line
    if body_upper and first not in KLARTEXT_LEAD and not re.match(r"(;|M\d)", body_upper):
        line.rest = body
        line.codes.append(TextWord(body_upper, "", None))
        line.odd = JUMPS if KLARTEXT_FLOW.match(body_upper) else f"{first} is not known to the second reader"
        if KLARTEXT_STATEMENT.match(body_upper):
            line.odd = ""
        return line
    rest = _Rest(body)
    for found in KLARTEXT_WORD.finditer(body):
        start, end = found.span()
        if found[3] is not None:
            name, digits = found[3].upper(), found[4]
            value = None if "Q" in digits.upper() else float(digits.replace(",", "."))
            counted = name.startswith("I")
            name = name.removeprefix("I")
            if name in AXES or name in ("R", "PA", "PR"):
                rest.cut(start, end)
                line.path.append(TextWord(name, digits, value, "+" if counted else "="))
                continue
            line.codes.append(TextWord(name, digits, value))
        elif found[2] is not None or found[5] is not None:
            line.codes.append(TextWord((found[2] or found[5]).upper(), "", None))
            if found[5] is not None and found[5].upper() not in KLARTEXT_LEAD:
                line.odd = line.odd or f"{found[5]} is not known to the second reader"
        elif found[6] is not None and found[6] not in "*/":
            line.odd = line.odd or f"{_piece(body, start)!r} is not a plain word"
    if any(word.name == "M" and word.value == 140 for word in line.codes):
        line.odd = RETRACTS
    line.rest = str(rest)
    return line


READERS: dict[Family, Callable[[int, str], TextLine]] = {
    Family.WORDS: _word_address,
    Family.SINUMERIK: _sinumerik,
    Family.KLARTEXT: _klartext,
}
