"""Which effect is hidden, and whether the data of the design can show it at all.

A benchmark that asks for what no data hold measures nothing. So a specimen is drawn again when less than VISIBLE of
its displacement is left beside set-up and base constants, or when even an ideal observer (`ideal.py`) would give less
than twenty to one for its name against any other that may be said, or another name could take its place within the
noise (what it cannot imitate, squared and over the noise's variance, is less than TOLD_APART), at the effect's own or
the usual size, whichever is larger. (A design is not called bad because an effect is small.) In families that spoil the
design on purpose, it is drawn all the same, and the names that nobody could rule out are noted: there their set is
right, and the first is not asked.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from . import designs
from .draft import Draft
from .families import Family
from .ideal import observer
from .motion import Array
from .names import matches, named
from .physics import Entry, catalogue, foreign, location, vocabulary
from .situation import joined
from .visibility import View, first_order, relatives, sensitivities, view
from .world import Specimen

VISIBLE, FAINT, HIDDEN = 0.4, 0.3, 0.15
CLOSE_ENOUGH, STRANGE, CLUTTER_MM = 0.3, 0.5, 0.001
TOLD_APART, CONFUSED = 12.0, 4.0
SIGMA_MM, USUAL_MM = 0.003, 0.005
ROUNDS = 30
PLAYS = ("backlash", "lateral play", "angular play")
"""What cannot show where every axis comes from one side: its mean is a constant, and its change is that of a curve."""


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
    if draft.design.one_sided:
        entries = tuple(e for e in entries if e.kind not in PLAYS)
    if spec.source in ("blind", "pair"):
        kinds = ("pitch",) if spec.source == "blind" else ("curve", *PLAYS)
        entries = tuple(e for e in entries if e.kind in kinds)
    if wish.effect and spec.hidden == 1:
        return next(e for e in entries if e.name == wish.effect)
    if wish.index is None or wish.index % 8 < 4 or tries > ROUNDS:
        return entries[int(rng.integers(len(entries)))]
    rows = sorted({e.row for e in entries})
    same = [e for e in entries if e.row == rows[(7 * (wish.index // 8) + 5 * (wish.index % 4)) % len(rows)]]
    return same[int(rng.integers(len(same)))]


@dataclass(frozen=True, slots=True)
class Verdict:
    """Of a specimen that may be hidden: its closest relatives, name to share of it that they imitate; and the names
    that nobody could rule out.
    """

    kin: dict[str, float]
    fellows: tuple[str, ...] = ()


def judge(
    rng: Generator, spec: Family, draft: Draft, seen_from: Array, specimen: Specimen, before: tuple[str, ...]
) -> Verdict | None:
    """None if it is not fair to ask for this specimen."""
    truth = first_order(seen_from, specimen.twists(draft.situation))
    if specimen.entry.name in before or not _shows(spec, left_share(draft.sight, truth)):
        return None
    if spec.source == "blind":
        return Verdict({})
    rivals = tuple(e for e in vocabulary(draft.world.machine) if not matches(named(specimen.entry), e.name))
    kin = relatives(rng, draft.situation, draft.sight, seen_from, truth, rivals)
    if spec.source == "foreign":
        return Verdict(_top(kin)) if max(kin.values()) < STRANGE else None
    if any(kin.get(name, 0.0) > 0.8 for name in before):
        return None
    if spec.source == "pair":
        return Verdict(_top(kin)) if _told_later(rng, spec, draft, specimen, truth, kin, rivals) else None
    larger = max(1.0, USUAL_MM / specimen.moved_mm)
    fellows = _fellows(rng, draft, seen_from, specimen.entry, larger * truth, kin, rivals)
    if fellows and not (spec.extra or spec.alone):
        return None
    return Verdict(_top(kin), fellows)


def _fellows(
    rng: Generator,
    draft: Draft,
    seen_from: Array,
    entry: Entry,
    truth: Array,
    kin: dict[str, float],
    rivals: tuple[Entry, ...],
) -> tuple[str, ...]:
    """Names that nobody could rule out: what they cannot imitate of the truth is too little beside the noise, or an
    ideal observer would give less than twenty to one against them.
    """
    strength = _strength(draft.sight, truth)
    alike = {name for name, share in kin.items() if strength * (1 - share) < TOLD_APART}
    close = tuple(e for e in rivals if kin[e.name] > CLOSE_ENOUGH)
    if close:
        shares = len(vocabulary(draft.world.machine)) + draft.sight.base.shape[2]
        every, clutter = (entry, *close), CLUTTER_MM / np.sqrt(shares)
        eye = observer(rng, draft.situation, draft.sight, seen_from, every, SIGMA_MM, clutter)
        alike |= set(eye.fellows(entry.name, truth))
    return tuple(sorted(alike))


def _told_later(
    rng: Generator,
    spec: Family,
    draft: Draft,
    specimen: Specimen,
    truth: Array,
    kin: dict[str, float],
    rivals: tuple[Entry, ...],
) -> bool:
    """Whether the closest relative could take its place within the noise, and no relative once there are more poses;
    the latter is not asked where the design is poor on purpose.
    """
    strength = _strength(draft.sight, truth)
    alike = {name for name, share in kin.items() if strength * (1 - share) < TOLD_APART}
    confused = strength * (1 - max(kin.values())) < CONFUSED
    return confused and (spec.extra or _told_by_more(rng, draft, specimen, tuple(e for e in rivals if e.name in alike)))


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
        return share < HIDDEN
    return share > (FAINT if spec.extra else VISIBLE)


def _told_by_more(rng: Generator, draft: Draft, specimen: Specimen, rivals: tuple[Entry, ...]) -> bool:
    """Whether 54 more poses with the second tool, anywhere, tell a specimen from all of its rivals."""
    s = draft.situation
    design = replace(designs.FREE, count=54, repeated=0, tools=1)
    other = tuple(x for x in s.machine.lengths if x != s.length[0])
    more = designs.lay_out(rng, s.machine, draft.topology, s.climate, other, design)
    both = joined([s, replace(more, set_id=more.set_id + 51)])
    sight = view(both, draft.handed_model, np.ones(len(both), dtype=bool), draft.kind)
    seen_from = sensitivities(both)
    truth = first_order(seen_from, specimen.twists(both))
    share = max(relatives(rng, both, sight, seen_from, truth, rivals).values())
    return _strength(sight, truth) * (1 - share) > TOLD_APART
