"""Files read and written with care: what is written is whole or not there.

A new file is written beside its target under another name, forced to the disk, and then given its name in one step.
What stands in a file without a name already (`unnamed`) is given one, and not copied, where the system can do that.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from ncfix.diagnostics import Place, SourceError, UsageError

READING = {errno.EACCES: "get the right to read it", errno.EISDIR: "name a file, not a folder"}
WRITING = {
    errno.EACCES: "another -o, or the right to write there",
    errno.EROFS: "another -o",
    errno.ENAMETOOLONG: "a shorter name",
    errno.ENOTDIR: "another -o: a part of this path is a file",
}
"""What to do about what the system says."""
COPIED = 1 << 20
"""Bytes that are copied at once."""


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


def read_bytes(path: str) -> bytes:
    """The content of a file; raises `SourceError` NCF002."""
    try:
        with open(path, "rb") as handle:
            return handle.read()
    except OSError as error:
        raise unreadable(path, error) from error


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


def write_whole(path: str, data: bytes | Iterable[bytes], replace: bool = False) -> None:
    """Write a new file, or with `replace` in place of an existing one, whose mode is kept; NCF004, NCF007 if not."""
    with _coded(path):
        os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
        with _written_beside(path, data, like=path if os.path.lexists(path) else None) as temporary:
            if replace or not _link(temporary, path):
                os.replace(temporary, path)
        _sync_folder(path)


def replace_keeping(path: str, backup: str, data: bytes | Iterable[bytes]) -> None:
    """Give `path` new content and keep the old file as `backup`; at every moment both names hold whole files."""
    with _coded(path):
        with _written_beside(path, data, like=path) as temporary:
            if not _link(path, backup):
                write_whole(backup, Path(path).read_bytes())
            try:
                os.replace(temporary, path)
            except OSError:
                os.unlink(backup)
                raise
        _sync_folder(path)


@contextmanager
def _coded(path: str) -> Iterator[None]:
    try:
        yield
    except FileExistsError as error:
        raise exists_already(str(error.filename2 or path)) from error
    except OSError as error:
        raise unwritable(path, error) from error


@contextmanager
def _written_beside(path: str, data: bytes | Iterable[bytes], like: str | None) -> Iterator[str]:
    """A file with this content, on the disk, in the same folder; gone afterwards if it still has its own name."""
    temporary = os.path.join(os.path.dirname(path), f".ncfix-{os.urandom(8).hex()}.tmp")
    try:
        handle = _filled(temporary, data, like)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
        yield temporary
    finally:
        with suppress(FileNotFoundError):
            os.unlink(temporary)


def _filled(path: str, data: bytes | Iterable[bytes], like: str | None) -> int:
    """A new file with this content, still open."""
    if isinstance(data, Whole):
        _like(data.handle.fileno(), like)
        if _named(data.handle.fileno(), path):
            return os.dup(data.handle.fileno())
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
    try:
        _like(handle, like)
        for part in (data,) if isinstance(data, bytes) else data:
            rest = memoryview(part)
            while rest:
                rest = rest[os.write(handle, rest) :]
    except BaseException:
        os.close(handle)
        raise
    return handle


def _named(handle: int, path: str) -> bool:
    """Give a file without a name this one; False where the system cannot do that."""
    with suppress(OSError):
        folder = os.open(os.path.dirname(path) or ".", os.O_RDONLY)
        try:
            os.link(f"/proc/self/fd/{handle}", path, src_dir_fd=folder)  # without a folder it would not be followed
            return True
        finally:
            os.close(folder)
    return False


def _like(handle: int, like: str | None) -> None:
    """Give a new file the owner and the mode of another."""
    if like is not None:
        before = os.stat(like)
        if (before.st_uid, before.st_gid) != (os.fstat(handle).st_uid, os.fstat(handle).st_gid):
            with suppress(PermissionError):
                os.chown(handle, before.st_uid, before.st_gid)
        os.chmod(handle, stat.S_IMODE(before.st_mode))


def _link(old: str, new: str) -> bool:
    """Give a file a second name, which must be free; False where the file system has no such thing."""
    try:
        os.link(old, new, follow_symlinks=False)
    except FileExistsError:
        raise
    except OSError as error:
        if error.errno in (errno.EPERM, errno.EOPNOTSUPP, errno.ENOSYS, errno.EMLINK):
            return False
        raise
    return True


def _sync_folder(path: str) -> None:
    """Make the new name last through a power cut, where the file system can."""
    handle = os.open(os.path.dirname(path) or ".", os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno != errno.EINVAL:
            raise
    finally:
        os.close(handle)
