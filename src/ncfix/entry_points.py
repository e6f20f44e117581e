"""Entry points of installed distributions, read directly from their metadata folders.

`importlib.metadata.entry_points` finds the same, but importing it doubles the time of `ncfix --help`. It is used only
if distributions may be elsewhere: in a zip file, an egg, or with a finder of their own.
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
"""Endings of a distribution's metadata folder."""
METADATA = ("METADATA", "PKG-INFO", "")
"""Files in that folder that may give name and version; an egg-info may be that file itself."""
PATH_FINDER = "_frozen_importlib_external"
"""Module of Python's own finder, which searches the folders of the path."""


class EntryPoint(Protocol):
    """An entry point: name, value (`module:object`), distribution (or None), and the object it loads."""

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
    """A distribution, given by its metadata folder."""

    folder: str

    @property
    def metadata(self) -> dict[str, str | None]:
        """Name and version; None if not given."""
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
        """The module that it names."""
        return re.split(r"[:\[]", self.value, maxsplit=1)[0].strip()

    def load(self) -> Any:
        """The module, or the object in it, that the value names; raises what importing it raises."""
        attributes = self.value.partition("[")[0].partition(":")[2].strip()
        return reduce(getattr, attributes.split(".") if attributes else (), import_module(self.module))


def entry_points(group: str) -> list[EntryPoint]:
    """The entry points of a group; of several distributions with the same name, the first on the path is used."""
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
    """Names of all metadata folders in a folder of the path."""
    try:
        return [name for name in os.listdir(folder or ".") if name.lower().endswith(INFO)]
    except OSError:
        return []


def _of_group(distribution: InstalledDistribution, group: str) -> Iterator[InstalledEntryPoint]:
    """The entry points of a distribution in a group."""
    section = ""
    for raw in _text(os.path.join(distribution.folder, "entry_points.txt")).splitlines():
        line = raw.strip()
        if line.startswith("[") and line.endswith("]"):
            section = line[1:-1]
        elif section == group and line and not line.startswith("#"):
            name, _, value = line.partition("=")
            yield InstalledEntryPoint(name.strip(), value.strip(), distribution)


def _text(path: str) -> str:
    """The content of a file; empty if it cannot be read."""
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            return file.read()
    except OSError:
        return ""
