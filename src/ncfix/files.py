"""Files read and written with care: what is written is whole or not there, and where it was meant to be.

A new file is written without a name, where the system can do that, or else under another one beside its target; it is
forced to the disk, and then given its name in one step. So a process that is killed leaves nothing, or a hidden
`.ncfix-*.tmp`, and never half an output.

Below a folder that the user named, no symbolic link is followed: every folder on the way down is opened from the one
above it, and what is written is written into the folder that is open, wherever its name may lead by then.

Controls run Windows, and programs go to them on sticks and shares. What is written under a name that Windows takes for
something else is lost there, or lands where nobody meant it: `CON` is the console whatever its suffix, a full stop or a
blank at the end is dropped, `\\` and `:` begin a folder, a disk or a hidden stream. So no output gets such a name, on
any system. The names that Windows keeps for devices are listed in Microsoft's "Naming Files, Paths, and Namespaces".
"""

from __future__ import annotations

import errno
import os
import re
import stat
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from ncfix import inputs
from ncfix.diagnostics import Place, SourceError, UsageError

READING = {
    errno.EACCES: "get the right to read it",
    errno.EISDIR: "name a file, not a folder",
    errno.ENXIO: "give an ordinary file, or - for standard input",
    errno.EFBIG: "no file of this kind is so long; a long program can be given as a file",
}
WRITING = {
    errno.EACCES: "another -o, or the right to write there",
    errno.EROFS: "another -o",
    errno.ENAMETOOLONG: "a shorter name",
    errno.ENOTDIR: "another -o: a part of this path is a file",
}
"""What to do about what the system says."""
COPIED = 1 << 20
"""Bytes that are copied at once."""
PERMISSIONS = 0o777
"""Bits of a mode that say who may read, write and run a file."""
FOLDER = os.O_RDONLY | getattr(os, "O_DIRECTORY", 0)
UNKNOWN = frozenset(
    {
        *(errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK, errno.EXDEV),
        *(errno.ENOENT, errno.EISDIR, errno.EINVAL, errno.EACCES),
    }
)
"""What systems and file systems say that have no links, no files without a name, or no way to name one."""
DEVICE = re.compile(r"(?:CON|PRN|AUX|NUL|CLOCK\$|CONIN\$|CONOUT\$|(?:COM|LPT)[0-9\u00b9\u00b2\u00b3])", re.IGNORECASE)
NAME_HINT = "give the output another name; controls and their computers run Windows"


@dataclass(frozen=True, slots=True)
class Whole:
    """All that stands in an open file."""

    handle: IO[bytes]

    @classmethod
    def of(cls, parts: Iterable[bytes], handle: IO[bytes]) -> Whole:
        """Parts, put into an empty file as they come."""
        at = 0
        for part in parts:
            put_at(handle.fileno(), at, part)
            at += len(part)
        return cls(handle)

    def __iter__(self) -> Iterator[bytes]:
        self.handle.seek(0)
        while part := self.handle.read(COPIED):
            yield part


def read_bytes(path: str, most: int = inputs.MOST) -> bytes:
    """The content of a file of at most so many bytes; raises `SourceError` NCF002."""
    try:
        return inputs.taken(path, most)
    except OSError as error:
        raise unreadable(path, error) from error


def read_folder(folder: str) -> dict[str, bytes]:
    """All files of a folder, by their names; raises `SourceError` NCF002."""
    try:
        names = sorted(os.listdir(folder))
    except OSError as error:
        raise unreadable(folder, error) from error
    paths = {name: os.path.join(folder, name) for name in names}
    return {name: read_bytes(path) for name, path in paths.items() if os.path.isfile(path)}


FileIdentity = tuple[int, int]
"""Device and number of a file, whatever it is called."""


def identity(path: str) -> FileIdentity | None:
    """Which file is behind a name; None if there is none."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_dev, found.st_ino


def identities(paths: Iterable[str]) -> frozenset[FileIdentity]:
    """The files behind these names, however they are called."""
    return frozenset(found for found in map(identity, paths) if found is not None)


def each_once(given: Iterable[str], shown: Callable[[str], str] = str) -> None:
    """Refuse a file that is named twice, under whatever names: `UsageError` NCF020.

    shown  how messages name it
    """
    seen: set[object] = set()
    for path in given:
        key = identity(path) or path
        if key in seen:
            raise given_twice(shown(path))
        seen.add(key)


def given_twice(path: str) -> UsageError:
    """The error NCF020 for an input that is there twice: what it says would count twice."""
    text = "is given twice, and what it says would count twice"
    return UsageError.of("NCF020", text, Place(path), "leave it out once")


def unreadable(path: str, error: OSError) -> SourceError:
    """The error NCF002 for what the system says of an input."""
    hint = READING.get(error.errno or 0, "give an existing file's path")
    return SourceError.of("NCF002", f"cannot be read: {error.strerror}", Place(path), hint)


def unwritable(path: str, error: OSError) -> UsageError:
    """The error NCF007 for what the system says of an output."""
    hint = WRITING.get(error.errno or 0, "make room, or another -o")
    return UsageError.of("NCF007", f"cannot be written: {error.strerror}", Place(path), hint)


def exists_already(path: str) -> UsageError:
    """The error NCF004."""
    return UsageError.of("NCF004", "exists already", Place(path), "--force replaces an output")


def put_at(handle: int, at: int, data: bytes) -> None:
    """Write into an open file, from a byte on."""
    rest = memoryview(data)
    while rest:
        done = os.pwrite(handle, rest, at)
        at, rest = at + done, rest[done:]


@contextmanager
def said_of(path: str | None) -> Iterator[None]:
    """What the system says of a file without a name is said of this path; None: of the folder for temporary files."""
    try:
        yield
    except OSError as error:
        if error.filename is None:
            from tempfile import gettempdir

            error.filename = path or gettempdir()
        raise


def unnamed(folder: str | None) -> IO[bytes]:
    """A new file without a name, in a folder if it can be there: gone with this process unless it is given one.

    What is written into it is there at once, for all processes that have it open.
    """
    folder = folder if folder and os.path.isdir(folder) else None
    if folder and hasattr(os, "O_TMPFILE"):
        with suppress(OSError):
            return os.fdopen(os.open(folder, os.O_RDWR | os.O_TMPFILE, 0o666), "w+b", buffering=0)
    from tempfile import TemporaryFile

    with suppress(OSError):
        return TemporaryFile(dir=folder, buffering=0)
    return TemporaryFile(buffering=0)


def holds(path: str, data: bytes | Iterable[bytes]) -> bool:
    """Whether a file has exactly this content; raises `SourceError` NCF002."""
    try:
        with open(path, "rb") as handle:
            for part in (data,) if isinstance(data, bytes) else data:
                if handle.read(len(part)) != part:
                    return False
            return not handle.read(1)
    except OSError as error:
        raise unreadable(path, error) from error


def mode_of(path: str) -> int | None:
    """Who may read, write and run a file, as permission bits; None for what is no ordinary file."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_mode & PERMISSIONS if stat.S_ISREG(found.st_mode) else None


def write_whole(
    path: str, data: bytes | Iterable[bytes], replace: bool = False, root: str | None = None, mode: int | None = None
) -> None:
    """Write a new file, or with `replace` in place of an existing one, whose owner and mode are kept.

    root  as in `check_output`
    mode  permission bits of a new file; None: those that new files get

    Raises `UsageError` NCF004, NCF005, NCF007, NCF023.
    """
    check_output(path, root, replace)
    with _coded(path), _folder(path, root) as (folder, name):
        like = _as_it_is(name, folder)
        _put(folder, name, data, mode if like is None else like, replace)
        _sync(folder)


def write_folder(
    folder: str, contents: Mapping[str, bytes], replace: bool = False, inputs: Collection[FileIdentity] = ()
) -> None:
    """Write all files of a folder, or none if one is there already or must not be, or there is no room.

    contents  name of a file -> what is in it
    inputs    files that are not replaced in any case

    Raises `UsageError` NCF003, NCF004, NCF005, NCF007, NCF023.
    """
    check_folder(folder)
    paths = {os.path.join(folder, name): content for name, content in contents.items()}
    for path in paths:
        check_target(path, inputs, replace, folder)
    fresh = [path for path in paths if not os.path.lexists(path)]
    try:
        for path, content in paths.items():
            write_whole(path, content, replace, folder)
    except UsageError:
        for path in fresh:
            with suppress(OSError):
                os.unlink(path)
        raise


def replace_keeping(path: str, backup: str, data: bytes | Iterable[bytes]) -> None:
    """Give `path` new content and keep the old file as `backup`; at every moment both names hold whole files."""
    check_output(path)
    with _coded(path), _folder(path, None) as (folder, name):
        kept = os.path.basename(backup)
        like = _as_it_is(name, folder)
        with _without_a_name(folder, data, like) as handle, _written_beside(folder, data, like, handle) as temporary:
            if not _link(name, kept, folder):
                write_whole(backup, Path(path).read_bytes())
            try:
                os.replace(temporary, name, src_dir_fd=folder, dst_dir_fd=folder)
            except OSError:
                os.unlink(kept, dir_fd=folder)
                raise
        _sync(folder)


def append(path: str, data: bytes) -> None:
    """Write on at the end of a file of ncfix's own, to the disk. Raises `UsageError` NCF005, NCF007."""
    check_own(path)
    with _coded(path):
        os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
        handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK, 0o666)
        try:
            _fill(handle, data)
            os.fsync(handle)
        finally:
            os.close(handle)


@contextmanager
def _coded(path: str) -> Iterator[None]:
    try:
        yield
    except FileExistsError as error:
        name = os.path.basename(str(error.filename2 or path))
        raise exists_already(os.path.join(os.path.dirname(path), name)) from error
    except OSError as error:
        raise unwritable(path, error) from error


# -- the way there ----------------------------------------------------------------------------------------------------


@contextmanager
def _folder(path: str, root: str | None) -> Iterator[tuple[int, str]]:
    """The folder of an output, opened, and the output's name in it; folders that are missing are made."""
    top, way = way_to(path, root)
    *folders, name = way.split(os.sep)
    os.makedirs(top or ".", exist_ok=True)
    here, at = os.open(top or ".", FOLDER), top
    try:
        for each in folders:
            at = os.path.join(at, each)
            with suppress(FileExistsError):
                os.mkdir(each, dir_fd=here)
            if stat.S_ISLNK(os.stat(each, dir_fd=here, follow_symlinks=False).st_mode):
                raise linked(at)
            outer, here = here, os.open(each, FOLDER | os.O_NOFOLLOW, dir_fd=here)
            os.close(outer)
        yield here, name
    finally:
        os.close(here)


def _as_it_is(name: str, folder: int) -> os.stat_result | None:
    """What the system says of a file in a folder; None if there is none."""
    try:
        return os.stat(name, dir_fd=folder, follow_symlinks=False)
    except FileNotFoundError:
        return None


# -- the file ---------------------------------------------------------------------------------------------------------


Like = os.stat_result | int | None
"""Whose owner and mode a file gets, or which permission bits; None: those of new files."""


def _put(folder: int, name: str, data: bytes | Iterable[bytes], like: Like, replace: bool) -> None:
    """A file with this content, on the disk, under a name in a folder."""
    with _without_a_name(folder, data, like) as handle:
        if handle is not None and not replace and _named(handle, name, folder):
            return
        with _written_beside(folder, data, like, handle) as temporary:
            if replace or not _link(temporary, name, folder):
                os.replace(temporary, name, src_dir_fd=folder, dst_dir_fd=folder)


@contextmanager
def _without_a_name(folder: int, data: bytes | Iterable[bytes], like: Like) -> Iterator[int | None]:
    """A file with this content and no name, on the disk; None where there is no such thing."""
    handle = os.dup(data.handle.fileno()) if isinstance(data, Whole) else _new_without_a_name(folder)
    if handle is None:
        yield None
        return
    try:
        if not isinstance(data, Whole):
            _fill(handle, data)
        _make_like(handle, like)
        os.fsync(handle)
        yield handle
    finally:
        os.close(handle)


def _new_without_a_name(folder: int) -> int | None:
    if hasattr(os, "O_TMPFILE"):
        try:
            return os.open(".", os.O_RDWR | os.O_TMPFILE, 0o666, dir_fd=folder)
        except OSError as error:
            if error.errno not in UNKNOWN:
                raise
    return None


@contextmanager
def _written_beside(
    folder: int, data: bytes | Iterable[bytes], like: Like, unnamed: int | None = None
) -> Iterator[str]:
    """A file with this content, on the disk, in a folder; gone afterwards if it still has its own name.

    unnamed  a file with this content, owner and mode that has no name yet
    """
    temporary = f".ncfix-{os.urandom(8).hex()}.tmp"
    try:
        if unnamed is None or not _named(unnamed, temporary, folder):
            handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666, dir_fd=folder)
            try:
                _make_like(handle, like)
                _fill(handle, data if unnamed is None else _parts(unnamed))
                os.fsync(handle)
            finally:
                os.close(handle)
        yield temporary
    finally:
        with suppress(FileNotFoundError):
            os.unlink(temporary, dir_fd=folder)


def _fill(handle: int, data: bytes | Iterable[bytes]) -> None:
    for part in (data,) if isinstance(data, bytes) else data:
        rest = memoryview(part)
        while rest:
            rest = rest[os.write(handle, rest) :]


def _parts(handle: int) -> Iterator[bytes]:
    """What stands in an open file."""
    at = 0
    while part := os.pread(handle, COPIED, at):
        yield part
        at += len(part)


def _named(handle: int, name: str, folder: int) -> bool:
    """Give a file without a name this one, which must be free; False where the system cannot do that."""
    try:
        os.link(f"/proc/self/fd/{handle}", name, src_dir_fd=folder, dst_dir_fd=folder)  # else it would not be followed
    except FileExistsError:
        raise
    except OSError as error:
        if error.errno in UNKNOWN:
            return False
        raise
    return True


def _make_like(handle: int, like: Like) -> None:
    """Give a new file the owner and the mode of another, or a mode."""
    if isinstance(like, int):
        os.chmod(handle, like)
    elif like is not None:
        if (like.st_uid, like.st_gid) != (os.fstat(handle).st_uid, os.fstat(handle).st_gid):
            with suppress(PermissionError):
                os.chown(handle, like.st_uid, like.st_gid)
        os.chmod(handle, stat.S_IMODE(like.st_mode))


def _link(old: str, new: str, folder: int) -> bool:
    """Give a file of a folder a second name there, which must be free; False where there is no such thing."""
    try:
        os.link(old, new, src_dir_fd=folder, dst_dir_fd=folder, follow_symlinks=False)
    except FileExistsError:
        raise
    except OSError as error:
        if error.errno in UNKNOWN:
            return False
        raise
    return True


def _sync(folder: int) -> None:
    """Make the new name last through a power cut, where the file system can."""
    try:
        os.fsync(folder)
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise


# -- where an output may go --------------------------------------------------------------------------------------------


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
    """The same for all names that some file system takes for one: case and composed letters make no difference."""
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
        hint = "--in-place, or another -o"
        raise UsageError.of("NCF005", "is an input too, and inputs are not changed", Place(path), hint)
    if os.path.lexists(path) and not (replace or resume):
        raise exists_already(path)
    folder = os.path.dirname(path) or "."
    if os.path.lexists(folder) and not os.path.isdir(folder):
        raise UsageError.of("NCF007", "is not a folder", Place(folder))


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
