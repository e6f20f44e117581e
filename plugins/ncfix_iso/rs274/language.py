"""The RS274 family as a `WrittenLanguage`: LinuxCNC, plain ISO code and similar languages.

Some languages express the codes of this family in words: MOVE X=10 FEED=500 for G1 X10 F500. They have their own
grammar, with `Dialect.keywords`. Each inserted line states its motion, because these languages have no modal motion.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from ncfix.control.interpreter import RUNTIME
from ncfix.diagnostics import SourceError
from ncfix.plugins import working
from ncfix.text.build import (
    Parsed,
    TooDeepError,
    TreeBuilder,
    build,
    check_exponents,
    check_numbers,
    is_token,
    kind,
    start_of,
)
from ncfix.text.dialect import Dialect
from ncfix.text.faults import BlockError, bare_expression, explain
from ncfix.text.grammar import UnparsedError, UnspacedBlock, parse, parser, squeeze
from ncfix.text.language import BulkLayout
from ncfix.text.layout import AXIS_LETTERS, Layout, arc_layout, bulk_layout, has_free_text, layout_of
from ncfix.text.reach import tape_end
from ncfix.text.shapes import scan, split_blocks
from ncfix.text.spelling import Spelling
from ncfix.text.tree import Program, Word
from ncfix.writer.block import BlockWriter
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.target import Target
from ncfix_iso.rs274.control import RS274Control
from ncfix_iso.rs274.groups import RULES, TOOL_CHANGE
from ncfix_iso.rs274.interpreter import RS274Interpreter

if TYPE_CHECKING:
    from ncfix.control.interpreter import FlatLine
    from ncfix.text.build import Branch


MAY_REPEAT = frozenset("GM")
"""Addresses that may occur several times in a block."""

NO_KEYWORD = "the correction needs a word for {}, but the language has none"
NO_TREE = "the grammar has to make a tree of words and values, as common.lark does, and made"

PRODUCT = re.compile(r"#[^(;\[]*(?P<operator>\*)\d+(?=;|$)")
"""A parameter, followed outside brackets by something that looks like a checksum.

`X#1*2` would be read as X#1 and a checksum. Programs with parameters have none: it is refused.
"""


def parse_block(dialect: Dialect, text: str) -> Parsed:
    """Parse one block by the grammar and the rules that a grammar cannot express; raises `BlockError`."""
    squeezed = squeeze(text)
    parsed = parsed_words(dialect, text, squeezed)
    if product := PRODUCT.search(squeezed.code):
        raise bare_expression(squeezed.places[product.start("operator")])
    check_numbers(parsed)
    check_exponents(parsed, text)
    check_repeats(parsed, standby=dialect.semantics != "linuxcnc")
    return parsed


def parsed_words(
    dialect: Dialect, text: str, squeezed: UnspacedBlock, maker: type[TreeBuilder] | None = None
) -> Parsed:
    """Parse one block by the grammar alone. `BlockError` if it fails; NCF507 if a plugin's grammar makes a bad tree."""
    try:
        tree = parse(dialect, squeezed.code)
    except UnparsedError as error:
        raise explain(error.place, text, squeezed) from None
    try:
        return build(tree, text, squeezed, maker, dialect.keywords)
    except TooDeepError as error:
        place = squeezed.places[error.position]
        raise BlockError("NCF118", "the expression is nested too deep, or too long", place) from None
    except (AssertionError, AttributeError, LookupError, TypeError, ValueError) as error:
        with working("dialects", dialect.name):
            raise ValueError(f"{Path(dialect.grammar).name}: {NO_TREE} {shown(tree)}, from {text.strip()!r}") from error


def shown(tree: Branch) -> str:
    """A tree in one line: word(ADDRESS X, literal(NUMBER 1))."""
    inside = (f"{kind(each)} {each}" if is_token(each) else shown(each) for each in tree.children)
    return f"{kind(tree)}({', '.join(inside)})"


def check_repeats(parsed: Parsed, standby: bool = True) -> None:
    """Refuse a word that occurs twice; with `standby`, M6 may name a second tool, to be prepared."""
    seen: set[str] = set()
    may = MAY_REPEAT | {"T"} if standby and TOOL_CHANGE in parsed.template.m_codes else MAY_REPEAT
    for word in parsed.template.words:
        if word.address in seen and word.address not in may:
            raise BlockError("NCF117", f"the word {word.address} appears twice", start_of(word, parsed))
        seen.add(word.address)


def writable(program: Program, block: int) -> Layout | None:
    """The layout of a block of words; None for flow control and opaque text."""
    return None if has_free_text(program, block) else layout_of(program, block)


def plain(program: Program) -> Spelling:
    """The spelling of numbers: unsigned unless the dialect signs them, with a point in place of expressions."""
    return Spelling(signed=program.dialect.signed)


def has_keywords(dialect: Dialect) -> bool:
    """Whether blocks of a dialect are written otherwise than with letters and numbers."""
    return bool(dialect.keywords or dialect.assign or dialect.signed)


def reads_codes(dialect: Dialect) -> bool:
    """Whether blocks of a dialect may contain G codes besides its keywords."""
    return any(terminal.name.endswith("CODE") for terminal in parser(dialect.grammar).terminals)


class KeywordWriter(BlockWriter):
    """Writes one motion into one block, with the dialect's keywords for codes and addresses."""

    @cached_property
    def spelled(self) -> dict[str, str]:
        """Code or address -> its keyword; the first of several."""
        return {meaning: word for word, meaning in reversed(self.program.dialect.keywords)}

    def _cased(self, address: str) -> str:
        return super()._cased(self.spelled.get(address, address)) + self.program.dialect.assign

    def _code(self, number: str) -> str:
        """A G code in the words of the language; a conflict if it has none."""
        if not self.program.dialect.keywords:
            return super()._cased("G") + number
        word = self.spelled.get(f"G{number}", "")
        if not word and reads_codes(self.program.dialect):
            return super()._cased("G") + number
        if not word:
            self.out.conflict = self.out.conflict or NO_KEYWORD.format(f"G{number}")
        return word

    def _restate(self, word: Word, number: str) -> None:
        if self.program.dialect.keywords:
            self.out.edits.append((*self.program.span(self.block, word.span), self._code(number)))
        else:
            super()._restate(word, number)

    def _opening(self, wanted: int) -> list[str]:
        """The beginning of an inserted line: its motion, because these languages have no modal motion."""
        if not self.program.dialect.keywords:
            return super()._opening(wanted)
        self.code = self.code if self.target.arcs is None else wanted
        return [self._code(f"{self.code // 10}")]

    def _feed_mode(self, number: str) -> None:
        word = self.layout.feed_mode
        if word is None or not self.program.dialect.keywords:
            super()._feed_mode(number)
        else:
            self._restate(word, number)


def writer_of(program: Program, block: int, layout: Layout, target: Target, spelling: Spelling) -> BlockWriter:
    """The writer of a block's motion."""
    kind = KeywordWriter if has_keywords(program.dialect) else BlockWriter
    return kind(program, block, layout, target, spelling)


def in_bulk(program: Program, block: int) -> BulkLayout | None:
    """What is needed to write motions of this shape many at a time; None if they need `BlockWriter`."""
    moving = any(word.address in AXIS_LETTERS for word in program.template_of(block).words)
    layout = writable(program, block) if moving and not has_keywords(program.dialect) else None
    found = None if layout is None else bulk_layout(program, block, layout)
    if layout is None or found is None:
        return None
    return replace(found, further=not (layout.after or layout.prefix), arc=arc_layout(program, block, layout))


def unroll(interpreter: RS274Interpreter, steps: Mapping[str, float], limit: int) -> Sequence[FlatLine]:
    """See `FollowedLanguage`; raises SourceError if the program cannot be written out flat."""
    from ncfix_iso.rs274.flatten import RS274Flattener

    if has_keywords(interpreter.dialect):
        text = "flat programs are G code, but this language is not"
        raise SourceError.of(RUNTIME, text, interpreter.place())
    flattener = RS274Flattener(interpreter.control, steps, limit)
    interpreter.watcher, interpreter.control.ends = flattener, []
    interpreter.run()
    lines = flattener.lines
    begins, ends = (lines[at].text.lstrip()[:1] == "%" if lines else False for at in (0, -1))
    if begins and (not ends or len(lines) == 1):
        flattener.write("%")
    return lines


RS274 = WrittenLanguage(
    split=split_blocks,
    end=tape_end,
    scan=scan,
    parse=parse_block,
    control=RS274Control,
    interpreter=RS274Interpreter,
    layout=writable,
    same_per_shape=True,
    writer=writer_of,
    spelling=plain,
    lenient=True,
    unroll=unroll,
    arc_pieces=True,
    bulk=in_bulk,
    semantics=frozenset(RULES),
    own_codes=True,
)
