"""Options that several verbs share."""

from __future__ import annotations

import click

json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead.")
machine_option = click.option(
    "-m", "--machine", "machine_path", metavar="FILE", required=True, help="The machine file (TOML)."
)
optional_machine_option = click.option(
    "-m", "--machine", "machine_path", metavar="FILE", help="The machine file (TOML)."
)
dialect_option = click.option("--dialect", metavar="NAME", help="The control's language; detected if not given.")
