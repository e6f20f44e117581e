"""A diagnosis as a JSON object, and its machine with provenance."""

from __future__ import annotations

import datetime
from typing import Any

import numpy as np

from ncfix.diagnose.carriers import carriers, conditions
from ncfix.diagnose.findings import Diagnosis, Finding
from ncfix.diagnose.next_poses import as_objects
from ncfix.diagnose.words import why
from ncfix.machine import Machine


def as_dict(diagnosis: Diagnosis, machine: str | None = None) -> dict[str, Any]:
    """The fields of docs/formats.md, section 4, and some more."""
    return {
        "verdict": diagnosis.verdict,
        "effects": [_effect(diagnosis, each) for each in diagnosis.findings],
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
        "invisible": [{"name": c.name, "visible_share": share} for c, share in diagnosis.case.gathered.invisible],
        "findable_um": {name: size if np.isfinite(size) else None for name, size in diagnosis.findable.items()},
        "considered": len(diagnosis.case.considered),
        "outliers": _outliers(diagnosis),
        "constants": [{"name": m.name, "file": m.file, "data": m.data, "sigma": m.sigma} for m in diagnosis.moved],
    }


def _effect(diagnosis: Diagnosis, finding: Finding) -> dict[str, Any]:
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
        "targets": list(carriers(diagnosis.view.machine, finding.effects)),
        "conditions": list(conditions(diagnosis.view.machine, finding.effects)),
    }


def _plausible(finding: Finding) -> dict[str, Any] | None:
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
        "rivals": p.rivals,
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
    for each in diagnosis.view.measurements:
        for row in np.flatnonzero(diagnosis.case.outlying[first : first + len(each)]):
            place = each.place(int(row))
            places.append({"path": place.path, "line": place.line})
        first += len(each)
    return places


def with_provenance(diagnosis: Diagnosis) -> Machine:
    """The machine with where its new effects come from."""
    assert diagnosis.machine is not None
    notes = {
        "date": datetime.date.today(),
        "source": ", ".join(dict.fromkeys(each.path for each in diagnosis.view.measurements)),
        "diagnosed_from": diagnosis.view.machine.hash,
        "added": ", ".join(each.candidate.name for each in diagnosis.findings),
        "gap_before_um": round(diagnosis.gap.before, 3),
        "gap_after_um": round(diagnosis.gap.after, 3),
        "noise_um": round(diagnosis.gap.floor, 3),
    }
    return diagnosis.machine.replace(provenance={**diagnosis.machine.provenance, **notes})
