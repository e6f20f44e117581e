"""The extension contract: everything that a plugin can add to ncfix.

A plugin is a module (or object) named by an entry point of the group `ncfix`. It has functions with the names below,
marked `@ncfix.hookspecs.hookimpl`. Each hook gets a function `register` and calls it once for each thing it adds:
`register(thing)` uses the name `thing.name`, `register(thing, name="...")` the given name. Each name can be registered
once. Hooks are called once, when ncfix first needs any plugin: they should be fast, and slow imports belong inside the
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
    """Registers a thing under its name; raises `PluginError`: NCF503 if the name is taken, NCF505 without a name."""

    def __call__(self, thing: Thing, name: str | None = None) -> None:
        """Register `thing` under `name`, or under `thing.name`."""


@hookspec
def register_dialects(register: Register[Dialect]) -> None:
    """Languages of controls, for `--dialect`: a `Dialect` names its grammar, file suffixes and limits."""


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
    """Readers of instrument files: `reader(text, path)` returns the measurement, or None for a file of another kind."""


@hookspec
def register_controls(register: Register[Callable[[], Control]]) -> None:
    """Controls with their own compensation tables: functions that return a `Control`, registered with a name."""


@hookspec
def register_reporters(register: Register[Callable[[Document], bytes]]) -> None:
    """Report formats: `form(document)` returns the content of a file; registered with the file suffix as name."""


@hookspec
def register_commands(register: Register[click.Command]) -> None:
    """Commands of the command line; a built-in one cannot be replaced."""


@hookspec
def register_executors(register: Register[Callable[[int], Executor]]) -> None:
    """Executors for batches: `factory(workers) -> concurrent.futures.Executor`, registered with a name."""
