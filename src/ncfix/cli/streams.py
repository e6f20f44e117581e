"""Long programs that are corrected while they are read, and written to a pipe part by part."""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import field
from typing import IO, TYPE_CHECKING

from ncfix import files, inputs
from ncfix.cli import console
from ncfix.cli.targets import STREAM, OutputTarget, shown, stdin
from ncfix.diagnostics import Place, RefusedError, SourceError, UsageError
from ncfix.values import frozen, mutable

if TYPE_CHECKING:
    from ncfix.compensate.driver import Stamp
    from ncfix.compensate.report import FixReport
    from ncfix.compensate.workers import OpenFiles
    from ncfix.reports.program_page import ProgramPage


LONG_BYTES = 3 << 20
"""Number of bytes from which on a program is processed in parts, unless `NCFIX_PART_BYTES` is set."""


def part_bytes() -> int:
    """Number of bytes of a part: `NCFIX_PART_BYTES` or the default; the output does not depend on it."""
    from ncfix.compensate.following import PART_BYTES

    text = os.environ.get("NCFIX_PART_BYTES") or str(PART_BYTES)
    if not text.isdecimal() or int(text) < 1:
        raise UsageError.of("NCF001", f"NCFIX_PART_BYTES is {text!r}, not a number of bytes", hint="unset it")
    return int(text)


def long_bytes() -> int:
    """Number of bytes from which on a program is processed in parts."""
    return part_bytes() if os.environ.get("NCFIX_PART_BYTES") else LONG_BYTES


@frozen
class FixedText:
    """A corrected program: the text that is not written yet, whether it differs from the original, and the report.

    dialect  name of the dialect in which it was read
    page     content of its HTML page, if one is wanted
    """

    text: bytes | Iterable[bytes]
    changed: bool
    report: FixReport
    dialect: str
    page: ProgramPage | None = None


@contextmanager
def source_of(path: str) -> Iterator[Source]:
    """Open an input file, or standard input, for reading from its beginning."""
    if path == STREAM:
        with files.unnamed(None) as spool:
            yield Source(path, stdin(), spool)
        return
    try:
        handle = inputs.opened(path)
    except OSError as error:
        raise files.unreadable(shown(path), error) from error
    began = os.fstat(handle.fileno())
    with handle:
        if stat.S_ISREG(began.st_mode):
            yield Source(path, handle, None, began)
            return
        with files.unnamed(None) as spool:
            yield Source(path, handle, spool)


@mutable
class Source:
    """A text that can be read in parts, and again as a whole; text from a pipe is copied to a file, the `spool`.

    began  status of a file when it was opened
    stamp  place of the stamp of a corrected program, if it is in the first lines
    """

    path: str
    handle: IO[bytes]
    spool: IO[bytes] | None
    began: os.stat_result | None = None
    head: bytes = b""
    taken: int = 0
    stamp: Place | None = None

    def files(self, out: int) -> OpenFiles:
        """The file handles that other processes need to read the text and to write to the file `out`."""
        from ncfix.compensate.workers import OpenFiles

        return OpenFiles((self.spool or self.handle).fileno(), self.spool is None, out)

    def check_unchanged(self) -> None:
        """Raise SourceError NCF002 if the file changed since it was opened: its parts may not fit together."""
        began, now = self.began, os.fstat(self.handle.fileno()) if self.began else None
        if began and now and (now.st_size, now.st_mtime_ns) != (began.st_size, began.st_mtime_ns):
            text = "was changed while it was read"
            raise SourceError.of("NCF002", text, Place(shown(self.path)), "run it again when the file is complete")

    def looked_into(self, named: bool = False) -> bool:
        """Read the first bytes, which `read` will return again; returns whether the program is long.

        named  whether the dialect is given: then no more bytes of a pipe are awaited than decide that; otherwise enough
               are read to identify the dialect
        """
        from ncfix.text.dialect import PROBE_BYTES
        from ncfix.text.stamp import SIGN

        many = long_bytes()
        self.head = self._read(many if named and self.spool is not None else max(many, PROBE_BYTES))
        lines = enumerate((line.decode("latin-1") for line in self.head[:PROBE_BYTES].splitlines()), start=1)
        stamps = (Place(shown(self.path), number, 0, line) for number, line in lines if SIGN.search(line))
        self.stamp = next(stamps, None)
        return len(self.head) >= many

    @property
    def first_lines(self) -> bytes:
        """The complete lines among the first bytes, until `read` is called."""
        return self.head[: self.head.rfind(b"\n") + 1]

    @property
    def size(self) -> int | None:
        """Number of bytes of the whole text; None if not known yet."""
        return self.began.st_size if self.began else None

    def read(self, size: int) -> bytes:
        """The next `size` bytes; fewer only at the end."""
        part, self.head = self.head[:size], self.head[size:]
        return part + self._read(size - len(part)) if len(part) < size else part

    def _read(self, size: int) -> bytes:
        try:
            part = self.handle.read(size)
        except OSError as error:
            raise files.unreadable(shown(self.path), error) from error
        if self.spool is not None:
            with files.said_of(None):
                files.put_at(self.spool.fileno(), self.taken, part)
            self.taken += len(part)
            try:
                inputs.check_size(self.taken)
            except OSError as error:
                raise files.unreadable(shown(self.path), error) from error
        return part

    def everything(self) -> bytes:
        """The whole text."""
        if self.spool is None:
            return files.read_bytes(self.path)
        while self._read(files.COPIED):
            pass
        self.spool.seek(0)
        return self.spool.read()


@mutable
class Outlet:
    """Destination of corrected text: a file first, and standard output as soon as the stamp has been written.

    stamped  returns whether the text so far contains the stamp with its final content
    taken    number of bytes so far, of which `sent` were written out; the others are in the file, at their positions
    """

    spool: IO[bytes]
    direct: bool
    stamped: Callable[[], bool]
    taken: int = 0
    sent: int = 0
    digest: hashlib._Hash = field(default_factory=hashlib.sha256)

    def put(self, data: bytes | int) -> None:
        """Take the next part, or its number of bytes if it is already in the file."""
        direct = self.direct and self.stamped()
        if isinstance(data, int):
            self.taken += data
        elif not direct:
            files.put_at(self.spool.fileno(), self.taken, data)
            self.taken += len(data)
        if direct:
            for part in self._unsent():
                self._send(part)
        if direct and isinstance(data, bytes):
            self._send(data)
            self.taken += len(data)

    def _send(self, data: bytes) -> None:
        console.put(data)
        self.sent += len(data)
        self.digest.update(data)

    def _unsent(self) -> Iterator[bytes]:
        at = self.sent
        while part := os.pread(self.spool.fileno(), min(files.COPIED, self.taken - at), at):
            yield part
            at += len(part)

    def remaining(self, stamp: Stamp) -> Iterable[bytes]:
        """The text that has not been sent, with the final stamp."""
        if self.sent:
            return self._unsent()
        spool = files.WholeFile(self.spool)
        return spool if stamp.written == stamp.wanted else StampedText(spool, stamp)

    def after(self, text: bytes, path: str) -> bytes:
        """The rest of a text whose beginning was sent; raises RefusedError NCF013 if what was sent differs."""
        if hashlib.sha256(text[: self.sent]).digest() != self.digest.digest():
            problem = "a later block changes what has already been written to the pipe"
            raise RefusedError.of(
                "NCF013", problem, Place(shown(path)), "give the program as a file, not through a pipe"
            )
        return text[self.sent :]


@frozen
class StampedText:
    """A text with its stamp replaced by the final one."""

    text: Iterable[bytes]
    stamp: Stamp

    def __iter__(self) -> Iterator[bytes]:
        parts, stamp = iter(self.text), self.stamp
        first = next(parts, b"")
        yield first[: stamp.at] + stamp.wanted + first[stamp.at + len(stamp.written) :]
        yield from parts


@contextmanager
def outlet_for(target: OutputTarget, sure: bool, stamped: Callable[[], bool]) -> Iterator[Outlet]:
    """An outlet; `sure`: whether the final content of the stamp is known from the beginning."""
    with room_for(target.file) as spool:
        yield Outlet(spool, target.path == STREAM and sure, stamped)


@contextmanager
def room_for(output: str | None) -> Iterator[IO[bytes]]:
    """A file without a name for a future output, in its folder; None: in the folder for temporary files."""
    folder = None if output is None else os.path.dirname(output) or "."
    with files.said_of(output), files.unnamed(folder) as spool:
        yield spool


@frozen
class HeldOutput:
    """Stores the parts of a long output until all are available; `opened` closes the file."""

    output: str | None
    opened: ExitStack

    def __call__(self, parts: Iterable[bytes]) -> Iterable[bytes]:
        """Store the parts as they come; returns the stored text."""
        return files.WholeFile.of(parts, self.opened.enter_context(room_for(self.output)))
