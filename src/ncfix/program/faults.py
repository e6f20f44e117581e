"""Why a block cannot be read, said to people: from the parser's complaint to a coded message with its place."""

from __future__ import annotations

from dataclasses import dataclass

from lark import UnexpectedInput
from lark.exceptions import UnexpectedCharacters, UnexpectedToken

from ncfix.program.grammar import Squeezed


@dataclass(frozen=True, slots=True)
class BlockError(Exception):
    """What is the matter in a block, and where in it (from 0)."""

    code: str
    text: str
    place: int
    hint: str = ""


def explain(error: UnexpectedInput, text: str, squeezed: Squeezed) -> BlockError:
    """The fault behind a complaint of the parser about one squeezed block."""
    code = squeezed.code
    position = position_of(error, code)
    place = squeezed.places[position] if position < len(code) else len(text)
    return BlockError("NCF110", f"{text[place : place + 1]!r} is not expected here", place)


def position_of(error: UnexpectedInput, code: str) -> int:
    """Where in the squeezed block the parser stopped; its length if it missed something at the end."""
    if isinstance(error, UnexpectedToken) and error.token.type == "$END":
        return len(code)
    if isinstance(error, UnexpectedCharacters | UnexpectedToken) and error.pos_in_stream is not None:
        return int(error.pos_in_stream)
    return len(code)
