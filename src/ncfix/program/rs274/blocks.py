"""One block of RS274 by the grammar, and by the rules that a grammar cannot say."""

from __future__ import annotations

import re
from math import isfinite

from lark import UnexpectedInput

from ncfix.program.build import Parsed, TooDeepError, build
from ncfix.program.dialect import Dialect
from ncfix.program.faults import BlockError, bare_expression, explain
from ncfix.program.grammar import Squeezed, parse, squeeze
from ncfix.program.rs274.groups import TOOL_CHANGE
from ncfix.program.tree import Constant, Word

MAY_REPEAT = frozenset("GM")
"""The addresses that may stand several times in a block."""

G_WITH_E = frozenset({470, 700, 760, 1870})
M_WITH_E = frozenset({660, 670, 680})
"""They take an E word, so that `H2E1` is two words there: G70, G76, M66, M67, M68 of LinuxCNC ("G codes", "M codes"),
G47 and G187 of Haas."""

PRODUCT = re.compile(r"#[^(;\[]*(?P<operator>\*)\d+(?=;|$)")
"""A parameter, and behind it outside brackets what a check number looks like."""


def parse_block(dialect: Dialect, text: str) -> Parsed:
    """One block, by the grammar and the rules that a grammar cannot say; raises `BlockError`."""
    squeezed = squeeze(text)
    try:
        parsed = build(parse(dialect, squeezed.code), text, squeezed)
    except UnexpectedInput as error:
        raise explain(error, text, squeezed) from None
    except TooDeepError as error:
        place = squeezed.places[error.position]
        raise BlockError("NCF118", "the expression is nested too deep, or too long", place) from None
    check_products(squeezed)
    check_numbers(parsed)
    check_exponents(parsed, text)
    check_repeats(parsed, standby=dialect.semantics != "linuxcnc")
    return parsed


def check_products(squeezed: Squeezed) -> None:
    """Refuse `X#1*2`: it would be read as X#1 and a check number, which no program with parameters has."""
    if found := PRODUCT.search(squeezed.code):
        raise bare_expression(squeezed.places[found.start("operator")])


def check_numbers(parsed: Parsed) -> None:
    """Refuse a number that no double can hold."""
    for (start, _), value in zip(parsed.spans, parsed.values, strict=True):
        if not isfinite(value):
            raise BlockError("NCF115", "the number is too large", start)
    for word in parsed.template.words:
        if isinstance(word.value, Constant) and not isfinite(word.value.value):
            raise BlockError("NCF115", "the number is too large", start_of(word, parsed))


def check_exponents(parsed: Parsed, text: str) -> None:
    """Refuse `X1e-5`: it would be read as X1 and a word E."""
    template = parsed.template
    if not (G_WITH_E.isdisjoint(template.g_codes) and M_WITH_E.isdisjoint(template.m_codes)):
        return
    for word in template.words:
        start = start_of(word, parsed)
        if word.address == "E" and start and text[start - 1] in "0123456789.":
            hint = "write the number out; if a word E is meant, put a blank before it"
            raise BlockError("NCF116", "the number has an exponent", start, hint)


def check_repeats(parsed: Parsed, standby: bool = True) -> None:
    """Refuse a word that stands twice; with `standby` not the tool that M6 has brought besides the one it changes."""
    seen: set[str] = set()
    may = MAY_REPEAT | {"T"} if standby and TOOL_CHANGE in parsed.template.m_codes else MAY_REPEAT
    for word in parsed.template.words:
        if word.address in seen and word.address not in may:
            raise BlockError("NCF117", f"the word {word.address} stands twice", start_of(word, parsed))
        seen.add(word.address)


def start_of(word: Word, parsed: Parsed) -> int:
    """Where a word starts in its block."""
    slot, offset = word.span.start
    return offset if slot < 0 else parsed.spans[slot][1] + offset
