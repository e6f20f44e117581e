"""Functions taken apart: the parts put together again are the function, and no part can be said by the others."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.tables.separable import Part, Product, Single, products, taken_apart, taken_apart_along

X, Y, A = (np.linspace(-1, 1, 7), np.linspace(0, 2, 6), np.linspace(-2, 2, 8))
GX, GY, GA = np.meshgrid(X, Y, A, indexing="ij")


def summed(parts: tuple[Part, ...], shape: tuple[int, ...]) -> np.ndarray:
    """The sum of the parts on the whole grid."""
    total = np.zeros(shape)
    places = np.indices(shape)
    for part in parts:
        if isinstance(part, Single):
            total += part.values[places[part.axis]]
        else:
            total += part.size * part.first[places[part.axes[0]]] * part.second[places[part.axes[1]]]
    return total


def test_sums_and_products_are_found_as_few_as_they_are() -> None:
    values = 3 + GX**2 + np.sin(GA) + GX * np.cos(GA) + GY * np.sin(GA) + GY * GA
    found = taken_apart(values)
    pairs = [part.axes for part in found.parts if isinstance(part, Product)]
    assert sorted(pairs) == [(0, 2), (1, 2)]  # Y sin A + Y A is one product
    assert found.rest < 1e-12
    assert found.constant + summed(found.parts, values.shape) == pytest.approx(values, abs=1e-12)


def test_parts_are_orthogonal_and_their_sizes_add_up() -> None:
    values = np.exp(GX * GY) * np.cos(GA + GX)
    found = taken_apart(values)
    total = sum(part.size**2 for part in found.parts) + found.rest**2
    assert total == pytest.approx(np.mean((values - found.constant) ** 2))
    assert [part.size for part in found.parts] == sorted((part.size for part in found.parts), reverse=True)


def test_what_needs_three_axes_is_the_rest() -> None:
    values = (GX - GX.mean()) * (GY - GY.mean()) * (GA - GA.mean())
    found = taken_apart(values)
    assert not found.parts
    assert found.rest == pytest.approx(np.sqrt(np.mean(values**2)))


def test_what_changes_with_a_way_has_that_axis_in_every_part() -> None:
    values = 0.5 + GX + GY**2 + GX * np.sin(GA)
    found = taken_apart_along(values, 0)
    assert all(part.axis == 0 if isinstance(part, Single) else 0 in part.axes for part in found.parts)
    assert found.constant == 0
    assert found.rest < 1e-12
    assert summed(found.parts, values.shape) == pytest.approx(values, abs=1e-12)


def test_products_have_factors_of_rms_one_whatever_the_sign_of_the_decomposition() -> None:
    (first, *others) = products(np.outer(X, -3 * np.cos(A)), (0, 2))
    assert max((part.size for part in others), default=0) < 1e-12
    assert np.mean(first.first**2) == pytest.approx(1)
    assert np.mean(first.second**2) == pytest.approx(1)
    assert first.second[np.argmax(np.abs(first.second))] > 0
    assert first.on(0) is first.first
    assert first.across(0) == 2
