"""The lossless tree of an NC program: blocks as spans of the source, their words as shared templates.

A program has many blocks and few *shapes*: a shape is the text of a block with its numbers replaced. There is one
`Template` per shape, made from the Lark tree of its first block. A block is a reference to its template, with the
positions and values of its own numbers in arrays. The source bytes are kept unchanged, so whatever is not edited is
written exactly as it was read.

A place inside a block is an `Anchor`: a number of bytes after the end of the block's number `slot` (slot -1: after the
start of the block; slot -2: after its end, with an offset of zero or less). It is valid for every block of the shape,
whatever the lengths of its numbers and of its final comment.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ncfix.arrays import Array, Ints
from ncfix.diagnostics import Place
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.text.dialect import Dialect


START = -1
"""Slot of anchors relative to the start of the block."""

END = -2
"""Slot of anchors relative to the end of the block."""


class Anchor(NamedTuple):
    """A place in every block of a shape: `offset` bytes after the end of number `slot`, or after `START` or `END`."""

    slot: int
    offset: int


class Span(NamedTuple):
    """A range of a block, from `start` up to `stop`."""

    start: Anchor
    stop: Anchor


# -- expressions ------------------------------------------------------------------------------------------------------


@frozen
class Literal:
    """A number written in the block: the value of number `slot` of the block.

    `pointless`: it has no decimal point, in a language where that changes its meaning: the value of an axis word may
    then count least increments. `Program.numbers` holds it as written.
    """

    slot: int
    pointless: bool = False


@frozen
class Constant:
    """A number that is the same in every block of the shape: a plain, unsigned number after G or M."""

    value: float


@frozen
class NumberedParameter:
    """A numbered parameter, `#5`, `##5`, `#[1+2]`."""

    index: Expression


@frozen
class NamedParameter:
    """A named parameter, `#<depth>`, `#<_global>`; the name is lower case without blanks."""

    name: str


@frozen
class Unary:
    """`-x`, `+x`, or a function of one argument: `sin`, `cos`, `fix`, ... (lower case)."""

    operator: str
    operand: Expression


@frozen
class Binary:
    """`left operator right`; the operator in lower case: `+ - * / ** mod and or xor eq ne gt ge lt le atan`."""

    operator: str
    left: Expression
    right: Expression


@frozen
class Exists:
    """`EXISTS[#<name>]` or `EXISTS[#5]`."""

    parameter: NumberedParameter | NamedParameter


@frozen
class StringLiteral:
    """A string, `"DRILL 8.5"`, without its quotation marks."""

    value: str


@frozen
class FunctionCall:
    """A name with arguments in brackets, lower case: a function, `SIN(R1)`, or an element of an array, `BORE[2]`.

    An omitted argument is None. `indexed`: the brackets are square.
    """

    name: str
    arguments: tuple[Expression | None, ...]
    indexed: bool = False


Expression = (
    Literal | Constant | NumberedParameter | NamedParameter | Unary | Binary | Exists | StringLiteral | FunctionCall
)


# -- the items of a block ---------------------------------------------------------------------------------------------


@frozen
class Word:
    """An address with its value, `X12.5`, `G[#1]`; the address in upper case. `value_span` covers the value only.

    The value is a `Literal` or `Constant` only if a plain number is written: `X[4]` is `+4`, a `Unary`.
    """

    address: str
    value: Expression
    span: Span
    value_span: Span


@frozen
class Assignment:
    """`#1=...`, `#<name>=...`: takes effect after the whole block."""

    target: NumberedParameter | NamedParameter | FunctionCall
    value: Expression
    span: Span


@frozen
class Command:
    """A name that stands alone or has arguments in brackets, lower case: `SUPA`, `CYCLE81(10,0,2,-5)`.

    An omitted argument is None. `called`: there are brackets, perhaps empty ones.
    """

    name: str
    arguments: tuple[Expression | None, ...]
    called: bool
    span: Span


@frozen
class Comment:
    """`( ... )`, `; ...` or another form of the dialect; delimiters included in the span."""

    span: Span


@frozen
class Skip:
    """Block skip `/` with its level; without a number, the lowest level (0 on SINUMERIK, else 1)."""

    level: int
    span: Span


@frozen
class OWordLine:
    """A flow-control line of RS274NGC: `o100 while [...]`, `o<name> call [..]`.

    `label` is the name, or the number without leading zeros, as text (`o100` and `o<100>` are the same), else an
    expression whose rounded value is that number. `keyword` is lower case; it is `program` for a bare program number
    (`O1234`, `:1234`), which starts a program or a subprogram that M98 calls.
    """

    label: str | Expression
    keyword: str
    arguments: tuple[Expression, ...]
    span: Span


@frozen
class Tape:
    """The `%` that starts and ends a tape."""

    span: Span


@frozen
class Opaque:
    """Text that is known to cause no motion and is passed through: program names, text after the end, ..."""

    kind: str
    span: Span


Item = Word | Assignment | Command | Comment | Skip | OWordLine | Tape | Opaque


BEYOND = 1e9
"""Largest number of a G or M code; all larger ones are invalid and treated alike."""


@frozen
class Template:
    """What all blocks of one shape have in common.

    items      the items of the block, in the order written
    n_numbers  the number of its numbers; `Literal.slot` and `Anchor.slot` count them from 0
    g_codes    the constant G codes in tenths (G1 is 10, G38.2 is 382), in the order written
    m_codes    the constant M codes in tenths, in the order written
    slots      address -> slot, for words with a plain number; without G and M, which may occur several times
    """

    items: tuple[Item, ...]
    n_numbers: int
    g_codes: tuple[int, ...] = field(init=False, compare=False, repr=False)
    m_codes: tuple[int, ...] = field(init=False, compare=False, repr=False)
    slots: Mapping[str, int] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        literals = {word.address: word.value.slot for word in self.words if isinstance(word.value, Literal)}
        object.__setattr__(self, "g_codes", self._codes("G"))
        object.__setattr__(self, "m_codes", self._codes("M"))
        object.__setattr__(self, "slots", {key: slot for key, slot in literals.items() if key not in "GM"})

    def _codes(self, address: str) -> tuple[int, ...]:
        values = (word.value for word in self.words if word.address == address)
        return tuple(round(10 * min(value.value, BEYOND)) for value in values if isinstance(value, Constant))

    @property
    def words(self) -> tuple[Word, ...]:
        """The words of the block in the order written."""
        return tuple(item for item in self.items if isinstance(item, Word))


# -- the program ------------------------------------------------------------------------------------------------------


@frozen(eq=False)
class Program:
    """An NC program, lossless. One row per block (a line of the source, or several where the dialect continues lines).

    source        the bytes as read
    path          as given by the user, for messages
    dialect       the dialect it was read in
    templates     the templates of its shapes
    template      (n,) index into `templates`
    blocks        (n, 2) start and stop byte of each block, without the line end
    first_number  (n + 1,) the numbers of block i are first_number[i] : first_number[i + 1]
    number_spans  (m, 2) start and stop byte of each number in the source, including the sign
    numbers       (m,) their values as written (in the program's units)
    first_line    line number of the file at which `source` begins, if it is a part of the file
    line_end      first line end of the file, which is also used for new lines
    """

    source: bytes
    path: str
    dialect: Dialect
    templates: tuple[Template, ...]
    template: NDArray[np.int32]
    blocks: Ints
    first_number: Ints
    number_spans: Ints
    numbers: Array
    first_line: int = 1
    line_end: bytes = b"\n"
    _lines_ended: int = field(default=-1, init=False, repr=False, compare=False)

    def __len__(self) -> int:
        return len(self.template)

    def text_of(self, block: int) -> str:
        """The text of a block, decoded as Latin-1 (one character per byte)."""
        start, stop = self.blocks[block]
        return self.source[start:stop].decode("latin-1")

    def template_of(self, block: int) -> Template:
        """The template of a block."""
        return self.templates[int(self.template[block])]

    def items_of(self, block: int) -> tuple[Item, ...]:
        """The items of a block."""
        return self.template_of(block).items

    def values_of(self, block: int) -> Array:
        """The values of the block's numbers, by slot, (k,), as written."""
        return self.numbers[self.first_number[block] : self.first_number[block + 1]]

    def column(self, address: str) -> Array:
        """The plain number after an address in each block, (n,); NaN if there is none, or no plain one."""
        slot = np.array([template.slots.get(address, -1) for template in self.templates], dtype=np.int64)[self.template]
        values = np.full(len(self), np.nan)
        rows = np.flatnonzero(slot >= 0)
        values[rows] = self.numbers[self.first_number[rows] + slot[rows]]
        return values

    def position(self, block: int, anchor: Anchor) -> int:
        """The byte of the source at an anchor of this block."""
        if anchor.slot < 0:
            return int(self.blocks[block, 0 if anchor.slot == START else 1]) + anchor.offset
        return int(self.number_spans[self.first_number[block] + anchor.slot, 1]) + anchor.offset

    def span(self, block: int, span: Span) -> tuple[int, int]:
        """Start and stop byte of a span of this block."""
        return self.position(block, span.start), self.position(block, span.stop)

    def slice(self, block: int, span: Span) -> str:
        """The text of a span of this block, decoded as Latin-1."""
        start, stop = self.span(block, span)
        return self.source[start:stop].decode("latin-1")

    @property
    def lines_ended(self) -> int:
        """Number of line ends in the text, counted once; a block may have several."""
        if self._lines_ended < 0:
            object.__setattr__(self, "_lines_ended", _counted(self.source, "\n"))
        return self._lines_ended

    def line(self, block: int) -> int:
        """The line number (from 1) at which the block starts."""
        if self.lines_ended + (not self.source.endswith(b"\n")) == len(self.blocks):
            return self.first_line + block  # each block is a line
        character = "\n" if b"\n" in self.source else "\r"
        return self.first_line + self.lines_ended_before(int(self.blocks[block, 0]), character)

    def lines_ended_before(self, stop: int, character: str = "\n") -> int:
        """Number of line ends before a byte."""
        if character == "\n" and 2 * stop > len(self.source):
            return self.lines_ended - _counted(self.source, character, stop)
        return _counted(self.source, character, 0, stop)

    def lines(self, blocks: NDArray[np.integer[Any]]) -> Ints:
        """The line numbers at which blocks (n,) start."""
        text = np.frombuffer(self.source, dtype=np.uint8)
        ends = np.flatnonzero(text == ord("\n" if b"\n" in self.source else "\r"))
        return self.first_line + np.searchsorted(ends, self.blocks[blocks, 0])

    def place(self, block: int, span: Span | None = None) -> Place:
        """The place of a block, or of a span of it, in the file: for messages."""
        column = 0
        if span is not None:
            column = self.position(block, span.start) - int(self.blocks[block, 0]) + 1
        return Place(self.path, self.line(block), column, self.text_of(block))

    def __iter__(self) -> Iterator[int]:
        return iter(range(len(self)))


def _counted(text: bytes, character: str, start: int = 0, stop: int | None = None) -> int:
    """Number of occurrences of a character; several times faster than `bytes.count` if there are many."""
    return int(np.count_nonzero(np.frombuffer(text, dtype=np.uint8)[start:stop] == ord(character)))


def view(array: NDArray[Any]) -> Sequence[Any]:
    """An array as a sequence that makes plain Python numbers on access."""
    return memoryview(np.ascontiguousarray(array))  # type: ignore[arg-type]
