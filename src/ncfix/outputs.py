"""Checks whether outputs may be written: names, folders on the way, files that would be replaced. Writes nothing.

Controls run Windows, and programs reach them on USB sticks and network shares. A name with a special meaning on Windows
is lost there, or leads elsewhere: `CON` is the console with any suffix, a final full stop or blank is dropped, `\\` and
`:` begin a folder, a drive or a hidden stream. So no output gets such a name, on any system. Source: Microsoft, "Naming
Files, Paths, and Namespaces".
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
    """Refuse an output that must not be written; to be called before anything is computed.

    inputs   files that are read, and so never replaced
    replace  whether an existing output may be replaced
    root     as in `check_output`
    resume   whether an existing output is accepted and left unchanged

    Raises `UsageError` NCF003, NCF004, NCF005, NCF007, NCF023.
    """
    check_named(path)
    check_output(path, root, replace)
    if identity(path) in inputs:
        hint = "give another output; ncfix fix also has --in-place"
        raise UsageError.of("NCF005", "is also an input, and inputs are not changed", Place(path), hint)
    if os.path.lexists(path) and not (replace or resume):
        raise exists_already(path)
    folder = os.path.dirname(path) or "."
    if os.path.lexists(folder) and not os.path.isdir(folder):
        raise UsageError.of("NCF007", "is not a folder", Place(folder))


def exists_already(path: str) -> UsageError:
    """The error NCF004: the output exists already."""
    return UsageError.of("NCF004", "exists already", Place(path), "choose another output, or replace it with --force")


def check_name(way: str, path: str) -> None:
    """Refuse a path below an output folder, or a file name, that is not allowed: NCF023.

    path  the output, for the message
    """
    if os.path.isabs(way):
        raise UsageError.of("NCF023", "leads out of the output folder: it begins at the root", Place(path), NAME_HINT)
    for name in way.split(os.sep):
        if problem := _name_problem(name):
            raise UsageError.of("NCF023", problem, Place(path), NAME_HINT)


def folded_name(path: str) -> str:
    """A name in the form in which file systems may compare it: without case, and with composed letters."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", path).casefold())


def check_ordinary(path: str) -> None:
    """Refuse an existing output that is a symbolic link, a folder or a device: NCF005."""
    if os.path.islink(path):
        hint = f"name the file itself: {os.path.realpath(path)}"
        raise UsageError.of("NCF005", "is a symbolic link; ncfix does not write through links", Place(path), hint)
    if os.path.lexists(path) and not os.path.isfile(path):
        raise UsageError.of("NCF005", "is not an ordinary file", Place(path), "-o - writes to standard output")


def check_output(path: str, root: str | None = None, replace: bool = False) -> None:
    """Refuse an output whose name is not allowed, or that would be written through a symbolic link.

    root  the folder named by the user, if the path below it is that of an input: none of its folders may be a link

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
    """Refuse an empty name: `UsageError` NCF003; None is accepted."""
    if path == "":
        raise UsageError.of("NCF003", "the name of the output is empty", hint="-o FILE, -o DIR or -o -")


def check_folder(folder: str) -> None:
    """Refuse an output folder with an invalid name (NCF003), or one that exists and is not a folder (NCF007)."""
    if folder in ("", "-"):
        raise UsageError.of("NCF003", "tables are several files, which go to a folder", hint="-o FOLDER")
    if os.path.lexists(folder) and not os.path.isdir(folder):
        raise UsageError.of("NCF007", "is not a folder", Place(folder), "-o FOLDER")


def check_own(path: str) -> None:
    """Refuse to append to a file that is not ncfix's own: a link, a device, or a file with a second name. NCF005."""
    check_ordinary(path)
    with suppress(FileNotFoundError):
        if os.stat(path).st_nlink != 1:
            raise UsageError.of("NCF005", "has a second name (a hard link)", Place(path), "remove this name")


def way_to(path: str, root: str | None) -> tuple[str, str]:
    """The folder that the user named, and the path below it."""
    if root is None:
        return os.path.dirname(path), os.path.basename(path)
    return root, os.path.relpath(path, root)


def linked(path: str) -> UsageError:
    """The error NCF005 for a symbolic link among the folders below the output folder."""
    hint = "remove the link, or give another -o"
    return UsageError.of("NCF005", "is a symbolic link, and leads out of the output folder", Place(path), hint)


def _name_problem(name: str) -> str:
    """What is wrong with a name, in words; empty if nothing is."""
    if name in ("", os.curdir):
        return "contains an empty name"
    if name == os.pardir:
        return "leads out of the output folder: it has .. in it"
    if odd := next((char for char in name if unicodedata.category(char) == "Cc"), ""):
        return f"has a control character in its name: {odd!r}"
    if odd := next((char for char in "\\:" if char in name), ""):
        return f"has a {odd} in its name, which is a path on Windows"
    if name[-1] in ". ":
        return f"ends in a {'full stop' if name[-1] == '.' else 'blank'}, which Windows drops"
    stem = name.split(".", 1)[0].rstrip(" ")
    if DEVICE.fullmatch(stem):
        return f"{stem} is the name of a device on Windows, whatever its suffix"
    return ""


def _link_on_the_way(folder: str) -> str:
    """The first symbolic link in the path of a folder that the user named; empty if there is none.

    Links at the root of the file system, such as `/tmp` on macOS, belong to the system and are ignored.
    """
    parts = folder.split(os.sep)
    for count in range(3 if os.path.isabs(folder) else 1, len(parts) + 1):
        here = os.sep.join(parts[:count])
        if here and os.path.islink(here):
            return here
    return ""
