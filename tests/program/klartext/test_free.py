"""Free contours (FK): what is worked out satisfies all that the program says; what is not certain is refused."""

from __future__ import annotations

import cmath
import math
import random

import numpy as np
import pytest

from conftest import some
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat
from ncfix.control.moves import MotionKind, Rule
from ncfix.text.reader import read
from ncfix_heidenhain.klartext.free import ContourElement, Element, solved
from program.klartext.tnc import KNOWN, THREE, fixed, follow, program

NEAR = 1e-3
THREE_CIRCLES = """
L X-30 Y+30 Z+0 R0 FMAX
APPR CT X+2 Y+30 CCA90 R+5 RL F250
FC DR- R18 CLSD+ CCX+20 CCY+30 F200
FLT
FCT DR- R15 CCX+50 CCY+75 M8
FLT
FCT DR- R15 CCX+75 CCY+20
FLT
FCT DR- R18 CLSD- CCX+20 CCY+30
DEP LT LEN20 F900
L X-30 Y+0 Z+0 R0 FMAX
"""


def line(**said: float) -> Element:
    return Element(arc=False, tangential=False, **said)  # type: ignore[arg-type]


def tangent(**said: float) -> Element:
    return Element(arc=False, tangential=True, **said)  # type: ignore[arg-type]


def arc(sense: int, radius: float, centre: complex, *, tangential: bool = True) -> Element:
    return Element(arc=True, tangential=tangential, sense=sense, radius=radius, centre=centre)


def check(elements: list[Element], start: complex, heading: complex | None, legs: list[ContourElement]) -> None:
    """Each leg does what its element says, and goes on in the direction of the one before where it has to."""
    at = start
    for element, leg in zip(elements, legs, strict=True):
        if leg.circle is None:
            begins = leg.heading
            assert leg.end - at == pytest.approx(abs(leg.end - at) * leg.heading)
        else:
            begins = leg.circle.heading(at)
            assert abs(at - leg.circle.centre) == pytest.approx(leg.circle.radius, abs=NEAR)
            assert abs(leg.end - leg.circle.centre) == pytest.approx(leg.circle.radius, abs=NEAR)
            assert leg.circle.sense == element.sense or element.sense == 0
            assert element.centre is None or leg.circle.centre == element.centre
            assert element.radius is None or leg.circle.radius == pytest.approx(element.radius, abs=NEAR)
        if element.tangential:
            assert heading is not None
            assert begins == pytest.approx(heading, abs=NEAR)
        assert element.x is None or leg.end.real == pytest.approx(element.x, abs=NEAR)
        assert element.y is None or leg.end.imag == pytest.approx(element.y, abs=NEAR)
        at, heading = leg.end, leg.heading


@pytest.mark.parametrize("seed", range(some(40)))
def test_lines_touch_the_circles_that_they_lead_between(seed: int) -> None:
    dice = random.Random(seed)
    first, second, third = (dice.choice([1, -1]) for _ in range(3))
    start = complex(dice.uniform(-9, 9), dice.uniform(-9, 9))
    middle, next_one = start + cmath.rect(5, dice.uniform(0, 6)), start + cmath.rect(60, dice.uniform(0, 6))
    end = next_one + cmath.rect(50, dice.uniform(0, 6))
    chain = [
        arc(first, 5.0, middle, tangential=False),
        tangent(),
        arc(second, dice.uniform(2, 20), next_one),
        tangent(x=end.real, y=end.imag),
        Element(arc=True, tangential=True, sense=third, radius=4.0, turn=1.5),
        tangent(length=3.0),
    ]
    legs = solved(chain, start, None, NEAR)
    assert legs is not None
    check(chain, start, None, legs)


def test_a_line_from_a_point_touches_a_circle_on_the_side_of_its_sense() -> None:
    for sense in (1, -1):
        chain = [line(), arc(sense, 3.0, 10 + 0j), tangent(angle=math.pi / 2 * sense, length=5.0)]
        legs = solved(chain, 0j, None, NEAR)
        assert legs is not None
        check(chain, 0j, None, legs)
        assert legs[0].end.imag * sense < 0


def test_circles_meet_where_they_touch() -> None:
    chain = [arc(1, 5.0, 5j, tangential=False), arc(-1, 3.0, 8 + 5j), tangent(angle=0.0, x=20.0)]
    legs = solved(chain, 0j, None, NEAR)
    assert legs is not None
    check(chain, 0j, None, legs)
    assert legs[0].end == pytest.approx(5 + 5j)


@pytest.mark.parametrize(
    "chain",
    [
        [line(x=5.0)],
        [line(length=5.0)],
        [line(angle=0.0, x=-5.0)],
        [line(angle=0.0, x=5.0, y=1.0)],
        [tangent(x=5.0, y=5.0)],
        [arc(1, 5.0, 5j, tangential=False)],
        [arc(1, 4.0, 5j, tangential=False), tangent(x=9.0, y=9.0)],
        [Element(arc=True, tangential=False, sense=1, radius=5.0, x=5.0, y=5.0)],
        [Element(arc=True, tangential=True, sense=-1, x=5.0, y=5.0)],
        [Element(arc=True, tangential=True, sense=1, radius=5.0, x=5.0)],
        [arc(1, 5.0, 5j, tangential=False), tangent(x=1.0, y=5.0)],
        [arc(1, 5.0, 5j, tangential=False), arc(-1, 3.0, 9 + 5j), tangent(angle=1.0, length=2.0)],
    ],
)
def test_what_is_not_certain_has_no_solution(chain: list[Element]) -> None:
    assert solved(chain, 0j, 1 + 0j, NEAR) is None


def test_a_contour_is_refused_as_it_stands_and_followed() -> None:
    moves = follow(THREE_CIRCLES).moves
    free = [row for row in range(len(moves)) if moves.rule[row] == Rule.REFUSE]
    assert len(free) == 7
    assert all("--flatten" in moves.reasons[int(moves.reason[row])] for row in free)
    assert moves.end[free[0], :2] == pytest.approx([5.6, 40.8])
    assert moves.end[free[-1], :2] == pytest.approx([2, 30])


def test_a_contour_is_written_out_flat_and_corrected() -> None:
    result = fix_flat(read(program(THREE_CIRCLES), "t.h", "heidenhain"), THREE, KNOWN, FixOptions(figures=False))
    assert result.report.refused == ()
    text = result.text.decode()
    assert "FLT" not in text
    assert "F200" in text
    assert "M8" in text
    again = follow("\n".join(text.splitlines()[1:-1])).moves
    meant = follow(THREE_CIRCLES).moves
    ends = {tuple(np.round(end[:2])) for end in meant.end if np.isfinite(end).all()}
    assert ends <= {tuple(np.round(end[:2])) for end in again.end}


def test_the_pole_is_put_back() -> None:
    body = "L X+0 Y+0 Z+0 FMAX\nCC X+1 Y+1\nL X+10 F100\nFCT DR+ R10 CCA90\nLP PR+30 PA+0\nL X+0 Y+0 Z+0"
    result = fix_flat(read(program(body), "t.h", "heidenhain"), THREE, KNOWN, FixOptions(figures=False))
    assert result.report.refused == ()
    assert follow(body).moves.end[3, :2] == pytest.approx([31, 1])


@pytest.mark.parametrize(
    "element",
    [
        "FL X+5",
        "FL PR+5 PA+3",
        "FC DR+ R5",
        "FLT X+Q9 Y+1",
        "FL X+5 Y+6 RX 3",
        "FL DR+",
        "FL X+5 Y+6 M30",
        "/FL X+5 Y+6",
    ],
)
def test_what_is_not_understood_ends_nobody_knows_where(element: str) -> None:
    moves = follow(f"L X+0 Y+0 Z+0 FMAX\n{element}\nL X+1 F100\nL X+2 Y+2 Z+0").moves
    assert "FK" in moves.reasons[int(moves.reason[1])]
    assert np.isnan(moves.end[1, :2]).all()


def test_a_frame_turns_a_contour() -> None:
    turned = "CYCL DEF 10.1 ROT+90\nCYCL DEF 8.1 X\nCYCL DEF 8.1\n"
    moves = follow(f"{turned}L X+0 Y+0 Z+0 FMAX\nL X+10 F100\nFCT DR+ R10 CCA90\nFLT LEN5").moves
    assert moves.end[-1, :2] == pytest.approx([-15, 20])
    assert moves.kind[-1] == MotionKind.ARC


def test_a_pole_may_stand_beside_a_corner() -> None:
    body = "L X+0 Y+0 Z+0 FMAX\nL X+60 F100\nRND R2\nCC X+60 Y+20\nC X+80 Y+20 DR+\nL Y+60"
    text = fixed(body).text.decode().split("RND R2")[1]
    assert "Z" not in text.split("\nL")[0]
