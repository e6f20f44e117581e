"""Machines that cannot be give no program and no table; machines that there are need no `--force`, of any size."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.hidden.model import machine_toml
from tests.hidden.workshop import TOPOLOGIES, draw_machine, draw_model

from conftest import some
from ncfix.diagnostics import ExitCode
from ncfix.machine import load, loads
from ncfix.machine.plausible import doubts

HONEST = int(os.environ.get("NCFIX_HONEST") or some(12))
"""How many machines of each kind are drawn."""

FIVE = """
ncfix = 1
name = "five axes"
topology = "w C A F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [0, 500], pitch = 10.0 }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [0, 400] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
axis.A = { type = "rotary", direction = [-1, 0, 0], point = [0, 0, 100], range = [-30, 120] }
axis.C = { type = "rotary", direction = [0, 0, -1], point = [0, 0, 120] }
"""
CUBIC = 'basis = "polynomial"\ndegree = [1, 2, 3]'
WAVE = 'basis = "fourier"\norder = [1]'
QUARTERS = [0, 1.5708, 3.1416, 4.7124, 6.2832]
ONE_LINE = ("[-1, 0, 0], point = [0, 0, 100]", "[0, 0, 1], point = [0, 0, 3]")


def effect(name: str, *coefficients: float, more: str = "") -> str:
    return f'[[effect]]\nname = "{name}"\ncoefficients = {list(coefficients)}\n{more}\n'


def polynomial(name: str, *coefficients: float) -> str:
    degree = list(range(1, len(coefficients) + 1))
    return effect(name, *coefficients, more=f'basis = "polynomial"\ndegree = {degree}\ncenter = 250\nscale = 250')


def table(name: str, positions: list[float], values: list[float]) -> str:
    return effect(name, *values, more=f'basis = "table"\npositions = {positions}')


def changed(old: str, new: str) -> str:
    assert old in FIVE
    return FIVE.replace(old, new)


IMPOSSIBLE = {
    # sizes
    "squareness in urad": (FIVE + effect("EC0Y", 12.0), "NCF320", "12 urad"),
    "squareness in degrees": (FIVE + effect("EC0Y", 0.003), "NCF320", "0.003 degrees"),
    "squareness in seconds of arc": (FIVE + effect("EB0Z", 4.0), "NCF320", "4 seconds of arc"),
    "gain in um": (FIVE + polynomial("EXX", 10.0), "NCF320", "10 um"),
    "gain of ten millimetres": (FIVE + polynomial("EYY", 10.0, 2.0), "NCF320", "EYY"),
    "gain a power without scale": (FIVE + effect("EXX", 1e-5, 1e-8, 1e-8, more=CUBIC), "NCF320", "EXX"),
    "table in um": (FIVE + table("EYX", [0, 250, 500], [0, 4.0, -3.0]), "NCF320", "4 um"),
    "table of 0.4 mm": (FIVE + table("EXX", [0, 250, 500], [0, 0.2, 0.4]), "NCF320", "400 um"),
    "roll in degrees": (FIVE + polynomial("EAX", 0.002), "NCF320", "EAX"),
    "pivot in um": (FIVE + effect("EX0C", 12.0), "NCF320", "12 um"),
    "pivot elsewhere": (FIVE + effect("EY0A", 25.0), "NCF320", "EY0A"),
    "tilt of a table": (FIVE + effect("EA0C", 0.1), "NCF320", "EA0C"),
    "play in um": (FIVE + effect("backlash-X", -6.0), "NCF320", "3 um"),
    "growth a kelvin in um": (FIVE + effect("spindle-growth", -12.0), "NCF320", "12 um"),
    "wobble in degrees": (FIVE + effect("EAC", 0.01, 0.01, more=WAVE), "NCF320", "EAC"),
    "two that add up": (FIVE + polynomial("EXX", 0.2) + polynomial("EXX", 0.2), "NCF320", "400 um"),
    "expansion in um": (FIVE + effect("expansion-X", 6.0), "NCF320", "6 um"),
    # axes
    "X and Y are one": (changed("[0, 1, 0], range = [0, 400]", "[1, 0, 0], range = [0, 400]"), "NCF321", "X and Y"),
    "Z against X": (changed("[0, 0, 1], range", "[-1, 0, 0], range"), "NCF321", "X and Z"),
    "three in a plane": (changed("[0, 0, 1], range", "[1, 1, 0], range"), "NCF321", "X and Y and Z"),
    "nearly parallel": (changed("[0, 1, 0]", "[1, 0.02, 0]"), "NCF321", "X and Y"),
    "A and C are one": (changed(*ONE_LINE), "NCF321", "C and A"),
    # units
    "travel in metres": (changed("[0, 500]", "[0, 0.5]"), "NCF322", "metres"),
    "travel in um": (changed("[0, 500]", "[0, 500000]"), "NCF322", "um"),
    "swivel in radians": (changed("[-30, 120]", "[-0.5236, 2.0944]"), "NCF322", "-30 ... 120 degrees"),
    "pitch in metres": (changed("pitch = 10.0", "pitch = 0.01"), "NCF322", "pitch"),
    "a step of a millimetre": ("least_increment = { linear = 1.0 }" + FIVE, "NCF322", "least_increment"),
    "a limit in um": ("max_correction = { linear = 500.0 }" + FIVE, "NCF322", "max_correction"),
    "a point in um": (changed("[0, 0, 120]", "[0, 0, 420000]"), "NCF322", "point"),
    "table in metres": (FIVE + table("EXX", [0, 0.25, 0.5], [0, 0.002, 0.004]), "NCF323", "almost nothing"),
    "table in radians": (FIVE + table("ECC", QUARTERS, [0, 1e-5, 2e-5, 1e-5, 0]), "NCF323", "radians"),
    "table in inches": (FIVE + table("EXX", [0, 9.84, 19.68], [0, 0.002, 0.004]), "NCF323", "positions in inches?"),
    "a travel in inches": (
        changed("[0, 500]", "[0, 19.685]") + table("EXX", [0, 250, 500], [0, 0.002, 0.004]),
        "NCF323",
        "range in inches?",
    ),
    "table of another axis": (FIVE + table("EZZ", [100, 200, 300], [0, 0.002, 0.004]), "NCF323", "outside"),
}  # fmt: skip


def test_a_machine_whose_travels_may_be_in_inches_is_remarked_on() -> None:
    small = changed("[0, 500]", "[0, 20]").replace("[0, 400]", "[0, 16]").replace("[-300, 0]", "[-12, 0]")
    (found,) = doubts(loads(small), "m.toml")
    assert (found.message.code, found.impossible) == ("NCF322", False)
    assert found.message.hint == "`range` is in mm; is it given in inches? That would be 508 mm"


def test_a_machine_that_is_left_handed_is_remarked_on() -> None:
    """The sign of one slide is all it takes."""
    for right, left in (
        ("[1, 0, 0]", "[-1, 0, 0]"),
        ("[0, 1, 0]", "[0, -1, 0]"),
        ("[0, 0, 1], range", "[0, 0, -1], range"),
    ):
        (found,) = doubts(loads(changed(right, left)), "m.toml")
        assert (found.message.code, found.impossible) == ("NCF325", False)
    below = FIVE.replace("w C A F X Y Z t", "w C A X F Y Z t")
    assert [each.message.code for each in doubts(loads(below), "m.toml")] == ["NCF325"]
    assert doubts(loads(below.replace("[1, 0, 0]", "[-1, 0, 0]", 1)), "m.toml") == []
    assert doubts(loads(FIVE), "m.toml") == []


@pytest.mark.parametrize("what", IMPOSSIBLE)
def test_a_machine_that_cannot_be_gives_nothing(shop: Any, ncfix: Any, what: str) -> None:
    text, code, said = IMPOSSIBLE[what]
    shop.machine.write_text(text)
    checked = ncfix("machine", "check", shop.machine)
    assert (checked.code, "no faults" in checked.err) == (ExitCode.FINDINGS, False)
    assert code in checked.err
    assert said in checked.err
    assert ncfix("machine", "check", shop.machine, "--json").json()["ok"] is False
    out = shop.folder / "out.ngc"
    result = ncfix("fix", shop.program, "-m", shop.machine, "-o", out)
    assert (result.code, out.exists()) == (ExitCode.REFUSED, False)
    assert {code, "NCF324"} <= {message["code"] for message in _errors(ncfix, shop, out)}
    result = ncfix("export", "isg", "-m", shop.machine, "-o", shop.folder / "t")
    assert (result.code, (shop.folder / "t").exists()) == (ExitCode.REFUSED, False)


def _errors(ncfix: Any, shop: Any, out: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = ncfix("fix", shop.program, "-m", shop.machine, "-o", out, "--json").json()["errors"]
    return found


def test_who_insists_gets_the_program(shop: Any, ncfix: Any) -> None:
    shop.machine.write_text(shop.machine.read_text().replace("1e-4", "8e-4"))
    out = shop.folder / "out.ngc"
    assert ncfix("fix", shop.program, "-m", shop.machine, "-o", out).code == ExitCode.REFUSED
    result = ncfix("fix", shop.program, "-m", shop.machine, "-o", out, "--force", "--assume-zero")
    assert (result.code, out.exists(), "NCF320" in result.err) == (ExitCode.DONE, True, True)


def test_much_is_said_and_no_more(shop: Any, ncfix: Any) -> None:
    """50 um over 500 mm: much, and a machine that there is."""
    out = shop.folder / "out.ngc"
    for command in (
        ("machine", "check", shop.machine),
        ("fix", shop.program, "-m", shop.machine, "-o", out, "--assume-zero"),
    ):
        result = ncfix(*command)
        assert (result.code, "50 um is more than 30 um" in result.err) == (ExitCode.DONE, True)


@pytest.mark.parametrize("topology", TOPOLOGIES)
@pytest.mark.parametrize("rich", [False, True])
def test_machines_of_another_workshop_are_in_order(topology: str, rich: bool) -> None:
    for seed in range(HONEST):
        rng = np.random.default_rng(seed)
        drawn = draw_machine(rng, topology)
        found = loads(machine_toml(drawn, draw_model(rng, drawn, topology, rich)))
        assert [str(each.message) for each in doubts(found, "m") if each.impossible] == []


@pytest.mark.parametrize("metres", [0.05, 0.3, 5.0, 30.0])
def test_what_is_much_grows_with_the_travel(metres: float) -> None:
    """20 um a metre in gain and bow, a squareness of 50 um a metre: small and large machines alike."""
    size = 1000 * metres
    text = f"""
topology = "w F X Y Z t"
axis.X = {{ type = "linear", direction = [1, 0, 0], range = [0, {size}] }}
axis.Y = {{ type = "linear", direction = [0, 1, 0], range = [0, {size / 3}] }}
axis.Z = {{ type = "linear", direction = [0, 0, 1], range = [0, {size / 5}] }}
"""
    more = f'basis = "polynomial"\ndegree = [1, 2]\ncenter = {size / 2}\nscale = {size / 2}'
    text += effect("EXX", 1e-2 * metres, 5e-3 * metres, more=more) + effect("EYX", 0.0, 1e-2 * metres, more=more)
    assert doubts(loads(text + effect("EC0Y", 5e-5)), "m") == []


def test_a_robot_that_is_off_by_a_millimetre_is_a_robot() -> None:
    """Six joints, their zeros off by a tenth of a degree, links by half a millimetre, as before a calibration."""
    places = [[0, 0, 0], [300, 0, 600], [300, 0, 1700], [400, 0, 1900], [1700, 0, 1900], [1900, 0, 1900]]
    text = 'topology = "w F A B C D E U t"\nmax_correction = { linear = 5.0, rotary = 1.0 }\n'
    text += "[tool]\npoint = [2000, 0, 1900]\n"
    for name, about, place in zip("ABCDEU", "ZYYXYX", places, strict=True):
        direction = [int(about == axis) for axis in "XYZ"]
        text += f'[axis.{name}]\ntype = "rotary"\ndirection = {direction}\npoint = {place}\nrange = [-170, 170]\n'
        text += effect(f"E{'ABC'['XYZ'.index(about)]}0{name}", 1.8e-3)
        text += effect(f"E{'Y' if about == 'X' else 'X'}0{name}", 0.5)
    assert [str(each.message) for each in doubts(loads(text), "m")] == []


def test_every_shipped_machine_is_a_machine(examples: Path) -> None:
    for path in sorted(examples.glob("**/*.toml")):
        text = path.read_text()
        if "topology" in text and "[[joint" not in text and path.parent.name != "chains":
            assert not [each.message for each in doubts(load(path), str(path)) if each.impossible]


def test_a_quill_may_be_parallel_to_the_column() -> None:
    text = FIVE.replace("X Y Z t", "X Y Z W t")
    text += 'axis.W = { type = "linear", direction = [0, 0, 1], range = [-200, 0] }\n'
    assert doubts(loads(text), "m") == []


def test_what_cannot_be_is_shown_where_it_stands(shop: Any, ncfix: Any) -> None:
    text = changed("pitch = 10.0", "pitch = 0.01") + effect("EC0Y", 12.0) + table("EXX", [0, 0.25, 0.5], [0, 0, 0.004])
    shop.machine.write_text(text)
    rows = text.splitlines()
    remarks = ncfix("machine", "check", shop.machine, "--json").json()["remarks"]
    assert [(each["code"], rows[each["line"] - 1]) for each in remarks] == [
        ("NCF320", "coefficients = [12.0]"),
        ("NCF322", next(row for row in rows if row.startswith("axis.X"))),
        ("NCF323", "positions = [0, 0.25, 0.5]"),
    ]
    refused = ncfix("fix", shop.program, "-m", shop.machine, "-o", shop.folder / "out.ngc")
    assert all(f":{each['line']}:{each['column']}: {each['code']}" in refused.err for each in remarks)
