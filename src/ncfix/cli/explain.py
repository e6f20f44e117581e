"""`ncfix explain CODE`: what a message code means and what to do about it."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from importlib.util import find_spec

import click

from ncfix.cli import console
from ncfix.cli.completion import OneOf
from ncfix.cli.options import json_option
from ncfix.diagnostics import Code, UsageError
from ncfix.plugins import called, registry

FLOORS = (
    "cli",
    "report",
    "diagnose",
    "batch",
    "compensate",
    "tables",
    "measure",
    "writer",
    "control",
    "text",
    "machine",
)


def all_codes() -> dict[str, Code]:
    """The codes of all floors and plugins, in order."""
    modules = ["ncfix.codes", *(f"ncfix.{floor}.codes" for floor in FLOORS)]
    found: dict[str, Code] = {}
    for module in modules:
        if find_spec(module):
            found |= import_module(module).CODES
    for name, codes in registry("codes").items():
        found |= called("codes", name, codes, gives=Mapping)
    return dict(sorted(found.items()))


@click.command()
@click.argument("code", type=OneOf(all_codes), required=False)
@json_option
def explain(code: str | None, as_json: bool) -> None:
    """Explain the message code CODE, e.g. NCF002; without CODE list them all."""
    codes = all_codes()
    if code is not None:
        code = f"NCF{code}" if code.isdecimal() else code.upper()
        codes = {code: _known(code, codes)}
    if as_json:
        console.put_json(codes=[{"code": key, **_as_dict(it)} for key, it in codes.items()])
    elif code is None:
        console.table(("code", "title"), [(key, it.title) for key, it in codes.items()])
    else:
        console.put("".join(_page(key, it) for key, it in codes.items()))


def _known(code: str, codes: dict[str, Code]) -> Code:
    if code not in codes:
        close = get_close_matches(code, codes, 1)
        hint = f"did you mean {close[0]}? " if close else ""
        text = f"there is no message code {code!r}"
        raise UsageError.of("NCF009", text, hint=f"{hint}`ncfix explain` lists all")
    return codes[code]


def _as_dict(code: Code) -> dict[str, str]:
    return {"title": code.title, "text": code.text, "hint": code.hint}


def _page(key: str, code: Code) -> str:
    hint = f"\nhint: {code.hint}\n" if code.hint else ""
    return f"{key}: {code.title}\n\n{code.text}\n{hint}"
