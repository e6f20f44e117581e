"""Motions written many at a time come out, byte for byte, as they do one by one."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from itertools import product
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from ncfix import core
from ncfix.control.moves import MotionKind, Moves, Rule
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.diagnostics import SourceError
from ncfix.text.language import language_of
from ncfix.text.reader import read
from ncfix.text.tree import Program
from ncfix.text.writer import Edit, Splices, apply, spliced
from ncfix.writer.bulk import Bulk
from ncfix.writer.emit import Emission, emit
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.pieces import Pieces
from program.arcs import full_of_arcs

AXES, ROTARY = ("X", "Y", "Z", "B", "C"), frozenset("BC")
STEPS = np.array([1e-3, 1e-3, 1e-3, np.radians(1e-3), np.radians(1e-3)])
EXAMPLES = settings(derandomize=True, deadline=None, max_examples=some(40))


def followed(source: bytes, dialect: str = "linuxcnc") -> tuple[Program, Moves]:
    setup = Setup(assume_zero=True, initial=dict.fromkeys(AXES, 0.0))
    program = read(source, "generated.nc", dialect)
    return program, trace(program, setup, AXES, ROTARY).moves


def moved(moves: Moves, seed: int, size: float) -> Pieces:
    """Corrections that wander along the path; some motions in two pieces, some left alone; dwells follow the axes."""
    rng = np.random.default_rng(seed)
    shift = size * np.cumsum(rng.normal(size=moves.end.shape), axis=0) / 10
    shift[:, moves.rotary] *= rng.integers(0, 2) / 100
    unchanged = (moves.rule != Rule.CORRECT) | (rng.random(len(moves)) < 0.01)
    shift[unchanged] = 0.0
    dwells = np.flatnonzero(moves.kind[1:] == MotionKind.DWELL) + 1
    for row in dwells.tolist():
        shift[row] = shift[row - 1]
    counts = np.where((rng.random(len(moves)) < 0.02) & ~unchanged & (moves.kind != MotionKind.CYCLE), 2, 1)
    move = np.repeat(np.arange(len(moves)), counts)
    last = np.append(np.diff(move) != 0, True)
    end = (moves.end + shift)[move]
    end[~last] = ((moves.start + moves.end) / 2 + shift)[move[~last]]
    arc = (moves.kind == MotionKind.ARC)[move] & (counts[move] == 1)
    return Pieces(move, np.where(last, 1.0, 0.5), end, arc, moves.centre[move].copy(), unchanged[move])


def in_all_ways(program: Program, moves: Moves, pieces: Pieces) -> tuple[Emission, ...]:
    """Written many at a time, the same compiled if that is installed, and one by one."""
    found = []
    for form in ("plain", None):
        core.use(form)
        found.append(emit(program, moves, pieces, STEPS))
    one_by_one = replace(language_of(program.dialect, WrittenLanguage), bulk=None)
    with mock.patch("ncfix.writer.emit.language_of", return_value=one_by_one):
        return *found, emit(program, moves, pieces, STEPS)


def assert_same(program: Program, moves: Moves, pieces: Pieces) -> None:
    """The same text and conflicts, and numbers but for noise, which an R near half the chord makes a thousandfold."""
    *many, slow = in_all_ways(program, moves, pieces)
    text = apply(program.source, slow.edits)
    for each in many:
        assert spliced(program.source, each.splices).decode("latin-1") == text.decode("latin-1")
        assert each.conflicts == slow.conflicts
        assert each.added_blocks == slow.added_blocks
        for name, noise in (("start", 1e-12), ("end", 1e-12), ("centre", 1e-9)):
            assert np.allclose(getattr(each, name), getattr(slow, name), rtol=0, atol=noise, equal_nan=True), name


NUMBERS = st.one_of(
    st.integers(-400, 400).map(lambda n: f"{n / 8:g}"),
    st.integers(-99999, 99999).map(lambda n: f"{n / 1000:.3f}"),
    st.integers(-99999, 99999).map(lambda n: f"{n / 10000:.4f}"),
    st.sampled_from(
        ["0", "0.", ".5", "-.25", "+3.", "+0.125", "-0.0", "007.5", "-012", "5.00000", "1 2.5", "- 3.", "0.00049"]
    ),
)
BLANKS = st.sampled_from(["", " ", "\t", "  "])


@st.composite
def blocks(draw: st.DrawFn) -> str:
    letters = draw(st.lists(st.sampled_from("XYZBC"), min_size=1, max_size=5, unique=True))
    words = [letter + draw(NUMBERS) for letter in letters]
    code = draw(st.sampled_from(["", "", "", "G1", "G0", "G01"]))
    number = draw(st.sampled_from(["", "N10", "N0020"]))
    feed = draw(st.sampled_from(["", "", "F500.", "F1234"]))
    text = draw(BLANKS).join(word for word in (number, code, *words, feed) if word)
    comment = draw(st.sampled_from(["", "", " (a 5)", ";tail"]))
    return (text.lower() if draw(st.booleans()) and draw(st.booleans()) else text) + comment


OTHERS = st.sampled_from(
    [
        "",
        "(remark 12)",
        "G91 G1 X1. Y-.5 F100\nG90",
        "G2 X10. Y0. I5. J0. F100.",
        "G20\nG1 X1.5 F20.\nG21",
        "M5",
        "G92 X1.",
        "#1=3",
        "G1 X[#1+2] F10.",
        "G4 P1.5",
        "/G4 P2",
    ]
)


@EXAMPLES
@given(
    lines=st.lists(st.one_of(blocks(), blocks(), blocks(), OTHERS), min_size=1, max_size=40),
    seed=st.integers(0, 1000),
    size=st.sampled_from([0.0, 0.0003, 0.01, 0.7]),
    end=st.sampled_from(["\n", "\r\n"]),
)
def test_many_at_a_time_as_one_by_one(lines: list[str], seed: int, size: float, end: str) -> None:
    source = end.join(["G0 G90 G21 G94 X0 Y0 Z0 B0 C0 F1000", *lines, "M2", ""]).encode()
    try:
        program, moves = followed(source)
    except Exception:  # an arc that does not close, and the like: not what this is about
        return
    assert_same(program, moves, moved(moves, seed, size))


@pytest.mark.parametrize("modal", [False, True])
def test_long_stretches(modal: bool) -> None:
    rng = np.random.default_rng(5)
    path = np.round(np.cumsum(rng.normal(size=(1000, 5)), axis=0), 4)
    lines = []
    for row in path:
        words = [f"{letter}{value:.4f}" for letter, value in zip("XYZBC", row, strict=True)]
        lines.append(" ".join(["N1", "G1", *(word for word in words if not modal or rng.random() < 0.6), "F100."]))
    program, moves = followed("\n".join(["G90 G21 G94", *lines, "M2\n"]).encode())
    pieces = moved(moves, 3, 0.01)
    core.use("plain")
    taken, take = [], Bulk.take
    with mock.patch.object(Bulk, "take", lambda *given: taken.append(take(*given)) or taken[-1]):
        emit(program, moves, pieces, STEPS)
    assert sum(len(ends) for ends in taken if ends is not None) > 500
    assert_same(program, moves, pieces)


@pytest.mark.parametrize("size", [0.0003, 0.01, 0.7, 40.0])
def test_every_style_in_a_stretch(size: float) -> None:
    styles = product(
        ("", "+", "-"), ("", "0", "7", "00", "007", "099", "123"), ("", ".", ".0", ".5", ".1250", ".000001")
    )
    numbers = ["".join(style) for style in styles if any(map(str.isdigit, "".join(style)))]
    lines = [f"G1 X{number} Y{numbers[-k]} C{numbers[k // 2]}" for k, number in enumerate(numbers, 1)]
    program, moves = followed("\n".join(["G90 G21 G94 G0 X0 Y0 Z0 B0 C0 F100", *lines, "M2\n"]).encode())
    assert_same(program, moves, moved(moves, 11, size))


@EXAMPLES
@given(
    seed=st.integers(0, 10_000),
    size=st.sampled_from([0.0, 0.0003, 0.01, 0.7]),
    start=st.sampled_from(
        [
            ("linuxcnc", "G21"),
            ("linuxcnc", "G21; G92 X1. Y-2.5"),
            ("linuxcnc", "G20"),
            ("linuxcnc", "G20; G92 X1. Z3."),
            ("fanuc", "G21"),
            ("haas", "G20; G52 X1. Y-2.5"),
            ("siemens", "G71"),
            ("siemens", "G700; TRANS X1 Z-2.5"),
        ]
    ),
)
def test_arcs_many_at_a_time_as_one_by_one(seed: int, size: float, start: tuple[str, str]) -> None:
    dialect, frame = start
    head = ["G90 G94 F1000", "G0 X0. Y0. Z0. B0. C0.", *frame.split("; "), "X0. Y0. Z0."]
    try:
        body = full_of_arcs(seed, 50, sinumerik=dialect == "siemens")
        program, moves = followed("\n".join([*head, *body, "M2\n"]).encode(), dialect)
    except SourceError:  # half a turn by R that does not reach its end: digits say less in inch
        return
    pieces = moved(moves, seed, size)
    shift = (pieces.end - moves.end[pieces.move])[:, :3] * np.random.default_rng(seed).choice([0.0, 0.9, 1.0])
    assert_same(program, moves, replace(pieces, centre=pieces.centre + shift))


def quarters_and_lines(seed: int, count: int) -> list[str]:
    """Quarters of circles of 10 mm and lines, words in any order, few numbers in all of them; some repeated."""
    rng = np.random.default_rng(seed)
    lines, x, y, repeated, between = list[str](), 0, 0, 0, str(rng.choice([" ", "", "\t"]))
    for number in range(count):
        right, up = (int(each) for each in rng.choice([-10, 10], size=2))
        beside = bool(rng.random() < 0.5)  # the centre lies beside where the arc begins, or above or below it
        code = "G2" if (right * up > 0) == beside else "G3"
        centre = [f"I{right if beside else 0}.", f"J{0 if beside else up}."]
        centre = [word for word in centre if word[1:] != "0." or rng.random() < 0.7]
        words = [f"X{x + right}.", f"Y{y + up}.", *(centre if rng.random() < 0.7 else ["R10."]), "F10."]
        if rng.random() < 0.3:
            code, words = "G1", [f"X{x + right}.", f"Y{y + up}.", "F10."]
        x, y = x + right, y + up
        words = [words[k] for k in rng.permutation(len(words))]
        if rng.random() < 0.1 and code == "G1":
            repeated += 1
            lines += [f"o{repeated} repeat [2]", between.join([code, *words]), f"o{repeated} endrepeat"]
        else:
            line = between.join([code, *words, *(["G90 G21 G17 G94"] if not number else [])])
            lines.append(line.lower() if rng.random() < 0.2 else line)
    return lines


@settings(EXAMPLES, max_examples=some(100))
@given(seed=st.integers(0, 10**6), size=st.sampled_from([0.0, 0.002, 0.005, 0.01, 0.05]))
def test_arcs_whose_numbers_stand_elsewhere_too(seed: int, size: float) -> None:
    """A radius, a centre and a feed of the same number, in any order, from the first number of the program on."""
    program, moves = followed("\n".join([*quarters_and_lines(seed, 12), "M2\n"]).encode())
    pieces = moved(moves, seed, size)
    if seed % 3:
        pieces.end[:, 2:] = moves.end[pieces.move, 2:]  # the program has not said where these stand
    shift = (pieces.end - moves.end[pieces.move])[:, :3] * np.random.default_rng(seed).choice([0.0, 1.0, 3.0])
    assert_same(program, moves, replace(pieces, centre=pieces.centre + shift))


@pytest.mark.parametrize("size", [0.0003, 0.01])
def test_arcs_whose_centres_count_from_the_origin(size: float) -> None:
    turns = np.linspace(0.5, 60, 120)
    body = [f"G3 X{9 * np.cos(turn):.4f} Y{9 * np.sin(turn):.4f} I0. J0.0" for turn in turns]
    program, moves = followed("\n".join(["G21 G94 F900 G90.1", "G0 X9 Y0 Z0 B0 C0", *body, "M2\n"]).encode())
    pieces = moved(moves, 7, size)
    assert_same(program, moves, replace(pieces, centre=pieces.centre + size))


def test_straight_motions_with_a_direction_of_the_tool_go_one_by_one() -> None:
    """Fanuc: the I J K that an arc has where its centre is are a direction in straight motions (G43.5)."""
    body = ["G2 X1. Y1. I1. J0.", "G1 X2. Y0.", "G2 X3. Y1. I1. J0."]
    program, moves = followed(
        "\n".join(["G21 G90 G94 F900", "G0 X0. Y0. Z0. B0. C0.", *body, "M2\n"]).encode(), "fanuc"
    )
    pieces, first, rule = (
        moved(moves, 1, 0.01),
        np.arange(len(moves) + 1),
        language_of(program.dialect, WrittenLanguage).one_by_one,
    )
    assert rule is not None
    assert not rule(program, moves, pieces, first).any()
    straight = replace(moves, kind=np.full_like(moves.kind, MotionKind.FEED))
    assert rule(program, straight, pieces, first).tolist() == [False, True, False, True]


@pytest.mark.parametrize("dialect", ["linuxcnc", "fanuc", "siemens"])
def test_long_stretches_of_arcs(dialect: str) -> None:
    body = full_of_arcs(4, 800, sinumerik=dialect == "siemens")
    head = ["G90 G94 F1000", "G71" if dialect == "siemens" else "G21", "G0 X0. Y0. Z0. B0. C0."]
    program, moves = followed("\n".join([*head, *body, "M2\n"]).encode(), dialect)
    pieces = moved(moves, 3, 0.01)
    certain, turn = list[int](), Bulk.turn
    with mock.patch.object(Bulk, "turn", lambda *given: (found := turn(*given), certain.append(found[0].sum()))[0]):
        emit(program, moves, pieces, STEPS)
    arcs = np.count_nonzero(pieces.arc & ~pieces.unchanged)
    assert arcs > 400
    assert sum(certain) > 0.4 * arcs
    assert_same(program, moves, pieces)


def written_from(
    program: Program, moves: Moves, pieces: Pieces, begin: np.ndarray | None = None
) -> list[tuple[str, list[list[float]]]]:
    """The text and the ends of pieces, both forms many at a time, and one by one; `begin`: where the first one ends."""
    found = []
    one_by_one = replace(language_of(program.dialect, WrittenLanguage), bulk=None)
    for form, language in (("plain", None), (None, None), (None, one_by_one)):
        core.use(form)
        with ExitStack() as patches:
            if language is not None:
                patches.enter_context(mock.patch("ncfix.writer.emit.language_of", return_value=language))
            emission = emit(program, moves, pieces, STEPS, done=begin)
        found.append((spliced(program.source, emission.splices).decode(), emission.end.tolist()))
    return found


def in_one_piece_each(moves: Moves, end: np.ndarray) -> Pieces:
    nothing = np.zeros(len(moves), dtype=bool)
    return Pieces(np.arange(len(moves)), np.ones(len(moves)), end, nothing, moves.centre.copy(), nothing)


def test_an_axis_without_a_word_that_stands_elsewhere_gets_none() -> None:
    """What the machine did before is not what was planned: X, of which the program says nothing, is not led back."""
    program, moves = followed(b"G90 G21 G94 G1 F1000 Y0 Z0 B0 C0\nB1\nB2 Y1\nB3\nM2\n")
    moves = replace(moves, placed=np.tile(np.array(AXES) != "X", (len(moves), 1)))
    pieces = in_one_piece_each(moves, moves.end.copy())
    for text, ends in written_from(program, moves, pieces, pieces.end[0] + [0.5, 0, 0, 0, 0]):
        assert text.encode() == program.source
        assert [end[0] for end in ends[1:]] == [0.5, 0.5, 0.5]


def test_an_axis_that_must_get_no_word_from_a_motion_on_gets_none() -> None:
    """X rests from the third motion on, where a correction of the second has left it."""
    program, moves = followed(b"G90 G21 G94 G1 F1000 X0 Y0 Z0 B0 C0\nX1 B1\nB2 Y1\nB3\nM2\n")
    moves = replace(moves, resting=np.zeros_like(moves.programmed))
    moves.resting[2:, 0] = True
    end = moves.end.copy()
    end[1, 0] += 0.5
    for text, ends in written_from(program, moves, in_one_piece_each(moves, end)):
        assert text.splitlines()[1:4] == ["X1.5 B1", "B2 Y1", "B3"]
        assert [each[0] for each in ends[1:]] == [1.5, 1.5, 1.5]


def test_words_that_an_axis_gets_though_it_stands_there() -> None:
    """Told to spell out Z, where it stands already, a motion is written by itself; the others are not."""
    program, moves = followed(b"G90 G21 G94 G1 F1000 X0 Y0 Z0 B0 C0\nX1\nX2\nX3\nM2\n")
    moves = replace(moves, spelled=np.zeros_like(moves.programmed))
    moves.spelled[2, 2] = True
    for text, _ in written_from(program, moves, in_one_piece_each(moves, moves.end.copy())):
        assert text.splitlines()[1:4] == ["X1", "X2 Z0.000", "X3"]


def test_arcs_and_dwells_do_not_part_a_stretch() -> None:
    line = [f"X{n / 7:.3f} Z{n / 9:.3f} B{n / 5:.3f}" for n in range(1, 41)]
    lines = [*line, "G4 P1.", "X9. Y1. Z4.", "G2 X11. Y3. I2. J0.", "G3 X9. Y1. Z3. I-2. J0.", "G1 X9. Z4.", *line]
    program, moves = followed("\n".join(["G90 G21 G94 G17", "G0 X0 Y0 Z0 B0 C0 F1000", *lines, "M2\n"]).encode())
    rows, unchanged = np.arange(len(moves)), moves.kind == MotionKind.DWELL
    shifted = moves.end + 0.0123, moves.kind == MotionKind.ARC, moves.centre + 0.0123
    pieces = Pieces(rows, np.ones(len(rows)), *shifted, unchanged)
    with mock.patch.object(Bulk, "take", autospec=True, side_effect=Bulk.take) as taken:
        emit(program, moves, pieces, STEPS)
    assert taken.call_count == 1
    assert_same(program, moves, pieces)


@pytest.mark.parametrize(
    ("dialect", "dwell"),
    [
        ("fanuc", "G4 X1.5"),
        ("fanuc", "G04 X0.5 F30"),
        ("fanuc", "/G4 X1.5"),
        ("fanuc", "G4 X1.5\nG4 X2.5"),
        ("fanuc", "G4 P1500"),
        ("iso", "G4 X1.5"),
        ("haas", "G4 X1.5"),
        ("siemens", "G4 F1 X5"),
        ("siemens", "G4 F1"),
        ("linuxcnc", "G1 X1. G4 P1"),
        ("linuxcnc", "G4 P1 X5."),
        ("linuxcnc", "G4 P1 G1 X33.5"),
    ],
)
def test_times_and_motions_with_letters_of_axes_in_dwells(dialect: str, dwell: str) -> None:
    line = [f"X{n / 7:.3f} Y1. Z{n / 9:.3f} B{n / 5:.3f} C0." for n in range(1, 41)]
    units = "G71" if dialect == "siemens" else "G21"
    lines = [
        f"G90 {units} G94 G17",
        "G0 X0. Y0. Z0. B0. C0.",
        "G1 F1000",
        *line,
        *dwell.split("\n"),
        *line,
        dwell,
        *line,
    ]
    program, moves = followed("\n".join([*lines, "M2\n"]).encode(), dialect)
    assert (moves.kind == MotionKind.DWELL).any()
    assert_same(program, moves, moved(moves, 2, 0.01))


@EXAMPLES
@given(
    centre=st.sampled_from(["I2.0000000001 J0", "I2.00000000000000000 J0.", "R2.8284"]),
    off=st.sampled_from([0.0123, 0.0125]),
    seed=st.integers(0, 100),
)
def test_an_arc_whose_centre_is_not_clear_is_written_by_itself(centre: str, off: float, seed: int) -> None:
    lines = [f"X{n / 8:.3f} Z{n / 8:.3f}\nG1 X9. Y1. Z4.\nG2 X11. Y3. {centre}\nG1 X9. Y1. Z{n / 5}" for n in range(9)]
    program, moves = followed("\n".join(["G90 G21 G94 G17", "G1 X0 Y0 Z0 B0 C0 F1000", *lines, "M2\n"]).encode())
    pieces = moved(moves, seed, 0.01)
    assert_same(program, moves, replace(pieces, centre=pieces.centre + off * ~pieces.unchanged[:, None]))


def test_arcs_written_by_themselves_in_another_order_than_they_stand_in() -> None:
    """Half circles by R, whose centres are not clear, in a subprogram that stands before the lines that call it."""
    arcs = [f"G1 X{n}. Y0.\nG2 X{n}. Y4. R2." for n in range(1, 4)]
    lines = ["o1 sub", *arcs, "o1 endsub", "G90 G21 G94 G17", "G1 X0 Y0 Z0 B0 C0 F1000", *arcs, "o1 call", "M2\n"]
    program, moves = followed("\n".join(lines).encode())
    assert (np.diff(moves.block) < 0).any()
    rows, arc = np.arange(len(moves)), moves.kind == MotionKind.ARC
    shifted = moves.end + 0.0123, arc, moves.centre + 0.0123
    assert_same(program, moves, Pieces(rows, np.ones(len(rows)), *shifted, np.zeros_like(arc)))


def test_words_of_more_digits_than_the_control_resolves() -> None:
    """Axes without words that are half an output step off where such a word leaves them: ties, but for the last bit."""
    lines = [line for n in range(60) for line in (f"X{n}.5 C{n / 27 + 0.0005:.4f}", f"X{n}.75")]
    program, moves = followed("\n".join(["G90 G21 G94 G1 X0 Y0 Z0 B0 C0 F1000", *lines, "M2\n"]).encode())
    rows, end, none = np.arange(len(moves)), moves.end.copy(), np.zeros(len(moves), dtype=bool)
    end[2::2, 4] = np.radians(np.round(np.degrees(end[1::2, 4]) + 0.0005, 3))
    assert_same(program, moves, Pieces(rows, np.ones(len(rows)), end, none, moves.centre, none))


@EXAMPLES
@given(st.binary(max_size=40), st.data())
def test_many_edits_as_single_ones(source: bytes, data: st.DataObject) -> None:
    places = sorted(data.draw(st.lists(st.integers(0, len(source)), max_size=10)))
    edits = [
        Edit(start, stop, data.draw(st.binary(max_size=3)))
        for start, stop in zip(places[::2], places[1::2], strict=False)
    ]
    assert spliced(source, Splices.of(edits)) == apply(source, edits)
    halves = [Splices.of(edits[1::2]), Splices.of(edits[::2])]
    if len({(edit.start, edit.stop) for edit in edits}) == len(edits):
        assert spliced(source, Splices.joined(halves)) == apply(source, edits)


@EXAMPLES
@given(st.integers(20, 60), st.sets(st.integers(0, 19), max_size=5), st.binary(min_size=1, max_size=3))
def test_many_edits_of_which_few_change_the_length(count: int, other: set[int], text: bytes) -> None:
    source = bytes(range(65, 65 + 26)) * count
    edits = [Edit(7 * k, 7 * k + 4, text if k in other else b"%04d" % k) for k in range(count)]
    edits += [Edit(7 * count, 7 * count, text)]
    assert spliced(source, Splices.of(edits)) == apply(source, edits)


def test_edits_that_overlap_are_refused() -> None:
    with pytest.raises(ValueError, match="overlap"):
        spliced(b"abcdef", Splices.of([Edit(0, 3, b""), Edit(2, 4, b"")]))
