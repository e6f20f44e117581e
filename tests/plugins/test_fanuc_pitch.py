"""Stored pitch errors: rounding carried along, turns that close, the samples, and broken files."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ncfix.diagnostics import ConfigError, RefusedError, UsageError
from ncfix.machine import Effect, load, loads
from ncfix.machine.basis import Fourier, Polynomial
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import export
from ncfix.tables.forms import lint_files
from ncfix.tables.table_files import Remarks
from ncfix.testing import check_control, single_error
from ncfix.testing.tables import AXES
from ncfix_fanuc.parameters import PunchedParameter, read_records
from ncfix_fanuc.pitch import diffused
from ncfix_fanuc.pitch_files import Pitch, pitch_text, read_increments

CONTROL = get_control("fanuc-pitch")
SETTINGS = CONTROL.settings({"sign": "correction"})


def long_screw() -> dict[str, bytes]:
    """A screw that is 0.1 um per mm too long."""
    machine = single_error("EXX").replace(effects=(Effect("EXX", (1e-4,), Polynomial((1,))),))
    settings = {**SETTINGS, "detection_unit_um": "1"}
    return dict(export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, settings), 100).native)


def test_a_range_far_from_machine_zero_keeps_its_reference_point() -> None:
    """Points near 250 mm, some 5 mm apart: that of machine zero gets a number all the same, and the sums hold."""
    machine = single_error("EXX").replace(effects=(Effect("EXX", (1e-9,), Polynomial((3,))),))
    space = ranges_of(machine, {"X": (200.0, 300.0)})
    made = export(CONTROL, Request(machine, space, 0.0, 0.001, SETTINGS), 500)
    assert b"N03620A1P0" in made.native["parameters.txt"]
    assert [message.text for message in made.messages] == ["the reference position is outside the points"]


def test_the_contract() -> None:
    check_control(CONTROL, {"sign": "error"})


@given(st.lists(st.floats(-300, 300), min_size=2, max_size=40))
def test_sums_are_never_off_by_more_than_half_a_step(values: list[float]) -> None:
    curve = np.array(values)
    increments, magnification = diffused(curve)
    assert np.abs(increments).max() <= 7
    sums = np.cumsum(increments) + np.rint(curve[0] / magnification)
    assert np.abs(sums * magnification - curve).max() <= magnification / 2 + 1e-9


def test_golden_bytes() -> None:
    """20 um at -200 to -30 um at 300, in units of 1 um: intervals of 62.5 mm, 6.25 units each.

    They count from zero, so the first and the last reach beyond the travel, with values that are right at its ends.
    """
    found = long_screw()
    assert set(found) == {"pitch_X.csv", "parameters.txt", "settings.txt"}
    lines = found["pitch_X.csv"].splitlines()
    assert lines[:3] == [
        b"# No.1..10, incremental values (-7..+7), x magnification, detection units",
        b"no,value",
        b"1,0",
    ]
    values = [int(line.split(b",")[1]) for line in lines[3:]]
    assert sum(values) == -56
    assert set(values) == {-7, -6}
    assert found["parameters.txt"].splitlines() == [
        b"%",
        b"N03620A1P5;",
        b"N03621A1P1;",
        b"N03622A1P10;",
        b"N03623A1P1;",
        b"N03624A1P62.5000;",
        b"N03625A1P0;",
        b"%",
    ]


def test_a_rotary_axis_closes_over_a_turn(root: Path) -> None:
    machine = load(root / "examples" / "machines" / "dmu50.toml")
    made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, SETTINGS), 200)
    first, increments = read_increments(Remarks.of("pitch_C.csv", made.native["pitch_C.csv"]))
    assert increments[1:].sum() == 0
    assert increments[0] == increments[-1] != 0
    assert first > 1

    def lint(point: int, value: int) -> list[str]:
        old, new = (b"\n%d,%d\n" % (point, each) for each in (increments[point - first], value))
        broken = {**made.native, "pitch_C.csv": made.native["pitch_C.csv"].replace(old, new)}
        return [message.text for message in CONTROL.lint(broken)]

    assert "behind its first point add up to" in lint(first + 3, 7)[0]
    assert "at the same position, has" in lint(first, 0)[0]


def test_the_intervals_of_a_turn_fill_it_exactly(root: Path) -> None:
    """The parameter has four decimals: 28 intervals of 12.8571 degrees would be no turn."""
    machine = load(root / "examples" / "machines" / "dmu50.toml").replace(
        effects=(Effect("ECC", (0.0, 5e-5), Fourier((1,))),)
    )
    space = ranges_of(machine)
    for turns in (1, 1.5, 2):
        space[machine.axis_names.index("C")] = np.array([0, turns * 2 * np.pi])
        made = export(CONTROL, Request(machine, space, 0.0, 0.001, SETTINGS), 50)
        rows = made.native["parameters.txt"].decode().splitlines()
        interval = next(re.findall(r"P([\d.]+)", row)[-1] for row in rows if row.startswith("N03624"))
        _, increments = read_increments(Remarks.of("pitch_C.csv", made.native["pitch_C.csv"]))
        assert float(interval) * (len(increments) - 1) == pytest.approx(360, abs=1e-9)


def test_the_sample_is_read_and_its_numbers_written_again(shared: Callable[[str], Path]) -> None:
    """B-63980EN, p. 100: points 33 to 49."""
    content = (shared("tables") / "fanuc" / "pitch_example_B63980EN_p100.csv").read_bytes()
    remarks = Remarks.of("sample", content)
    first, increments = read_increments(remarks)
    assert not remarks.messages
    assert (first, len(increments), increments.sum()) == (33, 17, 2)
    assert pitch_text(Pitch("X", first, increments, 33, 1, 1.0)) == content


def punched(record: PunchedParameter) -> str:
    """A record as the control writes it."""
    words = "".join(f"{record.kind}{index if record.kind else ''}P{value}" for index, value in record.values)
    return f"N{record.number:05d}{words};"


def test_nothing_of_the_parameter_sample_is_lost(shared: Callable[[str], Path]) -> None:
    content = (shared("tables") / "fanuc" / "param_record_15i.txt").read_bytes()
    remarks = Remarks.of("sample", content)
    records = read_records(remarks)
    assert not remarks.messages
    assert records[0].number == 0
    assert records[2].kind == "S"
    assert "\n".join(["%", *map(punched, records), "%", ""]).encode() == content


def test_a_punched_file_that_lost_its_first_line_is_told_so() -> None:
    found = lint_files({"CNC-PARA.TXT": b"N3620 A1P33 A2P40\nN10033 P-1\n"})["CNC-PARA.TXT"]
    assert (found.owner, [each.text for each in found.messages]) == (
        CONTROL.name,
        ["should begin and end with a line %"],
    )


def test_axes_without_a_table_keep_what_the_control_has() -> None:
    """No zero for them: it would wipe out the compensation of the machine's maker. Points begin where they are free."""
    machine = single_error("EYY").replace(effects=(Effect("EYY", (1e-4,), Polynomial((1,))),))
    settings = {**SETTINGS, "first_number": "200"}
    made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, settings), 100).native
    rows = made["parameters.txt"].decode().splitlines()[1:-1]
    assert all(re.fullmatch(r"N0362[0-5]A2P[\d.]+;", row) for row in rows)
    assert "N03621A2P200;" in rows


@pytest.mark.parametrize("at", [-120.0, 90.0])
def test_increments_count_from_the_reference_position(at: float) -> None:
    """0.1 um per mm: what is at the reference position cannot be said. That is left, and half of a magnified unit."""
    machine = single_error("EXX").replace(effects=(Effect("EXX", (1e-4,), Polynomial((1,))),))
    settings = {**SETTINGS, "reference": f"X{at}"}
    made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, settings), 500)
    half = 0.5e-4 * int(re.findall(rb"N03623A1P(\d+)", made.native["parameters.txt"])[0])
    assert made.left.after == pytest.approx(np.full(500, abs(at) * 1e-4), abs=half + 1e-5)
    with pytest.raises(UsageError, match="reference names B"):
        export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, {**SETTINGS, "reference": "B1"}), 50)


def test_a_magnification_beyond_the_control_is_refused() -> None:
    with pytest.raises(RefusedError) as caught:
        diffused(np.array([0.0, 900.0]))
    assert caught.value.code == "NCF484"


def test_what_only_an_offset_would_help_is_left() -> None:
    text = AXES.format(name="n", topology="w F X Y Z t", sense=1, effect="EXX", size=0, half=0)
    machine = loads(text).replace(effects=(Effect("EXX", (0.01,)),))
    made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, SETTINGS), 50)
    assert "pitch_X.csv" not in made.native
    assert (made.left.after == made.left.before).all()
    assert any(note.startswith("X: no points are written.") and "-10.0 um" in note for note in made.notes)


FILES = long_screw()
BROKEN = {
    "too large": (("pitch_X.csv", b",-7\n", b",-8\n"), "beyond -7 to 7"),
    "a point gone": (("pitch_X.csv", b"3,", b"4,"), "point 4 after point 2"),
    "a word": (("pitch_X.csv", b"1,0", b"1,O"), "not a point number"),
    "no head": (("pitch_X.csv", b"no,value\n", b""), "should begin with no,value"),
    "other numbers": (("parameters.txt", b"N03622A1P10", b"N03622A1P11"), "the parameters state 1 to 11"),
    "no interval": (("parameters.txt", b"N03624A1P62.5000", b"N03624A1P0"), "an interval of zero"),
    "a parameter gone": (("parameters.txt", b"N03623A1P1;\n", b""), "not all parameters of axis 1"),
    "no tape marks": (("parameters.txt", b"%\n", b""), "begin and end with a line %"),
    "no record": (("parameters.txt", b"N03625A1P0", b"N03625A1=0"), "is no record"),
    "two kinds": (("parameters.txt", b"N03625A1P0", b"N03625A1P0S2P0"), "several kinds"),
    "of a spindle": (("parameters.txt", b"N03625A1P0", b"N03625S1P0"), "not all parameters of axis 1"),
    "no sign": (("settings.txt", b"correction", b"plus"), "the sign"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_files(case: str) -> None:
    (name, old, new), expected = BROKEN[case]
    assert old in FILES[name]
    broken = {**FILES, name: FILES[name].replace(old, new, 1)}
    found = CONTROL.lint(broken)
    assert any(expected in message.text for message in found), found
    with pytest.raises(ConfigError):
        CONTROL.read(broken)


def test_good_files_are_not_remarked_on() -> None:
    assert not CONTROL.lint(FILES)
