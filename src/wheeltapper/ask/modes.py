"""Modes of small vibrations of a wagon about its steady run, with names."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.vehicle.body import MOTIONS
from wheeltapper.ground.arguments import as_quantity, check_flag
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.lowered.base import DECK
from wheeltapper.lower.lowered.wagon import LoweredWagon
from wheeltapper.lower.standing import jacobian
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march import run
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import LANES, PLACES, TO_RATE
from wheeltapper.record.arguments import as_scenario

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
WORDS = {
    "x": "longitudinal", "y": "lateral", "z": "bounce", "roll": "roll", "pitch": "pitch", "yaw": "yaw",
}  # fmt: skip
STILL = 1e-3
"""Magnitude of an eigenvalue, 1/s. A slower mode is no vibration: the vehicle can stand at another place."""
ROUNDING = 1e-9
"""Growth rate of a mode, over the magnitude of its eigenvalue or over 1/s, if that is larger. Up to this it is
rounding: the mode counts as undamped, not as unstable."""


@dataclass(frozen=True)
class LinearSystem:
    """Rates of small deviations x from the steady run: x' = matrix·x."""

    matrix: FloatArray
    motions: tuple[tuple[str, str], ...]
    rows: NDArray[np.int64]  # position of each motion's displacement among the deviations; -1 if it has none
    rate_rows: NDArray[np.int64]
    mass: FloatArray


def linear_system(lowered: LoweredWagon, fixed: tuple[str, ...] = ()) -> LinearSystem:
    """Return the linear equations of a lowered wagon about its start; bodies in `fixed` do not move."""
    assembly, layout, structure = lowered.assembly, lowered.layout, lowered.structure
    places = layout.displacement_places
    masses = np.append(structure.mass, np.ones(len(places) - len(structure.mass)))
    moves = assembly.mobility[places // PLACES * LANES + places % PLACES] != 0.0
    moves &= np.array([body not in fixed for body, _ in layout.motions])
    spins = np.array([motion == "pitch" and body.startswith("wheelset ") for body, motion in layout.motions])
    ends = assembly.element_inside[: len(assembly.element_inside) - len(assembly.sliders)]  # what sticks does not slide
    inside = ends[ends >= 0]
    with_place = moves & ~spins
    states = np.concatenate([places[with_place], places[moves] + TO_RATE, inside])
    indentation = assembly.numbers[asm.STATIC_INDENTATION]
    steps = np.full(len(states), 1e-5 * indentation)
    steps[with_place.sum() : with_place.sum() + moves.sum()] = 1e-5 * indentation / assembly.numbers[asm.PULSE]
    matrix = jacobian(assembly, assembly.start, states, steps)[states]
    rows = np.full(len(places), -1)
    rows[with_place] = np.arange(with_place.sum())
    rate_rows = np.full(len(places), -1)
    rate_rows[moves] = with_place.sum() + np.arange(moves.sum())
    return LinearSystem(matrix, layout.motions, rows, rate_rows, masses)


def fastest_growth(lowered: LoweredWagon) -> float:
    """Return the growth rate of the motion about a wagon's steady run that grows fastest, 1/s; below zero if none does.

    Less what may be rounding.
    """
    values: Any = np.linalg.eigvals(linear_system(lowered).matrix)
    size = np.abs(values)
    return float((values.real - ROUNDING * np.maximum(size, 1.0))[size > STILL].max())


def modes(
    scenario: Scenario | str | Path, *, fixed_wheelsets: bool = False, friction_amplitude: float | str | None = None,
    friction_frequency: float | str | None = None,
) -> xr.Dataset:  # fmt: skip
    """Return the modes of small vibrations of a wagon about its steady run, contacts linear and always closed.

    Friction is taken as sticking, unless an amplitude is stated: an element with a spring acts as this spring, one
    without a spring fixes its two ends to each other in its direction. A piecewise linear damper is taken with its
    slope at rest, on the side of positive rates.

    Parameters
    ----------
    scenario
        With a `Wagon`, or the path of its TOML file; its irregularities are left out.
    fixed_wheelsets
        True: the wheelsets do not move, only the bodies on them.
    friction_amplitude, friction_frequency
        Both or none: friction is replaced by the spring and the damper that have its first harmonic where its two ends
        move against each other with this amplitude, m (rad about an axis), and frequency, Hz.

    Returns
    -------
    xarray.Dataset
        Over "mode", by rising frequency: `frequency` (Hz, of the undamped mode), `damping_ratio` (negative: the mode
        grows; 1 or more: it does not oscillate), `name`, and the complex `shape` over "body" and "motion". The shape is
        in m and rad, scaled so that the largest translation of a body, or rotation times 1 m, is one. For pictures, the
        coordinates `centre` and `edges` (m) describe a box for each body, over "body" and "along": a box with the
        body's mass and moments, or the box around the wheels of a wheelset.

    Raises
    ------
    InputError
        If the vehicle is no wagon.
    """
    import xarray as xr

    scenario = as_scenario(scenario)
    check_flag(fixed_wheelsets, "fixed_wheelsets")
    run.choose(run.MODES, scenario.needs)
    if (friction_amplitude is None) != (friction_frequency is None):
        given = "amplitude" if friction_frequency is None else "frequency"
        raise InputError("", f"friction_{given}", "it alone", "with friction_amplitude and friction_frequency, or none")
    at = None
    if friction_amplitude is not None:
        amplitude = as_quantity(friction_amplitude, "friction_amplitude", "length")
        at = amplitude, as_quantity(friction_frequency, "friction_frequency", "frequency")
    lowered = lower_wagon(scenario.replaced({"irregularity": None}), friction_at=at)
    fixed = tuple(f"wheelset {i + 1}" for i in range(len(scenario.vehicle.axles))) if fixed_wheelsets else ()
    linear = linear_system(lowered, fixed)
    values, vectors = np.linalg.eig(linear.matrix)
    keep = (np.abs(values) > STILL) & (values.imag >= 0.0)
    values, vectors = values[keep], vectors[:, keep]
    order = np.argsort(np.abs(values), kind="stable")
    values, vectors = values[order], vectors[:, order]
    bodies = [body for body in lowered.layout.bodies if body != DECK]
    shapes = np.zeros((len(values), len(bodies), len(MOTIONS)), dtype=complex)
    energies = np.zeros(shapes.shape)
    for (body, motion), row, mass in zip(linear.motions, linear.rate_rows, linear.mass, strict=True):
        if row >= 0 and body in bodies:
            at = bodies.index(body), MOTIONS.index(motion)
            shapes[(slice(None), *at)] = vectors[row] / values
            energies[(slice(None), *at)] = mass * np.abs(vectors[row]) ** 2
    shapes = np.array([_normalised_shape(shape) for shape in shapes]).reshape(shapes.shape)
    names = [_mode_name(shape, energy, bodies) for shape, energy in zip(shapes, energies, strict=True)]
    axes = {"mode": np.arange(1, len(values) + 1), "body": bodies, "motion": list(MOTIONS)}
    centres, edges = (np.array(found) for found in zip(*(scenario.vehicle.boxes[body] for body in bodies), strict=True))
    boxes = {
        "along": ["x", "y", "z"],
        "centre": (("body", "along"), centres, {"units": "m", "long_name": "place of the body at rest"}),
        "edges": (("body", "along"), edges, {"units": "m", "long_name": "length, width and height"}),
    }
    size = np.abs(values)
    return xr.Dataset(
        {
            "frequency": ("mode", size / (2 * np.pi), {"units": "Hz", "long_name": "frequency of the undamped mode"}),
            "damping_ratio": ("mode", -values.real / size, {"units": "", "long_name": "share of critical damping"}),
            "name": ("mode", names, {"long_name": "what moves most"}),
            "shape": (("mode", "body", "motion"), shapes, {"units": "m or rad", "long_name": "complex shape"}),
        },
        axes | boxes,
        {"speed": float(scenario.speed)},
    )


def _normalised_shape(shape: ComplexArray) -> ComplexArray:
    largest = shape.flat[int(np.argmax(np.abs(shape)))]
    return shape if largest == 0.0 else np.asarray(shape / largest)


def _mode_name(shape: ComplexArray, energy: FloatArray, bodies: list[str]) -> str:
    """Return the name of a mode: the bodies and the motion with most of its kinetic energy."""
    groups = [re.sub(r" \d+$", "", body) for body in bodies]
    shares = {
        group: sum(energy[i].sum() for i, g in enumerate(groups) if g == group) for group in dict.fromkeys(groups)
    }
    group = max(shares, key=lambda g: shares[g])
    members = [i for i, g in enumerate(groups) if g == group]
    by_motion = energy[members].sum(axis=0)
    motion = int(np.argmax(by_motion))
    y, roll = MOTIONS.index("y"), MOTIONS.index("roll")
    if len(members) == 1 and motion in (y, roll):
        lean = (shape[members[0], y] * np.conj(shape[members[0], roll])).real
        return f"{group} {'lower' if lean < 0.0 else 'upper'} sway"
    name = f"{group} {WORDS[MOTIONS[motion]]}"
    if len(members) == 1:
        return name
    return f"{name}, {_relative_motion(shape[members, motion])}"


def _relative_motion(moved: ComplexArray) -> str:
    """Return how bodies of one kind move relative to each other: in phase or not."""
    largest = moved[int(np.argmax(np.abs(moved)))]
    signs = np.sign((moved * np.conj(largest)).real) * (np.abs(moved) > 0.1 * np.abs(largest))
    if np.all(signs > 0):
        return "in phase"
    if len(signs) == 2 and np.all(signs != 0):
        return "in antiphase"
    return "as " + " ".join({1.0: "+", -1.0: "-", 0.0: "0"}[float(sign)] for sign in signs)
