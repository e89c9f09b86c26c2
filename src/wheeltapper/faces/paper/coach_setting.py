"""The paper's coach: the wagon of its Figs 4 to 10, its irregularities, and the reading of its records."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import wheeltapper as wt
from wheeltapper.faces.paper.claims import Case

FloatArray = NDArray[np.float64]

COACH = wt.Wagon.erri_b176(1500.0)
"""The original coach, with the wheelset mass of the paper's figures."""
FREE = COACH.without_dampers()
"""The paper's damping-free wagon: only friction damps it."""

ZONES = Case("contact zones damped")
"""The paper's own condition: no dampers, but friction and material damping in the contact zones. Its level is not told;
0.1 s/m, 5.3 kN s/m for a wheel at rest, was found by search: with it Figs 4 to 7 and 9 show what the text says."""
UNDAMPED = Case("no damping but friction", own=False)
ORIGINAL = Case("original wagon", own=False)
CHANGES: dict[Case, dict[str, Any]] = {
    ZONES: {"contact": wt.Hertz(constant_per_wheel=9.4125e10, poisson=0.28, hysteresis=0.1)},
    UNDAMPED: {},
    ORIGINAL: {"vehicle": COACH},
}
"""What each case changes of the setting. The constant of damped zones is the exact one of a crown of 0.3 m."""

STATIC = 53_010.7875
"""Static force of a wheel, N: the unit of the forces in the claims."""
HEIGHT, EDGE, STEP_SPEED = 1e-4, 0.05, 5.0
"""The step of Figs 4 and 6: height and place on the rail, m; speed, m/s."""
MEETS = EDGE / STEP_SPEED
"""Time at which the leading wheelset meets the step, s."""
LATER = 2.56 / STEP_SPEED
"""Time between the leading and the trailing wheelset of the bogie at the step, s."""
AMPLITUDE, WAVELENGTH = 50e-6, 0.05
"""The corrugation of Figs 7 to 10, m."""
REAR = -21.56
"""Position of the rear wheelset of the rear bogie at time zero, m."""
HALF_BASE = 1.28
"""Half the distance of a bogie's wheelsets, m."""
ARM = 0.75
"""Half the distance of the wheels' centres, m."""


def run(irregularity: Any, speed: float, duration: float, vehicle: wt.Wagon = FREE, **changes: Any) -> wt.Record:
    """Simulate the coach with the contacts of the paper's setting, and friction of 0.35."""
    fields = {
        "contact": wt.Hertz(constant_per_wheel=7.025e10, poisson=0.28), "creep": wt.creep.Polach(friction=0.35),
    } | changes  # fmt: skip
    return wt.simulate(
        wt.Scenario(vehicle=vehicle, irregularity=irregularity, speed=speed, duration=duration, **fields)
    )


def step(
    height: float, duration: float, vehicle: wt.Wagon = FREE, under: tuple[str, ...] = ("wheelset 1",),
    ideal: bool = False, **changes: Any,
) -> wt.Record:  # fmt: skip
    """Simulate the step of Fig. 4 under some wheelsets or wheels only; the others run on level rails."""
    shape = wt.Step(height=height, position=EDGE, ideal=ideal)
    return run(dict.fromkeys(under, shape), STEP_SPEED, duration, vehicle, **changes)


def flat(duration: float, vehicle: wt.Wagon = FREE, **changes: Any) -> wt.Record:
    """Simulate the flats of Fig. 5 on the leading wheelset, the only one that the deck of 15 t and 5 Hz carries."""
    shape = wt.WheelFlat(depth=1e-4, position=EDGE, repeat=False)
    deck = wt.FloatingDeck(mass=15_000.0, stiffness=15_000.0 * (2 * np.pi * 5.0) ** 2, wheelset=1)
    return run({"wheelset 1": shape}, 5.0, duration, vehicle, **({"track": deck} | changes))


def corrugation(
    speed: float, lasting: float, vehicle: wt.Wagon = FREE, amplitude: float = -AMPLITUDE, where: str = "wheelset 4",
    **changes: Any,
) -> tuple[wt.Record, float]:  # fmt: skip
    """Simulate corrugation under the rear wheelset only; return also its start, one wavelength after time zero."""
    shape = wt.Corrugation(amplitude=amplitude, wavelength=WAVELENGTH, start=REAR + WAVELENGTH)
    start = WAVELENGTH / speed
    return run({where: shape}, speed, start + lasting, vehicle, **({"rolling": "point"} | changes)), start


def both_of_the_rear_bogie(speed: float, amplitude: float = -AMPLITUDE, **changes: Any) -> tuple[wt.Record, float]:
    """Simulate corrugation that starts under the rear bogie's front wheelset; return also when its rear one meets it.

    The record ends as long after that as the front wheelset ran alone.
    """
    lag = 2.56 / speed
    shape = wt.Corrugation(amplitude=amplitude, wavelength=WAVELENGTH, start=-19.0 + WAVELENGTH)
    start = WAVELENGTH / speed
    under = {"wheelset 3": shape, "wheelset 4": shape}
    return run(under, speed, start + 2 * lag, **({"rolling": "point"} | changes)), start + lag


def with_trailing_links(wagon: wt.Wagon, roll: float) -> wt.Wagon:
    """Return the wagon with a link at each axle box that resists roll against the frame, N m/rad."""
    links = tuple(
        wt.vehicles.Spring(
            name=one.name.replace("spring", "link"), between=one.between, at=one.at, bending=(roll, 0, 0)
        )
        for one in wagon.elements
        if one.name.startswith("primary spring")
    )
    return wagon.model_copy(update={"elements": wagon.elements + links})


def vertical_changes(wagon: wt.Wagon) -> dict[str, Any]:
    """Return the changes that restrict a coach to its vertical plane and roll: 17 degrees of freedom, no creep."""
    upright = []
    for element in wagon.elements:
        if isinstance(element, wt.vehicles.Spring):
            bending = element.bending if element.name.startswith("anti-roll") else (0.0, 0.0, 0.0)
            stiffness = (0.0, 0.0, element.stiffness[2])
            upright.append(element.model_copy(update={"stiffness": stiffness, "bending": bending}))
    bodies = tuple(body.model_copy(update={"held": ("x", "y", "yaw")}) for body in wagon.bodies)
    axles = tuple(axle.model_copy(update={"held": ("x", "y", "pitch", "yaw")}) for axle in wagon.axles)
    return {
        "vehicle": wt.Wagon(bodies=bodies, axles=axles, elements=tuple(upright)),
        "creep": None,
        "profiles": wt.profiles.Cones(arm=ARM, moving_with="wheel"),
    }


# -- reading records --------------------------------------------------------------------------------------------------


def wheel_rows(table: Any, wheelset: int = 1, side: str = "right") -> Any:
    """Return the rows of one wheel in a table of events, peaks or impacts."""
    (rows,) = table.sizes
    return table.isel({rows: (table.wheelset.values == wheelset) & (table.side.values == side)})


def wheel_peaks(record: wt.Record, wheelset: int = 1, side: str = "right") -> tuple[FloatArray, FloatArray]:
    """Return times and heights, over the static force, of a wheel's force maxima, without those at corners."""
    table = wheel_rows(record.peaks, wheelset, side)
    smooth = ~table.corner.values
    return table.time.values[smooth], table.normal_force.values[smooth] / STATIC


def largest(record: wt.Record, wheelset: int = 1) -> float:
    """Return the largest normal force on the wheels of a wheelset, over the static one."""
    table = record.peaks
    return float(table.normal_force.values[table.wheelset.values == wheelset].max(initial=0.0)) / STATIC


def force(history: Any, wheelset: int = 1, side: str = "right") -> FloatArray:
    """Return a wheel's normal force over its static one."""
    return np.asarray(history.normal_force.sel(wheelset=wheelset, side=side).values / STATIC)


def body(history: Any, name: str, motion: str = "z", quantity: str = "displacement") -> FloatArray:
    """Return a motion of a body."""
    return np.asarray(history[quantity].sel(body=name, motion=motion).values)


def wheel_centre_heights(history: Any, wheelset: int = 4) -> dict[str, FloatArray]:
    """Return the heights of the centres of a wheelset's wheels, m."""
    middle, turn = (body(history, f"wheelset {wheelset}", motion) for motion in ("z", "roll"))
    return {"left": middle + ARM * turn, "right": middle - ARM * turn}


def rear_bogie(history: Any) -> dict[str, FloatArray]:
    """Return the upward motions of the rear bogie's parts from where they stood at first, m."""
    middle, turn = body(history, "bogie 2"), HALF_BASE * body(history, "bogie 2", "pitch")
    parts = {
        "front wheelset": body(history, "wheelset 3"),
        "frame above the front wheelset": middle - turn,
        "frame above the rear wheelset": middle + turn,
        "rear wheelset": body(history, "wheelset 4"),
    }
    return {name: moved - moved[0] for name, moved in parts.items()}


def times(begin: float, end: float, rate: float = 2e5) -> FloatArray:
    """Return evenly spread times."""
    return np.linspace(begin, end, round((end - begin) * rate) + 1)


def amplitude_at(at: FloatArray, values: FloatArray, frequency: float) -> float:
    """Return the amplitude at one frequency, over a Hann window, which suppresses ringing at other frequencies."""
    window = np.hanning(len(at))
    off = values - values.mean()
    return float(2.0 * abs(np.sum(window * off * np.exp(-2j * np.pi * frequency * at))) / window.sum())


def decay_rate(record: wt.Record, span: float, window: float = 0.025) -> float:
    """Return the rate in 1/s at which the right front wheel's force maxima, less the static force, decay.

    A straight line is fitted to the logarithms of the largest one in each window after the step.
    """
    time, height = wheel_peaks(record)
    begins = MEETS + window * np.arange(round(span / window))
    highest = [height[(time >= begin) & (time < begin + window)].max() for begin in begins]
    return float(-np.polyfit(begins, np.log(np.array(highest) - 1.0), 1)[0])
