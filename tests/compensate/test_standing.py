"""Where the machine stands when some motions are corrected and others kept."""

from __future__ import annotations

import numpy as np

from compensate.machines_at_random import TOPOLOGIES, perfect
from compensate.motions import changed, motions
from ncfix.compensate.plan.ends import EndCommands, standing
from ncfix.compensate.plan.kinematics import commands_from_joints, joints_from_commands
from ncfix.control.moves import MotionKind, Moves
from ncfix.machine import Machine

MACHINE = perfect("w F X Y Z t")
SHIFT = np.array([0.01, -0.02, 0.03])


def stand(moves: Moves, unchanged: list[bool], machine: Machine = MACHINE, shift: np.ndarray = SHIFT) -> EndCommands:
    return standing(machine, moves, moves.end + shift, np.array(unchanged))


def test_a_motion_starts_where_the_one_before_really_ended() -> None:
    moves = motions(MACHINE, (0, 0, 0), [(1, 0, 0), (2, 1, 0), (3, 1, 1)])
    where = stand(moves, [False, False, False])
    np.testing.assert_allclose(where.end, moves.end + SHIFT)
    np.testing.assert_allclose(where.start, [moves.start[0], *(moves.end + SHIFT)[:2]])


def test_a_kept_motion_takes_away_the_displacement_of_the_axes_that_it_names() -> None:
    moves = motions(MACHINE, (0, 0, 0), [(1, 0, 0), (1, 0, 50), (2, 0, 50)])
    moves.programmed[1] = [False, False, True]
    where = stand(moves, [False, True, True])
    np.testing.assert_allclose(where.end[1], moves.end[1] + SHIFT * [1, 1, 0])
    np.testing.assert_allclose(where.start[2], where.end[1])
    np.testing.assert_allclose(where.end[2], moves.end[2])


def test_a_kept_increment_starts_from_where_the_machine_stands() -> None:
    moves = motions(MACHINE, (0, 0, 0), [(1, 0, 0), (2, 0, 0)])
    moves = changed(moves, incremental=np.array([False, True]))
    moves.programmed[1] = [True, False, False]
    where = stand(moves, [False, True])
    np.testing.assert_allclose(where.end[1], moves.end[1] + SHIFT)


def test_a_dwell_changes_nothing() -> None:
    moves = motions(
        MACHINE, (0, 0, 0), [(1, 0, 0), (1, 0, 0), (2, 0, 0)], [MotionKind.FEED, MotionKind.DWELL, MotionKind.FEED]
    )
    moves.programmed[1] = False
    where = stand(moves, [False, True, False])
    np.testing.assert_allclose(where.start[2], moves.end[0] + SHIFT)


def test_where_the_control_has_gone_elsewhere_its_word_is_taken() -> None:
    moves = motions(MACHINE, (0, 0, 0), [(1, 0, 0), (2, 0, 0)])
    moves.start[1, 2] = 80.0
    where = stand(moves, [False, False])
    np.testing.assert_allclose(where.start[1], [1 + SHIFT[0], SHIFT[1], 80.0])


def test_after_a_canned_cycle_the_machine_is_back_where_the_cycle_began() -> None:
    """The tracer's next motion starts at the height at which the cycle started."""
    moves = motions(
        MACHINE,
        (0, 0, 0),
        [(1, 0, 5), (4, 0, -10), (9, 0, -10)],
        [MotionKind.RAPID, MotionKind.CYCLE, MotionKind.CYCLE],
    )
    moves.start[2, 2] = 5.0
    where = stand(moves, [False, False, False])
    np.testing.assert_allclose(where.start[2], [4 + SHIFT[0], SHIFT[1], 5 + SHIFT[2]])
    np.testing.assert_allclose(where.end[1], moves.end[1] + SHIFT)


def test_what_is_not_known_stays_unknown_and_does_not_spread() -> None:
    moves = motions(MACHINE, (np.nan, np.nan, np.nan), [(1, 0, 0), (2, 0, 0)])
    where = stand(moves, [False, False])
    assert np.isnan(where.start[0]).all()
    np.testing.assert_allclose(where.end, moves.end + SHIFT)


def test_switching_tcp_on_does_not_move_the_machine() -> None:
    """The last plain command is displaced; the first one with TCP starts from the same axis positions."""
    machine = perfect(TOPOLOGIES["table-table"])
    plain = np.array([0.4, 0.3, 10.0, 20.0, 30.0])
    moves = motions(machine, plain, [plain + np.array([0, 0, 5, 0, 0]), plain])
    tcp = np.array([False, True])
    lengths = np.full(2, 60.0)
    at = joints_from_commands(machine, moves.end[:1], tcp[:1], lengths[:1])
    moves.start[1] = commands_from_joints(machine, at, tcp[1:], lengths[1:])[0]
    moves = changed(moves, tcp=tcp, tool_length=lengths)
    shift = np.array([0, 0, 0.01, -0.02, 0.03])
    where = stand(moves, [False, False], machine, shift)
    really = joints_from_commands(machine, where.start[1:], tcp[1:], lengths[1:])
    np.testing.assert_allclose(really[0], moves.end[0] + shift, rtol=0, atol=1e-9)
