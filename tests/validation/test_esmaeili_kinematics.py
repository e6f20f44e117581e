"""The Jacobian that S. Esmaeili Marzdashti prints for the wCAYFXZt machine "Kolibri" (thesis 2021, Eq. 42).

There every body moves in the positive sense when its axis grows, also on the workpiece side, and errors are expressed
in the tool frame. Z includes the tool length: it is the height of the tip above the crossing of A and C.
"""

from __future__ import annotations

import numpy as np

from ncfix.machine import Axis, Effect, Machine, State

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
KOLIBRI = Machine(
    "Kolibri",
    "w C A Y F X Z t",
    (
        Axis("C", True, True, Z),
        Axis("A", True, True, X),
        Axis("Y", False, True, Y),
        Axis("X", False, False, X),
        Axis("Z", False, False, Z),
    ),
)
LENGTH = 74.0


def in_tool_frame(pose: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Displacements and turns (6, k) in workpiece axes -> tool axes."""
    turning = pose[:3, :3].T
    return np.vstack([turning @ columns[:3], turning @ columns[3:]])


def test_the_printed_jacobian() -> None:
    rng = np.random.default_rng(0)
    for x, y, z, a, c in rng.uniform([-130, -210, 60, -1, -3], [130, 210, 300, 1, 3], (20, 5)):
        q = np.array([c, a, y, x, z])
        height = z - LENGTH
        s, k = np.sin(a), np.cos(a)
        printed = [
            [1, 0, 0, 0, s * height - k * y],
            [0, -1, 0, height, -k * x],
            [0, 0, 1, y, -s * x],
            [0, 0, 0, -1, 0],
            [0, 0, 0, 0, s],
            [0, 0, 0, 0, -k],
        ]
        jacobian = KOLIBRI.axis_jacobian(q, LENGTH)[:, [3, 2, 4, 1, 0]]
        mine = in_tool_frame(KOLIBRI.nominal(q, LENGTH), jacobian)
        np.testing.assert_allclose(mine, printed, atol=1e-9)


def test_workpiece_side_gains_enter_with_a_minus_sign() -> None:
    """Eq. 57: EYY of the table moves the tool by -e in y, EXX of the slide by +e in x."""
    for name, row, sign in (("EXX", 0, 1), ("EYY", 1, -1), ("EZZ", 2, 1)):
        error = KOLIBRI.replace(effects=(Effect(name, (0.01,)),)).error(np.zeros(5), State(LENGTH))
        np.testing.assert_allclose(error, sign * 0.01 * np.eye(6)[row], atol=1e-12)
