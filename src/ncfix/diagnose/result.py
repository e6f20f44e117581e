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


def as_dict(found: Diagnosis, machine: str | None = None) -> dict[str, Any]:
    """The fields of docs/formats.md, section 4, and some more."""
    return {
        "verdict": found.verdict,
        "effects": [_effect(found, each) for each in found.findings],
        "unknown": {"share_um": found.unknown_um, "where": found.rest.kind},
        "gap_um": {name: getattr(found.gap, name) for name in found.gap.__dataclass_fields__},
        "where": [{"text": p.text, "rms_um": p.rms_um, "p_value": p.p_value} for p in found.patterns],
        "next_measurements": as_objects(found.proposal.plan) if found.proposal and found.proposal.plan else [],
        "ambiguity": _ambiguity(found),
        "machine": machine,
        "noise": {"sigma_um": found.floor.sigma_um, "source": found.floor.source, "freedom": found.floor.freedom},
        "lack_of_fit": {"before": found.p_lack, "after": found.p_left},
        "invisible": [{"name": c.name, "visible_share": share} for c, share in found.case.gathered.invisible],
        "findable_um": {name: size if np.isfinite(size) else None for name, size in found.findable.items()},
        "considered": len(found.case.considered),
        "outliers": _outliers(found),
        "constants": [{"name": m.name, "file": m.file, "data": m.data, "sigma": m.sigma} for m in found.moved],
    }


def _effect(found: Diagnosis, finding: Finding) -> dict[str, Any]:
    return {
        "name": finding.candidate.name,
        "title": finding.candidate.title,
        "axis": finding.candidate.axis or None,
        "why": why(found, finding),
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
        "targets": list(carriers(found.view.machine, finding.effects)),
        "conditions": list(conditions(found.view.machine, finding.effects)),
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


def _ambiguity(found: Diagnosis) -> dict[str, Any] | None:
    if found.proposal is None:
        return None
    p = found.proposal
    return {
        "name": p.name,
        "rivals": p.rivals,
        "reason": p.reason,
        "alike": p.alike,
        "stuck": p.stuck,
        "told_apart": {"now": p.before, "after": p.after, "chance": p.chance, "times_each": p.times},
        "beyond_travels_measured": list(p.beyond),
        "tip_beyond": p.strays,
        "new_tool_lengths": list(p.tools),
    }


def _outliers(found: Diagnosis) -> list[dict[str, Any]]:
    places, first = [], 0
    for each in found.view.measurements:
        for row in np.flatnonzero(found.case.outlying[first : first + len(each)]):
            place = each.place(int(row))
            places.append({"path": place.path, "line": place.line})
        first += len(each)
    return places


def with_provenance(found: Diagnosis) -> Machine:
    """The machine with where its new effects come from."""
    assert found.machine is not None
    notes = {
        "date": datetime.date.today(),
        "source": ", ".join(dict.fromkeys(each.path for each in found.view.measurements)),
        "diagnosed_from": found.view.machine.hash,
        "added": ", ".join(each.candidate.name for each in found.findings),
        "gap_before_um": round(found.gap.before, 3),
        "gap_after_um": round(found.gap.after, 3),
        "noise_um": round(found.gap.floor, 3),
    }
    return found.machine.replace(provenance={**found.machine.provenance, **notes})
