"""Arcs: centre, sweep, planes, helices, turns, closure, against geometry worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ncfix.control.arcs import centre_from_radius, check_closure, sweep_angle
from ncfix.control.expressions import Fault
from ncfix.control.moves import Moves
from ncfix.diagnostics import SourceError
from program.tracing import follow


def arc(text: str, before: str = "G0 X0 Y0 Z0") -> Moves:
    """The trace of one arc."""
    moves = follow(f"F100\n{before}\n{text}").moves
    keep = slice(len(moves) - 1, len(moves))
    assert not np.isnan(moves.centre[keep]).any()
    return moves


def end_of_sweep(moves: Moves) -> np.ndarray:
    """Where the arc's start comes when it is turned by the sweep about the normal; without the helix."""
    start, centre, normal, angle = moves.start[-1, :3], moves.centre[-1], moves.normal[-1], moves.sweep[-1]
    arm = start - centre
    turned = arm * math.cos(angle) + np.cross(normal, arm) * math.sin(angle)
    turned += normal * np.dot(normal, arm) * (1 - math.cos(angle))
    return np.asarray(centre + turned)


def test_a_quarter_each_way() -> None:
    left, right = arc("G3 X-1 Y1 I-1 J0"), arc("G2 X1 Y1 I1 J0")
    assert left.centre[-1].tolist() == [-1, 0, 0]
    assert left.sweep[-1] == pytest.approx(math.pi / 2)
    assert right.centre[-1].tolist() == [1, 0, 0]
    assert right.sweep[-1] == pytest.approx(-math.pi / 2)


@pytest.mark.parametrize(
    ("plane", "words", "normal"),
    [
        ("G17", "X1 Y1 I1 J0", [0, 0, 1]),
        ("G18", "Z1 X1 K1 I0", [0, 1, 0]),
        ("G19", "Y1 Z1 J1 K0", [1, 0, 0]),
    ],
)
@pytest.mark.parametrize("code", ["G2", "G3"])
def test_each_plane_is_right_handed_about_its_normal(plane: str, words: str, normal: list[float], code: str) -> None:
    """G2 from the first axis' direction to the second is a quarter, G3 the other three quarters."""
    moves = arc(f"{plane} {code} {words}")
    assert moves.normal[-1].tolist() == normal
    assert moves.sweep[-1] == pytest.approx(-math.pi / 2 if code == "G2" else 1.5 * math.pi)
    assert np.allclose(end_of_sweep(moves), moves.end[-1])


def test_full_circles_and_turns() -> None:
    assert arc("G2 I5").sweep[-1] == pytest.approx(-2 * math.pi)
    assert arc("G3 I5 P3").sweep[-1] == pytest.approx(6 * math.pi)
    assert arc("G3 X1 Y1 I0 J1 P2").sweep[-1] == pytest.approx(2.5 * math.pi)


def test_a_helix_ends_at_its_height() -> None:
    moves = arc("G3 X0 Y2 Z-4 I0 J1")
    assert moves.end[-1].tolist() == [0, 2, -4]
    assert moves.sweep[-1] == pytest.approx(math.pi)
    assert np.allclose(end_of_sweep(moves)[:2], [0, 2])


@pytest.mark.parametrize(("code", "side"), [("G2", -1), ("G3", 1)])
def test_r_takes_the_short_way_and_minus_r_the_long_way(code: str, side: int) -> None:
    short, long = arc(f"{code} X1 Y1 R1"), arc(f"{code} X1 Y1 R-1")
    assert abs(short.sweep[-1]) == pytest.approx(math.pi / 2)
    assert abs(long.sweep[-1]) == pytest.approx(1.5 * math.pi)
    assert short.sweep[-1] * side > 0
    assert np.allclose(end_of_sweep(short), [1, 1, 0])
    assert np.allclose(end_of_sweep(long), [1, 1, 0])


def test_absolute_centres() -> None:
    moves = arc("G90.1 G3 X10 Y12 I10 J11", before="G10 L2 P1 X100\nG0 X10 Y10")
    assert moves.centre[-1].tolist() == [110, 11, 0]
    assert moves.arc_absolute[-1]


def test_centres_in_inches_and_with_diameters() -> None:
    assert arc("G20 G3 I1").centre[-1, 0] == 25.4
    assert arc("G7 G3 X8 Y0 I2", before="G0 X0").end[-1, 0] == 4.0


def test_rotated_frames_turn_arcs() -> None:
    moves = arc("G3 X-1 Y1 I-1 J0", before="G10 L2 P1 R90\nG0 X0 Y0")
    assert np.allclose(moves.centre[-1], [0, -1, 0])
    assert np.allclose(moves.end[-1], [-1, -1, 0])
    assert np.allclose(end_of_sweep(moves), moves.end[-1])
    turned = arc("G18 G3 X-1 Z1 I-1 K0", before="G10 L2 P1 R90\nG0 X0 Y0")
    assert np.allclose(turned.normal[-1], [-1, 0, 0])
    assert np.allclose(end_of_sweep(turned), turned.end[-1])


# -- closure: LinuxCNC's rule and its borders -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "accepted"),
    [
        ("G2 X20.028 Y0 I10 J0", True),
        ("G2 X20.029 Y0 I10 J0", False),
        ("G2 X200.1 Y0 I100 J0", True),
        ("G2 X200.11 Y0 I100 J0", False),
        ("G2 X20000.5 Y0 I10000 J0", True),
        ("G2 X20002.82 Y0 I10000 J0", True),
        ("G2 X20002.84 Y0 I10000 J0", False),
        ("G20 G2 X2.0028 Y0 I1 J0", True),
        ("G20 G2 X2.0029 Y0 I1 J0", False),
        ("G2 I0.0013", True),
        ("G2 I0.0012", False),
        ("G2 X2 R0.9988", True),
        ("G2 X2 R0.9987", False),
        ("G2 X2 R0", False),
    ],
)
def test_arcs_close_or_not_as_for_linuxcnc(text: str, accepted: bool) -> None:
    """Either side of every border, as `rs274` decided."""
    if accepted:
        assert len(arc(text).sweep)
        return
    with pytest.raises(SourceError) as caught:
        arc(text)
    assert caught.value.code == "NCF220"


@given(st.floats(0.01, 1e3), st.floats(0.0, 2 * math.pi), st.floats(0.001, 2 * math.pi - 0.001), st.booleans())
def test_r_and_centre_describe_the_same_arc(radius: float, angle: float, turn: float, clockwise: bool) -> None:
    centre = (radius * math.cos(angle), radius * math.sin(angle))
    signed = -turn if clockwise else turn
    back = angle + math.pi + signed
    end = (centre[0] + radius * math.cos(back), centre[1] + radius * math.sin(back))
    found = centre_from_radius(end, radius if turn <= math.pi else -radius, clockwise=clockwise)
    chord = math.hypot(*end)
    blur = 1e-6 + 1e-7 * radius**2 / max(chord, 1e-3) + (1e-4 * radius if abs(turn - math.pi) < 1e-3 else 0.0)
    assert found == pytest.approx(centre, abs=blur)
    assert sweep_angle(centre, end, 1, clockwise=clockwise) == pytest.approx(signed, abs=1e-6)


@given(st.floats(0.01, 1e4), st.floats(0.01, 1e4))
def test_closure_does_not_depend_on_the_direction(start: float, end: float) -> None:
    def refused(first: float, second: float) -> bool:
        try:
            check_closure((first, 0.0), (first + second, 0.0), 0.0283, 0.001)
        except Fault:
            return True
        return False

    assert refused(start, end) == refused(end, start)


@pytest.mark.parametrize(
    "text",
    [
        "G2 X1 Y1",
        "G2 X1 R1 I1",
        "G2 R5",
        "G18 G2 X1 Z1 J1",
        "G90.1 G2 X2 I1",
        "G2 X2 I1 P0",
        "G2 X2 I1 P1.5",
        "G17.1 G2 X2 I1",
        "G2 X0 Y0 R5",
    ],
)
def test_impossible_words(text: str) -> None:
    with pytest.raises(SourceError) as caught:
        arc(text)
    assert caught.value.code in ("NCF220", "NCF210")


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        (
            "G18 G0 X14 Z100\nG3 X28 Z93 I0 K-7",
            "the arc would close if X were a diameter: check whether the program is for a lathe",
        ),
        (
            "G18 G0 X14 Z100\nG3 X28 Z93 R5.1",
            "the arc would close if X were a diameter: check whether the program is for a lathe",
        ),
        ("G18 G0 X14 Z100\nG3 X29 Z93 I0 K-7", "check the centre words"),
        ("G17 G0 X14 Z100\nG3 X28 Z93 I0 K-7", "K is a centre word of another plane than G17"),
        ("G17 G0 X14 Y100\nG3 X28 Y93 I0 J-7", "check the centre words"),
    ],
)
def test_an_arc_that_is_none_says_what_may_be_meant(text: str, hint: str) -> None:
    """Diameters of 14 and 28 are 7 apart, as are the ends along Z: a quarter of radius 7, or a chord of 9.9."""
    with pytest.raises(SourceError) as caught:
        follow(f"G21 F100 G0 Y0\n{text}", dialect="iso")
    assert hint in caught.value.messages[0].hint
