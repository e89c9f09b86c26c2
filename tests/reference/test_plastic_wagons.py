"""Elastic-plastic contacts of wagons, against other marches and another program."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import wheeltapper as wt
from tests.reference.test_laws_of_wagons import ARM, GRAVITY, HELD, LEVEL, MASS, ROLL_INERTIA, lone, of_side
from tests.reference.test_plastic_on_rails import HEAVY, KINDS, LAWS, STRUCK, passes
from tests.reference.test_wagon_on_rails import NUMBERS, TRACK, half_coach
from wheeltapper.ask.passes import Scatter, after_pass
from wheeltapper.march import run
from wheeltapper.march.common import program as contract

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
CONSTANT = 7e10


def drawn(rng):
    """Return a ride that throws a wheelset, and the force at which its contact yields."""
    speed, length = float(rng.uniform(6, 25)), float(rng.uniform(0.03, 0.15))
    height, bump = float(rng.choice([-1, 1]) * rng.uniform(1e-4, 3e-4)), rng.uniform() < 0.5
    ride = {
        "irregularity": (
            wt.CosineBump(height=height, length=length, start=0.01) if bump
            else wt.Corrugation(amplitude=height / 5, wavelength=length, start=0.01)
        ),
        "rolling": "point", "speed": speed, "duration": 0.05,
    }  # fmt: skip
    return float(rng.uniform(0.7, 3.0)) * MASS * GRAVITY, ride


DECK = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)


@pytest.mark.slow
@pytest.mark.few(3)
@pytest.mark.parametrize("kind", LAWS)
@pytest.mark.parametrize(("method", "allowed", "force"), [("default", 5e-9, 3e-6), ("strict", 2e-11, 1e-8)])
def test_a_wagon_that_only_bounces_is_a_wheelset(kind, method, allowed, force):
    rng, seen, balance = np.random.default_rng(5), 0, 1e-6 if method == "default" else 1e-8
    for number in range(8):
        begins, ride = drawn(rng)
        on_deck = number >= 6
        ride |= {"track": DECK if on_deck else wt.StiffTrack()}
        of_wheel, of_wheelset = (
            kind(yield_force=begins, **constant)
            for constant in ({"constant_per_wheel": CONSTANT}, {"constant": 2 * CONSTANT})
        )
        wagon = wt.simulate(wt.Scenario(vehicle=lone(), contact=of_wheel, profiles=LEVEL, **ride), method)
        wheelset = wt.simulate(
            wt.Scenario(vehicle=wt.Wheelset(mass=MASS, load=0.0), contact=of_wheelset, **ride), method
        )  # fmt: skip
        times = np.linspace(0.0, 0.05, 77)
        for side in ("left", "right"):
            events, peaks = (of_side(table, side) for table in (wagon.events, wagon.peaks))
            assert list(events.kind.values) == list(wheelset.events.kind.values)
            # with Hertz's contact, too, the default method errs by 5e-9 s on this deck
            np.testing.assert_allclose(events.time, wheelset.events.time, rtol=0, atol=allowed * (1 + on_deck))
            scale = wheelset.peaks.normal_force.values.max()
            np.testing.assert_allclose(
                2 * peaks.normal_force, wheelset.peaks.normal_force, rtol=0, atol=force * scale
            )  # fmt: skip
            left = wagon.at(times).permanent_indentation.sel(side=side, wheelset=1)
            np.testing.assert_allclose(left, wheelset.at(times).permanent_indentation, rtol=0, atol=1e-9)
        seen += int((wheelset.events.kind == "yield").sum())
        assert abs(float(wagon.energy.relative_imbalance)) < balance
    assert seen >= 12


# -- a wheelset that rolls aside: another program ---------------------------------------------------------------------

STATIC_FORCE = 0.5 * MASS * GRAVITY


def thornton(d):
    return 1.0 + 1.5 * (d - 1.0)


def stronge(d):
    return (2.0 * d - 1.0) * (1.0 + np.log(max(2.0 * d - 1.0, 0.5)) / 3.3)


class Aside:
    """Bounce and roll of a wheelset on contacts that yield, by scipy's DOP853 from event to event.

    A wheel is lost (-1), presses elastically (0), or yields (1); each law goes on smoothly beyond its end.
    """

    def __init__(self, law, onset, bump, speed):
        self.law, self.onset, self.bump, self.speed = law, onset, bump, speed

    def height(self, t):
        x = self.speed * t - self.bump.start
        if not 0.0 < x < self.bump.length:
            return 0.0
        return 0.5 * float(self.bump.height) * (1 - np.cos(2 * np.pi * x / self.bump.length))

    def gaps(self, t, s):
        """Return the indentations of both wheels; the left one meets the bump."""
        return [self.height(t) * (a > 0) - s[0] - a * ARM * s[1] for a in (1, -1)]

    def push(self, gap, state):
        if state < 0:
            return 0.0
        if state == 0:
            return CONSTANT * max(gap, 0.0) ** 1.5
        return CONSTANT * self.onset**1.5 * self.law(gap / self.onset)

    def rates(self, t, s, states):
        left, right = (self.push(gap, state) for gap, state in zip(self.gaps(t, s), states, strict=True))
        return [s[2], s[3], (left + right) / MASS - GRAVITY, ARM * (left - right) / ROLL_INERTIA]

    def change(self, wheel, level, direction):
        def event(t, s):
            return self.gaps(t, s)[wheel] - level

        event.terminal, event.direction = True, direction
        return event

    def march(self, state, end):
        """Return times, wheels and kinds of all events."""
        breaks = [(self.bump.start + shift) / self.speed for shift in (0.0, self.bump.length)]
        t, states, found = 0.0, [0, 0], []
        while t < end:
            until = min([time for time in breaks if time > t + 1e-12] + [end])
            changes = []
            for wheel, own in enumerate(states):
                if own < 1:  # upwards: an impact, or yield
                    changes.append((wheel, own + 1, self.change(wheel, 0.0 if own < 0 else self.onset, 1.0)))
                if own > -1:
                    changes.append((wheel, own - 1, self.change(wheel, 0.0 if own == 0 else self.onset, -1.0)))
            done = solve_ivp(
                lambda t, s, on=tuple(states): self.rates(t, s, on), (t, until), state, "DOP853", rtol=3e-14,
                atol=1e-17, max_step=2e-5, events=[event for _, _, event in changes],
            )  # fmt: skip
            t, state = float(done.t[-1]), done.y[:, -1]
            for (wheel, after, _), times in zip(changes, done.t_events, strict=True):
                if len(times):
                    before, states[wheel] = states[wheel], after
                    name = {(0, -1): "loss", (-1, 0): "impact", (0, 1): "yield"}.get((before, after))
                    found += [(t, wheel, name)] if name else []
        return found


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "law"), [(wt.contact.Thornton, thornton), (wt.contact.Stronge, stronge)])
def test_a_wheelset_thrown_aside_is_that_of_another_program(kind, law):
    bump = wt.CosineBump(height=2e-4, length=0.05, start=0.01)
    begins = 2.6 * STATIC_FORCE
    scene = wt.Scenario(
        vehicle=lone(HELD), contact=kind(constant_per_wheel=CONSTANT, yield_force=begins),
        profiles=wt.profiles.Cones(arm=ARM, moving_with="wheel"), irregularity={"left": bump}, rolling="point",
        speed=9.0, duration=0.03,
    )  # fmt: skip
    onset = (0.5 * begins / CONSTANT) ** (2 / 3)
    static = (STATIC_FORCE / CONSTANT) ** (2 / 3)
    found = Aside(law, onset, bump, 9.0).march([-static, 0.0, 0.0, 0.0], 0.03)
    record = wt.simulate(scene, "strict")
    assert len(found) == len(record.events.time) >= 8
    names = [name for _, _, name in found]
    assert names.count("yield") >= 3
    assert record.events.kind.values.tolist() == names
    np.testing.assert_array_equal([wheel for _, wheel, _ in found], record.events.side.values == "right")
    np.testing.assert_allclose([t for t, _, _ in found], record.events.time, rtol=0, atol=1e-10)
    assert abs(float(record.energy.relative_imbalance)) < 1e-8


# -- memory between wheels ---------------------------------------------------------------------------------------------


RIDES = {
    "rigid": (wt.StiffTrack(), wt.CosineBump(height=3e-4, length=0.05, start=0.3), 1.6e5, 4),
    "sleepers": (TRACK, wt.Corrugation(amplitude=2e-4, wavelength=0.1, start=0.05), 1.2e5, 50),
}


@pytest.mark.few(1)
@pytest.mark.parametrize("kind", [wt.contact.Thornton, wt.contact.KogutEtsion])
@pytest.mark.parametrize(("method", "allowed", "balance"), [("default", 2e-8, 1e-6), ("strict", 1e-10, 1e-8)])
@pytest.mark.parametrize("name", ["rigid", pytest.param("sleepers", marks=pytest.mark.slow)])
def test_half_a_coach_over_its_own_marks_is_a_bogie(kind, name, method, allowed, balance):
    track, irregularity, begins, least = RIDES[name]
    common = {
        "contact": kind(constant_per_wheel=8e10, yield_force=begins), "speed": 20.0, "duration": 0.17,
        "irregularity": irregularity, "rolling": "point", "track": track,
    }  # fmt: skip
    coach = wt.simulate(wt.Scenario(vehicle=half_coach(), profiles=LEVEL, **common), method)
    load = float(coach.static_forces[0].sum())
    bogie = wt.simulate(wt.Scenario(vehicle=wt.vehicles.Bogie(wheel_load=load, **NUMBERS), **common), method)
    yields = bogie.events.kind.values == "yield"
    assert yields.sum() >= least
    assert {1, 2} == {*bogie.events.wheelset.values[yields].tolist()}
    for side in ("left", "right"):
        own = of_side(coach.events, side)
        assert own.kind.values.tolist() == bogie.events.kind.values.tolist()
        np.testing.assert_allclose(own.time, bogie.events.time, rtol=0, atol=allowed)
    assert abs(float(coach.energy.relative_imbalance)) < balance


def row_of_wheelsets(count, gap):
    """Return a wagon of wheelsets that only bounce, behind each other."""
    held = ("x", "y", "roll", "yaw", "pitch")
    axle = {"mass": HEAVY["mass"], "inertia": (800.0, 90.0, 800.0), "held": held, "load": HEAVY["load"]}
    axles = tuple(wt.vehicles.Axle(position=-gap * k, **axle) for k in range(count))
    return wt.Wagon(bodies=(), axles=axles)


@pytest.mark.parametrize("kind", LAWS)
def test_wheelsets_that_follow_are_passes_of_the_yielding_contacts_march(kind):
    line = passes(kind)
    gap, surface = 300 * line.virgin.interval, line.virgin
    ride = STRUCK | {"contact": kind(constant_per_wheel=1.405e11 / 2, yield_force=1.5e5)}
    scene = wt.Scenario(vehicle=row_of_wheelsets(3, gap), profiles=LEVEL, duration=0.2 + gap / 5.0, **ride)
    record = wt.simulate(scene, "strict")
    for number in range(3):
        program, law, unit = line._program_over(surface, 10.0, 91_307.0, 0.0)
        march = run.march(program)
        events = march.events[march.events[:, contract.EVENT_TIME] * unit < 0.19]
        own = _of_wheel(record.events, number, gap)
        expected = events[:, contract.EVENT_TIME] * unit
        assert own.time.values[: len(events)] == pytest.approx(expected, abs=1e-10, rel=0)
        assert own.kind.values[: len(events)].tolist() == [KINDS[int(kind)] for kind in events[:, contract.EVENT_KIND]]
        peaks, found = (
            march.peaks[march.peaks[:, contract.PEAK_TIME] * unit < 0.19],
            _of_wheel(record.peaks, number, gap),
        )
        forces = peaks[:, contract.PEAK_FORCE] * HEAVY["mass"] * law.length / unit**2
        assert 2 * found.normal_force.values[: len(peaks)] == pytest.approx(forces, rel=1e-8)
        surface, _ = after_pass(line, Scatter(), surface, number)


def _of_wheel(table, number, gap):
    """Return the rows of the right wheel of a wheelset, with times from when it comes to where the first one began."""
    rows = (table.wheelset.values == number + 1) & (table.side.values == "right")
    own = table.isel(dict.fromkeys(table.dims, rows))
    return own.assign(time=own.time - number * gap / 10.0)
