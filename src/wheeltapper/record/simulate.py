"""The verb: simulate a scenario."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Literal, overload

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.ground.arguments import as_count
from wheeltapper.lower.build import Lowered, lower
from wheeltapper.lower.plausible import implausible
from wheeltapper.march import program as contract
from wheeltapper.march.blocks import cores
from wheeltapper.record.arguments import as_scenario, as_scenarios, check_method
from wheeltapper.record.record import Record
from wheeltapper.record.rigid import rigid_track

Method = Literal["default", "strict"]


class ModelWarning(UserWarning):
    """The scenario is valid, but its result may not mean what the user thinks."""


DOUBTS = ("cannot follow", "energy back than it took", "holds up to", "is implausible")
"""Words of the notes that put a result's meaning in doubt."""


def say_that_it_compiles() -> None:
    """Tell the user why nothing happens for some seconds."""
    print("wheeltapper: compiling its kernels for this machine, once; this takes some seconds", file=sys.stderr)


def warn_of(notes: Iterable[str], depth: int = 3) -> None:
    """Warn the caller's caller, or one farther up, of those notes that put a result's meaning in doubt."""
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
        What to simulate, or the path of its TOML file; or several of them, which march side by side.
    method
        Of a wheelset, "default": Taylor series of order 12; "strict": order 20 with a thousand times smaller step
        tolerance. Of a wagon, DOP853 with step tolerances of 1e-7 and 3e-11.
    threads
        How many of several scenarios march at a time; by default all cores.

    Returns
    -------
    Record or list of Record
        Also where the computation could not finish: its `outcome` says why, and what was computed is kept.

    Raises
    ------
    InputError
        If a scenario cannot be simulated.
    """
    check_method(method)
    if isinstance(scenario, Scenario | str | Path):
        return _simulated(as_scenario(scenario), method)
    scenarios = as_scenarios(scenario)
    with ThreadPoolExecutor(cores() if threads is None else as_count(threads, "threads")) as pool:
        return list(pool.map(lambda one: _simulated(one, method), scenarios))


def _simulated(scenario: Scenario, method: str) -> Record:
    scenario.check_extent()
    doubts = implausible(scenario)
    warn_of(doubts, depth=4)
    record = _of_wagon(scenario, method) if isinstance(scenario.vehicle, Wagon) else _of_wheelset(scenario, method)
    record.notes = (*doubts, *record.notes, *rigid_track(record))
    return record


def _of_wheelset(scenario: Scenario, method: str) -> Record:
    from wheeltapper.march.single import is_ready, march

    lowered = lower(scenario, method)
    if isinstance(scenario.contact, ElasticPlastic):
        return _of_yielding(scenario, scenario.contact, method, lowered)
    warn_of(lowered.notes, depth=5)
    if scenario.vehicle.damper_end:
        return _with_end(scenario, method, lowered)
    if not is_ready(lowered.program):
        say_that_it_compiles()
    return Record(scenario, method, lowered, march(lowered.program))


def _with_end(scenario: Scenario, method: str, lowered: Lowered) -> Record:
    from wheeltapper.march import damper_end

    if not damper_end.is_ready(lowered.program):
        say_that_it_compiles()
    march, stops = damper_end.march(lowered.program)
    return Record(scenario, method, lowered, march, stops)


def _of_yielding(scenario: Scenario, law: ElasticPlastic, method: str, lowered: Lowered) -> Record:
    from wheeltapper.march import yielding
    from wheeltapper.record.yielded import beyond_law

    if not yielding.is_ready(lowered.program):
        say_that_it_compiles()
    march, pieces = yielding.march(lowered.program)
    largest = float(march.peaks[:, contract.PEAK_FORCE].max(initial=0.0)) * lowered.force
    notes = lowered.notes + beyond_law(law, lowered, largest)
    warn_of(notes, depth=6)
    program = lowered.program._replace(pieces=pieces)
    return Record(scenario, method, replace(lowered, program=program, notes=notes), march)


def _of_wagon(scenario: Scenario, method: str) -> Record:
    from wheeltapper.lower.wagon import lower_wagon
    from wheeltapper.march import multibody
    from wheeltapper.record.creep_range import beyond_spin
    from wheeltapper.record.wagon_record import WagonRecord

    lowered = lower_wagon(scenario, method)
    warn_of(lowered.notes, depth=5)
    if not multibody.kernels_are_ready():
        say_that_it_compiles()
    march = multibody.march(lowered.assembly)
    lowered = replace(lowered, notes=lowered.notes + beyond_spin(scenario, lowered, march))
    return WagonRecord(scenario, method, lowered, march)
