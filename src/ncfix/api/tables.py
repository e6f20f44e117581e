"""Compensation tables, and pages on machines, diagnoses and results."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from ncfix.api.sources import PathName, as_machine, check_writable, load_machine, paths_of, sound_machine, write_output
from ncfix.diagnostics import UsageError
from ncfix.files import read_folder, write_folder
from ncfix.inputs import identities
from ncfix.outputs import check_folder

if TYPE_CHECKING:
    from ncfix.diagnosis.diagnosis import Diagnosis
    from ncfix.machine import Machine
    from ncfix.tables.control import Control, Request
    from ncfix.tables.export import Exported


def table_request(
    control: Control,
    machine: Machine,
    tool_length: float,
    target_um: float,
    ranges: Mapping[str, tuple[float, float]] | None,
    settings: Mapping[str, str],
    complete: bool = True,
) -> Request:
    """What to make tables of; ranges in mm and rad. `complete`: options without a default must be given."""
    from ncfix.tables.control import Request
    from ncfix.tables.correction import ranges_of

    space = ranges_of(machine, dict(ranges or {}))
    options = control.settings(settings, complete=complete)
    return Request(machine, space, tool_length, 1e-3 * target_um, options)


def export(
    control: Control | str,
    machine: Machine | PathName,
    *,
    tool_length: float = 0.0,
    target_um: float = 1.0,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    settings: Mapping[str, str] | None = None,
    output: PathName | None = None,
    force: bool = False,
) -> Exported:
    """Make compensation tables for a control, read them again, and judge them by running them.

    control      its name, as in `ncfix export`
    tool_length  the length that the tables hold for, mm
    target_um    how much correction may be lost between the points of a table
    ranges       axis -> what the tables cover, mm and rad; others: the travel
    settings     options of the control
    output       a folder for the files
    """
    from ncfix.tables.control import get_control
    from ncfix.tables.export import export as exported

    chosen = get_control(control) if isinstance(control, str) else control
    if output is not None:
        check_folder(os.fspath(output))
    request = table_request(chosen, sound_machine(machine, force), tool_length, target_um, ranges, settings or {})
    made = exported(chosen, request)
    if output is not None:
        write_folder(os.fspath(output), made.files, force, identities(paths_of([machine])))
    return made


def emulate(
    control: Control | str,
    tables: Mapping[str, bytes] | PathName,
    machine: Machine | PathName,
    *,
    other_machine: bool = False,
    name: str = "tables",
) -> Exported:
    """Say what tables leave on a machine: run them as the control would.

    tables         the files that `export` made, all of them, or their folder
    other_machine  run tables that were made for another machine or other errors
    name           what the folder is called in messages, if files are given
    """
    from ncfix.tables.control import get_control
    from ncfix.tables.export import emulate as emulated

    chosen = get_control(control) if isinstance(control, str) else control
    if isinstance(tables, (str, os.PathLike)):
        name = os.fspath(tables)
        tables = read_folder(name)
    return emulated(chosen, tables, as_machine(machine), name, other_machine)


def report(
    *sources: Machine | Diagnosis | Mapping[str, Any] | PathName,
    form: str = ".html",
    output: PathName | None = None,
    force: bool = False,
) -> bytes:
    """Put machines, diagnoses and results (what a verb prints with --json) on one page.

    form  ".html" or ".md", or that of a plugin; the suffix of `output` says more
    """
    from ncfix.reports.document import Document
    from ncfix.reports.rendering import form_of

    if not sources:
        raise UsageError.of("NCF025", "a report is made of something", hint="machines, diagnoses or results")
    check_writable(output, force, sources)
    render = form_of(os.fspath(output) if output is not None else f"page{form}")
    found = [section for source in sources for section in _sections(source)]
    title = found[0].heading if len(sources) == 1 else f"{len(sources)} machines and results"
    page = render(Document(title, found))
    write_output(output, page, force)
    return page


def _sections(source: Machine | Diagnosis | Mapping[str, Any] | PathName) -> list[Any]:
    from ncfix.diagnosis.diagnosis import Diagnosis
    from ncfix.reports.content import machine_sections, result_sections
    from ncfix.reports.diagnosis import document

    if isinstance(source, (str, os.PathLike)):
        return machine_sections(load_machine(source), os.fspath(source))
    if isinstance(source, Diagnosis):
        return list(document(source).sections)
    if isinstance(source, Mapping):
        return result_sections(dict(source), "result")
    return machine_sections(source, source.name)
