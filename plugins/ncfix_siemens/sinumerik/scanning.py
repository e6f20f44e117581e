"""The scanner of SINUMERIK texts: numbers and shape of every block without parsing; also renumbering and polar words.

Digits inside a name belong to the name, and the number of an extended address (`C1=`) to the address: they are part of
the shape. The reader compares each shape with the grammar, and uses the grammar if the two differ.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from ncfix.arrays import Bytes, Ints, Mask
from ncfix.control.moves import Moves, Rule
from ncfix.diagnostics import RefusedError
from ncfix.text.numbers import BLANK, SIGN, fill, runs_of, table
from ncfix.text.shapes import Scan, block_of, in_slices, matches, scan_beside
from ncfix.text.tree import Program, Template
from ncfix_siemens.sinumerik.vocabulary import POLAR, POLES

FIXED = table(b"GgMmRr")
"""Letters after which a number is a code or a parameter, not a value."""

LETTERS = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_$"
LETTER, ADDRESS = table(LETTERS), table(LETTERS[:-2])
DIGITS, BLANKS = b"0123456789", b" \t"
DIGIT = table(DIGITS)
NAMES = table(LETTERS + DIGITS)

PASSIVE = re.compile(rb'"[^"\r\n]*"|(?P<comment>;[^\r\n]*)')
"""Strings and comments, whose digits are no numbers."""

PATH = re.compile(rb"(?im)^[ \t]*;[ \t]*\$PATH[ \t]*=")
"""The path line of an archive, which looks like a comment but is none."""


def scan(source: bytes, blocks: Ints) -> Scan:
    """Find the numbers and the shape of every block."""
    return in_slices(source, blocks, scan_slice)


def scan_slice(source: bytes, blocks: Ints) -> Scan:
    """As `scan`, for a slice of the text, to limit memory."""
    text = np.frombuffer(source, dtype=np.uint8)
    passive = list(matches(PASSIVE, source, b';"'))
    quiet = np.array([match.span() for match in passive], dtype=np.int64).reshape(-1, 2)
    final = [match.span() for match in passive if match["comment"] is not None]
    comments = np.array(final, dtype=np.int64).reshape(-1, 2)
    paths = PATH.finditer(source) if b";" in source else ()
    heads = block_of(blocks, np.array([match.start() for match in paths], dtype=np.int64)).tolist()
    found = scan_beside(text, blocks, quiet, comments, fixed=FIXED, named=in_names(text, source), apart=heads)
    signs = np.flatnonzero(SIGN[text[found.spans[:, 0]]])
    loose = signs[BLANK[text[found.spans[signs, 0] + 1]]]  # `- 5`: a sign, and a number
    return found.setting_apart(block_of(blocks, found.spans[loose, 0]).tolist())


def in_names(text: Bytes, source: bytes) -> Mask:
    """Mask (n,) of the bytes that belong to a name of two letters or more, or to the number of an extended address."""
    words = runs_of(NAMES[text])
    start = words[:, 0]
    second = text[np.minimum(start + 1, len(text) - 1)]
    named = np.zeros(len(text), dtype=np.bool_)
    fill(named, words[LETTER[text[start]] & LETTER[second]], True)
    places = np.flatnonzero(text == ord("="))
    single = extended_by_one(text, places)
    named[places[single] - 1] = True
    for place in places[~single].tolist():
        named[slice(*extension(source, place))] = True
    return named


def extended_by_one(text: Bytes, places: Ints) -> Mask:
    """Mask (n,) of the equals signs directly after an address of one letter and one digit, as in ` A3=`."""
    digit, letter, before = (text[np.maximum(places - back, 0)] for back in (1, 2, 3))
    return (places > 2) & DIGIT[digit] & ADDRESS[letter] & ~LETTER[before]


def extension(source: bytes, place: int) -> tuple[int, int]:
    """Start and stop of the number of an extended address before an equals sign at `place`; empty if it is none."""
    stop = place
    while stop and source[stop - 1] in BLANKS:
        stop -= 1
    start = stop
    while start and source[start - 1] in DIGITS:
        start -= 1
    alone = start > 0 and source[start - 1] in LETTERS[:-2] and (start == 1 or source[start - 2] not in LETTERS)
    return (start, stop) if alone else (stop, stop)


NOT_NUMBERED = "NCF256"
STEP = 10

BLOCK = re.compile(
    r"(?P<before>[ \t]*(?:/\d?[ \t]*)?)(?:N[ \t]*(?P<number>\d+)(?P<blank>[ \t]*))?(?P<rest>.*)",
    re.IGNORECASE | re.DOTALL,
)
WORDS = re.compile(r"[A-Z][ \t]*[-+=.\d]", re.IGNORECASE)
"""The beginning of a block of words, such as inserted blocks."""

LABEL = re.compile(r"[A-Z_]\w*[ \t]*:(?!=)", re.IGNORECASE)
HEAD = re.compile(r"[ \t]*%")
SILENT = re.compile(r'"[^"]*"|;.*', re.DOTALL)
JUMP = re.compile(r"\b(?:GOTO[FBC]?|REPEATB?)[ \t]+(?P<where>N[ \t]*\d+(?:[ \t]+N[ \t]*\d+)?)(?!\w)", re.IGNORECASE)
NUMBER = re.compile(r"N[ \t]*(\d+)", re.IGNORECASE)
BY_TEXT = re.compile(r'"[ \t]*N[ \t]*\d*[ \t]*"', re.IGNORECASE)
"""A string that is a block number or its beginning, from which the target of a jump may be composed."""


def renumbered(source: bytes) -> bytes:
    """A program with its blocks renumbered 10, 20, ...; in numbered programs, inserted blocks of words get numbers.

    Raises `RefusedError` NCF256 if a jump goes to a number that occurs twice, or that is composed at run time.
    """
    lines = source.decode("latin-1").splitlines(keepends=True)
    return "".join(line for unit in units(lines) for line in numbered(unit)).encode("latin-1")


def units(lines: list[str]) -> Iterator[list[str]]:
    """The lines of each program of an archive."""
    heads = [place for place, line in enumerate(lines) if HEAD.match(line)]
    edges = sorted({0, *heads, len(lines)})
    for begin, end in pairwise(edges):
        yield lines[begin:end]


def numbered(lines: list[str]) -> list[str]:
    """The lines of one program, renumbered."""
    blocks = [BLOCK.fullmatch(line) for line in lines]
    old = [int(block["number"]) for block in blocks if block is not None and block["number"]]
    if not old:
        return lines
    blank = next(block["blank"] for block in blocks if block is not None and block["number"])
    result, new, count = [], {}, 0
    for line, block in zip(lines, blocks, strict=True):
        bare = block is not None and WORDS.match(block["rest"]) and not LABEL.match(block["rest"])
        if block is None or not (block["number"] or bare):
            result.append(line)
            continue
        count += STEP
        if block["number"]:
            new[int(block["number"])] = count
        gap = block["blank"] if block["number"] else blank
        result.append(f"{block['before']}N{count}{gap}{block['rest']}")
    return [redirected(line, new, old) for line in result]


def redirected(line: str, new: dict[int, int], old: list[int]) -> str:
    """A line with its jumps redirected to the new numbers."""
    if BY_TEXT.search(line.split(";")[0]):
        raise RefusedError.of(NOT_NUMBERED, f"a jump may use a text as its block number: {line.strip()[:40]}")
    code = SILENT.sub(lambda found: " " * len(found[0]), line)
    pieces, done = [], 0
    for place, number in targets(code):
        if old.count(number) > 1:
            raise RefusedError.of(NOT_NUMBERED, f"a jump goes to N{number}, which appears more than once")
        pieces += [line[done : place[0]], str(new.get(number, number))]
        done = place[1]
    return "".join([*pieces, line[done:]])


def targets(code: str) -> list[tuple[tuple[int, int], int]]:
    """Span and value of each block number that is the target of a jump in a line."""
    return [
        (number.span(1), int(number[1]))
        for jump in JUMP.finditer(code)
        for number in NUMBER.finditer(code, jump.start("where"), jump.end())
    ]


ALL_OR_NONE = (
    "a block with only one polar coordinate depends on another block with polar coordinates that must stay unchanged"
)


def polar_words(template: Template) -> frozenset[str]:
    """The polar words (AP, RP) of a motion block; none for a block that sets the pole."""
    if not POLES.isdisjoint(template.g_codes):
        return frozenset()
    return frozenset(word.address for word in template.words) & POLAR


def has_partial(program: Program) -> bool:
    """Whether a block of the program has only one of AP and RP, and so uses the other of an earlier block."""
    return any(len(polar_words(template)) == 1 for template in program.templates)


def all_or_none(moves: Moves, program: Program) -> Moves:
    """The motions; if polar words depend on earlier blocks and one such motion cannot be corrected, all are refused."""
    if not has_partial(program):
        return moves
    shapes = [index for index, template in enumerate(program.templates) if polar_words(template)]
    polar = np.isin(program.template[moves.block], shapes)
    return moves.refused(polar, ALL_OR_NONE) if (polar & (moves.rule != Rule.CORRECT)).any() else moves
