"""Reads and writes files safely: an output is written completely or not at all, and only at its intended place.

A new file is written without a name if the system supports that, else under a temporary name beside its target. It is
synchronised to disk, and then given its name in one step. So a killed process leaves nothing, or a hidden
`.ncfix-*.tmp`, and never half an output.

Below a folder that the user named, symbolic links are not followed: each folder is opened from the one above it, and
output is written into the opened folder, even if its name leads somewhere else by then.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path
from typing import IO

from ncfix import inputs
from ncfix.diagnostics import Place, SourceError, UsageError
from ncfix.inputs import FileIdentity
from ncfix.outputs import check_folder, check_output, check_own, check_target, exists_already, linked, way_to
from ncfix.values import frozen

READING = {
    errno.EACCES: "get permission to read it",
    errno.EISDIR: "give a file, not a folder",
    errno.ENXIO: "give an ordinary file, or - for standard input",
    errno.EFBIG: "files of this kind are never so long; give a long program as a file, not through a pipe",
}
WRITING = {
    errno.EACCES: "give another -o, or get permission to write there",
    errno.EROFS: "another -o",
    errno.ENAMETOOLONG: "give a shorter name",
    errno.ENOTDIR: "give another -o: a part of this path is a file",
}
"""Hints by error number of the system."""
COPIED = 1 << 20
"""Number of bytes copied at once."""
COMPARED = 1000
"""Largest number of names in a folder that are compared with a missing one."""
PERMISSIONS = 0o777
"""Bits of a mode for the rights to read, write and execute."""
FOLDER = os.O_RDONLY | getattr(os, "O_DIRECTORY", 0)
UNKNOWN = frozenset(
    {
        *(errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK, errno.EXDEV),
        *(errno.ENOENT, errno.EISDIR, errno.EINVAL, errno.EACCES),
    }
)
"""Error numbers from systems and file systems that do not support links or unnamed files."""


@frozen
class WholeFile:
    """The content of an open file."""

    handle: IO[bytes]

    @classmethod
    def of(cls, parts: Iterable[bytes], handle: IO[bytes]) -> WholeFile:
        """Write parts into an empty file as they come."""
        at = 0
        for part in parts:
            put_at(handle.fileno(), at, part)
            at += len(part)
        return cls(handle)

    def __iter__(self) -> Iterator[bytes]:
        self.handle.seek(0)
        while part := self.handle.read(COPIED):
            yield part


def read_bytes(path: str, most: int = inputs.MAX_BYTES) -> bytes:
    """The content of a file of at most `most` bytes; raises `SourceError` NCF002."""
    try:
        return inputs.content_of(path, most)
    except OSError as error:
        raise unreadable(path, error) from error


def read_folder(folder: str) -> dict[str, bytes]:
    """Name -> content of all files in a folder; raises `SourceError` NCF002."""
    try:
        names = sorted(os.listdir(folder))
    except OSError as error:
        raise unreadable(folder, error) from error
    paths = {name: os.path.join(folder, name) for name in names}
    return {name: read_bytes(path) for name, path in paths.items() if os.path.isfile(path)}


def unreadable(path: str, error: OSError) -> SourceError:
    """The error NCF002 for an input that the system cannot read."""
    return SourceError.of("NCF002", f"cannot be read: {error.strerror}", Place(path), reading_hint(path, error))


def reading_hint(path: str, error: OSError) -> str:
    """A hint for an input that cannot be read; for a missing file, the most similar name in its folder."""
    if error.errno == errno.ENOENT and path:
        from difflib import get_close_matches

        folder, name = os.path.split(path.rstrip(os.sep))
        if folder and not os.path.isdir(folder):
            return f"there is no folder {folder}"
        with suppress(OSError), os.scandir(folder or ".") as entries:
            if close := get_close_matches(name, [entry.name for entry in islice(entries, COMPARED)], 1):
                return f"did you mean {os.path.join(folder, close[0])}?"
    return READING.get(error.errno or 0, "give the path of an existing file")


def unwritable(path: str, error: OSError) -> UsageError:
    """The error NCF007 for an output that the system cannot write."""
    hint = WRITING.get(error.errno or 0, "make room, or give another -o")
    return UsageError.of("NCF007", f"cannot be written: {error.strerror}", Place(path), hint)


def put_at(handle: int, at: int, data: bytes) -> None:
    """Write `data` into an open file at byte `at`."""
    rest = memoryview(data)
    while rest:
        done = os.pwrite(handle, rest, at)
        at, rest = at + done, rest[done:]


@contextmanager
def said_of(path: str | None) -> Iterator[None]:
    """Add the name `path` to system errors of an unnamed file; None: the folder for temporary files."""
    try:
        yield
    except OSError as error:
        if error.filename is None:
            from tempfile import gettempdir

            error.filename = path or gettempdir()
        raise


def unnamed(folder: str | None) -> IO[bytes]:
    """A new file without a name, in `folder` if possible; it disappears with this process unless it is given a name.

    What is written to it is at once visible to all processes that have it open.
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
    """Permission bits of a file; None if it is not an ordinary file."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_mode & PERMISSIONS if stat.S_ISREG(found.st_mode) else None


def write_whole(
    path: str, data: bytes | Iterable[bytes], replace: bool = False, root: str | None = None, mode: int | None = None
) -> None:
    """Write a new file; with `replace`, an existing one is replaced and its owner and mode are kept.

    root  as in `check_output`
    mode  permission bits of a new file; None: the default

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
    """Write all files of a folder, or none if one of them exists, must not be written, or there is no space.

    contents  file name -> content
    inputs    files that are never replaced

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
    """Give `path` new content and keep the old file as `backup`; at every moment both names refer to complete files."""
    check_output(path)
    with _coded(path), _folder(path, None) as (folder, name):
        second = os.path.basename(backup)
        like = _as_it_is(name, folder)
        with _without_a_name(folder, data, like) as handle, _written_beside(folder, data, like, handle) as temporary:
            if not _link(name, second, folder):
                write_whole(backup, Path(path).read_bytes())
            try:
                os.replace(temporary, name, src_dir_fd=folder, dst_dir_fd=folder)
            except OSError:
                os.unlink(second, dir_fd=folder)
                raise
        _sync(folder)


def append(path: str, data: bytes) -> None:
    """Append to a file that ncfix itself owns, and synchronise it. Raises `UsageError` NCF005, NCF007."""
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
    """Open the folder of an output and yield it with the output's name in it; missing folders are created."""
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
    """Status of a file in a folder; None if the file does not exist."""
    try:
        return os.stat(name, dir_fd=folder, follow_symlinks=False)
    except FileNotFoundError:
        return None


# -- the file ---------------------------------------------------------------------------------------------------------


Like = os.stat_result | int | None
"""File whose owner and mode a new file gets, or permission bits; None: defaults."""


def _put(folder: int, name: str, data: bytes | Iterable[bytes], like: Like, replace: bool) -> None:
    """Write a file with this content to disk under a name in a folder."""
    with _without_a_name(folder, data, like) as handle:
        if handle is not None and not replace and _named(handle, name, folder):
            return
        with _written_beside(folder, data, like, handle) as temporary:
            if replace or not _link(temporary, name, folder):
                os.replace(temporary, name, src_dir_fd=folder, dst_dir_fd=folder)


@contextmanager
def _without_a_name(folder: int, data: bytes | Iterable[bytes], like: Like) -> Iterator[int | None]:
    """A file on disk with this content and no name; None if the system has no such files."""
    handle = os.dup(data.handle.fileno()) if isinstance(data, WholeFile) else _new_without_a_name(folder)
    if handle is None:
        yield None
        return
    try:
        if not isinstance(data, WholeFile):
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
    """A file on disk with this content, under a temporary name in a folder; removed if it still has that name.

    unnamed  an unnamed file with this content, owner and mode
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
    """The content of an open file, in parts."""
    at = 0
    while part := os.pread(handle, COPIED, at):
        yield part
        at += len(part)


def _make_like(handle: int, like: Like) -> None:
    """Give a new file the owner and mode of another file, or a mode."""
    if isinstance(like, int):
        os.chmod(handle, like)
    elif like is not None:
        if (like.st_uid, like.st_gid) != (os.fstat(handle).st_uid, os.fstat(handle).st_gid):
            with suppress(PermissionError):
                os.chown(handle, like.st_uid, like.st_gid)
        os.chmod(handle, stat.S_IMODE(like.st_mode))


def _link(old: str, new: str, folder: int, *, follow: bool = False) -> bool:
    """Give a file in a folder a second name there, which must be free; returns False if the system cannot do that.

    follow  `old` is a symbolic link to the file
    """
    try:
        os.link(old, new, src_dir_fd=folder, dst_dir_fd=folder, follow_symlinks=follow)
    except FileExistsError:
        raise
    except OSError as error:
        if error.errno in UNKNOWN:
            return False
        raise
    return True


def _named(handle: int, name: str, folder: int) -> bool:
    """Give an unnamed file a name in a folder, as `_link`."""
    return _link(f"/proc/self/fd/{handle}", name, folder, follow=True)


def _sync(folder: int) -> None:
    """Synchronise the folder, so that a new name survives a power cut, if the file system supports that."""
    try:
        os.fsync(folder)
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise
