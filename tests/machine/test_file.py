"""The machine file: what it means, that it comes back as it was, and a message for every mistake."""

from __future__ import annotations

import math
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from machine import chains
from ncfix.diagnostics import ConfigError, ExitCode, Message
from ncfix.machine import Axis, Effect, Machine, Tool, dumps, load, loads
from ncfix.machine.codes import CODES
from ncfix.machine.piecewise import Spline, Step, Table
from ncfix.machine.smooth import Backlash, Fourier, Periodic, Polynomial

GOOD = """\
ncfix = 1                         # schema version
name = "DMU 50 eVolution"
topology = "w C B F X Y Z t"
control = "heidenhain"
least_increment = { linear = 0.001, rotary = 0.002 }
max_correction = { linear = 0.25, rotary = 0.1 }

[axis.X]
type = "linear"
direction = [1, 0, 0]
range = [0, 500]
pitch = 10.0

[axis.Y]
type = "linear"
direction = [0, 2, 0]

[axis.Z]
type = "linear"
direction = [0, 0, 1]
range = [-400, 0]

[axis.B]
type = "rotary"
direction = [0, -0.7071067811865476, 0.7071067811865476]
point = [0, 0, 154.996]
range = [0, 180]
error_axes = [[1, 0, 0], [0, 0.70710678, 0.70710678], [0, -0.70710678, 0.70710678]]
error_frame = "moving"

[axis.C]
type = "rotary"
direction = [0, 0, -1]

[tool]
direction = [0, 0, 1]
point = [0, 0, 120]

[[effect]]
name = "EXX"
basis = "polynomial"
degree = [1, 2, 3]
center = 250.0
scale = 250.0
coefficients = [0.0103, -0.0021, 0.0004]
covariance = [[4e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-8]]
reference = [0, 0, -275.86]

[[effect]]
name = "EC0Y"
coefficients = [12e-6]

[[effect]]
name = "EZS"
basis = "polynomial"
degree = [1]
input = "temp_spindle"
time_constant_s = 1800
coefficients = [0.0006]

[provenance]
date = 2026-11-21
source = "laser-tracker-2026-11.csv"
nested = { runs = [1, 2], "odd key" = true }
"""


def faults(text: str) -> tuple[Message, ...]:
    """The messages on a machine file that is wrong."""
    with pytest.raises(ConfigError) as caught:
        loads(text, "m.toml")
    assert caught.value.exit_code is ExitCode.UNREADABLE
    assert all(message.code in CODES for message in caught.value.messages)
    return caught.value.messages


def changed(old: str, new: str) -> str:
    """The good file with one place changed."""
    assert GOOD.count(old) == 1, old
    return GOOD.replace(old, new)


def test_what_a_file_means() -> None:
    machine = loads(GOOD)
    assert machine.axis_names == ("C", "B", "X", "Y", "Z")
    assert machine.topology == "w C B F X Y Z t"
    assert machine.name == "DMU 50 eVolution"
    assert machine.control == "heidenhain"
    assert machine.rotary.tolist() == [True, True, False, False, False]
    assert machine.least_increment == (0.001, math.radians(0.002))
    assert machine.max_correction == (0.25, math.radians(0.1))
    np.testing.assert_allclose(
        machine.ranges, [[-np.inf, np.inf], [0, np.pi], [0, 500], [-np.inf, np.inf], [-400, 0]], rtol=1e-15
    )
    c, b, x, y, _ = machine.axes
    assert (c.workpiece_side, b.workpiece_side, x.workpiece_side) == (True, True, False)
    assert c.endless
    assert not y.endless
    assert y.direction == (0.0, 1.0, 0.0)
    assert x.pitch == 10.0
    assert b.moving_frame
    np.testing.assert_allclose(b.error_axes @ np.transpose(b.error_axes), np.eye(3), atol=1e-15)
    assert machine.tool == Tool((0.0, 0.0, 1.0), (0.0, 0.0, 120.0))
    positioning, square, growth = machine.effects
    assert positioning.basis == Polynomial((1, 2, 3))
    assert positioning.reference == (0.0, 0.0, -275.86)
    assert positioning.covariance == ((4e-8, 0, 0), (0, 1e-8, 0), (0, 0, 1e-8))
    assert square == Effect("EC0Y", (12e-6,))
    assert (growth.input, growth.time_constant_s) == ("temp_spindle", 1800.0)
    assert machine.inputs == {"temp_spindle", "time_s"}
    assert str(machine.provenance["date"]) == "2026-11-21"


def test_the_polynomial_s_u_is_in_the_file_s_unit() -> None:
    extra = '[[effect]]\nname = "ECC"\nbasis = "polynomial"\ndegree = [1]\n'
    extra += "center = 90\nscale = 45\ncoefficients = [1e-5]\n\n"
    machine = loads(changed("[provenance]", extra + "[provenance]"))
    machine = machine.replace(effects=tuple(e for e in machine.effects if e.name in ("EXX", "ECC")))
    q = np.array([np.pi, 0, 500, 0, 0])
    errors = machine.joint_errors(q)
    assert errors[0, 5] == pytest.approx(2e-5)
    assert errors[2, 0] == pytest.approx(0.0103 - 0.0021 + 0.0004)


def test_the_simplest_file() -> None:
    machine = loads('topology = "wFXt"\n[axis.X]\ntype = "linear"\ndirection = [1, 0, 0]\n', "folder/mill.toml")
    assert machine == Machine("mill", "w F X t", (Axis("X", False, False, (1.0, 0.0, 0.0)),))
    assert machine.max_correction == (0.5, math.radians(0.05))
    assert machine.is_perfect


def test_the_spindle_in_the_topology_is_optional_and_kept() -> None:
    with_spindle = loads(changed("X Y Z t", "X Y Z S t"))
    assert with_spindle.topology == "w C B F X Y Z S t"
    assert with_spindle.axes == loads(GOOD).axes
    assert loads(dumps(with_spindle)) == with_spindle


# -- coming back ------------------------------------------------------------------------------------------------------


def test_the_file_comes_back_as_it_was() -> None:
    machine = loads(GOOD)
    assert loads(dumps(machine)) == machine
    assert dumps(loads(dumps(machine))) == dumps(machine)
    assert "range = [0.0, 180.0]" in dumps(machine)


def test_every_basis_and_option_comes_back() -> None:
    knots = (0.0, 0.0, 0.0, 0.0, 250.0, 500.0, 500.0, 500.0, 500.0)
    effects = (
        Effect("EXX", (1e-3, 2e-3), Backlash((0, 1)), scale=500.0),
        Effect(
            "EYX",
            (0.1, 0.2, 0.3),
            Table((0.0, 1 / 3, 500.0)),
            center=1.0,
            times="Z",
            times_center=-5.0,
            times_scale=7.0,
        ),
        Effect("EZX", (0.0, 1.0, 2.0, 3.0, 4.0), Spline(knots, 3)),
        Effect("EAX", (1e-5, 2e-5), Periodic((1,), 10.0)),
        Effect("ECC", (1e-5, 2e-5), Fourier((3,))),
        Effect("EBX", (1e-5, 2e-5, 3e-5), Step((5.0, 6.0), "negative")),
        Effect("EX0C", (0.01,), carried=True, reference=(1.0, 2.0, 1 / 3)),
        Effect("EY0C", (0.01,), Polynomial((1,)), input="temp_table", time_constant_s=0.1),
        Effect("EZX", (0.5,), input="X"),
    )
    machine = loads(GOOD).replace(effects=effects, workpiece_offset=(1.0, 2.0, 3.5), provenance={})
    assert loads(dumps(machine)) == machine


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), low=st.integers(-36000, 0), high=st.integers(1, 36000))
def test_any_machine_comes_back(seed: int, low: int, high: int) -> None:
    """Ranges of rotary axes in hundredths of a degree; everything else any number."""
    rng = np.random.default_rng(seed)
    machine = chains.random_errors(rng, chains.random_chain(rng, 5))
    degree = math.pi / 180
    limits = (low / 100 * degree, high / 100 * degree)
    axes = tuple(
        Axis(a.name, a.rotary, a.workpiece_side, a.direction, a.point, limits if a.rotary else (low / 7, high / 7),
             chains.triad(rng), bool(rng.integers(2)), 3.3)
        for a in machine.axes
    )  # fmt: skip
    machine = machine.replace(axes=axes)
    again = loads(dumps(machine), "random.toml")
    assert again == loads(dumps(again))
    assert again.effects == machine.effects
    assert again.tool.point == machine.tool.point
    for mine, theirs in zip(machine.axes, again.axes, strict=True):
        assert (mine.range, mine.point, mine.pitch) == (theirs.range, theirs.point, theirs.pitch)
        np.testing.assert_allclose(mine.direction, theirs.direction, atol=1e-15)
        np.testing.assert_allclose(mine.error_axes, theirs.error_axes, atol=1e-14)


def test_what_changes_the_hash_and_what_does_not() -> None:
    machine = loads(GOOD)
    assert len(machine.hash) == 12
    assert int(machine.hash, 16) >= 0
    for same in (
        loads(changed("DMU 50", "DMU 60")),
        loads(changed("covariance", "#")),
        loads(changed("2026-11-21", "2026-11-22")),
        loads(changed("pitch = 10.0", "")),
        machine.replace(effects=(*machine.effects, Effect("EYY", (0.0,)))),
        loads(dumps(machine)),
    ):
        assert same.hash == machine.hash
    for other in (
        loads(changed("0.0103", "0.01030001")),
        loads(changed("154.996", "154.997")),
        loads(changed("linear = 0.25", "linear = 0.26")),
        loads(changed("[0, 0, -275.86]", "[0, 0, -275.87]")),
        machine.replace(workpiece_offset=(0.0, 0.0, 1.0)),
    ):
        assert other.hash != machine.hash


# -- mistakes ---------------------------------------------------------------------------------------------------------

EFFECT = 'name = "EC0Y"\ncoefficients = [12e-6]'

MISTAKES = [
    # the file
    ("name = \"DMU 50 eVolution\"", "name = ", "NCF301", "not TOML"),
    ("ncfix = 1 ", "ncfix = 3 ", "NCF317", "schema version 3, this ncfix reads 1"),
    ('control = "heidenhain"', 'contrl = "heidenhain"', "NCF302", "unknown key 'contrl' | did you mean 'control'?"),
    ("topology = \"w C B F X Y Z t\"", "", "NCF303", "key 'topology' is missing"),
    ('control = "heidenhain"', "control = 5", "NCF304", "control: expected a string, found 5"),
    ('control = "heidenhain"', "workpiece_offset = [1, 2]", "NCF304", "a list of 3 numbers, found a list of 2"),
    ("linear = 0.001", "linear = 0", "NCF305", "least_increment.linear: 0 is not positive"),
    ("linear = 0.001", "liner = 0.001", "NCF302", "did you mean 'linear'?"),
    # topology
    ("X Y Z t", "X Y Z Z t", "NCF306", "axis Z is named twice"),
    ("w C B F", "w C B", "NCF306", "the foundation F must be named once, not 0 times"),
    ("w C B F", "C B F", "NCF306", "it must start with w"),
    ("X Y Z t", "X Y Z", "NCF306", "it must end with t"),
    ("X Y Z t", "S X Y Z t", "NCF306", "the spindle S can only stand last"),
    ("X Y Z t", "X Y z t", "NCF306", "'z' is not an axis letter"),
    ("X Y Z t", "X Y t", "NCF307", "axis.Z: axis Z is not in the topology"),
    ("X Y Z t", "X Y Z V t", "NCF307", "axis V has no table [axis.V]"),
    ("[axis.Z]", "[axis.S]", "NCF307", "S is the spindle, not an axis"),
    # axes
    ("pitch = 10.0", "ptch = 10.0", "NCF302", "axis.X.ptch: unknown key 'ptch' | did you mean 'pitch'?"),
    ("pitch = 10.0", "pitch = -1", "NCF305", "axis.X.pitch: -1 is not positive"),
    ("range = [0, 500]", "range = [500, 500]", "NCF308", "axis.X.range: empty range: 500 is not below 500"),
    ("range = [0, 500]", "range = [0, inf]", "NCF305", "inf is not a finite number"),
    ("range = [0, 500]", "range = [0, 500, 600]", "NCF304", "expected a list of 2 numbers, found a list of 3"),
    ("direction = [1, 0, 0]", "direction = [1, 0]", "NCF304", "axis.X.direction: expected a list of 3 numbers"),
    ("direction = [1, 0, 0]", 'direction = [1, 0, "0"]', "NCF304", "expected a list of 3 numbers, found '0'"),
    ("direction = [1, 0, 0]", "direction = [0, 0, 0]", "NCF313", "a direction cannot be zero"),
    ("direction = [1, 0, 0]", "", "NCF303", "axis.X: key 'direction' is missing"),
    ("point = [0, 0, 154.996]", "point = [0, 0, nan]", "NCF305", "axis.B.point: nan is not a finite number"),
    ("range = [0, 500]", "type = \"linear\"", "NCF301", "not TOML"),
    ('error_frame = "moving"', 'error_frame = "turning"', "NCF304", "neither fixed nor moving"),
    ("[0, -0.70710678, 0.70710678]]", "[0, 0.70710678, -0.70710678]]", "NCF313", "not a right-handed triad"),
    ("[0, -0.70710678, 0.70710678]]", "[0, -0.7071, 0.7]]", "NCF313", "not a right-handed triad"),
    ("[0, -0.70710678, 0.70710678]]", "[0, -0.7071]]", "NCF304", "3 rows of 3 numbers"),
    # effects
    (EFFECT, 'name = "EXQ"\ncoefficients = [1]', "NCF309", "'EXQ' is not an effect of this machine: it has no axis Q"),
    (EFFECT, 'name = "EXYX"\ncoefficients = [1]', "NCF309", "did you mean"),
    (EFFECT, "coefficients = [1]", "NCF303", "effect[1]: key 'name' is missing"),
    (EFFECT, 'name = "EC0Y"', "NCF303", "effect[1]: key 'coefficients' is missing"),
    (EFFECT, 'name = "EC0Y"\ncoefficients = 12e-6', "NCF304", "expected a list of numbers, found 1.2e-05"),
    (EFFECT, 'name = "EC0Y"\ncoefficients = [nan]', "NCF305", "nan is not a finite number"),
    (EFFECT, 'name = "EC0Y"\ncoefficients = [true]', "NCF304", "expected a list of numbers, found true"),
    (EFFECT, 'name = "EC0Y"\ncoefficients = [1, 2]', "NCF311", "2 coefficients, the basis constant has 1"),
    (EFFECT, EFFECT + "\ndegree = [1]", "NCF302", "unknown key 'degree'"),
    (EFFECT, EFFECT + "\ncarried = 1", "NCF304", "expected true or false, found 1"),
    (EFFECT, EFFECT + "\nscale = 0", "NCF305", "the scale cannot be zero"),
    (EFFECT, EFFECT + "\ncovariance = [[-1.0]]", "NCF312", "a variance is negative"),
    (EFFECT, EFFECT + "\ncovariance = [[1.0, 0]]", "NCF304", "expected 1 rows of 1 numbers"),
    (EFFECT, EFFECT + '\ninput = "Q"', "NCF314", "'Q' is neither an axis of this machine nor the name of an input"),
    (EFFECT, EFFECT + "\ntime_constant_s = 5", "NCF315", "a lag acts on an `input`, and there is none"),
    (EFFECT, EFFECT + '\nbasis = "polynomial"\ndegree = [1]', "NCF315", "no position for polynomial to depend on"),
    (EFFECT, EFFECT + '\nbasis = "backlash"', "NCF315", "EC0Y has no direction of motion"),
    (EFFECT, EFFECT + '\nbasis = "splin"', "NCF310", "there is no basis 'splin' | did you mean 'spline'?"),
    ('[1, 2, 3]\ncenter', '[1, 2, 2]\ncenter', "NCF316", "names a value twice"),
    ('[1, 2, 3]\ncenter', '[1, 2]\ncenter', "NCF311", "3 coefficients, the basis polynomial has 2 | one each"),
    ('[1, 2, 3]\ncenter', '3\ncenter', "NCF304", "expected a list of whole numbers, found 3"),
    ("degree = [1, 2, 3]", "degre = [1, 2, 3]", "NCF303", "key 'degree' is missing | did you mean 'degre'?"),
    ("[0, 1e-8, 0]", "[1e-8, 1e-8, 0]", "NCF312", "not symmetric"),
    ('"polynomial"\ndegree = [1, 2, 3]', '"fourier"\norder = [1]', "NCF315", "needs the angle of a rotary axis"),
    ('"polynomial"\ndegree = [1, 2, 3]', '"spline"\nknots = [0]\ndegree = 1.5', "NCF304", "a whole number, found 1.5"),
    ('name = "EXX"', 'name = "EXX"\ncarried = true', "NCF315", "EXX is not a location error"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "code", "what"), MISTAKES)
def test_every_mistake_has_its_message(old: str, new: str, code: str, what: str) -> None:
    """Of this code, with these words, and it shows the line that is wrong or the head of its table."""
    assert old in GOOD
    found = faults(GOOD.replace(old, new, 1))
    matching = [each for each in found if each.code == code and what in f"{each.text} | {each.hint}"]
    assert matching, found
    assert all(each.place is not None and each.place.line > 0 for each in matching)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("range = [0, 500]", "range = [5, 5]", "range = [5, 5]"),
        ("[1, 2, 3]\ncenter", "[1, 2, 2]\ncenter", "degree = [1, 2, 2]"),
        ("[12e-6]", "[12e-6, 1]", "coefficients = [12e-6, 1]"),
        ("[0, 1e-8, 0]", "[0, 1e-8]", "covariance = [[4e-8, 0, 0], [0, 1e-8], [0, 0, 1e-8]]"),
        ('name = "EC0Y"', "", "[[effect]]"),
    ],
)
def test_the_line_that_is_wrong_is_named(old: str, new: str, line: str) -> None:
    text = changed(old, new)
    (fault,) = faults(text)
    assert fault.place is not None
    assert fault.place.text == line
    assert text.splitlines()[fault.place.line - 1] == line


def test_all_mistakes_at_once_in_the_order_of_the_file() -> None:
    text = (
        GOOD.replace("[0, 500]", "[5, 5]")
        .replace("[12e-6]", "[nan]")
        .replace("control", "contrl")
        .replace("X Y Z t", "X Y Y Z t")
    )
    assert [fault.code for fault in faults(text)] == ["NCF306", "NCF302", "NCF308", "NCF305"]


def test_a_message_shows_the_line() -> None:
    with pytest.raises(ConfigError) as caught:
        loads(changed("pitch", "  ptch"), "m.toml")
    assert str(caught.value).splitlines() == [
        "m.toml:12:3: NCF302: axis.X.ptch: unknown key 'ptch'",
        "      ptch = 10.0",
        "      ^",
        "  hint: did you mean 'pitch'?",
    ]


JUNK = [
    "5",
    "-1",
    "nan",
    "true",
    '"x"',
    "[]",
    "[1]",
    "[[1]]",
    "[1, 2, 3]",
    "{}",
    "2026-01-01",
    "[[0, 0], [0]]",
    "",
    "=",
]


@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_whatever_is_in_the_file_the_answer_is_a_machine_or_messages(data: st.DataObject) -> None:
    """Lines dropped, doubled or with junk for a value: never another exception."""
    lines = GOOD.splitlines()
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(lines) - 1))
        kind = data.draw(st.sampled_from(["drop", "double", "junk", "junk", "junk"]))
        if kind == "junk" and "=" in lines[at]:
            lines[at] = lines[at].split("=")[0] + "= " + data.draw(st.sampled_from(JUNK))
        elif kind == "double":
            lines.insert(at, lines[at])
        else:
            lines[at] = ""
    machine = None
    with suppress(ConfigError):
        machine = loads("\n".join(lines))
    assert machine is None or dumps(loads(dumps(machine))) == dumps(machine)


def test_values_where_tables_should_be() -> None:
    found = faults('topology = "w F X t"\naxis = 3\neffect = 5\ntool = []\nleast_increment = 1\n')
    assert [fault.code for fault in found] == ["NCF304"] * 4
    found = faults('topology = "w F X t"\naxis.X = 3\n')
    assert [fault.text for fault in found] == ["axis.X: expected a table [axis.X], found 3"]
    found = faults('topology = "w F X t"\neffect = [5]\n[axis.X]\ntype = "linear"\ndirection = [1, 0, 0]\n')
    assert "expected tables [[effect]], found a list of 1" in found[0].text


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="NCF300: cannot read the machine file: No such file"):
        load(tmp_path / "missing.toml")
    (tmp_path / "binary.toml").write_bytes(b'name = "\xff\xfe"')
    with pytest.raises(ConfigError, match=r"binary.toml: NCF301: not a text in UTF-8 \(byte 8\)"):
        load(tmp_path / "binary.toml")
    (tmp_path / "good.toml").write_text(GOOD, encoding="utf-8")
    assert load(tmp_path / "good.toml") == loads(GOOD)
