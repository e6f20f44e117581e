"""Reading: what a block consists of, and where."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.diagnostics import SourceError
from ncfix.text.reader import read
from ncfix.text.tree import (
    Assignment,
    Binary,
    Comment,
    Constant,
    Exists,
    Expression,
    Item,
    Literal,
    NamedParameter,
    NumberedParameter,
    Opaque,
    OWordLine,
    Program,
    Skip,
    Tape,
    Unary,
    Word,
)
from program.lanes import assert_read_right


def items(text: bytes, dialect: str = "linuxcnc") -> tuple[Item, ...]:
    """The items of a block."""
    program = read(text, dialect=dialect)
    assert_read_right(program)
    return program.items_of(0)


def value(text: bytes) -> Expression:
    """The value of the only word of a block."""
    (word,) = items(text)
    assert isinstance(word, Word)
    return word.value


def texts(program: Program, block: int) -> list[str]:
    """The text of each item."""
    return [program.slice(block, item.span) for item in program.items_of(block)]


def test_words_have_addresses_values_and_places() -> None:
    program = read(b"N10 g1 X-12.5Y+.5 (side) F100.\n", dialect="linuxcnc")
    assert_read_right(program)
    words = program.templates[0].words
    assert [word.address for word in words] == ["N", "G", "X", "Y", "F"]
    assert [program.slice(0, word.value_span) for word in words] == ["10", "1", "-12.5", "+.5", "100."]
    assert texts(program, 0) == ["N10", "g1", "X-12.5", "Y+.5", "(side)", "F100."]
    assert program.values_of(0).tolist() == [10.0, -12.5, 0.5, 100.0]


def test_polar_and_spindle_addresses_of_linuxcnc() -> None:
    program = read(b"G1 @10 ^45.5\nM3 $1 S200\n", dialect="linuxcnc")
    assert_read_right(program)
    assert program.column("@")[0] == 10.0
    assert program.column("^")[0] == 45.5
    assert program.column("$")[1] == 1.0


def test_the_numbers_of_g_and_m_belong_to_the_template() -> None:
    program = read(b"G38.2 Z-5 M08\nG91.1\nG1\nG01\nG#1 M[2]\n", dialect="linuxcnc")
    codes = [(template.g_codes, template.m_codes) for template in program.templates]
    assert codes == [((382,), (80,)), ((911,), ()), ((10,), ()), ((10,), ()), ((), ())]
    assert program.templates[0].words[0].value == Constant(38.2)


def test_blocks_of_one_shape_share_a_template() -> None:
    program = read(b"G1 X1 Y2 (one)\nG1 X-1.5 Y+2. (another comment)\nG0 X1 Y2 (one)\n", dialect="linuxcnc")
    assert program.template.tolist() == [0, 0, 1]
    assert texts(program, 1) == ["G1", "X-1.5", "Y+2.", "(another comment)"]


def test_a_column_of_words() -> None:
    program = read(b"G1 X1 Y2\nX3\nY#1\n\nX[4]\nX-5 Y6\n", dialect="linuxcnc")
    np.testing.assert_array_equal(program.column("X"), [1, 3, np.nan, np.nan, np.nan, -5])
    np.testing.assert_array_equal(program.column("Y"), [2, np.nan, np.nan, np.nan, np.nan, 6])
    assert program.templates[0].slots == {"X": 0, "Y": 1}


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"X1", Literal(0)),
        (b"X#1", NumberedParameter(Literal(0))),
        (b"X##1", NumberedParameter(NumberedParameter(Literal(0)))),
        (b"X#[1+2]", NumberedParameter(Binary("+", Literal(0), Literal(1)))),
        (b"X# < Depth Of Cut >", NamedParameter("depthofcut")),
        (b"X-#1", Unary("-", NumberedParameter(Literal(0)))),
        (b"X+[1]", Unary("+", Literal(0))),
        (b"X[-1]", Unary("+", Literal(0))),
        (b"XSIN[30]", Unary("sin", Literal(0))),
        (b"X-sqrt[2]", Unary("-", Unary("sqrt", Literal(0)))),
        (b"Xatan[1]/[2]", Binary("atan", Literal(0), Literal(1))),
        (b"X[atan[1]/[2]/3]", Binary("/", Binary("atan", Literal(0), Literal(1)), Literal(2))),
        (b"XEXISTS[#<a>]", Exists(NamedParameter("a"))),
        (b"XEXISTS[#5]", Exists(NumberedParameter(Literal(0)))),
    ],
)
def test_values(text: bytes, expected: Expression) -> None:
    assert value(text) == expected


A, B, C = Literal(0), Literal(1), Literal(2)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"1 + 2 * 3", Binary("+", A, Binary("*", B, C))),
        (b"1 - 2 - 3", Binary("-", Binary("-", A, B), C)),
        (b"1 - -2", Binary("-", A, B)),
        (b"1 / 2 / 3", Binary("/", Binary("/", A, B), C)),
        (b"1 MOD 2 * 3", Binary("*", Binary("mod", A, B), C)),
        (b"2 ** 3 ** 2", Binary("**", Binary("**", A, B), C)),
        (b"2 * 3 ** 2", Binary("*", A, Binary("**", B, C))),
        (b"1 + 2 GT 3", Binary("gt", Binary("+", A, B), C)),
        (b"1 EQ 2 AND 3", Binary("and", Binary("eq", A, B), C)),
        (b"1 or 2 xor 3", Binary("xor", Binary("or", A, B), C)),
        (b"[1 - 2] * 3", Binary("*", Binary("-", A, B), C)),
        (b"1 NE [2 LE 3]", Binary("ne", A, Binary("le", B, C))),
    ],
)
def test_operators_bind_by_rank_and_from_the_left(text: bytes, expected: Expression) -> None:
    assert value(b"X[" + text + b"]") == expected


def test_assignments() -> None:
    first, second, word = items(b"#<Speed>=[100*2] #5=-3 X1")
    assert isinstance(first, Assignment)
    assert isinstance(second, Assignment)
    assert (first.target, first.value) == (NamedParameter("speed"), Binary("*", Literal(0), Literal(1)))
    assert (second.target, second.value) == (NumberedParameter(Literal(2)), Literal(3))
    assert isinstance(word, Word)


@pytest.mark.parametrize(
    ("text", "label", "keyword", "arguments"),
    [
        (b"o100 sub", "100", "sub", 0),
        (b"O0100 ENDSUB [#1]", "100", "endsub", 1),
        (b"o<Side> call [1] [2+3]", "side", "call", 2),
        (b"o[#1] call", NumberedParameter(Literal(0)), "call", 0),
        (b"o#<which> call [1]", NamedParameter("which"), "call", 1),
        (b"o1 if [#1 GT 2]", "1", "if", 1),
        (b"o1 else if [1]", "1", "elseif", 1),
        (b"o1 else", "1", "else", 0),
        (b"o1 endif", "1", "endif", 0),
        (b"o1 do", "1", "do", 0),
        (b"o1 while [1]", "1", "while", 1),
        (b"o1 end while", "1", "endwhile", 0),
        (b"o1 repeat [3]", "1", "repeat", 1),
        (b"o1 endrepeat", "1", "endrepeat", 0),
        (b"o1 break", "1", "break", 0),
        (b"o1 continue", "1", "continue", 0),
        (b"o1 return [2]", "1", "return", 1),
        (b"O1234", "1234", "program", 0),
    ],
)
def test_flow_control(text: bytes, label: str | Expression, keyword: str, arguments: int) -> None:
    flow = items(text)[0]
    assert isinstance(flow, OWordLine)
    assert (flow.label, flow.keyword, len(flow.arguments)) == (label, keyword, arguments)


def test_block_skip_line_number_and_comments_around_an_o_word() -> None:
    kinds = [type(item) for item in items(b"/ N5 o1 if [1] (yes) ; or no (\n")]
    assert kinds == [Skip, Word, OWordLine, Comment, Comment]


@pytest.mark.parametrize("text", [b"G1 X 1 2.5 Y- 3 Z+ .5", b"G 1X12.5Y-3Z.5", b"\tg\t1 x12.5\t y - 3z0.50"])
def test_blanks_within_words_mean_nothing(text: bytes) -> None:
    program = read(text, dialect="linuxcnc")
    assert_read_right(program)
    assert program.templates[0].g_codes == (10,)
    assert program.values_of(0).tolist() == [12.5, -3.0, 0.5]


def test_blanks_between_sign_and_digits_belong_to_the_number() -> None:
    program = read(b"G0 Y- 3\n", dialect="linuxcnc")
    assert program.slice(0, program.templates[0].words[1].value_span) == "- 3"


def test_a_comment_may_hold_anything_but_parentheses() -> None:
    every_byte = bytes(set(range(1, 256)) - set(b"()\r\n"))
    program = read(b"G0 (" + every_byte + b") X1 ;((" + every_byte + b"\nM2 (x)\n", dialect="iso")
    assert_read_right(program)
    assert [type(item) for item in program.items_of(0)] == [Word, Comment, Word, Comment]


@pytest.mark.parametrize(
    "source",
    [
        b"G0 X0.\r\nG1X50. ; \xe4\xf6\r\n",
        b"%\r\nM2",
        b" \n\n/g 0 x 1 2 . 5\n",
        b"G0 X1\rG0 X2\r",
        b"G0 X1\r\r\nG0 X2\r\r\n",
        b"G0 X1\nG0 X2\r\nG0 X3",
        b"\xef\xbb\xbfG0 X1 (BOM)\nM2\n",
        b"\xef\xbb\xbf%\nG0 X1\n%\n",
        b"M2",
        b"\n\n\nM2\n\n\n",
    ],
)
def test_the_bytes_are_kept(source: bytes) -> None:
    assert_read_right(read(source))


@pytest.mark.parametrize(("source", "lines"), [(b"X1\nX2\n", 2), (b"X1\r\nX2", 2), (b"X1\rX2\r", 2), (b"X1\n\nX2", 3)])
def test_a_block_is_a_line(source: bytes, lines: int) -> None:
    program = read(source)
    assert [program.line(block) for block in program] == list(range(1, lines + 1))
    assert program.text_of(lines - 1) == "X2"


def test_what_follows_the_tape_is_not_looked_at() -> None:
    program = read(b"%\nG0 X1\n % \n&& 12 X1.2.3\n\n%\n")
    assert_read_right(program)
    assert [type(item) for item in program.items_of(0)] == [Tape]
    assert [type(item) for item in program.items_of(3)] == [Opaque]
    assert program.values_of(3).tolist() == []


@pytest.mark.parametrize("comment", ['($Show("[a -> b] X5") )', "(a (1, 2))", "((a)\t)"])
def test_iso_takes_a_comment_in_a_comment_where_both_end_together(comment: str) -> None:
    """Whether the comment ends at the first parenthesis or at the second: no word stands between them."""
    program = read(f"G0 X1 {comment}\n{comment} G1 X2 {comment}\n{comment}\nX3 {comment} Y4\n".encode(), dialect="iso")
    assert_read_right(program)
    words = [[i.address for i in program.items_of(b) if isinstance(i, Word)] for b in range(len(program))]
    assert words == [["G", "X"], ["G", "X"], [], ["X", "Y"]]
    for dialect, text in (("linuxcnc", comment), ("iso", f"{comment[:-1]} X5)")):
        with pytest.raises(SourceError) as caught:
            read(f"G0 X1 {text}\n".encode(), dialect=dialect)
        assert caught.value.code == "NCF112"


def test_comments_may_precede_the_tape() -> None:
    program = read(b"(made on monday)\n%\nG0 X1\n%\nrest\n")
    assert [type(program.items_of(block)[0]) for block in program] == [Comment, Tape, Word, Tape, Opaque]


def test_numbers_of_many_digits_are_rounded_as_python_does() -> None:
    program = read(b"X1234567890.123456789 Y0.1234567890123456789 Z100000000000000000000123\n")
    assert program.values_of(0).tolist() == [1234567890.123456789, 0.1234567890123456789, 100000000000000000000123.0]


def test_programs_do_not_disturb_each_other() -> None:
    first = read(b"G1 X1 Y[1+2]\n", dialect="linuxcnc")
    second = read(b"G0 Z1\nG1 X2 Y[3+4]\n", dialect="linuxcnc")
    assert second.templates[1] == first.templates[0]
    assert second.values_of(1).tolist() == [2.0, 3.0, 4.0]


def test_parts_are_joined(monkeypatch: pytest.MonkeyPatch) -> None:
    source = b"".join(b"N%d G1 X%d.5 Y 1 %d ; %d\n" % (i, i, i % 7, i) for i in range(100))
    whole = read(source, dialect="linuxcnc")
    monkeypatch.setattr("ncfix.text.reader.PART_BYTES", 100)
    parts = read(source, dialect="linuxcnc")
    assert_read_right(parts)
    for name in ("template", "blocks", "first_number", "number_spans", "numbers"):
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name))


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        (b"O1234 (PART)", [OWordLine, Comment]),
        (b":1234", [OWordLine]),
        (b"<PART-1>", [Opaque]),
        (b"O1<PART>", [OWordLine, Opaque]),
        (b"%PART-1", [Tape]),
        (b"/2 N10 G0 X1;", [Skip, Word, Word, Word, Comment]),
        (b"N10 /3 G0", [Word, Skip, Word]),
        (b"$H", [Opaque]),
        (b"$10=3 (x)", [Opaque]),
        (b"G1 X1 E2.5", [Word, Word, Word]),
        (b"N3 T0*57", [Word, Word, Opaque]),
        (b'M862.3 P "CORE ONE" ; check', [Word, Opaque, Comment]),
        (b"M98 P1000 L2", [Word, Word, Word]),
        (b"#100=[#1+2.5]", [Assignment]),
        (b"M30\x1a", [Word, Opaque]),
        (b"?", [Opaque]),
        (b"!G1 X2 ? ~", [Opaque, Word, Word, Opaque, Opaque]),
        (b"", []),
    ],
)
def test_iso_is_lenient(text: bytes, kinds: list[type]) -> None:
    assert [type(item) for item in items(text + b"\nM30", "iso")] == kinds
