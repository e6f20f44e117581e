"""Functions for compensation tables, and reports on machines, diagnoses and results."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from ncfix.api.sources import (
    PathName,
    as_machine,
    as_program,
    as_setup,
    check_writable,
    load_machine,
    paths_of,
    sound_machine,
    subprograms_of,
    write_output,
)
from ncfix.diagnostics import RefusedError, UsageError
from ncfix.files import read_folder, write_folder
from ncfix.inputs import identities
from ncfix.outputs import check_folder

if TYPE_CHECKING:
    from ncfix.compensate.following import Resolve
    from ncfix.control.setup import Setup
    from ncfix.diagnosis.diagnosis import Diagnosis
    from ncfix.machine import Machine
    from ncfix.tables.control import Control, Request
    from ncfix.tables.export import Exported
    from ncfix.text.tree import Program

EQUAL_LENGTHS_MM = 0.5
"""Largest difference, mm, of tool lengths that count as equal for tables."""
MAX_LENGTHS_LISTED = 4
"""Number of tool lengths listed in a remark."""
INSTEAD = "give the original program, or run this one without tables"


def table_request(
    control: Control,
    machine: Machine,
    tool_length: float,
    target_um: float,
    ranges: Mapping[str, tuple[float, float]] | None,
    settings: Mapping[str, str],
    complete: bool = True,
    inputs: Mapping[str, float] | None = None,
) -> Request:
    """The request for tables; ranges in mm and rad.

    complete  whether options without a default must be given
    inputs    temperatures and other inputs: tables cannot follow them, and hold for these values
    """
    from ncfix.machine.effects import at_inputs
    from ncfix.tables.control import Request
    from ncfix.tables.correction import ranges_of

    space = ranges_of(machine, dict(ranges or {}))
    options = control.settings(settings, complete=complete)
    held = {name: value for name, value in (inputs or {}).items() if name in machine.inputs}
    return Request(at_inputs(machine, held), space, tool_length, 1e-3 * target_um, options, held)


def export(
    control: Control | str,
    machine: Machine | PathName,
    *,
    tool_length: float = 0.0,
    target_um: float = 1.0,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    settings: Mapping[str, str] | None = None,
    program: Program | PathName | None = None,
    setup: Setup | PathName | None = None,
    output: PathName | None = None,
    force: bool = False,
) -> Exported:
    """Make compensation tables for a control, read them back, and evaluate them by emulation.

    control      its name, as in `ncfix export`
    tool_length  tool length for which the tables hold, mm
    target_um    largest correction that may be lost between the points of a table
    ranges       axis -> range of the tables, mm and rad; default: the travel
    settings     options of the control
    program      a program to run with them, with its `setup`; for gcode, to rewrite
    setup        its `inputs` (temperatures and others) are the values for which the tables hold
    output       a folder for the files
    """
    from ncfix.tables.control import get_control
    from ncfix.tables.export import export as exported

    chosen = get_control(control) if isinstance(control, str) else control
    if output is not None:
        check_folder(os.fspath(output))
    known = sound_machine(machine, force)
    inputs = as_setup(setup, known).inputs
    request = table_request(chosen, known, tool_length, target_um, ranges, settings or {}, inputs=inputs)
    made = exported(chosen, request)
    if program is not None:
        made = with_program(made, chosen, *_to_run(program, known, setup), rewrite=True)
    if output is not None:
        write_folder(os.fspath(output), made.files, force, identities(paths_of([machine, program, setup])))
    return made


def emulate(
    control: Control | str,
    tables: Mapping[str, bytes] | PathName,
    machine: Machine | PathName,
    *,
    other_machine: bool = False,
    name: str = "tables",
    program: Program | PathName | None = None,
    setup: Setup | PathName | None = None,
) -> Exported:
    """Compute the errors that tables leave on a machine, by emulating the control.

    tables         all files that `export` made, or their folder
    other_machine  accept tables that were made for another machine or other errors
    name           name of the folder in messages, if files are given
    program        a program to run with them, with its `setup`
    setup          its `inputs` are temperatures and others; with inputs other than those of `export` the machine counts
                   as another one
    """
    from ncfix.machine.effects import at_inputs
    from ncfix.tables.control import get_control
    from ncfix.tables.export import emulate as emulated

    chosen = get_control(control) if isinstance(control, str) else control
    if isinstance(tables, (str, os.PathLike)):
        name = os.fspath(tables)
        tables = read_folder(name)
    known = as_machine(machine)
    found = emulated(chosen, tables, at_inputs(known, as_setup(setup, known).inputs), name, other_machine)
    return found if program is None else with_program(found, chosen, *_to_run(program, known, setup))


def _to_run(
    program: Program | PathName, machine: Machine, setup: Setup | PathName | None
) -> tuple[Program, Machine, Setup, Resolve | None]:
    """A program, the machine and the setup to run it with, and the finder of its subprograms."""
    read, own = as_program(program, machine), as_setup(setup, machine)
    return read, machine, replace(own, assume_zero=True) if machine.is_perfect else own, subprograms_of(own, read)


def with_program(
    made: Exported,
    control: Control,
    program: Program,
    machine: Machine,
    setup: Setup,
    resolve: Resolve | None,
    rewrite: bool = False,
) -> Exported:
    """Tables with the errors that they leave along a program.

    Errors before and after are sampled where the tool cuts; those of a rewritten program are the figures of `fix`,
    which also samples the ends of rapids. A remark is added if the program uses tools of other lengths than the tables.

    rewrite  for a control without tables, add the program as rewritten by `fix` to the files; raises `RefusedError`
             with everything that could not be corrected

    Raises `RefusedError` for a program that would be corrected twice: NCF493 if it has a stamp of ncfix, NCF438 if its
    numbers show it.
    """
    import numpy as np

    from ncfix.compensate import FixOptions
    from ncfix.compensate.driver import fix_program
    from ncfix.compensate.figures.simulation import SimulatedErrors, refuse_corrected, tip_errors_of, tip_with
    from ncfix.compensate.following import follow
    from ncfix.tables.export import SIDE_FILE, ProgramWithTables, read_manifest
    from ncfix.text import stamp

    manifest = read_manifest(made.files[SIDE_FILE], SIDE_FILE)
    if (block := stamp.find(program)) is not None:
        text = "the program has been corrected already: with tables of the same errors it would be corrected twice"
        raise RefusedError.of("NCF493", text, program.place(block), INSTEAD)
    followed = follow(program, machine, setup, resolve)
    before = SimulatedErrors.of(tip_errors_of(program, followed)).figures()
    if control.rewrites:
        options = FixOptions(manifest.settings["strategy"], float(manifest.settings["tolerance_um"]))
        found = fix_program(program, machine, setup, options, resolve)
        if rewrite and found.report.refused:
            raise RefusedError.collected(found.report.refusals)
        files = {**made.files, os.path.basename(program.path): found.text} if rewrite else made.files
        after = found.report.error_after_um or before
        return replace(made, files=files, program=ProgramWithTables(program.path, before, after))
    moves, names = followed.trace.moves, machine.axis_names
    refuse_corrected(followed.machine, moves, program.path, INSTEAD)
    tip = tip_with(lambda q, way, length: made.tables.for_tool(length).at(names, q, way))
    after = SimulatedErrors.of(tip_errors_of(program, followed, made=tip)).figures()
    remarks: tuple[str, ...] = ()
    if not control.any_tool and machine.depends_on_tool_length:
        used = moves.tool_length[np.isfinite(moves.tool_length)].tolist()
        others = sorted({round(each, 3) for each in used if abs(each - manifest.tool_length) > EQUAL_LENGTHS_MM})
        listed = ", ".join(f"{each:g}" for each in others[:MAX_LENGTHS_LISTED]) + (
            " ..." if len(others) > MAX_LENGTHS_LISTED else ""
        )
        if others:
            for_tool = f"The tables hold for a tool of {manifest.tool_length:g} mm"
            remarks = (f"{for_tool}; this program also runs with {listed} mm.",)
    return replace(made, program=ProgramWithTables(program.path, before, after, remarks))


def report(
    *sources: Machine | Diagnosis | Mapping[str, Any] | PathName,
    form: str = ".html",
    output: PathName | None = None,
    force: bool = False,
) -> bytes:
    """Put machines, diagnoses and results (as printed with --json) on one page.

    form  ".html" or ".md", or the form of a plugin; overridden by the suffix of `output`
    """
    from ncfix.reports.document import Document
    from ncfix.reports.rendering import form_of

    if not sources:
        raise UsageError.of("NCF025", "nothing is given for the report", hint="give machines, diagnoses or results")
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
    machine = as_machine(source)
    return machine_sections(machine, machine.name)
