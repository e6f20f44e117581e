"""What users get wrong, one mistake at a time: each is named, with its place if it has one, and nothing is dropped."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from measure.poses import machine, perfect, plan
from ncfix.diagnostics import NcfixError
from ncfix.measure.calibrate import calibrate
from ncfix.measure.estimate import Calibration
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import Measurement, dumps
from ncfix.measure.reader import reads

ROWS = 120
SOUGHT = ("EA0B", "EC0B", "EX0B", "EZ0B", "EA0C", "EB0C", "EX0C", "EY0C", "EC0Y", "EA0Y", "EB0Z", "EYY", "EZZ")
SHIPPED = machine("wCBXFZYSt")
FIVE = SHIPPED.replace(effects=tuple(effect for effect in SHIPPED.effects if effect.name in SOUGHT))


@pytest.fixture(scope="module")
def good() -> Measurement:
    """An R-test of the five-axis machine with a clock."""
    poses = plan(FIVE, "tcp", ROWS).with_columns({"time_s": np.arange(ROWS) * 30.0})
    return simulate(poses, FIVE, Faults(noise_um=1.0, setup=0.1), seed=5)


def calibrated(text: str) -> Calibration:
    """As the verb does: read, then calibrate; the same file twice gives the same."""
    return calibrate([reads(text.encode(), FIVE, "m.csv")], perfect(FIVE))


def cell(text: str, row: int, column: str, change: Callable[[str], str]) -> str:
    """The text with one cell changed; rows from 0."""
    lines = text.splitlines()
    head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    cells, index = lines[head + 1 + row].split(","), lines[head].split(",").index(column)
    cells[index] = change(cells[index])
    lines[head + 1 + row] = ",".join(cells)
    return "\n".join(lines) + "\n"


def whole(good: Measurement, change: Callable[[Measurement], Measurement]) -> str:
    return dumps(change(good))


def swapped(data: Measurement) -> Measurement:
    return data.with_columns({"dx": data.columns["dy"], "dy": data.columns["dx"]})


def in_radians(data: Measurement) -> Measurement:
    rounded = {axis: np.round(data.columns[axis] / 10) * 10 for axis in "BC"}
    return data.with_columns({axis: np.deg2rad(values) for axis, values in rounded.items()})


REFUSED = {
    "a gap": (lambda text: cell(text, 3, "dy", lambda _: ""), "NCF607", "column 'dy' is empty in this row"),
    "not a number": (lambda text: cell(text, 3, "dy", lambda _: "n/a"), "NCF608", "is not a number"),
    "a decimal comma": (lambda text: cell(text, 3, "dy", lambda value: value.replace(".", ",")), "NCF606", "cells"),
    "a reading marked by nines": (lambda text: cell(text, 3, "dy", lambda _: "-9999"), "NCF612", "missing reading?"),
    "an axis that is not there": (lambda text: text.replace(",B,", ",A,"), "NCF610", "no axis A, only C B X Z Y"),
    "time going backwards": (lambda text: cell(text, 9, "time_s", lambda _: "5"), "NCF611", "5 s after 240 s"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_is_refused(good: Measurement, name: str) -> None:
    change, code, text = REFUSED[name]
    with pytest.raises(NcfixError) as caught:
        calibrated(change(dumps(good)))
    (message,) = caught.value.messages
    assert (message.code, text in str(message)) == (code, True), str(message)
    assert message.place is not None
    assert message.place.line > 0


REMARKED = {
    "swapped columns": (swapped, "NCF617", "dx"),
    "degrees given as radians": (in_radians, "NCF614", "look like radians"),
}


@pytest.mark.parametrize("name", REMARKED)
def test_what_is_odd_is_remarked(good: Measurement, name: str) -> None:
    change, code, text = REMARKED[name]
    said = [str(message) for message in calibrated(whole(good, change)).remarks if message.code == code]
    assert said
    assert text in said[0]


def test_a_good_measurement_is_not_remarked_upon(good: Measurement) -> None:
    assert {m.code for m in calibrated(dumps(good)).remarks} <= {"NCF631", "NCF632"}


def test_too_few_rows_are_counted(good: Measurement) -> None:
    with pytest.raises(
        NcfixError, match=r"9 values are too few for 1\d coefficients and 8 unknowns of the set-up"
    ) as caught:
        calibrated(dumps(good.rows(slice(3))))
    assert caught.value.code == "NCF630"


def test_a_duplicated_pose_is_named_and_kept(good: Measurement) -> None:
    copied = dumps(good) + dumps(good).splitlines()[-1] + "\n"
    found = calibrated(copied)
    (said,) = [m for m in found.remarks if m.code == "NCF613"]
    assert "with the same values; was the row copied?" in str(said)
    assert len(found.problem.values) == 3 * (ROWS + 1)


def test_repeats_without_a_column_are_remarked_upon_once(good: Measurement) -> None:
    last = dumps(good).splitlines()[-1].rsplit(",", 1)[0]
    found = calibrated(dumps(good) + "".join(f"{last},0.00{k}\n" for k in range(1, 4)))
    (said,) = [m for m in found.remarks if m.code == "NCF613"]
    assert "taken as a repeat (and 2 more such rows)" in str(said)


def test_an_outlier_is_named_with_its_line_and_stays_in_the_file(good: Measurement) -> None:
    text = cell(dumps(good), 42, "dz", lambda value: f"{float(value) + 0.5:.6f}")
    found = calibrated(text)
    (said,) = [m for m in found.remarks if m.code == "NCF633"]
    assert "dz differs by +" in str(said)
    assert said.place is not None
    assert text.splitlines()[said.place.line - 1].split(",") == text.splitlines()[-ROWS + 42].split(",")
    assert len(found.problem.values) == 3 * ROWS
    assert (found.estimate.weight == 0).sum() == 1


def test_one_set_of_one_setting_says_what_it_hides(good: Measurement) -> None:
    """Rotary axes at rest: where they lie cannot be told, and each error that is held is named."""
    still = good.with_columns({"B": np.zeros(ROWS), "C": np.zeros(ROWS)})
    found = calibrated(dumps(still))
    held = {label for label, sigma in zip(found.labels, found.sigma, strict=True) if np.isnan(sigma)}
    said = " ".join(str(m) for m in found.remarks if m.code in ("NCF631", "NCF632"))
    assert {"EX0C", "EY0C", "EX0B", "EZ0B"} <= held
    assert all(label in said or label.split()[0] in said for label in held)


def test_one_target_of_a_tracker_does_not_show_angles() -> None:
    """Of the last axis of its body: what a turn does to one point, shifts do too. Three targets tell them apart."""
    poses = plan(FIVE, "tool", ROWS).with_header("carried_by", "spindle")  # in tools of two lengths one is two points
    alone = poses.rows([row for row, target in enumerate(poses.labels["target"]) if target == "1"])
    held = []
    for each in (alone, poses):
        found = calibrate([simulate(each, FIVE, Faults(noise_um=1.0))], FIVE.replace(effects=()), "EYY,EZY,EAY")
        held.append({label for label, sigma in zip(found.labels, found.sigma, strict=True) if np.isnan(sigma)})
        said = " ".join(str(m) for m in found.remarks if m.code in ("NCF631", "NCF632"))
        assert all(label in said or label.split()[0] in said for label in held[-1])
    assert {"EAY u^2", "EAY u^3"} <= held[0]
    assert not {"EAY u^2", "EAY u^3"} & held[1]


def test_an_empty_file_and_a_table_of_something_else() -> None:
    for text in ("", "a;b;c\n1;2;3\n", "# ncfix-measurement: 1\n# kind: tcp\nX,dx\n"):
        with pytest.raises(NcfixError) as caught:
            reads(text.encode(), FIVE, "m.csv")
        assert caught.value.code in ("NCF600", "NCF609")


def test_a_missing_file_is_not_a_traceback(tmp_path: Path) -> None:
    from ncfix.measure.reader import read

    with pytest.raises(NcfixError):
        read(str(tmp_path / "none.csv"), FIVE)
