"""A mistake of people or software, with machine file and measurements as they are without it."""

from __future__ import annotations

from ncfix.machine import Machine
from ncfix.measure.measurement import Measurement
from ncfix.values import frozen


@frozen(repr=False, slots=False)
class Mistake:
    """A mistake, with machine and measurements corrected for it.

    before_um, after_um  residual with and without it, um
    likely               the file itself suggests it
    aliases              names of mistakes or constants that explain the data as well
    stretch              factor by which the values must be multiplied, if their unit is wrong
    fitted               number of parameters fitted to undo it
    replaces             it also replaces the constants of the file
    given_um             rms residual length with the given file, um
    odds, paid           log odds against the given file, less its price; and that price
    sure                 undoing it leaves only noise, or nearly: no names can do better
    gained               log odds before the price, if these do not follow from the residual
    torn                 equally good mistakes are in the data and in the machine file: no corrected file is written
    remedy               what to do about it, unless the title says so
    """

    name: str
    title: str
    axis: str
    machine: Machine
    measurements: tuple[Measurement, ...]
    before_um: float = 0.0
    after_um: float = 0.0
    likely: bool = False
    aliases: tuple[str, ...] = ()
    stretch: float = 1.0
    fitted: int = 0
    replaces: bool = False
    given_um: float = 0.0
    odds: float = 0.0
    paid: float = 0.0
    sure: bool = False
    gained: float | None = None
    torn: bool = False
    remedy: str = ""


def undone_by_columns(
    name: str, title: str, machine: Machine, measurements: tuple[Measurement, ...],
    columns: dict[str, tuple[str, float]], stretch: float = 1.0,
) -> Mistake:  # fmt: skip
    """A mistake that is undone by replacing columns.

    columns  new column -> (column to take it from, factor)
    """
    changed = tuple(
        each.with_columns({to: factor * each.columns[of] for to, (of, factor) in columns.items() if of in each.columns})
        for each in measurements
    )
    return Mistake(name, title, "", machine, changed, stretch=stretch)
