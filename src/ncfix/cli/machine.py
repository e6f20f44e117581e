"""`ncfix machine check|show FILE`: is a machine file in order, and what does it say."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.completion import PATH
from ncfix.cli.options import json_option, load_machine
from ncfix.cli.targets import shown
from ncfix.diagnostics import ExitCode, Message, Place, visible
from ncfix.plugins import nearest, registry

if TYPE_CHECKING:
    from ncfix.machine import Axis, Effect, Machine


@click.group()
def machine() -> None:
    """Check or show a machine file."""


@machine.command()
@click.argument("file", type=PATH)
@json_option
def check(file: str, as_json: bool) -> int:
    """Check that FILE describes a machine.

    Every fault of the file is named at once. Exit code 1: it can be read, but there is no such machine.
    """
    from ncfix.machine.plausible import doubts

    found = load_machine(file)
    odd = doubts(found, shown(file))
    impossible = sum(doubt.impossible for doubt in odd)
    remarks = [*(doubt.message for doubt in odd), *_remarks(found, shown(file))]
    console.tell(*remarks)
    name = f"{visible(shown(file))}: {visible(found.name)}"
    if as_json:
        said = [message.as_dict() for message in remarks]
        console.put_json(path=shown(file), ok=not impossible, name=found.name, hash=found.hash, remarks=said)
    elif impossible:
        console.say(f"{name}: {console.counted(impossible, 'fault')}: no machine is like this one")
    else:
        axes = "1 axis" if len(found.axes) == 1 else f"{len(found.axes)} axes"
        effects = console.counted(len(found.effects), "effect")
        console.say(f"{name}: in order, {axes}, {effects}")
    return ExitCode.FINDINGS if impossible else ExitCode.DONE


def _remarks(machine: Machine, path: str) -> list[Message]:
    """What is possible and odd: a control that nobody here knows (a plugin may), play with the other sign."""
    from ncfix.machine.effects import runs_ahead

    said = []
    known = {*registry("dialects"), *registry("controls")}
    if machine.control and machine.control not in known:
        text = f"control: {machine.control!r} has neither a dialect nor tables here, and is passed over"
        said.append(Message("NCF318", text, Place(path), nearest(machine.control, known)))
    ahead = {effect.name for axis in machine.axes for effect in machine.effects if runs_ahead(axis, effect)}
    for name in sorted(ahead):
        text = f"{name}: the body is ahead of its axis on both ways; lost motion has the other sign here"
        said.append(Message("NCF319", text, Place(path), "it stays if the control takes out more play than there is"))
    return said


@machine.command()
@click.argument("file", type=PATH)
@json_option
def show(file: str, as_json: bool) -> None:
    """Print the chain and the errors of a machine.

    The chain goes from workpiece to tool; the errors have their size over the travel.
    """
    found = load_machine(file)
    if as_json:
        console.put_json(path=shown(file), **_as_dict(found))
    else:
        console.put("\n".join(_page(found)) + "\n")


def _as_dict(machine: Machine) -> dict[str, Any]:
    return {
        "name": machine.name,
        "hash": machine.hash,
        "topology": machine.topology,
        "control": machine.control,
        "axes": [
            {
                "name": axis.name,
                "type": "rotary" if axis.rotary else "linear",
                "carries": "workpiece" if axis.workpiece_side else "tool",
                "direction": axis.direction,
                "point": axis.point,
                "range": [limit / axis.unit for limit in axis.range],
            }
            for axis in machine.axes
        ],
        "effects": [_effect_as_dict(machine, effect) for effect in machine.effects],
        "provenance": machine.provenance,
    }


def _effect_as_dict(machine: Machine, effect: Effect) -> dict[str, Any]:
    from ncfix.machine.effects import extent, title_of

    found = extent(machine, effect)
    return {
        "name": effect.name,
        "title": title_of(machine, effect),
        "axis": effect.joint,
        "basis": effect.basis.name,
        "depends_on": [signal for signal in (effect.signal, effect.times) if signal is not None],
        "coefficients": effect.coefficients,
        "unit": "urad" if effect.rotational else "um",
        "range": [value * 1e3 * (1e3 if effect.rotational else 1.0) for value in found] if found else None,
    }


def _page(machine: Machine) -> list[str]:
    return [f"{machine.name}  ({machine.hash})", *_facts(machine), "", *_chain(machine), *_errors(machine)]


def _facts(machine: Machine) -> list[str]:
    from ncfix.machine.effects import facts

    return [f"{name + ':':<20}{value}" for name, value in facts(machine).items()]


def _chain(machine: Machine) -> list[str]:
    """The joints as they follow one another."""
    from ncfix.machine.effects import vector

    workpiece = [_axis(axis) for axis in machine.axes if axis.workpiece_side]
    tool = [_axis(axis) for axis in machine.axes if not axis.workpiece_side]
    end = f"tool        tip to spindle {vector(machine.tool.direction)}, gauge line at {vector(machine.tool.point)}"
    return ["workpiece", *workpiece, "foundation", *tool, end]


def _axis(axis: Axis) -> str:
    from ncfix.machine.effects import travel_of, vector

    along = f"along {vector(axis.direction)}"
    where = f"about {vector(axis.direction)} through {vector(axis.point)}" if axis.rotary else along
    return f"  {axis.name}  {'rotary' if axis.rotary else 'linear'}  {travel_of(axis):<20}  {where}"


def _errors(machine: Machine) -> list[str]:
    if not machine.effects:
        return ["", "no errors: a perfect machine"]
    lines = []
    for joint in (*machine.axis_names, "S"):
        found = [effect for effect in machine.effects if effect.joint == joint]
        if found:
            lines += ["", f"errors of {joint}" if joint != "S" else "errors of the spindle"]
            lines += [_effect(machine, effect) for effect in found]
    return lines


def _effect(machine: Machine, effect: Effect) -> str:
    from ncfix.machine.effects import depends_on

    facts = _effect_as_dict(machine, effect)
    if facts["range"] is None:
        size = "size not known from the file"
    else:
        low, high = facts["range"]
        size = f"{low:+.3g} {facts['unit']}" if low == high else f"{low:+.3g} ... {high:+.3g} {facts['unit']}"
    return f"  {effect.name:<5} {facts['title']:<44} {depends_on(effect):<28} {size}"
