"""Several processes that correct one program, each its own parts, and the messages between them.

Process k of n corrects the parts k, n + k, 2n + k and so on. It reads the whole text; of the other parts it needs only
two things, which their processes send:

- `PartCheckpoint`: the state of the control behind a part, as soon as the part has been followed. If the state cannot
  be sent, the other processes read and follow that part themselves.
- `PrecedingMotion`: the last motion of a part as written, as soon as it is known. The process of the next part can then
  write, while this part is still being proved.

Corrected text is not sent: each process writes it to its place in the output file (`OpenFiles`). The first process
counts the parts; if the program comes through a pipe, it reads the pipe for all processes.

Each pair of processes has a connection. When a process dies, its connections close, and a process that waits at one
gets `WorkerGoneError`. When the first process leaves the work, for whatever reason, it ends all others; if it is
killed, they end by themselves.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import field
from itertools import combinations
from queue import SimpleQueue
from threading import Thread
from traceback import format_exception
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from ncfix.compensate.solve import PrecedingMotion
from ncfix.control.trace import Checkpoint
from ncfix.diagnostics import NcfixError
from ncfix.host import tie
from ncfix.plugins import blamed
from ncfix.values import frozen, mutable

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    Connections = Mapping[tuple[int, int], Connection]
    """(one, other) -> the end that process `one` has of its connection to process `other`."""


BUG = "bug"
"""The kind of message that says what fault of ncfix has ended a process."""


class WorkerGoneError(Exception):
    """A process that worked on the program has ended unexpectedly."""


@mutable
class Mailbox:
    """The messages that one process exchanges with the others.

    process      the number of this process
    connections  number of another process -> connection to it
    received     (kind, number) -> message; the number is mostly that of a part
    unsent       messages to be sent; a thread sends them, so that `send` never waits for the receiver
    bug          fault of ncfix that has ended this thread
    """

    process: int = 0
    connections: Mapping[int, Connection] = field(default_factory=dict)
    received: dict[tuple[str, int], Any] = field(default_factory=dict)
    unsent: SimpleQueue[tuple[int, bytes] | None] = field(default_factory=SimpleQueue)
    bug: Exception | None = None

    def send(self, kind: str, number: int, what: Any, to: int | None = None) -> None:
        """Send a message to one process, or to all others. Raises here, not in the thread, if it cannot be pickled."""
        if to == self.process:
            self.received[kind, number] = what
        elif self.connections:
            data = pickle.dumps((kind, number, what))
            for each in self.connections if to is None else (to,):
                self.unsent.put((each, data))

    def receive(self, seconds: float | None = None) -> bool:
        """Take in messages that have arrived; without any, wait for one, at most `seconds` (None: without a limit).

        Returns whether there was any. Raises `WorkerGoneError`, and a fault that has ended the thread that sends, here
        or in another process.
        """
        if not self.connections:
            assert seconds is not None, "no other process could send it"
            return False
        from multiprocessing.connection import wait

        ready: list[Any] = wait(self.connections.values(), seconds)
        for connection in ready:
            try:
                kind, number, what = pickle.loads(connection.recv_bytes())
            except (EOFError, OSError):
                raise self.bug or WorkerGoneError("a process that worked on the program has ended") from None
            if kind == BUG:
                raise what
            self.received[kind, number] = what
        return bool(ready)

    def wait_for(self, kind: str, number: int) -> Any:
        """Wait for a message and take it out. Raises `WorkerGoneError`."""
        while (kind, number) not in self.received:
            self.receive()
        return self.received.pop((kind, number))

    @contextmanager
    def sending(self, failed: Callable[[], object]) -> Iterator[Mailbox]:
        """Run the thread that sends; it calls `failed` if it cannot send, for example for lack of memory.

        A fault of ncfix becomes the `bug`, or goes to the first process before that.
        """
        sender = Thread(target=self._send, args=(failed,), daemon=True)
        sender.start()
        try:
            yield self
        finally:
            self.unsent.put(None)
            sender.join()
            for connection in self.connections.values():
                connection.close()

    def _send(self, failed: Callable[[], object]) -> None:
        try:
            while message := self.unsent.get():
                to, data = message
                self.connections[to].send_bytes(data)
        except (OSError, MemoryError):
            failed()
        except Exception as bug:
            self.bug = bug
            with suppress(Exception):
                if self.process:
                    self.connections[0].send_bytes(pickle.dumps((BUG, self.process, _portable(bug))))
            failed()


def connections_between(count: int, context: Any) -> Connections:
    """A connection between each two of `count` processes."""
    connections = {}
    for one, other in combinations(range(count), 2):
        connections[one, other], connections[other, one] = context.Pipe()
    return connections


def own_connections(connections: Connections, process: int) -> dict[int, Connection]:
    """The connections of this process. It closes those of others: an open copy would hide that their process died."""
    for (owner, _), connection in connections.items():
        if owner != process:
            connection.close()
    return {other: connection for (owner, other), connection in connections.items() if owner == process}


@frozen
class PartCheckpoint:
    """The state behind a part of another process, of which only the last block has to be read and followed.

    size     number of bytes of the part
    begin    byte at which its last block begins
    lines    number of lines that end before that byte; `blocks`: number of blocks there
    tcp      whether tool-centre-point control (TCP) was on anywhere in the part
    control  state of the control at that byte
    """

    size: int
    begin: int
    lines: int
    blocks: int
    tcp: bool
    control: Checkpoint


Result = TypeVar("Result")
Made = TypeVar("Made", bound="PartResult", covariant=True)
FORKS = hasattr(os, "fork") and sys.platform != "darwin"
"""Whether processes can be forked: Windows cannot, and the libraries of macOS make it unsafe."""
Read = Callable[[int], bytes]
"""Returns the next `size` bytes of a text; fewer only at its end."""


class PartResult(Protocol):
    """The result for one part."""

    def written_into(self, file: int, at: int) -> Any:
        """Write the text into a file, from byte `at` on; returns the result with the length instead of the text."""


@frozen
class OpenFiles:
    """Descriptors of the files that all processes have open.

    text   the program, or as much of it as has been read so far
    whole  whether all of the program is there from the beginning
    out    the file into which corrected text is written
    """

    text: int
    whole: bool
    out: int


@mutable
class WorkShare:
    """The parts of a program that one process corrects: one of every `jobs` parts.

    begin  byte of the corrected text at which the part in work begins
    """

    jobs: int = 1
    mailbox: Mailbox = field(default_factory=Mailbox)
    begin: int = 0

    def has(self, number: int) -> bool:
        """Whether this process corrects part `number`."""
        return number % self.jobs == self.mailbox.process

    def shares(self, number: int) -> bool:
        """Whether this process corrects part `number`, and there are other processes to be told of it."""
        return self.jobs > 1 and self.has(number)

    def announce(self, number: int, checkpoint: PartCheckpoint | None) -> None:
        """Send the state of the control behind an own part; None: the others have to follow the part themselves."""
        self.mailbox.send("checkpoint", number, checkpoint)

    def checkpoint(self, number: int) -> PartCheckpoint | None:
        """The state of the control behind a part of another process; None: it has to be followed here. Waits for it."""
        received, owner = self.mailbox.received, number % self.jobs
        received.pop(("checkpoint", number - 1), None)
        if self.has(number):
            return None
        while ("checkpoint", number) not in received and ("silent", owner) not in received:
            self.mailbox.receive()
        return received.get(("checkpoint", number))

    def before(self, number: int) -> PrecedingMotion | None:
        """The last motion of the part before part `number`, waiting for it; None for the first part.

        Raises the error that kept another process from finding it.
        """
        if number == 0:
            return None
        message: tuple[PrecedingMotion, int] | Exception = self.mailbox.wait_for("before", number)
        if isinstance(message, Exception):
            raise message
        before, self.begin = message
        return before

    def leave(self, number: int, before: PrecedingMotion, size: int) -> None:
        """Hand on the last motion of an own part, whose corrected text has `size` bytes."""
        self._hand_on(number, (before, self.begin + size))

    def fail(self, number: int, error: Exception) -> None:
        """Tell the others by which error this process stops, from own part `number` on."""
        self.mailbox.send("done", number, error, 0)
        self._hand_on(number, error)
        self.mailbox.send("silent", self.mailbox.process, None)

    def _hand_on(self, number: int, what: Any) -> None:
        self.mailbox.send("before", number + 1, what, (number + 1) % self.jobs)


@mutable
class ReadAhead:
    """Reads a text in pieces of exactly the wanted size (the last may be shorter), and `pieces` more of them ahead."""

    source: Read
    pieces: int = 0
    unread: bytes = b""
    ended: bool = False

    def __call__(self, size: int) -> bytes:
        """The next bytes."""
        while not self.ended and len(self.unread) < (1 + self.pieces) * size:
            text = self.source(size)
            self.ended = not text
            self.unread += text
        text, self.unread = self.unread[:size], self.unread[size:]
        return text


@mutable
class BackgroundReader:
    """Reads the text in a process other than the first, from the file that all have open.

    file    descriptor of that file
    whole   whether all of the text is there; if not, the first process announces each piece that it has read
    known   number of bytes that are there; `pieces`: number of pieces announced so far
    """

    file: int
    whole: bool
    mailbox: Mailbox
    at: int = 0
    known: int = 0
    pieces: int = 0

    def __call__(self, size: int) -> bytes:
        """The next bytes."""
        while not self.whole and self.known < self.at + size:
            new = self.mailbox.wait_for("text", self.pieces)
            self.known, self.pieces, self.whole = self.known + new, self.pieces + 1, not new
        text = os.pread(self.file, size, self.at)
        self.at += len(text)
        return text


class Worker(Protocol[Made]):
    """Corrects the parts of a share."""

    def work(self, share: WorkShare) -> Iterator[tuple[int, Made]]:
        """The number of each own part, and its result."""


@mutable
class WorkerPool(Generic[Result]):
    """The processes that correct a program, seen from the first one, which collects their results in order.

    given  number of results returned so far
    """

    share: WorkShare
    files: OpenFiles | None = None
    given: int = 0

    def spread(self, read: Read) -> Read:
        """The reader for this process. It announces each piece to the others, and reads ahead so that they do not wait.

        This is `read` itself if the others can read the whole file.
        """
        if self.files is None or self.files.whole:
            return read
        pieces = 0

        def spreading(size: int) -> bytes:
            nonlocal pieces
            text = read(size)
            self.share.mailbox.send("text", pieces, len(text))
            pieces += 1
            return text

        return ReadAhead(spreading, self.share.jobs - 1)

    def put(self, number: int, result: Result) -> None:
        """Store a result of this process."""
        self.share.mailbox.received["done", number] = result

    def ready(self) -> Iterator[Result]:
        """The next results, in order, that are there without waiting."""
        while self.share.mailbox.receive(0):
            pass
        while ("done", self.given) in self.share.mailbox.received:
            yield self._next()

    def rest(self, count: int) -> Iterator[Result]:
        """The remaining results of `count` parts, in order; waits for them."""
        while self.given < count:
            yield self._next()

    def _next(self) -> Result:
        result: Result | Exception = self.share.mailbox.wait_for("done", self.given)
        if isinstance(result, Exception):
            raise result
        self.given += 1
        return result


@contextmanager
def worker_pool(
    jobs: int, worker: Callable[[Read], Worker[Made]], files: OpenFiles | None
) -> Iterator[WorkerPool[Made]]:
    """Start `jobs - 1` further processes that work on a program together with this one, and end them at last.

    worker  makes the object that corrects a text in another process
    files   the files that the processes share; without them, or where processes cannot be forked, this one works alone
    """
    if jobs <= 1 or files is None or not FORKS:
        yield WorkerPool(WorkShare())
        return
    from multiprocessing import get_context

    context = get_context("fork")
    connections = connections_between(jobs, context)
    processes = [
        context.Process(target=_work, args=(worker, files, jobs, number, connections), daemon=True)
        for number in range(1, jobs)
    ]

    def end() -> None:
        for process in processes:
            if process.pid is not None:
                process.terminate()

    try:
        for process in processes:
            process.start()
        with Mailbox(0, own_connections(connections, 0)).sending(end) as mailbox:
            try:
                yield WorkerPool(WorkShare(jobs, mailbox), files)
            finally:
                end()
    finally:
        end()
        for process in processes:
            if process.pid is not None:
                process.join()


def _work(worker: Callable[[Read], Worker[Any]], files: OpenFiles, jobs: int, process: int, connections: Any) -> None:
    """The body of another process. It ends when the first process has all results, or is gone."""
    tie()
    with (
        Mailbox(process, own_connections(connections, process)).sending(lambda: os._exit(1)) as mailbox,
        suppress(WorkerGoneError, KeyboardInterrupt),
    ):
        share, number = WorkShare(jobs, mailbox), process
        try:
            for number, done in worker(BackgroundReader(files.text, files.whole, mailbox)).work(share):
                mailbox.send("done", number, done.written_into(files.out, share.begin), 0)
                number += jobs
        except WorkerGoneError:
            raise
        except Exception as error:
            share.fail(number, _portable(blamed(error) or error))
        while True:
            mailbox.receive()


def _portable(error: Exception) -> Exception:
    """The error, of a fault of ncfix with its traceback; a RuntimeError with its text if it cannot be pickled."""
    if not isinstance(error, NcfixError):
        error.add_note(f"In another process:\n{''.join(format_exception(error))}")
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        instead = RuntimeError(f"{type(error).__name__}: {error}")
        for note in getattr(error, "__notes__", ()):
            instead.add_note(note)
        return instead
    return error
