"""What a basis is: known functions of one signal, whose weighted sum is an error. The kinds that there are.

A basis sees u = (x - center) / scale, x in the unit of the machine file (mm, degree, or the unit of a state input).
Its own parameters are the fields of a frozen dataclass, declared with `key`; the machine file is read and written by
these declarations, so a plugin's basis needs no code for that. Register one with the hook `register_bases`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import field
from functools import lru_cache
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
REQUIRED = object()


def key(kind: str, meaning: str, default: Any = REQUIRED) -> Any:
    """Declare a parameter of a basis and its key in the machine file.

    kind: "number", "numbers", "integer", "integers" or "text".
    """
    metadata = {"kind": kind, "meaning": meaning, "required": default is REQUIRED}
    return field(metadata=metadata) if default is REQUIRED else field(default=default, metadata=metadata)


class Basis(ABC):
    """Functions f_1 ... f_k of u (and of the direction of motion); an error is sum c_i f_i."""

    __slots__ = ()

    name: ClassVar[str]
    title: ClassVar[str]
    needs_signal: ClassVar[bool] = True
    rotary_only: ClassVar[bool] = False

    @property
    @abstractmethod
    def labels(self) -> tuple[str, ...]:
        """One short name per coefficient, in their order."""

    @abstractmethod
    def rows(self, u: Array, direction: Array) -> Array:
        """The functions at u, shape (...) -> (k, ...); `direction` is -1, 0 (unknown) or 1, same shape as u."""

    @abstractmethod
    def slopes(self, u: Array, direction: Array) -> Array:
        """Their derivatives by u, shape (...) -> (k, ...); at a kink the value of the upper side."""

    @abstractmethod
    def feature(self, span: float) -> float:
        """The smallest distance of u over which the sum may bend, if u has the range `span`; inf if it never does."""

    @property
    def needs_direction(self) -> bool:
        """Whether the direction of motion matters."""
        return False

    @property
    def size(self) -> int:
        """How many coefficients."""
        return len(self.labels)

    @property
    def domain(self) -> tuple[float, float]:
        """The u between which the functions are given; outside, the end values hold."""
        return -np.inf, np.inf

    @property
    def kinks(self) -> tuple[float, ...]:
        """The u at which the sum has a jump or a kink."""
        return ()

    @property
    def family(self) -> tuple[object, ...]:
        """Bases of equal family can be merged into one."""
        return self.name, self

    def merged(self, other: Self) -> Self:
        """A basis of the same family with the functions of both."""
        return self

    def bounds(self, coefficients: tuple[float, ...], low: float, high: float) -> tuple[float, float, float] | None:
        """What the sum with these coefficients, its slope and its curvature do not exceed for u from low to high.

        Kinks and jumps aside. None if that is not known, or not bounded.
        """
        return None

    def complaints(self) -> list[tuple[str, str]]:
        """What is wrong with the parameters: (key, text)."""
        return []

    def design(self, u: Array, direction: Array | float = 0.0) -> Array:
        """The functions at u as the row of a design matrix, shape (...) -> (..., k)."""
        u = np.asarray(u, dtype=np.float64)
        return np.moveaxis(self.rows(u, np.broadcast_to(direction, u.shape)), 0, -1)

    def derivative(self, u: Array, direction: Array | float = 0.0) -> Array:
        """Their derivatives by u, shape (...) -> (..., k)."""
        u = np.asarray(u, dtype=np.float64)
        return np.moveaxis(self.slopes(u, np.broadcast_to(direction, u.shape)), 0, -1)

    def combine(self, gains: Array, u: Array, direction: Array) -> Array:
        """Several sums at once, gains (m, k) and u (n,) -> (m, n)."""
        result: Array = gains @ self.rows(u, direction)
        return result


def check_shapes(basis: Basis) -> None:
    """Raise ValueError for a basis whose functions do not come as one row for each coefficient."""
    u = np.array([-0.5, 0.0, 0.5])
    for name, function in (("rows", basis.rows), ("slopes", basis.slopes)):
        shape = np.shape(function(u, np.zeros(3)))
        if shape != (basis.size, 3):
            raise ValueError(f"{name} gives shape {shape} for three places and {basis.size} coefficients")


@lru_cache(maxsize=1)
def kinds() -> dict[str, type[Basis]]:
    """Every basis by its name: the built-in ones and those of plugins."""
    from ncfix.machine import piecewise, smooth, truncated
    from ncfix.plugins import registry

    builtin = (*smooth.BASES, *piecewise.BASES, *truncated.BASES)
    return registry("bases", {basis.name: basis for basis in builtin})
