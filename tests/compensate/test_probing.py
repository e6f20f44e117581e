"""Programs that go on with what they have probed: refused, or corrected with the nominal results that the setup gives.

What a probe finds is a reading of the erroneous machine: it has the error of the place that was touched in it, so words
that are computed from it stay as they are, and only the other axes of their blocks are corrected.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from compensate.streaming import streamed
from ncfix.compensate import FixOptions
from ncfix.compensate.driver import Fixed, fix_program
from ncfix.control.setup import Setup
from ncfix.control.trace import NotInPartsError
from ncfix.diagnostics import RefusedError
from ncfix.machine import load
from ncfix.text.reader import read

MACHINE = load(str(Path(__file__).parents[2] / "examples/machines/wCBXFZYSt.toml"))
NOMINAL = Setup(assume_zero=True, no_point="calculator", probed={"Z": 0.0})
AT_RUN_TIME = Setup(assume_zero=True, no_point="calculator")

LEVELLED = """G21 G90 G17 G54
G0 X10 Y20 Z10 B0 C0
G38.2 Z-5 F50
#100 = #5063
G0 Z5
X40 Y20
G38.2 Z-5 F50
#101 = #5063
G0 Z5
G1 X10 Y20 Z[#100 - 0.1] F200
X40 Y20 Z[[#100+#101]/2-0.1]
Y30 Z#101
G0 Z20
G10 L20 P1 Z0
G1 X0 Y0 Z5
M2
"""


def fixed(text: str, setup: Setup = NOMINAL, dialect: str = "linuxcnc") -> Fixed:
    options = FixOptions(tolerance_um=5.0, allow_refused=True)
    return fix_program(read(text.encode(), "part.nc", dialect), MACHINE, setup, options)


@pytest.mark.parametrize("dialect", ["linuxcnc", "iso"])
def test_what_is_computed_from_probing_is_refused_unless_the_setup_says_where_it_ends(dialect: str) -> None:
    text = LEVELLED.replace("G10 L20 P1 Z0\n", "")  # ISO controls differ in what that sets
    assert [refusal.line for refusal in fixed(text, AT_RUN_TIME, dialect).report.refused] == [10, 11, 12]
    assert not fixed(text, dialect=dialect).report.refused


def test_words_computed_from_probing_stay_and_the_others_are_corrected() -> None:
    lines = fixed(LEVELLED).text.decode().splitlines()[1:]
    assert lines[9].startswith("G1 X10.01")
    assert lines[9].endswith("Z[#100 - 0.1] F200")
    assert lines[10].startswith("X40.01")
    assert lines[10].endswith("Z[[#100+#101]/2-0.1]")
    assert lines[11].startswith("Y29.99")
    assert "Z#101" in lines[11]
    assert lines[14].startswith("G1 X0.01")
    assert "Z4.99" in lines[14]


def test_an_axis_that_has_gone_to_a_measured_place_gets_no_word_of_its_own() -> None:
    text = LEVELLED.replace("Y30 Z#101\n", "Y30 Z#101\nG1 X50\n")
    line = next(line for line in fixed(text).text.decode().splitlines() if "X50" in line or "X49" in line)
    assert "Z" not in line


def test_the_stamp_and_a_warning_say_so() -> None:
    done = fixed(LEVELLED)
    assert b", nominal probing, assumed zero: " in done.text.splitlines()[0]
    assert any("as the results of probing" in warning.text for warning in done.report.warnings)


def test_figures_leave_out_what_the_machine_measures() -> None:
    assert fixed(LEVELLED).report.error_before_um["max"] > 10.0
    assert fixed(LEVELLED).report.error_after_um["max"] < 5.0  # the tolerance; Z alone is 5 to 6 um off at the ends


@pytest.mark.parametrize(
    "line",
    [
        "G2 X[10+#5063] Y20 I5 J0 F100",
        "G81 X[10+#5063] Y0 Z-3 R2 F100",
        "M66 P0 L0\nG1 X#5399 F100",
        "M66 P0 L0\nG1 Z#5063 F100",
        "G1 Z[#<_hal[probe.z]>] F100",
    ],
)
def test_what_else_is_known_at_run_time_only_stays_refused(line: str) -> None:
    text = f"G0 X10 Y20 Z10 B0 C0\nG38.2 Z-5 F50\nG0 X0 Y20 Z5\n{line}\nM2\n"
    done = fixed(text)
    assert done.report.refused
    assert all(part in done.text.decode() for part in line.split("\n"))


def test_branches_on_what_was_probed_stay_refused() -> None:
    text = "G0 X1 Y1 Z1 B0 C0\nG38.2 Z-5 F50\no1 if [#5063 GT 0]\nG1 X5\no1 endif\nG1 X6\nM2\n"
    assert {refusal.line for refusal in fixed(text).report.refused} >= {6}


def test_that_a_probe_has_switched_is_known() -> None:
    text = "G0 X1 Y1 Z1 B0 C0\nG38.2 Z-5 F50\no1 if [#5070 EQ 0]\nM2\no1 endif\nG1 X6 Z2 F100\nM2\n"
    assert not fixed(text).report.refused
    assert fixed(text, AT_RUN_TIME).report.refused


def test_probing_ends_where_the_setup_says_in_increments_and_inches_too() -> None:
    text = "G21 G0 X1 Y1 Z1 B0 C0\nG20 G91 G38.2 Z-1 F5\nG0 Z1\nG90 G1 X1 Z1 F5\nM2\n"
    assert not fixed(text).report.refused
    assert b"(" in fixed(text).text.splitlines()[0]


def test_flat_programs_would_lose_what_is_computed() -> None:
    from ncfix.compensate.driver import fix_flat

    text = LEVELLED.replace("Y30 Z#101\n", "#1=0\no1 repeat [2]\n#1=[#1+90]\nX#1 Z#101\no1 endrepeat\n")
    with pytest.raises(RefusedError) as caught:
        fix_flat(read(text.encode(), "part.nc", "linuxcnc"), MACHINE, NOMINAL, FixOptions())
    assert "run time" in caught.value.messages[0].text


def test_programs_that_probe_go_the_whole_way_at_once() -> None:
    text = LEVELLED.replace("M2\n", "".join(f"G1 X{i}.5 Y{i % 7} Z#101\n" for i in range(60)) + "M2\n").encode()
    with pytest.raises(NotInPartsError):
        streamed(text, MACHINE, "linuxcnc", 300, setup=NOMINAL)


def test_fanuc_programs_are_refused_as_before() -> None:
    text = "G0 X10. Y20. Z10. B0. C0.\nG31 Z-5. F50.\nG1 X10. Z#5063 F100.\nM30\n"
    assert fixed(text, dialect="fanuc").report.refused
