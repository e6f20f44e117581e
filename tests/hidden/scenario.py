"""A scenario: what is handed over (machine file, measurement files) and, apart from it, the truth.

`scenario(seed, family)` is a pure function: the same numbers give the same bytes.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from . import files, instruments
from .choose import choose
from .draft import Draft
from .families import FAMILIES, Family
from .instruments import SILENT, Noise, Setup, draw_instrument
from .model import machine_toml
from .motion import Array, Mask
from .names import Named
from .pick import Wish
from .situation import Situation
from .visibility import View
from .world import World, rms


@dataclass(frozen=True, slots=True)
class Truth:
    """What the code under test never sees. Lengths in um; `gaps` holds rms lengths on the held-out poses, free of
    noise.
    """

    seed: int
    family: str
    topology: str
    kind: str
    design: str
    effects: tuple[dict[str, Any], ...]
    without: tuple[str, ...]
    relatives: dict[str, float]
    gaps_um: dict[str, float]
    outlier_rows: tuple[int, ...]
    notes: dict[str, Any] = field(default_factory=dict)

    def named(self) -> list[Named]:
        """The hidden effects as far as names go."""
        return [Named(e["name"], e["kind"], e["axis"], tuple(e["symbols"]), e["family"]) for e in self.effects]


@dataclass(frozen=True, slots=True)
class Scenario:
    """Handed-over files by name, the truth, and the true tips of all rows (given and held out) with their plan.

    `draft` keeps the real machine, to measure on it again (`remeasure.py`).
    """

    handed: dict[str, str]
    truth: Truth
    plan: str
    tips: Array
    given: Mask
    draft: Draft
    setup: Setup
    noise: Noise

    def write(self, handed: Path, truth: Path) -> None:
        """Both parts, into folders that must not be one."""
        if handed.resolve() == truth.resolve():
            raise ValueError("the truth does not belong where the code under test looks")
        for folder in (handed, truth):
            folder.mkdir(parents=True, exist_ok=True)
        for name, text in self.handed.items():
            (handed / name).write_text(text)
        (truth / "truth.json").write_text(self.truth_json())
        (truth / "plan.csv").write_text(self.plan)

    def truth_json(self) -> str:
        """The truth as a file."""
        content = {name: getattr(self.truth, name) for name in Truth.__dataclass_fields__}
        return json.dumps(content, indent=1, default=_plain)


def scenario(
    seed: int,
    family: str,
    index: int | None = None,
    effect: str | None = None,
    amplitude_um: float | None = None,
    topology: str | None = None,
    kind: str | None = None,
    silent: bool = False,
) -> Scenario:
    """Build one. `index` walks evenly through topologies, sizes and catalogue rows; without it they are drawn.

    `effect`, `amplitude_um`, `topology`, `kind` fix what would be drawn; `silent` leaves out noise and outliers.
    """
    spec = FAMILIES[family]
    rng = np.random.default_rng([seed, list(FAMILIES).index(family)])
    draft = choose(rng, spec, Wish(index, effect, amplitude_um, topology, kind))
    noise = SILENT if silent else draw_instrument(rng, spec.clean)
    setup = instruments.draw_setup(rng, draft.situation, draft.kind)
    handed, outliers = _handed(rng, draft, setup, noise)
    tips = draft.world.displacement(draft.situation)
    truth = _truth(seed, spec, draft, tips, outliers, noise)
    return Scenario(handed, truth, files.plan(draft.situation), tips, draft.given, draft, setup, noise)


def observe(world: World, s: Situation, kind: str, setup: Setup) -> Array:
    """Measured values without noise, (n, 3) or (n, 1), mm."""
    if kind == "probe":
        return instruments.probe(s, world.tips, setup)
    instrument = instruments.tcp if kind == "tcp" else instruments.length
    return instrument(s, world.tips, setup)


def _handed(rng: Generator, draft: Draft, setup: Setup, noise: Noise) -> tuple[dict[str, str], tuple[int, ...]]:
    """The files that the code under test gets; and which given rows are outliers."""
    s = draft.situation.rows(np.flatnonzero(draft.given))
    values = observe(draft.world, s, draft.kind, setup)
    drawn, bad = instruments.draw_noise(rng, noise, s.time, values.shape[1])
    values = values + drawn
    stated = noise.sigma_um if rng.random() < 0.3 else None
    parts = [s.set_id >= 0] if rng.random() < 0.7 else [s.set_id % 2 == 0, s.set_id % 2 == 1]
    distances = _distances(rng, s, setup) if draft.kind == "probe" else ()
    factors = draft.mistake.factors if draft.mistake else {}
    texts = [files.measurement(s.rows(p), draft.kind, values[p], stated, distances, factors) for p in parts if p.any()]
    handed = {f"measured-{i + 1}.csv": text for i, text in enumerate(texts)}
    return {"machine.toml": machine_toml(draft.handed_machine, draft.handed_model), **handed}, tuple(map(int, bad))


def _distances(rng: Generator, s: Situation, setup: Setup) -> tuple[str, ...]:
    """Two calibrated distances between balls, 1.2 um uncertain at two sigma."""
    centre = {}
    places = s.ball()
    for k in np.unique(s.set_id // 2):
        row = int(np.flatnonzero(s.set_id // 2 == k)[0])
        centre[int(k)] = places[row] + setup.balls[int(s.set_id[row])]
    names = sorted(centre)
    lines = []
    for a, b in zip(names[:2], names[-2:], strict=True):
        true = float(np.linalg.norm(centre[a] - centre[b]))
        lines.append(f"{a + 1} {b + 1} {true + rng.normal(scale=0.0006):.4f} 0.0012")
    return tuple(lines)


def _truth(seed: int, spec: Family, draft: Draft, tips: Array, outliers: tuple[int, ...], noise: Noise) -> Truth:
    effects = tuple(_effect(draft, i) for i in range(len(draft.world.hidden)))
    if draft.mistake:
        m = draft.mistake
        effects = ({"name": m.name, "kind": m.kind, "axis": m.axis, "symbols": (), "family": "mistake", "row": 51},)
    without = tuple(e["name"] for e in effects) if spec.alone else ()
    return Truth(
        seed, spec.name, draft.topology, draft.kind, draft.design.name, effects, without, draft.relatives,
        gaps(draft, tips, noise), outliers, draft.notes,
    )  # fmt: skip


def _effect(draft: Draft, index: int) -> dict[str, Any]:
    specimen = draft.world.hidden[index]
    entry = specimen.entry
    everywhere = replace(draft.world, hidden=(specimen,), clutter=()).of_hidden(draft.situation)
    alone, seen = everywhere[draft.given], draft.sight.observed(everywhere)
    share = np.linalg.norm(draft.sight.left(seen)) / np.linalg.norm(seen)
    kept = ("name", "row", "kind", "axis", "symbols", "family")
    return {k: getattr(entry, k) for k in kept} | {
        "rms_um": 1e3 * rms(alone),
        "max_um": 1e3 * float(np.max(np.linalg.norm(alone, axis=1))),
        "visible_share": float(share),
    }


def gaps(draft: Draft, tips: Array, noise: Noise) -> dict[str, float]:
    """`file`: the machine file as handed over; `before`: the same after a refit of its constants, which no name is
    needed for; `floor`: clutter and the fit's own noise, with nothing hidden. A mistake makes them meaningless: zeros.
    """
    if draft.mistake:
        return dict.fromkeys(("file", "before", "floor"), 0.0)
    s, sight = draft.situation, draft.sight
    known = draft.handed_model.displacement(draft.handed_machine, s.q, s.length)
    bare = replace(draft.world, hidden=(), control=None).displacement(s)
    clutter = sight.gap(bare - draft.model.displacement(draft.world.machine, s.q, s.length))
    return {
        "file": 1e3 * sight.gap(tips - known, refit_base=False),
        "before": 1e3 * sight.gap(tips - known),
        "floor": float(np.hypot(1e3 * clutter, sight.noise_gap(noise.sigma_um))),
    }


def after_um(scene: Scenario, predicted: Array) -> float:
    """The gap on the held-out poses when `predicted` (n, 3), mm, are a model's tip errors at all rows of the plan."""
    view: View = scene.draft.sight
    return 1e3 * view.gap(scene.tips - predicted, refit_base=False)


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    return list(value)
