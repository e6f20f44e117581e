"""A few of the goldens, which need no corpus; `make goldens` compares all of them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from zlib import crc32

import pytest

from conftest import FULL
from goldens import programs, verbs
from goldens.__main__ import SECONDS, read
from goldens.case import LATE, Case, Workplace, digest

EACH = 10 if FULL else 4
"""Cases of a group."""


def some(group: str) -> Iterator[Case]:
    """Cases of a group that take no time, some of every kind, always the same."""
    found = [case for case in (*programs.cases(None), *verbs.cases()) if case.group == group]
    quick = [case for case in found if sum(map(len, case.files.values())) < 1500 and "derive" not in case.name]
    return islice(sorted(quick, key=lambda case: crc32(case.name.encode())), EACH)


@pytest.mark.parametrize("group", ["linuxcnc", "iso", "fanuc", "siemens", "heidenhain", "machine"])
def test_the_same_comes_out(group: str, tmp_path: Path) -> None:
    place, known = Workplace(tmp_path / "place", None), read(group)
    for case in some(group):
        found = {name: digest(text) for name, text in place.texts(case, SECONDS).items()}
        assert found == known[case.name], f"{case.name}: see docs/changes-of-output.md"
        assert LATE not in found.values()
