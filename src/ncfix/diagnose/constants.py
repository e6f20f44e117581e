"""Constants of the machine that its file lacks: where axes lie, gains. They go before all that is not one.

Every machine has them, and almost any curve or sag looks like one in part. So names of other effects are looked for
with all of them free; which constants are there is asked afterwards, beside what was found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ncfix.diagnose.background import background
from ncfix.diagnose.evidence import Court
from ncfix.diagnose.groups import Group
from ncfix.diagnose.selection import Selected, asked, judged
from ncfix.diagnose.view import View


def freed(court: Court) -> Court:
    """The same with the lacking constants as free as those that the file has; the same where it lacks none."""
    lacking = [group for group in court.groups[: court.named] if group.owner.constant]
    if not lacking:
        return court
    ground = court.background
    view = with_base(ground.view, lacking)
    named = [group for group in court.groups[: court.named] if not group.owner.constant]
    return Court(background(view, named, ground.relative, bool(ground.wander)), court.groups, court.named, True)


def with_base(view: View, lacking: Sequence[Group]) -> View:
    """The data with these as part of what is free anyway."""
    return replace(view, base=np.concatenate([view.base, *(group.columns for group in lacking)], axis=1))


def added(court: Court, selected: Selected) -> Selected:
    """The constants that are there beside what has no name, and then with what was found.

    They are looked for before other names have taken their part; with those, they leave only where they are denied.
    """
    offered = [name for name in court.names if court.constant(name)]
    there = {name: selected.members[name] for name in selected.unnamed}
    steps = list(selected.steps)
    while True:
        evidence = court.heard(list(there.values()))
        odds = {name: evidence.of(court.forms[name]) for name in offered if name not in there}
        best = max(odds, key=lambda name: odds[name], default=None)
        if best is None or odds[best] < asked(court, selected.null, there):
            break
        steps.append((best, odds[best]))
        there[best] = evidence.best(court.forms[best])
    return judged(court, {**there, **selected.members}, selected.first, selected.null, steps)
