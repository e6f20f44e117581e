"""The compiled scan of Klartext finds what the plain one finds, to the last bit."""

from __future__ import annotations

from random import Random

import numpy as np
import pytest

from conftest import require_core
from ncfix import core
from ncfix_heidenhain.klartext.blocks import scan, split
from program.test_many_blocks import klartext

CYCLE = [
    "CYCL DEF 200 DRILLING ~",
    "Q200=2 ;CLEARANCE 5 ~",
    "Q201=-3,5 ;DEPTH",
    "L X+1 ; a 5, b",
    "L \x01 X+5",
    "L X1.2.3",
]


def assert_same(source: bytes) -> None:
    blocks = split(source)
    core.use("plain")
    plain = scan(source, blocks).expanded()
    core.use("compiled")
    found = scan(source, blocks).expanded()
    assert found.shapes == plain.shapes
    for name in ("comment", "first_number", "spans", "values"):
        np.testing.assert_array_equal(getattr(found, name), getattr(plain, name), err_msg=name)


@pytest.mark.parametrize("ends", ["\n", "\r\n"])
@pytest.mark.parametrize("odd", [False, True])
def test_both_scans_find_the_same(ends: str, odd: bool) -> None:
    require_core()
    random = Random(5)
    lines = [klartext(Random(random.randrange(150)), random) for _ in range(1500)]
    if odd:
        for place in (0, 700, 1499):
            lines[place:place] = CYCLE
    assert_same(ends.join(lines).encode("latin-1"))
