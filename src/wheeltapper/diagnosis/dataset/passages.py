"""Passages of a data set: what is drawn for each, its runs, its readings and its labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.computed import COMPLETE, REFUSED, STATUS
from wheeltapper.ask.study import wheel_axes_of
from wheeltapper.describe.placement import SIDES, Placement
from wheeltapper.describe.scenario import Scenario
from wheeltapper.describe.sensor.base import Sensor
from wheeltapper.describe.vehicle.wheelset import Wheelset
from wheeltapper.diagnosis.dataset.plan import OF_SENSORS, DatasetPlan
from wheeltapper.diagnosis.faults.base import Fault, fault_named
from wheeltapper.diagnosis.site.neighbours import ends_of
from wheeltapper.ground.errors import InputError
from wheeltapper.ground.needs import SEVERAL_BODIES
from wheeltapper.ground.notes import Note
from wheeltapper.ground.outcome import Outcome
from wheeltapper.ground.warned import warn_of
from wheeltapper.record.record import Record
from wheeltapper.record.recordings.simulated import recordings
from wheeltapper.record.simulate import simulated_quietly
from wheeltapper.record.trains.of_record import trains_of

FloatArray = NDArray[np.float64]


class Own(NamedTuple):
    """What is drawn for one vehicle of a passage.

    Attributes
    ----------
    distance
        Behind the first vehicle, m.
    condition
        Its place among the plan's conditions.
    size, place
        Of its fault; NaN without one.
    wheel
        The wheel with the fault, as numbers along `wheel_axes_of`; -1 without one.
    drawn
        Drawn values by path.
    """

    distance: float
    condition: int
    size: float
    place: float
    wheel: tuple[int, ...]
    drawn: dict[str, float]


class Passage(NamedTuple):
    """One passage: its status, part, readings by sensor, drawn values, vehicles, and (features, vehicles, wheels)."""

    status: int
    part: int
    readings: dict[str, FloatArray]
    drawn: dict[str, float]
    vehicles: tuple[Own, ...]
    features: FloatArray


def passage_of(plan: DatasetPlan, number: int) -> Passage:
    """Compute a passage; one that no run completes has a status that says why, and no readings."""
    part = int(_random(plan, number, "part").choice(len(plan.parts), p=plan.part_shares))
    drawn = {row.path: row.draw.drawn(_random(plan, number, row.path)) for row in plan.rows if not row.per_vehicle}
    speed = drawn.get("speed", float(plan.scenario.speed))
    behind = samples_behind(plan, speed)
    apart = [late * speed / float(plan.sensors[0].rate) for late in behind]
    vehicles = tuple(_drawn_vehicle(plan, number, i, distance) for i, distance in enumerate(apart))
    wheels = int(np.prod([len(names) for names in wheel_axes_of(plan.scenario.vehicle).values()], initial=1))
    features = np.full((len(plan.labels), len(vehicles), wheels), np.nan)
    status, readings = COMPLETE, dict[str, FloatArray]()
    for i, (own, late) in enumerate(zip(vehicles, behind, strict=True)):
        try:
            record = simulated_quietly(scenario_of(plan, drawn, own), plan.method)
        except InputError:
            status = REFUSED
            break
        if record.outcome is not Outcome.COMPLETED:
            status = STATUS.index(record.outcome.name.lower())
            break
        _add_readings(readings, record, plan.changed_sensors(drawn), late, _seed(plan, number, f"noise {i}"))
        trains = trains_of(record, any(feature.tally for feature in plan.labels))
        for row, feature in zip(features, plan.labels, strict=True):
            row[i] = np.ravel(record._per_wheel(feature._of_trains(trains), {}))
    if status != COMPLETE:
        features[:], readings = np.nan, {}
    for name in readings:
        if plan.noises.get(name):
            white = _random(plan, number, f"noise of {name}").standard_normal(len(readings[name]))
            readings[name] = readings[name] + plan.noises[name] * white
    return Passage(status, part, readings, drawn, vehicles, features)


def check_plan(plan: DatasetPlan) -> None:
    """Refuse a plan whose scenario does not run as stated, with a sensor that reads nothing, or an impossible fault."""
    scenario, wheel = timed(plan, plan.scenario), tuple(0 for _ in wheel_axes_of(plan.scenario.vehicle))
    recordings(simulated_quietly(scenario, plan.method), plan.sensors)
    own = ", ".join(type(item).__name__ for item in scenario.irregularities if item.borne == "wheel")
    if own and any(one.fault is None for one in plan.conditions):
        warn_of([Note(f"vehicles labelled healthy have the scenario's own {own} on their wheels", doubtful=True)])
    for condition in plan.conditions:
        fault, size, place = condition.drawn(np.random.default_rng(0))
        if fault is None or size is None or place is None:
            continue
        try:
            for end in ends_of(fault.usual if condition.size is None else condition.size):
                faulty = with_fault(scenario, fault, end, place, wheel)
                if faulty == scenario:
                    found = f"a size of {end:g}, which changes nothing here"
                    raise InputError("", "size", found, "a fault of what the vehicle has")
                simulated_quietly(faulty, plan.method)
        except InputError as error:
            raise error.within(f"faults.{condition.label}") from None


def samples_behind(plan: DatasetPlan, speed: float) -> tuple[int, ...]:
    """Return by how many samples each vehicle comes behind the first one."""
    rate = float(plan.sensors[0].rate)
    return tuple(round(float(distance) * rate / speed) if distance else 0 for distance in plan.vehicles)


def _add_readings(
    readings: dict[str, FloatArray], record: Record, sensors: Sequence[Sensor], late: int, seed: int
) -> None:
    """Add what sensors read of a vehicle that comes `late` samples behind the first one."""
    for name, found in recordings(record, sensors, seed).items():
        whole = np.zeros(max(len(readings.get(name, ())), late + len(found.samples)))
        whole[: len(readings.get(name, ()))] = readings.get(name, ())
        whole[late : late + len(found.samples)] += found.samples
        readings[name] = whole


def _drawn_vehicle(plan: DatasetPlan, number: int, vehicle: int, distance: float) -> Own:
    rows = [row for row in plan.rows if row.per_vehicle]
    drawn = {row.path: row.draw.drawn(_random(plan, number, row.path, vehicle)) for row in rows}
    random = _random(plan, number, "fault", vehicle)
    condition = int(random.choice(len(plan.conditions), p=plan.shares))
    fault, size, place = plan.conditions[condition].drawn(random)
    axes = wheel_axes_of(plan.scenario.vehicle)
    if fault is None or size is None or place is None:
        return Own(distance, condition, np.nan, np.nan, tuple(-1 for _ in axes), drawn)
    wheel = tuple(int(random.integers(len(names))) for names in axes.values())
    return Own(distance, condition, size, place, wheel, drawn)


def scenario_of(plan: DatasetPlan, drawn: Mapping[str, float], own: Own) -> Scenario:
    """Return the scenario of one vehicle of a passage, with its fault.

    Raises
    ------
    InputError
        If there is no scenario with these values.
    """
    values = {path: value for path, value in drawn.items() if not path.startswith(OF_SENSORS)} | own.drawn
    scenario = timed(plan, plan.scenario.replaced(values) if values else plan.scenario)
    fault = plan.conditions[own.condition].fault
    return scenario if fault is None else with_fault(scenario, fault_named(fault), own.size, own.place, own.wheel)


def timed(plan: DatasetPlan, scenario: Scenario) -> Scenario:
    """Return a scenario that ends where the plan's `way` does."""
    return scenario if plan.way is None else scenario.replaced({"duration": float(plan.way) / float(scenario.speed)})


def with_fault(scenario: Scenario, fault: Fault, size: float, place: float, wheel: tuple[int, ...]) -> Scenario:
    """Return a scenario with a fault, on one wheel of a vehicle that has several.

    Raises
    ------
    InputError
        If a vehicle with several wheels has a fault that is no irregularity of a tread.
    """
    if not wheel:
        return fault.passage(scenario, size, place)
    vehicle = scenario.vehicle
    radius = vehicle.axles[wheel[0]].radius if SEVERAL_BODIES in vehicle.needs else vehicle.radius
    alone = Scenario(
        vehicle=Wheelset(mass=1500, load=1e5, radius=radius), speed=scenario.speed, duration=scenario.duration
    )
    faulty = fault.passage(alone, size, place)
    if not faulty.irregularity or faulty.replaced({"irregularity": ()}) != alone:
        raise InputError("", "faults", repr(fault.name), "faults of treads, on a vehicle with several wheelsets")
    items = scenario.irregularity
    placed = dict(items) if isinstance(items, Placement) else {"both": items} if items else {}
    names = [f"wheelset {wheel[0] + 1}", *(SIDES[side] for side in wheel[1:])]
    where = " ".join(names)
    placed[where] = (*placed.get(where, ()), *faulty.irregularity)
    return scenario.replaced({"irregularity": placed})


def _seed(plan: DatasetPlan, number: int, what: str) -> int:
    return int(np.random.SeedSequence([plan.seed, number, crc32(what.encode())]).generate_state(1)[0])


def _random(plan: DatasetPlan, number: int, what: str, vehicle: int = 0) -> np.random.Generator:
    """Return what draws one thing of a passage, which does not depend on what else is drawn."""
    return np.random.default_rng([plan.seed, number, vehicle, crc32(what.encode())])


def longest(plan: DatasetPlan) -> dict[float, int]:
    """Return the largest number of samples of a passage, by rate."""
    ends = {row.path: row.draw.ends for row in plan.rows}
    longest_run = ends.get("duration", (0.0, float(plan.scenario.duration)))[1]
    until = longest_run if plan.way is None else float(plan.way) / plan.slowest
    late = max(samples_behind(plan, plan.slowest))
    rates = dict.fromkeys(float(one.rate) for one in plan.sensors)
    return {rate: int(np.floor(until * rate * (1.0 + 1e-12))) + 1 + late for rate in rates}
