"""Verbs for compensation tables: `ncfix export` makes, `ncfix emulate` evaluates, and `ncfix lint` checks them.

The errors along a program run with the tables, or rewritten, are reported in the same form.
"""

from __future__ import annotations

import os
from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click

import ncfix
from ncfix import files
from ncfix.arguments import TARGET_UM
from ncfix.batch.programs import subprograms
from ncfix.cli import console
from ncfix.cli.following import FollowingSetup
from ncfix.cli.options import (
    CONTROL,
    FOLDER,
    PATH,
    Positive,
    ToolLength,
    dialect_option,
    force_option,
    json_option,
    machine_option,
    sound,
)
from ncfix.cli.setup_options import SetupOptions, setup_options
from ncfix.cli.targets import shown
from ncfix.diagnostics import ConfigError, ExitCode, Message, UsageError
from ncfix.inputs import identities
from ncfix.outputs import check_folder

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ncfix.machine import Machine
    from ncfix.tables.control import Control
    from ncfix.tables.export import Exported


@click.command()
@click.argument("control", type=CONTROL)
@machine_option
@click.option("-o", "--output", type=FOLDER, metavar="DIR", required=True, help="Folder for the files.")
@click.option(
    "--tool-length",
    type=ToolLength(),
    default=0.0,
    show_default=True,
    help="Tool length for which the tables are computed, mm.",
)
@click.option(
    "--target-um",
    type=Positive(TARGET_UM.low),
    default=1.0,
    show_default=True,
    help="Largest error of the tables between their points, um.",
)
@click.option(
    "--range",
    "ranges",
    metavar="X=LOW,HIGH",
    multiple=True,
    help="Range of an axis, mm or degrees; default: its travel (repeatable).",
)
@click.option(
    "--set",
    "settings",
    metavar="NAME=VALUE",
    multiple=True,
    help="Setting of the control; docs/controllers.md lists them (repeatable).",
)
@click.option(
    "--probe", is_flag=True, help="Write test files with which the machine shows the values that --set needs."
)
@click.option(
    "--program",
    type=PATH,
    metavar="FILE",
    help="Program that is run with the tables; with the control gcode: that is rewritten.",
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
    """Write compensation tables for CONTROL, with a hand-over sheet that states the remaining error.

    The remaining error is that of the files: they are read back and run as the control would, at 20000 random poses.
    """
    from ncfix.api.tables import table_request
    from ncfix.plugins import called
    from ncfix.tables.control import Written, get_control
    from ncfix.tables.export import export as exported

    chosen = get_control(control)
    check_folder(output)
    inputs = identities(each for each in (machine_path, program, *given.files) if each)
    following = FollowingSetup.of(machine_path, dialect, given)
    machine = following.machine
    assert machine is not None
    sound(machine, machine_path, force)
    covered = given_ranges(machine, ranges)
    pairs = dict(_pair(each, "--set NAME=VALUE") for each in settings)
    held = following.setup.inputs
    request = table_request(chosen, machine, tool_length, target_um, covered, pairs, not probe, held)
    if probe:
        found = called("controls", chosen.name, chosen.probe, request, gives=Written)
        files.write_folder(output, found.files, force, inputs)
        if as_json:
            console.put_json(control=chosen.name, files=sorted(found.files), notes=found.notes)
        else:
            console.put("".join(f"{name}\n" for name in sorted(found.files)))
        return ExitCode.DONE
    with console.busy("making tables"):
        made = exported(chosen, request)
        if program is not None:
            made = _with_program(made, chosen, following, program, rewrite=True)
    files.write_folder(output, made.files, force, inputs)
    console.tell_some(made.messages)
    tell(made, chosen, as_json)
    return ExitCode.DONE


def _with_program(
    made: Exported, control: Control, following: FollowingSetup, path: str, rewrite: bool = False
) -> Exported:
    from ncfix.api.tables import with_program

    assert following.machine is not None
    find = subprograms(following.setup, path)
    return with_program(made, control, following.read(path), following.machine, following.setup, find, rewrite)


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
        raise click.UsageError(f"{text!r} should be of the form {form}")
    return name.strip(), value.strip()


def tell(made: Exported, control: Control, as_json: bool) -> None:
    """Report the errors that the tables leave."""
    figures, program = made.left.figures(), made.program
    if as_json:
        entries: dict[str, Any] = {"control": control.name, "assumptions": control.described()["assumptions"]}
        if program is not None:
            entries["program"] = program.as_dict()
        entries |= {"class": made.reaches, "files": sorted(made.files), "residual_um": figures}
        if made.least:
            entries["least_um"] = {"max": 1e3 * made.least.value, "why": made.least.why}
        console.put_json(**entries, limits=made.limits(), notes=made.notes, warnings=made.messages)
        return
    rows = [(when, *(f"{figures[when][key]:.2f}" for key in ("max", "rms", "mean"))) for when in ("before", "after")]
    console.table(("tip error, um", "max", "rms", "mean"), rows)
    pose = " ".join(f"{name}{value:g}" for name, value in figures["after"]["at"].items())
    limits = made.limits()
    console.put(
        f"class {made.reaches}; {limits['tables']} tables, {limits['points']} points; the largest error "
        f"remains at {pose}\n"
    )
    if program is not None:
        for when, error in (("before", program.before), ("after", program.after)):
            console.put(f"{program.path} {when}: {console.error_figures(error)}\n")
        for remark in program.remarks:
            console.say(remark)
        if (program.after["rms"] or 0.0) > (program.before["rms"] or 0.0):
            console.say("The tables make this program worse: it runs where they do not match the machine.")
    for note in made.notes:
        console.say(note)


@click.command()
@click.argument("control", type=CONTROL)
@click.argument("folder", type=FOLDER, metavar="TABLEDIR")
@machine_option
@click.option("--program", type=PATH, metavar="FILE", help="Program that is run with the tables active.")
@click.option("--other-machine", is_flag=True, help="Accept tables that were made for another machine or other errors.")
@dialect_option
@setup_options
@json_option
def emulate(
    control: str,
    folder: str,
    machine_path: str,
    program: str | None,
    other_machine: bool,
    dialect: str | None,
    given: SetupOptions,
    as_json: bool,
) -> int:
    """Run the tables in TABLEDIR, which `ncfix export` wrote for CONTROL, and compute the remaining error.

    Exit code 1: there are remarks on the files.
    """
    from ncfix.tables.control import get_control

    chosen = get_control(control)
    following = FollowingSetup.of(machine_path, dialect, given)
    assert following.machine is not None
    content = files.read_folder(folder)
    with console.busy("running the tables"):
        try:
            name = folder.rstrip(os.sep)
            machine, setup = following.machine, following.setup
            found = ncfix.emulate(chosen, content, machine, other_machine=other_machine, name=name, setup=setup)
        except ConfigError as error:
            raise ConfigError.collected(_below(folder, error.messages, content)) from error
        if program is not None:
            found = _with_program(found, chosen, following, program)
    found = replace(found, messages=_below(folder, found.messages, content))
    console.tell_some(found.messages)
    tell(found, chosen, as_json)
    return ExitCode.FINDINGS if found.messages else ExitCode.DONE


def _below(folder: str, messages: Iterable[Message], names: Container[str]) -> tuple[Message, ...]:
    """The messages with the folder added to the names of its files."""
    return tuple(
        replace(message, place=replace(message.place, path=os.path.join(folder, message.place.path)))
        if message.place is not None and message.place.path in names
        else message
        for message in messages
    )


@click.command()
@click.argument("paths", nargs=-1, required=True, metavar="FILE...")
@click.option("--control", metavar="NAME", default="", help="Control that the tables are for; default: recognised.")
@json_option
def lint(paths: tuple[str, ...], control: str, as_json: bool) -> int:
    """Find what the control would not load or would misread in each FILE, or in all files of a folder.

    Files of one control in one folder are checked together. Exit code 1: there are findings; 3: a file has no known
    form.
    """
    from ncfix.tables.forms import lint_files

    worst, entries = int(ExitCode.DONE), []
    for folder, content in _gathered(paths):
        for name, looked in sorted(lint_files(content, control).items()):
            path = os.path.join(folder, name)
            messages = _below(folder, looked.messages, content)
            console.tell_some(messages)
            code = ExitCode.FINDINGS if messages else ExitCode.DONE
            worst = max(worst, code if looked.owner else ExitCode.UNREADABLE)
            whose = {"form": looked.owner or None, "title": looked.title or None}
            entries.append({"path": shown(path), **whose, "findings": messages})
            if not as_json:
                verdict = console.counted(len(messages), "finding") if messages else "nothing found"
                console.say(f"{shown(path)}: {looked.title or 'of no known form'}: {verdict}")
    if as_json:
        console.put_json(files=entries)
    return worst


def _gathered(paths: Sequence[str]) -> Iterator[tuple[str, dict[str, bytes]]]:
    """Each folder with the files to read from it; raises `SourceError` NCF002."""
    found: dict[str, dict[str, bytes]] = {}
    for path in paths:
        if os.path.isdir(path):
            found.setdefault(path.rstrip(os.sep) or os.sep, {}).update(files.read_folder(path))
        else:
            folder, name = os.path.split(path)
            found.setdefault(folder, {})[name] = files.read_bytes(path)
    yield from ((folder, content) for folder, content in found.items() if content)
