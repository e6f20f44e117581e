"""What a name must show besides evidence: that it predicts, and that it matters."""

from __future__ import annotations

import numpy as np

from ncfix.diagnose import addition, holdout
from ncfix.diagnose.addition import Mask
from ncfix.diagnose.evidence import Court
from ncfix.diagnose.selection import Selected, judged
from ncfix.diagnose.view import View
from ncfix.diagnose.weighing import Scale
from ncfix.measure.measurement import Array
from ncfix.measure.solve import orthonormal, without

MATERIAL_UM = 0.8
"""An effect that moves the tool tip by less is not worth a name."""
RATHER = 0.5
"""An effect smaller than this share of what has no name is as good as part of it."""


def passed(scale: Scale, selected: Selected) -> Selected:
    """Without the names that do not predict held-out poses by more than one standard error, or are immaterial.

    One leaves at a time, the least likely first: the others may then be needed more.
    """
    while failed := _failed(scale, selected):
        weakest = min(failed, key=lambda name: selected.odds[name])
        selected = judged(scale, {name: each for name, each in selected.members.items() if name != weakest})
    return selected


def _failed(scale: Scale, selected: Selected) -> list[str]:
    members, court = list(selected.members.values()), scale.court
    if not selected.named:
        return []
    share = court.share(members)
    held = holdout.held_out(court, members, share)
    joint = addition.fitted(court, members, share)
    least = max(MATERIAL_UM, RATHER * nameless(court, selected, joint))
    found = []
    for k, name in enumerate(selected.members):
        mean, error = holdout.gain(held, held.less[k])
        predicts = mean > error or _stands_behind(scale, selected, name)
        if name in selected.named and (visible(court.background.view, joint.shown[k]) < least or not predicts):
            found.append(name)
    return found


def nameless(court: Court, selected: Selected, whole: addition.Joint, keep: Mask | None = None) -> float:
    """How much of what the names leave something without a name explains, rms um; `whole` is the fit with both."""
    if not selected.unnamed:
        return 0.0
    view, every = court.background.view, list(selected.members.values())
    told = addition.fitted(court, [selected.members[name] for name in selected.named], court.share(every))
    return float(np.sqrt(max(view.rms(told.after, keep) ** 2 - view.rms(whole.after, keep) ** 2, 0.0)))


def _stands_behind(scale: Scale, selected: Selected, name: str) -> bool:
    """Whether it is a constant beside effects that can do the same where it is left out."""
    return scale.court.constant(name) and not all(scale.court.constant(each) for each in selected.named)


def visible(view: View, shown: Array) -> float:
    """The size of what an effect shows, (m,) um, beside what is free: rms over rows, um."""
    free = orthonormal(view.base / view.relative[:, None])
    return view.rms(without(free, (shown / view.relative)[:, None])[:, 0] * view.relative)
