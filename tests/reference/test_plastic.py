"""Elastic-plastic contacts against the reference impacts and the published laws (docs/theory/elastic_plastic.rst)."""

from math import sqrt

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import wheeltapper as wt

from ..cases import reference

MASS, N0, CONSTANT = 1500.0, 106_022.0, 1.405e11
MODELS = {"stronge": wt.contact.Stronge, "thornton": wt.contact.Thornton}
LIMITS = {"default": 1e-10, "strict": 1e-11}
JUST = 1e-12
"""Time, s, after a peak: from there on indentations count from the flattened surface."""
DEPTHS = np.array([2.0, 5.0, 10.0, 50.0, 110.0])
pytestmark = pytest.mark.filterwarnings("ignore:Stronge's law gives more energy back")


def law(name, **fields):
    return getattr(wt.contact, name)(**({"constant": CONSTANT} | fields))


def impacts_of(row, method, duration=0.03):
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=MASS, load=N0 - MASS * 9.81),
        contact=MODELS[row["model"]](constant=CONSTANT, yield_force=2 * N0),
        speed=0.0,
        duration=duration,
        start={"displacement": 0.0, "velocity": -float(row["v_in"])},
    )
    return wt.simulate(scene, method)


def loading_work(contact, depth):
    """The work up to D ≥ 1 over that of N_Y along δ_Y."""
    borders = [1.0, *(b for b in contact.borders if b < depth), depth]
    pieces = [
        quad(contact.loading, a, b, epsabs=0, epsrel=1e-12)[0] for a, b in zip(borders, borders[1:], strict=False)
    ]
    return 0.4 + sum(pieces)


def restitution(contact, depth):
    given_back = 0.4 * contact.loading(depth) * (depth - contact.residual(depth))
    return sqrt(given_back / loading_work(contact, depth))


def depth_at(contact, force):
    """D at which the loading force is `force` times N_Y."""
    return brentq(lambda depth: contact.loading(depth) - force, 1.0, 1e4, xtol=1e-14)


def thornton_restitution(x):
    """Thornton (1997), x the speed at which yield begins over the impact's."""
    return sqrt(1.2 * sqrt(3) * (1 - x**2 / 6) * sqrt(x / (x + 2 * sqrt(1.2 - 0.2 * x**2))))


@pytest.mark.parametrize("method", LIMITS)
def test_impacts_reach_the_reference_digits(method):
    for row in reference()["static"]["plastic_impact"]["rows"]:
        record = impacts_of(row, method)
        at_peak = record.at(record.peaks.time[0] + JUST)
        losses = record.events.indentation_rate[record.events.kind == "loss"]
        found = {
            "N_max": record.peaks.normal_force[0],
            "delta_max": at_peak.indentation + at_peak.permanent_indentation,
            "delta_residual": at_peak.permanent_indentation,
            "v_at_loss_of_contact": -losses[0],
        }
        for name, value in found.items():
            assert value.item() == pytest.approx(float(row[name]), rel=LIMITS[method]), name


def test_the_second_impact_on_a_spot_is_elastic():
    for row in reference()["static"]["plastic_impact"]["rows"]:
        record = impacts_of(row, "strict")
        assert record.events.kind.values[:4].tolist() == ["yield", "loss", "impact", "loss"]
        assert (record.events.kind == "yield").sum() == 1
        _, first, closing, leaving = np.abs(record.events.indentation_rate.values[:4])
        assert closing == pytest.approx(first, rel=1e-12)
        assert leaving == pytest.approx(closing, rel=1e-12)
        assert record.peaks.normal_force[1].item() == pytest.approx(float(row["N_max"]), rel=1e-12)


@pytest.mark.parametrize(
    ("name", "expected", "digits"),
    [
        ("JacksonGreen", [2.83, 10.1, 25.9, 203, 521], [0.005, 0.05, 0.05, 0.5, 0.5]),
        ("KogutEtsion", [2.77, 10.2, 25.7, 196, 530], [0.005, 0.05, 0.05, 0.5, 0.5]),
        ("Stronge", [4.0, 15.0, 36, 237, 219 * 2.8 / 1.1], [0.05, 0.05, 0.5, 0.5, 1e-9]),
        ("Thornton", [2.5, 7.0, 14.5, 74.5, 164.5], [1e-9] * 5),
    ],
)
def test_loading_forces_are_the_tabled_ones(name, expected, digits):
    assert np.all(np.abs(law(name).loading(DEPTHS) - expected) < digits)


def test_stronges_formula_goes_on_to_577_without_full_plasticity():
    x = 2 * 110.0 - 1
    assert x * (1 + np.log(x) / 3.3) == pytest.approx(577, abs=0.5)
    (full,) = law("Stronge").borders
    assert full == pytest.approx(82.5, abs=0.05)
    assert law("Stronge").loading(np.nextafter(full, 0)) == pytest.approx((2 * full - 1) * 2.8 / 1.1, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("KogutEtsion", [0.067, 0.243, 0.378, 0.621, 0.703]),
        ("JacksonGreen", [0.072, 0.223, 0.370, 0.690, 0.798]),
    ],
)
def test_residual_fractions_are_the_tabled_ones(name, expected):
    np.testing.assert_allclose(law(name).residual(DEPTHS) / DEPTHS, expected, rtol=0, atol=5e-4)


@pytest.mark.parametrize(
    ("strength", "force", "depth"),
    [(350, 9.4, 22), (500, 27.4, 44), (600, 47.4, 63), (785, 106, 109), (900, 160, 143)],
)
def test_yield_begins_where_the_sphere_says(strength, force, depth):
    radius = sqrt(0.46 * 0.3)
    contact = law("Thornton", constant=None, yield_strength=f"{strength} MPa")
    constant = 4 / 3 * contact.modulus * sqrt(radius)
    found = contact.yield_indentation(constant, 1, N0)
    begins = constant * found**1.5
    assert 1e6 * found == pytest.approx(depth, abs=0.5)
    assert 1e-3 * begins == pytest.approx(force, abs=0.5 if force > 100 else 0.05)
    strain = contact.yield_strength / contact.modulus
    assert begins == pytest.approx(21.17 * radius**2 * contact.yield_strength * strain**2, rel=5e-4)
    assert contact.yield_indentation(2 * constant, 2, N0) == pytest.approx(found, rel=1e-12)


def test_the_other_laws_begin_to_yield_at_their_own_pressures():
    strength = 500e6
    pressures = {
        "Thornton": 1.60 * strength,
        "Stronge": 1.60 * strength,
        "JacksonGreen": 1.295 * np.exp(0.736 * 0.3) * strength,
        "KogutEtsion": (0.454 + 0.41 * 0.3) * 2.8 * strength,
    }
    constant, modulus = 9.4125e10, 210e9 / (2 * (1 - 0.3**2))
    radius = (0.75 * constant / modulus) ** 2
    for name, pressure in pressures.items():
        given = law(name, yield_strength=strength).yield_indentation(constant, 1, N0)
        assert given == pytest.approx((np.pi * pressure / (2 * modulus)) ** 2 * radius, rel=1e-12)
        by_hardness = law(name, hardness=2.8 * strength)
        assert by_hardness.yield_indentation(constant, 1, N0) == pytest.approx(given, rel=1e-12)


@pytest.mark.parametrize(
    ("peak", "left", "speeds"), [(2.5, 1.24, 0.992), (3, 4.51, 0.977), (4, 15.5, 0.941), (5, 30.6, 0.907)]
)
def test_thorntons_impacts_on_the_papers_wheelset(peak, left, speeds):
    contact = law("Thornton")
    depth = depth_at(contact, peak / 2)
    unit = contact.yield_indentation(CONSTANT, 2, N0)
    assert 1e6 * unit * contact.residual(depth) == pytest.approx(left, abs=0.005 if left < 10 else 0.06)
    assert restitution(contact, depth) == pytest.approx(speeds, abs=5e-4)


def test_stronges_contact_is_stiffer_than_hertzs_just_above_yield():
    contact = law("Stronge")
    unit = contact.yield_indentation(CONSTANT, 2, N0)
    assert 1e6 * unit * depth_at(contact, 1.5) == pytest.approx(155.9, abs=0.05)
    assert pytest.approx(172.4, abs=0.05) == 1e6 * (3 * N0 / CONSTANT) ** (2 / 3)
    assert restitution(contact, depth_at(contact, 2.0)) == pytest.approx(1.059, abs=5e-4)
    assert restitution(contact, depth_at(contact, 7.3 / 2)) == pytest.approx(1.0, abs=5e-4)


@pytest.mark.parametrize(("x", "expected"), [(0.5, 0.9306), (0.2, 0.7733), (0.1, 0.6586), (0.01, 0.3743)])
def test_thorntons_restitution_is_its_closed_form(x, expected):
    contact = law("Thornton")
    depth = brentq(lambda d: loading_work(contact, d) * x**2 - 0.4, 1.0, 1e3, xtol=1e-13)
    assert restitution(contact, depth) == pytest.approx(thornton_restitution(x), rel=1e-11)
    assert thornton_restitution(x) == pytest.approx(expected, abs=5e-5)


@pytest.mark.parametrize("x", [0.5, 0.2, 0.1])
def test_a_simulated_impact_has_thorntons_restitution(x):
    contact, load, height = law("Thornton", yield_force=2 * N0), 100.0, 1e-6
    unit = contact.yield_indentation(CONSTANT, 2, N0)
    energy = 2 * N0 * unit
    speed = sqrt(0.8 * energy / MASS) / x
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=MASS, load=load, gravity=0.0),
        contact=contact,
        speed=0.0,
        duration=0.01,
        start={"displacement": height, "velocity": -speed},
    )
    record = wt.simulate(scene, "strict")
    assert record.events.kind.values.tolist() == ["impact", "yield", "loss"]
    leaving = -record.events.indentation_rate[-1].item()
    assert leaving / speed == pytest.approx(thornton_restitution(x), rel=1e-4)

    # With the work of the light load the agreement is exact.
    depth = brentq(
        lambda d: loading_work(contact, d) - 0.4 / x**2 - load * (height + d * unit) / energy, 1.0, 1e3, xtol=1e-13
    )
    lost = loading_work(contact, depth) * (1 - restitution(contact, depth) ** 2) * energy
    descent = height + contact.residual(depth) * unit
    assert leaving**2 == pytest.approx(speed**2 + 2 / MASS * (load * descent - lost), rel=1e-11)
