"""From a scenario with a wagon on rails that give way to its program: the wagon, and two equal rails below it.

The wagon starts as it stands on a stiff track, and each rail as it lies at rest under the wheels' forces there: springs
carry what they have to, as below every vehicle (docs/theory/track.rst). Sleepers over voids then bear on the ballast
where they are pressed so far.
"""

from __future__ import annotations

from dataclasses import replace
from math import log2

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.notes import Note
from wheeltapper.lower.lowered.wagon import LoweredWagon
from wheeltapper.lower.marks.wagon_marks import WornRails
from wheeltapper.lower.plane import GENERAL_METHODS, SUDDEN, check_speed
from wheeltapper.lower.standing import normal_forces
from wheeltapper.lower.track.anomalies import Void, arms_of, check_seats, voids_of
from wheeltapper.lower.track.irregular import IrregularModes
from wheeltapper.lower.track.reach import Reach, cutoff_note, modes_of, rolling_modes_of
from wheeltapper.lower.track.ring import TrackModes
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march.general.contract import Port
from wheeltapper.march.general.march import forces_of_ports, rest_of
from wheeltapper.march.general.tables import Units
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import HALF, LANES, Assembly
from wheeltapper.march.wagon.rail_motion import rails_array
from wheeltapper.march.wagon.rails.march import OnRails, ways_of
from wheeltapper.march.wagon.rails.modes import AGAINST, ALIKE, Track, fours_of, system_of

FloatArray = NDArray[np.float64]
TOLERANCES = {"default": 1e-6, "strict": 1e-8}
"""Tolerance of a step of each method. The rails' answers are far smoother than the highest degree of their moments, to
which most of a step's error belongs: event times move by some 1e-10 s and 1e-12 s."""
AT_ONCE = ("default",)
"""The methods that solve macro steps in which nothing happens at once. The strict one does not: it tells how exact they
are."""
MOST_OCTETS = 6
"""Octets of contacts and voids: a double tells which of so many lanes are closed, and whether a step is at once."""
TWO_RAILS = Note(
    "each rail lies on half-sleepers of its own; with track.sleeper_roll_inertia whole sleepers roll. Rails move "
    "vertically only: creep forces move the wheelsets alone",
    "two rails",
)
ROLLING = Note("rails move vertically only: creep forces move the wheelsets alone", "two rails")
"""What the march leaves out of a real track, without and with sleepers that roll."""
SPRINGS_AND_DAMPERS = Note(
    "at sleepers with voids ballast_roll_damping has no effect: there the ballast's dampers stand where its springs do",
    "voids below sleepers that roll",
)


def lower_wagon_on_rails(
    scenario: Scenario, method: str = "default", worn: WornRails | None = None
) -> LoweredWagon:  # fmt: skip
    """Lower a scenario with a wagon on rails that give way; `worn`: they have marks of others."""
    lowered = lower_wagon(scenario, method, worn)
    places = np.array([axle.position for axle in scenario.vehicle.axles], dtype=float)
    modes, reach = modes_of(scenario.track, method, float(np.ptp(places)))
    rolling = rolling_modes_of(scenario.track, reach) if scenario.track.rolls else modes
    rings = modes.ring, rolling.ring
    chosen = GENERAL_METHODS[method]
    check_speed(float(scenario.speed), scenario.track, modes.ring, chosen, float(scenario.speed * scenario.duration))
    way, seat = float(scenario.speed * scenario.duration), float(scenario.track.first_sleeper)
    recurring = check_seats(scenario.track, reach.bays, float(places.min()) - seat, float(places.max()) + way - seat)
    units, voids = _units(lowered), voids_of(scenario.track, reach.bays)
    from_seat = places - float(scenario.track.first_sleeper)
    below = _sleepers(modes, voids, np.ones(len(voids))), _sleepers(rolling, voids, arms_of(scenario.track, reach.bays))
    track = Track(rings, chosen, from_seat, float(scenario.speed), units, below)
    static = normal_forces(lowered.assembly, lowered.assembly.start, len(places)).T
    rest = [rest_of(system_of(track, way)) for way in (ALIKE, AGAINST)]
    force = ways_of(np.hstack([static, _forces_below(static, voids, [way.deflections for way in rest])]))
    assembly = over_voids(_with_moments(lowered, track, method), voids)
    amplitudes = force[ALIKE] @ rest[ALIKE].amplitudes, force[AGAINST] @ rest[AGAINST].amplitudes
    together, against = (
        (one @ way.deflections.T)[: len(places)] for one, way in zip(force, rest, strict=True)
    )  # fmt: skip
    on_rails = OnRails(assembly, track, amplitudes, np.stack([together + against, together - against]))
    said = (ROLLING if track.rolls else TWO_RAILS, *reach.notes, *recurring, *_excitation(scenario, reach))
    said = (*said, *_dampers_elsewhere(scenario, reach.bays))
    if scenario.speed > 0.0:
        said = (*said, SUDDEN)
    return replace(lowered, assembly=assembly, below=on_rails, voids=voids, notes=(*lowered.notes, *said))


def _dampers_elsewhere(scenario: Scenario, bays: int) -> tuple[Note, ...]:
    """Return a note where the track's dampers against roll are farther out, or nearer, than its springs."""
    stands = arms_of(scenario.track, bays) ** 2 * [void.damping for void in voids_of(scenario.track, bays)]
    wanted = np.array([void.damping for void in voids_of(scenario.track, bays, rolling=True)])
    return () if np.allclose(stands, wanted, rtol=1e-9, atol=0.0) else (SPRINGS_AND_DAMPERS,)


def _sleepers(modes: TrackModes | IrregularModes, voids: tuple[Void, ...], arms: FloatArray) -> tuple[Port, ...]:
    """Return the sleepers over voids as they move in one way of the rails."""
    if not isinstance(modes, IrregularModes):
        return ()
    return tuple(modes.port_of(void, float(arm)) for void, arm in zip(voids, arms, strict=True))


def _forces_below(static: FloatArray, voids: tuple[Void, ...], gives: list[FloatArray]) -> FloatArray:
    """Return what the ballast below voids bears at rest under forces of the wheels, N, both (2, …), left and right."""
    wheels = static.shape[1]
    same, other = 0.5 * (gives[ALIKE] + gives[AGAINST]), 0.5 * (gives[ALIKE] - gives[AGAINST])
    both = np.block([[same, other], [other, same]])
    pressing = np.tile(np.arange(len(same)) < wheels, 2)
    below = np.hstack([both[~pressing][:, pressing], both[~pressing][:, ~pressing]])
    gaps, stiffness = (np.tile([getattr(void, name) for void in voids], 2) for name in ("gap", "stiffness"))
    return forces_of_ports(below, static.ravel(), gaps, stiffness).reshape(2, -1)


def over_voids(A: Assembly, voids: tuple[Void, ...]) -> Assembly:
    """Return an assembly with octets of voids.

    Raises
    ------
    InputError
        If there are more than the number that tells which contacts are closed has digits for.
    """
    octets, room = fours_of(len(voids)), HALF * max(MOST_OCTETS - len(A.kinds), 0)
    if len(voids) > room:
        raise InputError("", "track.anomalies", f"{len(voids)} voids", f"at most {room} below this wagon")
    held = np.zeros((octets, asm.VOID_COLUMNS, LANES))
    held[:, [asm.VOID_STIFFNESS, asm.VOID_GAP]] = 1.0  # where there is no void, none that ever closes
    for i, void in enumerate(voids):
        for lane in (i % HALF, HALF + i % HALF):
            held[i // HALF, :, lane] = void.stiffness, void.damping, void.gap
    return A._replace(
        voids=held, kinds=np.append(A.kinds, np.full(octets, asm.BELOW_SLEEPERS)),
        lanes=np.concatenate([A.lanes, np.zeros((octets, *A.lanes.shape[1:]))]),
    )  # fmt: skip


def late_rates(assembly: Assembly) -> int:
    """Return how many rates of indentations follow late, and are states, on rails that give way."""
    return LANES * assembly.wheel_octets if assembly.numbers[asm.CONTACT_LAW] in (asm.LOSSY, asm.OWN_RATED) else 0


def _with_moments(lowered: LoweredWagon, track: Track, method: str) -> Assembly:
    """Return the assembly with the moments of the forces of a macro step as further states, after all others.

    Where these depend on the indentations' rates, such rates follow.
    """
    A, nodes = lowered.assembly, track.method.nodes
    more, states = np.zeros(2 * track.fours * nodes * HALF + late_rates(A)), len(A.start)
    rails = rails_array(
        nodes, track.fours, states, track.rolls, track.units.force, method in AT_ONCE, track.over_voids > 0
    )  # fmt: skip
    numbers = A.numbers.copy()
    numbers[asm.STEP_TOLERANCE] = TOLERANCES[method]
    return A._replace(numbers=numbers, start=np.append(A.start, more), scales=np.append(A.scales, more), rails=rails)


def _excitation(scenario: Scenario, reach: Reach) -> tuple[Note, ...]:
    """Return a note where the irregularities excite more than the modes of the track know."""
    radius = float(scenario.vehicle.axles[0].radius)
    waves = [length for item in scenario.irregularities if (length := item.shortest_wave(radius)) is not None]
    note = cutoff_note(reach, float(scenario.speed) / min(waves)) if waves else None
    return () if note is None else (note,)


def _units(lowered: LoweredWagon) -> Units:
    """Return powers of two near a wheel's static indentation and force."""
    sizes = float(lowered.assembly.numbers[asm.STATIC_INDENTATION]), float(lowered.static_force.max())
    return Units(*(2.0 ** round(log2(size)) for size in sizes))
