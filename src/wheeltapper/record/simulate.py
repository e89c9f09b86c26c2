"""The verb: simulate a scenario."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Literal, overload

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.ground import progress
from wheeltapper.ground.arguments import as_count
from wheeltapper.lower.build import Lowered, lower
from wheeltapper.lower.plausible import implausible
from wheeltapper.march import program as contract
from wheeltapper.march import telling
from wheeltapper.march.blocks import cores
from wheeltapper.record import balanced, extent
from wheeltapper.record.arguments import as_scenario, as_scenarios, check_method
from wheeltapper.record.damper import NO_STOPS
from wheeltapper.record.record import Record
from wheeltapper.record.rigid import rigid_track

if TYPE_CHECKING:
    from wheeltapper.march.single import March

Method = Literal["default", "strict"]


class ModelWarning(UserWarning):
    """The scenario is valid, but its result may not mean what the user expects."""


DOUBTS = ("cannot follow", "energy back than it took", "holds up to", "is implausible")
"""Words of the notes that put the meaning of a result in doubt. Such notes are also issued as warnings."""


_compiled: set[str] = set()


def say_that_it_compiles(what: str = "the kernels") -> None:
    """Tell the user once per kernel that it is being compiled, which takes some seconds."""
    if what not in _compiled:
        _compiled.add(what)
        progress.say(f"compiling {what} for this machine, once; this takes some seconds")


def warn_of(notes: Iterable[str], depth: int = 3) -> None:
    """Issue a warning, at the caller's caller or farther up, for notes that put the meaning of a result in doubt."""
    for note in notes:
        if any(words in note for words in DOUBTS):
            warnings.warn(note, ModelWarning, stacklevel=depth)


@overload
def simulate(scenario: Scenario | str | Path, method: Method = "default", *, threads: int | None = None) -> Record: ...
@overload
def simulate(
    scenario: Iterable[Scenario | Path], method: Method = "default", *, threads: int | None = None
) -> list[Record]: ...
def simulate(
    scenario: Scenario | str | Path | Iterable[Scenario | Path],
    method: Method = "default",
    *,
    threads: int | None = None,
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
    if isinstance(scenario, Scenario | str | Path):
        return _simulated(as_scenario(scenario), method)
    return _side_by_side(as_scenarios(scenario), method, cores() if threads is None else as_count(threads, "threads"))


class _StoppedError(Exception):
    """Another run was interrupted."""


def _side_by_side(scenarios: list[Scenario], method: str, threads: int) -> list[Record]:
    """Simulate several scenarios at a time; an error of one, or an interruption, soon ends all."""
    stop = Event()

    def heard(*_: object) -> None:
        if stop.is_set():
            raise _StoppedError

    def one(scenario: Scenario) -> Record:
        with progress.reporting(heard):
            return _simulated(scenario, method)

    with ThreadPoolExecutor(threads) as pool:
        try:
            waiting = [pool.submit(one, scenario) for scenario in scenarios]
            for done, _ in enumerate(as_completed(waiting), 1):
                progress.report("scenarios", done, len(waiting))
            return [future.result() for future in waiting]
        finally:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)


def _simulated(scenario: Scenario, method: str) -> Record:
    scenario.check_extent()
    doubts = implausible(scenario)
    warn_of(doubts, depth=4)
    record = _of_wagon(scenario, method) if isinstance(scenario.vehicle, Wagon) else _of_wheelset(scenario, method)
    record.notes = (*doubts, *record.notes, *rigid_track(record))
    return record


def _of_wheelset(scenario: Scenario, method: str) -> Record:
    progress.report("lowering", 0.0, 0.0)
    extent.check_time(scenario)
    lowered = lower(scenario, method)
    extent.check_pieces(scenario, lowered)
    tell = extent.teller("marching", lowered.time, scenario.duration, telling.CHUNK, extent.ROW_BYTES)
    if isinstance(scenario.contact, ElasticPlastic):
        return _of_yielding(scenario, scenario.contact, method, lowered, tell)
    warn_of(lowered.notes, depth=5)
    if scenario.vehicle.damper_end:
        return _with_end(scenario, method, lowered, tell)
    from wheeltapper.march.single import is_ready, march

    if not is_ready(lowered.program):
        say_that_it_compiles("the wheelset's march")
    return _checked(scenario, method, lowered, march(lowered.program, tell))


def _with_end(scenario: Scenario, method: str, lowered: Lowered, tell: telling.Tell) -> Record:
    from wheeltapper.march import damper_end

    if not damper_end.is_ready(lowered.program):
        say_that_it_compiles("the march with a damper's end")
    march, stops = damper_end.march(lowered.program, tell)
    return _checked(scenario, method, lowered, march, stops)


def _of_yielding(scenario: Scenario, law: ElasticPlastic, method: str, lowered: Lowered, tell: telling.Tell) -> Record:
    from wheeltapper.march import yielding
    from wheeltapper.record.yielded import beyond_law

    if not yielding.is_ready(lowered.program):
        say_that_it_compiles("the yielding contact's march")
    march, pieces = yielding.march(lowered.program, tell)
    largest = float(march.peaks[:, contract.PEAK_FORCE].max(initial=0.0)) * lowered.force
    notes = lowered.notes + beyond_law(law, lowered, largest)
    warn_of(notes, depth=6)
    program = lowered.program._replace(pieces=pieces)
    return _checked(scenario, method, replace(lowered, program=program, notes=notes), march)


def _checked(
    scenario: Scenario, method: str, lowered: Lowered, march: March, stops: NDArray[np.float64] = NO_STOPS
) -> Record:
    """Return the record of a march, after a check of its energy."""
    if not balanced.is_ready(lowered):
        say_that_it_compiles("the energy's check")
    status, notes = balanced.judged(march.status, balanced.missing_part(lowered, march))
    return Record(scenario, method, replace(lowered, notes=lowered.notes + notes), march._replace(status=status), stops)


def _of_wagon(scenario: Scenario, method: str) -> Record:
    from wheeltapper.lower.wagon import LONGEST, lower_wagon
    from wheeltapper.march import multibody
    from wheeltapper.march.assembly import PLACES
    from wheeltapper.record import wagon_energy
    from wheeltapper.record.creep_range import beyond_spin
    from wheeltapper.record.wagon_record import WagonRecord

    progress.report("lowering", 0.0, 0.0)
    row = 8.0 * (PLACES * (len(scenario.vehicle.names) + 1) + multibody.STEP_ELEMENTS)
    extent.check_duration(scenario, scenario.duration / LONGEST, row)
    lowered = lower_wagon(scenario, method)
    warn_of(lowered.notes, depth=5)
    tell = extent.teller("marching", 1.0, scenario.duration, telling.WAGON_CHUNK, row)
    if not multibody.kernels_are_ready():
        say_that_it_compiles("the wagon's march and its energy's check")
    march = multibody.march(lowered.assembly, tell)
    status, notes = balanced.judged(march.status, wagon_energy.missing_part(lowered, march, scenario))
    lowered = replace(lowered, notes=lowered.notes + notes + beyond_spin(scenario, lowered, march))
    return WagonRecord(scenario, method, lowered, march._replace(status=status))
