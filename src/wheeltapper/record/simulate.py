"""The verb: simulate a scenario."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from itertools import count
from pathlib import Path
from threading import Event
from typing import Literal, TypeVar, overload

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.notes import Note
from wheeltapper.ground.progress import Progress, progress_shown, report, reporting, sayer
from wheeltapper.ground.warned import ModelWarning, warn_of
from wheeltapper.lower import extent
from wheeltapper.lower.door import lowered_scenario
from wheeltapper.lower.lowered import balanced
from wheeltapper.march import run
from wheeltapper.march.common.blocks import algebra_on_one_thread, core_count
from wheeltapper.record.arguments import as_scenario, as_scenarios, check_method
from wheeltapper.record.beyond import beyond_laws
from wheeltapper.record.record import Record
from wheeltapper.record.rigid import rigid_track

__all__ = ["ModelWarning", "simulate"]

Method = Literal["default", "strict"]
T = TypeVar("T")
R = TypeVar("R")


@overload
def simulate(
    scenario: Scenario | str | Path, method: Method = "default", *, threads: int | None = None,
    progress: Progress = True,
) -> Record: ...  # fmt: skip
@overload
def simulate(
    scenario: Iterable[Scenario | Path], method: Method = "default", *, threads: int | None = None,
    progress: Progress = True,
) -> list[Record]: ...  # fmt: skip
def simulate(
    scenario: Scenario | str | Path | Iterable[Scenario | Path],
    method: Method = "default",
    *,
    threads: int | None = None,
    progress: Progress = True,
) -> Record | list[Record]:
    """Simulate a scenario: every loss of contact, every impact and every force maximum, located exactly.

    Parameters
    ----------
    scenario
        A scenario, or the path of its TOML file; or several of them, which are computed in parallel.
    method
        For a wheelset, "default" is a Taylor series of order 12, and "strict" one of order 20 with a thousand times
        smaller step tolerance. For a wagon they are DOP853 with step tolerances of 1e-7 and 3e-11.
    threads
        Number of scenarios that are computed at a time; by default one per core.
    progress
        True: a bar on a terminal or in a notebook, after two seconds; False: no bar. Or a function, which is called
        instead with what is being done ("marching"), how much of it is done, and the total (0: unknown). An exception
        that it raises ends the run.

    Returns
    -------
    Record or list of Record
        A record is also returned if the computation could not finish: its `outcome` states the reason, and the computed
        part is kept.

    Raises
    ------
    InputError
        If a scenario cannot be simulated.
    """
    check_method(method)
    with progress_shown(progress):
        if isinstance(scenario, Scenario | str | Path):
            return simulated_scenario(as_scenario(scenario), method)
        held = core_count() if threads is None else as_count(threads, "threads")
        scenarios, done = as_scenarios(scenario), count(1)
        return side_by_side(
            lambda one: simulated_scenario(one, method), scenarios, held,
            lambda: report("scenarios", next(done), len(scenarios)),
        )  # fmt: skip


class _StoppedError(Exception):
    """Another run was interrupted."""


def side_by_side(work: Callable[[T], R], over: Iterable[T], threads: int, tell: Callable[[], None]) -> list[R]:
    """Do a work that simulates for several things at a time; an error of one, or an interruption, soon ends all.

    `tell` is called after each.
    """
    stop, say_line = Event(), sayer()

    def raise_if_stopped(*_: object) -> None:
        if stop.is_set():
            raise _StoppedError

    def do_one(of: T) -> R:
        with reporting(raise_if_stopped, say_line):
            return work(of)

    with algebra_on_one_thread(), ThreadPoolExecutor(threads) as pool:
        try:
            waiting = [pool.submit(do_one, of) for of in over]
            for future in as_completed(waiting):
                future.result()  # what ends this one ends all
                tell()
            return [future.result() for future in waiting]
        finally:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)


def simulated_quietly(scenario: Scenario, method: str = "default") -> Record:
    """Simulate a scenario that the user has not made, such as a part of a passage; its notes are no warnings."""
    return simulated_scenario(scenario, method, lambda notes: None)


def simulated_scenario(
    scenario: Scenario, method: str, say_notes: Callable[[Iterable[Note]], None] = warn_of
) -> Record:
    """Simulate a scenario; what `say_notes` is told, and more, are the record's notes."""
    scenario.check_extent()
    run.choose(run.SIMULATE, scenario.needs)
    report("lowering", 0.0, 0.0)
    lowered = lowered_scenario(scenario, method)
    say_notes(lowered.notes)
    tell = extent.progress_function(lowered.time, scenario.duration, lowered.chunk, lowered.row_bytes)
    march = run.march(lowered.program, tell)
    beyond = beyond_laws(lowered, march)
    say_notes(beyond)
    status, missing = balanced.judged_balance(march.status, lowered.missing_part(march))
    record = Record(lowered, method, march._replace(status=status))
    record.notes = (*lowered.notes, *beyond, *missing)
    record.notes += rigid_track(record)
    return record
