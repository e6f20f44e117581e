"""What no tables can do better: bounds that are right, and that are come near to."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.arrays import Array
from ncfix.machine import Effect, Machine, loads
from ncfix.machine.basis import Fourier
from ncfix.tables.control import Request, get_control
from ncfix.tables.correction import ranges_of, residual
from ncfix.tables.export import export
from ncfix.tables.grid import Grid
from ncfix.tables.lower_bounds import least_of_even_nodes, least_of_functions, least_of_own_axis, least_of_sums
from ncfix.tables.volume import Volume
from ncfix.testing import single_error

TURNING = """
ncfix = 1
name = "a table that turns"
topology = "w C F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-200, 300] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-150, 250] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-300, 0] }
axis.C = { type = "rotary", direction = [0, 0, -1], range = [0, 180] }
"""


def turning() -> Machine:
    """Z of the table goes 10 um down and up again over half a turn of C."""
    return loads(TURNING).replace(effects=(Effect("EZC", (0.01, 0.0), Fourier((1,))),))


def test_a_grid_in_space_cannot_follow_c() -> None:
    found = least_of_functions(turning(), ranges_of(turning()), 0.0, "XYZ", ways=True)
    assert found.value == pytest.approx(0.01, rel=1e-9)  # from +10 to -10 um where X, Y and Z stand
    assert "at least 10.00 um remain" in found.sentence


def test_the_grid_in_the_middle_comes_near_to_it() -> None:
    machine = turning()
    left = {}
    for rotary in ("zero", "middle"):
        control = get_control("fanuc")
        settings = control.settings({"sign": "error", "rotary": rotary, "play": "no"})
        request = Request(machine, ranges_of(machine), 0.0, 0.001, settings)
        written = control.write(request)
        found = residual(machine, control.read(written.files), request.space, 0.0, 2000)
        left[rotary] = float(found.after.max())
        assert written.least is not None
        assert written.least.value <= left[rotary] + 1e-4  # poses at random do not meet the very ends
    assert left["middle"] == pytest.approx(0.01, abs=5e-5)  # half a detection unit
    assert left["zero"] == pytest.approx(0.02, abs=5e-5)


def test_a_table_of_one_axis_over_itself_does_not_see_the_others() -> None:
    """A turn of the X slide about Z shifts the tip along X by the angle times Y: 40 um at Y250, -24 at Y-150."""
    machine = single_error("EXX").replace(effects=(Effect("EC0X", (0.0,)), Effect("EC0Y", (80e-6,))))
    found = least_of_own_axis(machine, ranges_of(machine), 0.0)
    assert found.value == pytest.approx(80e-6 * 400 / 2, rel=1e-7)  # the angle squared is 6e-9
    assert "X" in found.why


def test_sums_cannot_say_a_product() -> None:
    """u times v over a square leaves a quarter of what it spans: the corners alternate in sign."""
    machine = single_error("ECX", 40e-6)
    found = least_of_sums(machine, ranges_of(machine), 0.0)
    made = export(
        get_control("heidenhain"),
        Request(machine, ranges_of(machine), 0.0, 0.001, get_control("heidenhain").settings({"sign": "error"})),
        4000,
    )
    assert 0.3 * made.left.after.max() < found.value < made.left.after.max()


def wavy(positions: Array) -> Array:
    return 0.001 * np.sin(positions[:, :1] / 5.0)


def test_even_nodes_that_are_too_few_cannot_follow_a_wave() -> None:
    volume = Volume(("X",), np.array([[0.0, 100.0]]), (1.0,), ("X",), wavy)
    found = least_of_even_nodes(volume, 0, 3)
    assert found.value == pytest.approx(0.001, rel=0.05)  # the very ends of the line may be met
    assert least_of_even_nodes(volume, 0, 200).value < 2e-6


@pytest.mark.parametrize("count", [4, 8, 16])
def test_no_fit_is_better_than_the_bound(count: int) -> None:
    volume = Volume(("X",), np.array([[0.0, 100.0]]), (1.0,), ("X",), wavy, area=True)
    bound = least_of_even_nodes(volume, 0, count).value
    fit = volume.grid([count])
    assert bound <= volume.left(fit) * 1.001
    rng = np.random.default_rng(5)
    for _ in range(20):
        other = Grid(fit.inputs, fit.nodes, fit.outputs, fit.values + 1e-4 * rng.normal(size=fit.values.shape))
        assert bound <= volume.left(other) * 1.001


def test_points_only_where_the_correction_changes() -> None:
    """Level up to 40: the points begin there, and what is before them is held."""

    def exact(positions: Array) -> Array:
        return 0.01 * np.maximum(positions[:, :1] - 40.0, 0.0) ** 2 / 3600

    whole = Volume(("X",), np.array([[0.0, 100.0]]), (1.0,), ("X",), exact, kinks=(np.array([40.0]),))
    part = whole.trimmed(0, 1e-6)
    assert part.covered[0] == pytest.approx([40.0, 100.0])
    assert part.ranges[0].tolist() == [0.0, 100.0]
    assert part.left(part.grid([6])) < 0.6 * whole.left(whole.grid([6]))


def test_a_correction_that_is_level_everywhere_keeps_its_range() -> None:
    level = Volume(("X",), np.array([[0.0, 100.0]]), (1.0,), ("X",), lambda positions: np.zeros_like(positions))
    assert level.trimmed(0, 1e-6).covered[0].tolist() == [0.0, 100.0]
