"""What drives do while axes move, on circles run at a feed: servo mismatch, lag, reversal spikes, changeover.

The columns that they go with are worked out from the path (`ncfix.measure.motion`). They are settings of drives, or
friction: a machine file says where axes stand, so nothing is added to it.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from ncfix.diagnosis.catalogue.candidate import LETTERS, Candidate, MeasuredRange, along, zero
from ncfix.machine import Effect
from ncfix.machine.axes import Axis
from ncfix.machine.basis import Polynomial
from ncfix.measure.motion import FADING_S

SPEED, ACCELERATION = 50.0, 50.0
"""mm/s and mm/s^2: the scales of these; of no consequence."""
GROWING = 0.3
"""How much more or less a spike may be at the end of the travel than in its middle, as a share."""


def dynamic_candidates(measured: MeasuredRange) -> Iterator[Candidate]:
    """All of them."""
    for axis in measured.linear:
        if f"spike_{axis.name.lower()}" in measured.columns:
            yield from _spikes(measured, axis)
    for first, second in combinations(measured.linear, 2):
        if f"speed_{first.name.lower()}_{second.name.lower()}" in measured.columns:
            yield from _pair(first, second)


def _spikes(measured: MeasuredRange, axis: Axis) -> Iterator[Candidate]:
    own = along(axis)
    if own is None:
        return
    name, low = f"E{LETTERS[own]}{axis.name}", axis.name.lower()
    effects = []
    for word in FADING_S:
        effects.append(Effect(name, (), Polynomial(degree=(1,)), input=f"{word}_{low}"))
        effects.append(Effect(name, (), Polynomial(degree=(1,)), input=f"{word}_{low}", **measured.factor(axis)))
    loadings = tuple(np.eye(4)[:, 2 * k : 2 * k + 2] * [1.0, GROWING] for k in range(len(FADING_S)))
    title = f"reversal spikes of {axis.name}: it sticks for a moment where it turns round"
    remedy = "adjust the friction compensation (quadrant) of the drive; lubricate"
    needs = tuple(f"{word}_{low}" for word in FADING_S)
    yield Candidate(
        f"reversal spikes {axis.name}", title, axis.name, f"{axis.name} reversal", zero(effects), loadings, needs,
        remedy, dynamic=True,
    )  # fmt: skip


def _pair(first: Axis, second: Axis) -> Iterator[Candidate]:
    """Both lag alike: circles are smaller the faster they are run. One lags more: they are oval at 45 degrees.

    The slower one lags more: they have steps there.
    """
    names = [f"E{LETTERS[own]}{axis.name}" for axis in (first, second) if (own := along(axis)) is not None]
    if len(names) < 2:
        return
    pair, family = f"{first.name}{second.name}", f"{first.name}{second.name} drives"
    # a body of the workpiece side goes against the way in which its number grows
    sense = [float(np.asarray(a.error_axes[along(a) or 0]) @ np.asarray(a.direction)) for a in (first, second)]
    for kind, word, size, signs, title, remedy in (
        ("servo mismatch", "speed", SPEED, (1.0, -1.0), "one lags more than the other: circles are oval at 45 degrees, "
         "the other way round the other way", "make the gains of both position loops alike"),
        ("lag", "accel", ACCELERATION, (1.0, 1.0), "both lag alike: circles are smaller the faster they are run",
         "more gain or feedforward in both position loops"),
        ("master-slave changeover", "slave", SPEED, (1.0, 1.0), "the slower axis lags more: steps at 45 degrees, where "
         "the other one becomes the slower", "a control that leads both axes alike"),
    ):  # fmt: skip
        low = first.name.lower(), second.name.lower()
        needs = (f"{word}_{low[0]}_{low[1]}", f"{word}_{low[1]}_{low[0]}")
        effects = zero(
            [
                Effect(name, (), Polynomial(degree=(1,)), scale=size, input=need)
                for name, need in zip(names, needs, strict=True)
            ]
        )
        loading = (np.array(signs) * np.array(sense))[:, None]
        yield Candidate(
            f"{kind} {pair}", f"{kind} of {first.name} and {second.name}: {title}", "", family, effects, (loading,),
            needs, remedy, dynamic=True,
        )  # fmt: skip
