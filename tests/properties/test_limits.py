"""Limits between models, scaling, convergence."""

import numpy as np
import pytest

import wheeltapper as wt
from tests import scenes
from wheeltapper.lower.numbers import METHODS, Method

BUMP = scenes.BUMP.replaced({"duration": 0.06})


def test_scaling_mass_load_suspension_and_contact_together_changes_nothing():
    one = wt.simulate(BUMP, "strict")
    v, s = BUMP.vehicle, 0.37
    scaled = BUMP.replaced(
        {
            "vehicle.mass": s * v.mass,
            "vehicle.load": s * v.load,
            "vehicle.stiffness": s * v.stiffness,
            "vehicle.damping": s * v.damping,
            "contact.constant": s * 1.405e11,
        }
    )
    other = wt.simulate(scaled, "strict")
    np.testing.assert_allclose(other.events.time, one.events.time, rtol=1e-13)
    np.testing.assert_allclose(other.peaks.normal_force, s * one.peaks.normal_force, rtol=1e-11)


@pytest.mark.filterwarnings("ignore:.*is implausible")
def test_a_heavy_deck_is_the_stiff_track():
    stiff = wt.simulate(BUMP, "strict")
    differences = []
    for mass in (1e9, 1e11):
        deck = BUMP.replaced({"track": wt.FloatingDeck(mass=mass, stiffness=mass * (2 * np.pi * 5) ** 2)})
        record = wt.simulate(deck, "strict")
        assert len(record.events.time) == len(stiff.events.time)
        differences.append(np.abs(record.events.time.values - stiff.events.time.values).max())
    assert differences[1] < 1e-9
    assert differences[0] / differences[1] == pytest.approx(100, rel=0.02)  # first order in 1/M


def test_the_error_falls_with_the_tolerance_as_the_order_says(monkeypatch):
    truth = wt.simulate(BUMP, "strict")
    errors = []
    tolerances = 10.0 ** np.arange(-3, -7, -1)
    for tolerance in tolerances:
        monkeypatch.setitem(METHODS, "default", Method(12, float(tolerance), 1e-13))
        record = wt.simulate(BUMP, "default")
        smooth = record.peaks.normal_force.values
        errors.append(np.abs(smooth / truth.peaks.normal_force.values - 1).max())
    rate = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    # The local error of a step of order P is tolerance·(h/h_last)^…: global error ~ tolerance^(P/(P-1)) per unit length
    assert rate == pytest.approx(12 / 11, abs=0.2)


def test_damping_and_deck_energies_balance():
    for track in (wt.StiffTrack(), wt.FloatingDeck(mass=750, stiffness=3e6, damping=2e4, start=0.05, length=0.3)):
        for contact in (wt.Hertz(constant=1.405e11, hysteresis=0.4), wt.Hertz(), wt.Linear(stiffness=1.9e9)):
            record = wt.simulate(BUMP.replaced({"track": track, "contact": contact}), "strict")
            assert abs(record.energy.relative_imbalance.item()) < 2e-11
