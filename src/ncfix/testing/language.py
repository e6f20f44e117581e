"""The contract for languages: `check_language(dialect)` in the tests of a plugin.

Programs are composed from what the language writes (`Statements`), corrected for a machine with a known error, and read
again. Every line must be a correct motion, pass by a rule, or be refused with a reason. Nothing that demands a motion
may be ignored silently, and nothing may fail without a message.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field
from itertools import combinations, product

from ncfix.compensate.driver import fix_program
from ncfix.control.coordinates import LETTERS
from ncfix.control.operations import Like
from ncfix.control.setup import Setup
from ncfix.diagnostics import SourceError
from ncfix.machine import Machine
from ncfix.testing.judging import OPTIONS, SETUP, Judged, judged, shifted_machine
from ncfix.text.dialect import Dialect, get
from ncfix.text.reader import read, shapes_of, texts_of
from ncfix.text.tree import Opaque
from ncfix.values import frozen

NUMBERS: dict[str, float] = {
    "5.": 5.0,
    "5.0": 5.0,
    ".5": 0.5,
    "-0.5": -0.5,
    "+5.25": 5.25,
    "0.": 0.0,
    "12.3456": 12.3456,
    "007.": 7.0,
    "1234.5678": 1234.5678,
    "0.0124": 0.0124,
}
"""Forms of numbers in G code, with their values."""
WORDS_AT_ONCE = 4
SIZES = (0, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4)
"""Numbers of words of random blocks."""
READ_AGAIN = 12
"""Number of random blocks that are read after others."""
TOLD = 5
"""Largest number of violations that are reported."""

Leads = Callable[[str, Sequence[str], int], bool]
"""(head, words, index of the mode) -> whether the block must move axes or stop the control, according to the manual."""


@frozen
class Pair:
    """Lines that put something in force, and lines that end it."""

    on: tuple[str, ...] = ()
    off: tuple[str, ...] = ()


NOTHING = Pair()


@frozen
class Statements:
    """The statements of a language from which `check_language` composes programs; one block per line.

    begin     start of every program: positions all axes with absolute words; tool, feed and work offset
    end       end of every program: its first block names X, Y and Z absolutely, its last one ends the program
    heads     beginnings of a block: codes, or nothing
    words     words that may follow; a block has at most one word of each address
    modes     lines before the statement that put another motion code or cycle in force
    leads     see `Leads`
    frames    rotations, tilted planes, shifts, with their ends
    offsets   cutter compensation switched on with a motion, and off
    cycles    lines that drill holes, with the end of the cycle
    places    lines in machine coordinates and to reference points
    motions   simple motions, absolute
    number    a motion with `{}` for a number of X
    numbers   forms of numbers, with their values
    skip      the sign of block delete; empty if the language has none
    unknown   lines unknown to the language, without axis words
    setup     offsets and tools that the programs use
    """

    begin: tuple[str, ...]
    end: tuple[str, ...]
    heads: tuple[str, ...]
    words: tuple[str, ...]
    modes: tuple[tuple[str, ...], ...]
    leads: Leads
    motions: tuple[str, ...]
    number: str
    frames: tuple[Pair, ...] = ()
    offsets: tuple[Pair, ...] = ()
    cycles: tuple[Pair, ...] = ()
    places: tuple[str, ...] = ()
    numbers: dict[str, float] = field(default_factory=lambda: dict(NUMBERS))
    skip: str = "/"
    unknown: tuple[str, ...] = ()
    setup: Setup = SETUP


TAKES = ("G4", "G92", "G52", "G10 L2 P1", "G43", "G17", "G90", "G40", "M3")
"""Codes that use the words of their block themselves, or for which these have no meaning."""
FRAME_CODES = ("G22", "G50.1", "G51", "G51.1", "G68", "G68.2", "G68.3", "G68.4")
"""Further codes of that kind; a dialect's own code may be like one of them."""
REFERENCE = ("G28", "G30")


def gcode_leads(head: str, words: Sequence[str], mode: int) -> bool:
    """Whether a block demands a motion: axis words do, unless a code uses them; arcs with a centre need none."""
    if head in REFERENCE:
        return True
    if head in TAKES or head in FRAME_CODES:
        return False
    arc = head in ("G2", "G3") or (mode == 1 and head == "")
    return any(word[0] in "XYZ" for word in words) or (arc and any(word[0] in "IJ" for word in words))


def gcode_statements(dialect: Dialect) -> Statements:
    """The statements of a dialect of G code (RS274, Fanuc and similar), with its own codes and cycles."""
    own = tuple(code for code, _ in dialect.codes)
    alike = {code: each.code for code, operations in dialect.codes for each in operations if isinstance(each, Like)}
    drills = {code: f"{code} X10. Y20. Z-5. {table.level}2." for code, table in dialect.cycles}
    for code, table in dialect.cycles:
        drills[code] += "".join(f" {address}1." for address in table.needs)
    levels = tuple(f"{table.level}2.5" for _, table in dialect.cycles if table.level != "R")
    begin = ("G21 G17 G90 G40 G49 G80 G94", "G54 G0 X0. Y10. Z3.", "T1 M6", "G0 X0. Y10. Z3.", "F200. S100 M3")
    return Statements(
        begin=begin,
        end=("G80", "G90 G40 G1 X1. Y2. Z30. F100.", "X3.", "M30"),
        heads=(
            *("", "G0", "G1", "G2", "G3", "G28", "G30", "G53 G0", "G53 G1", "G81", "G83", "G85", "G91 G1"),
            *(*TAKES, *own, *drills),
        ),
        words=(
            *("X30.", "X10.", "Y40.", "Y20.", "Z5.", "I20.", "J0.", "J10.", "K1.", "R25.", "P1", "Q2.", "L2", "F100."),
            *("H1", *levels),
        ),
        modes=(
            ("G1 X10. Y20.",),
            ("G2 X10. Y20. I5. J5.",),
            ("G81 X10. Y20. Z-5. R2.",),
            *((line,) for line in drills.values()),
        ),
        leads=lambda head, words, mode: gcode_leads(alike.get(head, head), words, mode),
        motions=("G1 X12. Y13.", "G0 X30. Y31. Z20.", "G2 X40. Y41. R30.", "G1 Z2."),
        number="G1 X{}",
        frames=(Pair(("G52 X3.",), ("G52 X0.",)), Pair(("G55",), ("G54",)), Pair(("G92 X7.",), ("G92.1",))),
        offsets=(Pair(("G1 G41 D1 X8. Y9.",), ("G1 G40 X60. Y61.",)),),
        cycles=tuple(
            Pair((f"G98 {line}", "X14. Y15."), ("G80",))
            for line in ("G81 X10. Y20. Z-5. R2.", "G83 X10. Y20. Z-5. R2. Q1.", *drills.values())
        ),
        places=("G53 G0 Z100.", "G28 Z20.", "G30 Z20."),
        unknown=("#NCFIX[1]", "#NCFIX", "NCFIX[1]", "NCFIX 1", '"1"', "G9879", "G987.6", "!1=2"),
    )


@frozen
class Sample:
    """A program; `statement`: line number of the tested block; `leads`: whether it must not remain without effect."""

    lines: tuple[str, ...]
    statement: int = 0
    leads: bool = False
    skipped: bool | None = None


def check_language(
    dialect: Dialect | str, statements: Statements | None = None, count: int = 60, seed: int = 1
) -> dict[str, int]:
    """Raise AssertionError if a language violates the contract; returns the counts of the fates of all lines.

    statements  how the language writes things; None: for a dialect of G code, see `gcode_statements`
    count       number of random programs of each kind; 0: all of them, which takes long

    Checks: A program's bytes are kept. A machine with negligible error changes nothing. Comments stay and have no
    effect. Numbers have the same meaning in every form. Neither unknown lines nor known words and codes are ignored. A
    block is read the same whatever was read before. Every statement with subsets of its words, in every mode, with
    block delete on and off, and combinations of frames, cutter compensation, cycles and machine coordinates: each line
    is right, passed by a rule, or refused.
    """
    dialect = get(dialect) if isinstance(dialect, str) else dialect
    sample = gcode_statements(dialect) if statements is None else statements
    try:
        check_bytes(dialect, sample)
        check_numbers(dialect, sample)
        check_unknown(dialect, sample)
    except SourceError as error:
        raise AssertionError(f"{dialect.name}: {error}") from error
    chosen = random.Random(seed)
    some = (" ".join((head, *words)).strip() for _, head, words in _blocks(sample, READ_AGAIN, chosen))
    check_order(dialect, sample, (*sample.motions, *some), chosen)
    found: dict[str, int] = {}
    faults: list[str] = []
    machine = shifted_machine()
    crosses = list(_crosses(sample))
    programs = [
        *_statements(sample, _blocks(sample, count, chosen)),
        *_deletable(sample, _blocks(sample, count // 2, chosen) if count else _blocks(sample, 0, chosen)),
        *(crosses if not count or count >= len(crosses) else chosen.sample(crosses, count)),
    ]
    for each in programs:
        faults += look(each, dialect, machine, sample.setup, found)
    shown = "\n\n".join(faults[:TOLD])
    assert not faults, f"{dialect.name}: {len(faults)} programs are not as they must be:\n\n{shown}"
    return found


def look(each: Sample, dialect: Dialect, machine: Machine, setup: Setup, found: dict[str, int]) -> list[str]:
    """Violations in the result of one program; counts the fates of its lines."""
    try:
        result = judged(each.lines, dialect, machine, setup, each.skipped)
    except Exception as error:
        return [told(each, f"fails: {type(error).__name__}: {error}")]
    for what in ["stopped"] if result.stopped else result.lines.values():
        word = what.partition(" ")[0]
        found[word] = found.get(word, 0) + 1
    return [told(each, why) for why in wrongs(each, result)]


def wrongs(each: Sample, result: Judged) -> Iterator[str]:
    """Violations in the result of a program."""
    if result.stopped is not None:
        if each.statement and result.stopped[0] < each.statement:
            yield f"stops before the statement: {result.stopped[1]}"
        return
    for line, what in result.wrong.items():
        yield f"line {line}, {each.lines[line - 1] if line else ''!r}: {what}\n-- written:\n{result.text}"
    if each.leads and each.statement not in result.lines:
        yield f"line {each.statement}, {each.lines[each.statement - 1]!r}: its words lead to no motion and no refusal"


def told(each: Sample, why: str) -> str:
    """A violation with its program."""
    return f"{why}\n-- program:\n" + "\n".join(each.lines)


# -- bytes, comments, numbers -----------------------------------------------------------------------------------------


def check_bytes(dialect: Dialect, sample: Statements) -> None:
    """Check that everything that is not corrected stays unchanged, byte for byte."""
    lines = (*sample.begin, *sample.motions, *sample.end)
    remark = dialect.comment.format("G0 X999 WORDS")
    for end, between in product(("\n", "\r\n"), ("", f" {remark}")):
        source = "".join(f"{line}{between}{end}" for line in lines).encode("latin-1")
        program = read(source, "part", dialect)
        assert program.source == source, f"{dialect.name}: a program that is read is not what was read"
        same = fix_program(program, shifted_machine(1e-9), sample.setup, OPTIONS)
        assert same.text == source, f"{dialect.name}: a machine without errors to speak of changes a program"
    plain, remarked = (
        judged(each, dialect, shifted_machine(), sample.setup) for each in (lines, _remarked(lines, remark))
    )
    for result in (plain, remarked):
        assert result.stopped is None, f"{dialect.name}: its own plain motions stop: {result.stopped}"
        assert not result.wrong, f"{dialect.name}: its own plain motions: {result.wrong}"
    found_again = remarked.text.count(remark)
    assert found_again == len(lines), f"{dialect.name}: {len(lines)} comments became {found_again}:\n{remarked.text}"
    assert list(plain.lines.values()) == list(remarked.lines.values()), f"{dialect.name}: comments mean something"


def _remarked(lines: Sequence[str], remark: str) -> tuple[str, ...]:
    return tuple(f"{line} {remark}" for line in lines)


def check_numbers(dialect: Dialect, sample: Statements) -> None:
    """Check that numbers have the same meaning in every form, and are written correctly."""
    line, places = len(sample.begin) + 1, {}
    for text, value in sample.numbers.items():
        lines = (*sample.begin, sample.number.format(text), *sample.end)
        result = judged(lines, dialect, shifted_machine(), sample.setup)
        fate = result.lines.get(line, "nothing")
        assert fate == "right", f"{dialect.name}: the number {text!r}: {result.stopped or fate}"
        places[text] = result.places[line][0] - value
    first = next(iter(places))
    for text, place in places.items():
        assert abs(place - places[first]) < 1e-9, f"{dialect.name}: {text!r} and {first!r} do not mean what they say"


def check_unknown(dialect: Dialect, sample: Statements) -> None:
    """Check that nothing is corrected after an unknown line, and that no part of a known one is ignored."""
    machine, line = shifted_machine(), len(sample.begin) + 1
    for text in sample.unknown:
        result = judged((*sample.begin, text, *sample.motions, *sample.end), dialect, machine, sample.setup)
        corrected = [number for number, fate in result.lines.items() if number > line and fate == "right"]
        stops = result.stopped is not None and result.stopped[0] == line
        assert stops or not corrected, f"{dialect.name}: {text!r} is passed over, and motions behind it are corrected"
    if not sample.unknown:
        return
    for text in (*sample.heads, *sample.words, *(f"{letter}1." for letter in LETTERS)):
        items = _read_block(dialect, sample, text)[0]
        seen = [item.kind for item in items if isinstance(item, Opaque)] if isinstance(items, tuple) else []
        assert not seen, f"{dialect.name}: {text!r} is passed over, as the grammar reads it as {seen[0].upper()}"


WRITTEN = re.compile(r"[-+]?(?:\d+[.,]?\d*|[.,]\d+)")
RESPELLED = ("5", "+5", "-5.", " 5.5", " +5", " - 5", "+ 5", "-\t5", ".5", "05.0", "- .5", "  7")
"""Texts put in place of a block's numbers; not all of them are valid in each language."""


def check_order(dialect: Dialect, sample: Statements, blocks: Iterable[str], chosen: random.Random) -> None:
    """Check that a block is read the same, or cannot be read, whatever was read before it."""
    for block in blocks:
        texts = [block, *(WRITTEN.sub(lambda _: chosen.choice(RESPELLED), block) for _ in RESPELLED)]
        alone = []
        for text in texts:
            shapes_of.cache_clear()
            texts_of.cache_clear()
            alone.append(_read_block(dialect, sample, text))
        order = chosen.sample(range(len(texts)), len(texts))
        for at, row in enumerate(order):
            before = [texts[each] for each in order[:at]]
            found = _read_block(dialect, sample, texts[row])
            told = f"{dialect.name}: {texts[row]!r} is read as {found} after {before}, and as {alone[row]} without"
            assert found == alone[row], told


def _read_block(dialect: Dialect, sample: Statements, text: str) -> tuple[object, ...]:
    """The result of reading a block: its items, and the places and values of its numbers; or the code of the error."""
    lines = (sample.begin[0], text, sample.end[-1])
    try:
        program = read("\n".join(lines).encode("latin-1"), "part", dialect)
    except SourceError as error:
        return (error.code,)
    items, numbers = program.templates[program.template[1]].items, slice(*program.first_number[1:3].tolist())
    return items, program.number_spans[numbers].tolist(), program.numbers[numbers].tolist()


# -- statements -------------------------------------------------------------------------------------------------------

Block = tuple[int, str, tuple[str, ...]]
"""Index of the mode, head, words."""


def address(word: str) -> str:
    """The address of a word, absolute or incremental: `X` for `X10`; `I1` for `I1=`."""
    found = re.match(r"(?:I(?=[A-Z]))?([A-Z]+(?:\d(?==))?(?:\[.\])?)", word)
    return found[1] if found else word


def agree(words: Sequence[str]) -> bool:
    """Whether words may stand in one block: no two with the same address."""
    return len({address(word) for word in words}) == len(words)


def every_block(modes: int, heads: Sequence[str], words: Sequence[str]) -> Iterator[Block]:
    """Every head with every subset of the words, in every mode."""
    for mode, head, size in product(range(modes), heads, range(WORDS_AT_ONCE + 1)):
        yield from ((mode, head, some) for some in combinations(words, size) if agree(some))


def _blocks(sample: Statements, count: int, chosen: random.Random) -> Iterator[Block]:
    """`count` random blocks: any head, any subset of the words, any mode; all such blocks if `count` is 0."""
    if not count:
        yield from every_block(len(sample.modes), sample.heads, sample.words)
    while count:
        words = tuple(chosen.sample(sample.words, chosen.choice(SIZES)))
        if agree(words):
            yield chosen.randrange(len(sample.modes)), chosen.choice(sample.heads), words
            count -= 1


def _statements(sample: Statements, blocks: Iterable[Block]) -> Iterator[Sample]:
    for mode, head, words in blocks:
        before = (*sample.begin, *sample.modes[mode])
        block = " ".join((head, *words)).strip()
        yield Sample((*before, block, *sample.end), len(before) + 1, sample.leads(head, words, mode))


def _deletable(sample: Statements, blocks: Iterable[Block]) -> Iterator[Sample]:
    """Blocks with the sign of block delete, for both positions of its switch."""
    for mode, head, words in blocks if sample.skip else ():
        before = (*sample.begin, *sample.modes[mode])
        block = f"{sample.skip}{' '.join((head, *words)).strip()}"
        for skipped in (False, True):
            yield Sample((*before, block, *sample.end), len(before) + 1, False, skipped)


def _crosses(sample: Statements) -> Iterator[Sample]:
    """Combinations of frames, compensation, cycles and machine coordinates."""
    frames, offsets, cycles = ((NOTHING, *each) for each in (sample.frames, sample.offsets, sample.cycles))
    for frame, offset, cycle, place in product(frames, offsets, cycles, ("", *sample.places)):
        for motion in sample.motions:
            inner = (*offset.on, motion, *cycle.on, *cycle.off, *([place] if place else []), motion, *offset.off)
            lines = (*sample.begin, *frame.on, *inner, *frame.off, *sample.end)
            yield Sample(lines, len(sample.begin) + 1)
