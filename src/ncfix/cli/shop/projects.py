"""The project file on the command line: its settings are defaults of options; `ncfix init` writes one.

The command line overrides the environment (`NCFIX_MACHINE`, `NCFIX_SETUP`, `NCFIX_OUTPUT`, `NCFIX_DIALECT`), which
overrides the file. Programs with different settings are processed in groups.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any, ClassVar

import click

from ncfix.batch.programs import program_files
from ncfix.cli import console
from ncfix.cli.options import FOLDER, PATH, PathName, force_option
from ncfix.diagnostics import ConfigError, UsageError, visible
from ncfix.outputs import exists_already
from ncfix.values import frozen, mutable

if TYPE_CHECKING:
    from ncfix.project import Project

COMMAND_LINE_ONLY = frozenset({"force", "in_place", "executor", "report", "plot"})
"""Options that a project file cannot set, because they write or replace other files or run programs elsewhere.

A project file may come with programs from anywhere.
"""
QUIET = "ncfix.quiet"
"""Key in the context: whether only failures are printed."""
STATE = "ncfix.groups"
"""Key in the context for the groups of programs."""


@frozen
class ProgramGroup:
    """Programs with the same settings.

    settings  parameter name -> default
    programs  their paths; None: all that are given
    folder    folder of the project file; None: no project file
    """

    settings: Mapping[str, Any] = field(default_factory=dict)
    programs: frozenset[str] | None = None
    folder: str | None = None


@mutable
class _Groups:
    arguments: list[str]
    found: list[ProgramGroup]
    at: int = 0


class ProjectCommand(click.Command):
    """A verb on programs; the settings of the project file are defaults of its options.

    not_of_it  option names that mean something else for this verb than in a project file
    """

    not_of_it: ClassVar[frozenset[str]] = frozenset()

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Find the project of the programs, then parse the arguments."""
        if not ctx.resilient_parsing:
            if STATE not in ctx.meta:
                ctx.meta[STATE] = _Groups(list(args), self._groups(ctx, args))
            ctx.default_map = dict(group_of(ctx).settings)
        return super().parse_args(ctx, args)

    def _groups(self, ctx: click.Context, args: list[str]) -> list[ProgramGroup]:
        options, _, _ = self.make_parser(ctx).parse_args(args=list(args))
        first = next((param.name for param in self.params if isinstance(param, click.Argument)), "program")
        given = options.get(first or "")
        given = [given] if isinstance(given, str) else given if isinstance(given, (list, tuple)) else []
        ctx.meta[QUIET] = options.get("quiet") is True
        if options.get("help") is True or options.get("no_project") is True or not given:
            return [ProgramGroup()]
        named = options.get("project") or os.environ.get("NCFIX_PROJECT")
        return self._by_settings(given, named if isinstance(named, str) else os.environ.get("NCFIX_PROJECT"))

    def _by_settings(self, given: Iterable[str], named: str | None) -> list[ProgramGroup]:
        """The programs in groups of equal settings; programs in folders are looked at one by one.

        Programs in the output folders of their project are left out, unless there are no others.
        """
        from ncfix.project import Project

        known: dict[str, Project | None] = {}

        def project_of(path: str) -> Project | None:
            folder = path if os.path.isdir(path) or path == "-" else os.path.dirname(path)
            if folder not in known:
                known[folder] = Project.load(named) if named else Project.of(folder or os.curdir)
            return known[folder]

        found: dict[str, tuple[Project | None, dict[str, Any], list[str]]] = {}
        all_of_them = True
        for path in given:
            if not os.path.isdir(path):
                self._put(found, path, project_of(path))
                continue
            programs = [(each.path, project_of(each.path)) for each in program_files([path])]
            meant = [(each, project) for each, project in programs if not (project and project.is_output(each, path))]
            all_of_them = all_of_them and len(meant) in (0, len(programs))
            for program, project in meant or programs:
                self._put(found, program, project)
        several = len(found) > 1 or not all_of_them
        tell_of(*{project.path: project for project, _, _ in found.values() if project}.values())
        return [
            ProgramGroup(
                settings, frozenset(paths) if several else None, None if project is None else project.folder or "."
            )
            for project, settings, paths in found.values()
        ]

    def _put(self, found: dict[str, Any], program: str, project: Project | None) -> None:
        settings = {} if project is None else self._parameters(project, project.settings(program))
        key = repr((project and project.path, sorted(settings.items())))
        found.setdefault(key, (project, settings, []))[2].append(program)

    def _parameters(self, project: Project, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Settings by parameter name, without those for other verbs."""
        own, others = _options(self.params), _all_options()
        found = {}
        for key, value in settings.items():
            if key not in others:
                from difflib import get_close_matches

                close = get_close_matches(key, others, 1)
                hint = f"did you mean {close[0]}?" if close else "ncfix fix --help shows the options"
                raise _wrong(project, key, value, "`ncfix fix` has no such option", hint)
            if key in COMMAND_LINE_ONLY:
                text = "can be given on the command line only, not in a project file"
                raise _wrong(project, key, value, text, f"--{key.replace('_', '-')}")
            if key in self.not_of_it:
                continue
            if (option := own.get(key)) and option.name and (taken := _taken(option, key, value, project)) is not None:
                found[option.name] = taken
        return found


class TableCommand(ProjectCommand):
    """A verb that writes a table about a program, to which the `output` of a project does not apply."""

    not_of_it = frozenset({"output"})


def tell_of(*projects: Project) -> None:
    """Print which project files are used, unless the run is quiet."""
    if not click.get_current_context().meta.get(QUIET):
        for project in projects:
            console.say(f"{visible(project.path)}: options that the command line does not give come from this file")


def _options(params: Iterable[click.Parameter]) -> dict[str, click.Option]:
    """Options by the names that a project file uses."""
    options = (param for param in params if isinstance(param, click.Option))
    return {name[2:].replace("-", "_"): option for option in options for name in option.opts if name.startswith("--")}


def _all_options() -> frozenset[str]:
    """The options that a project file can set: those of `ncfix fix`."""
    root = click.get_current_context().find_root()
    fix = root.command.get_command(root, "fix") if isinstance(root.command, click.Group) else None
    assert fix is not None, "ncfix has that verb"
    return frozenset(_options(fix.params)) - {"project", "no_project"}


def _taken(option: click.Option, key: str, value: Any, project: Project) -> Any:
    """A value from a project file in the form of the command line; None for a flag that is off."""
    if option.is_flag:
        if not isinstance(value, bool):
            raise _wrong(project, key, value, f"{value!r} is neither true nor false")
        return option.flag_value is not False if value else None
    several = value if isinstance(value, list) else [value]
    if len(several) != 1 and not option.multiple:
        raise _wrong(project, key, value, f"{len(several)} values, where one is expected")
    if odd := [each for each in several if isinstance(each, bool) or not isinstance(each, (str, int, float))]:
        raise _wrong(project, key, value, f"{odd[0]!r} is neither a text nor a number")
    texts = [str(each) for each in several]
    if any(not each or "\0" in each for each in texts):
        raise _wrong(project, key, value, "the text is empty or contains a NUL character")
    if isinstance(option.type, (PathName, click.Path)):
        texts = [project.from_here(each) for each in texts]
        if option.name == "output" and texts[0][-1] != os.sep:
            texts[0] += os.sep
    taken = texts if option.multiple else texts[0]
    try:
        option.type_cast_value(click.get_current_context(), taken)
    except click.BadParameter as error:
        raise _wrong(project, key, value, error.message) from error
    return taken


def _wrong(project: Project, key: str, value: object, text: str, hint: str = "") -> ConfigError:
    """The error NCF028 for a value in a project file."""
    return ConfigError((project.fault(f"{key}: {text}", *project.way_to(key, value), hint=hint),))


def group_of(context: click.Context) -> ProgramGroup:
    """The programs for which this run of a verb is."""
    groups: _Groups | None = context.meta.get(STATE)
    return groups.found[groups.at] if groups else ProgramGroup()


def after_next_groups(context: click.Context) -> int | None:
    """Run the verb for the following groups; returns the exit code of the last, which reports on all. None: no more."""
    groups: _Groups | None = context.meta.get(STATE)
    if groups is None or groups.at + 1 >= len(groups.found):
        return None
    groups.at += 1
    with context.command.make_context(context.info_name, list(groups.arguments), context.parent) as following:
        return int(following.command.invoke(following))


def is_from_file(context: click.Context, option: str) -> bool:
    """Whether the value of an option comes from the project file."""
    return context.get_parameter_source(option) == click.core.ParameterSource.DEFAULT_MAP


def project_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator that adds the options for selecting a project file to a verb."""
    named = click.option(
        "--project",
        type=PATH,
        metavar="FILE",
        expose_value=False,
        help="Project file; default: ncfix.toml in the folder of the program or above.",
    )
    none = click.option("--no-project", is_flag=True, expose_value=False, help="Ignore project files.")
    return named(none(command))


@click.command()
@click.argument("folder", type=FOLDER, default=".", metavar="[FOLDER]")
@click.option("-m", "--machine", type=PATH, metavar="FILE", help="Machine file.")
@click.option("--setup", type=PATH, metavar="FILE", help="Setup file; empty for none.")
@click.option("-o", "--output", type=PATH, metavar="DIR", help="Folder for corrected programs.")
@force_option
def init(folder: str, machine: str | None, setup: str | None, output: str | None, force: bool) -> None:
    """Write a project file ncfix.toml into FOLDER, so that `ncfix fix PROGRAM` needs no options there.

    It asks for the values that the options do not give. Paths in the file are relative to FOLDER.
    """
    from ncfix import files
    from ncfix.machine import load
    from ncfix.project import NAME, written

    path = os.path.join(folder, NAME)
    if os.path.lexists(path) and not force:
        raise exists_already(path)
    values = {
        "machine": _asked("machine", machine, "machine file", _only(folder, ("topology",)) or None),
        "setup": _asked("setup", setup, "setup file, empty for none", _only(folder, ("[work_offsets]", "[tools]"))),
        "output": _asked("output", output, "folder for corrected programs", "corrected"),
    }
    if values["output"] in ("", "-"):
        raise UsageError.of("NCF003", "corrected programs need a folder", hint="-o DIR")
    load(os.path.join(folder, values["machine"]))
    if values["setup"]:
        from ncfix.control.setup_file import load as load_setup

        load_setup(os.path.join(folder, values["setup"]))
    text = written({key: value for key, value in values.items() if value}, resume=True)
    files.write_whole(path, text.encode(), force)
    console.say(f"{visible(path)}: written; ncfix fix PROGRAM now corrects a program in this folder or below")


def _asked(option: str, given: str | None, what: str, default: str | None) -> str:
    """The given value, else an answer from the terminal or the default; raises `UsageError` NCF001 if there is none."""
    if given is not None:
        return given
    if sys.stdin is None or not sys.stdin.isatty():
        if default is not None:
            return default
        raise UsageError.of(
            "NCF001", f"the {what} is not given, and there is no terminal to ask for it", hint=f"--{option}"
        )
    return str(click.prompt(what, default=default, err=True))


def _only(folder: str, marks: tuple[str, ...]) -> str:
    """The only TOML file in a folder with a line that begins with one of `marks`; empty if none or several."""
    found = []
    for name in sorted(os.listdir(folder) if os.path.isdir(folder) else ()):
        if name.endswith(".toml") and os.path.isfile(os.path.join(folder, name)):
            with open(os.path.join(folder, name), encoding="utf-8", errors="replace") as handle:
                text = handle.read(1 << 16)
            if any(line.startswith(marks) for line in text.splitlines()):
                found.append(name)
    return found[0] if len(found) == 1 else ""
