"""How often the diagnosis is right on worlds of its own: `python tests/diagnose/study.py single=20 deleted=20 ...`.

`--set MISSHAPEN=0.1` tries another value of a constant of `ncfix.diagnose.weighing`. Prints a row of the table of
docs/diagnose.md for every family.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from diagnose.worlds import FOREIGN, World
from ncfix.diagnose import weighing
from ncfix.diagnose.diagnosis import Diagnosis, diagnose
from ncfix.diagnose.verdict import NOTHING, UNKNOWN
from ncfix.measure.measurement import Array

MACHINES = ("wCBXFZYSt", "wCAYFXZSt", "three_axis")
SIZES_UM = (5.0, 10.0, 20.0)
USUAL_UM = 10.0


@dataclass(frozen=True)
class Scene:
    """What is hidden: (m,) um; the names, and those that may not be used."""

    shown: Array
    names: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()


def clean(world: World, random: Generator) -> Scene:
    return Scene(np.zeros(len(world.view.y)))


def clutter(world: World, random: Generator) -> Scene:
    return Scene(world.clutter(random))


def foreign(world: World, random: Generator) -> Scene:
    kind = str(random.choice(FOREIGN))
    return Scene(world.clutter(random) + world.foreign(kind, float(random.choice(SIZES_UM)), random))


def hidden(world: World, random: Generator, count: int, size_um: float) -> Scene:
    """So many effects of one size beside a little of everything."""
    names = tuple(str(name) for name in random.choice(world.names, count, replace=False))
    whole = world.clutter(random)
    for name in names:
        whole = whole + world.effect(name, size_um, random)
    return Scene(whole, names)


def single(world: World, random: Generator) -> Scene:
    return hidden(world, random, 1, float(random.choice(SIZES_UM)))


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


def exact(found: Diagnosis, scene: Scene, world: World) -> bool:
    """All names, or their aliases where the data are ambiguous, and no others."""
    said = [{finding.candidate.name, *finding.aliases} for finding in found.findings]
    return len(said) == len(scene.names) and all(any(name in each for each in said) for name in scene.names)


Family = tuple[Callable[[World, Generator], Scene], Callable[[Diagnosis, Scene, World], bool], str]
FAMILIES: dict[str, Family] = {
    "clean": (clean, silent, "noise alone: no name"),
    "clutter": (clutter, silent, "noise and 1 um of everything: no name"),
    "single": (single, exact, "one effect of 5 to 20 um: its name (or alias) and no other"),
    "two": (two, exact, "two effects of 10 um: both and no other"),
    "three": (three, exact, "three effects of 10 um: all and no other"),
    "deleted": (deleted, kin, "the name taken out: unknown, nothing, or of its family"),
    "foreign": (foreign, unknown, "an effect of no catalogue: unknown"),
}


def outcomes(family: str, count: int) -> Iterator[bool]:
    """Whether each of so many scenes came out right; what came out goes to the standard error."""
    drawn, right, _ = FAMILIES[family]
    for index in range(count):
        world = World.of(MACHINES[index % len(MACHINES)], index // len(MACHINES) % 8)
        random = np.random.default_rng([index, *family.encode()])
        scene = drawn(world, random)
        found = diagnose([world.measured(scene.shown, random, bool(index % 2))], world.machine, scene.refused)
        names = [finding.candidate.name for finding in found.findings]
        good = right(found, scene, world)
        print(family, index, scene.names, "->", found.verdict, names, good, file=sys.stderr)
        yield good


def main(arguments: list[str]) -> None:
    if "--set" in arguments:
        at = arguments.index("--set")
        name, value = arguments[at + 1].split("=")
        setattr(weighing, name, float(value))
        arguments = [*arguments[:at], *arguments[at + 2 :]]
    for argument in arguments:
        family, count = argument.split("=")
        good = list(outcomes(family, int(count)))
        print(f"| {FAMILIES[family][2]} | {sum(good)} of {len(good)} |")


if __name__ == "__main__":
    main(sys.argv[1:])
