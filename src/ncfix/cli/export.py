"""`ncfix export`: compensation tables that a control understands."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

from ncfix import files
from ncfix.cli import console
from ncfix.cli.completion import CONTROL, FOLDER, PATH
from ncfix.cli.following import Following
from ncfix.cli.options import Length, Positive, dialect_option, force_option, json_option, machine_option, sound
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.targets import STREAM
from ncfix.diagnostics import ExitCode, Place, UsageError

if TYPE_CHECKING:
    from ncfix.machine import Machine
    from ncfix.tables.control import Written
    from ncfix.tables.export import Exported


@click.command()
@click.argument("control", type=CONTROL)
@machine_option
@click.option("-o", "--output", type=FOLDER, metavar="DIR", required=True, help="The folder for the files.")
@click.option(
    "--tool-length", type=Length(), default=0.0, show_default=True, help="The length that the tables hold for, mm."
)
@click.option(
    "--target-um",
    type=Positive(),
    default=1.0,
    show_default=True,
    help="How much correction may be lost between the points of a table.",
)
@click.option(
    "--range",
    "ranges",
    metavar="X=LOW,HIGH",
    multiple=True,
    help="Cover less than the travel; mm, degree (repeatable).",
)
@click.option("--set", "settings", metavar="NAME=VALUE", multiple=True, help="An option of the control (repeatable).")
@click.option("--probe", is_flag=True, help="Write small files that settle on the machine what --set must say.")
@click.option(
    "--program", type=PATH, metavar="FILE", help="Rewrite this program (control gcode), or run it with the tables."
)
@force_option
@dialect_option
@setup_options
@json_option
def export(
    control: str,
    machine_path: str,
    output: str,
    tool_length: float,
    target_um: float,
    ranges: tuple[str, ...],
    settings: tuple[str, ...],
    probe: bool,
    program: str | None,
    force: bool,
    dialect: str | None,
    given: SetupOptions,
    as_json: bool,
) -> int:
    """Write compensation tables for CONTROL, with a hand-over sheet and what they leave.

    The figures are those of the files: they are read back and run as the control would, over 20000 random poses.
    """
    from ncfix.cli.tabled import along, rewritten_file
    from ncfix.plugins import called
    from ncfix.tables.control import Request, Written, get_control
    from ncfix.tables.correction import ranges_of
    from ncfix.tables.export import export as exported

    chosen = get_control(control)
    check_folder(output)
    following = Following.of(machine_path, dialect, given)
    machine = following.machine
    assert machine is not None
    sound(machine, machine_path, force)
    space = ranges_of(machine, given_ranges(machine, ranges))
    options = chosen.settings(dict(_pair(each, "--set NAME=VALUE") for each in settings), complete=not probe)
    request = Request(machine, space, tool_length, 1e-3 * target_um, options)
    if probe:
        found = called("controls", chosen.name, chosen.probe, request, gives=Written)
        write_folder(output, found, force)
        _tell_of_probe(found, chosen.name, as_json)
        return ExitCode.DONE
    more: dict[str, Any] = {"assumptions": chosen.described()["assumptions"]}
    with console.busy("making tables"):
        made = exported(chosen, request)
        if program is not None:
            more["program"] = along(following, chosen, made.tables, options, program, tool_length)
        if program is not None and chosen.rewrites:
            made = replace(made, files={**made.files, **rewritten_file(following, options, program)})
    write_folder(output, made, force)
    console.tell_some(made.messages)
    tell(made, as_json, control=chosen.name, reaches=made.reaches, **more)
    return ExitCode.DONE


def given_ranges(machine: Machine, texts: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    """Axis -> range in mm or rad, from X=LOW,HIGH or X=LOW:HIGH in mm or degree; raises `UsageError` NCF483."""
    units = {axis.name: axis.unit for axis in machine.axes}
    found = {}
    for text in texts:
        name, value = _pair(text, "--range X=LOW,HIGH")
        try:
            low, high = (float(part) * units.get(name, 1.0) for part in value.replace(":", ",").split(","))
        except ValueError as error:
            hint = "--range X=LOW,HIGH, mm or degree"
            raise UsageError.of("NCF483", f"{text!r} is not a range", hint=hint) from error
        found[name] = (low, high)
    return found


def _pair(text: str, form: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name:
        raise click.UsageError(f"{text!r} should be {form}")
    return name.strip(), value.strip()


def _tell_of_probe(written: Written, control: str, as_json: bool) -> None:
    if as_json:
        console.put_json(control=control, files=sorted(written.files), notes=written.notes)
        return
    console.put("".join(f"{name}\n" for name in sorted(written.files)))


def check_folder(folder: str) -> None:
    """Refuse what cannot be a folder of tables: NCF003 or NCF007."""
    if folder in ("", STREAM):
        raise UsageError.of("NCF003", "tables are several files, which go to a folder", hint="-o FOLDER")
    if os.path.lexists(folder) and not os.path.isdir(folder):
        raise UsageError.of("NCF007", "is not a folder", Place(folder), "-o FOLDER")


def write_folder(folder: str, made: Exported | Written, force: bool) -> None:
    """Write all files, or none if one is there already or must not be, or there is no room.

    Raises `UsageError` NCF004, NCF005, NCF007, NCF023.
    """
    check_folder(folder)
    paths = {os.path.join(folder, name): content for name, content in made.files.items()}
    for path in paths:
        files.check_output(path, folder, force)
        if os.path.lexists(path) and not force:
            raise files.exists_already(path)
    fresh = [path for path in paths if not os.path.lexists(path)]
    try:
        for path, content in paths.items():
            files.write_whole(path, content, force, folder)
    except UsageError:
        for path in fresh:
            with suppress(OSError):
                os.unlink(path)
        raise


def tell(made: Exported, as_json: bool, **more: object) -> None:
    """Say what the tables leave."""
    figures = made.left.figures()
    reaches, program = more.pop("reaches"), more.get("program")
    if as_json:
        entries = {**more, "class": reaches, "files": sorted(made.files), "residual_um": figures}
        warnings = [message.as_dict() for message in made.messages]
        if made.least:
            entries["least_um"] = {"max": 1e3 * made.least.value, "why": made.least.why}
        console.put_json(**entries, limits=made.limits(), notes=made.notes, warnings=warnings)
        return
    rows = [(when, *(f"{figures[when][key]:.2f}" for key in ("max", "rms", "mean"))) for when in ("before", "after")]
    console.table(("tip error, um", "max", "rms", "mean"), rows)
    pose = " ".join(f"{name}{value:g}" for name, value in figures["after"]["at"].items())
    limits = made.limits()
    console.put(f"class {reaches}; {limits['tables']} tables, {limits['points']} points; most is left at {pose}\n")
    if isinstance(program, dict):
        for when in ("before", "after"):
            console.put(f"{program['path']} {when}: {console.error_figures(program[f'error_{when}_um'])}\n")
        for remark in program["remarks"]:
            console.say(remark)
        if program["error_after_um"]["rms"] > program["error_before_um"]["rms"]:
            console.say("This program is made worse: it runs where these tables do not fit the machine.")
    for note in made.notes:
        console.say(note)
