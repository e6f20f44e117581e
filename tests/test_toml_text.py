"""Keys of a TOML text are found on their lines."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

from ncfix.toml_text import key_lines, line_of, written

TEXT = '''\
name = "a"

[axis.X]   # a comment
"quoted key" = 1
direction = [
    1,
    0 ]
note = """
range = 5
[axis.Z]
"""
range = [0, 1]

[[effect]]
name = "EXX"
[[effect]]
name = "EYX"
inner.key = 1
[effect.table]
deep = 2
[ provenance ]
date = 1
'''


def test_the_line_of_every_key() -> None:
    lines = key_lines(TEXT)
    expected = {
        ("name",): 1,
        ("axis",): 3,
        ("axis", "X"): 3,
        ("axis", "X", "quoted key"): 4,
        ("axis", "X", "direction"): 5,
        ("axis", "X", "note"): 8,
        ("axis", "X", "range"): 12,
        ("effect",): 14,
        ("effect", 0): 14,
        ("effect", 0, "name"): 15,
        ("effect", 1): 16,
        ("effect", 1, "name"): 17,
        ("effect", 1, "inner"): 18,
        ("effect", 1, "inner", "key"): 18,
        ("effect", 1, "table"): 19,
        ("effect", 1, "table", "deep"): 20,
        ("provenance",): 21,
        ("provenance", "date"): 22,
    }
    assert {key: line for key, line in lines.items() if key} == expected


def test_a_key_inside_a_line_is_placed_on_its_table() -> None:
    lines = key_lines("a = 1\nincrement = { linear = 1, rotary = 2 }\n")
    assert line_of(("increment", "rotary"), lines) == 2
    assert line_of(("nowhere", 3, "at all"), lines) == 1


@pytest.mark.parametrize(
    ("first", "line"),
    [
        ('a = "x"  # """', 2),
        ('a = \'"""\'', 2),
        ('a = """x"""', 2),
        ("a = \"\"\"x\n'''\n\"\"\"  # '''", 4),
    ],
)
def test_what_only_looks_like_the_begin_of_a_long_text(first: str, line: int) -> None:
    assert key_lines(f"{first}\nb = 2\n")[("b",)] == line


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (np.int64(3), "3"),
        (np.float64(0.1), "0.1"),
        (np.bool_(True), "true"),
        (np.array([[1, 2], [3, 4]]), "[[1, 2], [3, 4]]"),
        (float("-inf"), "-inf"),
        (1e16, "1e+16"),
    ],
)
def test_numbers_are_written_as_toml_reads_them(value: object, text: str) -> None:
    line = written("[a]", {"key": value}).splitlines()[1]
    assert line == f"key = {text}"
    assert np.array_equal(tomllib.loads(line)["key"], value)  # type: ignore[arg-type]
