"""Axle boxes: a wheel's flat and waves, and flaws of the rail, told apart by what repeats."""

import json
from functools import cache

import numpy as np
import pytest

import wheeltapper as wt
from tests.wayside import BALLAST, HERTZ, MASS, PAD, PAD_DAMPING, RADIUS, Line, Wheel
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis import Recording, diagnose_axle_box
from wheeltapper.diagnosis.axle_box.joints import distance_of
from wheeltapper.diagnosis.axle_box.turns import turns_of
from wheeltapper.faces.cli import main

from .test_gauges import SHEAR, TRACK
from .test_sizes_of_trains import UNCERTAIN

LOAD, RATE, NOISE = 8e4, 5e3, 2.0
TURN = 2.0 * np.pi * RADIUS
ROUGH = wt.irregularities.Spectrum(curve="ISO 3095:2013", seed=4, wavelengths=(0.03, 0.4))


def site(**changes):
    known = {
        "track": TRACK, "radius": RADIUS, "unsprung_mass": 0.95 * MASS, "static_force": 0.96 * LOAD,
        "contact": wt.Hertz(constant_per_wheel=HERTZ), "uncertainty": UNCERTAIN, "name": "line",
    }  # fmt: skip
    return Site(**{**known, **changes})


def recorded(acceleration, speed, seed=1):
    """Return a wheel's acceleration with noise; the measured speed is off by 1 %."""
    noise = NOISE * np.random.default_rng(seed).standard_normal(len(acceleration))
    return Recording(acceleration + noise, RATE, "vertical acceleration", speed=1.01 * speed)


def rolled(*irregularity, speed=20.0, turns=10, **track):
    """Return what an axle box records on a track whose values differ from the site's."""
    other = TRACK.model_copy(update={"pad_stiffness": 0.9 * PAD, "ballast_stiffness": 1.1 * BALLAST, **track})
    wheel = wt.Wheelset(mass=MASS, load=LOAD - MASS * 9.81, stiffness=0.0, damping=0.0, radius=RADIUS, wheels=1)
    scenario = wt.Scenario(
        vehicle=wheel, track=other, contact=wt.Hertz(constant_per_wheel=1.04 * HERTZ), speed=speed,
        duration=turns * TURN / speed, irregularity=irregularity,
    )  # fmt: skip
    (shown,) = wt.simulate(scenario).recordings(wt.sensors.AxleBoxAcceleration(rate=RATE)).values()
    return recorded(shown.samples, speed)


@cache
def worn():
    """Return what an axle box records of a wheel out of round that meets two joints."""
    joints = (wt.irregularities.DippedJoint(depth=d, length=0.4, position=x) for d, x in ((5e-4, 9.0), (3e-4, 21.0)))
    return rolled(wt.OutOfRound(orders=(3, 8), amplitudes=(3e-4, 1e-4), phases=(0.4, 2.0)), ROUGH, *joints)


@pytest.mark.slow
@pytest.mark.parametrize("change", [0.0, 4e-5])
def test_turns_of_a_wheel_are_found_beside_a_louder_joint(change):
    number, expected = np.arange(30), 0.1445
    period = 1.013 * expected
    when = 0.05 + period * number + 0.5 * change * period * number**2
    time = np.arange(int((when[-1] + 0.05) * RATE)) / RATE
    samples = np.exp(-(((time[:, None] - when) / 1e-3) ** 2)).sum(axis=1)
    samples += 0.1 * np.random.default_rng(2).standard_normal(len(time))
    for joint in (0.7, 1.9, 3.1):
        samples += 12.0 * np.exp(-(((time - joint) / 1e-3) ** 2))
    turns = turns_of(samples, RATE, expected, 0.06, 0.6 / TURN, 800.0)
    lags = np.mod(turns.done(when) + 0.5, 1.0) * turns.mean
    assert np.ptp(lags) < 3e-4


@pytest.mark.slow
def test_waves_of_the_wheel_and_joints_of_the_rail_are_told_apart():
    found = diagnose_axle_box(worn(), site())
    assert found.verdict == "out of round"
    orders = {row["order"]: row["amplitude"] for row in found.to_dict()["orders"]}
    assert orders[3] == pytest.approx(3e-4, rel=0.12)
    assert orders[8] == pytest.approx(1e-4, rel=0.2)
    assert max(size for order, size in orders.items() if order not in (1, 2, 3, 8)) < 3e-5
    np.testing.assert_allclose([one.place for one in found.joints], [9.0, 21.0], atol=0.1)
    assert found.wheel.speed == pytest.approx(20.0, rel=3e-3)
    for one, depth in zip(found.joints, (5e-4, 3e-4), strict=True):
        assert -one.height == pytest.approx(depth, rel=0.35)
    assert "Rail: 2 places stand out" in str(found)


@pytest.mark.slow
def test_joints_of_a_smooth_rail_have_their_length_and_height():
    joints = [wt.irregularities.DippedJoint(depth=d, length=0.4, position=x) for d, x in ((5e-4, 9.0), (3e-4, 21.0))]
    found = diagnose_axle_box(rolled(*joints), site())
    assert [one.kind for one in found.joints] == 2 * ["dipped joint"]
    for one, depth in zip(found.joints, (5e-4, 3e-4), strict=True):
        assert -one.height == pytest.approx(depth, rel=0.25)
        assert -one.interval[1] < depth < -one.interval[0]
        assert one.length == pytest.approx(0.4)


@pytest.mark.slow
def test_a_flat_is_sized_on_a_track_that_is_not_the_stated_one():
    found = diagnose_axle_box(rolled(ROUGH, wt.WheelFlat(length=0.032, position=1.3), turns=20), site())
    assert found.verdict == "wheel flat"
    (low, high), size = found.sizes["wheel flat"][1], found.sizes["wheel flat"][0]
    assert low < 0.032 < high
    assert size == pytest.approx(0.032, abs=2e-3)
    assert found.place == pytest.approx(1.3 / TURN, abs=5e-3)
    assert found.joints == ()
    ends = [end for kind in (found.verdict, *found.alike) for end in found.sizes[kind][1]]
    assert found.to_dict()["size_interval"] == [min(ends), max(ends)]  # of both kinds where they are left open


@cache
def by_finite_elements(speed):
    """Return forces of a flat wheel and of one without a flaw, on roughness, on a track other than the site's."""
    line = Line(
        [("pad", 0.0), ("pad", 30.0)], pad=0.93 * PAD, ballast=1.1 * BALLAST, pad_damping=1.15 * PAD_DAMPING,
        shear=SHEAR, hertz=1.04 * HERTZ,
    )  # fmt: skip
    passages = line.passages([Wheel(LOAD, 3, (0.035, 7.0)), Wheel(LOAD, 4)], speed, RATE)
    return passages.forces[:, passages.x > 2.0]


@pytest.mark.whole
@pytest.mark.slow
def test_wheels_of_another_program_are_sized_or_healthy():
    flat, level = (diagnose_axle_box(recorded((one - LOAD) / MASS, 20.0), site()) for one in by_finite_elements(20.0))
    assert flat.verdict == "wheel flat"
    assert flat.sizes["wheel flat"][0] == pytest.approx(0.035, abs=2.5e-3)
    assert level.verdict == "healthy"
    assert level.seen.lengths[1] < 0.02
    assert flat.joints == level.joints == ()


@pytest.mark.slow
def test_the_command_writes_what_it_finds(tmp_path, capsys):
    recording = worn()
    rows = "\n".join(f"{one / 9.80665:.6f}" for one in recording.samples)
    (tmp_path / "right.csv").write_text(f"# rate: 5 kHz\n# axle box acceleration [g]\n{rows}\n")
    site().to_toml(tmp_path / "line.toml")
    asked = ["diagnose", str(tmp_path / "right.csv"), "--site", str(tmp_path / "line.toml")]
    assert main([*asked, "--speed", "72 km/h", "-o", str(tmp_path / "out"), "--figures", "all"]) == 0
    assert "wheel: out of round: order 3:" in capsys.readouterr().out
    told = json.loads((tmp_path / "out" / "right.json").read_text())
    assert told["verdict"] == "out of round"
    assert [round(one["place"]) for one in told["joints"]] == [9, 21]
    assert (tmp_path / "out" / "right.png").stat().st_size > 20_000
    assert main(asked) == 2
    assert "speed: found none" in capsys.readouterr().err
    assert main([*asked, "--speed", "20", "--train"]) == 2


@pytest.mark.parametrize(
    ("recording", "place", "words"),
    [
        ({"quantity": "deck acceleration"}, {}, "quantity: found 'deck acceleration'"),
        ({"rate": 500.0}, {}, "rate: found 500 Hz"),
        ({"samples": np.zeros(900)}, {}, "samples: found 0.18 s; allowed: 6 turns"),
        ({"speed": None}, {}, "speed: found none"),
        ({"samples": np.full(9000, np.nan)}, {}, "samples: found none that is good"),
    ],
)
def test_what_cannot_be_read_is_refused(recording, place, words):
    given = {"samples": np.zeros(9000), "rate": RATE, "quantity": "vertical acceleration", "speed": 20.0, **recording}
    with pytest.raises(wt.InputError, match=words):
        diagnose_axle_box(Recording(**given), site(**place))


def test_a_site_without_a_static_force_is_refused():
    gauge = wt.sensors.RailShearForce(name="1", x1=0.1, x2=0.5)
    with pytest.raises(wt.InputError, match="static_force: found none"):
        diagnose_axle_box(worn(), site(static_force=None, sensors=[gauge]))
    with pytest.raises(wt.InputError, match="passage: found none"):
        site(static_force=None)


@pytest.mark.parametrize("apart", [12.5, 20.0])
def test_joints_at_equal_distances_are_noticed(apart):
    places = np.array([3.0, 1.0, 2.0, 4.0, 6.0, 7.0]).cumsum() * apart  # some are missed
    assert distance_of(places + 0.02 * np.cos(places)) == pytest.approx(apart, abs=0.05)
    assert distance_of(np.array([0.0, 7.3, 21.0, 60.1, 71.9])) is None
