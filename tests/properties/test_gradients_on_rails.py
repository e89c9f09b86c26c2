"""Exact derivatives of runs on rails: central differences, linear theory, the wheel's march on a stiff track."""

import json

import numpy as np
import pytest
from scipy.differentiate import derivative
from scipy.integrate import solve_ivp

import wheeltapper as wt
from tests import rails
from wheeltapper.describe.scenario import Start
from wheeltapper.lower.fields import Fields
from wheeltapper.march.common import program as contract
from wheeltapper.march.general.contract import STRICT, Bodies
from wheeltapper.march.general.gradients import tangents
from wheeltapper.march.general.laws.switch import LINEAR_LAW
from wheeltapper.march.general.march import march
from wheeltapper.march.general.tables import compliance_at, shapes_at
from wheeltapper.march.general.turned import SystemTurn

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
WEIGHTS = {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}
TRACK = wt.tracks.Ballasted.named("Zhai2004")
SLOW = TRACK.model_copy(update={"cutoff": 1500.0, "bays": 40})
"""A track of slow modes only, which costs little."""
WHEEL = wt.Wheelset(mass=1200.0, load=8e4, stiffness=2e6, damping=4e4, radius=0.46)
WAVES = wt.Corrugation(amplitude=120e-6, wavelength=0.05, start=0.1)
BASE = wt.Scenario(
    vehicle=WHEEL, track=SLOW, contact=wt.Hertz(constant=1.88e11), irregularity=WAVES, rolling="point", speed=30.0,
    duration=0.03,
)  # fmt: skip
TWO = wt.vehicles.Wheelsets(
    wheelsets=(WHEEL, WHEEL.model_copy(update={"mass": 1300.0})), positions=(0.0, -2.5)
)  # fmt: skip
IDLE = SystemTurn(
    Bodies(*np.zeros((3, 1, 1)), np.zeros((1, 1)), np.zeros(1)), np.zeros(1), (np.zeros(1),), (None,)
)  # fmt: skip


def features():
    custom = wt.features.custom
    return [
        wt.features.largest_force(), wt.features.largest_force(over_static=True), wt.features.first_loss(),
        wt.features.time_in_air(), wt.features.impulse(), wt.features.decay_rate(), wt.features.contact_frequency(),
        custom(lambda train: train.loss_time.sum(), "losses", "s"),
        custom(lambda train: train.impact_time.sum(), "impacts", "s"),
        custom(lambda train: train.closing_speed.sum(), "speeds", "m/s"),
        custom(lambda train: train.peak_force[train.peak_impact >= 1].sum(), "forces", "N"),
        custom(lambda train: train.peak_time[train.peak_impact >= 1].sum(), "tops", "s"),
    ]  # fmt: skip


def difference(scene, path, step, of):
    """Return the derivative of something of a record, by sixth-order central differences of strict runs."""
    held = float(Fields(scene)(path))
    near = {k: of(wt.simulate(scene.replaced({path: held + k * step}), "strict")) for k in range(-3, 4) if k}
    return sum(weight * (near[k] - near[-k]) for k, weight in WEIGHTS.items()) / step


def check(scene, paths, impacts, method="strict", most=1e-6):
    """Compare all features' derivatives with differences.

    What is compared is the derivative, or a hundredth of feature over parameter where it is smaller than that. Maxima
    are flat, so that differences know their times less well.
    """
    found = wt.gradient(scene, [*features(), "number_of_impacts"], list(paths), method=method)
    assert float(found.number_of_impacts.max()) >= impacts
    assert set(np.atleast_1d(found.gradient_status.values)) == {0}
    asked = features()
    for number, (path, step) in enumerate(paths.items()):
        expected = difference(scene, path, step, lambda record: np.array([each(record).values for each in asked]))
        for feature, slope in zip(asked, expected, strict=True):
            own = found[f"{feature.name}_gradient"].values[number]
            known, value = np.isfinite(slope), found[feature.name].values
            np.testing.assert_array_equal(np.isfinite(own), known)
            weak = 0.01 * np.abs(np.nan_to_num(value)) / abs(float(Fields(scene)(path)))
            error = np.abs(own - slope) / np.maximum(np.maximum(np.abs(slope), weak), 1e-300)
            limit = 1e-2 if feature.name == "tops" else most
            assert not np.any(error[known] > limit), f"{feature.name} by {path}: {own} instead of {slope}"


OF_THE_WHEEL = {"vehicle.mass": 0.3, "vehicle.load": 10.0, "vehicle.stiffness": 4e4, "vehicle.damping": 200.0}
OF_THE_WAVES = {"irregularity.0.amplitude": 4e-9, "irregularity.0.wavelength": 2e-8, "irregularity.0.start": 4e-7}


@pytest.mark.slow
def test_a_corrugation_that_shakes_the_wheel_off():
    check(BASE, {"irregularity.0.amplitude": 4e-9, "vehicle.mass": 0.3, "speed": 6e-4}, 12)


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "paths", "impacts"),
    [
        ({}, OF_THE_WHEEL | OF_THE_WAVES | {"vehicle.gravity": 2e-3, "contact.constant": 4e7, "speed": 6e-4}, 12),
        ({"contact": wt.Linear(stiffness=2.4e9)}, {"contact.stiffness": 1e6, "vehicle.mass": 0.3, "speed": 6e-4}, 12),
        (
            {"contact": wt.Hertz(constant=1.88e11, hysteresis=0.1)},
            {"contact.hysteresis": 1e-4, "contact.constant": 4e7, "speed": 6e-4}, 12,
        ),
        (
            {"contact": wt.Hertz(), "rolling": "circle"},
            {"contact.youngs_modulus": 4e7, "contact.rail_radius": 1e-4, "vehicle.radius": 1e-5}, 12,
        ),
        ({"contact": wt.contact.Law(lambda d: 1.88e11 * d**1.5 * (1 + 200 * d))}, OF_THE_WHEEL, 12),
        (
            {"irregularity": wt.Step(height=-2e-4, position=0.2, ideal=True)},
            {"irregularity.0.height": 4e-9, "irregularity.0.position": 4e-7, "vehicle.mass": 0.3}, 1,
        ),
        (
            {"irregularity": wt.WheelFlat(depth=4e-4, position=0.2), "rolling": "circle", "speed": 15.0},
            {"irregularity.0.depth": 8e-9, "irregularity.0.position": 2e-6, "vehicle.radius": 1e-5}, 1,
        ),
        ({"vehicle": TWO}, {"vehicle.wheelsets.0.mass": 0.3, "vehicle.wheelsets.1.load": 80.0, "speed": 6e-4}, 12),
        (
            {"vehicle": TWO, "irregularity": {"wheelset 2": WAVES.model_copy(update={"start": -2.4})}},
            {"irregularity.wheelset 2.0.amplitude": 4e-9, "vehicle.wheelsets.0.stiffness": 4e4}, 2,
        ),
        (
            {"vehicle": wt.vehicles.Bogie(**wt.vehicles.Bogie.example)},
            {"vehicle.wheelset_mass": 0.3, "vehicle.frame_mass": 60.0, "vehicle.pitch_inertia": 60.0,
             "vehicle.primary_stiffness": 5e4, "vehicle.secondary_damping": 800.0, "vehicle.wheel_load": 10.0}, 12,
        ),
        (
            {"vehicle": TWO, "track": wt.FloatingDeck(mass=4e3, stiffness=2e7, damping=3e4),
             "start": Start(displacement=1e-4, velocity=0.01), "duration": 0.015},
            {"track.mass": 0.02, "track.damping": 1.0, "start.displacement": 1e-9, "start.velocity": 1e-6,
             "vehicle.wheelsets.0.mass": 0.02}, 4,
        ),
        (
            {"vehicle": WHEEL.model_copy(update={"bush_stiffness": 5e7})},
            {"vehicle.bush_stiffness": 1e5, "vehicle.damping": 200.0, "vehicle.mass": 0.3, "speed": 6e-4}, 12,
        ),
        (
            {"vehicle": wt.vehicles.Bogie(**wt.vehicles.Bogie.example), "track": wt.StiffTrack(),
             "irregularity": [wt.Step(height=1e-3, position=-1.0), WAVES]},  # it stands on two heights
            {"irregularity.0.height": 4e-8, "vehicle.primary_stiffness": 5e4, "vehicle.secondary_stiffness": 5e4,
             "contact.constant": 4e7, "vehicle.wheel_load": 10.0}, 2,
        ),
        (
            {"start": Start(displacement=-2e-4)}, {"start.displacement": 4e-9, "vehicle.load": 10.0, "speed": 6e-4}, 8,
        ),
    ],
)  # fmt: skip
def test_central_differences_of_strict_runs(changes, paths, impacts):
    check(BASE.replaced(changes), paths, impacts)


@pytest.mark.slow
@pytest.mark.parametrize("vehicle", [WHEEL, TWO])
def test_a_swept_map_has_the_derivatives_that_scipy_finds_from_strict_runs(vehicle):
    scene, asked = BASE.replaced({"vehicle": vehicle}), [wt.features.first_loss(), wt.features.largest_force()]
    over, steps = {"speed": [28.0, 30.0]}, {"speed": 6e-4, "irregularity.0.amplitude": 4e-9}
    found = wt.sweep(scene, over, asked, gradient=list(steps), method="strict", progress=False)
    assert (found.status == 0).all()
    assert (found.gradient_status == 0).all()
    for i, speed in enumerate(over["speed"]):
        cell = scene.replaced({"speed": speed})
        for number, (path, step) in enumerate(steps.items()):

            def values(x, cell=cell, path=path):
                """Return the features of all wheelsets (rows) at some values of a field."""
                fields = x.reshape(len(x), -1)[0]  # those of all rows are the same
                runs = [wt.simulate(cell.replaced({path: float(one)}), "strict", progress=False) for one in fields]
                every = [np.concatenate([np.ravel(each(run)) for each in asked]) for run in runs]
                return np.column_stack(every).reshape(x.shape)

            each_of = len(asked) * len(getattr(vehicle, "positions", (0.0,)))
            held = np.full(each_of, float(Fields(cell)(path)))
            expected = derivative(values, held, order=6, initial_step=step, maxiter=1, preserve_shape=True).df
            own = [found[f"{each.name}_gradient"].values[number, ..., i].ravel() for each in asked]
            np.testing.assert_allclose(np.concatenate(own), expected, rtol=1e-5)


@pytest.mark.slow
def test_the_default_method():
    check(BASE, {"irregularity.0.amplitude": 4e-9, "vehicle.mass": 0.3, "speed": 6e-4}, 12, "default", 2e-6)


# -- events and the end state, without features ------------------------------------------------------------------------


def system_of(amplitude=200e-6, constant=9.4125e10, mass=600.0, damping=2e4, load=1e5, speed=36.0):
    """Return a wheel on Zhai's track over waves of 50 mm."""
    law = rails.HERTZIAN._replace(numbers=np.array([constant]))
    system = rails.one_wheel(rails.wave(amplitude, 0.05, 0.6), speed, rails.ring("Zhai2004"), law)
    return system._replace(bodies=rails.free_wheels(1, mass, load)._replace(damping=np.array([[damping]])))


def turns():
    """Return each argument's direction and a step for its differences."""
    bodies, one = IDLE.bodies, np.ones((1, 1))
    wave = np.zeros((2, contract.PIECE_COLUMNS))
    wave[1, contract.SINE] = 1.0
    return {
        "amplitude": (IDLE._replace(paths=(wave,)), 4e-9),
        "constant": (IDLE._replace(laws=(np.ones(1),)), 2e6),
        "mass": (IDLE._replace(bodies=bodies._replace(mass=one)), 0.02),
        "damping": (IDLE._replace(bodies=bodies._replace(damping=one)), 10.0),
        "load": (IDLE._replace(bodies=bodies._replace(load=np.ones(1)), static=np.ones(1)), 2.0),
        "speed": (IDLE._replace(speed=1.0), 7e-4),
    }


@pytest.mark.slow
def test_120_events_and_the_end_of_a_corrugation():
    found = march(system_of(), STRICT, 0.1)
    assert len(found.events) >= 100
    own = tangents(found, [turn for turn, _ in turns().values()])
    for number, (name, (_, step)) in enumerate(turns().items()):
        held = {"amplitude": 200e-6, "constant": 9.4125e10, "mass": 600.0, "damping": 2e4, "load": 1e5, "speed": 36.0}
        near = {k: march(system_of(**{name: held[name] + k * step}), STRICT, 0.1) for k in range(-3, 4) if k}

        def slope(of, near=near, step=step):
            return sum(weight * (of(near[k]) - of(near[-k])) for k, weight in WEIGHTS.items()) / step

        times, rates = slope(lambda run: run.events[:, 0]), slope(lambda run: run.events[:, 2])
        forces = slope(lambda run: run.peaks[:, 1])
        np.testing.assert_allclose(own.events[:, 0, number], times, rtol=0, atol=1e-6 * np.abs(times).max())
        np.testing.assert_allclose(own.events[:, 1, number], rates, rtol=0, atol=1e-6 * np.abs(rates).max())
        np.testing.assert_allclose(own.peaks[:, 1, number], forces, rtol=0, atol=1e-6 * np.abs(forces).max())


# -- other witnesses ---------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_scipy_integrates_the_same_derivative():
    """Over small waves a linear contact is never lost: what its force gains per height is a linear problem."""
    ring, stiffness, speed = rails.ring("Zhai2004", 20, 1500.0), 1.2e9, 30.0
    law = rails.HERTZIAN._replace(kind=LINEAR_LAW, numbers=np.array([stiffness]))
    system = rails.one_wheel(rails.wave(1e-6, 0.06, 0.1), speed, ring, law)
    found = march(system, STRICT, 0.03)
    own = tangents(found, [turns()["amplitude"][0]]).peaks[:, 1, 0]
    count = len(ring.rates)

    def at(t):
        inside, bay = np.array([speed * t % ring.spacing]), np.floor(speed * t / ring.spacing)
        turn = np.exp(1j * bay * np.angle(ring.turns))
        shows, takes = shapes_at(ring, ring.deflection, inside)[0], shapes_at(ring, ring.drive, inside)[0]
        height = np.sin(2.0 * np.pi * (speed * t - 0.1) / 0.06) if speed * t > 0.1 else 0.0
        return shows * turn * ring.weights, takes / turn, height, compliance_at(ring, inside)[0]

    def force(t, state):
        shows, takes, height, local = at(t)
        modes = state[2 : 2 + count] + 1j * state[2 + count :]
        return (state[0] + height - np.real(shows @ modes)) / (1.0 / stiffness + local), modes, takes

    def rate(t, state):
        N, modes, takes = force(t, state)
        moved = ring.rates * modes + takes * N
        return np.concatenate([[state[1], -N / rails.MASS], moved.real, moved.imag])

    times, state, begin = found.peaks[:, 0], np.zeros(2 + 2 * count), 0.1 / speed
    late = np.flatnonzero(times > begin)
    for peak in late:
        seats = ring.spacing / speed * np.arange(1, 10)
        stops = [*seats[(seats > begin) & (seats < times[peak])], times[peak]]
        for stop in stops:
            run = solve_ivp(rate, (begin, stop), state, "DOP853", rtol=1e-10, atol=1e-14, max_step=5e-5)
            begin, state = stop, run.y[:, -1]
        assert own[peak] == pytest.approx(force(begin, state)[0], rel=1e-6)
    assert len(late) >= 10


@pytest.mark.slow
def test_a_stiff_track_has_the_derivatives_of_the_wheels_march():
    """Two wheelsets far apart on a rigid rail are two wheels of the wheel's march."""
    paths = ["irregularity.0.height", "irregularity.0.length", "speed", "contact.constant"]
    bump = wt.CosineBump(height=4e-4, length=0.05, start=0.1)
    wheel = WHEEL.model_copy(update={"stiffness": 0.0})  # which the wheel's march stretches at rest
    alone = BASE.replaced({"vehicle": wheel, "track": wt.StiffTrack(), "irregularity": bump, "duration": 0.05})
    pair = wt.vehicles.Wheelsets(wheelsets=(wheel, wheel), positions=(0.0, -9.0))
    of = [*features()[:4], features()[8]]
    expected = wt.gradient(alone, of, paths, method="strict")
    found = wt.gradient(alone.replaced({"vehicle": pair}), of, paths, method="strict")
    for feature in of:
        name = f"{feature.name}_gradient"
        np.testing.assert_allclose(found[name].sel(wheelset=1), expected[name], rtol=1e-6, err_msg=name)
    assert float(expected.time_in_air) > 0.0


# -- what has no tangents ---------------------------------------------------------------------------------------------


@pytest.mark.few(2)
@pytest.mark.parametrize(
    ("scene", "path", "feature"),
    [
        (BASE, "track.pad_stiffness", "largest_force"),
        (BASE, "track.rail.bending_stiffness", "first_loss"),
        pytest.param(BASE.replaced({"vehicle": TWO}), "vehicle.positions.1", "largest_force", marks=pytest.mark.slow),
        (BASE, "vehicle.mass", "largest_displacement"),
        (BASE.replaced({"vehicle": TWO, "track": wt.StiffTrack()}), "speed", "largest_displacement"),
    ],
)
@pytest.mark.slow
def test_fields_and_features_without_tangents_have_differences(scene, path, feature):
    found = wt.gradient(scene, [feature], [path])
    assert set(np.atleast_1d(found.gradient_status.values)) == {0}
    of, held = getattr(wt.features, feature)(), float(Fields(scene)(path))
    expected = difference(scene, path, 1e-4 * abs(held), lambda record: of(record).values)
    weak = 0.01 * np.abs(found[feature].values / held)
    error = np.abs(found[f"{feature}_gradient"].values[0] - expected) / np.maximum(np.abs(expected), weak)
    assert error.max() < 2e-5
    assert (found[f"{feature}_gradient_error"].values[0] < 1e-5 * np.maximum(np.abs(expected), weak)).all()


def test_a_note_names_what_has_no_derivative_where_a_contact_is_released():
    damped = BASE.replaced({"contact": wt.Hertz(constant=1.88e11, hysteresis=4.6)})
    found = wt.gradient(damped, ["time_in_air", "largest_force"], ["vehicle.mass", "speed"])
    assert np.isnan(found.time_in_air_gradient.values).all()
    assert np.isfinite(found.largest_force_gradient.values).all()
    told = [note for note in json.loads(found.attrs["notes"]) if "no derivative" in note]
    assert len(told) == 1
    assert told[0].startswith("time_in_air has no derivative by vehicle.mass, speed (NaN): ")
