"""Who works on the parts of a program: this process, or several others beside it. The results are the same."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.context import BaseContext
from typing import TypeVar

import numpy as np

from ncfix import fast
from ncfix.compensate.findings import Array, Mask
from ncfix.compensate.known import Known
from ncfix.compensate.options import FixOptions
from ncfix.compensate.settle import Agreed, Before, agree
from ncfix.compensate.verify import PathError, path_error
from ncfix.machine import Machine, State
from ncfix.program.dialect import Dialect
from ncfix.program.moves import Moves
from ncfix.program.pieces import Pieces

Value = TypeVar("Value")
Later = Callable[[], Value]
"""Gives a result that is being worked on, waiting for it if need be."""


@dataclass(frozen=True, slots=True)
class Task:
    """What all parts of a program have in common."""

    machine: Machine
    dialect: Dialect
    options: FixOptions

    def agree(self, moves: Moves, before: Before | None) -> Agreed:
        """The plan of a part."""
        return agree(moves, self.machine, self.dialect, self.options, before)

    def errors(
        self, moves: Moves, pieces: Pieces, start: Array, state: State, rows: Mask, known: Known | None
    ) -> PathError:
        """The tip errors of motions `rows` (n,) before and after; without those of each motion."""
        found = path_error(self.machine, moves, pieces, start, state=state, rows=rows, tilts=False, known=known)
        nothing = np.empty(0)
        return PathError(found.before, found.after, nothing, nothing, found.samples, found.way)


@dataclass(slots=True)
class Crew:
    """This process alone: everything is done when its result is asked for.

    ahead  how many parts are begun before the first has to be done
    """

    task: Task
    ahead: int = 0

    def agree(self, moves: Moves, before: Before | None) -> Later[Agreed]:
        """Begin the plan of a part."""
        return lambda: self.task.agree(moves, before)

    def errors(
        self, moves: Moves, pieces: Pieces, start: Array, state: State, rows: Mask, known: Known | None
    ) -> Later[PathError]:
        """Begin to find out tip errors."""
        return lambda: self.task.errors(moves, pieces, start, state, rows, known)


@dataclass(slots=True)
class Workers(Crew):
    """Other processes."""

    pool: ProcessPoolExecutor | None = None

    def agree(self, moves: Moves, before: Before | None) -> Later[Agreed]:
        """Begin the plan of a part."""
        assert self.pool is not None
        return self.pool.submit(_agree, moves, before).result

    def errors(
        self, moves: Moves, pieces: Pieces, start: Array, state: State, rows: Mask, known: Known | None
    ) -> Later[PathError]:
        """Begin to find out tip errors."""
        assert self.pool is not None
        return self.pool.submit(_errors, moves, pieces, start, state, rows, known).result


@contextmanager
def crew(jobs: int, machine: Machine, dialect: Dialect, options: FixOptions) -> Iterator[Crew]:
    """Those who work on a program: `jobs` processes beside this one, if that is more than one."""
    task = Task(machine, dialect, options)
    if jobs <= 1:
        yield Crew(task)
        return
    forks = "fork" in multiprocessing.get_all_start_methods()
    context: BaseContext = multiprocessing.get_context("fork" if forks else None)
    with ProcessPoolExecutor(jobs, context, initializer=_begin, initargs=(task, fast.engaged())) as pool:
        try:
            yield Workers(task, jobs + 1, pool)
        finally:
            pool.shutdown(cancel_futures=True)


_task: Task | None = None


def _begin(task: Task, compiled: bool) -> None:
    global _task
    _task = task
    if compiled:
        fast.engage()


def _agree(moves: Moves, before: Before | None) -> Agreed:
    assert _task is not None
    return _task.agree(moves, before)


def _errors(moves: Moves, pieces: Pieces, start: Array, state: State, rows: Mask, known: Known | None) -> PathError:
    assert _task is not None
    return _task.errors(moves, pieces, start, state, rows, known)
