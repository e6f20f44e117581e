"""`ncfix lint`: what is wrong in compensation tables, wherever they come from."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from ncfix import files
from ncfix.cli import console
from ncfix.cli.emulate import read_folder
from ncfix.cli.options import json_option
from ncfix.cli.targets import shown
from ncfix.diagnostics import ExitCode, Message

if TYPE_CHECKING:
    from ncfix.tables.forms import Linted


@click.command()
@click.argument("paths", nargs=-1, required=True, metavar="FILE...")
@click.option("--control", metavar="NAME", default="", help="Whose tables they are; else by what they hold.")
@json_option
def lint(paths: tuple[str, ...], control: str, as_json: bool) -> int:
    """Say what a control would not load, or would misread, in each FILE; of a folder in all of its files.

    Files of one control that lie in one folder are looked at together. Exit code 1 with findings, 3 if a file is of no
    known form.
    """
    from ncfix.tables.forms import lint_files

    worst, entries = int(ExitCode.DONE), []
    for folder, content in _gathered(paths):
        for name, looked in sorted(lint_files(content, control).items()):
            path = os.path.join(folder, name)
            messages = [_placed(message, folder, content) for message in looked.messages]
            console.tell_some(messages)
            worst = max(worst, _code(looked))
            entries.append(_entry(path, looked, messages))
            if not as_json:
                said = console.counted(len(messages), "finding") if messages else "nothing found"
                console.say(f"{shown(path)}: {looked.title or 'of no known form'}: {said}")
    if as_json:
        console.put_json(files=entries)
    return worst


def _gathered(paths: Sequence[str]) -> Iterator[tuple[str, dict[str, bytes]]]:
    """Folder -> the files in it that are meant; raises `SourceError` NCF002."""
    found: dict[str, dict[str, bytes]] = {}
    for path in paths:
        if os.path.isdir(path):
            found.setdefault(path.rstrip(os.sep) or os.sep, {}).update(read_folder(path))
        else:
            folder, name = os.path.split(path)
            found.setdefault(folder, {})[name] = files.read_bytes(path)
    yield from ((folder, content) for folder, content in found.items() if content)


def _placed(message: Message, folder: str, names: dict[str, bytes]) -> Message:
    """With the folder before the name of its file."""
    if message.place is None or message.place.path not in names:
        return message
    return replace(message, place=replace(message.place, path=os.path.join(folder, message.place.path)))


def _code(looked: Linted) -> int:
    if not looked.owner:
        return ExitCode.UNREADABLE
    return ExitCode.FINDINGS if looked.messages else ExitCode.DONE


def _entry(path: str, looked: Linted, messages: Sequence[Message]) -> dict[str, Any]:
    found = [message.as_dict() for message in messages]
    return {"path": shown(path), "form": looked.owner or None, "title": looked.title or None, "findings": found}
