"""One block of SINUMERIK by the grammar; what the grammar does not take and has a name in it is kept as it is."""

from __future__ import annotations

import re

from lark import UnexpectedInput
from lark.exceptions import UnexpectedCharacters, UnexpectedToken

from ncfix.text.build import Parsed, TooDeepError, check_exponents, check_numbers, start_of
from ncfix.text.dialect import Dialect
from ncfix.text.faults import BlockError
from ncfix.text.grammar import parse
from ncfix.text.tree import END, START, Anchor, Opaque, Span, Template
from ncfix_siemens.sinumerik.build import build

STATEMENT = "statement"
"""The kind of an `Opaque` that could not be understood: it may be anything, a call of a cycle for instance."""

NAME = re.compile(r"[A-Z_]{2}", re.IGNORECASE)
QUOTED = re.compile(r'"[^"]*"|;.*', re.DOTALL)
ONCE = frozenset("XYZABCUVWIJKF") | {"I1", "J1", "K1", "CR", "AR", "AP", "RP", "TURN"}
"""Addresses that a block may have once."""

WHOLE = Span(Anchor(START, 0), Anchor(END, 0))


def parse_block(dialect: Dialect, text: str) -> Parsed:
    """One block; raises `BlockError` where not even a name could excuse it."""
    try:
        parsed = build(parse(dialect, text), text)
    except UnexpectedInput as error:
        if NAME.search(QUOTED.sub(" ", text)):
            return Parsed(Template((Opaque(STATEMENT, WHOLE),), 0), (), (), -1)
        raise explained(error, text) from None
    except TooDeepError as error:
        raise BlockError("NCF118", "the expression is nested too deep, or too long", error.position) from None
    check_numbers(parsed)
    check_exponents(parsed, text)
    check_repeats(parsed)
    return parsed


def check_repeats(parsed: Parsed) -> None:
    """Refuse a word of a motion that stands twice."""
    seen: set[str] = set()
    for word in parsed.template.words:
        if word.address in seen and word.address in ONCE:
            raise BlockError("NCF117", f"the word {word.address} stands twice", start_of(word, parsed))
        seen.add(word.address)


def explained(error: UnexpectedInput, text: str) -> BlockError:
    """The parser's complaint in words."""
    place = len(text)
    missing = isinstance(error, UnexpectedToken) and error.token.type == "$END"
    if isinstance(error, UnexpectedCharacters | UnexpectedToken) and error.pos_in_stream is not None and not missing:
        place = int(error.pos_in_stream)
    before, at = text[:place].rstrip(), text[place : place + 1]
    if before.endswith("="):
        return BlockError("NCF114", "there is no value after =", place)
    if at == "." or (before.endswith(".") and at.isdigit()):
        return BlockError("NCF115", "the number is malformed", place)
    if at == "," and before[-1:].isdigit():
        return BlockError("NCF115", "the number has a decimal comma", place, "write a point")
    if at.isalpha():
        return BlockError("NCF114", f"the word {at.upper()} has no value", place)
    if not at:
        return BlockError("NCF110", "the block is not complete", place)
    shown = repr(at) if at.isprintable() and at.isascii() else f"byte 0x{ord(at):02X}"
    return BlockError("NCF110", f"{shown} is not expected here", place)
