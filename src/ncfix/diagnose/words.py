"""A diagnosis in words."""

from __future__ import annotations

from ncfix.diagnose.addition import Moved
from ncfix.diagnose.carriers import carriers, conditions
from ncfix.diagnose.findings import Diagnosis, Finding
from ncfix.diagnose.next_poses import Proposal
from ncfix.diagnose.verdict import AMBIGUOUS, FOUND, NOTHING, UNKNOWN

SAID = {
    NOTHING: "nothing is missing that stands out of the noise",
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
        lines += [f"  {said}" for said in (constants(finding), odd(finding), carried(found, finding)) if said]
    if found.unknown_um:
        lines += ["", rest(found)]
    if found.patterns:
        lines += ["", "where:", *(f"  {p.text}, {p.rms_um:.1f} um rms" for p in found.patterns)]
    if found.moved:
        lines += ["", "constants of the machine file that the data put elsewhere (the gap before is after that):"]
        lines += [f"  {constant(each)}" for each in found.moved]
    lines += _next(found)
    if found.case.outlying.any():
        lines += ["", f"{int(found.case.outlying.sum())} rows put aside as outliers (--json lists them)"]
    return "\n".join(lines) + "\n"


def constant(moved: Moved) -> str:
    """A constant of the file, and what the data say."""
    factor, unit = moved.unit
    file, data, sigma = (factor * value for value in (moved.file, moved.data, moved.sigma))
    return f"{moved.name}: {file:.4g} in the file, {data:.4g} +- {sigma:.2g} {unit} by the data"


def constants(finding: Finding) -> str:
    """The largest error of the joint beside what machines have."""
    judged = finding.judgement
    if judged is None:
        return ""
    size, bounds = judged.largest, judged.bounds
    usual = [f"{bound:g} {unit}" for bound, unit in zip(bounds or (), ("um", "urad"), strict=False) if bound]
    limit = f" (machines have up to {', '.join(usual)})" if usual else ""
    return f"the joint's own error reaches {size[0]:.1f} um and {size[1]:.1f} urad where it was measured{limit}"


def odd(finding: Finding) -> str:
    """What is odd about the constants."""
    return (
        f"hardly plausible: {'; '.join(finding.judgement.remarks)}"
        if finding.judgement and finding.judgement.remarks
        else ""
    )


def carried(found: Diagnosis, finding: Finding) -> str:
    """Which targets can carry the effect."""
    machine = found.view.machine
    named = ", ".join(carriers(machine, finding.effects))
    given = ", ".join(conditions(machine, finding.effects))
    return f"can be carried by {named}" + (f", with {given} stated" if given else "") if named else ""


def rest(found: Diagnosis) -> str:
    """What has no name; and that it decides nothing, where it does not."""
    said = f"without a name: {found.unknown_um:.1f} um rms of {found.rest.kind}"
    if found.verdict == UNKNOWN:
        return said
    why = "no more than one value's noise, and without repeats it may be the part's or the instrument's"
    return f"{said} ({why if found.floor.source == 'neighbours' else 'too little to decide'})"


def _next(found: Diagnosis) -> list[str]:
    """What to measure next, or that nothing of this kind would help."""
    p = found.proposal
    if p is None:
        return []
    if p.plan is None:
        alike = ", ".join((p.name, *p.rivals))
        return ["", f"{alike}: {p.reason}; no measurement of this kind would tell them apart"]
    poses = (
        f"{len(p.plan)} more poses raise what tells them apart from {p.before:.1f} to {p.after:.1f} squared noise units"
    )
    return [
        "",
        f"to tell {p.name} from {', '.join(p.rivals)} ({p.reason}): {poses}{beyond(p)}; --next FILE writes them",
    ]


def beyond(proposal: Proposal) -> str:
    """That poses lie where nothing was measured yet."""
    if not proposal.beyond:
        return ""
    return f", {', '.join(proposal.beyond)} beyond the travels measured so far (within those, none would)"


def why(found: Diagnosis, finding: Finding) -> str:
    """One sentence on why this name."""
    name = finding.candidate.name
    said = f"{finding.size_um:.1f} um rms, log odds {finding.odds:.0f} (p = {finding.p_value:.1g})"
    runners = found.selected.runners.get(name, {})
    if not runners:
        return said
    best = max(runners, key=lambda each: runners[each])
    return f"{said}; next best of {len(found.case.considered)}: {best}, {finding.odds - runners[best]:.0f} less"
