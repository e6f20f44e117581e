"""Classes of blocks, and what became of each line of theirs: `ncfix.testing.judging` looks at the lines.

A program that is written out flat has other lines than its source; there the motions are compared one by one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ncfix.compensate.driver import fix_flat
from ncfix.compensate.following import kinematics_of
from ncfix.control.moves import MotionKind, Moves
from ncfix.control.trace import trace
from ncfix.diagnostics import NcfixError
from ncfix.machine import Machine
from ncfix.testing import judging
from ncfix.testing.judging import OPTIONS, SETUP, SHIFT, STEP
from ncfix.text.dialect import get
from ncfix.text.reader import read


@dataclass(frozen=True, slots=True)
class Case:
    """A class of block, a program that has one, and what shall become of its lines.

    expected  line -> "right", "passed" or "refused"; lines not named hold no motion, or lead to the place
    """

    name: str
    text: str
    expected: dict[int, str]
    flat: bool = False


def judged(case: Case, dialect: str) -> dict[int, str]:
    """What became of each line that has a motion: "right", "passed", "refused", or what is wrong."""
    if case.flat:
        return _by_motion(case.text.encode(), dialect)
    found = judging.judged(case.text.splitlines(), get(dialect), judging.shifted_machine())
    return found.lines if found.stopped is None else {found.stopped[0]: "refused"}


def followed(source: bytes, known: Machine, dialect: str) -> Moves:
    """The motions of a text."""
    program = read(source, "part", dialect)
    return trace(program, SETUP, known.axis_names, frozenset(), kinematics=kinematics_of(known)).moves


def _by_motion(source: bytes, dialect: str) -> dict[int, str]:
    """All motions or none, as line 0; nothing if any is refused."""
    known = judging.shifted_machine()
    try:
        fixed = fix_flat(read(source, "part", dialect), known, SETUP, OPTIONS)
    except NcfixError as error:
        place = error.messages[0].place
        return {place.line if place else 0: "refused"}
    if fixed.report.refused:
        return {}
    before, after = followed(source, known, dialect), followed(fixed.text, known, dialect)
    rows, flat = (np.flatnonzero(moves.kind != MotionKind.DWELL) for moves in (before, after))
    if len(rows) != len(flat):
        return {0: f"{len(rows)} motions became {len(flat)}"}
    off = after.end[flat] - before.end[rows] - np.array(list(SHIFT.values()))
    return {0: "right" if np.abs(off).max() <= STEP else f"off by {np.abs(off).max():.4f} mm"}
