"""`ncfix simulate`: the effect of a machine's errors on a program or a measurement."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack
from itertools import chain
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

import ncfix
from ncfix.arguments import FAULT, SEED
from ncfix.cli import console
from ncfix.cli.following import FollowingSetup, dialect_in, task_of, tell_of_stamp, through
from ncfix.cli.options import PATH, dialect_option, force_option, json_option, load_machine, machine_option, numbers
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.shop.projects import TableCommand, project_options
from ncfix.cli.streams import HeldOutput, Source, source_of
from ncfix.cli.targets import JSON, STREAM, Outputs, OutputTarget, check_streams, read, shown, targets
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.cli.columns import Columns
    from ncfix.compensate.figures.simulation import SimulatedErrors, TipError
    from ncfix.diagnostics import Message
    from ncfix.measure.instruments import Faults

NOT_NEGATIVE = numbers(FAULT)
OF_PLANS = ("noise_um", "drift_um", "quantum_um", "setup_error", "seed")
"""Options that do not apply to a program."""


@click.command(cls=TableCommand)
@machine_option
@click.option("--program", type=PATH, metavar="FILE", help="Program that the machine runs.")
@click.option("--plan", type=PATH, metavar="FILE", help="Measurement plan to fill in, as `ncfix plan` writes it (CSV).")
@click.option(
    "--noise-um",
    type=NOT_NEGATIVE,
    default=0.0,
    help="Standard deviation of a measured length, um (with --plan; default 0).",
)
@click.option(
    "--drift-um",
    type=NOT_NEGATIVE,
    default=0.0,
    help="Largest drift of a length over the measurement, um (with --plan; default 0).",
)
@click.option(
    "--quantum-um", type=NOT_NEGATIVE, default=0.0, help="Resolution of the instrument, um (with --plan; default 0)."
)
@click.option(
    "--setup-error",
    type=NOT_NEGATIVE,
    default=1.0,
    help="Size of the unknown set-up: 1 as usual for the instrument (default), 0 none (with --plan).",
)
@click.option("--seed", type=numbers(SEED), default=0, help="Seed of the noise (with --plan; default 0).")
@click.option(
    "-o",
    "--output",
    type=PATH,
    metavar="FILE",
    help="File for the error along the path, or for the filled-in measurement (CSV).",
)
@force_option
@dialect_option
@setup_options
@project_options
@json_option
def simulate(
    machine_path: str,
    program: str | None,
    plan: str | None,
    noise_um: float,
    drift_um: float,
    quantum_um: float,
    setup_error: float,
    seed: int,
    output: str | None,
    force: bool,
    dialect: str | None,
    given: SetupOptions,
    as_json: bool,
) -> None:
    """Compute the error of the tool tip along the whole path of an uncorrected program.

    With --plan: fill in a measurement plan with simulated readings of this machine, with noise and drift.
    """
    if (program is None) == (plan is None):
        raise click.UsageError("give --program or --plan, and only one of them")
    _check_apt(of_plan=plan is not None, of_program=dialect is not None or given != SetupOptions())
    if plan is not None:
        from ncfix.measure.instruments import Faults

        faults = Faults(noise_um, None, drift_um, quantum_um, setup_error)
        _simulate_plan(machine_path, plan, faults, seed, output, force, as_json)
    elif program is not None:
        inputs = (machine_path, *given.files)
        target = targets([program], Outputs(output, force=force), inputs)[0] if output else None
        check_streams(JSON if as_json else None, table=target)
        _simulate_program(FollowingSetup.of(machine_path, dialect, given), program, target, as_json)


def _simulate_program(following: FollowingSetup, program: str, target: OutputTarget | None, as_json: bool) -> None:
    """Print the errors along a program, and write them as a table if wanted."""
    with source_of(program) as source, ExitStack() as opened:
        errors = Errors(following, source, HeldOutput(target.file, opened) if target else None)
        with console.busy(f"simulating {shown(program)}"):
            table, along, messages = through([source], errors.in_parts, errors.whole)
        tell_of_stamp(source)
        console.tell_some(messages)
        if target:
            target.write(table)
    found = along.figures()
    if as_json:
        console.put_json(path=shown(program), error_um=found, output=target.path if target else None)
    elif not target or target.path != STREAM:
        console.put(f"tip error: {console.error_figures(found)}\n")


def _check_apt(of_plan: bool, of_program: bool) -> None:
    """Refuse options that do not apply."""
    context = click.get_current_context()
    named = [name for name in OF_PLANS if context.get_parameter_source(name) is ParameterSource.COMMANDLINE]
    if named and not of_plan:
        raise click.UsageError(f"--{named[0].replace('_', '-')} is for a measurement (--plan), not for a program")
    if of_plan and of_program:
        raise click.UsageError(
            "--dialect and the options of the setup are for a program; a plan has columns for inputs (temp_x, ...)"
        )


@frozen
class Errors:
    """The errors along the path of a program; `keep` stores their table, if wanted."""

    following: FollowingSetup
    source: Source
    keep: HeldOutput | None

    def in_parts(self) -> tuple[Iterable[bytes], SimulatedErrors, Sequence[Message]]:
        """The table, the figures and the messages of a program while it is read.

        Raises errors of reading, and `NotInPartsError`.
        """
        from ncfix.compensate.figures.simulation import tip_errors_on

        task = task_of(self.following, self.source, dialect_in(self.following, self.source))
        messages: list[Message] = []
        table, along = self._gone_along(tip_errors_on(task, self.source.read, messages), self.keep)
        return table, along, messages

    def whole(self) -> tuple[Iterable[bytes], SimulatedErrors, Sequence[Message]]:
        """The table, the figures and the messages of a program read as a whole."""
        from ncfix.compensate.figures.simulation import tip_errors_of

        path = self.source.path
        program = self.following.read(path, self.source.everything())
        found = self.following.on_machine(program, path)
        table, along = self._gone_along(tip_errors_of(program, found), self.keep and list)
        return table, along, found.trace.messages

    def _gone_along(
        self, errors: Iterable[TipError], keep: Callable[[Iterable[bytes]], Iterable[bytes]] | None
    ) -> tuple[Iterable[bytes], SimulatedErrors]:
        from ncfix.cli.columns import as_csv
        from ncfix.compensate.figures.simulation import SimulatedErrors, TipError

        along = SimulatedErrors()
        tables = map(_columns, chain([TipError.none()], along.adding(errors)))
        if keep:
            return keep(as_csv(tables)), along
        deque(tables, maxlen=0)
        return (), along


def _simulate_plan(
    machine_path: str, plan: str, faults: Faults, seed: int, output: str | None, force: bool, as_json: bool
) -> None:
    """Fill in a measurement plan."""
    from ncfix.measure.measurement import dumps
    from ncfix.measure.reader import reads

    target = targets([plan], Outputs(output or STREAM, force=force), (machine_path,))[0]
    check_streams(JSON if as_json and output is not None else None, measurement=target)
    machine = load_machine(machine_path)
    measurement = reads(read(plan), machine, shown(plan), plan=True)
    console.tell(*measurement.remarks)
    found = ncfix.simulate(measurement, machine, faults=faults, seed=seed)
    if as_json:
        columns = {name: values for name, values in found.columns.items() if name in found.measured}
        console.put_json(path=shown(plan), rows=len(found), kind=found.kind, measured=columns, output=output)
        if output is None:
            return
    target.write(dumps(found).encode())


def _columns(error: TipError) -> Columns:
    """The samples as columns: intended tip in mm, error in um."""
    gap_um = 1e3 * (error.actual - error.intended)
    columns: Columns = {"line": error.lines, "fraction": error.fraction}
    columns |= {f"tip_{name}": values for name, values in zip("xyz", error.intended.T, strict=True)}
    columns |= {f"d{name}_um": values for name, values in zip("xyz", gap_um.T, strict=True)}
    return {**columns, "error_um": 1e3 * error.size}
