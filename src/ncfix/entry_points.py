"""Entry points of the installed distributions, read from the folders in which installers put them.

`importlib.metadata.entry_points` finds the same, but importing it takes as long as all else that `ncfix --help` does.
It is asked where a distribution may be elsewhere than in a folder: in a zip file, an egg, or with a finder of its own.
"""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterator
from functools import reduce
from importlib import import_module
from typing import Any, Protocol

from ncfix.values import frozen

INFO = (".dist-info", ".egg-info")
"""How the folder of a distribution ends."""
METADATA = ("METADATA", "PKG-INFO", "")
"""The files of such a folder that may say name and version; an egg-info may be that file itself."""
PATH_FINDER = "_frozen_importlib_external"
"""The module of Python's own finder, which looks into the folders of the path."""


class EntryPoint(Protocol):
    """An entry point: its name, `module:object`, the distribution that it is of, or None, and what it leads to."""

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def value(self) -> str: ...  # noqa: D102
    @property
    def module(self) -> str: ...  # noqa: D102
    @property
    def dist(self) -> Any: ...  # noqa: D102
    def load(self) -> Any: ...  # noqa: D102


@frozen
class InstalledDistribution:
    """A distribution, by its folder of metadata."""

    folder: str

    @property
    def metadata(self) -> dict[str, str | None]:
        """Name and version, None where nothing says them."""
        found: dict[str, str | None] = {"Name": None, "Version": None}
        text = next((text for name in METADATA if (text := _text(os.path.join(self.folder, name).rstrip(os.sep)))), "")
        for line in text.splitlines():
            if not line:
                break
            key, _, value = line.partition(":")
            if found.get(key.title(), "") is None:
                found[key.title()] = value.strip()
        return found


@frozen
class InstalledEntryPoint:
    """An entry point of an installed distribution."""

    name: str
    value: str
    dist: InstalledDistribution

    @property
    def module(self) -> str:
        """The module in which it is."""
        return re.split(r"[:\[]", self.value, maxsplit=1)[0].strip()

    def load(self) -> Any:
        """The module, or the object in it, that the value names; raises what importing it raises."""
        attributes = self.value.partition("[")[0].partition(":")[2].strip()
        return reduce(getattr, attributes.split(".") if attributes else (), import_module(self.module))


def entry_points(group: str) -> list[EntryPoint]:
    """The entry points of a group; of distributions of one name, the first one on the path counts."""
    others = (finder for finder in sys.meta_path if getattr(finder, "__module__", "") != PATH_FINDER)
    if any(hasattr(finder, "find_distributions") for finder in others) or any(
        os.path.isfile(folder) or folder.endswith(".egg") for folder in sys.path
    ):
        from importlib.metadata import entry_points as all_entry_points

        return list(all_entry_points(group=group))
    found: dict[str, list[EntryPoint]] = {}
    for folder in sys.path:
        for info in _distributions(folder):
            name = re.sub(r"[-_.]+", "_", info.rpartition(".")[0].partition("-")[0].lower())
            if name not in found:
                found[name] = list(_of_group(InstalledDistribution(os.path.join(folder, info)), group))
    return [point for points in found.values() for point in points]


def _distributions(folder: str) -> list[str]:
    """The names of all folders of metadata in a folder of the path."""
    try:
        return [name for name in os.listdir(folder or ".") if name.lower().endswith(INFO)]
    except OSError:
        return []


def _of_group(distribution: InstalledDistribution, group: str) -> Iterator[InstalledEntryPoint]:
    """The entry points of a group that a distribution has."""
    section = ""
    for raw in _text(os.path.join(distribution.folder, "entry_points.txt")).splitlines():
        line = raw.strip()
        if line.startswith("[") and line.endswith("]"):
            section = line[1:-1]
        elif section == group and line and not line.startswith("#"):
            name, _, value = line.partition("=")
            yield InstalledEntryPoint(name.strip(), value.strip(), distribution)


def _text(path: str) -> str:
    """What stands in a file, nothing if it cannot be read."""
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            return file.read()
    except OSError:
        return ""
