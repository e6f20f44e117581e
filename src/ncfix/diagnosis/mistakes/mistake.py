"""A mistake of people or software: machine file and measurements as they would be without it."""

from __future__ import annotations

from collections.abc import Sequence

from ncfix.machine import Machine
from ncfix.measure.measurement import Measurement
from ncfix.values import frozen


@frozen(repr=False, slots=False)
class Mistake:
    """A mistake, and machine and measurements as they are without it.

    before_um, after_um  misfit with it and without it
    likely               the file itself looks like it
    aliases              mistakes of its kind that explain the data as well
    stretch              values of the file are to be multiplied with this: densities are stretched by as much
    fitted               how many numbers were fitted to undo it
    replaces             the constants of the file are other ones, too: taken where its own do not agree with the data
    given_um             rms of the lengths that the file as given leaves
    odds, paid           log odds against the file as given, after what the mistake pays
    sure                 it reaches the noise: no names do better
    gained               log odds before it pays, where it is sure though the noise is not reached
    torn                 a mistake that explains the data as well is in the data, and this in the machine file, or the
                         other way round: no file is right for both
    remedy               what to do about it, where its title does not say so
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
    """A mistake that is undone by columns taken from others, times a factor."""
    changed = tuple(
        each.with_columns({to: factor * each.columns[of] for to, (of, factor) in columns.items() if of in each.columns})
        for each in measurements
    )
    return Mistake(name, title, "", machine, changed, stretch=stretch)


def times(measurements: tuple[Measurement, ...], axes: Sequence[str], factor: float) -> tuple[Measurement, ...]:
    """The columns of these names, and measured positions of these axes, times a factor."""
    names = {*axes, *(f"m{axis.lower()}" for axis in axes)}
    return tuple(
        each.with_columns({name: factor * values for name, values in each.columns.items() if name in names})
        for each in measurements
    )
