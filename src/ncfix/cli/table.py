"""Tables as comma-separated text."""

from __future__ import annotations

from typing import Any

DIGITS = 9
"""Decimals that are kept: what is below has no meaning on any machine."""

Columns = dict[str, list[Any]]
"""Name -> values, all of one length; None for what is not known."""


def known(values: Any) -> list[float | None]:
    """An array of numbers as a column: None for NaN, no noise in the last digits, no minus zero."""
    return [None if value != value else round(value, DIGITS) + 0.0 for value in values.tolist()]


def as_csv(columns: Columns) -> bytes:
    """A header and one line a row; cells of what is not known are empty."""
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(_cell, row)) for row in rows)]
    return "".join(f"{line}\n" for line in lines).encode()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    text = repr(value) if isinstance(value, float) else str(value)
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\n') else text
