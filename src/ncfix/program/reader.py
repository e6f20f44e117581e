"""From bytes to a `Program`: two lanes, one grammar.

The grammar decides what a block means. A block's shape is parsed once, and its template is then used for every block
of that shape, with the numbers that the scan found. Where the scan and the grammar do not see the same numbers the
block's own text is its shape, and its numbers are the grammar's.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from lark import UnexpectedInput
from numpy.typing import NDArray

from ncfix.diagnostics import Place, SourceError
from ncfix.program import dialects
from ncfix.program.build import Parsed, TooDeepError, build
from ncfix.program.dialect import Dialect
from ncfix.program.faults import BlockError, explain
from ncfix.program.grammar import parse, squeeze
from ncfix.program.shapes import Scan, scan, split_blocks
from ncfix.program.tree import Program, Template


def read(source: bytes, path: str = "<program>", dialect: Dialect | str | None = None) -> Program:
    """Read an NC program; `dialect` is found from content and suffix if it is not given.

    Raises SourceError NCF1xx with the first line that cannot be read, UsageError NCF104 for an unknown dialect.
    """
    chosen = dialects.detect(source, path) if dialect is None else dialect
    language = dialects.get(chosen) if isinstance(chosen, str) else chosen
    blocks = split_blocks(source)
    reading = Reading(source, path, language, blocks, scan(source, blocks))
    return reading.program()


def parse_block(dialect: Dialect, text: str) -> Parsed:
    """One block, by the grammar alone; raises `BlockError`."""
    squeezed = squeeze(text)
    try:
        return build(parse(dialect, squeezed.code), text, squeezed)
    except UnexpectedInput as error:
        raise explain(error, text, squeezed) from None
    except TooDeepError:
        raise BlockError("NCF118", "the expression is nested too deep", 0) from None


_CACHE: dict[tuple[str, bytes], Parsed] = {}


@dataclass(slots=True)
class Reading:
    """One program while it is being read."""

    source: bytes
    path: str
    dialect: Dialect
    blocks: NDArray[np.int64]
    scan: Scan
    templates: list[Template] = field(default_factory=list)
    index: dict[bytes, int] = field(default_factory=dict)
    exact: dict[int, Parsed] = field(default_factory=dict)

    def program(self) -> Program:
        """Read all blocks."""
        template = [self.index.get(key, -1) if key else -1 for key in self.scan.shapes]
        for block, shape in enumerate(self.scan.shapes):
            template[block] = self.index.get(shape, -1) if shape is not None else -1
            if template[block] < 0:
                template[block] = self.learn(block, shape)
        first, spans, values = self.columns()
        return Program(
            self.source,
            self.path,
            self.dialect,
            tuple(self.templates),
            np.array(template, dtype=np.int32),
            self.blocks,
            first,
            spans,
            values,
        )

    def learn(self, block: int, shape: bytes | None) -> int:
        """The template of a block that is the first of its shape, or whose shape has to be its text."""
        start, stop = self.blocks[block]
        text = self.source[start:stop]
        parsed = self.parsed(block, text)
        key = text + b"\n"
        if shape is not None and self.agrees(block, parsed):
            key = shape
        else:
            self.exact[block] = parsed
        if key not in self.index:
            self.index[key] = len(self.templates)
            self.templates.append(parsed.template)
        return self.index[key]

    def parsed(self, block: int, text: bytes) -> Parsed:
        """One block by the grammar; raises SourceError."""
        known = _CACHE.get((self.dialect.name, text))
        if known is not None:
            return known
        try:
            parsed = parse_block(self.dialect, text.decode("latin-1"))
        except BlockError as fault:
            place = Place(self.path, block + 1, fault.place + 1, text.decode("latin-1"))
            raise SourceError.of(fault.code, fault.text, place, fault.hint) from None
        _CACHE[self.dialect.name, text] = parsed
        return parsed

    def agrees(self, block: int, parsed: Parsed) -> bool:
        """Whether the scan saw the same numbers, and the same comment at the end, as the grammar."""
        numbers = slice(*self.scan.first_number[block : block + 2])
        start = self.blocks[block, 0]
        spans = self.scan.spans[numbers] - start
        comment = max(self.scan.comment[block] - start, -1)
        return bool(comment == parsed.comment and np.array_equal(spans, np.reshape(parsed.spans, (-1, 2))))

    def columns(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
        """first_number, number_spans and numbers, with those of the exact blocks in their places."""
        first, spans, values = self.scan.first_number, self.scan.spans, self.scan.values
        if not self.exact:
            return first, spans, values
        counts = np.diff(first)
        owner = np.repeat(np.arange(len(counts)), counts)
        keep = ~np.isin(owner, list(self.exact))
        parts = [(owner[keep], spans[keep], values[keep])]
        for block, parsed in self.exact.items():
            own = np.reshape(np.array(parsed.spans, dtype=np.int64), (-1, 2)) + self.blocks[block, 0]
            parts.append((np.full(len(own), block), own, np.array(parsed.values)))
        owner, spans, values = (np.concatenate(column) for column in zip(*parts, strict=True))
        order = np.argsort(owner, kind="stable")
        first = np.searchsorted(owner[order], np.arange(len(counts) + 1))
        return first, spans[order], values[order]
