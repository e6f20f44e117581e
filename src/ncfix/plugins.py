"""Loads plugins, each completely or not at all, and finds the plugin that is responsible for a failure.

A plugin is left out completely if it cannot be imported, has a hook that ncfix does not know, raises while registering,
or registers a name that is taken; a `PluginWarning` names it. With `NCFIX_STRICT_PLUGINS=1` it is an error instead.
`NCFIX_DISABLE_PLUGINS=name,name` leaves plugins out without loading them, by entry point or distribution.

Code of a plugin is called through `called`, or appears in the traceback of an exception (`blamed`, which the command
line asks before it reports a fault of ncfix). Errors with a code are passed on unchanged. So are exceptions from
ncfix's own plugins: those are faults of ncfix.
"""

from __future__ import annotations

import os
import re
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import field, fields, is_dataclass
from functools import cache, lru_cache
from importlib import import_module
from types import TracebackType
from typing import Any

import pluggy

from ncfix.diagnostics import Message, NcfixError, PluginError
from ncfix.entry_points import EntryPoint, entry_points
from ncfix.values import frozen

hookspecs = import_module("ncfix.hookspecs")
"""Loaded by name, because the contract refers to all packages and so is above this module."""
GROUP: str = hookspecs.GROUP
HOOKS = tuple(sorted(name for name in vars(hookspecs) if name.startswith("register_")))

KINDS = tuple(hook.removeprefix("register_") for hook in HOOKS)
"""The kinds of things that can be registered, one per hook: "dialects", "bases", ..."""

Things = Mapping[str, Mapping[str, Any]]
"""Kind -> name -> thing."""


class PluginWarning(UserWarning):
    """A plugin, or something that it registered, was left out; `message` tells which and why."""

    def __init__(self, message: Message) -> None:
        super().__init__(str(message))
        self.message = message


@frozen
class Plugin:
    """A loaded plugin: the name of its entry point, its origin, and what it registered."""

    name: str
    module: str
    distribution: str = ""
    version: str = ""
    things: Things = field(default_factory=dict)

    @property
    def hooks(self) -> tuple[str, ...]:
        """The hooks that it implements."""
        return tuple(f"register_{kind}" for kind in self.things)


@frozen
class Plugins:
    """All loaded plugins, and the reasons why others were left out."""

    loaded: tuple[Plugin, ...]
    problems: tuple[Message, ...]

    def owner(self, kind: str, name: str) -> Plugin | None:
        """The plugin that registered `name`; None if none did."""
        return next((plugin for plugin in self.loaded if name in plugin.things.get(kind, ())), None)


def registry(kind: str, builtin: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Name -> thing of one kind: built-in things, then those registered by plugins.

    A plugin's thing with the name of a built-in one, or unusable for its kind (NCF508), is left out with a warning (in
    strict mode: an error).
    """
    assert kind in KINDS, f"{kind!r} is none of {KINDS}"
    things = dict(builtin or {})
    for plugin in load_plugins().loaded:
        for name, thing in plugin.things.get(kind, {}).items():
            if name in things:
                report(name_taken(plugin.name, kind, name, "ncfix itself"))
            elif lacks := lacking(kind, thing):
                leave(plugin.name, plugin.distribution, kind, name, lacks)
            else:
                things[name] = thing
    return things


NEEDS = {
    "bases": ("name", "title", "labels", "rows", "slopes", "feature", "complaints"),
    "commands": ("main", "get_short_help_str"),
    "dialects": ("grammar", "suffixes", "signature", "language", "semantics"),
}
"""Kind -> attributes that its things must have, for kinds that are not just functions."""


def lacking(kind: str, thing: Any) -> str:
    """Why a thing is unusable for its kind, in words; empty if it is usable."""
    if kind == "effects":
        return (
            "" if hasattr(thing, "effects") or hasattr(thing, "candidates") else "it has no effects and no candidates"
        )
    if kind == "bases" and not isinstance(thing, type):
        return "it is not a class"
    if kind not in NEEDS:
        return "" if callable(thing) else "it cannot be called"
    abstract = getattr(thing, "__abstractmethods__", ()) if kind == "bases" else ()
    absent = [name for name in NEEDS[kind] if not hasattr(thing, name) or name in abstract]
    if absent:
        return f"it has no {', '.join(absent)}"
    if kind == "bases":
        if not is_dataclass(thing):
            return "it is not a dataclass"
        undeclared = [each.name for each in fields(thing) if "kind" not in each.metadata]
        return f"its fields are not declared with `key`: {', '.join(undeclared)}" if undeclared else ""
    return str(thing.complaint()) if kind == "dialects" and hasattr(thing, "complaint") else ""


@cache
def leave(plugin: str, source: str, kind: str, name: str, why: str) -> None:
    """Report, once, that a thing of a plugin is left out."""
    of = f" of {source}" if source else ""
    text = f"{name!r} of plugin {plugin!r}{of} left out of the {kind}: {why}"
    report(Message("NCF508", text, hint="report it to its author; docs/plugins.md describes what each hook registers"))


MIN_WORD_LETTERS = 7
"""Smallest number of letters of a title's word that is compared: names of makes and controls (`sinumerik`)."""


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint for an unknown name: the most similar known name, or all of them.

    known  the names; of a mapping to things with a `title`, long words of the titles are compared, too
    """
    from difflib import get_close_matches

    names, lower = sorted(known), name.lower()
    close = get_close_matches(lower, names, 1)
    if not close and isinstance(known, Mapping):
        titles = {each: str(getattr(known[each], "title", "")).lower() for each in names}
        close = [
            each
            for each in names
            if any(len(word) >= MIN_WORD_LETTERS and word in lower for word in titles[each].split())
        ]
    return f"did you mean {close[0]}?" if close else f"there are {', '.join(names)}"


@lru_cache(maxsize=1)
def load_plugins() -> Plugins:
    """All plugins of the entry-point group, loaded once per process; `load_plugins.cache_clear()` resets this."""
    return collect(installed())


def installed() -> list[EntryPoint]:
    """The enabled entry points of the group; those of ncfix first, then by distribution and name."""
    disabled = {name.strip() for name in os.environ.get("NCFIX_DISABLE_PLUGINS", "").split(",")}
    points = {(distribution(point), point.name): point for point in entry_points(GROUP)}
    order = sorted(points, key=lambda key: (key[0] != "ncfix", key))
    return [points[key] for key in order if disabled.isdisjoint(key)]


def collect(points: Iterable[EntryPoint]) -> Plugins:
    """Load plugins in order, each completely or not at all."""
    loaded: list[Plugin] = []
    problems: list[Message] = []
    for point in points:
        try:
            loaded.append(load_one(point, loaded))
        except PluginError as error:
            problems.extend(error.messages)
            for message in error.messages:
                report(message)
    return Plugins(tuple(loaded), tuple(problems))


def load_one(point: EntryPoint, earlier: Iterable[Plugin]) -> Plugin:
    """Import one plugin and collect what it registers; nothing takes effect unless all of it succeeds."""
    try:
        module = point.load()
    except (Exception, SystemExit) as error:
        why = f"cannot be imported: {describe(error)}{_where(point.module, error.__traceback__, only=True)}"
        raise left_out("NCF501", point, why, import_hint(error)) from error
    things = registrations(point, hooks_of(point, module))
    for plugin in earlier:
        for kind, named in things.items():
            for name in named:
                if name in plugin.things.get(kind, ()):
                    raise PluginError((name_taken(point.name, kind, name, f"plugin {plugin.name!r}"),))
    return Plugin(point.name, point.value, *described(point.dist), things)


def import_hint(error: BaseException) -> str:
    """A hint for a plugin that cannot be imported: the name that was probably meant, or whom to contact."""
    if isinstance(error, ImportError):
        found = re.match(r"cannot import name '(\w+)'", str(error))
        if found and error.name is not None and error.name.partition(".")[0] == OWN:
            return nearest(found[1], dir(import_module(error.name)))
        return "reinstall or uninstall it"
    return "report it to its author; NCFIX_DISABLE_PLUGINS leaves it out"


def hooks_of(point: EntryPoint, module: object) -> list[pluggy.HookCaller]:
    """The hooks that the plugin implements; unknown hooks are refused, and plugins without hooks.

    Each plugin has its own manager, so that a plugin that is left out leaves nothing behind.
    """
    manager = pluggy.PluginManager(GROUP)
    manager.add_hookspecs(hookspecs)
    try:
        manager.register(module, name=point.name)
        manager.check_pending()
    except pluggy.PluginValidationError as error:
        why = "has a hook that ncfix does not know: " + str(error).splitlines()[-1].partition(" in plugin <")[0]
        if wrong := re.search(r"definition: (.*)\nArgument", str(error)):
            why = f"has a hook with another argument than `register`: {wrong[1]}"
        raise left_out("NCF502", point, why, hook_hint(manager, module)) from error
    hooks = manager.get_hookcallers(module) or []
    unmarked = [name for name in HOOKS if hasattr(module, name) and name not in {hook.name for hook in hooks}]
    if unmarked or not hooks:
        why = f"has {unmarked[0]} without @hookimpl" if unmarked else "has no hooks"
        raise left_out("NCF506", point, why, "mark its functions with @hookimpl, from ncfix.plugin")
    return hooks


def hook_hint(manager: pluggy.PluginManager, module: object) -> str:
    """A hint with the hook that was probably meant."""
    from difflib import get_close_matches

    unknown = [hook.name for hook in manager.get_hookcallers(module) or () if not hook.has_spec()]
    close = [match for name in unknown for match in get_close_matches(name, HOOKS, 1)]
    return f"did you mean {close[0]}?" if close else "docs/plugins.md lists the hooks and their arguments"


def registrations(point: EntryPoint, hooks: Iterable[pluggy.HookCaller]) -> Things:
    """Call the hooks of a plugin; returns what it registers, by kind."""
    things: dict[str, dict[str, Any]] = {}
    for hook in hooks:
        kind = hook.name.removeprefix("register_")
        things[kind] = {}
        try:
            hook(register=Registrar(point.name, kind, things[kind]))
        except PluginError:
            raise
        except Exception as error:
            place = _where(point.module, error.__traceback__, only=True)
            why = f"failed in {hook.name}: {describe(error)}{place}"
            raise left_out("NCF504", point, why, "report it to its author") from error
    return things


@frozen
class Registrar:
    """The function `register` passed to one hook of one plugin."""

    plugin: str
    kind: str
    things: dict[str, Any]

    def __call__(self, thing: Any, name: str | None = None) -> None:
        """Register `thing` under `name` or its own name."""
        key = name if name is not None else getattr(thing, "name", None)
        if not isinstance(key, str) or not key:
            text = f"plugin {self.plugin!r} left out: it registers {thing!r} of {self.kind} without a name"
            raise PluginError((Message("NCF505", text, hint="register(thing, name=...)"),))
        if key in self.things:
            raise PluginError((name_taken(self.plugin, self.kind, key, "itself"),))
        self.things[key] = thing


def report(message: Message) -> None:
    """Warn that a plugin is left out; in strict mode, raise."""
    if os.environ.get("NCFIX_STRICT_PLUGINS", "") not in ("", "0"):
        raise PluginError((message,))
    warnings.warn(PluginWarning(message), stacklevel=2)


def left_out(code: str, point: EntryPoint, why: str, hint: str) -> PluginError:
    """The error that a plugin is left out, with the reason."""
    source = f" of {distribution(point)}" if distribution(point) else ""
    return PluginError((Message(code, f"plugin {point.name!r}{source} left out: it {why}", hint=hint),))


def name_taken(plugin: str, kind: str, name: str, owner: str) -> Message:
    """The message that a name is already registered."""
    text = f"plugin {plugin!r} left out: it registers {name!r} of {kind}, which {owner} has registered"
    return Message("NCF503", text, hint="leave one of them out with NCFIX_DISABLE_PLUGINS")


def distribution(point: EntryPoint) -> str:
    """Name of an entry point's distribution; empty if it has none."""
    return described(point.dist)[0]


@cache
def described(dist: Any) -> tuple[str, str]:
    """Name and version of a distribution; empty for None."""
    if dist is None:
        return "", ""
    metadata = dist.metadata
    return metadata["Name"], metadata["Version"]


def describe(error: BaseException) -> str:
    """An exception in one line."""
    lines = str(error).splitlines()
    return f"{type(error).__name__}: {lines[0]}" if lines else type(error).__name__


OWN = "ncfix"
"""The distribution whose plugins are part of ncfix."""
SINGULAR = {"bases": "basis"}


def called(
    kind: str, name: str, function: Callable[..., Any], *arguments: Any, gives: type | tuple[type, ...] = object
) -> Any:
    """Call a function of the thing registered under `name`, and check its result.

    Raises `PluginError`: NCF507 if a plugin's function raises anything but an error of ncfix, NCF508 if the result is
    not of the types `gives`.
    """
    with working(kind, name):
        found = function(*arguments)
    return handed(kind, name, found, gives)


def handed(kind: str, name: str, found: Any, gives: type | tuple[type, ...]) -> Any:
    """The object `found` that a plugin returned; raises `PluginError` NCF508 if it is not of the types `gives`."""
    plugin = _owner(kind, name)
    if plugin is None or isinstance(found, gives):
        return found
    types = gives if isinstance(gives, tuple) else (gives,)
    wanted = " or ".join("None" if each is type(None) else each.__name__ for each in types)
    text = f"{_said(plugin)} returned {type(found).__name__} as the {_singular(kind)} {name!r}, not {wanted}"
    raise PluginError.of("NCF508", text, hint=_hint(plugin))


def useless(kind: str, name: str, why: str, hint: str) -> PluginError:
    """The error NCF508: why the thing registered under `name` is unusable, and whose it is."""
    plugin = load_plugins().owner(kind, name)
    return PluginError.of("NCF508", why if plugin is None else f"{_said(plugin)}: {why}", hint=hint)


@contextmanager
def working(kind: str, name: str) -> Iterator[None]:
    """Context in which a registered thing works; raises `PluginError` NCF507, see `called`."""
    try:
        yield
    except NcfixError:
        raise
    except (Exception, SystemExit) as error:
        plugin = _owner(kind, name)
        if plugin is None:
            raise
        raise _failed(plugin, f" as the {_singular(kind)} {name!r}", error) from error


def blamed(error: BaseException) -> PluginError | None:
    """The `PluginError` for an uncaught exception if code of a plugin appears in its traceback; else None."""
    at_work = {_top(frame.f_globals.get("__name__", "")) for frame, _ in traceback.walk_tb(error.__traceback__)}
    try:
        plugins = load_plugins().loaded
    except NcfixError:  # strict mode: nothing came in, so nothing of it was at work
        return None
    for plugin in plugins:
        if plugin.distribution != OWN and _top(plugin.module) in at_work:
            made = _failed(plugin, "", error)
            made.__cause__ = error
            return made
    return None


def _failed(plugin: Plugin, what: str, error: BaseException) -> PluginError:
    text = f"{_said(plugin)} failed{what}: {describe(error)}"
    return PluginError((Message("NCF507", f"{text}{_where(plugin.module, error.__traceback__)}", hint=_hint(plugin)),))


def _where(module: str, trace: TracebackType | None, only: bool = False) -> str:
    """The last line of the plugin's module in a traceback, and the line of ncfix that it called, if any.

    only  without ncfix: it objected to what the plugin passed
    """
    last: dict[bool, str] = {}
    for frame, line in traceback.walk_tb(trace):
        top = _top(frame.f_globals.get("__name__", ""))
        if top == _top(module):
            last = {True: f"{os.path.basename(frame.f_code.co_filename)}:{line}"}
        elif top == OWN and last and not only:
            last[False] = f"in what it called of ncfix, {os.path.basename(frame.f_code.co_filename)}:{line}"
    return f" ({', '.join(last.values())})" if last else ""


def _owner(kind: str, name: str) -> Plugin | None:
    """The third-party plugin that registered this name; None otherwise."""
    plugin = load_plugins().owner(kind, name)
    return None if plugin is None or plugin.distribution == OWN else plugin


def _top(module: str) -> str:
    return module.partition(":")[0].partition(".")[0].strip()


def _singular(kind: str) -> str:
    return SINGULAR.get(kind, kind.removesuffix("s"))


def _said(plugin: Plugin) -> str:
    source = f" of {plugin.distribution} {plugin.version}" if plugin.distribution else ""
    return f"plugin {plugin.name!r}{source}"


def _hint(plugin: Plugin) -> str:
    return (
        f"report it to its author (ncfix --debug shows the traceback); NCFIX_DISABLE_PLUGINS={plugin.name} leaves it "
        "out"
    )
