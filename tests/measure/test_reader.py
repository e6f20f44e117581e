"""Measurement files: what is written reads back, and every fault is named with its line and column."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from measure.poses import machine, plan
from ncfix.diagnostics import ConfigError
from ncfix.machine import Axis, Effect, Machine, State
from ncfix.measure.calibrate import calibrate
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import dumps
from ncfix.measure.reader import read, reads

HEAD = "# ncfix-measurement: 1\n# kind: tcp\n# noise_um: 1.5\n"
GOOD = HEAD + "set,X,Y,Z,dir_X,time_s,tool_length,dx,dy,dz\n1,100.0,50.0,-20.0,1,0.0,160.0,0.0012,-0.0003,0.0041\n"
GAUGE = "# ncfix-measurement: 1\n# kind: length\nax,ay,az,bx,by,bz,length\n"
PROBE = "# ncfix-measurement: 1\n# kind: probe\n# distance: 1 2 304.7 0.001\n"
THREE = machine("three_axis")
FIVE = machine("wCBXFZYSt")


def faults(text: str, known=THREE) -> list[tuple[str, int, int]]:
    with pytest.raises(ConfigError) as caught:
        reads(text.encode(), known, "m.csv")
    return [(m.code, m.place.line if m.place else 0, m.place.column if m.place else 0) for m in caught.value.messages]


def test_a_row_is_what_it_says():
    found = reads(GOOD.encode(), THREE)
    assert found.positions(THREE).tolist() == [[100.0, 50.0, -20.0]]
    assert found.noise == (pytest.approx(1.5e-3), None)
    assert found.measured == ("dx", "dy", "dz")
    assert found.place(0).line == 5
    assert not found.remarks


def test_degrees_become_radians():
    found = reads((HEAD + "B,dx\n90,0.001\n").encode(), FIVE)
    assert found.positions(FIVE)[0, FIVE.axis_names.index("B")] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("kind", ["tcp", "tcp6", "probe", "gauge", "bar", "tool", "axis"])
def test_what_is_written_reads_back(kind):
    data = simulate(plan(FIVE, kind, 30), FIVE, Faults(noise_um=1.0), seed=1)
    again = reads(dumps(data).encode(), FIVE)
    assert again.labels == data.labels
    for name, values in data.columns.items():
        assert np.abs(again.columns[name] - values).max() <= 0.5e-9, name


def test_a_plan_has_empty_columns():
    poses = plan(THREE, "tcp", 10)
    text = dumps(poses, ("dx", "dy", "dz"))
    found = reads(text.encode(), THREE, plan=True)
    assert found.measured == ("dx", "dy", "dz")
    assert all(np.isnan(found.columns[name]).all() for name in found.measured)
    assert [code for code, *_ in faults(text)] == ["NCF607"] * 3, "one for each column, not for each cell"


def test_a_plan_says_which_columns_it_wants():
    wanted = reads(dumps(plan(THREE, "tcp", 10), ("dz",)).encode(), THREE, plan=True)
    filled = simulate(wanted, THREE, Faults(noise_um=1.0), seed=1)
    assert filled.measured == ("dz",)
    assert np.isfinite(filled.columns["dz"]).all()
    silent = reads(dumps(plan(THREE, "tcp", 10)).encode(), THREE, plan=True)
    assert simulate(silent, THREE).measured == ("dx", "dy", "dz")


BAD = {
    "no version": (GOOD.replace("# ncfix-measurement: 1\n", ""), ("NCF600", 1, 0)),
    "newer version": (GOOD.replace("measurement: 1", "measurement: 7"), ("NCF600", 1, 22)),
    "unknown kind": (GOOD.replace("kind: tcp", "kind: tpc"), ("NCF601", 2, 9)),
    "unknown header": (GOOD.replace("# noise_um", "# noise_nm"), ("NCF602", 3, 3)),
    "negative noise": (GOOD.replace("1.5", "-1.5"), ("NCF603", 3, 13)),
    "bad frame": (GOOD.replace("# noise_um: 1.5", "# frame: machine"), ("NCF603", 3, 10)),
    "unknown column": (GOOD.replace(",dz", ",ddz"), ("NCF604", 4, 42)),
    "column twice": (GOOD.replace("dy,dz", "dy,dy"), ("NCF604", 4, 42)),
    "no values": (HEAD + "X,Y\n1,2\n", ("NCF605", 4, 0)),
    "short row": (GOOD.replace(",0.0041", ""), ("NCF606", 5, 0)),
    "decimal comma": (GOOD.replace("100.0", "100,0"), ("NCF606", 5, 0)),
    "empty cell": (GOOD.replace("-0.0003", ""), ("NCF607", 5, 39)),
    "not a number": (GOOD.replace("-0.0003", "-O.0003"), ("NCF608", 5, 39)),
    "nan": (GOOD.replace("-0.0003", "nan"), ("NCF608", 5, 39)),
    "infinite": (GOOD.replace("-0.0003", "inf"), ("NCF608", 5, 39)),
    "no rows": (GOOD[: GOOD.index("1,100.0")], ("NCF609", 4, 0)),
    "foreign axis": (GOOD.replace("Z,dir", "W,dir"), ("NCF610", 4, 9)),
    "foreign direction": (GOOD.replace("dir_X", "dir_C"), ("NCF610", 4, 11)),
    "half a direction": (GOOD.replace("-20.0,1,", "-20.0,0.5,"), ("NCF612", 5, 0)),
    "time backwards": (GOOD + "1,101.0,50.0,-20.0,1,-3.0,160.0,0.0,0.0,0.0\n", ("NCF611", 6, 0)),
    "points and commas": (HEAD + "X;Y;dx\n1,5;2;0,001\n1.5;2;0,001\n", ("NCF608", 6, 1)),
    "thousands": (HEAD + "X;Y;dx\n1.000,5;2;0,001\n", ("NCF608", 5, 1)),
    "other marks": (HEAD + "X|Y|dx\n1,5|2|0,001\n", ("NCF604", 4, 1)),
    "a comma too many": (HEAD + "X,Y,dx,\n1,2,0.001,\n", ("NCF604", 4, 8)),
    "two kinds": (GOOD.replace("# noise_um: 1.5", "# kind: tcp6"), ("NCF602", 3, 3)),
    "no such number": (GOOD.replace("100.0", "1e200"), ("NCF608", 5, 3)),
    "empty file": ("", ("NCF600", 0, 0)),
    "late header": (GOOD + "# noise_um: 3\n", ("NCF602", 6, 1)),
    "negative length": (GAUGE + "0,0,0,100,0,0,-100\n", ("NCF612", 4, 0)),
    "no length": (GAUGE + "0,0,0,100,0,0,0\n", ("NCF612", 4, 0)),
    "no way": (GAUGE + "50,0,0,50,0,0,1\n", ("NCF612", 4, 0)),
    "no radius": (GAUGE.replace("ax,ay,az,bx,by,bz", "cx,cy,cz,radius") + "0,0,0,0,100\n", ("NCF612", 4, 0)),
    "axis beside its ends": (GAUGE.replace("ax,", "X,ax,") + "5,0,0,0,100,0,0,100\n", ("NCF604", 3, 1)),
    "axis beside its reading": (PROBE + "ball,mx,my,mz,Y\n1,0,0,0,0\n", ("NCF604", 4, 15)),
    "negative distance": (PROBE.replace("304.7", "-304.7") + "ball,mx,my,mz\n1,0,0,0\n", ("NCF603", 3, 13)),
}


@pytest.mark.parametrize("name", BAD)
def test_a_fault_is_named_with_its_place(name):
    text, expected = BAD[name]
    assert expected in faults(text)


SAID = {
    "units in names": (HEAD + "X [mm];Y/mm;dx (\u00b5m)\n1,5;2;0,001\n", "name it dx, without a unit"),
    "a line of units": (HEAD + "X,Y,dx\nmm,mm,um\n1,2,0.001\n", "remove the line with units"),
    "units in cells": (HEAD + "X,Y,dx\n1 mm,2,0.001\n", "write the number without a unit"),
    "a number in groups": (HEAD + "X;Y;dx\n1.000,5;2;0,001\n", "without thousands separators"),
    "groups by blanks": (HEAD + "X;Y;dx\n1\u00a0000,5;2;0,001\n", "without thousands separators"),
    "names once more": (HEAD + "X,Y,dx\n1,2,0.001\nX,Y,dx\n2,2,0.001\n", "the columns are named once"),
    "a minus of a typesetter": (HEAD + "X,Y,dx\n1,\u22122,0.001\n", "write a minus sign as -"),
    "a dash for no reading": (HEAD + "X,Y,dx\n1,2,-\n", "leave out the row"),
    "no number for no reading": (HEAD + "X,Y,dx\n1,2,NaN\n", "leave out the row"),
    "noise with a comma": (GOOD.replace("1.5", "1,5"), "a decimal point, not a comma"),
}


@pytest.mark.parametrize("name", SAID)
def test_what_instruments_write_is_refused_with_what_helps(name):
    text, said = SAID[name]
    with pytest.raises(ConfigError) as caught:
        reads(text.encode(), THREE)
    assert said in " ".join(message.hint for message in caught.value.messages)


def test_the_line_is_shown_with_what_cannot_be_in_it():
    with pytest.raises(ConfigError) as caught:
        reads(GOOD.replace("-20.0,1,", "-20.0,0.5,").encode(), THREE, "m.csv")
    place = caught.value.messages[0].place
    assert place is not None
    assert place.text.startswith("1,100.0,50.0,-20.0,0.5,")


@pytest.mark.parametrize("end", ["\n", "", "-1", "-3"])
def test_a_number_that_lacks_digits_at_the_end_of_the_file_is_remarked_on(end):
    text = GOOD.rstrip("\n") + "\n" + GOOD.splitlines()[-1]
    text = text + end if end in ("\n", "") else text[: int(end)]
    found = [message for message in reads(text.encode(), THREE).remarks if message.code == "NCF619"]
    assert [message.place.line for message in found if message.place] == ([] if end in ("\n", "") else [6])


@pytest.mark.parametrize("mark", [";", "\t", "   "])
@pytest.mark.parametrize("decimal", [",", "."])
@pytest.mark.parametrize("coding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be", "utf-16-le", "latin-1"])
def test_what_spreadsheets_of_other_countries_write(mark, decimal, coding):
    head, rows = GOOD[: GOOD.index("set,")], GOOD[GOOD.index("set,") :]
    text = head.replace("\n", 3 * mark + "\r\n") + rows.replace(",", mark).replace(".", decimal).replace("\n", "\r\n")
    source = ("\ufeff" if coding == "utf-16-be" and mark == ";" else "") + text
    plain, other = reads(GOOD.encode(), THREE), reads(source.encode(coding), THREE)
    assert plain.headers == other.headers
    assert {key: list(column) for key, column in plain.columns.items()} == {
        key: list(column) for key, column in other.columns.items()
    }


@pytest.mark.parametrize("head", ["{}\r\n", '"{}"\r\n', '"{}",,,\r\n'])
def test_a_spreadsheet_s_quotes_and_mark_mean_nothing(head: str):
    quoted = "".join(
        head.format(line) if line.startswith("#") else ",".join(f'"{cell}"' for cell in line.split(",")) + "\r\n"
        for line in GOOD.splitlines()
    )
    plain, other = reads(GOOD.encode(), THREE), reads(quoted.encode("utf-8-sig"), THREE)
    assert plain.headers == other.headers
    assert {key: list(column) for key, column in plain.columns.items()} == {
        key: list(column) for key, column in other.columns.items()
    }


def test_all_faults_are_named_at_once():
    text = GOOD.replace("0.0012", "x") + "1,,50.0,-20.0,1,1.0,160.0,0.0,0.0,nan\n"
    assert [code for code, *_ in faults(text)] == ["NCF608", "NCF607", "NCF608"]


@pytest.mark.parametrize(
    ("source", "said"),
    [
        (b"PK\x03\x04\0\0", "spreadsheet(.|\n)*CSV"),
        (b"%PDF-1.7\n", "PDF"),
        (b'\xef\xbb\xbf<?xml version="1.0"?>\n<test/>\n', "XML"),
        ("\ufeff{}".encode("utf-16"), "there is no line `# ncfix"),
        (b"\x1f\x8b\x08\0\0\0", "unpack"),
        (b"\0\1\2\0", "not a text file"),
    ],
)
def test_what_holds_no_cells_is_refused_by_what_it_is(source: bytes, said: str):
    with pytest.raises(ConfigError, match=said) as caught:
        reads(source, THREE)
    assert caught.value.messages[0].code == "NCF600"


@pytest.mark.parametrize(
    ("names", "kind"),
    [
        ("X,Y,dx,dy", "kind: tcp`"),
        ("X;dx;ry", "kind: tcp6`"),
        ("axis component position value", "kind: axis`"),
        ("target,x,y,z,X,Y,Z", "kind: points`"),
        ("Target (mm),Run 1", "kind: ...`"),
    ],
)
def test_a_table_without_its_head_is_told_what_to_put_above_it(names: str, kind: str):
    with pytest.raises(ConfigError) as caught:
        reads(f"{names}\n1,2,3,4\n".encode(), THREE)
    assert kind in caught.value.messages[0].hint


def test_aligned_columns_count_their_cells():
    """An empty cell between blanks is not seen, so that the row has too few: no value slips into the next column."""
    text = HEAD + "    X       Y      dx\n  10.5     2.0   0.001\n 100.25  -3.0  -0.002\n"
    found = reads(text.encode(), THREE)
    assert found.columns["X"].tolist() == [10.5, 100.25]
    assert ("NCF606", 6, 0) in faults(text.replace("-3.0", "    "))
    assert ("NCF608", 6, 16) in faults(text.replace("-0.002", "O.002 "))


def remarks(text: str, known=THREE) -> set[str]:
    return {message.code for message in reads(text.encode(), known).remarks}


def test_odd_but_possible_is_remarked():
    assert remarks(GOOD + GOOD.splitlines()[-1] + "\n") == {"NCF613"}
    assert remarks(GOOD.replace("100.0", "4100.0")) == {"NCF615"}
    assert remarks(GOOD.replace("0.0012", "12.3")) == {"NCF616"}
    radians = HEAD + "B,C,dx\n" + "".join(f"0,{np.deg2rad(30 * k)},0.001\n" for k in range(12))
    assert remarks(radians, FIVE) == {"NCF614"}
    degrees = HEAD + "B,C,dx\n" + "".join(f"0,{k},0.001\n" for k in range(6))
    assert not remarks(degrees, FIVE)


def test_radians_at_no_round_degree_are_told_by_how_far_they_go():
    random = np.random.default_rng(4)

    def rows(low: float, high: float) -> str:
        return HEAD + "C,dx\n" + "".join(f"{each:.4f},0.001\n" for each in random.uniform(low, high, 12))

    assert remarks(rows(-3.1, 3.1), FIVE) == {"NCF614"}
    assert not remarks(rows(-0.9, 0.9), FIVE)
    assert not remarks(rows(-170.0, 170.0), FIVE)


@pytest.mark.parametrize(
    ("size", "code", "said"),
    [(1 / 25.4, "NCF614", "inches"), (1e-3, "NCF614", "metres"), (1e3, "NCF615", "um"), (1.0, "", "")],
)
def test_linear_positions_in_another_unit_are_remarked(size: float, code: str, said: str):
    low, high = THREE.axis("X").range  # type: ignore[union-attr]
    head = "# ncfix-measurement: 1\n# kind: axis\n# sense: body\naxis,component,position,value\n"
    rows = "".join(f"X,EXX,{place * size:.5f},0.001\n" for place in np.linspace(low, 0.9 * high, 6))
    found = reads((head + rows).encode(), THREE).remarks
    assert [message.code for message in found] == ([code] if code else [])
    assert all(said in message.text + message.hint for message in found)


def test_ends_of_lengths_in_inches_are_remarked():
    low, high = THREE.axis("X").range  # type: ignore[union-attr]
    rows = "".join(f"{low / 25.4:.4f},0,0,{place / 25.4:.4f},0,0,{place - low}\n" for place in (0.5 * high, 0.9 * high))
    found = reads((GAUGE + rows).encode(), THREE).remarks
    assert [message.code for message in found] == ["NCF614"]
    assert "inches" in found[0].text


@pytest.mark.parametrize(("size", "code"), [(0.5, "NCF616"), (5e-3, ""), (5e-8, "NCF616")])
def test_positioning_no_machine_has_is_remarked(size: float, code: str):
    """Half a millimetre is more than ten times what is much (30 um); no laser tells less than a tenth of a um."""
    head = "# ncfix-measurement: 1\n# kind: axis\n# sense: body\naxis,component,position,value\n"
    rows = "".join(f"X,EXX,{10 * k},{k % 3 * size}\n" for k in range(1, 9))
    assert remarks(head + rows) == ({code} if code else set())


def test_positioning_of_a_table_says_in_which_sense_it_counts():
    head = "# ncfix-measurement: 1\n# kind: axis\n"
    rows = "axis,component,position,value\nX,EXX,0,0.001\nX,EXX,50,0.004\nX,EYX,50,0.002\nZ,EZZ,50,0.003\n"
    assert remarks(head + rows) == {"NCF626"}
    assert not remarks(head + rows.replace("X,EXX,0,0.001\nX,EXX,50,0.004\n", ""))
    for sense, factor in (("body", 1), ("axis", -1)):
        found = reads(f"{head}# sense: {sense}\n{rows}".encode(), THREE)
        assert not found.remarks
        assert found.columns["value"].tolist() == [factor * 0.001, factor * 0.004, 0.002, 0.003]
        assert reads(dumps(found).encode(), THREE).columns["value"].tolist() == found.columns["value"].tolist()
    assert faults(f"{head}# sense: laser\n{rows}") == [("NCF603", 3, 10)]


def test_positioning_is_along_the_error_axis_whatever_the_letter():
    """Of a quill W that counts outwards, against Z: EZW is turned, and its slope is no alignment of the instrument."""
    out = Axis("W", False, False, (0.0, 0.0, -1.0), range=(0.0, 300.0))
    quill = THREE.replace(topology="w X Y F Z W t", axes=(*THREE.axes, out), effects=())
    rows = "".join(f"W,EZW,{place},{2e-5 * place:.6f}\nW,EXW,{place},0.001\n" for place in range(0, 310, 30))
    head = "# ncfix-measurement: 1\n# kind: axis\n# noise_um: 1\n"
    columns = "axis,component,position,value\n"
    assert {each.code for each in reads(f"{head}{columns}{rows}".encode(), quill).remarks} == {"NCF626"}
    found = reads(f"{head}# sense: axis\n{columns}{rows}".encode(), quill)
    assert found.columns["value"][::2] == pytest.approx(-2e-5 * found.columns["position"][::2])
    assert (found.columns["value"][1::2] == 0.001).all()
    calibrated = calibrate([found], quill, "EZW")
    scale = calibrated.labels.index("EZW u^1")
    assert calibrated.estimate.coefficients[scale] == pytest.approx(-2e-5 * 150)


def test_direct_readings_in_radians_or_micrometres_are_remarked():
    head = "# ncfix-measurement: 1\n# kind: axis\n# sense: body\naxis,component,position,value\n"
    turns = "".join(f"C,ECC,{np.deg2rad(30 * k):.6f},{4 * k}e-6\n" for k in range(12))
    assert remarks(head + turns, FIVE) == {"NCF614"}
    assert remarks(head + turns.replace("e-6", ""), FIVE) == {"NCF614", "NCF616"}
    assert remarks(head + "X,EXX,0,3.1\nX,EXX,50,4.2\nX,EYX,0,0.001\n", FIVE) == {"NCF616"}
    assert remarks(head + "X,EXX,0,0.0031\nX,EXX,5000,0.0042\n", FIVE) == {"NCF615"}


def test_repeats_are_no_surprise():
    text = HEAD + "repeat,X,dx\n1,10,0.001\n2,10,0.001\n"
    assert not remarks(text)


def test_real_measurements_read(shared):
    for path in sorted(shared("measurements").glob("*.csv")):
        found = read(str(path), THREE)
        assert len(found) > 50
        # the plates are wider than this machine
        assert {m.code for m in found.remarks} <= {"NCF613", "NCF615"}, path.name


RTL = """HEADER::
File type: x
DEVIATIONS here later
TARGET DATA::
Target-count: 3
Targets:
0.000 50.000 100.000
USER-TEXT::
Axis: X
TITLE: spring
RUNS::
DEVIATIONS::
Run Target Data:
1 1 0.0
1 2 1.2
1 3 2.1
2 3 2.3
2 2 1.5
2 1 0.4
ENVIRONMENT::
"""


def test_an_interferometers_file():
    found = reads(RTL.encode(), THREE, "x.rtl")
    assert found.kind == "axis"
    assert found.labels["component"] == ("EXX",) * 6
    assert found.columns["direction"].tolist() == [1, 1, 1, -1, -1, -1]
    assert found.columns["value"][4] == pytest.approx(-1.5e-3)  # X is in the table: its body goes the other way
    assert found.columns["position"].tolist() == [0, 50, 100, 100, 50, 0]


AS_SAVED = RTL.replace("Targets:\n0.000 50.000 100.000\n", "Targets :\n0.000  50.000 \n100.000 \nFlags: 0 0 2 0\n\n")
"""The key and the folded targets as the instrument's own software has them."""


@pytest.mark.parametrize(
    "text",
    [
        AS_SAVED,
        AS_SAVED.replace("\n", "\r\n"),
        AS_SAVED.replace("Axis: X", "Axis:X-axis"),
        AS_SAVED.replace("Axis: X", "Axis: Eje x"),
        AS_SAVED.replace("Axis: X", "Axis:X\u8f74"),
        AS_SAVED.replace("TITLE: spring", "TITLE: Carroll, new controller"),
        AS_SAVED.replace("ENVIRONMENT::", "\nEQUIPMENT::\nSerial: 1 2 3\nEOF::\n"),
        "\n" + AS_SAVED.replace(" 2 1.2", "\t2\t1.2"),
        AS_SAVED.replace("Data:\n1 1", "Data: 1 1"),
        AS_SAVED.replace("Axis: X", "Axis: X\nUnits: mm, \u00b5m\nLaser unit: XL-80"),
    ],
)
def test_the_forms_of_an_interferometers_file(text: str):
    found, plain = reads(text.encode(), THREE), reads(RTL.encode(), THREE)
    assert found.labels == plain.labels
    for name in ("position", "value", "direction", "run"):
        assert found.columns[name].tolist() == plain.columns[name].tolist()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("Axis: X", "Axis: C", "rotary axis"),
        ("Axis: X", "Axis:", "the axis is ''"),
        ("Axis: X", "Axis: X1", "the axis is 'X1'"),
        ("Axis: X", "Axis: X to Y", "the axis is 'X to Y'"),
        ("Axis: X", "Axis: l\u00e4ngs", "the axis is"),
        ("TITLE: spring", "TITLE: Straightness of X", "another error than positioning"),
        ("2 1 0.4", "2 4 0.4", "target 4 of 3"),
        ("2 1 0.4", "2 1", "not a line with run, target and deviation"),
        ("2 1 0.4", "2 1 0,4", "'0,4' is not a number"),
        ("Target-count: 3", "Target-count: 4", "is a part of the file missing?"),
        ("Targets:", "Target:", "no line `Targets:`"),
        ("Axis: X", "Axis: X\nUnits: inches", "targets are read as mm"),
        ("USER-TEXT::", "Target units: in\nUSER-TEXT::", "targets are read as mm"),
        ("Axis: X", "Axis: X\nAxis: Y", "`Axis:` appears twice"),
        ("ENVIRONMENT::", "DEVIATIONS::\nRun Target Data:\n1 1 0.1\n", "`Run Target Data:` appears twice"),
    ],
)
def test_interferometers_files_that_cannot_be_taken_for_positioning(old: str, new: str, said: str):
    assert old in RTL
    with pytest.raises(ConfigError) as caught:
        reads(RTL.replace(old, new).encode(), THREE)
    assert said in str(caught.value)


@pytest.mark.parametrize("name", ["x.rta", "X.RTS", "straight/x.rtq"])
def test_a_file_of_angles_or_straightness_is_not_taken_for_positioning(name: str):
    """It has the same sections; only its ending, and maybe a free text, say what was measured."""
    with pytest.raises(ConfigError, match="another error than positioning"):
        reads(RTL.encode(), THREE, name)


def test_an_interferometers_file_that_ends_before_its_deviations_is_known_all_the_same():
    with pytest.raises(ConfigError, match="there are no readings"):
        reads(RTL.partition("DEVIATIONS::\n")[0].replace("DEVIATIONS", "").encode(), THREE, "x.rtl")


def moving(direction: tuple[float, float, float]) -> Machine:
    """The three-axis machine, whose X and Y are in the table, with X moving along this and Y along y."""
    x, y, z = THREE.axes
    return THREE.replace(axes=(replace(x, direction=direction), replace(y, direction=(0.0, 1.0, 0.0)), z), effects=())


def test_deviations_of_a_table_axis_are_errors_of_its_body_with_the_other_sign():
    """10 um too far towards plus: the body of X' stands 10 um too far towards minus x, and so the tip is off."""
    found = reads(RTL.replace("1 3 2.1", "1 3 10.0").encode(), THREE)
    assert found.columns["value"][2] == pytest.approx(-0.010)
    assert reads(RTL.encode(), moving((1.0, 0.0, 0.0))).columns["value"][4] == pytest.approx(1.5e-3)
    wrong = THREE.replace(effects=(Effect("EXX", (-0.010,)),))
    q = np.zeros((1, 3))
    q[0, THREE.axis_names.index("X")] = 0.010
    meant, there = THREE.tip(q, 0.0), wrong.actual_tip(np.zeros((1, 3)), State(0.0))
    assert there == pytest.approx(meant, abs=1e-12)
    with pytest.raises(ConfigError, match="does not move along its error axis"):
        reads(RTL.encode(), moving((-(0.5**0.5), 0.0, 0.5**0.5)))


def test_tables_of_a_table_axis_are_remarked():
    text = "X EXX EYX\n0.0 0.02 0.01\n100 0.03 0.02\n"
    assert remarks(text) == {"NCF618"}
    assert not remarks(text, moving((1.0, 0.0, 0.0)))


def test_a_run_that_was_cut_off_is_remarked():
    assert remarks(RTL.replace("2 1 0.4\n", "")) == {"NCF618"}


def test_a_run_that_turns_back_approaches_its_targets_from_both_sides():
    found = reads(RTL.replace("\n2 ", "\n1 ").replace("Run-count: 2", "Run-count: 1").encode(), THREE)
    assert found.columns["direction"].tolist() == [1, 1, 1, -1, -1, -1]


def test_deviations_in_millimetres_are_remarked():
    small = re.sub(r"(?m)^([12] [123]) (.*)$", lambda row: f"{row[1]} {float(row[2]) / 1000:.4f}", RTL)
    assert remarks(small) == {"NCF616"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("X EYY\n0 0\n100 0.01\n", "EYY is not an error of X"),
        ("EXX EYX\n0 0\n0.01 100\n", "the first column is 'EXX'"),
        ("position,EXX\n0,0\n100,0.01\n", "the first column is 'position'"),
        ("X EXX EXX\n0 0 0\n100 0.01 0.02\n", "a column appears twice"),
        ("X EXX [um]\n0 0\n100 10\n", "'\\[um\\]' is not an error of X"),
        ("X Y EXX\n0 0 0\n", "a grid over several axes"),
        ("X;EXX\n0;0\n100;0,01\n", "3 cells, but 2 columns(.|\n)*decimal point"),
        ("X;EXX;EYX\n0;0;0\n0,5;2\n", "3:(.|\n)*a decimal comma(.|\n)*decimal point"),
        ("[EXX]\nGridpoints = {\n 0 0\n}\n[EXX]\nGridpoints = {\n 0 1\n}\n", "5:1(.|\n)*EXX(.|\n)*twice"),
        ("[EXX]\nGridpoints = {\n 0 0\n 50 5 1\n 100 10\n}\n", "4:1: NCF618: invalid line"),
        ("[EXX]\nUNIT = um\nGridpoints = {\n 0 0\n 100 10\n}\n", "2:1: NCF618: invalid line"),
        ("[C0B\nVALUE = 1e-5\n[EXX]\nGridpoints = {\n 0 0\n}\n", "1:1: NCF618: invalid line"),
    ],
)
def test_tables_of_controls_that_would_be_misread(text: str, said: str):
    with pytest.raises(ConfigError, match=said):
        reads(text.encode(), moving((1.0, 0.0, 0.0)))


def test_tables_of_controls_are_direct_readings():
    isg = "// lengths mm\nX EXX EYX EAX\n0.0 0.02 0.01 1e-5\n100 0.03 0.02 2e-5\n"
    found = reads(isg.encode(), THREE)
    assert found.labels["component"] == ("EXX", "EYX", "EAX") * 2
    assert found.columns["position"].tolist() == [0, 0, 0, 100, 100, 100]
    squared = reads(b"X EXX EC0Y\n0 0 1e-5\n100 0.03 1e-5\n", moving((1.0, 0.0, 0.0)))
    assert set(squared.labels["component"]) == {"EXX"}
    assert [message.code for message in squared.remarks] == ["NCF618"]
    etalon = "[C0Y]\nVALUE = 0.00002\n[EXY]\nGridpoints = {\n -10 -0.001\n 20 0.002\n}\n"
    found = reads(etalon.encode(), moving((1.0, 0.0, 0.0)))
    assert found.columns["value"].tolist() == [-0.001, 0.002]
    assert [message.code for message in found.remarks] == ["NCF618"]


def test_shared_samples_of_instruments_read(shared):
    folder = shared("tables")
    for name in ("beckhoff_isg/volc_isg_csv_1d.csv", "beckhoff_isg/etalon_exchange.txt", "renishaw/rtl_skeleton.rtl"):
        assert len(read(str(folder / name), THREE)) > 0
