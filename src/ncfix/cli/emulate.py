"""`ncfix emulate`: tables read back from their files and run as the control would."""

from __future__ import annotations

import os
from collections.abc import Container, Iterable
from dataclasses import replace
from typing import Any

import click

from ncfix import files
from ncfix.cli import console
from ncfix.cli.completion import CONTROL, FOLDER, PATH
from ncfix.cli.export import tell
from ncfix.cli.following import Following
from ncfix.cli.options import dialect_option, json_option, machine_option
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.diagnostics import ConfigError, ExitCode, Message


@click.command()
@click.argument("control", type=CONTROL)
@click.argument("folder", type=FOLDER, metavar="TABLEDIR")
@machine_option
@click.option("--program", type=PATH, metavar="FILE", help="Also run this program with the tables active.")
@click.option("--other-machine", is_flag=True, help="Run tables that were made for another machine or other errors.")
@dialect_option
@setup_options
@json_option
def emulate(
    control: str,
    folder: str,
    machine_path: str,
    program: str | None,
    other_machine: bool,
    dialect: str | None,
    given: SetupOptions,
    as_json: bool,
) -> int:
    """Say what the tables in TABLEDIR, which `ncfix export` wrote for CONTROL, leave on this machine.

    Exit code 1 if there is something to remark on the files.
    """
    from ncfix.cli.tabled import along
    from ncfix.tables.control import get_control
    from ncfix.tables.export import SIDE_FILE, read_manifest
    from ncfix.tables.export import emulate as emulated

    chosen = get_control(control)
    following = Following.of(machine_path, dialect, given)
    assert following.machine is not None
    content = read_folder(folder)
    more: dict[str, Any] = {"assumptions": chosen.described()["assumptions"]}
    with console.busy("running the tables"):
        try:
            found = emulated(chosen, content, following.machine, folder.rstrip(os.sep), other_machine)
        except ConfigError as error:
            raise ConfigError.collected(_below(folder, error.messages, content)) from error
        if program is not None:
            made = read_manifest(content[SIDE_FILE], SIDE_FILE)
            more["program"] = along(following, chosen, found.tables, made.settings, program, made.tool_length)
    found = replace(found, messages=_below(folder, found.messages, content))
    console.tell_some(found.messages)
    tell(found, as_json, control=chosen.name, reaches=found.reaches, **more)
    return ExitCode.FINDINGS if found.messages else ExitCode.DONE


def _below(folder: str, messages: Iterable[Message], names: Container[str]) -> tuple[Message, ...]:
    """The messages with the folder before the names of its files."""
    return tuple(
        replace(message, place=replace(message.place, path=os.path.join(folder, message.place.path)))
        if message.place is not None and message.place.path in names
        else message
        for message in messages
    )


def read_folder(folder: str) -> dict[str, bytes]:
    """All files of a folder; raises `SourceError` NCF002."""
    try:
        names = sorted(os.listdir(folder))
    except OSError as error:
        raise files.unreadable(folder, error) from error
    paths = {name: os.path.join(folder, name) for name in names}
    return {name: files.read_bytes(path) for name, path in paths.items() if os.path.isfile(path)}
