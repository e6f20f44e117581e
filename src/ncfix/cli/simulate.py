"""`ncfix simulate`: what the errors of a machine do to a program."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.following import Following, figures, lines_of
from ncfix.cli.options import dialect_option, force_option, json_option, machine_option
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.table import as_csv, known
from ncfix.cli.targets import shown, targets

if TYPE_CHECKING:
    from ncfix.compensate.simulation import TipError


@click.command()
@machine_option
@click.option("--program", required=True, metavar="FILE", help="The program that the machine runs.")
@click.option("-o", "--output", metavar="FILE", help="Write the error along the path there (CSV).")
@force_option
@dialect_option
@setup_options
@json_option
def simulate(
    machine_path: str,
    program: str,
    output: str | None,
    force: bool,
    dialect: str | None,
    given: SetupOptions,
    as_json: bool,
) -> None:
    """Say how far the tool tip of this machine is from where the program means it to be, along the whole path."""
    inputs = (machine_path, *given.files)
    target = targets([program], output, False, force, inputs)[0] if output else None
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


def _columns(error: TipError, lines: list[int]) -> dict[str, list[Any]]:
    """The samples by columns: intended tip in mm, error in um."""
    gap_um = 1e3 * (error.actual - error.intended)
    columns: dict[str, list[Any]] = {"line": [lines[row] for row in error.rows], "fraction": known(error.fraction)}
    columns |= {f"tip_{name}": known(values) for name, values in zip("xyz", error.intended.T, strict=True)}
    columns |= {f"d{name}_um": known(values) for name, values in zip("xyz", gap_um.T, strict=True)}
    return {**columns, "error_um": known(1e3 * error.size)}
