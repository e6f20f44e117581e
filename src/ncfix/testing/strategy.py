"""The contract for strategies: `check_strategy(strategy)`."""

from __future__ import annotations

import numpy as np

from ncfix.compensate.plan.strategies import Strategy, get_strategy
from ncfix.machine import Machine, State, loads
from ncfix.tables.correction import random_poses, ranges_of

FIVE_AXES = """
name = "crossed tables"
topology = "w C B F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-200, 200] }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-200, 200] }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-100, 200] }
axis.B = { type = "rotary", direction = [0, 1, 0], point = [0, 0, 0], range = [-90, 90] }
axis.C = { type = "rotary", direction = [0, 0, 1], point = [0, 0, 0], range = [-180, 180] }
"""
EFFECTS = (
    ("EXX", 0.02),
    ("EYX", -0.015),
    ("EZY", 0.01),
    ("EBZ", 40e-6),
    ("EXB", 0.012),
    ("EAC", 50e-6),
    ("EYC", -0.01),
)
POSES = 40
NEAR_UM = 0.01


def five_axes(scale: float = 1.0) -> Machine:
    """A five-axis machine with some errors of linear and rotary axes, scaled by `scale`."""
    text = FIVE_AXES
    for name, size in EFFECTS:
        text += f'\n[[effect]]\nname = "{name}"\nbasis = "polynomial"\ndegree = [1, 2]\nscale = 200\n'
        text += f"coefficients = [{size * scale}, {size * scale / 2}]\n"
    return loads(text)


def check_strategy(strategy: Strategy | str, approximate: bool = False) -> None:
    """Raise AssertionError if a strategy violates the contract.

    Checks: A perfect machine is not corrected. The same poses give the same commands, and each pose the same alone and
    among others. Arguments are not changed. Rotary axes keep their values unless the strategy corrects orientations.
    Half the errors give about half the correction. The corrected command moves the tip to where a perfect machine moves
    it.

    approximate  the strategy may leave more than 0.01 um, but not more than a fifth of the error, and its correction of
                 a pose may depend on the poses before it
    """
    strategy = get_strategy(strategy) if isinstance(strategy, str) else strategy
    machine, name = five_axes(), strategy.name
    q = random_poses(ranges_of(machine), POSES, seed=3)
    state = State(120.0)
    perfect = strategy.correct(machine.replace(effects=()), q, state)
    assert np.array_equal(perfect, q), f"{name}: corrects a perfect machine"
    given = q.copy()
    corrected = strategy.correct(machine, q, state)
    assert np.array_equal(q, given), f"{name}: changes the poses that it is given"
    assert np.array_equal(corrected, strategy.correct(machine, q, state)), f"{name}: is not the same twice"
    alone = np.concatenate([strategy.correct(machine, pose[None], state) for pose in q[:5]])
    assert approximate or np.allclose(alone, corrected[:5], atol=1e-7), f"{name}: a pose alone is corrected otherwise"
    turning = np.array([axis.rotary for axis in machine.axes])
    if not strategy.corrects_orientation:
        assert np.array_equal(corrected[:, turning], q[:, turning]), (
            f"{name}: turns rotary axes, which it says it leaves"
        )
    half = strategy.correct(five_axes(0.5), q, state) - q
    whole = corrected - q
    assert np.abs(half - whole / 2).max() < 0.05 * np.abs(whole).max(), f"{name}: half the error is not half corrected"
    meant = machine.tip(q, state.tool_length)
    before = np.linalg.norm(machine.actual_tip(q, state) - meant, axis=-1)
    left = np.linalg.norm(machine.actual_tip(corrected, state) - meant, axis=-1)
    allowed = float(before.max()) / 5 if approximate else NEAR_UM * 1e-3
    worst = int(np.argmax(left))
    assert left[worst] < allowed, f"{name}: {left[worst] * 1e3:.3f} um are left at {q[worst].tolist()}"
