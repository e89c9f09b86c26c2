"""From a scenario with a wagon on rails that give way to its program: the wagon, and two equal rails below it.

The wagon starts as it stands on a stiff track, and each rail as it lies at rest under the wheels' forces there: springs
carry what they have to, as below every vehicle (docs/theory/track.rst).
"""

from __future__ import annotations

from dataclasses import replace
from math import log2

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note
from wheeltapper.lower.on_rails import GENERAL_METHODS, SUDDEN, check_speed
from wheeltapper.lower.standing import normal_forces
from wheeltapper.lower.track.anomalies import check_seats
from wheeltapper.lower.track.reach import Reach, cutoff_note, modes_of, rolling_modes_of
from wheeltapper.lower.wagon import LoweredWagon, lower_wagon
from wheeltapper.lower.wagon_marks import WornRails
from wheeltapper.march import assembly as asm
from wheeltapper.march.assembly import HALF, LANES, Assembly
from wheeltapper.march.general.march import rest_of
from wheeltapper.march.general.tables import Units
from wheeltapper.march.rail_motion import rails_array
from wheeltapper.march.rails.march import OnRails, ways_of
from wheeltapper.march.rails.modes import AGAINST, TOGETHER, Track, fours_of, system_of

FloatArray = NDArray[np.float64]
TOLERANCES = {"default": 1e-6, "strict": 1e-8}
"""Tolerance of a step of each method. The rails' answers are far smoother than the highest degree of their moments, to
which most of a step's error belongs: event times move by some 1e-10 s and 1e-12 s."""
AT_ONCE = ("default",)
"""The methods that solve macro steps in which nothing happens at once. The strict one does not: it tells how exact they
are."""
TWO_RAILS = Note(
    "the two rails are equal tracks side by side, each on half of every sleeper: sleepers do not roll. Rails move "
    "vertically only, and creep forces act on the wheelsets alone",
    "two rails",
)
ROLLING = Note("rails move vertically only, and creep forces act on the wheelsets alone", "two rails")
"""What the march leaves out of a real track, without and with sleepers that roll."""


def lower_wagon_on_rails(
    scenario: Scenario, method: str = "default", worn: WornRails | None = None
) -> LoweredWagon:  # fmt: skip
    """Lower a scenario with a wagon on rails that give way; `worn`: they have marks of others."""
    lowered = lower_wagon(scenario, method, worn)
    places = np.array([axle.position for axle in scenario.vehicle.axles], dtype=float)
    modes, reach = modes_of(scenario.track, method, float(np.ptp(places)))
    rings = modes.ring, rolling_modes_of(scenario.track, reach).ring if scenario.track.rolls else modes.ring
    chosen = GENERAL_METHODS[method]
    check_speed(float(scenario.speed), scenario.track, modes.ring, chosen, float(scenario.speed * scenario.duration))
    way, seat = float(scenario.speed * scenario.duration), float(scenario.track.first_sleeper)
    recurring = check_seats(scenario.track, reach.bays, float(places.min()) - seat, float(places.max()) + way - seat)
    units = _units(lowered)
    from_seat = places - float(scenario.track.first_sleeper)
    track = Track(rings, chosen, from_seat, float(scenario.speed), units)
    force = ways_of(normal_forces(lowered.assembly, lowered.assembly.start, len(places)).T)
    rest = [rest_of(system_of(track, way)) for way in (TOGETHER, AGAINST)]
    assembly = _with_moments(lowered, track, method)
    amplitudes = force[TOGETHER] @ rest[TOGETHER].amplitudes, force[AGAINST] @ rest[AGAINST].amplitudes
    together, against = (one @ way.deflections.T for one, way in zip(force, rest, strict=True))
    below = OnRails(assembly, track, amplitudes, np.stack([together + against, together - against]))
    said = (ROLLING if track.rolls else TWO_RAILS, *reach.notes, *recurring, *_excitation(scenario, reach))
    if scenario.speed > 0.0:
        said = (*said, SUDDEN)
    return replace(lowered, assembly=assembly, below=below, notes=(*lowered.notes, *said))


def late_rates(assembly: Assembly) -> int:
    """Return how many rates of indentations follow late, and are states, on rails that give way."""
    return LANES * len(assembly.kinds) if assembly.numbers[asm.CONTACT_LAW] in (asm.LOSSY, asm.OWN_RATED) else 0


def _with_moments(lowered: LoweredWagon, track: Track, method: str) -> Assembly:
    """Return the assembly with the moments of the forces of a macro step as further states, after all others.

    Where these depend on the indentations' rates, such rates follow.
    """
    A, nodes, fours = lowered.assembly, track.method.nodes, fours_of(len(track.places))
    more, states = np.zeros(2 * fours * nodes * HALF + late_rates(A)), len(A.start)
    rails = rails_array(nodes, fours, states, track.rolls, track.units.force, method in AT_ONCE)
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
