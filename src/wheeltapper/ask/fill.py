"""Filling a store: chunk after chunk, here or on workers, until nothing is missing."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import suppress
from functools import lru_cache
from importlib import import_module
from math import prod
from pathlib import Path
from typing import Any

from wheeltapper.ask.store import Store
from wheeltapper.ask.study import Study
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.locks import locked
from wheeltapper.ground.notes import Shared, shared_notes
from wheeltapper.ground.progress import progress_shown, report, say
from wheeltapper.march.common.blocks import core_count

Place = tuple[int, ...]
Done = tuple[Place, int, str, tuple[Shared, ...]]
"""A chunk, its number of cells, an error ("" if there was none), and notes."""
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
    path: Path, spec: dict[str, Any], *, resume: bool = False, workers: int = 0, scheduler: str | None = None,
    threads: int | None = None,
) -> list[str]:  # fmt: skip
    """Compute a study into a store; return what could not be computed, by its parameters.

    Parameters
    ----------
    path
        The store's folder, new unless `resume`.
    spec
        Result of `spec.read_study`.
    resume
        Continue a store that exists: only missing chunks are computed.
    workers, scheduler
        A number of processes on this machine, or the address of a Dask scheduler; else the threads of this process.
    threads
        Number of threads of this process; by default one per core.
    """
    store = Store(path, spec)
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
            compile_first(store.study)
        of = store.study.cell_count
        done = of - sum(_cell_count(store, place) for place in todo)
        failed = []
        noted: tuple[Shared, ...] = ()
        report("cells", done, of)
        try:
            for place, cells, wrong, notes in _filled_here(store, todo, workers, scheduler, threads or core_count()):
                noted = shared_notes((*noted, *notes))
                if wrong:
                    failed.append(f"{store.chunk_ranges(place)}: {wrong}")
                else:
                    done += cells
                report("cells", done, of)
        finally:
            for note in noted:
                say(f"note: {note.sentence_of(of)}")
    return failed


def _cell_count(store: Store, place: Place) -> int:
    return prod(part.stop - part.start for part in store.chunk_cells(place))


def _filled_here(store: Store, todo: list[Place], workers: int, scheduler: str | None, threads: int) -> Iterator[Done]:
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


def _on_cluster(store: Store, todo: list[Place], workers: int, scheduler: str | None) -> Iterator[Done]:
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


def _computed_chunk(store: Store, place: Place, threads: int) -> Done:
    """Compute one chunk in this process. Errors of the computation are returned; errors of the disk are raised."""
    try:
        with progress_shown(False):  # cells are counted in the whole store
            cells, notes = store.write(place, threads)
    except OSError:
        raise
    except Exception as error:
        return place, 0, f"{type(error).__name__}: {error}", ()
    return place, cells, "", notes


def worker_chunk(path: str, text: str, place: Place) -> Done:
    """Compute one chunk on a worker."""
    return _computed_chunk(_opened_store(path, text), place, 1)


@lru_cache(maxsize=4)
def _opened_store(path: str, text: str) -> Store:
    return Store(Path(path), json.loads(text))


def _filled_on_cluster(client: Any, store: Store, todo: list[Place]) -> Iterator[Done]:
    """Compute chunks on a cluster, a few more at a time than it has threads.

    When a worker dies, all its chunks are lost. Each is tried again alone, which shows the one that caused it.
    """
    distributed: Any = import_module("distributed")
    say(f"dashboard: {client.dashboard_link}")
    text = json.dumps(store.spec)
    waiting, suspects = list(reversed(todo)), list[Place]()
    attempts: dict[Place, int] = {}
    pending: dict[Any, Place] = {}
    room = 3 * max(1, sum(client.nthreads().values()))

    def submit_chunk(place: Place) -> None:
        pending[client.submit(worker_chunk, str(store.path.resolve()), text, place, pure=False, retries=0)] = place

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
                yield place, 0, f"{type(error).__name__}: {error}", ()


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


def compile_first(study: Study) -> None:
    """Compute one cell here, so that kernels are compiled, and told of, before all workers ask for them."""
    from wheeltapper.ask.cells import compute_cells

    corner = study.changed_values(tuple(slice(0, 1) for _ in study.shape))
    with suppress(Exception):  # it is said with the chunk
        compute_cells(study, {path: values[:1] for path, values in corner.items()}, 1)
