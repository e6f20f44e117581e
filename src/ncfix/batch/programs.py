"""Finds programs in files and folders, and the files of the subprograms that they call."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache
from typing import TYPE_CHECKING

from ncfix import files
from ncfix.diagnostics import Message, Place, UsageError
from ncfix.plugins import registry
from ncfix.text.dialect import goes_back
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.control.setup import Setup

SUBPROGRAM_SUFFIXES = ("", ".ngc", ".nc", ".spf", ".mpf")
"""Suffixes that a subprogram's file may have, in addition to the suffix of the calling program."""

TAIL_BYTES = 1 << 12
"""Number of bytes at the end of a text in which its last block is searched for."""
CODE = re.compile(rb"[ \t]*(?:\([^)]*\)[ \t]*)*[^%;(\s\0-\x1f]")
"""A line with more than comments and a tape mark."""
PROGRAM_END = re.compile(rb"(?i)(?:[^(;]|\([^)]*\))*?(?<![A-Z])M[ \t]*0*(?:2|30)(?![\d.])")


@frozen
class ProgramFile:
    """A program, and the name of its output in an output folder.

    path  as the user gave it, or below the folder that the user gave
    name  the file's own name, or its path below that folder
    below  whether it was found in a folder, and not given itself
    """

    path: str
    name: str
    below: bool = False

    @property
    def left_out(self) -> Message | None:
        """Why a program found in a folder is left out (it is a subprogram); None if it is not."""
        if not (self.below and is_subprogram(self.path)):
            return None
        text = "is a subprogram; ncfix corrects it in the programs that call it, with --flatten"
        return Message("NCF258", text, Place(self.path), "name the file itself to correct it as a main program")


def program_files(given: Iterable[str], apart: str | None = None) -> list[ProgramFile]:
    """The programs given by files and folders; of a folder all that are below it, sorted by name.

    apart  a folder that is left out: the output folder

    A file in a folder is a program if it has a suffix of a dialect. Hidden files and folders, symbolic links, pipes,
    devices and `.orig` files are not. Raises `UsageError` NCF014 for a folder without programs, `SourceError` NCF002
    for one that cannot be read.
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
    found = []
    for path in _files(folder, apart):
        suffix = os.path.splitext(path)[1].lower()
        if suffix in known and not os.path.islink(path) and os.path.isfile(path):
            found.append(ProgramFile(path, path[len(folder) :].lstrip(os.sep), below=True))
    if not found:
        hint = f"programs in folders have one of these suffixes: {' '.join(sorted(known))}; or name the files"
        raise UsageError.of("NCF014", "there is no program in this folder", Place(folder), hint)
    return found


def _files(folder: str, apart: str | None) -> Iterator[str]:
    """The files below a folder that are neither hidden nor below `apart`."""

    def refuse(error: OSError) -> None:
        raise files.unreadable(str(error.filename), error) from error

    for here, folders, names in os.walk(folder, onerror=refuse):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        if apart is not None and os.path.isdir(apart):
            folders[:] = [name for name in folders if not os.path.samefile(os.path.join(here, name), apart)]
        yield from (os.path.join(here, name) for name in sorted(names) if not name.startswith("."))


def is_subprogram(path: str) -> bool:
    """Whether the last block of a text returns to a caller, in any dialect, and no block ends a program."""
    try:
        with open(path, "rb") as handle:
            handle.seek(max(0, os.fstat(handle.fileno()).st_size - TAIL_BYTES))
            blocks = [line for line in handle.read().splitlines() if CODE.match(line)]
            if not blocks or not any(goes_back(blocks[-1], each) for each in registry("dialects").values()):
                return False
            handle.seek(0)
            return not any(PROGRAM_END.match(line) for line in handle)
    except OSError:
        return False  # whoever reads it says why


@frozen
class SubprogramFiles:
    """Finds the files of subprograms in folders, in their order, by name with or without a suffix.

    If no file has exactly the name, one with the name in another case is taken if it is the only one.
    """

    folders: tuple[str, ...]
    suffixes: tuple[str, ...] = SUBPROGRAM_SUFFIXES

    def __call__(self, name: str) -> bytes | None:
        """The text of a subprogram; None if there is none."""
        if os.path.basename(name) != name:
            return None
        for folder in self.folders:
            for suffix in self.suffixes:
                if found := file_of(folder, name + suffix):
                    return files.read_bytes(found)
        return None


def file_of(folder: str, name: str) -> str:
    """The path of a file in a folder, with its name in any case; empty if there is none, or more than one."""
    path = os.path.join(folder, name)
    if os.path.isfile(path):
        return path
    try:
        alike = names_in(folder, os.stat(folder).st_mtime_ns).get(name.lower(), [])
    except OSError:
        return ""
    path = os.path.join(folder, alike[0]) if len(alike) == 1 else ""
    return path if os.path.isfile(path) else ""


@lru_cache(maxsize=8)
def names_in(folder: str, changed: int) -> dict[str, list[str]]:
    """Name in lower case -> names, of a folder's content; `changed`: its modification time, ns, for the cache."""
    found: dict[str, list[str]] = {}
    for each in os.listdir(folder):
        found.setdefault(each.lower(), []).append(each)
    return found


def subprograms(setup: Setup, *paths: str) -> Callable[[str], bytes | None]:
    """A finder of subprograms: beside the given programs, and in the folders of the setup."""
    beside = dict.fromkeys("." if path == "-" else os.path.dirname(path) or "." for path in paths)
    suffixes = dict.fromkeys((*SUBPROGRAM_SUFFIXES, *(os.path.splitext(path)[1].lower() for path in paths)))
    return SubprogramFiles((*beside, *setup.subprograms), tuple(suffixes))
