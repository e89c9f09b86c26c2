"""What draws what: by its kind, by the title of a dataset, or by the variables that only such a dataset has."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from wheeltapper.ground.errors import InputError, value_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROOT = "wheeltapper."
Draw = Callable[..., "Figure"]


class Drawer(NamedTuple):
    """The functions that draw one thing, and several of a kind together, as "module.function" of this room.

    `named`: whether the latter also takes the names that several have in a dictionary.
    """

    one: str
    several: str = ""
    named: bool = False


KINDS = {
    "ask.marks.Marks": Drawer("wear.draw_marks"),
    "describe.contact.base.Contact": Drawer("laws.draw_contact", "laws.draw_contacts"),
    "describe.creep.base.CreepLaw": Drawer("laws.draw_creep_law", "laws.draw_creep_laws"),
    "describe.irregularity.base.Irregularity": Drawer("irregularities.draw_irregularity"),
    "describe.profile.wheel_rail.Profiles": Drawer("profiles.draw_profiles"),
    "describe.scenario.Scenario": Drawer("scenarios.draw_scenario"),
    "describe.sensor.base.Sensor": Drawer("sites.draw_sensor"),
    "describe.site.Site": Drawer("sites.draw_site"),
    "describe.track.anomaly.Anomaly": Drawer("supports.draw_anomaly"),
    "describe.track.deck.FloatingDeck": Drawer("supports.draw_deck"),
    "describe.track.rail.Rail": Drawer("supports.draw_rail"),
    "describe.track.stiff.StiffTrack": Drawer("supports.draw_stiff"),
    "describe.track.supported.SupportedRail": Drawer("supports.draw_supported"),
    "describe.vehicle.base.Vehicle": Drawer("plane.draw_any_vehicle"),
    "describe.vehicle.body.Axle": Drawer("plane.draw_axle"),
    "describe.vehicle.body.Body": Drawer("plane.draw_body"),
    "describe.vehicle.element.Element": Drawer("laws.draw_element"),
    "diagnosis.axle_box.finding.AxleBoxFinding": Drawer("axle_boxes.draw_axle_box"),
    "diagnosis.detection.detection.Detection": Drawer("chances.draw_detection"),
    "diagnosis.detection.roc.FalseCalls": Drawer("chances.draw_false_calls"),
    "diagnosis.detection.roc.Roc": Drawer("chances.draw_roc"),
    "diagnosis.faults.base.Fault": Drawer("faults.draw_fault"),
    "diagnosis.finding.Finding": Drawer("findings.draw_finding"),
    "diagnosis.force.reconstruction.Force": Drawer("results.draw_force"),
    "diagnosis.inference.combinations.Combinations": Drawer("chances.draw_combinations"),
    "diagnosis.inference.estimate.Estimate": Drawer("chances.draw_estimate"),
    "diagnosis.inference.information.Information": Drawer("chances.draw_information"),
    "diagnosis.inference.problem.Prior": Drawer("faults.draw_prior"),
    "diagnosis.performance.Performance": Drawer("findings.draw_performance"),
    "diagnosis.site.design.Design": Drawer("findings.draw_design"),
    "diagnosis.site.neighbours.Condition": Drawer("faults.draw_condition"),
    "diagnosis.site.neighbours.Neighbour": Drawer("faults.draw_neighbour", "faults.draw_neighbours"),
    "diagnosis.gauges.design.GaugeDesign": Drawer("gauges.draw_gauge_design"),
    "diagnosis.gauges.growth.Growth": Drawer("gauges.draw_growth"),
    "diagnosis.gauges.performance.GaugePerformance": Drawer("gauges.draw_gauge_performance"),
    "diagnosis.gauges.finding.WheelFinding": Drawer("gauges.draw_wheel_finding"),
    "diagnosis.train.TrainFinding": Drawer("trains.draw_train", "trains.draw_trains"),
    "orbits.orbit.Orbit": Drawer("orbits.draw_orbit"),
    "record.limits.comparison.LimitCheck": Drawer("joints.draw_limits"),
    "record.limits.rule.Rule": Drawer("joints.draw_rule"),
    "record.record.Record": Drawer("records.draw_record", "results.draw_records"),
    "record.recordings.recording.Recording": Drawer("results.draw_recording", "results.draw_recordings", named=True),
}
"""By the class, or one that it is made of."""
TITLES = {
    "wheeltapper border": Drawer("charts.draw_border_alone"),
    "wheeltapper branch": Drawer("orbits.draw_branch", "orbits.draw_branches", named=True),
    "wheeltapper chart": Drawer("charts.draw_chart_of_all"),
    "wheeltapper conicity": Drawer("profiles.draw_conicity", "profiles.draw_conicities"),
    "wheeltapper decay rate": Drawer("tracks.draw_decay"),
    "wheeltapper fates": Drawer("orbits.draw_fates"),
    "wheeltapper imitation": Drawer("findings.draw_imitation"),
    "wheeltapper joint": Drawer("joints.draw_joint"),
    "wheeltapper limit cycles": Drawer("vehicles.draw_limit_cycles", "vehicles.draw_several_limit_cycles", named=True),
    "wheeltapper pinned-pinned frequency": Drawer("tracks.draw_pinned"),
    "wheeltapper ramp": Drawer("orbits.draw_ramp", "orbits.draw_ramps", named=True),
    "wheeltapper receptance": Drawer("tracks.draw_receptance"),
    "wheeltapper returns": Drawer("orbits.draw_returns", "orbits.draw_several_returns", named=True),
    "wheeltapper static deflection": Drawer("tracks.draw_static"),
    "wheeltapper trace": Drawer("orbits.draw_trace", "orbits.draw_traces"),
    "wheeltapper wear": Drawer("wear.draw_wear"),
}
"""By the title of a dataset."""
HELD = (
    ({"damping_ratio", "shape", "centre"}, Drawer("vehicles.draw_modes", "vehicles.draw_modes_over_speed")),
    ({"weighted_acceleration", "mean_comfort"}, Drawer("results.draw_comfort")),
    ({"derailment_quotient", "statistic"}, Drawer("ride.draw_running_safety")),
    ({"derailment_quotient", "unloading"}, Drawer("ride.draw_guidance")),
    ({"relative_imbalance", "kinetic"}, Drawer("ride.draw_energy")),
    ({"compression_rate", "element"}, Drawer("ride.draw_suspension_events")),
    ({"indentation_rate", "kind"}, Drawer("ride.draw_events")),
    ({"closing_speed", "force_ratio"}, Drawer("ride.draw_impacts")),
    ({"normal_force", "corner"}, Drawer("ride.draw_peaks")),
    ({"normal_force", "indentation", "time"}, Drawer("ride.draw_history")),
    ({"rail_shear", "rail"}, Drawer("ride.draw_readings")),
    ({"pad_force", "seat"}, Drawer("ride.draw_readings")),
    ({"time", "kind", "side"}, Drawer("ride.draw_damper_events")),
)  # fmt: skip
"""By the variables of a dataset; the first that it has all of."""
ALLOWED = "a Record, a chart, an evolution, marks, a finding or the like, a noun, or several of a kind"


def drawer_of(what: Any) -> Draw:
    """Return the function that draws a noun, a result, or several of a kind.

    Raises
    ------
    InputError
        If there is none.
    """
    found = _drawer_of_one(what)
    if found is not None:
        return _function(found.one)
    names, items = (list(what), list(what.values())) if isinstance(what, dict) else ((), what)
    if isinstance(items, list | tuple):
        drawer = _drawer_of_several(items)
        draw, known = _function(drawer.several), {"names": names} if names and drawer.named else {}
        return lambda _: draw(items, **known)
    raise InputError("", "what", value_text(what), ALLOWED)


def is_drawn_by(what: Any, *names: str) -> bool:
    """Return whether something is of one of these kinds or titles."""
    return any(name in names for name in _names_of(what))


def _drawer_of_several(what: Any) -> Drawer:
    found = [_drawer_of_one(item) for item in what]
    if not found:
        raise InputError("", "what", "an empty list", "1 or more of a kind")
    for number, drawer in enumerate(found):
        if drawer is None or not drawer.several or drawer != found[0]:
            kinds = (
                "Records, Recordings, trains, neighbours, laws of contact or creep, modes at rising speeds, or "
                "branches, diagrams, ramps or borders of orbits"
            )
            raise InputError("", f"what.{number}", value_text(what[number]), f"in a list several of a kind: {kinds}")
    assert found[0] is not None
    return found[0]


def _drawer_of_one(what: Any) -> Drawer | None:
    by_name = KINDS | TITLES
    found = next((by_name[name] for name in _names_of(what) if name in by_name), None)
    if found is None:
        held = set(getattr(what, "variables", ()))
        found = next((drawer for needed, drawer in HELD if needed <= held), None)
    return found


def _names_of(what: Any) -> Iterator[str]:
    """Yield the names by which something may be listed: its title, its class, and those that it is made of."""
    attributes = getattr(what, "attrs", None)
    if isinstance(attributes, dict):
        yield str(attributes.get("title"))
    for kind in type(what).__mro__:
        yield f"{kind.__module__}.{kind.__qualname__}".removeprefix(ROOT)


def _function(name: str) -> Draw:
    module, _, function = name.rpartition(".")
    found: Draw = getattr(import_module(f"{ROOT}faces.{module}"), function)
    return found
