"""The verb: simulate a scenario."""

from __future__ import annotations

import inspect
import warnings
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from threading import Event
from typing import Literal, overload

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.notes import Note
from wheeltapper.ground.progress import Progress, progress_shown, report, reporting, say
from wheeltapper.march import run
from wheeltapper.march.blocks import core_count
from wheeltapper.record import balanced
from wheeltapper.record.arguments import as_scenario, as_scenarios, check_method
from wheeltapper.record.kinds import kind_of
from wheeltapper.record.record import Record
from wheeltapper.record.rigid import rigid_track

Method = Literal["default", "strict"]


class ModelWarning(UserWarning):
    """The scenario is valid, but its result may not mean what the user expects."""


_compiled: set[str] = set()


def say_that_it_compiles(what: str = "the kernels") -> None:
    """Tell the user once per kernel that it is being compiled, which takes some seconds."""
    if what not in _compiled:
        _compiled.add(what)
        say(f"compiling {what} for this machine, once; this takes some seconds")


def warn_caller(text: str) -> None:
    """Warn whoever called the package, however deep in it this is said."""
    frame, level = inspect.currentframe(), 1
    while frame is not None and str(frame.f_globals.get("__name__", "")).startswith("wheeltapper."):
        frame, level = frame.f_back, level + 1
    warnings.warn(text, ModelWarning, stacklevel=level)


def warn_of(notes: Iterable[Note]) -> None:
    """Warn of those notes that put a result's meaning in doubt."""
    for note in notes:
        if note.doubtful:
            warn_caller(note)


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
        True: on a terminal or in a notebook a bar after two seconds; False: none; or a function, called instead with
        what is being done ("marching"), how much of it is done, and how much there is (0: nobody knows). What it raises
        ends the run.

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
            return _simulated_scenario(as_scenario(scenario), method)
        held = core_count() if threads is None else as_count(threads, "threads")
        return _side_by_side(as_scenarios(scenario), method, held)


class _StoppedError(Exception):
    """Another run was interrupted."""


def _side_by_side(scenarios: list[Scenario], method: str, threads: int) -> list[Record]:
    """Simulate several scenarios at a time; an error of one, or an interruption, soon ends all."""
    stop = Event()

    def raise_if_stopped(*_: object) -> None:
        if stop.is_set():
            raise _StoppedError

    def simulate_one(scenario: Scenario) -> Record:
        with reporting(raise_if_stopped):
            return _simulated_scenario(scenario, method)

    with ThreadPoolExecutor(threads) as pool:
        try:
            waiting = [pool.submit(simulate_one, scenario) for scenario in scenarios]
            for done, future in enumerate(as_completed(waiting), 1):
                future.result()  # what ends this one ends all
                report("scenarios", done, len(waiting))
            return [future.result() for future in waiting]
        finally:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)


def _simulated_scenario(scenario: Scenario, method: str) -> Record:
    scenario.check_extent()
    marcher, kind = run.choose(run.SIMULATE, scenario.needs), kind_of(scenario)
    report("lowering", 0.0, 0.0)
    lowered = kind.lower(scenario, method)
    warn_of(lowered.notes)
    tell = kind.teller(scenario, lowered)
    if not run.is_ready(lowered.program):
        say_that_it_compiles(marcher.name)
    march = run.march(lowered.program, tell)
    beyond = kind.beyond(scenario, lowered, march)
    warn_of(beyond)
    if not run.balance_is_ready(lowered.program):
        say_that_it_compiles("the energy's check")
    status, missing = balanced.judged_balance(march.status, kind.missing_part(scenario, lowered, march))
    record = Record(scenario, method, lowered, march._replace(status=status))
    record.notes = (*lowered.notes, *beyond, *missing)
    record.notes += rigid_track(record)
    return record
