"""Functions for measurements: planning, calibration, diagnosis."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ncfix.api.sources import (
    PathName,
    as_machine,
    as_measurements,
    as_names,
    check_effects,
    check_writable,
    sound_machine,
    write_output,
)
from ncfix.diagnostics import Message, RefusedError, UsageError
from ncfix.values import frozen

if TYPE_CHECKING:
    from ncfix.api.sources import Measured
    from ncfix.diagnosis.diagnosis import Diagnosis
    from ncfix.machine import Machine
    from ncfix.measure.calibrate import Prediction
    from ncfix.measure.candidates import Room
    from ncfix.measure.estimate import Calibration
    from ncfix.measure.measurement import Measurement
    from ncfix.measure.plan import Planned


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
    """Choose the poses to measure: those that determine the errors of a machine best.

    kind      "tcp", "tcp6", "probe" or "length"
    room      limits of axes (mm and degree) and tip (mm), tool lengths, balls
    effects   effects to determine, as for `calibrate`; `separate`: effects to tell apart
    existing  a measurement that the new poses complete
    """
    from ncfix.measure.candidates import Room
    from ncfix.measure.measurement import dumps
    from ncfix.measure.plan import plan as planned

    check_effects(effects)
    check_writable(output, force, machine, existing)
    known = as_machine(machine)
    before = [] if existing is None else as_measurements(existing, known)
    if len(before) > 1:
        raise UsageError.of("NCF025", f"existing: {len(before)} measurements", hint="one of them")
    found = planned(
        known,
        kind,
        count,
        room or Room(),
        effects,
        list(as_names("separate", separate)),
        before[0] if before else None,
        seed,
    )
    write_output(output, dumps(found.plan, found.plan.form.measured if kind != "probe" else ()).encode(), force)
    return found


@frozen(eq=False)
class Calibrated:
    """Result of a calibration.

    calibration  the estimate, with its covariance
    prediction   uncertainty of the tip error over the travels
    refused      why the result cannot describe a machine or does not fit the measurements; empty if it is accepted
    remarks      messages on the estimate
    doubts       messages on implausible properties of the machine
    """

    calibration: Calibration
    prediction: Prediction
    refused: tuple[Message, ...]
    remarks: tuple[Message, ...]
    doubts: tuple[Message, ...]

    @property
    def machine(self) -> Machine:
        """The machine with the estimated errors."""
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

    effects  names or patterns, or a model; None: those of the machine file; if it has none, all that can be estimated
             (for a measuring arm: the position of its joints)
    loss     "auto", "none", "huber" or "tukey"; the other arguments are those of `ncfix calibrate`
    path     name of the machine in messages
    """
    from ncfix.machine import dumps
    from ncfix.machine.plausible import doubts
    from ncfix.measure.calibrate import calibrate as calibrated
    from ncfix.measure.calibrate import guesses, over_the_travels
    from ncfix.measure.contradictions import refusals

    check_effects(effects)
    check_writable(output, force, measured, machine)
    known = as_machine(machine)
    found = calibrated(as_measurements(measured, known), known, effects, loss, prune, knots, time_constants)
    over = over_the_travels(found)
    odd = doubts(found.machine, path if output is None else os.fspath(output))
    refused = tuple(refusals(found, odd))
    remarks = (*found.remarks, *guesses(found, over))
    result = Calibrated(found, over, refused, remarks, tuple(each.message for each in odd))
    if output is not None and refused and not allow_misfit:
        raise RefusedError(refused)
    write_output(output, dumps(found.machine).encode(), force)
    return result


def diagnose(
    measured: Measured | Sequence[Measured],
    machine: Machine | PathName,
    *,
    without: Sequence[str] = (),
    since: bool = False,
    output: PathName | None = None,
    force: bool = False,
) -> Diagnosis:
    """Find where machine and model disagree, and name the missing effect.

    without  names of effects that are excluded; `messages` of the result list names that do not exist (NCF657)
    since    the last file is of a later date than the others: only what changed in between is sought
    output   file for the machine with the effects added; nothing is written if there is nothing to add
    """
    from ncfix.diagnosis.diagnosis import diagnose as diagnosed
    from ncfix.diagnosis.presentation import with_provenance
    from ncfix.machine import dumps

    refused = as_names("without", without)
    check_writable(output, force, measured, machine)
    known = as_machine(machine)
    found = diagnosed(as_measurements(measured, known), known, refused, since)
    if found.machine is not None and output is not None:
        sound_machine(found.machine, force)
        write_output(output, dumps(with_provenance(found)).encode(), force)
    return found
