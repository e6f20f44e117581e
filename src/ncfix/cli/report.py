"""`ncfix report`: pages on programs, machines and results."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from ncfix.batch.programs import subprograms
from ncfix.cli import console
from ncfix.cli.fix import like_fix
from ncfix.cli.options import PATH, force_option, load_machine, sound
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.shop.pages import Pages
from ncfix.cli.targets import STREAM, Outputs, OutputTarget, read, shown, targets
from ncfix.diagnostics import Place, SourceError, UsageError

if TYPE_CHECKING:
    from ncfix.reports.document import ReportSection

DEEPEST = 64
"""Largest nesting depth of lists and objects in a result."""
OF_FIX = ("dialect", "strategy", "tolerance_um", "split_rapids", "flatten")
"""Parameters of `fix` that also apply to the page of a program."""


@like_fix(OF_FIX)
@click.command()
@click.argument("sources", type=PATH, nargs=-1, required=True, metavar="PROGRAM|MACHINE|RESULT...")
@click.option(
    "-m", "--machine", "machine_path", type=PATH, metavar="FILE", help="Machine file for which PROGRAM is corrected."
)
@click.option(
    "-o", "--output", type=PATH, metavar="FILE", required=True, help="File for the page: FILE.html or FILE.md."
)
@click.option("--plot", type=PATH, metavar="FILE.svg|png|pdf", help="Also write a picture of the errors of PROGRAM.")
@force_option
@setup_options
def report(
    sources: tuple[str, ...],
    machine_path: str | None,
    output: str,
    plot: str | None,
    force: bool,
    given: SetupOptions,
    **options: Any,
) -> None:
    """Write one page about machine files and results (the output of other verbs with --json); with -m, about a program.

    For a machine: its axes, the curves of its errors with their uncertainty, and the error of the tool tip. For a
    result: its tables; for a batch, a list that can be sorted and filtered. For a program: its path with the errors
    before and after a correction; the corrected program is not written.
    """
    if machine_path is not None:
        _report_program(sources, machine_path, output, plot, force, given, options)
        return
    context = click.get_current_context()
    named = [name for name in context.params if context.get_parameter_source(name) is ParameterSource.COMMANDLINE]
    if set(named) - {"sources", "output", "force"}:
        hint = "`ncfix report` does not read a project file; `ncfix fix PROGRAM --report FILE.html` does"
        raise UsageError.of("NCF001", "options of a program need -m MACHINE", hint=hint)
    from ncfix.reports.document import Document
    from ncfix.reports.rendering import form_of

    target = targets([STREAM], Outputs(output, force=force), sources)[0]
    form = form_of(output)
    with console.busy("writing the report"):
        texts = [read(source) for source in sources]
        page = _batch(texts[0], sources[0], output) if len(sources) == 1 else None
        if page is None:
            found = [each for text, source in zip(texts, sources, strict=True) for each in _sections(text, source)]
            title = found[0].heading if len(sources) == 1 else f"{len(sources)} machines and results"
            page = form(Document(title, found))
        target.write(page)


def _batch(text: bytes, path: str, output: str) -> bytes | None:
    """The page of a batch, if the source is the result of one and an HTML page is asked for; else None."""
    if not text.lstrip().startswith(b"{") or os.path.splitext(output)[1].lower() not in ("", ".html", ".htm"):
        return None
    entries = _result(text, path).get("files")
    from ncfix.reports.content import is_of_fix

    if not isinstance(entries, list) or len(entries) < 2 or not all(map(is_of_fix, entries)):
        return None
    from ncfix.cli.shop.batch_page import batch_page

    return batch_page(entries, os.path.dirname(output), f"Batch {shown(path)}")


def _report_program(
    sources: tuple[str, ...],
    machine_path: str,
    output: str,
    plot: str | None,
    force: bool,
    given: SetupOptions,
    options: dict[str, Any],
) -> None:
    """Correct a program and write its page, but not the program."""
    from ncfix.cli.shop.batch import FixJob
    from ncfix.compensate import FixOptions

    if len(sources) > 1:
        hint = "ncfix fix FOLDER -o FOLDER --report FILE.html makes pages of several programs"
        raise UsageError.of("NCF001", "with -m, a page shows one program", hint=hint)
    target = OutputTarget(sources[0], output)
    pages = Pages.of(output, plot, False, force, [OutputTarget(sources[0], STREAM)], (machine_path, *given.files))
    machine = sound(load_machine(machine_path), machine_path, force)
    dialect = options.pop("dialect")
    job = FixJob(machine, given.load(machine), dialect, FixOptions(**options, force=force), pages=pages)
    with console.busy(f"fixing {shown(sources[0])}"), job.fixed(target, subprograms(job.setup, sources[0]), 1) as fixed:
        assert fixed.page is not None
        pages.put(target, fixed.page)
    console.tell_some([*fixed.report.warnings, *fixed.report.refusals])


def _sections(text: bytes, path: str) -> list[ReportSection]:
    """The sections for one file: a machine if it is TOML, a result if it is JSON."""
    if text.lstrip().startswith(b"{"):
        from ncfix.reports.content import result_sections as of_result

        return of_result(_result(text, path), shown(path))
    from ncfix.machine import loads
    from ncfix.reports.content import machine_sections as of_machine

    return of_machine(loads(text, shown(path)), shown(path))


def _result(text: bytes, path: str) -> dict[str, Any]:
    try:
        found = json.loads(text)
        _check_depth(found)
    except ValueError as error:
        hint = "give what a verb printed with --json, or a machine file"
        raise SourceError.of("NCF019", f"is not a result of ncfix: {error}", Place(shown(path)), hint) from error
    except RecursionError as error:
        hint = "give what a verb printed with --json"
        raise SourceError.of(
            "NCF019", "is not a result of ncfix: its JSON is nested too deeply", Place(shown(path)), hint
        ) from error
    if not isinstance(found, dict) or found.get("schema") != console.SCHEMA:
        problem = f'is JSON, but not a result of ncfix: it has no "schema": {console.SCHEMA}'
        raise SourceError.of("NCF019", problem, Place(shown(path)), "give what a verb printed with --json")
    return found


def _check_depth(found: Any) -> None:
    """Raise RecursionError if lists and objects are nested deeper than in any result."""
    level = [found]
    for _ in range(DEEPEST):
        level = [
            item
            for each in level
            if isinstance(each, (dict, list))
            for item in (each.values() if isinstance(each, dict) else each)
        ]
        if not level:
            return
    raise RecursionError
