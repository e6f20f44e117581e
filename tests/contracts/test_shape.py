"""The shape of the code: names that are used once, deep modules, folders that can be looked through."""

from __future__ import annotations

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path

ROOTS = ("src", "plugins")
FACES = frozenset({"__init__.py", "__main__.py", "codes.py", "language.py", "version.py"})
"""Modules that may be short: faces of packages, and what entry points and hooks name."""
LEAST = 60
LARGEST = 20


@cache
def modules(root: Path) -> dict[str, str]:
    """Path -> text of every module."""
    found = (path for folder in ROOTS for path in sorted((root / folder).rglob("*.py")))
    return {str(path.relative_to(root)): path.read_text() for path in found}


def test_class_names_are_unique(root: Path) -> None:
    where = defaultdict(list)
    for path, text in modules(root).items():
        for node in ast.parse(text).body:
            if isinstance(node, ast.ClassDef):
                where[node.name].append(path)
    assert {name: paths for name, paths in where.items() if len(paths) > 1} == {}


def test_modules_are_deep(root: Path) -> None:
    short = {
        path for path, text in modules(root).items() if len(text.splitlines()) < LEAST and Path(path).name not in FACES
    }
    assert short == set()


def test_folders_can_be_looked_through(root: Path) -> None:
    count: dict[str, int] = defaultdict(int)
    for path in modules(root):
        count[str(Path(path).parent)] += Path(path).name != "__init__.py"
    assert {folder: n for folder, n in count.items() if n > LARGEST} == {}
