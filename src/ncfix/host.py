"""The computer that ncfix runs on: its processors, where it keeps what can be made again, processes that end together,
limits of time and memory.

A process that is killed cannot end others. So those that it starts look after themselves, and none works on, or holds a
pipe open, when the one that started it is gone, whatever ended that one: the kernel of Linux is asked to kill them
(`prctl`), also while they are deep in compiled code; and anywhere a thread waits for the far end of a pipe that closes
then, which multiprocessing keeps for that.
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
    """So many may run this process, whether they are free or not."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def cache_folders(source: str) -> Iterator[Path]:
    """Beside what Python keeps of a module, by its file; then the user's own cache, if there is a home for it.

    They need not be there, nor be such that they can be written to.
    """
    yield Path(source).parent / "__pycache__"
    with suppress(RuntimeError):  # no HOME, and a user whom the system does not know
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "ncfix"


GONE = 1
"""Exit code of a process that ends because the one that started it has."""
PR_SET_PDEATHSIG = 1
"""Linux, `prctl(2)`: the signal that a process gets when the thread that started it ends."""
SIGKILL = 9


def tie() -> None:
    """Tie this process to the one that started it by multiprocessing, whose starting thread waits for it to end."""
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
    """What is done has taken its time: an exception that no handler of errors on the way takes for its own."""


GRACE_S = 10.0
"""A process that was tied to another and does not end its work so long after its time is killed."""


@contextmanager
def limited(seconds: float | None, megabytes: int | None) -> Iterator[None]:
    """Do something in so much time and memory, in the main thread; None: without limit.

    megabytes  of data of this process; with more a `MemoryError` is raised

    Raises `FaultError` NCF030 when the time is over. Where the system has no such limits there are none.
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
    """Kill this process after a time, if it is one that another has started, unless that is taken back."""
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
