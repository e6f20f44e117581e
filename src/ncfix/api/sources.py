"""Arguments of the API functions, given as values or as paths of files; and checks of their outputs."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

from ncfix.arguments import FINITE, OFFSET_AXES, check_choice
from ncfix.batch.programs import subprograms
from ncfix.control.setup import Setup, Tool, check_offsets
from ncfix.diagnostics import UsageError
from ncfix.files import read_bytes, write_whole
from ncfix.inputs import each_once, given_twice, identities
from ncfix.outputs import check_target

if TYPE_CHECKING:
    from ncfix.compensate.following import Resolve
    from ncfix.machine import Machine
    from ncfix.measure.measurement import Measurement
    from ncfix.text.dialect import Dialect
    from ncfix.text.tree import Program

    Measured = Measurement | str | os.PathLike[str]

PathName = str | os.PathLike[str]
Value = TypeVar("Value")
ONE_SOURCE = "give a path or a text, not both"


def load_machine(source: PathName | None = None, *, text: str | None = None) -> Machine:
    """The machine described by a file or a TOML text; raises `ConfigError` NCF3xx with everything that is wrong."""
    from ncfix.machine import load, loads

    if source is not None and text is None:
        return load(as_path(source))
    if text is not None and source is None:
        return loads(text)
    raise TypeError(ONE_SOURCE)


def read_program(
    source: PathName | None = None,
    *,
    text: bytes | str | None = None,
    dialect: Dialect | str | None = None,
    machine: Machine | None = None,
) -> Program:
    """The program in a file or a text.

    dialect  its language; None: found from the text, the machine's control or the file suffix

    Raises `SourceError` NCF1xx for a program that cannot be read.
    """
    from ncfix.text.dialect import detect, encoded
    from ncfix.text.reader import read

    if source is not None and text is None:
        path = as_path(source)
        content = read_bytes(path)
    elif text is not None and source is None:
        path = "<program>"
        content = encoded(text, path) if isinstance(text, str) else text
    else:
        raise TypeError(ONE_SOURCE)
    chosen = detect(content, path, (machine and machine.control) or "") if dialect is None else dialect
    return read(content, path, chosen)


def as_path(source: PathName) -> str:
    """A path; raises TypeError for a text with several lines and for anything that is no path."""
    path = os.fspath(source)
    if isinstance(path, bytes) or "\n" in path:
        raise TypeError("a path is needed, and this is a text; read_program and load_machine take one as text=...")
    return path


def as_machine(machine: Machine | PathName) -> Machine:
    """A machine, given itself or as a file; raises TypeError for anything else."""
    from ncfix.machine import Machine

    return load_machine(machine) if isinstance(machine, (str, os.PathLike)) else _checked(machine, Machine)


def _checked(value: Any, kind: type[Value]) -> Value:
    if not isinstance(value, kind):
        raise TypeError(f"a {kind.__name__} or the path of a file is needed, not {type(value).__name__}")
    return value


def sound_machine(machine: Machine | PathName, force: bool) -> Machine:
    """A machine to make something for; raises `RefusedError` NCF320 to NCF324 if it is implausible, unless `force`."""
    from ncfix.machine.plausible import required

    known = as_machine(machine)
    if not force:
        path = os.fspath(machine) if isinstance(machine, (str, os.PathLike)) else known.name
        required(known, path, "force=True uses the machine as it is")
    return known


def as_program(program: Program | PathName, machine: Machine) -> Program:
    """A program, given itself or as a file; a file that does not show its language is read for the machine's control.

    Raises TypeError for anything else.
    """
    from ncfix.text.tree import Program

    if isinstance(program, (str, os.PathLike)):
        return read_program(program, machine=machine)
    return _checked(program, Program)


def as_setup(setup: Setup | PathName | None, machine: Machine) -> Setup:
    """A setup, given itself or as a file; None: an empty one.

    Raises `UsageError` NCF025 for a value that is not finite or an unknown axis, NCF384 for work offsets in the order
    of the machine's axes, TypeError for anything that is no setup.
    """
    if setup is None:
        return Setup()
    if isinstance(setup, (str, os.PathLike)):
        from ncfix.control.setup_file import load

        own = load(as_path(setup))
    else:
        own = _checked(setup, Setup)
        _check_values(own)
    check_offsets(own, machine.axis_names)
    return own


def _check_values(setup: Setup) -> None:
    """Refuse a setup with a value that is not a finite number, or for an unknown axis: NCF025."""
    by_axis = {f"work_offsets[{name!r}]": values for name, values in setup.work_offsets.items()}
    by_axis |= {f"references[{name!r}]": values for name, values in setup.references.items()}
    by_axis |= {"initial": setup.initial, "probed": setup.probed or {}}
    for where, values in by_axis.items():
        for axis in values:
            check_choice(f"{where}: axis", axis, OFFSET_AXES)
    tools: list[tuple[object, Tool]] = [*setup.tools.items(), *setup.named_tools.items()]
    for name, tool in tools:
        if not isinstance(tool, Tool):
            raise UsageError.of("NCF025", f"tools[{name!r}]={tool!r}", hint=f"Tool(length={tool!r})")
    lengths = {name: tool.length for name, tool in tools if tool.length is not None}
    radii = {name: tool.radius for name, tool in tools if tool.radius is not None}
    named: dict[str, Mapping[Any, float]] = {**by_axis, "variables": setup.variables, "inputs": setup.inputs}
    named |= {"lengths of tools": lengths, "radii of tools": radii}
    named |= {"workpiece_offset": dict(enumerate(setup.workpiece_offset))}
    for where, values in named.items():
        for key, value in values.items():
            FINITE.check(f"{where}[{key!r}]", value)


def subprograms_of(setup: Setup, *programs: Program) -> Resolve | None:
    """Finds subprogram files, beside programs that came from files and where the setup says; None: there are none."""
    paths = [program.path for program in programs if not program.path.startswith("<")]
    return subprograms(setup, *paths) if paths or setup.subprograms else None


def as_names(argument: str, given: Sequence[str]) -> tuple[str, ...]:
    """Several names; raises `UsageError` NCF025 for a single string, which would be read letter by letter."""
    if isinstance(given, str):
        raise UsageError.of("NCF025", f"{argument}={given!r}", hint=f"{argument}=[{given!r}], a list of names")
    return tuple(given)


def check_effects(given: str | None) -> None:
    """Refuse effects that are not one string of names separated by commas: `UsageError` NCF025."""
    if given is not None and not isinstance(given, str):
        raise UsageError.of("NCF025", f"effects={given!r}", hint="effects='EC0Y,E?X', one text")


def as_measurements(measured: Measured | Sequence[Measured], machine: Machine) -> list[Measurement]:
    """One or more measurements or their files; raises `UsageError` NCF020 if one is given twice, NCF025 without any."""
    from ncfix.measure.measurement import Measurement
    from ncfix.measure.reader import read

    several = [measured] if isinstance(measured, (str, os.PathLike, Measurement)) else list(measured)
    if not several:
        raise UsageError.of("NCF025", "no measurement is given", hint="give one or more measurements")
    each_once(paths_of(each for each in several if not isinstance(each, Measurement)))
    for number, each in enumerate(several):
        if isinstance(each, Measurement) and any(each is other for other in several[:number]):
            raise given_twice(each.path)
    return [each if isinstance(each, Measurement) else read(os.fspath(each), machine) for each in several]


def paths_of(given: Iterable[object]) -> Iterator[str]:
    """The paths of the arguments: of files, and of values that were read from files."""
    for each in given:
        if isinstance(each, (str, os.PathLike)):
            yield os.fspath(each)
        elif isinstance(each, (list, tuple)):
            yield from paths_of(each)
        elif isinstance(path := getattr(each, "path", None), str) and not path.startswith("<"):
            yield path


def check_writable(output: PathName | None, force: bool, *given: object) -> None:
    """Refuse an output that must not be written or is one of the inputs, before anything is computed."""
    if output is not None:
        check_target(os.fspath(output), identities(paths_of(given)), force)


def write_output(output: PathName | None, content: bytes, force: bool) -> None:
    """Write a result, if a path is given."""
    if output is not None:
        write_whole(os.fspath(output), content, force)
