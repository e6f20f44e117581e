"""Loading of plugins, one by one, whole or not at all; and whose fault it is when one of them fails.

A plugin that cannot be imported, has a hook that ncfix does not know, raises while it registers, or takes a name that
is taken, is left out with everything it had registered so far; a `PluginWarning` names it. With
`NCFIX_STRICT_PLUGINS=1` it is an error instead. `NCFIX_DISABLE_PLUGINS=name,name` leaves plugins out unloaded, by
entry point or distribution.

Whatever a plugin brings is called through `called`, or stands in the traceback of what it raised (`blamed`, which the
command line asks before it owns up to a fault of ncfix). Errors with a code pass: they are told as they are. So do
faults of what ncfix itself brings, which comes in as plugins do: those are faults of ncfix.
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
"""The contract speaks of things of all floors, so it stands above them, and the ground takes it by its name."""
GROUP: str = hookspecs.GROUP
HOOKS = tuple(sorted(name for name in vars(hookspecs) if name.startswith("register_")))

KINDS = tuple(hook.removeprefix("register_") for hook in HOOKS)
"""What can be registered, one kind a hook: "dialects", "bases", ..."""

Things = Mapping[str, Mapping[str, Any]]
"""Kind -> name -> thing."""


class PluginWarning(UserWarning):
    """A plugin was left out, or something of it; `message` says which and why."""

    def __init__(self, message: Message) -> None:
        super().__init__(str(message))
        self.message = message


@frozen
class Plugin:
    """A plugin that is in: its entry point's name, where it comes from, and what it registered."""

    name: str
    module: str
    distribution: str = ""
    version: str = ""
    things: Things = field(default_factory=dict)

    @property
    def hooks(self) -> tuple[str, ...]:
        """The hooks that it uses."""
        return tuple(f"register_{kind}" for kind in self.things)


@frozen
class Plugins:
    """All plugins that are in, and why others are not."""

    loaded: tuple[Plugin, ...]
    problems: tuple[Message, ...]

    def owner(self, kind: str, name: str) -> Plugin | None:
        """The plugin that registered this name."""
        return next((plugin for plugin in self.loaded if name in plugin.things.get(kind, ())), None)


def registry(kind: str, builtin: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Name -> thing of one kind: the built-in ones first, then what the plugins registered.

    A plugin's thing that bears the name of a built-in one, or is of no use for its kind (NCF508), is left out with a
    warning (an error in strict mode).
    """
    assert kind in KINDS, f"{kind!r} is none of {KINDS}"
    things = dict(builtin or {})
    for plugin in load_plugins().loaded:
        for name, thing in plugin.things.get(kind, {}).items():
            if name in things:
                report(taken(plugin.name, kind, name, "ncfix itself"))
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
"""Kind -> what its things have, of those kinds that are not merely called."""


def lacking(kind: str, thing: Any) -> str:
    """Why a thing cannot be one of its kind; empty if it can."""
    if kind == "effects":
        return (
            "" if hasattr(thing, "effects") or hasattr(thing, "candidates") else "it has no effects and no candidates"
        )
    if kind == "bases" and not isinstance(thing, type):
        return "it is no class"
    if kind not in NEEDS:
        return "" if callable(thing) else "it cannot be called"
    abstract = getattr(thing, "__abstractmethods__", ()) if kind == "bases" else ()
    absent = [name for name in NEEDS[kind] if not hasattr(thing, name) or name in abstract]
    if absent:
        return f"it has no {', '.join(absent)}"
    if kind == "bases":
        if not is_dataclass(thing):
            return "it is no dataclass"
        undeclared = [each.name for each in fields(thing) if "kind" not in each.metadata]
        return f"its fields are not declared with `key`: {', '.join(undeclared)}" if undeclared else ""
    return str(thing.complaint()) if kind == "dialects" and hasattr(thing, "complaint") else ""


@cache
def leave(plugin: str, source: str, kind: str, name: str, why: str) -> None:
    """Say once that something of a plugin is left out."""
    of = f" of {source}" if source else ""
    text = f"{name!r} of plugin {plugin!r}{of} left out of the {kind}: {why}"
    report(Message("NCF508", text, hint="tell its author; docs/plugins.md says what each hook registers"))


LONG = 7
"""A word of a title with so many letters is the name of a make or a control: `sinumerik`, `klartext`."""


def nearest(name: str, known: Iterable[str]) -> str:
    """A hint for a name that nobody registered: the one that was meant, perhaps, or all there are.

    known  the names; of a mapping to things with a `title` also the long words of these are compared
    """
    from difflib import get_close_matches

    names, lower = sorted(known), name.lower()
    close = get_close_matches(lower, names, 1)
    if not close and isinstance(known, Mapping):
        titles = {each: str(getattr(known[each], "title", "")).lower() for each in names}
        close = [each for each in names if any(len(word) >= LONG and word in lower for word in titles[each].split())]
    return f"did you mean {close[0]}?" if close else f"there are {', '.join(names)}"


@lru_cache(maxsize=1)
def load_plugins() -> Plugins:
    """Every plugin of the entry-point group, loaded once per process; `load_plugins.cache_clear()` forgets them."""
    return collect(installed())


def installed() -> list[EntryPoint]:
    """The entry points of the group that are not disabled; those of ncfix first, then by distribution and name."""
    disabled = {name.strip() for name in os.environ.get("NCFIX_DISABLE_PLUGINS", "").split(",")}
    points = {(distribution(point), point.name): point for point in entry_points(GROUP)}
    order = sorted(points, key=lambda key: (key[0] != "ncfix", key))
    return [points[key] for key in order if disabled.isdisjoint(key)]


def collect(points: Iterable[EntryPoint]) -> Plugins:
    """Load these entry points in order, each whole or not at all."""
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
    """Import one plugin and let it register everything, which nobody sees unless all goes well."""
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
                    raise PluginError((taken(point.name, kind, name, f"plugin {plugin.name!r}"),))
    return Plugin(point.name, point.value, *described(point.dist), things)


def import_hint(error: BaseException) -> str:
    """What helps with a plugin that cannot be imported: the name that was meant, or to whom to go."""
    if isinstance(error, ImportError):
        found = re.match(r"cannot import name '(\w+)'", str(error))
        if found and error.name is not None and error.name.partition(".")[0] == OWN:
            return nearest(found[1], dir(import_module(error.name)))
        return "reinstall or uninstall it"
    return "tell its author; NCFIX_DISABLE_PLUGINS leaves it out"


def hooks_of(point: EntryPoint, module: object) -> list[pluggy.HookCaller]:
    """The hooks that the plugin implements; refuses hooks that ncfix does not have, and none at all.

    Every plugin has a manager of its own, so that one that is left out leaves nothing behind.
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
    """What the author may have meant."""
    from difflib import get_close_matches

    unknown = [hook.name for hook in manager.get_hookcallers(module) or () if not hook.has_spec()]
    close = [match for name in unknown for match in get_close_matches(name, HOOKS, 1)]
    return f"did you mean {close[0]}?" if close else "docs/plugins.md lists the hooks and their arguments"


def registrations(point: EntryPoint, hooks: Iterable[pluggy.HookCaller]) -> Things:
    """Call the hooks of a plugin; what it registers, by kind."""
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
            raise left_out("NCF504", point, why, "tell its author") from error
    return things


@frozen
class Registrar:
    """The `register` function of one hook of one plugin."""

    plugin: str
    kind: str
    things: dict[str, Any]

    def __call__(self, thing: Any, name: str | None = None) -> None:
        """File `thing` under `name` or its own name."""
        key = name if name is not None else getattr(thing, "name", None)
        if not isinstance(key, str) or not key:
            text = f"plugin {self.plugin!r} left out: it registers {thing!r} of {self.kind} without a name"
            raise PluginError((Message("NCF505", text, hint="register(thing, name=...)"),))
        if key in self.things:
            raise PluginError((taken(self.plugin, self.kind, key, "itself"),))
        self.things[key] = thing


def report(message: Message) -> None:
    """Warn of a plugin that is left out; raise in strict mode."""
    if os.environ.get("NCFIX_STRICT_PLUGINS", "") not in ("", "0"):
        raise PluginError((message,))
    warnings.warn(PluginWarning(message), stacklevel=2)


def left_out(code: str, point: EntryPoint, why: str, hint: str) -> PluginError:
    """The error that says that this plugin is not in, and why."""
    source = f" of {distribution(point)}" if distribution(point) else ""
    return PluginError((Message(code, f"plugin {point.name!r}{source} left out: it {why}", hint=hint),))


def taken(plugin: str, kind: str, name: str, owner: str) -> Message:
    """Remark on a name that is taken."""
    text = f"plugin {plugin!r} left out: it registers {name!r} of {kind}, which {owner} has registered"
    return Message("NCF503", text, hint="NCFIX_DISABLE_PLUGINS leaves one of them out")


def distribution(point: EntryPoint) -> str:
    """The name of the distribution that an entry point belongs to, empty for none."""
    return described(point.dist)[0]


@cache
def described(dist: Any) -> tuple[str, str]:
    """Name and version of a distribution, empty for none."""
    if dist is None:
        return "", ""
    metadata = dist.metadata
    return metadata["Name"], metadata["Version"]


def describe(error: BaseException) -> str:
    """An exception in one line."""
    lines = str(error).splitlines()
    return f"{type(error).__name__}: {lines[0]}" if lines else type(error).__name__


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
    text = f"{_said(plugin)} returned {type(found).__name__} as the {_singular(kind)} {name!r}, not {wanted}"
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
        raise _failed(plugin, f" as the {_singular(kind)} {name!r}", error) from error


def blamed(error: BaseException) -> PluginError | None:
    """The `PluginError` of an exception that came all the way up, if code of a plugin's was at work."""
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
    """The last line of the plugin's module that was at work, and that of ncfix below it, if it called that.

    only  nothing of ncfix: it objects to what the plugin gave it
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
    """The plugin of somebody else that registered this name."""
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
    return f"tell its author (ncfix --debug shows the traceback); NCFIX_DISABLE_PLUGINS={plugin.name} leaves it out"
