"""`python -m tests.stories`: run the stories and write what their commands print into their READMEs."""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from .story import written_anew

STORIES = Path(__file__).resolve().parents[2] / "examples" / "stories"


def main(names: list[str]) -> None:
    """All stories, or these."""
    for folder in sorted(path.parent for path in STORIES.glob("*/README.md")):
        if names and folder.name not in names:
            continue
        with tempfile.TemporaryDirectory(prefix="story-") as place:
            copy = Path(place) / folder.name
            shutil.copytree(folder, copy)
            text = written_anew((folder / "README.md").read_text(), copy)
        (folder / "README.md").write_text(text)


if __name__ == "__main__":
    main(sys.argv[1:])
