"""Sites calibrated by their own traffic: runs of the package with roughness, and recordings of finite elements.

What is sought is known: gains, places and tracks differ from the stated ones by known amounts.
"""

import json
from functools import cache

import numpy as np
import pytest

from tests.traffic import AXLES, PAIRS, RATE, gauges, train
from tests.wayside import BALLAST, HERTZ, PAD, PAD_DAMPING, Line, Wheel, train_of
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis import Recording, calibrate_site
from wheeltapper.diagnosis.gauges.calibration import estimated, pooled
from wheeltapper.diagnosis.gauges.known import known_of
from wheeltapper.diagnosis.gauges.passing import Passing
from wheeltapper.diagnosis.gauges.traffic import LEVEL, NOISE, TILT, Alike, Traffic, stepped
from wheeltapper.faces.cli import main
from wheeltapper.ground.errors import InputError

from .test_gauges import SHEAR, TRACK

GAINS = 1.0 + 0.05 * np.array([1.0, -1.2, 0.7, -0.5])
OFF = 3e-3 * np.array([[1.0, -0.5], [-1.2, 0.6], [0.9, 0.2], [-1.0, 0.3]])
"""By how much gauges lie beside the stated places, m."""
LOADS = (7e4, 6.6e4, 7.3e4, 6.9e4)
DEVIATIONS = 3.5
"""Values may be so many of their standard deviations beside the true ones."""


def without_track(site):
    return site.replaced({"track": None, "unsprung_mass": None, "contact": None, "uncertainty": {}})


@cache
def traffic(pads=1.2, trains=2):
    """Return recordings of trains on a track of stiffer pads and softer ballast, whose gauges are off, too."""
    there = (np.array(PAIRS) + OFF).tolist()
    true = gauges(TRACK, there).replaced({"track.pad_stiffness": pads * PAD, "track.ballast_stiffness": 0.8 * BALLAST})
    return {f"2026-0{1 + 3 * k}-05T10-00": train(true, 20.0, LOADS, k, gains=GAINS) for k in range(trains)}


def apart(one, true):
    return abs(one.value - true) / one.after


@pytest.mark.slow
def test_gains_and_places_follow_from_traffic_and_the_scale_from_known_loads():
    site = without_track(gauges(TRACK))
    found = calibrate_site(site, traffic())
    gains = np.array([found[f"sensors.{k}.gain"].value for k in range(4)])
    np.testing.assert_allclose(gains / gains.mean(), GAINS / GAINS.mean(), atol=0.005)  # 8 wheels
    assert found["sensors.0.gain"].after > 0.02  # the scale stays that of the stated gains
    ends = np.array([[found[f"sensors.{k}.{end}"].value for end in ("x1", "x2")] for k in range(4)]).ravel()
    affine = np.stack([np.ones(8), ends], axis=1)
    left = ends - (np.array(PAIRS) + OFF).ravel()
    left -= affine @ np.linalg.lstsq(affine, left)[0]
    assert np.abs(left).max() < 1.2e-3  # m, but for a common shift and stretch, which the speed hides
    name = next(iter(traffic()))
    weighed = calibrate_site(site, traffic(), loads={name: {k + 1: (load, load) for k, load in enumerate(LOADS)}})
    found = np.array([weighed[f"sensors.{k}.gain"].value for k in range(4)])
    np.testing.assert_allclose(found, GAINS, rtol=0.012)
    assert weighed["sensors.0.gain"].after < 0.01
    assert not weighed.contradictions
    assert weighed.site.sensors[0].gain == weighed["sensors.0.gain"].value


def test_a_gain_and_a_place_that_contradict_the_traffic_are_said():
    site = without_track(gauges(TRACK)).replaced({"sensors.2.gain": 1.4, "sensors.1.x2": 1.13})
    found = calibrate_site(site, traffic())
    assert {"sensors.2.gain", "sensors.1.x2"} <= {one.path for one in found.contradictions}
    assert "CONTRADICTS the stated value" in str(found)


@pytest.mark.slow
def test_pads_and_ballast_follow_from_healthy_wheels(tmp_path):
    site = gauges(TRACK)
    found = calibrate_site(site, traffic())
    assert found.wheels == 8
    assert apart(found["track.pad_stiffness"], 1.2 * PAD) < DEVIATIONS
    assert apart(found["track.ballast_stiffness"], 0.8 * BALLAST) < DEVIATIONS
    assert found["track.pad_stiffness"].scatter < 0.08 * PAD
    assert "contact.constant_per_wheel" in found.unknown
    assert abs(found["roughness level"].value) < 2.0  # dB
    assert not found.contradictions
    found.site.to_toml(tmp_path / "site.toml")
    again = Site.from_toml(tmp_path / "site.toml")
    assert again == found.site
    assert again.track.pad_stiffness == found["track.pad_stiffness"].value
    assert again.uncertainty["track.pad_stiffness"] < 0.18 < site.uncertainty["track.pad_stiffness"]
    json.dumps(found.to_dict())


@pytest.mark.whole
@pytest.mark.slow
def test_pads_that_are_ten_times_as_stiff_as_stated_are_said():
    found = calibrate_site(gauges(TRACK), traffic(10.0))
    assert "track.pad_stiffness" in {one.path for one in found.contradictions}
    assert found["track.pad_stiffness"].value == pytest.approx(10.0 * PAD, rel=0.3)
    assert found["track.pad_stiffness"].apart > 5.0
    assert found.site.track.pad_stiffness == found["track.pad_stiffness"].value


@pytest.mark.whole
@pytest.mark.slow
def test_finite_elements_are_calibrated_and_pads_ten_times_off_are_said():
    for pads in (0.8, 10.0):
        found = calibrate_site(gauges(TRACK), {"one": finite_elements(pads)})
        pad = found["track.pad_stiffness"]
        assert pad.contradicted == (pads > 1.0)
        assert apart(pad, pads * PAD) < DEVIATIONS
        assert apart(found["track.ballast_stiffness"], 1.2 * BALLAST) < DEVIATIONS
        gains = np.array([found[f"sensors.{k}.gain"].value for k in range(4)])
        np.testing.assert_allclose(gains / gains.mean(), GAINS / GAINS.mean(), atol=0.01)


def finite_elements(pads):
    """Return what the gauges recorded of two wagons on a track whose pads are so many times as stiff as stated."""
    line = Line(
        [("pair", *one) for one in np.array(PAIRS) + OFF], before=9.0, pad=pads * PAD, ballast=1.2 * BALLAST,
        pad_damping=1.2 * PAD_DAMPING, shear=SHEAR, per_bay=8, hertz=1.04 * HERTZ,
    )  # fmt: skip
    rng = np.random.default_rng(8)
    wheels = [Wheel(7e4 * (1.0 + 0.05 * rng.standard_normal()), seed=600 + k) for k in range(8)]
    axles = (*AXLES, *(14.4 + axle for axle in AXLES))
    read, _ = train_of(line, line.passages(wheels, 20.0, RATE), 20.0, RATE, axles, range(8))
    read = GAINS[:, None] * read + 500.0 * rng.standard_normal(read.shape)
    return {f"{number}": Recording(row, RATE, "force") for number, row in enumerate(read)}


def test_what_changes_from_quarter_to_quarter_is_told():
    """Gauge 1 loses 4 % of its gain in the second quarter; the others stay."""
    site = without_track(gauges(TRACK))
    changed = {name: dict(one) for name, one in traffic().items()}
    last = [*changed][-1]
    one = changed[last]["1"]
    changed[last]["1"] = Recording(0.96 * one.samples, RATE, "force")
    found = calibrate_site(site, changed, period="quarter")
    assert [*found.periods] == ["2026-Q1", "2026-Q2"]
    drifts = {one.path: one for one in found.drift}
    assert drifts["sensors.1.gain"].drifts
    first, second = drifts["sensors.1.gain"].values
    assert second / first == pytest.approx(0.97, abs=0.008)  # 4 % less the mean over the four, which hides in loads
    constant = calibrate_site(site, traffic(), period="quarter")
    assert not any(one.drifts for one in constant.drift if one.path.endswith("gain"))


def test_the_command_writes_the_site_and_says_what_it_found(tmp_path, capsys):
    site = without_track(gauges(TRACK))
    site.to_toml(tmp_path / "site.toml")
    (tmp_path / "traffic").mkdir()
    for name, seen in traffic().items():
        rows = np.column_stack([one.samples for one in seen.values()])
        header = f"rate: {RATE:g} Hz\n" + ",".join(f"{one} [N]" for one in seen)
        np.savetxt(tmp_path / "traffic" / f"{name}.csv", rows, header=header, fmt="%.6g", delimiter=",")
    names = [*traffic()]
    (tmp_path / "loads.toml").write_text(f'["{names[0]}.csv"]\n1 = "140 kN"\n2 = ["66 kN", 66e3]\n')
    new, values = tmp_path / "new.toml", tmp_path / "values.json"
    command = ["calibrate", str(tmp_path / "traffic"), "--site", str(tmp_path / "site.toml"), "--output", str(new)]
    more = ["--loads", str(tmp_path / "loads.toml"), "--values", str(values), "--period", "quarter"]
    assert main([*command, *more]) == 0
    assert "sensors.0.gain: 1.0" in capsys.readouterr().out
    assert Site.from_toml(new).sensors[0].gain == pytest.approx(GAINS[0], rel=0.015)
    assert json.loads(values.read_text())["trains"] == 2
    (tmp_path / "loads.toml").write_text("[other]\n1 = 1e5\n")
    assert main([*command, *more]) == 2
    assert "loads: found 'other'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("given", "options", "said"),
    [
        ({}, {}, "recordings: found"),
        ("nowhere", {}, "no readable folder"),
        ({"a": {}}, {}, "no column for 4 of 4 sensors"),
        (None, {"loads": {"b": {1: 1e5}}}, "loads: found 'b'"),
        (None, {"period": "quarter"}, "no time in the name 'a'"),
        (None, {"period": "week"}, "period: found 'week'"),
        (None, {"places": "3 kg"}, "places: found '3 kg'"),
    ],
)
def test_bad_input_is_said(given, options, said):
    recordings = {"a": next(iter(traffic().values()))} if given is None else given
    with pytest.raises(InputError, match=said):
        calibrate_site(without_track(gauges(TRACK)), recordings, **options)


def made_up(wheels, rail):
    """Return wheels whose readings are drawn from the model's own covariance, of which a share is the rail's."""
    site = gauges(TRACK)
    known = known_of(site)
    x = -1.3 + 20.0 / RATE * np.arange(1250)
    ends = np.array(PAIRS).T
    near = np.minimum(abs(x[:, None] - ends[0]), abs(x[:, None] - ends[1])) > 0.08
    used = near & (x[:, None] > ends[0] - 0.35) & (x[:, None] < ends[1] + 0.35)
    passing = Passing(site.sensors, RATE, np.zeros(used.shape), used, -1.3, 20.0, 7e4, 500.0)
    made = Traffic(Alike(passing, np.zeros((*used.shape, wheels)), np.full(wheels, 7e4)), known.scene)
    values = {"vehicle.mass": 600.0, "contact.constant_per_wheel": HERTZ, LEVEL: 0.0, TILT: 0.0, NOISE: 0.0}
    signal, rough = made.model(values)
    rng = np.random.default_rng(4)
    root = np.linalg.cholesky(rough + 1e-9 * np.eye(len(rough)) * rough.max())
    own, shared = (rng.standard_normal((len(rough), count)) for count in (wheels, 1))
    made._read = signal[:, None] + root @ (np.sqrt(1.0 - rail) * own + np.sqrt(rail) * shared)
    made._read += rng.standard_normal(made._read.shape)
    return made, values


@pytest.mark.slow
def test_the_likelihood_slopes_as_its_differences_do_and_curves_as_fisher_says():
    made, values = made_up(6, 0.3)
    made.mix(values)
    names = (LEVEL, TILT, NOISE, "vehicle.mass")
    there = stepped(stepped(values, "vehicle.mass", 0.05), LEVEL, 0.3)
    told = made.told(there, names)
    for number, name in enumerate(names):
        step = 0.04
        up, down = (made.told(stepped(there, name, by)).likelihood for by in (step, -step))
        assert told.slope[number] == pytest.approx((up - down) / (2.0 * step), rel=0.1, abs=2.0)
    assert np.all(np.linalg.eigvalsh(told.information) > 0.0)


@pytest.mark.slow
def test_roughness_that_all_wheels_share_is_told_as_the_rails():
    for rail, low, high in ((0.0, 0.0, 0.05), (0.6, 0.3, 0.9)):
        made, values = made_up(8, rail)
        made.mix(values)
        assert low <= made.mixed.rail <= high


@pytest.mark.slow
def test_a_wheel_that_is_far_rougher_is_left_out():
    made, _ = made_up(8, 0.0)
    made._read[:, 3] *= 12.0
    known = known_of(gauges(TRACK))._replace(spread={"vehicle.mass": 0.08})
    found = estimated([made], known)
    assert made.wheels == 7
    assert found.values["vehicle.mass"] == pytest.approx(600.0, rel=0.15)


def test_pooled_changes_keep_what_wheels_cannot_show_as_it_was_before():
    rng = np.random.default_rng(2)
    true, spread = np.array([0.03, -0.05, 0.01, 0.04]), np.full(4, 0.05)
    seen = true + 0.01 * rng.standard_normal((100, 4)) + rng.standard_normal((100, 1))
    found = pooled(seen, np.ones((4, 1)), spread, 1e-4, None)
    np.testing.assert_allclose(found.changes - found.changes.mean(), true - true.mean(), atol=4e-3)
    assert found.changes.mean() == pytest.approx(0.0, abs=1e-3)
    assert np.sqrt(found.covariance.sum()) / 4.0 == pytest.approx(0.05 / 2.0, rel=0.02)  # of their mean
    seen[5] = np.nan
    weighed = pooled(seen, np.ones((4, 1)), spread, 1e-4, (true, np.eye(4) / 2e-3**2))
    np.testing.assert_allclose(weighed.changes, true, atol=4e-3)
