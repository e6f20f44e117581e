"""An [[effect]] of a machine file that has the name of a physical effect: `backlash-X`, `spindle-growth`, a plugin's.

The name stands for components, bases and inputs; the file gives the coefficients, of all of its components in turn.
"""

from __future__ import annotations

from dataclasses import replace

from ncfix.machine.effect import Effect
from ncfix.machine.fields import Section
from ncfix.machine.library import Named


def read_named(section: Section, named: Named) -> tuple[Effect, ...]:
    """The effects that it is made of; nothing if something is wrong (then it is noted)."""
    section.text("name")
    before = len(section.report.messages)
    values = section.numbers("coefficients", required=True)
    constant = section.number("time_constant_s")
    reference = section.numbers("reference", count=3)
    size = sum(effect.basis.size for effect in named.effects)
    if values is not None and len(values) != size:
        section.note("NCF311", "coefficients", f"{len(values)} coefficients, {named.name} has {size}", _parts(named))
    if constant is not None:
        _check_lag(section, named, constant)
    section.close()
    if values is None or len(section.report.messages) > before:
        return ()
    point = None if reference is None else (reference[0], reference[1], reference[2])
    found, at = [], 0
    for effect in named.effects:
        own = values[at : at + effect.basis.size]
        at += effect.basis.size
        lag = effect.time_constant_s if constant is None else constant
        found.append(replace(effect, coefficients=own, time_constant_s=lag, reference=point))
    return tuple(found)


def _check_lag(section: Section, named: Named, constant: float) -> None:
    lagging = {effect.time_constant_s for effect in named.effects}
    if lagging == {None}:
        section.note("NCF315", "time_constant_s", f"{named.name} follows nothing after a time")
    elif len(lagging) > 1:
        text = f"{named.name} has several time constants"
        section.note("NCF315", "time_constant_s", text, "write its components one by one: `ncfix effects` shows them")
    elif constant <= 0:
        section.note("NCF305", "time_constant_s", f"{constant:g} is not positive")


def _parts(named: Named) -> str:
    return "one each for " + ", ".join(f"{e.name} {label}" for e in named.effects for label in e.basis.labels)
