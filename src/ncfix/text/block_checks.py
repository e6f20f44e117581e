"""What a grammar cannot say of the words of a block, in every language that has words."""

from __future__ import annotations

from math import isfinite

from ncfix.text.build import Parsed
from ncfix.text.faults import BlockError
from ncfix.text.tree import Constant, Word

G_WITH_E = frozenset({470, 700, 760, 1870})
M_WITH_E = frozenset({660, 670, 680})
"""They take an E word, so that `H2E1` is two words there: G70, G76, M66, M67, M68 of LinuxCNC ("G codes", "M codes"),
G47 and G187 of Haas."""


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


def start_of(word: Word, parsed: Parsed) -> int:
    """Where a word starts in its block."""
    slot, offset = word.span.start
    return offset if slot < 0 else parsed.spans[slot][1] + offset
