"""Several processes that correct one program: each reads and follows all of it, and corrects parts of its own.

Parts are taken in turn. What a part has to know of the one before (`Before`) is handed on as soon as that is written,
so that the next one can be written, too, while it is still being proved. The text comes to the others from the first
process, and what they have done goes back to it.
"""

from __future__ import annotations

import multiprocessing
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.connection import wait
from queue import Empty
from typing import Any, Generic, Protocol, TypeVar

from ncfix import fast
from ncfix.compensate.settle import Before

Result = TypeVar("Result")
Done = TypeVar("Done", covariant=True)
Read = Callable[[int], bytes]
"""Gives the next so many bytes of a text; none at its end."""
PATIENCE = 1.0
"""Seconds after which it is looked whether those who are waited for are still there."""


class GoneError(Exception):
    """A process that worked on the program has ended before its time."""


@dataclass(slots=True)
class Share:
    """What of a program a process does: of every `jobs` parts the one with the number `mine`.

    inbox    what the part before has left, if another process has corrected it
    outbox   where the process hears of it that has the next part
    others   whether the others are still there
    last     what the last part has left, where there are no others
    """

    jobs: int = 1
    mine: int = 0
    inbox: Any = None
    outbox: Any = None
    others: Callable[[], bool] = field(default=lambda: True)
    last: Before | None = None

    def has(self, number: int) -> bool:
        """Whether a part is its own."""
        return number % self.jobs == self.mine

    def before(self, number: int) -> Before | None:
        """What the part before that one has left, as soon as it is known; None for the first part.

        Raises what kept another process from finding it out.
        """
        if number == 0 or self.jobs == 1:
            return self.last
        found: Before | Exception = waited_for(self.inbox, self.others)
        if isinstance(found, Exception):
            raise found
        return found

    def leave(self, before: Before | Exception) -> None:
        """Hand on what an own part leaves, or why that will not be known."""
        if self.jobs > 1:
            self.outbox.put(before)
        elif isinstance(before, Before):
            self.last = before


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
    there: Callable[[], bool] = field(default=lambda: True)
    done: dict[int, Result | Exception] = field(default_factory=dict)
    given: int = 0

    def spread(self, read: Read) -> Read:
        """A way to read that lets the others read the same."""

        def spreading(size: int) -> bytes:
            text = read(size)
            for each in self.texts:
                each.put(text)
            return text

        return spreading if self.texts else read

    def put(self, number: int, result: Result) -> None:
        """Note what this process has done."""
        self.done[number] = result

    def ready(self) -> Iterator[Result]:
        """What has been done, in order, as far as it is there."""
        if self.results is not None:
            while True:
                try:
                    number, result = self.results.get_nowait()
                except Empty:
                    break
                self.done[number] = result
        while self.given in self.done:
            yield self._next()

    def rest(self, count: int) -> Iterator[Result]:
        """What is left of so many parts, in order; waits for it."""
        while self.given < count:
            while self.given not in self.done:
                number, result = waited_for(self.results, self.there)
                self.done[number] = result
            yield self._next()

    def _next(self) -> Result:
        result = self.done.pop(self.given)
        if isinstance(result, Exception):
            raise result
        self.given += 1
        return result


def waited_for(queue: Any, there: Callable[[], bool]) -> Any:
    """What comes out of a queue; raises `GoneError` if those who might put something in are gone."""
    while True:
        try:
            return queue.get(timeout=PATIENCE)
        except Empty:
            if not there():
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
    results = context.Queue()
    shares = [Share(jobs, mine, boxes[mine], boxes[(mine + 1) % jobs]) for mine in range(jobs)]
    processes = [
        context.Process(target=_work, args=(worker, share, text, results, fast.engaged()), daemon=True)
        for share, text in zip(shares[1:], texts, strict=True)
    ]

    def there() -> bool:
        return all(process.is_alive() for process in processes)

    for process in processes:
        process.start()
    shares[0].others = there
    try:
        yield Crew(shares[0], texts, results, there)
    finally:
        for queue in (*boxes, *texts):
            queue.cancel_join_thread()
        for process in processes:
            process.terminate()
            process.join()


def _work(worker: Callable[[Read], Worker[Any]], share: Share, texts: Any, results: Any, compiled: bool) -> None:
    """What another process does; it ends when the first one has all it needs, or is gone."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    if compiled:
        fast.engage()
    share.others, number = parent.is_alive, share.mine
    try:
        for number, result in worker(lambda size: waited_for(texts, parent.is_alive)).work(share):
            results.put((number, result))
            number += share.jobs
    except (KeyboardInterrupt, GoneError):
        return
    except Exception as error:
        results.put((number, _portable(error)))
        share.leave(_portable(error))
    wait([parent.sentinel])


def _portable(error: Exception) -> Exception:
    """The error, or its text where it cannot go from one process to another."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
