"""Fates: on which orbit each of many starts ends, and after how many waves.

Motions are marched in rounds. Each ends as soon as it is in the trap of a known orbit. Where some are not, Newton's
method looks for orbits near their last states. If it finds a new stable one, the round is repeated for those that are
still free. What is in no trap at the end is unsettled: a transient that lasts longer, or chaos. Nothing tells these
apart in finite time, and nothing here claims to.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import Axis
from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.memory import check_room
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.lower.section import Section, SectionCells
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.blocks import core_count
from wheeltapper.march.wheel.ensemble import Cells
from wheeltapper.march.wheel.orbits import STATE_SIZE, TRAP_COLUMNS, UNCAUGHT, capture, trapped
from wheeltapper.orbits.asked import START, axes_of, is_undamped, section_of
from wheeltapper.orbits.diagram import all_cells, start_states
from wheeltapper.orbits.orbit import multipliers_of
from wheeltapper.orbits.section_map import FixedPoint, SectionMap, Wave
from wheeltapper.orbits.traps import traps_of
from wheeltapper.record.arguments import as_scenario

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.describe.scenario import Scenario

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
FIRST_ROUND = 32
"""Waves of the first round; each further one is twice as long."""
LONGEST_PERIOD = 16
"""Largest number of waves of the orbits that are looked for."""
SCOUTS = 256
"""Number of cells of one scenario that go ahead, where there are more."""
TRIALS = 48
"""Largest number of motions of one scenario near whose states orbits are looked for in a round."""
RECURS = 0.2
"""Distance, in static indentations, to which a state must return for an orbit to be looked for near it."""
NEAR = 0.5
"""Largest distance, in static indentations, between a state and the orbit that is found from it."""
SAME = 1e-6
"""Distance, in static indentations, below which two states belong to the same orbit."""
REPEATS = 6
"""How often a round is repeated, at most, because new orbits were found in it."""


@dataclass
class World:
    """The cells that share a scenario, and differ in their starts: the orbits that are known there.

    Attributes
    ----------
    cell
        The first of the cells.
    wave
        What its map is made of.
    orbits
        Stable orbits, by the number of their waves and their fixed point.
    traps
        Their traps.
    """

    cell: int
    wave: Wave
    orbits: list[tuple[int, FixedPoint]] = field(default_factory=list)
    traps: list[FloatArray] = field(default_factory=list)

    def knows(self, state: FloatArray) -> bool:
        """Return True if a state lies on a known orbit."""
        trails = [found.image.trail for _, found in self.orbits]
        return any(np.abs(trail - state).max(axis=1).min() < SAME for trail in trails)

    def catches(self, trail: FloatArray) -> bool:
        """Return True if one of some states, (many, n), is in a trap."""
        if not self.traps:
            return False
        states = np.zeros((len(trail), STATE_SIZE))
        states[:, : trail.shape[1]] = trail * self.wave.to_program
        return bool(np.any(trapped(states, np.vstack(self.traps)) != UNCAUGHT))


class Search:
    """The search for the fates of many cells.

    Parameters
    ----------
    section
        The scenario.
    found
        The cells.
    owner
        (cells,) the number of the world of each cell.
    firsts
        (worlds,) the first cell of each world.
    """

    def __init__(self, section: Section, found: SectionCells, owner: IntArray, firsts: IntArray) -> None:
        self.cells, self.owner = found.cells, owner
        self.maps = {many: SectionMap(section, many) for many in range(1, LONGEST_PERIOD + 1)}
        one = self.maps[1]
        self.worlds = [World(int(cell), one.wave_of(found, int(cell))) for cell in firsts]
        self.states = start_states(found)
        self.orbit = np.full(len(owner), UNCAUGHT, dtype=np.int64)
        self.waves = np.zeros(len(owner), dtype=np.int64)
        self.alive = np.ones(len(owner), dtype=bool)

    def settle(self, most: int, threads: int) -> None:
        """March all cells until they are caught, for at most `most` waves; a few go ahead and look for the orbits."""
        scouts = self._scouts()
        if len(scouts) < len(self.owner):
            begun = self.states[scouts].copy()
            self._settle(scouts, most, threads)
            self.states[scouts], self.waves[scouts] = begun, 0
            self.orbit[scouts], self.alive[scouts] = UNCAUGHT, True
        self._settle(np.arange(len(self.owner)), most, threads)

    def _scouts(self) -> IntArray:
        """Return some of the cells of each world, spread over all of them."""
        order = np.argsort(self.owner, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(self.owner[order])) + 1)
        spread = (np.unique(np.linspace(0, len(part) - 1, min(len(part), SCOUTS)).astype(int)) for part in parts)
        return np.concatenate([part[places] for part, places in zip(parts, spread, strict=True)])

    def _settle(self, cells: IntArray, most: int, threads: int) -> None:
        done, length = 0, FIRST_ROUND
        while done < most and len(free := cells[self.free()[cells]]):
            length = min(length, most - done)
            self._round(free, length, threads)
            done += length
            length *= 2
            report("waves", done, most)

    def free(self) -> NDArray[np.bool_]:
        """Return which cells are still free."""
        return np.asarray((self.orbit == UNCAUGHT) & self.alive)

    def _round(self, cells: IntArray, length: int, threads: int) -> None:
        begun, before = self.states[cells].copy(), self.waves[cells].copy()
        todo = np.ones(len(cells), dtype=bool)
        for _ in range(REPEATS):
            at = cells[todo]
            self.states[at], self.waves[at] = begun[todo], before[todo]
            self._march(at, length, threads)
            free = cells[self.free()[cells]]
            owner = self.owner[free]
            new = {world for world in np.unique(owner) if self._discover(world, free[owner == world])}
            if not new:
                return
            todo = self.free()[cells] & np.isin(self.owner[cells], list(new))

    def _march(self, at: IntArray, length: int, threads: int) -> None:
        """March some cells until they are caught, for at most `length` waves."""
        traps = [np.vstack([np.empty((0, TRAP_COLUMNS)), *world.traps]) for world in self.worlds]
        ends = np.cumsum([len(rows) for rows in traps])
        firsts = ends - [len(rows) for rows in traps]
        states, cells = self.states[at], self.cells
        own = Cells(cells.pieces, cells.first[at], cells.many[at], cells.numbers[at])
        owner = self.owner[at]
        caught = capture(own, states, length, np.vstack(traps), firsts[owner], ends[owner], threads)
        self.states[at], self.orbit[at] = states, caught.orbit
        self.waves[at] += caught.waves
        self.alive[at] = caught.status == contract.DONE

    def _discover(self, number: int, free: IntArray) -> bool:
        """Look for orbits near the states of some cells of a world; return whether a new stable one was found."""
        world, new = self.worlds[number], False
        size = self.maps[1].size
        chosen = free[np.unique(np.linspace(0, len(free) - 1, min(len(free), TRIALS)).astype(int))]
        for cell in chosen:
            state = self.states[cell, :size] / world.wave.to_program
            if not np.all(np.isfinite(state)):
                continue
            trail = self.maps[LONGEST_PERIOD].trail(world.wave, state)
            if world.catches(trail):  # a motion that only needs more waves
                continue
            for many in nearly_periods(trail, state):
                found = self.maps[many].fixed_point(world.wave, state)
                near = found.closed and np.abs(found.state - state).max() < NEAR
                sooner = shortest_period(found)
                if near and sooner < many:
                    many, found = sooner, self.maps[sooner].fixed_point(world.wave, found.state)
                if near and np.abs(multipliers_of(found.image.slopes)).max() < 1.0:
                    if not world.knows(found.state):
                        world.traps.append(traps_of(self.maps[many], world.wave, found, len(world.orbits)))
                        world.orbits.append((many, found))
                        new = True
                    break
        return new


def nearly_periods(trail: FloatArray, state: FloatArray) -> list[int]:
    """Return after how many waves a state nearly returns to itself, fewer before more."""
    away = np.abs(trail - state).max(axis=1)
    away[~np.isfinite(away)] = np.inf
    order = np.flatnonzero(away < RECURS)
    return [int(many) + 1 for many in order if away[many] <= 2.0 * away.min() + SAME][:3]


def shortest_period(found: FixedPoint) -> int:
    """Return the number of waves after which an orbit first returns to its state."""
    away = np.abs(found.image.trail - found.state).max(axis=1)
    many = len(away)
    return next(part for part in range(1, many + 1) if many % part == 0 and (part == many or away[part - 1] < SAME))


def fates(
    scenario: Scenario | str | Path, over: Mapping[str, Any], settle: int = 2000, *, method: str = "default",
    threads: int | None = None, progress: Progress = True,
) -> xr.Dataset:  # fmt: skip
    """Return the orbit on which each motion ends, and after how many waves.

    Parameters
    ----------
    scenario
        As for `find`; each motion begins at its start, at phase zero of the irregularity.
    over
        By path, the values of fields that vary: "start.displacement" and "start.velocity" for a basin of attraction,
        others for a map of regimes. The cells are all combinations. Of a start, what does not vary is that of rest.
    settle
        Largest number of waves.
    method
        "default" or "strict".
    threads
        Number of threads; by default one per core. The result does not depend on it.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    xarray.Dataset
        Over the fields: `orbit`, a number in `orbits`, or -1 for an unsettled motion; `waves`, after how many the
        motion was so near to its orbit that it never leaves it, or, unsettled, how many it has lived; `period`,
        `losses` and `largest_force` of the orbit. Over `orbits`, each finished by Newton's method and stable:
        `orbit_waves`, its start, `orbit_multiplier` (the largest modulus), `orbit_closure`, `orbit_losses`,
        `orbit_largest_force`, and the values of the other fields.

    Raises
    ------
    InputError
        If the scenario has no orbits, or nothing takes energy away, so that none attracts.

    Notes
    -----
    An unsettled motion is not called chaos: many live for thousands of waves, and then settle.
    """
    settle = as_count(settle, "settle")
    scenario, axes = axes_of(as_scenario(scenario), over)
    section = section_of(scenario, method)
    if is_undamped(section):
        raise InputError("", "vehicle.damping", "0 N s/m, with which no motion settles", "more; `find` takes it")
    shape, changed = all_cells(axes)
    total = int(np.prod(shape))
    check_room("over", f"{total:.4g} cells", 1000.0 * total, "fewer cells")
    held = core_count() if threads is None else as_count(threads, "threads")
    others = [axis for axis in axes if not axis.path.startswith("start.")]
    columns = np.column_stack([np.zeros(total), *(changed[axis.path] for axis in others)])
    _, firsts, owner = np.unique(columns, axis=0, return_index=True, return_inverse=True)
    with progress_shown(progress, "waves"):
        search = Search(section, section.cells(changed), owner.ravel(), firsts)
        search.settle(settle, held)
    return _dataset(search, section, axes, others, shape, changed)


def _dataset(
    search: Search, section: Section, axes: list[Axis], others: list[Axis], shape: tuple[int, ...],
    changed: dict[str, FloatArray],
) -> xr.Dataset:  # fmt: skip
    """Return the fates as a dataset; orbits are numbered by worlds, then by waves and forces, those in use only."""
    import xarray as xr

    used = np.unique(np.column_stack([search.owner, search.orbit])[search.orbit != UNCAUGHT], axis=0)
    rows = [(int(world), int(k), *search.worlds[world].orbits[k]) for world, k in used]
    rows.sort(key=lambda row: (row[0], row[2], row[3].image.losses, row[3].image.largest_force))
    number = {(world, k): i for i, (world, k, _, _) in enumerate(rows)}
    pairs = zip(search.owner.tolist(), search.orbit.tolist(), strict=True)
    orbit = np.array([number.get(pair, UNCAUGHT) for pair in pairs])
    one = search.maps[1]
    starts = np.array([_first_state(row[3]) * one.scale for row in rows]).reshape(-1, one.size)
    table: dict[str, Any] = {
        "waves": [many for _, _, many, _ in rows],
        "losses": [found.image.losses for *_, found in rows],
        "largest_force": [found.image.largest_force for *_, found in rows],
        "multiplier": [float(np.abs(multipliers_of(found.image.slopes)).max()) for *_, found in rows],
        "closure": [found.closure for *_, found in rows],
    }
    table |= dict(zip(START, starts.T, strict=False))
    cells = [search.worlds[world].cell for world, *_ in rows]
    table |= {axis.path: changed[axis.path][cells] for axis in others}
    units = {"largest_force": "N"} | START | {axis.path: axis.unit for axis in others}
    named: dict[str, Any] = {axis.path: (axis.path, axis.values, {"units": axis.unit}) for axis in axes}
    named["orbits"] = ("orbits", np.arange(len(rows)), {"long_name": "number of the orbit"})
    named |= {f"orbit_{name}": ("orbits", values, {"units": units.get(name, "")}) for name, values in table.items()}
    dimensions = tuple(axis.path for axis in axes)

    def of_orbit(name: str, free: float) -> NDArray[Any]:
        return np.asarray(np.append(table[name], free)[orbit].reshape(shape))

    data = {
        "orbit": (dimensions, orbit.reshape(shape), {"long_name": "number of the orbit; -1: unsettled"}),
        "waves": (dimensions, search.waves.reshape(shape), {"long_name": "waves until settled, or lived so far"}),
        "period": (dimensions, of_orbit("waves", 0).astype(int), {"long_name": "waves of the orbit; 0: unsettled"}),
        "losses": (dimensions, of_orbit("losses", np.nan), {"long_name": "losses of contact in one period"}),
        "largest_force": (dimensions, of_orbit("largest_force", np.nan), {"units": "N", "long_name": "largest force"}),
    }
    title = {"title": "wheeltapper fates", "method": section.method, "static_force": one.static_force}
    return xr.Dataset(data, named, title)


def _first_state(found: FixedPoint) -> FloatArray:
    """Return the state of an orbit that stands for it: that with the lowest wheel."""
    return np.asarray(found.image.trail[np.argmin(found.image.trail[:, 0])])
