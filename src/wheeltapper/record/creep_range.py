"""Whether the spin of a wagon's contacts stayed within the range of its creep law."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.profile.wheel_rail import WheelRail
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.notes import Note
from wheeltapper.lower.laws.patches import elastic_of, geometry_of, patch_tables
from wheeltapper.lower.lowered.wagon import LoweredWagon
from wheeltapper.march.common.program import EVENT_CONTACT, EVENT_KIND, EVENT_TIME, IMPACT
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.march import Marched as MarchedWagon

FloatArray = NDArray[np.float64]


def spin_use(scenario: Scenario, friction: float, radius: float, shift: FloatArray) -> FloatArray:
    """Return the linear spin force on a tread over the friction limit, in a straight run with lateral shifts u (m).

    It depends neither on the normal force nor on the speed: the spin is h'(u)/R, and its force is proportional to the
    normal force.
    """
    tables = patch_tables(scenario.profiles, scenario.contact, radius)
    nodes = geometry_of(scenario.profiles, radius, elastic_of(scenario.contact).rail_radius).shift
    slope = np.gradient(tables[asm.TABLE_LIFT], nodes)
    use = tables[asm.SPIN] * np.abs(slope) / (radius * friction)
    return np.asarray(np.interp(shift, nodes, use))


def beyond_spin(lowered: Any, march: Any) -> tuple[Note, ...]:
    """Return a note if spin leaves the range of the creep law, on the worst place only."""
    scenario, law = lowered.scenario, lowered.scenario.creep
    if law is None or law.spin_range is None:
        return ()
    limit = law.spin_range
    worst, where = limit, ""
    for number, axle in enumerate(scenario.vehicle.axles, 1):
        outwards = _tread_shift(lowered, march, f"wheelset {number}", axle.radius)
        for sign, side in ((1.0, "left"), (-1.0, "right")):
            use = spin_use(scenario, law.friction, axle.radius, sign * outwards)
            most = int(np.argmax(use))
            if use[most] > worst:
                worst, where = float(use[most]), f"on wheelset {number} {side} at t = {_step_times(march)[most]:.4g} s"
    found = []
    if where:
        found.append(f"spin by itself would use {worst:.2g} of the friction limit {where}")
    flange = _first_on_flange(scenario, lowered, march)
    if flange is not None:
        found.append(f"flanges touch from t = {flange:.4g} s on")
    if not found:
        return ()
    text = (
        f"{'; '.join(found)}: {type(law).__name__} is close to FASTSIM up to {limit:g} of that limit, beyond it gives "
        "too large creep forces; use creep=wt.creep.Fastsim()"
    )
    return (Note(text, "spin", worst / limit),)


def _step_times(march: MarchedWagon) -> FloatArray:
    return np.append(march.steps[:, asm.STEP_TIME], march.end)


def _tread_shift(lowered: LoweredWagon, march: MarchedWagon, body: str, radius: float) -> FloatArray:
    """Return the shift of a wheelset's treads to the left, m, at the beginnings of all steps and at the end."""
    motions, places = lowered.layout.motions, lowered.layout.displacement_places
    states = np.vstack([march.states, march.state])
    y, roll = (
        states[:, places[motions.index((body, motion))]] if (body, motion) in motions else 0.0
        for motion in ("y", "roll")
    )  # fmt: skip
    return np.asarray(np.zeros(len(states)) + y + radius * roll)


def _first_on_flange(scenario: Scenario, lowered: LoweredWagon, march: MarchedWagon) -> float | None:
    """Return the time of the first impact of a flange, s; None without one."""
    if not isinstance(scenario.profiles, WheelRail):
        return None
    treads = lowered.assembly.numbers[asm.TREADS] * asm.LANES
    events = march.events[(march.events[:, EVENT_KIND] == IMPACT) & (march.events[:, EVENT_CONTACT] >= treads)]
    return float(events[0, EVENT_TIME]) if len(events) else None
