"""What every strategy promises: `embed(compensate(p)) == p` for the tool tip, at more than ten thousand poses."""

from __future__ import annotations

import numpy as np
import pytest

from compensate.machines_at_random import SMOOTH, TOPOLOGIES, perfect, random_machine
from compensate.motions import motions, plan
from ncfix.compensate.plan import ends
from ncfix.compensate.plan.findings import PoseError
from ncfix.compensate.plan.strategies import Strategy, get_strategy, strategies
from ncfix.control.moves import MotionKind
from ncfix.diagnostics import UsageError
from ncfix.machine import Effect, Machine, State
from ncfix.machine.piecewise import PiecewiseConstant

POSES = 1000
NANOMETRE = 1e-6
EXACT = ("rotary-then-linear", "full", "position")


def poses(machine: Machine, rng: np.random.Generator, n: int = POSES) -> np.ndarray:
    q = rng.uniform(-200, 200, (n, len(machine.axes)))
    q[:, machine.rotary] = rng.uniform(-2, 2, (n, int(machine.rotary.sum())))
    return q


def state_of(machine: Machine, rng: np.random.Generator, n: int = POSES) -> State:
    return State(rng.uniform(20, 150, n), rng.integers(-1, 2, (n, len(machine.axes))))


def off(machine: Machine, q: np.ndarray, wanted: np.ndarray, state: State) -> np.ndarray:
    """The independent judge: poses as matrices, not the fast path to the tip that strategies use."""
    gap = machine.actual(q, state)[:, :3, 3] - machine.nominal(wanted, state.tool_length)[:, :3, 3]
    return np.linalg.norm(gap, axis=1)


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("kind", list(TOPOLOGIES))
def test_the_tip_of_the_real_machine_is_where_a_perfect_one_has_it(
    kind: str, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """To 1 nm, with errors of 100 um and 200 urad on every joint, play, all bases, any tool: 12,000 poses in all."""
    rng = np.random.default_rng(len(kind) + len(name))
    machine = random_machine(rng, TOPOLOGIES[kind], SMOOTH, backlash=8.0)
    q, state = poses(machine, rng), state_of(machine, rng)
    before, after = off(machine, q, q, state), off(machine, get_strategy(name).correct(machine, q, state), q, state)
    with capsys.disabled():
        print(f"\n{kind}, {name}: {before.max() * 1e3:.0f} um before, {after.max() * 1e6:.2g} nm after", end="")
    assert before.max() > 0.1
    assert after.max() < NANOMETRE


@pytest.mark.parametrize("name", EXACT)
def test_a_machine_without_errors_is_left_exactly_alone(name: str) -> None:
    machine = perfect(TOPOLOGIES["table-table"]).replace(effects=(Effect("EXX", (0.0,)),))
    q = poses(machine, np.random.default_rng(0))
    corrected = get_strategy(name).correct(machine, q, State(100.0))
    assert (corrected == q).all()
    assert corrected is not q


@pytest.mark.parametrize("name", ["rotary-then-linear", "position"])
def test_rotary_words_stay_as_they_are(name: str) -> None:
    rng = np.random.default_rng(4)
    machine = random_machine(rng, TOPOLOGIES["table-head"])
    q = poses(machine, rng)
    corrected = get_strategy(name).correct(machine, q, State(50.0))
    assert (corrected[:, machine.rotary] == q[:, machine.rotary]).all()


def test_poses_with_numbers_missing_are_not_converged_and_do_no_harm() -> None:
    rng = np.random.default_rng(7)
    machine = random_machine(rng, TOPOLOGIES["table-table"])
    q = poses(machine, rng, 5)
    q[2, 0] = np.nan
    for name in EXACT:
        result = get_strategy(name).solve(machine, q, State(100.0))
        assert result.converged.tolist() == [True, True, False, True, True]
        alone = get_strategy(name).solve(machine, q[3:], State(100.0))
        np.testing.assert_array_equal(result.q[3:], alone.q)


def test_a_point_that_a_jump_of_the_error_leaves_out_is_refused() -> None:
    """The error of X jumps from 0 to 10 um at 100 mm: the tip never gets to 100.005."""
    machine = jumping()
    q = np.array([[99.0, 0.0, 0.0], [100.005, 0.0, 0.0], [101.0, 0.0, 0.0]])
    for name in EXACT:
        with pytest.raises(PoseError) as raised:
            get_strategy(name).correct(machine, q, State())
        assert raised.value.code == "NCF403"
        assert raised.value.rows.tolist() == [False, True, False]


def test_a_point_at_the_edge_of_a_jump_is_reached_from_below() -> None:
    corrected = get_strategy("position").correct(jumping(), np.array([[100.0, 0.0, 0.0]]), State())
    assert 100.0 - NANOMETRE < corrected[0, 0] < 100.0


def jumping() -> Machine:
    """A machine whose error of X jumps from 0 to 10 um at 100 mm."""
    return perfect("w F X Y Z t").replace(effects=(Effect("EXX", (0.0, 0.01), PiecewiseConstant((100.0,))),))


@pytest.mark.parametrize("strategy", strategies().values(), ids=list(strategies()))
def test_each_says_what_it_leaves(strategy: Strategy) -> None:
    assert strategy.leaves.endswith(".")
    assert get_strategy(strategy.name).name == strategy.name


def test_an_unknown_name_is_a_coded_error_with_the_names_there_are() -> None:
    with pytest.raises(UsageError) as raised:
        get_strategy("perfect")
    assert raised.value.code == "NCF411"
    assert "rotary-then-linear" in raised.value.messages[0].hint


def test_order_of_poses_does_not_matter_and_batches_do_not_either() -> None:
    rng = np.random.default_rng(8)
    machine = random_machine(rng, TOPOLOGIES["head-head"])
    q, state = poses(machine, rng, 300), State(90.0)
    for name in EXACT:
        whole = get_strategy(name).correct(machine, q, state)
        parts = [get_strategy(name).correct(machine, q[i : i + 7], state) for i in range(0, 300, 7)]
        np.testing.assert_allclose(np.concatenate(parts), whole, rtol=0, atol=2 * NANOMETRE)


def test_a_plan_of_very_many_points_is_that_of_the_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ends are corrected in batches, which must not show: not even where the thesis leaves its first point alone."""
    machine = random_machine(np.random.default_rng(9), "w C B F X Y Z t", ("polynomial",))
    q = np.random.default_rng(10).uniform(-0.5, 0.5, (50, 5)) * np.where(machine.rotary, 1.0, 200.0)
    moves = motions(machine, q[0], q, MotionKind.RAPID)
    for name, strategy in strategies().items():
        whole = plan(machine, moves, strategy, 1e-3).pieces.end
        with monkeypatch.context() as patch:
            patch.setattr(ends, "BATCH", 7)
            np.testing.assert_array_equal(plan(machine, moves, strategy, 1e-3).pieces.end, whole, err_msg=name)
