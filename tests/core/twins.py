"""Both forms of the core side by side: what is done to the compiled one is done to the interpreted one, and compared.

While `both_forms` lasts, functions and classes of the compiled modules are replaced by twins. Arrays are copied for the
interpreted form; after each call all arrays and results of both must have the same bits.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

import numpy as np
import pytest

from ncfix import core


class DifferentFormsError(AssertionError):
    """The compiled and the interpreted form did not do the same."""


class Pair:
    """An object of a class of the core in both forms; `arrays` are those that it was made of, in both."""

    def __init__(self, name: str, compiled: Any, interpreted: Any, arrays: list[tuple[np.ndarray, np.ndarray]]) -> None:
        self._name, self._compiled, self._interpreted, self._arrays = name, compiled, interpreted, arrays

    def __getattr__(self, name: str) -> Any:
        own, other = getattr(self._compiled, name), getattr(self._interpreted, name)
        if callable(own):
            return lambda *given: called(f"{self._name}.{name}", own, other, given, self._arrays)
        assert_same(f"{self._name}.{name}", own, other)
        return own


def copied(value: Any, arrays: list[tuple[np.ndarray, np.ndarray]]) -> tuple[Any, Any]:
    """An argument for the compiled form, and one for the interpreted form; arrays are noted."""
    if isinstance(value, Pair):
        arrays += value._arrays
        return value._compiled, value._interpreted
    if isinstance(value, np.ndarray):
        arrays.append((value, value.copy()))
        return value, memoryview(arrays[-1][1])
    if isinstance(value, np.generic):
        return value, value.item()
    return value, value


def called(
    name: str, own: Callable[..., Any], other: Callable[..., Any], given: tuple[Any, ...],
    known: list[tuple[np.ndarray, np.ndarray]],
) -> Any:  # fmt: skip
    """What the compiled form returns, if the other one does the same."""
    CALLS[name] += 1
    arrays: list[tuple[np.ndarray, np.ndarray]] = []
    pairs = [copied(value, arrays) for value in given]
    result, twin = own(*(pair[0] for pair in pairs)), other(*(pair[1] for pair in pairs))
    for one, two in [*known, *arrays]:
        if one.tobytes() != two.tobytes():
            raise DifferentFormsError(f"{name}: {one!r} and, interpreted, {two!r}")
    assert_same(name, result, twin)
    return result


def assert_same(name: str, one: Any, two: Any) -> None:
    """Raises DifferentFormsError for other results than the same numbers."""
    if np.asarray(one).astype(float).tobytes() != np.asarray(two).astype(float).tobytes():
        raise DifferentFormsError(f"{name}: {one!r} and, interpreted, {two!r}")


CALLS: Counter[str] = Counter()
"""How often each function was compared."""


def twin_of(name: str, own: Any, other: Any) -> Callable[..., Any]:
    """A function of the core in both forms, or what makes a `Pair`."""
    if not isinstance(own, type):
        return lambda *given: called(name, own, other, given, [])

    def made(*given: Any) -> Pair:
        arrays: list[tuple[np.ndarray, np.ndarray]] = []
        pairs = [copied(value, arrays) for value in given]
        return Pair(name, own(*(pair[0] for pair in pairs)), other(*(pair[1] for pair in pairs)), arrays)

    return made


@contextmanager
def both_forms() -> Iterator[Counter[str]]:
    """Do all that the compiled core does in both forms; gives how often each function is called."""
    core.use("compiled")
    CALLS.clear()
    with pytest.MonkeyPatch.context() as patch:
        modules = {name: import_module(f"ncfix.core.{name}") for name in core.names()}  # they take types of one another
        for module, compiled in modules.items():
            interpreted = core.interpreted(module)
            for name, own in vars(compiled).items():
                other = getattr(interpreted, name, None)
                if callable(other) and getattr(own, "__module__", None) == compiled.__name__:
                    patch.setattr(compiled, name, twin_of(f"{module}.{name}", own, other))
        yield CALLS
