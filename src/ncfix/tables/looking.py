"""Tables from elsewhere: which control's they are, by what they hold, and what its linter has to say of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from ncfix.diagnostics import Message, Place
from ncfix.plugins import called
from ncfix.tables import forms
from ncfix.tables.control import Control, Files, controls, get_control
from ncfix.tables.export import SHEET, linted
from ncfix.tables.lines import AGAIN
from ncfix.tables.manifest import NAME, loads


@dataclass(frozen=True, slots=True)
class Looked:
    """What was said of one file.

    owner     the control, or the form of a control that ncfix makes no tables for; "" if nobody knows it
    title     the same for people
    messages  what is wrong or doubtful, with places in this file
    """

    owner: str
    title: str
    messages: tuple[Message, ...]


def look(files: Files, control: str = "") -> Mapping[str, Looked]:
    """What is said of files that lie together, each by its name; those of a control are looked at together.

    Of a folder that `export` wrote, its side file says whose they are; that and the hand-over sheet are left out.
    control: whose all of them are, if that is known. Raises `UsageError` NCF480.
    """
    tables = {name: content for name, content in files.items() if name != NAME and not name.startswith(f"{SHEET}.")}
    made = loads(files[NAME], NAME) if NAME in files else None
    if control or made is not None:
        chosen = get_control(control or (made.control if made is not None else ""))
        return _shared(chosen, tables, linted(chosen, tables) if made is not None else _look(chosen, tables))
    found: dict[str, Looked] = {}
    known = controls()
    owners = {name: _owner(known.values(), name, content) for name, content in tables.items()}
    for chosen in known.values():
        own = {name: tables[name] for name, owner in owners.items() if owner is chosen}
        if own:
            found |= _shared(chosen, own, _look(chosen, own))
    return {name: found[name] if name in found else _of_form(name, tables[name]) for name in tables}


def _owner(known: Iterable[Control], name: str, content: bytes) -> Control | None:
    return next((each for each in known if called("controls", each.name, each.knows, name, content, gives=bool)), None)


def _look(control: Control, files: Files) -> tuple[Message, ...]:
    found: tuple[Message, ...] = called("controls", control.name, control.look, files, gives=tuple)
    return tuple(replace(message, hint="") if message.hint == AGAIN else message for message in found)


def _shared(control: Control, files: Files, messages: Iterable[Message]) -> dict[str, Looked]:
    """Each message with its file; one of a file that is not there is said of the first that is."""
    parts: dict[str, list[Message]] = {name: [] for name in files}
    first = next(iter(files))
    for message in messages:
        path = message.place.path if message.place is not None else ""
        parts[path if path in parts else first].append(message)
    return {name: Looked(control.name, control.title, tuple(part)) for name, part in parts.items()}


def _of_form(name: str, content: bytes) -> Looked:
    """A file that no control of a plugin knows: of a form that is known, or of none."""
    document = forms.recognised(name, content)
    if document is None:
        return Looked("", "", (unknown(name),))
    return Looked(document.form, forms.BY_NAME[document.form].title, ())


def unknown(name: str) -> Message:
    """The remark on a file that is of no form that is known: NCF509."""
    hint = "ncfix lint --control NAME says whose it is; ncfix plugins lists the controls"
    return Message("NCF509", "is no table of a form that ncfix or a plugin knows", Place(name), hint)
