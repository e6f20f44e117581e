"""VOLCOMP of the ISG kernel: to the byte, read back, and what the linter says of broken files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ncfix.diagnostics import ConfigError, UsageError
from ncfix.machine import Effect, loads
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.export import export
from ncfix.testing import single_error

CONTROL = get_control("isg")
CONFIG = (
    b"workpiece_axes          0\nX                       1\nY                       2\nZ                       3\n"
    b"Interpolation           GRID\nenable_splicing         FALSE\nfilter_steps            20\n"
    b"manual_activation       FALSE\nalternative_model       FALSE\nassociate_to_channel    FALSE\n"
    b"file[0]                 C:\\vc\\volcomp0.csv\nfile_format[0]          ISG_CSV\n"
)
GRID = b"// errors\nX Y EXX EYY\n0 0 0.001 0\n0 10 0.002 0\n5 0 0.003 0\n5 10 0.004 0.002\n"


def files(grid: bytes = GRID, config: bytes = CONFIG) -> dict[str, bytes]:
    return {"volcomp.lis": config, "volcomp0.csv": grid}


def test_golden_bytes() -> None:
    """X stands 0.010 mm too far everywhere: the file holds that error at the eight corners of the travel."""
    machine = single_error("EXX").replace(effects=(Effect("EXX", (0.01,)),))
    made = export(CONTROL, Request(machine, ranges_of(machine), 0.0, 0.001), 100).native
    corners = [f"{x} {y} {z} 0.010000 0.000000 0.000000\n" for x in (-200, 300) for y in (-150, 250) for z in (-300, 0)]
    assert made["volcomp.lis"] == CONFIG
    head, names, *rows = made["volcomp0.csv"].decode().splitlines(keepends=True)
    assert head.startswith("// ")
    assert names == "X Y Z EXX EYY EZZ\n"
    assert rows == corners


def test_the_list_of_the_documentation_is_understood(shared: Callable[[str], Path]) -> None:
    folder = shared("tables") / "beckhoff_isg"
    sample = (folder / "volcomp_config.lis").read_bytes().replace(b"volcomp1.csv", b"volcomp0.csv")
    assert sample.replace(b"\r", b"") == CONFIG
    assert not CONTROL.lint(files(config=sample))


def test_errors_are_taken_off_and_held_outside() -> None:
    q = np.array([[2.5, 5.0], [99.0, 99.0]])
    found = CONTROL.read(files()).at(("X", "Y"), q)
    assert found == pytest.approx(-np.array([[0.0025, 0.0005], [0.004, 0.002]]), abs=1e-12)  # rounding of sums


def test_rows_may_come_in_any_order() -> None:
    head, *rows = GRID.splitlines(keepends=True)[1:]
    mixed = b"".join([head, *reversed(rows)])
    q = np.array([[1.0, 7.0]])
    assert (CONTROL.read(files(mixed)).at(("X", "Y"), q) == CONTROL.read(files()).at(("X", "Y"), q)).all()


def test_rotary_arguments_are_in_degree() -> None:
    config = CONFIG.replace(b"Interpolation", b"C                       4\nInterpolation")
    grid = b"C EXX\n0 0.000\n90 0.009\n"
    found = CONTROL.read(files(grid, config)).at(("X", "C"), np.array([[0.0, np.pi / 6]]))
    assert found[0, 0] == pytest.approx(-0.003, abs=1e-12)


BROKEN = {
    "a hole": (GRID.replace(b"5 0 0.003 0\n", b""), "no regular grid 2 x 2: 1 nodes missing"),
    "a node twice": (GRID + b"5 0 0.003 0\n", "1 double"),
    "one value too many": (GRID.replace(b"0.003 0\n", b"0.003 0 0\n"), "5 values under 4 names"),
    "one value too few": (GRID.replace(b"0.003 0\n", b"0.003\n"), "3 values under 4 names"),
    "a decimal comma": (GRID.replace(b"0.003", b"0,003"), "decimal comma"),
    "a word": (GRID.replace(b"0.003", b"three"), "not a number"),
    "not finite": (GRID.replace(b"0.003", b"nan"), "not finite"),
    "an unknown name": (GRID.replace(b"EYY", b"EYQ"), "70468"),
    "a name twice": (GRID.replace(b"EYY", b"EXX"), "70469"),
    "a parameter before an argument": (GRID.replace(b"X Y EXX", b"X EXX Y"), "arguments first"),
    "an axis without a number": (GRID.replace(b"X Y EXX", b"X B EXX"), "no axis number"),
    "an angle": (GRID.replace(b"EYY", b"EAX"), "position errors only"),
    "micrometres": (GRID.replace(b"0.004", b"4.0"), "not um"),
    "empty": (b"// nothing\n", "is empty"),
    "not ASCII": (GRID.replace(b"X Y EXX", b"X Y\xa0EXX"), "not ASCII"),
}
BROKEN_CONFIG = {
    "an unknown name": (CONFIG.replace(b"filter_steps ", b"filter_stops "), "70468"),
    "letters of two axes": (CONFIG + b"XY 5\n", "the name 'XY' is not known (error 70468)"),
    "a name twice": (CONFIG + b"X 9\n", "X appears twice"),
    "no value": (CONFIG + b"Y\n", "has no value"),
    "other kinematics": (CONFIG.replace(b"axes          0", b"axes          1"), "workpiece_axes is 1"),
    "no such file": (CONFIG.replace(b"volcomp0", b"volcomp9"), "volcomp9.csv is missing"),
    "another format": (CONFIG.replace(b"ISG_CSV", b"EXCEL"), "file_format[0] is EXCEL"),
    "two axes with one number": (CONFIG.replace(b"Y                       2", b"Y  1"), "same number 1"),
    "no file": (CONFIG[: CONFIG.index(b"file[0]")], "names no file"),
    "file 2 without file 1": (CONFIG + b"file[2] volcomp0.csv\n", "does not follow on"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_broken_grids(case: str) -> None:
    content, expected = BROKEN[case]
    found = CONTROL.lint(files(content))
    assert any(expected in f"{message.text} {message.hint}" for message in found), found
    with pytest.raises(ConfigError):
        CONTROL.read(files(content))


@pytest.mark.parametrize("case", BROKEN_CONFIG)
def test_broken_lists(case: str) -> None:
    content, expected = BROKEN_CONFIG[case]
    found = CONTROL.lint(files(config=content))
    assert any(expected in message.text for message in found), found
    with pytest.raises(ConfigError):
        CONTROL.read(files(config=content))


def test_a_jump_is_doubtful() -> None:
    found = CONTROL.lint(files(GRID.replace(b"0.004", b"0.4")))
    assert {message.code for message in found} == {"NCF492"}


def test_good_files_are_not_remarked_on() -> None:
    assert not CONTROL.lint(files())


TABLE = """
ncfix = 1
name = "table"
topology = "w C A F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-200, 300] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-150, 250] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
axis.A = { type = "rotary", direction = [-1, 0, 0], point = [0, 0, -350], range = [-60, 90] }
axis.C = { type = "rotary", direction = [0, 0, -1], point = [0, 0, -350], range = [0, 120] }

[[effect]]
name = "EBC"
basis = "fourier"
order = [1]
coefficients = [50e-6, 20e-6]
"""


def test_five_axes_have_a_sum_of_grids() -> None:
    """A tilt of the table by B turns with C: X is moved by Z (and what lies above it), Z by X, each over A and C."""
    machine = loads(TABLE)
    options = CONTROL.settings({})
    made = export(CONTROL, Request(machine, ranges_of(machine), 100.0, 0.001, options), 3000)
    assert made.left.before.max() > 0.015
    assert made.left.after.max() < 0.001
    names = sorted(name for name in made.native if name.endswith(".csv"))
    listed = made.native["volcomp.lis"].decode().splitlines()
    assert [line.split()[1] for line in listed if line.startswith("file[")] == [f"C:\\vc\\{name}" for name in names]
    heads = [made.native[name].decode().splitlines()[1].split() for name in names]
    parameters = [word for head in heads for word in head if word.startswith("E")]
    assert len(set(parameters)) == len(parameters)
    assert all(len([word for word in head if not word.startswith("E")]) <= 3 for head in heads)
    assert ["Z", "A", "C", "EXZ"] in [[word for word in head if word != "EYZ"] for head in heads]
    assert made.tables.points < 3000


@pytest.mark.parametrize("settings", [{"grids": "one", "points": "200"}, {"steps": "even"}, {"fit": "area"}])
def test_other_ways_to_fill_them(settings: dict[str, str]) -> None:
    """One grid over five axes has too few nodes: it leaves more."""
    machine = loads(TABLE)
    made = export(CONTROL, Request(machine, ranges_of(machine), 100.0, 0.001, CONTROL.settings(settings)), 1000)
    single = settings.get("grids") == "one"
    assert (made.left.after.max() > 0.001) == single
    assert (len(made.tables.grids) == 1) == single


def test_wrong_settings() -> None:
    machine = loads(TABLE)
    for wrong in ({"fit": "best"}, {"steps": "some"}, {"grids": "two"}, {"points": "7"}, {"axes": "X:1"}):
        with pytest.raises(UsageError) as caught:
            CONTROL.write(Request(machine, ranges_of(machine), 0.0, 0.001, CONTROL.settings(wrong)))
        assert caught.value.code == "NCF485"


# -- leadscrew compensation, as control engineers write it -------------------------------------------------------------


def leadscrew(*lines: str) -> dict[str, bytes]:
    """Lines of an axis list of Y beside the two grids."""
    head = ("kopf.achs_nr 2", "kopf.log_achs_name Y-ACHSE", "kw.ssfk.unit 1")
    text = "\n".join((*head, *(f"kw.ssfk.{line}" for line in lines)))
    return {**files(b"X EXX\n0 0\n10 0\n"), "achskw2.lis": f"{text}\n".encode()}


def moved(tables: dict[str, bytes], way: int) -> list[float]:
    """Corrections of Y at 9 to 13 mm, while it moves this way, mm."""
    q = np.array([[0.0, y] for y in (9.0, 10.0, 11.0, 12.0, 13.0)])
    found = CONTROL.read(tables).at(("X", "Y"), q, np.full(q.shape, float(way)))[:, 1]
    return [round(float(value), 9) for value in found]


EVEN = ("interval 10000", "kw_startpos 100000", "kw_nr_max 3", "bilateral 1")
BOTH = tuple(
    f"table[{i}].{key} {value}"
    for key, row in (("pos", (0, -102, 20)), ("neg", (10, 80, 0)))
    for i, value in enumerate(row)
)


def test_equal_steps_count_from_the_start() -> None:
    """Values are errors in tenths of a micrometre; beyond the ends those of the ends hold."""
    assert moved(leadscrew(*EVEN, *BOTH), 1) == [0.0, 0.0, 0.0102, -0.002, -0.002]
    assert moved(leadscrew(*EVEN, *BOTH), -1) == [-0.001, -0.001, -0.008, 0.0, 0.0]


def test_a_list_for_both_ways_has_the_values_of_one() -> None:
    one = [line for line in BOTH if ".pos" in line]
    for tables in (leadscrew(*EVEN[:3], *one), leadscrew(*EVEN[:3], "bilateral 0", *one)):
        assert moved(tables, 1) == moved(tables, -1) == [0.0, 0.0, 0.0102, -0.002, -0.002]
        assert not CONTROL.lint(tables)
    (message,) = CONTROL.lint(leadscrew(*EVEN[:3], "bilateral 0", *BOTH))
    assert "never used" in message.text


def test_setpoints_beside_equal_steps_must_agree() -> None:
    places = tuple(f"table[{i}].setpoint {100000 + 10000 * i}" for i in range(3))
    assert moved(leadscrew(*EVEN, *BOTH, *places), 1) == moved(leadscrew(*EVEN, *BOTH), 1)
    with pytest.raises(ConfigError, match="by start and interval at 110000"):
        CONTROL.read(leadscrew(*EVEN, *BOTH, "table[1].setpoint 110001"))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("interval 0.5", "interval is 0.5"),
        ("kw_startpos 1,5", "kw_startpos is 1,5"),
        ("modulo 1", "modulo is 1"),
        ("unit 0", "unit is 0"),
        ("interval 0", "a point without setpoint"),
    ],
)
def test_leadscrew_lists_that_cannot_be_read(line: str, said: str) -> None:
    name = line.split()[0]
    lines = [each for each in (*EVEN, *BOTH) if not each.startswith(f"{name} ")]
    tables = leadscrew(*lines, line)
    tables["achskw2.lis"] = tables["achskw2.lis"].replace(b"kw.ssfk.unit 1\n", b"", name == "unit")
    with pytest.raises(ConfigError) as caught:
        CONTROL.read(tables)
    assert said in str(caught.value)


def test_a_list_in_increments_is_looked_at_but_not_run() -> None:
    tables = leadscrew(*EVEN, *BOTH)
    alone = {"achskw2.lis": tables["achskw2.lis"].replace(b"unit 1", b"unit 0 /* increments */")}
    assert [(each.code, "increments" in each.text) for each in CONTROL.look(alone)] == [("NCF492", True)]
    with pytest.raises(ConfigError, match="unit is 0"):
        CONTROL.read({**tables, **alone})


@pytest.mark.parametrize("negate", ["", "XY", "z"])
def test_what_the_control_turns_round_is_written_the_other_way_round(negate: str) -> None:
    """`negate XY` in the list (P-VOLC-00009) turns the compensation of X and Y: the same must be added all the same."""
    control = get_control("isg")
    machine = single_error("EXX", 0.02)
    settings = control.settings({"negate": negate})
    made = export(control, Request(machine, ranges_of(machine), 0.0, 0.001, settings), 500)
    assert made.left.after.max() < 0.0011
    listed = made.native["volcomp.lis"].decode()
    assert (f"negate                  {negate.upper()}\n" in listed) is bool(negate)
    without = {**made.native, "volcomp.lis": listed.replace(f"negate                  {negate.upper()}\n", "").encode()}
    names, q = machine.axis_names, np.array([[250.0, 10.0, -20.0]])
    signs = [-1.0 if name in negate.upper() else 1.0 for name in names]
    assert control.read(without).at(names, q) == pytest.approx(control.read(made.native).at(names, q) * signs)


def test_lists_from_elsewhere_may_turn_axes_round_or_leave_them() -> None:
    control = get_control("isg")
    machine = single_error("EXX", 0.02)
    made = export(control, Request(machine, ranges_of(machine), 0.0, 0.001, control.settings({})), 100).native
    names, q = machine.axis_names, np.array([[250.0, 10.0, -20.0]])
    before = control.read(made).at(names, q)
    for line, factor in ((b'NEGATE "X"\n', -1.0), (b"set_to_zero X\n", 0.0), (b"diagnosis_file C:\\log.txt\n", 1.0)):
        files = {**made, "volcomp.lis": made["volcomp.lis"] + line}
        assert control.lint(files) == ()
        assert control.read(files).at(names, q)[0, 0] == pytest.approx(factor * before[0, 0])
    for line in (b"negate XQ\n", b"use_axis_offsets 1\n"):
        with pytest.raises(ConfigError):
            control.read({**made, "volcomp.lis": made["volcomp.lis"] + line})
