"""Several processes that correct one program: each corrects parts of its own, and knows what the others leave behind.

Parts are taken in turn. What a part leaves in the control (`Passage`) is told to all as soon as it has been followed;
only where that is more than can be told, the others read and follow it, too. What it leaves to the motions behind it
(`Before`) is handed on as soon as it is written, so that the next one can be written, too, while it is still being
proved. The text comes to the others from the first process, and what they have done goes back to it.

Nobody waits for a process that is gone: when one ends before its time, whatever kept it, all others are ended, too, and
the first process, when it next waits for something, finds that nothing more can come and raises `GoneError`.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import wait
from queue import Empty
from threading import Thread
from typing import Any, Generic, Protocol, TypeVar

from ncfix import fast
from ncfix.compensate.passage import Passage
from ncfix.compensate.settle import Before

Result = TypeVar("Result")
Done = TypeVar("Done", covariant=True)
Read = Callable[[int], bytes]
"""Gives the next so many bytes of a text; none at its end."""


class GoneError(Exception):
    """A process that worked on the program has ended before its time."""


@dataclass(slots=True)
class Share:
    """What of a program a process does: of every `jobs` parts the one with the number `mine`.

    inbox    what the part before has left, if another process has corrected it
    outbox   where the process hears of it that has the next part
    last     what the last part has left, where there are no others
    news     where this process hears what parts of others leave in the control, `hearers` where each of the others does
    heard    what it has heard of parts, by their numbers
    silent   processes that will not tell any more
    """

    jobs: int = 1
    mine: int = 0
    inbox: Any = None
    outbox: Any = None
    last: Before | None = None
    news: Any = None
    hearers: tuple[Any, ...] = ()
    heard: dict[int, Passage | None] = field(default_factory=dict)
    silent: set[int] = field(default_factory=set)

    def has(self, number: int) -> bool:
        """Whether a part is its own."""
        return number % self.jobs == self.mine

    def shares(self, number: int) -> bool:
        """Whether a part is its own, and others want to know of it."""
        return self.jobs > 1 and self.has(number)

    def announce(self, number: int, passage: Passage | None) -> None:
        """Tell the others what an own part leaves in the control; None: they have to follow it themselves."""
        for each in self.hearers:
            tell(each, (number, passage))

    def fall_silent(self) -> None:
        """Let the others know that nothing more will be told."""
        self.announce(-1 - self.mine, None)

    def passage(self, number: int) -> Passage | None:
        """What a part of another process leaves in the control; None: it has to be followed. Waits for it."""
        owner = number % self.jobs
        while not self.has(number) and number not in self.heard and owner not in self.silent:
            which, found = waited_for(self.news)
            if which < 0:
                self.silent.add(-1 - which)
            else:
                self.heard[which] = found
        self.heard = {which: found for which, found in self.heard.items() if which >= number}
        return self.heard.get(number)

    def before(self, number: int) -> Before | None:
        """What the part before that one has left, as soon as it is known; None for the first part.

        Raises what kept another process from finding it out.
        """
        if number == 0 or self.jobs == 1:
            return self.last
        found: Before | Exception = waited_for(self.inbox)
        if isinstance(found, Exception):
            raise found
        return found

    def leave(self, before: Before | Exception) -> None:
        """Hand on what an own part leaves, or why that will not be known."""
        if self.jobs > 1:
            tell(self.outbox, before)
        elif isinstance(before, Before):
            self.last = before


@dataclass(slots=True)
class Ahead:
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


class Worker(Protocol[Done]):
    """Corrects the parts of a share."""

    def work(self, share: Share) -> Iterator[tuple[int, Done]]:
        """The number of each own part, and what has been done to it."""


@dataclass(slots=True)
class Crew(Generic[Result]):
    """The processes beside this one, and what they have done."""

    share: Share
    texts: list[Any] = field(default_factory=list)
    results: Any = None
    done: dict[int, Result | Exception] = field(default_factory=dict)
    given: int = 0

    def spread(self, read: Read) -> Read:
        """A way to read that lets the others read the same, and so much ahead that they need not wait for it."""

        def spreading(size: int) -> bytes:
            text = read(size)
            for each in self.texts:
                tell(each, text)
            return text

        return Ahead(spreading, len(self.texts)) if self.texts else read

    def put(self, number: int, result: Result) -> None:
        """Note what this process has done."""
        self.done[number] = result

    def ready(self) -> Iterator[Result]:
        """What has been done, in order, as far as it is there."""
        if self.results is not None:
            while True:
                try:
                    number, result = waited_for(self.results, wait=False)
                except Empty:
                    break
                self.done[number] = result
        while self.given in self.done:
            yield self._next()

    def rest(self, count: int) -> Iterator[Result]:
        """What is left of so many parts, in order; waits for it."""
        while self.given < count:
            while self.given not in self.done:
                number, result = waited_for(self.results)
                self.done[number] = result
            yield self._next()

    def _next(self) -> Result:
        result = self.done.pop(self.given)
        if isinstance(result, Exception):
            raise result
        self.given += 1
        return result


def tell(queue: Any, what: Any) -> None:
    """Put something into a queue; what cannot go from one process to another raises here, and is not lost later."""
    queue.put(pickle.dumps(what))


def waited_for(queue: Any, wait: bool = True) -> Any:
    """What comes out of a queue; raises `GoneError` if those who put something in are gone, and `Empty`."""
    try:
        return pickle.loads(queue.get(wait))
    except (EOFError, OSError):
        raise GoneError("a process that worked on the program has ended") from None


@contextmanager
def crew(jobs: int, worker: Callable[[Read], Worker[Result]]) -> Iterator[Crew[Result]]:
    """Those who work on a program: `jobs` processes, of which this is one.

    worker  makes what corrects a text in another process
    """
    if jobs <= 1:
        yield Crew(Share())
        return
    forks = "fork" in multiprocessing.get_all_start_methods()
    context: Any = multiprocessing.get_context("fork" if forks else None)
    boxes, texts = [context.Queue() for _ in range(jobs)], [context.Queue() for _ in range(jobs - 1)]
    results, news = context.Queue(), [context.Queue() for _ in range(jobs)]
    shares = [
        Share(
            *(jobs, mine, boxes[mine], boxes[(mine + 1) % jobs]),
            news=news[mine],
            hearers=tuple(each for each in news if each is not news[mine]),
        )
        for mine in range(jobs)
    ]
    processes = [
        context.Process(target=_work, args=(worker, share, text, results, fast.engaged()), daemon=True)
        for share, text in zip(shares[1:], texts, strict=True)
    ]
    try:
        for process in processes:
            process.start()
        for queue in (results, boxes[0], news[0]):
            queue._writer.close()
        _must_arrive((*boxes, *texts, *news), lambda: _end(processes))
        Thread(target=_end_together, args=(processes,), daemon=True).start()
        yield Crew(shares[0], texts, results)
    finally:
        for queue in (*boxes, *texts, *news):
            queue.cancel_join_thread()
        texts.clear()
        started = [process for process in processes if process.pid is not None]
        _end(started)
        for process in started:
            process.join()


def _end_together(processes: Sequence[Any]) -> None:
    """End all as soon as one has ended: then what they write into ends, too, also in the middle of a message."""
    wait([process.sentinel for process in processes])
    _end(processes)


def _end(processes: Sequence[Any]) -> None:
    for process in processes:
        process.terminate()


def _must_arrive(queues: Sequence[Any], otherwise: Callable[[], object]) -> None:
    """Do something where what was put into queues cannot be sent, as for want of memory: it would just be missing."""
    for queue in queues:
        queue._on_queue_feeder_error = lambda *_: otherwise()


def _end_with(parent: int) -> None:
    """End this process with its parent, whatever it is doing or waiting for."""
    wait([parent])
    os._exit(1)


def _work(worker: Callable[[Read], Worker[Any]], share: Share, texts: Any, results: Any, compiled: bool) -> None:
    """What another process does; it ends when the first one has all it needs, or is gone."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    if compiled:
        fast.engage()
    number, end = share.mine, Thread(target=_end_with, args=(parent.sentinel,), daemon=True)
    end.start()
    _must_arrive((results, share.outbox, *share.hearers), lambda: os._exit(1))
    try:
        for number, result in worker(Ahead(lambda size: waited_for(texts))).work(share):
            tell(results, (number, result))
            number += share.jobs
    except KeyboardInterrupt:
        return
    except Exception as error:
        tell(results, (number, _portable(error)))
        share.leave(_portable(error))
        share.fall_silent()
    end.join()


def _portable(error: Exception) -> Exception:
    """The error, or its text where it cannot go from one process to another."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
