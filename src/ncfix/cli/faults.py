"""Bugs, owned up to: never dressed as the user's mistakes."""

from __future__ import annotations

import os

from ncfix.diagnostics import FaultError


def fault(error: Exception) -> FaultError:
    """Own up to a bug."""
    import traceback

    where = traceback.extract_tb(error.__traceback__)[-1]
    at = f"{os.path.basename(where.filename)}:{where.lineno}"
    text = f"this is a fault of ncfix: {type(error).__name__}: {error} ({at})"
    return FaultError.of("NCF000", text, hint="ncfix --debug shows the traceback; please report it with the input")
