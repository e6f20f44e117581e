"""Conversion between neutral sums and products of tables and the control's CEC and EEC tables: signs, units, products.

In a product, the base (the table with MULT_BY_TABLE) carries sign and unit; the multiplier has no unit. The files of a
folder are read as the control would, together with the comments of ncfix that state their meaning.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array
from ncfix.tables.compensation import Compensation, Term
from ncfix.tables.control import Files
from ncfix.tables.grid import Grid
from ncfix.tables.table_files import Remarks, unit_of
from ncfix.values import frozen
from ncfix_siemens.assignments import VALUE_FILES, parsed, settings
from ncfix_siemens.settings import SIGNS, TERMS
from ncfix_siemens.tables import BOTH, DIGITS, PLACES, CecTable, read_cec, read_eec

UNSAID = "ncfix writes it as a comment: ; ncfix: value_sign=error product_terms=only X=AX1 ..."


@frozen
class TableReading:
    """The meaning of tables in the control.

    axes   axis letter -> machine axis
    sign   1: values are corrections; -1: values are errors
    terms  what a product adds, one of `TERMS`; "" if there are no products
    """

    axes: Mapping[str, str]
    sign: int
    terms: str


def tables_of(terms: Iterable[Term], reading: TableReading) -> list[CecTable]:
    """The control's tables for some terms; a multiplier comes before the tables that refer to it."""
    tables: list[CecTable] = []
    multipliers: dict[int, tuple[int, float]] = {}
    terms = list(terms)
    for term in terms:
        base, *others = term.factors
        multiply, size = 0, 1.0
        if others:
            centre = others[0]
            if id(centre) not in multipliers:
                size = _shared(centre, terms, reading)
                multipliers[id(centre)] = len(tables) + 1, size
                tables.append(_table(len(tables), centre, size, term.outputs[0], reading))
            multiply, size = multipliers[id(centre)]
        direction = BOTH if term.way is None else term.way[1]
        factor = reading.sign / size / unit_of(term.outputs[0])
        table = _table(len(tables), base, factor, term.outputs[0], reading)
        tables.append(replace(table, direction=direction, multiply=multiply))
    return _balanced(tables, reading.terms)


def _shared(centre: Grid, terms: Sequence[Term], reading: TableReading) -> float:
    """The factor on a multiplier that makes it as large as its largest base, so that neither does harm by itself."""
    own = float(np.abs(centre.values).max()) or 1.0
    bases = [term.factors[0] for term in terms if any(factor is centre for factor in term.factors[1:])]
    largest = max(float(np.abs(base.values).max()) / unit_of(base.outputs[0]) for base in bases) * own
    wanted = np.sqrt(largest) if largest > 0 else 1.0
    return float(f"{min(wanted, 1.0):.2g}") / own


def _table(index: int, grid: Grid, factor: float, output: str, reading: TableReading) -> CecTable:
    (letter,) = grid.inputs
    nodes = grid.nodes[0] / unit_of(letter)
    step = round(float(nodes[-1] - nodes[0]) / (len(nodes) - 1), PLACES)
    values: Array = np.round(grid.values[:, 0] * factor, DIGITS) + 0.0
    modulo = bool(grid.modulo and grid.modulo[0])
    low = round(float(nodes[0]), PLACES)
    return CecTable(index, reading.axes[letter], reading.axes[output], low, step, values, modulo=modulo)


def _balanced(tables: list[CecTable], terms: str) -> list[CecTable]:
    """The tables, with further ones that cancel what the control adds besides the products."""
    pointed = {table.multiply - 1 for table in tables if table.multiply}
    extra = [
        table
        for table in tables
        if (table.index in pointed and terms in ("plus_multiplier", "plus_both"))
        or (table.multiply and terms in ("plus_base", "plus_both"))
    ]
    for table in extra:
        tables.append(replace(table, index=len(tables), values=-table.values + 0.0, multiply=0))
    return tables


def compensation(tables: Sequence[CecTable], reading: TableReading) -> Compensation:
    """The correction of the control's CEC tables."""
    letters = {axis: letter for letter, axis in reading.axes.items()}
    pointed = {table.multiply for table in tables if table.multiply}
    multipliers = {table.index + 1: _grid(table, letters, reading, plain=True) for table in tables}
    terms = []
    for table in tables:
        grid = _grid(table, letters, reading)
        way = None if table.direction == BOTH else (letters[table.input], table.direction)
        if table.multiply:
            terms.append(Term((grid, multipliers[table.multiply]), way))
        if _added(table, pointed, reading.terms):
            terms.append(Term((grid,), way))
    return Compensation(tuple(terms))


def _added(table: CecTable, pointed: set[int], terms: str) -> bool:
    if table.multiply:
        return terms in ("plus_base", "plus_both")
    return table.index + 1 not in pointed or terms in ("plus_multiplier", "plus_both")


def _grid(table: CecTable, letters: Mapping[str, str], reading: TableReading, plain: bool = False) -> Grid:
    own, output = letters[table.input], letters[table.output]
    return table.grid(own, output, 1.0 if plain else reading.sign * unit_of(output), unit_of(own))


@frozen
class Folder:
    """The tables of a folder by kind, the settings stated in comments, and remarks on every file."""

    cec: tuple[CecTable, ...]
    eec: tuple[CecTable, ...]
    said: Mapping[str, str]
    remarks: tuple[Remarks, ...]


def read_folder(files: Files) -> Folder:
    """Read all files of a folder."""
    cec: list[CecTable] = []
    eec: list[CecTable] = []
    said: dict[str, str] = {}
    remarks = []
    for name, content in sorted(files.items()):
        found = Remarks.of(name, content, ";")
        remarks.append(found)
        if b"\r\n" in content and content.count(b"\r\n") < content.count(b"\n"):
            found.doubt(0, "lines end in two ways", "LF or CR LF, but not both")
        lines = parsed("\n".join(found.rows))
        said |= settings(lines)
        tables = read_eec(lines, found) if VALUE_FILES["eec"] in content.upper() else read_cec(lines, found)
        (eec if VALUE_FILES["eec"] in content.upper() else cec).extend(tables)
    folder = Folder(tuple(cec), tuple(eec), said, tuple(remarks))
    if remarks:
        _look_across(folder, remarks[0])
    return folder


def _look_across(folder: Folder, remarks: Remarks) -> None:
    """Note faults that only show in all tables together: tables in two places, double correction, too many
    tables, one-sided tables.

    If the control also adds the factors of products, a table of an axis over itself cancels that, and is no fault.
    """
    numbers = [table.index + 1 for table in folder.cec]
    for number in sorted({number for number in numbers if numbers.count(number) > 1}):
        remarks.refuse(0, f"table {number} is in more than one file: the control keeps what is loaded last")
    encoders = [table.output for table in folder.eec if table.values.any()]
    for axis in sorted({axis for axis in encoders if encoders.count(axis) > 1}):
        text = f"{axis} has more than one encoder table: the control takes that of the encoder in use"
        remarks.refuse(0, text, "leave the one that is in use")
    own = {table.output for table in folder.eec}
    pointed = {table.multiply for table in folder.cec if table.multiply}
    offsets = bool(pointed) and folder.said.get("product_terms", "only") != "only"
    for table in folder.cec:
        plain = not table.multiply and table.index + 1 not in pointed and not offsets
        if plain and table.input == table.output and table.output in own:
            remarks.doubt(0, f"{table.output} over itself is corrected twice, by table {table.index + 1} and by EEC")
    for key, count in (("tables", len(folder.cec)), ("points", max((len(t.values) for t in folder.cec), default=0))):
        most = folder.said.get(f"most_{key}", "")
        if most.isdecimal() and count > int(most):
            remarks.refuse(
                0, f"{count} {key}, but the control has {most}", "use a smaller range, fewer tables, or ncfix fix"
            )
    ways: dict[tuple[str, str, int], set[int]] = {}
    for table in folder.cec:
        ways.setdefault((table.input, table.output, table.multiply), set()).add(table.direction)
    for (source, output, _), found in ways.items():
        if found in ({1}, {-1}):
            text = f"{output} is corrected over {source} only while it moves in one direction"
            remarks.doubt(0, text, "check whether the table for the other direction is missing")


def reading_of(folder: Folder) -> tuple[TableReading | None, Remarks]:
    """The meaning of the tables, from comments, with remarks on missing statements; None if any is missing."""
    remarks = Remarks(folder.remarks[0].path if folder.remarks else "")
    axes = {key: value for key, value in folder.said.items() if len(key) == 1}
    used = {name for table in (*folder.cec, *folder.eec) for name in (table.input, table.output)}
    for name in sorted(used - set(axes.values())):
        remarks.refuse(0, f"no file states which axis of the machine {name} is", UNSAID)
    sign, terms = folder.said.get("value_sign", ""), folder.said.get("product_terms", "")
    if folder.cec and sign not in SIGNS:
        remarks.refuse(0, "no file states whether values are errors or corrections (value_sign)", UNSAID)
    if any(table.multiply for table in folder.cec) and terms not in TERMS:
        remarks.refuse(0, "no file states what a product adds (product_terms)", UNSAID)
    if remarks.wrong:
        return None, remarks
    return TableReading(axes, 1 if sign == "correction" else -1, terms), remarks


def as_corrections(folder: Folder, reading: TableReading) -> Compensation:
    """The correction of all tables of a folder. EEC values are errors, whatever those of CEC are."""
    plain = TableReading(reading.axes, -1, "")
    return Compensation((*compensation(folder.cec, reading).terms, *compensation(folder.eec, plain).terms))
