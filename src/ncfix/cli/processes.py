"""`--jobs`: how many processes work on what is to be fixed."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import click

from ncfix.cli.targets import STREAM, Target
from ncfix.host import processors

AUTO = 0
"""`--jobs auto` as a number: as many as pay."""
PAYS_BYTES = 8 << 20
"""One process more pays for each so much text: starting it costs a tenth of what correcting this text takes."""
PAYS_PROGRAMS = 8
"""And one for each so many programs besides the first."""
ON_ONE = 8
"""At most so many for a single program: each of them reads all of it."""


class Jobs(click.IntRange):
    """A number of processes, or `auto`."""

    def __init__(self) -> None:
        super().__init__(1)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """Make it the number, or AUTO."""
        number: int = AUTO if value == "auto" else super().convert(value, param, ctx)
        return number


def settled(jobs: int, programs: Sequence[Target]) -> int:
    """How many processes work on these programs: what was asked for, or as many as pay, at most one a processor."""
    if jobs != AUTO:
        return jobs
    pay = sum(map(_size, programs)) / PAYS_BYTES + (len(programs) - 1) / PAYS_PROGRAMS
    return max(1, min(int(pay), processors(), ON_ONE if len(programs) == 1 else len(programs)))


def _size(target: Target) -> int:
    """Bytes of a program; what cannot be told (a pipe, no such file) counts as none."""
    if target.source == STREAM:
        return 0
    try:
        return os.stat(target.source).st_size
    except OSError:
        return 0
