"""Report content for a diagnosis: verdict, effects with their curves and rivals, residuals before and after."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.diagnosis.compound import EffectFinding
from ncfix.diagnosis.diagnosis import NOTHING, Diagnosis
from ncfix.diagnosis.ladder import in_words, ladder
from ncfix.diagnosis.presentation import (
    HEAD,
    NOISE,
    carried,
    constant,
    constants,
    held,
    hope,
    hopeless,
    odd,
    rest,
    silence,
    unusual,
    verdict,
    why,
)
from ncfix.machine import Effect
from ncfix.machine.basis import Periodic
from ncfix.machine.effects import with_unit
from ncfix.reports.document import ArrowMap, Bars, Document, Dots, Line, Paragraph, Part, Plot, ReportSection, Table
from ncfix.values import frozen

HOUR = 3600.0
CURVES = 4
"""Number of components of an effect that are drawn."""
MIN_SHOWN_PROBABILITY = 1e-99
"""Smallest probability that is shown as a number."""
RUNNERS = 6
"""Number of runners-up that are shown."""
PLACES, ROWS_LEAST = 15, 6
"""Largest number of points of a measured curve, and smallest number of rows averaged for each."""
MAIN = 0.5
"""Size, relative to the largest component, from which on a component is drawn."""
EXTREME = 0.995
"""Share of residuals within the limits of a plot; the others are drawn at its edge."""


def document(diagnosis: Diagnosis) -> Document:
    """The whole report."""
    sections = [
        _verdict(diagnosis),
        *(_finding(diagnosis, each) for each in diagnosis.findings),
        _where(diagnosis),
        _residuals(diagnosis),
    ]
    sections += [_next(diagnosis), _unseen(diagnosis)]
    title = f"Diagnosis of {diagnosis.data.machine.name}"
    return Document(title, [section for section in sections if section.parts])


def _verdict(diagnosis: Diagnosis) -> ReportSection:
    gap = diagnosis.gap
    rows = [
        ("all rows", f"{gap.before:.2f}", f"{gap.after:.2f}", f"{gap.floor:.2f}"),
        ("poses held out", f"{gap.holdout_before:.2f}", f"{gap.holdout_after:.2f}", f"{gap.floor:.2f}"),
    ]
    files = ", ".join(dict.fromkeys(each.path for each in diagnosis.data.measurements))
    noise = f"noise {diagnosis.floor.sigma_um:.2f} um a value, {NOISE[diagnosis.floor.source]}"
    parts: list[Part] = [
        Paragraph(f"{diagnosis.verdict}: {verdict(diagnosis)}."),
        *_waterfall(diagnosis),
        Paragraph(f"{diagnosis.data.count} rows of {files}; {noise}."),
        Table(("gap, um rms", "before", "after", "noise"), rows),
    ]
    if diagnosis.unknown_um:
        parts.append(Paragraph(f"{rest(diagnosis).capitalize()}."))
    parts += [
        Paragraph(f"{each[0].upper()}{each[1:]}.")
        for each in (silence(diagnosis) if diagnosis.verdict == NOTHING else [])
    ]
    return ReportSection("Verdict", [*parts, *_chances(diagnosis), *_moved(diagnosis)])


def _waterfall(diagnosis: Diagnosis) -> Iterator[Part]:
    """What each rung of the ladder leaves, as bars and as a table."""
    rungs = ladder(diagnosis)
    caption = "Residual below each rung, um rms, with the set-up fitted."
    yield Bars(caption, [rung.name for rung in rungs], [rung.left_um for rung in rungs])
    yield Table(HEAD, in_words(rungs))


def _chances(diagnosis: Diagnosis) -> Iterator[Part]:
    """Whether the gap is larger than noise explains."""
    if diagnosis.p_lack is None or diagnosis.p_left is None:
        yield Paragraph(
            "Whether the residual exceeds the noise is not known: there are no repeats and no stated noise."
        )
        return
    before, after = _chance(diagnosis.p_lack), _chance(diagnosis.p_left)
    yield Paragraph(f"Noise alone would give a gap as large as before with {before}, as after with {after}.")


def _chance(p: float) -> str:
    return f"p {'=' if p > MIN_SHOWN_PROBABILITY else 'below'} {max(p, MIN_SHOWN_PROBABILITY):.1g}"


def _moved(diagnosis: Diagnosis) -> Iterator[Part]:
    """Constants of the machine file (positions of axes, gains) that the data contradict."""
    if diagnosis.moved:
        yield Paragraph(
            "Constants of the machine file with another value by the data (the gap before is with that value):"
        )
        yield Table((), [(constant(each),) for each in diagnosis.moved])
        yield from (Paragraph(f"{each[0].upper()}{each[1:]}.") for each in held(diagnosis))


def _finding(diagnosis: Diagnosis, finding: EffectFinding) -> ReportSection:
    candidate = finding.candidate
    parts: list[Part] = [Paragraph(f"{candidate.title}. {why(diagnosis, finding)}.")]
    if finding.aliases:
        parts.append(Paragraph(f"These explain the data equally well: {', '.join(finding.aliases)}."))
    if candidate.remedy:
        parts.append(Paragraph(f"Remedy: {candidate.remedy}."))
    parts += [
        Paragraph(f"{said.capitalize()}.")
        for said in (constants(finding), odd(finding), carried(diagnosis, finding))
        if said
    ]
    return ReportSection(
        candidate.name,
        [
            *parts,
            *(curve.plot for curve in measured_curves(diagnosis, finding)),
            *_curve(diagnosis, finding),
            *_folded(diagnosis, finding),
            *_runners(diagnosis, finding),
        ],
    )


@frozen(slots=False)
class MeasuredCurve:
    """Measured values compared with an effect, as means of neighbouring rows.

    title      the effect, and the direction of motion if it depends on that
    component  the measured component; `over`: the quantity on x (k,), with its unit
    measured   (k,) um, with all other effects removed; `spread`: two standard errors of it
    model      (k,) um, means over the same rows
    """

    title: str
    component: str
    over: str
    x: Array
    measured: Array
    spread: Array
    model: Array

    @property
    def plot(self) -> Plot:
        """The curve as a plot of the report."""
        caption = (
            f"{self.title}: {self.component}, um over {self.over}, all other effects removed; means of neighbouring "
            "rows, band: two standard errors of the measured means"
        )
        drawn = [Line(self.x, self.measured, self.spread, "measured"), Line(self.x, self.model, None, "model")]
        return Plot(caption, drawn)


def measured_curves(diagnosis: Diagnosis, finding: EffectFinding) -> Iterator[MeasuredCurve]:
    """Curves of the components in which an effect shows most, over what it depends on, by direction of motion."""
    found = _depends_on(diagnosis, finding)
    if found is None or not finding.shown.any():
        return
    (over, place), data = found, diagnosis.data
    names, rows = np.array(data.names), np.maximum(data.row, 0)
    sizes = {name: float(np.linalg.norm(finding.shown[names == name])) for name in dict.fromkeys(names.tolist())}
    for component in [name for name, size in sizes.items() if size >= MAIN * max(sizes.values())]:
        for said, there in _ways(diagnosis, finding):
            own = np.flatnonzero((names == component) & diagnosis.case.kept & there[rows])
            own = own[np.argsort(place[rows[own]], kind="stable")]
            count = min(PLACES, len(own) // ROWS_LEAST)
            if count < 3:
                continue
            parts = np.array_split(own, count)
            values = diagnosis.after + finding.shown
            yield MeasuredCurve(
                finding.candidate.name + said, component, over,
                np.array([place[rows[part]].mean() for part in parts]),
                np.array([values[part].mean() for part in parts]),
                np.array([2 * diagnosis.after[part].std(ddof=1) / np.sqrt(len(part)) for part in parts]),
                np.array([finding.shown[part].mean() for part in parts]),
            )  # fmt: skip


def _depends_on(diagnosis: Diagnosis, finding: EffectFinding) -> tuple[str, Array] | None:
    """What an effect depends on, with its unit, and the value in each row; None if neither an axis nor the time."""
    data = diagnosis.data
    signals = [effect.signal or "" for effect in finding.effects] + [finding.candidate.axis]
    if any(signal.startswith(("temp_", "time_s")) for signal in signals):
        time = data.column("time_s")
        return ("time, h", (time - time.min()) / HOUR) if np.ptp(time) > 0 else None
    axis = next((axis for signal in signals if (axis := data.machine.axis(signal)) is not None), None)
    if axis is None or not data.measured.moved(axis):
        return None
    return with_unit(data.machine, axis.name), data.q[:, data.machine.axis_names.index(axis.name)] / axis.unit


def _ways(diagnosis: Diagnosis, finding: EffectFinding) -> Iterator[tuple[str, Mask]]:
    """Words and rows of each direction of approach, if the effect depends on that; else all rows."""
    data, axis = diagnosis.data, finding.candidate.axis
    side = data.column(f"dir_{axis}") if axis else np.zeros(data.count)
    if any(effect.basis.needs_direction for effect in finding.effects) and np.ptp(side) > 0:
        yield f", {axis} moving towards plus", side > 0
        yield f", {axis} moving towards minus", side < 0
    else:
        yield "", np.ones(data.count, dtype=bool)


def _runners(diagnosis: Diagnosis, finding: EffectFinding) -> Iterator[Part]:
    """The runners-up of an effect, by their evidence."""
    runners_up = diagnosis.selected.runners_up.get(finding.candidate.name, {})
    if runners_up:
        best = sorted(runners_up, key=lambda each: -runners_up[each])[:RUNNERS]
        rows = [(finding.candidate.name, f"{finding.odds:.1f}"), *((each, f"{runners_up[each]:.1f}") for each in best)]
        yield Paragraph(f"Evidence, log odds, best of {diagnosis.case.considered} (3 less is 20 times less likely):")
        yield Table(("name", "log odds"), rows)


def _curve(diagnosis: Diagnosis, finding: EffectFinding) -> Iterator[Part]:
    """Every component over its axis, with a band of two standard deviations; for thermal effects, also over time."""
    for effect in finding.effects[:CURVES]:
        yield from _component(diagnosis, effect)
    if any((effect.signal or "").startswith(("temp_", "time_s")) for effect in finding.effects):
        names = np.array(diagnosis.data.names)
        shown = {
            each: np.where(names == each, finding.shown, np.nan) for each in dict.fromkeys(names[diagnosis.case.kept])
        }
        yield from _in_time(diagnosis, "what it shows, um", shown)


def _component(diagnosis: Diagnosis, effect: Effect) -> Iterator[Part]:
    span = diagnosis.data.measured.spans.get(effect.signal or "")
    if effect.covariance is None or effect.times is not None or span is None:
        return
    x = np.linspace(*span, 121)
    design = effect.basis.design((x - effect.center) / effect.scale, 1.0)
    variance = np.einsum("nk,kl,nl->n", design, np.asarray(effect.covariance), design)
    factor, unit = (1e6, "urad") if effect.rotational else (1e3, "um")
    value = factor * (design @ np.asarray(effect.coefficients))
    over = with_unit(diagnosis.data.machine, effect.signal or "")
    caption = f"{effect.name}, {unit} over {over}; band: two standard deviations"
    yield Plot(caption, [Line(x, value, 2 * factor * np.sqrt(np.maximum(variance, 0.0)))])


def _where(diagnosis: Diagnosis) -> ReportSection:
    rows = [
        (
            pattern.text,
            f"{pattern.rms_um:.1f}",
            f"{pattern.p_value:.1g}"
            if pattern.p_value > MIN_SHOWN_PROBABILITY
            else f"less than {MIN_SHOWN_PROBABILITY:g}",
        )
        for pattern in diagnosis.patterns
    ]
    return ReportSection("Where", [Table(("pattern", "um rms", "p by chance"), rows)] if rows else [])


def _residuals(diagnosis: Diagnosis) -> ReportSection:
    return ReportSection("Residuals before and after", [*_arrows(diagnosis), *_maps(diagnosis)])


def _arrows(diagnosis: Diagnosis) -> Iterator[Part]:
    """Residual tip displacements as arrows in each plane of linear axes, before and after."""
    data, names = diagnosis.data, np.array(diagnosis.data.names)
    letters = [axis.name for axis in data.measured.linear if axis.name in "XYZ"]
    for first, second in combinations(letters, 2):
        parts = [np.flatnonzero((names == f"d{each.lower()}") & diagnosis.case.kept) for each in (first, second)]
        rows = np.intersect1d(data.row[parts[0]], data.row[parts[1]])
        if not len(rows):
            continue
        at = np.stack([own[np.searchsorted(data.row[own], rows)] for own in parts], axis=1)
        x, y = (data.q[rows, data.machine.axis_names.index(each)] for each in (first, second))
        shifts = {"before": diagnosis.before[at], "after": diagnosis.after[at]}
        caption = f"Measured minus modelled values in the plane of {first} and {second}, {len(rows)} poses."
        yield ArrowMap(caption, f"{first}, mm", f"{second}, mm", x, y, shifts, "um")


def _folded(diagnosis: Diagnosis, finding: EffectFinding) -> Iterator[Part]:
    """The residuals without a cyclic error over one pitch, all turns of the screw superposed."""
    waves = [effect for effect in finding.effects if isinstance(effect.basis, Periodic) and effect.times is None]
    axis = diagnosis.data.machine.axis(finding.candidate.axis)
    if not waves or axis is None:
        return
    [wave, *_], data = waves, diagnosis.data
    assert isinstance(wave.basis, Periodic)
    own = np.abs(finding.shown) > 0
    own &= diagnosis.case.kept
    place = data.q[data.row[own], data.machine.axis_names.index(axis.name)] / axis.unit
    phase, rest = np.mod(place, wave.basis.period), (diagnosis.after + finding.shown)[own]
    caption = f"um over {axis.name}, mm, folded by the pitch of {wave.basis.period:g} mm: all other effects removed"
    yield Plot(caption, [Dots(phase, rest, "measured"), Dots(phase, finding.shown[own], "model")])


def _maps(diagnosis: Diagnosis) -> Iterator[Part]:
    """Residuals of all components over each axis that moved."""
    data = diagnosis.data
    inside, every = diagnosis.case.kept, {"before": diagnosis.before, "after": diagnosis.after}
    sides = {label: values[inside] for label, values in every.items()}
    if not inside.any():
        return
    limit = float(np.quantile(np.abs(sides["before"]), EXTREME)) or 1.0
    for index, axis in enumerate(data.machine.axes):
        if data.measured.moved(axis):
            x = data.q[data.row[inside], index] / axis.unit
            dots = [Dots(x, np.clip(values, -limit, limit), label) for label, values in sides.items()]
            yield Plot(f"um over {with_unit(data.machine, axis.name)}", dots)
    yield from _in_time(diagnosis, "um", {label: np.clip(each, -limit, limit) for label, each in every.items()})


def _in_time(diagnosis: Diagnosis, what: str, values: Mapping[str, Array]) -> Iterator[Part]:
    """Values (m,) over time; nothing if the measurement has no times."""
    time = diagnosis.data.column("time_s")
    if np.ptp(time) > 0:
        kept = diagnosis.case.kept
        hours = (time - time.min()) / HOUR
        known = {label: kept & np.isfinite(each) for label, each in values.items()}
        dots = [Dots(hours[diagnosis.data.row[at]], values[label][at], label) for label, at in known.items()]
        yield Plot(f"{what}, over time, h", dots)


def _next(diagnosis: Diagnosis) -> ReportSection:
    proposal = diagnosis.proposal
    if proposal is None:
        return ReportSection("To distinguish the names", [])
    head = Paragraph(f"{', '.join((proposal.name, *proposal.alternatives))}: {proposal.reason}.")
    if proposal.plan is None:
        words = "No measurement of this kind within the travels of the machine distinguishes them."
        return ReportSection("To distinguish the names", [head, Paragraph(words)])
    names = [name for name in proposal.plan.columns if not name.startswith(("temp_", "time_s"))]
    rows = [[f"{proposal.plan.columns[name][k]:g}" for name in names] for k in range(len(proposal.plan))]
    said = [
        Paragraph(f"{each[0].upper()}{each[1:]}.")
        for each in (hope(proposal), unusual(proposal), hopeless(proposal))
        if each
    ]
    return ReportSection("To distinguish the names", [head, *said, Table(names, rows)])


def _unseen(diagnosis: Diagnosis) -> ReportSection:
    names = ", ".join(name for name, _ in diagnosis.case.invisible)
    count = int(diagnosis.case.outlying.sum())
    parts = [Paragraph(f"These poses cannot show: {names}.")] if names else []
    if count:
        parts.append(Paragraph(f"{count} rows were excluded as outliers; --json lists them."))
    return ReportSection("What was not considered", parts)
