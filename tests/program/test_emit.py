"""Corrected motions written back: what changes in the text, and what must not."""

import numpy as np
import pytest

from ncfix.control.moves import Frame, MotionKind, Moves
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.text.reader import read
from ncfix.text.writer import apply
from ncfix.writer.block import NO_TIME
from ncfix.writer.emit import MODE_LOST, SEVERAL_STATES, emit
from ncfix.writer.pieces import Pieces
from ncfix.writer.target import FrameMap

AXES = ("X", "Y", "Z")
STEP = np.full(3, 0.001)
GIVEN = Setup(work_offsets={"G54": {}}, initial=dict.fromkeys(AXES, 0.0))


def traced(text: str) -> tuple:
    program = read(text.encode("latin-1"), "test.ngc", "linuxcnc")
    return program, trace(program, GIVEN, AXES, frozenset()).moves


def whole(moves: Moves, shift=(0.0, 0.0, 0.0), unchanged: np.ndarray | None = None) -> Pieces:
    """One piece per motion, all ends and centres shifted alike."""
    arc = moves.kind == MotionKind.ARC
    n = len(moves)
    keep = np.zeros(n, dtype=bool) if unchanged is None else unchanged
    return Pieces(np.arange(n), np.ones(n), moves.end + np.array(shift), arc, moves.centre + np.array(shift), keep)


def rewritten(text: str, shift=(0.0, 0.0, 0.0), unchanged: np.ndarray | None = None) -> str:
    program, moves = traced(text)
    emission = emit(program, moves, whole(moves, shift, unchanged), STEP)
    assert not emission.conflicts
    return apply(program.source, emission.edits).decode("latin-1")


@pytest.mark.parametrize(
    "text",
    [
        "G0 X1 Y2. Z-.5\nG1 X1.000 F100\nM2\n",
        "g1x+1.y2f100\r\n(a comment)\r\nG91 G1 X-0.5\r\nM2",
        "G20 G1 X1 F10\nG2 X2 Y1 I1 J0\nG3 X3 Y2 R1\nM2\n",
        "#1=5\nG1 X#1 Y[#1*2] F100\nM2\n",
        "G93 G1 X1 F2\nG1 X2 F3\nM2\n",
        "G81 X1 Y2 Z-3 R1 F100\nX2\nG80\nM2\n",
        "G53 G0 Z0\nG1 X1 F100\nM2\n",
    ],
)
def test_without_correction_nothing_changes(text: str):
    assert rewritten(text) == text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        # every word keeps its style; a missing axis is added behind the last one
        ("N5 G1 X10. Y20 F100 (go)\nM2\n", "N5 G1 X10.01 Y19.98 Z0.005 F100 (go)\nM2\n"),
        ("g1x10.y20f100\nM2\n", "g1x10.01y19.98z0.005f100\nM2\n"),
        # the second block need not say again what has not moved since
        ("G1 X1 Y1 Z1 F9\nX2\nM2\n", "G1 X1.01 Y0.98 Z1.005 F9\nX2.01\nM2\n"),
        # increments from emitted positions: the constant part is taken up once
        ("G91 G1 X1. F9\nX1.\nM2\n", "G91 G1 X1.01 Y-0.020 Z0.005 F9\nX1.\nM2\n"),
        # an expression gives way to a number
        ("#1=3\nG1 X[#1+1] Y0 Z0 F9\nM2\n", "#1=3\nG1 X4.01 Y-0.02 Z0.005 F9\nM2\n"),
        ("#1=3\nG1 X[#1*1.25] Y0 Z0 F9\nM2\n", "#1=3\nG1 X3.76 Y-0.02 Z0.005 F9\nM2\n"),
        # inches: digits as the least increment needs them
        ("G20 G1 X1. F9\nM2\n", "G20 G1 X1.00039 Y-0.00079 Z0.00020 F9\nM2\n"),
        # arcs: incremental centres stay, the start has moved with everything else
        ("G1 X0 Y0 Z0 F9\nG2 X2 Y0 I1 J0\nM2\n", "G1 X0.01 Y-0.02 Z0.005 F9\nG2 X2.01 Y-0.02 I1 J0\nM2\n"),
        ("G1 X0 Y0 Z0 F9\nG2 X1 Y1 R1.\nM2\n", "G1 X0.01 Y-0.02 Z0.005 F9\nG2 X1.01 Y0.98 R1.\nM2\n"),
    ],
)
def test_a_constant_shift(text: str, expected: str):
    assert rewritten(text, (0.01, -0.02, 0.005)) == expected


def test_half_a_step_is_the_threshold():
    assert rewritten("G1 X1.000 Y0 Z0 F9\nM2\n", (0.00049, 0, 0)) == "G1 X1.000 Y0 Z0 F9\nM2\n"
    assert rewritten("G1 X1.000 Y0 Z0 F9\nM2\n", (0.00051, 0, 0)) == "G1 X1.001 Y0 Z0 F9\nM2\n"


def test_rounding_of_increments_is_carried():
    """A correction of a third of a step per block: 300 blocks end within half a step of where they should."""
    n = 300
    program, moves = traced("G91 G1 F100 X0 Y0 Z0\n" + "X1.\n" * n + "M2\n")
    pieces = whole(moves)
    pieces.end[:, 0] += np.arange(len(moves)) * STEP[0] / 3
    emission = emit(program, moves, pieces, STEP)
    assert np.abs(emission.end - pieces.end).max() <= STEP[0] / 2 + 1e-9
    text = apply(program.source, emission.edits).decode()
    words = [float(line[1:]) for line in text.splitlines() if line.startswith("X")]
    assert abs(sum(words) - pieces.end[-1, 0]) <= STEP[0] / 2 + 1e-9


def split(moves: Moves, row: int, fraction: float) -> Pieces:
    whole_pieces = whole(moves)
    middle = moves.start[row] + fraction * (moves.end[row] - moves.start[row])
    arc = whole_pieces.arc.copy()
    arc[row] = False
    return Pieces(
        np.insert(whole_pieces.move, row, row),
        np.insert(whole_pieces.fraction, row, fraction),
        np.insert(moves.end, row, middle, axis=0),
        np.insert(arc, row, False),
        np.insert(whole_pieces.centre, row, np.nan, axis=0),
        np.insert(whole_pieces.unchanged, row, False),
    )


@pytest.mark.parametrize(
    ("text", "row", "expected"),
    [
        ("G0 X0 Y0 Z0\nG1 X10. F9 S1000 M3\nM2\n", 1, "G0 X0 Y0 Z0\nG1 X4. F9 S1000 M3\nX10.000\nM2\n"),
        ("G0 X0 Y0 Z0\n/G1 X10. F9 M1\nM2\n", 1, "G0 X0 Y0 Z0\n/G1 X4. F9\n/X10.000 M1\nM2\n"),
        ("G0 X0 Y0 Z0\nG1 X10. F9 M5\nM2\n", 1, "G0 X0 Y0 Z0\nG1 X4. F9 M5\nX10.000\nM2\n"),
        ("G0 X0 Y0 Z0\nG93\nG1 X10. F2.\nM2\n", 1, "G0 X0 Y0 Z0\nG93\nG1 X4. F5.\nX10.000 F3.333\nM2\n"),
        ("G0 X0 Y0 Z0\nG91 G1 X10. F9\r\nX1.\nM2\n", 1, "G0 X0 Y0 Z0\nG91 G1 X4. F9\nX6.000\r\nX1.\nM2\n"),
    ],
)
def test_words_of_a_split_block_go_to_the_right_piece(text: str, row: int, expected: str):
    program, moves = traced(text)
    emission = emit(program, moves, split(moves, row, 0.4), STEP)
    assert apply(program.source, emission.edits).decode() == expected.replace(
        "\r\n", "\n" if "\r" not in text else "\r\n"
    )


@pytest.mark.parametrize(
    ("dialect", "block", "pieces"),
    [
        ("iso", "G1 G9 X10. F9", ["G1 X4. F9", "X10.000 G9"]),
        ("iso", "G1 X10. F9 M5", ["G1 X4. F9 M5", "X10.000"]),
        ("fanuc", "G1 G9 X10. F9", ["G1 X4. F9", "X10.000 G9"]),
        ("fanuc", "G1 X10. F9 M5", ["G1 X4. F9", "X10.000 M5"]),
        ("haas", "G1 X10. F9 M09", ["G1 X4. F9", "X10.000 M09"]),
        ("haas", "G1 X10. F9 M8", ["G1 X4. F9 M8", "X10.000"]),
        ("siemens", "G1 G9 X10 F9", ["G1 X4 F9", "X10.000 G9"]),
    ],
)
def test_what_acts_at_the_end_of_a_motion_goes_to_the_last_piece(dialect: str, block: str, pieces: list[str]):
    program = read(f"G0 X0 Y0 Z0\n{block}\nM2\n".encode(), "test", dialect)
    given = Setup(no_point="calculator", assume_zero=True)
    moves = trace(program, given, AXES, frozenset()).moves
    emission = emit(program, moves, split(moves, 1, 0.4), STEP)
    assert apply(program.source, emission.edits).decode().splitlines()[1:3] == pieces


def test_an_arc_made_of_lines_states_the_codes_around_it():
    program, moves = traced("G0 X0 Y0 Z0\nG2 X2 Y0 I1 J0 F9\nX4 I1 J0\nM2\n")
    emission = emit(program, moves, split(moves, 1, 0.5), STEP)
    text = apply(program.source, emission.edits).decode()
    assert text.splitlines()[1:4] == ["G1 X1 Y0 F9", "X2.000", "G2 X4 I1 J0"]


def test_a_word_that_is_taken_out_takes_one_blank_along():
    program, moves = traced("G0 X0 Y0 Z0\nG2 X2 Y0  I1   J0 F9\nG2 X4  I1 J0\nM2\n")
    text = apply(program.source, emit(program, moves, split(moves, 1, 0.5), STEP).edits).decode()
    assert text.splitlines()[1:] == ["G1 X1 Y0    F9", "X2.000", "G2 X4  I1 J0", "M2"]


@pytest.mark.parametrize(
    ("arcs", "lines"),
    [
        ((True, True), ["X2.000 Y0.000 I0.000 J-1.000", "X4 I1 J0"]),
        ((True, False), ["G1 X2.000 Y0.000", "G2 X4 I1 J0"]),
    ],
)
def test_of_an_arc_in_several_the_further_ones_name_the_axes_of_their_plane(arcs: tuple[bool, bool], lines: list[str]):
    source = b"G0 X0 Y0 Z0\nG2 X2 Y0 I1 J0 F9\nX4 I1 J0\nM30\n"
    program = read(source, "test.mpf", "siemens")
    moves = trace(program, Setup(assume_zero=True), AXES, frozenset()).moves
    pieces = split(moves, 1, 0.5)
    top, centre = (1.0, 1.0, 0.0), (1.0, 0.0, 0.0)
    pieces.end[1], pieces.arc[1:3], pieces.centre[1:3] = top, arcs, centre
    emission = emit(program, moves, pieces, STEP)
    text = apply(program.source, emission.edits).decode()
    assert text.splitlines()[1:4] == ["G2 X1 Y1 I1 J0 F9", *lines]
    assert emission.centre[1:3].tolist() == [list(centre)] * 2


def test_what_is_not_known_hides_the_coordinates_that_are_made_of_it():
    """In a frame that is turned about Z an unknown X hides X and Y of the program, not Z."""
    turned = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    frame = FrameMap(Frame(np.array([1.0, 2.0, 3.0]), turned, 1.0), AXES, np.zeros(3, dtype=bool))
    known, lacking = np.array([4.0, 5.0, 6.0]), np.array([np.nan, 5.0, 6.0])
    assert frame.program(known) == pytest.approx([0.8 * 3 + 0.6 * 3, -0.6 * 3 + 0.8 * 3, 3.0])
    assert frame.command(frame.program(known)) == pytest.approx(known)
    assert np.isnan(frame.program(lacking)).tolist() == [True, True, False]
    assert frame.program(lacking)[2] == 3.0
    both = frame.program(np.stack([known, lacking]))
    assert np.isnan(both).tolist() == [[False] * 3, [True, True, False]]


@pytest.mark.parametrize("before", [" ", "N20 ", " N20 ", "/N20 "])
def test_a_full_circle_without_a_word_of_an_axis_becomes_lines(before: str):
    program, moves = traced(f"G0 X0 Y0 Z0\nG2 X2 Y0 I1 J0 F9\n{before}I-1 J0\nX4 Y0 I1 J0\nM2\n")
    emission = emit(program, moves, split(moves, 2, 0.5), STEP)
    text = apply(program.source, emission.edits).decode()
    assert text.splitlines()[2:5:2] == [f"{before}G1  X2.000", "G2 X4 Y0 I1 J0"]


@pytest.mark.parametrize("shift", [-0.00049, 0.00049])
@pytest.mark.parametrize("units", ["G21 G20", "G20 G21", "G21 G21", "G20 G20"])
def test_a_full_circle_in_another_unit_gets_no_words_for_what_digits_left_over(units: str, shift: float):
    """Less than half a step of the control, which is more than three half steps of a number in inches."""
    before, behind = units.split()
    text = f"{before} G1 X1.000 Y2.000 Z0.000 F9\nG91\n{behind}\nG3 I.5 J.25\nM2\n"
    line = rewritten(text, (shift, shift, 0.0)).splitlines()[3]
    assert line.startswith("G3 I")
    assert not set(line) & set("XY")


@pytest.mark.parametrize(("block", "begins"), [("N30 I-1. J0.", "N30 G1 "), ("n30i-1.j0.", "n30g1")])
@pytest.mark.parametrize("dialect", ["linuxcnc", "iso", "fanuc"])
def test_a_full_circle_without_words_of_axes_keeps_its_number_in_front(block: str, begins: str, dialect: str):
    text = f"G0 X0. Y0. Z0.\nG2 X2. Y0. I1. J0. F9\n{block}\nM2\n"
    program = read(text.encode(), "test", dialect)
    moves = trace(program, GIVEN, AXES, frozenset()).moves
    emission = emit(program, moves, split(moves, 2, 0.5), STEP)
    assert apply(program.source, emission.edits).decode().splitlines()[2].startswith(begins)


@pytest.mark.parametrize(
    ("dialect", "text"),
    [("linuxcnc", "#1=2\nG0 X0 Y0 Z0\nG93\nG1 X10. F#1\nM2\n"), ("fanuc", "F9.\nG0 X0 Y0 Z0\nG93\nG1 X10.\nM2\n")],
)
def test_a_block_that_cannot_share_out_its_time_is_a_conflict(dialect: str, text: str):
    program = read(text.encode(), "test", dialect)
    moves = trace(program, GIVEN, AXES, frozenset()).moves
    assert emit(program, moves, split(moves, 1, 0.4), STEP).conflicts == {3: NO_TIME}


def test_a_loop_that_needs_different_corrections_is_a_conflict():
    program, moves = traced("G1 X0 Y0 Z0 F9\nG91\no1 repeat [3]\nG1 X1\no1 endrepeat\nM2\n")
    pieces = whole(moves)
    pieces.end[:, 0] += np.array([0.0, 0.01, 0.03, 0.06])
    emission = emit(program, moves, pieces, STEP)
    assert emission.conflicts == {3: SEVERAL_STATES}


def test_a_loop_whose_corrections_agree_is_written():
    text = "G1 X0 Y0 Z0 F9\no1 repeat [3]\nG1 X1\nX0\no1 endrepeat\nM2\n"
    program, moves = traced(text)
    emission = emit(program, moves, whole(moves, (0.01, 0, 0)), STEP)
    assert not emission.conflicts
    assert apply(program.source, emission.edits).decode().splitlines()[2:4] == ["G1 X1.01", "X0.01"]


def test_behind_a_motion_that_is_written_already_the_next_goes_on_from_where_it_led():
    program, moves = traced("G1 X1 Y0 Z0 F9\nX2\nG91 X1\nM2\n")
    emission = emit(program, moves, whole(moves), STEP, done=np.array([1.25, 0.5, 0.0]))
    assert apply(program.source, emission.edits).decode() == "G1 X1 Y0 Z0 F9\nX2 Y0.000\nG91 X1\nM2\n"
    assert emission.start[1].tolist() == [1.25, 0.5, 0.0]


@pytest.mark.parametrize(
    ("text", "lost"),
    [
        ("G2 X2 Y0 I1 J0 F9\nX4 I1 J0", {1}),
        ("G2 X2 Y0 I1 J0 F9\nG2 X4 I1 J0", set()),
        ("G2 X2 Y0 I1 J0 F9\nG4 P1\nX4 I1 J0", {1}),
        ("G2 X2 Y0 I1 J0 F9\nG1 X3\nX4", set()),
    ],
)
def test_a_motion_that_is_kept_must_not_rely_on_a_code_that_another_one_takes_away(text: str, lost: set[int]):
    """The first arc becomes lines; the block behind it is not written, and so cannot state its code."""
    program, moves = traced(f"G0 X0 Y0 Z0\n{text}\nM2\n")
    pieces = split(moves, 1, 0.5)
    pieces.unchanged[pieces.move > 1] = True
    emission = emit(program, moves, pieces, STEP)
    assert emission.conflicts == dict.fromkeys(lost, MODE_LOST)


def test_what_is_known_of_pieces():
    _, moves = traced("G1 X1 Y2 Z3 F9\nX2\nM2\n")
    pieces = whole(moves)
    assert pieces.known.tolist() == [True, True]
    pieces.end[1, 2] = np.nan
    assert pieces.known.tolist() == [True, False]
