"""How many processors there are for this process."""

from __future__ import annotations

import os


def processors() -> int:
    """So many may run this process, whether they are free or not."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
