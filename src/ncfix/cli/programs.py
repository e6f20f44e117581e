"""Verbs that examine programs and write none: `ncfix check` finds errors, `ncfix trace` lists motions."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from ncfix.batch.programs import ProgramFile, program_files
from ncfix.cli import console
from ncfix.cli.following import FollowingSetup, dialect_in, parts_of, task_of, through
from ncfix.cli.options import PATH, dialect_option, force_option, json_option, optional_machine_option, table_option
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.shop.projects import ProjectCommand, TableCommand, after_next_groups, group_of, project_options
from ncfix.cli.streams import HeldOutput, Source, source_of
from ncfix.cli.targets import Outputs, shown, targets
from ncfix.diagnostics import ExitCode, Message, NcfixError, UsageError, visible
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.cli.columns import Columns
    from ncfix.compensate.checking import Checked
    from ncfix.control.moves import Moves
    from ncfix.machine import Machine
    from ncfix.text.tree import Program


OUTCOMES = "ncfix.outcomes"
"""Key in the context for the results of preceding groups of programs."""
Found = tuple["Checked", str]
"""The findings in a program, and the name of its dialect."""


def _in_parts(following: FollowingSetup, source: Source) -> Found:
    """Check a program while it is read; raises errors of reading, and `NotInPartsError`."""
    from ncfix.compensate.checking import survey_alone, survey_on

    dialect = dialect_in(following, source)
    if following.machine is None:
        return survey_alone(*parts_of(following, source, dialect)), dialect.name
    return survey_on(task_of(following, source, dialect), source.read), dialect.name


def _whole(following: FollowingSetup, source: Source, flatten: bool) -> Found:
    program = following.read(source.path, source.everything())
    return following.checked(program, source.path, flatten), program.dialect.name


@click.command(cls=ProjectCommand)
@click.argument("programs", type=PATH, nargs=-1, required=True, metavar="PROGRAM...")
@optional_machine_option
@dialect_option
@setup_options
@click.option(
    "--flatten", is_flag=True, help="With a machine file: find what `ncfix fix --flatten` would still refuse."
)
@project_options
@json_option
def check(
    programs: tuple[str, ...],
    machine_path: str | None,
    dialect: str | None,
    given: SetupOptions,
    flatten: bool,
    as_json: bool,
) -> int:
    """Read each PROGRAM and follow it as the control would; for a folder, all programs in it and below. Writes nothing.

    With a machine file it also checks the travel, and lists what a correction would refuse. Exit code 1: there are
    findings.
    """
    following = FollowingSetup.of(machine_path, dialect, given)
    if flatten and following.machine is None:
        raise UsageError.of(
            "NCF001", "--flatten needs a machine file: without one nothing is corrected", hint="-m FILE"
        )
    context = click.get_current_context()
    only, outcomes = group_of(context).programs, context.meta.setdefault(OUTCOMES, [])
    wanted = (each for each in program_files(programs) if only is None or each.path in only)
    outcomes += [_outcome(following, each, flatten) for each in wanted]
    if (code := after_next_groups(context)) is not None:
        return code
    if as_json:
        console.put_json(files=[entry for _, entry in outcomes])
    return max(int(code) for code, _ in outcomes)


def _outcome(following: FollowingSetup, file: ProgramFile, flatten: bool) -> tuple[int, dict[str, Any]]:
    """Check one program: the exit code, and its entry in the JSON object."""
    path = file.path
    entry: dict[str, Any] = {"path": shown(path)}
    if why := file.left_out:
        console.tell(why)
        return ExitCode.DONE, {**entry, "left_out": True, "findings": []}
    try:
        with console.busy(f"checking {shown(path)}"), source_of(path) as source:
            whole = partial(_whole, following, source, flatten)
            checked, dialect = through([source], whole if flatten else partial(_in_parts, following, source), whole)
    except NcfixError as error:
        console.tell(*error.messages)
        return error.exit_code, {**entry, "errors": error.messages}
    console.tell_some(checked.findings)
    count = len(checked.findings)
    verdict = console.counted(count, "finding") if count else "nothing found"
    verdict += "" if following.machine else ", without a machine"
    size = f"{console.counted(checked.blocks, 'block')}, {console.counted(checked.moves, 'motion')}"
    console.say(f"{visible(shown(path))}: {size}, {dialect}: {verdict}")
    entry |= {"dialect": dialect, "blocks": checked.blocks, "moves": checked.moves, "findings": checked.findings}
    return ExitCode.FINDINGS if count else ExitCode.DONE, entry


@click.command(cls=TableCommand)
@click.argument("program", type=PATH)
@optional_machine_option
@table_option
@force_option
@dialect_option
@setup_options
@project_options
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
    """Print the motions of PROGRAM as a table, with the end of each in machine axes and at the tool tip."""
    (target,) = targets([program], Outputs(output, force=force), (machine_path, *given.files))
    following = FollowingSetup.of(machine_path, dialect, given)
    with source_of(program) as source, ExitStack() as opened:
        csv = None if as_json and target.file is None else HeldOutput(target.file, opened)
        motions = Motions(following, source, csv, HeldOutput(None, opened) if as_json else None)
        with console.busy(f"following {shown(program)}"):
            table, messages = through([source], motions.in_parts, motions.whole)
        console.tell(*messages)
        if csv:
            target.write(table.csv)
        console.put_all(table.json)


class TableTexts(NamedTuple):
    """A table as text; empty in forms that are not wanted."""

    csv: Iterable[bytes]
    json: Iterable[bytes]


@frozen
class Motions:
    """Writes the motions of a program as a table: `csv`, `json`, or both."""

    following: FollowingSetup
    source: Source
    csv: HeldOutput | None
    json: HeldOutput | None

    def written(self, tables: Iterable[Columns]) -> TableTexts:
        """The table as text."""
        from ncfix.cli.columns import as_csv, as_json

        tables = list(tables) if self.csv and self.json else tables
        return TableTexts(
            self.csv(as_csv(tables)) if self.csv else (),
            self.json(as_json(tables, path=shown(self.source.path))) if self.json else (),
        )

    def in_parts(self) -> tuple[TableTexts, Sequence[Message]]:
        """The table and messages of a program while it is read; raises errors of reading, and `NotInPartsError`."""
        machine = self.following.machine
        parts, found = parts_of(self.following, self.source, dialect_in(self.following, self.source))
        table = self.written(table_of(part.program, part.moves, machine) for part in found)
        parts.check_behind()
        return table, parts.follower.messages

    def whole(self) -> tuple[TableTexts, Sequence[Message]]:
        """The table and messages of a program read as a whole."""
        path = self.source.path
        program = self.following.read(path, self.source.everything())
        found = self.following.trace(program, path)
        return self.written([table_of(program, found.moves, self.following.machine)]), found.messages


def table_of(program: Program, moves: Moves, machine: Machine | None) -> Columns:
    """The motions as columns, mm and degrees; the tip only if the machine is known."""
    from ncfix.cli.columns import WordColumn, named
    from ncfix.control.moves import FeedMode, MotionKind, Rule

    positions, tip = _positions(moves, machine)
    columns: Columns = {"line": program.lines(moves.block), "kind": named(MotionKind, moves.kind)}
    columns |= dict(zip(moves.axes, positions.T, strict=True))
    columns |= {f"tip_{name}": values for name, values in zip("xyz", tip.T, strict=False)}
    columns |= {"feed": moves.feed, "feed_mode": named(FeedMode, moves.feed_mode)}
    return columns | {"rule": named(Rule, moves.rule), "reason": WordColumn(moves.reasons, moves.reason)}


def _positions(moves: Moves, machine: Machine | None) -> tuple[Any, Any]:
    """Axis positions at the ends of the motions, mm and degrees, and the tip in the workpiece, mm."""
    import numpy as np

    from ncfix.compensate.plan.kinematics import reached_joints

    if machine is None:
        q, tip = moves.end, np.empty((len(moves), 0))
    else:
        q, reached = reached_joints(machine, moves.end, moves.tcp, moves.length_under_tcp)
        q = np.where(reached[:, None], q, np.nan)
        tip = machine.tip(q, moves.tool_length)
    return np.where(moves.rotary, np.degrees(q), q), tip
