"""`ncfix plugins`: what is installed, what it adds, and what is left out."""

from __future__ import annotations

import click

from ncfix.cli import console
from ncfix.cli.options import json_option
from ncfix.diagnostics import ExitCode
from ncfix.plugins import Plugin, load_plugins


@click.command()
@json_option
def plugins(as_json: bool) -> int:
    """List the plugins and what each adds; exit code 1 if one was left out."""
    found = load_plugins()
    if as_json:
        entries = [_as_dict(plugin) for plugin in found.loaded]
        console.put_json(plugins=entries, left_out=[problem.as_dict() for problem in found.problems])
    else:
        console.table(("name", "from", "adds"), [_row(plugin) for plugin in found.loaded])
    return ExitCode.FINDINGS if found.problems else ExitCode.DONE


def _row(plugin: Plugin) -> tuple[str, str, str]:
    adds = "; ".join(f"{kind}: {', '.join(things)}" for kind, things in plugin.things.items() if things)
    return plugin.name, f"{plugin.distribution} {plugin.version}".strip(), adds


def _as_dict(plugin: Plugin) -> dict[str, object]:
    return {
        "name": plugin.name,
        "module": plugin.module,
        "distribution": plugin.distribution,
        "version": plugin.version,
        "hooks": plugin.hooks,
        "things": {kind: list(things) for kind, things in plugin.things.items()},
    }
