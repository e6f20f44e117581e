"""Processes that end with the one that started them, whatever ends that one: none works on, and none holds a pipe open.

A process that is killed cannot end others. So those that it starts look after themselves: the kernel of Linux is asked
to kill them (`prctl`), also while they are deep in compiled code; and anywhere a thread waits for the far end of a pipe
that closes when the process that started them is gone, which multiprocessing keeps for that, or asks now and then who
that process is.
"""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from threading import Thread
from time import sleep

GONE = 1
"""Exit code of a process that ends because the one that started it has."""
PR_SET_PDEATHSIG = 1
"""Linux, `prctl(2)`: the signal that a process gets when the thread that started it ends."""
SIGKILL = 9
EVERY_S = 0.2
"""How often is asked who started a process, where there is no pipe."""


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


def tie_to(parent: int) -> None:
    """Tie this process to the one with this number, which has started it in whatever way."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(EVERY_S)
        os._exit(GONE)

    Thread(target=watch, daemon=True).start()
