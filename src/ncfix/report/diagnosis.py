"""The report of a diagnosis as one HTML page: figures are inline SVG, nothing is loaded from elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

import numpy as np

from ncfix.diagnose.diagnosis import Diagnosis, Finding
from ncfix.diagnose.words import SAID, why
from ncfix.measure.measurement import Array

WIDTH, HEIGHT, EDGE = 560, 170, 34
STYLE = (
    "body{font:15px/1.45 sans-serif;max-width:60em;margin:2em auto;color:#222}table{border-collapse:collapse}"
    "td,th{padding:.2em .8em;border-bottom:1px solid #ccc;text-align:left}svg{background:#fafafa;margin:.3em 0}"
)
BEFORE, AFTER = "#b5452c", "#2c6fb5"


def page(found: Diagnosis) -> str:
    """The whole page."""
    parts = [_head(found), *(_finding(found, each) for each in found.findings), _unknown(found), _where(found)]
    parts += [_maps(found), _next(found), _invisible(found), _outliers(found)]
    title = escape(f"Diagnosis of {found.view.machine.name}")
    body = "\n".join(part for part in parts if part)
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title><style>{STYLE}</style>'
        f"<h1>{title}</h1>\n{body}\n</html>\n"
    )


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{head}</tr>{body}</table>"


def _head(found: Diagnosis) -> str:
    gap = found.gap
    rows = [
        ("all rows", f"{gap.before:.2f}", f"{gap.after:.2f}", f"{gap.floor:.2f}"),
        ("poses held out", f"{gap.holdout_before:.2f}", f"{gap.holdout_after:.2f}", f"{gap.floor:.2f}"),
    ]
    files = ", ".join(dict.fromkeys(each.path for each in found.view.measurements))
    said = f"<p><b>{found.verdict}</b>: {SAID[found.verdict]}.</p><p>{found.view.count} rows of {escape(files)}; "
    noise = f"noise {found.floor.sigma_um:.2f} um a value, from {found.floor.source}.</p>"
    return said + noise + _table(("gap, um rms", "before", "after", "noise"), rows)


def _finding(found: Diagnosis, finding: Finding) -> str:
    name = finding.candidate.name
    lines = [f"<h2>{escape(name)}</h2><p>{escape(finding.candidate.title)}. {escape(why(found, finding))}.</p>"]
    if finding.aliases:
        lines.append(f"<p>As likely with these data: {escape(', '.join(finding.aliases))}.</p>")
    if finding.candidate.remedy:
        lines.append(f"<p>Remedy: {escape(finding.candidate.remedy)}.</p>")
    curve = _curve(found, finding)
    if curve:
        lines.append(curve)
    runners = found.selected.runners.get(name, {}) if found.selected else {}
    if runners:
        best = sorted(runners, key=lambda each: -runners[each])[:6]
        rows = [(name, f"{finding.odds:.1f}"), *((each, f"{runners[each]:.1f}") for each in best)]
        lines.append(
            f"<p>Evidence, log odds, best of {len(found.considered)}:</p>" + _table(("name", "log odds"), rows)
        )
    return "\n".join(lines)


def _curve(found: Diagnosis, finding: Finding) -> str:
    """The first component over its axis, with a band of two standard deviations."""
    effect = next(iter(finding.effects), None)
    if effect is None or effect.covariance is None or effect.signal is None:
        return ""
    if effect.signal not in found.view.reach.spans:
        return ""
    low, high = found.view.reach.spans[effect.signal]
    x = np.linspace(low, high, 121)
    design = effect.basis.design((x - effect.center) / effect.scale, 1.0)
    value = design @ np.asarray(effect.coefficients)
    deviation = np.sqrt(np.maximum(np.einsum("nk,kl,nl->n", design, np.asarray(effect.covariance), design), 0.0))
    factor, unit = (1e6, "urad") if effect.rotational else (1e3, "um")
    top, bottom = factor * (value + 2 * deviation), factor * (value - 2 * deviation)
    frame = Frame((low, high), (float(bottom.min()), float(top.max())))
    band = " ".join([*frame.points(x, top), *reversed(frame.points(x, bottom))])
    line = " ".join(frame.points(x, factor * value))
    area = f'<polygon points="{band}" fill="{AFTER}" opacity=".2"/>'
    inside = area + f'<polyline points="{line}" fill="none" stroke="{AFTER}"/>'
    return frame.drawn(inside, f"{effect.name}, {unit}, over {effect.signal}; band: two standard deviations")


class Frame:
    """A plot's axes: from data to places on the page."""

    def __init__(self, across: tuple[float, float], up: tuple[float, float]) -> None:
        self.across, self.up = across, up

    def points(self, x: Array, y: Array) -> list[str]:
        """Places as SVG has them."""
        left, right = self.across
        low, high = self.up
        px = EDGE + (WIDTH - 2 * EDGE) * (x - left) / max(right - left, 1e-12)
        py = HEIGHT - EDGE - (HEIGHT - 2 * EDGE) * (y - low) / max(high - low, 1e-12)
        return [f"{a:.1f},{b:.1f}" for a, b in zip(px.tolist(), py.tolist(), strict=True)]

    def drawn(self, inside: str, caption: str) -> str:
        """The figure with its scale."""
        labels = (
            f'<text x="2" y="{EDGE}" font-size="11">{self.up[1]:.3g}</text>'
            f'<text x="2" y="{HEIGHT - EDGE}" font-size="11">{self.up[0]:.3g}</text>'
            f'<text x="{EDGE}" y="{HEIGHT - 12}" font-size="11">{self.across[0]:.4g}</text>'
            f'<text x="{WIDTH - 2 * EDGE}" y="{HEIGHT - 12}" font-size="11">{self.across[1]:.4g}</text>'
        )
        return f'<p>{escape(caption)}</p><svg width="{WIDTH}" height="{HEIGHT}">{inside}{labels}</svg>'


def _maps(found: Diagnosis) -> str:
    return "<h2>Residuals before and after</h2>" + "".join(_map(found))


def _map(found: Diagnosis) -> Iterator[str]:
    """Residuals of all components over each axis that moved: before in red, after in blue."""
    view = found.view
    inside = (view.row >= 0) & ~found.outlying[np.maximum(view.row, 0)]
    before, after = found.before[inside], found.after[inside]
    if not len(before):
        return
    limit = float(np.quantile(np.abs(before), 0.995)) or 1.0
    for index, axis in enumerate(view.machine.axes):
        if view.reach.moved(axis):
            frame = Frame(view.reach.spans[axis.name], (-limit, limit))
            x = view.q[view.row[inside], index] / axis.unit
            dots = ""
            for values, colour in ((before, BEFORE), (after, AFTER)):
                for place in frame.points(x, np.clip(values, -limit, limit)):
                    a, b = place.split(",")
                    dots += f'<circle cx="{a}" cy="{b}" r="1.5" fill="{colour}" opacity=".5"/>'
            yield frame.drawn(dots, f"um over {axis.name}: before (red), after (blue)")


def _unknown(found: Diagnosis) -> str:
    return (
        f"<p>Without a name: {found.unknown_um:.1f} um rms, {escape(found.unknown_kind)}.</p>"
        if found.unknown_um
        else ""
    )


def _where(found: Diagnosis) -> str:
    rows = [(p.text, f"{p.rms_um:.1f}", f"{p.p_value:.1g}") for p in found.patterns]
    return "<h2>Where</h2>" + _table(("pattern", "um rms", "p by chance"), rows) if rows else ""


def _next(found: Diagnosis) -> str:
    p = found.proposal
    if p is None:
        return ""
    head = f"<h2>To tell names apart</h2><p>{escape(', '.join(p.rivals))}: {escape(p.reason)}.</p>"
    if p.plan is None:
        return head + "<p>No measurement of this kind within the same travels would tell them apart.</p>"
    names = [name for name in p.plan.columns if not name.startswith(("temp_", "time_s"))]
    rows = [[f"{p.plan.columns[name][k]:g}" for name in names] for k in range(len(p.plan))]
    return head + "<p>These poses would:</p>" + _table(names, rows)


def _invisible(found: Diagnosis) -> str:
    names = ", ".join(candidate.name for candidate, _ in found.gathered.invisible)
    return f"<h2>Not visible with these poses</h2><p>{escape(names)}</p>" if names else ""


def _outliers(found: Diagnosis) -> str:
    count = int(found.outlying.sum())
    return f"<p>{count} rows were put aside as outliers; --json lists them.</p>" if count else ""
