"""Verbs that list what there is: `ncfix dialects`, `ncfix plugins`, `ncfix explain CODE`, `ncfix completion SHELL`."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import get_completion_class

from ncfix.cli import console
from ncfix.cli.options import DIALECT, OneOf, json_option
from ncfix.diagnostics import Code, ExitCode, UsageError
from ncfix.plugins import Plugin, called, load_plugins, registry

if TYPE_CHECKING:
    from ncfix.text.dialect import Dialect

SHELLS = ("bash", "zsh", "fish")
PARTS = (("understands", "corrected"), ("passes", "passed by rule"), ("refuses", "refused, with the line"))
"""Fields of `Dialect`, and what they are called for people."""
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


@click.command()
@click.argument("name", type=DIALECT, required=False, metavar="[NAME]")
@json_option
def dialects(name: str | None, as_json: bool) -> None:
    """List the dialects for `--dialect`, with the file suffixes that suggest them; or all about the one called NAME."""
    found = registry("dialects") if name is None else {name: _known_dialect(name)}
    if as_json:
        console.put_json(dialects=[_dialect_entry(it) for it in found.values()])
    elif name is not None:
        _describe(found[name])
    else:
        rows = [(name, it.title, " ".join(it.suffixes)) for name, it in found.items()]
        console.table(("name", "title", "suffixes"), rows)


def _known_dialect(name: str) -> Dialect:
    from ncfix.text.dialects import get

    return get(name)


def _dialect_entry(dialect: Dialect) -> dict[str, Any]:
    lists = {field: getattr(dialect, field) for field, _ in PARTS}
    return {"name": dialect.name, "title": dialect.title, "suffixes": dialect.suffixes, **lists}


def _describe(dialect: Dialect) -> None:
    """What a dialect makes of the blocks of a program."""
    lines = [f"{dialect.name}: {dialect.title}"]
    for field, heading in PARTS:
        lines += ["", heading, *(f"  {sentence}" for sentence in getattr(dialect, field))]
    console.put("".join(f"{line}\n" for line in lines))


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
        codes = {code: _known_code(code, codes)}
    if as_json:
        console.put_json(codes=[{"code": key, **_code_as_dict(it)} for key, it in codes.items()])
    elif code is None:
        console.table(("code", "title"), [(key, it.title) for key, it in codes.items()])
    else:
        console.put("".join(_code_page(key, it) for key, it in codes.items()))


def _known_code(code: str, codes: dict[str, Code]) -> Code:
    if code not in codes:
        close = get_close_matches(code, codes, 1)
        hint = f"did you mean {close[0]}? " if close else ""
        text = f"there is no message code {code!r}"
        raise UsageError.of("NCF009", text, hint=f"{hint}`ncfix explain` lists all")
    return codes[code]


def _code_as_dict(code: Code) -> dict[str, str]:
    return {"title": code.title, "text": code.text, "hint": code.hint}


def _code_page(key: str, code: Code) -> str:
    hint = f"\nhint: {code.hint}\n" if code.hint else ""
    return f"{key}: {code.title}\n\n{code.text}\n{hint}"


@click.command()
@json_option
def plugins(as_json: bool) -> int:
    """List the plugins and what each adds; exit code 1 if one was left out."""
    found = load_plugins()
    if as_json:
        entries = [_plugin_as_dict(plugin) for plugin in found.loaded]
        console.put_json(plugins=entries, left_out=[problem.as_dict() for problem in found.problems])
    else:
        console.table(("name", "from", "adds"), [_plugin_row(plugin) for plugin in found.loaded])
    return ExitCode.FINDINGS if found.problems else ExitCode.DONE


def _plugin_row(plugin: Plugin) -> tuple[str, str, str]:
    adds = "; ".join(f"{kind}: {', '.join(things)}" for kind, things in plugin.things.items() if things)
    return plugin.name, f"{plugin.distribution} {plugin.version}".strip(), adds


def _plugin_as_dict(plugin: Plugin) -> dict[str, object]:
    return {
        "name": plugin.name,
        "module": plugin.module,
        "distribution": plugin.distribution,
        "version": plugin.version,
        "hooks": plugin.hooks,
        "things": {kind: list(things) for kind, things in plugin.things.items()},
    }


@click.command()
@click.argument("shell", type=click.Choice(SHELLS), metavar="SHELL")
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the completion script for SHELL, e.g. `eval "$(ncfix completion bash)"`."""
    found = get_completion_class(shell)
    assert found is not None
    console.put(found(context.find_root().command, {}, "ncfix", "_NCFIX_COMPLETE").source() + "\n")
