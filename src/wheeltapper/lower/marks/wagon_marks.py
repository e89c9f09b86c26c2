"""What the wheels of a wagon that yield leave on both rails for those that follow (docs/theory/elastic_plastic.rst).

Left and right wheels have surfaces of their own, each as in `rail_memory`. The law is that of the middle position: δ_Y
is one number, and forces are scaled by the contact's constant where a wheel runs. Flanges stay elastic, and meet the
rails as they were.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note
from wheeltapper.lower.laws.ellipse import semi_axes
from wheeltapper.lower.laws.patches import geometry_of
from wheeltapper.lower.laws.plastic import PlasticLaw, stored_below, stretched_rows, virgin_pieces
from wheeltapper.lower.marks.marks import SAMPLES, VIRGIN, MarkedPath, Surface
from wheeltapper.lower.marks.rail_memory import RailMemory
from wheeltapper.lower.paths.table import PathTable
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.law_columns import PLASTIC_CONSTANT, PLASTIC_FIRST, PLASTIC_ONSET, PLASTIC_PIECES
from wheeltapper.march.common.program import FloatArray
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows
from wheeltapper.march.wagon.assembly import HALF, LANES, Assembly
from wheeltapper.march.wagon.remembering import Paths

if TYPE_CHECKING:
    from wheeltapper.march.wagon.march import Marched as MarchedWagon

SIDES = ("left", "right")
SCALED = Note(
    "treads yield by the law of a wheelset in the middle of the track, scaled by the contact's constant where the "
    "wheel runs; flanges stay elastic",
    "law aside",
)
"""What the law of treads that yield is where wheelsets shift."""
ROWS = np.array([wheel_rows.ROW_DELTA, wheel_rows.ROW_LEFT, wheel_rows.NORMAL, wheel_rows.STRETCH], dtype=np.int64)
"""Rows of the contacts that tell how deep a wheel presses."""


def plastic_law(contact: ElasticPlastic) -> FloatArray:
    """Return the pieces of a law, lengths over δ_Y and forces over N_Y, with the work up to each."""
    rows = stretched_rows(contact)
    return np.column_stack([rows, stored_below(rows, rows[:, contract.LAW_START])])


def plastic_numbers(contact: ElasticPlastic, constant: float, heaviest: float) -> FloatArray:
    """Return the numbers of a law from the constant of one wheel in the middle and the largest wheelset's force, N."""
    out = np.zeros(asm.AT_LAW - asm.YIELD_LAW)
    out[PLASTIC_CONSTANT] = 1.0
    out[PLASTIC_ONSET] = contact.yield_indentation(2.0 * constant, len(SIDES), heaviest)
    out[PLASTIC_FIRST], out[PLASTIC_PIECES] = 0.0, len(stretched_rows(contact))
    return out


def onset_of(assembly: Assembly) -> float:
    """Return δ_Y, m."""
    return float(assembly.numbers[asm.YIELD_LAW + PLASTIC_ONSET])


def semi_axis_of(scenario: Scenario, force: float) -> float:
    """Return the semi-axis along the rail, m, of the patch of a wheel in the middle that presses with a force, N."""
    contact, radius = scenario.contact, float(scenario.vehicle.axles[0].radius)
    geometry = geometry_of(scenario.profiles, radius, contact.rail_radius)
    across = geometry.curvature[len(geometry.shift) // 2 : len(geometry.shift) // 2 + 1]
    along, _ = semi_axes(np.array([0.5 / radius]), across, contact.youngs_modulus, contact.poisson)
    return float(along[0] * np.cbrt(force))


@dataclass(frozen=True, eq=False)
class WornRails:
    """Rails over which wheels have passed before a run.

    Attributes
    ----------
    surfaces
        The left one, and the right one.
    heaviest
        Static force, N, of the most heavily loaded wheelset that passes: by it a contact yields that does not say when.
    begins
        x at which the surfaces begin, m.
    hardening
        As in `RailMemory`.
    """

    surfaces: tuple[Surface, Surface]
    heaviest: float
    begins: float
    hardening: float


@dataclass(frozen=True, eq=False)
class WagonRails:
    """Both rails below a wagon, which remember.

    Attributes
    ----------
    rails
        The left rail, and the right one.
    lanes, pieces
        Lanes of the assembly, and its paths over rails without marks, which its flanges follow.
    """

    rails: tuple[RailMemory, RailMemory]
    lanes: FloatArray
    pieces: FloatArray

    @property
    def reach(self) -> float:
        """How far the wheels may roll before they must know more of the marks ahead, m."""
        return self.rails[0].reach

    def begin(self) -> WagonMarking:
        """Return the state at the start of a run."""
        return WagonMarking(self)


class WagonMarking:
    """The surfaces of both rails in a run under way; `sides` are the left one and the right one."""

    def __init__(self, memory: WagonRails) -> None:
        self._memory = memory
        self.sides = tuple(rail.begin() for rail in memory.rails)

    def press(self, found: MarchedWagon, everywhere: bool = False) -> None:
        """Take what the wheels of a march have pressed since the last time.

        Where a wheel presses elastically it leaves nothing: how deep it presses there, and with which force, is only
        read if asked for `everywhere`.
        """
        memory, speed = self._memory, float(found.assembly.numbers[asm.SPEED])
        way = min(speed * float(found.end), memory.rails[0].end)
        offsets = memory.rails[0].offsets
        passed = list(self.sides[0].ahead(way))
        asked = [(places - offsets[wheel]) / speed for wheel, places in passed]
        wanted = [
            [np.full(len(times), True) if everywhere else yields_at(found, times, lane_of(wheel, side))
             for side in range(len(SIDES))]
            for (wheel, _), times in zip(passed, asked, strict=True)
        ]  # fmt: skip
        some = [times[one | other] for times, (one, other) in zip(asked, wanted, strict=True)]
        read_at = np.unique(np.concatenate([np.zeros(0), *some]))
        read = read_contacts(found, read_at)
        force = memory.rails[0].laws[0].force
        for side, marking in enumerate(self.sides):
            for (wheel, _), times, each in zip(passed, asked, wanted, strict=True):
                depths, pressures, here = np.zeros(len(times)), np.zeros(len(times)), each[side]
                rows = read[np.searchsorted(read_at, times[here]), :, lane_of(wheel, side)]
                delta, left, normal, _ = rows.T
                depths[here], pressures[here] = np.maximum(delta, 0.0) + left, normal / force
                marking.take(wheel, depths, pressures)

    def paths(self) -> Paths:
        """Return the paths of all wheels over the surfaces as they are known."""
        return laid_paths(self._memory, [marking.pieces() for marking in self.sides])


def lane_of(wheelset: int, side: int) -> int:
    """Return the lane of a tread."""
    return wheelset // HALF * LANES + side * HALF + wheelset % HALF


def yields_at(found: MarchedWagon, times: FloatArray, lane: int) -> NDArray[np.bool_]:
    """Return whether a tread yields at some times of a march, by its steps."""
    steps = found.steps
    row = np.clip(np.searchsorted(steps[:, asm.STEP_TIME], times, side="right") - 1, 0, None)
    column = steps.shape[1] - found.assembly.stretch_columns + lane
    return np.asarray(steps[row, column] > 0.0)


def path_of(assembly: Assembly, lane: int) -> PathTable:
    """Return the path of a tread, over the distance travelled."""
    columns = assembly.lanes[lane // LANES, :, lane % LANES]
    first, last, loop = (int(columns[column]) for column in (asm.FIRST_PIECE, asm.LAST_PIECE, asm.PATH_LOOP))
    rows = assembly.pieces[first : last + 1, : contract.PIECE_COLUMNS]
    return PathTable(rows, loop - first, int(columns[asm.PATH_LOOP_JOIN]))


def read_contacts(found: MarchedWagon, times: FloatArray) -> FloatArray:
    """Return ROWS of all contacts at some times of a march, (times, rows, lanes)."""
    from wheeltapper.march.wagon.march import Marched

    if not len(times):
        return np.zeros((0, len(ROWS), found.assembly.kinds.size * LANES))
    steps = found.steps
    first = max(int(np.searchsorted(steps[:, asm.STEP_TIME], times[0], side="right")) - 1, 0)
    some = found._replace(steps=steps[first:], states=found.states[first:])
    return Marched(*some).at(times, ROWS)[2]


def laid_paths(memory: WagonRails, laid: list[list[FloatArray]]) -> Paths:
    """Return lanes and pieces with new paths of the treads, by side and wheelset, over places along the rail."""
    pieces, lanes = [virgin_pieces(memory.pieces, memory.rails[0].before.onset)], memory.lanes.copy()
    count = len(memory.pieces)
    for side, of_wheels in enumerate(laid):
        for wheel, rows in enumerate(of_wheels):
            own, octet, lane = rows.copy(), wheel // HALF, side * HALF + wheel % HALF
            own[:, [contract.START, contract.STOP, contract.CENTRE]] -= memory.rails[side].offsets[wheel]
            pieces.append(own)
            lanes[octet, asm.FIRST_PIECE, lane], lanes[octet, asm.LAST_PIECE, lane] = count, count + len(own) - 1
            lanes[octet, asm.PATH_LOOP, lane] = count + len(own)
            lanes[octet, asm.PATH_LOOP_JOIN, lane] = contract.SOFT
            count += len(own)
    return Paths(lanes, np.vstack(pieces))


def wagon_rails(
    scenario: Scenario, assembly: Assembly, tables: Sequence[tuple[PathTable, PathTable]], semi_axis: float,
    worn: WornRails | None = None,
) -> WagonRails:  # fmt: skip
    """Return what both rails remember of a wagon that yields.

    Parameters
    ----------
    scenario
        Its scenario.
    assembly
        Its assembly over rails without marks.
    tables
        Paths of the left and the right wheel of each wheelset, over the distance travelled; none where new paths are
        not wanted.
    semi_axis
        Of the patch along the rail, m.
    worn
        The rails before the run; by default virgin ones, which begin under the last wheelset.
    """
    positions = np.array([axle.position for axle in scenario.vehicle.axles], dtype=float)
    way, onset, contact = float(scenario.speed * scenario.duration), onset_of(assembly), scenario.contact
    if worn is None:
        virgin = Surface.virgin_surface(float(np.ptp(positions)) + way, semi_axis, onset, SAMPLES)
        worn = WornRails((virgin, virgin), 0.0, float(positions.min()), 1.0)
    offsets = tuple((positions - worn.begins).tolist())
    law, rails = PlasticLaw.over_onset(stretched_rows(contact), onset, constant_of(assembly)), []
    for side, before in enumerate(worn.surfaces):
        marked = tuple(
            MarkedPath(pair[side].going_on().moved(offset), before, offset + way)
            for pair, offset in zip(tables, offsets, strict=False)
        )
        laws = (law,) * len(offsets)
        rails.append(RailMemory(laws, offsets, contact.share_of_rail, worn.hardening, before, marked, way))
    return WagonRails((rails[0], rails[1]), assembly.lanes, assembly.pieces[:, : contract.PIECE_COLUMNS])


def constant_of(assembly: Assembly) -> float:
    """Return the constant of one wheel in the middle of the track, N/m^1.5."""
    return float(assembly.cells[0, assembly.cells.shape[1] // 2, asm.ROOT_CONSTANT, 0]) ** 3


def yielding_treads(assembly: Assembly, contact: ElasticPlastic, constant: float, heaviest: float) -> Assembly:
    """Return an assembly with treads that yield; its numbers take those of the law. `constant`: of a middle wheel."""
    numbers = assembly.numbers
    numbers[asm.YIELD_LAW : asm.AT_LAW] = plastic_numbers(contact, constant, heaviest)
    pieces = virgin_pieces(assembly.pieces, float(numbers[asm.YIELD_LAW + PLASTIC_ONSET]))
    return assembly._replace(pieces=pieces, law=plastic_law(contact))


def remembered(
    scenario: Scenario, assembly: Assembly, paths: Sequence[tuple[PathTable, PathTable]], force: float,
    worn: WornRails | None,
) -> tuple[WagonRails | None, tuple[Note, ...]]:  # fmt: skip
    """Return what the rails remember of a wagon that yields, and notes; `force` is that of a wheel at rest, N."""
    several = len(scenario.vehicle.axles) > 1
    if scenario.rolling != "point" or not (several or worn):
        return None, (SCALED, VIRGIN) if several else (SCALED,)
    return wagon_rails(scenario, assembly, paths, semi_axis_of(scenario, force), worn), (SCALED,)
