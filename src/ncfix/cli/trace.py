"""`ncfix trace`: the motions of a program as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.following import Following, lines_of
from ncfix.cli.options import (
    dialect_option,
    force_option,
    json_option,
    optional_machine_option,
    table_option,
)
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.table import Columns, as_csv, known
from ncfix.cli.targets import Outputs, shown, targets

if TYPE_CHECKING:
    from ncfix.machine import Machine
    from ncfix.program.moves import Moves
    from ncfix.program.tree import Program


@click.command()
@click.argument("program")
@optional_machine_option
@table_option
@force_option
@dialect_option
@setup_options
@json_option
def trace(
    program: str,
    machine_path: str | None,
    output: str,
    force: bool,
    dialect: str | None,
    given: SetupOptions,
    as_json: bool,
) -> None:
    """Print the motions of PROGRAM as a table: where each leads, in machine axes and at the tool tip."""
    (target,) = targets([program], Outputs(output, force=force), (machine_path, *given.files))
    following = Following.of(machine_path, dialect, given)
    with console.busy(f"following {shown(program)}"):
        source = following.read(program)
        found = following.trace(source, program)
        columns = table_of(source, found.moves, following.machine)
    console.tell(*found.messages)
    if as_json:
        console.put_json(path=shown(program), columns=list(columns), rows=list(zip(*columns.values(), strict=True)))
    else:
        target.write(as_csv(columns))


def table_of(program: Program, moves: Moves, machine: Machine | None) -> Columns:
    """The motions by columns, mm and degrees; the tip only where the machine is known."""
    from ncfix.program.moves import FeedMode, Kind, Rule

    positions, tip = _positions(moves, machine)
    columns: Columns = {
        "line": lines_of(program, moves.block),
        "kind": [Kind(kind).name.lower() for kind in moves.kind],
    }
    columns |= {name: known(values) for name, values in zip(moves.axes, positions.T, strict=True)}
    columns |= {f"tip_{name}": known(values) for name, values in zip("xyz", tip.T, strict=False)}
    columns["feed"] = known(moves.feed)
    columns["feed_mode"] = [FeedMode(mode).name.lower() for mode in moves.feed_mode]
    columns["rule"] = [Rule(rule).name.lower() for rule in moves.rule]
    columns["reason"] = [moves.reasons[reason] for reason in moves.reason]
    return columns


def _positions(moves: Moves, machine: Machine | None) -> tuple[Any, Any]:
    """Axis positions at the ends of the motions, mm and degrees, and where the tip is in the workpiece, mm."""
    import numpy as np

    from ncfix.compensate.kinematics import reached_joints

    if machine is None:
        q, tip = moves.end, np.empty((len(moves), 0))
    else:
        q, reached = reached_joints(machine, moves.end, moves.tcp, moves.tool_length)
        q = np.where(reached[:, None], q, np.nan)
        tip = machine.tip(q, moves.tool_length)
    return np.where(moves.rotary, np.degrees(q), q), tip
