"""A browser for pages: Chromium without a window, driven by its own protocol."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Any

import pytest

from conftest import missing, require_module

NAMES = ("chromium", "chromium-browser", "google-chrome")
SOFTWARE = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
SOFTWARE += ("--disable-gpu-rasterization", "--disable-gpu-compositing")
"""No graphics card is needed, and root may run it; only WebGL is drawn by a card in software, which takes longer."""


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """The browser; skips without it, fails without it if `NCFIX_REQUIRE_TOOLS=1`."""
    require_module("playwright")
    require_module("plotly")
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        missing("chromium is not installed", "NCFIX_REQUIRE_TOOLS")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=found, args=list(SOFTWARE))
        yield browser
        browser.close()
