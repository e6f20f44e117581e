"""A diagnosis in words."""

from __future__ import annotations

from ncfix.diagnose.diagnosis import AMBIGUOUS, FOUND, NOTHING, UNKNOWN, Diagnosis, Finding

SAID = {
    NOTHING: "nothing is missing: model and measurement agree within the noise",
    FOUND: "the model lacks something that has a name",
    AMBIGUOUS: "the model lacks something, and these data leave more than one name for it",
    UNKNOWN: "the model lacks something that is not in the catalogue",
}


def text(found: Diagnosis) -> str:
    """The report for a terminal."""
    gap = found.gap
    lines = [
        f"verdict: {found.verdict}: {SAID[found.verdict]}",
        f"gap: {gap.before:.2f} um before, {gap.after:.2f} um after, noise {gap.floor:.2f} um ({found.floor.source}); "
        f"held out: {gap.holdout_before:.2f} -> {gap.holdout_after:.2f} um",
    ]
    for finding in found.findings:
        lines += ["", f"{finding.candidate.name}: {finding.candidate.title}", f"  {why(found, finding)}"]
        if finding.aliases:
            lines.append(f"  as likely: {', '.join(finding.aliases)}")
    if found.unknown_um:
        lines += ["", f"unknown: {found.unknown_um:.1f} um of {found.unknown_kind}"]
    if found.patterns:
        lines += ["", "where:", *(f"  {p.text}, {p.rms_um:.1f} um rms" for p in found.patterns)]
    lines += _next(found)
    if found.outlying.any():
        lines += ["", f"{int(found.outlying.sum())} rows put aside as outliers (--json lists them)"]
    return "\n".join(lines) + "\n"


def _next(found: Diagnosis) -> list[str]:
    """What to measure next, or that nothing of this kind would help."""
    p = found.proposal
    if p is None:
        return []
    if p.plan is None:
        return ["", f"{', '.join(p.rivals)}: {p.reason}; no measurement of this kind would tell them apart"]
    poses = (
        f"{len(p.plan)} more poses raise what tells them apart from {p.before:.1f} to {p.after:.1f} squared noise units"
    )
    return ["", f"to tell it from {', '.join(p.rivals)} ({p.reason}): {poses}; --next FILE writes them"]


def why(found: Diagnosis, finding: Finding) -> str:
    """One sentence on why this name."""
    name = finding.candidate.name
    said = f"{finding.size_um:.1f} um rms, log odds {finding.odds:.0f} (p = {finding.p_value:.1g})"
    runners = found.selected.runners.get(name, {}) if found.selected else {}
    if not runners:
        return said
    best = max(runners, key=lambda each: runners[each])
    return f"{said}; next best of {len(found.considered)}: {best}, {finding.odds - runners[best]:.0f} less"
