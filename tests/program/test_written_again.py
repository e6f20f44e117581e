"""What is written is what the control will understand: corrected programs, read and followed again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
import pytest

from conftest import some
from ncfix.compensate.following import kinematics_of, rotary_names
from ncfix.control.moves import FeedMode, MotionKind, Moves, Rule
from ncfix.control.setup import Setup, Tool
from ncfix.control.trace import trace
from ncfix.machine import load
from ncfix.text.language import language_of
from ncfix.text.reader import read
from ncfix.text.tree import Program
from ncfix.text.writer import apply
from ncfix.writer.emit import Emission, emit
from ncfix.writer.language import WrittenLanguage
from ncfix.writer.pieces import Pieces, SecondReading
from program.arcs import full_of_arcs

AXES, ROTARY = ("X", "Y", "Z", "B", "C"), frozenset("BC")
STEP = np.array([1e-3, 1e-3, 1e-3, np.radians(1e-3), np.radians(1e-3)])
XYZ = slice(0, 3)
SAME, ROUND = 1e-9, 1e-4
"""mm and rad: rounding of the arithmetic; and how much of it an R near half the chord makes."""
HALF = 0.51 * np.sqrt(3) * STEP
"""Half an output step of each axis, or of three where a frame is turned."""
PROGRAMS = some(10)
HEAD = ["G90 G94 F1000.", "G0 X0. Y0. Z0. B0. C0."]
COMMON = {
    "inch": (["G20 F40."], ["G21 F1000."]),
    "increments": (["G91"], ["G90"]),
    "inverse time": (["G93"], ["G94 F900."]),
}
FRAMES = {
    "linuxcnc": COMMON
    | {
        "turned": (["G10 L2 P1 R30."], ["G10 L2 P1 R0"]),
        "diameters": (["G7"], ["G8"]),
        "shifted": (["G92 X1. Y-2.5"], ["G92.1"]),
        "centres from the origin": (["G90.1"], ["G91.1"]),
    },
    "fanuc": COMMON | {"turned": (["G68 X1. Y2. R30."], ["G69"]), "shifted": (["G52 X1. Y-2.5"], ["G52 X0. Y0."])},
    "siemens": {
        "inch": (["G700 F40."], ["G710 F1000."]),
        "increments": (["G91"], ["G90"]),
        "turned": (["ROT RPL=30"], ["ROT"]),
        "shifted": (["TRANS X1 Z-2.5"], ["TRANS"]),
        "other plane": (["G18"], ["G17"]),
    },
}
COUNTED = "fanuc, counting increments"
FRAMES[COUNTED] = {name: FRAMES["fanuc"][name] for name in ("increments", "inverse time", "turned", "inch")}
"""What is in force for a part of a program: the blocks before it and behind it."""


def followed(source: bytes, control: str) -> tuple[Program, Moves]:
    program = read(source, "part.nc", control.split(",")[0])
    no_point = "IS-B" if control == COUNTED else "calculator"
    setup = Setup(assume_zero=True, initial=dict.fromkeys(AXES, 0.0), no_point=no_point)
    return program, trace(program, setup, AXES, ROTARY).moves


def written_as(control: str, value: float, digits: int) -> str:
    """A number; one without a point counts thousandths where the control does so."""
    return f"{round(value * 1000)}" if control == COUNTED and digits == 3 else f"{value:.{digits}f}"


def text_of(rng: np.random.Generator, dialect: str) -> str:
    """Parts of lines, arcs and holes in frames of all kinds; each begins at a place of its own."""
    lines = list(HEAD)
    for _ in range(4):
        before, behind = FRAMES[dialect][str(rng.choice(list(FRAMES[dialect])))]
        modal = before[0] in ("G91", "G93", "G90.1")
        start = ["G1 X0.5 Y0.25 Z1. B5. C-10."]
        kind = rng.choice(["lines", "arcs", "expressions", "lines" if before[0] == "G91" else "holes"])
        body = {
            "lines": _lines(rng, dialect, "G93" in before, 8),
            "arcs": _arcs(rng, before[0], dialect),
            "holes": _holes(rng, dialect),
            "expressions": ["#1=3.", "G1 X[#1+2.] Y#1", "Z[-#1] X1."]
            if dialect != "siemens"
            else ["R1=3", "G1 X=R1+2 Y=R1"],
        }["lines" if before[0] == "G93" else str(kind)]
        lines += [*start, *before, *body, *behind] if modal else [*before, *start, *body, *behind]
    return "\n".join([*lines, "M30\n"])


def _lines(rng: np.random.Generator, dialect: str, timed: bool, count: int) -> list[str]:
    lines = []
    for k in range(count):
        named = [letter for letter in "XYZBC" if rng.random() < 0.4]
        named = named if {*named} & {*"XYZ"} else ["X", *named]
        code = str(rng.choice(["", "G1", "G0", "G01"])) if k and not timed else "G1"
        words = [letter + written_as(dialect, rng.uniform(-9, 9), int(rng.integers(1, 5))) for letter in named]
        feed = [f"F{rng.uniform(1, 9):.2f}"] if timed else [str(rng.choice(["", "", "F500.", "M8", "S1000"]))]
        text = str(rng.choice(["", " ", " "])).join(filter(None, [str(rng.choice(["", "N10 "])), code, *words, *feed]))
        lines.append(text.lower() if rng.random() < 0.2 else text)
    return lines


def _arcs(rng: np.random.Generator, before: str, dialect: str) -> list[str]:
    if before == "G91" and dialect == COUNTED:
        return ["G2 X2000 Y0 I1000 J0", "X1000 Y1000 R1000", "G3 X-1000 Y-1000 I-1000", "G1 X1."]
    if before in ("G91", "G90.1", "G7"):
        half = "G2 X2. Y0. I1. J0." if before != "G90.1" else "G2 X2.5 Y.25 I1.5 J.25"
        return ["G17", half, "G1 X1. Y1."] if before != "G7" else ["G18", "G2 X.5 Z5. I0 K2.", "G17", "G1 X1. Y1."]
    place = ["G17", "G0 X0. Y0. Z0."]
    return [*place, *full_of_arcs(int(rng.integers(10_000)), 8, sinumerik=dialect == "siemens"), "G17"]


def _holes(rng: np.random.Generator, dialect: str) -> list[str]:
    if dialect == "siemens":
        return ["G1 X1 F100", "X2 Y1"]
    code, level = rng.choice(["G98", "G99"]), rng.uniform(0.5, 2)
    first = f"{code} G81 X1. Y2. Z-3. R{level:.2f} F100."
    return ["G17 G0 Z3.", first, "X4.", "G98 X3.", "Y1. R1.5", "G99 X2. Z-4.", "G98 X3.", "G80", "G1 Z5."]


def corrected(rng: np.random.Generator, moves: Moves, size: float, *, arc_pieces: bool) -> Pieces:
    """Corrections that wander along the path, some motions in two pieces, arcs where they may be; arcs still close."""
    n = len(moves)
    shift = size * np.cumsum(rng.normal(size=moves.end.shape), axis=0) / 10 * np.where(moves.rotary, 0.01, 1.0)
    shift[:, moves.rotary] *= rng.integers(0, 2)
    is_arc, unchanged = moves.kind == MotionKind.ARC, (moves.rule != Rule.CORRECT) | (moves.kind == MotionKind.DWELL)
    way = (moves.end - moves.start)[:, XYZ]
    way = way - moves.normal * np.sum(way * moves.normal, axis=1)[:, None]
    round_ = is_arc & (np.abs(np.nan_to_num(way)).max(axis=1) < 0.05)
    is_arc &= ~round_ | (np.abs(way).max(axis=1) < 1e-6) | (size == 0)  # a micrometre of an arc becomes a line
    for row in np.flatnonzero(round_ | unchanged).tolist():
        shift[row] = shift[row - 1]
    straight = np.isin(moves.kind, (MotionKind.RAPID, MotionKind.FEED)) | (is_arc & ~round_ & arc_pieces)
    straight &= np.abs(moves.end - moves.start)[:, XYZ].max(axis=1) > 0.1
    counts = np.where((rng.random(n) < 0.2) & straight & ~unchanged & (size > 0), 2, 1)
    move = np.repeat(np.arange(n), counts)
    last = np.append(np.diff(move) != 0, True)
    end = (moves.end + shift)[move]
    middle = (moves.start + moves.end) / 2
    for row in np.flatnonzero(is_arc).tolist():
        across, half = moves.normal[row], moves.sweep[row] / 2
        spoke = moves.start[row, XYZ] - moves.centre[row]
        along = across * (spoke @ across)
        turned = np.cos(half) * (spoke - along) + np.sin(half) * np.cross(across, spoke)
        rise = across * ((middle - moves.start)[row, XYZ] @ across)
        middle[row, XYZ] = moves.centre[row] + along + rise + turned
    end[~last] = (middle + shift)[move[~last]]
    centre = moves.centre[move].copy()
    for piece in np.flatnonzero(is_arc[move]).tolist():
        row = move[piece]
        start, way = end[piece - 1, XYZ], end[piece, XYZ] - end[piece - 1, XYZ]
        way = way - moves.normal[row] * (way @ moves.normal[row])
        centre[piece] += shift[row, XYZ]
        if size and not round_[row]:
            off = (centre[piece] - start - way / 2) @ way
            centre[piece] -= way * off / (way @ way)
    approach = moves.approach[move] + shift[move]
    fraction = np.where(last, 1.0, 0.5)
    return Pieces(move, fraction, end, is_arc[move], centre, unchanged[move], approach=approach)


@pytest.mark.parametrize("control", list(FRAMES))
@pytest.mark.parametrize("size", [0.0, 0.02])
def test_what_is_written_is_what_is_read_again(control: str, size: float) -> None:
    """Each piece is a motion that ends, and turns about, where it is said to, within an output step of the plan."""
    rng, understood = np.random.default_rng(7), 0
    for number in range(PROGRAMS):
        program, moves = followed(text_of(rng, control).encode(), control)
        language = language_of(program.dialect, WrittenLanguage)
        pieces = corrected(rng, moves, size, arc_pieces=language.arc_pieces)
        way = (language, replace(language, bulk=None))[number % 2]  # many at a time, and one by one
        reading: SecondReading | None = None
        for attempt in range(8):  # G92 counts from where the axes stand: from where they were led
            with mock.patch("ncfix.writer.emit.language_of", return_value=way):
                emission = emit(program, moves, pieces, STEP, reading)
            if emission.conflicts:
                break
            written = apply(program.source, emission.edits)
            _, again = followed(written, control)
            if np.abs(again.end - emission.end).max() < SAME:
                assert_understood(moves, pieces, emission, again, 2.54 if control == COUNTED else 1.0)
                assert attempt == 0 or b"G92" in program.source
                understood += 1
                break
            reading = SecondReading.of(again, pieces)
        halves = set(program.lines(moves.block[np.abs(np.abs(moves.sweep) - np.pi) < 0.01]).tolist())
        lines = zip(program.source.splitlines(), written.splitlines(), strict=not size)
        assert size or all(was == now or k in halves for k, (was, now) in enumerate(lines, 1))  # R may be a hair short
    assert understood >= PROGRAMS - 2


def assert_understood(moves: Moves, pieces: Pieces, emission: Emission, again: Moves, coarser: float) -> None:
    """What the control makes of it is what was meant; times of blocks in inverse time are kept.

    coarser  so much larger is what a number without a point counts, 1e-4 inch, than the least increment
    """
    row, arc = pieces.move, pieces.arc
    assert np.abs(again.end - emission.end).max() < SAME
    assert ((again.kind == MotionKind.ARC) == arc).all()
    off = again.centre[arc] - emission.centre[arc]
    off -= again.normal[arc] * np.sum(off * again.normal[arc], axis=1)[:, None]
    assert np.abs(off).max(initial=0.0) < ROUND
    swept = moves.sweep[row] / np.bincount(row)[row]
    assert np.abs(again.sweep - swept)[arc].max(initial=0.0) < 0.5
    free = ~(pieces.unchanged | arc)[:, None] & ~moves.wordless[row]
    assert (np.abs(emission.end - pieces.end) < coarser * HALF)[free].all()
    assert np.abs(emission.centre - pieces.centre)[arc].max(initial=0.0) < 2.1 * coarser * STEP[0]
    if pieces.approach is not None:
        holes = np.flatnonzero(moves.kind[row] == MotionKind.CYCLE)
        level, wanted, begun = again.approach[holes, 2], pieces.approach[holes, 2], emission.start[row[holes], 2]
        assert (level > wanted - coarser * HALF[2]).all()
        assert (level < np.maximum(wanted + coarser * HALF[2], begun + SAME)).all()
    timed = moves.feed_mode[row] == FeedMode.INVERSE_TIME
    assert np.allclose(again.feed[~timed], moves.feed[row][~timed], equal_nan=True)
    minutes = np.bincount(row[timed], 1 / again.feed[timed], len(moves))
    whole = moves.feed_mode == FeedMode.INVERSE_TIME
    assert np.allclose(minutes[whole], 1 / moves.feed[whole], rtol=1e-3)


TILTED = {
    "siemens": ("T1 D1 M6\nG54\nTRAORI\nG0 X0 Y0 Z40 B5 C5\nROT RPL=30\nG1 F900", "G1 ", "A3={} B3={} C3={}", 25.0),
    "fanuc": ("T1 M6\nG54 G90 G94 F900.\nG0 X0. Y0. Z40. B5. C5.\nG43.5 H1", "G1 ", "I{} J{} K{}", 25.0),
    "heidenhain": (
        *("BEGIN PGM P MM\nTOOL CALL 1 Z S1000\nL X+0 Y+0 Z+40 B+5 C+5 R0 F900\nM128", "LN "),
        *("TX{} TY{} TZ{}", 1.0),
    ),
}
"""The first blocks, how a straight line begins, the words of a direction, and how long a vector it may be."""


@pytest.mark.parametrize("dialect", list(TILTED))
def test_directions_of_the_tool_are_read_again(dialect: str, root: Path) -> None:
    """Vectors, and rotary axes between them, lead where they are said to lead: to some 1e-6 rad where they should."""
    head, begin, words, longest = TILTED[dialect]
    rng, lines = np.random.default_rng(5), head.split("\n")
    form = "{:+.3f}" if dialect == "heidenhain" else "{:.3f}"
    for _ in range(40):
        tilt, turn, length = rng.uniform(0.05, 0.6), rng.uniform(-1, 1), rng.choice([1.0, longest])
        vector = length * np.array([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)])
        numbers = [form.format(number) for number in rng.uniform(-20, 20, 5)]
        place = "X{} Y{} Z{}".format(*numbers)
        if dialect != "fanuc" and rng.random() < 0.2:
            lines.append(f"{begin.replace('N', '')}{place} B{numbers[3]} C{numbers[4]}")
        elif rng.random() < 0.2:
            lines.append(f"{begin.replace('N', '')}{place}")  # the tool points as before
        else:
            lines.append(f"{begin}{place} " + words.format(*map(form.replace("3", "6").format, vector)))
    machine = load(root / "examples/machines/wCBXFZYSt.toml")

    def follow(source: bytes) -> tuple[Program, Moves]:
        program = read(source, "part.nc", dialect)
        setup = Setup(tools={1: Tool(80.0)}, assume_zero=True, no_point="calculator")
        kinematics = kinematics_of(machine)
        return program, trace(program, setup, machine.axis_names, rotary_names(machine), None, kinematics).moves

    program, moves = follow("\n".join([*lines, ""]).encode())
    count = np.where(rng.random(len(moves)) < 0.3, 2, 1)
    count[0] = 1
    row = np.repeat(np.arange(len(moves)), count)
    last = np.append(np.diff(row) != 0, True)
    end = np.where(last[:, None], moves.end[row], (moves.start + moves.end)[row] / 2)
    end += rng.normal(size=end.shape) * np.where(machine.rotary, 1e-4, 0.02)
    for piece in np.flatnonzero(~moves.moved[row][:, moves.rotary].any(axis=1)).tolist():
        end[piece, moves.rotary] = end[piece - 1, moves.rotary]
    fraction, none = np.where(last, 1.0, 0.5), np.zeros(len(row), dtype=bool)
    step = np.where(machine.rotary, np.radians(1e-3), 1e-3)
    emission = emit(program, moves, Pieces(row, fraction, end, none, moves.centre[row], none), step)
    assert not emission.conflicts
    _, again = follow(apply(program.source, emission.edits))
    assert len(again) == len(row)
    assert np.abs(again.end - emission.end).max() < SAME
    assert (np.abs(emission.end - end) < 0.51 * np.sqrt(3) * step).all()
