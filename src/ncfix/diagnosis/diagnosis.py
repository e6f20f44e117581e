"""The diagnosis: from measurements and a machine file to a verdict and the findings of a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array, Mask
from ncfix.diagnosis import checks
from ncfix.diagnosis.assessment import plausibility
from ncfix.diagnosis.catalogue import Candidate, catalogue, without
from ncfix.diagnosis.catalogue.dynamic import with_motion
from ncfix.diagnosis.compound import EffectFinding, compound
from ncfix.diagnosis.constants import ConstantsVerdict, FileLikelihood, MovedConstant, judged_constants, names_of
from ncfix.diagnosis.evidence import SHARES, Comparison, Evidence, Member, entry_price
from ncfix.diagnosis.forms import CHANGE, changes, file_constants, scaled_axes, unnamed_alternatives, visible_forms
from ncfix.diagnosis.joint_fit import (
    RATHER,
    Gap,
    JointFit,
    fitted,
    held_out,
    held_out_as_given,
    machine_with,
    passing,
    unnamed_by_view,
    visible,
)
from ncfix.diagnosis.mistakes.mistake import Mistake
from ncfix.diagnosis.mistakes.search import find, is_a_point_of
from ncfix.diagnosis.mistakes.units import in_usual_unit
from ncfix.diagnosis.next_poses import Proposal, proposed
from ncfix.diagnosis.noise import (
    NoiseFloor,
    beyond_noise,
    downweighted,
    estimated_background,
    everything_covariance,
    lack_of_fit,
    noise_floor,
)
from ncfix.diagnosis.residual_data import ResidualData, residual_data
from ncfix.diagnosis.residual_patterns import ResidualPattern, clustering, patterns
from ncfix.diagnosis.selection import (
    Selected,
    aliases,
    findable_sizes,
    plainest,
    select,
    with_alternatives,
    with_constants,
    with_constants_free,
)
from ncfix.diagnostics import Message, UsageError
from ncfix.machine import Effect, Machine
from ncfix.machine.axes import component_title
from ncfix.measure.least_squares import orthonormal
from ncfix.measure.least_squares import without as without_base
from ncfix.measure.measurement import Measurement
from ncfix.values import frozen

NOTHING, FOUND, AMBIGUOUS, UNKNOWN = "nothing-missing", "found", "ambiguous", "unknown-effect"
EXCESS_UM = 2.0
"""An unnamed remainder below this, um rms, does not affect the verdict: every machine has small effects."""
MUCH = 1 / 3
"""Nor does one below this share of the size of all names together."""
LACKING = 1e-3
"""Probability of the residual by chance below which something is missing."""
AS_GOOD = 1.5
"""Data that are refused with the given file are accepted if undoing a mistake leaves at most this times the noise."""
CONSTANT_FAMILY = "constant of the file"
PLAUSIBLE_UM = 4.0
"""Largest plausible background of small effects, um rms; a larger one is a pattern that was taken for background."""
CLEAR = float(np.log(1e6))
"""Log odds of the unnamed alternatives from which on they are not noise, however poorly the noise is known."""
NO_PATTERN = "something without a pattern that ncfix knows"


@frozen(repr=False, slots=False)
class Case:
    """The input of a diagnosis.

    data        the residuals
    considered  number of candidates
    unheard_of  names to be left out that the catalogue does not have
    invisible   (name, visible share of its squares) of candidates that the data cannot show
    outlying    (rows,) mask of the outliers
    since       index of the first file of the later date; 0: all are of one date
    """

    data: ResidualData
    considered: int
    unheard_of: tuple[str, ...]
    invisible: tuple[tuple[str, float], ...]
    outlying: Mask
    since: int = 0

    @property
    def kept(self) -> Mask:
        """(m,) mask of the values of rows that are no outliers."""
        return ~self.outlying[np.maximum(self.data.row, 0)] & (self.data.row >= 0)


@frozen(repr=False, eq=False, slots=False)
class Diagnosis:
    """The result of a diagnosis.

    verdict        nothing-missing, found, ambiguous, unknown-effect
    findings       likeliest first
    rest           the part of the residuals for which no name was found
    gap, floor     residuals in um rms, and the noise
    machine        the machine with the findings added, or None if there is nothing to add
    before, after  (m,) residuals with the constants alone, and with the findings, um
    p_lack, p_left  probability of so large residuals by chance, before and after; None if the noise is not known
    likelihood     log likelihood of the values given the file with all findings, less their prices
    named_odds     log odds of all names together
    steady         names of effects that two dates have in common (`case.since`)
    clustering     Moran's I of the residuals, before and after
    constants      the verdict on the constants of the machine file; `gap.before` has them corrected
    findable       name -> size, um rms, from which an effect would be found in these data; inf: never
    """

    case: Case
    verdict: str
    findings: tuple[EffectFinding, ...]
    rest: Unexplained
    gap: Gap
    floor: NoiseFloor
    machine: Machine | None
    selected: Selected
    before: Array
    after: Array
    p_lack: float | None
    patterns: tuple[ResidualPattern, ...]
    clustering: tuple[float, float]
    constants: ConstantsVerdict
    findable: Mapping[str, float]
    proposal: Proposal | None = None
    mistake: Mistake | None = None
    likelihood: float = 0.0
    named_odds: float = 0.0
    steady: tuple[str, ...] = ()

    @property
    def data(self) -> ResidualData:
        """The residual data of the diagnosis."""
        return self.case.data

    @property
    def messages(self) -> tuple[Message, ...]:
        """Remarks on the data, and on unknown names to be left out."""
        return tuple(checks.remarks(self.data, self.case.unheard_of))

    @property
    def moved(self) -> tuple[MovedConstant, ...]:
        """Constants of the machine file that the data contradict."""
        return self.constants.moved

    @property
    def unknown_um(self) -> float:
        """Size of the unnamed remainder, um rms."""
        return self.rest.size_um

    @property
    def p_left(self) -> float | None:
        """Probability by chance of the residuals with the findings; None if the noise is not known."""
        return self.rest.p_left


@frozen
class Unexplained:
    """The remainder that the names do not explain.

    pattern_um  part that unnamed alternatives explain, um rms; titles: of those, odds: their log odds
    beyond_um   part of the residual beyond the noise, um rms; p_left: its probability by chance, None if unknown
    """

    pattern_um: float
    titles: tuple[str, ...]
    odds: float
    beyond_um: float
    p_left: float | None

    @property
    def lacking(self) -> bool:
        """Whether the residual is significantly larger than the noise."""
        return self.p_left is not None and self.p_left < LACKING

    @property
    def size_um(self) -> float:
        """Size of the unnamed remainder, um rms."""
        return max(self.pattern_um, self.beyond_um) if self.lacking else self.pattern_um

    @property
    def kind(self) -> str:
        """Inputs on which the remainder depends, in words."""
        return " and ".join(self.titles) or (NO_PATTERN if self.size_um else "")


def verdict_of(
    findings: Sequence[EffectFinding], rest: Unexplained, told_um: float, floor: NoiseFloor, noise_um: float,
    little: float = 1.0,
) -> str:  # fmt: skip
    """The verdict.

    told_um   size of all findings together, um rms; noise_um: of the noise
    little    factor on the sizes that are too small to matter (`residual_data.little_of`)
    Without repeats a smooth remainder may come from the part or the instrument: only a large or clear one counts.
    """
    doubtful = floor.source == "neighbours"
    excess = EXCESS_UM * little
    decides = rest.size_um > (max(excess, noise_um) if doubtful and rest.odds < CLEAR else excess)
    if decides and rest.size_um >= (1.0 if doubtful else MUCH) * told_um * bool(findings):
        return UNKNOWN
    if not findings:
        return UNKNOWN if rest.lacking and rest.beyond_um > 0 else NOTHING
    return AMBIGUOUS if any(each.aliases for each in findings) else FOUND


def concluded(case: Case, scale: Comparison, selected: Selected) -> Diagnosis:
    """The diagnosis of a case, given the selected effects.

    Names are fitted without the unnamed alternatives, which shall explain only the remainder (Plumlee 2017).
    """
    evidence, data, keep = scale.evidence, case.data, case.kept
    every, told = list(selected.members.values()), [selected.members[name] for name in selected.named]
    share = evidence.share(every)
    joint = fitted(evidence, told, share)
    sigma = _sigma(evidence, every, share)
    checks.agreeing(data, joint.before, sigma, case.since)
    floor = noise_floor(data, evidence.background, sigma, keep)
    noise = floor.sigma_um * data.relative
    constants = judged_constants(evidence, told, share)
    machine, added = machine_with(evidence, told, fitted(evidence, told, share, constants.stay))
    named = _findings(case, evidence, selected, joint, added)
    off = _off(case, constants, machine, max((each.size_um for each in named), default=0.0))
    findings = (*off, *named) if named and off and off[0].size_um > named[0].size_um else (*named, *off)
    findings = compound(data, findings, constants.moved)
    places = scaled_axes(data)
    sets: list[dict[str, Member]] = [{}, {name: selected.members[name] for name in selected.named}, selected.members]
    weights = [scale.weight(each) for each in sets]
    rest = _rest(case, evidence, selected, joint, floor, noise, weights[2] - weights[1])
    return Diagnosis(
        case=case,
        verdict=verdict_of(
            findings, rest, data.size(visible(data, joint.together)), floor, data.size(noise, keep), data.little
        ),
        findings=findings,
        rest=rest,
        gap=_gap(case, evidence, told, joint, share, data.rms(noise, keep)),
        floor=floor,
        machine=machine if any(added) or off else None,
        selected=selected,
        before=joint.before,
        after=joint.after,
        p_lack=lack_of_fit(floor, (joint.before / data.relative)[keep], _constants(case)),
        patterns=tuple(patterns(evidence.background, sigma)),
        clustering=(
            clustering(evidence.background, joint.before, places),
            clustering(evidence.background, joint.after, places),
        ),
        constants=constants,
        findable=findable_sizes(scale),
        proposal=proposed(scale, selected, sigma) if told else None,
        likelihood=_likelihood(scale, selected, constants, share),
        named_odds=weights[1] - weights[0],
    )


def _findings(
    case: Case, evidence: Evidence, selected: Selected, joint: JointFit, added: Sequence[tuple[Effect, ...]]
) -> tuple[EffectFinding, ...]:
    """A finding for each named member, with its effect on the values and the effects that it adds."""
    found = []
    for name, effects, shown in zip(selected.named, added, joint.shown, strict=True):
        owner = evidence.groups[selected.members[name].group].owner
        size, judgement = case.data.size(shown, case.kept), plausibility(case.data, owner, effects)
        alike = tuple(aliases(selected, name))
        found.append(
            EffectFinding(owner, selected.odds[name], selected.p_value(name), alike, size, effects, shown, judgement)
        )
    return tuple(found)


def _likelihood(scale: Comparison, selected: Selected, constants: ConstantsVerdict, share: float) -> float:
    """Log likelihood of the values with corrected constants, names and alternatives, less their prices."""
    asked = FileLikelihood(scale.evidence, scale.all(selected.members), share)
    paid = sum(map(scale.price, selected.members)) + entry_price(len(selected.members)) + constants.paid
    return asked.likelihood(np.flatnonzero(~constants.stay).tolist()) - paid


def _off(case: Case, constants: ConstantsVerdict, machine: Machine, named_um: float) -> tuple[EffectFinding, ...]:
    """Findings for constants of the file that are off by more than day and set-up explain.

    named_um  size of the largest name, um rms; constants smaller than `RATHER` times that may be part of it
    """
    if constants.odds <= 0 or constants.size_um < max(EXCESS_UM * case.data.little, RATHER * named_um):
        return ()
    p_value = min(constants.p_value, float(np.exp(-constants.odds)))
    if constants.whole:
        title = f"constants of the machine file: all {constants.freedom} that the data determine are wrong together"
        owner = Candidate("constants of the file", title, "", CONSTANT_FAMILY, (), (), remedy=constants.remedy())
        return (EffectFinding(owner, constants.odds, p_value, (), constants.size_um, (), constants.shown),)
    probed = all(each.kind == "probe" for each in case.data.measurements)
    rotary = {axis.name for axis in machine.axes if axis.rotary and probed}
    effects = dict(zip(names_of(case.data.problem.selection), _owners(case.data, machine), strict=True))
    found = []
    for each in constants.moved:
        effect = effects[each.name]
        title = f"constant of the machine file: {component_title(effect.name, case.data.machine.axis(effect.joint))}"
        title += ", with the opposite sign" if each.turned else ""
        place = effect.location and effect.name[1] in "XYZ" and effect.joint in rotary
        remedy = constants.remedy(effect.joint if place else "")
        owner = Candidate(f"constant {each.name}", title, effect.joint, CONSTANT_FAMILY, (), (), remedy=remedy)
        shown = np.zeros(len(case.data.y))
        odds = max(each.odds, 0.0) if len(constants.moved) > 1 else constants.odds
        alike = tuple(f"constant {name}" for name in each.aliases)
        found.append(EffectFinding(owner, odds, p_value, alike, each.size_um, (effect,), shown))
    return tuple(found)


def _owners(data: ResidualData, machine: Machine) -> list[Effect]:
    """The effect in the new machine to which each free coefficient belongs, without its covariance."""
    free = [effect for effect, loose in zip(machine.effects, data.problem.selection.free, strict=False) if loose]
    return [replace(effect, covariance=None) for effect in free for _ in range(effect.basis.size)]


def _rest(
    case: Case, evidence: Evidence, selected: Selected, joint: JointFit, floor: NoiseFloor, noise: Array, odds: float
) -> Unexplained:
    """The remainder without a name."""
    keep = case.kept
    every = list(selected.members.values())
    whole = fitted(evidence, every, evidence.share(every))
    parameters = _constants(case) + sum(map(len, joint.numbers)) / 2
    return Unexplained(
        float(unnamed_by_view(evidence, selected, whole, keep).max(initial=0.0)),
        tuple(evidence.groups[selected.members[name].group].owner.title for name in selected.unnamed),
        odds,
        beyond_noise(case.data, floor, noise, joint.after, keep),
        lack_of_fit(floor, (joint.after / case.data.relative)[keep], parameters),
    )


def _gap(case: Case, evidence: Evidence, told: Sequence[Member], joint: JointFit, share: float, noise_um: float) -> Gap:
    data, keep = case.data, case.kept
    held = held_out(evidence, told, share)
    asked = FileLikelihood(evidence, told, share)
    predicted = held_out_as_given(evidence, asked.from_file, asked.setup, share)
    known = np.isfinite(held.without) & np.isfinite(held.with_all) & np.isfinite(predicted) & keep
    basis = orthonormal(asked.setup / data.relative[:, None])
    given = without_base(basis, (asked.from_file / data.relative)[:, None])[:, 0] * data.relative
    before, after = data.rms(joint.before, keep), data.rms(joint.after, keep)
    holdout = [data.rms(values, known) for values in (held.without, held.with_all, predicted)]
    return Gap(before, after, noise_um, holdout[0], holdout[1], data.rms(given, keep), holdout[2])


def _constants(case: Case) -> float:
    """Number of independent free parameters of set-up and constants."""
    return float(np.linalg.matrix_rank(case.data.base))


def _sigma(evidence: Evidence, members: Sequence[Member], share: float) -> float:
    """Noise of a usual value, um, estimated with the members fitted."""
    return evidence.background.sigma * float(np.sqrt(evidence.noise(members, share)))


def diagnose(
    measurements: Sequence[Measurement], machine: Machine, refused: Sequence[str] = (), since: bool = False
) -> Diagnosis:
    """Diagnose a machine file by measurements: find missing effects, wrong constants and mistakes.

    refused  names that must not be used
    since    the last file is of a later date than the others: only changes between the dates are findings
    Raises `UsageError` NCF630, NCF637 and NCF650 ... NCF659 if the data do not support a diagnosis.
    """
    checks.before(measurements, machine)
    measurements = checks.bounded([with_motion(each, machine) for each in measurements])
    if since:
        if len(measurements) < 2:
            raise UsageError.of("NCF650", "only one file is given, but --since needs files of two dates")
        return _explained(measurements, machine, refused, len(measurements) - 1)
    wrong = find(measurements, machine, refused) or in_usual_unit(measurements, machine, refused)
    if wrong is None:
        return _explained(measurements, machine, refused)
    undone = _explained(wrong.measurements, wrong.machine, refused)
    if not wrong.sure or any(each.candidate.family == CONSTANT_FAMILY for each in undone.findings):
        try:
            checks.sensible(measurements, machine)
            given = _explained(measurements, machine, refused)
        except UsageError:
            if undone.gap.given > AS_GOOD * undone.gap.floor:
                wrong = in_usual_unit(measurements, machine, refused)
                if wrong is None:
                    raise
                undone = _explained(wrong.measurements, machine, refused)
            return _with_mistake(undone, wrong, machine)
        stretched = len(undone.data.y) * float(np.log(wrong.stretch))
        odds = undone.likelihood + stretched - wrong.paid - given.likelihood
        if odds <= 0 and not is_a_point_of(wrong, [n for f in given.findings for n in (f.candidate.name, *f.aliases)]):
            return given
        wrong = replace(wrong, odds=odds if odds > 0 else wrong.odds)
    return _with_mistake(undone, wrong, machine)


def _changes(found: Diagnosis, evidence: Evidence) -> Diagnosis:
    """The diagnosis of two dates: findings are the changes between them; the other names are listed as steady."""
    new = tuple(each for each in found.findings if each.candidate.name.startswith(CHANGE))
    steady = tuple(each.candidate.name for each in found.findings if each not in new)
    members = found.selected.members
    every = list(members.values())
    shown = zip(members, fitted(evidence, every, evidence.share(every)).shown, strict=True)
    unnamed = {name: own for name, own in shown if name in found.selected.unnamed and name.startswith(CHANGE)}
    size = _visible_size(found.data, list(unnamed.values()))
    titles = tuple(evidence.groups[members[name].group].owner.title for name in unnamed)
    rest = Unexplained(size, titles, found.rest.odds if unnamed else 0.0, 0.0, None)
    told = _visible_size(found.data, [each.shown for each in new])
    verdict = verdict_of(new, rest, told, found.floor, found.gap.floor, found.data.little)
    proposal = found.proposal if found.proposal and found.proposal.name.startswith(CHANGE) else None
    machine = found.machine if new else None
    return replace(found, verdict=verdict, findings=new, rest=rest, machine=machine, proposal=proposal, steady=steady)


def _visible_size(data: ResidualData, shown: Sequence[Array]) -> float:
    """Size of several effects together, um rms: of what set-up and constants cannot imitate of their sum."""
    return data.size(visible(data, np.sum([np.zeros(len(data.y)), *shown], axis=0)))


def _explained(
    measurements: Sequence[Measurement], machine: Machine, refused: Sequence[str], since: int = 0
) -> Diagnosis:
    """The diagnosis of constants and names, without a search for mistakes.

    since  index of the first file of the later date; 0: all are of one date
    Raises `UsageError` NCF650, NCF656.
    """
    case, scale = weighed(measurements, machine, refused, since)
    selected = _selected(scale)
    evidence = scale.evidence
    while evidence.most > 1 and _everything_um(evidence, selected) > PLAUSIBLE_UM * case.data.large:
        evidence.most = SHARES.index(evidence.share(list(selected.members.values())))
        scale = Comparison(evidence)
        selected = _selected(scale)
    found = concluded(case, scale, selected)
    return _changes(found, evidence) if since else found


def weighed(
    measurements: Sequence[Measurement], machine: Machine, refused: Sequence[str] = (), since: int = 0
) -> tuple[Case, Comparison]:
    """The case, and the comparison of sets of effects for it. Raises `UsageError` NCF650."""
    seen = residual_data(measurements, machine)
    checks.enough(seen)
    candidates, unheard_of = without(catalogue(seen.measured), refused)
    visible = visible_forms(seen, candidates)
    named, unnamed = visible.groups, unnamed_alternatives(seen, visible.groups)
    if since:
        named = (*named, *changes(seen, (*named, *file_constants(seen)), since))
        unnamed = (*unnamed, *changes(seen, unnamed, since))
    everything, groups = everything_covariance(seen, named), (*named, *unnamed)
    relative, outlying = downweighted(seen, everything, groups)
    background = estimated_background(seen, everything, relative, named)
    invisible = tuple((candidate.name, share) for candidate, share in visible.invisible)
    case = Case(seen, len(candidates), unheard_of, invisible, outlying, since)
    return case, Comparison(Evidence(background, groups, len(named)))


def _everything_um(evidence: Evidence, selected: Selected) -> float:
    """Size of the background of small effects beside the selected ones, um rms."""
    every = list(selected.members.values())
    share = evidence.share(every)
    return share * _sigma(evidence, every, share)


def _selected(scale: Comparison) -> Selected:
    """The selected effects: first with lacking constants free, then with those selected, then those that predict."""
    freed = with_constants_free(scale.evidence)
    members = select(freed, (*freed.names, *freed.evidence.alternatives))
    return passing(scale, plainest(scale, with_alternatives(scale, with_constants(scale, members))))


def _with_mistake(diagnosis: Diagnosis, wrong: Mistake, given: Machine) -> Diagnosis:
    """The diagnosis with the mistake as its first finding, and with the given machine file corrected for it."""
    remedy = wrong.remedy or "correct the mistake"
    candidate = Candidate(wrong.name, wrong.title, wrong.axis, "mistake", (), (), remedy=remedy)
    size = float(np.sqrt(max(wrong.given_um**2 - diagnosis.gap.given**2, 0.0)))
    p_value = float(np.exp(-max(wrong.odds, 0.0)))
    first = EffectFinding(candidate, wrong.odds, p_value, wrong.aliases, size, (), np.zeros(len(diagnosis.data.y)))
    verdict = (AMBIGUOUS if wrong.aliases else FOUND) if diagnosis.verdict == NOTHING else diagnosis.verdict
    put_right = diagnosis.machine or (wrong.machine if wrong.machine != given else None)
    return replace(
        diagnosis,
        verdict=verdict,
        findings=(first, *diagnosis.findings),
        mistake=wrong,
        machine=None if wrong.torn else put_right,
    )
