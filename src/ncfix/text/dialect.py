"""Dialects as small declarative tables: grammar, words, limits. Also: the list of dialects, detection of the dialect of
a text, and whether bytes are an NC program at all.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import field, fields, replace
from pathlib import PurePath
from typing import Any, ClassVar, Literal, Protocol

from ncfix.diagnostics import Message, Place, SourceError, UsageError
from ncfix.plugins import nearest, registry, working
from ncfix.values import frozen

FAGOR = (
    rb"[ \t]*(?:RPT[ \t]+N\d+[ \t]*,[ \t]*N\d+|GOTO[ \t]+N\d+|P\d+[ \t]*=[^()\r\n]*P\d[^()\r\n]*"
    rb"|IF[ \t]+P\d[^()\r\n]*[ \t](?:GOTO[ \t]+N|P?CALL[ \t]+|RPT[ \t]+N)\d[^()\r\n]*"
    rb"|SUB[ \t]*\d+(?=[ \t]*\)(?s:.*?)\([ \t]*RET[ \t]*\))|RET)[ \t]*\)"
)
"""Statements of Fagor controls. Other controls read them as comments, which would make another program of the text."""

FOREIGN: tuple[tuple[str, bytes], ...] = (
    ("Heidenhain Klartext", rb"(?im)^[ \t]*(?:\d+[ \t]*)?BEGIN[ \t]+PGM\b"),
    ("Heidenhain DIN/ISO", rb"(?im)^[ \t]*%[ \t]*[\w.-]+[ \t]+G7[01][ \t]*(?:\*[ \t]*)?\r?$"),
    ("Siemens SINUMERIK code", rb"(?im)^(?:%_N_|[ \t]*;\$PATH[ \t]*=)"),
    (
        "Siemens SINUMERIK code",
        rb"(?im)^[ \t]*(?:N\d+[ \t]*)?(?:DEF[ \t]+(?:REAL|INT|BOOL|CHAR|STRING|AXIS|FRAME)\b|PROC[ \t]+\w"
        rb"|A?(?:TRANS|ROT|MIRROR|SCALE)\b|MSG[ \t]*\(|(?:CYCLE|POCKET|SLOT|HOLES)\d+[ \t]*\(|R\d+[ \t]*=)",
    ),
    (
        "Okuma OSP code",
        rb"(?im)^[^(;\n]*(?<![A-Z])(?:G1[56][ \t]*H[ \t]*\d|VC\d+[ \t]*=|CALL[ \t]+O[A-Z\d]"
        rb"|G62(?=[^(;\n]*[XYZ][ \t]*1(?![\d.]))(?:[ \t]*[XYZ][ \t]*[01](?![\d.]))+[ \t]*\r?$)",
    ),
    (
        "Okuma OSP code",
        rb"(?im)\A(?=(?s:.*?)G[ \t]*56(?![\d.]))(?!(?s:.*)^[^(;\n]*(?<![A-Z])G[ \t]*4[34](?!\d))(?s:.*?)"
        rb"^[^(;\n]*(?<![A-Z])(G[ \t]*56(?![\d.])[^(;\n]*(?<![A-Z])H[ \t]*[A-C1-9])",
    ),
    (
        "code of Philips or MAHO controls",
        rb"(?im)^[ \t]*(?:N\d+[ \t]*)?(G[ \t]*9[89](?=[^(;\n]*X)(?=[^(;\n]*I)(?=[^(;\n]*J)(?=[^(;\n]*K)"
        rb"[ \t]*(?:[XYZIJK][ \t]*[-+]?[\d.]+[ \t]*)+\r?$)",
    ),
    ("code of Philips or MAHO controls", rb"(?im)\A[ \t\r\n]*(%[ \t]*PM[ \t]*\d)"),
    (
        "NUM code",
        rb"(?i)\A[ \t\r\n]*(%[ \t]*\d+)(?=(?s:.*?)(?<![A-Z])"
        rb"(?:G[ \t]*5[12][ \t]*[XYZ]|G[ \t]*7[79][ \t]*N[ \t]*\d|E[ \t]*[5-8]\d{4}\b|L\d+[ \t]*=))",
    ),
    ("Fagor code (statements in brackets)", rb"(?i)\((?![ \t]*RET[ \t]*\))" + FAGOR),
    (
        "code of Fagor or ISG controls (# and a word)",
        rb"(?im)^[ \t]*(?:N\d+[ \t]*)?(#[ \t]*[A-Z]{2,}[A-Z\d]*+)(?![ \t]*\[)",
    ),
    ("Syntec code", rb"(?im)^[ \t]*(%[ \t]*@MACRO\b|[#@]\d+[ \t]*:=)"),
)
"""Languages of other families, for `Dialect.foreign`: their common name, and a pattern that identifies them.

On Okuma, G54 to G59 are tool lengths, G15 H selects work offsets, and G62 mirrors the axes that it gives a 1. MAHO
shifts the zero point by G93, and draws a window by G98 and G99. On NUM, G52 is a motion in machine coordinates.
"""

LATHE = "lathe code (X a diameter, U and W increments)"
TURNING: tuple[tuple[str, bytes], ...] = (
    (LATHE, rb"(?im)^[ \t/]*(?:N\d+[ \t]*)?(G[ \t]*50[ \t]*(?:S[ \t]*\d|[XZ][ \t]*[-+.\d]))"),
    (LATHE, rb"(?im)^[^(;\n]*(?<![A-Z])(G[ \t]*7(?:[0-2]|3(?=[^(;\n]{0,80}[UW]))[ \t]*P[ \t]*\d+[ \t]*Q[ \t]*\d)"),
    (
        LATHE,
        rb"(?im)\A(?!(?s:.*)^[^(;\n]*(?<![A-Z])Y[ \t]*[-+.\d#\[])(?s:.*?)^[^(;\n]*(?<![A-Z])(G[ \t]*96(?![\d.]))",
    ),
    (
        LATHE,
        rb"(?im)\A(?=(?s:.*?)T[ \t]*\d{4})(?!(?s:.*)^[^(;\n]*(?<![A-Z])(?:Y[ \t]*[-+.\d#\[]|M[ \t]*0*6(?!\d)))(?s:.*?)"
        rb"^[^(;\n]*(?<![A-Z])(T[ \t]*(?!0000)\d{4}(?![\d.]))(?=(?s:.*?)X[ \t]*[-+.\d#\[])",
    ),
)
"""Patterns that identify lathe programs of the Fanuc family: a spindle limit (G50 S) or a coordinate setting (G50 X),
turning cycles with the blocks of a contour (P and Q), or, in a text without Y, constant surface speed (G96), or a tool
with its offset (T0101) and no M6."""

CODE = re.compile(r"[GM](0|[1-9]\d{0,3})(\.[1-9])?")
"""Form of a dialect's own code."""
KEYWORD, KEYWORD_MEANING = re.compile(r"[#$]?[A-Z][A-Z0-9_.]*"), re.compile(rf"{CODE.pattern}|[A-FH-LP-Z]")
"""Form of a keyword, and of its meaning: a code, or an address that takes a number."""
FIXED = frozenset({"G0", "G1", "G2", "G3", "G17", "G18", "G19", "G20", "G21", "G53", "G80", "G90", "G91"})
"""Codes on whose meaning reader and writer rely: no dialect may redefine them."""

COMMENT = re.compile(r"\([^(){}]*\{\}[^(){}]*\)|;[^{}\r\n]*\{\}[^{}\r\n]*")
"""Forms of comments allowed in the families: their readers know `(...)` and `;`, whatever the grammar."""

HINTS = {
    LATHE: "ncfix reads lathe programs that define whether X is a diameter: LinuxCNC (G7, G8), Siemens (DIAMON, DIAMOF)"
}
"""Hints for languages refused by name, where naming the dialect would not help."""


def tenths(name: str) -> int:
    """A code in tenths: "G54.1" is 541."""
    return round(10 * float(name[1:]))


LEVELS = "EIJQR"
"""Addresses that may give the level of a cycle: no code of the families uses them otherwise in its block."""
REPEATS = "EKLP"
"""Addresses that may give the repeat count of a cycle: their numbers are no lengths."""
NO_WORDS = "GMNO"
"""Addresses of codes, and of numbers of blocks and programs."""


class CodeOperation(Protocol):
    """An action of a dialect's own code, see `ncfix.control.operations`."""

    takes: ClassVar[bool]
    alone: ClassVar[bool]

    def carry_out(self, control: Any, block: Any, destination: Any) -> None:
        """Execute it, before the motion of the block."""


@frozen
class CycleTable:
    """A drilling cycle: from the level to the depth and back, at each hole given by words of the plane.

    The depth is the word of the axis across the plane. It and the level count as in the family's cycles (G90, G91).

    level    address of the level from which it feeds
    needs    addresses without which the control does not start it
    repeats  addresses of the repeat count, among E K L P; empty: as in the family
    returns  where it ends: "mode" (as G98 and G99 say), "level", or "initial" (where the series of holes began)
    modal    whether it stays in force until G80 or another motion code
    """

    level: str = "R"
    needs: str = ""
    repeats: str = ""
    returns: Literal["mode", "level", "initial"] = "mode"
    modal: bool = True

    def __post_init__(self) -> None:
        if not isinstance(self.level, str) or len(self.level) != 1 or self.level not in LEVELS:
            raise ValueError(f"{self.level!r} cannot be the address of the level of a cycle: one of {LEVELS}")
        if self.needs != "" and not is_letters(self.needs, NO_WORDS):
            raise ValueError(f'{self.needs!r} are not the addresses that a cycle needs: letters in a string, "QP"')
        if self.repeats != "" and (not is_letters(self.repeats, self.level) or not {*self.repeats} <= {*REPEATS}):
            text = f"{self.repeats!r} cannot be the addresses of the repeats of a cycle"
            raise ValueError(f"{text}: letters of {REPEATS} in a string, not the level's")
        if self.returns not in ("mode", "level", "initial"):
            raise ValueError(f'a cycle returns to {self.returns!r}: "mode", "level" or "initial"')

    def __str__(self) -> str:
        needs = f", needs {' '.join(self.needs)}" if self.needs else ""
        ends = {"mode": "as G98 and G99 say", "level": "to the level", "initial": "to the initial level"}[self.returns]
        count = f", repeats by {' or '.join(self.repeats)}" if self.repeats else ""
        once = "" if self.modal else ", in its block only"
        return f"drilling cycle, level {self.level}{needs}{count}, returns {ends}{once}"

    def ends_at_level(self, mode: bool) -> bool:
        """Whether it ends at the level; `mode`: whether G99 is in force."""
        return mode if self.returns == "mode" else self.returns == "level"


FAMILY_CYCLE = CycleTable()
"""A canned cycle of the family itself: R is its level, and G98 and G99 define where it ends."""


def is_letters(text: object, but: str = "") -> bool:
    """Whether `text` is a non-empty string of capital letters, none of them in `but`."""
    return isinstance(text, str) and re.fullmatch("[A-Z]+", text) is not None and not {*text} & {*but}


@frozen
class Dialect:
    """The language of one control, as data. The grammar defines what a block is, the dialect what it does.

    name                short name, as in `--dialect`
    title               name for people
    grammar             file name under `grammars/`, or the path of a plugin's own
    suffixes            file extensions that suggest it, lower case with the point
    signature           regular expressions (bytes) that suggest it if found in a file, strongest first
    variant_of          the dialect of which this is a variant: a text that looks like that dialect, or like another
                        variant of it, is read as this one if the machine has this control
    foreign             languages that are refused by name: their common name, and a regular expression (bytes); its
                        first group, if any, is the part that identifies the language
    line_limit          largest number of characters of a line, without its end; 0: no limit
    comment             form of a one-line comment, with `{}` for the text
    upper_case          comments are written in upper case, because older controls know no other letters
    block_numbers       of inserted blocks, if every block has one: "same" as the block that they belong to, "none", or
                        "renumber": all blocks anew
    closure_mm          the control refuses an arc whose start and end radii differ by more than this, mm,
    closure_relative    and by more than this, relative to the radius (both must be exceeded)
    decimal_inches      an increment of 0.001 mm is one of 0.0001 inch in programs in inches, as in IS-B
    most_inverse_time   largest F in inverse time (G93), 1/min; 0: unknown or unlimited
    feed_of             the speed that F defines if linear and rotary axes move together: "linear" (rotary axes keep
                        pace), "all" (of all axes together), or "" if that differs from control to control
    understands         what is followed and corrected, in short sentences; for `ncfix dialects NAME`
    passes              what stays uncorrected by rule
    refuses             what cannot be corrected, and is reported with its line
    language            the `Language` object with the functions that read, follow and write it, as "module:NAME"
    returns             regular expression (bytes) that finds the end of a subprogram in a block without its comments
    semantics           name of the rule set of its language, if there are several. A name that the language does not
                        know is an error (NCF508) when the language is needed
    codes, cycles       codes added to those of its language, see `derive`
    keywords            words used in its blocks, with the G or M code or the address that each stands for: ("MOVE",
                        "G1"), ("FEED", "F"); its grammar makes a `code` of the former, the address of a `word` of the
                        latter
    assign              what stands between an address and its number, as in X=10
    signed              words that are added always have a sign, as in X+10
    """

    name: str
    title: str
    grammar: str
    suffixes: tuple[str, ...]
    signature: tuple[bytes, ...] = ()
    variant_of: str = ""
    foreign: tuple[tuple[str, bytes], ...] = ()
    line_limit: int = 0
    comment: str = "({})"
    upper_case: bool = False
    block_numbers: str = "same"
    closure_mm: float = 0.0283
    closure_relative: float = 0.001
    decimal_inches: bool = False
    most_inverse_time: float = 0.0
    feed_of: str = ""
    understands: tuple[str, ...] = ()
    passes: tuple[str, ...] = ()
    refuses: tuple[str, ...] = ()
    semantics: str = ""
    returns: bytes = b""
    codes: tuple[tuple[str, tuple[CodeOperation, ...]], ...] = ()
    cycles: tuple[tuple[str, CycleTable], ...] = ()
    keywords: tuple[tuple[str, str], ...] = ()
    assign: str = ""
    signed: bool = False
    language: str = field(kw_only=True)

    def cycle_of(self, code: int) -> CycleTable:
        """The drilling cycle table of a code in tenths."""
        return next((table for name, table in self.cycles if tenths(name) == code), FAMILY_CYCLE)

    def derive(
        self,
        name: str,
        *,
        title: str,
        codes: Mapping[str, Sequence[CodeOperation]] | None = None,
        cycles: Mapping[str, CycleTable] | None = None,
        keywords: Mapping[str, str] | None = None,
        **changes: Any,
    ) -> Dialect:
        """A dialect derived from this one; everything that is not given is inherited.

        codes    "G100", "M180", "G54.4" -> what it does: operations of `ncfix.control.operations`, in order; an empty
                 list: it moves nothing and changes no coordinates
        cycles   "G177" -> the drilling cycle that it is
        keywords "MOVE" -> "G1", "FEED" -> "F": the words of a language whose blocks are not letters and numbers;
                 of several keywords for one code, the first is written
        changes  other fields. Suffixes and signatures are not inherited, so that programs are read in this dialect only
                 if the machine file or --dialect says so

        Raises ValueError for impossible values: see `complaint`, and for a comment form that the language does not
        read.
        """
        if unknown := changes.keys() - {each.name for each in fields(self)}:
            known = ("codes", "cycles", "keywords", *(each.name for each in fields(self)))
            raise ValueError(f"{name}: a dialect has no {min(unknown)}: {nearest(min(unknown), known)}")
        for code, operations in (codes or {}).items():
            if not isinstance(operations, list | tuple):
                raise ValueError(f"{name}: {code}: {operations!r} is no list of operations")
        own = {code: tuple(operations) for code, operations in (codes or {}).items()}
        drills, words = dict(cycles or {}), dict(keywords or {})
        if both := own.keys() & drills.keys():
            raise ValueError(f"{name}: {min(both)} cannot be a code and a cycle")
        before = {code: operations for code, operations in self.codes if code not in drills}
        tables = {code: table for code, table in self.cycles if code not in own}
        made = replace(
            self,
            name=name,
            title=title,
            codes=tuple((before | own).items()),
            cycles=tuple((tables | drills).items()),
            keywords=tuple((words | {word: meaning for word, meaning in self.keywords if word not in words}).items()),
            **{"suffixes": (), "signature": (), "variant_of": self.variant_of or self.name, **changes},
        )
        if complaint := made.complaint():
            raise ValueError(f"{name}: {complaint}")
        if made.language == self.language and not COMMENT.fullmatch(made.comment):
            raise ValueError(f'{name}: no comment can be written as {made.comment!r}: "({{}})" or "; {{}}"')
        return made

    def complaint(self) -> str:
        """What is wrong with its fields, codes and cycles, in words; empty if nothing is."""
        if not isinstance(self.line_limit, int) or self.line_limit < 0:
            return f"{self.line_limit!r} cannot be the line_limit: a number of characters, 0 for none"
        if self.feed_of not in ("linear", "all", ""):
            return f'{self.feed_of!r} cannot be feed_of: "linear", "all" or ""'
        for name in ("suffixes", "signature", "understands", "passes", "refuses"):
            kind = bytes if name == "signature" else str
            if not isinstance(told := getattr(self, name), tuple) or not all(isinstance(each, kind) for each in told):
                return f"{name} is a tuple of {kind.__name__}, not {told!r}"
        if not isinstance(self.returns, bytes):
            return f"{self.returns!r} cannot be returns: a regular expression (bytes)"
        for suffix in self.suffixes:
            if not suffix.startswith(".") or suffix != suffix.lower() or len(suffix) < 2:
                return f"{suffix!r} cannot be a suffix: lower case, with the point"
        for code, table in self.cycles:
            if not isinstance(table, CycleTable):
                return f"{code}: {table!r} is no CycleTable"
            if code.startswith("M"):
                return f"{code!r} cannot be a code of a dialect's own: cycles are G codes"
        for keyword, meaning in self.keywords:
            if not KEYWORD.fullmatch(keyword) or not KEYWORD_MEANING.fullmatch(meaning):
                rule = "capital letters (# or $ may stand before them), for a code or an address"
                return f"{keyword!r}: {meaning!r} cannot be a keyword: {rule}"
        for code, operations in (*self.codes, *((code, ()) for code, _ in self.cycles)):
            if complaint := complaint_of_code(code, operations):
                return complaint
        return ""


def complaint_of_code(code: str, operations: Sequence[CodeOperation]) -> str:
    """What is wrong with a dialect's own code, in words; empty if nothing is."""
    for each in operations:
        if isinstance(each, type) or not hasattr(each, "carry_out"):
            shown = getattr(each, "__name__", repr(each))
            return f"{code}: {shown} is no operation" + (f": write {shown}(...)" if isinstance(each, type) else "")
    cannot = f"{code!r} cannot be a code of a dialect's own"
    if not CODE.fullmatch(code):
        return f"{cannot}: a capital G or M and its number, without zeros before it"
    if code in FIXED:
        return f"{cannot}: the families rely on what it means"
    if code.startswith("M") and any(operation.takes for operation in operations):
        return f"{cannot}: an M code takes no axis words"
    if len(operations) > 1 and any(operation.alone for operation in operations):
        return f"{code}: like(...) stands alone in its list"
    other: str = getattr(operations[0], "code", code) if operations else code
    if other[0] != code[0]:
        return f"{code}: like({other!r}): a G code is like a G code, an M code like an M code"
    return ""


DEFAULT = "iso"
"""The dialect of a text whose name and content suggest no other."""


def names() -> tuple[str, ...]:
    """The names of all dialects, sorted."""
    return tuple(sorted(registry("dialects")))


def get(name: str) -> Dialect:
    """The dialect with this name; raises UsageError NCF104."""
    known: dict[str, Dialect] = registry("dialects")
    if name not in known:
        raise UsageError.of("NCF104", f"no dialect {name!r}", hint=nearest(name, known))
    return known[name]


def detect(source: bytes, path: str, control: str = "") -> Dialect:
    """The dialect of a text, found from its content, from a suffix, or from the machine's control; else ISO."""
    known: dict[str, Dialect] = registry("dialects")
    head = beginning_without_comments(source)
    ranks = {name: rank for name, dialect in known.items() if (rank := signature_rank(dialect, head)) is not None}
    if ranks:
        shown = known[min(ranks, key=lambda name: (ranks[name], name))]
    else:
        suffix = PurePath(path).suffix.lower()
        shown = next((known[name] for name in sorted(known) if suffix in known[name].suffixes), get(DEFAULT))
        if control in known and shown.name == DEFAULT:
            return known[control]
    family = known[control].variant_of if control in known else ""
    return known[control] if family and family in (shown.name, shown.variant_of) else shown


def other_control(dialect: Dialect, control: str, path: str) -> Message | None:
    """The remark (NCF106) that a program is in the language of another family than the machine's control."""
    own: Dialect | None = registry("dialects").get(control)
    if own is None or (own.variant_of or own.name) == (dialect.variant_of or dialect.name):
        return None
    text = f"this is {dialect.title}, and the control of the machine file is {control}"
    return Message(
        "NCF106",
        text,
        Place(path),
        f"check that it is the right machine file; --dialect {dialect.name} confirms the language",
    )


def signature_rank(dialect: Dialect, head: bytes) -> int | None:
    """Index of the dialect's strongest signature found in `head`; None if there is none."""
    with working("dialects", dialect.name):
        found = (rank for rank, pattern in enumerate(dialect.signature) if re.search(pattern, head))
        return next(found, None)


def goes_back(block: bytes, dialect: Dialect) -> bool:
    """Whether a block ends a subprogram, so that its caller continues."""
    return bool(dialect.returns and re.search(dialect.returns, COMMENT_TEXT.sub(b"", block)))


UTF8_MARK = b"\xef\xbb\xbf"
UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")

ANOTHER = "--dialect NAME, if the program is for another control than the machine's; `ncfix dialects` lists the names"

OTHER_FILES = {
    "machine file": rb"(?m)^[ \t]*topology[ \t]*=[ \t]*[\"']",
    "setup file": rb"(?m)^[ \t]*\[(?:work_offsets|tools|initial)\]",
    "measurement file": rb"\A# *ncfix-measurement",
}
"""Patterns that identify other files of ncfix."""

PROBE_BYTES = 1 << 16
"""Number of bytes of a text that are examined to identify it."""

COMMENT_TEXT = re.compile(
    rb"(?<=\()(?!(?i:" + FAGOR + rb"))(?:[^()\r\n]|\([^()\r\n]*\))+|(?<=;)(?![ \t]*\$PATH)[^\r\n]+"
)
"""The content of a comment, up to its closing bracket or the end of the line. Two things are no comments: `;$PATH=`, by
which SINUMERIK says where a program is kept, and Fagor's statements in brackets."""


def check_content(source: bytes, path: str, dialect: Dialect) -> None:
    """Refuse bytes that are not text (NCF101), an empty program (NCF102), or another family's language (NCF103)."""
    if source.startswith(UTF16_MARKS):
        raise SourceError.of("NCF101", "the text is UTF-16", Place(path, 1), "save it as ASCII, Latin-1 or UTF-8")
    check_zeros(source, path)
    if not source.removeprefix(UTF8_MARK).strip():
        raise SourceError.of("NCF102", "the program has no blocks", Place(path))
    if other := next((kind for kind, sign in OTHER_FILES.items() if re.search(sign, source[:PROBE_BYTES])), ""):
        raise SourceError.of(
            "NCF103",
            f"this is a {other}, not a program",
            Place(path),
            "give machine and setup files with -m and --setup",
        )
    code = beginning_without_comments(source)
    for family, pattern in dialect.foreign:
        found = re.search(pattern, code)
        if found and not is_keyword(found[found.re.groups and 1], dialect):
            text = f"this is {family}, not {dialect.title}"
            place = place_of(source, found.start(found.re.groups and 1), path, "utf-8")
            raise SourceError.of("NCF103", text, place, HINTS.get(family, ANOTHER))


def is_keyword(sign: bytes, dialect: Dialect) -> bool:
    """Whether the sign of another language is a keyword of this one, or the beginning of one."""
    word = "".join(sign.decode("latin-1").upper().split())
    return any(keyword.startswith(word) for keyword, _ in dialect.keywords)


def beginning_without_comments(source: bytes) -> bytes:
    """The first `PROBE_BYTES` of a text with the content of comments blanked, since signs of a language count outside
    comments only. Byte positions are kept. The brackets of comments stay: in other languages they enclose arguments."""
    return COMMENT_TEXT.sub(lambda found: b" " * len(found[0]), source[:PROBE_BYTES])


def check_zeros(source: bytes, path: str, first_line: int = 1) -> None:
    """Refuse zero bytes (NCF101); `first_line`: line number of the file at which the text begins."""
    zero = source.find(b"\0")
    if zero >= 0:
        found = place_of(source, zero, path)
        place = Place(path, found.line + first_line - 1, found.column)
        raise SourceError.of("NCF101", "there is a zero byte in the file", place)


def place_of(source: bytes, byte: int, path: str, encoding: str = "") -> Place:
    """The line and column of a byte; with the text of the line if an encoding is given."""
    line = source.count(b"\n", 0, byte) + 1
    start = source.rfind(b"\n", 0, byte) + 1
    text = source[start:].split(b"\n", 1)[0].rstrip().decode(encoding, "replace") if encoding else ""
    return Place(path, line, byte - start + 1, text)


def encoded(text: str, path: str) -> bytes:
    """A text encoded as Latin-1; raises `SourceError` NCF101 for a character outside it."""
    try:
        return text.encode("latin-1")
    except UnicodeEncodeError as error:
        before, char = text[: error.start], text[error.start]
        place = Place(path, before.count("\n") + 1, error.start - before.rfind("\n"))
        hint = "give the text as bytes, as the control has it"
        raise SourceError.of("NCF101", f"{char!r} is not a character of Latin-1", place, hint) from error


def header_length(source: bytes) -> int:
    """Number of bytes before the first block: the byte order mark of UTF-8, if present."""
    return len(UTF8_MARK) if source.startswith(UTF8_MARK) else 0
