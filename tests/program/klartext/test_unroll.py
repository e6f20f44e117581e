"""Klartext programs written out flat: the same motions, without labels, calls, jumps and formulas."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.compensate import FixOptions
from ncfix.compensate.driver import fix_flat
from ncfix.control.flatten import flatten
from ncfix.diagnostics import RefusedError
from ncfix.text.reader import read
from program.klartext.tnc import KNOWN, THREE, follow, program

STEPS = dict.fromkeys("XYZ", 0.001)


def flat(body: str, files: dict[str, str] | None = None) -> list[str]:
    texts = {name: text.encode() for name, text in (files or {}).items()}
    found = flatten(read(program(body), "t.h"), KNOWN, ("X", "Y", "Z"), frozenset(), STEPS, texts.get)
    assert len(found.lines) == len(found.program.source.decode().splitlines())
    return found.program.source.decode().splitlines()[1:-1]


def test_a_repeated_section_is_written_as_often_as_it_runs() -> None:
    assert flat("L X+1 F100\n10 LBL 1\n11 L IX+2\n12 CALL LBL 1 REP 2/2") == [
        "L X+1 F100",
        "L IX+2",
        "L IX+2",
        "L IX+2",
    ]


def test_formulas_become_numbers() -> None:
    body = "Q1 = 1\nLBL 1\nQ1 = Q1 + 0.5\nL X+Q1 IY-Q1 FQ1\nFN 12: IF +Q1 LT +2 GOTO LBL 1"
    assert flat(body) == [
        "Q1 = 1",
        "Q1 = +1.5",
        "L X+1.5000 IY-1.5000 F1.5",
        "Q1 = +2",
        "L X+2.0000 IY-2.0000 F2",
    ]


def test_called_programs_are_written_in_place() -> None:
    sub = "BEGIN PGM S MM\nL IX+1 F100\nEND PGM S MM"
    assert flat("L X+5 F100\nCALL PGM S\nCALL PGM S", {"S": sub}) == ["L X+5 F100", "L IX+1 F100", "L IX+1 F100"]


def test_cycles_keep_their_parameters_and_their_lines() -> None:
    body = "Q9 = 3\nCYCL DEF 200 D ~\n Q200=+2 ~\n Q201=-Q9 ;DEPTH ~\n Q203=+0 ~\n Q204=+5\nL X+1 FMAX M99"
    assert flat(body)[1:6] == [
        "CYCL DEF 200 D ~",
        "Q200=+2 ~",
        "Q201 = -3 ;DEPTH ~",
        "Q203=+0 ~",
        "Q204=+5",
    ]


def test_what_depends_on_the_machine_cannot_be_written_out() -> None:
    with pytest.raises(RefusedError, match="NCF237"):
        flat("FN 18: SYSREAD Q1 = ID50 NR1\nFN 9: IF +Q1 EQU +1 GOTO LBL 1\nLBL 1\nL X+1")


def test_a_flat_program_is_corrected_where_the_other_is_refused() -> None:
    body = "L X+0 Y+0 Z+0 FMAX\nLBL 1\nL IX+50 F100\nL Y+20\nL Y+0\nCALL LBL 1 REP 3"
    fixed = fix_flat(read(program(body), "t.h"), THREE, KNOWN, FixOptions())
    assert fixed.report.refused == ()
    ends = follow("\n".join(fixed.text.decode().splitlines()[1:-1])).moves.end
    assert np.abs(ends[-1] - [200, 0, 0]).max() < 0.1
    assert b"LBL" not in fixed.text
