"""`ncfix check`: what is the matter with a program, without writing anything."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import click

from ncfix.batch.gathering import gathered
from ncfix.cli import console
from ncfix.cli.completion import PATH
from ncfix.cli.following import Following
from ncfix.cli.options import dialect_option, json_option, optional_machine_option
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.surveying import looked_at
from ncfix.cli.targets import shown
from ncfix.diagnostics import ExitCode, Message, NcfixError, visible


@click.command()
@click.argument("programs", type=PATH, nargs=-1, required=True, metavar="PROGRAM...")
@optional_machine_option
@dialect_option
@setup_options
@json_option
def check(
    programs: tuple[str, ...], machine_path: str | None, dialect: str | None, given: SetupOptions, as_json: bool
) -> int:
    """Read each PROGRAM, of a folder all below it, and follow it as the control would. Writes nothing.

    With a machine file also: does it stay within the travel, and what would its correction refuse? Exit code 1 with
    findings.
    """
    following = Following.of(machine_path, dialect, given)
    outcomes = [_outcome(following, program.path) for program in gathered(programs)]
    if as_json:
        console.put_json(files=[outcome.entry for outcome in outcomes])
    return max(outcome.code for outcome in outcomes)


@dataclass(frozen=True, slots=True)
class Outcome:
    """What was found in one program: its exit code and its entry in the JSON object."""

    code: int
    entry: dict[str, Any]


def _outcome(following: Following, path: str) -> Outcome:
    entry: dict[str, Any] = {"path": shown(path)}
    try:
        with console.busy(f"checking {shown(path)}"):
            looked = looked_at(following, path)
    except NcfixError as error:
        console.tell(*error.messages)
        return Outcome(error.exit_code, {**entry, "errors": _as_dicts(error.messages)})
    checked, dialect = looked.checked, looked.dialect
    console.tell_some(checked.findings)
    count = len(checked.findings)
    said = console.counted(count, "finding") if count else "nothing found"
    size = f"{console.counted(checked.blocks, 'block')}, {console.counted(checked.moves, 'motion')}"
    console.say(f"{visible(shown(path))}: {size}, {dialect}: {said}")
    entry |= {"dialect": dialect, "blocks": checked.blocks, "moves": checked.moves}
    return Outcome(ExitCode.FINDINGS if count else ExitCode.DONE, {**entry, "findings": _as_dicts(checked.findings)})


def _as_dicts(messages: tuple[Message, ...]) -> list[dict[str, object]]:
    return [message.as_dict() for message in messages]
