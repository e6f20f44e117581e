"""Verbs that list and explain: `ncfix dialects`, `ncfix plugins`, `ncfix explain CODE`, `ncfix completion SHELL`."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

import click
from click.shell_completion import get_completion_class

from ncfix import core
from ncfix.cli import console
from ncfix.cli.options import DIALECT, OneOf, json_option
from ncfix.diagnostics import Code, ExitCode, UsageError
from ncfix.plugins import called, load_plugins, registry

if TYPE_CHECKING:
    from ncfix.text.dialect import Dialect

SHELLS = ("bash", "zsh", "fish")
PARTS = (("understands", "corrected"), ("passes", "passed by rule"), ("refuses", "refused, with line and reason"))
"""Fields of `Dialect`, and their headings."""
FLOORS = (
    "cli",
    "reports",
    "diagnosis",
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
    """List the dialects for `--dialect` with their file suffixes; with NAME, describe that dialect."""
    if name is None:
        found: dict[str, Dialect] = registry("dialects")
    else:
        from ncfix.text.dialect import get

        found = {name: get(name)}
    if as_json:
        fields = ("name", "title", "suffixes", *(field for field, _ in PARTS))
        console.put_json(dialects=[{field: getattr(it, field) for field in fields} for it in found.values()])
    elif name is not None:
        lines = [f"{found[name].name}: {found[name].title}"]
        for field, heading in PARTS:
            lines += ["", heading, *(f"  {sentence}" for sentence in getattr(found[name], field))]
        if own := own_codes(found[name]):
            lines += ["", "codes of this dialect", *(f"  {sentence}" for sentence in own)]
        if words := found[name].keywords:
            lines += ["", "keywords", *(f"  {word}: {meaning}" for word, meaning in words)]
        console.put("".join(f"{line}\n" for line in lines))
    else:
        rows = [(name, it.title, " ".join(it.suffixes)) for name, it in found.items()]
        console.table(("name", "title", "suffixes"), rows)


def own_codes(dialect: Dialect) -> list[str]:
    """What each code and cycle does that the dialect adds to those of its family."""
    codes = ((code, "; ".join(map(str, operations)) or "moves nothing") for code, operations in dialect.codes)
    return [f"{code}: {does}" for code, does in (*codes, *((code, str(table)) for code, table in dialect.cycles))]


def all_codes() -> dict[str, Code]:
    """The message codes of all packages and plugins, sorted."""
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
    """Explain the message code CODE, e.g. NCF002; without CODE, list all codes."""
    codes = all_codes()
    if code is not None:
        code = f"NCF{code}" if code.isdecimal() else code.upper()
        if code not in codes:
            close = get_close_matches(code, codes, 1)
            hint = f"did you mean {close[0]}? " if close else ""
            text = f"there is no message code {code!r}"
            raise UsageError.of("NCF009", text, hint=f"{hint}`ncfix explain` lists all")
        codes = {code: codes[code]}
    if as_json:
        entries = [{"code": key, "title": it.title, "text": it.text, "hint": it.hint} for key, it in codes.items()]
        console.put_json(codes=entries)
    elif code is None:
        console.table(("code", "title"), [(key, it.title) for key, it in codes.items()])
    else:
        for key, it in codes.items():
            console.put(f"{key}: {it.title}\n\n{it.text}\n" + (f"\nhint: {it.hint}\n" if it.hint else ""))


@click.command()
@json_option
def plugins(as_json: bool) -> int:
    """List the plugins, what each adds, and whether the core is compiled. Exit code 1: a plugin was left out."""
    found = load_plugins()
    if as_json:
        entries = [
            {
                **{field: getattr(plugin, field) for field in ("name", "module", "distribution", "version", "hooks")},
                "things": {kind: list(things) for kind, things in plugin.things.items()},
            }
            for plugin in found.loaded
        ]
        console.put_json(plugins=entries, left_out=found.problems, core=core.status())
    else:
        rows = []
        for each in found.loaded:
            adds = "; ".join(f"{kind}: {', '.join(things)}" for kind, things in each.things.items() if things)
            rows.append((each.name, f"{each.distribution} {each.version}".strip(), adds))
        console.table(("name", "from", "adds"), rows)
        console.put(f"core: {core.status()}\n")
    return ExitCode.FINDINGS if found.problems else ExitCode.DONE


@click.command()
@click.argument("shell", type=click.Choice(SHELLS), metavar="SHELL")
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print the completion script for SHELL, e.g. `eval "$(ncfix completion bash)"`."""
    console.put(completion_script(context.find_root().command, shell) + "\n")


def completion_script(command: click.Command, shell: str) -> str:
    """The script with which a shell completes the arguments of `ncfix`."""
    found = get_completion_class(shell)
    assert found is not None
    return found(command, {}, "ncfix", "_NCFIX_COMPLETE").source()
