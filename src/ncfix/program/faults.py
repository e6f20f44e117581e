"""Why a block cannot be read, said to people: from the parser's complaint to a coded message with its place."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from lark import UnexpectedInput
from lark.exceptions import UnexpectedCharacters, UnexpectedToken

from ncfix.program.grammar import Squeezed

FLOW = re.compile(r"/?(n[\d.]*)?o(<[^<>]*>|\d+|\[.*?\](?=[a-z])|#\d+)(?P<keyword>[a-z]*)", re.IGNORECASE | re.DOTALL)
"""The start of a squeezed block of flow control."""

MACRO_B = re.compile(r"\A[ \t/]*(N\d+[ \t]*)?(IF[ \t]*\[|WHILE[ \t]*\[|GOTO\b|END[ \t]*\d|DO[ \t]*\d)", re.IGNORECASE)
"""Flow control as Fanuc and its like have it."""

COMPARISONS = "compare with EQ, NE, GT, GE, LT or LE"
KEYWORDS = "one of sub, endsub, call, return, if, elseif, else, endif, while, endwhile, do, repeat, endrepeat"


@dataclass(frozen=True, slots=True)
class BlockError(Exception):
    """What is the matter in a block, and where in it (from 0)."""

    code: str
    text: str
    place: int
    hint: str = ""


def explain(error: UnexpectedInput, text: str, squeezed: Squeezed) -> BlockError:
    """The fault behind a complaint of the parser about one squeezed block."""
    stop = Stop(text, squeezed, position_of(error, squeezed.code))
    found = (look(stop) for look in (in_comment, in_number, in_brackets, in_flow, in_word))
    return next((fault for fault in found if fault), None) or unexpected(stop)


def position_of(error: UnexpectedInput, code: str) -> int:
    """Where in the squeezed block the parser stopped; its length if it missed something at the end."""
    if isinstance(error, UnexpectedToken) and error.token.type == "$END":
        return len(code)
    if isinstance(error, UnexpectedCharacters | UnexpectedToken) and error.pos_in_stream is not None:
        return int(error.pos_in_stream)
    return len(code)


@dataclass(frozen=True, slots=True)
class Stop:
    """Where the parser stopped in a block.

    text      the block
    squeezed  the block without blanks
    position  in the squeezed block
    at        the character there, empty at the end of the block
    before    the character before it
    rest      the block from there on
    """

    text: str
    squeezed: Squeezed
    position: int
    at: str = field(init=False)
    before: str = field(init=False)
    rest: str = field(init=False)

    def __post_init__(self) -> None:
        code = self.squeezed.code
        object.__setattr__(self, "at", code[self.position : self.position + 1])
        object.__setattr__(self, "before", code[self.position - 1 : self.position] if self.position else "")
        object.__setattr__(self, "rest", self.text[self.place() :])

    def place(self, back: int = 0) -> int:
        """The place in the block, or of the character so many before."""
        places = self.squeezed.places
        position = self.position - back
        return places[position] if position < len(places) else len(self.text)

    def fault(self, code: str, text: str, hint: str = "", back: int = 0) -> BlockError:
        """A fault here, or so many characters before."""
        return BlockError(code, text, self.place(back), hint)


def in_comment(stop: Stop) -> BlockError | None:
    """A comment without an end, without a start, or with another in it."""
    if stop.at == ")":
        return stop.fault("NCF111", "no comment is open that this ) could close")
    if stop.at != "(":
        return None
    inner, end = stop.rest.find("(", 1), stop.rest.find(")")
    if end < 0:
        return stop.fault("NCF111", "the comment is not closed", "close it with ) on the same line")
    if 0 < inner < end:
        text = "there is a ( inside the comment"
        return BlockError("NCF112", text, stop.place() + inner, "use other brackets inside comments")
    return None


def in_number(stop: Stop) -> BlockError | None:
    """A second point or sign, a sign or point alone, or a decimal comma."""
    if stop.at == "." and stop.before in "0123456789." and stop.before:
        return stop.fault("NCF115", "the number has a second point")
    if stop.at == ".":
        return stop.fault("NCF115", "the number has no digit")
    if stop.at == "," and stop.before.isdigit():
        return stop.fault("NCF115", "the number has a decimal comma", "write a point")
    if stop.before and stop.before in "+-":
        text = "the number has two signs" if stop.at and stop.at in "+-" else "the sign has no number after it"
        return stop.fault("NCF115", text, back=0 if stop.at and stop.at in "+-" else 1)
    return None


def in_brackets(stop: Stop) -> BlockError | None:
    """Brackets that do not match, or with nothing or a sign of another language in them."""
    open_before = unmatched(stop.squeezed.code[: stop.position])
    if stop.at == "]" and not open_before:
        return stop.fault("NCF113", "no bracket is open that this ] could close")
    if stop.at == "]" and stop.before == "[":
        return stop.fault("NCF114", "there is nothing between the brackets", back=1)
    if open_before and stop.at and stop.at in "<>=!&|":
        return stop.fault("NCF110", f"{stop.at!r} is no operator", COMPARISONS)
    if open_before and unmatched(stop.squeezed.code):
        place = stop.squeezed.places[open_before[-1]]
        return BlockError("NCF113", "the bracket is not closed", place, "close it with ]")
    return None


def unmatched(code: str) -> list[int]:
    """Where brackets open in `code` that are not closed."""
    stack: list[int] = []
    for position, character in enumerate(code):
        if character == "[":
            stack.append(position)
        elif character == "]" and stack:
            stack.pop()
    return stack


def in_flow(stop: Stop) -> BlockError | None:
    """A block of flow control with a wrong keyword, without one, or with more than belongs to it."""
    start = FLOW.match(stop.squeezed.code)
    if start is None or stop.position < start.start("keyword") or unmatched(stop.squeezed.code[: stop.position]):
        return None
    keyword = start["keyword"]
    if not keyword:
        return stop.fault("NCF119", "after the O-word a keyword is missing", KEYWORDS)
    if stop.position < start.end("keyword"):
        place = stop.squeezed.places[start.start("keyword")]
        return BlockError("NCF119", f"{keyword!r} is no keyword of flow control", place, KEYWORDS)
    if not stop.at:
        return stop.fault("NCF119", f"after {keyword!r} an expression is missing", "write it in brackets [ ]")
    return stop.fault("NCF119", f"{stop.at!r} cannot follow {keyword!r}", "arguments stand in brackets [ ]")


def in_word(stop: Stop) -> BlockError | None:
    """An address or an `=` without a value; text that is no word at all."""
    if MACRO_B.match(stop.text):
        return stop.fault("NCF110", "this is flow control of another dialect (Macro B)", "name it with --dialect")
    if stop.before == "=":
        return stop.fault("NCF114", "there is no value after =", back=1)
    if stop.before == "#":
        return stop.fault("NCF114", "there is no parameter number after #", back=1)
    if not stop.before.isalpha() or not stop.before.isascii():
        return None
    prose = re.match(r"[A-Za-z_]{3,}", stop.text[stop.place(1) :])
    if prose:
        return stop.fault("NCF110", f"{prose[0][:40]!r} is no word of this dialect", back=1)
    return stop.fault("NCF114", f"the word {stop.before.upper()} has no value", back=1)


def unexpected(stop: Stop) -> BlockError:
    """Anything else: what stands where the parser stopped."""
    if not stop.at:
        return stop.fault("NCF110", "the block is not complete")
    shown = repr(stop.at) if stop.at.isprintable() and stop.at.isascii() else f"byte 0x{ord(stop.at):02X}"
    hints = {"/": "block skip stands at the start of the block", "N": "the line number stands first in the block"}
    return stop.fault("NCF110", f"{shown} is not expected here", hints.get(stop.at.upper(), ""))
