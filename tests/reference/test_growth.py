"""Growth of one wheel's flat, against drawn passages of which the truth is known, and passages that are fitted."""

from dataclasses import replace
from types import MappingProxyType

import numpy as np
import pytest

import wheeltapper as wt
from tests.looks import flaws
from wheeltapper.diagnosis.gauges.fit import SURER, Fit, covariance_of
from wheeltapper.diagnosis.gauges.known import known_of
from wheeltapper.diagnosis.gauges.shares import shares_of
from wheeltapper.diagnosis.gauges.sizing import OWN_LENGTH

from .test_gauges import BALLAST, HERTZ, MASS, PAD, PAD_DAMPING, RADIUS
from .test_sizes_of_trains import site

UNSEEN = {"half": 0.016, "nine_tenths": 0.019}
COMMON = ("contact.constant_per_wheel", "vehicle.mass", "gain of 0", "gain of 1")


def flat(length, own=0.01, common=MappingProxyType({}), kind="wheel flat", alike=(), unseen=MappingProxyType(UNSEEN)):
    """Return what a passage tells of a wheel with a flat; as a rounded one it is 1.3 times as long."""
    other = "rounded flat" if kind == "wheel flat" else "wheel flat"
    sizes = {kind: length, other: length * (1.3 if other == "rounded flat" else 1.0 / 1.3)}
    return {
        "verdict": kind, "alike": [other] if alike else [],
        "sizes": {name: {"size": one} for name, one in sizes.items()},
        "errors": {name: {"own": own, "common": dict(common)} for name in sizes}, "fresh_flat_found_from": dict(unseen),
    }  # fmt: skip


def healthy(unseen=MappingProxyType(UNSEEN)):
    """Return what a passage tells of a wheel that was looked at, and not fitted."""
    return {"verdict": "no strikes", "fresh_flat_found_from": dict(unseen)}


def drawn(rng, lengths, share):
    """Return passages of a wheel with flats of these lengths, drawn with the errors that they state.

    `share`: of the variance of the model's error, `OWN_LENGTH`, that is each passage's own.
    """
    off, model = rng.standard_normal(len(COMMON)), rng.standard_normal()
    out = []
    for length in lengths:
        half = rng.uniform(0.012, 0.02)
        unseen = {"half": half, "nine_tenths": 1.15 * half}
        smallest = half * np.exp(np.log(1.15) / 1.2816 * rng.standard_normal())
        if length < smallest or rng.uniform() < 0.03:
            out.append(healthy(unseen))
            continue
        own, parts = rng.uniform(0.006, 0.013), rng.normal([0.001, 0.0, -0.0025, -0.0025], 0.001)
        error = own * rng.standard_normal() + parts @ off
        error += OWN_LENGTH * (np.sqrt(1.0 - share) * model + np.sqrt(share) * rng.standard_normal())
        common = dict(zip(COMMON, parts.tolist(), strict=True))
        out.append(flat(float(length * (1.0 + error)), own, common, unseen=unseen))
    return out


def test_the_parts_of_a_lengths_error_are_those_of_a_least_squares_problem():
    rng = np.random.default_rng(4)
    names, free = ("length", "track.pad_stiffness", "speed", "vehicle.mass"), 8
    jacobian = rng.standard_normal((40, free)) * np.array([300.0, 9.0, 20.0, 12.0, 4.0, 5.0, 1.0, 1.0])
    deviations = np.array([np.inf, 0.2, 0.002, 0.08, 0.05, 0.03, np.inf, np.inf])  # the last four: gains and zero lines
    precision = SURER * deviations**-2.0
    inverse, covariance = covariance_of(jacobian.T @ jacobian + np.diag(precision), precision)
    fit = Fit("fresh", {}, names, covariance, inverse, 30.0, 40, np.ones(2), np.zeros(4), {}, 0.0)
    own, common = shares_of(fit, {"track.pad_stiffness": 0.2, "vehicle.mass": 0.08}, {"a": 0.05, "b": 0.03})
    assert list(common) == ["track.pad_stiffness", "vehicle.mass", "gain of a", "gain of b"]
    for number, name in zip((1, 3, 4, 5), common, strict=True):
        before = np.zeros(free)
        before[number] = deviations[number]  # readings of a truth of 0, fitted with this value before
        estimate = inverse @ (precision * before)
        assert estimate[0] == pytest.approx(common[name], rel=1e-12)
    of_readings = inverse[0] @ jacobian.T
    of_speed = inverse[0, 2] * precision[2] * deviations[2]
    assert own == pytest.approx(np.hypot(np.sqrt(of_readings @ of_readings), of_speed), rel=1e-9)


@pytest.mark.slow
@pytest.mark.few(1)
@pytest.mark.parametrize(("passages", "wheels"), [(20, 50), pytest.param(50, 400, marks=pytest.mark.slow)])
@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_intervals_cover_what_was_drawn_and_nothing_is_renewed(share, passages, wheels):
    rng = np.random.default_rng(round(10 * share) + passages)
    at = np.arange(float(passages))
    inside, off = [], []
    for _ in range(wheels):
        begin, rate = rng.uniform(0.025, 0.05), rng.uniform(0.0, 0.02) / passages
        grown = wt.diagnosis.wheel_growth(drawn(rng, begin + rate * at, share), at)
        assert len(grown.courses) == 1, str(grown)
        (low, high), (short, long) = grown.rate_interval, grown.length_interval
        inside.append((low < rate < high, short < begin + rate * at[-1] < long))
        off.append((grown.rate - rate) * passages)
    most = 2.5 * np.sqrt(0.09 / wheels)
    rates, lengths = np.mean(inside, axis=0)
    print(
        f"share {share}, {passages} passages: rates {rates:.3f}, lengths {lengths:.3f}, rms {1e3 * np.std(off):.2f} mm"
    )
    assert abs(rates - 0.9) < most + 0.03
    assert lengths > 0.9 - most  # all of the model's error counts as common, where it may be less


def test_common_errors_count_for_the_length_and_hardly_for_its_growth():
    common = {"contact.constant_per_wheel": 0.04}
    at = np.arange(10.0)
    rows = [flat(0.03 + 1e-3 * one, 0.005, common) for one in at]
    apart = [flat(0.03 + 1e-3 * one, float(np.hypot(0.005, 0.04))) for one in at]
    shared, alone = wt.diagnosis.wheel_growth(rows, at), wt.diagnosis.wheel_growth(apart, at)
    widths = [(np.ptp(one.length_interval), np.ptp(one.rate_interval)) for one in (shared, alone)]
    assert widths[0][0] > 1.3 * widths[1][0]
    assert widths[0][1] < 0.6 * widths[1][1]


def test_opposite_errors_of_passages_are_told_from_equal_ones():
    """A value that makes fast passages long and slow ones short makes growth uncertain where the speed rises."""
    at = np.arange(10.0)
    equal = [flat(0.04, 0.002, {"vehicle.mass": 0.02}) for _ in at]
    turned = [flat(0.04, 0.002, {"vehicle.mass": 0.02 * (one - 4.5) / 4.5}) for one in at]
    narrow, wide = (np.ptp(wt.diagnosis.wheel_growth(rows, at).rate_interval) for rows in (equal, turned))
    assert wide > 1.5 * narrow
    assert wide > 0.9 * 2.0 * 1.645 * 0.04 * 0.02 / 4.5


@pytest.mark.parametrize(
    ("lengths", "renewed", "struck"),
    [
        ([0.04] * 10 + [0.0] * 4, [10], []),  # replaced
        ([0.04] * 10 + [0.0] * 2, [], []),  # too few to tell
        ([0.0] * 6 + [0.035] * 6, [], [6]),  # slid
        ([0.045] * 8 + [0.026] * 8, [8], []),  # turned, but not far enough
        ([0.04] * 8 + [0.0] * 8 + [0.03] * 8, [8], [16]),
        ([0.03] * 8 + [0.05] * 8, [], [8]),
        ([0.03] * 5 + [0.0] + [0.03] * 5, [], []),  # missed once
        (np.linspace(0.03, 0.05, 16), [], []),
        (np.linspace(0.008, 0.03, 16), [], []),  # unseen at first
    ],
)
def test_a_wheel_that_was_turned_or_replaced_is_seen_as_such(lengths, renewed, struck):
    rng = np.random.default_rng(len(lengths))
    told = [flat(one * (1.0 + 0.02 * rng.standard_normal())) if one > 0.017 else healthy() for one in lengths]
    grown = wt.diagnosis.wheel_growth(told, range(len(told)))
    assert [int(one.first) for one in grown.courses if one.begins == "renewed"] == renewed
    assert grown.renewals == tuple(map(float, renewed))
    assert [int(one.first) for one in grown.courses if one.begins == "new flat"] == struck
    if lengths[-1] == 0.0 and renewed:
        assert grown.length is None
        assert grown.rate is None
        assert f"no flat since passage {renewed[-1]}" in str(grown)
    elif lengths[-1] == 0.0:
        assert "no flat was seen at the last 2 passages" in str(grown)
    else:
        low, high = grown.length_interval
        assert low < lengths[-1] < high


def test_passages_at_which_a_flat_was_not_found_bound_its_line():
    """Six healthy passages say that the flat was short then, so that it has grown since."""
    found = [flat(0.021), flat(0.022)]
    alone = wt.diagnosis.wheel_growth(found, [10, 11])
    after = wt.diagnosis.wheel_growth([healthy()] * 6 + found, [0, 2, 4, 6, 8, 9, 10, 11])
    assert len(after.courses) == 1
    assert np.ptp(after.rate_interval) < np.ptp(alone.rate_interval)
    assert after.courses[0].length(4.0)[0] < 0.018
    assert alone.courses[0].healthy == 0
    assert after.courses[0].healthy == 6


def test_kinds_that_are_not_told_are_those_of_their_neighbours_and_changes_are_said():
    rows = [
        flat(0.03),
        flat(0.039, kind="rounded flat", alike=True),
        flat(0.031),
        flat(0.032),
        flat(0.033, kind="rounded flat"),
    ]
    grown = wt.diagnosis.wheel_growth(rows, range(5))
    assert [one.kind for one in grown.passages] == ["wheel flat"] * 4 + ["rounded flat"]
    assert grown.passages[1].length == pytest.approx(0.03)
    assert "a rounded flat from passage 4 on" in str(grown)


def test_a_growth_that_is_not_steady_is_said_and_its_interval_is_wider():
    at = np.arange(20.0)
    steady, bent = (
        wt.diagnosis.wheel_growth([flat(one, 0.004) for one in lengths], at)
        for lengths in (0.03 + 0.01 * at / 19.0, 0.03 + 0.02 * np.abs(at - 9.5) / 9.5)
    )
    assert steady.holds
    assert not bent.holds
    assert bent.reduced > 2.0
    assert "steady growth does not explain" in str(bent)
    assert np.ptp(bent.rate_interval) > 2.0 * np.ptp(steady.rate_interval)


def test_when_a_length_is_reached():
    at = np.arange(0.0, 30.0, 3.0)
    grown = wt.diagnosis.wheel_growth([flat(0.03 + 2e-4 * one, 0.003) for one in at], at, unit="day")
    assert grown.reached("40 mm")["median"] == pytest.approx(50.0, rel=0.02)
    assert 40.0 < grown.reached(0.04)["low"] < 50.0 < grown.reached(0.04)["high"]
    assert grown.reached("20 mm") == {"low": 27.0, "median": 27.0, "high": 27.0}
    level = wt.diagnosis.wheel_growth([flat(0.03, 0.003) for _ in at], at)
    assert level.reached("50 mm")["high"] is None
    with pytest.raises(wt.InputError, match="less than twice"):
        wt.diagnosis.wheel_growth([healthy()], [0]).reached("50 mm")


def test_times_are_days_and_may_be_in_any_order(tmp_path):
    days = [3, 0, 1, 2]
    rows = [flat(0.03 + 1e-3 * one) for one in days]
    grown = wt.diagnosis.wheel_growth(rows, [f"2026-11-0{1 + day}T06:30" for day in days])
    same = wt.diagnosis.wheel_growth(rows, np.array([f"2026-11-0{1 + day}T06:30" for day in days], "datetime64[s]"))
    assert grown.to_dict() == same.to_dict()
    assert grown.unit == "day"
    assert grown.start == "2026-11-01T06:30:00"
    assert grown.rate == pytest.approx(1e-3, rel=0.02)
    assert [one.at for one in grown.passages] == [0.0, 1.0, 2.0, 3.0]
    assert grown.time(1.5) == "2026-11-02 18:30"
    figure = wt.plot(grown, tmp_path / "growth.svg")
    assert flaws(figure) == []
    assert "mm a day" in repr(grown)


def test_what_says_nothing_of_a_flat_is_left_out_and_told():
    odd = flat(0.05) | {"verdict": "not explained"}
    unseen = {"verdict": "no strikes"}
    entry = {"verdict": "strikes", "finding": flat(0.032)}
    grown = wt.diagnosis.wheel_growth([flat(0.03), odd, unseen, entry], [0, 1, 2, 3])
    assert [one.at for one in grown.passages] == [0.0, 3.0]
    assert "2 passages say nothing of a flat" in str(grown)


@pytest.mark.parametrize(
    ("rows", "at", "said"),
    [
        ([flat(0.03)], [0, 1], "at: found 2 of them, with 1 passages; allowed: one for each"),
        ([flat(0.03)], ["yesterday"], "at: found"),
        ([flat(0.03)], [np.nan], "at: found"),
        ([{"verdict": "no strikes"}], [0], "passages: found none that says whether the wheel has a flat"),
        ([], [], "passages: found none"),
        ([3.0], [0], "passages: found 3.0"),
    ],
)
def test_what_is_no_passage_is_refused(rows, at, said):
    with pytest.raises(wt.InputError, match=said):
        wt.diagnosis.wheel_growth(rows, at)


# -- passages that are fitted -----------------------------------------------------------------------------------------


def passages(lengths, seed):
    """Return findings of a wheel before gauges on a track that is not the stated one; the same in all passages.

    Noise, roughness, speed, load and the place of the strike are others each time.
    """
    sensors = [one.model_copy(update={"x1": one.x1 + 6.0, "x2": one.x2 + 6.0}) for one in site().sensors]
    place, rng = site().replaced({"sensors": sensors}), np.random.default_rng(seed)
    truth = known_of(place).scene.replaced({
        "track.pad_stiffness": 0.93 * PAD, "track.pad_damping": 1.15 * PAD_DAMPING, "vehicle.mass": 0.96 * MASS,
        "track.ballast_stiffness": 1.1 * BALLAST, "contact.constant_per_wheel": 1.04 * HERTZ,
        "vehicle.radius": 0.995 * RADIUS, "track.first_sleeper": 0.0,
    })  # fmt: skip
    gains, out = 1.0 + 0.05 * rng.standard_normal(len(sensors)), []
    for length in lengths:
        speed, load, first = rng.uniform((14.0, 45e3, 0.1), (26.0, 90e3, 2.9))
        rough = wt.irregularities.Spectrum(
            curve="ISO 3095:2013", wavelengths=(0.022, 0.4), seed=int(rng.integers(1_000_000))
        )
        flaw = [wt.WheelFlat(length=length, position=first, shape="fresh")] if length else []
        run = truth.replaced({
            "vehicle.load": load - 0.96 * MASS * 9.81, "speed": speed, "duration": 13.0 / speed,
            "irregularity": [*flaw, rough],
        })  # fmt: skip
        seen = {
            name: replace(one, samples=gain * one.samples + 500.0 * rng.standard_normal(len(one.samples)))
            for gain, (name, one) in zip(gains, wt.simulate(run).recordings(place).items(), strict=True)
        }
        out.append(wt.diagnosis.measure_trains(seen, place, diagnosed="suspicious")[0])
    return out


@pytest.mark.slow
@pytest.mark.whole
def test_growth_of_a_flat_that_is_fitted_again_and_again():
    lengths = [*np.linspace(0.034, 0.0396, 8), 0.0, 0.0, 0.0, 0.0]
    trains = passages(lengths, 1)
    assert not trains[-1].wheels  # a wheel without a flaw is not fitted, and yet tells what would have been found
    entries = [train.axles[0]["wheels"][0] for train in trains]
    grown = wt.diagnosis.wheel_growth(entries, range(len(entries)))
    assert grown.renewals == (8.0,)
    before = wt.diagnosis.wheel_growth([train.wheels[1, None] for train in trains[:8]], range(8))
    low, high = before.rate_interval
    print(before)
    assert low < 0.8e-3 < high
    assert high - low < 0.4e-3
    assert before.holds
    short, long = before.length_interval
    assert short < lengths[7] < long
    one = trains[7].wheels[1, None]
    broken = one.breaking_length("250 kN", speed=25.0)
    assert broken["high"] < broken["median"] < broken["low"]
    peak = one.outlook([25.0]).largest_force.sel(quantile="median").item()
    (longest,) = (one.breaking_length(peak, speed=25.0)["median"],)
    assert longest == pytest.approx(one.sized.best.values["length"], rel=0.1)
    assert before.reached(broken["median"])["median"] >= 7.0
