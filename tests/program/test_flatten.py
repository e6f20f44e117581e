"""Programs written out flat: the same motions, every block once, nothing left to compute."""

from __future__ import annotations

from pathlib import Path

import pytest

from conftest import some
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat, fix_program
from ncfix.control.flatten import flatten
from ncfix.control.setup import Setup
from ncfix.control.trace import trace
from ncfix.diagnostics import NcfixError, RefusedError
from ncfix.machine import load
from ncfix.text.reader import read
from ncfix.text.tree import Assignment, Constant, Literal, OWordLine
from program.generated import Generator
from program.tracing import KNOWN

STEPS = dict.fromkeys("XYZ", 0.001)


def flat(text: str, dialect: str, **options: object) -> str:
    program = read(text.encode(), "part", dialect)
    setup = Setup(KNOWN.work_offsets, KNOWN.tools, KNOWN.initial, KNOWN.references, no_point="calculator")
    found = flatten(program, setup, ("X", "Y", "Z"), frozenset(), STEPS, **options)  # type: ignore[arg-type]
    for template in found.program.templates:
        assert not any(isinstance(item, Assignment) for item in template.items)
        assert not any(isinstance(item, OWordLine) and item.keyword != "program" for item in template.items)
        assert all(isinstance(word.value, Literal | Constant) for word in template.words)
    assert len(found.lines) == len(found.program)
    return found.program.source.decode()


@pytest.mark.parametrize(
    ("dialect", "text", "expected"),
    [
        ("fanuc", "G0X1.\nM30\n", "G0X1.\nM30\n"),
        ("fanuc", "N10 G0 X[1/3] (A)\nM30\n", "G0 X0.333 (A)\nM30\n"),
        ("fanuc", "#1=0\nWHILE[#1LT2]DO1\nG0X#1\n#1=#1+1\nEND1\nM30\n", "G0X0.\nG0X1.\nM30\n"),
        (
            "fanuc",
            "%\nO1\nG0\nM98P2L2\nM30\nO2\nG91X1.\nG90\nM99\n%\n",
            "%\nO1\nG0\nG91X1.\nG90\nG91X1.\nG90\nM30\n%\n",
        ),
        ("fanuc", "G0X1.Y#5\nM30\n", "G0X1.\nM30\n"),
        ("fanuc", "G0\nG16X10.Y90.\nY180.\nG15\nM30\n", "G0\nX0.Y10.\nY0. X-10.\nM30\n"),
        (
            "fanuc",
            "G81X1.Z-1.R2.F9\nG91X1.K2\nG80\nM30\n",
            "G81X1.Z-1.R2.F9\nG90 X2. Y0. Z-1. R2.\nX3. Y0.\nG91\nG80\nM30\n",
        ),
        (
            "fanuc",
            "G51X1.Y1.Z0P2.(TWICE)\nG0X2.\nY1.\nG91G3X1.Y1.J1.\nG90G50\nG1X0\nM30\n",
            "(TWICE)\nG0X3.\nY1.\nG91G3X2.Y2.J2.\nG90\nG1X0\nM30\n",
        ),
        ("fanuc", "G65P9A1.\nM30\nO9\nG0X#1\r\nM99\n", "G0X1.\nM30\n"),
        ("fanuc", "G91 M8 G65P9A1.\nM30\nO9\nG0X#1\nM99\n", "G91 M8\nG0X1.\nM30\n"),
        (
            "fanuc",
            "N10 G65 P9810 Z5. F100. (SAFE)\n#1=0\nWHILE[#1LT2]DO1\nG65P9811Z0.S1\n#1=#1+1\nEND1\nM98 P9500\nM30\n",
            "G65 P9810 Z5. F100. (SAFE)\nG65P9811Z0.S1\nG65P9811Z0.S1\nM98 P9500\nM30\n",
        ),
        ("fanuc", "G0X1\nM30\n", "G0X1\nM30\n"),
        ("fanuc", "G#1 G0X1.\nM30\n", "G0X1.\nM30\n"),
        ("linuxcnc", "#1=2\no1 sub\nG0 X#1 Y[#2]\no1 endsub\no1 call [3] [4]\nM2\n", "G0 X3. Y4.\nM2\n"),
        (
            "linuxcnc",
            "G0\no1 repeat [3]\nG91 X[1/3]\no1 endrepeat\nM2\n",
            "G0\nG91 X0.333\nG91 X0.334\nG91 X0.333\nM2\n",
        ),
        (
            "linuxcnc",
            "G0 Z5\nF9 G91 G81 X1 Z-2 R-1 L2\nG80\nM2\n",
            "G0 Z5\nF9 G81 G90 X1. Y0. Z2. R4.\nX2. Y0.\nG91\nG80\nM2\n",
        ),
        (
            "linuxcnc",
            "G0 X2 Y0 Z5\nF9 G91 G81 ^90 Z-2 R-1 L2\nG90 @3 Z1 R2\nG80\nM2\n",
            "G0 X2 Y0 Z5\nF9 G81 G90 X0. Y2. Z2. R4.\nX-2. Y0.\nG91\nG90 X-3. Y0. Z1. R2.\nG80\nM2\n",
        ),
        ("linuxcnc", "G0 X#5221\nM2\n", "G0 X0.\nM2\n"),
        ("iso", "M98 P5\nM30\nO5\nG0 X1\nM99\n", "G0 X1\nM30\n"),
    ],
)
def test_flat_programs(dialect: str, text: str, expected: str) -> None:
    assert flat(text, dialect) == expected


@pytest.mark.parametrize(
    ("dialect", "text", "code"),
    [
        ("linuxcnc", "F9 G38.2 X5\nG0 X#5061\nM2\n", "NCF237"),
        ("linuxcnc", "M66 P0 L0\no1 if [#5399 gt 0]\nG0 X1\no1 endif\nM2\n", "NCF237"),
        ("fanuc", "IF[#1001EQ1]GOTO5\nG0X1.\nN5G0X2.\nM30\n", "NCF237"),
        ("fanuc", "G0X[#5041+1.]\nM30\n", "NCF237"),
        ("fanuc", "G0X1.\nG51X0Y0Z0P2.\nG92X0\nX1.\nM30\n", "NCF237"),
        ("fanuc", "G0X1.\nG51X0Y0Z0P2000\nX1.\nM30\n", "NCF237"),
        ("fanuc", "G0X1.\nG51X0Y0Z0I2.J1.K1.\nX1.\nM30\n", "NCF237"),
        ("fanuc", "#1=5.\nG65P9810Z#1\nM30\n", "NCF237"),
        ("fanuc", "G66P9810Z1.\nG0X1.\nG67\nM30\n", "NCF237"),
        ("fanuc", "#1=0\nWHILE[#1LT100]DO1\nG0X#1\n#1=#1+1\nEND1\nM30\n", "NCF238"),
        ("linuxcnc", "o1 sub\nM73\nG91\no1 endsub\nG0 X1\no1 call\nG0 X2\nM2\n", "NCF239"),
    ],
)
def test_what_cannot_be_written_out_is_refused(dialect: str, text: str, code: str) -> None:
    with pytest.raises(RefusedError) as caught:
        flat(text, dialect, limit=50)
    assert caught.value.messages[0].code == code


LOOP = (
    "G90 G54 G0 X0. Y0. Z50.\n#1=0\nWHILE[#1LT4]DO1\nG0 X[10.*#1] Y[5.*#1]\nG1 Z-1. F100.\nG0 Z5.\n#1=#1+1\nEND1\nM30\n"
)


def test_loops_are_corrected_when_they_are_written_out(root: Path) -> None:
    machine = load(str(root / "examples/machines/three_axis.toml"))
    program = read(LOOP.encode(), "part", "fanuc")
    setup = Setup(assume_zero=True)
    options = FixOptions(tolerance_um=2.0)
    refused = fix_program(program, machine, setup, options)
    assert {each.line for each in refused.report.refused} >= {4, 5}
    fixed = fix_flat(program, machine, setup, options)
    assert not fixed.report.refused
    assert fixed.report.warnings[0].code == "NCF445"
    assert fixed.text.count(b"G1 Z-1") + fixed.text.count(b"G1 Z-0.99") == 4
    assert float(fixed.report.error_after_um["max"] or 0) < 2.0
    assert 1 <= int(fixed.report.error_after_um["where"] or 0) <= 9


def test_what_can_be_corrected_keeps_its_form(root: Path) -> None:
    machine = load(str(root / "examples/machines/three_axis.toml"))
    text = "G90 G54 G0 X0. Y0. Z50.\n#1=4.\nG1 X#1 Y2. F100.\nM30\n"
    program = read(text.encode(), "part", "fanuc")
    fixed = fix_flat(program, machine, Setup(assume_zero=True), FixOptions(tolerance_um=2.0))
    assert b"#1=4." in fixed.text


@pytest.mark.parametrize("seed", range(some(12)))
def test_generated_programs_of_linuxcnc_mean_the_same(seed: int) -> None:
    """`flatten` compares the motions itself; here it must not fail for want of a case."""
    axes, rotary = ("X", "Y", "Z", "A", "B", "C"), frozenset("ABC")
    program = read(Generator(seed).program().encode(), "part.ngc", "linuxcnc")
    try:
        trace(program, KNOWN, axes, rotary)
    except NcfixError:
        return
    flatten(program, KNOWN, axes, rotary, dict.fromkeys(axes, 0.001))


def test_offsets_that_the_program_sets_are_set_in_the_flat_program_too() -> None:
    text = "#5221=[1+1]\n#1=3\nG0X#1\nM30\n"
    program = read(text.encode(), "part", "fanuc")
    found = flatten(program, KNOWN, ("X", "Y", "Z"), frozenset(), STEPS)
    assert found.program.source.decode() == "#5221=2.\nG0X3.\nM30\n"


def test_what_other_programs_find_is_left_to_them_in_the_flat_program_too() -> None:
    text = "#500=[1+1]\n#100=3\n#501=#0\nG0X#100\nM30\n"
    program = read(text.encode(), "part", "fanuc")
    found = flatten(program, KNOWN, ("X", "Y", "Z"), frozenset(), STEPS)
    assert found.program.source.decode() == "#500=2.\n#501=#0\nG0X3.\nM30\n"


def test_what_other_programs_find_must_be_known() -> None:
    program = read(b"#500=#5041\n#1=3\nG0X#1\nM30\n", "part", "fanuc")
    with pytest.raises(NcfixError, match="the value of #500 is known only at run time"):
        flatten(program, KNOWN, ("X", "Y", "Z"), frozenset(), STEPS)
