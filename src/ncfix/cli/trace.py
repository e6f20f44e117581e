"""`ncfix trace`: the motions of a program as a table."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.following import lines_of, read_and_follow
from ncfix.cli.options import (
    dialect_option,
    force_option,
    json_option,
    load_machine,
    optional_machine_option,
    table_option,
)
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.targets import shown, targets

if TYPE_CHECKING:
    from ncfix.machine import Machine
    from ncfix.program.moves import Moves
    from ncfix.program.tree import Program

Columns = dict[str, list[Any]]
"""Name -> values, one per motion; None for what is not known."""


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
    (target,) = targets([program], output, in_place=False, force=force)
    machine = load_machine(machine_path) if machine_path else None
    with console.busy(f"following {shown(program)}"):
        source, found = read_and_follow(program, dialect, given.load(), machine)
        columns = table_of(source, found.moves, machine)
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
    columns |= {name: _known(values) for name, values in zip(moves.axes, positions.T, strict=True)}
    columns |= {f"tip_{name}": _known(values) for name, values in zip("xyz", tip.T, strict=False)}
    columns["feed"] = _known(moves.feed)
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


def _known(values: Any) -> list[float | None]:
    """Numbers, with None for what is not known; without noise in digits that no control has."""
    return [None if value != value else round(value, 9) + 0.0 for value in values.tolist()]


def as_csv(columns: Columns) -> bytes:
    """A table as comma-separated text with a header; empty cells for what is not known."""
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(_cell, row)) for row in rows)]
    return "".join(f"{line}\n" for line in lines).encode()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    text = repr(value) if isinstance(value, float) else str(value)
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\n') else text
