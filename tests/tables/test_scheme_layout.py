"""Layouts: the fewest tables, and still the same function."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from conftest import some
from ncfix.tables.scheme import PartSelection, needed
from ncfix.tables.separable import (
    Separation,
    TableLayout,
    absorbed,
    arranged,
    tables_of,
    taken_apart,
    taken_apart_along,
)

NODES = (np.linspace(-1, 1, 7), np.linspace(0.5, 2, 7), np.linspace(-2, 2.2, 7))
GX, GY, GA = np.meshgrid(*NODES, indexing="ij")
PLACES = np.indices(GX.shape).reshape(3, -1).T
TINY = 1e-9


def layout(values: np.ndarray) -> TableLayout:
    found = taken_apart(values)
    assert found.rest < TINY
    return absorbed(arranged(found.parts, found.constant, None, TINY), TINY)


def same(values: np.ndarray) -> int:
    """How many tables, after looking that they say the same."""
    found = layout(values)
    assert found.at(PLACES) == pytest.approx(values.reshape(-1), abs=1e-7)
    return tables_of([found])


@pytest.mark.parametrize(
    ("values", "tables"),
    [
        (GX**2, 1),
        (np.full_like(GX, 0.3), 1),
        (GX + GY**2 + np.sin(GA), 3),
        (GX * np.sin(GA), 2),
        (GX * (1 + np.sin(GA)), 2),  # the sum hides in a factor
        ((GX + 3) * np.sin(GA), 2),
        (GX * np.sin(GA) + GY * np.sin(GA), 3),  # one factor serves two
        (GX * (2 + np.sin(GA)) + GY * (2 + np.sin(GA)), 3),
        (GX * np.sin(GA) + GY * np.cos(GA), 4),
        (GX * np.sin(GA) + GY * np.cos(GA) + GX**3 + np.tanh(GA), 6),  # a row of the 20 tables of the tilted machine
        (GX * np.sin(GA) + GX * np.cos(GA), 2),  # of one axis: put together
        (GX * GY + GX * GA, 3),
    ],
)
def test_the_fewest_tables(values: np.ndarray, tables: int) -> None:
    assert same(values) == tables


coefficient = st.floats(-2, 2, allow_nan=False).map(lambda value: round(value, 3))


@settings(derandomize=True, max_examples=some(40), deadline=None)
@given(st.lists(coefficient, min_size=8, max_size=8))
def test_any_sum_of_pairs_stays_the_same_function(c: list[float]) -> None:
    values = c[0] + c[1] * GX + c[2] * GY**2 + c[3] * np.sin(GA) + c[4] * GX * GY + c[5] * GX * np.cos(GA)
    values = values + c[6] * GY * np.cos(GA) + c[7] * GX**2 * np.sin(GA)
    assert same(values) <= 9


def test_what_changes_with_the_way_takes_two_tables_or_shares_them() -> None:
    plain = layout(GX**2 + GY)
    found = taken_apart_along(0.1 + 0.2 * GX, 0)
    turned = absorbed(arranged(found.parts, found.constant, 0, TINY), TINY)
    assert turned.way == 0
    assert tables_of([turned]) == 2
    assert tables_of([plain, turned]) == 3  # that of X becomes two


def test_scaling_scales_the_function() -> None:
    found = layout(0.2 + GX * np.sin(GA) + GY)
    assert found.scaled(3.0).at(PLACES) == pytest.approx(3 * found.at(PLACES))


def selection(values: np.ndarray, **more: frozenset[int]) -> PartSelection:
    faces: dict[tuple[int, int | None], Separation] = {(0, None): taken_apart(values)}
    return PartSelection(faces, TINY, **more)


def test_small_parts_go_first_and_together_stay_below_the_budget() -> None:
    chosen = selection(GX + 0.01 * GY + 0.001 * np.sin(GA))
    chosen.drop_small(0.002)
    assert chosen.tables(0) == 2
    assert 0 < chosen.lost <= 0.002


def test_few_tables_take_what_matters_most() -> None:
    values = GX + 0.5 * GY + 0.2 * GX * np.sin(GA) + 0.1 * np.cos(GA)
    sizes = []
    for tables in (6, 4, 2, 1, 0):
        chosen = selection(values)
        chosen.fit_into(tables)
        assert chosen.tables(0) <= tables
        sizes.append(chosen.lost)
    assert all(first <= second for first, second in pairwise(sizes))
    assert sizes[0] == 0
    assert sizes[-1] == pytest.approx(np.sqrt(np.mean(values**2)))


def test_a_sum_of_an_axis_over_itself_may_be_free() -> None:
    whole, spared = selection(GX + GY), selection(GX + GY, free=frozenset({0}))
    assert (whole.tables(0), spared.tables(0)) == (2, 1)
    absorbed_ones = [absorbed(one, TINY) for one in spared.layouts(0)]
    assert needed(0, absorbed_ones, frozenset({1})) == 2
