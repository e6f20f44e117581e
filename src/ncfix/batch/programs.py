"""The programs of a shop: files, and what is below folders."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass

from ncfix import files
from ncfix.diagnostics import Place, UsageError
from ncfix.plugins import registry


@dataclass(frozen=True, slots=True)
class ProgramFile:
    """A program, and the name under which its output is written in an output folder.

    path  as the user wrote it, or below the folder that the user named
    name  the file's own name, or its way down from that folder
    """

    path: str
    name: str


def program_files(given: Iterable[str], apart: str | None = None) -> list[ProgramFile]:
    """The programs that `given` names, folders with all that is below them, in the order of names.

    apart  a folder that is left out: that of the outputs

    A file in a folder is a program if it has a suffix of a dialect. Hidden files and folders, symbolic links, pipes,
    devices and `.orig` files are none. Raises `UsageError` NCF014 for a folder without any, `SourceError` NCF002 for
    one that cannot be read.
    """
    found: list[ProgramFile] = []
    for path in given:
        found.extend(_below(path, apart) if os.path.isdir(path) else [ProgramFile(path, os.path.basename(path))])
    return found


def suffixes() -> frozenset[str]:
    """The suffixes of all dialects, in lower case."""
    return frozenset(suffix.lower() for dialect in registry("dialects").values() for suffix in dialect.suffixes)


def _below(folder: str, apart: str | None) -> list[ProgramFile]:
    known = suffixes()
    found = [ProgramFile(path, os.path.relpath(path, folder)) for path in _files(folder, apart) if _is(path, known)]
    if not found:
        hint = f"programs in folders have one of these suffixes: {' '.join(sorted(known))}; or name the files"
        raise UsageError.of("NCF014", "there is no program in this folder", Place(folder), hint)
    return found


def _files(folder: str, apart: str | None) -> Iterator[str]:
    for here, folders, names in os.walk(folder, onerror=_unreadable):
        folders[:] = sorted(name for name in folders if not name.startswith(".") and not _same(here, name, apart))
        yield from (os.path.join(here, name) for name in sorted(names) if not name.startswith("."))


def _unreadable(error: OSError) -> None:
    raise files.unreadable(str(error.filename), error) from error


def _same(here: str, name: str, apart: str | None) -> bool:
    return apart is not None and os.path.isdir(apart) and os.path.samefile(os.path.join(here, name), apart)


def _is(path: str, known: Collection[str]) -> bool:
    return os.path.splitext(path)[1].lower() in known and not os.path.islink(path) and os.path.isfile(path)
