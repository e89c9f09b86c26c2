"""What sensors read of a run, against a finite-element track of another program, and against statics."""

import numpy as np
import pytest
from scipy.linalg import cho_solve_banded
from scipy.signal import butter, sosfiltfilt

import wheeltapper as wt
from tests.finite_rail import CONSTANT, STEP, FiniteRail, Newmark
from tests.finite_rail import LOAD as FINITE_LOAD
from tests.finite_rail import TRACK as FINITE_TRACK
from tests.finite_rail import WHEEL as FINITE_WHEEL
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


@pytest.mark.slow
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


@pytest.mark.slow
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
    others = [
        wt.sensors.SleeperDisplacement(name="sunk", seat=8, rate=RATE),
        wt.sensors.RailStrain(name="bent", x=4.5, rate=RATE),
        wt.sensors.SleeperAcceleration(name="shaken", seat=8, rate=RATE),
    ]
    site = Site(sensors=[*pairs, *others], spacing=SPACING)
    (train,) = measure_trains(wt.simulate(scene).recordings(site), site)
    loads = [axle["wheels"][0]["static_force"] for axle in train.axles]
    np.testing.assert_allclose(loads, [LOAD, 0.6 * LOAD], rtol=0.01)
    np.testing.assert_allclose([axle["speed"] for axle in train.axles], SPEED, rtol=0.02)
    assert train.axles[1]["place"] == pytest.approx(2.4, abs=0.05)
    assert "no sensors of forces: not used, whether recorded or not: 'sunk', 'bent', 'shaken'" in train.notes


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


@pytest.mark.slow
def test_sensors_of_both_rails_below_a_wagon_read_their_own_side():
    coach = wt.Scenario.from_toml("examples/coach_on_ballast.toml")
    held = {name: getattr(coach, name) for name in ("vehicle", "contact", "track", "creep", "speed")}
    bump = {"right": [wt.CosineBump(height=1e-4, length=0.1, start=0.1)]}
    record = wt.simulate(wt.Scenario(**held, irregularity=bump, duration=0.02))
    exact = {"rate": 5e3, "anti_alias": False}
    sides = {side: wt.sensors.ContactForce(x1=-0.5, x2=1.0, side=side, **exact) for side in ("left", "right")}
    found = {side: record.recordings(one)["contact force"].samples for side, one in sides.items()}
    force = record.history("5 kHz").vertical_force.sel(wheelset=1)
    for side, samples in found.items():
        np.testing.assert_allclose(samples, force.sel(side=side), rtol=1e-12)
    assert np.ptp(found["right"]) > 3.0 * np.ptp(found["left"])
    with pytest.raises(wt.InputError, match=r"^side: found none, of a run in which the rails differ"):
        record.recordings(wt.sensors.PadForce(seat=0))


# -- strains and accelerations ----------------------------------------------------------------------------------------

PLACES = np.array([0.0, 0.05, 0.15, 0.3, 0.45, 0.6, 0.9, 1.2, 1.5])


def strains_at_rest(at, places):
    """Return strains of the foot and forces of the pads, by their seats, under a wheel at rest at x = `at`."""
    shifted = TRACK.model_copy(update={"first_sleeper": -at})
    record = wt.simulate(
        wt.Scenario(vehicle=WHEEL, track=shifted, contact=wt.Hertz(constant=HERTZ), speed=0.0, duration=0.01)
    )
    gauges = [wt.sensors.RailStrain(name=f"{x:.9g}", x=x - at) for x in places]
    pads = [wt.sensors.PadForce(name=f"pad {i}", seat=i) for i in range(-20, 21)]
    found = {name: one.samples[-1] for name, one in record.recordings([*gauges, *pads]).items()}
    strains = np.array([found[one.name] for one in gauges])
    return strains, {i: found[f"pad {i}"] for i in range(-20, 21)}


@pytest.mark.parametrize("at", [0.0, 0.2, 0.3])
def test_a_strain_at_rest_is_that_of_the_bending_moment(at):
    """The rail ahead of a cut is in equilibrium: pads and the wheel give its moment M, and ε = M·e/EI."""
    strains, pads = strains_at_rest(at, PLACES)
    moments = [
        sum(force * (SPACING * seat - x) for seat, force in pads.items() if SPACING * seat > x)
        - LOAD * max(at - x, 0.0)
        for x in PLACES
    ]
    expected = np.array(moments) * RAIL.foot_distance / BENDING
    np.testing.assert_allclose(strains, expected, atol=2e-5 * np.abs(expected).max())
    assert strains[np.abs(PLACES - at).argmin()] > 1e-4  # tension below the wheel
    assert strains[PLACES - at >= 0.9].max() < 0.0  # and compression where the rail lifts


def test_a_strain_at_rest_is_that_of_finite_elements():
    rail, node = FiniteRail(FINITE_TRACK, 60, 48), FINITE_TRACK.spacing / 48
    force = np.zeros(rail.size)
    at = rail.load_at(0.0)[0]
    force[at[0]] = FINITE_LOAD
    turned = cho_solve_banded(rail.factor(rail.stiffness), force)[rail.deflections + 1]
    first = round(-rail.start / node)
    steps = np.array([-30, -12, 0, 6, 24, 36, 60])
    slope = (turned[first + steps + 1] - turned[first + steps - 1]) / (2.0 * node)
    record = wt.simulate(
        wt.Scenario(
            vehicle=FINITE_WHEEL, track=FINITE_TRACK, contact=wt.Hertz(constant=CONSTANT), speed=0.0, duration=0.01
        )
    )
    gauges = [wt.sensors.RailStrain(name=str(k), x=float(k * node)) for k in steps]
    found = np.array([one.samples[-1] for one in record.recordings(gauges).values()])
    expected = -FINITE_TRACK.rail.foot_distance * slope
    np.testing.assert_allclose(found, expected, atol=2e-2 * np.abs(expected).max())
    away = steps != 0  # below the load the moment has a kink
    np.testing.assert_allclose(found[away], expected[away], atol=2e-3 * np.abs(expected).max())


@pytest.mark.slow
def test_gauge_and_accelerometers_read_what_finite_elements_do():
    """A dip of the rail. Linear elements answer nodes with ripples of 2.4 kHz; accelerations are compared to 1 kHz."""
    speed, duration, x, seat, before = 30.0, 0.06, 2.1, 3, 0.9
    run, seen = Newmark(FiniteRail(FINITE_TRACK, 60, 48), speed), []
    node = round((x - run.rail.start) / run.rail.length)
    place, turns = run.rail.deflections[node], run.rail.deflections[[node - 1, node + 1]] + 1
    sleeper = run.rail.deflections[round((seat * FINITE_TRACK.spacing - run.rail.start) / run.rail.length)] + 2
    dip = wt.CosineBump(height=-1.5e-3, length=1.0, start=before)
    for number in range(1, round(duration / STEP) + 1):
        rolled = speed * number * STEP - before
        height = -0.75e-3 * (1.0 - np.cos(2.0 * np.pi * rolled)) if 0.0 < rolled < 1.0 else 0.0
        run.begin()
        run.end(run.force_on(run.free, height), run.free)
        bend = (run.u[turns[0]] - run.u[turns[1]]) / (2.0 * run.rail.length)
        fallen = run.wheel[2]
        seen.append((FINITE_TRACK.rail.foot_distance * bend, -run.a[place], -run.a[sleeper], -fallen))
    record = wt.simulate(
        wt.Scenario(
            vehicle=FINITE_WHEEL, track=FINITE_TRACK, contact=wt.Hertz(constant=CONSTANT), irregularity=dip,
            speed=speed, duration=duration, rolling="point",
        ),
        "strict",
    )  # fmt: skip
    rate = 1.0 / STEP
    found = record.recordings(
        [
            wt.sensors.RailStrain(name="strain", x=x, rate=rate),
            wt.sensors.RailAcceleration(name="rail", x=x, rate=rate),
            wt.sensors.SleeperAcceleration(name="sleeper", seat=seat, rate=rate),
            wt.sensors.AxleBoxAcceleration(name="axle box", rate=rate),
        ]
    )
    quiet, compared = butter(4, 1e3, fs=rate, output="sos"), slice(1500, -1000)
    limits = {"strain": 2e-3, "rail": 1e-2, "sleeper": 2e-3, "axle box": 5e-3}
    for (name, limit), theirs in zip(limits.items(), np.array(seen).T, strict=True):
        pair = np.stack([found[name].samples[1 : len(seen) + 1], theirs])
        mine, other = (pair if name == "strain" else sosfiltfilt(quiet, pair))[:, compared]
        assert np.abs(mine - other).max() < limit * np.abs(other).max(), name


def spectrally_filtered(fine, times, cutoff):
    """Return samples `times` as often without what a filter of order 8 takes away, by Fourier's integral."""
    spectrum = np.fft.rfft(np.concatenate([fine, fine[::-1]]))
    over = np.fft.rfftfreq(2 * len(fine), 1.0 / (times * 5e3)) / cutoff
    return np.fft.irfft(spectrum / (1.0 + (np.sqrt(2.0) - 1.0) * over**8))[: len(fine) : times]


@pytest.mark.slow
def test_recorders_filter_before_they_sample():
    """A strike lasts less than a sample of 5 kHz. Sampled at 80 kHz it is filtered by its spectrum."""
    flat = run(4.0, 30.0, irregularity=wt.WheelFlat(length=0.04, position=2.0, shape="fresh"))

    def read(rate, **filtered):
        own = {"rate": rate, **filtered}
        sensors = [
            wt.sensors.AxleBoxAcceleration(name="box", **own), wt.sensors.RailAcceleration(name="rail", x=2.3, **own),
            wt.sensors.PadForce(name="pad", seat=4, **own), wt.sensors.RailStrain(name="strain", x=2.1, **own),
        ]  # fmt: skip
        return {name: one.samples for name, one in flat.recordings(sensors).items()}

    whole, raw = read(80e3, anti_alias=False), read(5e3, anti_alias=False)
    for stated, cutoff in (({}, 2e3), ({"anti_alias": "1 kHz"}, 1e3)):
        for name, samples in read(5e3, **stated).items():
            true = spectrally_filtered(whole[name], 16, cutoff)
            inside = slice(20, -20)
            assert np.abs(samples - true)[inside].max() < 0.012 * np.ptp(true), name
            if name in ("box", "rail"):
                assert np.abs(raw[name] - true)[inside].max() > 0.05 * np.ptp(true), name


def test_a_filter_changes_nothing_that_is_slow():
    """A wheel without a flaw; the places of gauges, where a pair's reading jumps, are not slow."""
    rolled = run(4.0)
    own = [wt.sensors.PadForce(name="pad", seat=4), wt.sensors.SleeperDisplacement(name="sleeper", seat=3)]
    pair = wt.sensors.RailShearForce(name="pair", x1=2.1, x2=2.5)
    recorders = ({"rate": 5e3, "anti_alias": filtered} for filtered in (True, False))
    filtered, raw = (rolled.recordings([one.model_copy(update=its) for one in (*own, pair)]) for its in recorders)
    x = SPEED * np.arange(len(raw["pair"].samples)) / 5e3
    away = np.minimum(abs(x - 2.1), abs(x - 2.5)) > 0.06
    for name, one in raw.items():
        used = away if name == "pair" else x > 0.0
        assert np.abs(filtered[name].samples - one.samples)[used].max() < 2e-3 * np.ptp(one.samples), name


def test_an_axle_box_accelerates_as_newton_says():
    """Without a suspension m·a = N - load - m·g, in contact and in flight; of two wheelsets each has its own."""
    one = wt.Wheelset(mass=1200.0, load=5e4, stiffness=0.0, damping=0.0)
    two = wt.vehicles.Wheelsets(wheelsets=(one, one.model_copy(update={"mass": 900.0})), positions=(0.0, -0.4))
    bump = wt.CosineBump(height=4e-4, length=0.1, start=0.2)
    shared = {"contact": wt.Hertz(constant=1.4e11), "speed": 20.0, "duration": 0.05, "irregularity": bump}
    for vehicle, masses in ((one, (1200.0,)), (two, (1200.0, 900.0))):
        record = wt.simulate(wt.Scenario(vehicle=vehicle, **shared))
        numbers, exact = range(1, len(masses) + 1), {"rate": RATE, "anti_alias": False}
        boxes = [wt.sensors.AxleBoxAcceleration(name=f"{i}", wheelset=i, **exact) for i in numbers]
        force = record.history(RATE).normal_force
        for number, (mass, found) in enumerate(zip(masses, record.recordings(boxes).values(), strict=True), 1):
            pressed = (force.sel(wheelset=number) if len(masses) > 1 else force).values
            assert pressed.min() == 0.0
            expected = (pressed - 5e4) / mass - one.gravity
            np.testing.assert_allclose(found.samples, expected, atol=1e-9 * np.abs(expected).max())
    sided = wt.sensors.AxleBoxAcceleration(wheelset=2, side="right", **exact)  # both sides are alike
    np.testing.assert_array_equal(record.recordings(sided)["axle box acceleration"].samples, found.samples)


def test_an_axle_box_of_a_bogie_feels_its_suspension():
    """The wheelset's force, spring and damper to the frame, whose ends move by heave and pitch."""
    bogie = wt.vehicles.Bogie(**wt.vehicles.Bogie.example)
    record = wt.simulate(
        wt.Scenario(
            vehicle=bogie, contact=wt.Hertz(constant=1.4e11), speed=20.0, duration=0.2,
            irregularity=wt.CosineBump(height=2e-4, length=0.1, start=0.2),
        )
    )  # fmt: skip
    read = record.history(RATE)
    for wheelset, ahead in ((1, 0.5), (2, -0.5)):
        own, force = read.sel(wheelset=wheelset), 0.0
        for motion, per in (("displacement", bogie.primary_stiffness), ("velocity", bogie.primary_damping)):
            frame = "frame" if motion == "displacement" else "frame_velocity"
            pitch = frame.replace("frame", "frame_pitch")
            moved = read[frame] + ahead * bogie.wheelbase * read[pitch]
            static = own.wheel_displacement[0] if motion == "displacement" else 0.0
            force += per * (moved - (own[f"wheel_{motion}"] - static))
        expected = ((own.normal_force - own.normal_force[0] + force) / bogie.wheelset_mass).values
        box = wt.sensors.AxleBoxAcceleration(wheelset=wheelset, rate=RATE, anti_alias=False)
        found = record.recordings(box)
        np.testing.assert_allclose(found["axle box acceleration"].samples, expected, atol=1e-6 * np.ptp(expected))
        assert np.ptp(expected) > 10.0


@pytest.mark.slow
def test_an_axle_box_of_a_wagon_moves_by_heave_and_roll_of_its_wheelset():
    """ERRI B176: springs stand 1 m from the middle. Their places' displacements, differenced twice, are the witness."""
    coach = wt.Scenario.from_toml("examples/coach_on_ballast.toml")
    held = {name: getattr(coach, name) for name in ("vehicle", "contact", "track", "creep", "speed")}
    bump = {"right": [wt.CosineBump(height=1e-4, length=0.3, start=0.1)]}
    record = wt.simulate(wt.Scenario(**held, irregularity=bump, duration=0.03))
    rate = 50e3
    moved = record.history(rate).displacement.sel(body="wheelset 1")
    sizes = {}
    for side, y in (("left", 1.0), ("right", -1.0)):
        sensor = wt.sensors.AxleBoxAcceleration(wheelset=1, side=side, rate=rate)
        found = record.recordings(sensor)["axle box acceleration"].samples
        place = (moved.sel(motion="z") + y * moved.sel(motion="roll")).values
        expected = rate**2 * (place[2:] - 2.0 * place[1:-1] + place[:-2])
        np.testing.assert_allclose(found[1:-1], expected, atol=2e-2 * np.abs(expected).max())
        sizes[side] = np.ptp(found)
    assert sizes["right"] > 2.0 * sizes["left"]  # the bump is on the right rail
    with pytest.raises(
        wt.InputError, match=r"^side: found none, of a run in which the sides differ; allowed: .left. or"
    ):
        record.recordings(wt.sensors.AxleBoxAcceleration(wheelset=1))
    with pytest.raises(wt.InputError, match=r"^wheelset: found 5; allowed: 1 to 4, the wheelsets of the run"):
        record.recordings(wt.sensors.AxleBoxAcceleration(wheelset=5, side="left"))
    both = [wt.sensors.RailStrain(name=side, x=0.3, side=side, rate=rate) for side in ("left", "right")]
    left, right = (one.samples for one in record.recordings(both).values())
    assert np.abs(left - right).max() > 0.02 * np.ptp(right)
    with pytest.raises(wt.InputError, match=r"^side: found none, of a run in which the rails differ"):
        record.recordings(wt.sensors.RailStrain(x=0.3))
