"""One suite over the elastic-plastic laws: their curves, impacts on one spot, rolling over virgin rail.

The laws are those of the registry. What is said of single laws below is what was published of them; of one that is not
mentioned it is expected that nothing jumps and that no impact gives more energy back than it took.
"""

import warnings

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

import wheeltapper as wt
from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.registry import makeable_nouns
from wheeltapper.lower.laws.plastic import law_rows, left_after, loading_force, stored_below
from wheeltapper.record.simulate import ModelWarning

MASS, LOAD, CONSTANT = 1500.0, 91_307.0, 1.405e11
N0 = LOAD + MASS * 9.81


def laws():
    return {kind.__name__: kind for kind in makeable_nouns(ElasticPlastic)}


LAWS = laws()
NAMES = sorted(LAWS)
PUBLISHED_JUMPS = {
    "JacksonGreen": {1.9: 0.00474},
    "KogutEtsion": {1.0: 0.03, 6.0: 0.01679},
}
LARGEST_RESTITUTION = {"KogutEtsion": 1.00947, "Stronge": 1.06072}
GIVES_BACK_MORE_BELOW = {"KogutEtsion": 1.38407, "Stronge": 3.65520}
GROWS = np.unique(np.concatenate([np.linspace(1.0, 8.0, 701), np.geomspace(8.0, 250.0, 100)]))
JUST = 1e-12
"""Time, s, after a peak: from there on indentations count from the flattened surface."""
DECK = wt.FloatingDeck(mass=5000, stiffness=2e7, damping=1e4)
pytestmark = pytest.mark.filterwarnings("ignore:.* energy back than it took")


def law(name, **fields):
    return LAWS[name](constant=CONSTANT, **fields)


def force(contact, depth):
    """N/N_Y of a virgin surface at D."""
    depth = np.asarray(depth)
    return np.where(depth <= 1.0, np.maximum(depth, 0.0) ** 1.5, contact.loading(np.maximum(depth, 1.0)))


def stored(contact, depth):
    """The work that unloading from D ≥ 1 gives back, over N_Y·δ_Y."""
    return 0.4 * contact.loading(depth) * (depth - contact.residual(depth))


def loading_work(contact, depth):
    """The work of loading up to D ≥ 1, over N_Y·δ_Y."""
    borders = [1.0, *(b for b in contact.borders if b < depth), depth]
    pieces = [
        quad(contact.loading, a, b, epsabs=0, epsrel=1e-12)[0] for a, b in zip(borders, borders[1:], strict=False)
    ]
    return 0.4 + sum(pieces)


def lost(contact, depth):
    return loading_work(contact, depth) - stored(contact, depth)


def depth_at(contact, ratio):
    return brentq(lambda depth: contact.loading(depth) - ratio, 1.0, 1e3, xtol=1e-14)


def drop(contact, speed, duration=0.02, damping=0.0, **fields):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=MASS, load=LOAD, damping=damping),
        contact=contact,
        speed=0.0,
        duration=duration,
        start={"displacement": 0.0, "velocity": -speed},
        **fields,
    )


def rolling(contact, height=2e-4, **fields):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=MASS, load=LOAD, stiffness=2.44e6, damping=2e4),
        contact=contact,
        irregularity=wt.CosineBump(height=height, length=0.06, start=0.05) if height else None,
        rolling="point",
        speed=8,
        duration=0.06,
        **fields,
    )


@pytest.mark.parametrize("name", NAMES)
def test_the_force_does_not_jump_and_has_a_kink_at_yield_of_stronges_law_only(name):
    contact = law(name)
    depths = np.unique(np.concatenate([np.linspace(1.0, 8.0, 70_001), np.geomspace(8.0, 300.0, 20_000)]))
    found = contact.loading(depths)
    assert found[0] == pytest.approx(1.0, abs=1e-15)
    slopes = np.diff(np.log(found)) / np.diff(np.log(depths))
    assert slopes.min() > 0.9
    assert slopes.max() < 2.61
    assert slopes[0] == pytest.approx(2.606 if name == "Stronge" else 1.5, abs=2e-3)
    for border in contact.borders:
        below, above = contact.loading(np.nextafter(border, [0.0, np.inf]))
        assert above == pytest.approx(below, rel=1e-14)


@pytest.mark.parametrize("name", sorted(PUBLISHED_JUMPS))
def test_what_jumps_as_published_goes_over_smoothly_behind_the_border(name):
    contact = law(name)
    for border, jump in PUBLISHED_JUMPS[name].items():
        end = min(b for b in contact.borders if b > border)
        assert end <= 1.1 * border
        before, after = float(contact.loading(border)), float(contact.loading(end))
        rise = np.log(after / before) - np.log1p(jump)
        assert 1.2 < rise / np.log(end / border) < 1.5  # without the jump it is the power law of either side
        inner = contact.loading(np.linspace(border, end, 1001))
        assert np.all(np.diff(inner) > 0.0)


@pytest.mark.parametrize("name", NAMES)
def test_loading_and_residual_rise_with_the_indentation(name):
    contact = law(name)
    depths = np.geomspace(1.0, 300.0, 100_001)
    residual = contact.residual(depths)
    assert np.all(np.diff(contact.loading(depths)) > 0.0)
    assert residual[0] == pytest.approx(0.0, abs=1e-15)
    assert np.all(np.diff(residual) > 0.0)
    assert np.all(residual < depths)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_an_impact_gives_back_more_than_it_took_only_where_said(name):
    contact = law(name)
    ratios = np.array([np.sqrt(stored(contact, d) / loading_work(contact, d)) for d in GROWS])
    assert ratios.max() == pytest.approx(LARGEST_RESTITUTION.get(name, 1.0), abs=1e-5)
    if name in GIVES_BACK_MORE_BELOW:
        even = depth_at(contact, GIVES_BACK_MORE_BELOW[name])
        assert lost(contact, even) == pytest.approx(0.0, abs=1e-5)
        more = (GROWS > 1.0) & (even > GROWS)
        assert np.all(ratios[more] > 1.0)
        assert np.all(ratios[even < GROWS] < 1.0)
    else:
        assert np.all(ratios < 1.0 + 1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_what_is_lost_grows_with_the_indentation_but_for_what_is_published(name):
    contact = law(name)
    shrinks = GROWS[:-1][np.diff([lost(contact, d) for d in GROWS]) < -1e-12]
    if name == "Stronge":
        assert shrinks.max() == pytest.approx(1.482, abs=0.015)
        assert len(shrinks) == np.searchsorted(GROWS, shrinks.max()) + 1
    elif name == "KogutEtsion":
        assert shrinks.max() < 1.1
    else:
        assert len(shrinks) == 0


@pytest.mark.parametrize("begins", [0.01, 1.0, 30.0])
@pytest.mark.parametrize("name", NAMES)
def test_the_pieces_are_the_law(name, begins):
    contact = law(name)
    rows = law_rows(contact, begins)
    depths = np.geomspace(1.0 + 1e-9, 250.0, 20_011)
    np.testing.assert_allclose(loading_force(rows, depths * begins), begins**1.5 * contact.loading(depths), rtol=2e-12)
    left = left_after(rows, depths * begins) / begins
    assert np.abs((left - contact.residual(depths)) / depths).max() < 2e-12
    below = np.array([-0.1, 0.0, 0.3, 1.0])
    np.testing.assert_allclose(loading_force(rows, below * begins), begins**1.5 * force(contact, below), rtol=1e-14)
    assert np.all(left_after(rows, below * begins) == 0.0)
    np.testing.assert_allclose(
        stored_below(rows, below * begins), 0.4 * (begins * np.maximum(below, 0.0)) ** 2.5, rtol=1e-14
    )
    for depth in (1.3, 1.9, 2.5, 6.0, 7.0, 50.0, 90.0, 200.0):
        work = stored_below(rows, np.asarray(depth * begins)) / begins**2.5
        assert work == pytest.approx(loading_work(contact, depth), rel=1e-12)


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("speed", [0.08, 0.2, 0.5, 2.0])
@pytest.mark.parametrize("name", NAMES)
def test_an_impact_loses_what_the_law_says_and_the_energy_closes(name, speed, method):
    contact = law(name, yield_force=1.5e5)
    record = wt.simulate(drop(contact, speed, duration=0.006), method)
    energy = record.energy
    assert abs(float(energy.relative_imbalance)) < 1e-9
    assert float(energy.dissipated) == float(energy.dissipated_contact)
    balance = energy.kinetic + energy.elastic + energy.dissipated_contact
    exchanged = 0.5 * MASS * speed**2 + abs(float(energy.work_of_load))
    assert abs(float(balance - energy.work_of_load)) < 1e-9 * exchanged

    unit = contact.yield_indentation(CONSTANT, 2, N0)
    at_peak = record.at(record.peaks.time[0] + JUST)
    depth = (at_peak.indentation + at_peak.permanent_indentation).item() / unit
    assert record.peaks.normal_force[0].item() == pytest.approx(1.5e5 * contact.loading(depth), rel=1e-9)
    assert at_peak.permanent_indentation.item() == pytest.approx(unit * contact.residual(depth), rel=1e-9)
    assert float(energy.dissipated_contact) / (1.5e5 * unit) == pytest.approx(lost(contact, depth), rel=1e-8)
    loses = record.peaks.normal_force[0].item() > GIVES_BACK_MORE_BELOW.get(name, 0.0) * 1.5e5
    assert (float(energy.dissipated_contact) > 0.0) == loses


@pytest.mark.parametrize("name", NAMES)
def test_unloading_meets_loading(name):
    record = wt.simulate(drop(law(name, yield_force=1.5e5), 0.3))
    time, peak = record.peaks.time.values[0], record.peaks.normal_force.values[0]
    around = record.at(time + np.array([-1e-10, 1e-10]))
    np.testing.assert_allclose(around.normal_force, peak, rtol=1e-10)
    np.testing.assert_allclose(np.diff(around.permanent_indentation), 0.0, atol=1e-15)
    np.testing.assert_allclose(np.diff(around.wheel_displacement), 0.0, atol=1e-13)
    np.testing.assert_allclose(np.diff(around.wheel_velocity), 0.0, atol=1e-6)


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("name", NAMES)
def test_a_bouncing_wheel_yields_once(name, method):
    record = wt.simulate(drop(law(name, yield_force=1.5e5), 0.4, duration=0.1, damping=2e3), method)
    assert record.events.kind.values[:3].tolist() == ["yield", "loss", "impact"]
    assert (record.events.kind == "yield").sum() == 1
    assert len(record.impacts.time) >= 8
    left = record.at(np.linspace(record.peaks.time.values[0], record.end, 200)).permanent_indentation
    np.testing.assert_allclose(left, left[0], rtol=1e-14)
    assert np.argmax(record.peaks.normal_force.values) == 0


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("name", NAMES)
def test_a_spot_yields_again_only_above_the_largest_force_that_it_carried(name, method):
    light = wt.FloatingDeck(mass=500, stiffness=2e8, damping=1e4)
    contact = law(name, yield_force=1e5)
    unit = contact.yield_indentation(CONSTANT, 2, N0)
    record = wt.simulate(drop(contact, 0.7, track=light), method)
    peaks, forces = record.peaks.time.values, record.peaks.normal_force.values
    yields = record.events.time.values[record.events.kind == "yield"]
    assert len(yields) >= 3
    carried = forces[np.searchsorted(peaks, yields[1:]) - 1]
    largest = np.maximum.accumulate(forces)[np.searchsorted(peaks, yields[1:]) - 1]
    np.testing.assert_array_equal(carried, largest)
    np.testing.assert_allclose(record.at(yields[1:]).normal_force, carried, rtol=1e-9)

    for start, end in zip(yields, [*yields[1:], record.end], strict=True):
        peak = np.searchsorted(peaks, start)
        depth = depth_at(contact, forces[peak] / 1e5)
        left = float(contact.residual(depth))
        after = record.at(np.linspace(peaks[peak], end, 300)[:-1])
        borne = np.maximum(after.indentation / unit, 0.0) / (depth - left)
        np.testing.assert_allclose(after.normal_force, forces[peak] * borne**1.5, rtol=0, atol=1e-9 * forces[peak])
        np.testing.assert_allclose(after.permanent_indentation, unit * left, rtol=1e-9)
        assert np.all(after.normal_force <= forces[peak] * (1 + 1e-9))
    assert abs(float(record.energy.relative_imbalance)) < 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_both_methods_agree_on_one_spot(name):
    scene = drop(law(name, yield_force=1e5), 0.7, damping=2e3, track=DECK)
    default, strict = (wt.simulate(scene, method) for method in ("default", "strict"))
    assert default.events.kind.values.tolist() == strict.events.kind.values.tolist()
    np.testing.assert_allclose(default.events.time, strict.events.time, rtol=0, atol=1e-10)
    np.testing.assert_allclose(default.peaks.normal_force, strict.peaks.normal_force, rtol=1e-8)


@pytest.mark.parametrize("track", [wt.StiffTrack(), DECK])
@pytest.mark.parametrize("yield_force", [3e4, 8e4, 1.2e5, 3e5])
@pytest.mark.parametrize("name", NAMES)
def test_over_virgin_rail_the_loading_curve_holds_in_both_directions(name, yield_force, track):
    contact = law(name, yield_force=yield_force)
    unit = contact.yield_indentation(CONSTANT, 2, N0)
    for method in ("default", "strict"):
        record = wt.simulate(rolling(contact, track=track), method)
        history = record.history(1e5)
        depth = history.indentation.values / unit
        assert depth.max() > 1.2
        assert depth.min() < 0.0
        expected = yield_force * force(contact, depth)
        np.testing.assert_allclose(history.normal_force, expected, rtol=0, atol=3e-11 * yield_force)
        left = np.where(depth <= 1.0, 0.0, contact.residual(np.maximum(depth, 1.0)))
        np.testing.assert_allclose(history.permanent_indentation, unit * left, rtol=0, atol=1e-11 * unit)
        assert abs(float(record.energy.relative_imbalance)) < 1e-9
        assert abs(float(record.energy.dissipated_contact)) < 1e-9 * yield_force * unit


@pytest.mark.parametrize("track", [wt.StiffTrack(), DECK])
@pytest.mark.parametrize("name", NAMES)
def test_rolling_yields_exactly_where_the_indentation_reaches_its_bound(name, track):
    contact = law(name, yield_force=1.2e5)
    unit = contact.yield_indentation(CONSTANT, 2, N0)
    record = wt.simulate(rolling(contact, track=track), "strict")
    onsets = record.events.isel(event=(record.events.kind == "yield").values)
    assert len(onsets.time) >= 5
    assert np.all(onsets.indentation_rate > 0.0)
    np.testing.assert_allclose(record.at(onsets.time).indentation, unit, rtol=1e-9)
    history = record.history(1e6)
    rises = np.diff((history.indentation > unit).values.astype(int)) > 0
    np.testing.assert_allclose(onsets.time, history.time[:-1][rises] + 5e-7, rtol=0, atol=5.1e-7)


@pytest.mark.parametrize("track", [wt.StiffTrack(), DECK])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("speed", [0.0, 8.0])
def test_a_static_load_beyond_yield_starts_in_equilibrium(name, speed, track):
    contact = law(name, yield_strength="500 MPa")
    unit = contact.yield_indentation(CONSTANT, 2, N0)
    scene = rolling(contact, height=0.0, track=track).replaced({"speed": speed})
    record = wt.simulate(scene)
    history = record.history(1e4)
    sunk = history.indentation.values[0] + (0.0 if speed else history.permanent_indentation.values[0])
    depth = sunk / unit
    assert depth > 2.0
    assert record.static_force == pytest.approx(CONSTANT * unit**1.5 * contact.loading(depth), rel=1e-10)
    assert record.static_force == pytest.approx(N0 - 2.44e6 * sunk, rel=1e-12)
    np.testing.assert_allclose(history.normal_force, record.static_force, rtol=1e-10)
    np.testing.assert_allclose(history.wheel_acceleration, 0.0, atol=1e-8)
    np.testing.assert_allclose(history.wheel_displacement, -sunk, rtol=1e-10)
    np.testing.assert_allclose(history.permanent_indentation, unit * contact.residual(depth), rtol=1e-10)
    assert len(record.peaks.time) == 0
    assert record.events.kind.values.tolist() == (["yield"] if speed else [])  # a spot at rest has borne its load


def test_stronges_law_warns_of_impacts_on_one_spot_only():
    contact = law("Stronge", yield_force=1.5e5)
    with pytest.warns(ModelWarning, match="more energy back"):
        record = wt.simulate(drop(contact, 0.3))
    assert "more energy back" in record.notes[-1]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert wt.simulate(rolling(contact)).notes == ()
        wt.simulate(drop(law("Thornton", yield_force=1.5e5), 0.3))


@pytest.mark.parametrize(("name", "limit"), [("KogutEtsion", 110), ("JacksonGreen", 250)])
def test_a_law_used_beyond_its_limit_warns(name, limit):
    contact = law(name, yield_force=2e3)
    reached = 2e3 * float(contact.loading(limit))
    with pytest.warns(ModelWarning, match=f"holds up to {limit} times the indentation at yield"):
        beyond = wt.simulate(drop(contact, 1.5))
    assert beyond.peaks.normal_force.max() > reached
    with warnings.catch_warnings():
        warnings.filterwarnings("error", message=".* holds up to")
        within = wt.simulate(drop(contact, 0.2))
    assert within.peaks.normal_force.max() < reached
