"""The files of a folder as the control would take them: CEC and EEC tables, with what their comments say of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ncfix.tables.compensation import Compensation
from ncfix.tables.control import Files
from ncfix.tables.table_files import Remarks
from ncfix_siemens.cec import read_cec
from ncfix_siemens.combine import TERMS, Reading, compensation
from ncfix_siemens.eec import read_eec
from ncfix_siemens.options import SIGNS
from ncfix_siemens.syntax import VALUE_FILES, parsed, settings
from ncfix_siemens.table import Table

UNSAID = "ncfix writes it as a comment: ; ncfix: value_sign=error product_terms=only X=AX1 ..."


@dataclass(frozen=True, slots=True)
class Folder:
    """Tables of each kind, what comments say, and remarks on every file."""

    cec: tuple[Table, ...]
    eec: tuple[Table, ...]
    said: Mapping[str, str]
    remarks: tuple[Remarks, ...]


def read_folder(files: Files) -> Folder:
    """Everything that is in the files."""
    cec: list[Table] = []
    eec: list[Table] = []
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
    """What only shows when all tables are looked at together.

    Where factors are added by themselves, too, a table of an axis over itself takes that off again.
    """
    own = {table.output for table in folder.eec}
    pointed = {table.multiply for table in folder.cec if table.multiply}
    offsets = bool(pointed) and folder.said.get("product_terms", "only") != "only"
    for table in folder.cec:
        plain = not table.multiply and table.index + 1 not in pointed and not offsets
        if plain and table.input == table.output and table.output in own:
            remarks.doubt(0, f"{table.output} over itself is corrected twice, by table {table.index + 1} and by EEC")
    _look_at_limits(folder, remarks)
    _look_at_pairs(folder.cec, remarks)


def _look_at_limits(folder: Folder, remarks: Remarks) -> None:
    for key, count in (("tables", len(folder.cec)), ("points", max((len(t.values) for t in folder.cec), default=0))):
        most = folder.said.get(f"most_{key}", "")
        if most.isdecimal() and count > int(most):
            remarks.refuse(0, f"{count} {key}, and the control has {most}", "a smaller range, fewer tables, or fix")


def _look_at_pairs(tables: tuple[Table, ...], remarks: Remarks) -> None:
    """Two tables for the two ways of one axis belong together."""
    ways: dict[tuple[str, str, int], set[int]] = {}
    for table in tables:
        ways.setdefault((table.input, table.output, table.multiply), set()).add(table.direction)
    for (source, output, _), found in ways.items():
        if found in ({1}, {-1}):
            text = f"{output} is corrected over {source} while it moves one way only"
            remarks.doubt(0, text, "a table for the other way is missing?")


def reading_of(folder: Folder) -> tuple[Reading | None, Remarks]:
    """How the tables are to be taken, from what the comments say, with remarks on what they do not say."""
    remarks = Remarks(folder.remarks[0].path if folder.remarks else "")
    axes = {key: value for key, value in folder.said.items() if len(key) == 1}
    used = {name for table in (*folder.cec, *folder.eec) for name in (table.input, table.output)}
    for name in sorted(used - set(axes.values())):
        remarks.refuse(0, f"no file says which axis of the machine {name} is", UNSAID)
    sign, terms = folder.said.get("value_sign", ""), folder.said.get("product_terms", "")
    if folder.cec and sign not in SIGNS:
        remarks.refuse(0, "no file says whether values are errors or corrections (value_sign)", UNSAID)
    if any(table.multiply for table in folder.cec) and terms not in TERMS:
        remarks.refuse(0, "no file says what a product adds (product_terms)", UNSAID)
    if remarks.wrong:
        return None, remarks
    return Reading(axes, 1 if sign == "correction" else -1, terms), remarks


def as_corrections(folder: Folder, reading: Reading) -> Compensation:
    """What the tables do together. EEC values are errors, whatever those of CEC are."""
    plain = Reading(reading.axes, -1, "")
    return Compensation((*compensation(folder.cec, reading).terms, *compensation(folder.eec, plain).terms))
