"""`ncfix fix`: reads programs and writes corrected programs, on as many processes as `--jobs` says."""

from __future__ import annotations

import os
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING, Any

import click

from ncfix.arguments import BLOCK_NUMBERS
from ncfix.batch.programs import ProgramFile, program_files, subprograms
from ncfix.cli import console
from ncfix.cli.options import (
    PATH,
    OneOf,
    Positive,
    dialect_of,
    dialect_option,
    json_option,
    load_machine,
    machine_option,
    sound,
    tolerance_option,
)
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.shop.projects import ProjectCommand, after_next_groups, group_of, is_from_file, project_options
from ncfix.cli.targets import JSON, STREAM, Outputs, OutputTarget, check_streams, read, shown, targets
from ncfix.diagnostics import ExitCode, UsageError, visible
from ncfix.host import processors
from ncfix.plugins import registry

if TYPE_CHECKING:
    from ncfix.batch.work import ExecutorMaker
    from ncfix.cli.shop.batch import Batch, FixJob
    from ncfix.cli.shop.pages import Pages
    from ncfix.compensate.changes import Changes, MotionChange

BATCHES = "ncfix.batches"
"""Key in the context for the batches of preceding groups of programs."""
AUTO = 0
"""`--jobs auto` as a number: as many processes as are useful."""
CHANGE_COLUMNS = ("line", "axis", "from", "to", "change", "why")
"""Columns of `--diff-motions`."""
PAYS_BYTES = 8 << 20
"""Text size, bytes, per additional process: correcting it takes ten times as long as starting a process."""
PAYS_PROGRAMS = 8
"""Number of programs, besides the first, per additional process."""
ON_ONE = 8
"""Largest number of processes for a single program, since each of them reads all of it."""


class Jobs(click.IntRange):
    """A number of processes, or `auto`."""

    def __init__(self) -> None:
        super().__init__(1)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """The number, or `AUTO`."""
        return AUTO if value == "auto" else super().convert(value, param, ctx)


def workers_for(jobs: int, programs: Sequence[OutputTarget], executor: str) -> int:
    """Number of workers for these programs: as asked for, or as many as are useful, at most one per processor.

    For a cluster at least two, because a single one would be this process.
    """
    from ncfix.batch.work import SCHEME

    if executor.startswith(SCHEME):
        return max(jobs, 2)
    if jobs != AUTO:
        return jobs
    pay = sum(map(_size, programs)) / PAYS_BYTES + (len(programs) - 1) / PAYS_PROGRAMS
    return max(1, min(int(pay), processors(), ON_ONE if len(programs) == 1 else len(programs)))


def _size(target: OutputTarget) -> int:
    """Number of bytes of a program; 0 if unknown (a pipe, a missing file)."""
    if target.source == STREAM:
        return 0
    try:
        return os.stat(target.source).st_size
    except OSError:
        return 0


def _strategies() -> Iterable[str]:
    from ncfix.compensate.plan.strategies import strategies

    return strategies()


def _executors() -> Iterable[str]:
    from ncfix.batch.work import BUILT_IN

    return registry("executors", BUILT_IN)


@click.command(cls=ProjectCommand)
@click.argument("programs", type=PATH, nargs=-1, required=True, metavar="PROGRAM...")
@machine_option
@click.option(
    "-o",
    "--output",
    type=PATH,
    metavar="FILE|DIR",
    envvar="NCFIX_OUTPUT",
    help="Output file; a folder for several programs; - for standard output.",
)
@click.option("--in-place", is_flag=True, help="Replace PROGRAM by the result; the original becomes PROGRAM.orig.")
@click.option(
    "--force",
    is_flag=True,
    help="Replace outputs that exist, correct a program that is already corrected "
    "(stamped), use a machine file with impossible values.",
)
@click.option("--resume", is_flag=True, help="Continue a batch: skip programs that are done and have not changed.")
@click.option("--retry", is_flag=True, help="With --resume: also repeat programs that failed and have not changed.")
@click.option(
    "--strategy",
    type=OneOf(_strategies),
    default="rotary-then-linear",
    show_default=True,
    metavar="NAME",
    help="Strategy of correction: rotary-then-linear, position or full.",
)
@click.option("--thesis", is_flag=True, help="Use Ellingsdalen's algorithm as printed, without later corrections.")
@tolerance_option
@dialect_option
@setup_options
@click.option(
    "--split-rapids", is_flag=True, help="Keep the tolerance along rapid motions too, not only at their ends."
)
@click.option(
    "--flatten",
    is_flag=True,
    help="Write loops, subprograms and cycles out as single blocks where they cannot be corrected otherwise.",
)
@click.option(
    "--block-numbers",
    type=click.Choice(BLOCK_NUMBERS),
    default="same",
    show_default=True,
    help="Block numbers (Klartext): same or none for inserted blocks; renumber: number all blocks again (also "
    "SINUMERIK).",
)
@click.option(
    "--allow-refused", is_flag=True, help="Write the program although motions were refused; they stay uncorrected."
)
@click.option(
    "--report",
    "page",
    type=PATH,
    metavar="FILE.html",
    help="Write an HTML page of the program; for several programs, of the batch and of each program.",
)
@click.option("--plot", type=PATH, metavar="FILE.svg|png|pdf", help="Write a picture of the errors of one program.")
@click.option(
    "--certificate",
    is_flag=True,
    help="Prove the result with an independent reader; write its certificate beside the output.",
)
@click.option("--diff", is_flag=True, help="Print the changes of the text (unified diff); write nothing.")
@click.option(
    "--diff-motions",
    is_flag=True,
    help="Print the changes of each command, and the errors that cause them; write nothing.",
)
@click.option(
    "--no-figures",
    "figures",
    is_flag=True,
    flag_value=False,
    default=True,
    help="Do not compute the tip errors before and after.",
)
@click.option(
    "-j",
    "--jobs",
    type=Jobs(),
    default="auto",
    show_default="auto: as many as are useful",
    metavar="N|auto",
    help="Number of processes; the result does not depend on it.",
)
@click.option(
    "--executor",
    type=OneOf(_executors),
    default="processes",
    show_default=True,
    metavar="NAME",
    help="Where a batch runs: processes (this computer), dask://HOST:PORT, or an executor of a plugin.",
)
@click.option("--time-limit-s", type=Positive(), metavar="S", help="Time limit for one program, s.")
@click.option("--memory-limit-mb", type=click.IntRange(1), metavar="MB", help="Memory limit for one program, MB.")
@click.option("-q", "--quiet", is_flag=True, help="Print only the programs that were not written, and why.")
@click.option("-v", "--verbose", is_flag=True, help="Print everything about each program, also in a batch.")
@project_options
@json_option
@click.option(
    "--json-lines", is_flag=True, help="Print one JSON object on one line for each program as soon as it is done."
)
def fix(
    programs: tuple[str, ...],
    machine_path: str,
    output: str | None,
    in_place: bool,
    force: bool,
    resume: bool,
    retry: bool,
    page: str | None,
    plot: str | None,
    certificate: bool,
    diff: bool,
    diff_motions: bool,
    time_limit_s: float | None,
    memory_limit_mb: int | None,
    quiet: bool,
    verbose: bool,
    dialect: str | None,
    given: SetupOptions,
    jobs: int,
    executor: str,
    as_json: bool,
    json_lines: bool,
    **choices: Any,
) -> int:
    """Correct each PROGRAM for the errors of this machine; for a folder, all programs in it and below.

    PROGRAM itself is changed only with --in-place. Exit code 4: motions were refused and nothing was written.
    """
    from ncfix.batch.work import executor_of
    from ncfix.cli.shop.batch import Batch, FixJob, ProgramLimits
    from ncfix.cli.shop.summary import Verbosity

    if as_json and json_lines:
        raise UsageError.of("NCF001", "--json and --json-lines cannot be used together", hint="use one of them")
    if json_lines and (diff or diff_motions):
        raise UsageError.of("NCF001", "the changes are printed as text or as JSON, not both", hint="--json")
    if (diff or diff_motions) and (page or plot):
        raise UsageError.of("NCF001", "--diff writes no files, so also no page", hint="use one of them")
    if certificate and output == STREAM:
        raise UsageError.of("NCF001", "a certificate is written beside an output file", hint="-o FILE")
    if retry and not resume:
        raise UsageError.of("NCF001", "--retry needs --resume", hint="--resume --retry")
    context = click.get_current_context()
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # many small matrices: threads cost more than they give
    looks = diff or diff_motions
    outputs = _outputs(context, programs, Outputs(output, in_place, force, resume))
    inputs, only = (machine_path, *given.files), group_of(context).programs
    wanted = [] if looks else targets(programs, outputs, inputs, folders=True, only=only)
    for target in wanted:
        check_streams(JSON if as_json or json_lines else None, program=target)
    many = len(programs) > 1 or any(map(os.path.isdir, programs))
    pages: Pages | None = None
    if page is not None or plot is not None:
        from ncfix.cli.shop.pages import Pages

        pages = Pages.of(page, plot, many, force, wanted, inputs)
    from ncfix.compensate import FixOptions

    if choices.pop("thesis"):
        choices["strategy"] = "thesis"
    machine = sound(load_machine(machine_path), machine_path, force)
    options = FixOptions(**choices, force=force)
    limits = ProgramLimits(time_limit_s, memory_limit_mb)
    job = FixJob(machine, given.load(machine), dialect, options, limits, pages, verbose=verbose)
    if certificate:
        job = replace(job, certify=machine_path)
    if looks:
        return _changes(context, job, programs, outputs.folder(programs), diff_motions, as_json)
    verbosity = Verbosity.of(quiet, verbose)
    batch = Batch(job, wanted, outputs.folder(programs), resume, retry, verbosity)
    workers = workers_for(jobs, wanted, executor)
    batches = [*context.meta.get(BATCHES, ()), (batch, workers, executor_of(executor))]
    context.meta[BATCHES] = batches
    if (code := after_next_groups(context)) is not None:
        return code
    return _reported(batches, as_json, json_lines)


def like_fix(names: Container[str]) -> Callable[[click.Command], click.Command]:
    """Decorator that adds the named options of `fix` to another verb, after its own options."""

    def with_options(command: click.Command) -> click.Command:
        command.params += [param for param in fix.params if param.name in names]
        return command

    return with_options


def _outputs(context: click.Context, programs: Sequence[str], asked: Outputs) -> Outputs:
    """The outputs asked for; settings of the project file are dropped where they cannot apply."""
    base = group_of(context).folder if is_from_file(context, "output") else None
    output = None if base and (asked.in_place or programs == (STREAM,)) else asked.output
    outputs = replace(asked, output=output, base=base)
    if asked.resume and is_from_file(context, "resume") and outputs.folder(programs) is None:
        return replace(outputs, resume=False)
    return outputs


def _changes(
    context: click.Context, job: FixJob, programs: Sequence[str], apart: str | None, motions: bool, as_json: bool
) -> int:
    """Show what would change in these programs and in those of following groups; returns the worst exit code."""
    only, before = group_of(context).programs, context.meta.setdefault(BATCHES, [])
    wanted = [each for each in program_files(programs, apart) if only is None or each.path in only]
    before += [show_changes(job, each, motions, as_json) for each in wanted]
    if (code := after_next_groups(context)) is not None:
        return code
    if as_json:
        console.put_json(files=[entry for _, entry in before])
    return max(int(code) for code, _ in before)


def show_changes(job: FixJob, program: ProgramFile, motions: bool, as_json: bool) -> tuple[int, dict[str, Any]]:
    """Print what would change in a program; returns the exit code and the entry in the JSON object."""
    from ncfix.compensate.changes import Changes, as_plain
    from ncfix.text.reader import read as read_source

    path = program.path
    name = shown(path)
    entry: dict[str, Any] = {"path": name}
    if why := program.left_out:
        console.tell(why)
        return ExitCode.DONE, {**entry, "left_out": True, "changed": False, "motions": [], "refused": []}
    try:
        with console.busy(f"fixing {name}"):
            text = read(path)
            source = read_source(text, name, dialect_of(text, name, job.dialect, job.machine))
            find = subprograms(job.setup, path)
            changes = Changes.of(source, job.machine, job.setup, job.options, find)
            found = list(changes.motions())
    except Exception as error:
        own = console.owned(error)
        console.tell(*own.messages)
        return own.exit_code, {**entry, "errors": own.messages}
    report = changes.fixed.report
    refused = report.refusals
    console.tell_some([*report.warnings, *refused])
    if refused and not job.options.allow_refused:
        console.say(
            f"{visible(name)}: {console.counted(len(refused), 'motion')} refused, so `ncfix fix` would write nothing"
        )
        return ExitCode.REFUSED, {**entry, "changed": False, "motions": [], "refused": refused}
    if not as_json:
        _put_changes(changes, found, motions, text, name)
    entry |= {"changed": changes.fixed.changed, "motions": as_plain(found), "refused": []}
    return ExitCode.FINDINGS if changes.fixed.changed else ExitCode.DONE, entry


def _put_changes(changes: Changes, found: list[MotionChange], motions: bool, text: bytes, name: str) -> None:
    if not motions:
        console.put(b"".join(changes.unified(text, name, f"{name} (corrected)")))
        return
    if found:
        console.put(f"{visible(name)}\n")
        console.table(CHANGE_COLUMNS, [_change_row(each) for each in found])


def _change_row(each: MotionChange) -> tuple[str, ...]:
    digits, unit = (5, "mdeg") if each.rotary else (4, "um")
    places = (f"{value:.{digits}f}" for value in (each.before, each.after))
    return (str(each.line), each.axis, *places, f"{each.change:+.1f} {unit}", each.reason)


def _reported(batches: Sequence[tuple[Batch, int, ExecutorMaker]], as_json: bool, json_lines: bool) -> int:
    """Run batches one after the other and print their results in the form asked for; returns the worst exit code."""
    from ncfix.cli.shop.summary import OutcomeKind, Summary, Verbosity

    summary, entries, worst = Summary(), list[Mapping[str, Any]](), 0
    many = sum(len(batch.targets) for batch, _, _ in batches) > 1
    pages = batches[0][0].job.pages
    listed = pages if pages and pages.many and pages.page else None
    runs = (replace(batch, many=many).run(jobs, make) for batch, jobs, make in batches if batch.targets)
    for outcome in chain.from_iterable(runs):
        summary.add(outcome.entry)
        worst = max(worst, outcome.code)
        if json_lines:
            console.put(console.json_text(None, outcome=OutcomeKind.of(outcome.entry), **outcome.entry))
        if as_json or listed:
            entries.append(outcome.entry)
    if listed:
        listed.put_batch(entries)
    if many and batches[0][0].verbosity != Verbosity.QUIET:
        from ncfix.cli.listings import all_codes

        for line in summary.lines(all_codes()):
            console.say(line)
    if as_json:
        console.put_json(files=entries)
    if json_lines:
        console.put(console.json_text(None, summary=summary.as_dict()))
    return worst
