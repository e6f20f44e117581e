"""Bugs, owned up to: never dressed as the user's mistakes."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager

from ncfix.cli import console
from ncfix.diagnostics import FaultError, NcfixError, PluginError
from ncfix.files import unwritable
from ncfix.plugins import blamed

DEBUG = "NCFIX_DEBUG"
"""The environment variable that asks for tracebacks; workers inherit it."""


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""What the system says where there is no room: never a bug."""


def owned(error: Exception) -> NcfixError:
    """An exception as the error that is told: a remedy where there is one, else a fault of ncfix."""
    if isinstance(error, NcfixError):
        if error.__cause__ is not None and isinstance(error, PluginError):
            _trace(error.__cause__)
        return error
    if isinstance(error, OSError) and error.errno in FULL:
        return unwritable(str(error.filename or "<stdout>"), error)
    plugin = blamed(error)
    if plugin is not None:
        _trace(error)
        return plugin
    if isinstance(error, MemoryError):
        hint = "leave out what is not needed, or do it on a computer with more memory"
        return FaultError.of("NCF024", "there is not enough memory for this", hint=hint)
    return fault(error)


def _trace(error: BaseException) -> None:
    """The traceback, if that is asked for."""
    import traceback

    if os.environ.get(DEBUG, "") not in ("", "0"):
        console.say("".join(traceback.format_exception(error)))


def fault(error: Exception) -> FaultError:
    """Own up to a bug, with its traceback if that is asked for."""
    import traceback

    _trace(error)
    where = traceback.extract_tb(error.__traceback__)[-1]
    at = f"{os.path.basename(where.filename)}:{where.lineno}"
    text = f"this is a fault of ncfix: {type(error).__name__}: {error} ({at})"
    return FaultError.of("NCF000", text, hint="ncfix --debug shows the traceback; please report it with the input")


@contextmanager
def debugging(wanted: bool) -> Iterator[None]:
    """Tracebacks are asked for, as by the environment variable."""
    before = os.environ.get(DEBUG)
    if wanted:
        os.environ[DEBUG] = "1"
    try:
        yield
    finally:
        if wanted:
            os.environ.pop(DEBUG)
            os.environ.update({} if before is None else {DEBUG: before})
