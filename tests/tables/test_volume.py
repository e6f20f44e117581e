"""Grids made from a machine, and how many nodes they take."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ncfix.diagnostics import RefusedError, UsageError
from ncfix.machine import State, load, loads
from ncfix.tables.correction import (
    corners,
    even_poses,
    exact_correction,
    linear_axes,
    random_poses,
    ranges_of,
    steps_towards,
)
from ncfix.tables.volume import Volume, inputs_that_matter, search
from ncfix.testing import single_error
from tables import table_4_2

STRAIGHT = """
ncfix = 1
name = "the 13 errors of Table 4-3"
topology = "w C B X F Z Y t"
axis.X = { type = "linear", direction = [-1, 0, 0], range = [-305, 305] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-280, 280] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [0, 560] }
axis.B = { type = "rotary", direction = [0, -1, 0], range = [-90, 90] }
axis.C = { type = "rotary", direction = [0, 0, -1], range = [-360, 360] }
"""
THIRTEEN = {  # Esmaeili Marzdashti (2021), Table 4-3, mm and rad
    "EA0B": -0.000040,
    "EC0B": -0.000001,
    "EX0C": -0.095600,
    "EA0C": -0.000012,
    "EB0C": 0.000011,
    "EB0Z": -0.000010,
    "EA0Y": -0.000038,
    "EC0Y": 0.000015,
    "EY0S": 0.029300,
    "EX0S": -0.100000,
}
GAINS = {"EXX": -0.000017, "EYY": -0.000023, "EZZ": -0.000032}


def thirteen() -> str:
    places = "".join(f'[[effect]]\nname = "{name}"\ncoefficients = [{value}]\n' for name, value in THIRTEEN.items())
    gain = '[[effect]]\nname = "{}"\nbasis = "polynomial"\ndegree = [1]\ncoefficients = [{}]\n'
    return STRAIGHT + places + "".join(gain.format(*pair) for pair in GAINS.items())


def test_two_nodes_along_each_axis_do_for_the_thirteen_errors() -> None:
    """Thesis, section 4.3: the 13-error model needs a grid of 2 x 2 x 2 (8 nodes), to 0.1 um."""
    machine = loads(thirteen())
    mesh = search(Volume.of(machine, ("X", "Y", "Z"), ranges_of(machine), 275.86), 1e-4, [25] * 3, 15625)
    assert mesh.reached
    assert mesh.grid.counts == (2, 2, 2)


def test_unequal_counts_take_fewer_nodes_than_equal_ones() -> None:
    machine = single_error("EBX", 40e-6)
    volume = Volume.of(machine, ("X", "Y", "Z"), ranges_of(machine), 100.0)
    target = 2e-4
    free, same = (search(volume, target, [25] * 3, 15625, equal) for equal in (False, True))
    assert free.reached
    assert same.reached
    assert max(free.left, same.left) <= target
    assert len(set(same.grid.counts)) == 1
    assert free.grid.points < same.grid.points


def test_limits_end_the_search() -> None:
    machine = single_error("EXX")
    mesh = search(Volume.of(machine, ("X", "Y", "Z"), ranges_of(machine), 0.0), 1e-7, [4] * 3, 30)
    assert not mesh.reached
    assert mesh.grid.points <= 30
    assert max(mesh.grid.counts) <= 4


def test_nodes_hold_the_exact_correction() -> None:
    machine = single_error("ECX", 50e-6, "w X F Y Z t")
    grid = Volume.of(machine, ("X", "Y", "Z"), ranges_of(machine), 80.0).grid([3, 2, 4])
    place = np.array([[grid.nodes[0][1], grid.nodes[1][1], grid.nodes[2][2]]])
    names = machine.axis_names
    q = place[:, ["XYZ".index(name) for name in names]]
    corrected = q + grid.at(place)[:, [grid.outputs.index(name) for name in names]]
    gap = machine.actual_tip(corrected, State(80.0)) - machine.tip(q, 80.0)
    assert np.abs(gap).max() < 1e-7  # where the iteration stops, mm


def test_only_rotary_axes_that_matter_are_inputs() -> None:
    text = thirteen()
    machine = loads(text)
    assert set(inputs_that_matter(machine, ranges_of(machine), 0.0)) == set("XYZBC")
    linear = loads(text[: text.index("[[effect]]")] + '[[effect]]\nname = "EXX"\ncoefficients = [0.01]\n')
    assert set(inputs_that_matter(linear, ranges_of(linear), 0.0)) == set("XYZ")


def test_what_cannot_be_corrected_is_refused() -> None:
    machine = single_error("EXX", 3e6)
    with pytest.raises(RefusedError) as caught:
        exact_correction(machine, random_poses(ranges_of(machine), 20), State())
    assert caught.value.code == "NCF482"


def test_linear_axes_that_a_rotary_one_turns_into_one_plane_are_refused() -> None:
    """A Y that a rotary axis between X and Y has turned along X."""
    flat = np.array([[[1.0, 1.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]])
    with pytest.raises(RefusedError, match="do not span space") as caught:
        steps_towards(np.ones((1, 3)), flat)
    assert caught.value.code == "NCF482"


@pytest.mark.parametrize(
    "given", [{"U": (0.0, 1.0)}, {"X": (5.0, 5.0)}, {"X": (-200.0, 301.0)}], ids=["no axis", "empty", "beyond travel"]
)
def test_wrong_ranges(given: dict[str, tuple[float, float]]) -> None:
    with pytest.raises(UsageError) as caught:
        ranges_of(single_error("EXX"), given)
    assert caught.value.code == "NCF483"


def test_table_4_2_takes_fewer_nodes_than_the_thesis(figures: Callable[[str], None]) -> None:
    """84 coefficients: the thesis's real data took 19 x 19 x 19 equal steps. What those leave is the target."""
    machine = table_4_2.machine()
    assert len(table_4_2.coefficients()) == 84
    volume = Volume.of(machine, ("X", "Y", "Z"), ranges_of(machine), table_4_2.LENGTH)
    target = volume.left(volume.grid([19] * 3))
    same, free = (search(volume, target, [25] * 3, 15625, equal) for equal in (True, False))
    assert same.reached
    assert free.reached
    assert same.grid.points <= 19**3
    assert free.grid.points < same.grid.points
    counts = " x ".join(map(str, free.grid.counts))
    figures(
        f"Table 4-2, {1e3 * target:.3f} um: equal steps {same.grid.counts[0]}^3 = {same.grid.points} nodes, "
        f"unequal {counts} = {free.grid.points}"
    )


def test_nodes_fitted_to_what_is_around_them_halve_the_error() -> None:
    """A parabola between nodes: chords leave h^2 f''/8 of one sign, the fit about half of that, of both."""
    machine = single_error("EXX", 0.05)
    space = ranges_of(machine)
    left = [
        volume.left(volume.grid([7, 2, 2]))
        for volume in (Volume.of(machine, ("X", "Y", "Z"), space, 0.0, area) for area in (False, True))
    ]
    assert left[1] < 0.8 * left[0]


def test_the_middle_over_all_angles_is_worked_out_in_seconds(root: Path) -> None:
    """It took minutes: every place of every grid was looked at with seventeen positions of the rotary axes."""
    machine = load(str(root / "examples" / "machines" / "dmu50.toml"))
    space = ranges_of(machine)
    begun = time.process_time()
    volume = Volume.over_all(machine, ("X", "Y", "Z"), space, 120.0, area=True)
    volume.grid([25, 25, 25])
    assert time.process_time() - begun < 30  # less than four on two processors of the year 2026; more than 80 before
    places = random_poses(space[[machine.axis_names.index(name) for name in "XYZ"]], 40, seed=23)
    q = np.zeros((len(places), len(space)))
    q[:, [machine.axis_names.index(name) for name in "XYZ"]] = places
    low = high = None
    for rest in [*corners(space), *even_poses(space, 12), np.zeros(len(space))]:
        q[:, machine.rotary] = np.asarray(rest)[machine.rotary]
        found = exact_correction(machine, q, State(120.0))[:, linear_axes(machine)]
        low = found if low is None else np.minimum(low, found)
        high = found if high is None else np.maximum(high, found)
    assert np.abs(volume.exact(places) - (low + high) / 2).max() < 5e-4
