"""Opens and reads inputs safely: endless inputs are refused, and pipes without a writer are not waited for.

Accepted are ordinary files and pipes: standard input, those of a shell's `<(...)`, and named pipes as soon as a writer
opens them. Devices are refused, except the null device. Inputs read as a whole, and pipes, are limited in size; files
that are read in parts are not.
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Callable, Iterable
from contextlib import suppress
from threading import Thread
from typing import IO

from ncfix.diagnostics import Place, UsageError

MAX_BYTES = 1 << 30
"""Largest number of bytes of a program or a measurement read as a whole or through a pipe: some ten million blocks."""
MAX_CONFIG_BYTES = 1 << 26
"""Largest number of bytes of files that people write: machine files, setups, tool tables."""
PIPE_CHUNK_BYTES = 1 << 20
"""Number of bytes read from a pipe at once."""
WAIT_S = 5.0
"""Time, s, to wait for a writer of a named pipe."""
OWN = ("/dev/stdin", "/dev/fd/", "/proc/self/fd/")
"""Beginnings of paths that name files which this process has open."""


def opened(path: str) -> IO[bytes]:
    """Open a file for reading. Raises OSError with the words of the system or plain ones."""
    found = os.stat(path)
    own = path.startswith(OWN)
    if stat.S_ISFIFO(found.st_mode) and not own:
        return os.fdopen(_pipe(path), "rb")
    _check(found, own and stat.S_ISCHR(found.st_mode))
    handle = open(path, "rb")  # noqa: SIM115
    try:
        check(handle, own)
    except OSError:
        handle.close()
        raise
    return handle


def check(handle: IO[bytes], own: bool = True) -> None:
    """Raise OSError if an open file is a device or a socket.

    own  whether the terminal of this process is allowed
    """
    try:
        number = handle.fileno()
    except OSError:  # something that is no file, in a test
        return
    _check(os.fstat(number), own and os.isatty(number))


def content(handle: IO[bytes], most: int = MAX_BYTES) -> bytes:
    """The remaining content of an open file. Raises OSError if it is more than `most` bytes."""
    size = PIPE_CHUNK_BYTES
    if (known := _size(handle)) is not None:
        check_size(known, most)
        size = max(size, known + 1)
    parts, count = [], 0
    while part := handle.read(size):
        parts.append(part)
        count += len(part)
        check_size(count, most)
    return parts[0] if len(parts) == 1 else b"".join(parts)


def check_size(count: int, most: int = MAX_BYTES) -> None:
    """Raise OSError if `count` bytes are more than `most`."""
    if count > most:
        raise OSError(errno.EFBIG, f"it has more than {most >> 20} MB")


def content_of(path: str, most: int = MAX_BYTES) -> bytes:
    """The content of a file. Raises OSError with the words of the system or plain ones."""
    with opened(path) as handle:
        return content(handle, most)


FileIdentity = tuple[int, int]
"""Device and inode number, which identify a file under any name."""


def identity(path: str) -> FileIdentity | None:
    """The identity of the file with a name; None if the file does not exist."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return found.st_dev, found.st_ino


def identities(paths: Iterable[str]) -> frozenset[FileIdentity]:
    """The identities of the files with these names."""
    return frozenset(found for found in map(identity, paths) if found is not None)


def each_once(given: Iterable[str], shown: Callable[[str], str] = str) -> None:
    """Refuse a file that is given twice, even under different names: `UsageError` NCF020.

    shown  path -> its name in messages
    """
    seen: set[object] = set()
    for path in given:
        key = identity(path) or path
        if key in seen:
            raise given_twice(shown(path))
        seen.add(key)


def given_twice(path: str) -> UsageError:
    """The error NCF020 for an input that is given twice and would count twice."""
    text = "is given twice, and would count twice"
    return UsageError.of("NCF020", text, Place(path), "give it once")


def _size(handle: IO[bytes]) -> int | None:
    """Number of bytes of an ordinary file; None for anything else."""
    with suppress(OSError):
        found = os.fstat(handle.fileno())
        return found.st_size if stat.S_ISREG(found.st_mode) else None
    return None


def _check(found: os.stat_result, terminal: bool) -> None:
    empty = os.stat(os.devnull).st_rdev
    if stat.S_ISBLK(found.st_mode) or (stat.S_ISCHR(found.st_mode) and not terminal and found.st_rdev != empty):
        raise OSError(errno.ENXIO, "it is a device, not a file")
    if stat.S_ISSOCK(found.st_mode):
        raise OSError(errno.ENXIO, "it is a socket, not a file")


def _pipe(path: str) -> int:
    """Open a named pipe; raises OSError if no writer opens it in time."""
    found: list[int | OSError] = []

    def wait() -> None:
        try:
            found.append(os.open(path, os.O_RDONLY))
        except OSError as error:
            found.append(error)

    waiting = Thread(target=wait, daemon=True)
    waiting.start()
    waiting.join(WAIT_S)
    late = waiting.is_alive()
    if late:
        with suppress(OSError):
            os.close(os.open(path, os.O_WRONLY | os.O_NONBLOCK))  # lets it go on
        waiting.join()
    result = found[0]
    if isinstance(result, OSError):
        raise result
    if late:
        os.close(result)
        raise OSError(errno.ENXIO, "it is a pipe without a writer")
    return result
