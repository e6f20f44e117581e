"""Whether compiled kernels are to be used: the `fast` extra (numba), from a size of task at which it pays.

Loading them takes longer than a small program (see `kernel`). So none is used until someone who knows that there is
much to do says `engage`. `NCFIX_NO_FAST=1` forces the plain way; what comes out is the same.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec

KERNELS = (
    "ncfix.compensate.kernels",
    "ncfix.machine.kernels",
    "ncfix.control.lanes.lane_kernel",
    "ncfix.text.kernels",
    "ncfix.writer.writing_kernels",
)
"""The modules that have kernels: all are compiled when one is asked for, side by side."""
FAILED = "The loops of ncfix[fast] cannot be compiled here; without them it takes two or three times as long."

_engaged = False
_failed = False


def engage(say: Callable[[str], object] = lambda text: None) -> bool:
    """Use compiled kernels from here on, if they are installed and wanted; whether they are.

    The first time they are compiled, which takes a while; `say` is told so before. What failed is not tried again.
    """
    global _engaged
    _engaged = _engaged or (wanted() and not _failed and _ready(say))
    return _engaged


def engaged() -> bool:
    """Whether compiled kernels are in use."""
    return _engaged


def disengage() -> None:
    """Go back to the plain way."""
    global _engaged
    _engaged = False


def _ready(say: Callable[[str], object]) -> bool:
    """Whether numba is installed, and one that kernels can be compiled with; they are ready then."""
    global _failed
    if find_spec("numba") is None:
        return False
    from ncfix.kernel import CompilingError, ready

    try:
        ready([import_module(name).LIBRARY for name in KERNELS], say)
    except CompilingError:
        _failed = True
        say(FAILED)
        return False
    return True


def wanted() -> bool:
    """Whether the environment allows it."""
    return os.environ.get("NCFIX_NO_FAST", "") in ("", "0")
