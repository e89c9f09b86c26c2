"""Several wheelsets on a floating deck, starts of their own, and contacts that pull, in the general march."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import wheeltapper as wt
from wheeltapper.describe.scenario import Start

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
WHEEL = {"mass": 1340.0, "load": 87e3, "damping": 4e4}
DECK = wt.FloatingDeck(mass=3000.0, stiffness=1.1e7, damping=2e4)
BUMP = wt.CosineBump(height=4e-4, length=0.06, start=0.012)
DROPPED = Start(displacement=2.5e-4, velocity=-0.02)
BASE = wt.Scenario(
    vehicle=wt.Wheelset(**WHEEL), track=DECK, contact=wt.Hertz(constant=1.31e11), irregularity=BUMP, rolling="point",
    speed=8.0, duration=0.03,
)  # fmt: skip
CONTACTS = {
    "Hertz": wt.Hertz(constant=1.31e11),
    "hysteresis": wt.Hertz(constant=1.31e11, hysteresis=0.12),
    "linear": wt.Linear(stiffness=1.4e9),
    "bilateral": wt.Linear(stiffness=1.4e9, bilateral=True),
}


def alone(scenario):
    """Return the same scenario for the general march: a vehicle of one wheelset that may have others beside it."""
    return scenario.replaced({"vehicle": wt.vehicles.Wheelsets(wheelsets=(scenario.vehicle,), positions=(0.0,))})


# -- the wheel's march -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("start", ["equilibrium", DROPPED], ids=["rest", "dropped"])
@pytest.mark.parametrize("name", CONTACTS)
def test_one_wheel_on_a_deck_is_that_of_the_wheels_march(name, start, method):
    scene = BASE.replaced({"contact": CONTACTS[name], "start": start})
    wheel, general = wt.simulate(scene, method), wt.simulate(alone(scene), method)
    events = wheel.events.time.values
    assert (len(events) == 0) == (name == "bilateral")
    assert general.events.kind.values.tolist() == wheel.events.kind.values.tolist()
    most = {"default": 1e-9, "strict": 1e-11}[method]
    np.testing.assert_allclose(general.events.time.values, events, rtol=0, atol=most)
    times = np.linspace(0.0, scene.duration, 301)
    expected, found = wheel.at(times), general.at(times)
    assert set(found.data_vars) == set(expected.data_vars)
    assert float(np.abs(expected.deck_displacement).max()) > 1e-5
    for variable, values in expected.data_vars.items():
        size = float(np.abs(values).max())
        near = 1e-6 if method == "default" else 1e-9
        np.testing.assert_allclose(found[variable].values, values.values, rtol=0, atol=near * size, err_msg=variable)


@pytest.mark.parametrize("contact", ["Hertz", "bilateral"])
def test_the_energy_of_a_deck_closes(contact):
    pair = wt.vehicles.Wheelsets(wheelsets=(WHEEL, WHEEL | {"mass": 1100.0}), positions=(0.0, -0.05))
    scene = BASE.replaced({"vehicle": pair, "contact": CONTACTS[contact], "start": DROPPED})
    found = wt.simulate(scene, "strict").energy
    assert abs(float(found.relative_imbalance)) < 1e-10
    assert float(found.dissipated) > 0.01
    assert float(found.dissipated_deck) > 0.01
    assert abs(float(found.into_track)) < 1e-9 * float(found.work_of_irregularity)


# -- a general solver --------------------------------------------------------------------------------------------------


class Sprung(NamedTuple):
    """Wheelsets on their suspensions over one deck, written anew: y upwards from the static state."""

    scenario: wt.Scenario

    def integrated(self):
        """Return times and wheelsets of all losses and impacts, and what the wheels and the deck do in the end."""
        scene = self.scenario
        wheels, C = scene.vehicle.wheelsets, scene.contact.constant
        count, deck = len(wheels), scene.track
        m, c, k, W = (
            np.array([one.mass * 9.81 + one.load if name == "weight" else getattr(one, name) for one in wheels])
            for name in ("mass", "damping", "stiffness", "weight")
        )
        bump, positions = scene.irregularity[0], np.array(scene.vehicle.positions)
        rest = np.array(
            [brentq(lambda d, i=i: C * d**1.5 + k[i] * d - W[i], 0.0, 1e-2, xtol=1e-18) for i in range(count)]
        )
        N0 = C * rest**1.5  # the paper, Eq. 2.3: no spring has a force at first touch

        def path(t):
            along = np.clip((positions + scene.speed * t - bump.start) / bump.length, 0.0, 1.0)
            return 0.5 * bump.height * (1.0 - np.cos(2.0 * np.pi * along))

        def indentations(t, y):
            return path(t) + y[count] + rest - y[:count]

        def rate(t, state):
            y, v = state[: count + 1], state[count + 1 :]
            N = C * np.maximum(indentations(t, y), 0.0) ** 1.5
            wheel = (N - N0 - k * y[:count] - c * v[:count]) / m
            carried = (N0.sum() - N.sum() - deck.stiffness * y[count] - deck.damping * v[count]) / deck.mass
            return np.concatenate([v, wheel, [carried]])

        start = np.zeros(2 * count + 2)
        if scene.start != "equilibrium":
            start[:count] = scene.start.displacement + rest
            start[count + 1 : -1] = scene.start.velocity
        edges = (np.array([[bump.start], [bump.start + bump.length]]) - positions).ravel() / scene.speed
        stops = np.append(np.sort(edges[(edges > 0.0) & (edges < scene.duration)]), scene.duration)
        found, begin, state = [], 0.0, start
        for end in stops:
            run = solve_ivp(
                rate, (begin, end), state, "DOP853", rtol=1e-12, atol=1e-15, max_step=5e-6, dense_output=True
            )
            for i in range(count):
                gap = [indentations(t, y[: count + 1])[i] for t, y in zip(run.t, run.y.T, strict=True)]
                for j in np.flatnonzero(np.diff(np.sign(gap)) != 0.0):
                    at = brentq(lambda t, i=i, run=run: indentations(t, run.sol(t)[: count + 1])[i], *run.t[j : j + 2])
                    found.append((at, i + 1))
            begin, state = end, run.y[:, -1]
        return np.array(sorted(found)), state[: count + 1] - np.append(rest, 0.0)


@pytest.mark.parametrize("start", ["equilibrium", DROPPED], ids=["rest", "dropped"])
@pytest.mark.slow
def test_two_wheelsets_feel_each_other_through_a_deck_as_a_general_solver_says(start):
    sprung = WHEEL | {"mass": 1100.0, "load": 95e3, "stiffness": 2.4e6}
    pair = wt.vehicles.Wheelsets(wheelsets=(WHEEL, sprung), positions=(0.0, -0.05))
    scene = BASE.replaced({"vehicle": pair, "start": start})
    expected, ends = Sprung(scene).integrated()
    assert set(expected[:, 1]) == {1.0, 2.0}
    for method, most in (("default", 1e-9), ("strict", 5e-10)):
        record = wt.simulate(scene, method)
        assert record.events.wheelset.values.tolist() == expected[:, 1].tolist()
        np.testing.assert_allclose(record.events.time.values, expected[:, 0], rtol=0, atol=most)
        last = record.at(scene.duration)
        np.testing.assert_allclose(
            [*last.wheel_displacement.values.ravel(), last.deck_displacement.item()], ends, rtol=0, atol=0.1 * most
        )


# -- starts, and contacts that pull, on rails --------------------------------------------------------------------------

TRACK = wt.tracks.Ballasted.named("rolland_UIC60_example").model_copy(update={"cutoff": 2000.0, "bays": 40})
ON_RAILS = BASE.replaced({"track": TRACK, "duration": 0.01})


def test_a_wheelset_that_starts_where_it_rests_stays_at_rest():
    """At 0 m/s: the start is given as the displacement that the record tells of rest."""
    still = ON_RAILS.replaced({"speed": 0.0, "irregularity": None})
    resting = wt.simulate(still).at(0.0)
    again = wt.simulate(still.replaced({"start": Start(displacement=resting.wheel_displacement.item())}))
    force = again.at(np.linspace(0.0, 0.01, 40)).normal_force
    np.testing.assert_allclose(force, resting.normal_force.item(), rtol=1e-7)


def test_a_wheelset_that_starts_in_the_air_falls_freely_on_rails():
    scene = ON_RAILS.replaced({"start": Start(displacement=3e-4, velocity=0.0), "vehicle.damping": 0.0})
    record = wt.simulate(scene)
    first = record.events.isel(event=0)
    times = np.linspace(0.0, float(first.time), 30)
    at = record.at(times)
    pull = scene.vehicle.weight / scene.vehicle.mass
    np.testing.assert_allclose(at.wheel_displacement.values.ravel(), 3e-4 - 0.5 * pull * times**2, rtol=0, atol=1e-15)
    assert first.kind == "impact"
    assert not at.normal_force.values[:-1].any()
    # The track was at rest under the static force and has sprung up meanwhile: the wheel meets the rail where that is.
    met = at.isel(time=-1)
    rail = float(np.ravel(met.rail_displacement)[0]) + float(np.ravel(met.constraint)[0])
    assert float(np.ravel(met.wheel_displacement)[0]) == pytest.approx(rail, abs=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize(
    "vehicle", [BASE.vehicle, wt.vehicles.Bogie(**wt.vehicles.Bogie.example)], ids=["wheel", "bogie"]
)
def test_a_contact_that_pulls_on_rails_is_linear(vehicle):
    """Twice the bump has twice the answer, also where the force is negative; as long as it presses, nothing differs."""
    scene = ON_RAILS.replaced({"vehicle": vehicle, "contact": CONTACTS["bilateral"]})
    times = np.linspace(0.0, scene.duration, 200)

    def force(height, contact="bilateral"):
        one = scene.replaced({"irregularity.0.height": height, "contact": CONTACTS[contact]})
        record = wt.simulate(one, "strict")
        assert (record.events.sizes["event"] == 0) or contact != "bilateral"
        return record.at(times).normal_force.values

    level, once, twice = force(0.0), force(3e-4), force(6e-4)
    assert twice.min() < -1e3
    np.testing.assert_allclose(twice - level, 2.0 * (once - level), rtol=0, atol=1e-6 * np.abs(twice).max())
    np.testing.assert_allclose(force(2e-5), force(2e-5, "linear"), rtol=1e-10)


def test_a_record_of_two_wheelsets_on_a_deck_goes_through_a_file(tmp_path):
    pair = wt.vehicles.Wheelsets(wheelsets=(WHEEL, WHEEL), positions=(0.0, -0.05))
    record = wt.simulate(BASE.replaced({"vehicle": pair, "start": DROPPED}))
    record.save(tmp_path / "run.nc")
    again = wt.load(tmp_path / "run.nc")
    times = np.linspace(0.0, record.end, 20)
    assert again.at(times).equals(record.at(times))
    assert again.energy.equals(record.energy)
    assert wt.plot(again) is not None
