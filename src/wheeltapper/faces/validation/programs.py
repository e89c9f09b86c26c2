"""Comparisons with other programs."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.irregularity.bump import CosineBump
from wheeltapper.describe.irregularity.corrugation import Corrugation
from wheeltapper.describe.irregularity.flat import WheelFlat
from wheeltapper.describe.irregularity.step import Step
from wheeltapper.describe.scenario import Scenario, Start
from wheeltapper.describe.track.ballasted import Ballasted
from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.describe.track.stiff import StiffTrack
from wheeltapper.describe.vehicle.wagon import Wagon
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.faces.validation.comparison import compared, table_of
from wheeltapper.lower.structure import structure_of
from wheeltapper.orbits.orbit import find
from wheeltapper.record.simulate import simulate

DIGITS = "30 digits in mpmath, extrapolation of order 24 in regularised time; checked by SciPy's DOP853"
MOTIONS = {
    "drop_undamped_k0": "Bouncing on a stiff rail",
    "cosbump_c5e4": "Bump on a stiff rail",
    "step_up_R046": "Step up, met by a circle",
    "flat_stiff": "Wheel flat on a stiff rail",
    "flat_deck": "Wheel flat on a floating deck",
    "sine_V9": "Corrugation, with losses",
}
"""Motions of one wheelset that were computed with 30 digits."""


def motion(case: dict[str, Any]) -> Scenario:
    """Return the scenario of one of the motions that were computed with 30 digits."""
    given = case["inputs"]
    shape = {name: float(value) for name, value in given["exc"].items() if name != "type"}
    kind, start = given["exc"]["type"], given.get("init")
    deck = {name: float(value) for name, value in given.get("deck", {}).items()}
    irregularity: dict[str, Any] = {
        "none": lambda: None,
        "cosbump": lambda: CosineBump(height=shape["h"], length=shape["lam"], start=shape["x0"]),
        "stepup": lambda: Step(height=shape["h"], position=shape["x0"]),
        "flat": lambda: WheelFlat(depth=shape["h"], position=shape["x0"]),
        "sine": lambda: Corrugation(amplitude=-shape["a"], wavelength=shape["lam"], start=shape["x0"]),
    }
    fields = ("mass", "load", "stiffness", "damping", "gravity")
    wheelset = {field: float(given[name]) for field, name in zip(fields, "mPkcg", strict=True)}
    return Scenario(
        vehicle=Wheelset(**wheelset, radius=shape.get("R", 0.46)),
        track=FloatingDeck(mass=deck["M"], stiffness=deck["K"], damping=deck["C"]) if deck else StiffTrack(),
        contact=Hertz(constant=float(given["C"])),
        irregularity=irregularity[kind](),
        rolling="circle" if kind in ("stepup", "flat") else "point",
        speed=shape.get("V", 0.0),
        duration=float(given["t_end"]),
        start=Start(displacement=float(start["y"]), velocity=float(start["v"])) if start else "equilibrium",
    )


def differences_of(name: str) -> tuple[float, float]:
    """Return the differences of the instants, s, and of the force maxima."""
    case = table_of("core_cases.json")["dynamic"][name]
    record = simulate(motion(case), "strict")
    times = np.array([float(event["t"]) for event in case["events"]])
    forces = np.array([float(peak["N"]) for peak in case["force_peaks"]])
    if record.events.sizes["event"] != len(times):
        return np.inf, np.inf
    smooth = record.peaks.isel(peak=~record.peaks.corner.values)
    return abs(record.events.time.values - times).max(), abs(smooth.normal_force.values / forces - 1.0).max()


for name, subject in MOTIONS.items():
    compared(subject, "another program", DIGITS, {"instants, s": 1e-13, "force maxima": 1e-11})(
        partial(differences_of, name)
    )


@compared(
    "Periodic motions on corrugation", "another program",
    "SciPy's DOP853 in regularised variables, with its own events",
    {"start of the orbit": 1e-7, "largest force": 1e-7},
)  # fmt: skip
def orbits() -> tuple[float, float]:
    """Return the differences of states, over the scales of the motion, and of the largest forces."""
    start, force = [], []
    for case in table_of("orbits.json")["cases"]:
        if case["kind"] != "orbit":
            continue
        scene = Scenario(
            vehicle=Wheelset(mass=1500.0, load=91_307.0, stiffness=2.44e6, damping=2e4, radius=0.46),
            contact=Hertz(constant=1.405e11), rolling="point", speed=case["scenario"]["speed_m_per_s"], duration=1.0,
            irregularity=Corrugation(amplitude=5e-5, wavelength=0.05, start=0.0),
        )  # fmt: skip
        given = {"displacement": case["start_displacement_m"], "velocity": case["start_velocity_m_per_s"]}
        scales = {"displacement": 8.289e-5, "velocity": 0.0777}
        beside = {entry: given[entry] + 1e-4 * scale for entry, scale in scales.items()}
        orbit = find(scene, case["wavelengths"], beside, method="strict")
        start += [abs(orbit.start[entry] - given[entry]) / scale for entry, scale in scales.items()]
        force.append(orbit.largest_force / orbit.record.static_force / case["largest_force_over_static"] - 1.0)
    return max(start), float(np.abs(force).max())


@compared(
    "Wheel flat of 60 mm on rails and sleepers", "another program",
    "modes of a ring up to 12 and 18 kHz, extrapolated; finite elements agree with it to 6e-4",
    {"instants, s": 3e-6, "largest force": 3e-3},
)  # fmt: skip
def flat_on_ballast() -> tuple[float, float]:
    """Return the differences of the instants of loss and impact, s, and of the largest force."""
    scene = Scenario(
        vehicle=Wheelset(mass=600.0, load=1e5 - 600.0 * 9.81, radius=0.46, wheels=1),
        track=Ballasted.named("rolland_UIC60_example"), contact=Hertz(constant=9.4125e10), speed=10.0, duration=0.33,
        irregularity=WheelFlat(length=0.06, position=3.0, repeat=False),
    )  # fmt: skip
    record = simulate(scene)
    if record.events.sizes["event"] != 2:
        return np.inf, np.inf
    late = record.events.time.values - np.array([0.2996791, 0.3000273])
    late_peaks = record.peaks.normal_force.values[record.peaks.time.values > 0.2969]
    return abs(late).max(), float(late_peaks.max()) / 244_333.3 - 1.0


@compared(
    "Modes of the ERRI B176 coach", "another program",
    "eigenvalues from the figures of S. Iwnicki, Vehicle System Dynamics 30 (1998) 295-313", {"frequency": 5e-3},
)  # fmt: skip
def coach_modes() -> tuple[float]:
    """Return the largest difference of a frequency on fixed wheelsets."""
    plain = Wagon.erri_b176()
    fixed = ("x", "y", "z", "roll", "pitch", "yaw")
    axles = tuple(axle.model_copy(update={"held": fixed}) for axle in plain.axles)
    bodies = tuple(body.model_copy(update={"held": ()}) for body in plain.bodies)
    structure = structure_of(Wagon(bodies=bodies, axles=axles, elements=plain.elements))
    stiffness = structure.stiffness / np.sqrt(np.outer(structure.mass, structure.mass))
    found = np.sqrt(np.linalg.eigvalsh(stiffness)) / (2.0 * np.pi)
    stated = [value for name, value in table_of("coach_modes.toml").items() if name.endswith("_Hz")]
    return (max(float(np.abs(found / value - 1.0).min()) for value in stated),)
