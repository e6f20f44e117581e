"""Every code that the compensation floor uses is explained."""

from __future__ import annotations

import re
from pathlib import Path

import ncfix.compensate
from ncfix.compensate.codes import CODES

OWN = r"NCF(?:4|28)\d+"


def test_every_code_in_the_source_is_explained_and_every_explanation_is_used() -> None:
    folder = Path(next(iter(ncfix.compensate.__path__)))
    sources = {path.name: path.read_text(encoding="utf-8") for path in folder.rglob("*.py")}
    used = {code for name, text in sources.items() if name != "codes.py" for code in re.findall(OWN, text)}
    assert used == set(CODES)


def test_explanations_are_sentences() -> None:
    for code, entry in CODES.items():
        assert re.fullmatch(OWN, code)
        assert entry.title[0].islower()
        assert entry.text.endswith(".")
        assert entry.hint.endswith(".")
