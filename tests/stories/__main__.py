"""`python -m tests.stories [NAME...]`: run stories and pages of the guide; what their commands print goes into them."""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from .story import GUIDE, written_anew

ROOT = Path(__file__).resolve().parents[2]


def main(names: list[str]) -> None:
    """All stories and pages, or these: a story by its folder, a page of the guide by its name without `.md`."""
    stories = {path.parent.name: (path, path.parent) for path in (ROOT / "examples" / "stories").glob("*/README.md")}
    pages = {path.stem: (path, ROOT / GUIDE) for path in (ROOT / "docs" / "guide").glob("[a-z]*.md")}
    for name, (page, folder) in sorted({**stories, **pages}.items()):
        if names and name not in names:
            continue
        with tempfile.TemporaryDirectory(prefix="story-") as place:
            copy = Path(place) / folder.name
            shutil.copytree(folder, copy)
            text = written_anew(page.read_text(), copy)
        page.write_text(text)


if __name__ == "__main__":
    main(sys.argv[1:])
