"""A damper with an end of its own, against the equations integrated by SciPy's DOP853, restarted at every event."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import wheeltapper as wt
from wheeltapper.ask.motion import motion_at

DECK = wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4)
LIGHT = wt.FloatingDeck(mass=1500, stiffness=1e8, damping=2e4)
G0 = 9.81


def scene(duration=0.08, **changes):
    fields = {"mass": 1500, "load": 91_307, "stiffness": 2.44e6, "damping": 5e4, "radius": 0.46}
    names = set(wt.Wheelset.model_fields)
    return wt.Scenario(
        vehicle=wt.Wheelset(**(fields | {name: value for name, value in changes.items() if name in names})),
        contact=changes.get("contact", wt.Hertz(constant=1.405e11)),
        track=changes.get("track", wt.StiffTrack()),
        irregularity=changes.get("irregularity", wt.CosineBump(height=2e-4, length=0.05, start=0.009)),
        rolling=changes.get("rolling", "point"),
        speed=9.0,
        duration=duration,
    )


@dataclass
class Peer:
    """The equations of a wheelset over a bump, in SI units, with phases of its own.

    States: wheel y, v; deck Y, Z; deflection e of the bush. `side` is 0 while the end rests at z, else 1 or -1, the
    stop at which it is; `linked` where there is no play.
    """

    scenario: wt.Scenario

    def __post_init__(self):
        vehicle, deck = self.scenario.vehicle, self.scenario.track
        self.m, self.k, self.c = vehicle.mass, vehicle.stiffness, vehicle.damping
        self.weight = vehicle.load + self.m * G0
        self.g, self.kb = vehicle.damper_play, vehicle.bush_stiffness
        self.C = self.scenario.contact.constant
        self.chi = self.scenario.contact.hysteresis or 0.0
        self.deck = deck if isinstance(deck, wt.FloatingDeck) else None
        bump = self.scenario.irregularity[0]
        self.h, self.wave = bump.height, 2 * np.pi * self.scenario.speed / bump.length
        self.begin = bump.start / self.scenario.speed
        self.end = self.begin + bump.length / self.scenario.speed
        depth = (self.weight / self.C) ** (2 / 3)
        for _ in range(60):
            depth -= (self.C * depth**1.5 + self.k * depth - self.weight) / (1.5 * self.C * depth**0.5 + self.k)
        self.static = self.C * depth**1.5
        self.state = np.array([-depth, 0.0, 0.0, 0.0, 0.0])
        self.z = -depth + vehicle.damper_play_start * self.g
        self.touching, self.side, self.linked = True, 0, self.g == 0.0
        self.contact_events, self.damper_events = [], []
        self.parts = []

    def path(self, t, inside):
        if not inside:
            return 0.0, 0.0
        phase = self.wave * (t - self.begin)
        return 0.5 * self.h * (1 - np.cos(phase)), 0.5 * self.h * self.wave * np.sin(phase)

    def indentation(self, t, s, inside):
        return self.path(t, inside)[0] + s[2] - s[0]

    def normal_force(self, t, s, inside):
        delta = self.indentation(t, s, inside)
        if not self.touching or delta <= 0.0:
            return 0.0
        rate = self.path(t, inside)[1] + s[3] - s[1]
        return self.C * delta**1.5 * (1 + self.chi * rate)

    def damper_force(self, s):
        if not self.side and not self.linked:
            return 0.0
        return self.c * s[1] if self.kb is None else self.kb * s[4]

    def rates(self, t, s, inside):
        force = self.normal_force(t, s, inside)
        pull = self.damper_force(s)
        out = np.array([s[1], (force - self.weight - self.k * s[0] - pull) / self.m, 0.0, 0.0, 0.0])
        if self.deck:
            deck = self.deck
            out[2] = s[3]
            out[3] = (self.static - force - deck.stiffness * s[2] - deck.damping * s[3]) / deck.mass
        if self.kb is not None and (self.side or self.linked):
            out[4] = s[1] - pull / self.c
        return out

    def watched(self, inside):
        """Return what may happen now: name, function, direction."""
        yield "contact", lambda t, s: self.indentation(t, s, inside), -1 if self.touching else 1
        if self.linked:
            return
        if self.side:
            row = 1 if self.kb is None else 4
            yield "left", lambda t, s: self.side * s[row], -1
        else:
            yield "upper", lambda t, s: s[0] - self.z - self.g, 1
            yield "lower", lambda t, s: -(s[0] - self.z + self.g), 1

    def integrated(self, t0, t1, s, inside, **more):
        tiny = 1e-15 * np.array([1e-4, 1e-1, 1e-4, 1e-1, 1e-4])
        return solve_ivp(
            self.rates, (t0, t1), s, "DOP853", rtol=2e-13, atol=tiny, max_step=4e-5, args=(inside,), **more
        )

    def step(self, t, until, inside):
        """Integrate to the first event or to `until`; return the time and the event's name."""
        names, functions = [], []
        for name, function, direction in self.watched(inside):

            def event(t, s, inside, function=function):
                return function(t, s)

            event.terminal, event.direction = True, direction
            names.append(name)
            functions.append(event)
        found = self.integrated(t, until, self.state, inside, events=functions, dense_output=True)
        which = next((i for i, times in enumerate(found.t_events) if len(times)), None)
        here, state = found.t[-1], found.y[:, -1]
        if which is not None:  # the dense output is less exact than the steps: come to the event by a step
            start, before = found.t[-2], found.y[:, -2]
            for _ in range(4):
                state = self.integrated(start, here, before, inside).y[:, -1] if here > start else before
                value = functions[which](here, state, inside)
                small = 1e-9
                ahead = functions[which](here + small, state + small * self.rates(here, state, inside), inside)
                here = here - value * small / (ahead - value)
        self.parts.append((t, here, found.sol, self.touching, self.side, self.z, inside))
        self.state = state
        return here, None if which is None else names[which]

    def take(self, t, name):
        if name == "contact":
            self.contact_events.append((t, "loss" if self.touching else "impact"))
            self.touching = not self.touching
        elif name == "left":
            self.damper_events.append((t, "left", "upper" if self.side > 0 else "lower"))
            self.z = self.state[0] - self.side * self.g
            self.side, self.state[4] = 0, 0.0
        elif name is not None:
            self.damper_events.append((t, "reached", name))
            self.side, self.state[4] = 1 if name == "upper" else -1, 0.0

    def run(self):
        last = float(self.scenario.duration)
        for start, stop in pairwise([0.0, self.begin, self.end, last]):
            inside, t = start == self.begin, start
            while t < stop:
                t, name = self.step(t, stop, inside)
                self.take(t, name)
        return self

    def at(self, times):
        """Return wheel displacement, normal force, deck acceleration, displacement of the end, damper force."""
        rows = []
        for time in times:
            _, _, sol, self.touching, self.side, self.z, inside = next(p for p in self.parts if time <= p[1])
            s = sol(time)
            end = self.z if not self.side and not self.linked else s[0] - s[4] - self.side * self.g
            rates = self.rates(time, s, inside)
            rows.append([s[0], self.normal_force(time, s, inside), rates[3], end, -self.damper_force(s)])
        return np.array(rows).T


CASES = {
    "play of 10 um": {"damper_play": 1e-5},
    "play of 50 um": {"damper_play": 5e-5},
    "play of 200 um": {"damper_play": 2e-4},
    "play, begun near a stop": {"damper_play": 5e-5, "damper_play_start": -0.98},
    "bush of 1e7": {"bush_stiffness": 1e7},
    "bush of 1e8": {"bush_stiffness": 1e8},
    "both, 10 um and 1e8": {"damper_play": 1e-5, "bush_stiffness": 1e8},
    "both, 50 um and 1e7": {"damper_play": 5e-5, "bush_stiffness": 1e7, "damper_play_start": 0.5},
    "on a deck, 10 um": {"damper_play": 1e-5, "track": DECK},
    "on a deck, 50 um and 1e7": {"damper_play": 5e-5, "bush_stiffness": 1e7, "track": DECK},
    "on a light deck, 50 um": {"damper_play": 5e-5, "track": LIGHT},
    "on a deck, bush of 1e8": {"bush_stiffness": 1e8, "track": DECK},
    "hysteresis": {"damper_play": 2e-5, "contact": wt.Hertz(constant=1.405e11, hysteresis=0.1), "duration": 0.04},
}
TIMES = np.linspace(0.0005, 0.0395, 157)


@pytest.mark.slow
@pytest.mark.few(5)
@pytest.mark.parametrize("name", CASES)
def test_motion_and_events_are_those_of_another_integrator(name):
    one = scene(**CASES[name])
    peer = Peer(one).run()
    record = wt.simulate(one, "strict")
    default = wt.simulate(one)
    events, stops = record.events, record.damper_events
    assert list(events.kind.values) == [kind for _, kind in peer.contact_events]
    assert list(zip(stops.kind.values, stops.side.values, strict=True)) == [e[1:] for e in peer.damper_events]
    assert len(events.time) >= 4
    for ours, rtol in ((record, 1e-10), (default, 1e-9)):
        np.testing.assert_allclose(ours.events.time, [t for t, _ in peer.contact_events], rtol=rtol)
        np.testing.assert_allclose(ours.damper_events.time, [e[0] for e in peer.damper_events], rtol=rtol)
    found = record.at(TIMES)
    expected = peer.at(TIMES)
    near = [np.min(np.abs(TIMES[:, None] - t.values), axis=1, initial=1.0) < 1e-7 for t in (events.time, stops.time)]
    far = ~(near[0] | near[1])
    names = ["wheel_displacement", "normal_force", "deck_acceleration", "damper_end_displacement", "damper_force"]
    for column, values in zip(names, expected, strict=True):
        if column in found:
            largest = np.abs(values).max()
            np.testing.assert_allclose(
                found[column].values[far], values[far], rtol=0, atol=1e-9 * largest, err_msg=column
            )


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("method", ["default", "strict"])
def test_energy_closes_with_what_damper_and_bush_take(name, method):
    energy = wt.simulate(scene(**CASES[name]), method).energy
    assert abs(energy.relative_imbalance.item()) < (1e-10 if method == "default" else 1e-13)
    assert energy.dissipated_suspension.item() > 0.1  # J


def force_of(one):
    return motion_at(one, TIMES, "strict").force


def errors(name, values, limit):
    largest = np.abs(force_of(limit)).max()
    return np.array([np.abs(force_of(scene(**{name: value})) - force_of(limit)).max() for value in values]) / largest


def test_a_vanishing_gap_is_a_plain_damper():
    off = errors("damper_play", [4e-8, 2e-8, 1e-8, 1e-10, 1e-16], scene())
    np.testing.assert_allclose(off[:2] / off[1:3], 2.0, rtol=0.1)
    assert off[-2] < 1e-6
    assert off[-1] < 1e-9


def test_a_stiffer_and_stiffer_bush_is_a_rigid_one():
    off = errors("bush_stiffness", [2.5e9, 5e9, 1e10], scene())
    np.testing.assert_allclose(off[:2] / off[1:], 2.0, rtol=0.1)
    both = {"damper_play": 2e-5}
    rigid = force_of(scene(**both))
    largest = np.abs(rigid).max()
    off = [np.abs(force_of(scene(**both, bush_stiffness=value)) - rigid).max() / largest for value in (5e9, 1e10)]
    assert off[1] < 2e-3
    assert off[0] / off[1] == pytest.approx(2.0, rel=0.2)


@pytest.mark.parametrize("bush", [None, 1e8])
def test_a_gap_that_is_never_closed_is_no_damper(bush):
    loose = scene(damper_play=5e-3, bush_stiffness=bush)
    np.testing.assert_allclose(force_of(loose), force_of(scene(damping=0.0)), rtol=0, atol=1e-4)  # N
    assert wt.simulate(loose).damper_events.sizes["damper_event"] == 0


def test_a_wheel_that_begins_at_a_stop_is_damped_from_the_first_motion_on():
    record = wt.simulate(scene(damper_play=5e-5, damper_play_start=-1.0), "strict")
    stops = record.damper_events
    assert (stops.kind.values[0], stops.side.values[0]) == ("reached", "upper")
    assert stops.time.values[0] == pytest.approx(0.001, rel=1e-12)  # where the bump begins
    assert stops.kind.values[1] == "left"
    until = np.linspace(0.0, stops.time.values[1], 50)
    plain = wt.simulate(scene(), "strict").at(until)
    np.testing.assert_allclose(record.at(until).normal_force, plain.normal_force, rtol=1e-11)


def test_force_maxima_at_the_very_end_of_a_stop_are_found_once():
    record = wt.simulate(scene(damper_play=1e-5))
    stops, peaks = record.damper_events, record.peaks.time.values
    turns = stops.time.values[(stops.kind.values == "left") & (stops.side.values == "lower")]
    on_flat = peaks[peaks > 0.02]
    assert len(on_flat) >= 8
    np.testing.assert_allclose(np.min(np.abs(on_flat[:, None] - turns), axis=1), 0.0, atol=1e-12)
    assert np.diff(peaks).min() > 1e-4


@pytest.mark.parametrize("method", ["default", "strict"])
def test_a_wheel_that_comes_back_to_where_it_left_a_stop_does_not_reach_it_again(method):
    vehicle = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4, damper_play=2e-5)
    bouncing = wt.Scenario(
        vehicle=vehicle, contact=wt.Hertz(constant=1.405e11), speed=0.0, duration=2.0,
        start={"displacement": -1.3e-4, "velocity": 0.0},
    )  # fmt: skip
    record = wt.simulate(bouncing, method)
    stops = record.damper_events
    kinds = list(zip(stops.kind.values, stops.side.values, strict=True))
    last = max(i for i, kind in enumerate(kinds) if kind[0] == "left")
    assert 40 < last == len(kinds) - 1
    late = record.history(2e4).sel(time=slice(1.9, 2.0))
    gap = late.wheel_displacement - late.damper_end_displacement
    assert float(gap.max() - gap.min()) == pytest.approx(4e-5, rel=1e-2)


@pytest.mark.slow
def test_a_saved_record_answers_as_before(tmp_path):
    record = wt.simulate(scene(damper_play=2e-5, bush_stiffness=1e8, track=DECK, duration=0.04))
    path = tmp_path / "loose.nc"
    record.save(path)
    again = wt.load(path)
    assert again.scenario == record.scenario
    assert again.damper_events.identical(record.damper_events)
    assert again.at(TIMES[:100]).identical(record.at(TIMES[:100]))
    assert again.energy.identical(record.energy)
    with xr.open_dataset(path, engine="h5netcdf") as plain:
        assert plain.damper_event_kind.attrs["flag_meanings"] == "reached left"
        np.testing.assert_array_equal(plain.damper_event_time, record.damper_events.time)
        assert plain.damper_event_time.attrs["units"] == "s"
        assert plain.kind.attrs["flag_meanings"] == "loss impact yield void_opens void_closes"


@pytest.mark.parametrize("changes", [{}, *CASES.values()], ids=["plain", *CASES])
def test_the_motion_for_fits_is_that_of_the_record(changes):
    one = scene(**changes)
    found = motion_at(one, TIMES)
    at = wt.simulate(one).at(TIMES)
    np.testing.assert_allclose(found.force, at.normal_force, rtol=0, atol=1e-12 * np.abs(found.force).max())
    expected = at.deck_acceleration if "deck_acceleration" in at else np.zeros_like(TIMES)
    np.testing.assert_allclose(found.deck_acceleration, expected, rtol=0, atol=1e-11)
    late = motion_at(one, np.array([0.01, float(one.duration), 1.0]))
    assert np.isfinite(late.force[:2]).all()
    assert np.isnan(late.force[2])


@pytest.mark.parametrize("path", ["vehicle.mass", "vehicle.damping", "vehicle.damper_play", "vehicle.bush_stiffness"])
def test_the_motion_for_fits_is_smooth(path):
    one = scene(damper_play=2.5e-5, bush_stiffness=1e9, track=DECK)
    value = float(getattr(one.vehicle, path.split(".")[1]))
    steps = np.linspace(-1e-6, 1e-6, 9)
    found = np.array([motion_at(one.replaced({path: value * (1 + s)}), TIMES).deck_acceleration for s in steps])
    powers = np.vander(steps / 1e-6, 3)
    left = found - powers @ np.linalg.lstsq(powers, found, rcond=None)[0]
    assert np.abs(left).max() < 1e-9 * np.abs(found).max()
