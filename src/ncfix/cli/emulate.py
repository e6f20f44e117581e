"""`ncfix emulate`: tables read back from their files and run as the control would."""

from __future__ import annotations

import os

import click

from ncfix import files
from ncfix.cli import console
from ncfix.cli.export import tell
from ncfix.cli.options import json_option, load_machine, machine_option
from ncfix.diagnostics import ExitCode


@click.command()
@click.argument("control")
@click.argument("folder", metavar="TABLEDIR")
@machine_option
@click.option("--other-machine", is_flag=True, help="Run tables that were made for another machine or other errors.")
@json_option
def emulate(control: str, folder: str, machine_path: str, other_machine: bool, as_json: bool) -> int:
    """Say what the tables in TABLEDIR, which `ncfix export` wrote for CONTROL, leave on this machine.

    Exit code 1 if there is something to remark on the files.
    """
    from ncfix.tables.control import get_control
    from ncfix.tables.export import emulate as emulated

    chosen = get_control(control)
    machine = load_machine(machine_path)
    with console.busy("running the tables"):
        found = emulated(chosen, read_folder(folder), machine, folder.rstrip(os.sep), other_machine)
    console.tell_some(found.messages)
    tell(found, as_json, control=chosen.name, reaches=chosen.reaches)
    return ExitCode.FINDINGS if found.messages else ExitCode.DONE


def read_folder(folder: str) -> dict[str, bytes]:
    """All files of a folder; raises `SourceError` NCF002."""
    try:
        names = sorted(os.listdir(folder))
    except OSError as error:
        raise files.unreadable(folder, error) from error
    paths = {name: os.path.join(folder, name) for name in names}
    return {name: files.read_bytes(path) for name, path in paths.items() if os.path.isfile(path)}
