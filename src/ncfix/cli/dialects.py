"""`ncfix dialects`: the control languages that programs can be read in, and what becomes of their blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.completion import DIALECT
from ncfix.cli.options import json_option
from ncfix.plugins import registry

if TYPE_CHECKING:
    from ncfix.text.dialect import Dialect

PARTS = (("understands", "corrected"), ("passes", "passed by rule"), ("refuses", "refused, with the line"))
"""Fields of `Dialect`, and what they are called for people."""


@click.command()
@click.argument("name", type=DIALECT, required=False, metavar="[NAME]")
@json_option
def dialects(name: str | None, as_json: bool) -> None:
    """List the dialects for `--dialect`, with the file suffixes that suggest them; or all about the one called NAME."""
    found = registry("dialects") if name is None else {name: _known(name)}
    if as_json:
        console.put_json(dialects=[_entry(it) for it in found.values()])
    elif name is not None:
        _describe(found[name])
    else:
        rows = [(name, it.title, " ".join(it.suffixes)) for name, it in found.items()]
        console.table(("name", "title", "suffixes"), rows)


def _known(name: str) -> Dialect:
    from ncfix.text.dialects import get

    return get(name)


def _entry(dialect: Dialect) -> dict[str, Any]:
    lists = {field: getattr(dialect, field) for field, _ in PARTS}
    return {"name": dialect.name, "title": dialect.title, "suffixes": dialect.suffixes, **lists}


def _describe(dialect: Dialect) -> None:
    """What a dialect makes of the blocks of a program."""
    lines = [f"{dialect.name}: {dialect.title}"]
    for field, heading in PARTS:
        lines += ["", heading, *(f"  {sentence}" for sentence in getattr(dialect, field))]
    console.put("".join(f"{line}\n" for line in lines))
