"""One function applied to many tasks by several processes, which share a large argument."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context
from typing import Any, TypeVar

from wheeltapper.ground.arguments import as_count

AHEAD = 4
"""Tasks that are submitted per process. A few wait, so that no process is idle."""
THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
"""Environment variables that limit the threads of linear algebra libraries."""

Shared = TypeVar("Shared")
Task = TypeVar("Task")
Result = TypeVar("Result")


def in_processes(
    function: Callable[[Shared, Task], Result], shared: Shared, tasks: Sequence[Task], workers: int | None = None
) -> Iterator[tuple[int, Result]]:
    """Yield the number and the result of each task, function(shared, task), in the order of completion.

    Parameters
    ----------
    function
        A function of a module, because the processes import it.
    shared, tasks
        The argument that all calls share, and the argument of each call; both can be pickled.
    workers
        Processes; by default one per core. One: no process is started.
    """
    allowed = (os.cpu_count() or 1) if workers is None else as_count(workers, "workers")
    many = min(allowed, len(tasks))
    if many < 2:
        for number, task in enumerate(tasks):
            yield number, function(shared, task)
        return
    with _single_threaded(), ProcessPoolExecutor(many, get_context("spawn"), _begin, (function, shared)) as pool:
        ahead = iter(enumerate(tasks))
        running: dict[Future[Any], int] = {}
        try:
            while True:
                with _deaf():
                    for number, task in ahead:
                        running[pool.submit(_call, task)] = number
                        if len(running) >= AHEAD * many:
                            break
                if not running:
                    return
                done, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in done:
                    yield running.pop(future), future.result()
        except BaseException:
            started = list(pool._processes.values())
            pool.shutdown(wait=False, cancel_futures=True)
            for process in started:  # otherwise the program would wait for the running tasks, half a minute each
                process.terminate()
            raise


_HELD: list[Any] = []
"""In a worker process: the function and the shared argument, sent once and not with each task."""


def _begin(function: Any, shared: Any) -> None:
    _HELD[:] = [function, shared]


def _call(task: Any) -> Any:
    return _HELD[0](_HELD[1], task)


@contextmanager
def _deaf() -> Iterator[None]:
    """Let processes that start here ignore Ctrl-C; the process that started them reacts, and ends them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Limit linear algebra to one thread in each process that starts here; the processes already use all cores."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
