"""The machine file: a message for every mistake, all of them at once, and never another exception."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from machine.files import GOOD, changed, faults
from ncfix.diagnostics import ConfigError
from ncfix.machine import dumps, load, loads

EFFECT = 'name = "EC0Y"\ncoefficients = [12e-6]'

MISTAKES = [
    # the file
    ("name = \"DMU 50 eVolution\"", "name = ", "NCF301", "not TOML"),
    ("ncfix = 1 ", "ncfix = 3 ", "NCF317", "version 3 of the machine file; this ncfix reads version 1"),
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
    (EFFECT, 'name = "EC0Y"\ncoefficients = [1, 2]', "NCF311", "2 coefficients, but the basis constant needs 1"),
    (EFFECT, EFFECT + "\ndegree = [1]", "NCF302", "unknown key 'degree'"),
    (EFFECT, EFFECT + "\ncarried = 1", "NCF304", "expected true or false, found 1"),
    (EFFECT, EFFECT + "\nscale = 0", "NCF305", "the scale cannot be zero"),
    (EFFECT, EFFECT + "\ncovariance = [[-1.0]]", "NCF312", "a variance is negative"),
    (EFFECT, EFFECT + "\ncovariance = [[1.0, 0]]", "NCF304", "expected 1 rows of 1 numbers"),
    (EFFECT, EFFECT + '\ninput = "Q"', "NCF314", "'Q' is neither an axis of this machine nor the name of an input"),
    (EFFECT, EFFECT + "\ntime_constant_s = 5", "NCF315", "a time constant needs an `input`, but none is given"),
    (EFFECT, EFFECT + '\nbasis = "polynomial"\ndegree = [1]', "NCF315", "no position for polynomial to depend on"),
    (EFFECT, EFFECT + '\nbasis = "backlash"', "NCF315", "EC0Y has no direction of motion"),
    (EFFECT, EFFECT + '\nbasis = "splin"', "NCF310", "there is no basis 'splin' | did you mean 'spline'?"),
    ('[1, 2, 3]\ncenter', '[1, 2, 2]\ncenter', "NCF316", "has a value twice"),
    ('[1, 2, 3]\ncenter', '[1, 2]\ncenter', "NCF311", "3 coefficients, but the basis polynomial needs 2 | one each"),
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


@pytest.mark.parametrize(
    ("old", "new", "codes"),
    [
        ("[12e-6]", "[12e-6, 1]\ncovariance = [[1]]", ["NCF311", "NCF304"]),
        ("[12e-6]", "[inf]\ncovariance = [[1]]", ["NCF305"]),
        ("[12e-6]", "5\ncovariance = [[1]]", ["NCF304"]),
        ('input = "temp_spindle"', 'input = "Temp"', ["NCF314"]),
        ('input = "temp_spindle"', "input = 5", ["NCF304"]),
    ],
)
def test_one_mistake_does_not_make_others(old: str, new: str, codes: list[str]) -> None:
    assert [fault.code for fault in faults(changed(old, new))] == codes


def test_a_key_below_the_tables_is_not_a_key_of_the_file() -> None:
    (fault,) = faults(changed("pitch = 10.0", "max_correction = { linear = 1 }"))
    assert fault.hint == "move it above the first table; here it is a key of axis.X"


def test_a_misspelled_table_is_shown_where_it_stands() -> None:
    fault = next(each for each in faults(changed("[axis.C]", "[axs.C]")) if "axs" in each.text)
    assert fault.place is not None
    assert (fault.place.text, fault.hint) == ("[axs.C]", "did you mean 'axis'?")


def test_numbers_that_no_machine_has() -> None:
    assert "larger than any value" in faults(changed("[0, 0, 154.996]", "[0, 0, 1e300]"))[0].text
    assert "larger than any value" in faults(changed("[0, 0, 154.996]", f"[0, 0, 1{'0' * 400}]"))[0].text
    assert "thousands of digits" in faults(changed("[0, 0, 154.996]", f"[0, 0, 1{'0' * 5000}]"))[0].text
    assert "exceeds 1000" in faults(changed("degree = [1, 2, 3]", "degree = [1, 2, 999999999]"))[0].text
    assert "is not a possible scale" in faults(changed("scale = 250.0", "scale = 1e-320"))[0].text
    text = changed("degree = [1, 2, 3]\ncenter = 250.0\nscale = 250.0", "degree = [1, 2, 900]")
    (fault,) = faults(text)
    assert (fault.code, fault.text) == ("NCF305", "effect[0]: the effect is not finite at the ends of the travel")


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


@settings(max_examples=some(200), deadline=None)
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
    (tmp_path / "latin.toml").write_bytes(b'ncfix = 1\r\nname = "M\xfchle"\r\n')
    with pytest.raises(
        ConfigError, match=r"latin.toml:2:10: NCF301: not a text in UTF-8: byte 0xFC\n    name = "
    ) as raised:
        load(tmp_path / "latin.toml")
    assert raised.value.messages[0].hint == "save it as UTF-8"
    for encoding in ("utf-8", "utf-8-sig"):
        (tmp_path / "good.toml").write_text(GOOD, encoding=encoding)
        assert load(tmp_path / "good.toml") == loads(GOOD)


def test_a_setup_file_is_known_for_one() -> None:
    found = faults("[work_offsets]\nG54 = [0, 0, 0]\n[tools]\n1 = { length = 100.0 }\n")
    assert [(each.code, each.text) for each in found] == [("NCF303", "this is a setup file, not a machine file")]
