"""Macro B against programs worked by hand: where the motions lead, and where the control would stop."""

from __future__ import annotations

import pytest

from ncfix.diagnostics import SourceError
from program.tracing import ends, follow, last, reasons

WORKED: dict[str, tuple[str, list[list[float]]]] = {
    "a loop counts": (
        "#1=0\nWHILE[#1LT3]DO1\nG0X[#1*10.]\n#1=#1+1\nEND1",
        [[0, 0, 0], [10, 0, 0], [20, 0, 0]],
    ),
    "loops within loops, END goes back to its own DO": (
        "#1=1\nWHILE[#1LE2]DO1\n#2=1\nWHILE[#2LE2]DO2\nG0X#1Y#2\n#2=#2+1\nEND2\n#1=#1+1\nEND1",
        [[1, 1, 0], [1, 2, 0], [2, 1, 0], [2, 2, 0]],
    ),
    "the same loop number again after its END": (
        "#1=0\nWHILE[#1LT1]DO1\nG0X1.\n#1=#1+1\nEND1\nWHILE[#1LT2]DO1\nG0X2.\n#1=#1+1\nEND1",
        [[1, 0, 0], [2, 0, 0]],
    ),
    "DO without a condition, left by GOTO": (
        "#1=0\nDO1\n#1=#1+1\nIF[#1GT2]GOTO9\nG0X#1\nEND1\nN9G0Y5.",
        [[1, 0, 0], [2, 0, 0], [2, 5, 0]],
    ),
    "GOTO looks further down first": (
        "#1=0\nN5#1=#1+1\nG0X#1\nIF[#1EQ1]GOTO5\nN7G0Y1.\nGOTO8\nX9.\nN8Z1.",
        [[1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 1, 1]],
    ),
    "GOTO to a computed number": (
        "#1=20\nGOTO#1\nN10G0X1.\nGOTO99\nN20G0X2.\nGOTO[#1-10]\nN99",
        [[2, 0, 0], [1, 0, 0]],
    ),
    "IF THEN sets one variable": ("#1=5\nIF[#1GT3]THEN#2=7\nIF[#1GT9]THEN#2=8\nG0X#2", [[7, 0, 0]]),
    "a vacant variable in a word is a word not written": ("G0X1.Y2.\nG0X#3Y4.", [[1, 2, 0], [1, 4, 0]]),
    "vacant in arithmetic is zero, copied it is vacant": (
        "#2=#1\n#3=#1+1\nG0X[#1+5]Y#3\nIF[#2EQ#0]GOTO1\nX99.\nN1X6.",
        [[5, 1, 0], [6, 1, 0]],
    ),
    "vacant is not equal to zero, but not less either": (
        "IF[#1EQ0]GOTO1\nG0X1.\nN1IF[#1NE0]GOTO2\nX9.\nN2IF[#1LT0]GOTO3\nX2.\nN3",
        [[1, 0, 0], [2, 0, 0]],
    ),
    "multiplied by vacant": ("#2=#1*5.\nIF[#2EQ#0]GOTO1\nG0X#2Y1.\nN1", [[0, 1, 0]]),
    "assigned #0 it is vacant again": ("#100=4.\nG0X#100\n#100=#0\nG0X#100Y1.", [[4, 0, 0], [4, 1, 0]]),
    "functions": (
        "G0X[SQRT[9.]+ABS[-1.]]Y[FIX[-1.7]]Z[FUP[-1.2]]\n#1=ROUND[2.5]\nX#1Y[SIN[30.]*10]Z[ATAN[1.]/[-1.]]",
        [[4, -1, -2], [3, 5, 135]],
    ),
    "more functions": (
        "G0X[ATAN[1.,1.]]Y[ACOS[0]]Z[LN[EXP[2.]]]\nX[POW[2.,3.]]Y[7MOD3]Z[BIN[#1]+BCD[12]]",
        [[45, 90, 2], [8, 1, 18]],
    ),
    "bits": ("G0X[12AND10]Y[12OR10]Z[12XOR10]", [[8, 14, 6]]),
    "precedence: functions, then * / AND, then + - OR, then relations": (
        "G0X[2+3*4]Y[[2+3]*4]Z[10/4-1]\nX[2+3AND1]Y[1OR2+3]Z[2*3AND5]\nIF[1+1EQ2]GOTO9\nX0\nN9Z[7XOR2-1]",
        [[14, 20, 1.5], [3, 6, 4], [3, 6, 4]],
    ),
    "common variables of large memories": (
        "#400=1.\n#900000=2.\n#907399=#900000+#400\n#98499=4.\nG0X#400Y#907399Z#98499",
        [[1, 3, 4]],
    ),
    "indirect variables": ("#1=101\n#101=7.\n#[#1+1]=8.\nG0X#[#1]Y##1Z#102", [[7, 7, 8]]),
    "variables on the left side in one block": ("#1=2.\n#1=#1*#1\nG0X#1", [[4, 0, 0]]),
    "two letters of a control word": (
        "#1=0\nWH[#1LT2]DO1\n#1=#1+1\nEN1\nIF[#1EQ2]TH#2=7.\nGO9\n#1=5\nN9G0X#1Y#2",
        [[2, 7, 0]],
    ),
    "ROUND in a word rounds to the least increment": ("#1=1.23456\nG0X[ROUND[#1]]Y#1", [[1.235, 1.23456, 0]]),
    "arguments of a macro": (
        "G65P9010A1.B2.C3.\nG0X#1Y5.\nM30\nO9010\nG0X#1Y#2Z#3\nM99",
        [[1, 2, 3], [1, 5, 3]],
    ),
    "all argument letters": (
        "G65P9010D1.E2.F3.H4.Q5.R6.S7.T8.U9.V10.W11.X12.Y13.Z14.\nM30\nO9010\n"
        "G0X[#7+#8+#9]Y[#11+#17+#18]Z[#19+#20+#21+#22+#23]\nX#24Y#25Z#26\nM99",
        [[6, 15, 45], [12, 13, 14]],
    ),
    "M is an argument behind G65": ("M8G65P9010A1.M48\nM30\nO9010\nG0X#1Y#13\nM99", [[1, 48, 0]]),
    "codes and variables before G65 take effect": (
        "G0X5.\nG91#100=2.G65P9010A1.\nM30\nO9010\nG0X#1Y#100\nM99",
        [[5, 0, 0], [6, 2, 0]],
    ),
    "I J K several times": (
        "G65P9010A1.B2.C3.I4.J5.K6.I7.J8.\nM30\nO9010\nG0X[#4+#5+#6]Y[#7+#8]Z[#1+#2+#3]\nM99",
        [[15, 15, 6]],
    ),
    "a macro has its own local variables": (
        "#1=5.\n#100=1.\nG65P1L2\nG0X#1Y#100\nM30\nO1\n#1=9.\n#100=#100+1\nM99",
        [[5, 3, 0]],
    ),
    "a subprogram shares them": ("#1=5.\nM98P1L2\nG0X#1\nM30\nO1\n#1=#1+1\nM99", [[7, 0, 0]]),
    "repeats before the program number": ("#100=0\nM98P30001\nG0X#100\nM30\nO1\n#100=#100+1\nM99", [[3, 0, 0]]),
    "calls within calls": (
        "M98P1\nG0Y1.\nM30\nO1\nM98P2\nG0X2.\nM99\nO2\nG0X1.\nM99",
        [[1, 0, 0], [2, 0, 0], [2, 1, 0]],
    ),
    "M99 P returns to a block": ("M98P1\nG0X9.\nN50G0Y1.\nM30\nO1\nG0X1.\nM99P50", [[1, 0, 0], [1, 1, 0]]),
    "a macro after every motion, until G67": (
        "G66P1A3.\nG0X1.\nX2.\nF5\nG91G67X1.\nM30\nO1\nG0Z#1\nG0Z0.\nM99",
        [[1, 0, 0], [1, 0, 3], [1, 0, 0], [2, 0, 0], [2, 0, 3], [2, 0, 0], [3, 0, 0]],
    ),
    "work offsets are in the unit of the program": ("G20\n#5221=1.\nG0X1.Y#5221", [[50.8, 25.4, 0]]),
    "work offsets are variables": ("#5221=10.\nG0X1.\nG0X[#5221]", [[11, 0, 0], [20, 0, 0]]),
    "modes are variables": ("G91G0X1.\n#3=#4003\nG90X[#3]\nX#4001", [[1, 0, 0], [91, 0, 0], [0, 0, 0]]),
    "computed codes": ("#1=1\nG#1X5.F100.\nG[#1-1]X6.", [[5, 0, 0], [6, 0, 0]]),
    "a vacant code is no code": ("G1X5.F100.\nG#9X6.", [[5, 0, 0], [6, 0, 0]]),
    "system alarms are no motion": ("IF[#1EQ#0]GOTO5\n#3000=1(NO TOOL)\nN5#3006=1(LOOK)\nG0X1.", [[1, 0, 0]]),
    "a jump behind THEN": ("#1=1\nIF[#1EQ1]THEN GOTO5\nG0X9.\nN5G0X1.", [[1, 0, 0]]),
}


@pytest.mark.parametrize("name", WORKED)
def test_worked_by_hand(name: str) -> None:
    text, expected = WORKED[name]
    found = follow(text, dialect="fanuc", no_point="calculator")
    assert ends(found) == [[pytest.approx(value, abs=1e-9) for value in row] for row in expected]
    assert set(reasons(found)) == {""}


STOPS = {
    "IF[1EQ1AND2EQ2]GOTO5\nN5": "NCF110",
    "IF[1EQ1]GOTO5G0X1.\nN5": "NCF110",
    "GOTO5G0X1.\nN5": "NCF110",
    "G0X[1/0]": "NCF210",
    "G0X[SQRT[-1.]]": "NCF210",
    "#0=5": "NCF212",
    "#5041=5": "NCF212",
    "GOTO77": "NCF242",
    "WHILE[1EQ1]DO1\nG0X1.": "NCF242",
    "END1": "NCF242",
    "IF[#1EQ#0]THEN#3000=5": "NCF216",
    "M98P7": "NCF231",
    "G65P7": "NCF231",
    "M98P1\nM30\nO1\nG0X1.\nO2\nM99": "NCF242",
    "M98P1\nM30\nO1\nM98P1\nM99": "NCF232",
    "N1M97P1": "NCF232",
    "N1GOTO1": "NCF233",
}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("M98P7\nM30\n%\nO0007\nM99\n", "the program O7 is after the % at which the control stops reading"),
        ("GOTO N100\nN100 M30", "GOTO needs the number of a block, without N"),
    ],
)
def test_where_the_control_stops_the_reason_is_named(text: str, said: str) -> None:
    with pytest.raises(SourceError) as caught:
        follow(text, dialect="fanuc")
    assert caught.value.messages[0].text == said


@pytest.mark.parametrize("text", STOPS)
def test_where_the_control_stops(text: str) -> None:
    with pytest.raises(SourceError) as caught:
        follow(f"{text}\nM30", dialect="fanuc", most_blocks=2000)
    assert caught.value.messages[0].code == STOPS[text]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("G0X1.\n#1=#5041\nG0X[#1+1.]", "known only at run time"),
        ("IF[1EQ2]THEN\nG0X1.\nENDIF\nG0X2.", "ncfix does not support several blocks between THEN and ENDIF"),
        ("IF[#1000EQ1]GOTO5\nG0X1.\nN5G0X2.", "which blocks are executed from here on is known only at run time"),
        ("#1=#3012\nG0X#1", "known only at run time"),
        ("#5201=1.\nG0X1.", "the program sets #5201"),
        *((f"G0X#{word}", "known only at run time") for word in (4109, 4111, 4119, 4120)),  # F, H, S, T of before
        ("#1=0.1+0.2\nIF[#1GT0.3]GOTO5\nN5G0X1.", "which blocks are executed from here on is known only at run time"),
    ],
)
def test_what_depends_on_the_machine_is_refused(text: str, reason: str) -> None:
    found = follow(text, dialect="fanuc", no_point="calculator")
    assert reason in reasons(found)[-1]


@pytest.mark.parametrize(("dialect", "number"), [("fanuc", 4014), ("haas", 4012), ("mitsubishi", 4012)])
def test_the_work_offset_in_force_is_in_the_group_that_it_has_with_the_maker(dialect: str, number: int) -> None:
    assert last(follow(f"G57\nG0X#{number}", dialect=dialect))[0] == 57.0


def test_a_group_that_another_maker_counts_otherwise_is_no_number() -> None:
    assert reasons(follow("G57\nG0X#4014", dialect="mitsubishi")) == [
        "the position of the axis X is known only at run time"
    ]


def test_reading_a_position_is_said() -> None:
    found = follow("G21G0X1.\n#1=#5041\nG0Y2.", dialect="fanuc")
    assert [message.code for message in found.messages] == ["NCF241"]
    assert reasons(found) == ["", ""]


@pytest.mark.parametrize("setting", ["#2=4.", "#[#3]=4.", "#2=4. #3=5"])
def test_what_is_set_on_a_condition_of_the_machine_is_known_only_at_run_time(setting: str) -> None:
    found = follow(f"#2=3.\n#3=2\nIF[#1000EQ1]THEN{setting}\nG0Y1.\nX#2", dialect="fanuc")
    assert reasons(found) == ["", "the position of the axis X is known only at run time"]


@pytest.mark.parametrize("setting", ["#3000=1(TOO HIGH)", "#1100=1"])
def test_alarms_and_signals_on_a_condition_of_the_machine_do_no_harm(setting: str) -> None:
    assert reasons(follow(f"#2=3.\nIF[#1000EQ1]THEN{setting}\nG0X#2", dialect="fanuc")) == [""]


@pytest.mark.parametrize("then", ["#5221=4.", "G0X3.", "#[#2000]=1"])
def test_what_else_is_done_on_a_condition_of_the_machine_leaves_nothing_certain(then: str) -> None:
    found = follow(f"IF[#1000EQ1]THEN{then}\nG0Y1.", dialect="fanuc", no_point="calculator")
    assert reasons(found)[-1] == "which blocks are executed from here on is known only at run time"


def test_a_skipped_condition_sets_nothing() -> None:
    text = "IF[1EQ1]THEN#1=1.\n/IF[1EQ1]THEN#1=2.\nG0X#1"
    assert last(follow(text, dialect="fanuc", no_point="calculator", block_skip=True)) == [1, 0, 0]
    assert last(follow(text, dialect="fanuc", no_point="calculator")) == [2, 0, 0]


def test_programs_beside_it_are_found_by_number_and_name() -> None:
    files = {"O0007": "O7\nG0X7.\nM99\n", "PART": "G0Y3.\nM99\n"}
    found = follow("M98P7\nM98<PART>", dialect="fanuc", files=files)
    assert last(found) == [7, 3, 0]
    assert "O0007" in reasons(found)[0]
