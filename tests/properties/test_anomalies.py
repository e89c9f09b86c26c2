"""Tracks with anomalies: their limits, rest, energy, files, and the infinite track by finite elements."""

import numpy as np
import pytest
from scipy.sparse.linalg import spsolve

import wheeltapper as wt
from tests.finite_rail import FiniteRail

TRACK = wt.tracks.Ballasted.named("rolland_UIC60_example")
SMALL = {"bays": 40, "cutoff": 2000.0}
"""A ring of few modes: what it says of a run is rough, what it says of limits and energy is not."""
HANGING, WITHOUT_PAD = wt.tracks.HangingSleeper(seat=2), wt.tracks.MissingPad(seat=2)
ANOMALIES = {
    "hanging": (HANGING,),
    "void": (wt.tracks.HangingSleeper(seat=2, void="0.2 mm"),),
    "two voids": (wt.tracks.HangingSleeper(seat=2, void="0.2 mm"), wt.tracks.HangingSleeper(seat=3, void="0.1 mm")),
    "missing pad": (WITHOUT_PAD,),
    "scatter": (wt.tracks.Scatter(pads=0.1, ballast=0.2, seed=3),),
    "all": (wt.tracks.Scatter(pads=0.1, seed=3), WITHOUT_PAD, wt.tracks.HangingSleeper(seat=3, void="0.1 mm")),
}


def with_anomalies(*anomalies, **more):
    fields = {name: getattr(TRACK, name) for name in type(TRACK).model_fields} | {"anomalies": anomalies}
    return wt.tracks.Ballasted(**fields | SMALL | more)


def simulated(track, method="default", speed=30.0, duration=0.08, **more):
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=600.0, load=1e5 - 9.81 * 600.0, wheels=1), track=track,
        contact=wt.Hertz(constant=9.4125e10), speed=speed, duration=duration, **more,
    )  # fmt: skip
    return wt.simulate(scene, method)


def force_of(record):
    return record.at(np.linspace(0.0, record.end, 400)).normal_force.values


def test_a_void_that_never_closes_is_a_removed_spring():
    wide = simulated(with_anomalies(wt.tracks.HangingSleeper(seat=2, void="1 cm")))
    assert ", 0 closings of voids, " in str(wide)
    gone = simulated(with_anomalies(HANGING))
    assert wide.events.sizes["event"] == 0
    np.testing.assert_allclose(force_of(wide), force_of(gone), rtol=1e-12)


def test_no_void_is_a_sound_sleeper_while_it_is_not_lifted():
    """Seat 0 is pressed down by the wheel from the start; its force and motion are those of the sound track."""
    sound = simulated(with_anomalies(), duration=0.02)
    none = simulated(with_anomalies(wt.tracks.HangingSleeper(seat=0, void=0.0)), duration=0.02)
    assert none.events.sizes["event"] == 0
    np.testing.assert_allclose(force_of(none), force_of(sound), rtol=2e-4)
    own, other = (record.track("5 kHz", seat=[0]).isel(seat=0) for record in (none, sound))
    np.testing.assert_allclose(own.sleeper_displacement, other.sleeper_displacement, rtol=5e-4)
    np.testing.assert_allclose(own.ballast_force, other.ballast_force, rtol=2e-3)


def test_between_both_limits_the_sleeper_at_rest_lies_on_the_line():
    """At rest under a wheel over the void: what the ballast carries is linear in the void until nothing is left.

    Modes up to 2 kHz miss 2e-4 of what the wheel does to the sleeper, at 5 kHz 2e-5.
    """
    voids = np.array([0.0, 2e-4, 4e-4])
    over = {"first_sleeper": 0.0, "speed": 0.0, "duration": 1e-3}
    carried, sunk = [], []
    for void in voids:
        track = with_anomalies(wt.tracks.HangingSleeper(seat=0, void=void))
        at = simulated(track, speed=0.0, duration=over["duration"]).track("5 kHz", seat=[0]).isel(time=0, seat=0)
        carried.append(float(at.ballast_force))
        sunk.append(-float(at.sleeper_displacement))
    np.testing.assert_allclose(carried, TRACK.ballast_stiffness * (sunk - voids), rtol=3e-4)
    assert carried[0] - carried[1] == pytest.approx(carried[1] - carried[2], rel=1e-6)
    gone = simulated(with_anomalies(wt.tracks.HangingSleeper(seat=0)), speed=0.0, duration=over["duration"])
    limit = 1e5 * float(wt.tracks.static_deflection(with_anomalies(wt.tracks.HangingSleeper(seat=0)), 0.0))
    rail = gone.track("5 kHz", rail=[0.0]).rail_displacement.isel(time=0, rail=0)
    assert -float(rail) == pytest.approx(limit, rel=1e-6)


def test_at_rest_a_missing_pad_is_a_missing_sleeper():
    pad, sleeper = (wt.tracks.static_deflection(with_anomalies(one), [0.3, 1.2, 1.5]) for one in (WITHOUT_PAD, HANGING))
    np.testing.assert_allclose(pad, sleeper, rtol=1e-12)
    assert float(pad[1]) > 1.5 * float(wt.tracks.static_deflection(with_anomalies(), 1.2))


@pytest.mark.parametrize("name", ["hanging", "missing pad"])
def test_receptance_is_that_of_finite_elements(name):
    pads, ballasts = ({2: 0.0}, {}) if name == "missing pad" else ({}, {2: 0.0})
    rail = FiniteRail(TRACK, 60, 48, pads, ballasts)
    frequencies, places = np.array([60.0, 150.0, 400.0]), np.array([1.2, 1.5])
    own = wt.tracks.receptance(with_anomalies(*ANOMALIES[name]), frequencies, places).values
    for frequency, row in zip(frequencies, own, strict=True):
        omega = 2.0 * np.pi * frequency
        system = (rail.stiffness + 1j * omega * rail.damping - omega**2 * rail.mass).tocsc()
        for x, found in zip(places, row, strict=True):
            nodes, shares, _ = rail.load_at(x)
            force = np.zeros(rail.size, dtype=complex)
            force[nodes] = shares
            assert found == pytest.approx(shares @ spsolve(system, force)[nodes], rel=4e-3)


@pytest.mark.parametrize("name", ["void", "scatter", "missing pad"])
def test_at_rest_nothing_moves(name):
    record = simulated(with_anomalies(*ANOMALIES[name]), speed=0.0, duration=0.005)
    np.testing.assert_allclose(force_of(record), 1e5, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.few(3)
@pytest.mark.parametrize("name", ANOMALIES)
def test_energy_closes(name):
    first = 0.1234 if len(ANOMALIES[name]) > 1 else 0.0  # of the seats: between two macro steps of an even bay
    record = simulated(with_anomalies(*ANOMALIES[name], first_sleeper=first), "strict", duration=0.06)
    assert record.outcome.name == "COMPLETED"
    assert abs(float(record.energy.relative_imbalance)) < 1e-8
    assert "into_anomalies" in record.energy


def test_what_went_into_a_void_is_what_its_spring_holds_and_its_damper_has_taken():
    """The integral of the ballast's force over the sleeper's way; the last sample is in the closed void."""
    record = simulated(with_anomalies(*ANOMALIES["void"]), "strict", duration=0.045)
    closes = float(record.events.time[0])
    assert record.events.kind.values.tolist() == ["void closes"]
    assert ", 1 closing of voids, " in str(record)
    times = np.linspace(closes, record.end, 20_001)
    found = record._march.found
    from wheeltapper.march.general.replay import replay

    delta = replay(found, times).indentation[:, 1]
    force = replay(found, times).force[:, 1]
    rate = np.gradient(delta, times, edge_order=2)
    k, c = TRACK.ballast_stiffness, TRACK.ballast_damping
    np.testing.assert_allclose(force[1:-1], (k * delta + c * rate)[1:-1], rtol=1e-4, atol=2.0)
    work = np.trapezoid(force * rate, times)
    assert work == pytest.approx(0.5 * k * delta[-1] ** 2 + np.trapezoid(c * rate**2, times), rel=1e-5)


@pytest.mark.parametrize("cutoff", [500.0, 1000.0])
@pytest.mark.slow
def test_damped_voids_close_alike_by_both_methods_and_at_any_cutoff(cutoff):
    """Sleepers are heavy: they know hardly anything of the modes that a low cutoff leaves out."""
    hanging = wt.tracks.HangingSleeper(seat=1, void="0.2 mm"), wt.tracks.HangingSleeper(seat=-2, void="0.1 mm")
    example = wt.tracks.Ballasted.example | {"bays": 90, "first_sleeper": 0.15, "anomalies": hanging}

    def voids_of(method, **fields):
        scene = wt.Scenario(
            vehicle=wt.vehicles.Bogie(**wt.vehicles.Bogie.example), contact=wt.Hertz(constant_per_wheel=8e10),
            speed=20.0, duration=0.03, irregularity=wt.Corrugation(amplitude=1e-4, wavelength=0.1, start=0.05),
            rolling="point", track=wt.tracks.Ballasted(**example | fields),
        )  # fmt: skip
        record = wt.simulate(scene, method)
        assert record.outcome.name == "COMPLETED"
        return record.events.where(record.events.seat != -1, drop=True)

    default, strict, whole = voids_of("default", cutoff=cutoff), voids_of("strict", cutoff=cutoff), voids_of("default")
    assert whole.sizes["event"] > 10
    for other in (default, strict):
        assert other.kind.values.tolist() == whole.kind.values.tolist()
        assert other.seat.values.tolist() == whole.seat.values.tolist()
    np.testing.assert_allclose(default.time, strict.time, rtol=0, atol=1e-9)
    np.testing.assert_allclose(default.time, whole.time, rtol=0, atol=3e-4)


def test_events_of_voids_are_not_those_of_wheels():
    pair = wt.vehicles.Wheelsets(
        wheelsets=[{"mass": 600.0, "load": 94e3, "wheels": 1}] * 2, positions=(0.0, -2.4)
    )  # fmt: skip
    scene = wt.Scenario(
        vehicle=pair, track=with_anomalies(*ANOMALIES["void"]), contact=wt.Hertz(constant=9.4125e10), speed=30.0,
        duration=0.14,
    )  # fmt: skip
    record = wt.simulate(scene)
    events = record.events
    assert events.kind.values.tolist() == ["void closes"]  # one of the wheels is always near
    assert set(events.wheelset.values) == {0}
    assert set(events.seat.values) == {2}
    np.testing.assert_allclose(events.position, 1.2)
    assert record.impacts.sizes["impact"] == 0
    assert record.time_in_air == 0.0
    assert record.peaks.wheelset.isin([1, 2]).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["void", "scatter"])
def test_a_file_gives_the_record_back(name, tmp_path):
    record = simulated(with_anomalies(*ANOMALIES[name]))
    record.save(tmp_path / "a.nc")
    loaded = wt.load(tmp_path / "a.nc")
    np.testing.assert_array_equal(loaded.events.time, record.events.time)
    for one in ("sleeper_displacement", "ballast_force"):
        own, other = (each.track("2 kHz", rail=[1.2], seat=[2])[one] for each in (record, loaded))
        np.testing.assert_array_equal(own, other)


def test_deviates_depend_on_seed_and_seat_alone():
    one, other = (wt.tracks.Scatter(pads=0.1, ballast=0.2, seed=seed) for seed in (1, 2))
    assert one.changes(range(-3, 5))[3:] == one.changes(range(5))
    assert one.changes(range(5)) != other.changes(range(5))
    many = np.array([[change.pad, change.ballast] for change in one.changes(range(-2000, 2000))])
    np.testing.assert_allclose(many.mean(axis=0), 1.0, atol=0.01)
    np.testing.assert_allclose(many.std(axis=0), [0.1, 0.2], rtol=0.05)


def test_a_run_that_meets_an_anomaly_again_is_told():
    with pytest.warns(UserWarning, match="wheels meet some of them again"):
        record = simulated(with_anomalies(HANGING), speed=60.0, duration=0.5)
    assert any("come again every 24 m" in note for note in record.notes)
