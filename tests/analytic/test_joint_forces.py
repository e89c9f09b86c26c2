"""P1 and P2 against equations of motion that SciPy integrates, filters by Fourier's transform, beams by quadrature."""

from math import pi

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import wheeltapper as wt
from wheeltapper.lower.track.lumped import lumped, rail_on_pads, whole_track
from wheeltapper.lower.track.section import section_of
from wheeltapper.record.simulate import ModelWarning

MASS, LOAD, STIFFNESS, V, ANGLE, LENGTH, PLACE = 1200.0, 188_228.0, 2e9, 20.0, 0.01, 1.0, 2.0
ON_RIGID = wt.Scenario(
    vehicle=wt.Wheelset(mass=MASS, load=LOAD),
    contact=wt.Linear(stiffness=STIFFNESS),
    irregularity=wt.irregularities.DippedJoint(angle=ANGLE, length=LENGTH, position=PLACE),
    rolling="point",
    speed=V,
    duration=0.15,
)
FLAT = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
    contact=wt.Hertz(constant=1.405e11),
    irregularity=wt.WheelFlat(length="40 mm", position=1.0),
    speed=15.0,
    duration=0.2,
)
TRACK = wt.tracks.Ballasted.named("rolland_UIC60_example")
WHEELSET = wt.Wheelset(mass=MASS, load=LOAD)


def height(x):
    X = abs(x - PLACE)
    return -(ANGLE * LENGTH / 8.0) * (1.0 - 2.0 * X / LENGTH) ** 2 if X < LENGTH / 2.0 else 0.0


def test_p1_on_a_rigid_rail_is_that_of_the_equation_of_motion():
    weight = LOAD + MASS * 9.81
    rest = weight / STIFFNESS

    def motion(t, s):  # the wheel's height above that of first touch, and its velocity; contact may be lost
        return [s[1], (STIFFNESS * max(height(V * t) - s[0], 0.0) - weight) / MASS]

    met = PLACE / V
    tight = {"rtol": 1e-11, "atol": 1e-14, "max_step": 1e-4}
    before = solve_ivp(motion, (0.0, (PLACE - LENGTH / 2) / V), [-rest, 0.0], **tight).y[:, -1]
    there = solve_ivp(motion, ((PLACE - LENGTH / 2) / V, met), before, **tight).y[:, -1]
    after = solve_ivp(motion, (met, met + 0.01), there, dense_output=True, **tight)
    times = np.linspace(met, met + 0.01, 200_001)
    forces = STIFFNESS * np.maximum([height(V * t) for t in times] - after.sol(times)[0], 0.0)
    first = forces[np.flatnonzero((forces[1:-1] > forces[:-2]) & (forces[1:-1] >= forces[2:]))[0] + 1]
    found = wt.features.P1(PLACE)(wt.simulate(ON_RIGID, method="strict"))
    assert float(found) == pytest.approx(first, rel=1e-7)
    assert found.units == "N"
    # the wheel is turned within no time: more than the static force by 2α·V·√(K·m), less what the falling end takes
    assert float(found) == pytest.approx(weight + ANGLE * V * np.sqrt(STIFFNESS * MASS), rel=0.02)


SETTLING = {(90.0, 4): 1 / 90, (20.0, 4): 1 / 20, (300.0, 8): 2 / 300}
"""s: about a period of the cut-off for the order 4, two for the order 8."""


def filtered_by_fourier(force, rate, cutoff, order):
    """Return the force low-passed in the frequency domain; it holds on before and after for a long time."""
    beyond = len(force)
    long = np.concatenate([np.full(beyond, force[0]), force, np.full(beyond, force[-1])])
    mean = np.linspace(long[0], long[-1], len(long))  # what is left begins and ends at zero
    frequency = np.fft.rfftfreq(len(long), 1.0 / rate)
    ratio = np.tan(pi * np.minimum(frequency, 0.4999999 * rate) / rate) / np.tan(pi * cutoff / rate)
    gain = 1.0 / (1.0 + (2.0**0.5 - 1.0) * ratio**order)
    return (np.fft.irfft(np.fft.rfft(long - mean) * gain, len(long)) + mean)[beyond:-beyond]


@pytest.mark.parametrize(("cutoff", "order"), [(90.0, 4), (20.0, 4), (300.0, 8)])
def test_a_filtered_force_is_that_of_fouriers_filter(cutoff, order):
    record, rate = wt.simulate(FLAT), 30e3
    force = record.history(rate).normal_force.values
    read = round((0.2 - SETTLING[cutoff, order]) * rate)  # the rest depends on what follows the run
    expected = filtered_by_fourier(force, rate, cutoff, order)[:read].max()
    assert float(wt.features.P2(cutoff, order, rate)(record)) == pytest.approx(expected, rel=2e-5)
    over_static = wt.features.filtered_force(cutoff, order, rate, over_static=True)(record)
    assert float(over_static) * record.static_force == pytest.approx(expected, rel=2e-5)


@pytest.mark.parametrize("cutoff", [20.0, 90.0])
def test_the_usual_rate_is_enough_for_losses_and_impacts(cutoff):
    record = wt.simulate(FLAT)
    assert record.impacts.sizes["impact"] > 5
    usual, fine = (float(wt.features.filtered_force(cutoff, rate=rate)(record)) for rate in (None, 500e3))
    assert usual == pytest.approx(fine, rel=3e-4)


def test_a_run_that_is_too_short_for_the_filter_or_without_a_maximum_has_no_value():
    with pytest.warns(ModelWarning, match=r"DippedJoint from x = 1\.5 to 2\.5 m, is never met"):
        short = wt.simulate(ON_RIGID.replaced({"duration": 0.06}))
    assert np.isnan(float(wt.features.P1(PLACE)(short)))
    with pytest.warns(ModelWarning, match=r"below 10 Hz .* the last 0\.1 s of the run, .*: nothing is left"):
        assert np.isnan(float(wt.features.filtered_force(10.0)(short)))
    assert np.isfinite(float(wt.features.filtered_force(20.0)(short)))


def test_maps_have_p1_and_p2_at_every_speed():
    chart = wt.sweep(
        ON_RIGID, {"speed": [10.0, 20.0], "duration": [0.4, 0.3]},
        [wt.features.P1(PLACE), wt.features.P2(), {"type": "P2", "cutoff": "20 Hz", "name": "slow"}], zipped=True,
    )  # fmt: skip
    for cell, (speed, duration) in enumerate([(10.0, 0.4), (20.0, 0.3)]):
        record = wt.simulate(ON_RIGID.replaced({"speed": speed, "duration": duration}))
        assert float(chart.P1[cell]) == pytest.approx(float(wt.features.P1(PLACE)(record)), rel=1e-9)
        assert float(chart.P2[cell]) == float(wt.features.P2()(record))
        assert float(chart.slow[cell]) == float(wt.features.filtered_force(20.0)(record))


# -- Jenkins' formulas ------------------------------------------------------------------------------------------------


def test_the_lumped_beam_is_rayleighs():
    EI, k, m, c = 6.4e6, 1.1e8, 160.0, 3e4
    found = lumped(EI, k, m, c)
    beta = (k / (4.0 * EI)) ** 0.25

    def shape(x):
        return np.exp(-beta * x) * (np.cos(beta * x) + np.sin(beta * x))

    def bend(x):  # its second derivative
        return 2.0 * beta**2 * np.exp(-beta * x) * (np.sin(beta * x) - np.cos(beta * x))

    length = 2.0 * quad(lambda x: shape(x) ** 2, 0.0, 60.0 / beta, limit=400)[0]
    bent = 2.0 * quad(lambda x: bend(x) ** 2, 0.0, 60.0 / beta, limit=400)[0]
    np.testing.assert_allclose(found, (m * length, EI * bent + k * length, c * length), rtol=1e-10)


def test_the_lumped_track_answers_slow_forces_as_the_exact_one_on_seats_that_are_close():
    """Seats 5 cm apart, a twelfth of each; a rail that bends only, and damps nothing itself."""
    rail = wt.tracks.Rail(
        bending_stiffness=6.4e6, shear_stiffness=1e13, mass_per_length=60.0, rotary_inertia=1e-6, damping=0.0
    )
    track = wt.tracks.Ballasted(
        rail=rail, spacing=0.05, pad_stiffness=15e6, pad_damping=1500.0, sleeper_mass=12.5, ballast_stiffness=9e6,
        ballast_damping=4e3,
    )  # fmt: skip
    found = whole_track(section_of(track))
    assert found.stiffness == pytest.approx(1.0 / float(wt.tracks.static_deflection(track, 0.02)), rel=2e-4)
    # force over deflection is k_t + iω·c_t - ω²·m_t, to the second order of ω
    omega = 2.0 * pi * 3.0
    stiff = 1.0 / complex(wt.tracks.receptance(track, 3.0, 0.02))
    assert stiff.imag / omega == pytest.approx(found.damping, rel=1e-3)
    bare = track.model_copy(update={"pad_damping": 0.0, "ballast_damping": 0.0})
    slow = [1.0 / complex(wt.tracks.receptance(bare, f, 0.02)) for f in (0.0, 3.0)]
    assert (slow[0] - slow[1]).real / omega**2 == pytest.approx(found.mass, rel=2e-3)


def lumped_numbers(found):
    names = ("unsprung_mass", "contact_stiffness", "effective_mass_P1", "effective_mass", "effective_stiffness")
    return *(found.attrs[name] for name in names), found.attrs["effective_damping"]


def test_p1_is_the_blow_of_two_masses_on_the_contacts_spring():
    found = wt.tracks.jenkins(TRACK, WHEELSET, 0.02, 30.0, wt.Hertz(constant=1.8825e11))
    m_u, K_H, m_e, *_ = lumped_numbers(found)
    P0 = found.attrs["static_force"]
    assert (m_u, P0) == (600.0, pytest.approx(100e3))
    assert pytest.approx(1.5 * (0.94125e11) ** (2 / 3) * P0 ** (1 / 3)) == K_H
    assert m_e == pytest.approx(rail_on_pads(section_of(TRACK)).mass)
    blow = solve_ivp(
        lambda t, s: [s[2], s[3], -K_H * (s[0] - s[1]) / m_u, K_H * (s[0] - s[1]) / m_e], (0.0, 1.5e-3),
        [0.0, 0.0, 0.02 * 30.0, 0.0], rtol=1e-10, atol=1e-14, max_step=2e-6,
    )  # fmt: skip
    largest = P0 + K_H * (blow.y[0] - blow.y[1]).max()
    assert float(found.P1_jenkins[0]) == pytest.approx(2.0 * largest, rel=1e-5)


def test_p2_is_the_plastic_blow_of_two_masses_on_the_tracks_spring():
    undamped = TRACK.model_copy(update={"pad_damping": 0.0, "ballast_damping": 0.0})
    for track, tolerance in ((undamped, 1e-6), (TRACK, 0.01)):  # the formula takes the damping to first order
        found = wt.tracks.jenkins(track, WHEELSET, 0.02, [30.0], wt.Hertz(constant=1.8825e11))
        m_u, _, _, m_t, k_t, c_t = lumped_numbers(found)
        together = m_u + m_t
        blow = solve_ivp(
            lambda t, s, m=together, c=c_t, k=k_t: [s[1], -(c * s[1] + k * s[0]) / m], (0.0, 0.01),
            [0.0, 0.02 * 30.0 * m_u / together], rtol=1e-10, atol=1e-14, max_step=1e-5,
        )  # fmt: skip
        largest = found.attrs["static_force"] + k_t * blow.y[0].max()
        assert float(found.P2_jenkins[0]) == pytest.approx(2.0 * largest, rel=tolerance)


# -- over speed -------------------------------------------------------------------------------------------------------

SMALL = wt.tracks.Slab(rail="UIC60", spacing=0.6, pad_stiffness=60e6, pad_damping=30e3, bays=40, cutoff=2000.0)
PAIR = wt.vehicles.Wheelsets(wheelsets=(WHEELSET, WHEELSET), positions=(0.0, -2.4))
UNDER_ONE = wt.Scenario(
    vehicle=PAIR, track=SMALL, irregularity={"wheelset 2": ON_RIGID.irregularities[0]}, speed=V, duration=0.2
)


def test_a_joints_forces_over_speed_are_those_of_runs(tmp_path):
    scene = ON_RIGID.replaced({"track": SMALL, "contact": wt.Hertz(constant=1.8825e11), "rolling": "circle"})
    found = wt.tracks.joint_forces(scene, ["36 km/h", 30.0], cutoff="60 Hz")
    assert list(found.speed.values) == [10.0, 30.0]
    joint = scene.irregularities[0].moved(3 * 0.6)  # 0.1 s at 30 m/s before its dip, in whole bays
    run = wt.simulate(
        scene.replaced({"speed": 30.0, "irregularity": joint, "duration": (joint.position + 0.5) / 30.0 + 0.1})
    )
    fast = found.isel(speed=1)
    assert float(fast.P1) == float(wt.features.P1(joint.position)(run))
    assert float(fast.P2) == float(wt.features.P2("60 Hz")(run))
    assert float(fast.largest_force) == float(run.peaks.normal_force.max())
    np.testing.assert_array_equal(
        found.P1_jenkins, wt.tracks.jenkins(SMALL, scene.vehicle, ANGLE, [10, 30], scene.contact).P1_jenkins
    )
    assert (found.P1_jenkins > found.P1).all()  # one mass takes up less than the waves of a rail
    wt.plot(found, tmp_path / "joint.png")
    both = wt.tracks.joint_forces(scene.replaced({"vehicle": PAIR}), 10.0)
    assert both.P1.dims == both.losses.dims == ("speed", "wheelset")
    np.testing.assert_allclose(both.P1.sel(wheelset=2), both.P1.sel(wheelset=1), rtol=0.02)
    assert len(wt.plot(both).axes) == 2


def test_p2_does_not_depend_on_where_the_run_ends():
    scene = ON_RIGID.replaced({"track": SMALL, "contact": wt.Hertz(constant=1.8825e11), "rolling": "circle"})
    found = []
    for beyond in np.linspace(0.012, 0.06, 10):  # s behind the joint; the filter takes 0.011 s to settle
        record = wt.simulate(scene.replaced({"duration": PLACE / V + 0.005 + beyond}))
        found.append([float(feature(record)) for feature in (wt.features.P1(PLACE), wt.features.P2())])
    assert found[0][1] > 1.05 * record.static_force
    excess = np.array(found) - record.static_force
    np.testing.assert_allclose(excess, np.tile(excess[-1], (10, 1)), rtol=0.005)
    slow = wt.tracks.joint_forces(scene, V, cutoff="5 Hz")
    assert float(slow.P2[0]) < float(wt.features.P2()(record))  # the run has become long enough


@pytest.mark.parametrize(
    ("call", "field"),
    [
        (lambda: wt.tracks.jenkins(wt.StiffTrack(), WHEELSET, 0.02, 10.0), "track"),
        (lambda: wt.tracks.jenkins(TRACK, WHEELSET, -0.02, 10.0), "angle"),
        (lambda: wt.tracks.jenkins(TRACK, WHEELSET, "0.02 m", 10.0), "angle"),
        (lambda: wt.tracks.jenkins(TRACK, WHEELSET, 0.02, [10.0, 0.0]), "speed"),
        (lambda: wt.tracks.jenkins(TRACK, wt.Wagon.erri_b176(), 0.02, 10.0), "vehicle"),
        (lambda: wt.tracks.joint_forces(FLAT, 10.0), "irregularity"),
        (lambda: wt.tracks.joint_forces(ON_RIGID, 10.0), "track"),
        (lambda: wt.tracks.joint_forces(UNDER_ONE, 10.0), "irregularity"),
        (lambda: wt.features.P1("3 s"), "position"),
        (lambda: wt.features.P2(rate=100.0), "rate"),
        (lambda: wt.features.filtered_force(order=3), "order"),
        (lambda: wt.features.filtered_force(over_static=1), "over_static"),
    ],
)
def test_what_is_no_joint_is_refused_in_one_line(call, field):
    with pytest.raises(wt.InputError, match=f"^{field}: ") as caught:
        call()
    assert "\n" not in str(caught.value)
