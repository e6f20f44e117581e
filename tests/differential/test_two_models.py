"""The product's model of a machine and the judge's, written apart from the same page, mean the same machine."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import ncfix.machine
from differential.errors import LETTERS, Machine

MACHINES = ["three", "table", "four_a", "five_ac", "five_bc"]
SECOND_ORDER = 1e-6
"""mm: rotations of 1e-4 rad may be composed in another order, over an arm of 100 mm: 1e-4**2 * 100."""


@pytest.mark.parametrize("name", MACHINES)
def test_tips_agree(machine: Callable[[str], Machine], machine_file: Callable[[str], Path], name: str) -> None:
    mine, product = machine(name), ncfix.machine.load(str(machine_file(name)))
    rng = np.random.default_rng(4)
    q = np.zeros((500, 9))
    q[:, :3], q[:, 3:6] = rng.uniform(-400, 400, (500, 3)), rng.uniform(-120, 120, (500, 3))
    length = rng.uniform(0, 200, 500)
    own = q[:, [LETTERS.index(axis) for axis in product.axis_names]].copy()
    own[:, product.rotary] = np.radians(own[:, product.rotary])
    np.testing.assert_allclose(product.tip(own, length), mine.tip(q, length), atol=1e-9)
    state = ncfix.machine.State(tool_length=length)
    np.testing.assert_allclose(product.actual_tip(own, state), mine.actual_tip(q, length), atol=SECOND_ORDER)
    np.testing.assert_allclose(product.actual(own, state)[:, :3, 3], mine.actual_tip(q, length), atol=SECOND_ORDER)
