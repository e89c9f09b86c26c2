"""The motion of a scenario at given times, with its exact derivatives with respect to fields of the scenario.

The times are in seconds. If a parameter changes the program's unit of time, the scaled time of a sample changes, too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import check_along
from wheeltapper.describe.scenario import Scenario
from wheeltapper.lower.at_hand import table_at_hand
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.many import EPSILON, LoweredCells
from wheeltapper.lower.numbers import Units
from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program

FloatArray = NDArray[np.float64]


class Trajectory(NamedTuple):
    """Results in SI units; NaN beyond the end of the march."""

    status: int
    force: FloatArray  # (times,)
    deck_acceleration: FloatArray  # (times,); zero on a stiff track
    wheel_acceleration: FloatArray  # (times,)
    of_force: FloatArray  # (parameters, times): derivatives
    of_deck_acceleration: FloatArray  # (parameters, times)
    of_wheel_acceleration: FloatArray  # (parameters, times)
    deck_jerk: FloatArray  # (times,): rate of the deck acceleration in time, m/s^3
    largest_force: float
    impacts: int


def is_derivable(scenario: Scenario) -> bool:
    """Return True where a scenario's motion has exact derivatives."""
    return run.fastest_march(run.TRAJECTORY, scenario.needs) is not None


def trajectory(
    scenario: Scenario, parameters: tuple[str, ...], times: FloatArray, method: str = "default"
) -> Trajectory:
    """Return normal force and accelerations of deck and wheel with their derivatives.

    Parameters
    ----------
    scenario
        With a wheelset whose motion has exact derivatives.
    parameters
        Paths of continuous fields.
    times
        Rising times, s.
    method
        "default" or "strict".

    Raises
    ------
    InputError
        If the motion has no exact derivatives.
    """
    check_along(run.TRAJECTORY, scenario, parameters)
    from wheeltapper.march.steps.tangent_path import LANES
    from wheeltapper.march.wheel.gradients import sampled_tangents
    from wheeltapper.march.wheel.tangent_samples import RATE, VALUE

    here = {path: np.array([float(Fields(scenario)(path))]) for path in parameters}
    many = LoweredCells(scenario, here or {"speed": np.array([float(scenario.speed)])}, method, table_at_hand)
    units = many.units
    scaled = times / units.time.item()
    march, values, tangents = None, np.empty(0), []
    for first in range(0, max(len(parameters), 1), LANES):
        directions = [many.direction_along(path) for path in parameters[first : first + LANES]]
        cells, turns = many.turned(directions)
        program = Program(cells.pieces, cells.numbers[0])
        march, samples = sampled_tangents(program, turns.numbers[0], turns.bends, turns.table, scaled)
        values = samples
        for lane, direction in enumerate(directions):
            numbers = program.numbers + 1j * EPSILON * direction.numbers[0]
            found = in_si(numbers, direction.units, tilted_motion(samples, lane, direction.units, scaled), scaled)
            tangents.append([quantity.imag / EPSILON for quantity in found])
    assert march is not None
    motion = values[:, :, VALUE] + 1j * EPSILON * values[:, :, RATE]
    plain = in_si(program.numbers.astype(complex), units, motion, scaled)
    jerk = plain[1].imag / EPSILON / units.time.item()
    of = np.array(tangents).reshape(len(parameters), len(plain), len(times)).swapaxes(0, 1)
    peaks = march.peaks[:, contract.PEAK_FORCE].max(initial=0.0) * units.force.item()
    impacts = int((march.events[:, contract.EVENT_KIND] == contract.IMPACT).sum())
    force, deck, wheel = (one.real for one in plain)
    return Trajectory(march.status, force, deck, wheel, of[0], of[1], of[2], jerk, float(peaks), impacts)


def tilted_motion(samples: FloatArray, lane: int, units: Units, scaled: FloatArray) -> NDArray[np.complex128]:
    """Return the scaled motion at times in s; its imaginary part is its derivative in one lane, whose units are given.

    At a time in s, the scaled time moves as the unit of time does.
    """
    from wheeltapper.march.wheel.tangent_samples import FIRST_LANE, RATE, VALUE

    time = np.ravel(units.time)[0]
    stretch = time.imag / EPSILON / time.real
    moving = samples[:, :, FIRST_LANE + lane] - samples[:, :, RATE] * (scaled * stretch)[:, None]
    return np.asarray(samples[:, :, VALUE] + 1j * EPSILON * moving)


def in_si(
    numbers: NDArray[np.complex128], units: Units, motion: NDArray[np.complex128], scaled: FloatArray
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.complex128]]:
    """Return force, accelerations of deck (zero on a stiff track) and wheel in SI units.

    Derivatives are imaginary parts.
    """
    from wheeltapper.march.wheel.tangent_samples import (
        FORCE,
        SAMPLED_DECK_V,
        SAMPLED_DECK_Y,
        SAMPLED_WHEEL_V,
        SAMPLED_WHEEL_Y,
    )

    force, height, velocity = (motion[:, row] for row in (FORCE, SAMPLED_DECK_Y, SAMPLED_DECK_V))
    length, time, weight = (np.ravel(getattr(units, name))[0] for name in ("length", "time", "force"))
    springs = numbers[contract.STIFFNESS] * motion[:, SAMPLED_WHEEL_Y]
    springs = springs + numbers[contract.DAMPING] * motion[:, SAMPLED_WHEEL_V]
    wheel = (force - 1.0 - springs) * length / time**2
    if numbers[contract.DECK_MASS] == 0.0:
        return force * weight, np.zeros_like(force), wheel
    on_deck = (scaled >= numbers[contract.DECK_FROM].real) & (scaled < numbers[contract.DECK_TO].real)
    pull = -numbers[contract.DECK_STIFFNESS] * height - numbers[contract.DECK_DAMPING] * velocity
    pull = pull + np.where(on_deck, numbers[contract.PRESTRESS] - force, 0.0)
    acceleration = pull / numbers[contract.DECK_MASS] * length / time**2
    return force * weight, acceleration, wheel
