"""The program for the hidden-effect benchmark without starting Python anew for every question.

    python -m tests.hidden --callable tests.diagnose.resident:resident

gives the answers of `--command ncfix`, and its processor times less what a start takes (half a second).
"""

from __future__ import annotations

import io
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass

from tests.hidden.candidate import Program

from ncfix.cli.main import run


@dataclass(frozen=True, slots=True)
class Resident(Program):
    """`ncfix` as a command line in this process."""

    def _run(self, *arguments: str) -> str:
        out, err = io.StringIO(), io.StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            code = run(arguments)
        if code not in (0, 1):
            raise RuntimeError(f"exit code {code}: {err.getvalue().strip()[-400:]}")
        return out.getvalue()


def resident() -> Resident:
    """What `--callable` asks for."""
    return Resident()
