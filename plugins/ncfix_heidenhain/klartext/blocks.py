"""Reading Klartext: the blocks of a text, with lines that `~` joins; their shapes; and the template of each shape.

A block that is not Klartext does not make the file faulty: the control loads it, marks the block as ERROR, and stops
when it gets there. So it is kept as opaque text of the kind `UNREAD`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ncfix import core
from ncfix.arrays import Bytes, Ints, Mask
from ncfix.control.expressions import Fault, Unknown
from ncfix.text.build import MAX_DEPTH, Parsed, TooDeepError, TreeBuilder, edges, is_token, kind, tokens_of
from ncfix.text.dialect import Dialect
from ncfix.text.grammar import UnparsedError, UnspacedBlock, parse
from ncfix.text.numbers import POINT, SIGN, table
from ncfix.text.reach import UNREAD
from ncfix.text.shapes import ODD, Scan, block_of, blocks_at, in_slices, scan_beside, scan_compiled, split_blocks
from ncfix.text.spelling import value_of
from ncfix.text.tree import (
    END,
    Anchor,
    Assignment,
    Binary,
    Command,
    Comment,
    Constant,
    Expression,
    FunctionCall,
    Item,
    Literal,
    NamedParameter,
    Opaque,
    OWordLine,
    Skip,
    Span,
    StringLiteral,
    Template,
    Unary,
    Word,
)
from ncfix_heidenhain.klartext.control import KlartextControl
from ncfix_heidenhain.klartext.plans import MOVING, SIZES, owners

if TYPE_CHECKING:
    from lark import Token

    from ncfix.text.build import Branch, Node

COMMENT = re.compile(rb";[^\r\n]*")
JOINED = re.compile(rb"~[ \t]*(?=\r*\n)")
"""The mark at the end of a line that continues in the next line."""

FIXED = table(b"QqRrMmNn")
"""Letters after which a number belongs, or may belong, to the shape (`Q5`, `R0`, `M3`); the grammar decides."""

WITHIN_NONE = ODD | table(b"\x0b")
"""Bytes that no block with a shape contains; line ends within a block are among them."""

SMALL_BYTES = 1 << 14
"""A text of up to so many bytes is not halved any more to set apart the blocks that have no shape."""

COMMAS = bytes.maketrans(b",\n", b".\x0b")
"""For the scan only: decimal commas become points, and line feeds vertical tabs; every byte keeps its place."""


def split(source: bytes) -> Ints:
    """Start and stop byte of each block, shape (n, 2); lines that `~` joins are one block."""
    lines = split_blocks(source)
    marks = np.array([match.start() for match in JOINED.finditer(source)], dtype=np.int64)
    if not len(marks):
        return lines
    continued = np.zeros(len(lines), dtype=np.bool_)
    continued[block_of(lines, marks)] = True
    continued[-1] = False
    starts = np.append(True, ~continued[:-1])
    return np.stack((lines[starts, 0], lines[~continued, 1]), axis=1)


def scan(source: bytes, blocks: Ints) -> Scan:
    """Find the numbers and the shape of every block; a block of several lines has no shape, and is read by itself."""
    if core.engaged():
        text = np.frombuffer(source.translate(COMMAS), dtype=np.uint8)
        found = scan_compiled(text, blocks, False, b";", FIXED, WITHIN_NONE)
        if found is not None:
            return found.setting_apart(misnumbered(text, blocks, found))
        if len(source) > SMALL_BYTES and len(blocks) > 1:
            return in_halves(source, blocks)
    return in_slices(source, blocks, scan_plain)


def in_halves(source: bytes, blocks: Ints) -> Scan:
    """As `scan`, for each half of a text in which some block has no shape, so that the other half is scanned fast."""
    middle = len(blocks) // 2
    at = int(blocks[middle, 0])
    return Scan.joined([(0, scan(source[:at], blocks[:middle])), (at, scan(source[at:], blocks[middle:] - at))])


def scan_plain(source: bytes, blocks: Ints) -> Scan:
    """As `scan`, with numpy alone."""
    text = np.frombuffer(source.translate(COMMAS), dtype=np.uint8)
    comments = np.array([match.span() for match in COMMENT.finditer(source)], dtype=np.int64).reshape(-1, 2)
    comments = comments[inside(blocks, comments[:, 0])]
    found = scan_beside(
        text,
        blocks,
        comments,
        comments,
        fixed=FIXED,
        apart=blocks_at(blocks, np.flatnonzero(text == COMMAS[ord("\n")])),
    )
    return found.setting_apart(misnumbered(text, blocks, found))


def misnumbered(text: Bytes, blocks: Ints, found: Scan) -> list[int]:
    """The blocks that begin with a number that is no block number, because it has a sign or a point."""
    rows = np.flatnonzero(np.diff(found.first_number))
    spans, begins = found.spans[found.first_number[rows]], blocks[rows, 0]
    points = np.append(np.flatnonzero(text == POINT), len(text))
    pointed = points[np.searchsorted(points, spans[:, 0])] < spans[:, 1]
    apart = (spans[:, 0] == begins) | BEFORE_NUMBER[text[spans[:, 0] - 1]]
    suspicious = np.flatnonzero(apart & (pointed | SIGN[text[spans[:, 0]]]))
    leading = text.tobytes() if len(suspicious) else b""
    return [int(rows[row]) for row in suspicious if not leading[begins[row] : spans[row, 0]].strip(BEFORE_NUMBERS)]


def inside(blocks: Ints, places: Ints) -> Mask:
    """(n,) whether places, in bytes, are inside a block."""
    return places < blocks[block_of(blocks, places), 1]


BEFORE_NUMBERS = b" \t\x0b\x0c\xa0/"
BEFORE_NUMBER = table(BEFORE_NUMBERS)
"""Bytes that may stand before a block number: blanks, and the mark of block skip."""

# -- block numbers: nothing refers to them, jumps go to labels ---------------------------------------------------------

NUMBERED = re.compile(rb"(?P<skip>[ \t]*/)?[ \t]*(?:\d+(?![\d.,])[ \t]*)?")
"""The beginning of a block: block skip, block number, and blanks."""


def renumbered(source: bytes) -> bytes:
    """A program with its blocks numbered from 0; lines that `~` joins are one block, empty lines are not numbered."""
    pieces, done, count = [], 0, 0
    for start, stop in split(source).tolist():
        if not source[start:stop].strip():
            continue
        found = NUMBERED.match(source, start, stop)
        assert found is not None, "it matches nothing, too"
        pieces += [source[done:start], found["skip"].strip() if found["skip"] else b"", b"%d " % count]
        done, count = found.end(), count + 1
    return b"".join([*pieces, source[done:]])


UNREADABLE = "NCF236"
NOT_KLARTEXT = "this line is unknown; if it is not Klartext, the control stops here"
NOT_FOLLOWED = "the line {} may change coordinates in a way that ncfix does not support"
DECIDES = "an unknown line decides where the program continues"
HINT = "correct the line, or select the dialect with --dialect"

NUMBER = r"\A\s*/?\s*\d*\s*"
FLOW = re.compile(
    NUMBER + r"(LBL|CALL|FN\s*(9|1[0-2])\s*:|(END\s+|ELSE\s*)?(IF|WHILE|FOR)\b|(ELSE|BREAK|CONTINUE)\b|.*\bGOTO\b)",
    re.IGNORECASE | re.DOTALL,
)
PARAMETER = re.compile(r"\bQ[LRS]?\d+", re.IGNORECASE)
ASSIGNED = re.compile(NUMBER + r"(?:FN\s*\d+\s*:\s*)?Q[LRS]?\d+\s*=", re.IGNORECASE)
FRAME = re.compile(
    NUMBER
    + r"(PLANE|TRANS|CYCL\s*DEF|TOOL|FUNCTION|PRESET|POLARKIN|PATTERN|SEL)|\bM\s*(12[6-9]|130|11[45]|14[45]|89)\b",
    re.IGNORECASE,
)


def unread_line(control: KlartextControl, text: str) -> None:
    """Execute a line that could not be read; raises `Fault` if it may decide where the program goes on.

    After a remark with `~` the next lines may be part of the remark or blocks of their own, so they are checked, too.
    """
    behind = [line for line in text.split("\n")[1:] if BLOCK_BEHIND.match(f"\n{line}")]
    if any(FLOW.match(each) for each in (text, *behind)):
        raise Fault(UNREADABLE, DECIDES, "correct the line")
    for name in PARAMETER.findall(text):
        control.scope.parameters.assign(name.upper(), Unknown())
    if ASSIGNED.match(text) and not behind:
        return
    control.warn(UNREADABLE, NOT_KLARTEXT, HINT)
    if any(FRAME.search(each) for each in (text, *behind)):
        control.refuse_rest(NOT_FOLLOWED.format(control.place().line))
    control.refuse_here(NOT_KLARTEXT)


NUMBERS = frozenset({"NUMBER", "BLOCK_NUMBER"})
"""Terminals whose text is a number of the block; all other digits belong to its shape."""

WHOLE = re.compile(r"(?P<number>[ \t]*(?:/[ \t]*)?\d+)?[ \t]*(?P<text>[;*].*)?\Z", re.DOTALL)
"""A block that is only a comment or a structuring remark (with lines that `~` joins), or empty."""

BLOCK_BEHIND = re.compile(
    r"\n[ \t]*(?:/?[ \t]*\d+[ \t]+[A-Z]"
    r"|(?:L|LN|LP|CC?|CP|CR|CTP?|RND|CHF|APPR|DEP|CALL|LBL|TOOL|CYCL|PLANE|STOP)[ \t])",
    re.IGNORECASE,
)
"""A line, after a remark with `~`, that looks like a block: no manual says whether it is part of the remark."""

BLANKED = re.compile(r'"[^"\n]*"|;[^\n]*|~(?=[ \t\r]*(?:\n|\Z))')
"""Strings, which stay; and what is read as blanks: comments, and `~` at the end of a line."""

BLANKS = re.compile(r"\s+")
VALUES = frozenset({"literal", "parameter", "unary"})
"""Grammar rules of a value without an address."""


def parse_block(dialect: Dialect, text: str) -> Parsed:
    """Read one block by the grammar; one that is not Klartext, or nested too deep, becomes opaque text."""
    remark = WHOLE.match(text)
    if remark is not None:
        return unread_block() if BLOCK_BEHIND.search(text) else remark_block(text, remark)
    code = BLANKED.sub(lambda found: found[0] if found[0][0] == '"' else " " * len(found[0]), text)
    try:
        tree = parse(dialect, code)
        return built(tree, text)
    except (UnparsedError, TooDeepError):
        return unread_block()


def unread_block() -> Parsed:
    """A block that is not Klartext."""
    return Parsed(Template((Opaque(UNREAD, Span(Anchor(-1, 0), Anchor(END, 0))),), 0), (), (), -1)


def remark_block(text: str, match: re.Match[str]) -> Parsed:
    """A block that is only a comment, `; ...`, or a structuring remark, `* - ...`."""
    spans: tuple[tuple[int, int], ...] = ()
    values: tuple[float, ...] = ()
    number = re.search(r"\d+", match["number"] or "")
    if number is not None:
        spans, values = ((number.span(),), (float(number[0]),))
    builder = TreeBuilder(text, identity(text), {}, tuple(stop for _, stop in spans))
    items: tuple[Item, ...] = ()
    comment = -1
    if match["number"] and "/" in match["number"]:
        place = match["number"].index("/")
        items += (Skip(1, builder.between(place, place + 1)),)
    if number is not None:
        items += (Word("N", Literal(0), builder.between(*number.span()), builder.between(*number.span())),)
    if match["text"]:
        span = Span(builder.anchor(match.start("text")), Anchor(END, 0))
        note = match["text"].startswith(";")
        comment = match.start("text") if note else -1
        items += (Comment(span) if note else Opaque("structure", span),)
    return Parsed(Template(items, len(spans)), spans, values, comment)


def identity(text: str) -> UnspacedBlock:
    """The text of a block from which no blanks were taken out."""
    return UnspacedBlock(text, list(range(len(text))))


def built(tree: Branch, text: str) -> Parsed:
    """A block with the template that its parse tree stands for."""
    tokens = [token for token in tokens_of(tree) if kind(token) in NUMBERS]
    spans = tuple(edges(token) for token in tokens)
    slots = {span: slot for slot, span in enumerate(spans)}
    maker = Maker(TreeBuilder(text, identity(text), slots, tuple(stop for _, stop in spans)))
    items = list(maker.items(tree))
    if is_twice(items):
        return unread_block()
    taken = [place_of(item.span.stop, spans) for item in items if isinstance(item, Opaque)]
    notes = [match.span() for match in BLANKED.finditer(text) if match[0][0] == ";"]
    notes = [span for span in notes if not any(span[0] < stop for stop in taken)]
    items += [Comment(maker.note(*span)) for span in notes]
    items.sort(key=lambda item: place_of(item.span.start, spans))
    comment = notes[-1][0] if notes and not text[notes[-1][1] :].strip() else -1
    values = tuple(value_of(token) for token in tokens)
    return Parsed(Template(tuple(items), len(tokens)), spans, values, comment)


def is_twice(items: list[Item]) -> bool:
    """Whether a block has two words for the same axis or size, which the control marks as an error."""
    owned = owners(items)
    words = [w.address.removeprefix("I") for k, w in enumerate(items) if isinstance(w, Word) and k not in owned]
    once = [address for address in words if address in MOVING or address in SIZES]
    return len(once) > len(set(once))


def place_of(anchor: Anchor, spans: tuple[tuple[int, int], ...]) -> int:
    """The place in the block that an anchor stands for."""
    slot, offset = anchor
    return offset if slot < 0 else spans[slot][1] + offset


class Maker:
    """Makes the items of a block from its parse tree."""

    def __init__(self, builder: TreeBuilder) -> None:
        self.builder = builder

    def note(self, start: int, stop: int) -> Span:
        """The span of a comment; one that ends the block may differ in length from block to block."""
        if self.builder.text[stop:].strip():
            return self.builder.between(start, stop)
        return Span(self.builder.anchor(start), Anchor(END, stop - len(self.builder.text)))

    # -- items --------------------------------------------------------------------------------------------------------

    def items(self, tree: Branch) -> Iterator[Item]:
        """The items of a block."""
        nodes = list(tree.children)
        while nodes:
            node = nodes.pop(0)
            if is_token(node):
                yield self.terminal(node, nodes)
            elif kind(node) in ("plane", "datum"):
                nodes = [*node.children, *nodes]
            elif kind(node) == "code":
                code, *named = node.children
                yield self.code(code)
                nodes = [*named, *nodes]
            else:
                yield self.rule(node)

    def terminal(self, token: Token, following: list[Node]) -> Item:
        """The item that begins with a terminal; it may take the next node from `following`."""
        span = self.builder.span(token)
        match kind(token):
            case "SKIP":
                return Skip(1, span)
            case "REMARK":
                return Comment(span)
            case "HEAD" | "OPAQUE" as name:
                return self.statement(token, "program" if name == "HEAD" else "statement")
            case "TEXT":
                return Opaque("name", span)
            case "AXIS_NAME":
                return Command(f"axis {normal(token)}", (), False, span)
            case "CORNER" if following and kind(following[0]) in VALUES:
                value = following.pop(0)
                whole = self.builder.between(edges(token)[0], edges(value)[1])
                return Word(normal(token).upper(), self.expression(value), whole, self.builder.span(value))
        return Command(normal(token), (), False, span)

    def statement(self, token: Token, name: str) -> Item:
        """The item of a statement whose text is not analysed, without blanks at its end."""
        start = edges(token)[0]
        return Opaque(name, self.builder.between(start, start + len(str(token).rstrip())))

    def rule(self, tree: Branch) -> Item:
        """The item that a grammar rule stands for."""
        span = self.builder.span(tree)
        first = tree.children[0]
        match kind(tree):
            case "line_number":
                return Word("N", self.expression(first), span, span)
            case "word":
                address, value = tree.children
                return Word(str(address).upper(), self.expression(value), span, self.builder.span(value))
            case "assignment":
                target, value = tree.children
                return Assignment(NamedParameter(str(target).upper()), self.expression(value), span)
            case "text_assignment":
                target, value = tree.children
                return Assignment(NamedParameter(str(target).upper()), StringLiteral(str(value).strip('"')), span)
            case "tool_name":
                return Word("TOOL", self.name(first), span, span)
            case "label" | "call":
                return OWordLine(label_of(tree.children[1]), kind(tree), self.times(tree.children[2:]), span)
            case "condition":
                _, _, left, relation, right, _, label = tree.children
                compared = Binary(str(relation).lower(), self.expression(left), self.expression(right))
                return OWordLine(label_of(label), "if", (compared,), span)
        raise AssertionError(f"the grammar has a rule {tree.data!r} that nobody builds")

    def code(self, node: Node) -> Word:
        """The word of an M code, whose number is part of the shape."""
        start, stop = edges(node)
        value = Constant(value_of(str(node)[1:]))
        return Word("M", value, self.builder.between(start, stop), self.builder.between(start + 1, stop))

    def times(self, nodes: list[Node]) -> tuple[Expression, ...]:
        """The count of `REP 2/2`; empty without REP."""
        return tuple(Constant(float(re.findall(r"\d+", str(node))[0])) for node in nodes[1:])

    def name(self, node: Node) -> Expression:
        """The number or name of a tool."""
        if is_token(node):
            return StringLiteral(str(node).strip('"')) if kind(node) == "STRING" else Constant(value_of(str(node)))
        return self.expression(node)

    # -- expressions --------------------------------------------------------------------------------------------------

    def expression(self, node: Node, depth: int = 0) -> Expression:
        """The expression that a tree, or the terminal of a number, stands for."""
        if depth > MAX_DEPTH:
            raise TooDeepError(0)
        if is_token(node):
            return Literal(self.builder.slots[edges(node)])
        parts = node.children
        match kind(node):
            case "literal":
                return self.expression(parts[0], depth)
            case "bracket":
                return Unary("+", self.expression(parts[0], depth + 1))
            case "parameter":
                return NamedParameter(str(parts[0]).upper())
            case "unary":
                return Unary(str(parts[0]).lower(), self.expression(parts[1], depth + 1))
            case "binary":
                left, operator, right = parts
                operands = self.expression(left, depth + 1), self.expression(right, depth + 1)
                return Binary(str(operator).lower(), *operands)
            case "pi":
                return FunctionCall("pi", ())
        raise AssertionError(f"the grammar has an expression {node.data!r} that nobody builds")


def label_of(node: Node) -> str:
    """The name of a label; numbers without leading zeros."""
    text = str(node)
    return text.strip('"') if text.startswith('"') else str(int(text))


def normal(token: Token) -> str:
    """A word of the language in lower case with single blanks: `cycl def 200`, `fmax`, `dr+`."""
    text = BLANKS.sub(" ", str(token).strip()).lower()
    match kind(token):
        case "WORD" | "PLANE_WORD":
            return text.replace(" ", "") if text[0] in "fds" or text.startswith("r") else text
        case "TOOL_CALL" | "TOOL_DEF" | "CYCL_DEF" | "CYCL_CALL" | "CALL_LBL":
            return re.sub(r"(tool|cycl|call) ?(call|def|lbl) ?(\w*) ?(\.?) ?(\w*)", r"\1 \2 \3\4\5", text).strip()
    return text
