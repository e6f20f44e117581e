"""`ncfix calibrate`: the errors of a machine from measurements."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from ncfix.cli import console
from ncfix.cli.completion import PATH
from ncfix.cli.options import FiniteRange, force_option, json_option, load_machine, machine_option
from ncfix.cli.targets import JSON, STREAM, Outputs, check_streams, each_once, read, shown, targets
from ncfix.diagnostics import ExitCode, RefusedError

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ncfix.measure.calibrate import Calibration
    from ncfix.measure.prediction import Prediction

LOSSES = ("auto", "none", "huber", "tukey")


@click.command()
@click.argument("measured", type=PATH, nargs=-1, required=True)
@machine_option
@click.option(
    "-o", "--output", type=PATH, metavar="FILE", required=True, help="Where to write the calibrated machine (TOML)."
)
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
    from ncfix.machine.plausible import doubts
    from ncfix.measure.calibrate import calibrate as calibrated
    from ncfix.measure.misfit import refusals
    from ncfix.measure.prediction import guesses, over_the_travels
    from ncfix.measure.reader import reads

    each_once(measured)
    target = targets([measured[0]], Outputs(output, force=force), (machine_path, *measured[1:]))[0]
    check_streams(JSON if as_json else None, machine=target)
    machine = load_machine(machine_path)
    data = [reads(read(path), machine, shown(path)) for path in measured]
    with console.busy("calibrating"):
        calibration = calibrated(data, machine, effects, loss, prune, knots, time_constants)
    over = over_the_travels(calibration)
    remarks = (*calibration.remarks, *guesses(calibration, over))
    odd = doubts(calibration.machine, target.path)
    refused = refusals(calibration, odd)
    if refused and not allow_misfit:
        console.tell(*(each for each in remarks if each not in refused))
        raise RefusedError(refused)
    remarks = (*remarks, *(doubt.message for doubt in odd))
    console.tell(*remarks)
    target.write(dumps(calibration.machine).encode())
    if as_json:
        said = [message.as_dict() for message in remarks]
        console.put_json(**_as_dict(calibration, over), remarks=said, output=target.path)
    elif output != STREAM:
        _print(calibration, over)
    return ExitCode.DONE


def _as_dict(calibration: Calibration, over: Prediction) -> dict[str, Any]:
    from dataclasses import asdict

    from ncfix.measure.residuals import residuals, rms_by_set

    residual = residuals(calibration.problem, calibration.estimate)
    tests = {"ball_bar": _ball_bars(calibration), "positioning": _positioning(calibration)}
    sigma, covariance = calibration.sigma, calibration.covariance
    return {
        "parameters": [
            {"name": label, "value": value, "sigma": deviation, "held": math.isnan(deviation)}
            for label, value, deviation in zip(
                calibration.labels, calibration.estimate.coefficients.tolist(), sigma.tolist(), strict=True
            )
        ],
        "covariance": covariance,
        "set_up": _set_up(calibration),
        "chi_square": calibration.chi_square,
        "freedom": calibration.freedom,
        "condition": calibration.estimate.solution.condition,
        "rms_um": {
            "before": calibration.before_um,
            "after": calibration.after_um,
            "sets": rms_by_set(calibration.problem, residual),
        },
        "prediction": asdict(over),
        "largest_cook": float(residual.cook.max(initial=0.0)),
        **{name: rows for name, rows in tests.items() if rows},
    }


def _ball_bars(calibration: Calibration) -> list[dict[str, Any]]:
    """What ball-bar tests say by themselves, um."""
    from dataclasses import asdict

    from ncfix.measure.ball_bar import figures

    seen = (each.measurement for each in calibration.problem.observations)
    return [asdict(each) for measurement in seen for each in figures(measurement, calibration.problem.machine)]


def _positioning(calibration: Calibration) -> list[dict[str, Any]]:
    """ISO 230-2 of direct readings, um and urad."""
    from dataclasses import asdict

    from ncfix.measure.positioning import figures

    return [asdict(each) for seen in calibration.problem.observations for each in figures(seen.measurement)]


def _set_up(calibration: Calibration) -> dict[str, float]:
    labels = [label for each in calibration.problem.observations for label in each.unknowns.labels]
    return dict(zip(labels, calibration.estimate.unknowns.tolist(), strict=False))


def _print(calibration: Calibration, over: Prediction) -> None:
    console.table(("coefficient", "value", "sigma", "unit"), list(_rows(calibration)))
    for bar in _ball_bars(calibration):
        _say_bar(bar)
    for row in _positioning(calibration):
        _say_positioning(row)
    held = "; what is held counts as known" if any(map(math.isnan, calibration.sigma.tolist())) else ""
    figures = f"{over.worst_um:.2f} um at worst, {over.rms_um:.2f} um rms"
    console.say(f"sigma of the tip error over the travels: {figures}{held}")
    lengths = not math.isnan(calibration.before_um)
    rms = (
        f"rms {calibration.before_um:.2f} um before, {calibration.after_um:.2f} um after" if lengths else "only angles"
    )
    console.say(f"{rms}; {_noise(calibration)}")


def _rows(calibration: Calibration) -> Iterator[tuple[str, str, str, str]]:
    from ncfix.machine.effects import units

    machine, selection = calibration.problem.machine, calibration.problem.selection
    said = [unit for effect in selection.estimated for unit in units(machine, effect)]
    values, sigma = calibration.estimate.coefficients.tolist(), calibration.sigma.tolist()
    for label, value, deviation, (factor, unit) in zip(calibration.labels, values, sigma, said, strict=True):
        known = "held" if math.isnan(deviation) else f"{factor * deviation:.3g}"
        if value or known != "held":
            yield label, f"{factor * value:.4g}", known, unit


def _noise(calibration: Calibration) -> str:
    """How the residuals go with the noise; where nobody knows it, they are all that says how large it is."""
    freedom = f"{calibration.freedom} degrees of freedom"
    if calibration.problem.noise_known:
        return f"reduced chi-square {calibration.chi_square:.3f} with {freedom}"
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
