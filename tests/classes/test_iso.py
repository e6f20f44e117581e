"""The classes of blocks in LinuxCNC, plain ISO code and Fanuc: right, passed or refused; never silently wrong."""

from __future__ import annotations

import pytest

from classes.judging import Case, followed, judged
from ncfix.testing.judging import shifted_machine

HEAD = "G21 G90 G94 G17 G40 G54\nG0 X1. Y2. Z50.\n"
"""Two lines; the second is the motion to the start."""


def case(name: str, body: str, flat: bool = False, **lines: str) -> Case:
    """A case after the head; lines of the body are counted from 3, as `L3`."""
    return Case(name, HEAD + body + "\nM2\n", {2: "right"} | {int(k[1:]): v for k, v in lines.items()}, flat)


R, P, N = "right", "passed", "refused"
COMMON = [
    case("G0 and G1 with all words", "G1 X5. Y6. Z7. F100.", L3=R),
    case("omitted words", "G1 X5. F100.\nZ3.\nG0 Y9.", L3=R, L4=R, L5=R),
    case("G91", "G91\nG1 X5. F100.\nX5. Y1.\nG90 X0.", L4=R, L5=R, L6=R),
    case("inches", "G20\nG1 X1. Y.5 F10.\nG91 X.25", L4=R, L5=R),
    case("arc with a centre", "G2 X11. Y12. I10. J0 F100.", L3=R),
    case("arc with a radius", "G2 X11. Y12. R10. F100.", L3=R),
    case("full circle", "G3 I10. J0 F100.", L3=R),
    case("arc in the plane G18", "G18\nG2 X11. Z60. I0 K10. F100.", L4=R),
    case("helix", "G2 X11. Y12. Z40. I10. J0 F100.", L3=R),
    case("canned cycle", "G98 G81 X5. Y5. Z-3. R2. F100.\nX9.\nG80\nG0 X1.", L3=R, L4=R, L6=R),
    case("canned cycle with G91", "G91 G81 X5. Z-3. R-45. F100.\nG80\nG90 G0 X1. Y1. Z50.", L3=N, L5=R),
    case("cutter compensation", "G41 D1 G1 X5. F100.\nX20.\nY20.\nG40 X30.", L3=R, L4=R, L5=R, L6=R),
    case("G53", "G53 G0 Z0.\nG0 X5. Y5. Z20.", L3=P, L4=R),
    case("G28", "G28 Z100.\nG0 X5. Y5. Z20.", L3=P, L4=R),
    case("G92", "G92 X0.\nG1 X5. F100.", L4=R),
    case("G52", "G52 X3.\nG1 X5. F100.", L4=R),
    case("G10 L2", "G10 L2 P1 X7.\nG1 X5. F100.", L4=R),
    case("another work offset", "G55\nG1 X5. F100.", L4=R),
    case("tool length", "T3 M6\nG43 H3\nG1 Z5. F100.\nG49\nG1 Z80.", L5=R, L7=R),
    case("block skip", "/G0 X5.\nG0 Y5.", L3=R, L4=R),
    case("expression", "#1=5\nG1 X[#1] F100.", L4=R),
    case("dwell", "G4 P1.\nG1 X5. F100.", L4=R),
    case("no change of the feed word", "G1 X5. F123.\nM8\nY7. M9", L3=R, L5=R),
]
LINUXCNC = [
    case("polar", "G0 @10. ^90.\nG0 X5. Y5.", L3=N, L4=R),
    case("polar, flat", "G0 @10. ^90.\n@5.\nG91 @1. ^10.\nX5.", flat=True, L0=R),
    case("spline", "G5.1 X5. Y6. I2. J3. F100.", L3=N),
    case("probing", "G38.2 Z0. F100.\nG0 X5. Y5. Z20.", L3=P, L4=R),
    case("rotated frame", "G10 L2 P1 R30.\nG1 X5. Y6. Z7. F100.", L4=R),
    case("loop", "o1 repeat [2]\nG91 G1 X5. F100.\no1 endrepeat", L4=R),
    case("loop, flat", "o1 repeat [2]\nG91 G1 X5. F100.\no1 endrepeat", flat=True, L0=R),
    case("subprogram from two places", "o1 sub\nG0 Z5.\no1 endsub\nG0 X5.\no1 call\nG0 X9.\no1 call", L4=R, L6=R, L8=R),
    case("subprogram, flat", "o1 sub\nG91 G0 Z5.\nG90\no1 endsub\no1 call\nG0 X9.\no1 call", flat=True, L0=R),
]
FANUC = [
    case("a dwell by X", "G4 X1.\nG1 X5. F100.", L4=R),
    case("a dwell beside an axis", "G4 P1. X5.\nG1 X6. Y6. Z6. F100.", L3=N, L4=N),
    case("number without a point", "G1 X5 Y6 F100", L3=R),
    case("canned cycle with repeats", "G91 G81 X5. Z-3. R-45. K3 F100.\nG80\nG90 G0 X1. Y1. Z50.", L3=N, L5=R),
    case(
        "canned cycle with repeats, flat", "G91 G81 X5. Z-3. R-45. K3 F100.\nG80\nG90 G0 X1. Y1. Z50.", flat=True, L0=R
    ),
    case("an increment from nobody knows where", "G31 X9. F10.\nG91 G0 X5.\nG90 X7.", L3=P, L4=N, L5=R),
    case("an arc of the tip", "G43.4 H1\nG2 X11. Y12. I10. J0 F100.\nG49\nG0 X1. Y1. Z50.", L4=R, L6=R),
    case("a shift that only the control knows", "G52 X#500\nG1 X5. F100.\nG52 X0\nG0 X1.", L4=N, L6=R),
    case("an offset that only the control knows", "G10 L2 P1 X#500\nG1 X5. F100.\nG55 G0 X1. Y1. Z1.", L4=N, L5=R),
    case(
        "subprogram from two places",
        "M98 P100\nG0 X9.\nM98 P100\nM2\nO0100\nG0 X5. Z5.\nM99",
        L4=R,
        L8=R,
    ),
    case("subprogram in steps, flat", "M98 P20100\nG0 X9.\nM2\nO0100\nG91 G0 X5.\nG90\nM99", flat=True, L0=R),
    case("a variable that its block sets", "#1=5\n#1=7 G0 X#1\nX9. Y9. Z9.", L4=N, L5=R),
    case("threading", "G33 Z40. F1.5\nG0 X5. Y5. Z20.", L3=N, L4=R),
    case("return from the reference point", "G28 Z100.\nG29 X5. Y5. Z20.\nG0 X1. Y1. Z20.", L3=P, L4=N, L5=R),
    case("polar", "G16\nG0 X10. Y90.\nG15\nG0 X5. Y5.", L2=R, L4=N, L6=R),
    case("polar, flat", "G16\nG0 X10. Y90.\nG15\nG0 X5. Y5.", flat=True, L0=R),
    case("G54.1", "G54.1 P2\nG1 X5. F100.", L4=R),
    case("rotated frame", "G68 X1. Y1. R30.\nG1 X5. Y6. Z7. F100.\nG69\nG0 X1. Y1.", L4=R, L6=R),
    case("one axis after a rotation", "G68 X1. Y1. R30.\nG1 X5. F100.\nG0 X5. Y6.\nG69\nX1.", L2=R, L4=N, L5=R, L7=N),
    case("tilted plane", "G68.2 X1. Y1. Z0. I0. J30. K0.\nG1 X5. Y6. Z47. F100.\nG69\nG0 X1. Y1. Z50.", L4=R, L6=R),
    case("tool tip control", "G43.4 H1\nG1 X5. Y6. Z47. F100.\nG49\nG0 X1. Y1. Z50.", L4=R, L6=R),
    case("scaling", "G51 X0 Y0 Z0 P2.\nG1 X5. F100.\nG50\nG0 X5. Y5. Z20.", L2=R, L4=N, L6=R),
    case("mirror", "G51.1 X3.\nG1 X5. Y2. F100.\nG2 X15. Y12. I10. J0\nG50.1 X0\nG0 X5.", L2=R, L4=R, L5=R, L7=R),
    case("turned mirror", "G51.1 X3.\nG68 X0 Y0 R9.\nG1 X5. F100.\nG69\nG50.1 X0\nG0 X5. Y5. Z20.", L2=R, L5=N, L8=R),
    case("probing", "G31 Z0. F100.\nG0 X5. Y5. Z20.", L3=P, L4=R),
    case("corner rounding", "G1 X5. F100. ,R2.\nY20.", L3=R, L4=R),
    case("corner of an arc", "G1 X5. F100. ,C2.\nG2 X15. Y12. I10. J0 ,R1.\nG1 Y0", L3=R, L4=R, L5=R),
    case("line by its angle", "G1 X5. ,A45. F100.\nG0 X5. Y5.", L3=N, L4=R),
    case("polar interpolation", "G12.1\nG1 X5. F100.\nG13.1\nG0 X5. Y5. Z20.", L4=N, L6=R),
    case("loop", "#1=0\nWHILE[#1LT2]DO1\nG1 X[5.*#1] F100.\n#1=#1+1\nEND1", L2=R, L5=N),
    case("loop, flat", "#1=0\nWHILE[#1LT2]DO1\nG1 X[5.*#1] F100.\n#1=#1+1\nEND1", flat=True, L0=R),
    case("macro with arguments", "G65 P1 A5. B6.\nM2\nO1\nG1 X#1 Y#2 F100.\nM99", L6=R),
    case("a variable nobody has set", "G1 X#500 F100.\nG0 X5. Y5. Z20.", L3=N, L4=R),
    case("a tool length in steps", "G91 G43 H3 Z-10.\nX5.\nG90 G0 Z80.", L3=N, L4=P, L5=R),
    case("position in a variable", "#1=#5041\nG1 X[#1+1.] F100.\nG0 X5. Y5. Z20.", L2=R, L4=N, L5=R),
    case("unknown code", "G107.1\nG1 X5. F100.", L2=R, L4=N),
]


BESIDE = {
    name: Case(name, f"O12 G21 G91 G54\n{body}\nM30\n", found)
    for name, body, found in (
        ("modes beside the number of a program", "G0 X1. Y2. Z50.\nX1.", {2: R, 3: R}),
        ("a motion behind them", "G90 G0 X1. Y2. Z50.\nG91 X1.", {2: R, 3: R}),
    )
}


@pytest.mark.parametrize("dialect", ["iso", "fanuc"])
@pytest.mark.parametrize("name", BESIDE)
def test_words_beside_the_number_of_a_program(name: str, dialect: str) -> None:
    assert followed(BESIDE[name].text.encode(), shifted_machine(), dialect).end[-1, 0] == 2.0
    assert judged(BESIDE[name], dialect) == BESIDE[name].expected


def check(each: Case, dialect: str) -> None:
    assert judged(each, dialect) == ({0: R} if each.flat else each.expected)


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso", "fanuc"])
@pytest.mark.parametrize("each", COMMON, ids=lambda each: each.name)
def test_common_classes(each: Case, dialect: str) -> None:
    check(each, dialect)


@pytest.mark.parametrize("each", LINUXCNC, ids=lambda each: each.name)
def test_classes_of_linuxcnc(each: Case) -> None:
    check(each, "linuxcnc")


@pytest.mark.parametrize("each", FANUC, ids=lambda each: each.name)
def test_classes_of_fanuc(each: Case) -> None:
    check(each, "fanuc")
