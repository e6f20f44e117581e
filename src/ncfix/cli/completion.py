"""`ncfix completion SHELL`: the script that lets a shell complete verbs and options."""

from __future__ import annotations

import click
from click.shell_completion import get_completion_class

from ncfix.cli import console

SHELLS = ("bash", "zsh", "fish")


@click.command()
@click.argument("shell", type=click.Choice(SHELLS), metavar="SHELL")
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the completion script for SHELL, e.g. `eval "$(ncfix completion bash)"`."""
    found = get_completion_class(shell)
    assert found is not None
    console.put(found(context.find_root().command, {}, "ncfix", "_NCFIX_COMPLETE").source() + "\n")
