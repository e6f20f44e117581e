"""Tables as text: every number as Python writes it, rounded to nine decimals."""

from __future__ import annotations

import csv
import io
import json
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from ncfix.cli.columns import DIGITS, ROWS, Columns, WordColumn, as_csv, as_json

COUNT = ROWS + 7


def numbers(rng: np.random.Generator) -> dict[str, NDArray[np.float64]]:
    """Of all sizes, on and beside the middle between two outputs, with few digits, without any."""
    sizes = {f"1e{power}": rng.normal(size=COUNT) * 10.0**power for power in range(-12, 19, 3)}
    steps = rng.integers(-(10**12), 10**12, COUNT)
    odd = rng.choice([0.0, -0.0, np.nan, np.inf, -np.inf, 1e-5, 1e-4, 9.9999e-5, 1e6, 999999.9999999999, 5e-10], COUNT)
    return sizes | {
        "ties": (steps + 0.5) * 1e-9,
        "exact ties": steps / 2.0 ** rng.integers(0, 40, COUNT),
        "few digits": np.round(steps * 1e-9, 3),
        "whole": np.round(steps * 1e-6),
        "odd": odd,
    }


def said(value: float) -> str:
    return "" if math.isnan(value) else repr(round(value, DIGITS) + 0.0)


@pytest.fixture
def columns() -> Columns:
    rng = np.random.default_rng(7)
    names = ["", "plain", "with, comma", 'a "word"', "two\nlines", "Maß"]
    return {
        "line": rng.integers(0, 10**10, COUNT),
        "word": WordColumn(names, rng.integers(0, 6, COUNT)),
        **numbers(rng),
    }


def test_cells_are_what_python_writes(columns: Columns) -> None:
    found = list(csv.reader(io.StringIO(b"".join(as_csv([columns])).decode(), newline="")))
    assert found[0] == list(columns)
    for name, cells in zip(found[0], zip(*found[1:], strict=True), strict=True):
        column = columns[name]
        if isinstance(column, WordColumn):
            assert list(cells) == [column.names[each] for each in column.which]
        elif column.dtype.kind == "i":
            assert list(cells) == list(map(str, column.tolist()))
        else:
            assert list(cells) == list(map(said, column.tolist())), name


def test_the_object_is_what_json_writes(columns: Columns) -> None:
    cells = []
    for column in columns.values():
        if isinstance(column, WordColumn):
            cells.append([column.names[each] for each in column.which])
        else:
            values = column.tolist()
            whole = column.dtype.kind == "i"
            cells.append([each if whole else float(said(each)) if math.isfinite(each) else None for each in values])
    rows = [list(row) for row in zip(*cells, strict=True)]
    wanted = json.dumps({"schema": 1, "path": "a", "columns": list(columns), "rows": rows}, indent=1) + "\n"
    assert b"".join(as_json([columns], path="a")).decode() == wanted


@pytest.mark.parametrize("form", [as_csv, as_json])
def test_tables_one_after_the_other_are_one(columns: Columns, form: object) -> None:
    def some(part: slice) -> Columns:
        return {
            name: WordColumn(each.names, each.which[part]) if isinstance(each, WordColumn) else each[part]
            for name, each in columns.items()
        }

    assert callable(form)
    tables = [some(slice(0, 0)), some(slice(0, 5)), some(slice(5, None))]
    assert b"".join(form(tables)) == b"".join(form([columns]))


def test_a_table_without_rows() -> None:
    empty: Columns = {"line": np.zeros(0, dtype=np.int64), "x": np.zeros(0)}
    assert b"".join(as_csv([empty])) == b"line,x\n"
    assert json.loads(b"".join(as_json([empty], path="a"))) == {
        "schema": 1, "path": "a", "columns": ["line", "x"], "rows": [],
    }  # fmt: skip
