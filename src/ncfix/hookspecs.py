"""The whole extension contract: what a plugin may add to ncfix.

A plugin is a module (or object) that an entry point of the group `ncfix` names, with functions of these names marked
`@ncfix.hookspecs.hookimpl`. Every hook gets a `register` function and calls it once for each thing that it brings:
`register(thing)` files it under `thing.name`, `register(thing, name="...")` under that name. A name may be taken once.
Hooks are called once, when ncfix first needs any plugin: they should be cheap, and import what is slow inside the
things that they register. docs/plugins.md shows a plugin in 15 lines.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar

import pluggy

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from concurrent.futures import Executor

    import click

    from ncfix.diagnostics import Code
    from ncfix.machine.basis import Basis
    from ncfix.machine.effects import PluginEffect
    from ncfix.measure.measurement import Measurement
    from ncfix.reports.document import Document
    from ncfix.tables.control import Control
    from ncfix.text.dialect import Dialect

GROUP = "ncfix"
"""The entry-point group, and the name of the pluggy project."""

hookspec = pluggy.HookspecMarker(GROUP)
hookimpl = pluggy.HookimplMarker(GROUP)

Thing = TypeVar("Thing", contravariant=True)


class Register(Protocol[Thing]):
    """Files a thing under its name; raises `PluginError`: NCF503 if the name is taken, NCF505 without a name."""

    def __call__(self, thing: Thing, name: str | None = None) -> None:
        """File `thing` under `name`, or under `thing.name`."""


@hookspec
def register_dialects(register: Register[Dialect]) -> None:
    """Controls' languages for `--dialect`: a `Dialect` names its grammar, its file suffixes and its limits."""


@hookspec
def register_codes(register: Register[Callable[[], Mapping[str, Code]]]) -> None:
    """Explanations of message codes for `ncfix explain`: functions that return code -> `Code`, with a name."""


@hookspec
def register_bases(register: Register[type[Basis]]) -> None:
    """Basis functions for `basis = "..."` of an effect in a machine file: subclasses of `Basis`."""


@hookspec
def register_effects(register: Register[PluginEffect]) -> None:
    """Named error effects beyond ISO 230-1 for `name = "..."` of an effect in a machine file, and for diagnosis."""


@hookspec
def register_readers(register: Register[Callable[[str, str], Measurement | None]]) -> None:
    """Readers of instruments' own files: `reader(text, path)` is the measurement in them, None if it knows them not."""


@hookspec
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Controls with compensation tables of their own: functions that return a `Control`; register them with a name."""


@hookspec
def register_reporters(register: Register[Callable[[Document], bytes]]) -> None:
    """Forms of a report: `form(document)` is the content of a file; register it with the file's suffix as its name."""


@hookspec
def register_commands(register: Register[click.Command]) -> None:
    """Verbs of the command line; a built-in verb cannot be replaced."""


@hookspec
def register_executors(register: Register[Callable[[int], Executor]]) -> None:
    """Where batches run: `factory(workers) -> concurrent.futures.Executor`; register it with a name."""
