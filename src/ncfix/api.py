"""ncfix as functions: what the verbs of the command line do, on values.

Programs, machines and measurements are values, or the paths of files with them. No file is touched unless its path is
given: `output=` writes the result, whole or not at all; never in the place of an input, and in that of another file
only if `force` says so. That is looked at before anything is computed. docs/api.md shows each function at work.

What is refused stands in the result; to write a result of which something is refused raises `RefusedError`, unless it
is allowed. All errors are `ncfix.diagnostics.NcfixError`, with codes; a function called as no function can be, with two
sources for one, say, raises TypeError.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, overload

from ncfix.batch.programs import subprograms
from ncfix.control.setup import Setup
from ncfix.diagnostics import Message, Place, RefusedError, UsageError
from ncfix.files import (
    check_folder,
    check_target,
    each_once,
    given_twice,
    identities,
    read_bytes,
    read_folder,
    write_folder,
    write_whole,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ncfix.compensate import FixOptions
    from ncfix.compensate.driver import Fixed
    from ncfix.compensate.figures.verification import Compared
    from ncfix.compensate.following import Resolve
    from ncfix.diagnosis.diagnosis import Diagnosis
    from ncfix.machine import Machine
    from ncfix.measure.calibrate import Prediction
    from ncfix.measure.candidates import Room
    from ncfix.measure.estimate import Calibration
    from ncfix.measure.instruments import Faults
    from ncfix.measure.measurement import Measurement
    from ncfix.measure.plan import Planned
    from ncfix.tables.control import Control, Request
    from ncfix.tables.export import Exported
    from ncfix.text.dialect import Dialect
    from ncfix.text.tree import Program

    Measured = Measurement | str | os.PathLike[str]

PathName = str | os.PathLike[str]
ONE_SOURCE = "a path or a text is needed, and not both"


def load_machine(source: PathName | None = None, *, text: str | None = None) -> Machine:
    """The machine that a file, or a text in TOML, describes; raises `ConfigError` NCF3xx with all that is wrong."""
    from ncfix.machine import load, loads

    if source is not None and text is None:
        return load(os.fspath(source))
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
    """The program in a file, or in a text.

    dialect  its language; None: what the text shows, else that of the machine's control, else what the suffix shows

    Raises `SourceError` NCF1xx for what cannot be read.
    """
    from ncfix.text.dialects import detect, encoded
    from ncfix.text.reader import read

    if source is not None and text is None:
        path = os.fspath(source)
        content = read_bytes(path)
    elif text is not None and source is None:
        path = "<program>"
        content = encoded(text, path) if isinstance(text, str) else text
    else:
        raise TypeError(ONE_SOURCE)
    chosen = detect(content, path, (machine and machine.control) or "") if dialect is None else dialect
    return read(content, path, chosen)


def _machine(machine: Machine | PathName) -> Machine:
    return load_machine(machine) if isinstance(machine, (str, os.PathLike)) else machine


def _sound(machine: Machine | PathName, force: bool) -> Machine:
    """A machine for something to be made with it; raises `RefusedError` NCF320 to NCF324 if no machine can be so."""
    from ncfix.machine.plausible import required

    known = _machine(machine)
    if not force:
        path = os.fspath(machine) if isinstance(machine, (str, os.PathLike)) else known.name
        required(known, path, "force=True makes it all the same")
    return known


def _program(program: Program | PathName, machine: Machine) -> Program:
    return read_program(program, machine=machine) if isinstance(program, (str, os.PathLike)) else program


def _setup(setup: Setup | PathName | None) -> Setup:
    if setup is None:
        return Setup()
    if isinstance(setup, Setup):
        return setup
    from ncfix.control.setup_file import load

    return load(os.fspath(setup))


def _resolve(setup: Setup, *programs: Program) -> Resolve | None:
    """What gives the files of subprograms: beside programs that came from files, and where the setup says."""
    paths = [program.path for program in programs if not program.path.startswith("<")]
    return subprograms(setup, *paths) if paths or setup.subprograms else None


def _measurements(measured: Measured | Sequence[Measured], machine: Machine) -> list[Measurement]:
    from ncfix.measure.measurement import Measurement
    from ncfix.measure.reader import read

    several = [measured] if isinstance(measured, (str, os.PathLike, Measurement)) else list(measured)
    if not several:
        raise UsageError.of("NCF025", "no measurement is given", hint="one or more of them")
    each_once(_read_paths(each for each in several if not isinstance(each, Measurement)))
    for number, each in enumerate(several):
        if isinstance(each, Measurement) and any(each is other for other in several[:number]):
            raise given_twice(each.path)
    return [each if isinstance(each, Measurement) else read(os.fspath(each), machine) for each in several]


def _read_paths(given: Iterable[object]) -> Iterator[str]:
    """The paths of what is given: those of files, and of values that came from files."""
    for each in given:
        if isinstance(each, (str, os.PathLike)):
            yield os.fspath(each)
        elif isinstance(each, (list, tuple)):
            yield from _read_paths(each)
        elif isinstance(path := getattr(each, "path", None), str) and not path.startswith("<"):
            yield path


def _check_output(output: PathName | None, force: bool, *given: object) -> None:
    """Refuse an output that must not be written, or is one of the inputs, before anything is computed."""
    if output is not None:
        check_target(os.fspath(output), identities(_read_paths(given)), force)


def _write(output: PathName | None, content: bytes, force: bool) -> None:
    if output is not None:
        write_whole(os.fspath(output), content, force)


def fix(
    program: Program | PathName,
    machine: Machine | PathName,
    *,
    setup: Setup | PathName | None = None,
    strategy: str = "rotary-then-linear",
    tolerance_um: float = 1.0,
    flatten: bool = False,
    split_rapids: bool = False,
    block_numbers: str = "same",
    figures: bool = True,
    force: bool = False,
    allow_refused: bool = False,
    resolve: Resolve | None = None,
    output: PathName | None = None,
) -> Fixed:
    """Rewrite a program so that this machine cuts what was meant.

    setup          offsets, tools and where axes start, or a setup file; what it lacks raises `UsageError` NCF2xx
    strategy       `ncfix fix --strategy`
    tolerance_um   how far the tool tip may leave the intended path
    flatten        write loops, subprograms and cycles out where they cannot be corrected
    figures        the errors before and after along the path (`report.error_before_um`, ...)
    force          correct a program that has been corrected, for a machine that no machine is like, too; take the
                   place of an existing output
    allow_refused  write the output though motions had to be left uncorrected
    resolve        gives the text of a subprogram by its name; None: files beside the program, if that is one
    """
    from ncfix.compensate import FixOptions

    options = FixOptions(strategy, tolerance_um, allow_refused, force, split_rapids, flatten, block_numbers, figures)
    _check_output(output, force, program, machine, setup)
    known, own = _sound(machine, force), _setup(setup)
    read = _program(program, known)
    found = fixed(read, known, own, options, resolve or _resolve(own, read))
    if output is not None and found.report.refused and not allow_refused:
        refused = [Message(each.code, each.reason, Place(read.path, each.line)) for each in found.report.refused]
        raise RefusedError.collected(refused)
    _write(output, found.text, force)
    return found


def fixed(program: Program, machine: Machine, setup: Setup, options: FixOptions, resolve: Resolve | None) -> Fixed:
    """A program corrected with these options, flat where they say so."""
    from ncfix.compensate.driver import fix_flat, fix_program

    return (fix_flat if options.flatten else fix_program)(program, machine, setup, options, resolve)


def verify(
    original: Program | PathName,
    fixed: Program | PathName | bytes,
    machine: Machine | PathName,
    *,
    setup: Setup | PathName | None = None,
    tolerance_um: float = 1.0,
) -> Compared:
    """Compare what this machine cuts with `fixed` (a program, or its text) with what `original` means.

    `within` of the result is the verdict; its figures are in um; `messages` say what was assumed.
    """
    from ncfix.arguments import TOLERANCE_UM
    from ncfix.compensate.figures.verification import Compared, FollowedProgram, side_by_side, told_once
    from ncfix.text.reader import read_like

    TOLERANCE_UM.check("tolerance_um", tolerance_um)
    known, own = _machine(machine), _setup(setup)
    own = replace(own, assume_zero=True) if known.is_perfect else own
    first = _program(original, known)
    if isinstance(fixed, bytes):
        second = read_program(text=fixed, dialect=first.dialect)
    elif isinstance(fixed, (str, os.PathLike)):
        path = os.fspath(fixed)
        second = read_like(read_bytes(path), path, first, known.control or "")
    else:
        second = fixed
    meant = FollowedProgram.of(first, known, own, _resolve(own, first))
    done = FollowedProgram.of(second, known, own, _resolve(own, second, first))
    found, said = side_by_side(meant, done, known, own, tolerance_um)
    messages = (*_remark_of_stamp(first), *told_once(*said))
    return replace(Compared.together([Compared.of(each) for each in found]), messages=messages)


def _remark_of_stamp(program: Program) -> Iterator[Message]:
    """What is said of a program that is to be what is meant, and has been corrected."""
    from ncfix.text import stamp

    block = stamp.find(program)
    if block is not None:
        yield stamp.remark(program.place(block))


@dataclass(frozen=True, slots=True)
class PathErrors:
    """How far the tool tip of a machine is from where a program means it to be, n samples along the path.

    max_um, rms_um  the largest error, and the root mean square along the path; None where nothing was looked at
    line            the line of the largest
    lines           (n,) the line of each sample
    intended        (n, 3) where the tip shall be in the workpiece, mm
    error_um        (n, 3) where it is, less that
    messages        what there is to say of following the program
    """

    max_um: float | None
    rms_um: float | None
    line: int | None
    lines: NDArray[Any] = field(repr=False)
    intended: NDArray[Any] = field(repr=False)
    error_um: NDArray[Any] = field(repr=False)
    messages: tuple[Message, ...] = ()


@overload
def simulate(
    subject: Measurement, machine: Machine | PathName, *, faults: Faults | None = ..., seed: int = ...
) -> Measurement: ...


@overload
def simulate(
    subject: Program | PathName, machine: Machine | PathName, *, setup: Setup | PathName | None = ...
) -> PathErrors: ...


def simulate(
    subject: Program | PathName | Measurement,
    machine: Machine | PathName,
    *,
    setup: Setup | PathName | None = None,
    faults: Faults | None = None,
    seed: int = 0,
) -> PathErrors | Measurement:
    """Say how far the tool tip of this machine is from where a program means it to be, along the whole path.

    Of a measurement plan: the plan filled in as this machine would be measured, with the `faults` of measuring.
    """
    from ncfix.measure.measurement import Measurement

    if isinstance(subject, Measurement) and setup is not None:
        raise UsageError.of("NCF025", "a set-up is for a program", hint="a plan has columns for states")
    if not isinstance(subject, Measurement) and (faults is not None or seed != 0):
        raise UsageError.of("NCF025", "faults and seed are for a measurement plan, not for a program")
    known = _machine(machine)
    if isinstance(subject, Measurement):
        from ncfix.measure.instruments import simulate as filled

        return filled(subject, known, faults, seed)
    own = _setup(setup)
    own = replace(own, assume_zero=True) if known.is_perfect else own
    return _path_errors(_program(subject, known), known, own)


def _path_errors(program: Program, machine: Machine, setup: Setup) -> PathErrors:
    import numpy as np

    from ncfix.compensate.figures.simulation import Along, tip_errors
    from ncfix.compensate.following import follow
    from ncfix.compensate.plan.intent import Intent
    from ncfix.machine import State

    found = follow(program, machine, setup, _resolve(setup, program))
    moves, along = found.trace.moves, Along()
    parts = list(along.adding(tip_errors(Intent(found.machine, moves, State()), program.lines(moves.block))))
    total = along.figures()
    lines = [each.lines for each in parts]
    intended, actual = ([getattr(each, name) for each in parts] for name in ("intended", "actual"))
    nothing = np.empty((0, 3))
    meant = np.concatenate([nothing, *intended])
    gap = 1e3 * (np.concatenate([nothing, *actual]) - meant)
    every = np.concatenate([np.empty(0, dtype=np.intp), *lines])
    messages = (*_remark_of_stamp(program), *found.trace.messages)
    return PathErrors(total["max"], total["rms"], total["where"], every, meant, gap, messages)


def plan(
    machine: Machine | PathName,
    *,
    kind: str = "tcp",
    count: int = 40,
    room: Room | None = None,
    effects: str | None = None,
    separate: Sequence[str] = (),
    existing: Measurement | PathName | None = None,
    seed: int = 0,
    output: PathName | None = None,
    force: bool = False,
) -> Planned:
    """Choose the poses to be measured: those that tell most about the errors of a machine.

    kind      "tcp", "tcp6", "probe" or "length"
    room      where axes (mm and degree) and tip (mm) may go, tool lengths, balls
    effects   those to be determined, as for `calibrate`; `separate`: those to be told apart
    existing  a measurement that the new poses complete
    """
    from ncfix.measure.candidates import Room
    from ncfix.measure.measurement import dumps
    from ncfix.measure.plan import plan as planned

    _check_output(output, force, machine, existing)
    known = _machine(machine)
    before = None if existing is None else _measurements(existing, known)[0]
    found = planned(known, kind, count, room or Room(), effects, list(separate), before, seed)
    _write(output, dumps(found.plan, found.plan.form.measured if kind != "probe" else ()).encode(), force)
    return found


@dataclass(frozen=True, slots=True)
class Calibrated:
    """What measurements say of the errors of a machine.

    calibration  the estimate, with its covariance
    prediction   how well the tip error is known over the travels
    refused      why the result describes no machine, or not these measurements; empty if it does
    remarks      what there is to say of the estimate
    doubts       what is odd about the machine
    """

    calibration: Calibration
    prediction: Prediction
    refused: tuple[Message, ...]
    remarks: tuple[Message, ...]
    doubts: tuple[Message, ...]

    @property
    def machine(self) -> Machine:
        """The machine with the errors that were estimated."""
        return self.calibration.machine


def calibrate(
    measured: Measured | Sequence[Measured],
    machine: Machine | PathName,
    *,
    effects: str | None = None,
    loss: str = "auto",
    prune: float | None = None,
    knots: int = 0,
    time_constants: bool = False,
    allow_misfit: bool = False,
    path: str = "<machine>",
    output: PathName | None = None,
    force: bool = False,
) -> Calibrated:
    """Estimate the errors of a machine from measurements.

    effects  names or patterns, or a model; None: those of the machine file, or of one without, all that can be
    loss     "auto", "none", "huber" or "tukey"; the other arguments are those of `ncfix calibrate`
    path     what the machine is called in messages
    """
    from ncfix.machine import dumps
    from ncfix.machine.plausible import doubts
    from ncfix.measure.calibrate import calibrate as calibrated
    from ncfix.measure.calibrate import guesses, over_the_travels
    from ncfix.measure.contradictions import refusals

    _check_output(output, force, measured, machine)
    known = _machine(machine)
    found = calibrated(_measurements(measured, known), known, effects, loss, prune, knots, time_constants)
    over = over_the_travels(found)
    odd = doubts(found.machine, path if output is None else os.fspath(output))
    refused = tuple(refusals(found, odd))
    remarks = (*found.remarks, *guesses(found, over))
    result = Calibrated(found, over, refused, remarks, tuple(each.message for each in odd))
    if output is not None and refused and not allow_misfit:
        raise RefusedError(refused)
    _write(output, dumps(found.machine).encode(), force)
    return result


def diagnose(
    measured: Measured | Sequence[Measured],
    machine: Machine | PathName,
    *,
    without: Sequence[str] = (),
    output: PathName | None = None,
    force: bool = False,
) -> Diagnosis:
    """Say where machine and model disagree, and name the effect that is missing.

    without  effects that are not to be considered
    output   where the machine with the effects added goes; nothing is written where there is nothing to add
    """
    from ncfix.diagnosis.diagnosis import diagnose as diagnosed
    from ncfix.diagnosis.presentation import with_provenance
    from ncfix.machine import dumps

    _check_output(output, force, measured, machine)
    known = _machine(machine)
    found = diagnosed(_measurements(measured, known), known, tuple(without))
    if found.machine is not None and output is not None:
        _sound(found.machine, force)
        _write(output, dumps(with_provenance(found)).encode(), force)
    return found


def table_request(
    control: Control,
    machine: Machine,
    tool_length: float,
    target_um: float,
    ranges: Mapping[str, tuple[float, float]] | None,
    settings: Mapping[str, str],
    complete: bool = True,
) -> Request:
    """What to make tables of; ranges in mm and rad. `complete`: options without a default must be given."""
    from ncfix.tables.control import Request
    from ncfix.tables.correction import ranges_of

    space = ranges_of(machine, dict(ranges or {}))
    options = control.settings(settings, complete=complete)
    return Request(machine, space, tool_length, 1e-3 * target_um, options)


def export(
    control: Control | str,
    machine: Machine | PathName,
    *,
    tool_length: float = 0.0,
    target_um: float = 1.0,
    ranges: Mapping[str, tuple[float, float]] | None = None,
    settings: Mapping[str, str] | None = None,
    output: PathName | None = None,
    force: bool = False,
) -> Exported:
    """Make compensation tables for a control, read them again, and judge them by running them.

    control      its name, as in `ncfix export`
    tool_length  the length that the tables hold for, mm
    target_um    how much correction may be lost between the points of a table
    ranges       axis -> what the tables cover, mm and rad; others: the travel
    settings     options of the control
    output       a folder for the files
    """
    from ncfix.tables.control import get_control
    from ncfix.tables.export import export as exported

    chosen = get_control(control) if isinstance(control, str) else control
    if output is not None:
        check_folder(os.fspath(output))
    request = table_request(chosen, _sound(machine, force), tool_length, target_um, ranges, settings or {})
    made = exported(chosen, request)
    if output is not None:
        write_folder(os.fspath(output), made.files, force, identities(_read_paths([machine])))
    return made


def emulate(
    control: Control | str,
    tables: Mapping[str, bytes] | PathName,
    machine: Machine | PathName,
    *,
    other_machine: bool = False,
    name: str = "tables",
) -> Exported:
    """Say what tables leave on a machine: run them as the control would.

    tables         the files that `export` made, all of them, or their folder
    other_machine  run tables that were made for another machine or other errors
    name           what the folder is called in messages, if files are given
    """
    from ncfix.tables.control import get_control
    from ncfix.tables.export import emulate as emulated

    chosen = get_control(control) if isinstance(control, str) else control
    if isinstance(tables, (str, os.PathLike)):
        name = os.fspath(tables)
        tables = read_folder(name)
    return emulated(chosen, tables, _machine(machine), name, other_machine)


def report(
    *sources: Machine | Diagnosis | Mapping[str, Any] | PathName,
    form: str = ".html",
    output: PathName | None = None,
    force: bool = False,
) -> bytes:
    """Put machines, diagnoses and results (what a verb prints with --json) on one page.

    form  ".html" or ".md", or that of a plugin; the suffix of `output` says more
    """
    from ncfix.reports.document import Document
    from ncfix.reports.rendering import form_of

    if not sources:
        raise UsageError.of("NCF025", "a report is made of something", hint="machines, diagnoses or results")
    _check_output(output, force, sources)
    render = form_of(os.fspath(output) if output is not None else f"page{form}")
    found = [section for source in sources for section in _sections(source)]
    title = found[0].heading if len(sources) == 1 else f"{len(sources)} machines and results"
    page = render(Document(title, found))
    _write(output, page, force)
    return page


def _sections(source: Machine | Diagnosis | Mapping[str, Any] | PathName) -> list[Any]:
    from ncfix.diagnosis.diagnosis import Diagnosis
    from ncfix.reports.content import machine_sections, result_sections
    from ncfix.reports.diagnosis import document

    if isinstance(source, (str, os.PathLike)):
        return machine_sections(load_machine(source), os.fspath(source))
    if isinstance(source, Diagnosis):
        return list(document(source).sections)
    if isinstance(source, Mapping):
        return result_sections(dict(source), "result")
    return machine_sections(source, source.name)
