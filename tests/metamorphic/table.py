"""The table of docs/accuracy.md with what the relations came to: each run writes its rows, the others stay."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

BEGIN, END = "<!-- metamorphic: begin -->", "<!-- metamorphic: end -->"
HEAD = "| one path written in two ways | pairs | worst difference of ends, um or 0.001 degree |\n|---|---|---|"
FIGURE = re.compile(r"metamorphic, (?P<dialect>\w+), (?P<relation>.+): (?P<pairs>\d+) pairs, worst (?P<worst>[\d.]+) ")
ROW = re.compile(r"\| (?P<relation>[^|]+) \| (?P<pairs>\d+) \| (?P<cells>[^|]+) \|")

Rows = dict[tuple[str, int], dict[str, str]]
"""(relation, number of pairs) -> dialect -> worst difference."""


def figure(text: str) -> tuple[tuple[str, int], str, str] | None:
    """The row, the dialect and the worst difference that a test has printed; None for other figures."""
    found = FIGURE.match(text)
    return None if found is None else ((found["relation"], int(found["pairs"])), found["dialect"], found["worst"])


def rows_of(page: str) -> Rows:
    """The rows that stand in a page."""
    between = page[page.index(BEGIN) : page.index(END)]
    found: Rows = {}
    for row in ROW.finditer(between):
        cells = (cell.rsplit(" ", 1) for cell in row["cells"].split(", "))
        found[row["relation"], int(row["pairs"])] = dict(cells)  # type: ignore[arg-type]
    return found


def merged(rows: Rows, key: tuple[str, int], dialect: str, worst: str) -> Rows:
    """The rows with a new figure; an older one of the same dialect and relation is gone."""
    relation = key[0]
    kept = {
        (name, count): {each: value for each, value in cells.items() if (name, each) != (relation, dialect)}
        for (name, count), cells in rows.items()
    }
    kept[key] = kept.get(key, {}) | {dialect: worst}
    return {row: cells for row, cells in kept.items() if cells}


def written(page: str, rows: Mapping[tuple[str, int], Mapping[str, str]]) -> str:
    """The page with these rows."""
    lines = [
        f"| {relation} | {pairs} | {', '.join(f'{dialect} {worst}' for dialect, worst in cells.items())} |"
        for (relation, pairs), cells in rows.items()
    ]
    start, stop = page.index(BEGIN) + len(BEGIN), page.index(END)
    return page[:start] + "\n" + "\n".join([HEAD, *lines]) + "\n" + page[stop:]


def note(path: Path, text: str) -> None:
    """Put a figure that a test has printed into the page."""
    found = figure(text)
    if found is not None:
        page = path.read_text(encoding="utf-8")
        path.write_text(written(page, merged(rows_of(page), *found)), encoding="utf-8")
