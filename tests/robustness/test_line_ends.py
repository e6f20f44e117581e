"""Lines that end with carriage returns alone: read, corrected and written like all others."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from differential import product

RS274 = "G21 G90 G17 G54\nG0 X0 Y0 Z5 (start)\nG1 X200 Y20 F300 ; long\nG2 X220 Y40 J20\nG1 Z1\nM30\n"
PROGRAMS = {
    "linuxcnc": RS274,
    "iso": RS274,
    "fanuc": "%\nO1\n" + RS274.replace(";", "(").replace("long", "long)").replace("5 (", "5. (") + "%\n",
    "siemens": RS274.replace("(start)", "; start").replace("G21", "G71"),
    "heidenhain": "BEGIN PGM A MM\nL X+0 Y+0 Z+5 FMAX ; start\nL X+200 Y+20 F300\nCC X+200 Y+40\n"
    "C X+220 Y+40 DR+\nLP PR+30 PA+0\nCC\nLP PR+5 PA+90\nEND PGM A MM\n",
}


@pytest.mark.parametrize("dialect", PROGRAMS)
@pytest.mark.parametrize("flat", [False, True])
def test_carriage_returns_alone(dialect: str, flat: bool, machine_file: Callable[[str], Path], tmp_path: Path) -> None:
    more = ("--assume-zero", "--dialect", dialect, "--no-point", "calculator", *(["--flatten"] if flat else []))
    texts = []
    for index, end in enumerate(("\n", "\r")):
        folder = tmp_path / str(index)
        folder.mkdir()
        found = product.fix_text(PROGRAMS[dialect].replace("\n", end), machine_file("three"), folder, *more)
        assert found.text is not None, found.errors
        texts.append(found.text)
    assert len(texts[0].splitlines()) > len(PROGRAMS[dialect].splitlines()) + 1
    assert texts[1] == texts[0].replace(b"\n", b"\r")
