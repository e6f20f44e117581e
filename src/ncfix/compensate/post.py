"""Messages between the processes that work on one program: each has a line to each of the others.

A line ends when the process at its other end is gone, also in the middle of a message.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import combinations
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    Lines = Mapping[tuple[int, int], Connection]
    """The end of each line that one process has to another: (one, other)."""


class GoneError(Exception):
    """A process that worked on the program has ended before its time."""


@dataclass(slots=True)
class Post:
    """What a process sends to the others, and what it has heard from them.

    mine    its own number
    lines   to the others, by their numbers
    heard   by the kind of a message and the number it has, mostly that of a part
    unsent  messages on their way: nobody who tells something waits until another one listens
    """

    mine: int = 0
    lines: Mapping[int, Connection] = field(default_factory=dict)
    heard: dict[tuple[str, int], Any] = field(default_factory=dict)
    unsent: SimpleQueue[tuple[int, bytes] | None] = field(default_factory=SimpleQueue)

    def tell(self, kind: str, number: int, what: Any, to: int | None = None) -> None:
        """Tell something to one process, or to all others; what cannot be packed raises here, and is not lost later."""
        if to == self.mine:
            self.heard[kind, number] = what
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
            self.heard[kind, number] = what
        return bool(talking)

    def waited_for(self, kind: str, number: int) -> Any:
        """A message, as soon as it is there, once. Raises `GoneError`."""
        while (kind, number) not in self.heard:
            self.listen()
        return self.heard.pop((kind, number))

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
