"""Files that were damaged in any way are read or refused, in words: never a fault of the reader."""

from __future__ import annotations

import json
import random
import warnings
from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
import pytest

from conftest import some
from ncfix.diagnostics import NcfixError
from ncfix.machine import Effect, loads
from ncfix.machine.basis import Backlash, Fourier, Polynomial
from ncfix.tables.control import Control, Request, get_control
from ncfix.tables.correction import ranges_of
from ncfix.tables.forms import FORMS, read_form

SETTINGS: dict[str, dict[str, str]] = {
    "fanuc": {"sign": "error", "template": "N{no}A1P{dx}A2P{dy}A3P{dz};"},
    "fanuc-pitch": {"sign": "error"},
    "fanuc-rotary": {"sign": "error"},
    "gcode": {},
    "heidenhain": {"sign": "error", "backlash": "on"},
    "heidenhain-kinematics": {"sign": "error", "angle_unit": "deg", "backlash": "on"},
    "isg": {},
    "linuxcnc": {},
    "siemens": {"value_sign": "error", "product_terms": "only", "positioning": "eec"},
}
MACHINE = """
ncfix = 1
name = "fuzz"
topology = "w C F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-200, 300] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-150, 250] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
axis.C = { type = "rotary", direction = [0, 0, -1] }
"""
EFFECTS = (
    Effect("EXX", (0.01, 0.004), Polynomial((1, 2)), scale=200.0),
    Effect("EXX", (0.002,), Backlash((0,))),
    Effect("EBX", (20e-6,), Polynomial((1,)), scale=200.0),
    Effect("EYY", (0.006,), Polynomial((1,)), scale=200.0),
    Effect("ECC", (20e-6, 10e-6), Fourier((1,))),
)
WORDS = (
    b"nan",
    b"inf",
    b"1e999",
    b"-",
    b"",
    b"0",
    b"-1",
    b"99999999999999999999",
    b"1,5",
    b"\xb2",
    b"\x85",
    b"[",
    b"=",
)
ROUNDS = some(120)
Damage = Callable[[random.Random, bytes], bytes]


@cache
def fresh(name: str) -> tuple[Control, dict[str, bytes]]:
    machine = loads(MACHINE).replace(effects=EFFECTS)
    control = get_control(name)
    request = Request(machine, ranges_of(machine), 50.0, 0.004, control.settings(SETTINGS[name]))
    return control, dict(control.write(request).files)


def flipped(chance: random.Random, content: bytes) -> bytes:
    place = chance.randrange(len(content) + 1)
    return content[:place] + bytes([chance.randrange(256)]) + content[place + 1 :]


def cut(chance: random.Random, content: bytes) -> bytes:
    start, stop = sorted(chance.randrange(len(content) + 1) for _ in range(2))
    return content[:start] + content[stop:]


def word(chance: random.Random, content: bytes) -> bytes:
    words = content.split(b" ") if chance.random() < 0.5 else content.replace(b"=", b"= ").split(b" ")
    words[chance.randrange(len(words))] = chance.choice(WORDS)
    return b" ".join(words)


def number(chance: random.Random, content: bytes) -> bytes:
    digits = [place for place, byte in enumerate(content) if byte in b"0123456789"]
    place = chance.choice(digits or [0])
    return content[:place] + chance.choice(WORDS) + content[place + 1 :]


def lines(chance: random.Random, content: bytes) -> bytes:
    rows = content.split(b"\n")
    what = chance.randrange(4)
    row = chance.randrange(len(rows))
    if what == 0:
        rows.insert(row, chance.choice(rows))
    elif what == 1:
        del rows[row]
    elif what == 2:
        rows.insert(row, chance.choice((b"", b"%", b"; x", b"// x", b"# x", b"[END]", b"\xff\xfe", b"\t")))
    else:
        chance.shuffle(rows)
    return b"\n".join(rows)


def ends(chance: random.Random, content: bytes) -> bytes:
    return content.replace(b"\n", chance.choice((b"\r\n", b"\r", b"\n\n", b" \n", b"")))


DAMAGES: tuple[Damage, ...] = (flipped, cut, word, number, lines, ends)


def damaged(chance: random.Random, files: Mapping[str, bytes]) -> dict[str, bytes]:
    found = dict(files)
    for _ in range(chance.choice((1, 1, 1, 3))):
        name = chance.choice(sorted(found))
        found[name] = chance.choice(DAMAGES)(chance, found[name])
    if chance.random() < 0.1:
        del found[chance.choice(sorted(found))]
    return found


def look(control: Control, files: Mapping[str, bytes]) -> bool:
    """Whether they can be read; what is read can be run, and is finite."""
    control.lint(files)
    try:
        tables = control.read(files)
    except NcfixError:
        return False
    names = ("C", "X", "Y", "Z")
    if tables.axes <= set(names):
        for length in (0.0, 50.0):
            found = tables.for_tool(length).at(names, np.array([[0.1, 10.0, 20.0, -30.0], [9.0, 900.0, 900.0, 900.0]]))
            assert np.isfinite(found).all()
    return True


@pytest.mark.parametrize("name", SETTINGS)
def test_damaged_files(name: str) -> None:
    control, files = fresh(name)
    assert look(control, files)
    chance = random.Random(7)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        refused = sum(not look(control, damaged(chance, files)) for _ in range(ROUNDS))
    assert refused > ROUNDS / 4  # most damage shows


@pytest.mark.parametrize("name", ["fanuc", "fanuc-rotary"])
@pytest.mark.parametrize("value", [None, True, "1", [], {}, -1, 0, 1.5, 1e308, float("nan"), 10**30])
def test_anything_in_place_of_a_value_in_records(name: str, value: object) -> None:
    control, files = fresh(name)
    for file in (file for file in files if file.endswith(".json")):
        found = json.loads(files[file])
        for key in found:
            look(control, {**files, file: json.dumps({**found, key: value}).encode()})
        for key in found["records"][0]:
            record = {**found["records"][0], key: value}
            changed = {**found, "records": [record, *found["records"][1:]]}
            look(control, {**files, file: json.dumps(changed).encode()})


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
def test_anything_is_read_or_remarked_on(form: object) -> None:
    chance = random.Random(11)
    for _ in range(200):
        content = bytes(chance.choice(b"0123456789.,-+eEXYZ=[]#;/ \t\r\n\x85\xff") for _ in range(chance.randrange(80)))
        document, remarks = read_form(form, "x", content)  # type: ignore[arg-type]
        assert remarks.wrong or document.content() == content or b"\r" in content
