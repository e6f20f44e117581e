"""How well a calibration knows the error of the tool tip: its standard deviation all over the travels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ncfix.diagnostics import Message
from ncfix.machine import Machine, State
from ncfix.machine.error_model import signals_of
from ncfix.measure.calibrate import Calibration
from ncfix.measure.candidates import Room, candidates
from ncfix.measure.measurement import Array

PLACES = 400
"""Poses over the travels at which the tip error is predicted."""
UM = 1e3


@dataclass(frozen=True, slots=True)
class Prediction:
    """The standard deviation of the predicted tip error, um, the largest of three directions at each pose.

    What was held counts as known; other signals than positions are taken where they were in the middle of the data.
    """

    worst_um: float
    rms_um: float
    at: Mapping[str, float]


def over_the_travels(calibration: Calibration) -> Prediction:
    """At poses all over the travels, with the tools that were measured with."""
    machine = calibration.problem.machine
    lengths = {
        float(length) for each in calibration.problem.observations for length in each.measurement.column("tool_length")
    }
    places = candidates(machine, "tcp", PLACES, Room(tool_lengths=sorted(lengths)))
    state = State(places.column("tool_length"), places.state(machine).direction, _inputs(calibration, machine))
    sigma = UM * deviations(calibration, places.positions(machine), state).max(axis=1)
    row = int(sigma.argmax())
    at = {name: float(places.columns[name][row]) for name in (*machine.axis_names, "tool_length")}
    return Prediction(float(sigma[row]), float(np.sqrt((sigma**2).mean())), at)


def guesses(calibration: Calibration, over: Prediction) -> tuple[Message, ...]:
    """A warning (NCF641) if somewhere in the travels the tip error is known to less than what was to be corrected."""
    if not over.worst_um > calibration.before_um:
        return ()
    at = ", ".join(f"{name} {value:g}" for name, value in over.at.items() if name != "tool_length")
    text = (
        f"at {at} the tip error is known to {over.worst_um:.1f} um (1 sigma), and only {calibration.before_um:.1f} um "
        "rms were there before: away from the measured poses the model is a guess"
    )
    hint = "measure where `ncfix plan --existing` says, or estimate fewer effects: --effects, --prune 0.99"
    return (Message("NCF641", text, hint=hint),)


def deviations(calibration: Calibration, q: Array, state: State) -> Array:
    """Standard deviation of the predicted tip error at any poses, (n, 3) mm, directions of the workpiece frame."""
    design = calibration.problem.machine.design(q, state, calibration.problem.selection.estimated)
    return calibration.uncertainty(design[:, :3])


def _inputs(calibration: Calibration, machine: Machine) -> dict[str, Array]:
    """The middle of every signal that the estimated effects need."""
    signals = (each for effect in calibration.problem.selection.estimated for each in signals_of(machine.axes, effect))
    names = {name for signal in signals if signal is not None for name in signal.inputs} - {"tool_length"}
    values = {}
    for name in names:
        columns = [each.measurement.column(name) for each in calibration.problem.observations]
        values[name] = np.full(PLACES, float(np.median(np.concatenate(columns))))
    return values
