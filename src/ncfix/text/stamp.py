"""The mark that a corrected program carries, so that it is not corrected twice."""

from __future__ import annotations

import re

import numpy as np

from ncfix.diagnostics import Message, Place
from ncfix.text.tree import Comment, Opaque, OWordLine, Program, Tape, Word
from ncfix.text.writer import Edit

#: How every stamp begins; what follows it is for people.
SIGN = re.compile(r"\bncfix \d+\.\d+\S* machine ", re.IGNORECASE)

MANY = 100
"""Comments; to look for the name in the whole text takes less time than to look at so many."""


def find(program: Program) -> int | None:
    """The block that carries a stamp, or None."""
    carriers = [any(isinstance(item, (Comment, Opaque)) for item in each.items) for each in program.templates]
    blocks = np.flatnonzero(np.array(carriers)[program.template])
    if len(blocks) > MANY and b"ncfix" not in program.source.lower():
        return None
    for block in blocks.tolist():
        for item in program.items_of(block):
            if isinstance(item, (Comment, Opaque)) and SIGN.search(program.slice(block, item.span)):
                return int(block)
    return None


def remark(place: Place) -> Message:
    """What is said of a program with a stamp whose numbers are to be what is meant: NCF430."""
    text = "the program has been corrected already, and its corrected numbers are taken for what is meant"
    return Message("NCF430", text, place, "give the original program")


def insertion(program: Program, text: str) -> Edit:
    """The edit that puts the stamp where the dialect allows: after `%` and the program's number, before all else."""
    words = text.upper() if program.dialect.upper_case else text
    comment = program.dialect.comment.format(words.replace("(", "[").replace(")", "]"))
    before = 0
    for block in program:
        if _is_head(program, block):
            before = block + 1
        elif not all(isinstance(item, Comment) for item in program.items_of(block)):
            break
    eol = program.line_end
    line = comment.encode("latin-1", "replace")
    if before == 0:
        start = int(program.blocks[0, 0])
        return Edit(start, start, line + eol)
    at = int(program.blocks[before - 1, 1])
    return Edit(at, at, eol + line)


def _is_head(program: Program, block: int) -> bool:
    """A tape mark, program number or program name: what must stay in front."""
    heads = 0
    for item in program.items_of(block):
        match item:
            case Comment() | Word("N"):
                continue
            case Tape() | Word("O") | OWordLine(keyword="program"):
                heads += 1
            case Opaque(kind) if "program" in kind:
                heads += 1
            case _:
                return False
    return heads > 0
