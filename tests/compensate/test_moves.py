"""What the columns of motions say together, row by row, and what may pass."""

from __future__ import annotations

import numpy as np

from compensate.machines_at_random import perfect
from compensate.motions import changed, motions
from ncfix.control.moves import PASS_RULES, RAPIDS, CycleCall, MotionKind, Pass, Rule, TcpState

CALLS = tuple(CycleCall(name, (), (), "Z", modal=True) for name in ("CYCLE81", "CYCLE83"))


def test_what_columns_say_together() -> None:
    rng, n = np.random.default_rng(1), 400
    machine = perfect("w C F X Y Z t")
    moves = motions(machine, np.zeros(4), rng.integers(0, 2, (n, 4)).astype(float))
    counted, placed, resting = (rng.random((n, 4)) < share for share in (0.5, 0.7, 0.1))
    columns = {
        "kind": rng.choice(list(MotionKind), n).astype(np.int8),
        "rule": rng.choice(list(Rule), n).astype(np.int8),
        "programmed": rng.random((n, 4)) < 0.3,
        "incremental": rng.random(n) < 0.5,
        "arc_absolute": rng.random(n) < 0.5,
        "tcp": rng.random(n) < 0.5,
    }
    short = changed(moves, **columns)
    length = np.where(rng.random(n) < 0.5, np.nan, 7.0)
    more = {"counted": counted, "placed": placed, "resting": resting, "fixed_centre": rng.random(n) < 0.5}
    full = changed(short, tcp_length=length, call=rng.integers(-1, 2, n).astype(np.int32), calls=CALLS, **more)
    for row in range(n):
        passes, dwell = full.rule[row] == Rule.PASS, full.kind[row] == MotionKind.DWELL
        assert full.cutting[row] == (not passes and not dwell and full.kind[row] != MotionKind.RAPID)
        assert full.call_of(row) is (None if full.call[row] < 0 else CALLS[full.call[row]])
        assert short.call_of(row) is None
        assert full.about_fixed_point[row] == (full.arc_absolute[row] or more["fixed_centre"][row])
        assert short.about_fixed_point[row] == short.arc_absolute[row]
        own = not np.isnan(length[row])
        assert full.length_under_tcp[row] == (7.0 if own else full.tool_length[row])
        assert full.beside_tip[row] == (full.tcp[row] and own)
        goes_home = passes and not dwell and not full.programmed[row].any()
        for axis in range(4):
            assert full.increments[row, axis] == (counted[row, axis] and not passes)
            assert short.increments[row, axis] == (short.incremental[row] and not passes)
            silent = not (placed[row, axis] or full.programmed[row, axis])
            assert full.wordless[row, axis] == (silent or resting[row, axis])
            goes = full.programmed[row, axis] or full.end[row, axis] != full.start[row, axis]
            assert full.moved[row, axis] == (goes or goes_home)
    assert not short.wordless.any()
    assert not short.beside_tip.any()
    assert (short.length_under_tcp == short.tool_length).all()


def test_what_may_pass() -> None:
    """No rule passes a hole, none but that of machine coordinates an arc, and a feed that may cut is said to."""
    feeds = {rule for rule, each in PASS_RULES.items() if MotionKind.FEED in each.kinds}
    assert feeds == {Pass.MACHINE_COORDINATES, Pass.PROBING, Pass.ROTARY_ALONE, Pass.DEPARTURE}
    assert {rule for rule, each in PASS_RULES.items() if each.cuts} == feeds - {Pass.PROBING}
    assert [rule for rule, each in PASS_RULES.items() if MotionKind.ARC in each.kinds] == [Pass.MACHINE_COORDINATES]
    assert not any(MotionKind.CYCLE in each.kinds for each in PASS_RULES.values())
    assert {rule for rule, each in PASS_RULES.items() if each.kinds == {MotionKind.DWELL}} == {Pass.DWELL}
    assert all(each.kinds >= RAPIDS for rule, each in PASS_RULES.items() if rule not in (Pass.DWELL, Pass.DEPARTURE))
    assert set(PASS_RULES) == set(Pass) - {Pass.NONE}


def test_a_length_shifts_commands_while_tool_centre_point_control_is_on() -> None:
    assert [TcpState(on, 80.0).shift for on in (True, False)] == [80.0, 0.0]
