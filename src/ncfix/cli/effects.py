"""`ncfix effects`: the names that an effect in a machine file may have, and the bases."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import click

from ncfix.cli import console
from ncfix.cli.completion import PATH
from ncfix.cli.options import json_option, load_machine

if TYPE_CHECKING:
    from ncfix.machine import Machine

Row = dict[str, str]

GENERIC = """
ncfix = 1
topology = "w C B F X Y Z t"
axis.X = { type = "linear", direction = [1, 0, 0], range = [-250, 250], pitch = 10 }
axis.Y = { type = "linear", direction = [0, 1, 0], range = [-250, 250], pitch = 10 }
axis.Z = { type = "linear", direction = [0, 0, 1], range = [-250, 250], pitch = 10 }
axis.B = { type = "rotary", direction = [0, -1, 0] }
axis.C = { type = "rotary", direction = [0, 0, -1] }
"""
"""The machine whose effects are listed if none is given."""


@click.command()
@click.option("-m", "--machine", "path", type=PATH, metavar="FILE", help="List the effects that this machine can have.")
@click.option("--bases", is_flag=True, help="List the bases for `basis = ...` with their keys instead.")
@json_option
def effects(path: str | None, bases: bool, as_json: bool) -> None:
    """List the error effects that a machine file may have: ISO 230-1 components, then physical effects by name.

    Without a machine, those of one with X Y Z and a table with B and C.
    """
    rows = _bases() if bases else _effects(path)
    if as_json:
        console.put_json(**{"bases" if bases else "effects": rows})
    elif rows:
        console.table(tuple(rows[0]), [tuple(row.values()) for row in rows])


def _effects(path: str | None) -> list[Row]:
    from ncfix.machine import loads

    machine = load_machine(path) if path else loads(GENERIC)
    return [*_components(machine, with_all=path is None), *_physical(machine), *_nameless(machine)]


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
        title = component_title(name, axes.get(name[-1]))
        unit = "rad" if effect.rotational else "mm"
        square = squareness_meaning(name)
        basis, much = usual_basis(name), large_size(name)
        rows.append(_row(name, title, unit=unit, basis=basis, much=much, seen=seen, squareness=square))
    return rows


def _physical(machine: Machine) -> list[Row]:
    from ncfix.machine.effects import library

    rows = []
    for named in library(machine).values():
        parts = dict.fromkeys(f"{each.name} {each.basis.name}" for each in named.effects)
        unit = " ".join(dict.fromkeys("rad" if each.rotational else "mm" for each in named.effects))
        much = "" if math.isnan(named.largest) else f"{named.largest:g}"
        seen, needs = " ".join(named.instruments), " ".join(named.needs)
        rows.append(_row(named.name, named.title, unit=unit, basis=", ".join(parts), much=much, seen=seen, needs=needs))
    return rows


def _nameless(machine: Machine) -> list[Row]:
    """Effects of plugins that this machine cannot have, or that only diagnosis knows."""
    from ncfix.machine.effects import library
    from ncfix.plugins import registry

    there = library(machine)
    absent = ((name, each) for name, each in registry("effects").items() if name not in there)
    return [_row(name, getattr(each, "title", "")) for name, each in absent]


def _row(
    name: str,
    title: str,
    *,
    unit: str = "",
    basis: str = "",
    much: str = "",
    seen: str = "",
    needs: str = "",
    squareness: str = "",
) -> Row:
    """A row of the table; the order is that of its columns."""
    return {
        "name": name,
        "unit": unit,
        "title": title,
        "basis": basis,
        "much": much,
        "seen by": seen,
        "needs": needs,
        "squareness": squareness,
    }


def _bases() -> list[Row]:
    from dataclasses import fields

    from ncfix.machine.effects import kinds

    return [
        {"name": name, "title": basis.title, "keys": ", ".join(field.name for field in fields(basis))}  # type: ignore[arg-type]
        for name, basis in sorted(kinds().items())
    ]
