"""Mistakes that people make in measurement files, as changes of texts; the files are honest before.

A file is a head of comment lines, a line of column names, and rows of cells.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

Cells = dict[str, list[str]]
Files = dict[str, str]
Change = Callable[[Cells], Cells]


@dataclass(frozen=True)
class Sheet:
    """A measurement file taken apart."""

    head: tuple[str, ...]
    cells: Cells

    @staticmethod
    def of(text: str) -> Sheet:
        lines = [line for line in text.splitlines() if line]
        head = tuple(line for line in lines if line.startswith("#"))
        names, *rows = [line.split(",") for line in lines if not line.startswith("#")]
        return Sheet(head, {name: [row[k] for row in rows] for k, name in enumerate(names)})

    def text(self) -> str:
        rows = [",".join(row) for row in zip(*self.cells.values(), strict=True)]
        return "\n".join([*self.head, ",".join(self.cells), *rows, ""])


def scaled(cells: Cells, names: Sequence[str], factor: float) -> Cells:
    """Columns times a factor, with all their digits."""
    found = {name: [f"{factor * float(each):.9g}" for each in cells[name]] for name in names if name in cells}
    return {**cells, **found}


def times(names: Sequence[str], factor: float) -> Change:
    return lambda cells: scaled(cells, names, factor)


def exchanged(first: str, second: str) -> Change:
    return lambda cells: {**cells, first: cells[second], second: cells[first]}


def filled(names: Sequence[str], value: str) -> Change:
    return lambda cells: {**cells, **{name: [value] * len(cells[name]) for name in names if name in cells}}


def in_part(column: str, of: Callable[[str], bool], change: Change) -> Change:
    """A change of the rows whose cell in a column is one of some."""

    def done(cells: Cells) -> Cells:
        new = change(cells)
        mine = [of(each) for each in cells[column]]
        return {
            name: [b if here else a for a, b, here in zip(cells[name], new[name], mine, strict=True)] for name in cells
        }

    return done


def each_its_set(cells: Cells) -> Cells:
    return {**cells, "set": [str(k) for k in range(len(next(iter(cells.values()))))]}


def everywhere(files: Files, change: Change, head: Callable[[str], str] = lambda line: line) -> Files:
    """The files with all measurements changed."""
    found = {}
    for name, text in files.items():
        if name.endswith(".csv"):
            sheet = Sheet.of(text)
            text = Sheet(tuple(head(line) for line in sheet.head), change(sheet.cells)).text()
        found[name] = text
    return found


def same(cells: Cells) -> Cells:
    return cells


def longer(number: int, factor: float, uncertainty: str = "") -> Callable[[str], str]:
    """The lines of one calibrated distance with another length."""
    seen: list[str] = []

    def changed(line: str) -> str:
        if not line.startswith("# distance:"):
            return line
        first, second, length, spread = line.split(":")[1].split()
        seen.append(line)
        if (len(seen) - 1) % 2 != number:
            return line
        return f"# distance: {first} {second} {float(length) * factor:.4f} {uncertainty or spread}"

    return changed
