"""Block numbers of SINUMERIK: those that a program has, and those of blocks that were put in, all anew.

Jumps go to labels or to block numbers: the numbers in `GOTOF N100` and `REPEAT N100 N200` change with those of their
blocks. Each program of an archive counts by itself. Main blocks (`:100`) keep their numbers.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

from ncfix.diagnostics import RefusedError

NOT_NUMBERED = "NCF256"
STEP = 10

BLOCK = re.compile(
    r"(?P<before>[ \t]*(?:/\d?[ \t]*)?)(?:N[ \t]*(?P<number>\d+)(?P<blank>[ \t]*))?(?P<rest>.*)",
    re.IGNORECASE | re.DOTALL,
)
WORDS = re.compile(r"[A-Z][ \t]*[-+=.\d]", re.IGNORECASE)
"""How a block begins that is nothing but words, as those are that are put in."""

LABEL = re.compile(r"[A-Z_]\w*[ \t]*:(?!=)", re.IGNORECASE)
HEAD = re.compile(r"[ \t]*%")
SILENT = re.compile(r'"[^"]*"|;.*', re.DOTALL)
JUMP = re.compile(r"\b(?:GOTO[FBC]?|REPEATB?)[ \t]+(?P<where>N[ \t]*\d+(?:[ \t]+N[ \t]*\d+)?)(?!\w)", re.IGNORECASE)
NUMBER = re.compile(r"N[ \t]*(\d+)", re.IGNORECASE)
BY_TEXT = re.compile(r'"[ \t]*N[ \t]*\d*[ \t]*"', re.IGNORECASE)
"""A block number, or the beginning of one, as a text: the target of a jump may be made of it."""


def renumbered(source: bytes) -> bytes:
    """A program with its blocks numbered 10, 20, ... wherever they have numbers, and blocks of words where others have.

    Raises RefusedError NCF256 where a jump goes to a number that stands twice, or that is put together at run time.
    """
    lines = source.decode("latin-1").splitlines(keepends=True)
    return "".join(line for unit in units(lines) for line in numbered(unit)).encode("latin-1")


def units(lines: list[str]) -> Iterator[list[str]]:
    """The programs of an archive."""
    heads = [place for place, line in enumerate(lines) if HEAD.match(line)]
    edges = sorted({0, *heads, len(lines)})
    for begin, end in pairwise(edges):
        yield lines[begin:end]


def numbered(lines: list[str]) -> list[str]:
    """The lines of one program."""
    blocks = [BLOCK.fullmatch(line) for line in lines]
    old = [int(block["number"]) for block in blocks if block is not None and block["number"]]
    if not old:
        return lines
    blank = next(block["blank"] for block in blocks if block is not None and block["number"])
    result, new, count = [], {}, 0
    for line, block in zip(lines, blocks, strict=True):
        if block is None or not (block["number"] or is_words(block["rest"])):
            result.append(line)
            continue
        count += STEP
        if block["number"]:
            new[int(block["number"])] = count
        gap = block["blank"] if block["number"] else blank
        result.append(f"{block['before']}N{count}{gap}{block['rest']}")
    return [redirected(line, new, old) for line in result]


def is_words(text: str) -> bool:
    """Whether a block without a number is nothing but words."""
    return bool(WORDS.match(text)) and not LABEL.match(text)


def redirected(line: str, new: dict[int, int], old: list[int]) -> str:
    """A line whose jumps go to the new numbers."""
    if BY_TEXT.search(line.split(";")[0]):
        raise RefusedError.of(NOT_NUMBERED, f"a jump may go to a number that is a text: {line.strip()[:40]}")
    code = SILENT.sub(lambda found: " " * len(found[0]), line)
    pieces, done = [], 0
    for place, number in targets(code):
        if old.count(number) > 1:
            raise RefusedError.of(NOT_NUMBERED, f"a jump goes to N{number}, which stands there more than once")
        pieces += [line[done : place[0]], str(new.get(number, number))]
        done = place[1]
    return "".join([*pieces, line[done:]])


def targets(code: str) -> list[tuple[tuple[int, int], int]]:
    """Where block numbers stand that a line leads to, and what they are."""
    return [
        (number.span(1), int(number[1]))
        for jump in JUMP.finditer(code)
        for number in NUMBER.finditer(code, jump.start("where"), jump.end())
    ]
