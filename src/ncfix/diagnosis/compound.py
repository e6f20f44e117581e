"""Findings of a diagnosis, and findings that are reported as one: a common temperature, a squareness.

Scales of all axes that are off by the same share are what a temperature does: one finding, stated in kelvin. A
squareness is one error, whichever of its two axes carries it in a machine file.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ncfix.arrays import Array
from ncfix.diagnosis.assessment import Plausibility
from ncfix.diagnosis.catalogue import Candidate
from ncfix.diagnosis.constants import MovedConstant
from ncfix.diagnosis.residual_data import ResidualData
from ncfix.machine import Effect
from ncfix.machine.basis import Polynomial
from ncfix.values import frozen

LIKE = 0.25
"""Largest difference of scale errors from their mean, as a share of it, at which one temperature explains them."""
STEEL = 11.5e-6
"""Thermal expansion of steel, 1/K."""
SCALE = re.compile(r"(?:scale |constant E(?=[XYZ][XYZ]$))([XYZ])\1?$")
LINE = re.compile(r"(constant )?E([ABC])0([XYZ])$")


@frozen(repr=False, slots=False)
class EffectFinding:
    """One named effect.

    candidate   the effect in the catalogue
    odds        log odds that it is there, given the others; p_value: probability that noise gives any name such odds
    aliases     names that explain the same data nearly as well
    size_um     rms of its effect on the values
    effects     the effects added to the machine file; empty if it belongs to the measurement
    shown       (m,) its effect on the values, um
    judgement   plausibility of its coefficients; None if it has none
    """

    candidate: Candidate
    odds: float
    p_value: float
    aliases: tuple[str, ...]
    size_um: float
    effects: tuple[Effect, ...]
    shown: Array
    judgement: Plausibility | None = None


def compound(
    data: ResidualData, findings: Sequence[EffectFinding], moved: Sequence[MovedConstant]
) -> tuple[EffectFinding, ...]:
    """The findings, with equal scale errors merged into one temperature and squareness named as such."""
    return _temperature(data, [_squareness(each) for each in findings], moved)


def _squareness(finding: EffectFinding) -> EffectFinding:
    """The finding, titled as the squareness of two axes if it is the tilt of one with that of the other as an alias."""
    own = LINE.match(finding.candidate.name)
    aliases = (LINE.match(name) for name in finding.aliases)
    other = next((each for each in aliases if own and each and each[2] == own[2] and each[3] != own[3]), None)
    if own is None or other is None:
        return finding
    pair = " and ".join(sorted((own[3], other[3])))
    title = f"squareness of {pair}, carried by {own[3]} or {other[3]}: {finding.candidate.title}"
    return replace(finding, candidate=replace(finding.candidate, title=title))


def _temperature(
    data: ResidualData, findings: Sequence[EffectFinding], moved: Sequence[MovedConstant]
) -> tuple[EffectFinding, ...]:
    """The findings, with the scale errors of all moved linear axes merged into one if they are nearly equal."""
    changes = {f"constant {each.name}": each.data - each.file for each in moved}
    shares = {}
    for each in findings:
        if found := SCALE.match(each.candidate.name):
            shares[found[1]] = (each, _share(each, changes.get(each.candidate.name)))
    gains = np.array([share for _, share in shares.values()])
    if len(gains) < 2 or set(shares) != {axis.name for axis in data.measured.linear}:
        return tuple(findings)
    mean = float(gains.mean())
    if np.abs(gains - mean).max() > LIKE * abs(mean):
        return tuple(findings)
    scales = [each for each, _ in shares.values()]
    warm = "colder" if mean < 0 else "warmer"
    title = (
        f"the scales of {' and '.join(sorted(shares))} all have an error of {1e6 * mean:+.1f} um/m, as if the "
        f"machine were {abs(mean) / STEEL:.1f} K {warm} than the part, both of steel"
    )
    names = {each.candidate.name for each in scales}
    owner = Candidate("temperature", title, "", "temperature", (), (), remedy="measure and cut at one temperature")
    whole = replace(
        scales[0],
        candidate=owner,
        odds=max(each.odds for each in scales),
        p_value=min(each.p_value for each in scales),
        aliases=tuple(name for each in scales for name in each.aliases if name not in names),
        size_um=float(np.sqrt(sum(each.size_um**2 for each in scales))),
        effects=tuple(effect for each in scales for effect in each.effects),
        shown=np.sum([each.shown for each in scales], axis=0),
        judgement=None,
    )
    place = findings.index(scales[0])
    rest = [each for each in findings if each not in scales]
    return (*rest[:place], whole, *rest[place:])


def _share(finding: EffectFinding, change: float | None) -> float:
    """Relative scale error of a finding: of its linear effect, or the change of the file's constant; NaN if neither."""
    effect: Effect = finding.effects[0]
    if not isinstance(effect.basis, Polynomial) or effect.basis.degree != (1,):
        return float("nan")
    return float(effect.coefficients[0] if change is None else change) / effect.scale
