"""`ncfix watch IN OUT`: corrects programs that are copied into a folder, each when it is complete."""

from __future__ import annotations

import os
import time
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import field
from html import escape
from typing import TYPE_CHECKING, Any

import click

from ncfix import files
from ncfix.batch.watching import WatchedFolder, moments, state_of
from ncfix.cli import console
from ncfix.cli.fix import like_fix, workers_for
from ncfix.cli.options import FOLDER, PATH, Positive, load_machine, sound
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.shop.projects import ProgramGroup, ProjectCommand, tell_of
from ncfix.cli.shop.summary import OutcomeKind, Verbosity, reasons
from ncfix.cli.targets import STREAM, Outputs, targets
from ncfix.diagnostics import ExitCode, NcfixError, Place, UsageError, visible
from ncfix.inputs import identities
from ncfix.outputs import check_target
from ncfix.values import frozen, mutable

if TYPE_CHECKING:
    from ncfix.cli.shop.batch import FixJob

HEAD = """<!doctype html>
<html lang="en"><meta charset="utf-8"><meta http-equiv="refresh" content="5">
<meta name="viewport" content="width=device-width"><title>ncfix watch</title>"""
"""Beginning of every status page, by which it is recognised."""
LAST = 200
"""Largest number of programs on the status page."""
STYLE = """:root { color-scheme: light dark; font: 15px/1.4 system-ui, sans-serif }
body { max-width: 70em; margin: 1.5em auto; padding: 0 1em }
table { border-collapse: collapse; width: 100% } th, td { text-align: left; padding: .3em .8em .3em 0 }
td { border-top: 1px solid #8886; overflow-wrap: anywhere } .failed, .refused { color: #c33; font-weight: 600 }"""
TAKEN = frozenset(
    {
        *("machine_path", "dialect", "strategy", "thesis", "tolerance_um", "split_rapids", "flatten", "block_numbers"),
        *("allow_refused", "figures", "jobs", "executor", "time_limit_s", "memory_limit_mb"),
    }
)
"""Parameters of `fix` that `watch` has, too, in addition to those of the setup."""


class FolderCommand(ProjectCommand):
    """A verb on a folder, to which the project file of that folder applies as a whole."""

    def _by_settings(self, given: Iterable[str], named: str | None) -> list[ProgramGroup]:
        from ncfix.project import Project

        (folder, *_) = given
        project = Project.load(named) if named else Project.of(folder)
        if project is None:
            return [ProgramGroup()]
        tell_of(project)
        return [ProgramGroup(self._parameters(project, project.settings(folder)), None, project.folder or os.curdir)]


@mutable
class StatusPage:
    """The results since the start, as a page that a browser reloads regularly.

    path  file of the page; None: no page
    lost  why the last attempt to write it failed; empty if it succeeded
    """

    path: str | None
    began: float = field(default_factory=time.time)
    counts: Counter[str] = field(default_factory=Counter)
    last: list[tuple[float, Mapping[str, Any]]] = field(default_factory=list)
    trouble: str = ""
    lost: str = ""

    def check(self, inputs: Iterable[str]) -> None:
        """Refuse to replace an input, or a file that is no status page.

        Raises `UsageError` NCF003, NCF004, NCF005, NCF007, NCF018, NCF023.
        """
        if self.path is None:
            return
        check_target(self.path, identities(inputs), replace=True)
        if os.path.splitext(self.path)[1].lower() not in (".html", ".htm"):
            raise UsageError.of("NCF018", "a status page must be an .html file", Place(self.path), "--status FILE.html")
        if os.path.lexists(self.path) and not files.read_bytes(self.path).startswith(HEAD.encode()):
            text = "exists already and is not a status page of ncfix watch"
            raise UsageError.of("NCF004", text, Place(self.path), "give the page another name")

    def add(self, entry: Mapping[str, Any]) -> None:
        """Add the result of a program."""
        self.counts[OutcomeKind.of(entry)] += 1
        self.last = [(time.time(), entry), *self.last[: LAST - 1]]

    def write(self) -> None:
        """Rewrite the page; a failure is reported once and does not stop the corrections."""
        if self.path is None:
            return
        try:
            files.write_whole(self.path, self.text().encode(), replace=True)
            self.lost = ""
        except NcfixError as error:
            if str(error) != self.lost:
                console.tell(*error.messages)
                self.lost = str(error)

    def text(self) -> str:
        """The page as HTML."""
        rows = "\n".join(self._row(at, entry) for at, entry in self.last)
        counts = ", ".join(f"{count} {became}" for became, count in sorted(self.counts.items())) or "no program yet"
        trouble = f'<p class="failed">{escape(visible(self.trouble, lines=True))}</p>' if self.trouble else ""
        return f"""{HEAD}<style>{STYLE}</style>
<h1>ncfix watch</h1>
<p>Since {_clock(self.began)}: {counts}. Written {_clock(time.time())}.</p>{trouble}
<table><tr><th>when<th>program<th>what became of it<th>why</tr>
{rows}
</table></html>
"""

    def _row(self, at: float, entry: Mapping[str, Any]) -> str:
        became, why = OutcomeKind.of(entry), reasons(entry)
        said = f"{why[0][0]}: {why[0][1]}" if why else _correction(entry)
        cells = (_clock(at), visible(entry["path"]), f'<span class="{became}">{became}</span>', visible(said))
        return "<tr>" + "".join(f"<td>{cell if '<span' in cell else escape(cell)}" for cell in cells) + "</tr>"


def _correction(entry: Mapping[str, Any]) -> str:
    most = entry.get("max_correction_um")
    return "" if most is None else f"largest correction {most:.1f} um"


def _clock(at: float) -> str:
    return time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(at))


@like_fix(TAKEN)
@click.command(cls=FolderCommand)
@click.argument("folder", type=FOLDER, metavar="IN")
@click.argument("output", type=FOLDER, metavar="OUT")
@setup_options
@click.option(
    "--settle-s",
    type=Positive(),
    default=2.0,
    show_default=True,
    help="Time without a change after which a program counts as complete, s.",
)
@click.option(
    "--poll-s",
    type=Positive(),
    metavar="S",
    help="Interval at which IN is looked at, s; for network shares, which report no changes.",
)
@click.option(
    "--status", type=PATH, metavar="FILE.html", help="Write a status page of the programs, and keep it up to date."
)
@click.option("--once", is_flag=True, help="End when all programs that are in IN now are done.")
@click.option("--project", type=PATH, metavar="FILE", expose_value=False, help="Project file.")
@click.option("--no-project", is_flag=True, expose_value=False, help="Ignore project files.")
@click.option("-q", "--quiet", is_flag=True, help="Print only the programs that were not written, and why.")
@click.option("-v", "--verbose", is_flag=True, help="Print everything about each program.")
def watch(
    folder: str,
    output: str,
    given: SetupOptions,
    settle_s: float,
    poll_s: float | None,
    status: str | None,
    once: bool,
    quiet: bool,
    verbose: bool,
    machine_path: str,
    **options: Any,
) -> int:
    """Correct the programs that arrive in the folder IN, each when it is complete, into the folder OUT, until Ctrl-C.

    Programs that are done and have not changed are skipped, as with `ncfix fix --resume`.
    """
    if not os.path.isdir(folder):
        raise UsageError.of("NCF014", "is not a folder", Place(folder), "make this folder, or name another one")
    if output in ("", STREAM):
        raise UsageError.of("NCF003", "corrected programs need a folder", hint="name the folder OUT")
    if os.path.isdir(output) and os.path.samefile(folder, output):
        raise UsageError.of("NCF005", "is also the folder of the programs", Place(output), "name another folder OUT")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    inputs = [path for path in (machine_path, *given.files) if path]
    verbosity = Verbosity.of(quiet, verbose)
    page = StatusPage(status)
    watched, watching = WatchedFolder(folder, output, settle_s), _Watching(folder, output, given, options, verbosity)
    known, worst = None, 0
    page.check(inputs)
    page.write()
    if page.lost:
        return ExitCode.USAGE
    try:
        for _ in moments(folder, inputs, settle_s, poll_s):
            now = tuple(map(state_of, inputs))
            if now != known:
                known = now
                watched.again()
            try:
                ready = watched.complete()
                if ready:
                    worst = max(worst, watching.corrected(machine_path, inputs, ready, page))
                page.trouble = ""
            except NcfixError as error:
                if str(error) != page.trouble:
                    console.tell(*error.messages)
                    page.trouble = str(error)
                    page.write()
                watched.again()
                worst = max(worst, error.exit_code)
                if once:
                    return worst
            if once and not watched.waiting:
                return worst
    except KeyboardInterrupt:
        console.say("stopped")
    return worst


@frozen
class _Watching:
    folder: str
    output: str
    given: SetupOptions
    options: Mapping[str, Any]
    verbosity: Verbosity

    def corrected(self, machine_path: str, inputs: Iterable[str], ready: list[str], page: StatusPage) -> int:
        """Correct the programs that are ready and report their results; returns the worst exit code."""
        from ncfix.batch.work import executor_of
        from ncfix.cli.shop.batch import Batch

        outputs = Outputs(os.path.join(self.output, ""), resume=True)
        wanted = targets([self.folder], outputs, [*inputs], folders=True, only=frozenset(ready))
        if not wanted:
            return 0
        batch = Batch(self._job(machine_path), wanted, self.output, True, False, self.verbosity, many=True)
        worst = 0
        executor = self.options["executor"]
        workers = workers_for(self.options["jobs"], wanted, executor)
        for outcome in batch.run(workers, executor_of(executor)):
            entry = outcome.entry
            if entry["output"] is not None and not entry.get("resumed") and self.verbosity == Verbosity.USUAL:
                console.say(f"{visible(entry['path'])} -> {visible(entry['output'])}")
            page.add(entry)
            worst = max(worst, outcome.code)
            page.write()
        return worst

    def _job(self, machine_path: str) -> FixJob:
        from ncfix.cli.shop.batch import FixJob, ProgramLimits
        from ncfix.compensate import FixOptions

        names = ("tolerance_um", "split_rapids", "flatten", "block_numbers", "allow_refused", "figures")
        chosen = {name: self.options[name] for name in names}
        strategy = "thesis" if self.options["thesis"] else self.options["strategy"]
        machine = sound(load_machine(machine_path), machine_path, force=False)
        limits = ProgramLimits(self.options["time_limit_s"], self.options["memory_limit_mb"])
        return FixJob(
            machine, self.given.load(machine), self.options["dialect"], FixOptions(strategy, **chosen), limits
        )
