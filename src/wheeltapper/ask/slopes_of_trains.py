"""Exact derivatives of features of runs on rails."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask import computed as status_of
from wheeltapper.ask.computed import ComputedCells
from wheeltapper.ask.sensitivity import Rates, derivatives
from wheeltapper.ask.study import Study
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note, Shared
from wheeltapper.ground.outcome import Outcome
from wheeltapper.ground.progress import progress_counter
from wheeltapper.lower.door import lowered_scenario
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.many import EPSILON
from wheeltapper.lower.turns_on_rails import turn_along
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.record.record import Record
from wheeltapper.record.simulate import side_by_side
from wheeltapper.record.trains.of_record import trains_of
from wheeltapper.record.trains.trains import Trains, notes_of_cells

if TYPE_CHECKING:
    from wheeltapper.lower.lowered.plane import LoweredOnRails
    from wheeltapper.march.general.gradients import Tangents
    from wheeltapper.march.general.task import Marched
    from wheeltapper.march.general.turned import SystemTurn

FloatArray = NDArray[np.float64]
OF_TIME, OF_SIZE = range(2)


def slopes_of_trains(asked: Study, changed: dict[str, FloatArray], threads: int) -> ComputedCells:
    """Compute some cells of a study on rails: features and their derivatives."""
    count = progress_counter("cells", len(next(iter(changed.values()))))
    held = Fields(asked.scenario)

    def slopes_of_cell(values: tuple[float, ...]) -> ComputedCells:
        beside = {path: value for path, value in zip(changed, values, strict=True) if value != held(path)}
        return _slopes_of(asked, asked.scenario.replaced(beside) if beside else asked.scenario)

    cells = list(zip(*changed.values(), strict=True))
    return ComputedCells.joined_parts(side_by_side(slopes_of_cell, cells, threads, lambda: count(1)))


def _slopes_of(asked: Study, scenario: Scenario) -> ComputedCells:
    """Compute one cell; the trains of its wheelsets are like those of cells."""
    lowered: Any = lowered_scenario(scenario, asked.method)
    turns = [turn_along(scenario, path, lowered) for path in asked.gradient]
    marched = run.march(lowered.program)
    record = Record(lowered, asked.method, marched)
    trains, whole = trains_of(record, asked.needs_tally), record.outcome is Outcome.COMPLETED
    unknown = dict[str, list[str]]()
    wheels, amplification = trains.cell_count, np.nan
    values = np.full((len(asked.features), wheels), np.nan)
    gradient = np.full((len(asked.features), len(turns), wheels), np.nan)
    if whole:
        found = marched.tangents(turns)
        amplification = _amplification(lowered, marched, found)
        for lane, turn in enumerate(turns):
            rates = _rates(trains, lowered, marched, found, lane)
            ends = float(asked.gradient[lane] == "duration")

            def tilted(gap: float, rates: Rates = rates, ends: float = ends, turn: SystemTurn = turn) -> Trains:
                tilted = _tilted(trains, rates.known(gap), ends, turn.static * lowered.force)
                return replace(tilted, unknown_part=gap * EPSILON)

            for row, (value, slope) in enumerate(derivatives(asked.features, tilted, rates.has_gaps)):
                values[row], gradient[row, lane] = value, slope
                feature = asked.features[row]
                if feature.differentiable and np.any(np.isnan(slope) & ~np.isnan(value)):
                    unknown.setdefault(feature.name, []).append(asked.gradient[lane])
    trust = status_of.trust_of(lowered.gentlest(marched), amplification, asked.chaos_limit)
    each = *asked.wheel_shape, 1
    return ComputedCells(
        values.reshape(len(asked.features), *each), status_of.STATUS_OF_MARCH[[marched.status]],
        gradient.reshape(len(asked.features), len(turns), *each), trust[None], np.array([amplification]),
        (
            *(Shared(note, 1) for note in (*record.notes, *(_unknown_note(*one) for one in unknown.items()))),
            *notes_of_cells(trains.notes, wheels),
        ),
    )  # fmt: skip


def _unknown_note(name: str, paths: list[str]) -> Note:
    """Return a note on a feature without derivatives."""
    text = (
        f"{name} has no derivative by {', '.join(paths)}: it depends on a time without one, at a jump of the path, or "
        "where a contact that is still indented is released or presses again, or on a force at an end of the run"
    )
    return Note(text, f"no derivative of {name}")


def _rates(trains: Trains, lowered: LoweredOnRails, marched: Marched, found: Tangents, lane: int) -> Rates:
    """Return derivatives along one direction in the order of the trains."""
    by_train = np.argsort(marched.events[:, contract.EVENT_CONTACT], kind="stable")
    of_peaks = np.argsort(marched.peaks[:, contract.PEAK_CONTACT], kind="stable")
    events, peaks = found.events[by_train, :, lane], found.peaks[of_peaks, :, lane].copy()
    peaks[:, OF_SIZE] *= lowered.force
    cells, tally = trains.cell_count, trains.marched.impulses is not None
    impulses = np.full(len(events) if tally else 0, np.nan)
    first = 0
    for contact in range(cells if tally else 0):
        own = marched.impulse_rates(found, contact)[:, lane] * lowered.force
        impulses[first : first + len(own)] = own
        first += int(np.sum(marched.events[:, contract.EVENT_CONTACT] == contact))
    return Rates(events, peaks, np.full(cells if tally else 0, np.nan), impulses)


def _tilted(trains: Trains, rates: Rates, ends: float, static: FloatArray) -> Trains:
    """Return trains with their derivatives along one direction as imaginary parts."""
    marched = trains.marched
    events, peaks = marched.events.astype(complex), marched.peaks.astype(complex)
    events[:, [contract.EVENT_TIME, contract.EVENT_RATE]] += 1j * EPSILON * rates.events
    peaks[:, [contract.PEAK_TIME, contract.PEAK_FORCE]] += 1j * EPSILON * rates.peaks
    changed: Any = {"events": events, "peaks": peaks, "end": marched.end + 1j * EPSILON * ends}
    if marched.impulses is not None and marched.highest is not None:
        changed["impulses"] = marched.impulses + 1j * EPSILON * rates.impulses
        changed["highest"] = marched.highest + 1j * EPSILON * rates.highest
    units: Any = type(trains.units)(
        **(vars(trains.units) | {"static_force": trains.units.static_force + 1j * EPSILON * static})
    )
    return replace(trains, marched=marched._replace(**changed), units=units)


def _amplification(lowered: LoweredOnRails, marched: Marched, found: Tangents) -> float:
    """Return how much a small change of the start has grown at the end: of all wheels' heights or velocities alike."""
    length, speed = marched.static_indentation, float(lowered.speeds(marched).mean())
    freedoms = len(lowered.plane.freedoms)
    scale = np.repeat([length, speed], [freedoms, found.of_starts.shape[1] - freedoms])
    grown = found.of_starts / scale * np.array([[length], [speed]])
    return float(np.linalg.svd(grown, compute_uv=False)[0] / np.sqrt(len(lowered.static_force)))
