"""Tables of machines that nobody has seen, read and run by emulators that share nothing with ncfix.

The residual that an export states must be what these leave at the same poses. Both read the same decimals, so they may
differ by what floats of 64 bits lose (LinuxCNC keeps 32 bits of its values: 1e-9 mm in 0.01 mm).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pytest

from conftest import FULL, some
from ncfix.diagnostics import ConfigError, RefusedError
from ncfix.machine import Effect, Machine, State, loads
from ncfix.machine.basis import Backlash, Fourier, Polynomial
from ncfix.machine.piecewise import PiecewiseLinear
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import random_poses, random_ways, ranges_of
from ncfix.tables.export import export
from ncfix_siemens.settings import SIGNS, TERMS
from tables import second_emulators as second

Rng = np.random.Generator
POSES = 400
SAME = 1e-6
"""mm: a nanometre. Both read the same decimals; what is solved for (KinematicsComp) differs by 1e-7 mm."""
CHAINS = (
    ("w F X Y Z t", ""),
    ("w X F Y Z t", "X"),
    ("w Y X F Z t", "XY"),
    ("w C A F X Y Z t", ""),
    ("w C B X F Z Y t", "X"),
    ("w Y X F Z C B t", "XY"),
    ("w X F Y Z A C t", "X"),
    ("w B X F Y Z A t", "X"),
    ("w A F Y X Z t", ""),
    ("w F U V W t", ""),
    ("w C F V X W A t", ""),
)
ALONG = {"X": 0, "Y": 1, "Z": 2, "U": 0, "V": 1, "W": 2, "A": 0, "B": 1, "C": 2}


def machine(rng: Rng) -> Machine:
    """Any chain; ranges that begin anywhere and span 0.1 to 4 m; left-handed rotary axes; endless C; play."""
    topology, reversed_ones = CHAINS[rng.integers(len(CHAINS))]
    lines = ["ncfix = 1", 'name = "any"', f'topology = "{topology}"', "max_correction = {linear = 9, rotary = 9}"]
    names = [letter for letter in topology.split() if letter in ALONG]
    spans = {}
    for letter in names:
        direction = np.zeros(3, dtype=int)
        direction[ALONG[letter]] = -1 if letter in reversed_ones else 1
        if letter in "ABC":
            direction *= int(rng.choice([-1, 1]))
            low, high = (-180, 180) if letter == "C" and rng.random() < 0.6 else sorted(rng.uniform(-120, 120, 2))
            high = max(high, low + 20)
            endless = letter == "C" and (low, high) == (-180, 180)
            place = [float(x) for x in np.round(rng.uniform(-200, 200, 3), 3)]
            more = "" if endless else f", range = [{low:.4f}, {high:.4f}]"
            lines.append(
                f'axis.{letter} = {{ type = "rotary", direction = {direction.tolist()}, point = {place}{more} }}'
            )
        else:
            span = float(rng.choice([100, 500, 1234.5, 4000]))
            low = float(np.round(rng.uniform(-span, 0), int(rng.integers(0, 4))))
            high = low + span
            lines.append(
                f'axis.{letter} = {{ type = "linear", direction = {direction.tolist()}, range = [{low}, {high}] }}'
            )
        spans[letter] = (low, high)
    found = loads("\n".join(lines))
    return found.replace(effects=tuple(_errors(rng, names, spans)))


def _errors(rng: Rng, names: list[str], spans: dict[str, tuple[float, float]]) -> Iterator[Effect]:
    for letter in names:
        low, high = spans[letter]
        half = (high - low) / 2
        turn = letter == "C" and half == 180
        for component in "XYZABC":
            size = (30e-6 if component in "ABC" else 0.02) * float(rng.normal())
            if rng.random() < 0.4:
                continue
            name = f"E{component}{letter}"
            if turn:
                harmonics = Fourier((1, 2))
                yield Effect(name, tuple((size * rng.normal(size=4)).tolist()), harmonics)
            elif rng.random() < 0.4:
                nodes = np.round(np.linspace(low, high, 7) + rng.uniform(-0.05, 0.05, 7) * half, 3)[1:-1]
                values = size * rng.normal(size=len(nodes)).cumsum() / 3
                yield Effect(name, tuple(values.tolist()), PiecewiseLinear(tuple(nodes.tolist())))
            else:
                powers = Polynomial((1, 2, 3))
                coefficients = tuple((size * rng.normal(size=3)).tolist())
                yield Effect(name, coefficients, powers, center=(low + high) / 2, scale=half)
        if letter not in "ABC" and rng.random() < 0.4:
            yield Effect(f"E{'XYZ'[ALONG[letter]]}{letter}", (-float(rng.uniform(0.002, 0.02)),), Backlash((0,)))


CONTROLS: dict[str, tuple[Callable[..., second.Array], list[dict[str, str]]]] = {
    "linuxcnc": (
        second.linuxcnc,
        [{}, {"type": "0"}, {"points": "9"}, {"unit": "inch"}, {"unit": "inch", "type": "0"}],
    ),
    "siemens": (
        second.siemens,
        [
            {"value_sign": sign, "product_terms": terms, "positioning": own, "tables": "60"}
            for sign, terms, own in (
                ("error", "only", "cec"),
                ("correction", "only", "eec"),
                ("error", "plus_both", "cec"),
                ("correction", "plus_base", "cec"),
                ("error", "plus_multiplier", "eec"),
            )
        ],
    ),
    "fanuc": (
        second.fanuc,
        [{"sign": "error"}, {"sign": "correction", "order": "ZYX"}, {"sign": "error", "home_minus": "XZ"}],
    ),
    "fanuc-pitch": (second.fanuc_pitch, [{"sign": "error"}, {"sign": "correction", "detection_unit_um": "1"}]),
    "fanuc-rotary": (second.fanuc_rotary, [{"sign": "error"}, {"sign": "correction", "home_minus": "Y"}]),
    "heidenhain": (
        second.heidenhain,
        [
            {"sign": sign, "family": family, "backlash": play}
            for sign, family, play in (
                ("error", "tnc640", "on"),
                ("correction", "itnc530", "off"),
                ("error", "itnc530", "on"),
            )
        ],
    ),
    "heidenhain-kinematics": (
        second.kinematics,
        [{"sign": "error", "angle_unit": "deg"}, {"sign": "correction", "angle_unit": "rad", "backlash": "on"}],
    ),
    "isg": (second.isg, [{}, {"negate": "XZ"}, {"grids": "one"}, {"steps": "even"}]),
}
TOOL_KNOWN = {"fanuc-rotary", "heidenhain-kinematics"}
COUNT = 40 if FULL else 2
TARGET = 0.004 if FULL else 0.02
"""mm: what is left is stated alike whatever is left, and tables that leave less have more points."""


@pytest.mark.parametrize("name", CONTROLS)
@pytest.mark.parametrize("seed", range(COUNT))
def test_what_is_stated_is_what_a_second_emulator_leaves(name: str, seed: int) -> None:
    rng = np.random.default_rng([seed, len(name)])
    run, choices = CONTROLS[name]
    control = get_control(name)
    settings = control.settings(choices[seed % len(choices)])
    length = float(rng.choice([0.0, 80.0, 250.0]))
    for _ in range(30):
        one = machine(rng)
        ends = [(axis.name, *(x / axis.unit for x in axis.range)) for axis in one.axes if axis.name in "XYZABC"]
        places = ",".join(f"{name}{np.clip(0, low + 1, high - 1):.3f}" for name, low, high in ends)
        chosen = {**settings, "reference": places} if "reference" in settings else settings
        try:
            made = export(control, Request(one, ranges_of(one), length, TARGET, chosen), POSES)
        except RefusedError as refused:
            if refused.code in ("NCF484", "NCF490"):  # the format cannot hold it, or does not reach it
                continue
            raise
        files = {path: content.decode() for path, content in made.native.items()}
        if "axes" in chosen:
            ordered = [letter for letter in "XYZABCUVW" if letter in one.axis_names]
            chosen = {**chosen, "axes": ",".join(f"{letter}:AX{n}" for n, letter in enumerate(ordered, 1))}
        space = ranges_of(one)
        q, ways = random_poses(space, POSES, seed=7), random_ways(len(space), POSES, seed=8)
        units = np.array([axis.unit for axis in one.axes])
        run_it = partial(run, length=length) if name in TOOL_KNOWN else run
        correction = run_it(files, one.axis_names, q / units, ways, chosen) * units
        gap = one.actual_tip(q + correction, State(length, ways)) - one.tip(q, length)
        np.testing.assert_allclose(np.linalg.norm(gap, axis=-1), made.left.after, atol=SAME, rtol=0)
        return
    pytest.fail("no machine was taken")


LETTERS = ("X", "Y", "Z", "A", "C")
AXES = {letter: f"AX{number}" for number, letter in enumerate(LETTERS, 1)}


def table_of(rng: Rng, index: int, count: int, output: str) -> list[str]:
    """A compensation table as anyone may write it, its lines in any order."""
    cells, step, letter = int(rng.integers(1, 9)), float(np.round(rng.uniform(1, 90), 3)), str(rng.choice(LETTERS))
    low, modulo = float(np.round(rng.uniform(-300, 100), 3)), letter in "AC" and rng.random() < 0.4
    if modulo:
        cells, step = 8, 45.0
    values = np.round(rng.normal(size=cells + 1) * 0.01, 5)
    values[-1] = values[0] if modulo else values[-1]
    words = {
        "INPUT_AXIS": f"({AXES[letter]})",
        "OUTPUT_AXIS": f"({AXES[output]})",
        "STEP": f"{step:.4f}",
        "MIN": f"{low:.4f}",
        "MAX": f"{low + cells * step:.4f}",
        "DIRECTION": str(rng.choice([0, 0, 0, 1, -1])),
        "MULT_BY_TABLE": str(rng.integers(1, count + 1) if rng.random() < 0.3 else 0),
        "IS_MODULO": str(int(modulo)),
    }
    lines = [f"$AN_CEC[{index},{place}]={value:.5f}" for place, value in enumerate(values)]
    lines += [f"$AN_CEC_{word}[{index}]={value}" for word, value in words.items()]
    rng.shuffle(lines)
    return lines


def test_any_tables_of_siemens_do_what_a_second_emulator_does() -> None:
    """Directions, products of any pair, itself too, repeats, and far beyond the ends; what is not public is refused."""
    control, run = get_control("siemens"), 0
    for seed in range(some(100)):
        rng = np.random.default_rng(seed)
        said = {"value_sign": str(rng.choice(SIGNS)), "product_terms": str(rng.choice(TERMS))}
        head = " ".join(f"{key}={value}" for key, value in (said | AXES).items())
        count, output = int(rng.integers(1, 7)), str(rng.choice(LETTERS))
        lines = [line for index in range(count) for line in table_of(rng, index, count, output)]
        text = "\n".join(["%_N_NC_CEC_INI", "CHANDATA(1)", f"; ncfix: {head}", *lines, "M17", ""])
        q, ways = rng.uniform(-700, 700, (200, 5)), rng.choice([-1.0, 1.0], (200, 5))
        units = np.array([np.pi / 180 if letter in "AC" else 1.0 for letter in LETTERS])
        try:
            found = control.read({"NC_CEC.INI": text.encode()}).at(LETTERS, q * units, ways) / units
        except ConfigError as refused:
            if all("acts in one direction only" in message.text for message in refused.messages):
                continue
            raise
        said["axes"] = ",".join(f"{letter}:{axis}" for letter, axis in AXES.items())
        expected = second.siemens({"NC_CEC.INI": text}, LETTERS, q, ways, said)
        np.testing.assert_allclose(found, expected, atol=1e-12)
        run += 1
    assert run > some(40)
