"""`ncfix report`: machines and results as a page to be read, printed or filed."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.options import PATH, force_option
from ncfix.cli.targets import STREAM, Outputs, read, shown, targets
from ncfix.diagnostics import Place, SourceError

if TYPE_CHECKING:
    from ncfix.reports.document import ReportSection

DEEPEST = 64
"""How deep the lists and objects of a result lie in one another at most."""


@click.command()
@click.argument("sources", type=PATH, nargs=-1, required=True, metavar="MACHINE|RESULT...")
@click.option("-o", "--output", type=PATH, metavar="FILE", required=True, help="The page: FILE.html or FILE.md.")
@force_option
def report(sources: tuple[str, ...], output: str, force: bool) -> None:
    """Put machine files, and what other verbs printed with --json, on one page.

    Of a machine: its chain, its errors with their curves and uncertainty, and how far they lead the tool tip. Of a
    result: its tables.
    """
    from ncfix.reports.document import Document
    from ncfix.reports.rendering import form_of

    target = targets([STREAM], Outputs(output, force=force), sources)[0]
    form = form_of(output)
    with console.busy("writing the report"):
        found = [section for source in sources for section in _sections(source)]
        title = found[0].heading if len(sources) == 1 else f"{len(sources)} machines and results"
        target.write(form(Document(title, found)))


def _sections(path: str) -> list[ReportSection]:
    """What one file has to say: a machine if it is TOML, a result if it is JSON."""
    text = read(path)
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
        raise SourceError.of("NCF019", f"is not a result: {error}", Place(shown(path)), hint) from error
    except RecursionError as error:
        hint = "give what a verb printed with --json"
        raise SourceError.of("NCF019", "is no result: it is nested too deeply", Place(shown(path)), hint) from error
    if not isinstance(found, dict) or found.get("schema") != console.SCHEMA:
        problem = f'is JSON, but no result: it has no "schema": {console.SCHEMA}'
        raise SourceError.of("NCF019", problem, Place(shown(path)), "give what a verb printed with --json")
    return found


def _check_depth(found: Any) -> None:
    """Raise RecursionError if lists and objects lie deeper in one another than those of any result."""
    level = [found]
    for _ in range(DEEPEST):
        level = [item for each in level if isinstance(each, (dict, list)) for item in _items(each)]
        if not level:
            return
    raise RecursionError


def _items(nested: dict[str, Any] | list[Any]) -> Iterable[Any]:
    return nested.values() if isinstance(nested, dict) else nested
