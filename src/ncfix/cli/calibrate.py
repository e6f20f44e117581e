"""`ncfix calibrate`: the errors of a machine from measurements."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.options import FiniteRange, force_option, json_option, load_machine, machine_option
from ncfix.cli.targets import JSON, STREAM, Outputs, check_streams, each_once, read, shown, targets
from ncfix.diagnostics import ExitCode, RefusedError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ncfix.measure.calibrate import Calibration
    from ncfix.measure.prediction import Prediction

LOSSES = ("auto", "none", "huber", "tukey")


@click.command()
@click.argument("measured", nargs=-1, required=True)
@machine_option
@click.option("-o", "--output", metavar="FILE", required=True, help="Where to write the calibrated machine (TOML).")
@click.option("--effects", metavar="LIST", help="Names or patterns like EC0Y,E?X; all; or a model like esmaeili-13-bc.")
@click.option(
    "--loss",
    type=click.Choice(LOSSES),
    default="auto",
    show_default=True,
    help="What far-off values count: auto gives gross outliers no weight and names them.",
)
@click.option(
    "--prune",
    type=FiniteRange(0.5, 1.0, min_open=True, max_open=True),
    metavar="LEVEL",
    help="Leave out coefficients that are not significant at this level, e.g. 0.999.",
)
@click.option(
    "--knots",
    type=click.IntRange(min=0),
    default=0,
    metavar="N",
    help="New error motions of linear axes are parabolas that join at N knots, not cubics; see --prune.",
)
@click.option("--time-constants", is_flag=True, help="Estimate the time constants of effects that lag, too.")
@click.option("--allow-misfit", is_flag=True, help="Write the machine even if it does not describe the measurements.")
@force_option
@json_option
def calibrate(
    measured: tuple[str, ...],
    machine_path: str,
    output: str,
    effects: str | None,
    loss: str,
    prune: float | None,
    knots: int,
    time_constants: bool,
    allow_misfit: bool,
    force: bool,
    as_json: bool,
) -> int:
    """Estimate the errors of a machine from measurements and write the machine with them.

    Without --effects those of the machine file are estimated; of a machine without effects, all that can be. Exit
    code 4: the result does not describe the measurements, and nothing was written.
    """
    from ncfix.machine import dumps
    from ncfix.measure.calibrate import calibrate as calibrated
    from ncfix.measure.misfit import misfit
    from ncfix.measure.prediction import guesses, over_the_travels
    from ncfix.measure.reader import reads

    each_once(measured)
    target = targets([measured[0]], Outputs(output, force=force), (machine_path, *measured[1:]))[0]
    check_streams(JSON if as_json else None, machine=target)
    machine = load_machine(machine_path)
    data = [reads(read(path), machine, shown(path)) for path in measured]
    with console.busy("calibrating"):
        found = calibrated(data, machine, effects, loss, prune, knots, time_constants)
    over = over_the_travels(found)
    remarks = (*found.remarks, *guesses(found, over))
    console.tell(*remarks)
    if not allow_misfit and (message := misfit(found)) is not None:
        raise RefusedError((message,))
    target.write(dumps(found.machine).encode())
    if as_json:
        said = [message.as_dict() for message in remarks]
        console.put_json(**_as_dict(found, over), remarks=said, output=target.path)
    elif output != STREAM:
        _print(found, over)
    return ExitCode.DONE


def _as_dict(found: Calibration, over: Prediction) -> dict[str, Any]:
    from dataclasses import asdict

    from ncfix.measure.residuals import residuals, rms_by_set

    diagnosis = residuals(found.problem, found.estimate)
    tests = {"ball_bar": _ball_bars(found), "positioning": _positioning(found)}
    sigma, covariance = found.sigma, found.covariance
    return {
        "parameters": [
            {"name": label, "value": value, "sigma": deviation, "held": math.isnan(deviation)}
            for label, value, deviation in zip(
                found.labels, found.estimate.coefficients.tolist(), sigma.tolist(), strict=True
            )
        ],
        "covariance": covariance,
        "set_up": _set_up(found),
        "chi_square": found.chi_square,
        "freedom": found.freedom,
        "condition": found.estimate.solution.condition,
        "rms_um": {"before": found.before_um, "after": found.after_um, "sets": rms_by_set(found.problem, diagnosis)},
        "prediction": asdict(over),
        "largest_cook": float(diagnosis.cook.max(initial=0.0)),
        **{name: rows for name, rows in tests.items() if rows},
    }


def _ball_bars(found: Calibration) -> list[dict[str, Any]]:
    """What ball-bar tests say by themselves, um."""
    from dataclasses import asdict

    from ncfix.measure.ball_bar import figures

    seen = (each.measurement for each in found.problem.observations)
    return [asdict(each) for measurement in seen for each in figures(measurement, found.problem.machine)]


def _positioning(found: Calibration) -> list[dict[str, Any]]:
    """ISO 230-2 of direct readings, um and urad."""
    from dataclasses import asdict

    from ncfix.measure.positioning import figures

    return [asdict(each) for seen in found.problem.observations for each in figures(seen.measurement)]


def _set_up(found: Calibration) -> dict[str, float]:
    labels = [label for each in found.problem.observations for label in each.unknowns.labels]
    return dict(zip(labels, found.estimate.unknowns.tolist(), strict=False))


def _print(found: Calibration, over: Prediction) -> None:
    console.table(("coefficient", "value", "sigma", "unit"), list(_rows(found)))
    for bar in _ball_bars(found):
        _say_bar(bar)
    for row in _positioning(found):
        _say_positioning(row)
    held = "; what is held counts as known" if any(sigma != sigma for sigma in found.sigma.tolist()) else ""
    figures = f"{over.worst_um:.2f} um at worst, {over.rms_um:.2f} um rms"
    console.say(f"sigma of the tip error over the travels: {figures}{held}")
    lengths = found.before_um == found.before_um
    rms = f"rms {found.before_um:.2f} um before, {found.after_um:.2f} um after" if lengths else "only angles"
    console.say(f"{rms}; {_noise(found)}")


def _rows(found: Calibration) -> Iterator[tuple[str, str, str, str]]:
    from ncfix.machine.units import units

    machine, selection = found.problem.machine, found.problem.selection
    said = [unit for effect in selection.estimated for unit in units(machine, effect)]
    values, sigma = found.estimate.coefficients.tolist(), found.sigma.tolist()
    for label, value, deviation, (factor, unit) in zip(found.labels, values, sigma, said, strict=True):
        known = "held" if deviation != deviation else f"{factor * deviation:.3g}"
        if value or known != "held":
            yield label, f"{factor * value:.4g}", known, unit


def _noise(found: Calibration) -> str:
    """How the residuals go with the noise; where nobody knows it, they are all that says how large it is."""
    freedom = f"{found.freedom} degrees of freedom"
    if found.problem.noise_known:
        return f"reduced chi-square {found.chi_square:.3f} with {freedom}"
    return f"noise neither given nor to be told from repeats: sigmas are those of the residuals ({freedom})"


def _say_bar(bar: dict[str, Any]) -> None:
    centre = ", ".join(f"{value:.1f}" for value in bar["centre"])
    text = (
        f"ball-bar set {bar['name']}: size {bar['size']:+.1f} um, form {bar['form']:.1f} um, centre off by {centre} um"
    )
    circle = bar["circle"]
    if circle:
        names = {"G(b)": "Gb", "H": "H", "D": "D", "Fmax": "F_max", "Fmin": "F_min"}
        text += "; ISO 230-4: " + ", ".join(f"{name} {circle[key]:.1f}" for name, key in names.items())
    console.say(text)


def _say_positioning(row: dict[str, Any]) -> None:
    unit = "urad" if row["component"][1] in "ABC" else "um"
    known = [f"{name} {row[name]:.1f}" for name in ("A", "R", "E", "M", "B") if row[name] == row[name]]
    console.say(f"{row['component']} set {row['name']}, ISO 230-2: {', '.join(known)} {unit}")
