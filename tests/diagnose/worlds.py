"""Measurements of machines that lack something, to see how often the diagnosis is right and to set its constants.

The machine's own Jacobian carries the effects, but not their shapes: curves are drawn from random waves or are a local
bump, harmonics and plays are drawn anew, and every effect swells and shrinks along some axis by a quarter. What is
thermal follows the warmth of a body that no sensor sees well (warmth.py). Noise has long tails, outliers and memory; a
little of every other effect (1 um rms together) is there in "clutter".
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.random import Generator

from diagnose.warmth import Warmth
from measure.poses import machine
from ncfix.diagnosis.catalogue import Candidate, catalogue
from ncfix.diagnosis.forms import VisibleForms, visible_forms
from ncfix.diagnosis.residual_data import ResidualData, residual_data
from ncfix.machine import Effect, Machine
from ncfix.machine.basis import ConstantBasis
from ncfix.measure.candidates import Room, candidates
from ncfix.measure.instruments import Faults, simulate
from ncfix.measure.measurement import Array, Measurement

SIGMA_UM = 3.0
SETS, REPEATED, TIMES = 4, 12, 5
"""Set-ups (tool and load), and poses that are taken several times one after another."""
SWELLS = 0.25
"""How much an effect swells and shrinks along some axis, a share of its size."""
BUMPS = 0.2
"""Share of the curves that are a local bump."""
PAUSES_S = (50.0, 150.0)
"""Mean time between poses, from world to world."""
THERMAL = ("heat", "spindle")
"""Families of what warms."""
STILL: dict[str, Any] = {
    "basis": ConstantBasis(), "coefficients": (0.0,), "input": None, "time_constant_s": None,
    "center": 0.0, "scale": 1.0,
}  # fmt: skip
"""An effect without what drives it."""
FOREIGN = ("field", "drag", "slips", "walk", "triple", "history")


@dataclass(frozen=True, repr=False)
class World:
    """A machine that is known but for what will be hidden, and poses at which it is measured.

    plain   the measurement without any error
    warmth  what warmed meanwhile
    """

    machine: Machine
    plain: Measurement
    warmth: Warmth

    @classmethod
    def of(cls, name: str, seed: int, poses: int = 180, kind: str = "tcp") -> World:
        """One of the test machines with location errors of its own: poses all over, or styluses in balls (probe)."""
        random = np.random.default_rng(10_000 + seed)
        known = machine(name)
        located = [effect for effect in known.effects if effect.location]
        own = [replace(each, coefficients=_constants(each, random)) for each in located]
        known = known.replace(effects=tuple(own))
        plan, warmth = _plan(known, poses, kind, random)
        return cls(known, simulate(plan, known, Faults(0.0), seed), warmth)

    @cached_property
    def data(self) -> ResidualData:
        return residual_data([self.plain], self.machine)

    @cached_property
    def candidates(self) -> tuple[Candidate, ...]:
        return catalogue(self.data.measured)

    @cached_property
    def visible(self) -> VisibleForms:
        return visible_forms(self.data, self.candidates)

    @cached_property
    def names(self) -> list[str]:
        """What may be hidden: all that the poses show, but for constants and what stands on the table."""
        shown = {group.owner.name for group in self.visible.groups if not (group.owner.constant or group.owner.grows)}
        return sorted(each.name for each in self.candidates if each.name in shown and "location" not in each.family)

    @cached_property
    def u(self) -> dict[str, Array]:
        """Every axis as -1 ... 1."""
        found = {}
        for index, axis in enumerate(self.machine.axes):
            low, high = self.data.measured.spans[axis.name]
            found[axis.name] = (2 * self.data.q[:, index] / axis.unit - low - high) / (high - low)
        return found

    def candidate(self, name: str) -> Candidate:
        """The one with this name."""
        return next(each for each in self.candidates if each.name == name)

    def effect(self, name: str, size_um: float, random: Generator) -> Array:
        """What a hidden effect shows, (m,) um of this rms."""
        shown = self._shaped(self.candidate(name), random)
        swollen = 1 + SWELLS * waves(self.u[random.choice(list(self.u))], random, 1.2)
        return self._sized(shown * swollen[self.data.row], size_um)

    def _shaped(self, candidate: Candidate, random: Generator) -> Array:
        kind, lead = candidate.name.split()[0], candidate.effects[0]
        if len(kind) == 3 and kind.startswith("E"):
            unit = self.data.design([Effect(kind, (0.0,))])[:, 0]
            return unit * self._curve(self.u[kind[2]], random)[self.data.row]
        if candidate.family in THERMAL and candidate.name != "tool droop":
            return self._warmed(candidate, random)
        loading = candidate.loadings[random.integers(len(candidate.loadings))]
        numbers = random.normal(size=loading.shape[1])
        if kind in ("backlash", "lateral", "angular"):
            numbers = np.zeros(loading.shape[1])
            numbers[:2] = 1.0, random.uniform(-0.8, 0.8)
        elif kind in ("radial", "axial", "wobble", "encoder"):
            numbers = numbers * np.tile(
                np.repeat([1.0, 0.35, 0.1, *(0.0,) * 5][: lead.basis.size // 2], 2), len(candidate.effects)
            )
            loading = np.eye(len(candidate.effects) * lead.basis.size)
        return self.data.design(candidate.effects) @ (loading @ numbers)

    def _warmed(self, candidate: Candidate, random: Generator) -> Array:
        """The pattern of a thermal effect in space, with a course in time that is not the catalogue's."""
        still = {(e.name, e.times): replace(e, **STILL) for e in candidate.effects}
        parts = list(still.values())
        if candidate.name.startswith("thermal scale"):
            held = float(random.uniform(*self.data.measured.spans[candidate.axis]))
            parts = [replace(each, times_center=held) for each in parts if each.times]
        pattern = self.data.design(parts) @ random.normal(size=len(parts))
        course = self.warmth.course(candidate.name, self.data.column("time_s"), random)
        return pattern * (course - course.mean())[self.data.row]

    @staticmethod
    def _curve(u: Array, random: Generator) -> Array:
        """A curve without mean and slope."""
        curve = waves(u, random, random.uniform(0.25, 0.9))
        if random.random() < BUMPS:
            curve = np.exp(-0.5 * ((u - random.uniform(-0.6, 0.6)) / 0.13) ** 2)
        return curve - np.polyval(np.polyfit(u, curve, 1), u)

    def clutter(self, random: Generator, size_um: float = 1.0) -> Array:
        """A little of everything."""
        whole = np.zeros(len(self.data.y))
        for group in self.visible.groups:
            if not group.owner.grows:
                shown = group.columns @ random.normal(size=group.columns.shape[1])
                whole += self._sized(shown, random.normal() / np.sqrt(len(self._forms[group.owner.name])))
        return self._sized(whole, size_um)

    @cached_property
    def _forms(self) -> dict[str, list[int]]:
        forms: dict[str, list[int]] = {}
        for index, group in enumerate(self.visible.groups):
            forms.setdefault(group.owner.name, []).append(index)
        return forms

    def foreign(self, kind: str, size_um: float, random: Generator) -> Array:
        """Something that is in no catalogue."""
        places = np.stack(list(self.u.values()), axis=-1)
        time = self.data.column("time_s")
        clock = (time - time.min()) / np.ptp(time)
        ways = random.normal(size=3)
        first, second, third = places[:, random.choice(places.shape[1], 3, replace=False)].T
        if kind == "field":
            shown = np.stack([field(places, random, random.uniform(0.9, 1.8)) for _ in range(3)], axis=-1)
        elif kind == "drag":
            shown = np.outer(np.sin(2 * first) * np.sin(2 * second), ways)
        elif kind == "slips":
            shown = sum(np.outer(clock > random.uniform(0.15, 0.85), random.normal(size=3)) for _ in range(2))
        elif kind == "walk":
            shown = np.stack([waves(2 * clock, random, random.uniform(0.15, 0.4)) for _ in range(3)], axis=-1)
        elif kind == "triple":
            shown = np.outer(first * second * third, ways)
        else:
            shown = np.outer(np.tanh(3 * np.diff(first, prepend=first[0])) * np.abs(second), ways)
        return self._sized(shown.ravel(), size_um)

    def measured(self, shown_um: Array, random: Generator, stated: bool = False) -> Measurement:
        """The measurement with this error and noise; the noise stated, or to be told from repeats."""
        every = (shown_um + self._noise(random)).reshape(-1, 3) / 1e3
        names = self.data.problem.observations[0].components
        data = self.plain.with_columns({n: self.plain.columns[n] + every[:, k] for k, n in enumerate(names)})
        silent = replace(data, headers=tuple(pair for pair in data.headers if pair[0] != "noise_um"))
        return silent.with_header("noise_um", f"{SIGMA_UM:g}") if stated else silent

    def _noise(self, random: Generator) -> Array:
        count, time = self.data.count, self.data.column("time_s")
        noise = SIGMA_UM * random.standard_t(5, (count, 3)) / np.sqrt(5 / 3)
        memory = np.exp(-np.diff(time, prepend=time[0]) / 900.0)
        drift = np.zeros((count, 3))
        for row in range(1, count):
            fresh = np.sqrt(1 - memory[row] ** 2) * random.normal(size=3)
            drift[row] = memory[row] * drift[row - 1] + fresh
        outlying = random.random((count, 3)) < 0.01
        far = SIGMA_UM * random.uniform(5, 15, (count, 3)) * random.choice([-1, 1], (count, 3))
        return (noise + SIGMA_UM * random.choice([0.0, 0.15, 0.3]) * drift + outlying * far).ravel()

    def _sized(self, shown: Array, size_um: float) -> Array:
        rms = self.data.rms(shown)
        return shown * size_um / rms if rms > 0 else shown


def waves(u: Array, random: Generator, length: float) -> Array:
    """A smooth random function of variance one."""
    count = 30
    frequency, phase = random.normal(0, 1 / length, count), random.uniform(0, 2 * np.pi, count)
    return np.asarray(np.cos(np.outer(u, frequency) + phase) @ random.normal(size=count) / np.sqrt(count / 2))


def field(places: Array, random: Generator, length: float) -> Array:
    """The same of several variables, (n, k) -> (n,)."""
    count = 60
    frequency, phase = random.normal(0, 1 / length, (places.shape[1], count)), random.uniform(0, 2 * np.pi, count)
    return np.asarray(np.cos(places @ frequency + phase) @ random.normal(size=count) / np.sqrt(count / 2))


def _constants(effect: Effect, random: Generator) -> tuple[float, ...]:
    size = 3e-5 if effect.rotational else 0.03
    return tuple(float(size * random.uniform(-1, 1)) for _ in effect.coefficients)


def _plan(known: Machine, poses: int, kind: str, random: Generator) -> tuple[Measurement, Warmth]:
    """Poses in random order and from random sides, some repeated, with clock, temperatures, tools and loads."""
    drawn = candidates(known, kind, poses, Room(tool_lengths=(110.0, 230.0)), int(random.integers(1000)))
    poses = len(drawn)
    order = np.sort(np.concatenate([np.arange(poses), np.repeat(np.arange(REPEATED) * poses // REPEATED, TIMES - 1)]))
    shuffled = random.permutation(poses)[order]
    columns = {name: values[shuffled] for name, values in drawn.columns.items()}
    labels = {name: tuple(values[k] for k in shuffled) for name, values in drawn.labels.items()}
    for axis in known.axes:
        columns[f"dir_{axis.name}"] = random.choice([-1.0, 1.0], poses)[order]
    if kind == "tcp":
        sets = random.integers(0, SETS, poses)[order]
        columns["load_kg"] = np.array([20.0, 150.0, 20.0, 150.0])[sets]
        labels["set"] = tuple(str(number + 1) for number in sets)
    again, pause = np.diff(order, prepend=-1) == 0, random.uniform(*PAUSES_S)
    time = np.cumsum(np.where(again, 15.0, 20.0 + random.exponential(pause, len(order))))
    warmth = Warmth.drawn(float(time[-1]), random)
    columns |= {"time_s": time, **{name: warmth.at(time, values) for name, values in warmth.sensors.items()}}
    return Measurement(kind, (), columns, labels), warmth
