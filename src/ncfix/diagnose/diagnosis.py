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
    holdout,
    mistakes,
    next_poses,
    noise,
    outliers,
    plausible,
    rest,
)
from ncfix.diagnose.background import Background, background
from ncfix.diagnose.catalogue import Candidate, catalogue, without
from ncfix.diagnose.evidence import Court, Evidence, Member
from ncfix.diagnose.groups import Gathered, gather
from ncfix.diagnose.rivals import rivals, scaled
from ncfix.diagnose.selection import Selected, aliases, select
from ncfix.diagnose.view import View, view
from ncfix.machine import Effect, Machine
from ncfix.measure.measurement import Array, Measurement
from ncfix.measure.solve import orthonormal
from ncfix.measure.solve import without as without_free

NOTHING, FOUND, AMBIGUOUS, UNKNOWN = "nothing-missing", "found", "ambiguous", "unknown-effect"
MATERIAL_UM = 0.8
"""An effect that moves the tool tip by less is not worth a name."""
RATHER = 0.5
"""An effect smaller than this share of what is left without a name is as good as part of it."""
MUCH = 1 / 3
"""Share of what all names together show from which on what has none decides the verdict."""
NEAR = 10.0
"""Log odds within which another name is near enough to ask for poses that tell them apart."""
ALIKE = 3.0
"""The same for names that are as likely."""
RIVALS_MOST = 3
LACKING = 1e-3
"""Probability of what is left by chance, below which something is missing that has no name."""
EXCESS_UM = 2.0
"""And this much more than the noise, rms: machines have a little of everything."""


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
    if wrong is None:
        checks.sensible(measurements, machine)
    seen = view(measurements, machine)
    checks.enough(seen)
    candidates, unheard_of = without(catalogue(seen.reach), refused)
    gathered = gather(seen, candidates)
    ground, outlying = _ground(seen, gathered)
    court = Court(ground, (*gathered.groups, *rivals(seen, gathered.groups)), len(gathered.groups))
    inner = constants.freed(court)
    selected = _gated(court, constants.added(court, rest.completed(inner, select(inner))))
    found = _concluded(court, selected, gathered, candidates, outlying, unheard_of)
    return mistakes.told(found, wrong) if wrong else found


def _ground(seen: View, gathered: Gathered) -> tuple[Background, NDArray[np.bool_]]:
    """The background, outliers put aside."""
    rough = background(seen, gathered.groups, seen.relative, wanders=False)
    relative, outlying = outliers.weighed(rough)
    return background(seen, gathered.groups, relative), outlying


def _gated(court: Court, selected: Selected) -> Selected:
    """Without the members that do not predict held-out poses, or that are too small to matter."""
    view = court.background.view
    free = orthonormal(view.base / view.relative[:, None])
    least = max(MATERIAL_UM, RATHER * _nameless(court, selected))
    while selected.members:
        members = list(selected.members.values())
        share = _share(court, members)
        held = holdout.held_out(court, members, share)
        joint = addition.fitted(court, members, share)
        sizes = [_visible(view, free, shown) for shown in joint.shown]
        names = list(selected.members)
        failed = [
            name
            for k, name in enumerate(names)
            if name in selected.named
            and (sizes[k] < least or not (_sure(court, selected, name) or _passes(holdout.gain(held, held.less[k]))))
        ]
        if not failed:
            break
        weakest = min(failed, key=lambda name: selected.odds[name])
        selected = selected.without(weakest, court)
    return selected


def _sure(court: Court, selected: Selected, name: str) -> bool:
    """Whether it is a constant beside effects that can do the same where it is left out."""
    return court.constant(name) and not all(court.constant(each) for each in selected.named)


def _visible(view: View, free: Array, shown: Array) -> float:
    """The size of what an effect shows beside what is free, um."""
    return view.rms(without_free(free, (shown / view.relative)[:, None])[:, 0] * view.relative)


def _passes(gain: tuple[float, float]) -> bool:
    mean, error = gain
    return mean > error


def _concluded(
    court: Court,
    selected: Selected,
    gathered: Gathered,
    candidates: tuple[Candidate, ...],
    outlying: NDArray[np.bool_],
    unheard_of: tuple[str, ...],
) -> Diagnosis:
    ground, seen = court.background, court.background.view
    told = [selected.members[name] for name in selected.named]
    # names are fitted without what has none: that shall explain only what they leave (Plumlee 2017)
    share = _share(court, list(selected.members.values()))
    joint = addition.fitted(court, told, share)
    keep = ~outlying[np.maximum(seen.row, 0)] & (seen.row >= 0)
    sigma = _sigma(court, selected)
    checks.agreeing(seen, joint.before, sigma)
    floor = noise.floor(seen, ground, sigma, keep)
    machine, added = addition.machine_with(court, told, addition.firm(court, told, share, joint))
    findings = tuple(
        Finding(
            court.groups[member.group].owner, selected.odds[name], selected.null.p_value(selected.odds[name]),
            tuple(aliases(selected, name, ALIKE)), seen.rms(shown, keep), effects, shown,
            plausible.judged(seen, court.groups[member.group].owner, effects),
        )
        for name, member, effects, shown in zip(selected.named, told, added, joint.shown, strict=True)
    )  # fmt: skip
    parameters = float(np.linalg.matrix_rank(seen.base))
    p_left = noise.lack_of_fit(floor, joint.after[keep], parameters + sum(map(len, joint.numbers)) / 2)
    noise_um = _length(seen, keep, floor.sigma_um)
    unknown_um = _nameless(court, selected, keep)
    beyond = noise.beyond(floor, noise_um, seen.rms(joint.after, keep))
    if p_left is not None and p_left < LACKING and beyond > EXCESS_UM:
        unknown_um = max(unknown_um, beyond)
    told_um = _visible(seen, orthonormal(seen.base / seen.relative[:, None]), joint.together)
    held = holdout.held_out(court, told, share)
    known = np.isfinite(held.without) & np.isfinite(held.with_all) & keep
    return Diagnosis(
        verdict=_verdict(findings, unknown_um, told_um, floor, noise_um),
        findings=findings,
        unknown_um=unknown_um,
        unknown_kind=_kind(court, selected, unknown_um),
        gap=Gap(
            seen.rms(joint.before, keep), seen.rms(joint.after, keep), noise_um,
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
        proposal=_proposal(court, selected, sigma) if told else None,
        moved=addition.surely_moved(court, joint),
    )  # fmt: skip


def _proposal(court: Court, selected: Selected, sigma: float) -> next_poses.Proposal | None:
    """Poses that tell the first name from those that come near it."""
    name = selected.named[0]
    runners = selected.runners[name]
    reach = ALIKE if any(runners[n] > selected.odds[name] - ALIKE for n in runners) else NEAR
    near = [n for n in sorted(runners, key=lambda n: -runners[n]) if runners[n] > selected.odds[name] - reach]
    owners = {group.owner.name: group.owner for group in court.groups}
    near = [n for n in near if not owners[n].grows][:RIVALS_MOST]
    if not near or owners[name].grows:
        return None
    others = [member for key, member in selected.members.items() if key != name]
    evidence = court.heard(others)
    sides = [_side(court, evidence, others, each) for each in (name, *near)]
    return next_poses.propose(court, sides[0], sides[1:], sigma)


def _side(court: Court, evidence: Evidence, others: Sequence[Member], name: str) -> next_poses.Side:
    """A name as it would be beside the others."""
    members = evidence.likeliest(court.forms[name], next_poses.FORMS)
    numbers = court.numbers([*others, members[0]], addition.likeliest_share(evidence.null))[-1]
    forms = tuple((court.groups[member.group], member.size) for member in members)
    return next_poses.Side(forms[0][0], numbers, forms)


def _nameless(court: Court, selected: Selected, keep: NDArray[np.bool_] | None = None) -> float:
    """How much of what the names leave something without a name explains, rms um."""
    if not selected.unnamed:
        return 0.0
    told, every = [selected.members[name] for name in selected.named], list(selected.members.values())
    share = _share(court, every)
    left = [court.background.view.rms(addition.fitted(court, each, share).after, keep) for each in (told, every)]
    return float(np.sqrt(max(left[0] ** 2 - left[1] ** 2, 0.0)))


def _share(court: Court, members: Sequence[Member]) -> float:
    return addition.likeliest_share(court.heard(members, among=range(0)).null)


def _kind(court: Court, selected: Selected, unknown_um: float) -> str:
    titles = [court.groups[selected.members[name].group].owner.title for name in selected.unnamed]
    return " and ".join(titles) or ("something that follows no pattern that was looked for" if unknown_um else "")


def _sigma(court: Court, selected: Selected) -> float:
    """Noise of one value, um, with the members there."""
    members = list(selected.members.values())
    y, _ = court.whitened(_share(court, members), members)
    freedom = court.background.freedom
    return court.background.sigma * float(np.sqrt((y @ y + freedom) / (len(y) + freedom)))


def _length(seen: View, keep: NDArray[np.bool_], sigma: float) -> float:
    """The noise of a row's length, um."""
    return seen.rms(np.where(seen.row >= 0, sigma * seen.relative, 0.0), keep)


def _verdict(findings: Sequence[Finding], unknown_um: float, told_um: float, floor: noise.Floor, length: float) -> str:
    """Without repeats a smooth rest may as well be the part's or the instrument's: only a large one decides."""
    doubtful = floor.source == "neighbours"
    decides = unknown_um > (max(EXCESS_UM, length) if doubtful else EXCESS_UM)
    if not findings:
        return UNKNOWN if decides else NOTHING
    if decides and unknown_um >= (told_um if doubtful else MUCH * told_um):
        return UNKNOWN
    return AMBIGUOUS if any(each.aliases for each in findings) else FOUND
