"""The site of the documents: it is built without a warning, and all in it that is linked is there."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from html import unescape
from pathlib import Path
from urllib.parse import unquote

import pytest

from conftest import require_module
from ncfix.cli.listings import all_codes


@pytest.fixture(scope="module")
def site(root: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    for name in ("mkdocs", "mkdocstrings"):
        require_module(name)
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "-q", "-d", str(folder)]
    done = subprocess.run(
        command, cwd=root, capture_output=True, text=True, check=False, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


def test_what_pages_link_to_is_there(site: Path) -> None:
    pages = {path: path.read_text() for path in site.rglob("*.html") if path.name != "404.html"}
    anchors = {path: set(re.findall(r'\bid="([^"]+)"', text)) for path, text in pages.items()}
    lost = []
    for path, text in pages.items():
        for link in re.findall(r'\b(?:href|src)="([^"]*)"', text):
            target, _, anchor = unquote(unescape(link)).partition("#")
            if "://" in target or target.startswith(("data:", "mailto:")):
                continue
            found = (path.parent / target).resolve() if target else path
            if not found.exists() or (anchor and found in anchors and anchor not in anchors[found]):
                lost.append((path.name, link))
    assert len(pages) > 30
    assert not lost


def test_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    for path in site.rglob("*.html"):
        assert not re.findall(r'<(?:script|img|iframe)[^>]*\ssrc="(?:https?:)?//', path.read_text()), path
        assert not re.findall(r'<link[^>]*rel="stylesheet"[^>]*href="(?:https?:)?//', path.read_text()), path


def test_the_reference_is_made_of_docstrings_and_codes(site: Path) -> None:
    functions = (site / "reference/functions.html").read_text()
    assert 'id="ncfix.api.programs.fix"' in functions
    assert "<code>tolerance_um</code>: largest deviation of the tool tip from the intended path" in functions
    messages = (site / "reference/messages.html").read_text()
    assert all(f'id="{code.lower()}"' in messages for code in all_codes())
