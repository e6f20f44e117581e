"""How often the diagnosis is right on worlds of its own: `python tests/diagnose/study.py single=20 deleted=20 ...`.

`--set evidence.MISSHAPEN=0.1` tries another value of a constant, `--from 40` other worlds, `--log FILE` keeps a line
of JSON for every scene, and `--read FILE` takes such scenes as done. Prints the table of docs/accuracy.md, or puts it
there with `--table docs/accuracy.md`.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.random import Generator

from diagnose.tables import put
from diagnose.worlds import FOREIGN, THERMAL, World
from ncfix.diagnosis.diagnosis import NOTHING, UNKNOWN, Diagnosis, diagnose
from ncfix.measure.measurement import Array

WORLDS = (
    ("wCBXFZYSt", "tcp"),
    ("wCAYFXZSt", "probe"),
    ("three_axis", "tcp"),
    ("wCBXFZYSt", "probe"),
    ("wCAYFXZSt", "tcp"),
    ("dmu50", "tcp"),
    ("angle_head", "tcp"),
)
"""Machine and kind of measurement, in turn."""
EACH = 12
"""Worlds of each."""
SIZES_UM = (5.0, 10.0, 20.0)
USUAL_UM, WEAK_UM = 10.0, 2.5


@dataclass(frozen=True)
class Scene:
    """What is hidden: (m,) um; the names, and those that may not be used."""

    shown: Array
    names: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()


def clean(world: World, random: Generator) -> Scene:
    return Scene(np.zeros(len(world.data.y)))


def clutter(world: World, random: Generator) -> Scene:
    return Scene(world.clutter(random))


def foreign(world: World, random: Generator) -> Scene:
    kind = str(random.choice(FOREIGN))
    return Scene(world.clutter(random) + world.foreign(kind, float(random.choice(SIZES_UM)), random), (kind,))


def hidden(world: World, random: Generator, count: int, size_um: float, of: Sequence[str] | None = None) -> Scene:
    """So many effects of one size beside a little of everything."""
    names = tuple(str(name) for name in random.choice(world.names if of is None else of, count, replace=False))
    whole = world.clutter(random)
    for name in names:
        whole = whole + world.effect(name, size_um, random)
    return Scene(whole, names)


def single(world: World, random: Generator) -> Scene:
    return hidden(world, random, 1, float(random.choice(SIZES_UM)))


def weak(world: World, random: Generator) -> Scene:
    return hidden(world, random, 1, WEAK_UM)


def thermal(world: World, random: Generator) -> Scene:
    of = [name for name in world.names if world.candidate(name).family in THERMAL]
    return hidden(world, random, 1, float(random.choice(SIZES_UM)), of)


def curves(world: World, random: Generator) -> Scene:
    return hidden(world, random, 1, float(random.choice(SIZES_UM)), [name for name in world.names if len(name) == 3])


def two(world: World, random: Generator) -> Scene:
    return hidden(world, random, 2, USUAL_UM)


def three(world: World, random: Generator) -> Scene:
    return hidden(world, random, 3, USUAL_UM)


def deleted(world: World, random: Generator) -> Scene:
    scene = hidden(world, random, 1, USUAL_UM)
    return Scene(scene.shown, scene.names, scene.names)


def silent(found: Diagnosis, scene: Scene, world: World) -> bool:
    return not found.findings


def unknown(found: Diagnosis, scene: Scene, world: World) -> bool:
    return found.verdict == UNKNOWN


def kin(found: Diagnosis, scene: Scene, world: World) -> bool:
    """Unknown, nothing, or a name of the same family."""
    families = {world.candidate(name).family for name in scene.names}
    named = {finding.candidate.family for finding in found.findings}
    return found.verdict in (UNKNOWN, NOTHING) or bool(families & named)


def first(found: Diagnosis, scene: Scene, world: World) -> bool:
    """The first name is the one that was hidden."""
    return bool(found.findings) and found.findings[0].candidate.name in scene.names


def exact(found: Diagnosis, scene: Scene, world: World) -> bool:
    """All names, or their aliases where the data are ambiguous, and no others."""
    said = [{finding.candidate.name, *finding.aliases} for finding in found.findings]
    return len(said) == len(scene.names) and all(any(name in each for each in said) for name in scene.names)


def inside(found: Diagnosis, scene: Scene) -> bool:
    """All hidden names are among those reported."""
    said = {name for finding in found.findings for name in (finding.candidate.name, *finding.aliases)}
    return set(scene.names) <= said


Family = tuple[Callable[[World, Generator], Scene], Callable[[Diagnosis, Scene, World], bool], str]
FAMILIES: dict[str, Family] = {
    "clean": (clean, silent, "noise alone: no name"),
    "clutter": (clutter, silent, "noise and 1 um of everything: no name"),
    "single": (single, first, "one effect of 5 to 20 um: first name right"),
    "thermal": (thermal, first, "one thermal effect of 5 to 20 um: first name right"),
    "curves": (curves, first, "one curve of 5 to 20 um: first name right"),
    "weak": (weak, first, "one effect of 2.5 um: first name right"),
    "two": (two, exact, "two effects of 10 um: both (or aliases) and no other"),
    "three": (three, exact, "three effects of 10 um: all (or aliases) and no other"),
    "deleted": (deleted, kin, "the name taken out: unknown, nothing, or of its family"),
    "foreign": (foreign, unknown, "an effect of no catalogue: unknown"),
}


@dataclass(frozen=True)
class Outcome:
    """What was hidden, what was said, and whether that is right.

    sets  the names with their aliases; `inside` whether all that is hidden is among them, `exact` and nothing else
    """

    family: str
    index: int
    world: str
    hidden: tuple[str, ...]
    verdict: str
    sets: tuple[tuple[str, ...], ...]
    unnamed: str
    right: bool
    inside: bool
    exact: bool
    seconds: float


def drawn(family: str, index: int) -> tuple[World, Scene, Generator]:
    """One scene, where it is, and chance for the noise."""
    name, kind = WORLDS[index % len(WORLDS)]
    world = World.of(name, index // len(WORLDS) % EACH, kind=kind)
    random = np.random.default_rng([index, *family.encode()])
    return world, FAMILIES[family][0](world, random), random


def outcome(family: str, index: int) -> Outcome:
    """What comes out of one scene."""
    world, scene, random = drawn(family, index)
    measured, started = world.measured(scene.shown, random, bool(index % 2)), time.process_time()
    found = diagnose([measured], world.machine, scene.refused)
    seconds = time.process_time() - started
    sets = tuple((each.candidate.name, *each.aliases) for each in found.findings)
    unnamed = f"{found.unknown_um:.1f} um {found.rest.kind}" if found.unknown_um else ""
    good = FAMILIES[family][1](found, scene, world), inside(found, scene), exact(found, scene, world)
    place = " ".join(WORLDS[index % len(WORLDS)])
    return Outcome(family, index, place, scene.names, found.verdict, sets, unnamed, *good, round(seconds, 2))


NAMED = ("single", "thermal", "curves", "weak", "two", "three")
"""Families in which names are to be found."""
HEAD = (
    "| what | right | in the set | alone | names in a set | s, median | s, longest |",
    "|---|---|---|---|---|---|---|",
)


def row(family: str, found: Sequence[Outcome]) -> str:
    """A row of the table: right, in the set, alone; how many names a set has; processor seconds, median and longest."""
    said, count = [len(each.sets[0]) for each in found if each.sets], len(found)
    counts = f"{sum(each.inside for each in found)} | {sum(each.exact for each in found)} | {np.mean(said or [0]):.2f}"
    times = np.array([each.seconds for each in found])
    right = f"{sum(each.right for each in found)} of {count}"
    named = counts if family in NAMED else " | | "
    return f"| {FAMILIES[family][2]} | {right} | {named} | {np.median(times):.1f} | {times.max():.1f} |"


def outcomes(family: str, indices: Sequence[int], log: str | None) -> Iterator[Outcome]:
    """The scenes one after another; each goes to the log and to the standard error."""
    for index in indices:
        found = outcome(family, index)
        print(family, index, found.world, found.hidden, "->", found.verdict, found.sets, found.unnamed, file=sys.stderr)
        if log:
            with open(log, "a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(found)) + "\n")
        yield found


def read(path: str) -> list[Outcome]:
    """The scenes of a log."""
    with open(path, encoding="utf-8") as file:
        return [Outcome(**json.loads(line)) for line in file]


def main() -> None:
    wanted = argparse.ArgumentParser(description=__doc__)
    wanted.add_argument("families", nargs="*", help="family=count")
    wanted.add_argument("--set", action="append", default=[], help="module.NAME=value")
    wanted.add_argument("--from", dest="start", type=int, default=0)
    wanted.add_argument("--log")
    wanted.add_argument("--read", action="append", default=[])
    wanted.add_argument("--table")
    given = wanted.parse_args()
    for each in given.set:
        place, value = each.split("=")
        module, name = place.rsplit(".", 1)
        setattr(importlib.import_module(f"ncfix.diagnosis.{module}"), name, float(value))
    found = [each for path in given.read for each in read(path)]
    for argument in given.families:
        family, count = argument.split("=")
        found += outcomes(family, range(given.start, given.start + int(count)), given.log)
    own = {family: [each for each in found if each.family == family] for family in FAMILIES}
    lines = [*HEAD, *(row(family, each) for family, each in own.items() if each)]
    print("\n".join(lines))
    if given.table:
        put(given.table, "study", lines)


if __name__ == "__main__":
    main()
