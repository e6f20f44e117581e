"""Which scenarios there are: a family for every line of the table in docs/accuracy.md, and the seeds of both runs.

Development seeds are small numbers, for whoever works on the code under test. Final seeds come out of a fixed hash
and lie in another range; they are run once and reported as they came.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

from . import designs
from .designs import Design

FINAL_RANGE = 2**40
_SALT = "hidden effects, final run, 11"


@dataclass(frozen=True, slots=True)
class Family:
    """One kind of scenario: how many effects of which sizes are hidden among how much clutter, in which data.

    `source` says where hidden effects come from: "catalogue", "foreign", "mistake", "location" (a line error the file
    lacks) or "pair" (one of two that only a second tool tells apart). `alone`: the code under test must do without
    the true effect's name. `gap`: whether the new machine file is judged on the held-out poses.
    """

    name: str
    title: str
    count: int
    hidden: int = 1
    amplitudes_um: tuple[float, ...] = (5.0, 10.0, 20.0)
    clutter_um: float = 1.0
    clean: bool = False
    source: str = "catalogue"
    alone: bool = False
    layouts: tuple[Design, ...] = (designs.BALLS, designs.FREE, designs.BARS)
    extra: bool = False
    gap: bool = False


FAMILIES = {
    family.name: family
    for family in (
        Family("single", "one effect, 5 to 20 um", 200, gap=True),
        Family("weak", "one effect, 2.5 um", 80, amplitudes_um=(2.5,)),
        Family("clean", "nothing hidden, no clutter", 100, hidden=0, clutter_um=0.0, clean=True),
        Family("clutter", "nothing hidden, 1 um of everything", 100, hidden=0),
        Family("foreign", "an effect that no catalogue has", 60, amplitudes_um=(10.0,), source="foreign"),
        Family("deleted", "the true effect taken from the catalogue", 60, amplitudes_um=(10.0,), alone=True),
        Family("mistake", "software and set-up mistakes", 30, source="mistake", layouts=(designs.BALLS, designs.FREE)),
        Family("two", "two effects", 60, hidden=2, amplitudes_um=(10.0,)),
        Family("three", "three effects", 40, hidden=3, amplitudes_um=(10.0,)),
        Family("pair", "one of a pair that other poses tell apart", 30, amplitudes_um=(10.0,), source="pair",
               layouts=(designs.ONE_TOOL,)),
        Family("location", "a line error the file lacks", 24, amplitudes_um=(10.0,), source="location", extra=True,
               layouts=(designs.FREE,)),
        Family("poor", "one effect, one tool, one direction, in order", 24, layouts=(designs.ORDERED,), extra=True),
        Family("small", "one effect, 110 rows", 24, amplitudes_um=(10.0,), layouts=(designs.SMALL,), extra=True,
               gap=True),
        Family("blind", "pitch and backlash that the poses cannot show", 16, amplitudes_um=(10.0,), source="blind",
               layouts=(designs.ON_PITCH,), extra=True),
        Family("alike", "one of a pair, 120 rows: asked by promises.py, as many as it wants", 0, amplitudes_um=(10.0,),
               source="pair", layouts=(designs.FEW,), extra=True),
    )
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Task:
    """One scenario to be built: family, its number in the run, and its seed."""

    family: str
    index: int
    seed: int


def tasks(names: list[str], final: bool = False, counts: Mapping[str, int] | None = None) -> list[Task]:
    """The first scenarios of these families, `counts` at most of each ("" for those it does not name).

    Families take turns, so that a run that is broken off has some of all.
    """
    most = counts or {}
    seed = final_seed if final else development_seed
    shares = []
    for name in names:
        total = min(FAMILIES[name].count, most.get(name, most.get("", FAMILIES[name].count)))
        shares += [((index + 0.5) / total, Task(name, index, seed(name, index))) for index in range(total)]
    return [task for _, task in sorted(shares, key=lambda pair: pair[0])]


def development_seed(family: str, index: int) -> int:
    """A small number: below a million."""
    return 10_000 * list(FAMILIES).index(family) + index


def final_seed(family: str, index: int) -> int:
    """A number above 2**40 out of a hash."""
    digest = hashlib.sha256(f"{_SALT}: {family} {index}".encode()).digest()
    return FINAL_RANGE + int.from_bytes(digest[:5])
