"""A folder into which programs come one by one: which of them are complete, and when it is worth looking again.

A program is complete when its size and its time have not changed for a while: a copy over a network writes for
seconds, and nothing else says that it is over. What comes is noticed at once where the system says so (the extra
`watch`), and by looking again and again where it does not, as on shares of other computers.
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
"""How often a folder is looked at where the system says nothing."""
EVENTS_S = 0.2
"""Changes that come within this time are one."""

State = tuple[int, int, int]
"""Size, time of the last change (ns), and number of a file: what tells that it is another one."""


def state_of(path: str) -> State | None:
    """The state of a file; None if there is none."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns, found.st_ino


@mutable
class WatchedFolder:
    """The programs of a folder, and which of them have been taken.

    folder    with all that is below it
    apart     a folder that is left out: that of the outputs
    settle_s  a program that has not changed for so long is complete
    clock     the time, s
    taken     the states in which programs were taken, by their paths
    waiting   the states of those that are not complete, and since when
    """

    folder: str
    apart: str | None
    settle_s: float
    clock: Callable[[], float] = monotonic
    taken: dict[str, State] = field(default_factory=dict)
    waiting: dict[str, tuple[State, float]] = field(default_factory=dict)

    def complete(self) -> list[str]:
        """The paths of programs that are complete and have not been taken in this state; now they have."""
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
        """Forget what has been taken: what programs are corrected for has changed."""
        self.taken.clear()

    def _paths(self) -> Sequence[str]:
        try:
            return [program.path for program in program_files([self.folder], self.apart)]
        except UsageError as error:
            if error.code == "NCF014":  # none yet
                return []
            raise


def moments(folder: str, others: Sequence[str], settle_s: float, poll_s: float | None) -> Iterator[None]:
    """When it is worth looking at a folder: at first, when something has changed, and a while after that.

    others  files whose changes count, too; they need not be there
    poll_s  look so often, whatever the system says; None: as the system says, if it can
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
