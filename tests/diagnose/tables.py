"""Tables that a study writes into a page, between two marks."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def put(page: str, name: str, lines: Sequence[str]) -> None:
    """Replace what stands between the marks of this name."""
    begin, end = f"<!-- {name}: begin -->", f"<!-- {name}: end -->"
    text = Path(page).read_text(encoding="utf-8")
    before, after = text.index(begin) + len(begin), text.index(end)
    Path(page).write_text("\n".join([text[:before], *lines, text[after:]]), encoding="utf-8")
