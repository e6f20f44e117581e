"""Mistakes of software and set-up: undone, one is found by its odds; a file that is right has none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from conftest import FULL, some
from measure.poses import machine, plan
from ncfix.diagnosis.diagnosis import diagnose
from ncfix.diagnosis.mistakes.search import find
from ncfix.diagnosis.residual_data import is_free, misfit
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import Polynomial
from ncfix.machine.piecewise import PiecewiseLinear
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import CENTRE, Measurement

Changed = tuple[Measurement, Machine]


def scaled(known: Machine, factor: float, wanted: Callable[[Effect], bool]) -> Machine:
    return known.replace(
        effects=tuple(
            replace(e, coefficients=tuple(factor * c for c in e.coefficients)) if wanted(e) else e
            for e in known.effects
        )
    )


@pytest.fixture(scope="module")
def known() -> Machine:
    """Its location errors, large, and bowed positioning errors."""
    lines = machine("wCBXFZYSt")
    lines = lines.replace(effects=tuple(effect for effect in lines.effects if effect.location))
    bows = [
        Effect(f"E{axis.name}{axis.name}", (0.03, 0.02), Polynomial(degree=(2, 3)), center=sum(axis.range) / 2,
               scale=(axis.range[1] - axis.range[0]) / 2)
        for axis in lines.axes
        if not axis.rotary
    ]  # fmt: skip
    return scaled(lines, 4.0, lambda effect: True).replace(
        effects=(*scaled(lines, 4.0, lambda effect: True).effects, *bows)
    )


@pytest.fixture(scope="module")
def data(known: Machine) -> Measurement:
    return simulate(plan(known, "tcp", 120, 3), known, Faults(2.0), 3)


def columns(data: Measurement, factor: float, *names: str) -> Measurement:
    return data.with_columns({name: factor * data.columns[name] for name in names})


def exchanged(data: Measurement, first: str, second: str) -> Measurement:
    return data.with_columns({first: data.columns[second], second: data.columns[first]})


def turned(known: Machine, name: str) -> Machine:
    axes = tuple(
        replace(axis, direction=tuple(-x for x in axis.direction)) if axis.name == name else axis for axis in known.axes
    )
    return known.replace(axes=axes)


def corrected(data: Measurement, known: Machine, factor: float, wanted: Callable[[Effect], bool]) -> Measurement:
    """What is measured where the control corrects these errors of the file, so many times."""
    part = known.replace(effects=tuple(e for e in known.effects if wanted(e)))
    quiet = simulate(plan(known, "tcp", 120, 3), part, Faults(0.0, setup=0.0), 3)
    return data.with_columns({n: data.columns[n] - factor * quiet.columns[n] for n in ("dx", "dy", "dz")})


def one_way(data: Measurement, changed: Measurement, axis: str) -> Measurement:
    """The other values where an axis came in plus."""
    there = data.columns[f"dir_{axis}"] > 0
    return data.with_columns({n: np.where(there, changed.columns[n], data.columns[n]) for n in ("dx", "dy", "dz")})


VALUES = ("dx", "dy", "dz")
CASES: dict[str, Callable[[Measurement, Machine], Changed]] = {
    "table active": lambda d, m: (corrected(d, m, 1.0, lambda e: True), m),
    "table active X": lambda d, m: (corrected(d, m, 1.0, lambda e: e.name == "EXX"), m),
    "table active Y one way": lambda d, m: (one_way(d, corrected(d, m, 1.0, lambda e: e.name == "EYY"), "Y"), m),
    "wrong sign": lambda d, m: (d, scaled(m, -1.0, lambda e: True)),
    "wrong sign control": lambda d, m: (corrected(d, m, -1.0, lambda e: True), m),
    "sign of EYY": lambda d, m: (d, scaled(m, -1.0, lambda e: e.name == "EYY")),
    "sign of Z": lambda d, m: (d, scaled(m, -1.0, lambda e: e.joint == "Z")),
    "sign of values": lambda d, m: (columns(d, -1.0, *VALUES), m),
    "sign of dy": lambda d, m: (columns(d, -1.0, "dy"), m),
    "unit of values: um": lambda d, m: (columns(d, 1e3, *VALUES), m),
    "unit of values: m": lambda d, m: (columns(d, 1e-3, *VALUES), m),
    "unit of values: inch": lambda d, m: (columns(d, 1 / 25.4, *VALUES), m),
    "swapped dx dy": lambda d, m: (exchanged(d, "dx", "dy"), m),
    "swapped X Y": lambda d, m: (exchanged(d, "X", "Y"), m),
    "inch": lambda d, m: (columns(d, 1 / 25.4, "X", "Y", "Z"), m),
    "metre": lambda d, m: (columns(d, 1e-3, "X", "Y", "Z"), m),
    "um": lambda d, m: (columns(d, 1e3, "X", "Y", "Z"), m),
    "radian": lambda d, m: (columns(d, np.pi / 180, "B", "C"), m),
    "axis sign X": lambda d, m: (columns(d, -1.0, "X"), m),
    "rotary sign B": lambda d, m: (d, turned(m, "B")),
    "tool length": lambda d, m: (d.with_columns({"tool_length": 320.0 - d.columns["tool_length"]}), m),
    "workpiece": lambda d, m: (
        d.with_columns(
            {
                name: d.columns[name]
                + 230e-6 * m.tip(d.positions(m), d.column("tool_length"))[:, "xyz".index(name[1])]
                for name in VALUES
            }
        ),
        m,
    ),
}  # fmt: skip
ALSO = {
    "sign of values": {"wrong sign"},
    "wrong sign": {"sign of values"},
    "wrong sign control": {"wrong sign"},
    "table active X": {"table active EXX"},
    "table active Y one way": {"table active Y"},
}


TWICE = {"unit of values: m", "unit of values: inch"}
"""Found in readings of other instruments, too, see `FEW_UNITS`."""


@pytest.mark.parametrize("kind", [kind for kind in CASES if FULL or kind not in TWICE])
def test_a_mistake_is_found_by_its_odds(kind: str, data: Measurement, known: Machine) -> None:
    wrong = find([CASES[kind](data, known)[0]], CASES[kind](data, known)[1])
    assert wrong is not None
    assert kind.split(":")[0] in (wrong.name, wrong.name.split()[0]) or wrong.name in ALSO.get(kind, ())
    assert wrong.odds > 20
    assert wrong.sure
    assert wrong.after_um < 0.6 * wrong.before_um


@pytest.mark.parametrize("kind", ["inch", "um", "swapped X Y", "axis sign X", "rotary sign B", "table active"])
def test_a_fit_is_given_up_only_if_its_end_is_hopeless(kind: str, data: Measurement, known: Machine) -> None:
    files, of = CASES[kind](data, known)
    end = misfit([files], of).left()
    for limit in (0.5 * end, 0.9 * end, 1.1 * end, 2 * end):
        left = misfit([files], of).left(hopeless=lambda least, most=limit: least > most)  # type: ignore[misc]
        assert left == end or (left == np.inf and end > limit)


@pytest.mark.parametrize("kind", ["unit of values: inch", "inch"])
def test_a_unit_is_no_squareness_that_moved(kind: str) -> None:
    """Where a file has squarenesses alone, other ones explain a wrong unit to the last digit, and so does a table."""
    lines = machine("three_axis")
    square = [Effect(name, (size,)) for name, size in (("EC0Y", 20e-6), ("EB0Z", -15e-6), ("EA0Z", 12e-6))]
    lines = lines.replace(effects=tuple(square))
    rows = np.sort(np.r_[np.arange(60), np.repeat(np.arange(0, 40, 4), 3)])
    right = simulate(plan(lines, "tcp", 60, 5).rows(rows), lines, Faults(2.0), 5)
    right = replace(right, headers=())  # the noise comes from repeats: it is in the wrong unit, too
    assert find([right], lines) is None
    wrong = find([CASES[kind](right, lines)[0]], lines)
    assert wrong is not None
    assert wrong.sure
    assert wrong.name == kind.split(":")[0]
    assert "inch" in wrong.title


UNITS = [kind for kind in CASES if kind.split(":")[0] in ("unit of values", "inch", "metre", "um", "radian")]


SEVERAL = [(kind, repeated) for repeated in (False, True) for kind in [*UNITS, "tool length: m"]]
FEW = [("inch", False), ("tool length: m", False), ("unit of values: um", True)]
"""Repeats change what values in another unit say of the noise; in one file each unit is found by `CASES`."""


@pytest.mark.parametrize(("kind", "repeated"), SEVERAL if FULL else FEW)
def test_a_unit_of_one_of_several_files(kind: str, repeated: bool, known: Machine) -> None:
    """Where noise comes from repeats, it is in the wrong unit, too."""
    again = np.repeat(np.arange(0, 40, 4), 4) if repeated else []
    rows = np.sort(np.r_[np.arange(60), again].astype(int))
    files = [simulate(plan(known, "tcp", 60, k).rows(rows), known, Faults(2.0), k) for k in (3, 4, 5)]
    if repeated:
        files = [replace(each, headers=()) for each in files]
    files = [replace(each, path=f"part{k}.csv") for k, each in enumerate(files)]
    change = CASES.get(kind, lambda d, m: (columns(d, 1e-3, "tool_length"), m))
    wrong = find([files[0], change(files[1], known)[0], files[2]], known)
    assert wrong is not None
    assert wrong.sure
    assert wrong.name == kind.split(":")[0]
    assert "part1.csv" in wrong.title
    for undone, right in zip(wrong.measurements, files, strict=True):
        for name, values in right.columns.items():
            assert undone.columns[name] == pytest.approx(values, rel=1e-12)


READINGS = {"gauge": ("length",), "bar": ("length",), "tool": ("x", "y", "z"), "probe": ("mx", "my", "mz")}


FACTORS = (1e3, 1e-3, 1 / 25.4)
IN_UNITS = [(kind, factor, beside) for kind in READINGS for factor in FACTORS for beside in (0, 2)]
"""Of one file, and of one of three."""
FEW_UNITS = [("gauge", 1e3, 0), ("bar", 1 / 25.4, 0), ("tool", 1e-3, 0), ("probe", 1e-3, 0), ("gauge", 1 / 25.4, 2)]
"""Each reading and each unit, one file and three; targets in metres beside two other files take eight times as long."""


@pytest.mark.parametrize(("kind", "factor", "beside"), IN_UNITS if FULL else FEW_UNITS)
def test_a_unit_of_readings(kind: str, factor: float, beside: int, known: Machine) -> None:
    """Lengths, targets and positions of a probe are no deviations: in another unit they are off by metres."""
    files = [simulate(plan(known, kind, 80, k), known, Faults(2.0), k) for k in range(3, 4 + beside)]
    files = [replace(each, path=f"part{k}.csv") for k, each in enumerate(files)]
    wrong = find([columns(files[0], factor, *READINGS[kind]), *files[1:]], known)
    assert wrong is not None
    assert wrong.sure
    assert ("part0.csv" in wrong.title) == bool(beside)
    for name in READINGS[kind]:
        assert wrong.measurements[0].columns[name] == pytest.approx(files[0].columns[name], rel=1e-12)


LENGTHS = ("length", "nominal", "radius")
PLACES: dict[str, Callable[[Measurement], Measurement]] = {
    "inch": lambda d: d.times("XYZ", 1 / 25.4),
    "inch: positions and lengths": lambda d: d.times((*"XYZ", *LENGTHS), 1 / 25.4),
    "metre: positions and lengths": lambda d: d.times((*"XYZ", *LENGTHS), 1e-3),
    "swapped X Y": lambda d: d.exchanged("X", "Y") or d,
    "axis sign Z": lambda d: d.times("Z", -1.0),
    "axis sign X": lambda d: d.times("X", -1.0, CENTRE),
}
MISPLACED = [(kind, change) for kind in ("gauge", "bar", "probe") for change in PLACES]
MISPLACED = [pair for pair in MISPLACED if pair[0] != "probe" or "lengths" not in pair[1]]


@pytest.mark.parametrize(("kind", "change"), MISPLACED if FULL else MISPLACED[1::4])
def test_positions_in_every_column_that_holds_them(kind: str, change: str, known: Machine) -> None:
    """Both ends of a length, the centre of a bar, what a probe reads: X is X whatever its column is called."""
    right = simulate(plan(known, kind, 80, 3), known, Faults(2.0), 3)
    mistaken = PLACES[change](right)
    wrong = find([mistaken], known)
    assert wrong is not None
    assert wrong.sure
    assert wrong.name == change.split(":")[0]
    assert change.split(": ")[-1] in wrong.title or ":" not in change
    for name, values in right.columns.items():
        assert wrong.measurements[0].columns[name] == pytest.approx(values, rel=1e-12)


def test_a_sign_of_values_that_constants_could_explain_as_well(data: Measurement, known: Machine) -> None:
    """Six constants that all changed their signs over night explain it; one mistake is likelier."""
    constants = known.replace(effects=tuple(e for e in known.effects if is_free(e)))
    poses = plan(constants, "tcp", 120, 3)
    seen = simulate(poses, constants, Faults(1.0), 4)
    found = diagnose([columns(seen.with_header("noise_um", "1"), -1.0, *VALUES)], constants)
    assert found.findings[0].candidate.name in ("sign of values", "wrong sign")


def test_tools_without_lengths_are_told_by_their_sets(known: Machine) -> None:
    poses = plan(known, "tcp", 120, 3)
    poses = replace(poses, labels={"set": tuple(f"{length:g}" for length in poses.columns["tool_length"])})
    seen = simulate(poses, known, Faults(1.0), 4)
    none = seen.with_columns({"tool_length": 0.0 * seen.columns["tool_length"]})
    wrong = find([none], known)
    assert wrong is not None
    assert wrong.name == "tool length"
    assert wrong.after_um < 2.0


def test_a_file_that_is_right_has_no_mistake(data: Measurement, known: Machine) -> None:
    assert find([data], known) is None


def test_a_mistake_that_is_refused_is_not_named(data: Measurement, known: Machine) -> None:
    wrong = find([columns(data, -1.0, "dy")], known, ["sign-of-dy"])
    assert wrong is None or wrong.name != "sign of dy"


TABLES = ("EXX", "EYX", "EZX", "EXY", "EYY", "EZY", "EXZ", "EYZ", "EZZ")


def with_tables(known: Machine, names: tuple[str, ...], seed: int) -> Machine:
    """The constants of a machine, and a table of its own for each of these errors: walks of 8 um rms."""
    random, effects = np.random.default_rng(seed), [effect for effect in known.effects if is_free(effect)]
    for name in names:
        places = np.linspace(*next(axis.range for axis in known.axes if axis.name == name[2]), 13)
        walk = np.cumsum(random.normal(size=13))
        walk -= np.polyval(np.polyfit(places, walk, 1), places)
        table = PiecewiseLinear(positions=tuple(places.tolist()))
        effects.append(Effect(name, tuple((0.008 * walk / np.sqrt(np.mean(walk**2))).tolist()), table))
    return known.replace(effects=tuple(effects))


@pytest.mark.parametrize("seed", range(1, 1 + some(3)))
def test_the_tables_of_another_machine(known: Machine, seed: int) -> None:
    """None of them holds, and nine curves are missing: each name by itself would say no such thing."""
    seen = simulate(plan(known, "tcp", 200, seed), with_tables(known, TABLES, seed), Faults(3.0), seed)
    wrong = find([seen], with_tables(known, TABLES, 100 + seed))
    assert wrong is not None
    assert wrong.name == "another machine"
    assert wrong.sure
    assert all(is_free(effect) for effect in wrong.machine.effects)


@pytest.mark.parametrize("count", [0, 1, 3])
def test_some_tables_that_changed_are_not_another_machine(known: Machine, count: int) -> None:
    true = with_tables(known, TABLES, 5)
    changed = {effect.name: effect for effect in with_tables(known, TABLES, 6).effects if effect.name in TABLES[:count]}
    seen = simulate(plan(known, "tcp", 200, 5), true, Faults(3.0), 5)
    wrong = find([seen], true.replace(effects=tuple(changed.get(effect.name, effect) for effect in true.effects)))
    assert wrong is None or wrong.name != "another machine"
