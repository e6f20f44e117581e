"""The computer ncfix runs on: processors, cache folders, child processes that end with their parent, limits of time and
memory.

A killed process cannot end its children. So each child watches its parent, and neither continues nor keeps a pipe open
after the parent is gone, for whatever reason. On Linux the kernel is asked to kill it (`prctl`), which also works
during compiled code; on all systems a thread waits for a pipe of multiprocessing that closes when the parent ends.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Thread, Timer, current_thread, main_thread

from ncfix.diagnostics import FaultError


def processors() -> int:
    """Number of processors that this process may use, busy or not."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def cache_folders(source: str) -> Iterator[Path]:
    """Folders for data that can be recomputed: beside a module's compiled file, then the user's cache, if any.

    They need not exist or be writable.
    """
    yield Path(source).parent / "__pycache__"
    with suppress(RuntimeError):  # no HOME, and a user whom the system does not know
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ncfix"


GONE = 1
"""Exit code of a process that ends because its parent has ended."""
PR_SET_PDEATHSIG = 1
"""Linux, `prctl(2)`: set the signal that a process gets when its parent thread ends."""
SIGKILL = 9


def tie() -> None:
    """Make this process, if multiprocessing started it, end with its parent; the thread that started it must wait."""
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is None:
        return
    if sys.platform == "linux":
        with suppress(ImportError, OSError, AttributeError):
            import ctypes

            ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0)

    def watch() -> None:
        parent.join()
        os._exit(GONE)

    Thread(target=watch, daemon=True).start()


class TimeIsUpError(BaseException):
    """The time limit is over. Not an `Exception`, so that handlers of errors on the way do not catch it."""


GRACE_S = 10.0
"""Time, s, after its limit at which a child process that has not ended is killed."""


@contextmanager
def limited(seconds: float | None, megabytes: int | None) -> Iterator[None]:
    """Context with limits of time and memory, in the main thread; None: no limit.

    megabytes  size of this process's data; beyond it a `MemoryError` is raised

    Raises `FaultError` NCF030 when the time is over. On systems without such limits there are none.
    """
    with _in_memory(megabytes), _in_time(seconds):
        yield


@contextmanager
def _in_time(seconds: float | None) -> Iterator[None]:
    import signal

    if seconds is None or not hasattr(signal, "setitimer") or current_thread() is not main_thread():
        yield
        return

    def is_up(number: int, frame: object) -> None:
        raise TimeIsUpError

    before = signal.signal(signal.SIGALRM, is_up)
    backstop = _backstop(seconds + GRACE_S)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    except TimeIsUpError:
        text = f"took more than {seconds:g} s, its limit"
        raise FaultError.of("NCF030", text, hint="--time-limit-s gives it more") from None
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
        backstop.cancel()


def _backstop(seconds: float) -> Timer:
    """Start a timer that kills this process, if it is a child process; cancelling the timer prevents it."""
    from multiprocessing import parent_process

    timer = Timer(seconds, (lambda: os._exit(GONE)) if parent_process() else lambda: None)
    timer.daemon = True
    timer.start()
    return timer


@contextmanager
def _in_memory(megabytes: int | None) -> Iterator[None]:
    try:
        import resource
    except ImportError:  # Windows
        megabytes = None
    if megabytes is None:
        yield
        return
    before = resource.getrlimit(resource.RLIMIT_DATA)
    least = megabytes << 20
    resource.setrlimit(resource.RLIMIT_DATA, (least if before[1] < 0 else min(least, before[1]), before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)
