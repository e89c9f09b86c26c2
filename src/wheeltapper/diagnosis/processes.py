"""One function on many tasks, by several processes that share a large argument.

A process that dies (killed, or out of memory) takes no other task with it. Its own task is tried once more when all
others are done, with the machine to itself, and is lost if its process dies again.
"""

from __future__ import annotations

import os
import pickle
import signal
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from functools import lru_cache
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from typing import Any, NamedTuple, TypeVar

from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.errors import InputError
from wheeltapper.record.recordings.apart import how_it_ended

STILLBORN = 4
"""After so many processes in a row that died as they started there is no room for more: the others go on without."""
LINGERING = 1.0
"""Seconds that a process may take to end after it has closed its connection."""
THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
"""Environment variables that limit the threads of linear algebra libraries."""

Shared = TypeVar("Shared")
Task = TypeVar("Task")
Result = TypeVar("Result")


class Lost(NamedTuple):
    """What there is instead of a result where two processes have died of a task."""

    reason: str  # of the last one

    def __str__(self) -> str:
        return f"two processes died of it, and the last one {self.reason}"


class ProcessError(RuntimeError):
    """Processes died, so that there is no result; what the others computed is kept where a file was asked for."""


def in_processes(
    function: Callable[[Shared, Task], Result], shared: Shared, tasks: Sequence[Task], workers: int | None = None
) -> Generator[tuple[int, Result | Lost], None, None]:
    """Yield the number and the result of each task, function(shared, task), in the order of completion.

    Whoever stops before the end closes the iterator: that ends the processes, and whatever they are doing.

    Parameters
    ----------
    function
        A function of a module, because the processes import it. What it raises is raised here.
    shared, tasks
        The argument that all calls share, and the argument of each call; both can be pickled.
    workers
        Processes; by default one per core. One: no process is started.

    Raises
    ------
    InputError
        If one of these cannot be pickled, and several processes are to have it.
    ProcessError
        If processes die as they start until none is left.
    """
    allowed = (os.cpu_count() or 1) if workers is None else as_count(workers, "workers")
    many = min(allowed, len(tasks))
    if many < 2:
        for number, task in enumerate(tasks):
            yield number, function(shared, task)
        return
    work, again = _pickled((function, shared)), list[int]()
    with _single_threaded():
        with closing(_results_of_tasks(work, list(enumerate(tasks)), many)) as found:
            for number, result in found:
                if isinstance(result, Lost):
                    again.append(number)
                else:
                    yield number, result
        with closing(_results_of_tasks(work, [(number, tasks[number]) for number in again], 1)) as found:
            yield from found


def _results_of_tasks(work: bytes, tasks: list[tuple[int, Any]], many: int) -> Generator[tuple[int, Any], None, None]:
    """Yield what `many` processes find, or `Lost` where one died; a new process takes its place."""
    waiting, left, stillborn = deque(tasks), len(tasks), 0
    workers: dict[Any, _Worker] = {}
    try:
        while left:
            while len(workers) < min(many, left):
                worker = _Worker(work)
                workers[worker.connection] = worker
            for connection in wait(list(workers)):
                worker = workers[connection]
                number, answer = worker.number, worker.receive_result()
                if isinstance(answer, Lost):
                    del workers[connection]
                    stillborn += not worker.ready
                    if stillborn == STILLBORN:
                        stillborn, many = 0, len(workers)
                        if not many:
                            raise ProcessError(
                                f"{STILLBORN} processes died as they started, the last one {answer.reason}"
                            )
                else:
                    stillborn = 0
                    worker.start_task(waiting)
                if number is not None:
                    left -= 1
                    yield number, answer
    finally:
        for worker in workers.values():
            worker.end_process()


class _Worker:
    """A process that computes one task at a time; `number` is that of its task, None where it has none."""

    def __init__(self, work: bytes) -> None:
        context = get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.ready = False
        self.number: int | None = None
        self._work = work
        self._process = context.Process(target=_serve_tasks, args=(theirs,), daemon=True)
        with _interrupts_blocked():
            self._process.start()
        theirs.close()  # else the connection would outlive the process, and its death go unheard

    def receive_result(self) -> Any:
        """Return the result of the task, or that it is lost since the process died; the first answer means nothing."""
        try:
            found, error = self.connection.recv()
        except (EOFError, OSError):
            self._process.join(LINGERING)  # it may be about to end by itself, which tells more
            return Lost(how_it_ended(self.end_process()))
        if error is not None:
            raise error
        if not self.ready:
            self.ready = True
            self._send_bytes(self._work)
        return found

    def start_task(self, waiting: deque[tuple[int, Any]]) -> None:
        """Begin with the next task, if there is one."""
        self.number, task = waiting.popleft() if waiting else (None, None)
        if self.number is not None:
            self._send_bytes(_pickled(task))

    def end_process(self) -> int:
        """End the process at once; return its exit code."""
        self._process.kill()
        self._process.join()
        self.connection.close()
        return self._process.exitcode or 0

    def _send_bytes(self, packed: bytes) -> None:
        with suppress(OSError):  # of a process that has just died; the next answer says so
            self.connection.send_bytes(packed)


def _pickled(what: Any) -> bytes:
    try:
        return pickle.dumps(what)
    except Exception as error:
        found = f"more than one process, to which not all can be sent ({error})"
        raise InputError("", "workers", " ".join(found.split()), "1, or nothing but functions of modules") from error


def _serve_tasks(connection: Connection) -> None:
    """Compute tasks, one after the other, until nobody asks any more."""
    with suppress(EOFError, OSError):
        connection.send((None, None))
        work = connection.recv_bytes()
        while True:
            connection.send(_result_or_error(work, connection.recv_bytes()))


_loaded = lru_cache(maxsize=1)(pickle.loads)


def _result_or_error(work: bytes, task: bytes) -> tuple[Any, BaseException | None]:
    """Return a result, or what was raised, as something that can be sent."""
    try:
        function, shared = _loaded(work)
        return function(shared, pickle.loads(task)), None
    except BaseException as error:
        told = error
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:
            told = RuntimeError(f"{type(error).__name__}: {error}")
        told.add_note("In another process:\n" + "".join(traceback.format_exception(error)))
        return None, told


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
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
