"""`ncfix simulate`: what the errors of a machine do to a program, or to a measurement."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.following import Following, figures, lines_of
from ncfix.cli.options import FiniteRange, dialect_option, force_option, json_option, load_machine, machine_option
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.table import as_csv, known
from ncfix.cli.targets import STREAM, Outputs, read, shown, targets

if TYPE_CHECKING:
    from ncfix.compensate.simulation import TipError
    from ncfix.measure.synthetic import Faults

NOT_NEGATIVE = FiniteRange(min=0.0, max=1e6)


@click.command()
@machine_option
@click.option("--program", metavar="FILE", help="The program that the machine runs.")
@click.option("--plan", metavar="FILE", help="Poses to be measured, as `ncfix plan` writes them (CSV).")
@click.option("--noise-um", type=NOT_NEGATIVE, default=0.0, help="Noise of a measured length (with --plan).")
@click.option("--drift-um", type=NOT_NEGATIVE, default=0.0, help="Largest drift over the measurement (with --plan).")
@click.option("--quantum-um", type=NOT_NEGATIVE, default=0.0, help="Step of the instrument (with --plan).")
@click.option("--setup-error", type=NOT_NEGATIVE, default=1.0, help="How far the set-up is off (with --plan).")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Other numbers, other noise (with --plan).")
@click.option("-o", "--output", metavar="FILE", help="Write the error along the path, or the measurement (CSV).")
@force_option
@dialect_option
@setup_options
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
    """Say how far the tool tip of this machine is from where the program means it to be, along the whole path.

    With --plan: fill in a measurement plan as this machine would be measured, with noise and the faults of measuring.
    """
    if (program is None) == (plan is None):
        raise click.UsageError("give either --program or --plan")
    if plan is not None:
        from ncfix.measure.synthetic import Faults

        faults = Faults(noise_um, None, drift_um, quantum_um, setup_error)
        _simulate_plan(machine_path, plan, faults, seed, output, force, as_json)
        return
    assert program is not None
    inputs = (machine_path, *given.files)
    target = targets([program], Outputs(output, force=force), inputs)[0] if output else None
    following = Following.of(machine_path, dialect, given)
    with console.busy(f"simulating {shown(program)}"):
        source, moves, error = following.simulated(program)
    if target:
        target.write(as_csv(_columns(error, lines_of(source, moves.block))))
    found = figures(error, lines_of(source, moves.block))
    if as_json:
        console.put_json(path=shown(program), error_um=found, output=target.path if target else None)
    elif not target or target.path != "-":
        console.put(f"tip error: {console.error_figures(found)}\n")


def _simulate_plan(
    machine_path: str, plan: str, faults: Faults, seed: int, output: str | None, force: bool, as_json: bool
) -> None:
    """Fill in a plan."""
    from ncfix.measure.reader import reads
    from ncfix.measure.synthetic import simulate as filled
    from ncfix.measure.writer import dumps

    target = targets([plan], Outputs(output or STREAM, force=force), (machine_path,))[0]
    machine = load_machine(machine_path)
    measurement = reads(read(plan), machine, shown(plan), plan=True)
    console.tell(*measurement.remarks)
    found = filled(measurement, machine, faults, seed)
    if as_json:
        columns = {name: values for name, values in found.columns.items() if name in found.measured}
        console.put_json(path=shown(plan), rows=len(found), kind=found.kind, measured=columns, output=output)
        if output is None:
            return
    target.write(dumps(found).encode())


def _columns(error: TipError, lines: list[int]) -> dict[str, list[Any]]:
    """The samples by columns: intended tip in mm, error in um."""
    gap_um = 1e3 * (error.actual - error.intended)
    columns: dict[str, list[Any]] = {"line": [lines[row] for row in error.rows], "fraction": known(error.fraction)}
    columns |= {f"tip_{name}": known(values) for name, values in zip("xyz", error.intended.T, strict=True)}
    columns |= {f"d{name}_um": known(values) for name, values in zip("xyz", gap_um.T, strict=True)}
    return {**columns, "error_um": known(1e3 * error.size)}
