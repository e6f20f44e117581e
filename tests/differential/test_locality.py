"""Only numbers of motion words change, and words and blocks are added: seen without knowing the dialect."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from differential import locality, product, setups
from differential.cases import CASES
from differential.errors import LETTERS, Machine


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.expect == "right"])
def test_nothing_else_changes(
    name: str, machine: Callable[[str], Machine], machine_file: Callable[[str], Path], tmp_path: Path
) -> None:
    case = CASES[name]
    model = machine(case.machine)
    axes = "".join(LETTERS[column] for column in (*model.linear, *model.rotary))
    setup = setups.write(tmp_path, case.controls, axes)
    outcome = product.fix_text(case.source, machine_file(case.machine), tmp_path, "--setup", setup)
    assert outcome.text is not None, outcome.errors
    assert outcome.text != case.source.encode()
    assert locality.complaints(case.source.encode(), outcome.text) == []


@pytest.mark.parametrize(
    ("before", "after", "word"),
    [
        (b"G1 X1 Y2\n", b"G1 X1.001 Y2\n", None),
        (b"G1 X1 Y2\nM5\n", b"G1 X1.001 Y2 Z3\nX4\nM5\n", None),
        (b"N1 G2 X1 I2 M8\n", b"N1 G1 X1\nX2 M8\n", None),
        (b"(hello X1)\nG1 X1\n", b"(hello X2)\nG1 X1\n", "hello"),
        (b"G1 X1 S100\n", b"G1 X1 S101\n", "S10"),
        (b"M3\nG1 X1\nM5\n", b"M5\nG1 X1\nM3\n", "gone"),
        (b"G1 X1\r\nM5\r\n", b"G1 X2\nM5\n", "line end"),
        (b"G92 X1\nG1 X3\n", b"G92 X1.01\nG1 X3\n", "G92"),
        (b"#1=3\nG1 X#1\n", b"#1=4\nG1 X#1\n", "#1=3"),
        (b"T1 M6\nG1 X3\n", b"G1 X3\n", "gone"),
    ],
)
def test_the_check_itself(before: bytes, after: bytes, word: str | None) -> None:
    found = locality.complaints(before, after)
    assert not found if word is None else any(word in text for text in found), found
