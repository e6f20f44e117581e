"""From the effects that are there to a verdict, a machine file with them, and the gap before and after."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ncfix.diagnose import addition, checks, gapmap, gates, holdout, next_poses, noise, plausible, power, verdict
from ncfix.diagnose.addition import Joint
from ncfix.diagnose.evidence import Court, Member
from ncfix.diagnose.fields import scaled
from ncfix.diagnose.findings import Case, Diagnosis, Finding, Gap
from ncfix.diagnose.selection import Selected, aliases
from ncfix.diagnose.weighing import Scale
from ncfix.machine import Effect


def concluded(case: Case, scale: Scale, selected: Selected) -> Diagnosis:
    """All that is said of a case in which these effects were selected.

    Names are fitted without what has none: that shall explain only what they leave (Plumlee 2017).
    """
    court, view, keep = case.court, case.view, case.kept
    every, told = list(selected.members.values()), [selected.members[name] for name in selected.named]
    share = court.share(every)
    joint = addition.fitted(court, told, share)
    sigma = _sigma(court, every, share)
    checks.agreeing(view, joint.before, sigma)
    floor = noise.floor(view, court.background, sigma, keep)
    noise_um = view.rms(np.where(view.row >= 0, floor.sigma_um * view.relative, 0.0), keep)
    machine, added = addition.machine_with(court, told, addition.firm(court, told, share, joint))
    findings = _findings(case, selected, joint, added)
    rest = _rest(case, selected, joint, floor, noise_um)
    places = scaled(view)
    return Diagnosis(
        case=case,
        verdict=verdict.of(findings, rest, gates.visible(view, joint.together), floor, noise_um),
        findings=findings,
        rest=rest,
        gap=_gap(case, told, joint, share, noise_um),
        floor=floor,
        machine=machine if any(added) else None,
        selected=selected,
        before=joint.before,
        after=joint.after,
        p_lack=noise.lack_of_fit(floor, joint.before[keep], _constants(case)),
        patterns=tuple(gapmap.patterns(court.background, sigma)),
        clustering=(
            gapmap.clustering(court.background, joint.before, places),
            gapmap.clustering(court.background, joint.after, places),
        ),
        moved=addition.surely_moved(court, joint),
        findable=power.findable(scale),
        proposal=next_poses.proposed(scale, selected, sigma) if told else None,
    )


def _findings(case: Case, selected: Selected, joint: Joint, added: Sequence[tuple[Effect, ...]]) -> tuple[Finding, ...]:
    """The names with what they show and add."""
    found = []
    for name, effects, shown in zip(selected.named, added, joint.shown, strict=True):
        owner = case.court.groups[selected.members[name].group].owner
        size, judgement = case.view.rms(shown, case.kept), plausible.judged(case.view, owner, effects)
        alike = tuple(aliases(selected, name))
        found.append(
            Finding(owner, selected.odds[name], selected.p_value(name), alike, size, effects, shown, judgement)
        )
    return tuple(found)


def _rest(case: Case, selected: Selected, joint: Joint, floor: noise.Floor, noise_um: float) -> verdict.Rest:
    """What has no name."""
    court, keep = case.court, case.kept
    every = list(selected.members.values())
    whole = addition.fitted(court, every, court.share(every))
    parameters = _constants(case) + sum(map(len, joint.numbers)) / 2
    return verdict.Rest(
        gates.nameless(court, selected, whole, keep),
        tuple(court.groups[selected.members[name].group].owner.title for name in selected.unnamed),
        noise.beyond(floor, noise_um, case.view.rms(joint.after, keep)),
        noise.lack_of_fit(floor, joint.after[keep], parameters),
    )


def _gap(case: Case, told: Sequence[Member], joint: Joint, share: float, noise_um: float) -> Gap:
    view, keep = case.view, case.kept
    held = holdout.held_out(case.court, told, share)
    known = np.isfinite(held.without) & np.isfinite(held.with_all) & keep
    before, after = view.rms(joint.before, keep), view.rms(joint.after, keep)
    return Gap(before, after, noise_um, view.rms(held.without, known), view.rms(held.with_all, known))


def _constants(case: Case) -> float:
    """How many numbers are free anyway."""
    return float(np.linalg.matrix_rank(case.view.base))


def _sigma(court: Court, members: Sequence[Member], share: float) -> float:
    """Noise of one value, um, with the members there."""
    freedom, count = court.background.freedom, len(court.y)
    return court.background.sigma * float(np.sqrt((court.squares(members, share) + freedom) / (count + freedom)))
