"""Verbs for machines: `ncfix machine check|show`, `ncfix effects`, `ncfix derive`.

They check and print machine files, list the effects and bases that these can use, and derive the error equations of a
machine symbolically.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.options import PATH, force_option, json_option, load_machine
from ncfix.cli.targets import STREAM, Outputs, shown, targets
from ncfix.diagnostics import ExitCode, Message, Place, visible
from ncfix.plugins import nearest, registry

if TYPE_CHECKING:
    from ncfix.machine import Effect, Machine
    from ncfix.machine.symbolic import Derivation

Row = dict[str, str]
COLUMNS = ("name", "unit", "title", "basis", "much", "seen by", "needs", "squareness")
"""Columns of the table of effects."""
GENERIC = """
ncfix = 1
topology = "w C B F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-250, 250], pitch = 10 }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-250, 250], pitch = 10 }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-250, 250], pitch = 10 }
axis.B = { type = "rotary", direction = [0, -1, 0] }
axis.C = { type = "rotary", direction = [0, 0, -1] }
"""
"""The machine whose effects are listed if no machine is given."""
CONSTANT = ("locations", "spindle")
"""Default selection of errors for a measuring protocol: the constant ones."""


@click.group()
def machine() -> None:
    """Check or show a machine file."""


@machine.command()
@click.argument("file", type=PATH)
@json_option
def check(file: str, as_json: bool) -> int:
    """Check a machine file: its form, and whether its values are possible.

    All faults are reported together. Exit code 1: the file can be read, but describes an impossible machine.
    """
    from ncfix.machine.plausible import doubts

    found = load_machine(file)
    odd = doubts(found, shown(file), lines=True)
    impossible = sum(doubt.impossible for doubt in odd)
    remarks = [*(doubt.message for doubt in odd), *_remarks(found, shown(file))]
    console.tell(*remarks)
    name = f"{visible(shown(file))}: {visible(found.name)}"
    if as_json:
        console.put_json(path=shown(file), ok=not impossible, name=found.name, hash=found.hash, remarks=remarks)
    elif impossible:
        console.say(f"{name}: {console.counted(impossible, 'fault')}: this machine is impossible")
    else:
        axes = "1 axis" if len(found.axes) == 1 else f"{len(found.axes)} axes"
        effects = console.counted(len(found.effects), "effect")
        console.say(f"{name}: no faults, {axes}, {effects}")
    return ExitCode.FINDINGS if impossible else ExitCode.DONE


def _remarks(machine: Machine, path: str) -> list[Message]:
    """Remarks on valid but unusual values: an unknown control (a plugin may know it), play of opposite sign."""
    from ncfix.machine.effects import runs_ahead

    remarks = []
    known = registry("controls") | registry("dialects")
    if machine.control and machine.control not in known:
        text = f"control: {machine.control!r} is neither a dialect nor a control with tables, and is ignored"
        remarks.append(Message("NCF318", text, Place(path), nearest(machine.control, known)))
    ahead = {effect.name for axis in machine.axes for effect in machine.effects if runs_ahead(axis, effect)}
    for name in sorted(ahead):
        text = (
            f"{name}: with this sign the body is ahead of its axis in both directions; lost motion has the opposite "
            "sign here"
        )
        remarks.append(
            Message(
                "NCF319", text, Place(path), "keep the sign only if the control compensates more backlash than there is"
            )
        )
    return remarks


@machine.command()
@click.argument("file", type=PATH)
@json_option
def show(file: str, as_json: bool) -> None:
    """Print the axes and the errors of a machine.

    The axes are in the order from workpiece to tool. The size of an error is its range over the travel.
    """
    found = load_machine(file)
    if as_json:
        console.put_json(path=shown(file), **_machine_as_dict(found))
    else:
        console.put("\n".join(_page(found)) + "\n")


def _machine_as_dict(machine: Machine) -> dict[str, Any]:
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


def _page(machine: Machine) -> Iterator[str]:
    """The general facts, the axes in their order, and the errors of each."""
    from ncfix.machine.effects import depends_on, facts, travel_of, vector

    yield f"{machine.name}  ({machine.hash})"
    yield from (f"{name + ':':<20}{value}" for name, value in facts(machine).items())
    for heading, on_workpiece in (("\nworkpiece", True), ("foundation", False)):
        yield heading
        for axis in (each for each in machine.axes if each.workpiece_side == on_workpiece):
            through = f" through {vector(axis.point)}" if axis.rotary else ""
            kind, where = ("rotary", "about") if axis.rotary else ("linear", "along")
            yield f"  {axis.name}  {kind}  {travel_of(axis):<20}  {where} {vector(axis.direction)}{through}"
    yield f"tool        tip to spindle {vector(machine.tool.direction)}, gauge line at {vector(machine.tool.point)}"
    if not machine.effects:
        yield "\nno errors"
    for joint in (*machine.axis_names, "S"):
        found = [effect for effect in machine.effects if effect.joint == joint]
        if found:
            yield f"\nerrors of {joint}" if joint != "S" else "\nerrors of the spindle"
        for effect in found:
            entry = _effect_as_dict(machine, effect)
            size = "size not known: depends on an input or an axis without range"
            if entry["range"] is not None:
                low, high = entry["range"]
                size = f"{low:+.3g} {entry['unit']}" if low == high else f"{low:+.3g} ... {high:+.3g} {entry['unit']}"
            yield f"  {effect.name:<5} {entry['title']:<44} {depends_on(effect):<28} {size}"


@click.command()
@click.option(
    "-m",
    "--machine",
    "path",
    type=PATH,
    metavar="FILE",
    help="Machine file: list the effects that this machine can have.",
)
@click.option("--bases", is_flag=True, help="List the bases for `basis = ...` and their keys instead.")
@json_option
def effects(path: str | None, bases: bool, as_json: bool) -> None:
    """List the error effects that a machine file may have: ISO 230-1 components, then physical effects by name.

    Without --machine: those of a machine with X, Y, Z and a table with B and C.
    """
    from ncfix.machine import loads

    if bases:
        rows = _bases()
    else:
        machine = load_machine(path) if path else loads(GENERIC)
        rows = [*_components(machine, with_all=path is None), *_physical(machine), *_nameless(machine)]
    if as_json:
        console.put_json(**{"bases" if bases else "effects": rows})
    elif rows:
        console.table(tuple(rows[0]), [tuple(row.values()) for row in rows])


def _components(machine: Machine, with_all: bool) -> list[Row]:
    from ncfix.machine.axes import (
        SPINDLE,
        Effect,
        component_names,
        component_title,
        instruments_for,
        large_size,
        squareness_meaning,
        usual_basis,
    )

    letters = "XYZABC" if with_all else "".join(machine.axis_names)
    axes = {axis.name: axis for axis in machine.axes}
    rows = []
    for name in component_names(letters + SPINDLE):
        effect = Effect(name, ())
        seen = instruments_for(name)
        title = component_title(name, axis := axes.get(name[-1]))
        unit = "rad" if effect.rotational else "mm"
        square = squareness_meaning(name)
        basis, much = usual_basis(name, axis), large_size(name)
        rows.append(_row(name, title, unit=unit, basis=basis, much=much, seen_by=seen, squareness=square))
    return rows


def _physical(machine: Machine) -> list[Row]:
    from ncfix.machine.effects import library

    rows = []
    for named in library(machine).values():
        parts = dict.fromkeys(f"{each.name} {each.basis.name}" for each in named.effects)
        unit = " ".join(dict.fromkeys("rad" if each.rotational else "mm" for each in named.effects))
        much = "" if math.isnan(named.largest) else f"{named.largest:g}"
        seen, needs = " ".join(named.instruments), " ".join(named.needs)
        rows.append(
            _row(named.name, named.title, unit=unit, basis=", ".join(parts), much=much, seen_by=seen, needs=needs)
        )
    return rows


def _nameless(machine: Machine) -> list[Row]:
    """Effects of plugins that this machine cannot have, or that only diagnosis uses."""
    from ncfix.machine.effects import library
    from ncfix.plugins import registry

    there = library(machine)
    absent = ((name, each) for name, each in registry("effects").items() if name not in there)
    return [_row(name, getattr(each, "title", "")) for name, each in absent]


def _row(name: str, title: str, **others: str) -> Row:
    """A row of the table, with the columns in their order."""
    cells = {"name": name, "title": title, **others}
    return {column: cells.get(column.replace(" ", "_"), "") for column in COLUMNS}


def _bases() -> list[Row]:
    from dataclasses import fields

    from ncfix.machine.effects import kinds

    return [
        {"name": name, "title": basis.title, "keys": ", ".join(field.name for field in fields(basis))}  # type: ignore[arg-type]
        for name, basis in sorted(kinds().items())
    ]


@click.command()
@click.option("-m", "--machine", "machine_path", type=PATH, metavar="FILE", help="The machine file (TOML).")
@click.option(
    "--chain", "chain_path", type=PATH, metavar="FILE", help="Chain file (docs/derive.md) instead of a machine file."
)
@click.option(
    "--order", type=click.IntRange(1, 4), default=1, show_default=True, help="Order of the expansion in the errors."
)
@click.option(
    "--effects",
    metavar="LIST",
    help="Errors to include: the groups motions, locations, spindle, machine; names or patterns like E?C.",
)
@click.option("--letters", is_flag=True, help="Write fixed angles between axes as letters instead of values.")
@click.option("--latex", "form", flag_value="latex", help="Print LaTeX.")
@click.option("--python", "form", flag_value="python", help="Print a Python module of numpy functions.")
@click.option("--c", "form", flag_value="c", help="Print C source of the same functions.")
@click.option(
    "--protocol", "form", flag_value="protocol", help="Print which errors can be identified, and a measuring protocol."
)
@click.option("--vary", metavar="LIST", default="tool_length", help="Lengths that are varied too, for --protocol.")
@click.option(
    "-o", "--output", type=PATH, metavar="FILE", default=STREAM, help="Output file; default: standard output."
)
@force_option
@json_option
def derive(
    machine_path: str | None,
    chain_path: str | None,
    order: int,
    effects: str | None,
    letters: bool,
    form: str | None,
    vary: str,
    output: str,
    force: bool,
    as_json: bool,
) -> None:
    """Derive the formulas of the tool tip and of its error for a machine, simplified.

    Needs the extra `symbolic`: pip install "ncfix[symbolic]".
    """
    if (machine_path is None) == (chain_path is None):
        raise click.UsageError("give one of --machine and --chain")
    if as_json and form and output == STREAM:
        raise click.UsageError(f"--json prints the formulas itself; --{form} together with it needs -o FILE")
    source = machine_path or chain_path or ""
    target = targets([source], Outputs(output, force=force))[0]
    from ncfix.machine import symbolic

    include = effects.split(",") if effects else None
    if chain_path is not None:
        derivation = symbolic.derive(symbolic.load_chain(chain_path), order, include)
    else:
        include = list(CONSTANT) if include is None and form == "protocol" else include
        with console.busy("deriving"):
            derivation = symbolic.derive(load_machine(source), order, include, letters)
    if not as_json or target.file:
        with console.busy("writing the formulas"):
            if form == "protocol":
                text = symbolic.measuring(derivation, vary.split(","))
            else:
                written = {"latex": symbolic.to_latex, "python": symbolic.to_python, "c": symbolic.to_c}
                text = written.get(form or "", symbolic.to_text)(derivation)
        target.write(text.encode())
    if as_json:
        console.put_json(**_derivation_as_dict(derivation))


def _derivation_as_dict(derivation: Derivation) -> dict[str, Any]:
    from ncfix.machine.symbolic import inverse_nominal

    inverse = inverse_nominal(derivation)
    return {
        "name": derivation.chain.name,
        "order": derivation.order,
        "variables": [
            {"name": v.name, "size": v.size.value, "axis": v.axis, "value": v.value, "definition": v.definition}
            for v in derivation.chain.variables
        ],
        "nominal": {name: str(formula) for name, formula in derivation.nominal.items()},
        "inverse": {name: str(formula) for name, formula in inverse.formulas.items()},
        "inverse_notes": inverse.notes,
        "error": {name: str(formula) for name, formula in derivation.error.items()},
        "without_effect": derivation.without_effect,
    }
