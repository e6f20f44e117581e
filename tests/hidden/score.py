"""One scenario, asked and judged: a flat record for the tally."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import remeasure
from .candidate import Answer, Candidate, Reported, ask
from .families import FAMILIES, Task
from .names import Named, matches, named
from .physics import vocabulary
from .scenario import Scenario, after_um, scenario

EXTRA_POSES = 12
FLAGGED_SHARE = 0.5
CLOSE = 0.5


@dataclass(frozen=True, slots=True)
class Record:
    """What came out of one scenario; None where a question does not arise. `rows` were handed over; of `fellows` names
    an ideal observer would not rule one out.
    """

    family: str
    index: int
    seed: int
    topology: str
    kind: str
    hidden: tuple[str, ...]
    rms_um: float
    fair: bool
    verdict: str
    reported: tuple[str, ...]
    first_right: bool | None
    in_set: bool | None
    all_right: bool | None
    set_size: float | None
    false_names: int
    unknown: bool
    closest: float
    family_right: bool | None
    gap_before_um: float
    gap_after_um: float | None
    gap_file_um: float
    floor_um: float
    resolved: bool | None
    resolved_by_random: bool | None
    seconds: float
    cpu_seconds: float
    error: str
    rows: int = 0
    fellows: tuple[str, ...] = ()

    @property
    def per_300_rows(self) -> float:
        """Processor seconds in proportion to the rows."""
        return 300 * self.cpu_seconds / self.rows


def run(task: Task, candidate: Candidate, keep: Path | None = None) -> Record:
    """Build the scenario of a task, ask the candidate, judge."""
    scene = scenario(task.seed, task.family, task.index)
    with tempfile.TemporaryDirectory(prefix="hidden-") as folder:
        base = (keep / f"{task.family}-{task.index:03d}") if keep else Path(folder)
        scene.write(base / "handed", base / "truth")
        answer = ask(candidate, base / "handed", scene.truth.without)
        after = _gap_after(scene, candidate, answer, base) if FAMILIES[task.family].gap else None
        resolved = _resolved(scene, candidate, answer, base) if FAMILIES[task.family].source == "pair" else (None, None)
    return judged(task, scene, answer, after, resolved)


def judged(
    task: Task,
    scene: Scenario,
    answer: Answer,
    after: float | None,
    resolved: tuple[bool | None, bool | None] = (None, None),
) -> Record:
    """The record of an answer."""
    truth, truths = scene.truth, scene.truth.named()
    first = answer.effects[0] if answer.effects else None
    sets = [effect for effect in answer.effects if any(_in_set(effect, t) for t in truths)]
    gaps, size = truth.gaps_um, max((e.get("rms_um", 0.0) for e in truth.effects), default=0.0)
    flagged = answer.verdict == "unknown-effect" or (size > 0 and answer.unknown_um >= FLAGGED_SHARE * size)
    return Record(
        family=task.family, index=task.index, seed=task.seed, topology=truth.topology, kind=truth.kind,
        hidden=tuple(t.name for t in truths), rms_um=size, fair=bool(truth.notes.get("fair", True)),
        verdict=answer.verdict, reported=tuple(e.name for e in answer.effects),
        first_right=bool(first and any(_is(first, t) for t in truths)) if truths else None,
        in_set=all(any(_in_set(e, t) for e in answer.effects) for t in truths) if truths else None,
        all_right=_all_right(answer.effects, truths) if truths else None,
        set_size=float(np.mean([_size(e) for e in sets or answer.effects])) if truths and answer.effects else None,
        false_names=sum(not any(_in_set(e, t) or _may_be(task, e, t) for t in truths) for e in answer.effects),
        unknown=flagged, closest=max(truth.relatives.values(), default=0.0),
        family_right=_family_right(scene, first) if truth.without else None,
        gap_before_um=gaps["before"], gap_after_um=after, gap_file_um=gaps["file"], floor_um=gaps["floor"],
        resolved=resolved[0], resolved_by_random=resolved[1], seconds=answer.seconds,
        cpu_seconds=answer.cpu_seconds, error=answer.error, rows=int(scene.given.sum()),
        fellows=tuple(truth.notes.get("fellows", ())),
    )  # fmt: skip


def _is(effect: Reported, truth: Named) -> bool:
    return matches(truth, effect.name, effect.title, effect.axis)


def _in_set(effect: Reported, truth: Named) -> bool:
    return _is(effect, truth) or any(matches(truth, alias) for alias in effect.aliases)


def _may_be(task: Task, effect: Reported, truth: Named) -> bool:
    """Where the poses are blind to an effect, the little of it that shows is a curve of the same component."""
    return FAMILIES[task.family].source == "blind" and any(symbol in effect.name for symbol in truth.symbols)


def _size(effect: Reported) -> int:
    return len({effect.name, *effect.aliases})


def _all_right(effects: Sequence[Reported], truths: Sequence[Named]) -> bool:
    """Every hidden effect is a name of the answer itself, not one of its aliases."""
    return all(any(_is(effect, truth) for effect in effects) for truth in truths)


def _family_right(scene: Scenario, first: Reported | None) -> bool:
    """Whether the first name is of the deleted effect's family, or one of its measured close relatives."""
    if first is None:
        return False
    truth = scene.truth.named()[0]
    meant = [
        entry
        for entry in vocabulary(scene.draft.world.machine)
        if matches(named(entry), first.name, first.title, first.axis)
    ]
    return any(e.family == truth.family or scene.truth.relatives.get(e.name, 0.0) >= CLOSE for e in meant)


def _gap_after(scene: Scenario, candidate: Candidate, answer: Answer, base: Path) -> float | None:
    """The held-out gap of the machine file that the answer wrote, um: the one that was handed over if it wrote none.

    None where that file cannot be read.
    """
    machine = answer.machine or base / "handed" / "machine.toml"
    plan = base / "handed" / "plan.csv"
    plan.write_text(scene.plan)
    try:
        return after_um(scene, candidate.predict(machine, plan))
    except Exception:
        return None


def _resolved(scene: Scenario, candidate: Candidate, answer: Answer, base: Path) -> tuple[bool, bool]:
    """Whether the truth stands alone after the proposed poses are measured, and after as many random ones.

    Who proposes none has given the last answer already.
    """
    seed = scene.truth.seed
    proposed = answer.next_poses[:EXTRA_POSES]
    chance = _asked_again(scene, candidate, base, remeasure.at_random(scene, EXTRA_POSES, seed))
    if not proposed:
        return _alone(scene, answer), _alone(scene, chance)
    chosen = _asked_again(scene, candidate, base, remeasure.at_poses(scene, proposed, seed))
    return _alone(scene, chosen), _alone(scene, chance)


def _asked_again(scene: Scenario, candidate: Candidate, base: Path, text: str) -> Answer:
    more = base / "handed" / "more.csv"
    more.write_text(text)
    return ask(candidate, base / "handed", more=[more])


def _alone(scene: Scenario, answer: Answer) -> bool:
    first = answer.effects[0] if answer.effects else None
    truth = scene.truth.named()[0]
    return bool(first and _is(first, truth) and all(matches(truth, alias) for alias in first.aliases))


def as_row(record: Record) -> dict[str, Any]:
    """A record as a JSON line holds it."""
    return asdict(record)


def from_row(row: dict[str, Any]) -> Record:
    """The record of a JSON line."""
    lists = {k: tuple(v) for k, v in row.items() if isinstance(v, list)}
    return Record(**{**row, **lists})
