"""Derivatives of readings: a wheel on a sinusoid in closed form, what scales, differences of runs, another march."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

import wheeltapper as wt
from tests.reference.test_wagon_on_rails import NUMBERS, half_coach
from wheeltapper.lower.fields import Fields

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.ground.warned.ModelWarning")
RATE = 2e4
TRACK = wt.tracks.Ballasted.named("rolland_Nordborg", bays=40, cutoff=1500.0)
WHEEL = wt.Wheelset(mass=1200.0, load=90e3, stiffness=1e6, damping=3e4, radius=0.46)
STRIKE = wt.Scenario(
    vehicle=WHEEL, track=TRACK, contact=wt.Hertz(constant=1.8e11), speed=20.0, duration=0.06, rolling="circle",
    irregularity=wt.WheelFlat(length=0.04, position=0.5037, repeat=False),
)  # fmt: skip
BUMP = STRIKE.replaced({
    "track": wt.StiffTrack(), "rolling": "point", "speed": 11.0, "duration": 0.05,
    "irregularity": wt.CosineBump(height=2.1e-4, length=0.06, start=0.1),
})  # fmt: skip
DECK = wt.FloatingDeck(mass=9e3, stiffness=2e7, damping=4e4)


def along_track(rate=RATE):
    """Return a sensor of each kind along rails."""
    return [
        wt.sensors.RailShearForce(name="pair", x1=0.45, x2=0.8, gain=1.07, rate=rate, anti_alias=False),
        wt.sensors.ContactForce(name="length", x1=0.45, x2=0.8, rate=rate, anti_alias=False),
        wt.sensors.PadForce(name="pad", seat=1, rate=rate, anti_alias=False),
        wt.sensors.SleeperForce(name="ballast", seat=1, rate=rate, anti_alias=False),
        wt.sensors.SleeperDisplacement(name="sleeper", seat=1, rate=rate, anti_alias=False),
        wt.sensors.RailStrain(name="strain", x=0.7, rate=rate, anti_alias=False),
        wt.sensors.RailAcceleration(name="rail", x=0.7, rate=rate, anti_alias=False),
        wt.sensors.SleeperAcceleration(name="shaken", seat=1, rate=rate, anti_alias=False),
        wt.sensors.AxleBoxAcceleration(name="box", rate=rate, anti_alias=False),
    ]


def samples_of(scene, sensors):
    return np.array([one.samples for one in wt.simulate(scene, "strict").recordings(sensors).values()])


def slopes_of(found, sensors, path):
    return np.array([found[f"{one.name}_gradient"].sel(parameter=path).values for one in sensors])


def errors_of(found, sensors, path):
    return np.array([found[f"{one.name}_gradient_error"].sel(parameter=path).values for one in sensors])


def differences(scene, sensors, path, step):
    """Return differences of fourth order of strict runs; `step` is relative."""
    value = float(Fields(scene)(path))
    at = {k: samples_of(scene.replaced({path: value * (1.0 + k * step)}), sensors) for k in (-2, -1, 1, 2)}
    return (8.0 * (at[1] - at[-1]) - (at[2] - at[-2])) / (12.0 * step * value)


def relative(found, expected):
    """Return the differences over the size of the expected ones, sample by sample."""
    return np.abs(found - expected) / np.abs(expected).max(axis=1, keepdims=True)


# -- closed forms -----------------------------------------------------------------------------------------------------


def test_a_linear_wheel_on_a_sinusoid_has_the_derivatives_of_its_transfer_function():
    """m·y'' + c·y' + k·y = K·(h - y) with h = a·sin(ω·t - φ): by 0.4 s the transient has fallen to 1e-11."""
    m, c, k, K, a, V, length, start = 1500.0, 2e5, 1e6, 1e9, 1e-5, 12.0, 0.2, 0.1
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=m, load=8e4, stiffness=k, damping=c), contact=wt.Linear(stiffness=K), speed=V,
        duration=0.6, rolling="point", irregularity=wt.Corrugation(amplitude=a, wavelength=length, start=start),
    )  # fmt: skip
    sensors = [
        wt.sensors.ContactForce(name="force", x1=-1.0, x2=100.0, gain=1.1, rate=5e3, anti_alias=False),
        wt.sensors.AxleBoxAcceleration(name="box", rate=5e3, anti_alias=False),
    ]

    def readings(t, m=m, c=c, k=k, K=K, a=a, V=V, length=length, start=start):
        omega = 2.0 * np.pi * V / length
        spring = k + 1j * omega * c - m * omega**2
        wave = a * np.exp(1j * (omega * t - 2.0 * np.pi * start / length)) / (K + spring)
        mean = (8e4 + m * 9.81) * K / (K + k)  # the spring is not stretched where the wheel touches first
        return np.array([1.1 * (mean + (K * spring * wave).imag) / 2.0, (-(omega**2) * K * wave).imag])

    names = {
        "vehicle.mass": "m", "vehicle.damping": "c", "vehicle.stiffness": "k", "contact.stiffness": "K", "speed": "V",
        "irregularity.0.amplitude": "a", "irregularity.0.wavelength": "length", "irregularity.0.start": "start",
    }  # fmt: skip
    found = wt.gradient(scene, sensors, [*names, "sensors.force.gain"], method="strict")
    late = found.time.values > 0.4
    t, held = found.time.values[late], dict(zip(names.values(), found.value.values[:-1], strict=True))
    plain = readings(t)
    for row, one in enumerate(sensors):
        np.testing.assert_allclose(
            found[one.name].values[late], plain[row], rtol=0, atol=1e-9 * np.abs(plain[row]).max()
        )
    for path, name in names.items():
        step = 1e-4 * held[name]
        at = {n: readings(t, **{name: held[name] + n * step}) for n in range(-3, 4)}
        weights = {1: 45.0, 2: -9.0, 3: 1.0}
        exact = sum(weight * (at[n] - at[-n]) for n, weight in weights.items()) / (60.0 * step)
        own = slopes_of(found, sensors, path)[:, late]
        assert relative(own, exact).max() < 2e-8, path
        assert not errors_of(found, sensors, path).any()
    np.testing.assert_allclose(slopes_of(found, sensors, "sensors.force.gain")[0][late], plain[0] / 1.1, rtol=1e-9)
    assert not slopes_of(found, sensors, "sensors.force.gain")[1].any()


@pytest.mark.parametrize("anti_alias", [False, True, 3000.0])
def test_a_jump_that_comes_earlier_is_an_impulse(anti_alias):
    """A wheel that presses with N on a length from x1 to x2: sums with any smooth weight w are ∫w·∂r/∂p dt."""
    x1, x2, gain, speed = 0.1, 0.4, 1.1, 11.0
    scene = BUMP.replaced({"irregularity": None})
    length = wt.sensors.ContactForce(name="length", x1=x1, x2=x2, gain=gain, rate=RATE, anti_alias=anti_alias)
    paths = ["speed", "sensors.length.x1", "sensors.length.x2", "sensors.length.gain"]
    found = wt.gradient(scene, length, paths)
    force = gain * float(wt.simulate(scene).static_force) / 2.0
    t1, t2 = x1 / speed, x2 / speed
    w = lambda t: np.cos(40.0 * t)  # noqa: E731
    sums = (found.length_gradient * w(found.time)).sum("time").values / RATE
    exact = [force * (w(t1) * t1 - w(t2) * t2) / speed, -force * w(t1) / speed, force * w(t2) / speed]
    np.testing.assert_allclose(sums[:3], exact, rtol=2e-6)
    inside = np.abs(found.time.values - 0.5 * (t1 + t2)) < 0.4 * (t2 - t1)
    np.testing.assert_allclose(found.length_gradient.values[3, inside], force / gain, rtol=1e-6)


@pytest.mark.parametrize(
    ("scene", "sensors"),
    [
        pytest.param(BUMP, [wt.sensors.ContactForce(name="length", x1=0.05, x2=0.4, rate=RATE)], id="a stiff track"),
        pytest.param(
            BUMP.replaced({"track": DECK}),
            [
                wt.sensors.ContactForce(name="length", x1=0.05, x2=0.4, rate=RATE),
                wt.sensors.DeckAcceleration(name="deck", rate=RATE, range=200.0, bits=16, cutoff=2e3, drift=0.2),
                wt.sensors.AxleBoxAcceleration(name="box", rate=RATE),
            ],
            id="a deck",
        ),
        pytest.param(
            STRIKE.replaced({"irregularity": None, "duration": 0.02}),
            along_track(5e3)[2:5],
            id="rails",
            marks=pytest.mark.slow,
        ),
    ],
)
def test_forces_are_homogeneous_and_accelerations_do_not_change_where_all_that_has_mass_grows(scene, sensors):
    """Euler: with masses, forces, stiffnesses and dampings s times as large all forces are s times as large."""
    paths = ["vehicle.mass", "vehicle.load", "vehicle.stiffness", "vehicle.damping", "contact.constant"]
    if scene.track == DECK:
        paths += ["track.mass", "track.stiffness", "track.damping"]
    elif scene.track == TRACK:
        of_rail = ["bending_stiffness", "shear_stiffness", "mass_per_length", "rotary_inertia"]
        held = [f"track.rail.{name}" for name in of_rail if getattr(TRACK.rail, name, None)]
        own = ["pad_stiffness", "pad_damping", "sleeper_mass", "ballast_stiffness", "ballast_damping"]
        paths += [*held, *(f"track.{name}" for name in own)]
    found = wt.gradient(scene, sensors, paths)
    values = found.value.values
    for one in sensors:
        slopes = found[f"{one.name}_gradient"].values * values[:, None]
        force = one.quantity == "force"
        size = np.nanmax(np.abs(slopes))
        error = (found[f"{one.name}_gradient_error"].values * values[:, None]).sum(axis=0)
        wrong = np.abs(slopes.sum(axis=0) - (found[one.name].values if force else 0.0))
        assert np.nanmax(wrong - 5.0 * error) < 1e-7 * size, one.name


# -- differences of runs ----------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    "path",
    [
        "irregularity.0.length", "speed",
        *(
            pytest.param(path, marks=pytest.mark.slow)
            for path in (
                "irregularity.0.position", "vehicle.load", "vehicle.mass", "contact.constant", "vehicle.damping"
            )
        ),
    ],
)  # fmt: skip
def test_on_rails_all_sensors_have_the_derivatives_of_strict_runs(path):
    """Apart from samples that an event, a corner or a wheel passes between the runs that are differenced."""
    sensors = along_track()
    found = wt.gradient(STRIKE, sensors, [path], method="strict")
    assert int(wt.simulate(STRIKE).impacts.sizes["impact"]) == 1
    assert not errors_of(found, sensors, path).any()
    other = differences(STRIKE, sensors, path, 1e-5)
    own = slopes_of(found, sensors, path)
    for one, mine, theirs in zip(sensors, own, other, strict=True):
        known = np.isfinite(theirs)
        assert (np.isfinite(mine) == known).all()
        wrong = np.sort(np.abs(mine - theirs)[known])
        size = np.quantile(np.abs(theirs[known]), 0.995)
        weak = path == "vehicle.damping"  # a derivative that is 1e-7 of what is differenced
        fine = {"rail": 2e-5, "shaken": 2e-6}.get(one.name, 2e-8) * (50.0 if weak else 1.0)
        assert wrong[-12] < fine * size, one.name


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("path", ["irregularity.0.length", "irregularity.0.position", "track.pad_stiffness"])
def test_low_passed_readings_have_the_low_passed_derivatives(path):
    """Of readings of forces, strain and displacement, at 800 Hz, through an impact that moves."""
    sensors = [one for one in along_track(1e5) if one.name not in ("rail", "shaken")]
    found = wt.gradient(STRIKE, sensors, [path], method="strict")
    sections = butter(4, 800.0, fs=1e5, output="sos")
    own, other = (
        sosfiltfilt(sections, one, axis=1)
        for one in (slopes_of(found, sensors, path), differences(STRIKE, sensors, path, 3e-6))
    )
    assert relative(own, other).max() < (1e-6 if path.startswith("track") else 3e-8)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "paths"),
    [
        pytest.param({}, ["speed", "vehicle.load", "irregularity.0.start"], id="a stiff track"),
        pytest.param(
            {"track": DECK, "contact": wt.Hertz(constant=1.8e11, hysteresis=0.2)},
            ["speed", "track.stiffness", "contact.hysteresis"], id="a deck, damped",
        ),
        pytest.param(
            {"vehicle": wt.vehicles.Bogie(**wt.vehicles.Bogie.example)}, ["speed", "vehicle.frame_mass"], id="a bogie"
        ),
        pytest.param(
            {
                "vehicle": wt.vehicles.Bogie(**wt.vehicles.Bogie.example), "duration": 0.03,
                "track": wt.tracks.Slab(**wt.tracks.Slab.example | {"cutoff": 1000, "bays": 160}),
            },
            ["speed", "vehicle.frame_mass"], id="a bogie on a slab", marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_wheels_and_decks_have_the_derivatives_of_strict_runs(changes, paths):
    scene = BUMP.replaced(changes)
    sensors = [
        wt.sensors.ContactForce(name="length", x1=0.05, x2=0.4, rate=RATE, anti_alias=False),
        wt.sensors.AxleBoxAcceleration(name="box", rate=RATE, anti_alias=False),
    ]
    if "track" in changes and scene.track == DECK:
        sensors.append(wt.sensors.DeckAcceleration(name="deck", rate=RATE))
    if isinstance(scene.vehicle, wt.vehicles.Bogie):
        sensors.append(wt.sensors.AxleBoxAcceleration(name="behind", wheelset=2, rate=RATE, anti_alias=False))
    found = wt.gradient(scene, sensors, paths, method="strict")
    for path in paths:
        own, other = slopes_of(found, sensors, path), differences(scene, sensors, path, 1e-5)
        assert not errors_of(found, sensors, path).any()
        for mine, theirs in zip(own, other, strict=True):
            size = np.quantile(np.abs(theirs), 0.995)
            assert np.sort(np.abs(mine - theirs))[-6] < 1e-6 * size, path


@pytest.mark.slow
def test_places_of_gauges_have_the_slopes_of_the_rail():
    """Two gauges a little apart read what the slope says; the wheel passes each of them in the run."""
    pair, strain = along_track()[0], along_track()[5]
    scene = STRIKE.replaced({"irregularity": None, "duration": 0.04})
    found = wt.gradient(scene, [pair, strain], ["sensors.pair.x2", "sensors.strain.x", "sensors.pair.gain"])
    record = wt.simulate(scene)
    for name, sensor, field, path in (("pair", pair, "x2", 0), ("strain", strain, "x", 1)):
        at = [
            record.recordings(sensor.model_copy(update={field: getattr(sensor, field) + by}))[name].samples
            for by in (-2e-5, -1e-5, 1e-5, 2e-5)
        ]
        other = (8.0 * (at[2] - at[1]) - (at[3] - at[0])) / (12.0 * 1e-5)
        wrong = np.sort(np.abs(found[f"{name}_gradient"].values[path] - other))
        assert wrong[-5] < 1e-6 * np.quantile(np.abs(other), 0.99)
    np.testing.assert_allclose(found.pair_gradient.values[2] * 1.07, found.pair.values, rtol=1e-8)


# -- where marches have no tangents -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_fields_of_the_track_are_differenced_and_say_how_well():
    sensors = along_track(5e3)[:4]
    scene = STRIKE.replaced({"duration": 0.03, "irregularity": wt.CosineBump(height=5e-5, length=0.1, start=0.3)})
    found = wt.gradient(scene, sensors, ["track.pad_stiffness", "vehicle.mass"])
    other = differences(scene, sensors, "track.pad_stiffness", 1e-3)
    own, error = (of(found, sensors, "track.pad_stiffness") for of in (slopes_of, errors_of))
    size = np.abs(other).max(axis=1, keepdims=True)
    assert relative(own, other).max() < 1e-6
    assert ((error <= 1e-7 * size) & (error >= 0.0)).all()
    assert error.any(axis=1).all()
    assert not errors_of(found, sensors, "vehicle.mass").any()


@pytest.mark.slow
def test_where_a_step_makes_the_force_jump_rails_are_differenced():
    """The change of what rails do would be that under an impulse; the force's own change is known beside the jump."""
    scene = STRIKE.replaced({
        "irregularity": wt.Step(height=2e-5, position=0.3), "rolling": "point", "duration": 0.03,
    })  # fmt: skip
    sensors = [along_track(5e3)[2], along_track(5e3)[-1]]
    path = "irregularity.0.position"
    found = wt.gradient(scene, sensors, [path, "vehicle.mass"])
    other = differences(scene, sensors, path, 1e-5)
    assert errors_of(found, sensors, path).any(axis=1).all()
    assert not errors_of(found, sensors, "vehicle.mass").any()
    size = np.quantile(np.abs(other), 0.99, axis=1)
    assert (np.sort(np.abs(slopes_of(found, sensors, path) - other), axis=1)[:, -6] < 1e-5 * size).all()


@pytest.mark.slow
def test_half_a_coach_has_the_derivatives_of_a_bogie():
    """The wagon's march has no tangents: its differences are those that the general march tells exactly."""
    common = {
        "contact": wt.Hertz(constant_per_wheel=8e10, curvature=False), "speed": 20.0, "duration": 0.03,
        "irregularity": wt.Corrugation(amplitude=1e-4, wavelength=0.1, start=0.05), "rolling": "point",
    }  # fmt: skip
    coach = wt.Scenario(vehicle=half_coach(), profiles=wt.profiles.Cones(), **common)
    load = float(wt.simulate(coach).static_forces[0].sum())
    bogie = wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common)
    sensors = [
        wt.sensors.ContactForce(name="both", side="left", x1=-3.0, x2=0.7, rate=RATE, anti_alias=False),
        wt.sensors.ContactForce(name="front", side="left", x1=0.02, x2=0.5, rate=RATE, anti_alias=False),
    ]  # a filter would spread what differences of runs tell wrongly where a wheel passes an end
    paths = ["speed", "irregularity.0.amplitude"]
    own, exact = wt.gradient(coach, sensors, paths), wt.gradient(bogie, sensors, paths, method="strict")
    for one in sensors:
        mine, theirs = own[f"{one.name}_gradient"].values, exact[f"{one.name}_gradient"].values
        size = np.quantile(np.abs(theirs), 0.995, axis=1)
        assert (np.sort(np.abs(mine - theirs), axis=1)[:, -6] < 1e-6 * size).all()
        assert (own[f"{one.name}_gradient_error"].values > 0.0).any()


# -- what is asked ----------------------------------------------------------------------------------------------------


def test_a_site_is_asked_with_its_own_seats():
    pad = wt.sensors.PadForce(name="pad", seat=2, rate=5e3)
    site = wt.diagnosis.Site(sensors=[pad], spacing=float(TRACK.spacing))
    scene = STRIKE.replaced({"irregularity": None, "duration": 0.02, "track.first_sleeper": float(TRACK.spacing)})
    by_site = wt.gradient(scene, site, ["vehicle.mass"])
    by_run = wt.gradient(scene, wt.sensors.PadForce(name="pad", seat=1, rate=5e3), ["vehicle.mass"])
    np.testing.assert_array_equal(by_site.pad_gradient, by_run.pad_gradient)
    assert by_site["pad"].attrs["units"] == "N"
    assert by_site.pad_gradient.dims == ("parameter", "time")


@pytest.mark.parametrize(
    ("sensors", "path", "message"),
    [
        (along_track()[:1], "sensors.pare.gain", "sensors.pare.gain: found no such sensor; allowed: pair"),
        (along_track()[:1], "sensors.pair.gian", "sensors.pair.gian: found no such field"),
        (along_track()[:1], "sensors.pair.side", "a field that holds a quantity"),
        (along_track()[2:3], "sensors.pad.seat", "a field that holds a quantity"),
        ([wt.sensors.PadForce(name="pad", x=0.6)], "sensors.pad.x", "the place of a seat, which stays where it is"),
        ([wt.sensors.PadForce(name="pad", x=0.6)], "sensors.pad.rate", "with which the times of readings change"),
        (along_track()[:1], "duration", "on which no reading at a given time depends"),
        ([*along_track()[:1], *along_track(5e3)[1:2]], "speed", "rate: found sensors of 2 rates"),
        ([*along_track()[:1], "largest_force"], "speed", "sensors.1: found 'largest_force'"),
        ([wt.sensors.PadForce(name="time", seat=1)], "speed", "name: found 'time'"),
    ],
)
def test_what_has_no_derivative_is_refused_in_one_line(sensors, path, message):
    scene = STRIKE.replaced({"irregularity": None, "duration": 0.01})
    with pytest.raises(wt.InputError, match=message) as refusal:
        wt.gradient(scene, sensors, [path])
    assert "\n" not in str(refusal.value)
