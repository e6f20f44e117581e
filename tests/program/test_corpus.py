"""Programs of the world: all that a control accepts can be read, the rest is refused with its line."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import FULL
from ncfix.diagnostics import SourceError
from ncfix.text.reader import read
from program.lanes import assert_read_right

FAMILIES = ("linuxcnc", "iso", "grbl")


@pytest.fixture(scope="module")
def corpus(shared: Callable[[str], Path]) -> list[tuple[Path, str, bool]]:
    """Each program of the families, its family, and whether LinuxCNC's interpreter accepts it."""
    folder = shared("corpus")
    with (folder / "manifest.csv").open(newline="", encoding="utf-8") as manifest:
        rows = [row for row in csv.DictReader(manifest) if row["dialect"] in FAMILIES]
    return [(folder / row["file"], row["dialect"], row["rs274_rc"] == "0") for row in rows]


def test_what_the_control_accepts_can_be_read(
    corpus: list[tuple[Path, str, bool]], capsys: pytest.CaptureFixture[str]
) -> None:
    counts: Counter[tuple[str, str]] = Counter()
    accepted_but_unreadable = []
    for path, family, accepted in corpus:
        try:
            read(path.read_bytes(), path.name)
            counts[family, "readable"] += 1
        except SourceError as error:
            place = error.messages[0].place
            assert place is not None
            assert place.line >= 1
            counts[family, "unreadable"] += 1
            accepted_but_unreadable += [str(error)] * accepted
    with capsys.disabled():
        print(f"\ncorpus: {dict(sorted(counts.items()))}, accepted but unreadable {len(accepted_but_unreadable)}")
    assert not accepted_but_unreadable
    assert len(corpus) > 500


def test_templates_mean_what_the_grammar_says(corpus: list[tuple[Path, str, bool]]) -> None:
    """The first lines of every third program, all of small ones; Lark takes a fraction of a millisecond a line."""
    for path, _, _ in corpus[:: 1 if FULL else 3]:
        source = b"".join(path.read_bytes().splitlines(keepends=True)[:60])
        try:
            program = read(source, path.name)
        except SourceError:
            continue
        assert_read_right(program)
