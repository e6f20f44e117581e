"""Functions for programs: correction, comparison, and tip errors along the path."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, overload

from ncfix.api.sources import (
    PathName,
    as_machine,
    as_path,
    as_program,
    as_setup,
    check_writable,
    read_program,
    sound_machine,
    subprograms_of,
    write_output,
)
from ncfix.control.setup import Setup
from ncfix.diagnostics import Message, RefusedError, UsageError
from ncfix.files import read_bytes
from ncfix.values import frozen

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from ncfix.compensate.driver import Fixed
    from ncfix.compensate.figures.verification import Compared
    from ncfix.compensate.following import Resolve
    from ncfix.machine import Machine
    from ncfix.measure.instruments import Faults
    from ncfix.measure.measurement import Measurement
    from ncfix.text.tree import Program


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
    """Rewrite a program so that this machine cuts what was intended.

    setup          offsets, tools and start positions, or a setup file; missing data raise `UsageError` NCF2xx
    strategy       `ncfix fix --strategy`
    tolerance_um   largest deviation of the tool tip from the intended path
    flatten        write loops, subprograms and cycles out where they cannot be corrected otherwise
    figures        compute the errors along the path before and after (`report.error_before_um`, ...)
    force          correct a program that is corrected already, or for an implausible machine; replace an existing
                   output
    allow_refused  write the output even if motions had to be left uncorrected
    resolve        returns the text of a subprogram by its name; None: files beside the program, if it is a file
    """
    from ncfix.compensate import FixOptions
    from ncfix.compensate.driver import fix_flat, fix_program

    options = FixOptions(strategy, tolerance_um, allow_refused, force, split_rapids, flatten, block_numbers, figures)
    check_writable(output, force, program, machine, setup)
    known = sound_machine(machine, force)
    own = as_setup(setup, known)
    read = as_program(program, known)
    correct = fix_flat if flatten else fix_program
    found = correct(read, known, own, options, resolve or subprograms_of(own, read))
    if output is not None and found.report.refused and not allow_refused:
        raise RefusedError.collected(found.report.refusals)
    write_output(output, found.text, force)
    return found


def verify(
    original: Program | PathName,
    fixed: Program | PathName | bytes,
    machine: Machine | PathName,
    *,
    setup: Setup | PathName | None = None,
    tolerance_um: float = 1.0,
) -> Compared:
    """Compare what this machine cuts with `fixed` (a program, or its text) to what `original` intends.

    `within` of the result is the verdict; its figures are in um; `messages` lists assumptions.
    """
    from ncfix.arguments import TOLERANCE_UM
    from ncfix.compensate.figures.verification import Compared, side_by_side
    from ncfix.text.reader import read_like

    TOLERANCE_UM.check("tolerance_um", tolerance_um)
    known = as_machine(machine)
    own = as_setup(setup, known)
    own = replace(own, assume_zero=True) if known.is_perfect else own
    first = as_program(original, known)
    if isinstance(fixed, bytes):
        second = read_program(text=fixed, dialect=first.dialect)
    elif isinstance(fixed, (str, os.PathLike)):
        path = as_path(fixed)
        second = read_like(read_bytes(path), path, first, known.control or "")
    else:
        second = as_program(fixed, known)
    resolves = subprograms_of(own, first), subprograms_of(own, second, first)
    found = Compared.of_all(*side_by_side(first, second, known, own, tolerance_um, resolves))
    return replace(found, messages=(*_remark_of_stamp(first), *found.messages))


def _remark_of_stamp(program: Program) -> Iterator[Message]:
    """The warning for a program that is taken as the intended one although it has been corrected."""
    from ncfix.text import stamp

    block = stamp.find(program)
    if block is not None:
        yield stamp.remark(program.place(block))


@frozen(eq=False)
class PathErrors:
    """Errors of a machine's tool tip at n samples along the path of a program.

    max_um, rms_um  largest error, and root mean square along the path; None without samples
    line            line of the largest error
    lines           (n,) line of each sample
    intended        (n, 3) intended tip in the workpiece, mm
    error_um        (n, 3) actual minus intended tip
    messages        remarks from following the program
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
    """Compute the error of this machine's tool tip along the whole path of a program.

    For a measurement plan: the plan, filled in with what this machine would measure, with the measuring errors
    `faults`.
    """
    from ncfix.measure.measurement import Measurement

    if isinstance(subject, Measurement) and setup is not None:
        raise UsageError.of(
            "NCF025", "a setup is for a program, not for a measurement plan", hint="a plan has columns for inputs"
        )
    if not isinstance(subject, Measurement) and (faults is not None or seed != 0):
        raise UsageError.of("NCF025", "faults and seed are for a measurement plan, not for a program")
    known = as_machine(machine)
    if isinstance(subject, Measurement):
        from ncfix.measure.instruments import simulate as filled

        return filled(subject, known, faults, seed)
    own = as_setup(setup, known)
    own = replace(own, assume_zero=True) if known.is_perfect else own
    return _path_errors(as_program(subject, known), known, own)


def _path_errors(program: Program, machine: Machine, setup: Setup) -> PathErrors:
    import numpy as np

    from ncfix.compensate.figures.simulation import SimulatedErrors, tip_errors_of
    from ncfix.compensate.following import follow

    found = follow(program, machine, setup, subprograms_of(setup, program))
    along = SimulatedErrors()
    parts = list(along.adding(tip_errors_of(program, found)))
    total = along.figures()
    lines = [each.lines for each in parts]
    intended, actual = ([getattr(each, name) for each in parts] for name in ("intended", "actual"))
    nothing = np.empty((0, 3))
    meant = np.concatenate([nothing, *intended])
    gap = 1e3 * (np.concatenate([nothing, *actual]) - meant)
    every = np.concatenate([np.empty(0, dtype=np.intp), *lines])
    messages = (*_remark_of_stamp(program), *found.trace.messages)
    return PathErrors(total["max"], total["rms"], total["where"], every, meant, gap, messages)
