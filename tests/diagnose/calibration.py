"""What the constants that were argued, not derived, do: `python tests/diagnose/calibration.py 10 [--from 40]`.

So many scenes of every family (study.py) are diagnosed with each constant at its value and at others. What was computed
of a scene is used again, so another value costs little. Prints the table, and puts it into `--table docs/accuracy.md`.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import ModuleType

import numpy as np

from diagnose.study import FAMILIES, Scene, drawn
from diagnose.tables import put
from diagnose.worlds import World
from ncfix.diagnosis import diagnosis, evidence, joint_fit
from ncfix.diagnosis.diagnosis import Case, Diagnosis, concluded, weighed
from ncfix.diagnosis.evidence import Comparison, Evidence, Members
from ncfix.diagnosis.joint_fit import passing
from ncfix.diagnosis.selection import Selected, select, with_alternatives, with_constants, with_constants_free

TRIED: tuple[tuple[str, ModuleType, tuple[float, ...]], ...] = (
    ("UNNAMED", evidence, (0.0, 6.0)),
    ("RATHER", joint_fit, (0.25, 1.0)),
    ("MUCH", diagnosis, (1 / 6, 2 / 3)),
    ("EXCESS_UM", diagnosis, (1.0, 3.0)),
)
"""Constant, where it is, and other values; more than the first of them changes only what is made of the evidence."""
ASKED = ("clutter", "single", "two", "deleted", "foreign")


@dataclass(repr=False)
class Again:
    """A scene that was diagnosed once, to be judged again with other constants."""

    case: Case
    evidence: Evidence
    members: Members = field(init=False)
    scale: Comparison = field(init=False)

    def __post_init__(self) -> None:
        """The evidence as it is weighed."""
        self.weigh()

    def weigh(self) -> None:
        """Which effects are there, from the start."""
        freed = with_constants_free(self.evidence)
        self.scale = Comparison(self.evidence)
        self.members = with_constants(self.scale, select(freed, (*freed.names, *self.evidence.alternatives)))

    def concluded(self) -> Diagnosis:
        """What is said of them."""
        selected: Selected = passing(self.scale, with_alternatives(self.scale, self.members))
        return concluded(self.case, self.scale, selected)


@contextmanager
def at(module: ModuleType, name: str, value: float) -> Iterator[None]:
    """A constant at another value."""
    own = getattr(module, name)
    setattr(module, name, value)
    try:
        yield
    finally:
        setattr(module, name, own)


def answers(world: World, scene: Scene, random: np.random.Generator, stated: bool) -> Iterator[tuple[str, Diagnosis]]:
    """What is said with the constants as they are, and with each at other values."""
    case, scale = weighed([world.measured(scene.shown, random, stated)], world.machine, scene.refused)
    again = Again(case, scale.evidence)
    yield "as they are", again.concluded()
    for name, module, values in TRIED[1:]:
        for value in values:
            with at(module, name, value):
                yield f"{name} {value:.2g}", again.concluded()
    name, module, values = TRIED[0]
    for value in values:
        with at(module, name, value):
            again.weigh()
            yield f"{name} {value:.2g}", again.concluded()


def main() -> None:
    wanted = argparse.ArgumentParser(description=__doc__)
    wanted.add_argument("count", type=int)
    wanted.add_argument("--from", dest="start", type=int, default=0)
    wanted.add_argument("--table")
    given = wanted.parse_args()
    right: Counter[tuple[str, str]] = Counter()
    settings: dict[str, None] = {}
    for index in range(given.start, given.start + given.count):
        for family in ASKED:
            good: Callable[[Diagnosis, Scene, World], bool] = FAMILIES[family][1]
            world, scene, random = drawn(family, index)
            for setting, found in answers(world, scene, random, bool(index % 2)):
                settings[setting] = None
                right[setting, family] += good(found, scene, world)
                print(family, index, setting, good(found, scene, world), file=sys.stderr, flush=True)
    lines = [f"| of {given.count} each | {' | '.join(ASKED)} |", f"|---{'|---' * len(ASKED)}|"]
    lines += [f"| {each} | {' | '.join(str(right[each, family]) for family in ASKED)} |" for each in settings]
    print("\n".join(lines))
    if given.table:
        put(given.table, "calibration", lines)


if __name__ == "__main__":
    main()
