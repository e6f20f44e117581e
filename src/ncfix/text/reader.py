"""Reads a program from bytes to a `Program`.

A scan finds the numbers of all blocks. A block without its numbers is its shape. The grammar parses each shape once;
the resulting template serves every block of that shape, with the numbers of the scan. If scan and grammar find
different numbers in a block, that block is parsed by itself, and its template is used for its own text only.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator
from dataclasses import field
from functools import lru_cache
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Ints
from ncfix.diagnostics import Place, SourceError
from ncfix.text.build import Parsed
from ncfix.text.dialect import Dialect, check_content, detect, get, header_length
from ncfix.text.faults import BlockError
from ncfix.text.language import Language, language_of
from ncfix.text.reach import UNREAD, Reach
from ncfix.text.shapes import Scan, firsts
from ncfix.text.tree import END, START, Anchor, Opaque, Program, Span, Template
from ncfix.text.writer import line_end
from ncfix.values import mutable

MAX_CACHED = 5_000
"""Number of shapes and of texts of a dialect that are cached; the least recently used is dropped first."""

Value = TypeVar("Value")


class Memory(Generic[Value]):
    """A cache of values by key; the least recently used is dropped first."""

    def __init__(self) -> None:
        self._values: OrderedDict[bytes, Value] = OrderedDict()

    def __len__(self) -> int:
        return len(self._values)

    def recall(self, key: bytes) -> Value | None:
        """The value under `key`, which becomes the most recently used; None if it is not cached."""
        if key in self._values:
            self._values.move_to_end(key)
        return self._values.get(key)

    def keep(self, key: bytes, value: Value) -> None:
        """Store a value."""
        self._values[key] = value
        if len(self._values) > MAX_CACHED:
            self._values.popitem(last=False)


@lru_cache(maxsize=32)
def shapes_of(dialect: Dialect) -> Memory[Template]:
    """Cache of the templates of a dialect's shapes."""
    return Memory()


@lru_cache(maxsize=32)
def texts_of(dialect: Dialect) -> Memory[Parsed]:
    """Cache of a dialect's blocks that were parsed one by one."""
    return Memory()


def parse_block(dialect: Dialect, text: str) -> Parsed:
    """Parse one block by the grammar and the rules that a grammar cannot express; raises `BlockError`."""
    return language_of(dialect, Language).parse(dialect, text)


PART_BYTES = 1 << 22
"""Number of bytes scanned at once; more than one part of a long program."""

WHOLE_BLOCK = Span(Anchor(START, 0), Anchor(END, 0))


def opaque_block(kind: str) -> Parsed:
    """A block that is passed through as a whole."""
    return Parsed(Template((Opaque(kind, WHOLE_BLOCK),), 0), (), (), -1)


ONE_UNSCANNED = Scan([None], np.array([-1]), np.array([0, 0]), np.empty((0, 2), np.int64), np.empty(0))
"""The scan of a single block that was not scanned."""

AFTER_TAPE = opaque_block("after the end of the tape")
NOT_READ = opaque_block(UNREAD)


def read(source: bytes, path: str = "<program>", dialect: Dialect | str | None = None) -> Program:
    """Read an NC program; without `dialect` it is found from content and suffix.

    Raises SourceError NCF101 to NCF103 if the bytes are no program of that kind, NCF105 to NCF119 for the first line
    that cannot be parsed, and UsageError NCF104 for an unknown dialect.
    """
    chosen = detect(source, path) if dialect is None else dialect
    known = get(chosen) if isinstance(chosen, str) else chosen
    check_content(source, path, known)
    language = language_of(known, Language)
    blocks = language.split(source)
    blocks[0, 0] = header_length(source)
    return ProgramReading(source, path, known, language, blocks, language.end(source, blocks)).program()


def read_like(source: bytes, path: str, like: Program, control: str = "") -> Program:
    """Read a program in the dialect of `like`; if that is refused, in the dialect found from its own text.

    A flat program may have lost everything that identifies its dialect. Raises what `read` raises.
    """
    try:
        return read(source, path, like.dialect)
    except SourceError:
        return read(source, path, detect(source, path, control))


class PartColumns(NamedTuple):
    """Columns of a part of a program: first number of each block and the total, spans, values."""

    first: Ints
    spans: Ints
    values: Array


@mutable
class ProgramReading:
    """The state of reading one program, part by part.

    tape_end   the block that ends the tape
    templates  the templates found so far
    index      shape -> index of its template; a block without a shape is entered by its text and a line feed
    rows       index of each block's template, for the `done` blocks read so far
    reach      reachability after the first `followed` blocks; updated only when a block cannot be parsed
    first_line line number of the file at which the text begins
    line_end   first line end of the file; if not given, of the text
    """

    source: bytes
    path: str
    dialect: Dialect
    language: Language
    blocks: Ints
    tape_end: int
    templates: list[Template] = field(default_factory=list)
    index: dict[bytes | None, int] = field(default_factory=dict)
    rows: NDArray[np.int32] = field(init=False)
    done: int = 0
    reach: Reach = field(default_factory=Reach)
    followed: int = 0
    first_line: int = 1
    line_end: bytes = b""

    def __post_init__(self) -> None:
        self.rows = np.empty(len(self.blocks), dtype=np.int32)

    def program(self) -> Program:
        """Read all parts, then what follows the end of the tape."""
        parts = [self.part(first, stop) for first, stop in self.parts()]
        parts.append(self.tail())
        parts = [part for part in parts if len(part.first) > 1] or parts[:1]
        first, spans, values = parts[0] if len(parts) == 1 else joined_columns(parts)
        return Program(
            source=self.source,
            path=self.path,
            dialect=self.dialect,
            templates=tuple(self.templates),
            template=self.rows,
            blocks=self.blocks,
            first_number=first,
            number_spans=spans,
            numbers=values,
            first_line=self.first_line,
            line_end=self.line_end or line_end(self.source),
        )

    def parts(self) -> Iterator[tuple[int, int]]:
        """First block of each part and the block after its last; a very long line is a part of its own."""
        first, end = 0, min(self.tape_end + 1, len(self.blocks))
        while first < end:
            limit = self.blocks[first, 0] + PART_BYTES
            stop = max(int(np.searchsorted(self.blocks[:end, 1], limit, side="right")), first + 1)
            yield first, stop
            first = stop

    def part(self, first: int, stop: int) -> PartColumns:
        """Read the blocks from `first` up to `stop`."""
        found = self.scan(first, stop)
        known = np.array([self.index.get(shape, -1) for shape in found.shapes], dtype=np.int32)
        self.take(known if found.group is None else known[found.group])
        exact: dict[int, Parsed] = {}
        for row in np.flatnonzero(self.rows[first:stop] < 0).tolist():
            self.rows[first + row] = self.learn(first, row, found, exact)
        columns = with_exact(found, exact, self.blocks[first:stop, 0] - self.blocks[first, 0])
        return columns._replace(spans=moved_by(columns.spans, self.blocks[first, 0]))

    def tail(self) -> PartColumns:
        """The columns of the blocks after the end of the tape."""
        count = len(self.blocks) - self.done
        if count:
            self.take(np.full(count, self.number(b"\n", AFTER_TAPE.template), dtype=np.int32))
        return PartColumns(np.zeros(count + 1, np.int64), np.empty((0, 2), np.int64), np.empty(0))

    def take(self, templates: NDArray[np.int32]) -> None:
        """Record the templates of the next blocks."""
        stop = self.done + len(templates)
        self.rows[self.done : stop] = templates
        self.done = stop

    def scan(self, first: int, stop: int) -> Scan:
        """The shapes and numbers of a part; a line over the length limit has no shape."""
        blocks = self.blocks[first:stop]
        start, end = blocks[0, 0], blocks[-1, 1] if stop < len(self.blocks) else len(self.source)
        lengths = blocks[:, 1] - blocks[:, 0]
        limit = self.dialect.line_limit
        if limit and len(blocks) == 1 and lengths[0] > limit:
            return ONE_UNSCANNED
        found = self.language.scan(self.source[start:end], moved_by(blocks, -start))
        return found.setting_apart(np.flatnonzero(lengths > limit).tolist()) if limit else found

    def learn(self, first: int, row: int, scan: Scan, exact: dict[int, Parsed]) -> int:
        """The template index of a block of unknown shape, or of one parsed by itself, which is added to `exact`."""
        shape = scan.shapes[row if scan.group is None else scan.group[row]]
        if shape is not None:
            if shape in self.index:  # from a block further up in this part
                return self.index[shape]
            known = shapes_of(self.dialect).recall(shape)
            if known is not None:
                return self.number(shape, known)
        start, stop = self.blocks[first + row]
        text = self.source[start:stop]
        parsed = self.parsed(first + row, text)
        if parsed is NOT_READ:
            exact[row] = parsed
            return self.number(b"\n\n", parsed.template)
        if shape is not None and agrees(scan, row, parsed, start - self.blocks[first, 0]):
            shapes_of(self.dialect).keep(shape, parsed.template)
            return self.number(shape, parsed.template)
        texts_of(self.dialect).keep(text, parsed)
        exact[row] = parsed
        return self.number(text + b"\n", parsed.template)

    def number(self, key: bytes, template: Template) -> int:
        """The index of a template, which is entered under `key`."""
        if key not in self.index:
            self.index[key] = len(self.templates)
            self.templates.append(template)
        return self.index[key]

    def parsed(self, block: int, text: bytes) -> Parsed:
        """One block parsed by the grammar; raises SourceError, unless the control may never reach it."""
        known, limit = texts_of(self.dialect).recall(text), self.dialect.line_limit
        if known is not None:
            return known
        try:
            if limit and len(text) > limit:
                long = f"the line has {len(text)} characters; {self.dialect.title} accepts {limit}"
                raise BlockError("NCF105", long, limit, "break the line or shorten its comment")
            return parse_block(self.dialect, text.decode("latin-1"))
        except BlockError as fault:
            if self.language.lenient and self.in_doubt(block):
                return NOT_READ
            place = Place(self.path, block + self.first_line, fault.place + 1, text.decode("latin-1"))
            raise SourceError.of(fault.code, fault.text, place, fault.hint) from None

    def in_doubt(self, block: int) -> bool:
        """Whether the control may never reach a block."""
        for row in self.rows[self.followed : block].tolist():
            self.reach.follow(self.templates[row])
        self.followed = block
        return self.reach.in_doubt


def moved_by(places: Ints, offset: int) -> Ints:
    """Places moved by `offset`; the same array if it is zero."""
    return places + offset if offset else places


def agrees(scan: Scan, row: int, parsed: Parsed, start: int) -> bool:
    """Whether scan and grammar found the same numbers and the same comment at the end of the block."""
    spans = scan.spans[scan.first_number[row] : scan.first_number[row + 1]] - start
    comment = max(scan.comment[row] - start, -1)
    return bool(comment == parsed.comment and np.array_equal(spans, np.reshape(parsed.spans, (-1, 2))))


def with_exact(scan: Scan, exact: dict[int, Parsed], starts: Ints) -> PartColumns:
    """The columns of a scan, with the grammar's numbers for the blocks in `exact`."""
    if not exact:
        return PartColumns(scan.first_number, scan.spans, scan.values)
    counts = np.diff(scan.first_number)
    owner = np.repeat(np.arange(len(counts)), counts)
    keep = ~np.isin(owner, list(exact))
    parts = [(owner[keep], scan.spans[keep], scan.values[keep])]
    for row, parsed in exact.items():
        spans = np.array(parsed.spans, dtype=np.int64).reshape(-1, 2) + starts[row]
        parts.append((np.full(len(spans), row), spans, np.array(parsed.values)))
    owner, spans, values = (np.concatenate(column) for column in zip(*parts, strict=True))
    order = np.argsort(owner, kind="stable")
    return PartColumns(firsts(np.bincount(owner, minlength=len(counts))), spans[order], values[order])


def joined_columns(parts: list[PartColumns]) -> PartColumns:
    """The columns of consecutive parts, joined."""
    counts, spans, values = map(np.concatenate, zip(*((np.diff(each[0]), *each[1:]) for each in parts), strict=True))
    return PartColumns(firsts(counts), spans, values)
