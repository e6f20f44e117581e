"""A diagnosis as a text report and as a JSON object, and its machine with provenance."""

from __future__ import annotations

import datetime
from itertools import compress
from typing import Any

import numpy as np

from ncfix.diagnosis.assessment import carriers, conditions
from ncfix.diagnosis.compound import EffectFinding
from ncfix.diagnosis.constants import MovedConstant, names_of
from ncfix.diagnosis.diagnosis import AMBIGUOUS, FOUND, LACKING, NOTHING, UNKNOWN, Diagnosis
from ncfix.diagnosis.ladder import in_words, ladder
from ncfix.diagnosis.next_poses import Proposal, as_objects
from ncfix.diagnosis.selection import findable_in_words, shows_hardly_anything
from ncfix.machine import Machine
from ncfix.measure.calibrate import untold

HEAD = ("rung", "residual, um", "held out", "share", "log odds", "found")
"""Headings of the table of the ladder."""
LEAST_P = 1e-300
"""Smallest probability that is printed."""
SHOWN = 0.05
"""Smallest error that is printed, um or urad."""
NEARLY = 0.925
"""Chances above this are called nearly sure; others are rounded to five in a hundred."""
SAID = {
    NOTHING: "the model lacks nothing that exceeds the noise",
    FOUND: "the model lacks effects that could be named",
    AMBIGUOUS: "the model lacks an effect, and these data agree with more than one name for it",
    UNKNOWN: "the model lacks an effect that is not in the catalogue",
}
MISTAKEN = "a mistake in the software, the files or the set-up explains the data"
CHANGED = {
    NOTHING: "nothing has changed that exceeds the noise",
    FOUND: "the changes could be named",
    AMBIGUOUS: "something has changed, and these data agree with more than one name for it",
    UNKNOWN: "something has changed that is not in the catalogue",
}
"""Verdicts of a comparison of two dates."""
NOISE = {
    "repeats": "from repeats",
    "given": "as stated in the files",
    "neighbours": "estimated from neighbouring poses",
}
"""Source of the noise, in words."""


def text(diagnosis: Diagnosis) -> str:
    """The report for a terminal."""
    gap = diagnosis.gap
    lines = [
        f"verdict: {diagnosis.verdict}: {verdict(diagnosis)}",
        f"gap: {gap.before:.2f} um before, {gap.after:.2f} um after, noise {gap.floor:.2f} um "
        f"({NOISE[diagnosis.floor.source]}); held out: {gap.holdout_before:.2f} -> {gap.holdout_after:.2f} um",
    ]
    lines += ["", *_table(diagnosis), *noise(diagnosis)]
    if diagnosis.steady:
        lines += ["", f"present before, and unchanged: {', '.join(diagnosis.steady)}"]
    for finding in diagnosis.findings:
        lines += ["", f"{finding.candidate.name}: {finding.candidate.title}", f"  {why(diagnosis, finding)}"]
        if finding.aliases:
            lines.append(f"  these explain the data equally well: {', '.join(finding.aliases)}")
        if diagnosis.mistake and diagnosis.mistake.remedy and finding is diagnosis.findings[0]:
            lines.append(f"  {diagnosis.mistake.remedy}")
        lines += [f"  {said}" for said in (constants(finding), odd(finding), carried(diagnosis, finding)) if said]
    if diagnosis.unknown_um:
        lines += ["", rest(diagnosis)]
    if diagnosis.patterns:
        lines += [
            "",
            "where machine file and data disagree most:",
            *(f"  {p.text}, {p.rms_um:.1f} um rms" for p in diagnosis.patterns),
        ]
    if diagnosis.moved:
        lines += [
            "",
            "constants of the machine file with another value by the data (the gap before is with that value):",
        ]
        lines += [f"  {constant(each)}" for each in diagnosis.moved]
        lines += [f"  {each}" for each in held(diagnosis)]
    if diagnosis.verdict == NOTHING:
        lines += ["", *silence(diagnosis)]
    lines += _next(diagnosis)
    aside = int(diagnosis.case.outlying.sum())
    if aside:
        said = "1 row excluded as an outlier (--json lists it)"
        lines += ["", said if aside == 1 else f"{aside} rows excluded as outliers (--json lists them)"]
    return "\n".join(lines) + "\n"


def _table(diagnosis: Diagnosis) -> list[str]:
    """The ladder as a table."""
    rows = [HEAD, *in_words(ladder(diagnosis))]
    width = [max(len(row[k]) for row in rows) for k in range(len(HEAD))]
    cells = [
        [cell.ljust(w) if k in (0, 5) else cell.rjust(w) for k, (cell, w) in enumerate(zip(row, width, strict=True))]
        for row in rows
    ]
    return ["  ".join(row).rstrip() for row in cells]


def verdict(diagnosis: Diagnosis) -> str:
    """The verdict as a sentence."""
    if diagnosis.case.since:
        return CHANGED[diagnosis.verdict]
    if diagnosis.verdict == NOTHING and diagnosis.rest.lacking:
        return (
            f"the residual exceeds the noise (p = {diagnosis.p_left:.1g}), but only by the small errors that every "
            "machine has"
        )
    if diagnosis.mistake is None:
        return SAID[diagnosis.verdict]
    return (
        MISTAKEN
        if len(diagnosis.findings) == 1
        else f"{MISTAKEN} in part; when it is corrected, {SAID[diagnosis.verdict]}"
    )


def noise(diagnosis: Diagnosis) -> list[str]:
    """A line that the residual counts as noise, if it does."""
    p = diagnosis.p_left
    return (
        []
        if p is None or p < LACKING
        else [f"the residual counts as noise: noise alone gives as much with probability p = {p:.2g}"]
    )


def held(diagnosis: Diagnosis) -> list[str]:
    """Remarks on constants that the data cannot determine, as in `calibrate`."""
    labels = names_of(diagnosis.data.problem.selection)
    return [message.text for message in untold(diagnosis.constants.solution, labels)]


def silence(diagnosis: Diagnosis) -> list[str]:
    """What a result without findings means: the sizes from which effects would have been found."""
    count = diagnosis.case.considered
    few = shows_hardly_anything(diagnosis.findable, diagnosis.data.sizes)
    return [
        *(["these data can show hardly any effect"] if few else []),
        findable_in_words(diagnosis.findable, count, diagnosis.data.sizes),
    ]


def constant(moved: MovedConstant) -> str:
    """A constant of the file with its value by the data."""
    factor, unit = moved.unit
    file, data, sigma = (factor * value for value in (moved.file, moved.data, moved.sigma))
    return f"{moved.name}: {file:.4g} in the file, {data:.4g} +- {sigma:.2g} {unit} by the data"


def constants(finding: EffectFinding) -> str:
    """The largest error motion of the joint, with the plausible limit."""
    judged = finding.judgement
    if judged is None:
        return ""
    units = ("um", "urad")
    there = [size >= SHOWN for size in judged.largest]
    bounds = zip(judged.bounds or (0.0, 0.0), units, there, strict=True)
    usual = [f"{bound:g} {unit}" for bound, unit, shown in bounds if bound and shown]
    limit = f" (machines have up to {', '.join(usual)})" if usual else ""
    reached = [f"{size:.1f} {unit}" for size, unit in compress(zip(judged.largest, units, strict=True), there)]
    return f"the joint's own error reaches {' and '.join(reached)} where it was measured{limit}" if reached else ""


def odd(finding: EffectFinding) -> str:
    """Remarks on implausible coefficients; empty if there are none."""
    return (
        f"not plausible: {'; '.join(finding.judgement.remarks)}"
        if finding.judgement and finding.judgement.remarks
        else ""
    )


def carried(diagnosis: Diagnosis, finding: EffectFinding) -> str:
    """The targets that can correct the effect; empty if there are none."""
    machine = diagnosis.data.machine
    named = ", ".join(carriers(machine, finding.effects))
    given = ", ".join(conditions(machine, finding.effects))
    return f"can be corrected by {named}" + (f", with {given} stated" if given else "") if named else ""


def rest(diagnosis: Diagnosis) -> str:
    """The unnamed remainder, and why it does not affect the verdict if it does not."""
    said = f"without a name: {diagnosis.unknown_um:.1f} um rms, {diagnosis.rest.kind}"
    if diagnosis.verdict == UNKNOWN:
        return said
    why = "without repeats it may come from the part or the instrument"
    return f"{said} ({why if diagnosis.floor.source == 'neighbours' else 'too little to decide'})"


def _next(diagnosis: Diagnosis) -> list[str]:
    """What to measure next, or that no measurement of this kind would help."""
    p = diagnosis.proposal
    if p is None:
        return []
    if p.plan is None:
        alike = ", ".join((p.name, *p.alternatives))
        return ["", f"{alike}: {p.reason}; no measurement of this kind distinguishes them"]
    lines = [
        "",
        f"to distinguish {p.name} from {', '.join(p.alternatives)} ({p.reason}):",
        f"  {hope(p)}; --next FILE writes them",
    ]
    lines += [f"  {said}" for said in (unusual(p), hopeless(p)) if said]
    return lines


def hope(proposal: Proposal) -> str:
    """The chance that the proposed poses leave one name."""
    assert proposal.plan is not None
    said = f"{len(proposal.plan)} more poses leave only one name in {_of_hundred(proposal.chance)}"
    if proposal.stuck:
        return f"{said}; if the truth is {' or '.join(proposal.stuck)}, another name remains possible"
    if proposal.times == 1 or proposal.chance >= NEARLY:
        return said
    return f"{said}, and in nearly all cases if each is measured {proposal.times} times"


def _of_hundred(chance: float) -> str:
    return "nearly all cases" if chance >= NEARLY else f"{max(round(20 * chance) * 5, 5)} of 100 cases"


def unusual(proposal: Proposal) -> str:
    """Travels and tools that the proposed poses need beyond those used so far."""
    far = [*proposal.beyond, *(["the tool tip"] if proposal.strays else [])]
    said = [f"{', '.join(far)} beyond the travels measured so far"] if far else []
    if proposal.tools:
        lengths = " and ".join(f"{each:g} mm" for each in proposal.tools)
        said.append(f"a tool of {lengths}, or of another length that differs as much from those used")
    return f"the poses need {'; and '.join(said)}" if said else ""


def hopeless(proposal: Proposal) -> str:
    """Rivals that no pose on offer tells apart."""
    return f"{', '.join(proposal.alike)}: no measurement of this kind distinguishes that" if proposal.alike else ""


def why(diagnosis: Diagnosis, finding: EffectFinding) -> str:
    """Why this name was found: size, log odds, and the next best name."""
    name = finding.candidate.name
    chance = f"p at most {max(finding.p_value, LEAST_P):.1g}"
    said = f"{finding.size_um:.1f} um rms, log odds {finding.odds:.0f} ({chance})"
    runners_up = diagnosis.selected.runners_up.get(name, {})
    if not runners_up:
        return said
    best = max(runners_up, key=lambda each: runners_up[each])
    return f"{said}; next best of {diagnosis.case.considered} effects: {best}, log odds {runners_up[best]:.0f}"


def as_dict(diagnosis: Diagnosis, machine: str | None = None) -> dict[str, Any]:
    """The diagnosis as a JSON object; its fields are in docs/formats.md and docs/diagnose.md."""
    return {
        "verdict": diagnosis.verdict,
        "ladder": [
            {
                "rung": rung.name,
                "left_um": rung.left_um,
                "holdout_um": None if np.isnan(rung.holdout_um) else rung.holdout_um,
                "share": rung.share,
                "log_odds": None if np.isnan(rung.log_odds) else rung.log_odds,
                "found": list(rung.found),
            }
            for rung in ladder(diagnosis)
        ],
        "effects": [_effect(diagnosis, each) for each in diagnosis.findings],
        "unchanged": list(diagnosis.steady),
        "unknown": {"share_um": diagnosis.unknown_um, "where": diagnosis.rest.kind},
        "gap_um": {name: getattr(diagnosis.gap, name) for name in diagnosis.gap.__dataclass_fields__},
        "where": [{"text": p.text, "rms_um": p.rms_um, "p_value": p.p_value} for p in diagnosis.patterns],
        "next_measurements": as_objects(diagnosis.proposal.plan)
        if diagnosis.proposal and diagnosis.proposal.plan
        else [],
        "ambiguity": _ambiguity(diagnosis),
        "machine": machine,
        "noise": {
            "sigma_um": diagnosis.floor.sigma_um,
            "source": diagnosis.floor.source,
            "freedom": diagnosis.floor.freedom,
        },
        "lack_of_fit": {"before": diagnosis.p_lack, "after": diagnosis.p_left},
        "invisible": [{"name": name, "visible_share": share} for name, share in diagnosis.case.invisible],
        "findable_um": {name: size if np.isfinite(size) else None for name, size in diagnosis.findable.items()},
        "considered": diagnosis.case.considered,
        "outliers": _outliers(diagnosis),
        "constants": [
            {
                "name": m.name,
                "file": m.file,
                "data": m.data,
                "sigma": m.sigma,
                "log_odds": m.odds,
                "size_um": m.size_um,
                "aliases": list(m.aliases),
            }
            for m in diagnosis.moved
        ],
        "constants_together": {
            "chi_square": diagnosis.constants.distance,
            "freedom": diagnosis.constants.freedom,
            "p_value": diagnosis.constants.p_value,
            "log_odds": diagnosis.constants.odds,
            "size_um": diagnosis.constants.size_um,
        },
    }


def _effect(diagnosis: Diagnosis, finding: EffectFinding) -> dict[str, Any]:
    return {
        "name": finding.candidate.name,
        "title": finding.candidate.title,
        "axis": finding.candidate.axis or None,
        "why": why(diagnosis, finding),
        "size_um": finding.size_um,
        "coefficients": [
            {"name": each.name, "basis": each.basis.name, "labels": each.basis.labels, "values": each.coefficients}
            for each in finding.effects
        ],
        "sigma": [
            np.sqrt(np.maximum(np.diag(np.asarray(each.covariance)), 0.0)).tolist() if each.covariance else None
            for each in finding.effects
        ],
        "log_odds": finding.odds,
        "p_value": finding.p_value,
        "aliases": list(finding.aliases),
        "remedy": finding.candidate.remedy,
        "plausible": _plausible(finding),
        "targets": list(carriers(diagnosis.data.machine, finding.effects)),
        "conditions": list(conditions(diagnosis.data.machine, finding.effects)),
    }


def _plausible(finding: EffectFinding) -> dict[str, Any] | None:
    if finding.judgement is None:
        return None
    names, judged = ("um", "urad"), finding.judgement
    bounds = dict(zip(names, judged.bounds, strict=True)) if judged.bounds else None
    return {
        "is": judged.plausible,
        "largest": dict(zip(names, judged.largest, strict=True)),
        "bounds": bounds,
        "remarks": list(judged.remarks),
    }


def _ambiguity(diagnosis: Diagnosis) -> dict[str, Any] | None:
    if diagnosis.proposal is None:
        return None
    p = diagnosis.proposal
    return {
        "name": p.name,
        "rivals": p.alternatives,
        "reason": p.reason,
        "alike": p.alike,
        "stuck": p.stuck,
        "told_apart": {
            "now": p.before,
            "after": p.after,
            "chance": p.chance,
            "times_each": p.times if p.plan is not None else None,
        },
        "beyond_travels_measured": list(p.beyond),
        "tip_beyond": p.strays,
        "new_tool_lengths": list(p.tools),
    }


def _outliers(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    places, first = [], 0
    for each in diagnosis.data.measurements:
        for row in np.flatnonzero(diagnosis.case.outlying[first : first + len(each)]):
            place = each.place(int(row))
            places.append({"path": place.path, "line": place.line})
        first += len(each)
    return places


def with_provenance(diagnosis: Diagnosis) -> Machine:
    """The new machine, with notes on the source of its new effects."""
    assert diagnosis.machine is not None
    notes = {
        "date": datetime.date.today(),
        "source": ", ".join(dict.fromkeys(each.path for each in diagnosis.data.measurements)),
        "diagnosed_from": diagnosis.data.machine.hash,
        "added": ", ".join(each.candidate.name for each in diagnosis.findings),
        "gap_before_um": round(diagnosis.gap.before, 3),
        "gap_after_um": round(diagnosis.gap.after, 3),
        "noise_um": round(diagnosis.gap.floor, 3),
    }
    return diagnosis.machine.known_from(notes)
