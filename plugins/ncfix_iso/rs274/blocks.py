"""One block of RS274 by the grammar, and by the rules that a grammar cannot say.

Words that no code of their block uses are refused.
"""

from __future__ import annotations

import re
from collections.abc import Set
from dataclasses import dataclass

from lark import UnexpectedInput

from ncfix.control.expressions import Fault
from ncfix.text.build import Parsed, TooDeepError, build, check_exponents, check_numbers, start_of
from ncfix.text.dialect import Dialect
from ncfix.text.faults import BlockError, bare_expression, explain
from ncfix.text.grammar import Squeezed, parse, squeeze
from ncfix_iso.rs274.control import ARCS, RS274Control
from ncfix_iso.rs274.groups import CYCLES, TOOL_CHANGE, TURNING_CYCLES
from ncfix_iso.rs274.plans import Codes, RS274Plan

UNUSED = "NCF209"

DRILLING = tuple(code for code in CYCLES if code >= 810)


@dataclass(frozen=True, slots=True)
class Uses:
    """Which codes use an address: motion codes, other G codes of the block, M codes of the block; in tenths."""

    motions: frozenset[int] = frozenset()
    g_codes: frozenset[int] = frozenset()
    m_codes: frozenset[int] = frozenset()


def uses(motions: tuple[int, ...] = (), g: tuple[int, ...] = (), m: tuple[int, ...] = ()) -> Uses:
    """`Uses` from tuples; the cycles of turning use every address."""
    return Uses(frozenset((*motions, *TURNING_CYCLES)), frozenset(g), frozenset(m))


USER_M = tuple(range(1000, 2000, 10))
CUTTER_WORDS = (410, 411, 420, 421)

USED_BY: dict[str, Uses] = {
    "D": uses(g=(*CUTTER_WORDS, 960)),
    "E": uses((760,), m=(660, 670, 680)),
    "H": uses((760,), g=(430, 432)),
    "I": uses((*ARCS, 50, 51, 331, 760, 870), g=(100,)),
    "J": uses((*ARCS, 50, 51, 760, 870), g=(100,)),
    "K": uses((*ARCS, 330, 331, 760, 870)),
    "L": uses((52, 730, 760, *DRILLING), g=(100, *CUTTER_WORDS), m=(660, 980)),
    "P": uses(
        (*ARCS, 50, 52, 740, 760, 820, 840, 860, 880, 890),
        g=(40, 100, 640),
        m=(190, 500, 510, 520, 530, 620, 630, 640, 650, 660, 980, *USER_M),
    ),
    "Q": uses((50, 730, 760, 830), g=(100, 640), m=(190, 610, 660, 670, 680, *USER_M)),
    "R": uses((*ARCS, 730, 740, 760, *DRILLING), g=(100, 411, 421), m=(190,)),
}


def unused_word(letters: Set[str], motion: int | None, g_codes: Set[int], m_codes: Set[int]) -> str | None:
    """The first address that no code of the block uses."""
    for letter, users in USED_BY.items():
        used = motion in users.motions or g_codes & users.g_codes or m_codes & users.m_codes
        if letter in letters and not used:
            return letter
    return None


def has_own_codes(control: RS274Control, codes: Codes, motion: int | None) -> bool:
    """Whether codes of the dialect's own may use words of a block."""
    operations = control.rules.operations
    own = any(("G", code) in operations for code in codes.g.values())
    return own or any(("M", code) in operations for code in codes.m.values()) or motion in control.rules.tables


def check_words(control: RS274Control, plan: RS274Plan, codes: Codes, motion: int | None) -> None:
    """Raise `Fault` for a word that no code uses, where the control does."""
    if not control.rules.strict or motion in plan.checked or has_own_codes(control, codes, motion):
        return
    letter = unused_word(plan.letters, motion, frozenset(codes.g.values()), frozenset(codes.m.values()))
    if letter is not None:
        raise Fault(UNUSED, f"no code of the block uses the word {letter}", span=plan.span_of(letter))
    if plan.codes is not None:
        plan.checked.add(motion)


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
