"""The manual page of `ncfix`, made from the help texts of all verbs; `share/` has it with the completion scripts."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click

from ncfix.cli import console
from ncfix.cli.listings import completion_script
from ncfix.cli.main import VERBS, cli

EXIT_CODES = (
    ("0", "done"),
    ("1", "findings: faults, differences, or an error beyond the tolerance"),
    ("2", "wrong use of the command line, or an output that cannot be written"),
    ("3", "unreadable input"),
    ("4", "refused for safety; nothing was written"),
    ("5", "internal fault of ncfix or of a plugin"),
    ("130", "after Ctrl-C"),
    ("141", "the reader of standard output has closed it"),
)
ENVIRONMENT = (
    ("NCFIX_MACHINE, NCFIX_SETUP, NCFIX_OUTPUT, NCFIX_DIALECT", "defaults of the options of these names"),
    ("NCFIX_PROJECT", "the project file, instead of the ncfix.toml above the program"),
    ("NCFIX_CORE", "plain: do not use the compiled core; compiled: fail without it"),
    ("NCFIX_PART_BYTES", "size in bytes from which a program is corrected in parts"),
    ("NCFIX_DEBUG", "1: show the traceback of an internal fault"),
    ("NO_COLOR", "use no colours"),
)
SHARED = {
    "bash": "bash-completion/completions/ncfix",
    "zsh": "zsh/site-functions/_ncfix",
    "fish": "fish/vendor_completions.d/ncfix.fish",
}
"""Paths of completion scripts below `share`, by shell."""
PAGE = "man/man1/ncfix.1"


def shared_files() -> Iterator[tuple[str, str]]:
    """The files of `share`: paths and texts."""
    yield PAGE, page()
    for shell, path in SHARED.items():
        yield path, completion_script(cli, shell).rstrip() + "\n"


def page() -> str:
    """The manual page in the markup of man(7)."""
    return "\n".join(_page()) + "\n"


def _page() -> Iterator[str]:
    yield '.TH NCFIX 1 "" "ncfix" "User Commands"'
    yield from (".SH NAME", r"ncfix \- rewrites NC programs so that a particular machine tool cuts right")
    yield from (".SH SYNOPSIS", ".B ncfix", r"[\-\-debug] VERB ...")
    yield from (".SH DESCRIPTION", _escaped(" ".join((cli.help or "").split())))
    yield from ("Data goes to standard output, messages to standard error.", ".SH VERBS")
    context = click.Context(cli, info_name="ncfix")
    for name in VERBS:
        command = cli.get_command(context, name)
        assert command is not None
        yield from _verb(command, click.Context(command, context, info_name=name))
    for title, rows in (("EXIT STATUS", EXIT_CODES), ("ENVIRONMENT", ENVIRONMENT)):
        yield f".SH {title}"
        for term, text in rows:
            yield from _item(term, text)
    yield from (".SH SEE ALSO", "The guide and the description of all files come with the source, in docs.")


def _verb(command: click.Command, context: click.Context) -> Iterator[str]:
    usage = " ".join(command.collect_usage_pieces(context))
    yield f".SS {_escaped(f'{context.command_path} {usage}')}"
    for paragraph in (command.help or "").split("\n\n"):
        yield from (_escaped(" ".join(paragraph.split())), ".PP")
    for param in command.get_params(context):
        record = param.get_help_record(context)
        if record is not None and "--help" not in record[0]:
            yield from _item(*record)
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            inner = command.get_command(context, name)
            assert inner is not None
            yield from _verb(inner, click.Context(inner, context, info_name=name))


def _item(term: str, text: str) -> Iterator[str]:
    yield from (".TP", rf".B {_escaped(term)}", _escaped(" ".join(text.split())))


def _escaped(text: str) -> str:
    """Plain text in the markup of man(7): backslashes and hyphens are literal, and no line begins with a command."""
    found = text.replace("\\", r"\e").replace("-", r"\-").replace("`", "")
    return re.sub(r"^([.'])", r"\\&\1", found)


@click.command()
def manual() -> None:
    """Print the manual page, for `man -l -`."""
    console.put(page())
