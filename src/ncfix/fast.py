"""Whether compiled kernels are to be used: the `fast` extra (numba), from a size of task at which it pays.

Loading them takes longer than a small program (see `kernel`). So none is used until someone who knows that there is
much to do says `engage`. `NCFIX_NO_FAST=1` forces the plain way; what comes out is the same.
"""

from __future__ import annotations

import os
from importlib.util import find_spec

_engaged = False


def engage() -> bool:
    """Use compiled kernels from here on, if they are installed and wanted; whether they are."""
    global _engaged
    _engaged = _engaged or (wanted() and _usable())
    return _engaged


def engaged() -> bool:
    """Whether compiled kernels are in use."""
    return _engaged


def disengage() -> None:
    """Go back to the plain way."""
    global _engaged
    _engaged = False


def _usable() -> bool:
    """Whether numba is installed, and one that kernels can be compiled with."""
    if find_spec("numba") is None:
        return False
    from ncfix.kernel import trusted

    return trusted()


def wanted() -> bool:
    """Whether the environment allows it."""
    return os.environ.get("NCFIX_NO_FAST", "") in ("", "0")
