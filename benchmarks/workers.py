"""Cells computed by a peer in as many processes as there are cores, all starting at the same moment.

Every process prepares its solver and its share of the cells and computes them once; when it is asked for the time, it
waits for the others, and then measures how long its share takes. The slowest process counts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context
from multiprocessing.synchronize import Barrier
from typing import Any, NamedTuple, Protocol

from machine import no_garbage_collection, seconds
from problems import Case, Outcome, Scaled, scaled

PATIENCE = 300.0
"""How long a process waits for the others, s."""


class Code(NamedTuple):
    """A peer, its tolerance, and the number of landings after which it stops; None: at the end."""

    name: str
    tolerance: float
    landings: int | None


class Share(Protocol):
    """Some cells, ready to be computed by a peer."""

    def __call__(self) -> Any:
        """Compute them all."""

    def read(self, raw: Any) -> list[Outcome]:
        """Put the answers into SI units."""


class OneByOne:
    """Cells that one solver computes one after the other; it is made once and given the numbers of each cell."""

    def __init__(self, solver: Any, problems: Sequence[Scaled]) -> None:
        self._solver, self._problems = solver, problems

    def __call__(self) -> list[Any]:
        """Compute them all."""
        answers = []
        for problem in self._problems:
            self._solver.problem = problem
            answers.append(self._solver())
        return answers

    def read(self, raw: list[Any]) -> list[Outcome]:
        """Put the answers into SI units."""
        outcomes = []
        for problem, answer in zip(self._problems, raw, strict=True):
            self._solver.problem = problem
            outcomes.append(self._solver.read(answer))
        return outcomes


def solver_of(name: str) -> Any:
    """Return the class of a peer with events; it is imported where it is needed."""
    if name.startswith("heyoka"):
        from peer_heyoka import Heyoka

        return Heyoka
    if name.startswith("scipy"):
        from peer_scipy import Scipy

        return Scipy
    from peer_cvode import Cvode

    return Cvode


@cache
def share_of(code: Code, cells: tuple[Case, ...]) -> Share:
    """Return some cells prepared for a peer."""
    problems = [scaled(cell) for cell in cells]
    if not code.name.startswith("diffrax"):
        return OneByOne(solver_of(code.name)(problems[0], code.tolerance, code.landings), problems)
    from peer_diffrax import DiffraxMany

    return DiffraxMany(problems, code.name.split()[1], code.tolerance)


_barrier: Barrier | None = None


def _begin(barrier: Barrier) -> None:
    """Remember, in a new process, where all wait for each other."""
    global _barrier
    _barrier = barrier


def _answers(code: Code, cells: tuple[Case, ...]) -> list[Outcome]:
    """Compute a share."""
    share = share_of(code, cells)
    return share.read(share())


def _time(code: Code, cells: tuple[Case, ...]) -> float:
    """Return how long a share takes that all processes begin at the same moment; it was computed before."""
    assert _barrier is not None
    share = share_of(code, cells)
    _barrier.wait(PATIENCE)
    with no_garbage_collection():
        return seconds(share)


class Workers:
    """Processes that compute shares of cells at the same time."""

    def __init__(self, processes: int) -> None:
        context = get_context("spawn")  # the threads of numba, heyoka and jax do not survive a fork
        barrier = context.Barrier(processes)
        self._pools = [ProcessPoolExecutor(1, context, _begin, (barrier,)) for _ in range(processes)]

    def _each(self, do: Callable[[Code, tuple[Case, ...]], Any], code: Code, cells: Sequence[Case]) -> list[Any]:
        """Return what each process makes of its share, which is always the same one."""
        step = len(self._pools)
        tasks = [pool.submit(do, code, tuple(cells[k::step])) for k, pool in enumerate(self._pools)]
        return [task.result() for task in tasks]

    def answers(self, code: Code, cells: Sequence[Case]) -> list[Outcome]:
        """Return the answers in the order of the cells."""
        shares = self._each(_answers, code, cells)
        return [shares[k % len(shares)][k // len(shares)] for k in range(len(cells))]

    def seconds(self, code: Code, cells: Sequence[Case]) -> float:
        """Return how long the slowest process takes for its share of cells that were computed before."""
        return float(max(self._each(_time, code, cells)))

    def close(self) -> None:
        """End the processes."""
        for pool in self._pools:
            pool.shutdown()
