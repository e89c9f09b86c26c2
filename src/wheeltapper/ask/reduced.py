"""The core model that is equivalent to one wheelset of a wagon, and the comparison of both responses.

The paper's claim (section 4): for contact vibrations a mass and a damper suffice; bogie and car body hardly move.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.track.deck import FloatingDeck
from wheeltapper.describe.vehicle.element import Damper, Spring
from wheeltapper.describe.vehicle.freight import CompressionSpring
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import LINEAR, OWN_LAW
from wheeltapper.lower.laws.own_law import indentation_under
from wheeltapper.march import run
from wheeltapper.record.arguments import as_scenario
from wheeltapper.record.labels import LABELS
from wheeltapper.record.record import Record

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]


def reduced(scenario: Scenario | str | Path, wheelset: int = 1) -> Scenario:
    """Return the scenario of the core model that is equivalent to one wheelset of a wagon.

    Mass, contacts and static contact force are those of the wheelset. Stiffness and damping are those of its vertical
    springs and dampers, whose other ends are fixed. Dry friction is left out; springs that only press and piecewise
    linear dampers are taken with their slopes at rest. x = 0 is the position of the wheelset at time zero.

    Parameters
    ----------
    scenario
        With a `Wagon`, or the path of its TOML file.
    wheelset
        Its number, from the leading one, 1.

    Raises
    ------
    InputError
        If there is no such wheelset, if its two wheels meet different irregularities, or if one of the irregularities
        has no place that could be moved.
    """
    scenario = as_scenario(scenario)
    run.choose(run.REDUCED, scenario.needs)
    wagon = scenario.vehicle
    wheelset = as_count(wheelset, "wheelset", 1, len(wagon.axles))
    items = scenario.irregularities_on(wheelset, "left")
    if items != scenario.irregularities_on(wheelset, "right"):
        raise InputError(
            "", "irregularity", f"other ones left than right on wheelset {wheelset}", "the same on both rails"
        )
    from wheeltapper.lower.wagon import lower_wagon

    axle, name = wagon.axles[wheelset - 1], f"wheelset {wheelset}"
    lowered = lower_wagon(scenario.replaced({"irregularity": None}))
    force = float(lowered.static_force[wheelset - 1].sum())
    constant = 2.0 * lowered.contact_constant
    held = [element for element in wagon.elements if name in element.between]
    stiffness = sum(element.stiffness[2] for element in held if isinstance(element, Spring))
    nests = [one for one in held if isinstance(one, CompressionSpring) and one.along == "z"]
    stiffness += sum(lowered.structure.slope_at_rest(one.name) for one in nests)
    damping = sum(element.slopes[2] for element in held if isinstance(element, Damper))
    contact = scenario.contact
    if OWN_LAW in scenario.needs:
        indentation = indentation_under(contact, force)
    elif LINEAR in scenario.needs:
        indentation = force / constant
    else:
        indentation = (force / constant) ** (2.0 / 3.0)
        loss = contact.hysteresis_factor or None
        contact = Hertz(constant=constant, curvature=contact.follows_curvature, hysteresis=loss)
    vehicle = Wheelset(
        mass=axle.mass,
        load=force + stiffness * indentation - axle.mass * wagon.gravity,
        stiffness=stiffness,
        damping=damping,
        radius=axle.radius,
        gravity=wagon.gravity,
    )
    return Scenario(
        vehicle=vehicle,
        track=_met_track(scenario, wheelset, axle.position),
        contact=contact,
        irregularity=tuple(item.moved(-axle.position) for item in items),
        rolling=scenario.rolling,
        speed=scenario.speed,
        duration=scenario.duration,
    )


def _met_track(scenario: Scenario, wheelset: int, position: float) -> Any:
    """Return the track that the wheelset meets."""
    from wheeltapper.describe.track.stiff import StiffTrack

    deck = scenario.track
    if not isinstance(deck, FloatingDeck) or deck.wheelset not in (None, wheelset):
        return StiffTrack()
    start = None if deck.start is None else deck.start - position
    return deck.model_copy(update={"wheelset": None, "start": start})


def compare_responses(record: Record, other: Record, wheelset: int = 1) -> xr.Dataset:
    """Return the differences between the response of one wheelset of a wagon and that of a core model.

    Parameters
    ----------
    record
        Record of a wagon.
    other
        Record of the core model.
    wheelset
        Number of the wheelset.

    Returns
    -------
    xarray.Dataset
        Over "peak": `peak_time` of the wheelset's left wheel and `peak_delay` (s) and `peak_ratio` against the other
        record, whose forces are those of two wheels; over "event": `event_time`, `event_delay`; over "impact":
        `interval` and `interval_ratio`. Only those that both records have.
    """
    import xarray as xr

    def own_peaks(table: xr.Dataset) -> xr.Dataset:
        chosen = (table.wheelset.values == wheelset) & (table.side.values == "left")
        return table.isel({next(iter(table.sizes)): chosen})

    peaks, events, impacts = own_peaks(record.peaks), own_peaks(record.events), own_peaks(record.impacts)

    def common_part(one: Any, two: Any) -> tuple[FloatArray, FloatArray]:
        count = min(len(one), len(two))
        return np.asarray(one.values[:count]), np.asarray(two.values[:count])

    time, time_other = common_part(peaks.time, other.peaks.time)
    force, force_other = common_part(2.0 * peaks.normal_force, other.peaks.normal_force)
    event, event_other = common_part(events.time, other.events.time)
    interval, interval_other = common_part(impacts.interval, other.impacts.interval)
    seconds = {"units": "s"}
    return xr.Dataset(
        {
            "peak_time": ("peak", time, seconds | {"long_name": LABELS["time"][1]}),
            "peak_delay": ("peak", time - time_other, seconds | {"long_name": "later than the other's peak"}),
            "peak_ratio": ("peak", force / force_other, {"units": "", "long_name": "force over the other's"}),
            "event_time": ("event", event, seconds | {"long_name": "loss or impact"}),
            "event_delay": ("event", event - event_other, seconds | {"long_name": "later than the other's event"}),
            "interval": ("impact", interval, seconds | {"long_name": LABELS["interval"][1]}),
            "interval_ratio": (
                "impact", interval / interval_other, {"units": "", "long_name": "interval over the other's"},
            ),
        },
        attrs={"wheelset": wheelset},
    )  # fmt: skip
