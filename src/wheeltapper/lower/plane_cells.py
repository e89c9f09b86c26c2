"""From a vehicle in the plane, and fields that differ from cell to cell, to tasks that share what is equal.

A vehicle, a track or a path is lowered once for each of its values. Cells hold the same objects, by which the march
knows what they share.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.needs import DECK
from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.known import check_known
from wheeltapper.lower.laws import ellipse
from wheeltapper.lower.lowered.plane import LoweredPlane
from wheeltapper.lower.numbers import METHODS
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.lower.plane import (
    SUDDEN,
    UnderWheels,
    checked_way,
    on_wheels,
    paths_of,
    shortest_wave,
    task_of,
    under_wheels,
)
from wheeltapper.lower.plausible import implausible_cells
from wheeltapper.lower.track.reach import cutoff_note
from wheeltapper.lower.unmet import acting_in, unmet_cells
from wheeltapper.march.general.contract import Task

VEHICLE = "vehicle.", "contact.", "start."
"""How the paths of fields begin on which bodies and laws depend."""
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class PlaneCells:
    """Cells of a scenario for the general march, lowered together; it is made as `lower.many.LoweredCells` is.

    Attributes
    ----------
    tasks
        Of all cells.
    vehicles
        Of all cells; equal ones are the same object.
    """

    def __init__(self, scenario: Scenario, changed: dict[str, FloatArray], method: str = "default") -> None:
        check_known(scenario)
        self.scenario, self.changed, self.method = scenario, changed, method
        value = Fields(scenario, changed)
        self.cells = value.cells
        self._speed, self._duration = (
            np.broadcast_to(np.asarray(value(path), dtype=float), self.cells) for path in ("speed", "duration")
        )
        for path in ("speed", "duration"):
            for number in np.unique(changed.get(path, [])).tolist():
                scenario.replaced({path: number})
        (on_wheel, self._on), (rough, self._rough), (under, self._under) = (
            value.variants([path for path in changed if path.startswith(starts)])
            for starts in ((*VEHICLE, "track.") if DECK in scenario.needs else VEHICLE, "irregularity.", "track.")
        )
        kinds = [on_wheels(scenario.replaced(changes)) for changes in on_wheel]
        self.vehicles = [kinds[kind] for kind in self._on]
        self._path_of, self._paths, self._path_notes, self._waves = self._lowered_paths(on_wheel, rough)
        self._recurring = list[Shared]()
        self._tracks = self._lowered_tracks(under)
        self.tasks = list(self._made_tasks())

    def _lowered_paths(
        self, on_wheel: list[dict[str, float]], rough: list[dict[str, float]]
    ) -> tuple[IntArray, list[list[PathTable]], list[list[Any]], FloatArray]:
        """Return the number of each cell's paths, all paths, the notes on them, and their shortest waves, m."""
        numbers: dict[tuple[Any, ...], int] = {}
        owner = np.empty(self.cells, dtype=np.int64)
        for cell, (kind, shape, vehicle) in enumerate(zip(self._on, self._rough, self.vehicles, strict=True)):
            wheelsets = vehicle.plane.wheelsets
            follows = ellipse.factor_function(self.scenario.contact, wheelsets[0]) is not None
            radii = tuple(wheelset.radius for wheelset in wheelsets)
            key = shape, radii, vehicle.plane.positions, kind if follows else None
            owner[cell] = numbers.setdefault(key, len(numbers))
        paths, notes, waves = list[list[PathTable]](), list[list[Any]](), np.full(len(numbers), np.inf)
        for number in range(len(numbers)):
            mine = np.flatnonzero(owner == number)
            one = mine[0]
            shaped = self.scenario.replaced(rough[self._rough[one]] | on_wheel[self._on[one]])
            ends = self._speed[mine] * self._duration[mine]
            for end in (float(ends.min()), float(ends.max())):
                shaped.check_extent(end)
            plane = self.vehicles[one].plane
            tables, said = paths_of(shaped, plane, float(ends.max()), METHODS[self.method])
            paths.append(tables)
            notes.append(said)
            waves[number] = shortest_wave(shaped, plane) or np.inf
        return owner, paths, notes, waves

    def _lowered_tracks(self, under: list[dict[str, float]]) -> list[UnderWheels]:
        """Return the track of each cell."""
        scenarios = [self.scenario.replaced(changes) for changes in under]
        made: dict[tuple[int, float], UnderWheels] = {}
        checked: dict[tuple[Any, ...], tuple[Note, ...]] = {}
        out = []
        for cell, (number, vehicle) in enumerate(zip(self._under.tolist(), self.vehicles, strict=True)):
            key = number, vehicle.plane.extent
            if key not in made:
                made[key] = under_wheels(scenarios[number], vehicle.plane.extent, self.method)
            speed, way = float(self._speed[cell]), float(self._speed[cell] * self._duration[cell])
            going = *key, vehicle.plane.positions, speed, way
            if going not in checked:
                checked[going] = checked_way(scenarios[number], vehicle.plane, made[key], speed, way, self.method)
            self._recurring += [Shared(note, 1) for note in checked[going]]
            out.append(made[key])
        return out

    def _made_tasks(self) -> Iterator[Task]:
        for cell, (vehicle, track) in enumerate(zip(self.vehicles, self._tracks, strict=True)):
            paths, speed, duration = self._paths[self._path_of[cell]], self._speed[cell], self._duration[cell]
            yield task_of(self.scenario, vehicle, track, paths, float(speed), float(duration), self.method)

    def lowered(self, cell: int) -> LoweredPlane:
        """Return one cell as if it were lowered alone, without notes."""
        vehicle, track, paths = self.vehicles[cell], self._tracks[cell], tuple(self._paths[self._path_of[cell]])
        return LoweredPlane(
            self.scenario_of(cell), self.tasks[cell], vehicle.plane, track.modes, track.seat, vehicle.static_force,
            vehicle.contact_constant, (), self.rails, vehicle.stops, track.anomalies, paths,
        )  # fmt: skip

    def scenario_of(self, cell: int) -> Scenario:
        """Return the scenario of one cell."""
        return self.scenario.replaced({path: float(values[cell]) for path, values in self.changed.items()})

    @property
    def rails(self) -> float:
        """Number of equal rails: a wheelset's force for one of a task."""
        return float(self.vehicles[0].plane.rails)

    @cached_property
    def static_force(self) -> FloatArray:
        """Of each wheelset, N, (cells, wheelsets)."""
        return np.stack([vehicle.static_force for vehicle in self.vehicles])

    @cached_property
    def notes(self) -> tuple[Shared, ...]:
        """What the user should know, one note for each cause."""
        told = [*implausible_cells(self.scenario, self.changed, self.cells), *self._unmet(), *self._recurring]
        told += [Shared(note, count) for vehicle, count in _counted(self.vehicles) for note in vehicle.notes]
        for number, said in enumerate(self._path_notes):
            told += [Shared(note, int((self._path_of == number).sum())) for note in said]
        for track, count in _counted(self._tracks):
            if track.reach is not None:
                told += [Shared(note, count) for note in track.reach.notes]
        for cell, track in enumerate(self._tracks):
            frequency = self._speed[cell] / self._waves[self._path_of[cell]]
            note = None if track.reach is None else cutoff_note(track.reach, float(frequency))
            told += [] if note is None else [Shared(note, 1)]
        moving = sum(
            track.modes is not None and speed > 0.0 for track, speed in zip(self._tracks, self._speed, strict=True)
        )
        return shared_notes([*told, *([Shared(SUDDEN, int(moving))] if moving else [])])

    def _unmet(self) -> list[Shared]:
        """Return notes on what cells never meet."""
        _, first, owner = np.unique(
            np.column_stack([self._on, self._rough, self._under]), axis=0, return_index=True, return_inverse=True
        )
        way, groups = self._speed * self._duration, []
        for number, one in enumerate(first.tolist()):
            mine = np.flatnonzero(owner.ravel() == number)
            groups.append((acting_in(self.scenario_of(one)), mine, 0.0, way[mine]))
        return unmet_cells(groups, self.scenario_of)


def _counted(items: list[Any]) -> list[tuple[Any, int]]:
    """Return the different ones of some objects, and how often each is there."""
    found: dict[int, list[Any]] = {}
    for item in items:
        found.setdefault(id(item), [item, 0])[1] += 1
    return [(item, count) for item, count in found.values()]
