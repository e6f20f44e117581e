"""The strategy `full`: tool tip and tool direction, with the rotary axes held back where they would have to run away.

Near a pose in which a rotary axis turns the tool about itself, a small tilt needs a large turn of that axis. The
correction of that axis is damped there (Nakamura and Hanafusa 1986: the damping grows as the smallest singular value
falls below a bound), so that it fades to nothing in the pole and never exceeds the limit; the tip is held exactly all
the same.
"""

from __future__ import annotations

import numpy as np

from ncfix.compensate.findings import Array, Mask
from ncfix.compensate.kinematics import linear_columns, regular, solve
from ncfix.compensate.rates import Path, limited
from ncfix.compensate.steer import Correction, rows_of, steer
from ncfix.compensate.strategies import Strategy, untouched
from ncfix.machine import Machine, State

SETTLED = 1e-9
"""rad; rotary corrections that change less from pass to pass are settled. 1e-9 rad is 1 nm at 1 m."""
PASSES = 12
CONE = 0.02
"""Smallest singular value (rad of tilt per rad of rotary axis) below which it is always damped: about 1 degree."""
GAIN = 1.2
"""Just above 2 / sqrt(3), the largest correction per error times the bound (at a singular value of bound / sqrt(3))."""


class Full(Strategy):
    """Position exactly, tool direction by least squares, damped near singular poses, limited in size and in rate.

    most      largest correction of a rotary axis, rad; None: the machine's `max_correction`
    per_mm    how much a rotary correction may change per mm of the tip's way, rad/mm
    per_rad   and per rad of the rotary axes' way

    A correction never takes a rotary axis out of the travel that the program keeps to; the tip is held all the same.
    """

    name = "full"
    leaves = (
        "The turn of the tool about its own axis is not corrected. Near poses in which a rotary axis turns the tool "
        "about itself, and where corrections would be too large or too fast, its direction is not, or only partly."
    )
    corrects_orientation = True

    def __init__(self, most: float | None = None, per_mm: float = 5e-5, per_rad: float = 0.02) -> None:
        self.most = most
        self.per_mm = per_mm
        self.per_rad = per_rad

    def solve(self, machine: Machine, q: Array, state: State, path: Path | None = None) -> Correction:
        """See `Strategy.solve`. Rates are limited only if `path` is given."""
        if machine.is_perfect:
            return untouched(q)
        known = np.isfinite(q.sum(axis=1)) & np.isfinite(machine.tip(q, state.tool_length).sum(axis=1))
        if not known.all():
            return self._known_only(machine, q, state, path, known)
        most = machine.max_correction[1] if self.most is None else self.most
        corrected, free = self._tilted(machine, q, state, most)
        rotary = machine.rotary
        wanted = corrected[:, rotary] - q[:, rotary]
        held = wanted if path is None or not rotary.any() else limited(wanted, path, self.per_mm, self.per_rad)
        corrected[:, rotary] = _within_travel(machine, q[:, rotary], held)
        free &= (np.abs(corrected[:, rotary] - q[:, rotary] - wanted) < SETTLED).all(axis=1)
        target = machine.tip(q, state.tool_length)
        corrected, arrived = steer(machine, corrected, target, state)
        return Correction(corrected, arrived, free)

    def _known_only(self, machine: Machine, q: Array, state: State, path: Path | None, known: Mask) -> Correction:
        """Poses with numbers missing are left alone; they end a stretch of the path."""
        rows = np.flatnonzero(known)
        rest = None if path is None else path.rows(rows)
        result = self.solve(machine, q[rows], rows_of(state, rows), rest)
        corrected, converged, oriented = q.copy(), known.copy(), known.copy()
        corrected[rows], converged[rows], oriented[rows] = result.q, result.converged, result.oriented
        return Correction(corrected, converged, oriented)

    def _tilted(self, machine: Machine, q: Array, state: State, most: float) -> tuple[Array, Mask]:
        """Positions with the rotary axes corrected and X Y Z nearly so, and which poses are free of damping.

        The damped step is taken from the error that would be there without it: repeated damped steps would add up to
        an undamped one.
        """
        rotary, columns = machine.rotary, linear_columns(machine)
        corrected, free = q.copy(), np.zeros(len(q), dtype=bool)
        if not rotary.any():
            return corrected, free
        pose = machine.nominal(q, state.tool_length)
        jacobian = machine.jacobians(q, state.tool_length).axes
        across = _across(pose, machine)
        tilts, swings = across @ jacobian[:, 3:, rotary], jacobian[:, :3, rotary]
        maps = regular(jacobian[:, :3, columns])[0]
        turn = np.zeros((len(q), int(rotary.sum())))
        for _ in range(PASSES):
            actual = machine.actual(corrected, state)
            error = apply(across, small_turn(actual, pose)) - apply(tilts, turn)
            before, (turn, free) = turn, damped(tilts, error, most)
            corrected[:, rotary] = q[:, rotary] + turn
            gap = actual[:, :3, 3] - pose[:, :3, 3] + apply(swings, turn - before)
            corrected[:, columns] -= solve(maps, gap)
            if np.max(np.abs(turn - before), initial=0.0) < SETTLED:
                break
        return corrected, free


def _within_travel(machine: Machine, q: Array, turn: Array) -> Array:
    """Corrected rotary positions (n, n_rotary), held at the end of the travel that the program keeps to, rad."""
    low, high = machine.ranges[machine.rotary].T
    return np.clip(q + turn, np.minimum(low, q), np.maximum(high, q))


def apply(matrices: Array, vectors: Array) -> Array:
    """Matrices (n, i, j) times vectors (n, j)."""
    result: Array = (matrices @ vectors[..., None])[..., 0]
    return result


def damped(tilts: Array, error: Array, most: float) -> tuple[Array, Mask]:
    """Rotary corrections that take off a tilt, by least squares with damping.

    tilts  (n, 2, k) tilt of the tool per rad of each rotary axis
    error  (n, 2) tilt to take off, rad
    most   no rotary axis is corrected by more, rad

    Returns (n, k) rad, and where nothing was damped (n,).
    """
    squares, ways = np.linalg.eigh(np.swapaxes(tilts, 1, 2) @ tilts)
    size = np.sqrt(np.einsum("ij,ij->i", error, error))
    bound = np.maximum(CONE, GAIN * size / most)[:, None]
    values = np.sqrt(np.maximum(squares, 0.0))
    damping = np.where(values < bound, (bound**2 - values**2) / 4, 0.0)
    possible = np.arange(values.shape[1]) >= values.shape[1] - tilts.shape[1]
    weight = np.where(possible, 1.0, 0.0) / np.maximum(squares + damping, 1e-300)
    along = np.einsum("nji,nj->ni", ways, np.einsum("nij,ni->nj", tilts, error))
    turn = -np.einsum("nij,nj->ni", ways, weight * along)
    return turn, ((damping == 0) | ~possible).all(axis=1)


def _across(nominal: Array, machine: Machine) -> Array:
    """Two directions across the tool in the workpiece frame, as rows, (n, 2, 3)."""
    tool = np.asarray(machine.tool.direction)
    first = np.cross(tool, np.eye(3)[np.argmin(np.abs(tool))])
    first /= np.linalg.norm(first)
    pair = np.stack([first, np.cross(tool, first)])
    result: Array = pair @ np.swapaxes(nominal[:, :3, :3], 1, 2)
    return result


def small_turn(actual: Array, nominal: Array) -> Array:
    """The small rotation from nominal to actual in the workpiece frame, (n, 3) rad, to third order."""
    relative = actual[:, :3, :3] @ np.swapaxes(nominal[:, :3, :3], 1, 2)
    return 0.5 * np.stack(
        [
            relative[:, 2, 1] - relative[:, 1, 2],
            relative[:, 0, 2] - relative[:, 2, 0],
            relative[:, 1, 0] - relative[:, 0, 1],
        ],
        axis=1,
    )
