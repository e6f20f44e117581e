"""Works on many programs in parallel.

Workers are processes of this computer, or those of a plugin's executor. The results do not depend on that: they come in
the order of the tasks, and a worker that dies costs one task, not the batch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from ncfix.diagnostics import UsageError
from ncfix.host import tie
from ncfix.plugins import called, nearest, registry

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future

Task = TypeVar("Task")
Result = TypeVar("Result")
ExecutorMaker: TypeAlias = "Callable[[int], Executor]"
"""Makes an executor with a number of workers."""
SCHEME = "dask://"
"""Beginning of the name of a cluster."""


def processes(workers: int) -> Executor:
    """An executor of processes on this computer; they end with this process."""
    from concurrent.futures import ProcessPoolExecutor

    return ProcessPoolExecutor(workers, initializer=tie)


BUILT_IN: Mapping[str, ExecutorMaker] = {"processes": processes}


def executor_of(name: str) -> ExecutorMaker:
    """The executor maker with a name, or for a cluster, `dask://HOST:PORT`; raises `UsageError` NCF015, NCF029."""
    if name.startswith(SCHEME):
        from ncfix.batch.cluster import cluster

        return cluster(name)
    known: dict[str, ExecutorMaker] = registry("executors", BUILT_IN)
    if name not in known:
        raise UsageError.of("NCF015", f"there is no executor {name!r}", hint=nearest(name, known))
    return partial(_made, name, known[name])


def _made(name: str, make: ExecutorMaker, workers: int) -> Executor:
    from concurrent.futures import Executor

    return called("executors", name, make, workers, gives=Executor)


def results_in_order(
    work: Callable[[Task], Result],
    tasks: Sequence[Task],
    make: ExecutorMaker,
    workers: int,
    lost: Callable[[Task], Result],
    done: Callable[[Task, Result], None] = lambda task, result: None,
) -> Iterator[Result]:
    """The results of `work` for all tasks, in their order, by `workers` workers.

    lost  makes the result of a task whose worker died twice, the second time with this task alone
    done  called with each result as soon as it is available, in any order
    """
    from concurrent.futures import BrokenExecutor, as_completed

    rest, results, wanted = dict(enumerate(tasks)), dict[int, Result](), 0

    def came(number: int, result: Result) -> None:
        done(rest.pop(number), result)
        results[number] = result

    while rest:
        with make(min(workers, len(rest))) as executor:
            begun: dict[Future[Result], int] = {}
            try:
                with suppress(BrokenExecutor):
                    for number, task in rest.items():
                        begun[executor.submit(work, task)] = number
                for future in as_completed(list(begun)):
                    try:
                        result = future.result()
                    except BrokenExecutor:
                        continue
                    came(begun.pop(future), result)
                    while wanted in results:
                        yield results.pop(wanted)
                        wanted += 1
            except BaseException:
                for future in begun:
                    future.cancel()
                raise
        if rest:
            number = min(rest)
            came(number, _done_alone(work, rest[number], make, lost))
        while wanted in results:
            yield results.pop(wanted)
            wanted += 1


def _done_alone(
    work: Callable[[Task], Result], task: Task, make: ExecutorMaker, lost: Callable[[Task], Result]
) -> Result:
    from concurrent.futures import BrokenExecutor

    try:
        with make(1) as executor:
            return executor.submit(work, task).result()
    except BrokenExecutor:
        return lost(task)
