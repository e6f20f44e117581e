"""The stamp: the comment by which a corrected program is recognised, so that it is not corrected twice."""

from __future__ import annotations

import re

import numpy as np

from ncfix.diagnostics import Message, Place
from ncfix.text.tree import Comment, Opaque, OWordLine, Program, Tape, Word
from ncfix.text.writer import Edit

#: The beginning of every stamp; the rest is for people.
SIGN = re.compile(r"\bncfix \d+\.\d+\S* machine ", re.IGNORECASE)

MANY_COMMENTS = 100
"""Number of comments above which searching the whole text is faster than examining each comment."""


def find(program: Program) -> int | None:
    """The block with the stamp; None without one."""
    carriers = [any(isinstance(item, (Comment, Opaque)) for item in each.items) for each in program.templates]
    blocks = np.flatnonzero(np.array(carriers)[program.template])
    if len(blocks) > MANY_COMMENTS and b"ncfix" not in program.source.lower():
        return None
    for block in blocks.tolist():
        for item in program.items_of(block):
            if isinstance(item, (Comment, Opaque)) and SIGN.search(program.slice(block, item.span)):
                return int(block)
    return None


def remark(place: Place) -> Message:
    """The warning NCF430: the program has a stamp, and its corrected numbers are taken as the intended ones."""
    text = "the program has been corrected already; ncfix takes its corrected numbers as the intended path"
    return Message("NCF430", text, place, "use the original program")


def insertion(program: Program, text: str) -> Edit:
    """The edit that inserts the stamp at the first place allowed: after `%` and the program's number or name."""
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
    """Whether a block is a tape mark, a program number or a program name, which must stay in front."""
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
