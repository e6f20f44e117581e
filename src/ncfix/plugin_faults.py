"""Whose fault it is: what a plugin's own code raises, or hands over that is of no use, is told as the plugin's.

Whatever a plugin brings is called through `called`, or stands in the traceback of what it raised (`blamed`, which the
command line asks before it owns up to a fault of ncfix). Errors with a code pass: they are told as they are. So do
faults of what ncfix itself brings, which comes in as plugins do: those are faults of ncfix.
"""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any

from ncfix.diagnostics import Message, NcfixError, PluginError
from ncfix.plugins import Plugin, describe, load_plugins

OWN = "ncfix"
"""The distribution whose plugins are ncfix itself."""
SINGULAR = {"bases": "basis"}


def called(
    kind: str, name: str, function: Callable[..., Any], *arguments: Any, gives: type | tuple[type, ...] = object
) -> Any:
    """What a function of a thing that is registered under this name returns.

    Raises `PluginError`: NCF507 where a plugin's raises what is no error of ncfix, NCF508 where it returns something
    that is none of the types that it must give.
    """
    with working(kind, name):
        found = function(*arguments)
    return handed(kind, name, found, gives)


def handed(kind: str, name: str, found: Any, gives: type | tuple[type, ...]) -> Any:
    """What a plugin handed over; raises `PluginError` NCF508 if it is none of these types."""
    plugin = _owner(kind, name)
    if plugin is None or isinstance(found, gives):
        return found
    types = gives if isinstance(gives, tuple) else (gives,)
    wanted = " or ".join("None" if each is type(None) else each.__name__ for each in types)
    text = f"{_said(plugin)} returned {type(found).__name__} as the {_kind(kind)} {name!r}, not {wanted}"
    raise PluginError.of("NCF508", text, hint=_hint(plugin))


def useless(kind: str, name: str, why: str, hint: str) -> PluginError:
    """The error NCF508 that says why what is registered under this name is of no use, and which plugin brings it."""
    plugin = load_plugins().owner(kind, name)
    return PluginError.of("NCF508", why if plugin is None else f"{_said(plugin)}: {why}", hint=hint)


@contextmanager
def working(kind: str, name: str) -> Iterator[None]:
    """While what is registered under this name is at work; raises `PluginError` NCF507, see `called`."""
    try:
        yield
    except NcfixError:
        raise
    except (Exception, SystemExit) as error:
        plugin = _owner(kind, name)
        if plugin is None:
            raise
        raise _failed(plugin, f" as the {_kind(kind)} {name!r}", error) from error


def blamed(error: BaseException) -> PluginError | None:
    """The same for an exception that came all the way up: a plugin's if code of a plugin's was at work."""
    at_work = {_top(frame.f_globals.get("__name__", "")) for frame, _ in traceback.walk_tb(error.__traceback__)}
    try:
        plugins = load_plugins().loaded
    except NcfixError:  # strict mode: nothing came in, so nothing of it was at work
        return None
    for plugin in plugins:
        if not _own(plugin) and _top(plugin.module) in at_work:
            made = _failed(plugin, "", error)
            made.__cause__ = error
            return made
    return None


def _failed(plugin: Plugin, what: str, error: BaseException) -> PluginError:
    text = f"{_said(plugin)} failed{what}: {describe(error)}"
    return PluginError((Message("NCF507", f"{text}{_where(plugin, error.__traceback__)}", hint=_hint(plugin)),))


def _where(plugin: Plugin, trace: TracebackType | None) -> str:
    """The last line of the plugin that was at work, and that of ncfix below it, if it called that."""
    last: dict[bool, str] = {}
    for frame, line in traceback.walk_tb(trace):
        top = _top(frame.f_globals.get("__name__", ""))
        if top == _top(plugin.module):
            last = {True: f"{os.path.basename(frame.f_code.co_filename)}:{line}"}
        elif top == OWN and last:
            last[False] = f"in what it called of ncfix, {os.path.basename(frame.f_code.co_filename)}:{line}"
    return f" ({', '.join(last.values())})" if last else ""


def _owner(kind: str, name: str) -> Plugin | None:
    """The plugin of somebody else that registered this name."""
    plugin = load_plugins().owner(kind, name)
    return None if plugin is None or _own(plugin) else plugin


def _own(plugin: Plugin) -> bool:
    return plugin.distribution == OWN


def _top(module: str) -> str:
    return module.partition(":")[0].partition(".")[0].strip()


def _kind(kind: str) -> str:
    return SINGULAR.get(kind, kind.removesuffix("s"))


def _said(plugin: Plugin) -> str:
    source = f" of {plugin.distribution} {plugin.version}" if plugin.distribution else ""
    return f"plugin {plugin.name!r}{source}"


def _hint(plugin: Plugin) -> str:
    return f"tell its author (ncfix --debug shows the traceback); NCFIX_DISABLE_PLUGINS={plugin.name} leaves it out"
