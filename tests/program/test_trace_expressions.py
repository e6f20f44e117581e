"""What expressions and parameters are worth: values that LinuxCNC's `rs274` printed for the same lines."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ncfix.control.moves import Rule
from ncfix.diagnostics import SourceError
from ncfix_iso.rs274 import parameters
from program.tracing import follow, last, reasons

AXIS = "the position of the axis {} is known only at run time"


def value_of(expression: str, before: str = "") -> float:
    """The value of an expression, by way of the position it leads to."""
    return last(follow(f"{before}\nG0 X{expression}"))[0]


PRINTED = {
    "[2+3*4**2]": 50.0,
    "[10 mod 3]": 1.0,
    "[-7 mod 3]": 2.0,
    "[1 eq 1.0000005]": 1.0,
    "[1 eq 1.0002]": 0.0,
    "[1 lt 1.00000001]": 1.0,
    "round[2.5]": 3.0,
    "round[-2.5]": -3.0,
    "fix[-2.5]": -3.0,
    "fup[-2.5]": -2.0,
    "atan[1]/[-1]": 135.0,
    "[1 or 0 and 0]": 0.0,
    "[2**3**2]": 64.0,
    "[-2**2]": 4.0,
    "[5-3 gt 1 and 2]": 1.0,
    "[-[2]**2]": 4.0,
    "[1 xor 1]": 0.0,
    "[1 ne 1.0000005]": 0.0,
    "[2 le 1.99995]": 0.0,
    "[1.99995 ge 2]": 0.0,
    "[2 ge 2]": 1.0,
    "[10 / 4 * 2]": 5.0,
    "[7 - 2 - 1]": 4.0,
    "abs[-3]": 3.0,
    "sqrt[16]": 4.0,
    "exp[0]": 1.0,
    "ln[1]": 0.0,
    "acos[0]": 90.0,
    "asin[1]": 90.0,
    "-[3]": -3.0,
}


@pytest.mark.parametrize(("expression", "value"), PRINTED.items())
def test_values_are_those_of_linuxcnc(expression: str, value: float) -> None:
    assert value_of(expression) == pytest.approx(value, abs=1e-9)


@pytest.mark.parametrize("expression", [*PRINTED, "[#2/4]", "[10/2-1]", "[3*2]", "[[8]/2]", "[-#2*3/4]"])
def test_division_is_no_block_skip_and_a_product_no_check_number(expression: str) -> None:
    """ISO has both, and LinuxCNC neither where arithmetic may stand."""
    value = last(follow(f"#2=8\nG0 X{expression}", dialect="iso"))[0]
    assert value == pytest.approx(value_of(expression, "#2=8"), abs=1e-9)


def test_block_skip_stands_behind_a_line_number_too_and_a_check_number_at_the_end() -> None:
    skipped = follow("N10 /G0 X[8/2]\nN20 G0 Y[2*3]*71\n/2 Z5 *12 ; end", dialect="iso", block_skip=True)
    assert last(skipped) == [0.0, 6.0, 0.0]
    assert last(follow("N10 /G0 X[8/2]\nN20 G0 Y[2*3]*71", dialect="iso")) == [4.0, 6.0, 0.0]


def test_case_and_blanks_mean_nothing() -> None:
    assert value_of("[ S I N [ 3 0 ] + 1 . 5 ]") == pytest.approx(2.0, abs=1e-9)


numbers = st.floats(-1e4, 1e4).map(lambda value: round(value, 3))


@given(numbers, numbers, numbers)
def test_products_bind_stronger_than_sums(a: float, b: float, c: float) -> None:
    assert value_of(f"[{a:.3f} + {b:.3f} * {c:.3f}]") == pytest.approx(a + b * c, abs=1e-6)


@given(numbers, numbers.filter(lambda value: abs(value) > 0.001))
def test_modulo_is_never_negative_and_leaves_a_multiple(a: float, b: float) -> None:
    rest = parameters.modulo(a, b)
    assert 0.0 <= rest <= abs(b)
    turns = (a - rest) / b
    assert turns == pytest.approx(round(turns), abs=1e-6)


@given(st.floats(-360.0, 360.0))
def test_angles_are_degrees(angle: float) -> None:
    sine, cosine = parameters.FUNCTIONS["sin"][0](angle), parameters.FUNCTIONS["cos"][0](angle)
    assert sine**2 + cosine**2 == pytest.approx(1.0, abs=1e-12)
    back = parameters.OPERATORS["atan"](sine, cosine)
    assert math.remainder(back - angle, 360.0) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("comparison", ["1 eq 1.00005", "1 ne 1.00005", "2 le 1.9999999", "1.9999999 ge 2"])
def test_comparisons_that_versions_of_linuxcnc_decide_otherwise_are_known_at_run_time_only(comparison: str) -> None:
    assert reasons(follow(f"G0 X[{comparison}]")) == [AXIS.format("X")]


def test_a_loop_that_sums_up_to_its_end_runs_once_more_since_2_9_1() -> None:
    """Seventy-five times 0.0005 are 0.037500000000000026."""
    found = follow("#1=0\no1 while [#1 le 0.0375]\nG0 X#1\n#1=[#1+0.0005]\no1 endwhile\nG0 Y1")
    assert reasons(found) == [""] * 75 + ["which blocks are executed from here on is known only at run time"] * 2


@given(st.sampled_from(["eq", "ne", "gt", "ge", "lt", "le"]), numbers, numbers)
def test_comparisons_are_one_or_zero_and_each_has_its_opposite(operator: str, a: float, b: float) -> None:
    opposite = {"eq": "ne", "ne": "eq", "gt": "le", "ge": "lt", "lt": "ge", "le": "gt"}[operator]
    one, other = parameters.OPERATORS[operator](a, b), parameters.OPERATORS[opposite](a, b)
    assert {one, other} <= {0.0, 1.0}
    assert one != other or 0.0 < abs(a - b) < parameters.EQUAL


# -- parameters -------------------------------------------------------------------------------------------------------


def test_parameters_that_were_never_set_are_zero() -> None:
    assert value_of("[#100 + 1]") == 1.0


def test_assignments_take_effect_after_the_block() -> None:
    assert last(follow("#1=5\n#1=7 G0 X#1\nG0 Y#1"))[:2] == [5.0, 7.0]
    assert value_of("[#2]", "#1=5\n#1=[#1+1] #2=#1") == 5.0


def test_the_last_assignment_of_a_block_counts() -> None:
    assert value_of("#1", "#1=5 #1=6") == 6.0


def test_indirection() -> None:
    assert value_of("##2", "#7=4\n#2=7") == 4.0
    assert value_of("#[#2+1]", "#8=3\n#2=7") == 3.0


def test_named_parameters_ignore_case_and_blanks() -> None:
    assert value_of("#<feedheight>", "#<Feed Height>=4") == 4.0


def test_existence() -> None:
    before = "#<here>=1"
    assert value_of("exists[#<here>]", before) == 1.0
    assert value_of("exists[#<there>]", before) == 0.0
    assert value_of("exists[#<_x>]", before) == 1.0


def test_local_names_belong_to_their_subprogram() -> None:
    text = "o1 sub\n#<a>=7\n#<_depth>=8\nG0 X#<a>\no1 endsub\n#<a>=1\no1 call\nG0 Y#<a> Z#<_depth>"
    assert last(follow(text)) == [7.0, 1.0, 8.0]


def test_the_setup_gives_values() -> None:
    variables = {"#100": 3.0, "#<depth>": 4.0, "#<_ini[tool]x>": 5.0}
    text = "G0 X#100 Y#<depth> Z#<_INI[TOOL]X>"
    assert last(follow(text, variables=variables)) == [3.0, 4.0, 5.0]


def test_modes_can_be_read() -> None:
    text = "G0 X12 Y3\n#3=#<_metric> #4=#<_coord_system> #2=#5221\nG55 G20\nG21 G0 X#2 Y#3 Z#4"
    assert last(follow(text)) == [0.0, 1.0, 540.0]


@pytest.mark.parametrize("position", ["#5420", "#<_x>"])
def test_a_position_that_is_read_is_another_one_in_the_corrected_program(position: str) -> None:
    found = follow(f"G21 G0 X12 Y3 Z1\n#1={position}\nG0 X[#1+1] Y5\nG0 X3")
    assert found.moves.rule.tolist() == [Rule.CORRECT, Rule.REFUSE, Rule.CORRECT]
    assert [message.code for message in found.messages] == ["NCF241"]
    waits = follow(f"G91\no1 while [{position} LT 40]\nG0 X1\no1 endwhile").moves
    assert set(waits.rule.tolist()) <= {Rule.REFUSE}


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("G0 X[1/0]", "NCF210"),
        ("G0 X[5 mod 0]", "NCF210"),
        ("G0 X[[0-8]**0.5]", "NCF210"),
        ("G0 X sqrt[-1]", "NCF210"),
        ("G0 X ln[0]", "NCF210"),
        ("G0 X asin[1.1]", "NCF210"),
        ("G0 X[10**400]", "NCF210"),
        ("G0 X exp[1000]", "NCF210"),
        ("G0 X#[1.5]", "NCF210"),
        ("G0 X#<never>", "NCF211"),
        ("#5400=1", "NCF212"),
        ("#<_x>=1", "NCF212"),
        ("#6000=1", "NCF213"),
        ("G0 X#0", "NCF213"),
    ],
)
def test_what_cannot_be_computed_is_an_error(text: str, code: str) -> None:
    with pytest.raises(SourceError) as caught:
        follow(text)
    assert caught.value.code == code


def test_a_number_next_to_a_whole_one_is_one() -> None:
    assert value_of("#[1.00005]", "#1=3") == 3.0
    assert value_of("#[0.99995]", "#1=3") == 3.0


def test_pins_and_entries_of_the_machine_are_known_at_run_time_only() -> None:
    found = follow("F#<_hal[plasma.feed]>\nG1 X1\nG1 Y#<_ini[TABLE]PARK> X2\nG0 X3 Y3\nG0 X#<_hal[motion.x]>")
    assert reasons(found) == ["", AXIS.format("Y"), "", AXIS.format("X")]
    assert np.isnan(found.moves.feed[0])


def test_the_setup_may_give_the_value_of_a_pin() -> None:
    assert last(follow("G0 X#<_HAL[a.b-c]>", variables={"#<_hal[a.b-c]>": 2.5}))[0] == 2.5


def test_a_branch_that_a_pin_decides_is_decided_at_run_time() -> None:
    found = follow("G0 X1\no1 if [#<_hal[a.b]> GT 1]\nG0 X2\no1 endif\nG0 X3")
    assert reasons(found) == ["", "which blocks are executed from here on is known only at run time"]
