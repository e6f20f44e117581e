"""Where what can be made again is kept between runs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path


def folders(source: str) -> Iterator[Path]:
    """Beside what Python keeps of a module, by its file; then the user's own cache, if there is a home for it.

    They need not be there, nor be such that they can be written to.
    """
    yield Path(source).parent / "__pycache__"
    with suppress(RuntimeError):  # no HOME, and a user whom the system does not know
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ncfix"
