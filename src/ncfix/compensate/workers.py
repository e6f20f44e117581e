"""Several processes correct one program: each its own parts, and each knows what the others leave behind.

Process k of n corrects the parts k, n + k, 2n + k and so on. It reads the whole text, but of the parts between it only
needs two things, which their processes send it:

- `PartCheckpoint`: the state of the control behind a part, as soon as that has been followed. Where the state cannot be
  sent, the others read and follow that part themselves;
- `PrecedingMotion`: the last motion of a part as it was written, as soon as that is known. The process of the next part
  can write then, while this one is still being proved.

Corrected text is not sent: each process writes it into the output file, where it belongs (`OpenFiles`). The first
process counts the parts, and reads the program for all of them if it comes through a pipe.

Every two processes have a connection. When a process dies, its connections end, and whoever waits at one gets
`WorkerGoneError`. When the first process leaves the work, for whatever reason, it ends all others; if it is killed,
they end by themselves.
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
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from ncfix.compensate.solve import PrecedingMotion
from ncfix.control.trace import Checkpoint
from ncfix.host import tie
from ncfix.plugins import blamed
from ncfix.values import frozen, mutable

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    Connections = Mapping[tuple[int, int], Connection]
    """The end of each connection that one process has to another: (one, other)."""


class WorkerGoneError(Exception):
    """A process that worked on the program has ended before its time."""


@mutable
class Mailbox:
    """The messages of one process to the others, and theirs to it.

    process      its own number
    connections  to the others, by their numbers
    received     by the kind of a message and its number, mostly that of a part
    unsent       on their way: a thread sends them, so that `send` never waits for the one who receives
    """

    process: int = 0
    connections: Mapping[int, Connection] = field(default_factory=dict)
    received: dict[tuple[str, int], Any] = field(default_factory=dict)
    unsent: SimpleQueue[tuple[int, bytes] | None] = field(default_factory=SimpleQueue)

    def send(self, kind: str, number: int, what: Any, to: int | None = None) -> None:
        """Send something to one process, or to all others. Raises here, not in the thread, if it cannot be pickled."""
        if to == self.process:
            self.received[kind, number] = what
        elif self.connections:
            data = pickle.dumps((kind, number, what))
            for each in self.connections if to is None else (to,):
                self.unsent.put((each, data))

    def receive(self, seconds: float | None = None) -> bool:
        """Take in what has come, or wait so long for something; whether there was any. Raises `WorkerGoneError`."""
        if not self.connections:
            assert seconds is not None, "no other process could send it"
            return False
        from multiprocessing.connection import wait

        ready: list[Any] = wait(self.connections.values(), seconds)
        for connection in ready:
            try:
                kind, number, what = pickle.loads(connection.recv_bytes())
            except (EOFError, OSError):
                raise WorkerGoneError("a process that worked on the program has ended") from None
            self.received[kind, number] = what
        return bool(ready)

    def wait_for(self, kind: str, number: int) -> Any:
        """Wait for a message and take it out. Raises `WorkerGoneError`."""
        while (kind, number) not in self.received:
            self.receive()
        return self.received.pop((kind, number))

    @contextmanager
    def sending(self, failed: Callable[[], object]) -> Iterator[Mailbox]:
        """Run the thread that sends; it calls `failed` where it cannot, as for want of memory."""
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
        except Exception:
            failed()


def connections_between(count: int, context: Any) -> Connections:
    """Connections between so many processes."""
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
    """A part that left little behind: only its last block has still to be read and followed.

    size     bytes of the part
    begin    where its last block begins
    lines    that end before that, and `blocks` that stand there
    tcp      the tip was under control (TCP) somewhere in it
    control  what the control was like there
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
"""Whether a process can be forked: not with Windows, and not in safety with the libraries of macOS."""
Read = Callable[[int], bytes]
"""Gives the next so many bytes of a text, just as many but at its end."""


class PartResult(Protocol):
    """What has been done to a part."""

    def written_into(self, file: int, at: int) -> Any:
        """Put the text into a file, from a byte on; the result with how long it is instead of it."""


@frozen
class OpenFiles:
    """Files that all processes have open.

    text   the one that is corrected, or what of it has been read so far
    whole  all of it is there from the beginning
    out    the one into which corrected text goes
    """

    text: int
    whole: bool
    out: int


@mutable
class WorkShare:
    """The parts of a program that one process corrects: of every `jobs` parts one.

    begin  bytes of the corrected text before the part that it works on
    """

    jobs: int = 1
    mailbox: Mailbox = field(default_factory=Mailbox)
    begin: int = 0

    def has(self, number: int) -> bool:
        """Whether a part is its own."""
        return number % self.jobs == self.mailbox.process

    def shares(self, number: int) -> bool:
        """Whether a part is its own, and others want to know of it."""
        return self.jobs > 1 and self.has(number)

    def announce(self, number: int, checkpoint: PartCheckpoint | None) -> None:
        """Tell the others what an own part leaves in the control; None: they have to follow it themselves."""
        self.mailbox.send("checkpoint", number, checkpoint)

    def checkpoint(self, number: int) -> PartCheckpoint | None:
        """What a part of another process leaves in the control; None: it has to be followed. Waits for it."""
        received, owner = self.mailbox.received, number % self.jobs
        received.pop(("checkpoint", number - 1), None)
        if self.has(number):
            return None
        while ("checkpoint", number) not in received and ("silent", owner) not in received:
            self.mailbox.receive()
        return received.get(("checkpoint", number))

    def before(self, number: int) -> PrecedingMotion | None:
        """What the part before that one has left, as soon as it is known; None for the first part.

        Raises what kept another process from finding it out.
        """
        if number == 0:
            return None
        found: tuple[PrecedingMotion, int] | Exception = self.mailbox.wait_for("before", number)
        if isinstance(found, Exception):
            raise found
        before, self.begin = found
        return before

    def leave(self, number: int, before: PrecedingMotion, size: int) -> None:
        """Hand on what an own part leaves, which has become a text of so many bytes."""
        self._hand_on(number, (before, self.begin + size))

    def fail(self, number: int, error: Exception) -> None:
        """Let the others know why there is no more to come, from an own part on."""
        self.mailbox.send("done", number, error, 0)
        self._hand_on(number, error)
        self.mailbox.send("silent", self.mailbox.process, None)

    def _hand_on(self, number: int, what: Any) -> None:
        self.mailbox.send("before", number + 1, what, (number + 1) % self.jobs)


@mutable
class ReadAhead:
    """Reads a text in pieces of just the size that is wanted, and so many pieces ahead; the last one may be shorter."""

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
    """Reads a text beside the first process, from the file where it stands.

    file   that file
    whole  all of it is there; if not, the first process tells how much is
    known  so many bytes are, and `pieces` have been told of
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
        """The number of each own part, and what has been done to it."""


@mutable
class WorkerPool(Generic[Result]):
    """This process and those beside it, and what they have done.

    given  how many parts have been given back
    """

    share: WorkShare
    files: OpenFiles | None = None
    given: int = 0

    def spread(self, read: Read) -> Read:
        """A way to read that lets the others know what is there, and so much ahead that they need not wait for it."""
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
        """Note what this process has done."""
        self.share.mailbox.received["done", number] = result

    def ready(self) -> Iterator[Result]:
        """What has been done, in order, as far as it is there."""
        while self.share.mailbox.receive(0):
            pass
        while ("done", self.given) in self.share.mailbox.received:
            yield self._next()

    def rest(self, count: int) -> Iterator[Result]:
        """What is left of so many parts, in order; waits for it."""
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
    """The processes that work on a program: `jobs` processes, of which this is one.

    worker  makes what corrects a text in another process
    files   all that processes share; without them, and where processes cannot be forked, this one works alone
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
    """What another process does; it ends when the first one has all it needs, or is gone."""
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
    """The error, or its text where it cannot go from one process to another."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
