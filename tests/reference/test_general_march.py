"""The general march: against another program, a general solver, the wheel march, closed forms, and itself."""

from math import pi

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import wheeltapper as wt
from tests import rails
from wheeltapper.lower.build import lower
from wheeltapper.lower.track import ring as rings
from wheeltapper.lower.track.section import section_of
from wheeltapper.march.common import program as contract
from wheeltapper.march.general import layout
from wheeltapper.march.general.contract import DEFAULT, STRICT, Bodies, Contact, Law, System
from wheeltapper.march.general.laws.switch import HUNT_CROSSLEY, LINEAR_LAW
from wheeltapper.march.general.march import Start, march
from wheeltapper.march.general.replay import modes, path_heights, replay
from wheeltapper.march.general.structure import Ring
from wheeltapper.march.general.tables import compliance_at, grid_of, longest_step, shapes_at

METHODS = {"default": DEFAULT, "strict": STRICT}
ROLLAND, ZHAI = "rolland_UIC60_example", "Zhai2004"


def finished(system, method, duration, **more):
    found = march(system, method, duration, **more)
    assert found.status == contract.DONE
    return found


def kinds(found):
    return [["loss", "impact"][int(kind)] for kind in found.events[:, 1]]


# -- another program ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["flat_60mm_10ms", "two_wheels_two_flats"])
def test_published_flats_on_a_ballasted_track(name):
    case = rails.CASES[name]
    system = rails.flat_60mm() if name == "flat_60mm_10ms" else rails.two_wheels()
    found = finished(system, DEFAULT, case["duration_s"])
    assert kinds(found) == [event["kind"] for event in case["events"]]
    assert found.events[:, 3].tolist() == [event.get("wheel", 0) for event in case["events"]]
    assert found.events[:, 0] == pytest.approx([event["time_s"] for event in case["events"]], abs=3e-6, rel=0)
    for peak in case["peaks"]:
        own = found.peaks[found.peaks[:, 2] == peak.get("wheel", 0)]
        near = own[np.argmin(np.abs(own[:, 0] - peak["time_s"]))]
        assert near[0] == pytest.approx(peak["time_s"], abs=1e-5)
        assert near[1] == pytest.approx(peak["force_N"], rel=5e-3)
    largest = found.peaks[np.argmax(found.peaks[:, 1])]
    assert largest[1] == pytest.approx(case["largest_force"]["force_N"], rel=3e-3)
    assert largest[2] == case["largest_force"].get("wheel", 0)
    samples = case["force_samples"]
    forces = replay(found, np.array([sample["time_s"] for sample in samples])).force
    at = np.arange(len(samples)), [sample.get("wheel", 0) for sample in samples]
    assert forces[at] == pytest.approx([sample["force_N"] for sample in samples], abs=1e3)


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "force"), [(20, 159), (30, 171), (60, 217), (100, 273), (150, 296)])
def test_largest_forces_of_a_flat_at_many_speeds(speed, force):
    system = rails.one_wheel(rails.flat(0.04, 3.0), speed / 3.6, rails.ring(ROLLAND, 100, 8e3))
    found = finished(system, DEFAULT._replace(nodes=14), 3.3 / (speed / 3.6))
    late = found.peaks[found.peaks[:, 0] > 2.9 / (speed / 3.6)]
    assert late[:, 1].max() == pytest.approx(1e3 * force, abs=600)


# -- itself, with finer steps ------------------------------------------------------------------------------------------


def corrugated():
    """Return a wheel on waves that divide the spacing, whose losses repeat in every bay."""
    return rails.one_wheel(rails.wave(200e-6, 0.06, 0.6), 30.0, rails.ring(ZHAI))


@pytest.mark.slow
@pytest.mark.parametrize(("system", "duration", "losses"), [(rails.flat_60mm, 0.33, 1), (corrugated, 0.3, 17)])
def test_finer_steps_change_nothing(system, duration, losses):
    finest = finished(system(), STRICT._replace(step=5e-5), duration)
    assert kinds(finest).count("loss") == losses
    for method, most in ((STRICT, 1e-12), (DEFAULT, 1e-9)):
        found = finished(system(), method, duration)
        assert kinds(found) == kinds(finest)
        assert found.events[:, 0] == pytest.approx(finest.events[:, 0], abs=most, rel=0)
        assert found.peaks[:, 1].max() == pytest.approx(finest.peaks[:, 1].max(), rel=1e-6)


@pytest.mark.slow
def test_finer_steps_change_nothing_of_several_wheels():
    contacts = [Contact(rails.flat(0.04, 1.0 + 0.3 * i), rails.HERTZIAN, -2.56 * i) for i in range(2)]
    for bodies in (rails.free_wheels(2), rails.bogie()):
        system = System(bodies, tuple(contacts), 20.0, rails.ring(ROLLAND))
        finest = finished(system, STRICT._replace(step=5e-5), 0.1)
        assert len(finest.events) >= 4
        assert {0.0, 1.0} == set(finest.events[:, 3])
        for method, most in ((STRICT, 1e-12), (DEFAULT, 1e-9)):
            found = finished(system, method, 0.1)
            assert found.events[:, 1:4:2].tolist() == finest.events[:, 1:4:2].tolist()
            assert found.events[:, 0] == pytest.approx(finest.events[:, 0], abs=most, rel=0)


# -- a general solver --------------------------------------------------------------------------------------------------


class Plain:
    """The same truncated structure for SciPy's DOP853: all modes and bodies in one state, an event at each change."""

    def __init__(self, system, offsets, modes):
        self.system, self.offsets = system, offsets
        bodies = system.bodies
        self.count = len(bodies.mass)
        self.inverse = np.linalg.inv(bodies.mass)
        start = np.concatenate([np.zeros(2 * self.count), modes.real, modes.imag])
        self.start, self.closed = start, np.ones(len(system.contacts), dtype=bool)

    def rows(self, t):
        """Return what shows the modes to each contact, what drives them, and the local compliance."""
        ring, contacts = self.system.ring, self.system.contacts
        x = np.array([contact.position for contact in contacts]) + self.system.speed * t
        bays = np.floor(x / ring.spacing)
        inside = x - bays * ring.spacing
        turn = np.exp(1j * np.multiply.outer(bays, np.angle(ring.turns)))
        shows = shapes_at(ring, ring.deflection, inside) * turn * ring.weights
        takes = shapes_at(ring, ring.drive, inside) / turn
        return shows, takes, compliance_at(ring, inside)

    def gaps(self, t, state):
        """Return δ + r·N of all contacts."""
        shows, takes, local = self.rows(t)
        modes = state[2 * self.count :].reshape(2, -1)
        path = [path_heights(one, np.array([one.start + self.system.speed * t]))[0] for one in self.system.contacts]
        wheels = self.system.bodies.shapes.T @ state[: self.count]
        return wheels + self.offsets + path - np.real(shows @ (modes[0] + 1j * modes[1])), takes, local

    def forces(self, gaps, local):
        """Return the forces of closed contacts: Newton's method on δ + r·C·δ^1.5 = gap."""
        C = self.system.contacts[0].law.numbers[0]
        delta = np.maximum(gaps, 0.0)
        for _ in range(60):
            root = np.sqrt(delta)
            delta = np.maximum(delta - (delta + local * C * delta * root - gaps) / (1.0 + 1.5 * local * C * root), 0.0)
        return np.where(self.closed, C * delta**1.5, 0.0)

    def rate(self, t, state):
        gaps, takes, local = self.gaps(t, state)
        N = self.forces(gaps, local)
        bodies, count, ring = self.system.bodies, self.count, self.system.ring
        y, v = state[:count], state[count : 2 * count]
        a = self.inverse @ (bodies.load - bodies.shapes @ N - bodies.stiffness @ y - bodies.damping @ v)
        modes = state[2 * count :].reshape(2, -1)
        moved = ring.rates * (modes[0] + 1j * modes[1]) + N @ takes
        return np.concatenate([v, a, moved.real, moved.imag])

    def events(self, duration, breaks):
        """Integrate from event to event and over the path's breaks; return times and contacts of all events."""
        t, state, found = 0.0, self.start, []
        watched = [lambda t, state, i=i: self.gaps(t, state)[0][i] for i in range(len(self.closed))]
        while t < duration:
            for i, one in enumerate(watched):
                one.terminal, one.direction = True, -1.0 if self.closed[i] else 1.0
            until = min([b for b in breaks if b > t + 1e-12] + [duration])
            run = solve_ivp(
                self.rate, (t, until), state, "DOP853", events=watched, rtol=1e-10, atol=1e-12, max_step=2e-5
            )
            t, state = run.t[-1], run.y[:, -1]
            for i, times in enumerate(run.t_events):
                if len(times):
                    found.append((times[0], i))
                    self.closed[i] = not self.closed[i]
        return np.array(found)


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.parametrize("vehicle", ["one wheel", "bogie"])
def test_events_of_a_general_solver(vehicle):
    coarse = rails.ring(ROLLAND, 20, 2e3)
    contacts = (Contact(rails.flat(0.06, 0.45), rails.HERTZIAN, 0.2),)
    bodies = rails.free_wheels()
    if vehicle == "bogie":
        bodies = rails.bogie()
        contacts += (Contact(rails.flat(0.05, 0.5), rails.HERTZIAN, 0.2 - 2.56),)
    system = System(bodies, contacts, 20.0, coarse)
    found = finished(system, STRICT, 0.04)
    assert len(found.events) >= 2 * len(contacts)
    start = march(system, STRICT, 1e-4).prepared.start
    breaks = {
        edge / system.speed for one in contacts for edge in one.pieces[1:, contract.START] if np.isfinite(edge)
    }  # fmt: skip
    seats = {(0.3 * k - one.position) / system.speed for one in contacts for k in range(-12, 12)}
    plain = Plain(system, start.offsets, start.modes).events(0.04, sorted(breaks | seats))
    assert plain[:, 1].tolist() == found.events[:, 3].tolist()
    assert plain[:, 0] == pytest.approx(found.events[:, 0], abs=2e-8, rel=0)


# -- the wheel march ---------------------------------------------------------------------------------------------------

BUMP = wt.CosineBump(height=2e-4, length=0.05, start=0.009)
WAVES = wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=0.02)
DECK = wt.FloatingDeck(mass=3000, stiffness=1e7, damping=2e4)


def scene(track, irregularity, **contact):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91307, stiffness=2.44e6, damping=5e4), track=track,
        contact=wt.Hertz(constant=1.405e11, **contact), irregularity=irregularity, rolling="point", speed=9.0,
        duration=0.12,
    )  # fmt: skip


def general(scenario, method, modal=False):
    """March a scenario of the wheel march by the general one; a deck is a body, or one complex mode of a track."""
    lowered = lower(scenario, "strict")
    numbers, vehicle, deck = lowered.program.numbers, scenario.vehicle, scenario.track
    lost = numbers[contract.HYSTERESIS] / lowered.length * lowered.time
    law = rails.Law(rails.HERTZ, np.array([lowered.contact_constant]))
    if lost:
        law = Law(HUNT_CROSSLEY, np.array([lowered.contact_constant, lost]))
    joint = int(numbers[contract.LOOP]), int(numbers[contract.LOOP_JOIN])
    contacts = (Contact(lowered.program.pieces, law, 0.0, -numbers[contract.START_SHIFT], *joint),)
    y, prestress = -numbers[contract.START_HEIGHT] * lowered.length, numbers[contract.PRESTRESS] * lowered.force
    wheel = vehicle.mass, vehicle.damping, vehicle.stiffness, 1.0, lowered.force
    rows, ring, modes, offset = [wheel], None, np.zeros(0, complex), 0.0
    if isinstance(deck, wt.FloatingDeck) and modal:
        rate = -0.5 * deck.damping / deck.mass
        rate = np.array([rate + 1j * np.sqrt(deck.stiffness / deck.mass - rate**2)])
        drive = 1.0 / (2j * deck.mass * rate.imag)
        stride = scenario.speed * method.step
        ring = Ring(
            rate, np.ones(1, complex), np.full(1, 2.0), np.array([0.0, stride]), np.ones((1, 1, 1), complex),
            drive.reshape(1, 1, 1), np.zeros((1, 15)), stride, 1,
        )  # fmt: skip
        modes = -drive * prestress / rate
        offset = 2.0 * modes.real.sum()
    elif isinstance(deck, wt.FloatingDeck):
        rows.append((deck.mass, deck.damping, deck.stiffness, -1.0, -prestress))
    mass, damping, stiffness, shape, load = np.array(rows).T
    bodies = Bodies(np.diag(mass), np.diag(damping), np.diag(stiffness), shape[:, None], load)
    start = np.zeros(2 * len(rows))
    start[0] = y
    system = System(bodies, contacts, scenario.speed, ring)
    return finished(system, method, scenario.duration, start=Start(start, modes, np.array([offset])))


@pytest.mark.parametrize("irregularity", [BUMP, WAVES], ids=["bump", "waves"])
@pytest.mark.parametrize(
    ("track", "contact", "modal"),
    [(wt.StiffTrack(), {}, False), (DECK, {}, False), (DECK, {}, True), (wt.StiffTrack(), {"hysteresis": 0.3}, False)],
    ids=["rigid", "deck", "deck as a mode", "hysteresis"],
)  # fmt: skip
def test_one_wheel_is_that_of_the_wheel_march(track, contact, modal, irregularity):
    scenario = scene(track, irregularity, **contact)
    record = wt.simulate(scenario, method="strict")
    found = general(scenario, DEFAULT, modal)
    assert len(found.events) > 12
    assert kinds(found) == record.events.kind.values.tolist()
    assert found.events[:, 0] == pytest.approx(record.events.time.values, abs=1e-9, rel=0)
    assert found.peaks[:, 1] == pytest.approx(record.peaks.normal_force.values, rel=1e-6)
    times = np.linspace(0.0, 0.12, 500)
    there, own = record.at(times), replay(found, times)
    assert own.force[:, 0] == pytest.approx(there.normal_force.values, abs=2.0)
    assert -own.displacement[:, 0] == pytest.approx(there.wheel_displacement.values, abs=1e-9)
    assert -own.acceleration[:, 0] == pytest.approx(there.wheel_acceleration.values, abs=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("contact", [{}, {"hysteresis": 0.3}], ids=["elastic", "hysteresis"])
def test_strictly_it_is_that_of_the_wheel_march_to_rounding(contact):
    for irregularity in (BUMP, WAVES):
        scenario = scene(wt.StiffTrack(), irregularity, **contact)
        record = wt.simulate(scenario, method="strict")
        found = general(scenario, STRICT)
        assert found.events[:, 0] == pytest.approx(record.events.time.values, abs=1e-12, rel=0)
        assert found.events[:, 2] == pytest.approx(record.events.indentation_rate.values, abs=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("cutoff", [5e3, 50.0], ids=["with modes", "without modes"])
def test_a_stiffened_track_approaches_the_rigid_one(cutoff):
    pieces = rails.pieces_of(lambda x: -5e-5 * (1.0 - np.cos(2.0 * pi * (x - 0.7) / 0.2)), np.linspace(0.7, 0.9, 9))
    rigid = finished(rails.one_wheel(pieces, 20.0), DEFAULT, 0.06).peaks[:, 1].max()
    plain = wt.tracks.Ballasted.named(ROLLAND)
    away = []
    for share in (1e4, 1e6):
        rail = changed_rail(plain.rail, share)
        track = wt.tracks.Ballasted(
            rail=rail, spacing=plain.spacing, pad_stiffness=plain.pad_stiffness * share,
            pad_damping=plain.pad_damping * share, sleeper_mass=plain.sleeper_mass,
            ballast_stiffness=plain.ballast_stiffness * share, ballast_damping=plain.ballast_damping * share,
        )  # fmt: skip
        ring = rings.ring_of(section_of(track), 20, cutoff).ring
        assert (len(ring.rates) == 0) == (cutoff == 50.0)
        away.append(finished(rails.one_wheel(pieces, 20.0, ring), DEFAULT, 0.06).peaks[:, 1].max() / rigid - 1.0)
    assert abs(away[0]) < 1e-3
    assert away[0] / away[1] == pytest.approx(100.0, rel=0.1)


def changed_rail(rail, share):
    return wt.tracks.Rail(
        bending_stiffness=rail.bending_stiffness * share, shear_stiffness=rail.shear_stiffness * share,
        mass_per_length=rail.mass_per_length, rotary_inertia=rail.inertia, damping=rail.damping,
    )  # fmt: skip


# -- closed forms ------------------------------------------------------------------------------------------------------


def test_a_wheel_on_a_linear_contact_bounces_as_in_the_closed_form():
    k, m, P = 1e9, 600.0, 1e5
    system = rails.one_wheel(rails.level(), 10.0, law=Law(LINEAR_LAW, np.array([k])))
    speed = 0.3  # m/s, downwards at the moment of touch
    omega = np.sqrt(k / m)
    start = Start(np.array([-1e-12, speed]), np.zeros(0, complex), np.zeros(1))
    found = finished(system, STRICT, 0.02, start=start)

    def indentation(t):
        return P / k * (1.0 - np.cos(omega * t)) + speed / omega * np.sin(omega * t)

    touch = found.events[0, 0]
    away = brentq(indentation, 0.6 * pi / omega, 1.9 * pi / omega)
    assert kinds(found)[:3] == ["impact", "loss", "impact"]
    assert found.events[1, 0] - touch == pytest.approx(away, abs=1e-11)
    assert found.events[2, 0] - found.events[1, 0] == pytest.approx(2.0 * speed * m / P, abs=1e-11)
    assert found.peaks[0, 1] == pytest.approx(P + np.hypot(P, k * speed / omega), rel=1e-8)


def test_a_wheel_at_rest_stays_at_rest():
    found = finished(rails.one_wheel(rails.level(), 10.0), DEFAULT, 0.05)
    assert len(found.events) == len(found.peaks) == 0
    assert replay(found, np.linspace(0.0, 0.05, 50)).force == pytest.approx(rails.LOAD, rel=1e-12)


# -- the log -----------------------------------------------------------------------------------------------------------


def test_what_is_replayed_fits_together():
    system = rails.flat_60mm()
    found = finished(system, DEFAULT, 0.305)
    times = np.linspace(0.2985, 0.3045, 4001)
    seen, kept = replay(found, times), modes(found, times)
    delta = np.maximum(seen.indentation[:, 0], 0.0)
    assert seen.force[:, 0] == pytest.approx(9.4125e10 * delta**1.5, abs=1.0)
    assert (seen.indentation[:, 0] < 0.0).any()
    assert seen.acceleration[:, 0] == pytest.approx((rails.LOAD - seen.force[:, 0]) / rails.MASS, abs=1e-9)
    slopes = np.gradient(seen.velocity[:, 0], times)[1:-1]
    assert slopes == pytest.approx(seen.acceleration[1:-1, 0], abs=0.5)
    ring = system.ring
    along = system.contacts[0].position + system.speed * times
    inside = np.clip(along - kept.bay * ring.spacing, 0.0, 0.6)
    shows = np.real((shapes_at(ring, ring.deflection, inside) * kept.amplitudes) @ ring.weights)
    local = compliance_at(ring, inside) * seen.force[:, 0]
    assert shows + local == pytest.approx(seen.rail[:, 0], abs=1e-9)


def test_maxima_are_those_of_the_replayed_force():
    found = finished(rails.flat_60mm(), DEFAULT, 0.331)
    times = np.arange(0.2985, 0.33, 5e-7)
    force = replay(found, times).force[:, 0]
    tops = np.flatnonzero((force[1:-1] > force[:-2]) & (force[1:-1] >= force[2:])) + 1
    told = found.peaks[(found.peaks[:, 0] > times[0]) & (found.peaks[:, 0] < times[-1])]
    assert len(told) == len(tops) > 10
    assert told[:, 0] == pytest.approx(times[tops], abs=6e-7)
    assert told[:, 1] == pytest.approx(force[tops], rel=1e-6)


# -- what cannot go on -------------------------------------------------------------------------------------------------


def test_a_path_that_ends_ends_the_march():
    pieces = rails.level()
    pieces[0, contract.STOP] = 0.3
    found = march(rails.one_wheel(pieces, 10.0), DEFAULT, 0.1)
    assert found.status == contract.END_OF_PATH
    assert found.time == pytest.approx(0.03, abs=2e-4)


def test_who_is_told_of_the_progress_may_end_the_march():
    told = []

    def tell(reached):
        told.append(reached)
        return len(told) == 2

    system = rails.one_wheel(rails.wave(1e-5, 0.05, 0.1), 20.0)
    found = march(system, DEFAULT, 10.0, tell=tell)
    assert found.status == contract.FULL
    assert found.time == told[-1] == pytest.approx(2.0 * told[0])
    assert found.time < 10.0
    assert march(system, DEFAULT, told[0], tell=lambda reached: True).status == contract.DONE  # nothing is left


@pytest.mark.parametrize(("loss", "default"), [(1.0, 2e-9), (5.0, 1e-9), (20.0, 5e-8)])
@pytest.mark.parametrize("method", ["default", "strict"])
def test_a_law_that_would_pull_is_released_as_in_the_wheel_march(loss, default, method):
    """A flat in the surface of a law that would pull in every rebound faster than 1/loss.

    The strict method is right; by default ten nodes see a force that falls as steeply as 20 s/m makes it less well.
    """
    most = {"default": default, "strict": 1e-11}[method]
    flat = wt.WheelFlat(length=0.06, position=0.5, repeat=False)
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=600.0, load=1e5 - 9.81 * 600.0, wheels=1, radius=rails.RADIUS),
        contact=wt.Hertz(constant=9.4125e10, hysteresis=loss), irregularity=flat, speed=10.0, duration=0.1,
    )  # fmt: skip
    events = wt.simulate(scene, method).events
    law = Law(HUNT_CROSSLEY, np.array([9.4125e10, loss]))
    found = finished(rails.one_wheel(rails.flat(0.06, 0.5), 10.0, law=law), METHODS[method], 0.1)
    assert kinds(found) == events.kind.values.tolist()
    assert found.events[:, 0] == pytest.approx(events.time.values, abs=most, rel=0)
    released = found.events[(found.events[:, 1] == contract.LOSS), 2] + 1.0 / loss
    assert (np.abs(released) < 1e-6).any() or loss == 1.0


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("track", [None, (ROLLAND, 40, 1e3)], ids=["rigid", "rails"])
def test_a_loss_that_begins_at_a_kink_to_the_last_bit_is_an_ordinary_answer(track, method):
    """The gap of a flat is smallest at its middle, a kink: by length there is a first one that loses contact there."""
    ring = rails.ring(*track) if track else None
    low, high, runs = 0.005, 0.08, []
    while 0.5 * (low + high) not in (low, high):
        runs.append(finished(rails.one_wheel(rails.flat(0.5 * (low + high), 0.1), 30.0, ring), METHODS[method], 0.0045))
        low, high = (low, 0.5 * (low + high)) if len(runs[-1].events) else (0.5 * (low + high), high)
    last = [found.events[:, :2] for found in runs[-12:] if len(found.events)]
    for events in last:  # at the kink, for no longer than the gap is open
        assert events[:, 1].tolist() == [contract.LOSS, contract.IMPACT]
        assert events[:, 0] == pytest.approx(0.1 / 30.0, abs=1e-13, rel=0)
    assert last


def test_more_parts_than_allowed_end_the_march():
    edges = 0.5 + 1e-5 * np.arange(400)  # all of them in one or two macro steps
    pieces = rails.pieces_of(lambda x: 0.0 * x, edges)
    found = march(rails.one_wheel(pieces, 20.0), DEFAULT, 0.1)
    assert found.status == layout.CHATTERS


def test_a_law_with_losses_loses_contact_on_a_track_as_with_finer_steps():
    law = Law(HUNT_CROSSLEY, np.array([9.4125e10, 0.1]))
    system = rails.one_wheel(rails.wave(200e-6, 0.05, 0.6), 30.0, rails.ring(ZHAI), law)
    found, finer = (finished(system, method, 0.06) for method in (DEFAULT, DEFAULT._replace(step=1e-4)))
    assert kinds(found) == kinds(finer)
    assert kinds(found).count("loss") > 15
    assert found.events[:, 0] == pytest.approx(finer.events[:, 0], abs=1e-7, rel=0)


# -- speed zero, and corners -------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_wheels_that_stand_stay_at_rest_and_a_dropped_one_strikes_the_track():
    contacts = tuple(Contact(rails.level(), rails.HERTZIAN, x) for x in (0.25, -2.31))
    system = System(rails.free_wheels(2), contacts, 0.0, rails.ring(ROLLAND))
    still = finished(system, DEFAULT, 0.05)
    assert len(still.events) == len(still.peaks) == 0
    seen = replay(still, np.array([0.0, 0.021, 0.05]))
    assert seen.force == pytest.approx(rails.LOAD, rel=1e-6)
    assert seen.displacement == pytest.approx(0.0, abs=1e-11)
    rest = still.prepared.start
    dropped = rest._replace(bodies=np.array([-1e-3, 0.0, 0.0, 0.0]))
    found = finished(system, DEFAULT, 0.02, start=dropped)
    slow = System(system.bodies, contacts, 2.0, system.ring)
    moving = finished(slow, DEFAULT._replace(nodes=12), 0.02, start=dropped)
    assert kinds(found) == kinds(moving) == ["impact"]
    assert found.events[:, 0] == pytest.approx(moving.events[:, 0], rel=2e-3)
    assert found.peaks[:, 1].max() == pytest.approx(moving.peaks[:, 1].max(), rel=2e-2)


def test_maxima_at_corners_are_told():
    height, k = 1e-4, 0.5
    rows = rails.pieces_of(lambda x: height * (1.0 - np.abs(x - k) / 0.05), np.array([0.45, 0.5, 0.55]), (0.45, 0.5))
    rows[-1, contract.JOIN] = contract.KINK
    found = finished(rails.one_wheel(rows, 10.0), DEFAULT, 0.08)
    corners = found.peaks[found.peaks[:, 3] == 1.0]
    assert len(corners) < len(found.peaks)
    assert np.abs(10.0 * corners[:, 0, None] - np.array([0.45, 0.5, 0.55])).min(axis=1) == pytest.approx(0.0, abs=1e-12)


def test_a_wheel_that_creeps_is_refused_before_memory_is_full():
    with pytest.raises(ValueError, match=r"below 0\.25 m/s"):
        march(rails.one_wheel(rails.level(), 0.1, rails.ring(ROLLAND)), DEFAULT, 1e-3)


def test_steps_follow_the_fastest_mode():
    fast = rails.ring(ROLLAND, 20, 12e3)
    found = march(rails.one_wheel(rails.level(), 20.0, fast), DEFAULT, 1e-3)
    assert found.prepared.grid.longest * np.abs(fast.rates).max() < 6.4
    assert march(rails.flat_60mm(), DEFAULT, 1e-3).prepared.grid.longest == pytest.approx(2e-4)


def wheels_at(places, speed):
    """Return wheels on a level rail."""
    contacts = tuple(Contact(rails.level(), rails.HERTZIAN, x) for x in places)
    return System(rails.free_wheels(len(places)), contacts, speed, rails.ring(ROLLAND))


@pytest.mark.parametrize(
    "places", [(0.0,), (0.1234,), (0.0, -2.537), (0.31, 0.31 - 1.7), (-0.05, -1.85, -17.552, -19.352), (5.1, -5.1)]
)
@pytest.mark.parametrize("speed", [0.71, 20.0, 61.3])
def test_macro_steps_end_where_any_wheel_passes_a_seat(places, speed):
    system, bay = wheels_at(places, speed), 0.6
    grid = grid_of(system, DEFAULT)
    step = longest_step(system.ring, DEFAULT, system.bodies)
    fewest = int(np.ceil(bay / (speed * step)))
    assert len(grid.which) <= max(1.15 * fewest + 1.0, fewest + len(places))
    assert grid.longest <= step * (1.0 + 1e-9)
    passages = np.sort(np.concatenate([(-np.array(places) % bay + bay * lap) / speed for lap in range(4)]))
    at = grid.steps(passages)
    assert at == pytest.approx(np.rint(at), abs=2e-6, rel=0)
    times = np.linspace(0.0, 4.0 * bay / speed, 3001)
    assert grid.times(grid.steps(times)) == pytest.approx(times, abs=1e-13, rel=0)
    ends = grid.times(np.arange(3 * len(grid.which) + 1))
    assert np.diff(ends) == pytest.approx(grid.seconds(np.arange(len(ends) - 1)), rel=1e-8)
    assert ends[:: len(grid.which)] == pytest.approx(bay / speed * np.arange(4), rel=1e-12)


@pytest.mark.slow
def test_a_seat_below_one_of_several_wheels_is_not_smoothed():
    """Wheels 2.537 m apart on seats every 0.6 m, the first one between two of them: each passes its own at its time."""
    paths = rails.flat(0.04, 0.45), rails.flat(0.05, 0.55)
    contacts = [Contact(path, rails.HERTZIAN, 0.37 - 2.537 * i) for i, path in enumerate(paths)]
    system = System(rails.free_wheels(2), tuple(contacts), 20.0, rails.ring(ROLLAND))
    finest = finished(system, STRICT._replace(step=5e-5), 0.04)
    assert len(finest.events) >= 4
    assert {0.0, 1.0} == set(finest.events[:, 3])
    passages = [(-contact.position % 0.6) / 20.0 for contact in contacts]
    times = np.add.outer(passages, np.linspace(-2e-4, 2e-4, 101)).ravel()
    there = replay(finest, times).force
    for method, event, force in ((STRICT, 1e-12, 1e-9), (DEFAULT, 1e-9, 5e-7)):
        found = finished(system, method, 0.04)
        assert len(found.prepared.grid.lengths) == 3
        assert found.events[:, 1:4:2].tolist() == finest.events[:, 1:4:2].tolist()
        assert found.events[:, 0] == pytest.approx(finest.events[:, 0], abs=event, rel=0)
        assert replay(found, times).force == pytest.approx(there, abs=force * rails.LOAD, rel=0)
