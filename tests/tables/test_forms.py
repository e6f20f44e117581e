"""Every sample of a table file is read, and written again to the byte where it is well formed."""

from __future__ import annotations

from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ncfix.tables.forms import BY_NAME, FileForm, lint_files, read_form, recognised

SAMPLES = {
    "beckhoff_isg/crosscomp.lis": ("isg-list", 7),
    "beckhoff_isg/etalon_exchange.txt": ("etalon", 12),
    "beckhoff_isg/ssfk.lis": ("isg-list", 8),
    "beckhoff_isg/volc_isg_csv_1d.csv": ("isg-csv", 7),
    "beckhoff_isg/volc_isg_csv_grid.csv": ("isg-csv", 5),
    "beckhoff_isg/volcomp_config.lis": ("isg-list", 5),
    "fanuc/g10_param_input.txt": ("g10", 11),
    "heidenhain/TNC306_example.txt": ("tnc306", 8),
    "linuxcnc/doc_type0_example.comp": ("comp", 9),
    "linuxcnc/doc_type1_example.comp": ("comp", 9),
    "linuxcnc/ini_snippet.ini": ("ini", 1),
    "linuxcnc/screwcompX.dat": ("comp", 33),
    "other/centroid_cnc1.tab.example": ("centroid", 5),
    "other/elmo_maestro_2d.txt": ("elmo", 33),
    "other/hexagon_COMP.ERR": ("hexagon", 2),
    "other/pmac_define_comp.txt": ("pmac", 0),
    "other/weihong_axeserr.dat": ("weihong", 6),
    "renishaw/rtl_skeleton.rtl": ("rtl", 23),
}
ELSEWHERE = {
    "README.md": "says what is there",
    "fanuc/param_record_15i.txt": "tests/plugins/test_fanuc_pitch.py",
    "fanuc/pitch_example_B63980EN_p100.csv": "tests/plugins/test_fanuc_pitch.py",
    "heidenhain/AXIS-X_iTNC530.COM": "tests/plugins/test_heidenhain_tables.py",
    "heidenhain/AXIS_X_TNC640.COM": "tests/plugins/test_heidenhain_tables.py",
    "heidenhain/config.cma": "tests/plugins/test_heidenhain_tables.py",
    "heidenhain/kinematics_COMPTAB_iTNC530.txt": "tests/plugins/test_heidenhain_kinematics.py",
    "siemens/cec_802Dsl_manual_example.ini": "tests/plugins/test_siemens*.py",
    "siemens/cec_fig73_seed001.ini": "tests/plugins/test_siemens*.py",
    "siemens/cec_mult_probe_RECONSTRUCTED.ini": "tests/plugins/test_siemens*.py",
    "siemens/eec_manual_example.ini": "tests/plugins/test_siemens*.py",
}
ELMO = b"""[header]
Table size\t4
Error table dimension\t2
Target axis\ta01
Reference axes\ta02\ta03
Start position\t0\t0
Axis grid size\t16\t16
Table dimensions\t2\t2
[header/]
[table]
Table #1 Start Data
1\t2
3\t4
Table #1 End Data
[table/]
"""
BROKEN = {
    "comp": (b"0 0 0\n1 0,1 0\n", "a decimal comma"),
    "tnc306": (b"DATUM POINT 0\nY = F(Z)\n0 Z0 Y0\n", "should begin with the line of rule"),
    "g10": (b"G10L50\nN1 R1\n", "end with that of end"),
    "isg-csv": (b"X EXX\n0 0 0\n", "3 numbers under 2 names"),
    "elmo": (ELMO.replace(b"3\t4\n", b""), "1 rows, but Table dimensions states 2 of 2"),
    "weihong": (b"unit = mm\n[X]\n0, 0\n", "is not a line of"),
    "weihong ": (b"unit = mm\n[X]\n1, 0, 0\n1, 0, 0\n", "must ascend"),
    "hexagon": (b"STARTW\n10=10.1\n", "end with that of end"),
    "centroid": (b"24 0 0 0\n", "is not a line of"),
    "rtl": (b"Target-count: 2\nRun-count: 1\nDEVIATIONS::\nRun Target Data:\n1 1 0.0\n", "1 deviations, 2 expected"),
    "etalon": (b"[EXY]\nGridpoints = {\n0 one\n}\n", "is not a line of"),
    "pmac": (b"DEFINE COMP ten, #1\n", "is not a line of"),
    "pmac ": (b"DEFINE COMP 3, #1, #1, 6000\n16 8\n", "2 entries follow, but the line states 3"),
    "pmac  ": (b"#2DEFINE COMP 2, 6000\n16\n8.5\n", "whole numbers"),
    "pmac   ": (b"#2DEFINE COMP 2, 6000\n16\n8\n", "the last entry is 8"),
    "isg-list": (b"X\n", "is not a line of"),
    "ini": (b"[A]\nb c\n", "is not a line of"),
}


@pytest.mark.parametrize("name", SAMPLES)
def test_samples_are_read_and_written_again_identically(shared: Callable[[str], Path], name: str) -> None:
    content = (shared("tables") / name).read_bytes()
    document = recognised(name, content)
    assert document is not None
    assert (document.form, sum(len(line.numbers) for line in document.lines)) == SAMPLES[name]
    assert document.content() == content
    assert read_form(BY_NAME[document.form], name, content.replace(b"\n", b"\r\n"))[0].content().count(b"\r\n") > 0


def test_no_sample_is_forgotten(shared: Callable[[str], Path]) -> None:
    folder = shared("tables")
    found = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert found == set(SAMPLES) | set(ELSEWHERE)


def test_numbers_can_be_changed_and_the_rest_stays() -> None:
    document = recognised("x", b"unit = mm\n[X]\n0.000, 0.000, 0.002\n10.000, 0.003, 0.005\n")
    assert document is not None
    assert document.rows("row") == [(0.0, 0.0, 0.002), (10.0, 0.003, 0.005)]
    changed = document.with_numbers(3, Decimal("10.000"), Decimal("-0.001"), Decimal("0.000"))
    assert changed.content() == b"unit = mm\n[X]\n0.000, 0.000, 0.002\n10.000, -0.001, 0.000\n"


@pytest.mark.parametrize("row", ["5., .5, 1.", "05, +0.50, 01"])
def test_numbers_that_are_written_in_another_way_count_and_stay(row: str) -> None:
    content = f"unit = mm\n[X]\n{row}\n10, 1, 2\n".encode()
    document = recognised("x", content)
    assert document is not None
    assert document.sections("axis") == {"X": [(5.0, 0.5, 1.0), (10.0, 1.0, 2.0)]}
    assert document.content() == content
    assert b"\n5.5, " in document.with_numbers(2, *map(Decimal, ("5.5", "1", "2"))).content()


def test_a_form_of_a_plugin() -> None:
    form = FileForm("own", "Own's table", {"axis": r"#AXIS\[[XYZ]\]", "row": r"(\d+) (\d+)"})
    document, remarks = read_form(form, "x", b"#AXIS[Y]\n1 2\n1;2\n")
    assert document.sections("axis") == {"Y": [(1.0, 2.0)]}
    assert [(each.text, each.hint) for each in remarks.wrong] == [
        ("is not a line of Own's table", "possible lines: axis, row")
    ]


def test_a_sound_elmo_table() -> None:
    assert not read_form(BY_NAME["elmo"], "x", ELMO)[1].messages


@pytest.mark.parametrize("form", BROKEN)
def test_broken_files(form: str) -> None:
    content, expected = BROKEN[form]
    _, remarks = read_form(BY_NAME[form.strip()], "x", content)
    assert any(expected in message.text for message in remarks.messages), remarks.messages


@pytest.mark.parametrize("form", [form for form in BROKEN if BY_NAME[form.strip()].tells and form != "pmac"])
def test_a_damaged_file_that_one_line_tells_is_of_its_form(form: str) -> None:
    """What is wrong is named with its line, not that nobody knows the file."""
    content, expected = BROKEN[form]
    found = lint_files({"x": content})["x"]
    assert found.owner == form.strip()
    assert any(expected in message.text for message in found.messages), found.messages
    assert {message.hint for message in found.messages} <= {"", "see docs/controllers.md"}


@pytest.mark.parametrize(
    ("form", "content", "texts"),
    [
        ("weihong", b"; \xb5\xa5\xce\xbb\nunit = mm\n[x]\n0, 0, 0\n5, 0.001, 0\n", ["a character that is not ASCII"]),
        ("rtl", b"HEADER::\nMachine: \xbb\xfa\nTarget-count: 1\nRun-count: 1\nRun Target Data:\n1 1 0.0\n", []),
        ("pmac", b"I51=0\n#1 DEL COMP\n#1 DEFINE COMP 4,2000 ; X\n160 80\n120 0\nI51=1\n", []),
        ("pmac", b"DEFINE COMP 2, #1D, #3, 2000\n160 0\nDEFINE COMP 1.2, #1, #2, 20, 20\n1 2 3 4 5\n", []),
    ],
)
def test_files_as_they_are_found(form: str, content: bytes, texts: list[str]) -> None:
    found = lint_files({"x": content})["x"]
    assert (found.owner, [message.text for message in found.messages]) == (form, texts)


@given(st.lists(st.decimals(-10, 10, places=4), min_size=3, max_size=3), st.sampled_from(["\n", "\r\n"]))
def test_any_numbers_come_back_as_they_were(numbers: list[Decimal], eol: str) -> None:
    rows = [f"{place}, {numbers[1]}, {numbers[2]}" for place in (numbers[0], numbers[0] + 1)]
    content = eol.join(["unit = mm", "[X]", *rows, ""]).encode()
    document, remarks = read_form(BY_NAME["weihong"], "x", content)
    assert not remarks.wrong
    assert document.content() == content


VARIED = {
    "tnc306": b"Y = F(Z)  \n\nDATUM POINT  -990\nSETUP        14\n  0  Z-990      Y+0\n1  Z-973.616  Y-0.06 \n",
    "g10 ": b"%\nO0001 (SCREW)\nG90 G10 L50\nN3620 P1 R50\nG11\nM30\n%\n",
    "g10": b"; page 3\n(axis 1)\ng10 l52;\nn8312 p2 r0;\nG11;\n",
    "isg-csv": b"X  EXX EYX // mm\n 0.0\t0.02 0.01 // first\n# next\nY EYY\n0 1e-3\n",
    "isg-list": b"  # head\nkw.ssfk.unit\t1   # 0.1 um\n\n",
    "etalon": b"[EXY]\nGridpoints = {\n\t-280.0\t-0.0013 // edge\n}\n\n[C0B]\nVALUE=0.1 \n",
    "elmo": ELMO.replace(b"3\t4\n", b" 3 4 \n\n"),
    "pmac": b"; by the maker\ndefine comp 3, #1D,#1 ,20000 ; X\n 10 -12\n\n-3\n",
    "weihong": b"unit=mm\n; by laser\n[X] \n0.0,0,0.002\n\n 10.0 , 0.003 , 0.005\n",
    "hexagon": b"STARTX\n10.0 = 10.002\n\nEND\n",
    "centroid": b"24 -1448819  0 -32\t-38\n\n",
    "rtl": b"TARGET DATA::\nTarget-count:2\nTargets:\n0.000\t50.000 \n",
    "isg-list ": b"/* made by hand */\nkw.ssfk.unit  1  /* 0: increments, 1: metric */ \nkopf.log_achs_name  X_AXIS\n",
    "comp": b"\xef\xbb\xbf0 0 0\n1 0.1 0.2\n",
    "ini": b"  # note\n[JOINT_0]\nCOMP_FILE=x.dat\nCOMMENT =\n",
}


@pytest.mark.parametrize("form", VARIED)
def test_what_a_form_allows_is_kept(form: str) -> None:
    content = VARIED[form]
    document, remarks = read_form(BY_NAME[form.strip()], "x", content)
    assert not remarks.wrong, remarks.wrong
    assert document.content() == content


@pytest.mark.parametrize("content", [b"\n0 0 0\n1 0.1 0.2\n", b"; a note\n\n", b"// a note\n", b"Run-count: 3\n0 1\n"])
def test_what_no_form_has_is_no_file_of_one(content: bytes) -> None:
    """LinuxCNC would not read past the blank line; numbers and notes alone are nobody's file."""
    assert recognised("x", content) is None
