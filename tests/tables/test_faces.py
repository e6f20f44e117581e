"""A correction of five axes as a sum of grids over three: exact where the sum can say it, and few nodes."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.arrays import Array
from ncfix.tables.grid import Bending
from ncfix.tables.grid_sums import faces, interactions, searched
from ncfix.tables.volume import Volume

NAMES = ("X", "Y", "Z", "A", "C")
RANGES = np.array([[-300.0, 200.0], [-200.0, 250.0], [0.0, 400.0], [-1.5, 1.0], [-np.pi, np.pi]])
TARGET = 1e-3


def tilting_table(q: Array) -> Array:
    """A table that tilts by angles that change with both rotary axes, on straight lines with a squareness, mm."""
    x, y, z, a, c = q.T
    tilt = 20e-6 * np.stack([np.sin(c) * np.cos(a), np.cos(2 * c), np.sin(c) * np.sin(a)], axis=1)
    turned = np.cross(tilt, q[:, :3])
    straight = np.stack([30e-6 * y + 1e-8 * x * y, 2e-8 * z**2, 10e-6 * x], axis=1)
    return turned + straight


def volume(exact: object = tilting_table, **more: object) -> Volume:
    units = (1.0, 1.0, 1.0, np.pi / 180, np.pi / 180)
    return Volume(NAMES, RANGES, units, ("X", "Y", "Z"), exact, **more)  # type: ignore[arg-type]


def test_parts_of_a_function_are_told_apart() -> None:
    """x + y z on nodes with mean zero: one part of x alone, one of y and z together, and nothing else."""
    x, y, z = np.meshgrid(*[np.array([-1.0, 0.0, 1.0])] * 3, indexing="ij")
    found = interactions((x + y * z)[..., None], 3)
    sizes = {"".join("xyz"[axis] for axis in sorted(key)): float(size[0]) for key, size in found.items()}
    assert sizes.pop("x") == pytest.approx(np.sqrt(2 / 3))
    assert sizes.pop("yz") == pytest.approx(2 / 3)
    assert max(sizes.values()) < 1e-15  # rounding


def test_faces_have_three_inputs_and_an_owner_each() -> None:
    found = faces(volume(), [0, 1, 2], TARGET)
    assert found is not None
    assert all(face.owner in face.inputs and len(face.inputs) <= 3 for face in found)
    for output in range(3):
        owners = [face.owner for face in found if output in face.outputs]
        assert len(owners) == len(set(owners)) <= 3


@pytest.mark.parametrize("uneven", [False, True])
@pytest.mark.parametrize("area", [False, True])
def test_the_sum_meets_the_target_with_few_nodes(uneven: bool, area: bool) -> None:
    """A single grid with 20,000 nodes has seven along each axis: it leaves some micrometres."""
    whole = volume(uneven=uneven, area=area)
    found = faces(whole, [0, 1, 2], TARGET)
    assert found is not None
    made = searched(whole, found, TARGET, 20_000)
    assert made.reached
    assert made.left <= TARGET
    assert made.points < 8000
    assert volume().left(volume().grid([7] * 5)) > 3 * TARGET


def test_too_few_nodes_are_kept_to() -> None:
    whole = volume()
    found = faces(whole, [0, 1, 2], TARGET)
    assert found is not None
    made = searched(whole, found, TARGET, 300)
    assert not made.reached
    assert made.points <= 300


def test_what_needs_all_axes_at_once_has_no_faces_of_three() -> None:
    def tangled(q: Array) -> Array:
        return np.stack([1e-2 * np.prod(q / RANGES[:, 1], axis=1)] * 3, axis=1)

    found = faces(volume(tangled), [0, 1, 2], TARGET)
    assert found is not None
    assert {face.inputs for face in found} == {(0, 1, 2, 3, 4)}


def test_kinks_that_are_fine_steps_but_for_rounding_are_not_there_twice() -> None:
    """A file could not tell such nodes apart."""
    kinks = np.array([1e-12, 25.0 + 1e-10, 50.0 - 1e-10, 100.0 - 1e-12])
    bending = Bending.over(0.0, 100.0, kinks, lambda line: np.sign(line - 25.0)[None, :, None])
    assert np.diff(bending.places).min() > 1e-5
    assert (bending.places[0], bending.places[-1]) == (0.0, 100.0)
    assert all(np.diff(np.round(nodes, 6)).min() > 0 for nodes, _ in bending.uneven().values())


def test_uneven_nodes_lie_on_the_kinks() -> None:
    """A table of three straight lines takes four nodes, wherever they meet."""
    knots, values = np.array([0.0, 13.7, 61.3, 100.0]), np.array([0.0, 0.02, -0.01, 0.03])
    bending = Bending.over(0.0, 100.0, knots, lambda line: np.interp(line, knots, values)[None, :, None])
    nodes, missed = bending.uneven()[4]
    assert nodes == pytest.approx(knots)
    chords = np.interp(np.linspace(0, 100, 999), nodes, np.interp(nodes, knots, values))
    assert np.abs(chords - np.interp(np.linspace(0, 100, 999), knots, values)).max() <= missed
    assert bending.missed(np.linspace(0, 100, 4)) > 0.005
