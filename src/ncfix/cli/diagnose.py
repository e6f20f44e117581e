"""`ncfix diagnose`: why a machine disagrees with its model."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from ncfix.cli import console
from ncfix.cli.completion import PATH
from ncfix.cli.options import force_option, json_option, load_machine, machine_option, sound
from ncfix.cli.targets import STREAM, Outputs, check_streams, each_once, read, shown, targets
from ncfix.diagnostics import ExitCode

if TYPE_CHECKING:
    from ncfix.cli.targets import Target
    from ncfix.diagnose.diagnosis import Diagnosis


@click.command()
@click.argument("measured", type=PATH, nargs=-1, required=True)
@machine_option
@click.option(
    "-o", "--output", type=PATH, metavar="FILE", help="Where to write the machine with the effects added (TOML)."
)
@click.option("--without", multiple=True, metavar="NAME", help="An effect that is not to be considered (repeatable).")
@click.option(
    "--next", "next_path", type=PATH, metavar="FILE", help="Write the poses to be measured next: CSV, else a program."
)
@click.option("--report", type=PATH, metavar="FILE", help="Write a report with figures (HTML or Markdown).")
@click.option("--check", is_flag=True, help="Exit code 1 if anything is missing.")
@force_option
@json_option
def diagnose(
    measured: tuple[str, ...],
    machine_path: str,
    output: str | None,
    without: tuple[str, ...],
    next_path: str | None,
    report: str | None,
    check: bool,
    force: bool,
    as_json: bool,
) -> int:
    """Say where machine and model disagree, name the effect that is missing, and add it to the model."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # many small matrices: threads cost more than they give
    from ncfix.diagnose import result, words
    from ncfix.diagnose.checks import remarks
    from ncfix.diagnose.diagnosis import NOTHING
    from ncfix.diagnose.diagnosis import diagnose as diagnosed
    from ncfix.machine import dumps
    from ncfix.measure.reader import reads
    from ncfix.report.diagnosis import document
    from ncfix.report.forms import form_of

    each_once(measured)
    inputs = (*measured, machine_path)
    machine_target, next_target, page_target = (_target(path, force, inputs) for path in (output, next_path, report))
    check_streams("what was found", machine=machine_target, poses=next_target, report=page_target)
    form = form_of(report) if report is not None else None
    machine = load_machine(machine_path)
    data = [reads(read(path), machine, shown(path)) for path in measured]
    for each in data:
        console.tell_some(each.remarks)
    with console.busy("diagnosing"):
        diagnosis = diagnosed(data, machine, without)
    console.tell(*remarks(diagnosis.view, diagnosis.case.unheard_of))
    written = None
    if machine_target is not None and diagnosis.machine is not None:
        sound(diagnosis.machine, machine_target.path, force)
        machine_target.write(dumps(result.with_provenance(diagnosis)).encode())
        written = machine_target.path
    if next_target is not None:
        _write_next(diagnosis, next_target)
    if page_target is not None and form is not None:
        page_target.write(form(document(diagnosis)))
    if as_json:
        console.put_json(**result.as_dict(diagnosis, written))
    else:
        console.put(words.text(diagnosis))
        _say_written(diagnosis, output, written)
    return ExitCode.FINDINGS if check and diagnosis.verdict != NOTHING else ExitCode.DONE


def _target(path: str | None, force: bool, inputs: Sequence[str]) -> Target | None:
    """Where an output goes that was asked for; none of the inputs."""
    return targets([STREAM], Outputs(path, force=force), inputs)[0] if path is not None else None


def _write_next(diagnosis: Diagnosis, target: Target) -> None:
    from ncfix.measure.program import skeleton
    from ncfix.measure.writer import dumps

    if diagnosis.proposal is None or diagnosis.proposal.plan is None:
        console.say("no further poses are proposed")
        return
    plan = diagnosis.proposal.plan
    table = target.path.endswith(".csv")
    target.write((dumps(plan, ("dx", "dy", "dz")) if table else skeleton(plan, diagnosis.view.machine)).encode())


def _say_written(diagnosis: Diagnosis, output: str | None, written: str | None) -> None:
    if output and written is None:
        wrong = "; constants that are wrong are for `ncfix calibrate`" if diagnosis.moved else ""
        console.say(f"no machine file was written: there is nothing to add to the model{wrong}")
