"""Of which sources the compiled core is: an old binary must not be taken for what an edited source says."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path


def digest(folder: Path) -> str:
    """A digest of all sources in a folder that are compiled: modules that have declarations (`.pxd`)."""
    found = sha256()
    for declarations in sorted(folder.glob("*.pxd")):
        for path in (declarations, declarations.with_suffix(".py")):
            found.update(path.name.encode() + b"\0" + path.read_bytes().replace(b"\r\n", b"\n") + b"\0")
    return found.hexdigest()
