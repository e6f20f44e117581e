"""Who works on many programs: this process, others beside it, or whatever the executor of a plugin reaches.

What comes out does not depend on it: results come in the order of the tasks, and a worker that dies takes one task with
it, not the batch.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, TypeAlias, TypeVar

from ncfix.diagnostics import UsageError
from ncfix.host import tie
from ncfix.plugins import called, nearest, registry

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future

Task = TypeVar("Task")
Result = TypeVar("Result")
Staff: TypeAlias = "Callable[[int], Executor]"
"""Makes an executor with so many workers."""


def processes(workers: int) -> Executor:
    """Processes of this machine; they end with this one."""
    from concurrent.futures import ProcessPoolExecutor

    return ProcessPoolExecutor(workers, initializer=tie)


BUILT_IN: Mapping[str, Staff] = {"processes": processes}


def staff(name: str) -> Staff:
    """The executors of that name; raises `UsageError` NCF015."""
    known: dict[str, Staff] = registry("executors", BUILT_IN)
    if name not in known:
        raise UsageError.of("NCF015", f"there is no executor {name!r}", hint=nearest(name, known))
    return partial(_made, name, known[name])


def _made(name: str, make: Staff, workers: int) -> Executor:
    from concurrent.futures import Executor

    executor: Executor = called("executors", name, make, workers, gives=Executor)
    return executor


def each(
    work: Callable[[Task], Result],
    tasks: Sequence[Task],
    make: Staff,
    workers: int,
    lost: Callable[[Task], Result],
) -> Iterator[Result]:
    """The results of `work` for all tasks, in their order, by `workers` workers.

    lost  the result for a task whose worker died over it twice, the second time alone
    """
    from concurrent.futures import BrokenExecutor

    rest = list(tasks)
    while rest:
        with make(min(workers, len(rest))) as executor:
            begun = [executor.submit(work, task) for task in rest]
            try:
                for future in begun:
                    yield future.result()
                    del rest[0]
            except BrokenExecutor:
                _forget(begun)
            except BaseException:
                _forget(begun)
                raise
        if rest:
            yield _alone(work, rest.pop(0), make, lost)


def _alone(work: Callable[[Task], Result], task: Task, make: Staff, lost: Callable[[Task], Result]) -> Result:
    from concurrent.futures import BrokenExecutor

    try:
        with make(1) as executor:
            return executor.submit(work, task).result()
    except BrokenExecutor:
        return lost(task)


def _forget(begun: Sequence[Future[Result]]) -> None:
    for future in begun:
        future.cancel()
