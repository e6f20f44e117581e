"""Imports: every module can be the first one that is imported, and no module needs itself, not even for its types."""

from __future__ import annotations

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

ROOTS = ("src", "plugins")


@cache
def modules(root: Path) -> dict[str, Path]:
    """Name -> path of every module."""
    found = {}
    for folder in (root / each for each in ROOTS):
        for path in sorted(folder.rglob("*.py")):
            parts = path.relative_to(folder).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(name: str, known: dict[str, Path]) -> set[str]:
    """The modules that a module imports: at its top, in functions, and for its types."""
    found = set()
    for node in ast.walk(ast.parse(known[name].read_text())):
        if isinstance(node, ast.ImportFrom):
            below = (f"{node.module}.{each.name}" for each in node.names)
            found |= {each if each in known else str(node.module) for each in below}
        elif isinstance(node, ast.Import):
            found |= {each.name for each in node.names}
    found |= {package for each in found for package in packages(each)} - packages(name)
    return found & known.keys() - {name}


def packages(name: str) -> set[str]:
    """The packages around a module, which are imported before it."""
    parts = name.split(".")
    return {".".join(parts[:length]) for length in range(1, len(parts))}


def circles(graph: dict[str, set[str]]) -> list[set[str]]:
    """Groups of modules that all need each other."""
    left = dict(graph)
    while outer := {name for name in left if not left[name] & left.keys()}:
        left = {name: needs for name, needs in left.items() if name not in outer}
    reach = {name: {name} for name in left}
    for name, seen in reach.items():
        waiting = [name]
        while waiting:
            new = (left[waiting.pop()] & left.keys()) - seen
            seen |= new
            waiting += new
    groups = {frozenset(other for other in seen if name in reach[other]) for name, seen in reach.items()}
    return [set(group) for group in groups if len(group) > 1]


def test_no_module_needs_itself(root: Path) -> None:
    """So every module can be the first that is imported, too: what it needs never needs it."""
    known = modules(root)
    found = circles({name: imported(name, known) for name in known})
    assert sorted(map(sorted, found)) == []


def test_every_module_can_be_imported(root: Path) -> None:
    names = [name for name in modules(root) if not name.endswith("__main__")]
    importing = "import importlib, sys; [importlib.import_module(name) for name in reversed(sys.argv[1:])]"
    subprocess.run([sys.executable, "-c", importing, *names], check=True)
