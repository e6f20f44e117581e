"""Which effect is hidden, and whether the data of the design can show it at all.

A benchmark that asks for what no data hold measures nothing. So a specimen is drawn again when less than VISIBLE of
its displacement is left beside set-up and base constants, or when its closest relative could take its place within
the noise: what that relative cannot imitate, squared and over the noise's variance, is less than TOLD_APART for an
effect of the usual size or its own, whichever is larger. (A design is not called bad because an effect is small.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from . import designs
from .draft import Draft
from .families import Family
from .motion import Array
from .physics import Entry, catalogue, foreign, location, vocabulary
from .situation import joined
from .visibility import View, first_order, relatives, sensitivities, view
from .world import Specimen

VISIBLE, FAINT = 0.4, 0.3
TOLD_APART, CONFUSED = 12.0, 4.0
SIGMA_MM, USUAL_MM = 0.003, 0.005
ROUNDS = 30


@dataclass(frozen=True, slots=True)
class Wish:
    """What the caller fixes; None is drawn. `index` walks evenly through topologies, sizes and catalogue rows."""

    index: int | None = None
    effect: str | None = None
    amplitude_um: float | None = None
    topology: str | None = None
    kind: str | None = None


def pick(rng: Generator, spec: Family, wish: Wish, draft: Draft, tries: int) -> Entry:
    """Half of the scenarios walk through the rows of the catalogue, the others draw from all its effects alike.

    The walk leaps, by machine and by round, so that the first few scenarios have as many rows as there are of them.
    """
    machine = draft.world.machine
    if spec.source == "location":
        return location.entry(machine, draft.notes["lacking"])
    entries = foreign(machine) if spec.source == "foreign" else catalogue(machine)
    if spec.source in ("blind", "pair"):
        kinds = ("pitch",) if spec.source == "blind" else ("curve", "backlash", "lateral play", "angular play")
        entries = tuple(e for e in entries if e.kind in kinds)
    if wish.effect and spec.hidden == 1:
        return next(e for e in entries if e.name == wish.effect)
    if wish.index is None or wish.index % 8 < 4 or tries > ROUNDS:
        return entries[int(rng.integers(len(entries)))]
    rows = sorted({e.row for e in entries})
    same = [e for e in entries if e.row == rows[(7 * (wish.index // 8) + 5 * (wish.index % 4)) % len(rows)]]
    return same[int(rng.integers(len(same)))]


def judge(
    rng: Generator, spec: Family, draft: Draft, seen_from: Array, specimen: Specimen, before: tuple[str, ...]
) -> dict[str, float] | None:
    """The closest relatives of a specimen, name to share of it that they imitate; None if it is not fair to ask for
    it.
    """
    truth = first_order(seen_from, specimen.twists(draft.situation))
    share, strength = left_share(draft.sight, truth), _strength(draft.sight, truth)
    if specimen.entry.name in before or not _shows(spec, share):
        return None
    if spec.source in ("foreign", "blind"):
        return {}
    known = vocabulary if spec.alone else catalogue
    rivals = tuple(e for e in known(draft.world.machine) if e.name != specimen.entry.name)
    kin = relatives(rng, draft.situation, draft.sight, seen_from, truth, rivals)
    closest = next(iter(kin))
    larger = max(1.0, USUAL_MM / specimen.moved_mm) ** 2
    apart = strength * (1 - kin[closest]) * (1.0 if spec.source == "pair" else larger)
    if any(kin.get(name, 0.0) > 0.8 for name in before):
        return None
    if spec.source == "pair":
        told = apart < CONFUSED and _told_by_more(rng, draft, specimen, next(e for e in rivals if e.name == closest))
        return _top(kin) if told else None
    if not (spec.extra or spec.alone) and apart < TOLD_APART:
        return None
    return _top(kin)


def _top(kin: dict[str, float]) -> dict[str, float]:
    return dict(list(kin.items())[:6])


def left_share(sight: View, truth: Array) -> float:
    """Share of a displacement's length that set-up and constants leave in what is seen."""
    seen = sight.observed(truth)
    return float(np.linalg.norm(sight.left(seen)) / np.linalg.norm(seen))


def _strength(sight: View, truth: Array) -> float:
    """Sum of squares of what they leave, over the noise's variance."""
    return float(np.sum(sight.left(sight.observed(truth)) ** 2)) / SIGMA_MM**2


def _shows(spec: Family, share: float) -> bool:
    if spec.source == "blind":
        return share < FAINT
    return share > (FAINT if spec.extra else VISIBLE)


def _told_by_more(rng: Generator, draft: Draft, specimen: Specimen, rival: Entry) -> bool:
    """Whether 54 more poses with the second tool, anywhere, tell a specimen from its closest relative."""
    s = draft.situation
    design = replace(designs.FREE, count=54, repeated=0, tools=1)
    other = tuple(x for x in s.machine.lengths if x != s.length[0])
    more = designs.lay_out(rng, s.machine, draft.topology, s.climate, other, design)
    both = joined([s, replace(more, set_id=more.set_id + 51)])
    sight = view(both, draft.handed_model, np.ones(len(both), dtype=bool), draft.kind)
    seen_from = sensitivities(both)
    truth = first_order(seen_from, specimen.twists(both))
    share = relatives(rng, both, sight, seen_from, truth, (rival,))[rival.name]
    return _strength(sight, truth) * (1 - share) > TOLD_APART
