"""Flats sized from gauges, on recordings of finite elements whose track differs in all that is uncertain."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import wheeltapper as wt
from tests.wayside import (
    BALLAST,
    BALLAST_DAMPING,
    BENDING,
    HERTZ,
    MASS,
    PAD,
    PAD_DAMPING,
    RADIUS,
    RAIL_MASS,
    SLEEPER,
    SPACING,
    Line,
    Wheel,
)
from wheeltapper.diagnosis.gauges.finding import WheelFinding
from wheeltapper.diagnosis.gauges.fit import ARRIVAL, Fit, Search, moved
from wheeltapper.diagnosis.gauges.outlook import FittedFlat, outlook
from wheeltapper.diagnosis.gauges.passing import (
    ADVANCE,
    FORCE,
    HIGHEST,
    LENGTH,
    POSITION,
    SPEED,
    Passing,
    Runs,
    passing_without_readings,
)
from wheeltapper.diagnosis.gauges.responses import responses_of
from wheeltapper.diagnosis.gauges.roughness import contact_stiffness, rough_columns, rough_force, rough_of_others
from wheeltapper.diagnosis.gauges.scan import Scan
from wheeltapper.diagnosis.gauges.sizing import (
    Known,
    Sized,
    _flats_of,
    _starts_by_shape,
    coarse_problem,
    problem_of,
    sized_flat,
    values_of,
)
from wheeltapper.diagnosis.gauges.transfer import Transfer
from wheeltapper.diagnosis.gauges.verdicts import interval_over
from wheeltapper.diagnosis.gauges.weighing import Weights, band_of
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.track.section import section_of
from wheeltapper.record.assessment.filtering import low_passed

RATE, NOISE, SHEAR, TURN = 5e3, 500.0, 2.43e8, 2.0 * np.pi * RADIUS
PAIRS = tuple((SPACING * k + 0.1, SPACING * k + 0.5) for k in range(6))
WITHIN = PAIRS[0][0] - 1.4, PAIRS[-1][1] + 1.4
RAIL = wt.tracks.Rail(bending_stiffness=BENDING, shear_stiffness=SHEAR, mass_per_length=RAIL_MASS, damping=1e-6)
TRACK = wt.tracks.Ballasted(
    rail=RAIL, spacing=SPACING, pad_stiffness=PAD, pad_damping=PAD_DAMPING, sleeper_mass=SLEEPER,
    ballast_stiffness=BALLAST, ballast_damping=BALLAST_DAMPING,
)  # fmt: skip
SCENE = wt.Scenario(
    vehicle=wt.Wheelset(mass=MASS, load=7e4, stiffness=0.0, damping=0.0, radius=RADIUS, wheels=1), track=TRACK,
    contact=wt.Hertz(constant_per_wheel=HERTZ), speed=20.0, duration=0.3,
)  # fmt: skip
SPREAD = {
    "track.pad_stiffness": 0.2, "track.pad_damping": 0.3, "track.ballast_stiffness": 0.2, "track.ballast_damping": 0.3,
    "contact.constant_per_wheel": 0.05, "vehicle.mass": 0.08, "vehicle.radius": 0.01,
}  # fmt: skip
SENSORS = tuple(
    wt.sensors.RailShearForce(name=f"{number}", x1=a, x2=b, rate=RATE) for number, (a, b) in enumerate(PAIRS)
)


@cache
def recorded(speed, wheels, differs=True):
    """Return what wheels do and what the gauges read; `differs`: on a track other than the model's."""
    other = {"pad": 1.04 * PAD, "ballast": 1.1 * BALLAST, "pad_damping": 0.85 * PAD_DAMPING, "hertz": 0.94 * HERTZ}
    line = Line([("pair", *one) for one in PAIRS], shear=SHEAR, per_bay=12, **(other if differs else {}))
    return line.recorded(wheels, speed, RATE)


def passages(speed, wheels, differs=True):
    """Return the places of wheels over time, and what the gauges read."""
    found = recorded(speed, wheels, differs)
    return found.x, found.readings


def passing_of(x, readings, speed, load, seed):
    """Return what is known of a wheel: noisy readings with wrong gains; place, speed and load are off, too."""
    rng = np.random.default_rng(seed)
    inside = slice(*np.searchsorted(x, WITHIN).tolist())
    gains = 1.0 + 0.05 * rng.standard_normal(len(PAIRS))
    rows = (gains[:, None] * readings[:, inside] + NOISE * rng.standard_normal(readings[:, inside].shape)).T
    place, own = x[inside][0] + 2e-3 * rng.standard_normal(), speed * (1.0 + 1.3e-3 * rng.standard_normal())
    at = place + own / RATE * np.arange(len(rows))
    used = np.stack([np.minimum(abs(at - a), abs(at - b)) > 0.06 for a, b in PAIRS], axis=1)
    return Passing(SENSORS, RATE, rows, used, place, own, load * (1.0 + 0.03 * rng.standard_normal()), NOISE)


def responses(passing):
    return responses_of(section_of(TRACK), PAIRS, passing.x[0], passing.x[-1])


@pytest.mark.slow
def test_a_slow_force_reads_one_between_the_gauges_and_nothing_beside():
    x, readings = passages(20.0, (Wheel(8e4, seed=7),))
    passing = passing_of(x, readings[0], 20.0, 8e4, 1)
    places = np.array([-1.0, 0.0, 0.2, 0.4, 0.8, 1.0, 2.9])
    read = responses(passing).readings(np.array([0.0]), places)[:, 0]
    np.testing.assert_allclose(read[0], [0, 0, 1, 1, 0, 0, 0], atol=1e-3)
    np.testing.assert_allclose(read[1], [0, 0, 0, 0, 1, 1, 0], atol=1e-3)


@pytest.mark.slow
def test_roughness_has_the_size_that_its_columns_say():
    band, columns, left, _ = rough_wheels()
    found = [np.std(band.taken(one)) for one in left(0)]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(np.sqrt((columns**2).sum(axis=1).mean()), rel=0.15)
    behind = 300  # samples: 1.2 m
    beside = rough_of_others(band._replace(passing=replace(band.passing, others=(-1.2,))), columns)
    found = np.sqrt(np.mean([np.square(band.taken(one)) for one in left(behind)], axis=0))
    away = np.concatenate([band.passing.x[picked] for picked in band.picked.T]) - 1.2 < band.passing.x[0]
    assert np.sqrt(np.mean(found[~away] ** 2)) == pytest.approx(np.sqrt(np.mean(beside[~away] ** 2)), rel=0.15)
    assert beside[away].max() == 0.0
    print("N, far away:", np.sqrt(np.mean(found[away] ** 2)))
    assert np.sqrt(np.mean(found[away] ** 2)) < 0.3 * np.sqrt(np.mean(found[~away] ** 2))


@pytest.mark.slow
def test_what_gauges_read_tells_the_force_of_roughness():
    band, columns, left, forces = rough_wheels()
    passing, weights = band.passing, Weights(band.deviations(band.noise), columns)
    noise = NOISE * np.random.default_rng(3).standard_normal(passing.readings.shape)
    begin, end = np.searchsorted(passing.x, [PAIRS[0][0], PAIRS[-1][1]])
    off = []
    for one, force in zip(left(0), forces, strict=True):
        factors = weights.rough_factors(weights.over(band.taken(one + band.smooth(noise))))
        told = rough_force(band, responses(passing), contact_stiffness(HERTZ, 8e4), MASS, factors, passing.x)
        true, told = (low_passed(each, RATE, 500.0)[begin:end] for each in (force, told))
        off.append([np.mean((told - true) ** 2), np.mean(true**2)])
    error, size = np.sqrt(np.mean(off, axis=0))
    print(f"{size:.0f} N, but for {error:.0f}")
    assert error < 0.4 * size


@cache
def rough_wheels():
    """Return a band, its columns, and of wheels on rough rails what roughness adds to readings and to the force.

    The readings after the low-pass are those of wheels that are so many samples behind.
    """
    wheels = tuple(Wheel(8e4, seed=seed) for seed in range(12))
    rough, level = recorded(20.0, wheels, differs=False), recorded(20.0, (Wheel(8e4),), differs=False)
    x, begin = rough.x, int(np.searchsorted(rough.x, WITHIN[0]))
    count = int(np.searchsorted(x, WITHIN[1])) - begin
    place = x[begin : begin + count]
    used = np.stack([np.minimum(abs(place - a), abs(place - b)) > 0.06 for a, b in PAIRS], axis=1)
    passing = Passing(SENSORS, RATE, 0.0 * used, used, float(place[0]), 20.0, 8e4, NOISE)
    band = band_of(passing, HIGHEST)
    columns = rough_columns(band, responses(passing), contact_stiffness(HERTZ, 8e4), MASS)

    def left(behind):
        rows = slice(begin - behind, begin - behind + count)
        return [band.smooth((one - level.readings[0])[:, rows].T) for one in rough.readings]

    return band, columns, left, [one[begin : begin + count] for one in rough.forces - level.forces]


def test_responses_go_with_the_seats():
    """A site whose seats, gauges and wheels all lie 0.23 m further on reads the same."""
    at, frequencies = np.array([-0.4, 0.2, 1.9]), np.array([0.0, 130.0, 610.0])
    own = responses_of(section_of(TRACK), PAIRS, -1.3, 4.9)
    there = own._replace(seat=0.23)
    np.testing.assert_allclose(there.readings(frequencies, at + 0.23), own.readings(frequencies, at), atol=1e-9)
    contact = own.contact(frequencies, 1e9, MASS)
    np.testing.assert_allclose(there.at_places(contact, at + 0.23), own.at_places(contact, at), rtol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("speed", [12.0, 33.0])
def test_readings_of_a_force_are_those_of_the_whole_run(speed):
    """The operator against the march's own track."""
    passing = passing_at(speed)
    runs = Runs(passing, SCENE)
    smooth = {SPEED: speed, FORCE: 8e4, ADVANCE: 0.0}
    band = band_of(passing, HIGHEST)
    transfer = Transfer(band, responses(passing), smooth)

    def exact(values):
        return band.smooth(runs.readings(values, "fresh"))

    level = exact(smooth)
    found = transfer.of(runs.forces(smooth, "fresh"))
    assert np.sqrt(np.mean((found - level)[passing.used] ** 2)) < 70.0  # N, of 80 kN; noise has 300 N
    for values in ({}, {ADVANCE: 0.004}, {SPEED: 1.002 * speed}):
        own = {**smooth, LENGTH: 0.04, POSITION: 1.0}
        flat = {**own, **values}
        beside = exact({**flat, LENGTH: 0.0})
        strikes = exact(flat) - beside
        found = transfer.retimed(transfer.of(runs.forces(own, "fresh")), flat) - beside
        off = np.sqrt(np.mean((found - strikes)[passing.used] ** 2) / np.mean(strikes[passing.used] ** 2))
        assert off < 0.06


@pytest.mark.slow
def test_readings_on_a_track_that_is_a_little_stiffer_are_linear_in_it():
    """A problem's readings near its anchor against a run on the other track."""
    runs, values = Runs(passing_at(22.0), SCENE), values_of(passing_at(22.0), Known(SCENE, SPREAD))
    values |= {LENGTH: 0.04, POSITION: 1.0}
    problem = problem_of(runs, values, SPREAD, np.full(len(PAIRS), 0.05), HIGHEST)
    other = moved(values, "track.pad_stiffness", 0.05)
    stiffer, as_known = (problem.band.smooth(runs.readings(one, "fresh")) for one in (other, values))
    off = problem.read(other, "fresh") - problem.read(values, "fresh") - (stiffer - as_known)
    used = problem.band.passing.used
    assert np.sqrt(np.mean(off[used] ** 2)) < 0.1 * np.sqrt(np.mean((stiffer - as_known)[used] ** 2))


def slow_flat(*names):
    """Return a problem, a search by some values, and where it is: at 12 m/s, a wave of 900 Hz is 13 mm long."""
    passing = passing_at(12.0)
    runs, values = Runs(passing, SCENE), values_of(passing, Known(SCENE, SPREAD))
    values |= {LENGTH: 0.04, POSITION: 0.4}
    problem = problem_of(runs, values, SPREAD, np.full(len(PAIRS), 0.05), HIGHEST)
    search = Search(problem, "rounded", names)
    return problem, search, search.at(values, np.ones(len(PAIRS)), np.zeros(2 * len(PAIRS)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "step"), [(POSITION, 3e-4), ("vehicle.radius", 1e-4), (ADVANCE, 3e-4), (SPEED, 1e-4), (LENGTH, 1e-3)]
)
def test_derivatives_of_readings_are_those_of_small_steps_to_both_sides(name, step):
    problem, search, now = slow_flat(name)
    ahead, behind = (problem.read(moved(now.values, name, by), "rounded") for by in (step, -step))
    expected = problem.band.taken(ahead - behind) / (2.0 * step)
    assert np.linalg.norm(search.change(now, name) - expected) < 0.02 * np.linalg.norm(expected)


@pytest.mark.slow
def test_a_strike_at_the_same_time_elsewhere_on_the_track_is_hardly_another():
    """A wheel and its flat that both are further on: what of the derivatives by both places is left."""
    problem, search, now = slow_flat(POSITION, ADVANCE)
    both = [moved(moved(now.values, POSITION, by), ADVANCE, by) for by in (1e-3, -1e-3)]
    ahead, behind = (problem.read(one, "rounded") for one in both)
    expected = problem.band.taken(ahead - behind) / 2e-3
    by_place, by_wheel = (search.change(now, name) for name in (POSITION, ADVANCE))
    assert np.linalg.norm(expected) < 0.1 * np.linalg.norm(by_place)
    assert np.linalg.norm(by_place + by_wheel - expected) < 0.02 * np.linalg.norm(by_place)


def passing_at(speed):
    """Return a wheel without readings."""
    empty = np.zeros((int(6.2 / speed * RATE), len(PAIRS)))
    passing = Passing(SENSORS, RATE, empty, empty == 0.0, -1.3, speed, 8e4, NOISE)
    used = np.stack([np.minimum(abs(passing.x - a), abs(passing.x - b)) > 0.06 for a, b in PAIRS], axis=1)
    return replace(passing, used=used)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "load", "length", "place", "worn", "within"),
    [
        (20.0, 73e3, 0.042, 1.35, False, 0.01),  # strikes in a crib between gauges
        (20.0, 52e3, 0.034, 0.62, False, 0.01),  # strikes over a seat, where no gauge is
        (12.0, 68e3, 0.036, 1.9, True, 2.5 * ARRIVAL),  # its place is known as well as where the wheel was
        (30.0, 68e3, 0.052, 0.9, True, 0.01),
    ],
)
def test_flats_are_sized_and_fresh_ones_told_from_rounded(speed, load, length, place, worn, within):
    x, readings = passages(speed, (Wheel(load, seed=5, flat=(length, place - TURN), worn=worn),))
    passing = passing_of(x, readings[0], speed, load, 3)
    found = sized_flat(passing, Known(SCENE, SPREAD), np.full(len(PAIRS), 0.05))
    assert found.verdict == ("rounded flat" if worn else "wheel flat")
    assert not found.alike
    assert found.best is not None
    assert found.best.values[LENGTH] == pytest.approx(length, abs=max(1.5e-3, 0.04 * length))
    best = found.best.values
    way = best[POSITION] - place
    assert abs((way + 0.5 * TURN) % TURN - 0.5 * TURN) < within
    late = (best[POSITION] - passing.place - best[ADVANCE]) / best[SPEED] - (place - x[x >= WITHIN[0]][0]) / speed
    turn = 2.0 * np.pi * best["vehicle.radius"] / best[SPEED]
    assert abs((late + 0.5 * turn) % turn - 0.5 * turn) < 5e-5
    assert abs(found.best.values[LENGTH] - length) < 2.5 * found.deviation(found.best.shape)
    assert found.best.chi < 1.25 * found.best.readings


@pytest.mark.slow
@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("speed", "load", "length", "position", "changes", "gains", "measured"),
    [
        (
            15.266,
            30.49e3,
            0.03875,
            -0.957,
            (604.72, 0.45377, 8.776e10, 1.6024e8, 40144.0, 7.549e7, 66364.0),
            (1.017, 1.041, 1.017),
            (15.281, 30.49e3, 2e-3),
        ),
        (
            15.673,
            52.96e3,
            0.02504,
            -0.5129,
            (593.95, 0.4555, 9.3678e10, 1.8392e8, 25638.0, 7.5925e7, 79076.0),
            (1.0881, 0.9953, 0.962),
            (15.651, 54.24e3, -2e-4),
        ),
    ],
    ids=["the second strike is seen", "the first strike is seen"],
)
def test_a_flat_of_which_one_strike_is_seen_is_found_on_a_wheel_of_another_radius(
    speed, load, length, position, changes, gains, measured
):
    """Recordings of the own model: near the stated radius one was 5.6 mm longer, the other 5.6 mm shorter."""
    known, sensors = Known(SCENE, SPREAD), SENSORS[:3]
    empty, rng = passing_without_readings(sensors, RATE, NOISE, speed, load), np.random.default_rng(1)
    names = (
        "vehicle.mass", "vehicle.radius", "contact.constant_per_wheel", "track.pad_stiffness", "track.pad_damping",
        "track.ballast_stiffness", "track.ballast_damping",
    )  # fmt: skip
    true = values_of(empty, known) | dict(zip(names, changes, strict=True)) | {LENGTH: length, POSITION: position}
    read = Runs(empty, SCENE).readings(true, "fresh")
    rows = read * gains + NOISE * rng.standard_normal(read.shape)
    speed, force, off = measured
    passing = replace(empty, readings=rows, place=empty.place + off, speed=speed, static_force=force)
    found = sized_flat(passing, known, np.full(3, 0.05))
    assert found.verdict == "wheel flat"
    assert found.best is not None
    assert found.best.values[LENGTH] == pytest.approx(length, abs=1e-3)
    assert found.best.values["vehicle.radius"] == pytest.approx(true["vehicle.radius"], rel=4e-3)


@pytest.mark.slow
def test_the_flat_of_a_slow_wheel_is_found_from_8_millimetres_beside_it():
    """Below 320 Hz a wave is 35 mm long, below 900 Hz 12: there a fit from these values comes to a flat of 24 mm."""
    alone, known = passing_without_readings(SENSORS[:4], RATE, NOISE, 11.2, 9e4), Known(SCENE, SPREAD)
    values = values_of(alone, known)
    true = {**values, LENGTH: 0.034, POSITION: -0.8, "vehicle.radius": 1.006 * RADIUS}
    read = Runs(alone, SCENE).readings(true, "rounded")
    noisy = read + NOISE * np.random.default_rng(4).standard_normal(read.shape)
    coarse = coarse_problem(Runs(replace(alone, readings=noisy), SCENE), values, SPREAD, np.full(4, 0.05))
    beside = {**true, LENGTH: 0.026, POSITION: -0.792, "vehicle.radius": 1.002 * RADIUS}
    seen = Scan(coarse, values).seen(noisy, coarse.runs.passing.used)
    found = _flats_of(coarse, Sized({}, seen.gain, seen, 0), _starts_by_shape(coarse, [beside]))
    assert found.verdict == "rounded flat"
    assert found.best.values[LENGTH] == pytest.approx(0.034, abs=1.5e-3)
    assert found.best.chi < 1.1 * found.best.readings


@pytest.mark.whole
@pytest.mark.slow
def test_kinds_of_a_short_flat_at_speed_are_not_told():
    x, readings = passages(30.0, (Wheel(71e3, seed=3001, flat=(0.029, 0.9 - TURN)),))
    found = sized_flat(passing_of(x, readings[0], 30.0, 71e3, 3), Known(SCENE, SPREAD), np.full(len(PAIRS), 0.05))
    assert {found.verdict, *found.alike} == {"wheel flat", "rounded flat"}
    assert found.fits["fresh"].values[LENGTH] == pytest.approx(0.029, abs=1.5e-3)


@pytest.mark.slow
def test_wheels_without_a_flaw_have_no_flat():
    wheels = tuple(Wheel(load, seed=seed) for load, seed in ((94e3, 500), (34e3, 507)))
    x, readings = passages(20.0, wheels)
    for wheel, row in zip(wheels, readings, strict=True):
        passing = passing_of(x, row, 20.0, wheel.load, 3)
        found = sized_flat(passing, Known(SCENE, SPREAD), np.full(len(PAIRS), 0.05))
        assert found.verdict == "healthy"
        assert found.best is None
        assert found.runs < 10


@pytest.mark.slow
def test_a_wheel_that_is_out_of_round_is_told_with_its_orders():
    waves = ((12, 6e-5, 1.0), (15, 5e-5, 2.0))
    x, readings = passages(20.0, (Wheel(7e4, seed=9, waves=waves), Wheel(7e4, seed=9)))
    finding, sound = (
        WheelFinding(sized_flat(passing, known, np.full(len(PAIRS), 0.05)), passing, known)
        for passing, known in ((passing_of(x, one, 20.0, 7e4, 5), Known(SCENE, SPREAD)) for one in readings)
    )
    assert finding.verdict == "out of round"
    assert finding.out_of_round.known == [12, 15]
    for order, size, phase in waves:
        assert finding.out_of_round.amplitudes[order - 1] == pytest.approx(size, rel=0.25)
        moved = finding.out_of_round.phases[order - 1] - phase - order * finding.out_of_round.place / RADIUS
        assert abs((moved + np.pi) % (2.0 * np.pi) - np.pi) < 0.6
    assert 1 in finding.out_of_round.unknown  # it looks like a gain
    assert "order 12" in str(finding)
    assert sound.verdict == "healthy"
    assert sound.out_of_round is None
    assert 0.005 < sound.unseen[0] <= sound.unseen[1] < 0.025
    with pytest.raises(InputError, match="found a wheel that is healthy; allowed: one with a flat"):
        sound.outlook()


@pytest.mark.slow
def test_peaks_to_come_are_those_of_all_kinds_that_are_left_open():
    def flat(shape, length, probability):
        values = {LENGTH: length, POSITION: 0.0, ADVANCE: 0.0, SPEED: 20.0, FORCE: 7e4}
        none = np.zeros((1, 1))
        fit = Fit(shape, values, (LENGTH,), none, none, 1.0, 1, none[0], none[0], {}, 0.0)
        return FittedFlat(fit, 0.0, probability)

    def peaks(*kinds):
        return outlook(SCENE, kinds, np.array([25.0]), np.array([7e4])).largest_force.values[0, 0]

    fresh, rounded = flat("fresh", 0.045, 0.7), flat("rounded", 0.045, 0.3)
    worse, better = peaks(fresh), peaks(rounded)
    assert better[2] < worse[0]
    low, median, high = peaks(fresh, rounded)
    assert low < better[2]
    assert worse[0] < median < high
    assert high == pytest.approx(worse[2], rel=0.05)
    np.testing.assert_array_equal(peaks(fresh, rounded._replace(probability=0.0)), worse)


def test_an_interval_holds_those_of_all_faults_that_are_left_open():
    sizes = {"wheel flat": (0.026, (0.025, 0.027)), "rounded flat": (0.0325, (0.031, 0.034))}
    assert interval_over(["wheel flat"], sizes) == [0.025, 0.027]
    assert interval_over(["rounded flat", "wheel flat"], sizes) == [0.025, 0.034]
    assert interval_over(["healthy"], sizes) is None
