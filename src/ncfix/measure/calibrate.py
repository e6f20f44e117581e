"""Calibration: estimate the errors of a machine from measurements, with remarks on the result.

`calibrate` estimates by weighted least squares on the exact model (`ncfix.measure.estimate`). The remarks name what the
measurements cannot determine. `over_the_travels` gives the uncertainty of the predicted tip error.
"""

from __future__ import annotations

import datetime
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ncfix.arguments import KNOTS, LOSSES, PLANS, PRUNE, check_choice
from ncfix.arrays import Array, Mask
from ncfix.diagnostics import Message, RefusedError, UsageError
from ncfix.machine import Effect, Machine, State
from ncfix.machine.error_model import signals_of
from ncfix.measure import contradictions, mistakes
from ncfix.measure.candidates import Room, candidates, offered
from ncfix.measure.estimate import Calibration, Estimate, Problem, Residuals, fit, noise_scale
from ncfix.measure.least_squares import AUTO, Combination, Solution, orthonormal, solve, without
from ncfix.measure.measurement import Measurement
from ncfix.measure.refine import pruned, with_time_constants
from ncfix.measure.selection import Selection, select
from ncfix.values import frozen
from ncfix.version import __version__

ALIKE = 0.02
"""Largest difference from 1 or -1 at which a factor is printed as a plain sum or difference."""
NAMED = 20
"""Largest number of outliers, and of omitted coefficients, that are named one by one."""
PLACES = 400
"""Number of poses over the travels at which the uncertainty of the tip error is predicted."""
UM = 1e3
FURTHER, LONGER = 200, 100.0
"""Number of further poses, and mm by which the longest tool is exceeded, to find what more measurements would show."""
SEPARATE = "`ncfix plan --separate` finds poses that distinguish them"
APART = "no further poses of this kind distinguish them; another instrument may, or a set-up whose position is known"


def calibrate(
    measurements: Sequence[Measurement],
    machine: Machine,
    effects: str | Selection | None = None,
    loss: str = AUTO,
    prune: float | None = None,
    knots: int = 0,
    time_constants: bool = False,
) -> Calibration:
    """Estimate the errors of a machine.

    effects  names, patterns, `all` or a model, see `ncfix.measure.selection`; None: those that the machine has
    loss     auto (gross outliers get no weight), none, huber or tukey
    prune    significance, e.g. 0.99, that a coefficient must have to stay; None keeps all
    knots    number of knots of new error motions of linear axes; 0: cubics. `prune` removes insignificant knots
    time_constants  also estimate the time constants of effects with a lag

    Raises `UsageError` NCF025, NCF630, NCF635, NCF637, NCF639, and `RefusedError` NCF623.
    """
    check_choice("loss", loss, LOSSES)
    KNOTS.check("knots", knots)
    if prune is not None:
        PRUNE.check("prune", prune)
    nothing = [message for each in measurements if (message := contradictions.untouched(each)) is not None]
    if nothing:
        raise RefusedError(tuple(nothing))
    selection = effects if isinstance(effects, Selection) else select(machine, effects, _point(measurements), knots)
    time_remarks: tuple[Message, ...] = ()
    if time_constants:
        selection, time_remarks = with_time_constants(measurements, machine, selection)
    problem = Problem.of(measurements, machine, selection)
    try:
        estimate = fit(problem, loss)
    except UsageError as error:
        why = mistakes.suspected(problem) if error.code == "NCF637" else ()
        raise UsageError((*error.messages, *why, *(each for data in measurements for each in data.remarks))) from error
    dropped: tuple[str, ...] = ()
    if prune is not None:
        problem, estimate, dropped = pruned(problem, estimate, prune, loss)
    scale = noise_scale(problem, estimate)
    residuals = Residuals.of(problem, estimate)
    before = _rms_before(problem, residuals)
    after = _rms(residuals, estimate.residual, estimate.weight > 0)
    found = _machine(problem, estimate, scale, {"rms_before_um": before, "rms_after_um": after, "loss": loss})
    remarks = [
        *(each for data in measurements for each in data.remarks),
        *untold(estimate.solution, problem.selection.labels, _told_by_more(problem, estimate.solution)),
        *_outliers(estimate, residuals),
        *_noise(problem, scale),
        *contradictions.conflicts(problem, estimate),
        *mistakes.suspected(problem),
        *(message for seen in problem.observations for message in seen.doubts(found)),
        *time_remarks,
        *_left_out(dropped, prune),
    ]
    return Calibration(found, problem, estimate, scale, tuple(remarks), before, after)


def _point(measurements: Sequence[Measurement]) -> list[float] | None:
    """The point at which error motions were read directly, mm, if the files of kind axis state one and the same."""
    texts = {measurement.header("point") for measurement in measurements if measurement.kind == "axis"} - {""}
    return [float(part) for part in texts.pop().split()] if len(texts) == 1 else None


def _machine(problem: Problem, estimate: Estimate, scale: float, figures: dict[str, Any]) -> Machine:
    """The calibrated machine, with covariances and provenance."""
    machine = problem.selection.machine(problem.machine, estimate.coefficients.tolist())
    covariance = estimate.covariance(scale)
    effects, start = [], 0
    for effect, free in zip(machine.effects, problem.selection.free, strict=True):
        stop = start + (effect.basis.size if free else 0)
        effects.append(_known(effect, covariance[start:stop, start:stop]) if free else effect)
        start = stop
    sources = ", ".join(dict.fromkeys(each.measurement.path for each in problem.observations))
    notes = {"date": datetime.date.today(), "source": sources, "calibrated_from": problem.machine.hash}
    notes["calibrated_by"] = f"ncfix {__version__}"
    told = {key: value for key, value in figures.items() if value == value}
    rounded = {key: round(value, 3) if isinstance(value, float) else value for key, value in told.items()}
    return machine.replace(effects=tuple(effects)).known_from({**notes, **rounded})


def _known(effect: Effect, covariance: Array) -> Effect:
    """The effect with its covariance if all coefficients were estimated, with that of the file if all were held, else
    without one.
    """
    if np.isnan(covariance).all():
        return effect
    if not np.isfinite(covariance).all():
        return replace(effect, covariance=None)
    even = (covariance + covariance.T) / 2
    return replace(effect, covariance=tuple(tuple(float(value) for value in row) for row in even))


def _rms(residuals: Residuals, values: Array, keep: Mask) -> float:
    """RMS, um, of the lengths among values (m,) mm, without calibrated distances; NaN if there is none."""
    chosen = values[(residuals.row >= 0) & ~residuals.turns & keep]
    return float(UM * np.sqrt((chosen**2).mean())) if chosen.size else np.nan


def _rms_before(problem: Problem, residuals: Residuals) -> float:
    """As `_rms`, of the residuals of the given machine with its set-up fitted."""
    residual = problem.residual(problem.selection.start, problem.start) / problem.sigma
    basis = orthonormal(problem.nuisance(problem.start) / problem.sigma[:, None])
    return _rms(residuals, without(basis, residual) * problem.sigma, np.ones(len(residual), dtype=bool))


# -- what has to be said ----------------------------------------------------------------------------------------------


def _outliers(estimate: Estimate, residuals: Residuals) -> Iterator[Message]:
    aside = np.flatnonzero(estimate.weight == 0)
    for index in aside[np.argsort(-np.abs(residuals.studentised[aside]))][:NAMED].tolist():
        factor, unit = (1e6, "urad") if residuals.turns[index] else (1e3, "um")
        size = f"{residuals.value[index] * factor:+.1f} {unit}"
        text = f"{residuals.component[index]} differs by {size} from the model: an outlier, which gets no weight"
        yield Message("NCF633", text, residuals.place(index), "check this row; --loss none gives it full weight")
    if len(aside) > NAMED:
        yield Message("NCF633", f"{len(aside) - NAMED} more outliers")


def _left_out(names: Sequence[str], level: float | None) -> Iterator[Message]:
    if names:
        more = f" and {len(names) - NAMED} more" if len(names) > NAMED else ""
        listed = ", ".join(names[:NAMED]) + more
        yield Message(
            "NCF644",
            f"not significant at {level:g}, so set to zero: {listed}; the standard deviations "
            "allow for their possible size",
        )


def _noise(problem: Problem, scale: float) -> Iterator[Message]:
    if problem.noise_known and scale > 1:
        times = f"{scale:.2f}" if scale < 100 else f"{scale:.0f}"
        text = (
            f"the residuals are {times} times the noise: the model lacks an effect, or the noise is larger than stated"
        )
        yield Message("NCF634", text, hint="`ncfix diagnose` looks for the missing effect")


def _told_by_more(problem: Problem, solution: Solution) -> frozenset[int]:
    """Coefficients that more poses of the measured kinds would determine, over all travels and with a longer tool.

    Empty if the data confound nothing.
    """
    old, more = [each.measurement for each in problem.observations], []
    for each in old if solution.combinations else ():
        if each.kind in PLANS and "radius" not in each.columns:
            lengths = sorted(set(each.column("tool_length").tolist()))
            poses = offered(problem.machine, each.kind, FURTHER, Room(tool_lengths=(*lengths, lengths[-1] + LONGER)))
            names = [name for name in each.measured if name not in poses.columns]
            poses = poses.with_columns({name: np.zeros(len(poses)) for name in names})
            headers = [(name, value) for name in ("setup", "frame") if (value := each.header(name))]
            more.append(replace(poses, headers=tuple(headers)))
    if not more:
        return frozenset()
    wider = Problem.of([*old, *more], problem.machine, problem.selection)
    seen, free = np.split(wider.columns, [wider.design.shape[1]], axis=1)
    found = solve(seen, free, np.zeros(len(seen)), wider.limits, wider.fleeting)
    return frozenset(found.kept.tolist())


def untold(solution: Solution, labels: Sequence[str], told_by_more: Collection[int] = ()) -> list[Message]:
    """Remarks on coefficients that were held because the data do not determine them, alone or in combinations.

    told_by_more  coefficients that more poses would determine, for the hint
    """
    found = _unseen(_listed(solution.unseen, labels), "no measured value depends on")
    found += _unseen(_listed(solution.set_up, labels), "the unknown set-up has the same effect as")
    for each in solution.combinations:
        helps = {each.held, *each.others} <= set(told_by_more)
        found.append(_combined(each, labels, SEPARATE if helps else APART))
    if weak := _listed(solution.weak, labels):
        are = "keeps the value of the machine file" if len(weak) == 1 else "keep the value of the machine file"
        text = (
            f"{', '.join(weak)} {are}: these measurements would determine it only to more than a large error of this "
            "kind"
        )
        found.append(Message("NCF620", text, hint="measure at poses where it acts; `ncfix plan` finds them"))
    if solution.condition > 1e4:
        text = f"the estimates depend strongly on one another: condition number {solution.condition:.0f}"
        found.append(Message("NCF638", text, hint="measure at more different poses, or estimate fewer effects"))
    return found


def _unseen(names: Sequence[str], why: str) -> list[Message]:
    if not names:
        return []
    are, them = (
        ("keeps the value of the machine file", "it")
        if len(names) == 1
        else ("keep the value of the machine file", "them")
    )
    return [Message("NCF632", f"{', '.join(names)} {are}: {why} {them}")]


def _listed(held: Sequence[int], labels: Sequence[str]) -> list[str]:
    """Names of held coefficients; an effect of which all are held is named as a whole."""
    free = {name.split()[0] for k, name in enumerate(labels) if k not in set(held)}
    names = [labels[k] for k in held]
    return list(dict.fromkeys(name if name.split()[0] in free else name.split()[0] for name in names))


def _combined(combination: Combination, labels: Sequence[str], hint: str) -> Message:
    held = labels[combination.held]
    names = [labels[k] for k in combination.others]
    if len(names) > 4:
        text = (
            f"of {held} and {', '.join(names[:4])} and {len(names) - 4} more, these measurements determine only "
            f"combinations; {held} keeps the value of the machine file"
        )
        return Message("NCF631", text, hint=hint)
    listed = f"{', '.join([held, *names[:-1]])} and {names[-1]}"
    return Message(
        "NCF631",
        f"of {listed}, these measurements determine only {_what(combination, held, names)}; "
        f"{held} keeps the value of the machine file",
        hint=hint,
    )


def _what(combination: Combination, held: str, names: Sequence[str]) -> str:
    """The determined combination in words: each of the others plus its factor times the held coefficient."""
    signs = ["+" if factor > 0 else "-" for factor in combination.factors]
    alike = [abs(abs(factor) - 1) < ALIKE for factor in combination.factors]
    if len(names) == 1 and alike[0]:
        return "their sum" if signs[0] == "+" else "their difference"
    sizes = ["" if same else f" {abs(factor):.3g} x" for same, factor in zip(alike, combination.factors, strict=True)]
    return " and ".join(f"{name} {sign}{size} {held}" for name, sign, size in zip(names, signs, sizes, strict=True))


# -- how well the tip is known -----------------------------------------------------------------------------------------


@frozen(eq=False)
class Prediction:
    """Standard deviation of the predicted tip error over the travels, um, the largest of x, y, z at each pose.

    worst_um, rms_um  maximum and root mean square over the poses; at: the worst pose, mm and degree
    Held coefficients count as known. Inputs other than positions are at the median of the data.
    """

    worst_um: float
    rms_um: float
    at: Mapping[str, float]


def over_the_travels(calibration: Calibration) -> Prediction:
    """The uncertainty of the predicted tip error at poses over all travels, with the tools of the measurements."""
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
    """A warning (NCF641) if the uncertainty of the tip error anywhere exceeds the rms error before calibration."""
    if not over.worst_um > calibration.before_um:
        return ()
    at = ", ".join(f"{name} {value:g}" for name, value in over.at.items() if name != "tool_length")
    text = (
        f"at {at} the standard deviation of the predicted tip error is {over.worst_um:.1f} um, but the residuals "
        f"before the calibration were only {calibration.before_um:.1f} um rms: away from the measured poses the "
        "model is a guess"
    )
    hint = "measure where `ncfix plan --existing` says, or estimate fewer effects: --effects"
    return (Message("NCF641", text, hint=hint),)


def deviations(calibration: Calibration, q: Array, state: State) -> Array:
    """Standard deviation of the predicted tip error at poses q (n, n_axes), (n, 3) mm, in the workpiece frame."""
    design = calibration.problem.machine.design(q, state, calibration.asked.estimated)
    return calibration.uncertainty(design[:, :3])


def _inputs(calibration: Calibration, machine: Machine) -> dict[str, Array]:
    """The median of each input on which the estimated effects depend, for `PLACES` poses."""
    signals = (each for effect in calibration.asked.estimated for each in signals_of(machine.axes, effect))
    names = {name for signal in signals if signal is not None for name in signal.inputs} - {"tool_length"}
    values = {}
    for name in names:
        columns = [each.measurement.column(name) for each in calibration.problem.observations]
        values[name] = np.full(PLACES, float(np.median(np.concatenate(columns))))
    return values
