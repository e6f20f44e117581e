"""The exchange of candidates: its shortcut finds what looking at everything finds."""

from __future__ import annotations

import numpy as np
import pytest

from ncfix.measure.plan import Pool, best_addition, choose, variances


def pool(seed: int, candidates: int = 150, targets: int = 200) -> Pool:
    rng = np.random.default_rng(seed)
    return Pool(
        rng.normal(size=(candidates, 3, 12)), rng.normal(size=(targets, 12)) * rng.uniform(0.1, 2, (targets, 1))
    )


@pytest.mark.parametrize(("seed", "count"), [(0, 2), (1, 5), (2, 9), (3, 30)])
def test_the_best_addition_is_that_of_all_variances_written_out(seed: int, count: int) -> None:
    whole = pool(seed)
    others = np.random.default_rng(seed).permutation(len(whole.blocks))[:count].tolist()
    worst = [np.inf if k in others else float(variances(whole, [*others, k]).max()) for k in range(len(whole.blocks))]
    best, value = best_addition(whole, others)
    assert worst[best] == pytest.approx(min(worst), rel=1e-6)  # a ridge of 1e-9 where the others leave much open
    assert value == pytest.approx(min(worst), rel=1e-6)


def test_a_choice_cannot_be_bettered_by_one_exchange() -> None:
    whole = pool(4)
    chosen = choose(whole, 10).tolist()
    worst = variances(whole, chosen).max()
    for place in range(len(chosen)):
        others = chosen[:place] + chosen[place + 1 :]
        assert best_addition(whole, others)[1] > 0.98 * worst  # a pass that gains half a percent is the last one
