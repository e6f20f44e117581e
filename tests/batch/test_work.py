"""Work for several processes: the same results in the same order, and one that dies takes one task with it."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import pytest

from ncfix.batch.work import BUILT_IN, executor_of, results_in_order
from ncfix.diagnostics import UsageError

LETHAL = 3


def square(number: int) -> int:
    if number == LETHAL:
        os._exit(1)
    return number * number


def failing(number: int) -> int:
    raise ValueError(number)


def lost(number: int) -> int:
    return -number


@pytest.mark.parametrize("workers", [1, 2, 5])
def test_results_come_in_the_order_of_the_tasks(workers: int) -> None:
    tasks = [9, 1, 8, 2, 7]
    assert list(results_in_order(square, tasks, ThreadPoolExecutor, workers, lost)) == [81, 1, 64, 4, 49]


def test_a_worker_that_dies_takes_one_task_with_it() -> None:
    assert list(results_in_order(square, [1, 2, 3, 4, 5], BUILT_IN["processes"], 2, lost)) == [1, 4, -3, 16, 25]


def test_what_the_work_raises_is_raised() -> None:
    with pytest.raises(ValueError, match="7"):
        list(results_in_order(failing, [7, 8], ThreadPoolExecutor, 2, lost))


def test_an_executor_that_is_not_there() -> None:
    with pytest.raises(UsageError, match="did you mean processes") as caught:
        executor_of("proceses")
    assert caught.value.code == "NCF015"
