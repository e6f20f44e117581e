"""Verbs for measurements: `ncfix plan`, `ncfix calibrate`, `ncfix diagnose`.

They choose the poses to measure, estimate errors from measurements, and find why a machine disagrees with its model.
"""

from __future__ import annotations

import math
import os
from typing import TYPE_CHECKING, Any

import click

import ncfix
from ncfix.arguments import KNOTS, LOSSES, PLANS, POSES, PRUNE, SEED
from ncfix.cli import console
from ncfix.cli.options import (
    PATH,
    ToolLength,
    force_option,
    json_option,
    load_machine,
    machine_option,
    numbers,
    sound,
    table_option,
)
from ncfix.cli.targets import JSON, STREAM, Outputs, check_streams, read, shown, targets
from ncfix.diagnostics import ExitCode, RefusedError
from ncfix.inputs import each_once

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ncfix.cli.targets import OutputTarget
    from ncfix.diagnosis.diagnosis import Diagnosis
    from ncfix.measure.calibrate import Prediction
    from ncfix.measure.estimate import Calibration
    from ncfix.measure.measurement import Measurement
    from ncfix.measure.plan import Planned

FULL_TEST = 5
"""Number of runs of a test by ISO 230-2, for an axis of up to 2 m."""
FIGURES = {name: name for name in ("A", "R", "E", "M", "B")}
FIGURES |= {f"{name}_{side}": f"{name} {side}" for name in ("A", "R", "E") for side in ("up", "down")}
FIGURES["mean_reversal"] = "mean B"
"""Figures of ISO 230-2, and their printed names."""


@click.command()
@click.argument("measured", type=PATH, nargs=-1, required=True)
@machine_option
@click.option(
    "-o", "--output", type=PATH, metavar="FILE", required=True, help="File for the calibrated machine (TOML)."
)
@click.option(
    "--effects",
    metavar="LIST",
    help="Errors to estimate: names or patterns like EC0Y,E?X; all; or a model like esmaeili-13-bc.",
)
@click.option(
    "--loss",
    type=click.Choice(LOSSES),
    default="auto",
    show_default=True,
    help="Weight of outliers; auto: gross outliers get no weight and are named; none: all values get full weight.",
)
@click.option(
    "--prune",
    type=numbers(PRUNE),
    metavar="LEVEL",
    help="Set coefficients to zero that are not significant at this level, e.g. 0.999.",
)
@click.option(
    "--knots",
    type=numbers(KNOTS),
    default=0,
    metavar="N",
    help="Describe new error motions of linear axes by parabolas that join at N knots instead of cubics; see --prune.",
)
@click.option(
    "--time-constants",
    is_flag=True,
    help="Also estimate the time constants of effects that follow their input with a delay.",
)
@click.option(
    "--allow-misfit", is_flag=True, help="Write the machine file although it does not describe the measurements."
)
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
    """Estimate the errors of a machine from the files MEASURED, and write the machine file with them.

    Without --effects, the effects of the machine file are estimated; if it has none, all that can be estimated (of an
    arm: the location errors of its joints). Exit code 4: the result does not describe the measurements, and nothing was
    written.
    """
    from ncfix.machine import dumps
    from ncfix.measure.reader import reads

    each_once(measured, shown)
    target = targets([measured[0]], Outputs(output, force=force), (machine_path, *measured[1:]))[0]
    check_streams(JSON if as_json else None, machine=target)
    machine = load_machine(machine_path)
    data = [reads(read(path), machine, shown(path)) for path in measured]
    with console.busy("calibrating"):
        found = ncfix.calibrate(
            data,
            machine,
            effects=effects,
            loss=loss,
            prune=prune,
            knots=knots,
            time_constants=time_constants,
            path=target.path,
        )
    calibration, over = found.calibration, found.prediction
    if found.refused and not allow_misfit:
        console.tell(*(each for each in found.remarks if each not in found.refused))
        raise RefusedError(found.refused)
    remarks = (*found.remarks, *found.doubts)
    console.tell(*remarks)
    target.write(dumps(calibration.machine).encode())
    if as_json:
        console.put_json(**_as_dict(calibration, over), remarks=remarks, output=target.path)
    elif output != STREAM:
        _print(calibration, over)
    return ExitCode.DONE


def _as_dict(calibration: Calibration, over: Prediction) -> dict[str, Any]:
    from dataclasses import asdict

    from ncfix.measure.estimate import Residuals

    problem, estimate = calibration.problem, calibration.estimate
    residual = Residuals.of(problem, estimate)
    tests = {"ball_bar": _ball_bars(calibration), "positioning": _positioning(calibration)}
    values, sigma = estimate.coefficients.tolist(), calibration.sigma.tolist()
    unknowns = [label for each in problem.observations for label in each.unknowns.labels]
    return {
        "measured": [_told_of(each.measurement) for each in problem.observations],
        "parameters": [
            {"name": label, "value": value, "sigma": deviation, "held": math.isnan(deviation)}
            for label, value, deviation in zip(calibration.labels, values, sigma, strict=True)
        ],
        "covariance": calibration.covariance,
        "set_up": dict(zip(unknowns, estimate.unknowns.tolist(), strict=False)),
        "chi_square": calibration.chi_square,
        "freedom": estimate.freedom,
        "condition": estimate.solution.condition,
        "rms_um": {"before": calibration.before_um, "after": calibration.after_um, "sets": residual.rms_by_set()},
        "prediction": asdict(over),
        "largest_cook": float(residual.cook.max(initial=0.0)),
        **{name: rows for name, rows in tests.items() if rows},
    }


def _told_of(measurement: Measurement) -> dict[str, Any]:
    """The header data of a measurement file."""
    notes = {key: measurement.header(key) for key in ("instrument", "date", "operator", "note")}
    return {"path": measurement.path, "kind": measurement.kind, "rows": len(measurement), **notes}


def _ball_bars(calibration: Calibration) -> list[dict[str, Any]]:
    """Figures of the ball-bar tests by themselves, um."""
    from dataclasses import asdict

    from ncfix.measure.lengths import ball_bar_figures

    seen = (each.measurement for each in calibration.problem.observations)
    return [asdict(each) for measurement in seen for each in ball_bar_figures(measurement, calibration.problem.machine)]


def _positioning(calibration: Calibration) -> list[dict[str, Any]]:
    """Figures of ISO 230-2 from direct readings, um and urad."""
    from dataclasses import asdict

    from ncfix.measure.direct import positioning_figures

    return [asdict(each) for seen in calibration.problem.observations for each in positioning_figures(seen.measurement)]


def _print(calibration: Calibration, over: Prediction) -> None:
    console.table(("coefficient", "value", "sigma", "unit"), list(_rows(calibration)))
    for bar in _ball_bars(calibration):
        _say_bar(bar)
    machine = calibration.problem.machine
    for row in _positioning(calibration):
        unit = "urad" if row["component"][1] in "ABC" else "um"
        known = [f"{name} {row[key]:.1f}" for key, name in FIGURES.items() if row[key] == row[key]]
        own = machine.is_positioning(row["component"])
        few = (
            f" ({row['runs']} of the {FULL_TEST} runs that the standard requires)"
            if own and row["runs"] < FULL_TEST
            else ""
        )
        norm = "ISO 230-2" if own else "as in ISO 230-2"
        console.say(f"{row['component']} set {row['name']}, {norm}: {', '.join(known)} {unit}{few}")
    held = "; held coefficients count as known" if any(map(math.isnan, calibration.sigma.tolist())) else ""
    figures = f"{over.worst_um:.2f} um at worst, {over.rms_um:.2f} um rms"
    console.say(f"standard deviation of the predicted tip error over the travels: {figures}{held}")
    rms = f"residuals {calibration.before_um:.2f} um rms before, {calibration.after_um:.2f} um rms after"
    console.say(f"{'only angles' if math.isnan(calibration.before_um) else rms}; {_noise(calibration)}")


def _rows(calibration: Calibration) -> Iterator[tuple[str, str, str, str]]:
    from ncfix.machine.effects import units

    machine, selection = calibration.problem.machine, calibration.problem.selection
    scales = [unit for effect in selection.estimated for unit in units(machine, effect)]
    values, sigma = calibration.estimate.coefficients.tolist(), calibration.sigma.tolist()
    for label, value, deviation, (factor, unit) in zip(calibration.labels, values, sigma, scales, strict=True):
        known = "held" if math.isnan(deviation) else f"{factor * deviation:.3g}"
        if value or known != "held":
            yield label, f"{factor * value:.4g}", known, unit


def _noise(calibration: Calibration) -> str:
    """The relation of residuals and noise; if the noise is not known, it was estimated from the residuals."""
    freedom = f"{calibration.estimate.freedom} degrees of freedom"
    if calibration.problem.noise_known:
        return f"reduced chi-square {calibration.chi_square:.3f} with {freedom}"
    return f"noise neither stated nor known from repeats: sigmas are from the residuals ({freedom})"


def _say_bar(bar: dict[str, Any]) -> None:
    centre = ", ".join(f"{value:.1f}" for value in bar["centre"])
    text = f"ball-bar set {bar['name']}: size {bar['size']:+.1f} um, form {bar['form']:.1f} um"
    text += f", centre off by {centre} um"
    if circle := bar["circle"]:
        both = circle["H"] == circle["H"]
        names = {"G(b)" if both else "G": "Gb", "H": "H", "D": "D", "Fmax": "F_max", "Fmin": "F_min"}
        known = [f"{name} {circle[key]:.1f}" for name, key in names.items() if circle[key] == circle[key]]
        text += f"; ISO 230-4: {', '.join(known)}" + ("" if both else " (one way round only)")
    console.say(text)


@click.command()
@machine_option
@click.option("--kind", type=click.Choice(PLANS), default="tcp", show_default=True, help="Kind of measurement.")
@click.option("-n", "--count", type=numbers(POSES), default=40, show_default=True, help="Number of poses.")
@click.option("--effects", metavar="LIST", help="Errors to be determined, as for `ncfix calibrate`.")
@click.option("--separate", metavar="EFFECT,EFFECT", help="Find poses that distinguish these effects.")
@click.option("--existing", type=PATH, metavar="FILE", help="Measurement file that the new poses add to.")
@click.option(
    "--range",
    "ranges",
    multiple=True,
    metavar="AXIS=LOW,HIGH",
    help="Range of an axis, mm or degrees; default: its travel (repeatable).",
)
@click.option(
    "--tool-length",
    "lengths",
    multiple=True,
    type=ToolLength(),
    metavar="MM",
    help="Length of a tool or probe, mm; default: 100 (repeatable).",
)
@click.option(
    "--ball",
    "balls",
    multiple=True,
    metavar="NAME=X,Y,Z",
    help="Position of a ball, mm, for the kinds probe and tcp (repeatable).",
)
@click.option(
    "--reach",
    "reaches",
    multiple=True,
    metavar="x=LOW,HIGH",
    help="Range of the tool tip along x, y or z of the workpiece, mm (repeatable).",
)
@click.option(
    "--input",
    "inputs",
    multiple=True,
    metavar="NAME=LOW,HIGH",
    help="Range of an input that can be set, e.g. load_kg (repeatable).",
)
@click.option(
    "--gcode", type=PATH, metavar="FILE", help="Also write the skeleton of an NC program that goes to the poses."
)
@click.option("--seed", type=numbers(SEED), default=0, help="Seed of the candidate poses; default: 0.")
@table_option
@force_option
@json_option
def plan(
    machine_path: str,
    kind: str,
    count: int,
    effects: str | None,
    separate: str | None,
    existing: str | None,
    ranges: tuple[str, ...],
    lengths: tuple[float, ...],
    balls: tuple[str, ...],
    reaches: tuple[str, ...],
    inputs: tuple[str, ...],
    gcode: str | None,
    seed: int,
    output: str,
    force: bool,
    as_json: bool,
) -> None:
    """Choose the poses of a measurement, and write them as a measurement file to be filled in."""
    from ncfix.measure.candidates import Room
    from ncfix.measure.measurement import dumps
    from ncfix.measure.plan import skeleton
    from ncfix.measure.reader import reads

    sources = () if existing is None else (existing,)
    target = targets([machine_path], Outputs(output, force=force), sources)[0]
    program = targets([machine_path], Outputs(gcode, force=force), sources)[0] if gcode else None
    check_streams(JSON if as_json else None, program=program, poses=None if as_json else target)
    machine = load_machine(machine_path)
    before = reads(read(existing), machine, shown(existing)) if existing else None
    names = [name.strip() for name in separate.split(",")] if separate else []
    stand = {name: (at[0], at[1], at[2]) for name, at in (_named(text, 3, "--ball") for text in balls)}
    travels, space, others = _limits(ranges, "--range"), _limits(reaches, "--reach"), _limits(inputs, "--input")
    room = Room(travels, lengths or (100.0,), stand, space, others)
    with console.busy("choosing poses"):
        found = ncfix.plan(
            machine, kind=kind, count=count, room=room, effects=effects, separate=names, existing=before, seed=seed
        )
    empty = found.plan.form.measured if kind != "probe" else ()
    text = dumps(found.plan, empty)
    if program:
        program.write(skeleton(found.plan, machine).encode())
    figures = {"worst_um": found.worst_um, "mean_um": found.mean_um, "determined": len(found.seen)}
    listed = {"unseen": found.unseen, "open": found.open}
    if as_json:
        console.put_json(kind=kind, count=count, **figures, **listed, output=output)
    if not as_json or output != STREAM:
        target.write(text.encode())
    _say(found, separated=bool(separate))


def _say(planned: Planned, *, separated: bool) -> None:
    """Report what the poses cannot determine, and how well the tip error will be known if that was optimised."""
    if planned.unseen:
        console.say(
            f"no pose of this kind distinguishes these errors from the other unknowns: {', '.join(planned.unseen)}"
        )
    if not separated:
        console.say(
            f"standard deviation of the tip error, per um of noise: {planned.worst_um:.2f} um at worst, "
            f"{planned.mean_um:.2f} um rms"
        )
    if planned.open:
        console.say(f"hardly determined is a combination of {', '.join(planned.open)}")
        console.say(
            "use more poses, another kind of measurement or another tool length, or estimate fewer effects (--effects)"
        )


def _limits(texts: tuple[str, ...], option: str) -> dict[str, tuple[float, float]]:
    """Name -> limits, from NAME=LOW,HIGH or NAME=LOW:HIGH."""
    named = (_named(text.replace(":", ","), 2, option) for text in texts)
    return {name: (limits[0], limits[1]) for name, limits in named}


def _named(text: str, count: int, option: str) -> tuple[str, list[float]]:
    name, equals, rest = text.partition("=")
    try:
        values = [float(part) for part in rest.split(",")]
    except ValueError:
        values = []
    if not equals or len(values) != count or not all(map(math.isfinite, values)):
        raise click.BadParameter(f"{text!r} should be NAME= and {count} numbers", param_hint=option)
    return name.strip(), values


@click.command()
@click.argument("measured", type=PATH, nargs=-1, required=True)
@machine_option
@click.option("-o", "--output", type=PATH, metavar="FILE", help="File for the machine with the effects added (TOML).")
@click.option("--without", multiple=True, metavar="NAME", help="Effect that is not considered (repeatable).")
@click.option("--since", is_flag=True, help="Find what has changed: the last file is compared with all before it.")
@click.option(
    "--next",
    "next_path",
    type=PATH,
    metavar="FILE",
    help="File for the poses to be measured next: a plan if it ends in .csv, else an NC program.",
)
@click.option("--report", type=PATH, metavar="FILE", help="File for a report with figures (HTML or Markdown).")
@click.option("--plot", type=PATH, metavar="FILE.svg|png|pdf", help="Write a picture of the result.")
@click.option("--check", is_flag=True, help="Return exit code 1 if the model lacks anything.")
@force_option
@json_option
def diagnose(
    measured: tuple[str, ...],
    machine_path: str,
    output: str | None,
    without: tuple[str, ...],
    since: bool,
    next_path: str | None,
    report: str | None,
    plot: str | None,
    check: bool,
    force: bool,
    as_json: bool,
) -> int:
    """Compare the model of a machine with the files MEASURED, name the effects that it lacks, and add them."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # many small matrices: threads cost more than they give
    from ncfix.cli.shop.pages import check_plot
    from ncfix.diagnosis.diagnosis import NOTHING
    from ncfix.diagnosis.presentation import as_dict, text, with_provenance
    from ncfix.machine import dumps
    from ncfix.measure.reader import reads
    from ncfix.reports.diagnosis import document
    from ncfix.reports.rendering import form_of

    each_once(measured, shown)
    inputs = (*measured, machine_path)
    if plot is not None:
        check_plot(plot)
    machine_target, next_target, page_target, plot_target = (
        targets([STREAM], Outputs(path, force=force), inputs)[0] if path is not None else None
        for path in (output, next_path, report, plot)
    )
    check_streams("what was found", machine=machine_target, poses=next_target, report=page_target)
    form = form_of(report) if report is not None else None
    machine = load_machine(machine_path)
    data = [reads(read(path), machine, shown(path)) for path in measured]
    for each in data:
        console.tell_some(each.remarks)
    with console.busy("diagnosing"):
        diagnosis = ncfix.diagnose(data, machine, without=without, since=since)
    console.tell(*diagnosis.messages)
    written = None
    if machine_target is not None and diagnosis.machine is not None:
        sound(diagnosis.machine, machine_target.path, force)
        machine_target.write(dumps(with_provenance(diagnosis)).encode())
        written = machine_target.path
    if next_target is not None:
        _write_next(diagnosis, next_target)
    if page_target is not None and form is not None:
        page_target.write(form(document(diagnosis)))
    if plot_target is not None:
        from ncfix.reports.diagnosis_picture import picture

        plot_target.write(picture(diagnosis, plot_target.path.lower().rpartition(".")[2]))
    if as_json:
        console.put_json(**as_dict(diagnosis, written))
    else:
        console.put(text(diagnosis))
        if output and written is None:
            torn = diagnosis.mistake is not None and diagnosis.mistake.torn
            why = "the readings may be wrong instead" if torn else "there is no effect to add to the model"
            console.say(f"no machine file was written: {why}")
    return ExitCode.FINDINGS if check and diagnosis.verdict != NOTHING else ExitCode.DONE


def _write_next(diagnosis: Diagnosis, target: OutputTarget) -> None:
    from ncfix.measure.measurement import dumps
    from ncfix.measure.plan import skeleton

    if diagnosis.proposal is None or diagnosis.proposal.plan is None:
        console.say("no further poses are proposed")
        return
    plan = diagnosis.proposal.plan
    table = target.path.endswith(".csv")
    target.write((dumps(plan, ("dx", "dy", "dz")) if table else skeleton(plan, diagnosis.data.machine)).encode())
