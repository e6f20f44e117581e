"""`ncfix plan`: the poses that tell most about a machine's errors."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import click

from ncfix.cli import console
from ncfix.cli.completion import PATH
from ncfix.cli.options import Length, force_option, json_option, load_machine, machine_option, table_option
from ncfix.cli.targets import JSON, STREAM, Outputs, check_streams, read, shown, targets

if TYPE_CHECKING:
    from ncfix.machine import Machine
    from ncfix.measure.candidates import Room
    from ncfix.measure.plan import Planned

KINDS = ("tcp", "tcp6", "probe", "length")
ROUNDING = 1e-9
"""mm or degree: no way beyond the travel."""


@click.command()
@machine_option
@click.option("--kind", type=click.Choice(KINDS), default="tcp", show_default=True, help="What will be measured.")
@click.option("-n", "--count", type=click.IntRange(min=1), default=40, show_default=True, help="How many poses.")
@click.option("--effects", metavar="LIST", help="Effects to be determined, as for calibrate.")
@click.option("--separate", metavar="EFFECT,EFFECT", help="Find poses that tell these effects apart.")
@click.option("--existing", type=PATH, metavar="FILE", help="A measurement that the new poses complete.")
@click.option("--range", "ranges", multiple=True, metavar="AXIS=LOW,HIGH", help="Where the axis may go (repeatable).")
@click.option("--tool-length", "lengths", multiple=True, type=Length(), metavar="MM", help="A tool (repeatable).")
@click.option(
    "--ball",
    "balls",
    multiple=True,
    metavar="NAME=X,Y,Z",
    help="Where a ball stands, kinds probe and tcp (repeatable).",
)
@click.option(
    "--reach", "reaches", multiple=True, metavar="x=LOW,HIGH", help="Where the tip may be: x, y or z (repeatable)."
)
@click.option(
    "--input", "inputs", multiple=True, metavar="NAME=LOW,HIGH", help="What else can be set, e.g. load_kg (repeatable)."
)
@click.option("--gcode", type=PATH, metavar="FILE", help="Also write a skeleton of the program that goes to the poses.")
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Other candidates.")
@table_option
@force_option
@json_option
def plan(
    machine_path: str,
    kind: str,
    count: int,
    effects: str | None,
    separate: str | None,
    existing: str | None,
    ranges: tuple[str, ...],
    lengths: tuple[float, ...],
    balls: tuple[str, ...],
    reaches: tuple[str, ...],
    inputs: tuple[str, ...],
    gcode: str | None,
    seed: int,
    output: str,
    force: bool,
    as_json: bool,
) -> None:
    """Choose the poses to be measured, and write them as a measurement file to be filled in."""
    from ncfix.measure.plan import plan as planned
    from ncfix.measure.program import skeleton
    from ncfix.measure.reader import reads
    from ncfix.measure.writer import dumps

    sources = () if existing is None else (existing,)
    target = targets([machine_path], Outputs(output, force=force), sources)[0]
    program = targets([machine_path], Outputs(gcode, force=force), sources)[0] if gcode else None
    check_streams(JSON if as_json else None, program=program, poses=None if as_json else target)
    machine = load_machine(machine_path)
    before = reads(read(existing), machine, shown(existing)) if existing else None
    names = [name.strip() for name in separate.split(",")] if separate else []
    room = _room(ranges, lengths, balls, reaches, inputs, machine)
    with console.busy("choosing poses"):
        found = planned(machine, kind, count, room, effects, names, before, seed)
    empty = found.plan.form.measured if kind != "probe" else ()
    text = dumps(found.plan, empty)
    if program:
        program.write(skeleton(found.plan, machine).encode())
    figures = {"worst_um": found.worst_um, "mean_um": found.mean_um, "determined": len(found.seen)}
    listed = {"unseen": found.unseen, "open": found.open}
    if as_json:
        console.put_json(kind=kind, count=count, **figures, **listed, output=output)
    if not as_json or output != STREAM:
        target.write(text.encode())
    _say(found, separated=bool(separate))


def _say(planned: Planned, *, separated: bool) -> None:
    """What the poses do not tell, and how well the tip error will be known where that was sought."""
    if planned.unseen:
        console.say(f"no pose of this kind tells {', '.join(planned.unseen)} from the rest")
    if not separated:
        console.say(
            f"tip error known to {planned.worst_um:.2f} um at worst per um of noise, {planned.mean_um:.2f} um rms"
        )
    if planned.open:
        console.say(f"nearly open is a combination of {', '.join(planned.open)}")
        console.say(
            "more poses may tell it, another kind of measurement or another tool; or seek fewer effects (--effects)"
        )


def _room(
    ranges: tuple[str, ...],
    lengths: tuple[float, ...],
    balls: tuple[str, ...],
    reaches: tuple[str, ...],
    inputs: tuple[str, ...],
    machine: Machine,
) -> Room:
    from ncfix.measure.candidates import Room

    limits = _limits(ranges, "--range")
    travels = {axis.name: tuple(limit / axis.unit for limit in axis.range) for axis in machine.axes}
    for name, (low, high) in limits.items():
        if name not in travels:
            raise click.BadParameter(f"the machine has no axis {name}, only {' '.join(travels)}", param_hint="--range")
        lowest, highest = travels[name]
        if low < lowest - ROUNDING or high > highest + ROUNDING:
            raise click.BadParameter(f"{name} goes from {lowest:g} to {highest:g} only", param_hint="--range")
    reach = _limits(reaches, "--reach")
    for name in reach:
        if name not in ("x", "y", "z"):
            raise click.BadParameter(f"{name} is none of x, y and z of the workpiece", param_hint="--reach")
    places = {}
    for text in balls:
        name, values = _named(text, 3, "--ball")
        places[name] = (values[0], values[1], values[2])
    return Room(limits, lengths or (100.0,), places, reach, _limits(inputs, "--input"))


def _limits(texts: tuple[str, ...], option: str) -> dict[str, tuple[float, float]]:
    """NAME=LOW,HIGH or NAME=LOW:HIGH."""
    found = {}
    for text in texts:
        name, (low, high) = _named(text.replace(":", ","), 2, option)
        if low >= high:
            raise click.BadParameter(f"{text!r} is an empty range", param_hint=option)
        found[name] = (low, high)
    return found


def _named(text: str, count: int, option: str) -> tuple[str, list[float]]:
    name, equals, rest = text.partition("=")
    try:
        values = [float(part) for part in rest.split(",")]
    except ValueError:
        values = []
    if not equals or len(values) != count or not all(map(math.isfinite, values)):
        raise click.BadParameter(f"{text!r} is not NAME= and {count} numbers", param_hint=option)
    return name.strip(), values
