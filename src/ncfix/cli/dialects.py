"""`ncfix dialects`: the control languages that programs can be read in."""

from __future__ import annotations

import click

from ncfix.cli import console
from ncfix.cli.options import json_option
from ncfix.plugins import registry


@click.command()
@json_option
def dialects(as_json: bool) -> None:
    """List the dialects for `--dialect`, with the file suffixes that suggest them."""
    found = registry("dialects")
    if as_json:
        entries = [{"name": name, "title": it.title, "suffixes": it.suffixes} for name, it in found.items()]
        console.put_json(dialects=entries)
    else:
        rows = [(name, it.title, " ".join(it.suffixes)) for name, it in found.items()]
        console.table(("name", "title", "suffixes"), rows)
