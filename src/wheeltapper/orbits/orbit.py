"""Periodic motions of a wheel over a periodic irregularity, found by Newton's method."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario, Start
from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.shown import Shown
from wheeltapper.lower.build import lower
from wheeltapper.lower.lowered.balanced import judged_balance
from wheeltapper.lower.section import Section, section_place
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.orbits.asked import START, given_start, is_undamped, section_of
from wheeltapper.orbits.section_map import FixedPoint, SectionMap, Wave, exact_determinant
from wheeltapper.record.record import Record

FloatArray = NDArray[np.float64]
SETTLING = (40, 80, 160, 320, 640, 1280)
"""Rounds for which a motion from rest settles, between two trials to finish it by Newton's method."""
SETTLED = 0.05
"""Largest distance, in static indentations, of a settled motion from the orbit that it settles on."""


@dataclass(frozen=True, eq=False, repr=False)
class Orbit(Shown):
    """A motion that repeats after some waves of the irregularity.

    Attributes
    ----------
    scenario
        What it is an orbit of.
    method
        "default" or "strict".
    start
        State at phase zero of the irregularity, where it begins to repeat: "displacement" in m, "velocity" in m/s; on a
        deck also "deck_displacement" and "deck_velocity".
    waves
        Number of periods of the irregularity after which it repeats.
    period
        s.
    multipliers
        Floquet multipliers: factors by which small deviations grow in one period, the largest first.
    closure
        Distance between its first and its last state, in static indentations and their unit of velocity.
    determinant_error
        Error of the product of the multipliers, which is known exactly: exp(-(c/m + C_d/M)·period). NaN for a contact
        with hysteresis.
    losses
        Losses of contact in one period.
    largest_force
        Largest contact force, N.
    undamped
        True where nothing takes energy away: then no orbit attracts, and none is stable.
    """

    scenario: Scenario
    method: str
    start: Mapping[str, float]
    waves: int
    period: float
    multipliers: NDArray[np.complex128]
    closure: float
    determinant_error: float
    losses: int
    largest_force: float
    undamped: bool
    _section: Section

    def __str__(self) -> str:
        kind = "undamped" if self.undamped else "stable" if self.stable else "unstable"
        waves = f"{self.waves} wave{'' if self.waves == 1 else 's'}"
        losses = f"{self.losses} loss{'' if self.losses == 1 else 'es'} of contact"
        over = self.largest_force / float(self._section.cells({}).units.static_force[0])
        size = abs(self.multipliers[0])
        return (
            f"{kind} orbit of {waves}, {1e3 * self.period:.4g} ms: {losses}, largest force {over:.3f} of static, "
            f"largest multiplier {size:.4g}, closes to {self.closure:.1g}"
        )

    def __repr__(self) -> str:
        return f"<Orbit {self}>"

    @property
    def stable(self) -> bool:
        """True if every small deviation dies out."""
        return not self.undamped and bool(np.abs(self.multipliers).max() < 1.0)

    @property
    def state(self) -> FloatArray:
        """Its start as an array, in the order of `start`."""
        return np.array(list(self.start.values()))

    @property
    def phase_zero(self) -> float:
        """Where phase zero lies on the rail of the scenario, m; also one period of the irregularity farther, and so on.

        The irregularity repeats from there on. A flat is met half a revolution behind it.
        """
        return section_place(self.scenario)

    @cached_property
    def record(self) -> Record:
        """The record of one period, from phase zero.

        Its scenario begins on the orbit, as a start for `simulate` and `wear_in`. A deck's motion is in no scenario's
        start: there a deck begins at rest.
        """
        start = Start(displacement=self.start["displacement"], velocity=self.start["velocity"])
        scenario = self._section.public().model_copy(update={"duration": self.period, "start": start})
        lowered = lower(scenario, self.method, self._section.table())
        state = np.zeros(len(START))
        state[: len(self.start)] = self.state
        scale = np.array([lowered.length, lowered.length / lowered.time] * 2)
        march = run.march(lowered.program, motion=state / scale).on_its_own_path()
        status, missing = judged_balance(march.status, lowered.missing_part(march))
        record = Record(lowered, self.method, march._replace(status=status))
        record.notes = (*lowered.notes, *missing)
        return record


def find(
    scenario: Scenario | str | Path, waves: int = 1, start: Mapping[str, Any] | None = None, *, method: str = "default"
) -> Orbit:
    """Find a periodic motion over a periodic irregularity.

    Parameters
    ----------
    scenario
        A wheelset over an irregularity that repeats without end: a corrugation, repeated joints, what is on the wheel.
        Its duration does not matter.
    waves
        Number of the irregularity's periods after which the motion repeats. An orbit that closes sooner is found too.
    start
        A state near the orbit, at phase zero of the irregularity, where it begins to repeat: {"displacement": m,
        "velocity": m/s}. None: the motion from rest settles first.
    method
        "default" or "strict".

    Returns
    -------
    Orbit
        Stable or not.

    Raises
    ------
    InputError
        If the scenario has no orbits, or Newton's method finds none from this start.
    """
    section = section_of(scenario, method)
    waves = as_count(waves, "waves")
    each = SectionMap(section, waves)
    wave = each.wave_at()
    if start is None:
        found = settled(each, wave, at_rest(each, wave), is_undamped(section))
    else:
        found = each.fixed_point(wave, given_start(start, each.size == 4)[: each.size] / each.scale)
    if not found.closed:
        raise no_orbit("start", waves, found.closure)
    return orbit_of(each, wave, found)


def no_orbit(field: str, waves: int, closure: float) -> InputError:
    """Return the error of a start from which no orbit is found."""
    return InputError(
        "", field, f"a start from which Newton's method comes no nearer to an orbit than a closure of {closure:.2g}",
        f"a state near an orbit of {waves} wave{'s' if waves > 1 else ''}; `wheeltapper.orbits.returns` shows some",
    )  # fmt: skip


def at_rest(each: SectionMap, wave: Wave) -> FloatArray:
    """Return the start of the scenario as a state of the map."""
    numbers = wave.program.numbers
    out = np.zeros(each.size)
    out[:2] = numbers[[contract.START_HEIGHT, contract.START_VELOCITY]]
    return np.asarray(out / wave.to_program)


def settled(each: SectionMap, wave: Wave, state: FloatArray, undamped: bool) -> FixedPoint:
    """Return the orbit on which a motion settles; where it does not, an orbit that is near its last state."""
    found = each.fixed_point(wave, state)
    if undamped:
        return found
    for rounds in SETTLING:
        state = each.marched(wave, state[None], rounds)[0]
        if not np.all(np.isfinite(state)):
            break
        nearby = each.fixed_point(wave, state)
        if nearby.closed or not found.closed:
            found = nearby
        attracts = nearby.closed and np.abs(multipliers_of(nearby.image.slopes)).max() < 1.0
        if attracts and np.abs(nearby.state - state).max() < SETTLED:
            break
    return found


def multipliers_of(slopes: FloatArray) -> NDArray[np.complex128]:
    """Return the multipliers, the largest first; of a pair the one above the axis."""
    values = np.linalg.eigvals(slopes).astype(complex)
    return np.asarray(values[np.lexsort((-values.imag, -values.real, -np.round(np.abs(values), 9)))])


def orbit_of(each: SectionMap, wave: Wave, found: FixedPoint) -> Orbit:
    """Return a fixed point of the map as an orbit."""
    section, image = each.section, found.image
    error = float(np.linalg.det(image.slopes)) - exact_determinant(wave.program, each.waves)
    start = dict(zip(START, (found.state * each.scale).tolist(), strict=False))
    return Orbit(
        section.given, section.method, start, each.waves, each.waves * wave.period, multipliers_of(image.slopes),
        found.closure, error, image.losses, image.largest_force, is_undamped(section), section,
    )  # fmt: skip
