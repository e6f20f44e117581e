"""Turns the parser's failure into a message for people: a coded error with its place in the block."""

from __future__ import annotations

import re
from dataclasses import field

from ncfix.text.grammar import UnspacedBlock
from ncfix.values import frozen

FLOW = re.compile(r"/?(n[\d.]*)?o(<[^<>]*>|\d+|\[.*?\](?=[a-z])|#\d+)(?P<keyword>[a-z]*)", re.IGNORECASE | re.DOTALL)
"""The start of a squeezed block of flow control."""

MACRO_B = re.compile(
    r"[ \t/]*(?:N\d+[ \t]*)?(?P<keyword>IF[ \t]*\[|WHILE[ \t]*\[|GOTO[ \t]*[\d#\[]|END[ \t]*\d|DO[ \t]*\d)",
    re.IGNORECASE,
)
"""Flow control of Fanuc and similar controls."""

FUNCTIONS = re.compile(r"(abs|acos|asin|atan|cos|exists|exp|fix|fup|ln|round|sin|sqrt|tan)\Z", re.IGNORECASE)
KEYWORDS = (
    *("sub", "endsub", "call", "return", "if", "elseif", "else", "endif", "while", "endwhile", "do", "repeat"),
    *("endrepeat", "break", "continue"),
)
COMPARISONS = frozenset({"EQ", "NE", "GT", "GE", "LT", "LE"})
OPERATORS = "compare with EQ, NE, GT, GE, LT or LE"
JOINED = "[[#1 EQ 1] AND [#2 EQ 2]] joins two comparisons"

HINTS = {
    "/": "the block skip / must be at the start of the block",
    "N": "the line number must be first in the block",
    "O": "an O-word must be first in the block",
    "=": "words are written without = in this dialect",
    "%": "the tape mark % must be alone on its line",
}
NUMERIC = frozenset("0123456789.")
SIGNS = frozenset("+-")
BARE = re.compile(r"#(\d+|<[^<>]*>)=[^=]+\Z")
"""An assignment followed by an operator: an expression without brackets."""


@frozen
class BlockError(Exception):
    """What is wrong in a block; `place`: index of the character in it."""

    code: str
    text: str
    place: int
    hint: str = ""


def explain(place: int, text: str, squeezed: UnspacedBlock) -> BlockError:
    """The error in a block, from the place in the squeezed block at which the parser stopped."""
    stop = Stop(text, squeezed, place)
    found = (look(stop) for look in (in_comment, in_number, in_expression, in_brackets, in_flow, in_word))
    return next((fault for fault in found if fault), None) or unexpected(stop)


@frozen
class Stop:
    """The place at which the parser stopped in a block.

    text      the block
    squeezed  the block without blanks
    position  index in the squeezed block
    at        the character there; empty at the end of the block
    before    the character before it
    rest      the block from there on
    """

    text: str
    squeezed: UnspacedBlock
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
        """Index in the block of the character here, or `back` characters before."""
        places = self.squeezed.places
        position = self.position - back
        return places[position] if position < len(places) else len(self.text)

    def fault(self, code: str, text: str, hint: str = "", back: int = 0) -> BlockError:
        """An error here, or `back` characters before."""
        return BlockError(code, text, self.place(back), hint)

    def not_closed(self) -> BlockError:
        """The error that the innermost open bracket is never closed."""
        opened = unmatched(self.squeezed.code[: self.position])[-1]
        return BlockError("NCF113", "the bracket is not closed", self.squeezed.places[opened], "close it with ]")


def bare_expression(place: int) -> BlockError:
    """The error that an expression has no brackets."""
    text = "this dialect needs brackets [ ] around an expression"
    return BlockError("NCF110", text, place, "--dialect fanuc, if the control accepts it without brackets")


def in_comment(stop: Stop) -> BlockError | None:
    """Errors of comments: not closed, not opened, or nested."""
    if stop.at == ")":
        return stop.fault("NCF111", "this ) has no ( before it")
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
    """Errors of numbers: a second point or sign, no digit, or a decimal comma."""
    if stop.at == "." and stop.before in NUMERIC:
        return stop.fault("NCF115", "the number has a second point")
    if stop.at == ".":
        return stop.fault("NCF115", "the number has no digit")
    if stop.at == "," and stop.before in NUMERIC:
        return stop.fault("NCF115", "the number has a decimal comma", "write a point")
    if stop.at in SIGNS and stop.before in SIGNS:
        return stop.fault("NCF115", "the number has two signs")
    return None


def in_expression(stop: Stop) -> BlockError | None:
    """Errors of expressions: a missing operator or value, an unknown function, or missing brackets."""
    done = stop.squeezed.code[: stop.position]
    if stop.at in {*SIGNS, "*", "/"} and BARE.search(done) and not unmatched(done):
        return bare_expression(stop.place())
    if stop.before in {*SIGNS, "*", "/"} and unmatched(done):
        return stop.fault("NCF114", f"there is no value after {stop.before!r}", back=1)
    if stop.before in SIGNS:
        return stop.fault("NCF115", "the sign has no number after it", back=1)
    if function := FUNCTIONS.search(done):
        text = f"{function[0]!r} needs its argument in brackets [ ]"
        return stop.fault("NCF110", text, back=len(function[0]))
    if re.search(r"atan\[[^\[\]]*\]\Z", done, re.IGNORECASE):
        return stop.fault("NCF110", "ATAN needs two values", "write ATAN[..]/[..]")
    if re.search(r"exists\[\Z", done, re.IGNORECASE):
        return stop.fault("NCF110", "EXISTS needs a parameter", "write EXISTS[#<name>]")
    if stop.at.isalpha() and unmatched(done):
        return in_expression_word(stop)
    return None


def in_expression_word(stop: Stop) -> BlockError:
    """The error at a word inside brackets that the language does not know."""
    name = re.match(r"[A-Za-z]*", stop.rest)
    shown = repr(name[0]) if name and name[0] else repr(stop.at)
    if name and name[0].upper() in COMPARISONS:
        return stop.fault("NCF110", f"{shown} is a second comparison without brackets", JOINED)
    if stop.before in {*NUMERIC, "]", ">"} and unmatched(stop.squeezed.code) == []:
        return stop.fault("NCF110", f"{shown} is not an operator", OPERATORS)
    if unmatched(stop.squeezed.code):
        return stop.not_closed()
    return stop.fault("NCF110", f"{shown} is not a function")


def in_brackets(stop: Stop) -> BlockError | None:
    """Errors of brackets: not matching, empty, or with an operator of another language in them."""
    open_before = unmatched(stop.squeezed.code[: stop.position])
    if stop.at == "]" and not open_before:
        return stop.fault("NCF113", "this ] has no [ before it")
    if stop.at == "]" and stop.before == "[":
        return stop.fault("NCF114", "the brackets are empty", back=1)
    if open_before and stop.at and stop.at in "<>=!&|" and stop.before != "#":
        return stop.fault("NCF110", f"{stop.at!r} is not an operator", OPERATORS)
    if open_before and unmatched(stop.squeezed.code):
        return stop.not_closed()
    return None


def unmatched(code: str) -> list[int]:
    """Indices of the brackets in `code` that are not closed."""
    stack: list[int] = []
    for position, character in enumerate(code):
        if character == "[":
            stack.append(position)
        elif character == "]" and stack:
            stack.pop()
    return stack


def in_flow(stop: Stop) -> BlockError | None:
    """Errors of flow control: a wrong keyword, none, or something after it."""
    start = FLOW.match(stop.squeezed.code)
    if start is None or unmatched(stop.squeezed.code[: stop.position]):
        return None
    keyword = start["keyword"]
    place = stop.squeezed.places[start.start("keyword")] if keyword else 0
    if keyword.lower() in KEYWORDS and stop.position < start.end("keyword"):
        return BlockError(
            "NCF119", "this dialect has no O-words for flow control", place, "--dialect linuxcnc reads them"
        )
    if stop.position < start.start("keyword"):
        return None
    if not keyword:
        return stop.fault("NCF119", "there is no keyword after the O-word", f"one of {', '.join(KEYWORDS)}")
    if stop.position >= start.end("keyword"):
        what = f"{stop.at!r} cannot follow {keyword!r}" if stop.at else f"there is no expression after {keyword!r}"
        return stop.fault("NCF119", what, "arguments must be in brackets [ ]")
    return BlockError("NCF119", f"{keyword!r} is not a keyword of flow control", place, f"one of {', '.join(KEYWORDS)}")


def in_word(stop: Stop) -> BlockError | None:
    """Errors of words: an address, a parameter or an `=` without its value; text that is no word."""
    if (macro := MACRO_B.match(stop.text)) and stop.place() < macro.end("keyword"):
        text = "this is flow control of another dialect (Macro B)"
        return BlockError("NCF110", text, macro.start("keyword"), "select it with --dialect")
    if stop.before == "=":
        return stop.fault("NCF114", "there is no value after =", back=1)
    if stop.before == "#":
        text = "the name is not closed with >" if stop.at == "<" else "there is no parameter number after #"
        return stop.fault("NCF114", text, back=1)
    if not stop.at and re.search(r"#(\d+|<[^<>]*>)\Z", stop.squeezed.code):
        return stop.fault("NCF114", "the parameter has no value", "write = and a value")
    if stop.before.isalpha() and stop.before.isascii() and stop.at != "=":
        return in_address(stop)
    return None


def in_address(stop: Stop) -> BlockError:
    """The error that an address has no value."""
    address = stop.before.upper()
    prose = re.match(r"[A-Za-z_]{3,}", stop.text[stop.place(1) :])
    if prose:
        return stop.fault("NCF110", f"{prose[0][:40]!r} is not a word of this dialect", back=1)
    if re.search(r"(?i)GOTO\Z", stop.squeezed.code[: stop.position]):
        return stop.fault("NCF110", "GOTO needs the number of a block, without N")
    if address == "O":
        text = "the name is not closed with >" if stop.at == "<" else "the O-word has no number and no name"
        return stop.fault("NCF119", text, back=1)
    if address == "N" and stop.at:
        return stop.fault("NCF114", "the line number is not a plain number", back=1)
    return stop.fault("NCF114", f"the word {address} has no value", back=1)


def unexpected(stop: Stop) -> BlockError:
    """Any other error: names the character at which the parser stopped."""
    if not stop.at:
        return stop.fault("NCF110", "the block is not complete")
    if stop.at == "\r":
        return stop.fault("NCF110", "there is a carriage return within the line", "write all line ends the same way")
    shown = repr(stop.at) if stop.at.isprintable() and stop.at.isascii() else f"byte 0x{ord(stop.at):02X}"
    return stop.fault("NCF110", f"{shown} is not expected here", HINTS.get(stop.at.upper(), ""))
