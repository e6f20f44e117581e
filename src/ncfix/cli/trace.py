"""`ncfix trace`: the motions of a program as a table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from ncfix.cli import console
from ncfix.cli.completion import PATH
from ncfix.cli.following import Following
from ncfix.cli.options import (
    dialect_option,
    force_option,
    json_option,
    optional_machine_option,
    table_option,
)
from ncfix.cli.parts import Keep, Source, source_of
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.targets import Outputs, shown, targets
from ncfix.cli.through import dialect_in, parts_of, through
from ncfix.diagnostics import Message

if TYPE_CHECKING:
    from ncfix.cli.table import Columns
    from ncfix.control.moves import Moves
    from ncfix.machine import Machine
    from ncfix.text.tree import Program


@click.command()
@click.argument("program", type=PATH)
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
    with source_of(program) as source, ExitStack() as opened:
        csv = None if as_json and target.file is None else Keep(target.file, opened)
        motions = Motions(following, source, csv, Keep(None, opened) if as_json else None)
        with console.busy(f"following {shown(program)}"):
            table, messages = through([source], motions.in_parts, motions.whole)
        console.tell(*messages)
        if csv:
            target.write(table.csv)
        console.put_all(table.json)


class Texts(NamedTuple):
    """A table as text; empty in a form that is not asked for."""

    csv: Iterable[bytes]
    json: Iterable[bytes]


@dataclass(frozen=True, slots=True)
class Motions:
    """The motions of a program, to be written as a table: `csv`, `json`, or both."""

    following: Following
    source: Source
    csv: Keep | None
    json: Keep | None

    def written(self, tables: Iterable[Columns]) -> Texts:
        """The table as text."""
        from ncfix.cli.table import as_csv, as_json

        tables = list(tables) if self.csv and self.json else tables
        return Texts(
            self.csv(as_csv(tables)) if self.csv else (),
            self.json(as_json(tables, path=shown(self.source.path))) if self.json else (),
        )

    def in_parts(self) -> tuple[Texts, Sequence[Message]]:
        """The table and what there is to say, of a program that is read; raises what that does, `NotInPartsError`."""
        machine = self.following.machine
        parts, found = parts_of(self.following, self.source, dialect_in(self.following, self.source))
        table = self.written(table_of(part.program, part.moves, machine) for part in found)
        parts.blocks_behind()
        return table, parts.follower.messages

    def whole(self) -> tuple[Texts, Sequence[Message]]:
        """The same of a program as a whole."""
        path = self.source.path
        program = self.following.read(path, self.source.everything())
        found = self.following.trace(program, path)
        return self.written([table_of(program, found.moves, self.following.machine)]), found.messages


def table_of(program: Program, moves: Moves, machine: Machine | None) -> Columns:
    """The motions by columns, mm and degrees; the tip only where the machine is known."""
    from ncfix.cli.table import Words, named
    from ncfix.control.moves import FeedMode, Kind, Rule

    positions, tip = _positions(moves, machine)
    columns: Columns = {"line": program.lines(moves.block), "kind": named(Kind, moves.kind)}
    columns |= dict(zip(moves.axes, positions.T, strict=True))
    columns |= {f"tip_{name}": values for name, values in zip("xyz", tip.T, strict=False)}
    columns |= {"feed": moves.feed, "feed_mode": named(FeedMode, moves.feed_mode)}
    return columns | {"rule": named(Rule, moves.rule), "reason": Words(moves.reasons, moves.reason)}


def _positions(moves: Moves, machine: Machine | None) -> tuple[Any, Any]:
    """Axis positions at the ends of the motions, mm and degrees, and where the tip is in the workpiece, mm."""
    import numpy as np

    from ncfix.compensate.plan.kinematics import reached_joints

    if machine is None:
        q, tip = moves.end, np.empty((len(moves), 0))
    else:
        q, reached = reached_joints(machine, moves.end, moves.tcp, moves.tool_length)
        q = np.where(reached[:, None], q, np.nan)
        tip = machine.tip(q, moves.tool_length)
    return np.where(moves.rotary, np.degrees(q), q), tip
