"""Options that several verbs share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from ncfix.cli.targets import STREAM, read, shown

if TYPE_CHECKING:
    from ncfix.machine import Machine

json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
machine_option = click.option(
    "-m", "--machine", "machine_path", metavar="FILE", required=True, help="The machine file (TOML)."
)
optional_machine_option = click.option(
    "-m", "--machine", "machine_path", metavar="FILE", help="The machine file (TOML)."
)
dialect_option = click.option("--dialect", metavar="NAME", help="The control's language; detected if not given.")


def load_machine(path: str) -> Machine:
    """The machine that a file, or standard input, describes."""
    from ncfix.machine import load, loads

    return load(path) if path != STREAM else loads(read(path).decode("utf-8", "replace"), shown(path))
