"""The one module that plugins import: its names are there, typed, and light ones stay light."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from ncfix import plugin


def test_what_types_see_is_what_is_there(root: Path) -> None:
    tree = ast.parse((root / "src/ncfix/plugin.py").read_text())
    typed = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {alias.name: node.module for node in typed.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert seen == plugin.MODULES
    for name in dir(plugin):
        assert getattr(plugin, name) is not None


def test_a_name_that_is_not_there() -> None:
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        plugin.nothing  # noqa: B018
    with pytest.raises(LookupError, match="did you mean fanuc"):
        plugin.family("fanuk")


def test_dialects_cost_no_numpy() -> None:
    code = "import sys, ncfix.plugin as p; p.family('haas'); print('numpy' in sys.modules, 'lark' in sys.modules)"
    made = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert made.stdout.split() == ["False", "False"]


def test_small_plugins_import_the_face_and_what_it_lacks(root: Path) -> None:
    """Their first modules nothing else of ncfix; third parties' no module but the face."""
    folders = [root / "plugins", root / "examples"]
    firsts = [path for folder in folders for path in [*folder.glob("*/__init__.py"), *folder.glob("third*/**/*.py")]]
    assert len(firsts) >= 9
    for path in firsts:
        modules = {
            node.module or "" for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom)
        }
        own = {name for name in modules if name.split(".")[0] == "ncfix"}
        assert own == {"ncfix.testing" if path.name.startswith("test_") else "ncfix.plugin"}, path
