"""Which errors a formula shall have: the ISO 230-1 symbols of a machine, chosen by group, name or pattern."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from fnmatch import fnmatchcase

from ncfix.diagnostics import NcfixError, UsageError
from ncfix.machine.axes import COMPONENTS, SPINDLE, Effect, Vector, component_title
from ncfix.machine.machine import Machine
from ncfix.machine.symbolic.variables import Size, Variable

DEFAULT = ("motions", "locations", "spindle")
GROUPS = ("motions", "locations", "spindle", "machine")
"""Error motions of the axes; location errors of the axes; location errors of the spindle; what the machine file has."""


@dataclass(frozen=True, slots=True)
class ErrorSymbol:
    """An error component of a joint as a variable, with what the machine file says of it.

    reference  where its rotation causes no translation, base frame; None: the joint's own reference point
    carried    a location error that carries the body
    """

    variable: Variable
    joint: str
    component: int
    location: bool
    reference: Vector | None
    carried: bool


def chosen(machine: Machine, include: str | Iterable[str] = DEFAULT) -> list[ErrorSymbol]:
    """The errors that `include` names: groups, names, patterns such as "E?C"; raises `UsageError` NCF393."""
    everything = list(_names(machine))
    wanted: set[str] = set()
    for item in [include] if isinstance(include, str) else include:
        found = _group(machine, item) if item in GROUPS else {n for n in everything if fnmatchcase(n, item)}
        if not found and item != "machine":
            raise _nothing(item, everything)
        wanted |= found
    return [_symbol(machine, name) for name in everything if name in wanted]


def _names(machine: Machine) -> Iterable[str]:
    for joint in (*machine.axis_names, SPINDLE):
        yield from (f"E{component}{joint}" for component in COMPONENTS)
        yield from (f"E{component}0{joint}" for component in COMPONENTS)


def _group(machine: Machine, group: str) -> set[str]:
    if group == "machine":
        return {effect.name for effect in machine.effects if effect.active}
    if group == "spindle":
        return {f"E{component}0{SPINDLE}" for component in COMPONENTS}
    zero = "0" if group == "locations" else ""
    return {f"E{component}{zero}{axis}" for axis in machine.axis_names for component in COMPONENTS}


def _nothing(item: str, names: Sequence[str]) -> NcfixError:
    close = get_close_matches(item, (*GROUPS, *names), 1)
    hint = f"did you mean {close[0]}? " if close else ""
    text = f"{item!r} names no error of this machine"
    return UsageError.of("NCF393", text, hint=f"{hint}{', '.join(GROUPS)}, a name or a pattern such as E?C")


def _symbol(machine: Machine, name: str) -> ErrorSymbol:
    same = [effect for effect in machine.effects if effect.name == name and effect.active] or [Effect(name, (0.0,))]
    effect = same[0]
    if len({(_reference(it), it.carried) for it in same}) > 1:
        text = f"the effects {name} of this machine differ in reference or carried: one symbol cannot stand for them"
        raise UsageError.of("NCF393", text, hint="leave it out, or give them one reference point")
    axes = {axis.name: axis for axis in machine.axes}
    title = component_title(name, axes.get(effect.joint))
    return ErrorSymbol(
        variable=Variable(name, Size.SMALL, title, rotary=effect.rotational, arguments=_arguments(same)),
        joint=effect.joint,
        component=effect.component,
        location=effect.location,
        reference=_reference(effect),
        carried=effect.carried or (effect.location and effect.joint == SPINDLE),
    )


def _reference(effect: Effect) -> Vector | None:
    """Only a rotation needs one."""
    return effect.reference if effect.rotational else None


def _arguments(same: Sequence[Effect]) -> tuple[str, ...]:
    effect = same[0]
    own = () if effect.location or effect.joint == SPINDLE else (effect.joint,)
    signals = (signal for it in same for signal in (it.signal, it.times) if signal is not None)
    return tuple(dict.fromkeys((*own, *signals)))
