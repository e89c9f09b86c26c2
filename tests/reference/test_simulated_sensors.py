"""What sensors read of a run, against a finite-element track of another program, and against statics."""

import numpy as np
import pytest

import wheeltapper as wt
from tests.wayside import (
    BALLAST,
    BALLAST_DAMPING,
    BENDING,
    GAUGE,
    HERTZ,
    MASS,
    PAD,
    PAD_DAMPING,
    RADIUS,
    RAIL_MASS,
    SLEEPER,
    SPACING,
    Line,
    Wheel,
)
from wheeltapper.diagnosis import Site, measure_trains

pytestmark = pytest.mark.filterwarnings("ignore:track.rail.shear_stiffness")
LOAD, SPEED, RATE = 1e5, 20.0, 10e3
RAIL = wt.tracks.Rail(bending_stiffness=BENDING, shear_stiffness=1e10, mass_per_length=RAIL_MASS, damping=1e-6)
TRACK = wt.tracks.Ballasted(
    rail=RAIL, spacing=SPACING, pad_stiffness=PAD, pad_damping=PAD_DAMPING, sleeper_mass=SLEEPER,
    ballast_stiffness=BALLAST, ballast_damping=BALLAST_DAMPING,
)  # fmt: skip
WHEEL = wt.Wheelset(mass=MASS, load=LOAD, gravity=0.0, stiffness=0.0, damping=0.0, wheels=1, radius=RADIUS)


def run(way, speed=SPEED, **fields):
    return wt.simulate(
        wt.Scenario(
            vehicle=WHEEL, track=TRACK, contact=wt.Hertz(constant=HERTZ), speed=speed, duration=way / speed, **fields
        )
    )


def averaged_gauges(x1, x2):
    """Return pairs of gauges about x1 and x2, of which the mean is that of gauges as long as those of the line."""
    shifts = GAUGE * (np.arange(9) - 4.0) / 9.0
    return [wt.sensors.RailShearForce(name=f"{i}", x1=x1 + d, x2=x2 + d, rate=RATE) for i, d in enumerate(shifts)]


def apart_from_finite_elements(flat, way=7.0):
    """Return by how much readings differ, over the load: (largest reading, rms) of a pair, a pad, a sleeper."""
    line = Line([("pair", 4.3, 4.7), ("pad", 4.8), ("sleeper", 4.8)])
    other = line.passages([Wheel(LOAD, flat=flat)], SPEED, RATE)
    item = None if flat is None else wt.WheelFlat(length=flat[0], position=flat[1], repeat=False)
    seats = (
        wt.sensors.PadForce(name="pad", seat=8, rate=RATE),
        wt.sensors.SleeperForce(name="sleeper", x=4.8, rate=RATE),
    )
    found = run(way, irregularity=item, rolling="circle").recordings([*averaged_gauges(4.3, 4.7), *seats])
    x = SPEED * found["pad"].times
    inside = (x > 3.0) & (x < 6.0)
    pair = np.mean([found[f"{i}"].samples for i in range(9)], axis=0)
    out = []
    for mine, theirs in zip((pair, found["pad"].samples, found["sleeper"].samples), other.readings[0], strict=True):
        a, b = mine[inside] / LOAD, np.interp(x[inside], other.x, theirs) / LOAD
        out.append((abs(a.max() - b.max()), np.sqrt(np.mean((a - b) ** 2))))
    return out


def test_readings_of_a_smooth_wheel_are_those_of_finite_elements():
    pair, pad, sleeper = apart_from_finite_elements(None)
    assert max(pad) < 2e-3
    assert max(sleeper) < 2e-3
    assert pair[0] < 1e-3
    assert pair[1] < 0.015  # nine gauges stand for the mean over a length: steps on both flanks of the pulse


@pytest.mark.slow
def test_readings_of_a_flat_are_those_of_finite_elements():
    """A fresh flat of 40 mm strikes in a crib between two gauges: 2.6 times the load, 0.8 times at the next pad."""
    pair, pad, sleeper = apart_from_finite_elements((0.04, 4.55))
    assert pad[0] < 6e-3
    assert pad[1] < 2e-3
    assert max(sleeper) < 1e-3
    assert pair[0] < 0.02
    assert pair[1] < 0.015


def test_a_wheel_at_rest_weighs_the_same_on_all_sensors():
    """In a crib it stands between the gauges; on a seat all that goes into the ballast is its load."""
    vehicle = wt.Wheelset(mass=MASS, load=2 * LOAD, gravity=0.0, stiffness=0.0, damping=0.0, wheels=2, radius=RADIUS)
    record = wt.simulate(
        wt.Scenario(vehicle=vehicle, track=TRACK, contact=wt.Hertz(constant=2 * HERTZ), speed=0.0, duration=0.01)
    )
    gauges = wt.sensors.RailShearForce(name="gauges", x1=-0.2, x2=0.2), wt.sensors.PadForce(name="own", seat=0)
    weighed = wt.sensors.ContactForce(name="contact", x1=-0.2, x2=0.2)
    under = [wt.sensors.SleeperForce(name=f"sleeper {i}", seat=i) for i in range(-20, 21)]
    sunk = wt.sensors.SleeperDisplacement(name="sunk", seat=0)
    found = {name: one.samples[-1] for name, one in record.recordings([*gauges, weighed, *under, sunk]).items()}
    assert found["contact"] == pytest.approx(LOAD, rel=1e-6)
    assert found["gauges"] + found["own"] == pytest.approx(LOAD, rel=1e-3)  # the seat between them carries the rest
    assert sum(found[f"sleeper {i}"] for i in range(-20, 21)) == pytest.approx(LOAD, rel=2e-3)
    assert found["sunk"] == pytest.approx(-found["sleeper 0"] / BALLAST, rel=1e-6)


def test_a_reading_as_the_wheel_passes_its_place_is_the_one_just_before():
    """The field around a wheel has a kink under it, and the shear force a jump: no slope is taken across them."""
    scene = wt.Scenario(vehicle=WHEEL, track=TRACK, contact=wt.Hertz(constant=HERTZ), speed=20.0, duration=0.07)
    read = wt.simulate(scene).track(1e5, rail=[1.1], seat=[2])
    for name, at in (("rail_shear", 5500), ("pad_force", 6000)):
        before, there = read[name].values[[at - 4, at], 0]
        assert there == pytest.approx(before, rel={"rail_shear": 5e-3, "pad_force": 5e-4}[name]), name
    assert abs(np.diff(read.rail_shear.values[[5500, 5501], 0])[0]) == pytest.approx(LOAD, rel=0.02)


def test_a_simulated_train_is_measured_as_it_was_loaded():
    """Two wheelsets pass three pairs of gauges; what their simulated recordings give are their loads and speed."""
    vehicle = wt.vehicles.Wheelsets(
        wheelsets=(WHEEL, WHEEL.model_copy(update={"load": 0.6 * LOAD})), positions=(0.0, -2.4)
    )
    scene = wt.Scenario(
        vehicle=vehicle, track=TRACK, contact=wt.Hertz(constant=HERTZ), speed=SPEED, duration=0.7, rolling="point"
    )
    pairs = [
        wt.sensors.RailShearForce(name=f"{k}", x1=0.6 * k + 0.1, x2=0.6 * k + 0.5, gain=1.0 + 0.1 * k, rate=RATE)
        for k in (6, 9, 10)
    ]
    site = Site(sensors=[*pairs, wt.sensors.SleeperDisplacement(name="sunk", seat=8, rate=RATE)], spacing=SPACING)
    (train,) = measure_trains(wt.simulate(scene).recordings(site), site)
    loads = [axle["wheels"][0]["static_force"] for axle in train.axles]
    np.testing.assert_allclose(loads, [LOAD, 0.6 * LOAD], rtol=0.01)
    np.testing.assert_allclose([axle["speed"] for axle in train.axles], SPEED, rtol=0.02)
    assert train.axles[1]["place"] == pytest.approx(2.4, abs=0.05)
    assert "no sensors of forces: not used, whether recorded or not: 'sunk'" in train.notes


def test_a_sites_seats_count_from_its_own_zero():
    """A run's seats count from its first sleeper; a site's seat lies at its number times the spacing."""
    shifted = TRACK.model_copy(update={"first_sleeper": 1.2})
    record = wt.simulate(
        wt.Scenario(vehicle=WHEEL, track=shifted, contact=wt.Hertz(constant=HERTZ), speed=SPEED, duration=0.1)
    )
    pad = wt.sensors.PadForce(name="pad", seat=3, rate=RATE)
    of_site = record.recordings(Site(sensors=[pad], spacing=SPACING))["pad"].samples
    np.testing.assert_array_equal(of_site, record.recordings(pad.model_copy(update={"seat": 1}))["pad"].samples)
    with pytest.raises(wt.InputError, match=r"^rate: found 1e\+15 per second"):
        record.recordings(wt.sensors.ContactForce(x1=0.0, x2=1.0, rate=1e15))


def test_sensors_of_both_rails_below_a_wagon_read_their_own_side():
    coach = wt.Scenario.from_toml("examples/coach_on_ballast.toml")
    held = {name: getattr(coach, name) for name in ("vehicle", "contact", "track", "creep", "speed")}
    bump = {"right": [wt.CosineBump(height=1e-4, length=0.1, start=0.1)]}
    record = wt.simulate(wt.Scenario(**held, irregularity=bump, duration=0.02))
    sides = {side: wt.sensors.ContactForce(x1=-0.5, x2=1.0, side=side, rate=5e3) for side in ("left", "right")}
    found = {side: record.recordings(one)["contact force"].samples for side, one in sides.items()}
    force = record.history("5 kHz").vertical_force.sel(wheelset=1)
    for side, samples in found.items():
        np.testing.assert_allclose(samples, force.sel(side=side), rtol=1e-12)
    assert np.ptp(found["right"]) > 3.0 * np.ptp(found["left"])
    with pytest.raises(wt.InputError, match=r"^side: found none, of a run in which the rails differ"):
        record.recordings(wt.sensors.PadForce(seat=0))
