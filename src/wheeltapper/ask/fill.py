"""Filling a store: chunk after chunk, here or on workers, until nothing is missing."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

from wheeltapper.ask.filled import FilledStore
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.locks import locked
from wheeltapper.ground.notes import Shared, shared_notes
from wheeltapper.ground.progress import progress_shown, report, say
from wheeltapper.march.common.blocks import core_count

Place = tuple[int, ...]
Done = tuple[Place, str, tuple[Shared, ...]]
"""A chunk, an error ("" if there was none), and notes."""
ENVIRONMENT = {"OMP_NUM_THREADS": 1, "OPENBLAS_NUM_THREADS": 1, "MKL_NUM_THREADS": 1}
"""Environment variables of worker processes on this machine: linear algebra uses one thread, since the workers occupy
the cores. It replaces Dask's default, which also limits how much freed memory a process keeps. With that limit every
large array has to be requested from the system again."""
ATTEMPTS = 2
"""How often a chunk is tried again, alone, after its workers died. Also how often a cluster is started again if its
workers die while starting."""
DASHBOARD = "127.0.0.1:8787"
"""Address of the dashboard of workers on this machine. It is visible on this machine only; Dask's default opens it to
the network."""
PATIENCE = 120.0
"""Time that a cluster may be without workers, s. After that it is given up. On a busy machine a worker needs half a
minute to start again."""
ANSWER = 30.0
"""Time in which a scheduler has to answer, s."""
LOCAL = {
    "distributed.nanny.pre-spawn-environ": ENVIRONMENT,
    "distributed.deploy.lost-worker-timeout": f"{PATIENCE:g}s",
}
"""Dask settings of a cluster on this machine. Dask's default gives up workers that need more than 15 s to start
again."""


class ClusterError(RuntimeError):
    """The workers or their scheduler broke down; the chunks that they wrote are kept."""


def fill_store(
    store: FilledStore, *, resume: bool = False, workers: int = 0, scheduler: str | None = None,
    threads: int | None = None,
) -> list[str]:  # fmt: skip
    """Compute what a store shall hold; return what could not be computed.

    Parameters
    ----------
    store
        The store; its folder is new unless `resume`.
    resume
        Continue a store that exists: only missing chunks are computed.
    workers, scheduler
        A number of processes on this machine, or the address of a Dask scheduler; else the threads of this process.
    threads
        Number of threads of this process; by default one per core.
    """
    path, things = store.path, store.kind.things
    if path.exists() and not resume:
        raise InputError(
            str(path), "--output", "a store that is there already", "a new name, or --resume to go on with it"
        )
    with locked(path):
        if path.exists():
            store.check()
            store.mend()
        else:
            store.create()
        todo = store.missing_chunks()
        if todo and (workers or scheduler):
            store.compile_first()
        of = store.count
        done = of - sum(store.count_in(place) for place in todo)
        failed = []
        noted: tuple[Shared, ...] = ()
        report(things, done, of)
        try:
            for place, wrong, notes in _filled_here(store, todo, workers, scheduler, threads or core_count()):
                noted = shared_notes((*noted, *notes))
                if wrong:
                    failed.append(f"{store.described(place)}: {wrong}")
                else:
                    done += store.count_in(place)
                report(things, done, of)
        finally:
            for note in noted:
                say(f"note: {note.sentence_of(of)}")
    return failed


def _filled_here(
    store: FilledStore, todo: list[Place], workers: int, scheduler: str | None, threads: int
) -> Iterator[Done]:
    if not (workers or scheduler):
        for place in todo:
            yield _computed_chunk(store, place, threads)
        return
    try:
        yield from _on_cluster(store, todo, workers, scheduler)
    except (OSError, InputError, ClusterError):
        raise
    except Exception as error:
        raise ClusterError(f"the workers failed ({type(error).__name__}: {error})") from error


def _on_cluster(store: FilledStore, todo: list[Place], workers: int, scheduler: str | None) -> Iterator[Done]:
    distributed: Any = import_module("distributed")
    if scheduler:
        with _connected(scheduler) as client:
            yield from _filled_on_cluster(client, store, todo)
        return
    dask: Any = import_module("dask")
    with dask.config.set(LOCAL), _local_cluster(workers) as cluster, distributed.Client(cluster) as client:
        yield from _filled_on_cluster(client, store, todo)


def _connected(scheduler: str) -> Any:
    """Return a client of a scheduler; say that it is waited for, and refuse one that does not answer."""
    distributed: Any = import_module("distributed")
    say(f"looking for the scheduler at {scheduler}, for {ANSWER:g} s at most")
    try:
        return distributed.Client(scheduler, timeout=f"{ANSWER:g}s")
    except (OSError, ValueError) as error:
        found = f"{scheduler!r}, where no scheduler answers in {ANSWER:g} s ({error})"
        raise InputError("", "--scheduler", found, "the address of a Dask scheduler, as tcp://host:8786") from error


def _local_cluster(workers: int) -> Any:
    """Return a cluster on this machine; it is started again if its workers are killed while starting."""
    distributed: Any = import_module("distributed")
    settings = {"threads_per_worker": 1, "processes": True, "dashboard_address": DASHBOARD}
    for _ in range(ATTEMPTS):
        with suppress(RuntimeError):
            return distributed.LocalCluster(n_workers=workers, **settings)
    return distributed.LocalCluster(n_workers=workers, **settings)


def _computed_chunk(store: FilledStore, place: Place, threads: int) -> Done:
    """Compute one chunk in this process. Errors of the computation are returned; errors of the disk are raised."""
    try:
        with progress_shown(False):  # it is counted in the whole store
            notes = store.write(place, threads)
    except OSError:
        raise
    except Exception as error:
        return place, f"{type(error).__name__}: {error}", ()
    return place, "", notes


def worker_chunk(kind: Callable[[Path, Any], FilledStore], path: str, text: str, place: Place) -> Done:
    """Compute one chunk on a worker, of a store of this class."""
    return _computed_chunk(_opened_store(kind, path, text), place, 1)


@lru_cache(maxsize=4)
def _opened_store(kind: Callable[[Path, Any], FilledStore], path: str, text: str) -> FilledStore:
    return kind(Path(path), json.loads(text))


def _filled_on_cluster(client: Any, store: FilledStore, todo: list[Place]) -> Iterator[Done]:
    """Compute chunks on a cluster, a few more at a time than it has threads.

    When a worker dies, all its chunks are lost. Each is tried again alone, which shows the one that caused it.
    """
    distributed: Any = import_module("distributed")
    say(f"dashboard: {client.dashboard_link}")
    of = type(store), str(store.path.resolve()), json.dumps(store.spec)
    waiting, suspects = list(reversed(todo)), list[Place]()
    attempts: dict[Place, int] = {}
    pending: dict[Any, Place] = {}
    room = 3 * max(1, sum(client.nthreads().values()))

    def submit_chunk(place: Place) -> None:
        pending[client.submit(worker_chunk, *of, place, pure=False, retries=0)] = place

    while waiting or suspects or pending:
        while waiting and len(pending) < room:
            submit_chunk(waiting.pop())
        if not pending:
            submit_chunk(suspects.pop())
        for future in _wait_for_chunk(client, list(pending)):
            place = pending.pop(future)
            try:
                error = future.exception(timeout=PATIENCE)
                done = None if error else future.result(timeout=PATIENCE)
            except TimeoutError:  # the answer was lost with its worker
                waiting.append(place)
                continue
            if done is not None:
                yield done
            elif isinstance(error, OSError):
                raise error
            elif isinstance(error, distributed.KilledWorker) and attempts.get(place, 0) < ATTEMPTS:
                attempts[place] = attempts.get(place, 0) + 1
                suspects.append(place)
            else:
                yield place, f"{type(error).__name__}: {error}", ()


def _wait_for_chunk(client: Any, pending: list[Any]) -> Iterable[Any]:
    """Wait until at least one chunk is finished, as long as there is a worker."""
    distributed: Any = import_module("distributed")
    alone = 0.0
    while True:
        try:
            return list(distributed.wait(pending, timeout=PATIENCE / 10, return_when="FIRST_COMPLETED").done)
        except TimeoutError:
            alone = 0.0 if client.nthreads() else alone + PATIENCE / 10
        if alone > PATIENCE:
            raise ClusterError(f"no worker came back within {PATIENCE:g} s")
