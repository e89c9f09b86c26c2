"""Ride comfort against the tables of the standards, closed forms, and the analogue filters integrated over time."""

import numpy as np
import pytest
import xarray as xr
from scipy import signal

from wheeltapper.ground.errors import InputError
from wheeltapper.record.assessment.comfort import (
    AXES,
    RESULTS,
    WEIGHTINGS,
    comfort,
    ride_comfort,
    running_rms,
    weighted,
    weighting,
)

RATE = 500.0

# ISO 2631-1:1997, Table 3: nominal one-third-octave frequencies, factors x 1000.
TABLE_3 = {
    "Wk": {0.5: 418, 1: 482, 2: 531, 3.15: 804, 4: 967, 5: 1039, 6.3: 1054, 8: 1036, 12.5: 902, 16: 768, 25: 513,
           31.5: 405, 50: 246, 63: 186, 80: 132},
    "Wd": {0.5: 853, 0.63: 944, 0.8: 992, 1: 1011, 1.25: 1008, 1.6: 968, 2: 890, 3.15: 642, 4: 512, 5: 409, 8: 253,
           12.5: 161, 16: 125, 20: 100, 31.5: 63.2, 40: 49.4, 63: 29.5, 80: 21.1},
}  # fmt: skip
# ISO 8041-1:2017, Table B.1: Wb at exact frequencies, 0.1 Hz to 400 Hz in steps of a tenth of a decade.
TABLE_B1 = [
    0.02494, 0.03941, 0.06198, 0.09645, 0.1464, 0.2113, 0.28, 0.3347, 0.3666, 0.3808, 0.3853, 0.3864, 0.3916, 0.4168,
    0.496, 0.6653, 0.885, 1.026, 1.054, 1.026, 0.9745, 0.9042, 0.8144, 0.7088, 0.5973, 0.4906, 0.395, 0.3118, 0.2389,
    0.1734, 0.1154, 0.06929, 0.03818, 0.01999, 0.0102, 0.005154, 0.002591,
]  # fmt: skip


def factor(name, frequency):
    return abs(weighting(name, frequency))


def sinusoids(amplitudes, frequencies, seconds, rate=RATE):
    time = np.arange(round(seconds * rate)) / rate
    return [a * np.sin(2 * np.pi * f * time) for a, f in zip(amplitudes, frequencies, strict=True)]


# -- weightings -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["Wk", "Wd"])
def test_wk_and_wd_have_the_factors_of_iso_2631_1(name):
    frequencies, printed = np.array(list(TABLE_3[name])), np.array(list(TABLE_3[name].values()))
    # The printed factors belong partly to nominal, partly to exact frequencies, up to 1.6 % apart.
    exact = 10.0 ** (np.round(10.0 * np.log10(frequencies)) / 10.0)
    found = 1000.0 * np.array([factor(name, frequencies), factor(name, exact)])
    slack = 0.5 * 10.0 ** (np.floor(np.log10(printed)) - 2) / printed
    assert (found.min(axis=0) <= printed * (1.0 + slack + 0.005)).all()
    assert (found.max(axis=0) >= printed * (1.0 - slack - 0.005)).all()


def test_wb_has_every_factor_of_iso_8041_1():
    found = factor("Wb", 10.0 ** (np.arange(-10, 27) / 10.0))
    rounding = 0.5001 * 10.0 ** (np.floor(np.log10(TABLE_B1)) - 3)
    assert (abs(found - TABLE_B1) <= rounding).all()


def test_factors_at_100_radians_per_second_and_phases_are_those_of_iso_8041_1():
    reference = 100.0 / (2 * np.pi)
    for name, printed in (("Wb", 0.8126), ("Wd", 0.1261), ("Wk", 0.7718)):
        assert factor(name, reference) == pytest.approx(printed, abs=6e-5)
    assert np.degrees(np.angle(weighting("Wb", 1.0))) == pytest.approx(42.42, abs=0.01)
    assert np.degrees(np.angle(weighting("Wk", 10**1.2))) == pytest.approx(-61.84, abs=0.01)


def test_the_older_railway_form_of_wb_differs_by_as_much_as_its_docstring_says():
    ratio = factor("Wb EN 12299:2009", [0.3, 10**0.6, 10**1.2, 400.0]) / factor("Wb", [0.3, 10**0.6, 10**1.2, 400.0])
    np.testing.assert_allclose(ratio, [1.0013, 0.925, 1.133, 1.0006], atol=1e-3)


def test_no_acceleration_passes_at_rest():
    assert weighting("Wk", 0.0) == 0.0


# -- filters --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", list(WEIGHTINGS))
@pytest.mark.parametrize("rate", [250.0, 400.0, 1000.0, 10_000.0])
def test_the_digital_weighting_is_the_analogue_one_up_to_a_quarter_of_the_rate(name, rate):
    impulse = np.zeros(round(20 * rate))
    impulse[0] = 1.0
    found = np.fft.rfft(weighted(impulse, rate, name))
    frequency = np.fft.rfftfreq(len(impulse), 1 / rate)
    among = (frequency >= 0.1) & (frequency <= rate / 4)
    ratio = found[among] / weighting(name, frequency[among])
    assert abs(abs(ratio) - 1.0).max() < 2e-3
    assert abs(np.angle(ratio)).max() < 2e-3
    assert abs(found[~among]).max() < 1.7 * factor(name, rate / 4) + 0.1  # nothing is amplified above


@pytest.mark.parametrize("name", ["Wk", "Wd"])
def test_the_digital_weighting_follows_the_analogue_one_from_rest(name):
    (f3, f4, q4), step = WEIGHTINGS[name].transition, WEIGHTINGS[name].step
    w = 2 * np.pi
    above, below = np.array([1 / (w * 0.4) ** 2, 0, 0]), np.array([1 / (w * 0.4) ** 2, np.sqrt(2) / (w * 0.4), 1])
    above = np.polymul(above, [1 / (w * f3), 1])
    for f, q in ((100.0, np.sqrt(0.5)), (f4, q4)):
        below = np.polymul(below, [1 / (w * f) ** 2, 1 / (q * w * f), 1])
    if step is not None:
        f5, q5, f6, q6 = step
        above = np.polymul(above, np.array([1 / (w * f5) ** 2, 1 / (q5 * w * f5), 1]) * (f5 / f6) ** 2)
        below = np.polymul(below, [1 / (w * f6) ** 2, 1 / (q6 * w * f6), 1])
    fine, every = 20_000.0, 20
    time = np.arange(40_000) / fine
    pulse = np.where((time > 0.1) & (time < 0.2), np.sin(10 * np.pi * (time - 0.1)) ** 2, 0.0)
    expected = signal.lsim((above, below), pulse, time)[1][::every]
    found = weighted(pulse[::every], fine / every, name)
    assert abs(found[:100]).max() == 0.0
    np.testing.assert_allclose(found, expected, atol=1e-3 * abs(expected).max())


def test_rows_are_weighted_one_by_one():
    rows = np.random.default_rng(1).standard_normal((2, 3, 400))
    np.testing.assert_array_equal(weighted(rows, RATE, "Wb")[1, 2], weighted(rows[1, 2], RATE, "Wb"))
    assert weighted(np.zeros((3, 0)), RATE, "Wb").shape == (3, 0)


def test_the_running_rms_is_that_of_every_window():
    samples = np.random.default_rng(2).standard_normal((2, 57))
    found = running_rms(samples, 10.0, 0.7)
    expected = np.sqrt((np.lib.stride_tricks.sliding_window_view(samples, 7, axis=-1) ** 2).mean(axis=-1))
    np.testing.assert_allclose(found, expected, rtol=1e-12)
    assert running_rms(samples, 10.0, 5.7).shape == (2, 1)
    assert running_rms(samples, 10.0, 5.8).shape == (2, 0)
    after_shock = running_rms(np.append(1e9, np.full(50, 1e-9)), 1.0, 3.0)
    assert np.isfinite(after_shock).all()


# -- numbers --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vertical", ["Wb", "Wb EN 12299:2009"])
def test_sinusoids_have_the_numbers_of_their_closed_forms(vertical):
    amplitudes, frequencies = np.array([0.1, 0.3, 0.5]), np.array([3.0, 1.0, 8.0])
    found = ride_comfort(*sinusoids(amplitudes, frequencies, 60.0), RATE, vertical_weighting=vertical, settling=20.0)
    rail = amplitudes * [factor(n, f) for n, f in zip(("Wd", "Wd", vertical), frequencies, strict=True)]
    iso = amplitudes * [factor(n, f) for n, f in zip(("Wd", "Wd", "Wk"), frequencies, strict=True)]
    close = {"rtol": 1e-3}
    np.testing.assert_allclose(found["weighted_rms"], iso / np.sqrt(2), **close)
    np.testing.assert_allclose(found["weighted_rms_rail"], rail / np.sqrt(2), **close)
    np.testing.assert_allclose(found["vibration_total_value"], np.linalg.norm(iso) / np.sqrt(2), **close)
    np.testing.assert_allclose(found["maximum_transient_vibration"], iso / np.sqrt(2), **close)
    np.testing.assert_allclose(found["vibration_dose"], iso * (3 / 8 * 40.0) ** 0.25, **close)
    assert found["blocks"] == 8
    assert found["continuous_comfort"].shape == (3, 8)
    np.testing.assert_allclose(found["continuous_comfort"], np.tile(rail / np.sqrt(2), (8, 1)).T, **close)
    np.testing.assert_allclose(found["percentile_95"], rail / np.sqrt(2), **close)
    np.testing.assert_allclose(found["mean_comfort"], 6 * np.linalg.norm(rail) / np.sqrt(2), **close)


def test_five_minutes_have_sixty_blocks_and_the_percentile_is_between_the_third_and_the_fourth_largest():
    rng = np.random.default_rng(3)
    louder = np.repeat(rng.uniform(0.5, 2.0, 60), 5 * 250)
    found = ride_comfort(*(louder * rng.standard_normal((3, 300 * 250))), 250.0)
    assert found["blocks"] == 60
    ordered = np.sort(found["continuous_comfort"], axis=-1)
    # 0.95 of the way from the smallest to the largest of 60: 0.05 of the way from the 57th to the 58th.
    expected = 0.95 * ordered[:, 56] + 0.05 * ordered[:, 57]
    np.testing.assert_allclose(found["percentile_95"], expected, rtol=1e-12)


def test_a_short_record_has_no_mean_comfort():
    found = ride_comfort(*sinusoids([1.0] * 3, [5.0] * 3, 4.9), RATE)
    assert found["blocks"] == 0
    assert np.isnan(found["mean_comfort"])
    assert np.isnan(found["percentile_95"]).all()
    assert found["continuous_comfort"].shape == (3, 0)
    assert np.isfinite(found["maximum_transient_vibration"]).all()
    shorter = ride_comfort(*sinusoids([1.0] * 3, [5.0] * 3, 0.9), RATE)
    assert np.isnan(shorter["maximum_transient_vibration"]).all()
    assert np.isfinite(shorter["weighted_rms"]).all()


def test_numbers_are_proportional_to_the_acceleration():
    rows = np.random.default_rng(4).standard_normal((3, 3000))
    once, thrice = ride_comfort(*rows, RATE), ride_comfort(*(3 * rows), RATE)
    for name in set(RESULTS) - {"blocks"}:
        np.testing.assert_allclose(thrice[name], 3 * np.asarray(once[name]), rtol=1e-12)


@pytest.mark.parametrize(
    ("changed", "field"),
    [
        ({"rate": 249.0}, "rate"),
        ({"rate": np.nan}, "rate"),
        ({"lateral": np.zeros(9)}, "lateral"),
        ({"vertical": np.zeros((2, 500))}, "vertical"),
        ({"vertical": np.full(500, np.nan)}, "acceleration"),
        ({"vertical_weighting": "Wk"}, "vertical_weighting"),
        ({"settling": 1.0}, "settling"),
        ({"settling": np.nan}, "settling"),
    ],
)
def test_wrong_input_is_refused(changed, field):
    quiet = np.zeros(500)
    with pytest.raises(InputError) as raised:
        ride_comfort(**{"longitudinal": quiet, "lateral": quiet, "vertical": quiet, "rate": RATE} | changed)
    assert raised.value.field == field


def test_an_unknown_weighting_and_an_empty_window_are_refused():
    for call in (lambda: weighting("Wz", 1.0), lambda: weighted(np.zeros(9), RATE, "Wz")):
        with pytest.raises(InputError, match="Wz"):
            call()
    with pytest.raises(InputError, match="at least one sample"):
        running_rms(np.zeros(9), RATE, 0.0)


# -- records --------------------------------------------------------------------------------------------------------


class Swaying:
    """A record of a car body that shakes, rolls, pitches and yaws; its wheelset is quiet."""

    motions = ("x", "y", "z", "roll", "pitch", "yaw")
    amplitudes = np.array([0.1, 0.2, 0.3, 0.4, 0.05, 0.02])

    def history(self, rate):
        time = np.arange(round(30 * rate)) / rate
        values = np.zeros((len(time), 2, 6))
        values[:, 0] = np.outer(np.sin(2 * np.pi * 2.0 * time), self.amplitudes)
        axes = {"time": time, "body": ["car body", "wheelset 1"], "motion": list(self.motions)}
        return xr.Dataset({"acceleration": (("time", "body", "motion"), values)}, axes)


class Wheel:
    """A record without bodies."""

    def history(self, rate):
        return xr.Dataset({"wheel_acceleration": ("time", np.zeros(10))})


def test_the_acceleration_at_a_point_is_that_of_a_rigid_body():
    x, y, z = 8.0, 1.0, -0.5
    found = comfort(Swaying(), at=(x, y, z), rate=RATE, settling=10.0)
    ax, ay, az, roll, pitch, yaw = Swaying.amplitudes
    expected = np.array([ax + pitch * z - yaw * y, ay + yaw * x - roll * z, az + roll * y - pitch * x])
    factors = np.array([factor(name, 2.0) for name in ("Wd", "Wd", "Wk")])
    np.testing.assert_allclose(found.weighted_rms, abs(expected) * factors / np.sqrt(2), rtol=1e-3)
    centre = comfort(Swaying(), rate=RATE, settling=10.0)
    np.testing.assert_allclose(centre.weighted_rms, Swaying.amplitudes[:3] * factors / np.sqrt(2), rtol=1e-3)


def test_the_numbers_of_a_record_say_what_they_are():
    found = comfort(Swaying(), rate=RATE, settling=10.0)
    assert set(found.data_vars) == {*RESULTS, "weighted_acceleration", "running_rms"}
    for name in RESULTS:
        assert found[name].attrs["units"] == RESULTS[name][0]
        assert found[name].attrs["long_name"]
    assert list(found.axis.values) == list(AXES)
    np.testing.assert_allclose(found.block, [15.0, 20.0, 25.0, 30.0])
    assert found.continuous_comfort.dims == ("axis", "block")
    assert found.attrs["vertical_weighting"] == "Wb"
    assert float(comfort(Swaying(), body="wheelset 1", rate=RATE).mean_comfort) == 0.0


@pytest.mark.parametrize(
    ("settling", "parts"),
    [
        (29.5, ("maximum_transient_vibration needs 1 s", "need a block of 5 s", "counted here: 0.5 s")),
        (27.0, ("need a block of 5 s", "counted here: 3 s")),
        (10.0, ("by the standard takes 300 s", "counted here: 20 s")),
    ],
)
def test_what_a_record_is_too_short_for_is_said(settling, parts):
    found = comfort(Swaying(), rate=RATE, settling=settling)
    for part in parts:
        assert part in found.attrs["note"]
    assert bool(np.isnan(found.mean_comfort)) == ("need a block" in found.attrs["note"])
    transient = bool(np.isnan(found.maximum_transient_vibration).any())
    assert transient == ("transient" in found.attrs["note"])


def test_a_wrong_question_to_a_record_is_refused():
    with pytest.raises(InputError, match=r"body: found 'bogie'; allowed: 'car body', 'wheelset 1'"):
        comfort(Swaying(), body="bogie", rate=RATE)
    with pytest.raises(InputError, match="the record of a wagon"):
        comfort(Wheel(), rate=RATE)
    with pytest.raises(InputError, match="three numbers"):
        comfort(Swaying(), at=(1.0, 2.0), rate=RATE)
    with pytest.raises(InputError, match="rate"):
        comfort(Swaying(), rate=100.0)
