"""Effects without a name, as rivals of those with one.

They hold more than any name does and pay for it in the evidence; where such a rival explains the data better all the
same, the effect is not in the catalogue.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from ncfix.diagnose.fields import fields
from ncfix.diagnose.groups import Group, apart
from ncfix.diagnose.joints import of_joints
from ncfix.diagnose.view import View
from ncfix.measure.measurement import Array
from ncfix.measure.solve import orthonormal, without

HELD = 0.8
"""Share of an error's squares, beside what is free, that makes it the same as a name."""


def rivals(view: View, named: Sequence[Group]) -> tuple[Group, ...]:
    """All of them, several forms each; none where the data do not show the tool tip.

    What a constant that the machine file lacks would show is left to that: a rival has no part in it.
    """
    anywhere = list(fields(view))
    found = [group for group in (*anywhere, *(of_joints(view) if anywhere else ())) if group is not None]
    if found and any(group.owner.constant for group in named):
        columns = apart(view, np.concatenate([group.columns for group in found], axis=1), named)
        ends = np.cumsum([group.columns.shape[1] for group in found])[:-1]
        parts = np.split(columns, ends, axis=1)
        found = [replace(group, columns=own) for group, own in zip(found, parts, strict=True)]
    return tuple(_not_in_catalogue(view, found, named))


def _not_in_catalogue(view: View, groups: Sequence[Group], named: Sequence[Group]) -> list[Group]:
    """Without the single errors that a name holds already: those are that name with another shape, or course."""
    basis = orthonormal(view.base / view.relative[:, None])
    own: dict[str, list[Array]] = {}
    for group in named:
        left = without(basis, group.columns / view.relative[:, None])
        span = orthonormal(left)
        for key in _errors(group):
            own.setdefault(key, []).append(span)
    return [group for group in groups if not _held(without(basis, group.columns / view.relative[:, None]), group, own)]


def _errors(group: Group) -> set[str]:
    """The errors it consists of; and the course of time if it is nothing but one, wherever it acts."""
    return {effect.name for effect in group.owner.effects} | ({"slow"} if group.owner.slow else set())


def _held(left: Array, group: Group, spans: Mapping[str, Sequence[Array]]) -> bool:
    held = [((span.T @ left) ** 2).sum() for key in _errors(group) for span in spans.get(key, ())]
    return bool(max(held, default=0.0) > HELD * (left**2).sum())
