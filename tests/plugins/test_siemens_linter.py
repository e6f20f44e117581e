"""Siemens files with mistakes: each is named, whatever it is, and good files are not remarked on."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from ncfix.diagnostics import ConfigError
from ncfix.tables.table_files import Remarks
from ncfix_siemens.assignments import parsed, written
from ncfix_siemens.tables import read_eec
from tables.siemens_files import CONTROL, EEC, GOOD, HEAD, ONE, PAIR, at

WRONG = {
    "one value too many": (GOOD.replace(b"$AN_CEC_INPUT", b"$AN_CEC[0,3]=0.0\n$AN_CEC_INPUT"), "values 0 to 2 by its"),
    "a value gone": (GOOD.replace(b"$AN_CEC[0,1]=0.003\n", b""), "1 of 3 values of table 1 are missing"),
    "a step that does not fit": (GOOD.replace(b"STEP[0]=50.0", b"STEP[0]=30.0"), "not a whole number"),
    "no step": (GOOD.replace(b"STEP[0]=50.0", b"STEP[0]=0"), "a step of 0"),
    "ends exchanged": (GOOD.replace(b"MAX[0]=0.0", b"MAX[0]=-200.0"), "from -100 to -200"),
    "no input axis": (GOOD.replace(b"$AN_CEC_INPUT_AXIS[0]=(AX2)\n", b""), "has no $AN_CEC_INPUT_AXIS[0]"),
    "an axis of another machine": (GOOD.replace(b"(AX2)", b"(AX7)"), "which axis of the machine AX7 is"),
    "a word for a direction": (GOOD.replace(b"DIRECTION[0]=0", b"DIRECTION[0]=TRUE"), "'TRUE' is not a number"),
    "no name of an axis": (GOOD.replace(b"(AX2)", b"(A+)"), "not the name of an axis"),
    "a decimal comma": (GOOD.replace(b"0.003", b"0,003"), "a decimal comma"),
    "a word": (GOOD.replace(b"0.003", b"three"), "not a number"),
    "a direction of 2": (GOOD.replace(b"DIRECTION[0]=0", b"DIRECTION[0]=2"), "DIRECTION is 2, not one of 0, 1, -1"),
    "half a direction": (GOOD.replace(b"DIRECTION[0]=0", b"DIRECTION[0]=0.5"), "not one of 0, 1, -1"),
    "IS_MODULO is 5": (GOOD.replace(b"MODULO[0]=0", b"MODULO[0]=5"), "IS_MODULO is 5"),
    "times a table that is not there": (PAIR.replace(b"TABLE[0]=2", b"TABLE[0]=3"), "table 3, which does not exist"),
    "factors of two axes": (PAIR.replace(b"OUTPUT_AXIS[1]=(AX1)", b"OUTPUT_AXIS[1]=(AX2)"), "is for AX1, the table"),
    "a multiplier with a direction": (
        PAIR.replace(b"TION[1]=0", b"TION[1]=1"),
        "acts in one direction only",
    ),
    "an unknown variable": (GOOD.replace(b"AN_CEC_STEP", b"AN_CEC_STOP"), "not a variable of these tables"),
    "an index too many": (GOOD.replace(b"STEP[0]", b"STEP[0,1]"), "takes 1 whole number in its brackets"),
    "no index": (GOOD.replace(b"[0,1]", b"[0]"), "takes 2 whole numbers in its brackets"),
    "a line that is none": (GOOD.replace(b"CHANDATA(1)", b"CHANNEL 1"), "is not understood"),
    "no assignment": (GOOD.replace(b"$AN_CEC[0,1]=0.003", b"$AN_CEC[0,1] 0.003"), "is not an assignment"),
    "inches": (GOOD.replace(b"CHANDATA", b"INCH\nCHANDATA"), "INCH"),
    "cut off": (GOOD.removesuffix(b"M17\n"), "does not end with M17"),
    "more after the end": (GOOD + ONE, "stands after the end"),
    "not ASCII": (GOOD.replace(b"0.003", b"0.003\xa0"), "not ASCII"),
    "no sign": (GOOD.replace(b"value_sign=error ", b""), "errors or corrections (value_sign)"),
    "what products add unsaid": (PAIR.replace(b"product_terms=only ", b""), "what a product adds (product_terms)"),
    "too many tables": (PAIR.replace(b"most_tables=40", b"most_tables=1"), "2 tables, but the control has 1"),
    "too many points": (GOOD.replace(b"most_points=1000", b"most_points=2"), "3 points, but the control has 2"),
    "EEC: one value too many": (EEC.replace(b"MAX[0,AX1]=0.0", b"MAX[0,AX1]=-100.0"), "AX1 has values 0 to 1 by its"),
    "EEC: a value gone": (EEC.replace(b"$AA_ENC_COMP[0,0,AX1]=0.003\n", b""), "1 of 3 values of AX1 are missing"),
    "EEC: no step, of an odd axis": (
        EEC.replace(b"$AA_ENC_COMP_STEP[0,AX1]=100.0\n", b"").replace(b"AX1]", b"A{1]"),
        "has no $AA_ENC_COMP_STEP[0,A{1]",
    ),
    "EEC: no step": (EEC.replace(b"$AA_ENC_COMP_STEP[0,AX1]=100.0\n", b""), "has no $AA_ENC_COMP_STEP"),
    "EEC: a step that does not fit": (EEC.replace(b"=100.0", b"=130.0"), "not a whole number"),
    "EEC: a decimal comma": (EEC.replace(b"0.012", b"0,012"), "a decimal comma"),
    "EEC: no axis": (EEC.replace(b"[0,1,AX1]", b"[0,1]"), "encoder, number and axis"),
}
DOUBTFUL = {
    "not ASCII in a comment": (GOOD.replace(b"; ncfix", "; µm\n; ncfix".encode()), "not ASCII"),
    "a byte order mark": (b"\xef\xbb\xbf" + GOOD, "byte order mark"),
    "an axis of another control unit": (GOOD.replace(b"M17", b"$AN_CEC_INPUT_NCU[0]=1\nM17"), "control units"),
    "no header": (GOOD.replace(b"%_N_NC_CEC_INI\n", b""), "does not name the file"),
    "assigned twice": (GOOD.replace(b"$AN_CEC_INPUT", b"$AN_CEC[0,1]=0.0\n$AN_CEC_INPUT"), "keeps the last"),
    "a turn that is none": (GOOD.replace(b"MODULO[0]=0", b"MODULO[0]=1"), "are no whole turns"),
    "ends that differ": (GOOD.replace(b"MODULO[0]=0", b"MODULO[0]=1"), "ends on another value than it begins"),
    "micrometres": (GOOD.replace(b"0.003", b"3.0"), "which is larger than any machine needs"),
    "check this value for a typing error": (GOOD.replace(b"0.003", b"0.9"), "changes by"),
    "both factors turned": (PAIR.replace(b"=0.2", b"=-0.2"), "the largest value of the multiplier"),
    "a chain of products": (PAIR.replace(b"TABLE[1]=0", b"TABLE[1]=1"), "is itself multiplied by another"),
    "block skip": (GOOD.replace(b"$AN_CEC[0,1]", b"/N20 $AN_CEC[0,1]"), "while block skip is on"),
    "one way only": (GOOD.replace(b"DIRECTION[0]=0", b"DIRECTION[0]=1"), "only while it moves in one direction"),
    "two ends of lines": (GOOD.replace(b"STEP[0]=50.0\n", b"STEP[0]=50.0\r\n"), "end in two ways"),
    "EEC: ends that differ": (EEC.replace(b"MODULO[0,AX1]=0", b"MODULO[0,AX1]=TRUE"), "another value than it begins"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_files_are_named_and_not_run(case: str) -> None:
    content, expected = WRONG[case]
    found = CONTROL.lint({"NC_CEC.INI": content})
    assert any(expected in message.text and message.code == "NCF491" for message in found), found
    with pytest.raises(ConfigError):
        CONTROL.read({"NC_CEC.INI": content})


@pytest.mark.parametrize("case", DOUBTFUL)
def test_doubtful_files_are_named_and_run(case: str) -> None:
    content, expected = DOUBTFUL[case]
    found = CONTROL.lint({"NC_CEC.INI": content})
    assert any(expected in message.text and message.code == "NCF492" for message in found), found
    CONTROL.read({"NC_CEC.INI": content})


def test_an_axis_corrected_in_two_places() -> None:
    own = GOOD.replace(b"INPUT_AXIS[0]=(AX2)", b"INPUT_AXIS[0]=(AX1)")
    found = CONTROL.lint({"AX1_EEC.INI": EEC, "NC_CEC.INI": own})
    assert [message.code for message in found] == ["NCF492"]
    assert "is corrected twice" in found[0].text


def test_tables_of_two_files_are_not_added_up_where_the_control_takes_one() -> None:
    """Of a table that is loaded twice the last counts; of two encoders of an axis the one that is switched on."""
    second = EEC.replace(b"COMP[0", b"COMP[1").replace(b"_STEP[0", b"_STEP[1").replace(b"_MIN[0", b"_MIN[1")
    second = second.replace(b"_MAX[0", b"_MAX[1").replace(b"MODULO[0", b"MODULO[1")
    for files, said in (
        ({"A.INI": GOOD, "B.INI": GOOD}, "table 1 is in more than one file"),
        ({"A.INI": EEC, "B.INI": EEC}, "AX1 has more than one encoder table"),
        ({"A.INI": EEC, "B.INI": second}, "AX1 has more than one encoder table"),
    ):
        assert [(message.code, said in message.text) for message in CONTROL.lint(files)] == [("NCF491", True)]
        with pytest.raises(ConfigError, match=said):
            CONTROL.read(files)
    unused = re.sub(rb"(\[1,\d,AX1\])=.*", rb"\1=0", second)
    assert at({"A.INI": EEC, "B.INI": unused}, X=-100)[0] == pytest.approx(-0.010)


@pytest.mark.parametrize(
    "content",
    [GOOD, PAIR, EEC, GOOD.replace(b"\n", b"\r\n"), EEC.replace(b"MODULO[0,AX1]=0", b"MODULO[0,AX1]=FALSE")],
    ids=["sum", "pair", "EEC", "CR LF", "a word for no"],
)
def test_good_files_are_not_remarked_on(content: bytes) -> None:
    assert not CONTROL.lint({"a.INI": content})


@settings(derandomize=True, max_examples=some(200), deadline=None)
@given(st.text())
def test_any_text_is_written_again_as_it_was_read(text: str) -> None:
    assert written(parsed(text)) == text


SLIPS = [b"", b"0", b"1e999", b"-", b"1e-300", b"$", b"[", b"]", b"=", b"\n", b";", b",", b"AX3", b"7"]


@settings(derandomize=True, max_examples=some(300), deadline=None)
@given(st.sampled_from([GOOD, PAIR, EEC]), st.data())
def test_damaged_files_are_refused_or_run_but_nothing_breaks(content: bytes, data: st.DataObject) -> None:
    start = data.draw(st.integers(0, len(content)))
    stop = data.draw(st.integers(start, min(start + 12, len(content))))
    damaged = content[:start] + data.draw(st.sampled_from(SLIPS) | st.binary(max_size=4)) + content[stop:]
    found = CONTROL.lint({"a.INI": damaged})
    if any(message.code == "NCF491" for message in found):
        with pytest.raises(ConfigError):
            CONTROL.read({"a.INI": damaged})
    else:
        assert np.isfinite(at({"a.INI": damaged}, X=-50, Y=-50, Z=50)).all()


def test_files_may_look_otherwise() -> None:
    """Axes may be bare or in brackets; METRIC, comments and numbers do no harm; the order of lines is free."""
    lines = b"".join(ONE.splitlines(keepends=True)[::-1])
    lines = lines.replace(b"(AX2)", b"AX2 ; base").replace(b"$AN_CEC_STEP", b"N10 $an_cec_step")
    mixed = HEAD + b"METRIC\n; anything\n\n" + lines
    mixed = mixed.replace(b"_CEC_INI", b"_CEC_SPF") + b"M0\n\nN99 M17 ; end\n"
    assert not CONTROL.lint({"a.INI": mixed})
    assert at({"a.INI": mixed}, Y=-75)[0] == pytest.approx(-0.002)


def test_an_encoder_file_alone_is_read() -> None:
    remarks = Remarks("")
    (table,) = read_eec(parsed(EEC.decode()), remarks)
    assert (table.output, table.low, table.step, table.high) == ("AX1", -200.0, 100.0, 0.0)
    assert not remarks.messages
