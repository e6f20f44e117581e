"""The whole way from measurements and a machine to a verdict."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ncfix.diagnose import (
    addition,
    checks,
    constants,
    gapmap,
    gates,
    holdout,
    mistakes,
    next_poses,
    noise,
    outliers,
    plausible,
    verdict,
)
from ncfix.diagnose.background import background, everything_of
from ncfix.diagnose.catalogue import Candidate, catalogue, without
from ncfix.diagnose.evidence import Court, Member
from ncfix.diagnose.groups import Gathered, gather
from ncfix.diagnose.rivals import rivals, scaled
from ncfix.diagnose.selection import Selected, aliases, judged, select
from ncfix.diagnose.verdict import AMBIGUOUS, FOUND, NOTHING, UNKNOWN
from ncfix.diagnose.view import View, view
from ncfix.diagnose.weighing import Scale
from ncfix.machine import Effect, Machine
from ncfix.measure.measurement import Array, Measurement

__all__ = ["AMBIGUOUS", "FOUND", "NOTHING", "UNKNOWN", "Diagnosis", "Finding", "Gap", "diagnose"]


@dataclass(frozen=True, repr=False)
class Finding:
    """One named effect.

    candidate   what it is
    odds        log odds against its not being there, given the others; p_value by chance for any name
    aliases     names that explain its part nearly as well
    size_um     rms of what it shows
    effects     as they stand in the machine file; empty for what belongs to the measurement
    shown       (m,) what it shows, um
    judgement   whether its constants are such as machines have; None where there are none
    """

    candidate: Candidate
    odds: float
    p_value: float
    aliases: tuple[str, ...]
    size_um: float
    effects: tuple[Effect, ...]
    shown: Array
    judgement: plausible.Judgement | None = None


@dataclass(frozen=True)
class Gap:
    """Root mean square of residual lengths, um: before, after, the noise floor, and the first two on held-out poses."""

    before: float
    after: float
    floor: float
    holdout_before: float
    holdout_after: float


@dataclass(frozen=True, repr=False)
class Diagnosis:
    """What was found, and everything a report needs.

    verdict      nothing-missing, found, ambiguous, unknown-effect
    findings     likeliest first
    unknown_um   rms of what has no name, and `unknown_kind` what it depends on
    machine      with the findings added, or None if there is nothing to add
    p_lack       probability of the residuals before by chance; p_left after
    moved        constants of the machine file that the data put elsewhere; the gap before is after that
    """

    verdict: str
    findings: tuple[Finding, ...]
    unknown_um: float
    unknown_kind: str
    gap: Gap
    floor: noise.Floor
    machine: Machine | None
    patterns: tuple[gapmap.Pattern, ...]
    clustering: tuple[float, float]
    outlying: NDArray[np.bool_]
    p_lack: float | None
    p_left: float | None
    view: View
    gathered: Gathered
    considered: tuple[Candidate, ...]
    unheard_of: tuple[str, ...]
    selected: Selected | None = None
    before: Array = field(default_factory=lambda: np.zeros(0))
    after: Array = field(default_factory=lambda: np.zeros(0))
    mistake: mistakes.Mistake | None = None
    proposal: next_poses.Proposal | None = None
    court: Court | None = None
    moved: tuple[addition.Moved, ...] = ()


def diagnose(measurements: Sequence[Measurement], machine: Machine, refused: Sequence[str] = ()) -> Diagnosis:
    """Compare, name, add, and show how far the gap shrank. `refused` are names that must not be used.

    Raises `UsageError` NCF630, NCF637 and NCF650 ... NCF659 where the data cannot carry a diagnosis.
    """
    checks.before(measurements, machine)
    wrong = mistakes.find(measurements, machine, refused)
    if wrong is not None:
        measurements, machine = wrong.measurements, wrong.machine
    else:
        checks.sensible(measurements, machine)
    seen = view(measurements, machine)
    checks.enough(seen)
    candidates, unheard_of = without(catalogue(seen.reach), refused)
    gathered = gather(seen, candidates)
    everything = everything_of(seen, gathered.groups)
    relative, outlying = outliers.weighed(seen, everything)
    ground = background(seen, everything, relative)
    court = Court(ground, (*gathered.groups, *rivals(seen, gathered.groups)), len(gathered.groups))
    scale = Scale(court)
    found = _concluded(scale, _selected(scale), gathered, candidates, outlying, unheard_of)
    return mistakes.told(found, wrong) if wrong else found


def _selected(scale: Scale) -> Selected:
    """What is there: curves and the like while lacking constants are free, then those, then what holds."""
    freed = constants.freed(scale.court)
    members = select(freed, (*freed.names, *freed.court.rivals))
    return gates.passed(scale, judged(scale, constants.added(scale, members)))


def _concluded(
    scale: Scale,
    selected: Selected,
    gathered: Gathered,
    candidates: tuple[Candidate, ...],
    outlying: NDArray[np.bool_],
    unheard_of: tuple[str, ...],
) -> Diagnosis:
    court, ground, seen = scale.court, scale.court.background, scale.court.background.view
    every, told = list(selected.members.values()), [selected.members[name] for name in selected.named]
    # names are fitted without what has none: that shall explain only what they leave (Plumlee 2017)
    share = court.share(every)
    joint = addition.fitted(court, told, share)
    keep = ~outlying[np.maximum(seen.row, 0)] & (seen.row >= 0)
    sigma = _sigma(court, every, share)
    checks.agreeing(seen, joint.before, sigma)
    floor = noise.floor(seen, ground, sigma, keep)
    machine, added = addition.machine_with(court, told, addition.firm(court, told, share, joint))
    findings = tuple(
        Finding(
            court.groups[member.group].owner, selected.odds[name], selected.p_value(name),
            tuple(aliases(selected, name)), seen.rms(shown, keep), effects, shown,
            plausible.judged(seen, court.groups[member.group].owner, effects),
        )
        for name, member, effects, shown in zip(selected.named, told, added, joint.shown, strict=True)
    )  # fmt: skip
    parameters = float(np.linalg.matrix_rank(seen.base))
    p_left = noise.lack_of_fit(floor, joint.after[keep], parameters + sum(map(len, joint.numbers)) / 2)
    noise_um = seen.rms(np.where(seen.row >= 0, floor.sigma_um * seen.relative, 0.0), keep)
    left_um = seen.rms(joint.after, keep)
    rest = verdict.Rest(
        gates.nameless(court, selected, addition.fitted(court, every, share), keep),
        tuple(court.groups[selected.members[name].group].owner.title for name in selected.unnamed),
        noise.beyond(floor, noise_um, left_um),
        p_left,
    )
    told_um = gates.visible(seen, joint.together)
    held = holdout.held_out(court, told, share)
    known = np.isfinite(held.without) & np.isfinite(held.with_all) & keep
    return Diagnosis(
        verdict=verdict.of(findings, rest, told_um, floor, noise_um),
        findings=findings,
        unknown_um=rest.size_um,
        unknown_kind=rest.kind,
        gap=Gap(
            seen.rms(joint.before, keep), left_um, noise_um,
            seen.rms(held.without, known), seen.rms(held.with_all, known),
        ),
        floor=floor,
        machine=machine if any(added) else None,
        patterns=tuple(gapmap.patterns(ground, sigma)),
        clustering=(
            gapmap.clustering(ground, joint.before, scaled(seen)), gapmap.clustering(ground, joint.after, scaled(seen)),
        ),
        outlying=outlying,
        p_lack=noise.lack_of_fit(floor, joint.before[keep], parameters),
        p_left=p_left,
        view=seen, gathered=gathered, considered=candidates, unheard_of=unheard_of, selected=selected,
        before=joint.before, after=joint.after, court=court,
        proposal=next_poses.proposed(scale, selected, sigma) if told else None,
        moved=addition.surely_moved(court, joint),
    )  # fmt: skip


def _sigma(court: Court, members: Sequence[Member], share: float) -> float:
    """Noise of one value, um, with the members there."""
    freedom, count = court.background.freedom, len(court.y)
    return court.background.sigma * float(np.sqrt((court.squares(members, share) + freedom) / (count + freedom)))
