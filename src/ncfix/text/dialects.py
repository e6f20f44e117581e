"""Which dialects there are, which of them a text is written in, and whether bytes are an NC program at all."""

from __future__ import annotations

import re
from pathlib import PurePath

from ncfix.diagnostics import Place, SourceError, UsageError
from ncfix.plugins import nearest, registry, working
from ncfix.text.dialect import HINTS, Dialect

DEFAULT = "iso"
"""What a text is read as if neither its name nor its content says more."""


def names() -> tuple[str, ...]:
    """The names of all dialects, sorted."""
    return tuple(sorted(registry("dialects")))


def get(name: str) -> Dialect:
    """The dialect of that name; raises UsageError NCF104."""
    known: dict[str, Dialect] = registry("dialects")
    if name not in known:
        raise UsageError.of("NCF104", f"no dialect {name!r}", hint=nearest(name, known))
    return known[name]


def detect(source: bytes, path: str, control: str = "") -> Dialect:
    """The dialect of a text: by its content, else that of the machine's control, else by its file suffix, else ISO."""
    known: dict[str, Dialect] = registry("dialects")
    head = beginning_without_comments(source)
    ranks = {name: rank for name, dialect in known.items() if (rank := signature_rank(dialect, head)) is not None}
    if ranks:
        shown = min(ranks, key=lambda name: (ranks[name], name))
        return known[control if control in known and known[control].variant_of == shown else shown]
    if control in known:
        return known[control]
    suffix = PurePath(path).suffix.lower()
    by_suffix = [name for name, dialect in sorted(known.items()) if suffix in dialect.suffixes]
    return known[by_suffix[0]] if by_suffix else get(DEFAULT)


def signature_rank(dialect: Dialect, head: bytes) -> int | None:
    """Which of the dialect's signatures is found first in `head`, in the order of their strength; None for none."""
    with working("dialects", dialect.name):
        found = (rank for rank, pattern in enumerate(dialect.signature) if re.search(pattern, head))
        return next(found, None)


UTF8_MARK = b"\xef\xbb\xbf"
UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")

ANOTHER = "--dialect NAME, if it is for another control than the machine's; `ncfix dialects` lists them"

PROBE_BYTES = 1 << 16
"""How much of a text is looked at to find out what it is."""

COMMENT = re.compile(rb"(?<=\()(?:[^()\r\n]|\([^()\r\n]*\))+|(?<=;)(?![ \t]*\$PATH)[^\r\n]+")
"""What a comment says, up to its closing bracket or the end of the line; in `;$PATH=` SINUMERIK says where a program
is kept."""


def check_content(source: bytes, path: str, dialect: Dialect) -> None:
    """Refuse what is not text (NCF101), holds nothing (NCF102), or is another family's language (NCF103)."""
    if source.startswith(UTF16_MARKS):
        raise SourceError.of("NCF101", "the text is UTF-16", Place(path, 1), "save it as ASCII, Latin-1 or UTF-8")
    check_zeros(source, path)
    if not source.removeprefix(UTF8_MARK).strip():
        raise SourceError.of("NCF102", "there is no block in the program", Place(path))
    code = beginning_without_comments(source)
    for family, pattern in dialect.foreign:
        if found := re.search(pattern, code):
            text = f"this is {family}, not {dialect.title}"
            place = place_of(source, found.start(found.re.groups and 1), path, "utf-8")
            raise SourceError.of("NCF103", text, place, HINTS.get(family, ANOTHER))


def beginning_without_comments(source: bytes) -> bytes:
    """The first `PROBE_BYTES` of a text with blanks for what its comments say, byte for byte: signs of a language count
    outside comments only. The brackets of a comment stay, as in other languages they enclose arguments."""
    return COMMENT.sub(lambda found: b" " * len(found[0]), source[:PROBE_BYTES])


def check_zeros(source: bytes, path: str, first_line: int = 1) -> None:
    """Refuse zero bytes (NCF101); `first_line` is that of the file on which the text begins."""
    zero = source.find(b"\0")
    if zero >= 0:
        found = place_of(source, zero, path)
        place = Place(path, found.line + first_line - 1, found.column)
        raise SourceError.of("NCF101", "there is a zero byte in the file", place)


def place_of(source: bytes, byte: int, path: str, encoding: str = "") -> Place:
    """The line and column of a byte, with the line's text if an encoding is given."""
    line = source.count(b"\n", 0, byte) + 1
    start = source.rfind(b"\n", 0, byte) + 1
    text = source[start:].split(b"\n", 1)[0].rstrip().decode(encoding, "replace") if encoding else ""
    return Place(path, line, byte - start + 1, text)


def encoded(text: str, path: str) -> bytes:
    """A text as the bytes of a file, Latin-1; raises `SourceError` NCF101 for a character that has none."""
    try:
        return text.encode("latin-1")
    except UnicodeEncodeError as error:
        before, char = text[: error.start], text[error.start]
        place = Place(path, before.count("\n") + 1, error.start - before.rfind("\n"))
        hint = "give the text as bytes, as the control has it"
        raise SourceError.of("NCF101", f"{char!r} is no character of Latin-1", place, hint) from error


def header_length(source: bytes) -> int:
    """How many bytes stand before the first block: the mark of UTF-8, if it is there."""
    return len(UTF8_MARK) if source.startswith(UTF8_MARK) else 0
