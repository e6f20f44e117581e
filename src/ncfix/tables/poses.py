"""Where tables are filled and judged: the working space of a machine, and poses at random in it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ncfix.diagnostics import UsageError
from ncfix.machine import Machine
from ncfix.tables.grid import Array

Ranges = Mapping[str, tuple[float, float]]
"""Axis -> lowest and highest position, mm or rad."""


def ranges_of(machine: Machine, given: Ranges | None = None) -> Array:
    """The space that the tables cover, (n_axes, 2) mm and rad: that given, else the travel; one turn where endless.

    Raises `UsageError` NCF483 for an axis that the machine does not have, a range that is empty or beyond the travel,
    or a linear axis whose range is nowhere given.
    """
    space = np.array(machine.ranges)
    endless = machine.rotary & ~np.isfinite(space).all(axis=1)
    space[endless] = (-np.pi, np.pi)
    for name, limits in (given or {}).items():
        if name not in machine.axis_names:
            raise wrong_range(f"the machine has no axis {name!r}", f"one of {', '.join(machine.axis_names)}")
        index = machine.axis_names.index(name)
        low, high = machine.ranges[index]
        if not limits[0] < limits[1]:
            raise wrong_range(f"the range of {name} is empty", "LOW,HIGH, the lower first")
        if limits[0] < low - 1e-9 or limits[1] > high + 1e-9:
            raise wrong_range(f"the range of {name} goes beyond its travel", "the machine file has the travel")
        space[index] = limits
    for name, limits in zip(machine.axis_names, space, strict=True):
        if not np.isfinite(limits).all():
            raise wrong_range(f"the machine file gives no range of {name}", f"--range {name}=LOW,HIGH")
    return space


def wrong_range(text: str, hint: str) -> UsageError:
    """The error NCF483."""
    return UsageError.of("NCF483", text, hint=hint)


def random_poses(space: Array, count: int, seed: int = 0) -> Array:
    """Poses spread evenly over the space, (count, n_axes); the same for the same seed."""
    return np.random.default_rng(seed).uniform(space[:, 0], space[:, 1], size=(count, len(space)))


def random_ways(n_axes: int, count: int, seed: int = 1) -> Array:
    """Directions of motion at random, (count, n_axes), -1 or 1."""
    return np.random.default_rng(seed).choice([-1.0, 1.0], size=(count, n_axes))


def even_poses(space: Array, count: int) -> Array:
    """Poses that fill the space more evenly than those at random, (count, n_axes): a lattice of irrational steps."""
    dimensions = len(space)
    ratio = 2.0
    for _ in range(40):
        ratio = (1 + ratio) ** (1 / (dimensions + 1))
    steps = ratio ** -np.arange(1.0, dimensions + 1)
    share = np.mod(0.5 + np.arange(1, count + 1)[:, None] * steps, 1.0)
    poses: Array = space[:, 0] + share * (space[:, 1] - space[:, 0])
    return poses


def corners(space: Array) -> Array:
    """The corners of the space, (2 ** n_axes, n_axes)."""
    return np.stack(np.meshgrid(*space, indexing="ij"), axis=-1).reshape(-1, len(space))
