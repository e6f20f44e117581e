"""What a scenario is about: machine, design, and the hidden effects; drawn so that the design can show them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.random import Generator

from . import climate, designs, mistakes, workshop
from .chain import Machine
from .designs import Design
from .draft import Draft
from .families import Family
from .model import Model
from .physics import catalogue, location
from .pick import FAINT, ROUNDS, Wish, judge, left_share, pick
from .visibility import first_order, sensitivities, view
from .world import Specimen, World, draw_clutter, sized

PAIRED = ("wCBXFZYSt", "wCAYFXZSt", "wXFYZSt")
PATIENCE = 8
KIND_SHARE = {"tcp": 0.6, "probe": 0.3, "length": 0.1}


def choose(rng: Generator, spec: Family, wish: Wish) -> Draft:
    """A machine, a day and a design; then what is wrong with it."""
    topologies = PAIRED if spec.source == "pair" else workshop.TOPOLOGIES
    topology = wish.topology or topologies[_turn(rng, wish, len(topologies))]
    if spec.source == "mistake":
        return _with_mistake(rng, spec, wish, topology)
    machine = workshop.draw_machine(rng, topology)
    model = workshop.draw_model(rng, machine, topology)
    kind = wish.kind or _kind(rng, spec, topology)
    draft = _measured(rng, spec, topology, machine, model, kind)
    if spec.source == "location":
        draft = _lacking(rng, draft, wish)
    return _hide(rng, spec, wish, draft)


def _turn(rng: Generator, wish: Wish, count: int) -> int:
    return int(rng.integers(count)) if wish.index is None else wish.index % count


def _kind(rng: Generator, spec: Family, topology: str) -> str:
    """Three in ten are probed, one in ten has lengths; where nothing turns, unknown balls tell nothing."""
    drawn = str(rng.choice(list(KIND_SHARE), p=list(KIND_SHARE.values())))
    wanted = drawn if len(spec.layouts) == 3 else "tcp"
    return "tcp" if wanted == "probe" and topology == "wXFYZSt" else wanted


def _layout(rng: Generator, spec: Family, topology: str, kind: str) -> Design:
    wanted = {"probe": ("balls",), "length": ("bars",), "tcp": ("balls", "free")}[kind]
    design = spec.layouts[int(rng.choice([i for i, d in enumerate(spec.layouts) if d.layout in wanted]))]
    return replace(design, layout="free") if topology == "wXFYZSt" and kind == "tcp" else design


def _measured(rng: Generator, spec: Family, topology: str, machine: Machine, model: Model, kind: str) -> Draft:
    """The draft without anything hidden, with its clutter."""
    design = _layout(rng, spec, topology, kind)
    lengths = machine.lengths[:: 1 if rng.random() < 0.5 else -1]
    s = designs.lay_out(rng, machine, topology, climate.draw_climate(rng), lengths, designs.varied(rng, design))
    given = ~designs.held_out(rng, s, rng.uniform(0.2, 0.3))
    sight = view(s, model, given, kind)
    return Draft(topology, design, kind, s, given, sight, World(machine, model), model, machine, model)


def _hide(rng: Generator, spec: Family, wish: Wish, draft: Draft) -> Draft:
    """Hidden effects first, then a little of everything else."""
    seen_from = sensitivities(draft.situation)
    rows, near = draft.situation.rows(np.flatnonzero(draft.given)), seen_from[draft.given]
    size = 1e-3 * (wish.amplitude_um or spec.amplitudes_um[_turn(rng, _walk(wish, 4), len(spec.amplitudes_um))])
    hidden: list[Specimen] = []
    kin: dict[str, float] = {}
    fellows: tuple[str, ...] = ()
    tries, fair = 0, True
    while len(hidden) < spec.hidden:
        tries += 1
        entry = pick(rng, spec, wish, draft, tries)
        specimen = sized(draft.world, entry, entry.specimen(rng), rows, near, size)
        verdict = judge(rng, spec, draft, seen_from, specimen, tuple(h.entry.name for h in hidden))
        if verdict is not None or tries > PATIENCE * ROUNDS:
            hidden.append(specimen)
            fair = fair and verdict is not None
            kin, fellows = (verdict.kin, verdict.fellows) if verdict else ({}, ())
    world = replace(draft.world, hidden=tuple(hidden))
    if spec.clutter_um:
        others = tuple(e for e in catalogue(world.machine) if e.name not in {h.entry.name for h in hidden})
        world = draw_clutter(rng, world, others, draft.situation, seen_from, draft.sight, 1e-3 * spec.clutter_um)
    return replace(
        draft, world=world, relatives=kin, notes=draft.notes | {"draws": tries, "fair": fair, "fellows": fellows}
    )


def _walk(wish: Wish, by: int) -> Wish:
    return wish if wish.index is None else replace(wish, index=wish.index // by)


def _lacking(rng: Generator, draft: Draft, wish: Wish) -> Draft:
    """One line error is not in the file, and its constant is not free; one that the others cannot stand in for."""
    names = [term.name for term in draft.model.terms if term.located]
    for name in [wish.effect] if wish.effect else rng.permutation(names):
        model = draft.model.without(str(name))
        sight = view(draft.situation, model, draft.given, draft.kind)
        specimen = location.entry(draft.world.machine, str(name)).draw(rng)
        if left_share(sight, first_order(sensitivities(draft.situation), specimen(draft.situation))) > FAINT:
            break
    world = replace(draft.world, model=model)
    return replace(draft, model=model, handed_model=model, world=world, sight=sight, notes={"lacking": str(name)})


def _with_mistake(rng: Generator, spec: Family, wish: Wish, topology: str) -> Draft:
    """A calibrated machine, its measurement, and a mistake that moves the data by more than 6 um."""
    kind = wish.effect or mistakes.KINDS[_turn(rng, wish, len(mistakes.KINDS))]
    if kind in mistakes.NEEDS_ROTARY and topology == "wXFYZSt":
        topology = workshop.TOPOLOGIES[int(rng.integers(3))]
    for _ in range(ROUNDS):
        machine = workshop.draw_machine(rng, topology)
        model = workshop.draw_model(rng, machine, topology, rich=True)
        mistake = mistakes.draw(rng, kind, machine, model)
        draft = _measured(rng, spec, topology, machine, model, mistake.instrument)
        world = replace(draft.world, control=mistake.control)
        draft = replace(draft, world=world, mistake=mistake, handed_machine=mistake.machine, handed_model=mistake.model)
        if mistake.instrument == "probe" or _shows(draft):
            break
    seen_from = sensitivities(draft.situation)
    entries = catalogue(machine)
    free = view(draft.situation, model, draft.given, draft.kind)
    world = draw_clutter(rng, world, entries, draft.situation, seen_from, free, 1e-3 * spec.clutter_um)
    return replace(draft, world=world)


def _shows(draft: Draft) -> bool:
    """Whether data and file disagree by 6 um rms where only the set-up is free."""
    s, m = draft.situation, draft.mistake
    assert m is not None
    told = s.q.copy()
    for name, factor in m.factors.items():
        told[:, s.machine.axes.index(name)] *= factor
    gap = draft.world.displacement(s) - m.model.displacement(m.machine, told, s.length)
    values = draft.sight.observed(gap)
    setup = replace(draft.sight, base=draft.sight.base[:, :, :0])
    return float(np.sqrt(3 * np.mean(setup.left(values) ** 2))) > 6e-3
