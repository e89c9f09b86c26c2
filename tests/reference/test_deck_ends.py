"""Decks that begin and end below several wheelsets: against the wheelset's march, other programs, and limits."""

from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import wheeltapper as wt
from tests import pieces
from tests.reference.test_kinks_of_suspensions import KINKS, static_of
from tests.reference.test_kinks_of_suspensions import WHEEL as STIFF
from wheeltapper.describe.scenario import Start

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
WHEEL = {"mass": 1340.0, "load": 87e3, "damping": 4e4}
DECK = wt.FloatingDeck(mass=3000.0, stiffness=1.1e7, damping=2e4, start=0.05, length=0.12)
BUMP = wt.CosineBump(height=4e-4, length=0.06, start=0.012)
HERTZ = wt.Hertz(constant=1.31e11)
PAIR = wt.vehicles.Wheelsets(wheelsets=(WHEEL, WHEEL | {"mass": 1100.0, "load": 95e3}), positions=(0.0, -0.05))
BASE = wt.Scenario(
    vehicle=PAIR, track=DECK, contact=HERTZ, irregularity=BUMP, rolling="point", speed=8.0, duration=0.05
)
EVENTS = {"default": 1e-9, "strict": 1e-12}
"""By how much times of events may differ, s."""


def alone(scenario):
    """Return the same scenario for the general march."""
    return scenario.replaced({"vehicle": wt.vehicles.Wheelsets(wheelsets=(scenario.vehicle,), positions=(0.0,))})


def jumps_of(record):
    """Return which events are where a wheelset comes on to the deck or leaves it."""
    scene = record.scenario
    ends = np.array([scene.track.start, scene.track.start + scene.track.length])
    times = np.subtract.outer(ends, getattr(scene.vehicle, "positions", (0.0,))).ravel() / scene.speed
    return np.isclose(record.events.time.values[:, None], times, rtol=0, atol=1e-15).any(axis=1)


# -- the wheelset's march ----------------------------------------------------------------------------------------------

LONE = BASE.replaced({"vehicle": wt.Wheelset(**WHEEL)})
SCENES = {
    "slow": {
        "speed": 0.6, "irregularity.0.length": 3e-3, "irregularity.0.start": 1e-3, "track.start": 3e-3,
        "track.length": 8e-3,
    },
    "fast": {"speed": 60.0, "irregularity.0.length": 0.3, "track.start": 0.5, "track.length": 1.2},
    "in the air": {"track.start": 0.04, "track.length": 0.01},
    "ringing": {"irregularity.0.start": 0.08, "track.start": 0.02, "track.mass": 900.0, "track.damping": 0.0},
    "free deck": {"track.length": 0.06, "duration": 0.08},
    "hysteresis": {"contact": wt.Hertz(constant=1.31e11, hysteresis=0.2)},
    "linear": {"contact": wt.Linear(stiffness=1.4e9)},
    "bilateral": {"contact": wt.Linear(stiffness=1.4e9, bilateral=True)},
    "dropped": {"start": Start(displacement=3e-4, velocity=-0.02), "irregularity.0.start": 0.06},
    "bush": {"vehicle.bush_stiffness": 6e7},
    "play": {"vehicle.damper_play": 5e-5},
}  # fmt: skip


def check_as_wheelsets_march(scene, method):
    wheel, general = wt.simulate(scene, method), wt.simulate(alone(scene), method)
    most, near = EVENTS[method], {"default": 1e-6, "strict": 1e-9}[method]
    if scene.vehicle.damper_play:  # less sharp without ends, too (test_dampers_on_rails.py): stops are left at turns
        most, near = max(most, 1e-10), max(near, 1e-7)
    assert general.events.kind.values.tolist() == wheel.events.kind.values.tolist()
    np.testing.assert_allclose(general.events.time.values, wheel.events.time.values, rtol=0, atol=most)
    np.testing.assert_allclose(general.damper_events.time.values, wheel.damper_events.time.values, rtol=0, atol=most)
    rates = wheel.events.indentation_rate.values
    np.testing.assert_allclose(general.events.indentation_rate.values, rates, rtol=0, atol=near)
    times = np.linspace(0.0, scene.duration, 301)
    expected, found = wheel.at(times), general.at(times)
    assert set(found.data_vars) == set(expected.data_vars)
    for variable, values in expected.data_vars.items():
        size = float(np.abs(values).max()) * (100.0 if variable == "damper_force" else 1.0)
        np.testing.assert_allclose(
            found[variable].values, values.values, rtol=0, atol=max(near * size, 1e-12), err_msg=variable
        )
    if not getattr(scene.contact, "bilateral", False):  # of a force that pulls the marches tell other maxima
        peaks = wheel.peaks
        assert general.peaks.corner.values.tolist() == peaks.corner.values.tolist()
        np.testing.assert_allclose(general.peaks.normal_force, peaks.normal_force, rtol=near, atol=near * 1e5)
        np.testing.assert_allclose(general.peaks.time, peaks.time, rtol=0, atol=1e-7)
    assert abs(float(general.energy.relative_imbalance)) < 1e-9
    return wheel


@pytest.mark.parametrize("method", EVENTS)
@pytest.mark.parametrize("name", SCENES)
def test_one_wheelset_over_a_deck_is_that_of_its_own_march(name, method):
    scene = LONE.replaced(SCENES[name])
    record = check_as_wheelsets_march(scene, method)
    if name not in ("ringing", "bilateral"):
        assert record.events.sizes["event"] > 2
    enters = scene.track.start / scene.speed
    if name == "in the air":
        assert record.at(enters).normal_force.item() == 0.0
    if name == "ringing":
        left = enters + scene.track.length / scene.speed
        assert abs(record.at(left).deck_displacement.item()) > 1e-5
    if name in ("free deck", "hysteresis"):
        assert jumps_of(record).any()


@pytest.mark.few(8)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(24))
def test_drawn_passages_are_those_of_the_wheelsets_march(seed):
    draw = np.random.default_rng(seed)
    speed, way = float(draw.choice([0.7, 5.0, 20.0, 60.0]) * draw.uniform(0.8, 1.2)), 0.06
    contacts = HERTZ, wt.Hertz(constant=1.31e11, hysteresis=0.12), wt.Linear(stiffness=1.4e9)
    dropped = Start(displacement=float(draw.uniform(0.0, 3e-4)), velocity=0.01)
    scene = LONE.replaced({
        "vehicle": wt.Wheelset(
            mass=float(draw.uniform(800.0, 2000.0)), load=87e3, damping=float(draw.uniform(0.0, 5e4))
        ),
        "track": wt.FloatingDeck(
            mass=float(draw.uniform(800.0, 5000.0)), stiffness=float(10 ** draw.uniform(6.8, 8.0)),
            damping=float(draw.uniform(0.0, 3e4)), start=float(speed * way * draw.uniform(0.1, 0.4)),
            length=float(speed * way * draw.uniform(0.2, 0.4)),
        ),
        "irregularity": wt.CosineBump(
            height=float(draw.uniform(1e-4, 6e-4)), length=float(speed * way * draw.uniform(0.05, 0.2)),
            start=float(speed * way * draw.uniform(0.0, 0.6)),
        ),
        "contact": contacts[seed % 3], "start": dropped if seed % 4 == 0 else "equilibrium", "speed": speed,
        "duration": way,
    })  # fmt: skip
    for method in EVENTS:
        check_as_wheelsets_march(scene, method)


@pytest.mark.parametrize("contact", [HERTZ, wt.contact.Thornton(constant=1.31e11, yield_force=2e5)])
def test_a_wheelset_far_behind_is_not_felt(contact):
    scene = LONE.replaced({"contact": contact, "rolling": "circle"})
    pair = wt.vehicles.Wheelsets(wheelsets=(WHEEL, WHEEL), positions=(0.0, -50.0))
    own, both = wt.simulate(scene, "strict"), wt.simulate(scene.replaced({"vehicle": pair}), "strict")
    first = both.events.wheelset.values == 1
    assert both.events.kind.values[first].tolist() == own.events.kind.values.tolist()
    assert len(own.events.time) > 5
    np.testing.assert_allclose(both.events.time.values[first], own.events.time.values, rtol=0, atol=1e-11)


# -- a general solver --------------------------------------------------------------------------------------------------


class Passing:
    """Wheelsets that share springs and a deck with ends, by DOP853, y upwards from the static state; events located.

    M·y'' = contacts·(N - N0) - Σ along·(k·u + c·u'), u = along·y; of the deck, the last freedom, M·y'' is the sum of
    N0 - N of those that are on it, less K·y + C·y'.
    """

    def __init__(self, scene, masses, links, static, positions):
        self.scene, self.links, self.static, self.positions = scene, links, np.array(static), np.array(positions)
        deck = scene.track
        self.masses = np.array([*masses, deck.mass])
        self.count = len(positions)
        linear = isinstance(scene.contact, wt.Linear)
        self.constant, self.power = (scene.contact.stiffness, 1.0) if linear else (scene.contact.constant, 1.5)
        self.loss = float(getattr(scene.contact, "hysteresis", None) or 0.0)
        self.rest = (self.static / self.constant) ** (1.0 / self.power)
        self.ends = np.subtract.outer([deck.start, deck.start + deck.length], self.positions) / scene.speed
        self.on = (self.ends[0] <= 0.0) & (self.ends[1] > 0.0)
        self.held = np.ones(self.count, dtype=bool)

    def path(self, t):
        bump = self.scene.irregularity[0]
        along = (self.positions + self.scene.speed * t - bump.start) / bump.length
        inside = (along > 0.0) & (along < 1.0)
        height = 0.5 * bump.height * (1.0 - np.cos(2.0 * pi * along)) * inside
        slope = bump.height * pi / bump.length * np.sin(2.0 * pi * along) * self.scene.speed * inside
        return height, slope

    def indentation(self, t, state):
        y, v = np.split(state, 2)
        height, slope = self.path(t)
        return self.rest + height + self.on * y[-1] - y[: self.count], slope + self.on * v[-1] - v[: self.count]

    def rate(self, t, state):
        y, v = np.split(state, 2)
        delta, growth = self.indentation(t, state)
        N = self.held * self.constant * np.maximum(delta, 0.0) ** self.power * (1.0 + self.loss * growth)
        force = np.zeros(len(y))
        force[: self.count] = N - self.static
        for along, k, c in self.links:
            force[:-1] -= along * (k * (along @ y[:-1]) + c * (along @ v[:-1]))
        deck = self.scene.track
        force[-1] = self.on @ (self.static - N) - deck.stiffness * y[-1] - deck.damping * v[-1]
        return np.concatenate([v, force / self.masses])

    def watch(self, i):
        def crosses(t, state):
            return self.indentation(t, state)[0][i]

        crosses.terminal, crosses.direction = True, -1.0 if self.held[i] else 1.0
        return crosses

    def run(self):
        """Return times, wheelsets and kinds of all events, and the state in the end."""
        bump, end = self.scene.irregularity[0], self.scene.duration
        kinks = np.subtract.outer([bump.start, bump.start + bump.length], self.positions) / self.scene.speed
        stops = np.unique([*self.ends.ravel(), *kinks.ravel()])
        stops = [*stops[(stops > 0.0) & (stops < end)].tolist(), end]
        time, state, told = 0.0, np.zeros(2 * len(self.masses)), []
        while stops:
            found = solve_ivp(
                self.rate, (time, stops[0]), state, "DOP853", rtol=1e-12, atol=1e-15, max_step=2e-5,
                events=[self.watch(i) for i in range(self.count)],
            )  # fmt: skip
            time, state = found.t[-1], found.y[:, -1]
            if found.status == 1:
                i = next(i for i, times in enumerate(found.t_events) if len(times))
                self.turn(i, time, told)
                continue
            time = stops.pop(0)
            on = (self.ends[0] <= time) & (time < self.ends[1])
            moved, self.on = np.flatnonzero(on != self.on), on
            for i in moved:
                if (self.indentation(time, state)[0][i] > 0.0) != self.held[i]:
                    self.turn(i, time, told)
        return told, state

    def turn(self, i, time, told):
        self.held[i] = not self.held[i]
        told.append((time, i + 1, "impact" if self.held[i] else "loss"))


def static_force(wheel, contact):
    """Return N with N + k·δ(N) = P + m·g: the spring has no force at first touch (the paper, Eq. 2.3)."""
    linear = isinstance(contact, wt.Linear)
    constant, power = (contact.stiffness, 1.0) if linear else (contact.constant, 2.0 / 3.0)
    weight = wheel.mass * 9.81 + wheel.load
    return brentq(lambda N: N + wheel.stiffness * (N / constant) ** power - weight, 0.0, weight, xtol=1e-9)


def of_wheelsets(scene):
    wheels = scene.vehicle.wheelsets
    links = [(np.eye(len(wheels))[i], one.stiffness, one.damping) for i, one in enumerate(wheels)]
    static = [static_force(one, scene.contact) for one in wheels]
    return Passing(scene, [one.mass for one in wheels], links, static, scene.vehicle.positions)


BOGIE = {
    "wheelset_mass": 1200.0, "frame_mass": 2600.0, "pitch_inertia": 1500.0, "wheelbase": 0.3,
    "primary_stiffness": 2.4e6, "primary_damping": 3e4, "secondary_stiffness": 8e5, "secondary_damping": 4e4,
    "wheel_load": 1e5,
}  # fmt: skip


def of_bogie(scene):
    half, k, c = 0.5 * BOGIE["wheelbase"], BOGIE["primary_stiffness"], BOGIE["primary_damping"]
    links = [
        (np.array([1.0, 0.0, -1.0, -half]), k, c), (np.array([0.0, 1.0, -1.0, half]), k, c),
        (np.array([0.0, 0.0, 1.0, 0.0]), BOGIE["secondary_stiffness"], BOGIE["secondary_damping"]),
    ]  # fmt: skip
    masses = [BOGIE["wheelset_mass"]] * 2 + [BOGIE["frame_mass"], BOGIE["pitch_inertia"]]
    return Passing(scene, masses, links, [BOGIE["wheel_load"]] * 2, (0.0, -BOGIE["wheelbase"]))


def check_as_general_solver(scene, other, methods=tuple(EVENTS)):
    """Compare all events, and where wheelsets and deck are in the end; return the events."""
    told, state = other.run()
    wheels = other.count
    for method in methods:
        record = wt.simulate(scene, method)
        mine = [*zip(record.events.wheelset.values.tolist(), record.events.kind.values.tolist(), strict=True)]
        assert mine == [one[1:] for one in told]
        np.testing.assert_allclose(record.events.time.values, [one[0] for one in told], rtol=0, atol=1e-9)
        last = record.at(scene.duration)
        places = [*(last.wheel_displacement.values.ravel() + other.rest), last.deck_displacement.item()]
        mid = len(state) // 2
        np.testing.assert_allclose(places, [*state[:wheels], state[mid - 1]], rtol=0, atol=1e-10)
        assert abs(float(record.energy.relative_imbalance)) < {"default": 1e-8, "strict": 1e-9}[method]
    return told


def drawn_pair(seed):
    draw = np.random.default_rng(seed)
    speed, duration = float(draw.uniform(4.0, 30.0)), 0.04
    wheelsets = tuple(
        {
            "mass": float(draw.uniform(900.0, 1800.0)), "load": float(draw.uniform(7e4, 1e5)),
            "damping": float(draw.uniform(1e4, 5e4)), "stiffness": float(draw.uniform(0.0, 3e6)),
        }
        for _ in range(2)
    )  # fmt: skip
    way = speed * duration
    contacts = HERTZ, wt.Linear(stiffness=1.4e9), wt.Hertz(constant=1.31e11, hysteresis=0.1)
    deck = wt.FloatingDeck(
        mass=float(draw.uniform(1000.0, 5000.0)), stiffness=float(10 ** draw.uniform(6.8, 7.8)),
        damping=float(draw.uniform(0.0, 3e4)), start=float(way * draw.uniform(0.1, 0.3)),
        length=float(way * draw.uniform(0.3, 0.5)),
    )  # fmt: skip
    bump = wt.CosineBump(
        height=float(draw.uniform(2e-4, 5e-4)), length=float(way * draw.uniform(0.05, 0.15)),
        start=float(way * draw.uniform(0.0, 0.3)),
    )  # fmt: skip
    pair = wt.vehicles.Wheelsets(wheelsets=wheelsets, positions=(0.0, -float(way * draw.uniform(0.05, 0.3))))
    return BASE.replaced({
        "vehicle": pair, "track": deck, "irregularity": bump, "contact": contacts[seed % 3], "speed": speed,
        "duration": duration,
    })  # fmt: skip


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(9))
def test_two_wheelsets_over_a_deck_are_those_of_a_general_solver(seed):
    scene = drawn_pair(seed)
    assert len(check_as_general_solver(scene, of_wheelsets(scene))) > 4


@pytest.mark.slow
def test_a_bogie_over_a_deck_is_that_of_a_general_solver():
    """Each of its wheelsets comes on to the deck, and leaves it, at a time of its own."""
    deck = DECK.model_copy(update={"start": 0.1, "length": 0.25})
    scene = BASE.replaced({"vehicle": wt.vehicles.Bogie(**BOGIE), "track": deck, "speed": 15.0})
    assert len(check_as_general_solver(scene, of_bogie(scene))) > 10


@pytest.mark.slow
def test_a_wheelset_leaves_as_another_one_comes():
    """Both ends are passed at one time, to rounding, or 1 ns apart."""
    for length in (0.05, 0.05 + 8e-9):
        scene = BASE.replaced({"track": DECK.model_copy(update={"length": length})})
        check_as_general_solver(scene, of_wheelsets(scene))


# -- laws of one's own, and suspensions with kinks ---------------------------------------------------------------------


def test_a_law_of_ones_own_that_is_hertzs_changes_nothing():
    def cubed(delta):
        return 1.31e11 * delta**1.5

    given, own = wt.simulate(BASE, "strict"), wt.simulate(BASE.replaced({"contact": wt.contact.Law(cubed)}), "strict")
    assert len(given.events.time) > 10
    assert own.events.kind.values.tolist() == given.events.kind.values.tolist()
    np.testing.assert_allclose(own.events.time.values, given.events.time.values, rtol=0, atol=1e-12)
    times = np.linspace(0.0, BASE.duration, 200)
    np.testing.assert_allclose(own.at(times).normal_force, given.at(times).normal_force, rtol=1e-9, atol=1e-4)


IDLE = {
    "friction": {"friction": 1e12, "friction_stiffness": 2e7},
    "bumpstops": {"bumpstop_gap": 1.0, "rebound_gap": 1.0, "bumpstop_stiffness": 1.5e7},
    "corners": {"spring_corners": ((-1.0, 0.5e6), (1.0, 6e6))},
    "blow-off": {"blow_off_force": 1e9},
}
"""The same where it never happens: friction is a spring then."""


def over_waves(**kinks):
    waves = ((4e-5, 2.0 * pi / 0.061), (6e-5, 2.0 * pi / 0.11))
    rough = [wt.Corrugation(amplitude=size, wavelength=2.0 * pi / number, start=0.0) for size, number in waves]
    deck = wt.FloatingDeck(mass=2500.0, stiffness=2e7, damping=2e4, start=0.08, length=0.17)
    pair = wt.vehicles.Wheelsets(wheelsets=(STIFF | kinks, STIFF | kinks), positions=(0.0, -0.05))
    scene = wt.Scenario(
        vehicle=pair, contact=wt.Linear(stiffness=1.2e9), irregularity={"wheelset 1": rough}, rolling="point",
        speed=9.0, duration=0.05, track=deck,
    )  # fmt: skip
    return scene, waves


def elements_of(kinks, along):
    out, stiffness, damping = [], STIFF["stiffness"], STIFF["damping"]
    if "friction" in kinks:
        out.append(pieces.Friction(along, kinks["friction"], kinks["friction_stiffness"]))
    if "bumpstop_gap" in kinks:
        held = kinks["bumpstop_stiffness"]
        out.append(pieces.Corners(along, [-kinks["rebound_gap"], kinks["bumpstop_gap"]], [held, 0.0, held]))
    places, beyond = zip(*kinks.get("spring_corners", ((-1.0, stiffness),)), strict=True)
    slopes = [*beyond]
    slopes.insert(sum(place < 0 for place in places), stiffness)
    out.append(pieces.Corners(along, [*places], slopes))
    rate = kinks.get("blow_off_force", 1e9) / damping
    after = kinks.get("blow_off_damping", damping)
    return [*out, pieces.Corners(along, [-rate, rate], [after, damping, after], by_rate=True)]


@pytest.mark.few(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", KINKS)
def test_kinks_over_a_deck_are_those_of_another_program(name):
    scene, waves = over_waves(**KINKS[name])
    deck, static = scene.track, static_of(STIFF)
    contacts = []
    for freedom, position in enumerate(scene.vehicle.positions):
        on = tuple((end - position) / scene.speed for end in (deck.start, deck.start + deck.length))
        rough = tuple((*wave, 0.0) for wave in waves) if freedom == 0 else ()
        contacts.append(pieces.Contact(freedom, 1.2e9, static, rough, deck=2, on=on))
    elements = [one for along in np.eye(3)[:2] for one in elements_of(KINKS[name], along)]
    only = np.diag([0.0, 0.0, 1.0])
    masses = np.diag([STIFF["mass"], STIFF["mass"], deck.mass])
    others = pieces.run(masses, deck.damping * only, deck.stiffness * only, contacts, elements, scene.speed, 0.05)
    strikes = [(time, number + 1, what) for time, family, number, what in others if family == "contact"]
    bends = [time for time, family, *_ in others if family == "element"]
    assert len(strikes) > 10
    assert len(bends) > 10
    for method, most in EVENTS.items():
        record = wt.simulate(scene, method)
        mine = [*zip(record.events.wheelset.values.tolist(), record.events.kind.values.tolist(), strict=True)]
        assert mine == [one[1:] for one in strikes]
        np.testing.assert_allclose(record.events.time.values, [one[0] for one in strikes], rtol=0, atol=most)
        sharp = 20.0 * most  # where a rate turns slowly a time is less so
        np.testing.assert_allclose(record.suspension_events.time.values, bends, rtol=0, atol=sharp)
        assert abs(float(record.energy.relative_imbalance)) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("name", IDLE)
def test_kinks_that_are_never_reached_change_nothing_over_a_deck(name):
    times = np.linspace(0.0, 0.05, 301)
    borne = 2e7 * static_of(STIFF) / 1.2e9  # by a spring at rest; friction that sticks has no force there
    stiffer = {"stiffness": STIFF["stiffness"] + 2e7, "load": STIFF["load"] + borne}
    plain = stiffer if name == "friction" else {}
    idle, usual = (
        wt.simulate(over_waves(**fields)[0], "strict").at(times).normal_force for fields in (IDLE[name], plain)
    )
    np.testing.assert_allclose(idle, usual, rtol=0, atol=1e-9 * float(usual.max()))


# -- limits, files, and what is asked ----------------------------------------------------------------------------------


def test_a_deck_that_begins_before_and_ends_never_is_one_without_ends():
    endless, begun = (
        wt.simulate(BASE.replaced({"track": DECK.model_copy(update=ends)}), "strict")
        for ends in ({"start": None, "length": None}, {"start": -1.0, "length": None})
    )
    assert begun.events.equals(endless.events)
    times = np.linspace(0.0, BASE.duration, 100)
    assert begun.at(times).equals(endless.at(times))


def test_a_deck_stays_at_rest_until_a_wheelset_comes():
    """And below one at rest, too: until it comes its static force acts instead."""
    level = BASE.replaced({"irregularity": (), "duration": 0.04})
    motion = wt.simulate(level, "strict").at(np.linspace(0.0, 0.04, 50))
    assert float(np.abs(motion.deck_displacement).max()) < 1e-15
    forces = [one.mass * 9.81 + one.load for one in PAIR.wheelsets]
    np.testing.assert_allclose(motion.normal_force.values, np.tile(forces, (50, 1)), rtol=1e-9)


@pytest.mark.parametrize("stiffness", [0.0, 1.1e7])
def test_wheelsets_stand_on_heights_ahead_of_a_deck_whatever_holds_it(stiffness):
    deck = DECK.model_copy(update={"start": 0.3, "stiffness": stiffness})
    sprung = WHEEL | {"stiffness": 2.4e6}
    pair = wt.vehicles.Wheelsets(wheelsets=(sprung, sprung), positions=(0.0, -2.0))
    step = wt.Step(height=1e-3, position=-1.0)
    scene = wt.Scenario(
        vehicle=pair, track=deck, contact=HERTZ, irregularity=step, rolling="point", speed=8.0, duration=0.001
    )  # fmt: skip
    weight = WHEEL["mass"] * 9.81 + WHEEL["load"]
    for force, height in zip(wt.simulate(scene).at([0.0]).normal_force.values[0], (1e-3, 0.0), strict=True):
        depth = brentq(lambda d, h=height: 1.31e11 * d**1.5 + 2.4e6 * (d - h) - weight, 1e-6, 1e-3, xtol=1e-18)
        assert force == pytest.approx(1.31e11 * depth**1.5, rel=1e-9)


@pytest.mark.slow
def test_a_record_over_a_deck_with_ends_goes_through_a_file(tmp_path):
    record = wt.simulate(BASE)
    record.save(tmp_path / "run.nc")
    again = wt.load(tmp_path / "run.nc")
    times = np.linspace(0.0, record.end, 40)
    assert again.at(times).equals(record.at(times))
    assert again.energy.equals(record.energy)
    assert again.events.equals(record.events)


FIELDS = {"speed": 8.0, "track.start": 0.05, "track.length": 0.12, "track.mass": 3000.0}


@pytest.mark.slow
def test_gradients_are_differences_of_runs_also_by_where_the_deck_is():
    features = [wt.features.largest_force(), wt.features.time_in_air()]
    found = wt.gradient(BASE, features, [*FIELDS])
    assert not found.gradient_status.any()
    for number, (path, value) in enumerate(FIELDS.items()):
        above, below = (wt.simulate(BASE.replaced({path: value * (1.0 + part)}), "strict") for part in (1e-6, -1e-6))
        for feature in features:
            slope = (feature(above).values - feature(below).values) / (2e-6 * value)
            mine = found[f"{feature.name}_gradient"].values[number].ravel()
            scale = np.abs(feature(above).values) / value
            np.testing.assert_allclose(mine, slope, rtol=1e-6, atol=3e-8 * scale.max())


@pytest.mark.slow
def test_gradients_and_borders_are_those_of_the_wheelsets_march():
    one, general = (
        wt.gradient(scene, ["largest_force", "time_in_air"], [*FIELDS]) for scene in (LONE, alone(LONE))
    )  # fmt: skip
    for name in ("largest_force_gradient", "time_in_air_gradient"):
        np.testing.assert_allclose(general[name].values.ravel(), one[name].values.ravel(), rtol=1e-7)
    over = {"irregularity.0.height": [2e-5, 4e-4], "speed": [6.0, 9.0]}
    one, general = (wt.border(scene, over, resolution=3) for scene in (LONE, alone(LONE)))
    assert one.sizes["point"] > 2
    for path in over:
        np.testing.assert_allclose(general[path], one[path], rtol=1e-7)


def test_maps_over_a_deck_with_ends_are_runs():
    starts = [0.02, 0.05, 0.07]
    chart = wt.sweep(BASE, {"track.start": starts}, ["largest_force"])
    runs = [wt.simulate(BASE.replaced({"track.start": one})).peaks for one in starts]
    for start, peaks in zip(starts, runs, strict=True):
        for wheelset in (1, 2):
            found = chart.largest_force.sel({"track.start": start, "wheelset": wheelset}).item()
            assert found == pytest.approx(peaks.normal_force.values[peaks.wheelset.values == wheelset].max(), rel=1e-12)


@pytest.mark.parametrize("start", [None, 0.1])
def test_a_deck_below_one_wheelset_leaves_the_others_alone(start):
    bump = wt.CosineBump(height=2e-4, length=0.05, start=0.2)
    deck = wt.FloatingDeck(mass=4e3, stiffness=2e7, damping=1e4, start=start, length=start and 2.0)
    alone = wt.Scenario(
        vehicle=wt.Wheelset(mass=1200, load=9e4), irregularity=bump, rolling="point", speed=10.0, duration=0.15
    )  # fmt: skip
    pair = alone.replaced({
        "vehicle": wt.vehicles.Wheelsets(wheelsets=(alone.vehicle, alone.vehicle), positions=(0.0, -0.9)),
        "track": deck.model_copy(update={"wheelset": 2}),
    })  # fmt: skip
    record = wt.simulate(pair, "strict")
    moved = deck.model_copy(update={"start": None if start is None else start + 0.9})
    behind = alone.replaced({"irregularity": bump.moved(0.9), "track": moved})
    for number, other in enumerate((alone, behind), 1):
        own, lone = record.events.time[record.events.wheelset == number], wt.simulate(other, "strict").events.time
        assert len(own) == len(lone) >= 2
        np.testing.assert_allclose(own, lone, rtol=0, atol=1e-11)


@pytest.mark.parametrize(("vehicle", "found", "allowed"), [
    (wt.Wheelset(mass=1200, load=9e4), 2, "1, or none"),
    (wt.vehicles.Bogie.example, 3, "1 to 2"),
])  # fmt: skip
def test_a_deck_below_a_wheelset_that_is_not_there_is_refused(vehicle, found, allowed):
    vehicle = wt.vehicles.Bogie(**vehicle) if isinstance(vehicle, dict) else vehicle
    deck = wt.FloatingDeck(mass=4e3, stiffness=2e7, wheelset=found)
    with pytest.raises(wt.InputError, match=f"track.wheelset: found {found}; allowed: {allowed}"):
        wt.Scenario(vehicle=vehicle, track=deck, speed=10.0, duration=0.01)
