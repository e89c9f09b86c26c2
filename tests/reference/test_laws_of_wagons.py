"""Contacts with hysteresis and linear contacts on wagons, against other marches and another program."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import wheeltapper as wt
from tests.reference.test_wagon_on_rails import NUMBERS, TRACK, half_coach

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
LEVEL = wt.profiles.Cones()
HELD = ("x", "y", "yaw", "pitch")


def lone(held=()):
    """Return a wagon that is a heavy wheelset."""
    axle = wt.vehicles.Axle(mass=1e4, inertia=(1120.0, 112.0, 1120.0), position=0.0, held=held)
    return wt.Wagon(bodies=(), axles=(axle,))


def of_side(table, side):
    return table.isel(dict.fromkeys(table.dims, table.side.values == side))


def drawn(rng, linear):
    """Return contacts of a wheel and of a wheelset, and a ride that throws it."""
    speed, length = float(rng.uniform(4, 25)), float(rng.uniform(0.03, 0.15))
    height, bump = float(rng.choice([-1, 1]) * rng.uniform(5e-5, 3e-4)), rng.uniform() < 0.5
    constant, chi, stiffness = float(rng.uniform(4e10, 1e11)), float(rng.uniform(0.1, 20)), float(rng.uniform(1e9, 3e9))
    ride = {
        "irregularity": (
            wt.CosineBump(height=height, length=length, start=0.01) if bump
            else wt.Corrugation(amplitude=height / 5, wavelength=length, start=0.01)
        ),
        "rolling": "point", "speed": speed, "duration": 0.05,
    }  # fmt: skip
    if linear:
        return wt.Linear(stiffness=stiffness), wt.Linear(stiffness=stiffness), ride
    return wt.Hertz(constant_per_wheel=constant, hysteresis=chi), wt.Hertz(constant=2 * constant, hysteresis=chi), ride


@pytest.mark.parametrize("linear", [False, True])
@pytest.mark.parametrize(("method", "allowed", "force"), [("default", 5e-9, 3e-6), ("strict", 2e-11, 1e-8)])
def test_a_wagon_that_only_bounces_is_a_wheelset(linear, method, allowed, force):
    rng, seen = np.random.default_rng(3), 0
    for _ in range(4 if linear else 12):
        of_wheel, of_wheelset, ride = drawn(rng, linear)
        wagon = wt.simulate(wt.Scenario(vehicle=lone(), contact=of_wheel, profiles=LEVEL, **ride), method)
        wheelset = wt.simulate(
            wt.Scenario(vehicle=wt.Wheelset(mass=1e4, load=0.0), contact=of_wheelset, **ride), method
        )  # fmt: skip
        for side in ("left", "right"):
            events, peaks = (of_side(table, side) for table in (wagon.events, wagon.peaks))
            assert list(events.kind.values) == list(wheelset.events.kind.values)
            np.testing.assert_allclose(events.time, wheelset.events.time, rtol=0, atol=allowed)
            scale = wheelset.peaks.normal_force.values.max()
            np.testing.assert_allclose(
                2 * peaks.normal_force, wheelset.peaks.normal_force, rtol=0, atol=force * scale
            )  # fmt: skip
        seen += len(wheelset.events.time)
        assert float(wagon.energy.relative_imbalance) < (1e-6 if method == "default" else 1e-8)
        if not linear:
            lost = float(wagon.energy.dissipated_contact)
            assert lost == pytest.approx(float(wheelset.energy.dissipated_contact), rel=1e-6, abs=1e-9)
    assert seen >= (8 if linear else 40)


# -- a wheelset that rolls aside: another program ---------------------------------------------------------------------

MASS, ROLL_INERTIA, GRAVITY, ARM = 1e4, 1120.0, 9.81, 0.75


class Aside:
    """Bounce and roll of a wheelset on vertical springs, by scipy's DOP853 from event to event."""

    def __init__(self, force, hold, bump, speed):
        self.force, self.hold, self.bump, self.speed = force, hold, bump, speed

    def path(self, t):
        x = self.speed * t - self.bump.start
        if not 0.0 < x < self.bump.length:
            return 0.0, 0.0
        k = 2 * np.pi / self.bump.length
        height = float(self.bump.height)
        return 0.5 * height * (1 - np.cos(k * x)), 0.5 * height * k * self.speed * np.sin(k * x)

    def gaps(self, t, s):
        """Return indentations and rates of both wheels; the left one meets the bump."""
        z, roll, v, spin = s
        height, rise = self.path(t)
        sides = (1, -1)
        return [(height * (a > 0) - z - a * ARM * roll, rise * (a > 0) - v - a * ARM * spin) for a in sides]

    def rates(self, t, s, closed):
        left, right = (self.force(*gap) if on else 0.0 for gap, on in zip(self.gaps(t, s), closed, strict=True))
        return [s[2], s[3], (left + right) / MASS - GRAVITY, ARM * (left - right) / ROLL_INERTIA]

    def change(self, wheel, closed):
        """Return the event at which a wheel is lost, or strikes."""

        def event(t, s):
            return self.hold(*self.gaps(t, s)[wheel])

        event.terminal, event.direction = True, -1.0 if closed else 1.0
        return event

    def march(self, state, end):
        """Return times, wheels and kinds of all losses and impacts."""
        breaks = [(self.bump.start + shift) / self.speed for shift in (0.0, self.bump.length)]
        t, closed, found = 0.0, [True, True], []
        while t < end:
            until = min([time for time in breaks if time > t + 1e-12] + [end])

            done = solve_ivp(
                lambda t, s, on=tuple(closed): self.rates(t, s, on), (t, until), state, "DOP853", rtol=3e-14,
                atol=1e-17, max_step=2e-5, events=[self.change(wheel, closed[wheel]) for wheel in range(2)],
            )  # fmt: skip
            t, state = float(done.t[-1]), done.y[:, -1]
            for wheel in range(2):
                if len(done.t_events[wheel]):
                    closed[wheel] = not closed[wheel]
                    found.append((t, wheel, closed[wheel]))
        return found


C, CHI, K = 7e10, 3.0, 8e8


def lossy(d, rate):
    return C * max(d, 0.0) ** 1.5 * max(1.0 + CHI * rate, 0.0)


def bent(d, rate):
    """Return a force that no other law has, and no clip."""
    return C * d**1.5 * (1.0 + 400.0 * d) * (1.0 + CHI * rate + 0.3 * np.sin(5.0 * rate))


@pytest.mark.parametrize(
    ("contact", "force", "hold", "static"),
    [
        (
            wt.Hertz(constant_per_wheel=C, hysteresis=CHI), lossy, lambda d, rate: min(d, 1e-4 * (1.0 + CHI * rate)),
            (0.5 * MASS * GRAVITY / C) ** (2 / 3),
        ),
        (
            wt.Linear(stiffness=2 * K), lambda d, _: K * max(d, 0.0), lambda d, _: d, 0.5 * MASS * GRAVITY / K,
        ),
        (
            wt.contact.Law(lambda d, rate: 2.0 * bent(d, rate)), lambda d, rate: max(bent(max(d, 0.0), rate), 0.0),
            lambda d, rate: min(d, 1e-4 * (1.0 + CHI * rate + 0.3 * np.sin(5.0 * rate))),
            brentq(lambda d: bent(d, 0.0) - 0.5 * MASS * GRAVITY, 0.0, 1e-3, xtol=1e-18),
        ),
    ],
)  # fmt: skip
def test_a_wheelset_thrown_aside_is_that_of_another_program(contact, force, hold, static):
    bump = wt.CosineBump(height=2e-4, length=0.05, start=0.01)
    scene = wt.Scenario(
        vehicle=lone(HELD), contact=contact, profiles=wt.profiles.Cones(arm=ARM, moving_with="wheel"),
        irregularity={"left": bump}, rolling="point", speed=9.0, duration=0.03,
    )  # fmt: skip
    found = Aside(force, hold, bump, 9.0).march([-static, 0.0, 0.0, 0.0], 0.03)
    record = wt.simulate(scene, "strict")
    assert len(found) == len(record.events.time) >= 4
    np.testing.assert_array_equal([closes for _, _, closes in found], record.events.kind.values == "impact")
    np.testing.assert_array_equal([wheel for _, wheel, _ in found], record.events.side.values == "right")
    np.testing.assert_allclose([t for t, _, _ in found], record.events.time, rtol=0, atol=1e-10)


# -- on rails ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(
    ("contact", "allowed"),
    [
        (wt.Linear(stiffness=2.4e9), {"default": (3e-9, 1e-5), "strict": (1e-11, 1e-5)}),
        # behind a kink of the path the general march lets the force jump where the lag of the damping is short
        (
            wt.Hertz(constant_per_wheel=8e10, curvature=False, hysteresis=1.67),
            {"default": (3e-8, 1e-3), "strict": (1e-8, 3e-4)},
        ),
    ],
)
@pytest.mark.parametrize("method", ["default", pytest.param("strict", marks=pytest.mark.slow)])
def test_half_a_coach_is_a_bogie_on_rails(contact, allowed, method):
    common = {
        "contact": contact, "speed": 20.0, "duration": 0.03, "rolling": "point", "track": TRACK,
        "irregularity": wt.Corrugation(amplitude=2e-4, wavelength=0.1, start=0.05),
    }  # fmt: skip
    coach = wt.simulate(wt.Scenario(vehicle=half_coach(), profiles=LEVEL, **common), method)
    load = float(coach.static_forces[0].sum())
    bogie = wt.simulate(wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common), method)
    events, forces = allowed[method]
    times = np.linspace(0.0, 0.03, 601)
    force = bogie.at(times).normal_force.values
    for side in ("left", "right"):
        own = coach.events.time[coach.events.side == side]
        assert len(own) == len(bogie.events.time) >= 8
        np.testing.assert_allclose(own, bogie.events.time, rtol=0, atol=events)
        away = np.abs(2.0 * coach.at(times).normal_force.sel(side=side) - force) / load
        assert np.quantile(away, 0.99) < forces
    assert float(coach.energy.relative_imbalance) < 1e-8


@pytest.mark.parametrize(("hysteresis", "events"), [(0.0, 24), (0.1, 24), (1.67, 8)])  # the last one does not rebound
def test_a_start_on_a_deck_counts_from_the_deck_that_has_sunk_below_the_wagon(hysteresis, events):
    # it hardly moves while the wheels fall and bounce; with an end it is prestressed by one wheelset of four
    deck = wt.FloatingDeck(mass=1e9, stiffness=1e12, start=-100.0)
    scene = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=wt.Hertz(constant_per_wheel=7e10, hysteresis=hysteresis), track=deck,
        speed=5.0, duration=0.008, start={"displacement": 1e-5}, rolling="point", profiles=wt.profiles.Cones(),
    )  # fmt: skip
    on_deck, on_rail = wt.simulate(scene), wt.simulate(scene.replaced({"track": wt.StiffTrack()}))
    assert on_deck.outcome.name == "COMPLETED"
    assert len(on_deck.events.time) == len(on_rail.events.time) == events
    np.testing.assert_allclose(on_deck.events.time, on_rail.events.time, rtol=1e-3)


def test_eight_damped_contacts_part_within_rounding_from_a_deck_that_has_sunk_far():
    # 22 mm below three wheelsets that do not prestress it: a step of rounding there is 3e-18 m
    deck = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4, start=-100.0)
    scene = wt.Scenario(
        vehicle=wt.Wagon.erri_b176(), contact=wt.Hertz(constant_per_wheel=7e10, hysteresis=0.1), track=deck, speed=9.0,
        duration=0.01, start={"displacement": 1e-5}, rolling="point", profiles=wt.profiles.Cones(),
    )  # fmt: skip
    record = wt.simulate(scene)
    assert record.outcome.name == "COMPLETED"
    assert 24 <= len(record.events.time) < 100
