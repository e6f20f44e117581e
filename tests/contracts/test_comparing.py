"""Values that hold arrays are not compared field by field: `==` on arrays says no yes or no, and they have no hash."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from dataclasses import fields, is_dataclass

import ncfix
from ncfix.values import ARRAYS


def classes() -> Iterator[type]:
    """The dataclasses of ncfix and of the plugins that come with it."""
    plugins = [found.name for found in pkgutil.iter_modules() if found.name.startswith("ncfix_")]
    for package in (ncfix, *map(importlib.import_module, plugins)):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if found.name.endswith("__main__"):
                continue
            try:
                module = importlib.import_module(found.name)
            except ImportError:  # an extra that is not installed
                continue
            for _, each in inspect.getmembers(module, inspect.isclass):
                if each.__module__ == found.name and is_dataclass(each):
                    yield each


def compares_arrays(known: type) -> bool:
    """Whether a class compares its fields, of which one is an array, and does not say itself how."""
    made = getattr(known.__eq__, "__module__", "") == "ncfix.values"
    return made and any(each.compare and ARRAYS.search(str(each.type)) for each in fields(known))


def test_no_value_compares_arrays() -> None:
    found = [f"{each.__module__}.{each.__qualname__}" for each in classes()]
    assert len(found) > 200
    wrong = sorted(f"{each.__module__}.{each.__qualname__}" for each in classes() if compares_arrays(each))
    assert wrong == []
