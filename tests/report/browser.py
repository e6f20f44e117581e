"""A page in a browser, as tests see it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any


class Tab:
    """A page in the browser, and what it complained of or asked for."""

    def __init__(self, browser: Any, path: Path, width: int = 1400, dark: bool = False) -> None:
        scheme = "dark" if dark else "light"
        self.page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
        self.page.set_default_timeout(60_000)
        self.wrong: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda said: self.wrong.append(said.text) if said.type == "error" else None)
        self.page.on("pageerror", lambda error: self.wrong.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(path.as_uri())
        self.page.wait_for_selector("html[data-ready]", state="attached")
        assert self.do("document.documentElement.dataset.ready") == "yes", self.wrong

    def do(self, script: str) -> Any:
        """What a script gives."""
        return self.page.evaluate(script)

    def wide(self) -> int:
        """Pixels by which the page is wider than the window."""
        return int(self.do("document.documentElement.scrollWidth - innerWidth"))

    def shot(self, name: str) -> None:
        """Put a picture of the window where `NCFIX_SCREENSHOTS` says, for the documentation."""
        if folder := os.environ.get("NCFIX_SCREENSHOTS"):
            path = os.path.join(folder, name)
            self.page.screenshot(path=path)
            from PIL import Image

            Image.open(path).convert("RGB").quantize(160).save(path, optimize=True)

    def close(self) -> None:
        """Close it; it has complained of nothing, and asked for nothing from elsewhere."""
        self.page.close()
        assert self.wrong == []
        assert [url for url in self.asked if not url.startswith(("file:", "blob:", "data:"))] == []
