"""Laws without reference digits, against an independent integration in time (tests/peer.py)."""

import numpy as np
import pytest

import wheeltapper as wt
from tests.peer import Wheel

BASE = {"mass": 1500.0, "load": 91_307.0, "stiffness": 2.44e6, "damping": 2e4}
CONSTANT = 1.405e11
HEIGHT = 2e-4


def check(peer, duration, tolerance=2e-9, **fields):
    contact = fields.pop("contact", wt.Hertz(constant=CONSTANT))
    record = wt.simulate(
        wt.Scenario(
            vehicle=wt.Wheelset(**BASE),
            contact=contact,
            irregularity=wt.CosineBump(height=peer.height, length=peer.length, start=peer.start)
            if peer.height
            else None,
            rolling="point",
            speed=peer.speed,
            duration=duration,
            **fields,
        ),
        "strict",
    )
    found, state = peer.solve(duration)
    assert record.events.kind.values.tolist() == [kind for _, kind in found]
    np.testing.assert_allclose(record.events.time.values, [t for t, _ in found], rtol=0, atol=tolerance)
    last = record.at(record.end)
    assert float(last.wheel_displacement[0]) == pytest.approx(state[0], abs=1e-10)
    assert float(last.wheel_velocity[0]) == pytest.approx(state[1], abs=1e-7)
    if peer.deck:
        assert float(last.deck_displacement[0]) == pytest.approx(state[2], abs=1e-10)
    return record


@pytest.mark.parametrize("hysteresis", [0.1, 1.0, 8.0])
def test_hunt_crossley_damping_with_its_released_phase(hysteresis):
    peer = Wheel(**BASE, constant=CONSTANT, speed=9.0, height=HEIGHT, hysteresis=hysteresis)
    record = check(peer, 0.05, contact=wt.Hertz(constant=CONSTANT, hysteresis=hysteresis))
    history = record.history(2e5)
    assert float(history.normal_force.min()) == 0.0
    if hysteresis == 8.0:  # the damping alone holds the force at zero while the bodies still overlap
        assert np.any((history.normal_force.values == 0.0) & (history.indentation.values > 1e-9))


def test_a_wheel_that_runs_onto_a_deck_and_off_again():
    deck = (3000.0, 6e6, 4e4)
    peer = Wheel(**BASE, constant=CONSTANT, speed=10.0, height=HEIGHT, start=0.15, deck=deck, entry=0.01, leave=0.05)
    track = wt.FloatingDeck(mass=deck[0], stiffness=deck[1], damping=deck[2], start=0.1, length=0.4)
    record = check(peer, 0.08, track=track)
    times = record.events.time.values
    assert np.any((times > 0.01) & (times < 0.05))
    assert np.any(times > 0.05)


@pytest.mark.slow
def test_a_contact_constant_that_follows_the_curvature():
    def factor(x):
        inside = 0.05 <= x <= 0.1
        bend = 0.5 * HEIGHT * (2 * np.pi / 0.05) ** 2 * np.cos(2 * np.pi * (x - 0.05) / 0.05) if inside else 0.0
        return float(contact_constant(0.46, 0.3, 210e9, 0.3, -bend) / contact_constant(0.46, 0.3, 210e9, 0.3))

    from wheeltapper.lower.laws.ellipse import contact_constant  # its digits have their own references

    peer = Wheel(**BASE, constant=CONSTANT, speed=9.0, height=HEIGHT, factor=factor)
    check(peer, 0.03, tolerance=1e-8, contact=wt.Hertz(constant=CONSTANT, curvature=True))


@pytest.mark.parametrize("restitution", [0.95, 0.6, 0.2])
def test_a_free_impact_has_the_stated_restitution(restitution):
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500.0, load=0.0, gravity=1e-9),
        contact=wt.Hertz(constant=CONSTANT, restitution=restitution, impact_speed=0.3),
        speed=0.0,
        duration=0.05,
        start={"displacement": 1e-6, "velocity": -0.3},
    )
    events = wt.simulate(scene, "strict").events
    assert events.kind.values.tolist()[:2] == ["impact", "loss"]
    before, after = events.indentation_rate.values[:2]
    assert -after / before == pytest.approx(restitution, rel=1e-7)
