"""One block of RS274 by the grammar, and by the rules that a grammar cannot say."""

from __future__ import annotations

import re

from lark import UnexpectedInput

from ncfix.text.build import Parsed, TooDeepError, build, check_exponents, check_numbers, start_of
from ncfix.text.dialect import Dialect
from ncfix.text.faults import BlockError, bare_expression, explain
from ncfix.text.grammar import Squeezed, parse, squeeze
from ncfix_iso.rs274.groups import TOOL_CHANGE

MAY_REPEAT = frozenset("GM")
"""The addresses that may stand several times in a block."""

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


def check_repeats(parsed: Parsed, standby: bool = True) -> None:
    """Refuse a word that stands twice; with `standby` not the tool that M6 has brought besides the one it changes."""
    seen: set[str] = set()
    may = MAY_REPEAT | {"T"} if standby and TOOL_CHANGE in parsed.template.m_codes else MAY_REPEAT
    for word in parsed.template.words:
        if word.address in seen and word.address not in may:
            raise BlockError("NCF117", f"the word {word.address} stands twice", start_of(word, parsed))
        seen.add(word.address)
