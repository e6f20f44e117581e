"""Options shared by several verbs, their inputs, and shell completion of their values."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from ncfix import core
from ncfix.arguments import TOLERANCE_UM, TOOL_LENGTH, NumberRange
from ncfix.cli import console
from ncfix.cli.streams import long_bytes
from ncfix.cli.targets import STREAM, read, shown

if TYPE_CHECKING:
    from ncfix.machine import Machine
    from ncfix.text.dialect import Dialect
    from ncfix.text.tree import Program

json_option = click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of the text.")
force_option = click.option("--force", is_flag=True, help="Replace the output if it exists.")


class PathName(click.ParamType):  # type: ignore[type-arg]
    """The path of a file or folder, taken as written; completed by the shell itself.

    kind  what the shell completes: file or dir
    """

    name = "path"

    def __init__(self, kind: str = "file") -> None:
        self.kind = kind

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The path as a string."""
        return str(value)

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Ask the shell to complete file names."""
        return [CompletionItem(incomplete, type=self.kind)]


class OneOf(click.ParamType):  # type: ignore[type-arg]
    """A name, taken as written; the names known at that time are completed."""

    name = "text"

    def __init__(self, known: Callable[[], Iterable[str]]) -> None:
        self.known = known

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """The known names that begin with the text, ignoring case."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of plugins that are left out: there is no place to say so now
            begun = incomplete.lower()
            return [CompletionItem(name) for name in self.known() if name.lower().startswith(begun)]


def of_kind(kind: str) -> OneOf:
    """The name of a thing that plugins register: "dialects", "controls", ..."""

    def known() -> Iterable[str]:
        from ncfix.plugins import registry

        return sorted(registry(kind))

    return OneOf(known)


PATH = PathName()
FOLDER = PathName("dir")
DIALECT = of_kind("dialects")
CONTROL = of_kind("controls")

optional_machine_option, machine_option = (
    click.option(
        "-m",
        "--machine",
        "machine_path",
        type=PATH,
        metavar="FILE",
        required=required,
        envvar="NCFIX_MACHINE",
        help="Machine file (TOML).",
    )
    for required in (False, True)
)
dialect_option = click.option(
    "--dialect",
    type=DIALECT,
    metavar="NAME",
    envvar="NCFIX_DIALECT",
    help="Dialect of the program; default: recognised.",
)
table_option = click.option(
    "-o",
    "--output",
    type=PATH,
    metavar="FILE",
    default=STREAM,
    help="File for the table (CSV); default: standard output.",
)


class Positive(click.ParamType):  # type: ignore[type-arg]
    """A finite number above zero and not below `least`."""

    name = "number"

    def __init__(self, least: float = 0.0) -> None:
        self.least = least

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Convert the text to a finite number above zero, or fail with a usage error."""
        try:
            found = float(value)
        except ValueError:
            found = math.nan
        if not 0 < found < math.inf:
            self.fail(f"{value!r} is not a number above zero", param, ctx)
        if found < self.least:
            self.fail(f"{value!r} is below {self.least:g}, the smallest value accepted", param, ctx)
        return found


class FiniteRange(click.FloatRange):
    """A finite number within limits; "nan" is refused, although it is neither below nor above them."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Convert the text to a finite number within the limits, or fail with a usage error."""
        found = float(super().convert(value, param, ctx))
        if not math.isfinite(found):
            self.fail(f"{value!r} is not a number", param, ctx)
        return found


def numbers(within: NumberRange) -> click.FloatRange | click.IntRange:
    """The option type for the numbers of a range."""
    high = None if within.high == math.inf else within.high
    if within.whole:
        return click.IntRange(int(within.low))
    return FiniteRange(within.low, high, min_open=within.inside, max_open=within.inside)


class ToolLength(click.ParamType):  # type: ignore[type-arg]
    """A tool length in mm; zero is allowed."""

    name = "mm"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Convert the text to a length, mm, or fail with a usage error."""
        try:
            found = float(value)
        except ValueError:
            found = math.nan
        if not TOOL_LENGTH.has(found):
            self.fail(f"{value!r} is not a length from 0 to {TOOL_LENGTH.high:g} mm", param, ctx)
        return found


tolerance_option = click.option(
    "--tolerance-um",
    type=Positive(TOLERANCE_UM.low),
    default=1.0,
    show_default=True,
    help="Largest distance of the tool tip from the intended path, um.",
)


def load_machine(path: str) -> Machine:
    """The machine described by a file or by standard input."""
    from ncfix.machine import load, loads

    return load(path) if path != STREAM else loads(read(path), shown(path))


def sound(machine: Machine, path: str, force: bool) -> Machine:
    """The machine, after a check that it is plausible; doubts are reported.

    Raises `RefusedError` NCF320 to NCF324 for an impossible machine, unless `force`.
    """
    from ncfix.machine.plausible import doubts, required

    if force:
        console.tell(*(doubt.message for doubt in doubts(machine, shown(path))))
    else:
        console.tell(*required(machine, shown(path), "--force uses the machine file as it is"))
    return machine


def read_program(
    path: str,
    dialect: str | None,
    machine: Machine | None = None,
    text: bytes | None = None,
    like: Program | None = None,
) -> Program:
    """A program from a file or standard input, in the given dialect, else in that of the machine's control.

    If neither gives a dialect, it is found from the text. `text`: content of the file, if already read; `like`: a
    program in whose dialect it is read, if no dialect is given and that is possible.
    """
    from ncfix.text.reader import read as read_source
    from ncfix.text.reader import read_like

    source = read(path) if text is None else text
    if len(source) >= long_bytes():
        core.forewarn(console.forewarn)
    if dialect is None and like is not None:
        return read_like(source, shown(path), like, (machine and machine.control) or "")
    return read_source(source, shown(path), dialect_of(source, shown(path), dialect, machine))


def dialect_of(head: bytes, path: str, name: str | None, machine: Machine | None) -> Dialect:
    """The dialect with this name; without a name, the one found from the text, else that of the machine's control."""
    from ncfix.text.dialect import detect, get

    if name is not None:
        return get(name)
    return detect(head, path, (machine and machine.control) or "")
