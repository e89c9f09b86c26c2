"""The energy balance of a run: it must close, and the record states the error.

Along a smooth stretch: change of (kinetic + elastic) = work of the load + work of the irregularity - dissipated. Where
the path jumps, or the wheel leaves a displaced deck, the indentation and the elastic energy of the contact jump. That
difference counts as work of the irregularity.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wheeltapper.lower.laws.plastic import left_after, stored_below
from wheeltapper.lower.lowered.base import Terms
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program

if TYPE_CHECKING:
    from wheeltapper.march.wheel.march import Marched as MarchedWheel

FloatArray = NDArray[np.float64]
NODES = 24
"""Number of nodes of Gauss's rule for the integral over one step."""


@dataclass(frozen=True)
class Integrals:
    """Scaled integrals of each step, and the quantities at the steps' ends."""

    columns: FloatArray  # (steps, INTEGRALS)
    ends: FloatArray  # (steps, 2, OUT_COLUMNS)
    elastic: FloatArray  # (steps, 2): elastic energy of the contact at the ends
    on_deck: NDArray[np.bool_]

    @property
    def impulse(self) -> FloatArray:
        """Impulse of the contact force in each step."""
        from wheeltapper.march.wheel.dense import IMPULSE

        return np.asarray(self.columns[:, IMPULSE])


def integrate(program: Program, march: MarchedWheel) -> Integrals:
    """Integrate over every step of a march."""
    from wheeltapper.march.wheel import dense

    columns, ends = march.integrals(NODES)
    elastic = _elastic_energy(program, march, ends)
    yields = march.steps[:, contract.PHASE] >= contract.YIELDING
    if np.any(yields):
        elastic[yields] = _stored_energy(program, ends[yields])
    # An indentation that recovers without force returns no energy: it stays in the material.
    spent = yields | (march.steps[:, contract.PHASE] == contract.RELEASED)
    columns[spent, dense.LOST_CONTACT] -= elastic[spent, 1] - elastic[spent, 0]
    return Integrals(columns, ends, elastic, march.steps[:, contract.ON_DECK] != 0.0)


def _stored_energy(program: Program, ends: FloatArray) -> FloatArray:
    """Return the energy (scaled) that a yielding contact returns on unloading, from rows of the dense output.

    For a spot with a memory this is the work of unloading. Over virgin rail unloading follows the loading curve, and
    all energy is returned.
    """
    from wheeltapper.march.wheel import dense

    depth = ends[..., dense.OUT_DELTA] + ends[..., dense.OUT_RESIDUAL]
    if program.numbers[contract.MEMORY] == 0.0:
        return stored_below(program.law, depth)
    return np.asarray(0.4 * ends[..., dense.OUT_FORCE] * (depth - left_after(program.law, depth)))


def _elastic_energy(program: Program, march: MarchedWheel, ends: FloatArray) -> FloatArray:
    from wheeltapper.march.wheel import dense

    numbers, steps = program.numbers, march.steps
    delta = ends[:, :, dense.OUT_DELTA]
    touching = (steps[:, contract.PHASE] != contract.FLIGHT)[:, None]
    bonded = (steps[:, contract.PHASE] == contract.BONDED)[:, None]
    depth = np.where(touching, np.where(bonded, delta, np.maximum(delta, 0.0)), 0.0)
    law = 0.5 * numbers[contract.QUADRATIC] * depth**2 + 0.4 * numbers[contract.CUBIC] * np.abs(depth) ** 2.5
    return np.asarray(law * _step_factors(program, march))


def _step_factors(program: Program, march: MarchedWheel) -> FloatArray:
    """Return the factor on the contact force at both ends of each step, from the piece of that step."""
    rows = march.pieces[march.steps[:, contract.PIECE].astype(int)]
    if np.all(rows[:, contract.FACTOR_DEGREE] < 0):
        return np.ones((len(rows), 2))
    pace = program.numbers[contract.PACE]
    begins = march.steps[:, contract.TIME]
    finishes = np.append(begins[1:], march.state[contract.TIME])
    out = np.ones((len(rows), 2))
    for i, time in enumerate((begins, finishes)):
        xi = (pace * time - march.steps[:, contract.SHIFT] - rows[:, contract.CENTRE]) / rows[:, contract.SCALE]
        powers = sum(rows[:, contract.FACTOR + k] * xi**k for k in range(contract.TERMS))
        out[:, i] = np.where(rows[:, contract.FACTOR_DEGREE] < 0, 1.0, powers)
    return out


def _state_energy(program: Program, ends: FloatArray) -> tuple[float, float]:
    """Return kinetic energy and elastic energy of the springs (without the contact) at one instant, scaled."""
    from wheeltapper.march.wheel import dense

    numbers = program.numbers
    kinetic = 0.5 * ends[dense.OUT_WHEEL_V] ** 2 + 0.5 * numbers[contract.DECK_MASS] * ends[dense.OUT_DECK_V] ** 2
    springs = numbers[contract.STIFFNESS] * ends[dense.OUT_WHEEL_Y] ** 2
    springs += numbers[contract.DECK_STIFFNESS] * ends[dense.OUT_DECK_Y] ** 2
    return float(kinetic), float(0.5 * springs) + _bush_energy(program, ends)


def _bush_energy(program: Program, ends: FloatArray) -> float:
    """Return the elastic energy of the bush (scaled), from a row of the dense output."""
    from wheeltapper.march.wheel import dense

    bush = program.numbers[contract.DAMPER_BUSH]
    return float(0.5 * ends[dense.OUT_DAMPER_FORCE] ** 2 / bush) if bush > 0.0 else 0.0


def balance(program: Program, integrals: Integrals, joule: float) -> Terms:
    """Return the energy balance over the whole run; `joule` is the program's unit of energy, J."""
    from wheeltapper.march.wheel import dense

    ends, columns = integrals.ends, integrals.columns
    kinetic0, springs0 = _state_energy(program, ends[0, 0])
    kinetic1, springs1 = _state_energy(program, ends[-1, 1])
    in_contact = float(integrals.elastic[-1, 1] - integrals.elastic[0, 0])
    jumps = float((integrals.elastic[1:, 0] - integrals.elastic[:-1, 1]).sum())
    settled = jumps if program.numbers[contract.MEMORY] != 0.0 else 0.0  # jumps of the contact law itself
    work_path = float(columns[:, dense.WORK_PATH].sum() + columns[:, dense.WORK_FACTOR].sum()) + jumps - settled
    rise = ends[:, 1, dense.OUT_DECK_Y] - ends[:, 0, dense.OUT_DECK_Y]
    prestress = program.numbers[contract.PRESTRESS] * float(rise[integrals.on_deck].sum())
    work_load = -(ends[-1, 1, dense.OUT_WHEEL_Y] - ends[0, 0, dense.OUT_WHEEL_Y]) + prestress
    lost = columns[:, [dense.LOST_SUSPENSION, dense.LOST_DECK, dense.LOST_CONTACT]].sum(axis=0)
    lost[2] -= settled
    exchanged = (
        0.5 * float((ends[:, 0, dense.OUT_WHEEL_V] ** 2).max())
        + float(integrals.elastic.max())
        + float(np.abs(columns[:, dense.WORK_PATH]).sum())
        + float(lost.sum())
        + abs(work_load)
    )
    terms = {
        "kinetic": kinetic1 - kinetic0,
        "elastic": springs1 - springs0 + in_contact,
        "elastic_contact": in_contact,
        "dissipated_suspension": lost[0],
        "dissipated_deck": lost[1],
        "dissipated_contact": lost[2],
        "work_of_load": work_load,
        "work_of_irregularity": work_path,
    }
    return Terms(terms, exchanged, joule)
