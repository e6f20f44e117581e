"""Planned poses against random ones: the worst variance of a predicted tip error, for several machines and models.

The variance is that of 300 poses all over the travels that the plan has not seen. What none of the candidates can tell
is left out for both. What the best of all plans could reach is bounded from below by duality: for any weights of the
predictions no choice among the candidates, however often it repeats a pose, has a lower weighted mean of variances.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field

import numpy as np

from measure.poses import machine
from ncfix.machine import Machine
from ncfix.measure.candidates import Room, at_balls, candidates, has_r_test, r_test
from ncfix.measure.estimate import Problem
from ncfix.measure.instruments import observe
from ncfix.measure.least_squares import solve
from ncfix.measure.measurement import Measurement
from ncfix.measure.plan import CANDIDATES, Planned, plan, pool_of
from ncfix.measure.selection import select

COUNT, DRAWS, PLACES = 40, 20, 300
LINEAR = "EC0Y,EA0Z,EB0Z,EXX,EYY,EZZ,EYX,EZX,EXY,EZY,EXZ,EYZ"
ROTARY = "E?0B,E?0C,EC0Y,EA0Z,EB0Z"


@dataclass(frozen=True)
class Case:
    """A machine, a kind of measurement, and the errors to be found; the tools that there are, mm.

    stands  balls may stand at 24 places on the table instead of the usual four
    """

    machine: str
    kind: str
    effects: str
    tools: tuple[float, ...] = (100.0, 200.0)
    stands: bool = field(default=False)

    @property
    def known(self) -> Machine:
        """The machine without errors."""
        return machine(self.machine).replace(effects=())

    @property
    def room(self) -> Room:
        """Where measuring is possible."""
        return Room(tool_lengths=self.tools, balls=self._balls() if self.stands else {})

    @property
    def title(self) -> str:
        """The first cells of its row."""
        kind = f"`{self.kind}`, 24 places for balls" if self.stands else f"`{self.kind}`"
        return f"{self.machine} | {kind} | {self.effects.replace(',', ' ')}"

    def _balls(self) -> dict[str, tuple[float, float, float]]:
        """On two circles and at two heights round the middle of the travels."""
        middle = [0.0 if axis.rotary else sum(Room().of(axis)) / 2 for axis in self.known.axes]
        x, y, z = self.known.tip(np.array([middle]), float(np.mean(self.tools)))[0].tolist()
        ways = np.arange(6) * np.pi / 3
        places = [(x + r * np.cos(t), y + r * np.sin(t), z + h) for r in (60, 120) for t in ways for h in (0, 60)]
        return {str(k + 1): place for k, place in enumerate(places)}


CASES = (
    Case("three_axis", "tcp", LINEAR),
    Case("three_axis", "length", "EC0Y,EA0Z,EB0Z,EXX,EYY,EZZ"),
    Case("wCBXFZYSt", "tcp", ROTARY),
    Case("wCBXFZYSt", "probe", "esmaeili-13-bc"),
    Case("wCBXFZYSt", "probe", "esmaeili-13-bc", stands=True),
    Case("wCAYFXZSt", "tcp", "esmaeili-12"),
    Case("wCAYFXZSt", "probe", "esmaeili-12"),
    Case("wCAYFXZSt", "probe", "esmaeili-12", stands=True),
    Case("dmu50", "tcp", ROTARY),
    Case("dmu50", "tcp6", LINEAR),
    Case("angle_head", "tcp", "E?0C,E?0A,EC0Y,EA0Z,EB0Z"),
)


@dataclass(frozen=True)
class Comparison:
    """Standard deviations, um per um of noise: of the plan, the median and the best of the random draws, the bound."""

    planned: float
    random: float
    luckiest: float
    bound: float

    @property
    def ratio(self) -> float:
        """How many times lower the plan's variance is, median over the draws."""
        return (self.random / self.planned) ** 2


def random_poses(case: Case, seed: int) -> Measurement:
    """Poses drawn evenly over the travels; for probing and R-tests those that reach a ball drawn at random."""
    if case.kind == "tcp" and has_r_test(case.known):
        return r_test(case.known, COUNT, case.room, seed)
    known, random = case.known, np.random.default_rng(seed)
    count = 20 * COUNT if case.kind == "probe" else COUNT
    columns = {axis.name: random.uniform(*case.room.of(axis), count) for axis in known.axes}
    columns |= {f"dir_{axis.name}": random.choice([-1.0, 1.0], count) for axis in known.axes}
    columns["tool_length"] = random.choice(case.tools, count)
    if case.kind == "probe":
        return at_balls(known, columns, case.room, random).rows(slice(COUNT))
    if case.kind == "length":
        for axis in "XYZ":
            both = random.uniform(*case.room.of(known.axes[known.axis_names.index(axis)]), (2, count))
            columns |= {f"a{axis.lower()}": both[0], f"b{axis.lower()}": both[1]}
            del columns[axis]
    return Measurement(case.kind, (), columns, {"set": ("1",) * count})


def worst_um(case: Case, poses: Measurement, seen: frozenset[str]) -> float:
    """The largest standard deviation of a predicted tip error; infinite if anything is not determined."""
    known, selection = case.known, select(case.known, case.effects)
    kept = np.array([label in seen for label in selection.labels])
    problem = Problem.of([poses.with_header("noise_um", "1")], known, selection)
    nuisance = problem.nuisance(problem.start) / problem.sigma[:, None]
    design = (problem.design / problem.sigma[:, None])[:, kept]
    found = solve(design, nuisance, np.zeros(len(design)))
    if len(found.kept) < kept.sum():
        return np.inf
    places = candidates(known, "tcp", PLACES, case.room, seed=77)
    tip = known.design(places.positions(known), places.state(known), selection.estimated)[:, :3][..., kept]
    return 1e3 * float(np.sqrt(np.einsum("nik,kl,nil->ni", tip, found.covariance, tip).max()))


def planned(case: Case) -> Planned:
    """The plan."""
    return plan(case.known, case.kind, COUNT, case.room, case.effects)


def compared(case: Case) -> Comparison:
    """The plan against the draws."""
    found = planned(case)
    draws = [worst_um(case, random_poses(case, seed), frozenset(found.seen)) for seed in range(DRAWS)]
    mine = worst_um(case, found.plan, frozenset(found.seen))
    return Comparison(mine, float(np.median(draws)), min(draws), bound_um(case))


def bound_um(case: Case, rounds: int = 400) -> float:
    """No plan from the candidates has a lower worst standard deviation: the dual of the minimax design, by steps.

    For weights v of the predictions, tr(V inverse(M)) over designs w is at least its square over the largest of its
    derivatives by w; both w and v are moved towards what is worst.
    """
    known, selection = case.known, select(case.known, case.effects)
    offered = candidates(known, case.kind, CANDIDATES, case.room)
    pool, _ = pool_of(observe(offered, known), known, selection, case.room, (), 0)
    w, v = np.full(len(pool.blocks), 1 / len(pool.blocks)), np.full(len(pool.targets), 1 / len(pool.targets))
    best = 0.0
    for _ in range(rounds):
        inverse = np.linalg.inv(np.einsum("n,nip,niq->pq", w, pool.blocks, pool.blocks, optimize=True))
        variance = np.einsum("tp,pq,tq->t", pool.targets, inverse, pool.targets, optimize=True)
        weighted = inverse @ ((pool.targets * v[:, None]).T @ pool.targets) @ inverse
        gain = np.einsum("nip,pq,niq->n", pool.blocks, weighted, pool.blocks, optimize=True)
        mean = float(v @ variance)
        best = max(best, mean**2 / float(gain.max()))
        w, v = w * np.sqrt(gain.clip(0) / mean), v * np.sqrt(variance.clip(0) / mean)
        w, v = w / w.sum(), v / v.sum()
    return float(np.sqrt(best / COUNT))


def table() -> str:
    """All cases."""
    lines = [
        "| machine | measurement | sought | planned | no plan below | random | best random | variance lower by |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for case in CASES:
        found = compared(case)
        figures = (
            f"{found.planned:.2f} | {found.bound:.2f} | {found.random:.2f} | {found.luckiest:.2f} | {found.ratio:.1f}"
        )
        lines.append(f"| {case.title} | {figures} |")
        print(lines[-1], file=sys.stderr, flush=True)
    return "\n".join(lines)
