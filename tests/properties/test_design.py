"""What a passage can tell (Fisher's information), what it cannot, and rails designed to tell more."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import wheeltapper as wt
from tests.drawn import drawn
from wheeltapper.ask.trajectory import trajectory
from wheeltapper.describe.scenario import write_toml
from wheeltapper.describe.sensor import Sensor
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.inference.combinations import STATIC_LOAD, combinations
from wheeltapper.diagnosis.inference.information import information
from wheeltapper.diagnosis.inference.passages import Passages
from wheeltapper.diagnosis.site.design import design_site
from wheeltapper.diagnosis.site.layout import Family, Layout, RailFeature, laid_out

MASS, DAMPING, CONSTANT, SPRING = "vehicle.mass", "vehicle.damping", "contact.constant", "vehicle.stiffness"
KNOWN = {"speed": 0.01, "vehicle.load": 0.05}
HEIGHT, CONTACT = {"irregularity.0.height": 0.05}, {"contact.constant": 0.1}
DECK = {"track.mass": 0.01, "track.stiffness": 0.05, "track.damping": 0.2, "vehicle.radius": 0.04}
ALL = KNOWN | {SPRING: 0.2} | HEIGHT | CONTACT | DECK
CALIBRATED = KNOWN | {
    SPRING: 0.2, "irregularity.0.height": 0.005, "contact.constant": 0.02, "vehicle.radius": 0.002, "track.mass": 0.003,
}  # fmt: skip
RATE, SIGMA = 20e3, 0.0666
BUMP = wt.CosineBump(height=2e-4, length=0.05, start=0.009)
DIP = wt.CosineBump(height=-2e-4, length=0.05, start=0.009)
STEP = wt.Step(height=2e-4, position=0.05)


def site(uncertainty, rail=BUMP, deck=15_000, speed=9.0, duration=0.2, sensor=None, **changes):
    passage = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
        contact=wt.Hertz(constant=1.405e11),
        track=wt.FloatingDeck(mass=deck, stiffness=1.5e7, damping=5e4),
        irregularity=rail,
        speed=speed,
        duration=duration,
        **changes,
    )
    return Site(passage=passage, sensor=sensor or Sensor(noise=SIGMA / np.sqrt(RATE / 2)), uncertainty=uncertainty)


# -- what can be known: figures of another program ---------------------------------------------------------------------

ROWS = [
    # uncertain, rail, speed, deck, noise: 40 dB or m/s²; m, c, C in %, relative tolerance
    (KNOWN, BUMP, 9, 15_000, "40 dB", (0.01, 0.025), 0.2),
    (KNOWN | HEIGHT | CONTACT, BUMP, 9, 15_000, "40 dB", (1.7, 1.8, 2.3), 0.05),
    (KNOWN | HEIGHT | CONTACT, DIP, 9, 15_000, "40 dB", (0.8, 0.9, 1.1), 0.06),
    (KNOWN | HEIGHT | CONTACT, BUMP, 5, 15_000, "40 dB", (0.24, 0.27, 0.32), 0.03),
    (KNOWN | HEIGHT | CONTACT | DECK, BUMP, 9, 15_000, "40 dB", (3.25, 3.5, 4.4), 0.03),
    (KNOWN | HEIGHT | CONTACT | DECK, DIP, 9, 15_000, "40 dB", (3.25, 3.5, 4.4), 0.03),
    (KNOWN | CONTACT | DECK | {"irregularity.0.height": 0.05}, STEP, 9, 15_000, "40 dB", (3.25, 3.5, 4.4), 0.04),
    (KNOWN | HEIGHT | CONTACT | DECK, BUMP, 9, 15_000, 0.02452, (3.2, 3.45, 4.3), 0.02),
    (KNOWN | HEIGHT | CONTACT | DECK, BUMP, 9, 3_000, 0.02452, (1.15, 1.2, 1.15), 0.06),
]


@pytest.mark.parametrize("row", range(len(ROWS)))
def test_the_bounds_are_those_of_the_reference(row):
    """At 40 dB of each record's own rms, and with the time of the trigger unknown."""
    uncertainty, rail, speed, deck, noise, expected, near = ROWS[row]
    where = site(uncertainty, rail, deck, speed)
    named = (MASS, DAMPING, SPRING)
    if noise == "40 dB":
        noise = 0.01 * information(where, named, noise=1.0).signal[0]
    found = information(where, named, trigger=np.inf, noise=noise)
    told = [100 * float(found.deviation(path)[0]) for path in (MASS, DAMPING, CONSTANT)[: len(expected)]]
    assert told == pytest.approx(expected, rel=near)


@pytest.mark.parametrize("spring", [{}, {SPRING: 0.2}])
def test_the_suspension_s_stiffness_is_told_to_some_percent(spring):
    named = (MASS, DAMPING) if spring else (MASS, DAMPING, SPRING)
    found = information(site(ALL | spring), named, trigger=np.inf)
    assert 0.04 < float(found.deviation(SPRING)[0]) < 0.08


def test_what_is_told_best_and_what_not():
    found = combinations(information(site(ALL), trigger=np.inf))
    known = {tuple(sorted(one.exponents.items())): one for one in found.known}
    ratio = known[((DAMPING, 1.0), (MASS, -1.0))]
    assert ratio.deviation == pytest.approx(0.003, rel=0.15)
    assert "force scale" in ratio.reason
    assert "displacement scale" in ratio.reason
    stiff = known[((CONSTANT, float(Fraction(2, 3))), (MASS, -1.0))]
    assert stiff.deviation == pytest.approx(0.0043, rel=0.03)
    load = known[((STATIC_LOAD, 1.0), ("track.mass", -1.0))]
    assert load.deviation == pytest.approx(0.0002, rel=0.15)
    assert known[((CONSTANT, float(Fraction(2, 3))), ("irregularity.0.height", 1.0))].deviation < 0.01

    force, length = found.unknown
    assert force.reason == "force scale"
    assert force.deviation == np.inf
    assert set(force.exponents.values()) == {1.0}
    assert set(force.exponents) == {
        MASS, DAMPING, SPRING, CONSTANT, STATIC_LOAD, "track.mass", "track.stiffness", "track.damping",
    }  # fmt: skip
    assert length.reason == "displacement scale"
    assert 0.1 < length.deviation < 2.0
    assert length.exponents == {
        "irregularity.0.height": 1.0, "vehicle.radius": -1.0, MASS: -1.0, DAMPING: -1.0, SPRING: -1.0, CONSTANT: -1.5,
    }  # fmt: skip
    assert "force scale" in str(found)


def test_load_and_weight_act_by_their_sum_alone():
    """At a known N0 the acceleration of gravity changes nothing."""
    found = information(site({}), (MASS, "vehicle.load", "vehicle.gravity"))
    gravity = next(one for one in combinations(found).unknown if one.reason == "load and weight")
    assert gravity.exponents == {"vehicle.gravity": 1.0}
    assert gravity.deviation > 1e4
    assert found.deviation("vehicle.load")[0] > 1e4


def test_a_lighter_deck_tells_the_displacement_scale():
    heavy, light = (combinations(information(site(ALL, deck=deck), trigger=np.inf)) for deck in (15_000, 3_000))
    assert [one.reason for one in heavy.unknown] == ["force scale", "displacement scale"]
    assert [one.reason for one in light.unknown] == ["force scale"]


# -- the information itself -------------------------------------------------------------------------------------------


def test_bounds_are_right_though_the_information_is_nearly_singular():
    """Against the inverse of RᵀR with 60 digits."""
    found = information(site(ALL))
    rows = mpmath.matrix(found.rows().tolist())
    with mpmath.workdps(60):
        covariance = (rows.T * rows) ** -1
        exact = np.array([float(mpmath.sqrt(covariance[i, i])) for i in range(rows.cols)])
        block = covariance[:2, :2]
        determinant = float(1 / (block[0, 0] * block[1, 1] - block[0, 1] * block[1, 0]))
        correlation = float(block[0, 1] / mpmath.sqrt(block[0, 0] * block[1, 1]))
    np.testing.assert_allclose(found.deviations[0], exact, rtol=1e-7)
    assert found.determinants[0] == pytest.approx(determinant, rel=1e-7)
    assert found.determinant == found.determinants[0]
    assert found.correlation(MASS, DAMPING) == pytest.approx(correlation, rel=1e-7)
    assert found.worst == max(found.deviations[0, :2])
    inverse = np.linalg.inv(found.marginal[0])
    assert np.sqrt(np.diag(inverse)) == pytest.approx(found.deviations[0, :2], rel=1e-6)


def test_passages_at_several_speeds_are_those_at_each():
    scenario = site({}, [BUMP, DIP.moved(0.4)]).passage
    paths = (
        MASS,
        DAMPING,
        "speed",
        "irregularity.1.height",
        "vehicle.radius",
        "track.mass",
        CONSTANT,
        SPRING,
        "vehicle.load",
    )
    times = np.arange(1500) / 1e4
    passages = Passages(scenario, np.array([6.0, 11.0]), paths)
    for speed, one, force in zip((6.0, 11.0), passages.motions_at(times), passages.largest_forces, strict=True):
        alone = trajectory(scenario.replaced({"speed": speed}), paths, times)
        np.testing.assert_allclose(one.deck_acceleration, alone.deck_acceleration, rtol=0, atol=1e-9)
        scale = np.abs(alone.of_deck_acceleration).max(axis=1)[:, None]
        np.testing.assert_allclose(one.slopes / scale, alone.of_deck_acceleration / scale, rtol=0, atol=1e-8)
        assert force == pytest.approx(alone.largest_force, rel=1e-10)
    assert 0.05 < passages.place_of_largest_force < 0.6


def test_passages_together_tell_more_than_each():
    found = information(site(ALL), speeds=(6.0, 9.0, 12.0))
    joint = found.joint()
    assert joint.determinant > found.determinants.max()
    assert joint.determinant < found.determinants.sum() * 9
    assert np.all(
        joint.deviations[0] <= found.deviations[:, [p in joint.paths for p in found.paths]].min(axis=0) * 1.000001
    )
    assert joint.deviation("track.mass")[0] > 0.009  # the calibration's errors are not averaged
    alone = information(site(ALL)).joint()
    assert alone.determinant == pytest.approx(information(site(ALL)).determinant, rel=1e-6)


def test_heights_of_one_gauge_are_one_height():
    """Two bumps whose heights err together are one bump that is repeated."""
    two = site(KNOWN | HEIGHT | {"irregularity.1.height": 0.05}, [BUMP, BUMP.moved(0.5)])
    one = site(KNOWN | {"irregularity.0.of.height": 0.05}, wt.Repeated(of=BUMP, period=0.5, count=2))
    group = ("irregularity.0.height", "irregularity.1.height")
    together = information(two, together=[group])
    assert together.determinant == pytest.approx(information(one).determinant, rel=1e-5)
    assert together.paths == tuple(path for path in information(two).paths if path != group[1])
    assert information(two).deviation(group[0])[0] > together.deviation(group[0])[0] * 0.99


def test_an_unknown_trigger_costs_and_a_known_one_does_not():
    where = site(KNOWN | HEIGHT | CONTACT)
    known, near, unknown = (information(where, trigger=t).deviation(MASS)[0] for t in (0.0, 1e-9, np.inf))
    assert near == pytest.approx(known, rel=1e-3)
    assert unknown > 1.3 * known


def test_sensors_that_clip_or_filter_tell_less():
    plain = information(site(ALL)).determinant
    noise = SIGMA / np.sqrt(RATE / 2)
    clipped, filtered, stepped = (
        information(site(ALL, sensor=Sensor(noise=noise, **changes))).determinant
        for changes in ({"range": 10.0}, {"cutoff": 200.0}, {"range": 500.0, "bits": 8})
    )
    assert 0.01 * plain < clipped < 0.99 * plain
    assert 0.01 * plain < filtered < 0.99 * plain
    assert stepped < 0.5 * plain


def test_fewer_samples_of_the_same_noise_density_tell_the_same():
    where = site(CALIBRATED, [BUMP, DIP.moved(0.3)])
    fine, coarse = (information(where, speeds=(6.0, 12.0), rate=rate).determinants for rate in (20e3, 5e3))
    np.testing.assert_allclose(coarse, fine, rtol=0.01)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"where": lambda: site(ALL, sensor=Sensor())}, "sensor.noise"),
        ({"where": lambda: site(ALL | {"irregularity.0.start": 0.1}, wt.CosineBump(height=1e-4, length=0.05, start=0))},
         "irregularity.0.start"),
        ({"where": lambda: site(KNOWN, wt.Profile(function=np.sin)), "trigger": 1e-3}, "trigger"),
    ],
)  # fmt: skip
def test_what_cannot_be_asked_is_said(changes, field):
    where = changes.pop("where")()
    with pytest.raises(wt.InputError) as error:
        information(where, **changes)
    assert error.value.field == field


def test_a_field_that_was_not_asked_for_is_said():
    with pytest.raises(wt.InputError, match=r"vehicle\.mass"):
        information(site(KNOWN)).deviation("track.mass")


# -- layouts ----------------------------------------------------------------------------------------------------------

FAMILY = Family(
    3, ("bump", "dip", "step down"), (1e-5, 4e-3), (0.02, 0.4), (0.02, 1.5), 2.0, fields={"track.mass": (5e3, 2e4)}
)


@pytest.mark.slow
@drawn(200)
@given(st.lists(st.floats(0.0, 1.0), min_size=FAMILY.coordinate_count, max_size=FAMILY.coordinate_count), st.booleans())
def test_layouts_keep_their_bounds_and_have_coordinates(at, alike):
    family = Family(**{**vars(FAMILY), "alike": alike, "shapes": ("bump",)}) if alike else FAMILY
    layout = family.layout_at(np.array(at[: family.coordinate_count]))
    assert len(layout.features) == 3
    assert layout.total_length <= 2.0 + 1e-9
    for one, other in zip(layout.features[:-1], layout.features[1:], strict=True):
        assert other.start - one.start >= max(0.02, one.length) - 1e-12
        assert not alike or (one.height, one.length, one.shape) == (other.height, other.length, other.shape)
    assert all(1e-5 * 0.999 <= one.height <= 4e-3 * 1.001 for one in layout.features)
    again = family.layout_at(family.coordinates_of(layout))
    assert again.fields == pytest.approx(layout.fields)
    for one, other in zip(layout.features, again.features, strict=True):
        assert other.shape == one.shape
        assert other[1:] == pytest.approx(one[1:], rel=1e-5, abs=1e-9)


def test_layouts_are_known_as_well_as_the_first_feature_of_the_site():
    two = Layout((RailFeature("dip", 1e-4, 0.04, 0.05), RailFeature("step up", 2e-4, 0.0, 0.5)), {"track.mass": 8e3})
    made = laid_out(site(ALL), two, 0.5)
    assert made.passage.irregularities == (
        wt.CosineBump(height=-1e-4, length=0.04, start=0.05), wt.Step(height=2e-4, position=0.5),
    )  # fmt: skip
    assert made.uncertainty["irregularity.1.height"] == 0.05
    assert made.passage.track.mass == 8e3
    assert made.passage.duration == 0.5
    assert two.total_length == pytest.approx(0.45)


# -- designs ----------------------------------------------------------------------------------------------------------


def small(**changes):
    rail = {"total_length": 0.6, "lengths": (0.03, 0.2)} | changes.pop("rail", {})
    asked = {"speeds": (9.0,), "budget": 24, "seed": 3, "rail": rail} | changes
    return design_site(site(CALIBRATED), **asked)


def test_names_of_the_rail_are_known():
    with pytest.raises(wt.InputError, match="number: found 0"):
        design_site(site(CALIBRATED), rail={"number": 0})
    with pytest.raises(wt.InputError, match="did you mean 'heights'"):
        design_site(site(CALIBRATED), rail={"height": (1e-4, 1e-3)})
    with pytest.raises(TypeError, match="heigths"):
        design_site(site(CALIBRATED), heigths=(1e-4, 1e-3))


@pytest.fixture(scope="module")
def found():
    return small()


@pytest.mark.slow
def test_a_design_keeps_the_limits_and_says_what_it_gains(found, tmp_path):
    for one in (found.best, found.single, found.repeated, found.alike):
        assert one.largest_force <= 400e3
        assert one.total_length <= 0.6 + 1e-9
    assert found.information.largest_force.max() == found.best.largest_force
    assert found.information.determinant == pytest.approx(found.best.determinant, rel=1e-9)
    assert found.gains["single"] == pytest.approx(found.best.determinant / found.single.determinant)
    assert min(found.gains.values()) >= 1.0 - 0.02  # the search has begun with all of them; the rate is another one
    assert "kN" in str(found)
    (bump,) = found.single.layout.features
    for one in (found.repeated, found.alike):
        first, second = one.layout.features
        assert first[:3] == second[:3]
    assert found.repeated.layout.features[0].length == pytest.approx(bump.length)
    assert found.repeated.layout.features[0].height <= bump.height * (1.0 + 1e-9)  # lower only where the force asks it
    assert found.alike.determinant >= (1.0 - 0.02) * found.repeated.determinant


@pytest.mark.slow
def test_the_same_seed_finds_the_same_design(found):
    again = small()
    assert again.best == found.best
    assert [one.layout for one in again.candidates] == [one.layout for one in found.candidates]
    assert small(seed=4).best != found.best


@pytest.mark.slow
def test_the_front_is_what_nothing_beats(found):
    for over in ("largest_force", "total_length"):
        front = found.front(over)
        told = [one for one in found.candidates if one.kind == "designed" and np.isfinite(one.determinant)]
        assert front
        for one in told:
            assert any(
                other.determinant >= one.determinant and getattr(other, over) <= getattr(one, over) for other in front
            )
    chart = found.chart()
    assert chart.sizes["candidate"] == len(found.candidates)
    assert set(chart.kind.values) == {"single", "repeated", "alike", "part", "designed"}
    assert float(chart.largest_force[-1]) == found.candidates[-1].largest_force


def test_the_site_of_a_design_is_read_back(found, tmp_path):
    found.to_toml(tmp_path / "site.toml")
    assert Site.from_toml(tmp_path / "site.toml") == found.site
    other = site(ALL, [DIP, STEP], sensor=Sensor(noise=1e-3, range=50.0, bits=16, cutoff=5e3))
    write_toml(other, tmp_path / "other.toml")
    assert Site.from_toml(tmp_path / "other.toml") == other


@pytest.mark.slow
def test_designs_for_the_worst_interval_with_another_deck():
    told = []
    made = small(
        criterion="worst interval", vary={"track.mass": (3e3, 1.5e4)}, rail={"number": 1, "shapes": ("step down",)},
        progress=lambda *layouts: told.append(layouts),
    )  # fmt: skip
    assert made.best.worst == pytest.approx(made.information.worst)
    assert 3e3 <= made.site.passage.track.mass <= 1.5e4
    assert made.gains["single"] >= 0.98
    assert {what for what, _, _ in told} == {"layouts"}
    assert [done for _, done, _ in told] == list(range(1, len(made.candidates) + 1))


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"criterion": "trace"}, "criterion"), ({"rail": {"shapes": ("hill",)}}, "shapes"),
        ({"rail": {"number": 0}}, "number"),
        ({"rail": {"heights": (2e-3, 1e-3)}}, "heights"), ({"rail": {"total_length": 0.01}}, "total_length"),
        ({"parameters": ("irregularity.0.height",)}, "irregularity.0.height"),
        ({"rail": {"largest_force": 90e3}}, "largest_force"), ({"vary": {"track.mass": (-1.0, 2.0)}}, "track.mass"),
    ],
)  # fmt: skip
def test_what_cannot_be_designed_is_said(changes, field):
    with pytest.raises(wt.InputError) as error:
        small(**changes)
    assert error.value.field == field
