"""The forces of a dipped joint over speed: by the exact march, and by the formulas of Jenkins and others.

H. H. Jenkins, J. E. Stephenson, G. A. Clayton, G. W. Morland, D. Lyon: The effect of track and vehicle parameters on
wheel/rail vertical dynamic forces. Railway Engineering Journal 3 (1974). docs/theory/joints.rst, section 14.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, pi
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.base import Contact
from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.irregularity.joint import DippedJoint
from wheeltapper.describe.placement import Placement
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.supported import SupportedRail
from wheeltapper.describe.vehicle.base import Vehicle
from wheeltapper.ground.arguments import as_quantities, as_quantity
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.needs import SEVERAL_BODIES
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.lower.track.lumped import contact_stiffness, rail_on_pads, whole_track
from wheeltapper.lower.track.section import section_of
from wheeltapper.record.arguments import as_scenario
from wheeltapper.record.assessment.filtering import checked_filter, settling_time
from wheeltapper.record.features.forces import largest_force
from wheeltapper.record.features.joint import P1, P2
from wheeltapper.record.labels import JOINT_TITLE
from wheeltapper.record.simulate import Method, simulate

if TYPE_CHECKING:
    import xarray as xr

Speeds = float | str | Sequence[float | str] | NDArray[Any]
BEFORE, AFTER = 0.1, 0.1
"""s on the track before the joint's dip begins, for the start to die away, and after the joint, for P2."""
MEANINGS = {
    "P1": "P1, first maximum of the contact force after the joint",
    "P2": "P2, largest low-passed contact force",
    "largest_force": "largest contact force, unfiltered",
    "losses": "number of losses of contact",
    "P1_jenkins": "P1 by the formula of Jenkins and others",
    "P2_jenkins": "P2 by the formula of Jenkins and others",
}


def jenkins(
    track: SupportedRail, vehicle: Vehicle, angle: float | str, speed: Speeds, contact: Contact | None = None
) -> xr.Dataset:
    """Return P1 and P2 of a dipped joint by the formulas of Jenkins and others (1974).

    P1 = P0 + 2α·V·√(K_H·m_e/(1 + m_e/m_u)), and
    P2 = P0 + 2α·V·√(m_u/(m_u + m_t))·[1 - π·c_t/(4·√(k_t·(m_u + m_t)))]·√(k_t·m_u), of one wheel. P0 is the static
    force, K_H the slope of the contact force over the indentation at P0, m_u one wheel's half of the wheelset's mass.
    The track is a beam on an elastic foundation, reduced to the point of the force by Rayleigh's method: m_e is the
    mass of the rail on its pads alone, and m_t, k_t, c_t are mass, stiffness and damping of rail, pads, sleepers and
    ballast together (docs/theory/joints.rst, section 14.2). The reduction is this program's; the authors give numbers
    of their own tracks.

    Parameters
    ----------
    track
        `Ballasted` or `Slab`.
    vehicle
        A vehicle on rails; its first wheelset is taken.
    angle
        2α, the total change of slope at the joint, rad.
    speed
        V, m/s; one, or several.
    contact
        `Hertz` or `Linear`; by default `Hertz()`.

    Returns
    -------
    xarray.Dataset
        P1_jenkins and P2_jenkins, N per wheelset, over "speed". Attributes, per wheel: static_force, unsprung_mass,
        contact_stiffness, effective_mass_P1, effective_mass, effective_stiffness, effective_damping (SI), and angle.

    Raises
    ------
    InputError
        If the track has no flexible rail, or an argument is wrong.
    """
    import xarray as xr

    turn, V = as_quantity(angle, "angle", "angle"), _speeds(speed)
    if not isinstance(track, SupportedRail):
        raise InputError("", "track", value_text(track), "a track with a flexible rail, as wt.tracks.Ballasted")
    if track.anomalies:
        raise InputError("", "track.anomalies", f"{len(track.anomalies)} of them", "none: all seats alike")
    scenario = Scenario(
        vehicle=vehicle,
        track=track,
        contact=Hertz() if contact is None else contact,
        speed=float(V.max()),
        duration=1.0,
    )
    if SEVERAL_BODIES in scenario.needs:
        raise InputError("", "vehicle", SEVERAL_BODIES.words, "a vehicle in the vertical plane")
    wheelset = scenario.vehicle.plane.wheelsets[0]
    wheels = float(wheelset.wheels)
    P0, m_u = wheelset.weight / wheels, float(wheelset.mass) / wheels
    K_H = contact_stiffness(scenario) / wheels
    section = section_of(track)
    m_e = rail_on_pads(section).mass
    m_t, k_t, c_t = whole_track(section)
    first = np.sqrt(K_H * m_e / (1.0 + m_e / m_u))
    lost = 1.0 - pi * c_t / (4.0 * np.sqrt(k_t * (m_u + m_t)))
    second = np.sqrt(m_u / (m_u + m_t)) * lost * np.sqrt(k_t * m_u)
    forces = {"P1_jenkins": P0 + turn * V * first, "P2_jenkins": P0 + turn * V * second}
    numbers = {
        "static_force": P0, "unsprung_mass": m_u, "contact_stiffness": K_H, "effective_mass_P1": m_e,
        "effective_mass": m_t, "effective_stiffness": k_t, "effective_damping": c_t, "angle": turn,
    }  # fmt: skip
    return xr.Dataset(
        {name: ("speed", wheels * force, _labels(name)) for name, force in forces.items()},
        {"speed": ("speed", V, {"units": "m/s", "long_name": "speed"})},
        {"title": JOINT_TITLE, **{name: float(number) for name, number in numbers.items()}},
    )


def joint_forces(
    scenario: Scenario | str, speed: Speeds, *, cutoff: float | str = 90.0, order: int = 4, method: Method = "default",
    progress: Progress = True,
) -> xr.Dataset:  # fmt: skip
    """Return P1 and P2 of a dipped joint over speed, simulated and by the formulas of Jenkins and others.

    At each speed the joint is moved ahead by whole bays, so far that the disturbance of the start has died away before
    it. The run ends 0.1 s after the joint; for a slow filter later, two of its settling times after the joint.

    Parameters
    ----------
    scenario
        A vehicle over a `DippedJoint` on rails and sleepers, or the path of its TOML file. Its speed and its duration
        do not matter.
    speed
        m/s; one, or several.
    cutoff, order
        Cut-off and order of the filter for P2, as for `wheeltapper.features.P2`.
    method
        "default" or "strict".
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    xarray.Dataset
        P1, P2, largest_force, P1_jenkins and P2_jenkins, N per wheelset, and the number of losses, over "speed"; for
        several wheelsets the simulated values are also over "wheelset". The attributes of `jenkins`, and the cut-off.

    Raises
    ------
    InputError
        If there is no dipped joint, or more than one irregularity.
    """
    import xarray as xr

    scene, V = as_scenario(scenario), _speeds(speed)
    second, after = P2(cutoff, order), max(AFTER, 2.0 * settling_time(*checked_filter(cutoff, order)))
    met = scene.irregularities
    if len(met) != 1 or not isinstance(met[0], DippedJoint):
        found = " and ".join(type(item).__name__ for item in met) or "none"
        raise InputError("", "irregularity", found, "one DippedJoint")
    if isinstance(scene.irregularity, Placement):
        found = f"a joint under {value_text(next(iter(scene.irregularity)))}"
        raise InputError("", "irregularity", found, "one DippedJoint under all wheelsets")
    joint = met[0]
    angle = 8.0 * joint.lowest / joint.length
    out = jenkins(scene.track, scene.vehicle, angle, V, scene.contact)
    each = []
    with progress_shown(progress, "runs"):
        for number, v in enumerate(V):
            report("runs", number, len(V))
            ahead = max(BEFORE * v + 0.5 * joint.length - joint.position, 0.0)
            placed = joint.moved(ceil(ahead / scene.track.spacing - 1e-9) * float(scene.track.spacing))
            last = min(getattr(scene.vehicle, "positions", (0.0,)))  # of the wheelset that meets the joint last
            duration = (placed.position + 0.5 * joint.length - last) / v + after
            record = simulate(scene.replaced({"speed": float(v), "duration": duration, "irregularity": placed}), method)
            losses = record.events.where(record.events.kind == "loss", drop=True)
            count = record.static_forces * 0 + losses.sizes["event"]
            if "wheelset" in record.static_forces.dims:
                count = xr.zeros_like(record.static_forces) + [
                    int((losses.wheelset == one).sum()) for one in record.static_forces.wheelset
                ]
            features = P1(placed.position)(record), second(record), largest_force()(record), count
            each.append(dict(zip(("P1", "P2", "largest_force", "losses"), features, strict=True)))
    for name in each[0]:
        out[name] = xr.concat([one[name] for one in each], "speed", combine_attrs="override").assign_attrs(
            _labels(name)
        )
    return out.assign_attrs(cutoff=float(as_quantity(cutoff, "cutoff", "frequency")), order=order)


def _labels(name: str) -> dict[str, str]:
    is_force = name != "losses"
    return {
        "units": "N" if is_force else "",
        "long_name": f"{MEANINGS[name]}, per wheelset" if is_force else MEANINGS[name],
    }


def _speeds(given: Speeds) -> NDArray[np.float64]:
    listed = given if isinstance(given, str) or np.ndim(given) else [given]
    return np.array(as_quantities(listed, "speed", "speed", 'a speed in m/s, or as "90 km/h", or a list of them'))
