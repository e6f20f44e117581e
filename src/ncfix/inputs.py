"""Inputs opened and read without surprise: what has no end is refused, and nobody is waited for who does not come.

Ordinary files are read, and pipes: standard input, those that a shell makes for `<(...)`, and those with a name as soon
as somebody writes into them. A device has no end that is worth waiting for, but for the one that is always empty. What
is read as a whole, and what comes through a pipe, may have so many bytes; a file that is read in parts any number.
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

MOST = 1 << 30
"""Bytes of a program or a measurement that is read as a whole, or comes through a pipe: some ten million blocks."""
MOST_SAID = 1 << 26
"""Bytes of what people write: machine files, set-ups, tool tables."""
AT_ONCE = 1 << 20
"""Bytes of a pipe that are read at once."""
WAIT_S = 5.0
"""How long somebody is waited for who opens the other end of a pipe with a name."""
OWN = ("/dev/stdin", "/dev/fd/", "/proc/self/fd/")
"""How the paths of files begin that this process has open."""


def opened(path: str) -> IO[bytes]:
    """A file, open to be read. Raises OSError, in the words of the system or in plain ones."""
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
    """Raise OSError if an open file is a device that nobody sits at, or the like.

    own  it may be the terminal at which this process was started
    """
    try:
        number = handle.fileno()
    except OSError:  # something that is no file, in a test
        return
    _check(os.fstat(number), own and os.isatty(number))


def content(handle: IO[bytes], most: int = MOST) -> bytes:
    """All that is left of an open file. Raises OSError if that is more than `most` bytes."""
    size = AT_ONCE
    if (known := _size(handle)) is not None:
        check_size(known, most)
        size = max(size, known + 1)
    parts, count = [], 0
    while part := handle.read(size):
        parts.append(part)
        count += len(part)
        check_size(count, most)
    return parts[0] if len(parts) == 1 else b"".join(parts)


def check_size(count: int, most: int = MOST) -> None:
    """Raise OSError if something has more than so many bytes."""
    if count > most:
        raise OSError(errno.EFBIG, f"it has more than {most >> 20} MB")


def taken(path: str, most: int = MOST) -> bytes:
    """The content of a file. Raises OSError, in the words of the system or in plain ones."""
    with opened(path) as handle:
        return content(handle, most)


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


def _size(handle: IO[bytes]) -> int | None:
    """Bytes of an ordinary file; None of anything else."""
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
    """A pipe with a name, open as soon as somebody writes into it; raises OSError if nobody does."""
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
        raise OSError(errno.ENXIO, "it is a pipe, and nobody writes into it")
    return result
