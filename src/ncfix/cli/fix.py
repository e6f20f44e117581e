"""`ncfix fix`: programs in, corrected programs out."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from ncfix import fast
from ncfix.cli import console
from ncfix.cli.options import (
    dialect_of,
    dialect_option,
    json_option,
    load_machine,
    machine_option,
    subprograms,
    tolerance_option,
)
from ncfix.cli.parts import Fixed, Outlet, Source, outlet_for, part_bytes, source_of
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.targets import STREAM, Target, shown, targets
from ncfix.diagnostics import ExitCode, Message, NcfixError, Place, UsageError

if TYPE_CHECKING:
    from ncfix.compensate.options import FixOptions
    from ncfix.compensate.stream import Stream
    from ncfix.machine import Machine
    from ncfix.program.dialect import Dialect
    from ncfix.program.setup import Setup


@click.command()
@click.argument("programs", nargs=-1, required=True, metavar="PROGRAM...")
@machine_option
@click.option("-o", "--output", metavar="FILE|DIR", help="Where to write; a folder for many programs; - for stdout.")
@click.option("--in-place", is_flag=True, help="Put the result in PROGRAM's place and keep that as PROGRAM.orig.")
@click.option("--force", is_flag=True, help="Replace an existing output; correct a program that carries a stamp.")
@click.option(
    "--strategy", default="rotary-then-linear", show_default=True, metavar="NAME", help="Or position, or full."
)
@click.option("--thesis", is_flag=True, help="Ellingsdalen's printed algorithm, without the corrections to it.")
@tolerance_option
@dialect_option
@setup_options
@click.option("--split-rapids", is_flag=True, help="Hold the tolerance along rapids too, not only at their ends.")
@click.option("--flatten", is_flag=True, help="Write loops, subprograms and cycles out where they cannot be corrected.")
@click.option(
    "--block-numbers",
    type=click.Choice(["same", "none", "renumber"]),
    default="same",
    show_default=True,
    help="Klartext: of blocks that are put in, or all blocks anew.",
)
@click.option("--allow-refused", is_flag=True, help="Write the program even if motions had to be left uncorrected.")
@click.option("--no-figures", "verify", is_flag=True, flag_value=False, default=True, help="Leave out the tip errors.")
@click.option(
    "--jobs",
    type=click.IntRange(1),
    default=1,
    show_default=True,
    metavar="N",
    help="Processes that work on a long program; the result is the same.",
)
@json_option
def fix(
    programs: tuple[str, ...],
    machine_path: str,
    output: str | None,
    in_place: bool,
    force: bool,
    dialect: str | None,
    given: SetupOptions,
    jobs: int,
    as_json: bool,
    **choices: Any,
) -> int:
    """Rewrite each PROGRAM so that this machine cuts what was meant.

    Programs are never changed where they are unless --in-place says so. Exit code 4: motions were refused and nothing
    was written.
    """
    found = targets(programs, output, in_place, force, (machine_path, *given.files))
    if as_json and any(target.path == STREAM for target in found):
        text = "the program and the JSON object would both go to standard output"
        raise UsageError.of("NCF010", text, hint="-o FILE")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # many small matrices: threads cost more than they give
    job = _job(machine_path, dialect, given, jobs, {**choices, "force": force})
    outcomes = [job.outcome(target) for target in found]
    if as_json:
        console.put_json(files=[outcome.entry for outcome in outcomes])
    return max(outcome.code for outcome in outcomes)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of one program: its exit code and its entry in the JSON object."""

    code: int
    entry: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Job:
    """What is the same for all programs."""

    machine: Machine
    setup: Setup
    dialect: str | None
    options: FixOptions
    jobs: int = 1

    def outcome(self, target: Target) -> Outcome:
        """Fix one program and say what came of it; an error ends this program only."""
        try:
            with console.busy(f"fixing {shown(target.source)}"), self.fixed(target) as fixed:
                return _written(fixed, target, self.options.allow_refused)
        except NcfixError as error:
            console.tell(*error.messages)
            entry = {"path": shown(target.source), "output": None}
            return Outcome(error.exit_code, {**entry, "errors": [message.as_dict() for message in error.messages]})

    @contextmanager
    def fixed(self, target: Target) -> Iterator[Fixed]:
        """The corrected program; a long one is corrected while it is read, if it can be."""
        with source_of(target.source) as source:
            head, long = source.looked_into()
            if not long or self.options.flatten:
                yield self._whole(source, source.everything() if long else head)
                return
            dialect = dialect_of(head, shown(target.source), self.dialect, self.machine)
            with self._outlet(source, target, dialect) as (stream, outlet):
                yield self._in_parts(source, stream, outlet)

    def _whole(self, source: Source, text: bytes) -> Fixed:
        from ncfix.compensate.fix import fix_program
        from ncfix.compensate.flat import fix_flat
        from ncfix.program.reader import read

        path = shown(source.path)
        program = read(text, path, dialect_of(text, path, self.dialect, self.machine))
        fix = fix_flat if self.options.flatten else fix_program
        fixed = fix(program, self.machine, self.setup, self.options, resolve=subprograms(source.path))
        return Fixed(fixed.text, fixed.changed, fixed.report)

    @contextmanager
    def _outlet(self, source: Source, target: Target, dialect: Dialect) -> Iterator[tuple[Stream, Outlet]]:
        from ncfix.compensate.stream import Stream

        fast.engage()
        path, found = shown(source.path), subprograms(source.path)
        with outlet_for(target, not self.setup.assume_zero, lambda: bool(stream.stamped)) as outlet:
            stream = Stream(
                self.machine,
                self.setup,
                self.options,
                found,
                path,
                dialect,
                source.read,
                outlet.put,
                part_bytes(),
                self.jobs,
            )
            yield stream, outlet

    def _in_parts(self, source: Source, stream: Stream, outlet: Outlet) -> Fixed:
        from ncfix.program.parts import NotInPartsError

        try:
            done = stream.run()
        except NotInPartsError:
            fixed = self._whole(source, source.everything())
            assert isinstance(fixed.text, bytes)
            return Fixed(outlet.after(fixed.text, source.path), fixed.changed, fixed.report)
        return Fixed(outlet.remaining(done.stamp), done.report.changed, done.report)


def _job(machine_path: str, dialect: str | None, setup: SetupOptions, jobs: int, choices: dict[str, Any]) -> Job:
    from ncfix.compensate.options import FixOptions

    if choices.pop("thesis"):
        choices["strategy"] = "thesis"
    return Job(load_machine(machine_path), setup.load(), dialect, FixOptions(**choices), jobs)


def _written(fixed: Fixed, target: Target, allow_refused: bool) -> Outcome:
    entry: dict[str, Any] = fixed.report.as_dict()
    console.tell_some([*fixed.report.warnings, *_refusals(target.source, entry["refused"])])
    refused = bool(entry["refused"]) and not allow_refused
    if not refused:
        _write(fixed, target)
        entry["output"] = target.path
    for line in _summary(entry, refused):
        console.say(line)
    return Outcome(ExitCode.REFUSED if refused else ExitCode.DONE, entry)


def _write(fixed: Fixed, target: Target) -> None:
    if target.in_place and not fixed.changed:
        return
    target.write(fixed.text)


def _refusals(source: str, refused: Sequence[dict[str, Any]]) -> list[Message]:
    return [Message(each["code"], each["reason"], Place(shown(source), each["line"])) for each in refused]


def _summary(entry: dict[str, Any], refused: bool) -> list[str]:
    """What was done, for people."""
    output = "nothing written" if refused else "<stdout>" if entry["output"] == STREAM else entry["output"]
    counts = f"{entry['compensated']} corrected, {entry['passed']} passed by rule, {len(entry['refused'])} refused"
    lines = [
        f"{entry['path']} -> {output}",
        f"  motion blocks       {counts}; {entry['inserted_blocks']} inserted",
        f"  largest correction  {entry['max_correction_um']:.1f} um",
    ]
    if entry["error_before_um"]:
        without = "; without what is refused" if entry["refused"] else ""
        lines.append(f"  tip error before    {console.error_figures(entry['error_before_um'])}{without}")
        lines.append(f"  tip error after     {console.error_figures(entry['error_after_um'])}{without}")
    if entry["leaves"]:
        lines.append(f"  {entry['strategy']}: {entry['leaves']}")
    return lines
