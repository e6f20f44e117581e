"""Which outputs may be written: under what name, through which folders, in whose place. Nothing is written here.

Controls run Windows, and programs go to them on sticks and shares. What is written under a name that Windows takes for
something else is lost there, or lands where nobody meant it: `CON` is the console whatever its suffix, a full stop or a
blank at the end is dropped, `\\` and `:` begin a folder, a disk or a hidden stream. So no output gets such a name, on
any system. The names that Windows keeps for devices are listed in Microsoft's "Naming Files, Paths, and Namespaces".
"""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Collection
from contextlib import suppress

from ncfix.diagnostics import Place, UsageError
from ncfix.inputs import FileIdentity, identity

DEVICE = re.compile(r"(?:CON|PRN|AUX|NUL|CLOCK\$|CONIN\$|CONOUT\$|(?:COM|LPT)[0-9\u00b9\u00b2\u00b3])", re.IGNORECASE)
NAME_HINT = "give the output another name; controls and their computers run Windows"


def check_target(
    path: str,
    inputs: Collection[FileIdentity] = (),
    replace: bool = False,
    root: str | None = None,
    resume: bool = False,
) -> None:
    """Refuse an output that must not be written, as long as nothing has been computed.

    inputs   files that are read, and not replaced in any case
    replace  an existing output may be replaced
    root     as in `check_output`
    resume   an existing output is left as it is

    Raises `UsageError` NCF003, NCF004, NCF005, NCF007, NCF023.
    """
    check_named(path)
    check_output(path, root, replace)
    if identity(path) in inputs:
        hint = "another output; ncfix fix has --in-place, too"
        raise UsageError.of("NCF005", "is an input too, and inputs are not changed", Place(path), hint)
    if os.path.lexists(path) and not (replace or resume):
        raise exists_already(path)
    folder = os.path.dirname(path) or "."
    if os.path.lexists(folder) and not os.path.isdir(folder):
        raise UsageError.of("NCF007", "is not a folder", Place(folder))


def exists_already(path: str) -> UsageError:
    """The error NCF004."""
    return UsageError.of("NCF004", "exists already", Place(path), "--force replaces an output")


def check_name(way: str, path: str) -> None:
    """Refuse a way down from an output folder, or the name of a file, that cannot be carried: NCF023.

    path  the output, for the message
    """
    if os.path.isabs(way):
        raise UsageError.of("NCF023", "leads out of the output folder: it begins at the root", Place(path), NAME_HINT)
    for name in way.split(os.sep):
        if problem := _name_problem(name):
            raise UsageError.of("NCF023", problem, Place(path), NAME_HINT)


def folded_name(path: str) -> str:
    """A name without what some file systems do not tell apart: case, and composed letters."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


def check_ordinary(path: str) -> None:
    """Refuse an output that is there and is a symbolic link, a folder or a device: NCF005."""
    if os.path.islink(path):
        hint = f"name the file itself: {os.path.realpath(path)}"
        raise UsageError.of("NCF005", "is a symbolic link, which is not written through", Place(path), hint)
    if os.path.lexists(path) and not os.path.isfile(path):
        raise UsageError.of("NCF005", "is not an ordinary file", Place(path), "-o - writes to standard output")


def check_output(path: str, root: str | None = None, replace: bool = False) -> None:
    """Refuse an output that must not be written: under a name that cannot be carried, or through a link.

    root  the folder that the user named, if the way from there is that of an input: none of its folders may be a link

    Raises `UsageError` NCF005, NCF023.
    """
    folder, way = way_to(path, root)
    check_name(way, path)
    check_ordinary(path)
    here = folder
    for name in way.split(os.sep)[:-1]:
        here = os.path.join(here, name)
        if os.path.islink(here):
            raise linked(here)
    if replace and os.path.lexists(path) and (link := _link_on_the_way(folder)):
        text = f"would be replaced through the symbolic link {link}"
        hint = f"name the folder itself: {os.path.realpath(folder)}"
        raise UsageError.of("NCF005", text, Place(path), hint)


def check_named(path: str | None) -> None:
    """Refuse an empty name: `UsageError` NCF003; None is no name."""
    if path == "":
        raise UsageError.of("NCF003", "the name of the output is empty", hint="-o FILE, -o DIR or -o -")


def check_folder(folder: str) -> None:
    """Refuse what cannot be a folder of several files: NCF003, or NCF007 for what is there and is none."""
    if folder in ("", "-"):
        raise UsageError.of("NCF003", "tables are several files, which go to a folder", hint="-o FOLDER")
    if os.path.lexists(folder) and not os.path.isdir(folder):
        raise UsageError.of("NCF007", "is not a folder", Place(folder), "-o FOLDER")


def check_own(path: str) -> None:
    """Refuse to write on in what is no file of ncfix's own: a link, a device, a file with another name, too. NCF005."""
    check_ordinary(path)
    with suppress(FileNotFoundError):
        if os.stat(path).st_nlink != 1:
            raise UsageError.of("NCF005", "is another file, too: it has two names", Place(path), "remove this one")


def way_to(path: str, root: str | None) -> tuple[str, str]:
    """The folder that the user named, and the way from there."""
    if root is None:
        return os.path.dirname(path), os.path.basename(path)
    return root, os.path.relpath(path, root)


def linked(path: str) -> UsageError:
    """The error NCF005 for a folder below the output folder that is a symbolic link."""
    hint = "take the link away, or another -o"
    return UsageError.of("NCF005", "is a symbolic link, and leads out of the output folder", Place(path), hint)


def _name_problem(name: str) -> str:
    """What is the matter with a name; empty if nothing is."""
    if name in ("", os.curdir):
        return "has an empty name in it"
    if name == os.pardir:
        return "leads out of the output folder: it has .. in it"
    if odd := next((char for char in name if unicodedata.category(char) == "Cc"), ""):
        return f"has a control character in its name: {odd!r}"
    if odd := next((char for char in "\\:" if char in name), ""):
        return f"has a {odd} in its name, which is a path on Windows"
    if name[-1] in ". ":
        return f"ends in a {'full stop' if name[-1] == '.' else 'blank'}, which Windows leaves out"
    stem = name.split(".", 1)[0].rstrip(" ")
    if DEVICE.fullmatch(stem):
        return f"{stem} is the name of a device on Windows, whatever its suffix"
    return ""


def _link_on_the_way(folder: str) -> str:
    """The first symbolic link among the folders that the user named; empty if there is none.

    Links at the root of the file system, as `/tmp` of macOS, are the system's own.
    """
    parts = folder.split(os.sep)
    for count in range(3 if os.path.isabs(folder) else 1, len(parts) + 1):
        here = os.sep.join(parts[:count])
        if here and os.path.islink(here):
            return here
    return ""
