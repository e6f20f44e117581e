"""Several processes that correct one program: each corrects parts of its own, and knows what the others leave behind.

Parts are taken in turn. What a part leaves in the control (`PartCheckpoint`) is told to all as soon as it has been
followed; only where that is more than can be told, the others read and follow it, too. What it leaves to the motions
behind it (`PrecedingMotion`) is handed on as soon as its text is there, so that the next one can be written, too,
while it is still being proved. Texts do not go from one process to another: each reads the program from its file, and
puts what it has corrected where it belongs (`Ground`); the first process counts, and hands out what comes through a
pipe.

Each process has a line to each of the others. Nobody waits for a process that is gone: its lines end (`Post`), also in
the middle of a message, and who listens there gets `GoneError`; and when the first process leaves the work, whatever
the reason, all others are ended; and they end by themselves if it is killed.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import combinations
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from ncfix.compensate.solve import PrecedingMotion
from ncfix.control.trace import Checkpoint
from ncfix.host import tie
from ncfix.plugins import blamed

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    Lines = Mapping[tuple[int, int], Connection]
    """The end of each line that one process has to another: (one, other)."""


class GoneError(Exception):
    """A process that worked on the program has ended before its time."""


@dataclass(slots=True)
class Post:
    """What a process sends to the others, and what it has received from them.

    mine    its own number
    lines   to the others, by their numbers
    received  by the kind of a message and the number it has, mostly that of a part
    unsent  messages on their way: nobody who tells something waits until another one listens
    """

    mine: int = 0
    lines: Mapping[int, Connection] = field(default_factory=dict)
    received: dict[tuple[str, int], Any] = field(default_factory=dict)
    unsent: SimpleQueue[tuple[int, bytes] | None] = field(default_factory=SimpleQueue)

    def tell(self, kind: str, number: int, what: Any, to: int | None = None) -> None:
        """Tell something to one process, or to all others; what cannot be packed raises here, and is not lost later."""
        if to == self.mine:
            self.received[kind, number] = what
        elif self.lines:
            data = pickle.dumps((kind, number, what))
            for each in self.lines if to is None else (to,):
                self.unsent.put((each, data))

    def listen(self, seconds: float | None = None) -> bool:
        """Hear what there is, or wait for something; whether there was. Raises `GoneError`."""
        if not self.lines:
            assert seconds is not None, "there is nobody who could say it"
            return False
        from multiprocessing.connection import wait

        talking: list[Any] = wait(self.lines.values(), seconds)
        for line in talking:
            try:
                kind, number, what = pickle.loads(line.recv_bytes())
            except (EOFError, OSError):
                raise GoneError("a process that worked on the program has ended") from None
            self.received[kind, number] = what
        return bool(talking)

    def waited_for(self, kind: str, number: int) -> Any:
        """A message, as soon as it is there, once. Raises `GoneError`."""
        while (kind, number) not in self.received:
            self.listen()
        return self.received.pop((kind, number))

    @contextmanager
    def opened(self, failed: Callable[[], object]) -> Iterator[Post]:
        """Sends what is told; `failed` is called where that cannot be done, as for want of memory."""
        sender = Thread(target=self._send, args=(failed,), daemon=True)
        sender.start()
        try:
            yield self
        finally:
            self.unsent.put(None)
            sender.join()
            for line in self.lines.values():
                line.close()

    def _send(self, failed: Callable[[], object]) -> None:
        try:
            while message := self.unsent.get():
                to, data = message
                self.lines[to].send_bytes(data)
        except Exception:
            failed()


def lines_between(count: int, context: Any) -> Lines:
    """Lines between so many processes."""
    lines = {}
    for one, other in combinations(range(count), 2):
        lines[one, other], lines[other, one] = context.Pipe()
    return lines


def own_lines(lines: Lines, mine: int) -> dict[int, Connection]:
    """The lines of a process; those of others are closed in it: they would not end with their owner."""
    for (owner, _), line in lines.items():
        if owner != mine:
            line.close()
    return {other: line for (owner, other), line in lines.items() if owner == mine}


@dataclass(frozen=True, slots=True)
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

    def placed(self, file: int, at: int) -> Any:
        """The same with the text put into a file, from a byte on; instead of it there is how long it is."""


@dataclass(frozen=True, slots=True)
class Ground:
    """Files that all processes have open.

    text   the one that is corrected, or what of it has been read so far
    whole  all of it is there from the beginning
    out    the one into which corrected text goes
    """

    text: int
    whole: bool
    out: int


@dataclass(slots=True)
class Share:
    """What of a program a process does: of every `jobs` parts the one with the number `mine`.

    begin  bytes of the corrected text before the part that it works on
    """

    jobs: int = 1
    post: Post = field(default_factory=Post)
    begin: int = 0

    def has(self, number: int) -> bool:
        """Whether a part is its own."""
        return number % self.jobs == self.post.mine

    def shares(self, number: int) -> bool:
        """Whether a part is its own, and others want to know of it."""
        return self.jobs > 1 and self.has(number)

    def announce(self, number: int, checkpoint: PartCheckpoint | None) -> None:
        """Tell the others what an own part leaves in the control; None: they have to follow it themselves."""
        self.post.tell("checkpoint", number, checkpoint)

    def checkpoint(self, number: int) -> PartCheckpoint | None:
        """What a part of another process leaves in the control; None: it has to be followed. Waits for it."""
        received, owner = self.post.received, number % self.jobs
        received.pop(("checkpoint", number - 1), None)
        if self.has(number):
            return None
        while ("checkpoint", number) not in received and ("silent", owner) not in received:
            self.post.listen()
        found: PartCheckpoint | None = received.get(("checkpoint", number))
        return found

    def before(self, number: int) -> PrecedingMotion | None:
        """What the part before that one has left, as soon as it is known; None for the first part.

        Raises what kept another process from finding it out.
        """
        if number == 0:
            return None
        found: tuple[PrecedingMotion, int] | Exception = self.post.waited_for("before", number)
        if isinstance(found, Exception):
            raise found
        before, self.begin = found
        return before

    def leave(self, number: int, before: PrecedingMotion, size: int) -> None:
        """Hand on what an own part leaves, which has become a text of so many bytes."""
        self._hand_on(number, (before, self.begin + size))

    def fail(self, number: int, error: Exception) -> None:
        """Let the others know why there is no more to come, from an own part on."""
        self.post.tell("done", number, error, 0)
        self._hand_on(number, error)
        self.post.tell("silent", self.post.mine, None)

    def _hand_on(self, number: int, what: Any) -> None:
        self.post.tell("before", number + 1, what, (number + 1) % self.jobs)


@dataclass(slots=True)
class ReadAhead:
    """Reads a text in pieces of just the size that is wanted, and so many pieces ahead; the last one may be shorter."""

    source: Read
    pieces: int = 0
    kept: bytes = b""
    ended: bool = False

    def __call__(self, size: int) -> bytes:
        """The next bytes."""
        while not self.ended and len(self.kept) < (1 + self.pieces) * size:
            text = self.source(size)
            self.ended = not text
            self.kept += text
        text, self.kept = self.kept[:size], self.kept[size:]
        return text


@dataclass(slots=True)
class BackgroundReader:
    """Reads a text beside the first process, from the file where it stands.

    file   that file
    whole  all of it is there; if not, the first process tells how much is
    known  so many bytes are, and `pieces` have been told of
    """

    file: int
    whole: bool
    post: Post
    at: int = 0
    known: int = 0
    pieces: int = 0

    def __call__(self, size: int) -> bytes:
        """The next bytes."""
        while not self.whole and self.known < self.at + size:
            new = self.post.waited_for("text", self.pieces)
            self.known, self.pieces, self.whole = self.known + new, self.pieces + 1, not new
        text = os.pread(self.file, size, self.at)
        self.at += len(text)
        return text


class Worker(Protocol[Made]):
    """Corrects the parts of a share."""

    def work(self, share: Share) -> Iterator[tuple[int, Made]]:
        """The number of each own part, and what has been done to it."""


@dataclass(slots=True)
class WorkerPool(Generic[Result]):
    """This process and those beside it, and what they have done.

    given  how many parts have been given back
    """

    share: Share
    ground: Ground | None = None
    given: int = 0

    def spread(self, read: Read) -> Read:
        """A way to read that lets the others know what is there, and so much ahead that they need not wait for it."""
        if self.ground is None or self.ground.whole:
            return read
        pieces = 0

        def spreading(size: int) -> bytes:
            nonlocal pieces
            text = read(size)
            self.share.post.tell("text", pieces, len(text))
            pieces += 1
            return text

        return ReadAhead(spreading, self.share.jobs - 1)

    def put(self, number: int, result: Result) -> None:
        """Note what this process has done."""
        self.share.post.received["done", number] = result

    def ready(self) -> Iterator[Result]:
        """What has been done, in order, as far as it is there."""
        while self.share.post.listen(0):
            pass
        while ("done", self.given) in self.share.post.received:
            yield self._next()

    def rest(self, count: int) -> Iterator[Result]:
        """What is left of so many parts, in order; waits for it."""
        while self.given < count:
            yield self._next()

    def _next(self) -> Result:
        result: Result | Exception = self.share.post.waited_for("done", self.given)
        if isinstance(result, Exception):
            raise result
        self.given += 1
        return result


@contextmanager
def worker_pool(jobs: int, worker: Callable[[Read], Worker[Made]], ground: Ground | None) -> Iterator[WorkerPool[Made]]:
    """Those who work on a program: `jobs` processes, of which this is one.

    worker  makes what corrects a text in another process
    ground  the files; without them, and where processes cannot be forked, this one works alone
    """
    if jobs <= 1 or ground is None or not FORKS:
        yield WorkerPool(Share())
        return
    from multiprocessing import get_context

    context = get_context("fork")
    lines = lines_between(jobs, context)
    processes = [
        context.Process(target=_work, args=(worker, ground, jobs, mine, lines), daemon=True) for mine in range(1, jobs)
    ]

    def end() -> None:
        for process in processes:
            if process.pid is not None:
                process.terminate()

    try:
        for process in processes:
            process.start()
        with Post(0, own_lines(lines, 0)).opened(end) as post:
            try:
                yield WorkerPool(Share(jobs, post), ground)
            finally:
                end()
    finally:
        end()
        for process in processes:
            if process.pid is not None:
                process.join()


def _work(worker: Callable[[Read], Worker[Any]], ground: Ground, jobs: int, mine: int, lines: Any) -> None:
    """What another process does; it ends when the first one has all it needs, or is gone."""
    tie()
    with Post(mine, own_lines(lines, mine)).opened(lambda: os._exit(1)) as post, suppress(GoneError, KeyboardInterrupt):
        share, number = Share(jobs, post), mine
        try:
            for number, done in worker(BackgroundReader(ground.text, ground.whole, post)).work(share):
                post.tell("done", number, done.placed(ground.out, share.begin), 0)
                number += jobs
        except GoneError:
            raise
        except Exception as error:
            share.fail(number, _portable(blamed(error) or error))
        while True:
            post.listen()


def _portable(error: Exception) -> Exception:
    """The error, or its text where it cannot go from one process to another."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
