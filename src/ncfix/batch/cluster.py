"""Runs the programs of a batch on a Dask cluster: `--executor dask://HOST:PORT` (the extra `cluster`).

Workers read programs and write outputs themselves. So they need the same version of ncfix, and the same folders under
the same paths; they work in the folder in which the batch was started. If a worker dies, another one gets its program
and writes the same output again. If the scheduler fails, the batch ends, and `--resume` continues it.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import suppress
from functools import partial
from importlib.util import find_spec
from threading import Event, Lock, Thread
from typing import Any, TypeVar

from ncfix.diagnostics import UsageError
from ncfix.version import __version__

CONNECT_S = 10
"""Time, s, for the scheduler to answer, at first and after it was gone."""
LOOK_S = 0.5
"""Interval, s, at which the connection to the scheduler is checked."""
Result = TypeVar("Result")


def cluster(address: str) -> Callable[[int], Executor]:
    """A factory of executors on a cluster; raises `UsageError` NCF029 if dask is not installed.

    address  dask://HOST:PORT of its scheduler
    """
    if find_spec("distributed") is None:
        raise UsageError.of("NCF029", "dask.distributed is not installed", hint="pip install 'ncfix[cluster]'")
    return partial(ClusterExecutor, address)


class ClusterExecutor(Executor):
    """Submits tasks to all workers of a cluster, however many are asked for."""

    def __init__(self, address: str, workers: int) -> None:
        self.address = address
        self.client = self._connected(address.rpartition("://")[2])
        self._check_workers()
        self._folder = os.getcwd()
        self._lock = Lock()
        self._waiting: dict[Future[Any], Any] = {}
        self._over = Event()
        Thread(target=self._watch, daemon=True).start()

    def _connected(self, place: str) -> Any:
        from distributed import Client

        logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # what it has to say, ncfix says itself
        connect: Callable[..., Any] = Client
        try:
            return connect(f"tcp://{place}", timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            hint = "start it, or name another one; --resume continues a batch that has begun"
            raise UsageError.of("NCF029", f"there is no scheduler at {self.address}", hint=hint) from error

    def _check_workers(self) -> None:
        versions = self.client.run(_version)
        if not versions:
            self.client.close()
            raise UsageError.of(
                "NCF029", f"the scheduler at {self.address} has no workers", hint="dask worker HOST:PORT --nthreads 1"
            )
        others = {found for found in versions.values() if found != __version__}
        if others:
            self.client.close()
            text = f"workers of {self.address} have ncfix {', '.join(sorted(others))}, but this is {__version__}"
            raise UsageError.of("NCF029", text, hint="install the same version on all of them")

    def submit(self, work: Callable[..., Result], /, *given: Any, **named: Any) -> Future[Result]:
        """Submit a task; its future raises `BrokenExecutor` if several workers died over it, or the cluster is gone."""
        outer: Future[Result] = Future()
        try:
            inner = self.client.submit(_there, self._folder, work, *given, pure=False, **named)
        except Exception as error:
            raise BrokenExecutor(str(error)) from error
        with self._lock:
            self._waiting[outer] = inner
        inner.add_done_callback(partial(self._came, outer))
        return outer

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Disconnect from the cluster; tasks that have not begun are dropped."""
        self._over.set()
        with self._lock:
            rest = list(self._waiting.items())
        for outer, inner in rest:
            outer.cancel()
            with suppress(Exception):
                inner.cancel()
        with suppress(Exception):
            self.client.close(timeout=CONNECT_S)

    def _came(self, outer: Future[Any], inner: Any) -> None:
        from distributed.scheduler import KilledWorker

        if self._taken(outer) is None:
            return
        if inner.status == "finished":
            try:
                outer.set_result(inner.result(timeout=CONNECT_S))
            except Exception as error:
                outer.set_exception(BrokenExecutor(str(error)))
            return
        failed = inner.exception(timeout=CONNECT_S) if inner.status == "error" else None
        if failed is None or isinstance(failed, KilledWorker):
            failed = BrokenExecutor(f"{self.address}: {failed or inner.status}")
        outer.set_exception(failed)

    def _taken(self, outer: Future[Any]) -> Any:
        """The inner future of a task, returned once; None if nobody waits for its result any more."""
        with self._lock:
            inner = self._waiting.pop(outer, None)
        return inner if inner is not None and outer.set_running_or_notify_cancel() else None

    def _watch(self) -> None:
        """Fail all waiting tasks when the cluster is gone."""
        while not self._over.wait(LOOK_S):
            if self.client.status in ("closed", "closing"):
                with self._lock:
                    rest = list(self._waiting)
                for outer in rest:
                    if self._taken(outer) is not None:
                        outer.set_exception(BrokenExecutor(f"{self.address} is gone"))


def _version() -> str:
    return __version__


def _there(folder: str, work: Callable[..., Result], *given: Any, **named: Any) -> Result:
    """Run a task in the folder in which the batch was started, to which its paths are relative."""
    if os.getcwd() != folder:
        os.chdir(folder)
    return work(*given, **named)
