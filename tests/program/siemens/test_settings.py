"""What is in force on a SINUMERIK besides frames: additive offsets, setting data, synchronized actions, punching."""

from __future__ import annotations

from pathlib import Path

import pytest

from ncfix.compensate.following import traced
from ncfix.control.setup import Setup
from ncfix.control.trace import Trace
from ncfix.diagnostics import SourceError
from ncfix.machine import load
from ncfix.text.reader import read
from program.siemens.following import follow
from program.tracing import ends, reasons

CRADLE = Path(__file__).parents[3] / "examples" / "machines" / "wCAYFXZSt.toml"


def on_the_cradle(body: str) -> Trace:
    """A program behind its first position on a machine with a rotary table, all that it lacks taken as zero."""
    source = f"G54 G0 X10 Y0 Z100 A0 C0\n{body}\nM30\n".encode()
    return traced(read(source, "part.mpf", "siemens"), load(CRADLE), Setup(assume_zero=True))


@pytest.mark.parametrize("block", ["D1 DL=1", "DL=2", "DL=R1"])
def test_an_additive_offset_is_not_in_the_setup(block: str) -> None:
    found = reasons(follow(f"T1 D1 M6\nG0 X1 Y1 Z1\n{block}\nX2\nDL=0\nX3 Y3 Z3\nD1 DL=1\nX4\nD1\nX5 Y5 Z5"))
    assert ["DL" in reason for reason in found] == [False, True, False, True, False]


def test_the_axes_are_not_known_behind_an_additive_offset() -> None:
    found = reasons(follow("T1 D1 M6\nG0 X1 Y1 Z1\nDL=1\nX2\nDL=0\nG1 X3 F100"))
    assert "additive" in found[-1]


@pytest.mark.parametrize(
    "setting",
    [
        "$SC_TOOL_LENGTH_TYPE=1",
        "$SC_MIRROR_TOOL_LENGTH=TRUE",
        "$SC_WEAR_SIGN=1",
        "$SN_CEC_TABLE_ENABLE[0]=1",
        "$NT_TRAFO_INDEX[1]=2",
        "$NK_OFF_DIR[3,0]=0.01",
    ],
)
def test_setting_data_that_lengths_and_errors_depend_on(setting: str) -> None:
    assert setting.split("=")[0].split("[")[0] in reasons(follow(f"G0 X1\n{setting}\nX2"))[-1]


def test_an_axis_has_no_index() -> None:
    assert reasons(follow("G0 X1\nX[1]=5\nX2")) == ["", "X[..] is not supported"]


def test_only_rotary_axes_have_a_sense() -> None:
    with pytest.raises(SourceError, match="DC is for rotary axes"):
        follow("G0 X=DC(5)")


@pytest.mark.parametrize("call", ['EXTCALL("PART.MPF")', 'CALL "PART"', "EXTCALL(NAME)"])
def test_a_program_that_is_not_at_hand_is_said(call: str) -> None:
    assert [message.code for message in follow(f"G71 G0 X1\n{call}").messages] == ["NCF252"]


@pytest.mark.parametrize("name", ["$P_ISTEST", "$P_SIM", "$P_SEARCH", "$P_DRYRUN"])
def test_a_program_is_followed_as_it_cuts(name: str) -> None:
    text = f"IF {name} GOTOF A1\nG0 X1\nA1: G0 X2"
    assert [row[0] for row in ends(follow(text))] == [1, 2]
    assert [row[0] for row in ends(follow(text, variables={name: 1.0}))] == [2]


@pytest.mark.parametrize(
    ("body", "whole"),
    [
        ("G1 X20 F2000\nWHEN $AA_IW[X]>25 DO M8\nX30\nX40", [False, True, False]),
        ("ID=1 WHEN $AA_IW[X]>25 DO M8\nG1 X20 F2000\nX30", [False, False]),
        ("IDS=1 WHENEVER $AC_DTEB<5 DO $AC_OVR=10\nG1 X20 F2000\nX30", [True, True]),
        ("G1 X20 F2000 L6\nX30 Y0 Z100 A0 C0", [True, False]),
        ("SON\nG1 X20 F2000\nX30\nSPOF\nX40", [True, True, False]),
    ],
)
def test_what_acts_by_blocks_needs_them_whole(body: str, whole: list[bool]) -> None:
    """A further block would begin the action, the call or the stroke anew, or end what acts in one block only."""
    assert on_the_cradle(body).moves.whole.tolist()[1:] == whole


@pytest.mark.parametrize(
    "coupling", ["COUPON(C,A)", "COUPONC(C,S1)", "COUPON(AXNAME(NAME),S1)", "CPON=C", "CPON=(A,C)", "CPLON[C]=A"]
)
def test_an_axis_that_follows_another(coupling: str) -> None:
    found = reasons(on_the_cradle(f"G1 X1 F100\n{coupling}\nX2"))
    assert not found[1]
    assert "follows another" in found[2]


@pytest.mark.parametrize("coupling", ["COUPON(S2,S1)", "COUPON(SPI(2),SPI(1),45)", "COUPON", "CPON=S2", "CPLON[S2]=S1"])
def test_a_spindle_that_follows_another(coupling: str) -> None:
    assert not any(reasons(on_the_cradle(f"G1 X1 F100\n{coupling}\nX2")))


def test_a_coupling_ends() -> None:
    found = reasons(on_the_cradle("COUPON(C,A)\nG1 X1 F100\nCOUPOF(C,A)\nG0 X2 Y2 Z2 A0 C0"))
    assert [bool(each) for each in found] == [False, True, False]


@pytest.mark.parametrize("block", ["G751 X1=0", "G751 FP=2 X10 Y5", "G75 FP=2 X1=0"])
def test_a_fixed_point_is_where_the_control_says(block: str) -> None:
    found = reasons(on_the_cradle(f"{block}\nG0 X2 Y2 Z2 A0 C0"))
    assert "fixed point" in found[1]
    assert not found[2]
