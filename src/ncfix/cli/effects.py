"""`ncfix effects`: the names that an effect in a machine file may have, and the bases."""

from __future__ import annotations

import click

from ncfix.cli import console
from ncfix.cli.options import json_option


@click.command()
@click.option("--bases", is_flag=True, help="List the bases for `basis = ...` with their keys instead.")
@json_option
def effects(bases: bool, as_json: bool) -> None:
    """List the error effects (ISO 230-1 names) that a machine file may have."""
    rows = _bases() if bases else _effects()
    if as_json:
        console.put_json(**{"bases" if bases else "effects": rows})
    elif rows:
        console.table(tuple(rows[0]), [tuple(row.values()) for row in rows])


def _effects() -> list[dict[str, str]]:
    from ncfix.machine import catalogue
    from ncfix.machine.effect import Effect
    from ncfix.plugins import registry

    iso = [
        {
            "name": name,
            "unit": "rad" if Effect(name, ()).rotational else "mm",
            "title": catalogue.title(name),
            "squareness": catalogue.squareness(name),
        }
        for name in catalogue.names()
    ]
    others = registry("effects").items()
    return iso + [{"name": name, "unit": "", "title": each.title, "squareness": ""} for name, each in others]


def _bases() -> list[dict[str, str]]:
    from dataclasses import fields

    from ncfix.machine.basis import kinds

    return [
        {"name": name, "title": basis.title, "keys": ", ".join(field.name for field in fields(basis))}  # type: ignore[arg-type]
        for name, basis in sorted(kinds().items())
    ]
