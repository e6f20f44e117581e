"""ISG_CSV: blank-separated columns, arguments first, then parameters; `//` starts a comment."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

import numpy as np

from ncfix.tables.control import Files
from ncfix.tables.grid import Array, Grid
from ncfix.tables.table_files import Remarks, as_number, unit_of
from ncfix_isg.configuration import LETTERS

PARAMETER = re.compile(r"E[XYZABC]0?[XYZABC]")
POSITION = re.compile(r"E([XYZ])([XYZABC])")
HEAD_LINES = 100
"""Among which the names are looked for."""
LARGE = 1.0
"""mm: no machine is that wrong; most likely the unit is."""
STEEP = 0.01
"""mm per mm or degree."""


def parameters(grid: Grid, owner: str = "") -> list[str]:
    """The names of its values: errors in the directions of its outputs, of an axis or each of its own."""
    return [f"E{name}{owner or name}" for name in grid.outputs]


def grid_text(grid: Grid, owner: str = "") -> bytes:
    """The file of a grid of corrections: errors, that is the opposite, in mm; positions in mm and degree."""
    units = [unit_of(name) for name in grid.inputs]
    lines = [nodes / unit for nodes, unit in zip(grid.nodes, units, strict=True)]
    places = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(lines))
    values = np.round(-grid.values.reshape(-1, len(grid.outputs)), 6) + 0.0
    head = " ".join([*grid.inputs, *parameters(grid, owner)])
    places = np.round(places, 6) + 0.0
    rows = [
        " ".join([*(f"{place:g}" if place == round(place, 3) else f"{place:.6f}" for place in at), *_six(value)])
        for at, value in zip(places.tolist(), values.tolist(), strict=True)
    ]
    comment = "// ncfix: errors in mm, positions in mm and degree; assumptions ISG-1 to ISG-5, see hand-over.md"
    return "".join(f"{row}\n" for row in [comment, head, *rows]).encode()


def _six(values: Sequence[float]) -> list[str]:
    return [f"{value:.6f}" for value in values]


def is_grid(content: bytes) -> bool:
    """Whether the first line that is no comment names positions, then errors."""
    parts = _parts(content.decode("latin-1").splitlines()[:HEAD_LINES])
    words = [word.upper() for word in parts[0][0][1]] if parts else []
    return len(words) > 1 and words[0] in LETTERS and PARAMETER.fullmatch(words[-1]) is not None


def read_grids(names: Sequence[str], axes: Collection[str], files: Files) -> tuple[list[Grid], list[Remarks]]:
    """The grids of corrections in these files, with remarks on each; axes: that may be arguments."""
    grids: list[Grid] = []
    remarks = []
    seen: dict[str, str] = {}
    for name in names:
        found = Remarks.of(name, files[name], "//")
        remarks.append(found)
        parts = _parts(found.rows)
        if not parts:
            found.refuse(0, "is empty")
        for (head_line, names_of), *rows in parts:
            head = [word.upper() for word in names_of]
            inputs, outputs = _header(found, head_line, head, axes, seen)
            table = _numbers(found, rows, len(head))
            if not found.wrong:
                grids += _grids(found, [number for number, _ in rows], inputs, outputs, table)
    return grids, remarks


Words = tuple[int, list[str]]


def _parts(rows: Sequence[str]) -> list[list[Words]]:
    """The lines of each table, as words, without comments; a line that begins with # stands between two tables."""
    parts: list[list[Words]] = [[]]
    for number, row in enumerate(rows, 1):
        if row.lstrip().startswith("#"):
            parts.append([])
        elif words := row.split("//", 1)[0].split():
            parts[-1].append((number, words))
    return [part for part in parts if part]


def _header(
    remarks: Remarks, line: int, head: Sequence[str], axes: Collection[str], seen: dict[str, str]
) -> tuple[list[str], list[str]]:
    inputs = [word for word in head if word in LETTERS]
    outputs = [word for word in head if word not in inputs]
    if list(head) != [*inputs, *outputs] or not inputs or not outputs:
        remarks.refuse(line, "the header should name arguments first, then parameters", "e.g. X Y Z EXX EYY EZZ")
    for word in sorted(set(inputs) - set(axes)):
        remarks.refuse(line, f"the argument {word} has no axis number in the configuration")
    for word in outputs:
        if not PARAMETER.fullmatch(word):
            remarks.refuse(line, f"the parameter {word!r} is not known (error 70468)", "ISO 230-1 names")
        elif not POSITION.fullmatch(word):
            remarks.refuse(line, f"{word}: ncfix runs position errors only, not angles and locations")
    for word in head:
        if list(head).count(word) > 1 or (word in outputs and word in seen):
            remarks.refuse(line, f"{word} is there twice (error 70469)")
            break
    seen.update(dict.fromkeys(outputs, remarks.path))
    return inputs, outputs


def _numbers(remarks: Remarks, rows: Sequence[tuple[int, list[str]]], width: int) -> Array:
    table = []
    for number, words in rows:
        if len(words) != width:
            remarks.refuse(number, f"{len(words)} values under {width} names")
            continue
        values = [as_number(word) for word in words]
        if None in values:
            comma = any("," in word for word in words)
            endless = any(word.strip("+-").lower() in ("nan", "inf", "infinity") for word in words)
            other = "a value that is not finite" if endless else "something that is not a number"
            remarks.refuse(number, "a decimal comma" if comma else other)
            continue
        table.append(values)
    return np.array(table, dtype=np.float64).reshape(-1, width)


def _grids(
    remarks: Remarks, lines: Sequence[int], inputs: Sequence[str], outputs: Sequence[str], table: Array
) -> list[Grid]:
    """One grid for each direction that the parameters are in, if the rows fill a regular grid."""
    places, values = table[:, : len(inputs)], table[:, len(inputs) :]
    nodes = [np.unique(column) for column in places.T]
    counts = tuple(len(line) for line in nodes)
    at = tuple(np.searchsorted(line, column) for line, column in zip(nodes, places.T, strict=True))
    filled = np.zeros(counts, dtype=np.intp)
    np.add.at(filled, at, 1)
    if filled.size == 0 or (filled != 1).any():
        twice = int((filled > 1).sum())
        shape = " x ".join(map(str, counts))
        text = (
            f"{len(table)} rows are no regular grid {shape}: {int((filled == 0).sum())} nodes missing, {twice} double"
        )
        remarks.refuse(0, f"{text} (error 70471)", "GRID needs every combination of the positions once")
        return []
    _look_at_values(remarks, lines, values)
    ordered = np.zeros((*counts, len(outputs)))
    ordered[at] = values
    _look_for_jumps(remarks, nodes, ordered)
    units = [unit_of(name) for name in inputs]
    scaled = tuple(line * unit for line, unit in zip(nodes, units, strict=True))
    axes = tuple(sorted({name[1] for name in outputs}))
    error = np.stack([sum(ordered[..., i] for i, name in enumerate(outputs) if name[1] == axis) for axis in axes], -1)
    return [Grid(tuple(inputs), scaled, axes, -error)]


def _look_at_values(remarks: Remarks, lines: Sequence[int], values: Array) -> None:
    for row in np.flatnonzero(np.abs(values).max(axis=1) > LARGE)[:1]:
        text = f"an error of {np.abs(values[row]).max():g} mm, which no machine has"
        remarks.refuse(lines[row], text, "values are in mm, not um")


def _look_for_jumps(remarks: Remarks, nodes: Sequence[Array], values: Array) -> None:
    """Name the input along which neighbours differ by more than a machine can."""
    for axis, line in enumerate(nodes):
        if len(line) > 1:
            steps = np.diff(line).reshape([-1 if i == axis else 1 for i in range(values.ndim)])
            slope = float(np.abs(np.diff(values, axis=axis) / steps).max())
            if slope > STEEP:
                remarks.doubt(0, f"an error changes by {slope:.3g} mm per unit along input {axis + 1}", "a slip?")
