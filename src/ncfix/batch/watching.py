"""Watches a folder into which programs are copied: which of them are complete, and when to look again.

A program is complete when its size and modification time have not changed for a while: a copy over a network takes
seconds, and nothing else shows its end. Changes are noticed at once where the system reports them (the extra `watch`),
otherwise by polling, as on network shares.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import field
from importlib.util import find_spec
from time import monotonic, sleep

from ncfix.batch.programs import program_files
from ncfix.diagnostics import UsageError
from ncfix.values import mutable

LOOK_S = 1.0
"""Polling interval, s, where the system does not report changes."""
EVENTS_S = 0.2
"""Time, s, within which several changes count as one."""

State = tuple[int, int, int]
"""Size, modification time (ns) and inode of a file, which change when it is rewritten or replaced."""


def state_of(path: str) -> State | None:
    """The state of a file; None if the file does not exist."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns, found.st_ino


@mutable
class WatchedFolder:
    """The programs of a folder, and which of them have been taken.

    folder    the folder, including everything below it
    apart     a folder that is left out: the output folder
    settle_s  time without changes, s, after which a program is complete
    clock     returns the time, s
    taken     path -> state in which the program was taken
    waiting   path -> state of an incomplete program, and since when it has been in that state
    """

    folder: str
    apart: str | None
    settle_s: float
    clock: Callable[[], float] = monotonic
    taken: dict[str, State] = field(default_factory=dict)
    waiting: dict[str, tuple[State, float]] = field(default_factory=dict)

    def complete(self) -> list[str]:
        """Paths of programs that are complete and not yet taken in this state; marks them as taken."""
        now, found = self.clock(), []
        states = {path: state for path in self._paths() if (state := state_of(path)) is not None}
        self.waiting = {path: since for path, since in self.waiting.items() if path in states}
        for path, state in states.items():
            if self.taken.get(path) == state:
                self.waiting.pop(path, None)
            elif path not in self.waiting or self.waiting[path][0] != state:
                self.waiting[path] = (state, now)
            if path in self.waiting and now - self.waiting[path][1] >= self.settle_s:
                self.taken[path] = self.waiting.pop(path)[0]
                found.append(path)
        self.taken = {path: state for path, state in self.taken.items() if path in states}
        return found

    def again(self) -> None:
        """Forget what was taken, because the machine or the setup has changed."""
        self.taken.clear()

    def _paths(self) -> Sequence[str]:
        try:
            return [program.path for program in program_files([self.folder], self.apart)]
        except UsageError as error:
            if error.code == "NCF014":  # none yet
                return []
            raise


def moments(folder: str, others: Sequence[str], settle_s: float, poll_s: float | None) -> Iterator[None]:
    """Yields when the folder should be looked at: at first, after changes, and for a while after them.

    others  further files whose changes count; they need not exist
    poll_s  polling interval; None: as the system reports changes, if it can
    """
    if poll_s is None and find_spec("watchfiles"):
        yield from _told(folder, others, settle_s)
        return
    while True:
        yield None
        sleep(poll_s or min(LOOK_S, settle_s or LOOK_S))


def _told(folder: str, others: Sequence[str], settle_s: float) -> Iterator[None]:
    import watchfiles

    yield None
    every = max(int(1e3 * min(settle_s, LOOK_S)), 50)
    known = [state_of(path) for path in others]
    changes = watchfiles.watch(
        folder,
        watch_filter=None,
        debounce=int(1e3 * EVENTS_S),
        rust_timeout=every,
        yield_on_timeout=True,
        raise_interrupt=True,
        recursive=True,
    )
    quiet_s = 0.0
    for change in changes:
        states = [state_of(path) for path in others]
        quiet_s = quiet_s + every / 1e3 if not change and states == known else 0.0
        known = states
        if quiet_s <= 2 * settle_s + LOOK_S or quiet_s % 60 < every / 1e3:  # once a minute in any case
            yield None
