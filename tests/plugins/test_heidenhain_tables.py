"""Heidenhain's `.COM` and `.CMA`: to the byte, the dependency rule, the samples, and what is wrong in broken files."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ncfix.diagnostics import ConfigError, RefusedError, UsageError
from ncfix.machine import Effect, dumps, loads
from ncfix.machine.basis import Polynomial
from ncfix.machine.piecewise import PiecewiseLinear
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import export
from ncfix.tables.table_files import Remarks
from ncfix.testing import check_control, single_error
from ncfix_heidenhain.table_files import read_com, read_table

CONTROL = get_control("heidenhain")
CMA = (
    b"BEGIN config.cma MM\n"
    b"NR   ACTIVE X            Y            Z            \n"
    b"0    *      AXIS_X.COM                             \n[END]\n"
)
COM = (
    b"BEGIN AXIS_X.COM MM\n"
    b"NR   AXISPOS       BACKLASH      X             Z             \n"
    b"0    -10.0000      +0.0020       +0.0012       +0.0000       \n"
    b"1    +0.0000       +0.0021       +0.0009       +0.0010       \n"
    b"2    +10.0000      +0.0021       +0.0004       +0.0040       \n[END]\n"
)


def files(com: bytes = COM, cma: bytes = CMA, sign: bytes = b"error\n") -> dict[str, bytes]:
    return {"AXIS_X.COM": com, "config.cma": cma, "sign.txt": sign}


def long_screw(**settings: str) -> dict[str, bytes]:
    """A screw that is 0.1 um per mm too long: 20.000 um short at -200, so the error there is -0.0200 mm."""
    machine = single_error("EXX").replace(effects=(Effect("EXX", (1e-4,), Polynomial((1,))),))
    request = Request(machine, ranges_of(machine), 0.0, 0.001, CONTROL.settings({"sign": "error", **settings}))
    return dict(export(CONTROL, request, 100).native)


def test_golden_bytes() -> None:
    assert long_screw() == {
        "AXIS_X.COM": b"BEGIN AXIS_X.COM MM\nNR   AXISPOS       X             \n"
        b"0    -200.0000     -0.0200       \n1    +300.0000     +0.0300       \n[END]\n",
        "config.cma": CMA,
        "sign.txt": b"error\n",
    }


def test_golden_bytes_of_the_older_controls() -> None:
    found = long_screw(family="itnc530", sign="correction")
    assert found["AXIS-X.COM"] == (
        b"BEGIN AXIS-X.COM  DATUM:-200.0000 DISTANCE:+500.0000\nNR   BACKLASH      1=F()         \n"
        b"0    +0.0200       +0.0200       \n1    -0.0300       -0.0300       \n"
    )


def test_a_control_may_put_the_version_of_the_table_behind_its_unit() -> None:
    found = files()
    name = next(name for name in found if name.endswith(".COM"))
    found[name] = found[name].replace(b" MM", b" MM Version: 'Update:100.00 Date:2020-02-01'", 1)
    assert not CONTROL.lint(found)


def test_the_contract() -> None:
    check_control(CONTROL, {"sign": "error"})


@pytest.mark.parametrize(
    ("x", "way", "expected"),
    [(-10, 1, (-0.0012, 0)), (-10, -1, (-0.0020, 0)), (5, 1, (-0.00065, -0.0025)), (99, -1, (-0.0021, -0.0040))],
)
def test_the_dependency_rule(x: float, way: float, expected: tuple[float, float]) -> None:
    """The column Z of the file that is entered under X moves Z as X goes; BACKLASH counts on the way back."""
    found = CONTROL.read(files()).at(("X", "Y", "Z"), np.array([[x, 0.0, 0.0]]), np.array([[way, 0.0, 0.0]]))
    assert found[0] == pytest.approx([expected[0], 0.0, expected[1]], abs=1e-12)


def test_play_goes_into_backlash_only_if_asked_for() -> None:
    text = '[[effect]]\nname = "EXX"\nbasis = "backlash"\ncoefficients = [0.01]\n'
    machine = loads(dumps(single_error("EXX").replace(effects=())) + text)
    for backlash, left in (("on", 0.0), ("off", 1.0)):
        settings = CONTROL.settings({"sign": "error", "backlash": backlash})
        made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, settings), 200)
        assert made.left.after.max() == pytest.approx(left * made.left.before.max(), abs=1e-4)  # digits of the file


@pytest.mark.parametrize("name", ["AXIS_X_TNC640.COM", "AXIS-X_iTNC530.COM", "config.cma"])
def test_samples_are_written_again_identically(shared: Callable[[str], Path], name: str) -> None:
    content = (shared("tables") / "heidenhain" / name).read_bytes()
    remarks = Remarks.of(name, content)
    table = read_table(remarks, content)
    assert not remarks.wrong
    assert table is not None
    assert table.text() == content


def test_the_samples_say_what_they_say(shared: Callable[[str], Path]) -> None:
    folder = shared("tables") / "heidenhain"
    new, _ = read_com("AXIS_X.COM", (folder / "AXIS_X_TNC640.COM").read_bytes())
    old, _ = read_com("AXIS-X.COM", (folder / "AXIS-X_iTNC530.COM").read_bytes())
    assert new is not None
    assert old is not None
    assert new.nodes.tolist() == [-875, -825, -775]
    assert new.columns["X"].tolist() == [0.0012, 0.0009, 0.0004]
    assert new.backlash is not None
    assert new.backlash.tolist() == [0.002, 0.0021, 0.0021]
    assert old.nodes.tolist() == [-875, -825]
    assert old.columns["1"].tolist() == [0.0012, 0.0009]


def test_the_sign_must_be_given() -> None:
    with pytest.raises(UsageError, match="sign"):
        CONTROL.settings({})


def test_values_beyond_the_columns_are_refused() -> None:
    machine = single_error("EXX").replace(effects=(Effect("EXX", (11.0,)),), max_correction=(50.0, 0.1))
    with pytest.raises(RefusedError) as caught:
        export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001, CONTROL.settings({"sign": "error"})), 100)
    assert caught.value.code == "NCF484"


BROKEN = {
    "cut short": (COM.replace(b"[END]\n", b""), "[END] is missing"),
    "a row gone": (COM.replace(COM.splitlines(keepends=True)[3], b""), "row 2 instead of row 1"),
    "descending": (COM.replace(b"+10.0000", b"-20.0000"), "must ascend"),
    "a decimal comma": (COM.replace(b"+0.0009", b"+0,0009"), "a decimal comma under X"),
    "an empty cell": (COM.replace(b"+0.0009", b"       "), "nothing under X"),
    "a word": (COM.replace(b"+0.0009", b"+0.OOO9"), "is not a number"),
    "not finite": (COM.replace(b"+0.0009", b"nan    "), "is not a number"),
    "shifted": (COM.replace(b"1    +0.0000       +0.0021 ", b"1    +0.0000      +0.0021  "), "column"),
    "a cell too many": (COM.replace(b"+0.0010       \n", b"+0.0010 +0.0010\n"), "more cells than"),
    "a tab": (COM.replace(b"1    +0.0000", b"1\t+0.0000"), "a tab"),
    "inches": (COM.replace(b"COM MM", b"COM INCH"), "the unit is INCH"),
    "no header": (COM.replace(b"NR   AXISPOS", b"     AXISPOS"), "no line of column names"),
    "an unknown axis": (COM.replace(b"       Z  ", b"       Q  "), "is not an axis"),
    "a column twice": (COM.replace(b"       Z  ", b"       X  "), "appears twice"),
    "micrometres": (COM.replace(b"+0.0040", b"+4.0000"), "not um"),
    "one row": (b"".join([*COM.splitlines(keepends=True)[:3], b"[END]\n"]), "1 points"),
    "empty": (b"", "is empty"),
}
BROKEN_CMA = {
    "no active line": (CMA.replace(b"*", b" "), "0 lines are marked"),
    "a file that is not there": (CMA.replace(b"AXIS_X.COM", b"AXIS_Y.COM"), "AXIS_Y.COM of axis X is missing"),
    "an unknown axis": (CMA.replace(b"X     ", b"Q     ", 1), "is not an axis"),
    "two active lines": (CMA.replace(b"[END]", b"1    *      AXIS_X.COM\n[END]"), "2 lines are marked"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_tables(case: str) -> None:
    content, expected = BROKEN[case]
    found = CONTROL.lint(files(content))
    assert any(expected in f"{message.text} {message.hint}" for message in found), found
    with pytest.raises(ConfigError):
        CONTROL.read(files(content))


@pytest.mark.parametrize("case", BROKEN_CMA)
def test_broken_configurations(case: str) -> None:
    content, expected = BROKEN_CMA[case]
    found = CONTROL.lint(files(cma=content))
    assert any(expected in message.text for message in found), found
    with pytest.raises(ConfigError):
        CONTROL.read(files(cma=content))


def test_what_is_doubtful() -> None:
    steep = CONTROL.lint(files(COM.replace(b"+0.0040", b"+0.4000")))
    assert [message.code for message in steep] == ["NCF492"]
    unused = CONTROL.lint(files(re.sub(rb"(?m)^(\d+ +\S+ +)\S+", rb"\1+0.0000", COM)))
    assert any("BACKLASH is zero in all rows" in message.text for message in unused), unused
    spare = CONTROL.lint({**files(), "AXIS_Y.COM": COM})
    assert any("not entered" in message.text for message in spare)


def test_a_file_without_its_sign_is_not_read() -> None:
    with pytest.raises(ConfigError, match="HEID-1"):
        CONTROL.read(files(sign=b""))


def test_good_files_are_not_remarked_on() -> None:
    assert not CONTROL.lint(files())


def test_play_that_is_left_is_said_with_the_setting_that_takes_it_up() -> None:
    curves = {"positive": (0.004, -0.002), "negative": (0.007, 0.003)}
    effects = tuple(Effect("EXX", curve, PiecewiseLinear((-200.0, 300.0), way)) for way, curve in curves.items())
    machine = single_error("EXX").replace(effects=effects)
    begins = ["Errors that depend on the direction of motion", "The values written are the mean of both directions"]
    for setting, left in (("off", begins), ("on", [])):
        settings = {"sign": "error", "backlash": setting}
        request = Request(machine, ranges_of(machine), 0.0, 0.001, settings)
        found = [note for note in CONTROL.write(request).notes if "direction" in note]
        assert [note[: len(begin)] for note, begin in zip(found, left, strict=True)] == left
