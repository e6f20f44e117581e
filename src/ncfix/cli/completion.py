"""`ncfix completion SHELL`, and what a shell completes: verbs, options, files, and names of what there is."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable
from typing import Any

import click
from click.shell_completion import CompletionItem, get_completion_class

from ncfix.cli import console

SHELLS = ("bash", "zsh", "fish")


class PathName(click.ParamType):  # type: ignore[type-arg]
    """The path of a file or folder, taken as it is written; the shell itself completes it.

    kind  what the shell is asked for: file or dir
    """

    name = "path"

    def __init__(self, kind: str = "file") -> None:
        self.kind = kind

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The path."""
        return str(value)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """What says to the shell that it is to look for files."""
        return [CompletionItem(incomplete, type=self.kind)]


class OneOf(click.ParamType):  # type: ignore[type-arg]
    """A name, taken as it is written; those that there are by now are completed."""

    name = "text"

    def __init__(self, known: Callable[[], Iterable[str]]) -> None:
        self.known = known

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """The names that begin so, in whatever case."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of plugins that are left out: there is no place to say so now
            begun = incomplete.lower()
            return [CompletionItem(name) for name in self.known() if name.lower().startswith(begun)]


def of_kind(kind: str) -> OneOf:
    """The name of something that plugins register: "dialects", "controls", ..."""

    def known() -> Iterable[str]:
        from ncfix.plugins import registry

        return sorted(registry(kind))

    return OneOf(known)


PATH = PathName()
FOLDER = PathName("dir")
DIALECT = of_kind("dialects")
CONTROL = of_kind("controls")


@click.command()
@click.argument("shell", type=click.Choice(SHELLS), metavar="SHELL")
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the completion script for SHELL, e.g. `eval "$(ncfix completion bash)"`."""
    found = get_completion_class(shell)
    assert found is not None
    console.put(found(context.find_root().command, {}, "ncfix", "_NCFIX_COMPLETE").source() + "\n")
