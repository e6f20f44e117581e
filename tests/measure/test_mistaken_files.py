"""Mistaken and contradictory measurement files give no machine; honest ones, of machines richer than any model, do.

Files are those of the hidden simulation, which shares nothing with the models under test. A few of each by default;
`NCFIX_MISTAKEN=10 NCFIX_HONEST=200` for many.
"""

from __future__ import annotations

import os
import resource
from collections.abc import Callable
from functools import cache
from itertools import product

import numpy as np
import pytest
from tests.hidden.scenario import scenario

from measure.mistaken import (
    Change,
    Files,
    each_its_set,
    everywhere,
    exchanged,
    filled,
    in_part,
    longer,
    same,
    times,
)
from measure.poses import machine, perfect, plan
from ncfix.diagnostics import NcfixError, RefusedError, UsageError
from ncfix.machine import Machine, loads
from ncfix.machine.plausible import doubts, much
from ncfix.measure.calibrate import calibrate
from ncfix.measure.contradictions import refusals
from ncfix.measure.estimate import Calibration
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import Measurement
from ncfix.measure.reader import reads

SEEDS = int(os.environ.get("NCFIX_MISTAKEN", "1"))
HONEST = int(os.environ.get("NCFIX_HONEST", "6"))
FIRST = int(os.environ.get("NCFIX_SEED", "0"))
FAMILIES = ("clutter", "clean", "weak", "single", "two", "small")
FIVE = ("wCBXFZYSt", "wCAYFXZSt", "wXFYZCBSt")
KINDS = ("tcp", "probe", "length")
SHIFTS, READ = ("dx", "dy", "dz"), ("mx", "my", "mz")
DEGREE = float(np.pi / 180)


@cache
def honest(seed: int, family: str, topology: str, kind: str) -> Files:
    return scenario(seed, family, topology=topology, kind=kind).handed


def outcome(files: Files, effects: str | None = None) -> tuple[str, ...]:
    """The codes with which no machine is written; none if one is."""
    known = loads(files["machine.toml"])
    try:
        data = [reads(text.encode(), known, name) for name, text in files.items() if name.endswith(".csv")]
        found = calibrate(data, known, effects)
    except NcfixError as error:
        return tuple(message.code for message in error.messages)
    return tuple(message.code for message in refusals(found, doubts(found.machine, "machine.toml")))


def one_set(change: Change) -> Change:
    return in_part("set", lambda name: int(name) == 2, change)


def two_sets(change: Change) -> Change:
    return in_part("set", lambda name: int(name) in (2, 5), change)


def turning(topology: str) -> str:
    """The axis nearer to the workpiece or to the column."""
    return topology[1] if topology[0:2] != "wX" else topology[5]


MISTAKES: dict[str, dict[str, Callable[[str], tuple[Change, ...]]]] = {
    "tcp": {
        "two columns exchanged": lambda t: (exchanged("dx", "dy"),),
        "a sign": lambda t: (times(["dy"], -1),),
        "micrometres": lambda t: (times(SHIFTS, 1000),),
        "radians": lambda t: (times([turning(t)], DEGREE),),
        "an axis turned round": lambda t: (times([turning(t)], -1),),
        "a set of the other sign": lambda t: (one_set(times(SHIFTS, -1)),),
        "two sets of the other sign": lambda t: (two_sets(times(SHIFTS, -1)),),
        "positions exchanged": lambda t: (exchanged("X", "Y"),),
        "nothing measured": lambda t: (filled(SHIFTS, "0.0"),),
        "a set with columns exchanged": lambda t: (one_set(exchanged("dx", "dy")),),
        "every row a set": lambda t: (each_its_set,),
    },
    "probe": {
        "a standard too long": lambda t: (same, longer(0, 1 + 63e-6)),
        "a standard too short": lambda t: (same, longer(1, 1 - 63e-6)),
        "a standard in inches": lambda t: (same, longer(0, 1 / 25.4)),
        "columns exchanged": lambda t: (exchanged("mx", "my"),),
        "a sign": lambda t: (times(["mz"], -1),),
        "radians": lambda t: (times([turning(t)], DEGREE),),
        "an axis turned round": lambda t: (times([turning(t)], -1),),
        "nothing measured": lambda t: (filled(READ, "0.0"),),
    },
    "length": {
        "micrometres": lambda t: (times(["length"], 1000),),
        "inches": lambda t: (times(["length"], 1 / 25.4),),
        "an axis turned round": lambda t: (times(["X"], -1),),
        "columns exchanged": lambda t: (exchanged("X", "Y"),),
        "radians": lambda t: (times([turning(t)], DEGREE),),
        "nothing measured": lambda t: (filled(["length"], "150.0"),),
    },
}  # fmt: skip
CASES = [(kind, what, FIVE[k % 3]) for kind in KINDS for k, what in enumerate(MISTAKES[kind])]


@pytest.mark.parametrize(("kind", "what", "topology"), CASES)
def test_a_mistaken_file_gives_no_machine(kind: str, what: str, topology: str) -> None:
    for seed in range(FIRST, FIRST + SEEDS):
        where = FIVE[(FIVE.index(topology) + seed) % 3]
        files = honest(seed, "clutter", where, kind)
        change = MISTAKES[kind][what](where)
        assert outcome(everywhere(files, *change)), (seed, what)


@pytest.mark.parametrize(
    ("family", "topology", "seed", "change"),
    [("clutter", "wCAYFXZSt", 31001, exchanged("dx", "dy")), ("small", "wCAYFXZSt", 52000, times(["dy"], -1))],
)
def test_a_mistaken_set_is_judged_by_itself(family: str, topology: str, seed: int, change: Change) -> None:
    """Among many right sets one leaves little, and among poor ones it leaves not all of it."""
    files = honest(seed, family, topology, "tcp")
    assert "NCF617" in outcome(everywhere(files, one_set(change)))
    assert outcome(files) == ()


@pytest.mark.parametrize("kind", KINDS)
def test_honest_files_of_richer_machines_are_not_refused(kind: str) -> None:
    topologies = FIVE if kind == "probe" else (*FIVE, "wXFYZSt")
    for seed, (family, topology) in zip(range(max(HONEST // 3, 1)), _around(topologies, kind), strict=False):
        assert outcome(honest(FIRST + 100 + seed, family, topology, kind)) == (), (seed, family, topology)


def _around(topologies: tuple[str, ...], kind: str) -> list[tuple[str, str]]:
    """Families and topologies; `small` is never measured with lengths."""
    families = [family for family in FAMILIES if family != "small" or kind != "length"]
    every = list(product(families, topologies))
    return [every[(7 * k) % len(every)] for k in range(1000)]


def test_signs_name_the_axis_that_is_turned_round() -> None:
    known = machine("wCBXFZYSt")
    data = simulate(plan(known, "tcp", 150), known, Faults(noise_um=0.5, setup=0.1), seed=4)
    turned = data.with_columns({"dy": -data.columns["dy"]})
    (said,) = [each for each in calibrate([turned], perfect(known)).remarks if each.code == "NCF617"]
    assert "dx, -dy, dz" in said.text
    assert "y axis is in the opposite direction" in said.hint
    wrong = data.with_columns({"C": -data.columns["C"]})
    (said,) = [each for each in calibrate([wrong], perfect(known)).remarks if each.code == "NCF617"]
    assert said.text.startswith("C has the opposite sign")


def gauges(known: Machine, factor: float) -> Measurement:
    """Steps along X and Y, the set of Y against another standard."""
    ends = np.tile(np.linspace(-250, 250, 11), 3)
    columns = {f"{end}{axis}": np.zeros(66) for end in "ab" for axis in "xyz"}
    columns["ax"][:33], columns["bx"][:33] = -280.0, ends + 20.0
    columns["ax"][33:], columns["bx"][33:] = -280.0, ends + 20.0
    sets = ("1",) * 33 + ("2",) * 33
    data = simulate(Measurement("length", (), columns, {"set": sets}), known, Faults(noise_um=0.5), seed=2)
    return data.with_columns({"length": np.where(np.arange(66) < 33, 1.0, factor) * data.columns["length"]})


def test_two_gauges_of_which_one_is_wrong() -> None:
    known = perfect(machine("three_axis"))
    free = Machine.replace(known, effects=())
    assert refusals(calibrate([gauges(known, 1.0)], free, "EXX"), []) == ()
    (said,) = refusals(calibrate([gauges(known, 1 + 63e-6)], free, "EXX"), [])
    assert (said.code, "differ from the others by a scale factor" in said.text) == ("NCF617", True)


def test_what_is_nearly_unobservable_is_held_and_named() -> None:
    """A bar of unknown length sees no common scale but by the digits of its radius."""
    known = machine("three_axis").replace(effects=())
    data = simulate(plan(known, "bar", 300), known, Faults(noise_um=1.0, setup=1.0), seed=3)
    rounded = data.with_columns({"radius": np.round(data.columns["radius"][:1], 3).repeat(300)})
    for each in (data, rounded, _on_a_sphere(known)):
        found = calibrate([each.with_header("setup", "unknown")], known, "EXX,EYY,EZZ")
        if refusals(found, []):  # the radius is rounded by far more than its noise: nothing is written
            assert each is rounded
            continue
        at = 0
        for effect in found.problem.selection.estimated:
            size = np.abs(found.estimate.coefficients[at : at + effect.basis.size])
            assert size.max() < much(known, effect.name)
            at += effect.basis.size


def _on_a_sphere(known: Machine) -> Measurement:
    """Poses on a sphere to a micrometre or so, as a bar's are."""
    random = np.random.default_rng(5)
    way = random.normal(size=(300, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    low, high = np.array([axis.range for axis in known.axes]).T
    places = np.round((low + high) / 2 + 150.0 * way, 3)
    every = plan(known, "tcp", 300)
    columns = {**every.columns, **dict(zip("XYZ", places.T, strict=True)), "tool_length": np.zeros(300)}
    tip = known.tip(places, 0.0)
    centre = (tip - places + (low + high) / 2)[0]
    columns |= {f"c{axis}": np.full(300, centre[k]) for k, axis in enumerate("xyz")} | {"radius": np.full(300, 150.0)}
    return simulate(Measurement("length", (), columns, every.labels), known, Faults(noise_um=1.0), seed=3)


def test_thirty_thousand_sets_are_refused_in_little_memory() -> None:
    known = machine("three_axis")
    count = 30_000
    columns = {name: np.linspace(0, 1, count) for name in ("X", "dx", "dy", "dz")}
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(UsageError) as caught:
        calibrate([Measurement("tcp", (), columns, {"set": tuple(map(str, range(count)))})], known)
    assert caught.value.code == "NCF624"
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000


def test_nothing_measured_is_no_fault() -> None:
    known = machine("three_axis")
    for kind in ("tcp", "tcp6", "axis", "gauge", "tool"):
        poses = plan(known, kind, 60)
        names = poses.form.measured
        empty = poses.with_columns({name: np.zeros(60) for name in names})
        with pytest.raises(RefusedError) as caught:
            calibrate([empty], known)
        assert caught.value.code == "NCF623"


def test_a_stated_distance_is_never_an_outlier() -> None:
    known = machine("wCBXFZYSt")
    data = simulate(plan(known, "probe", 200), known, Faults(noise_um=1.0), seed=1)
    found: Calibration = calibrate([_with_distances(data, known, 1.0)], perfect(known))
    assert refusals(found, []) == ()
    wrong = calibrate([_with_distances(data, known, 1 + 63e-6)], perfect(known))
    assert wrong.estimate.weight[wrong.problem.stated].min() == 1
    assert "NCF621" in {each.code for each in refusals(wrong, [])}


def _with_distances(data: Measurement, known: Machine, factor: float) -> Measurement:
    """Two lengths between the balls, the second one wrong by a factor."""
    found = calibrate([data], known, "EC0Y")
    unknowns = found.estimate.unknowns
    names = [label for each in found.problem.observations for label in each.unknowns.labels]
    balls = {name.split()[3]: k for k, name in enumerate(names) if name.startswith("position of ball")}
    places = {name: unknowns[k - 2 : k + 1] for name, k in balls.items()}
    lines = []
    for (first, second), scale in zip((("1", "3"), ("2", "4")), (1.0, factor), strict=True):
        length = float(np.linalg.norm(places[first] - places[second])) * scale
        lines.append(("distance", f"{first} {second} {length:.4f} 0.0012"))
    return Measurement(data.kind, (*data.headers, *lines), data.columns, data.labels)
