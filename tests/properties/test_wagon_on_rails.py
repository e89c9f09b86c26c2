"""What must hold of a wagon on rails that give way: energy, mirrors, stiff rails, macro steps, files."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ground.outcome import Outcome
from wheeltapper.lower.wagon_on_rails import lower_wagon_on_rails
from wheeltapper.march import run
from wheeltapper.march.common import program
from wheeltapper.march.wagon import assembly

COACH = wt.Wagon.erri_b176(1500.0)
BALLASTED = wt.tracks.Ballasted(**wt.tracks.Ballasted.example | {"cutoff": 2000.0, "bays": 90})
SLAB = wt.tracks.Slab(**wt.tracks.Slab.example | {"cutoff": 2000.0, "bays": 120})
FULL = wt.creep.Polach(friction=0.2, wheel_spin="full")
NARROW = wt.profiles.WheelRail(gauge=1.4219)
STRENGTHS = ("pad_stiffness", "pad_damping", "ballast_stiffness", "ballast_damping", "sleeper_mass")
WAVE = wt.Corrugation(amplitude=2e-4, wavelength=0.1, start=0.05)


def coach(irregularity=WAVE, duration=0.03, **changes):
    fields = {
        "vehicle": COACH, "contact": wt.Hertz(constant_per_wheel=7.025e10), "creep": wt.creep.Polach(friction=0.35),
        "speed": 20.0, "rolling": "point", "track": BALLASTED,
    } | changes  # fmt: skip
    return wt.Scenario(irregularity=irregularity, duration=duration, **fields)


def finished(scenario, method="default"):
    record = wt.simulate(scenario, method)
    assert record.outcome is Outcome.COMPLETED
    return record


def stronger(factor):
    """Return the same track, all of it so many times as stiff, heavy and damped: its waves stay as they are."""
    rail = dict(BALLASTED.rail)
    for name in ("bending_stiffness", "shear_stiffness", "mass_per_length"):
        rail[name] = factor * float(rail[name])
    rail["rotary_inertia"] = factor * float(BALLASTED.rail.inertia)
    fields = {name: factor * float(getattr(BALLASTED, name)) for name in STRENGTHS}
    return wt.tracks.Ballasted(
        rail=wt.tracks.Rail(**rail), spacing=BALLASTED.spacing, cutoff=2000.0, bays=90, **fields
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"creep": None},
        {"creep": FULL, "contact": wt.Hertz(), "irregularity": {"right": WAVE}},
        {"creep": wt.creep.Fastsim(friction=0.3), "track": SLAB, "speed": 45.0},
        {"profiles": NARROW, "irregularity": {"left": WAVE}},  # treads and flanges press the same place of a rail
    ],
)  # fmt: skip
def test_energy_closes(changes):
    record = finished(coach(**changes), "strict")
    energy = record.energy
    assert len(record.events.time) > 0
    assert float(energy.relative_imbalance) < 1e-8
    assert float(energy.dissipated_creep) >= -1e-12
    assert float(finished(coach(**changes)).energy.relative_imbalance) < 1e-6


def test_flanges_touch_and_part_where_the_gauge_is_narrow():
    record = finished(coach({"left": WAVE}, duration=0.02, profiles=NARROW))
    assert {"tread", "flange"} == set(record.events.surface.values.tolist())
    assert float(record.history("2 kHz").flange_force.max()) > 1e4


def test_a_mirrored_scenario_gives_mirrored_results():
    one, other = (finished(coach({side: WAVE})) for side in ("left", "right"))
    swapped = {"left": "right", "right": "left"}
    assert len(one.events.time) >= 4
    assert list(one.events.side.values) == [swapped[side] for side in other.events.side.values]
    np.testing.assert_allclose(one.events.time, other.events.time, rtol=0, atol=1e-12)
    times = np.linspace(0.0, 0.03, 31)
    a, b = one.at(times), other.at(times)
    for name, tolerance in (("normal_force", 1e-7 * one.static_force), ("rail_displacement", 1e-12)):
        np.testing.assert_allclose(a[name].sel(side="left"), b[name].sel(side="right"), rtol=0, atol=tolerance)


def test_what_is_symmetric_stays_symmetric():
    record = finished(coach(duration=0.1))
    found = record.at(np.linspace(0.0, 0.1, 101))
    left, right = (found.normal_force.sel(side=side) for side in ("left", "right"))
    np.testing.assert_allclose(left, right, rtol=0, atol=1e-9 * record.static_force)
    times = {side: record.events.time[record.events.side == side] for side in ("left", "right")}
    assert len(times["left"]) >= 20
    np.testing.assert_allclose(times["left"], times["right"], rtol=0, atol=1e-13)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*implausible")
def test_ever_stiffer_rails_become_a_stiff_track():
    step = {"irregularity": wt.Step(height=1e-4, position=0.1), "rolling": "circle", "duration": 0.02}
    stiff = finished(coach(track=wt.StiffTrack(), **step), "strict")
    assert len(stiff.events.time) >= 4
    times = np.linspace(0.0, 0.02, 81)
    forces, away = stiff.at(times).normal_force, []
    for factor in (1e4, 1e6):
        record = finished(coach(track=stronger(factor), **step), "strict")
        assert list(record.events.wheelset.values) == list(stiff.events.wheelset.values)
        later = np.abs(record.events.time - stiff.events.time).max()
        away.append((float(later), float(np.abs(record.at(times).normal_force - forces).max()) / stiff.static_force))
    (late, strong), (later, stronger_still) = away
    assert late < 2e-5 and strong < 3e-2  # noqa: PT018
    assert later < 0.02 * late + 1e-11 and stronger_still < 0.02 * strong + 1e-7  # noqa: PT018


def marched(scenario, seconds, tolerance=1e-8):
    """Return the events of a march with macro steps of at most so many seconds, on the same modes."""
    below = lower_wagon_on_rails(scenario).program
    numbers = below.assembly.numbers.copy()
    numbers[assembly.STEP_TOLERANCE] = tolerance
    method = below.track.method._replace(step=seconds, single=False)
    finer = below._replace(
        assembly=below.assembly._replace(numbers=numbers), track=below.track._replace(method=method)
    )  # fmt: skip
    found = run.march(finer)
    return found.events[np.lexsort((found.events[:, program.EVENT_TIME], found.events[:, program.EVENT_CONTACT]))]


def test_macro_steps_of_half_the_length_change_nothing():
    one, other = (marched(coach(), seconds) for seconds in (2e-4, 1e-4))
    assert len(one) == len(other) >= 8
    which = [program.EVENT_KIND, program.EVENT_CONTACT]
    np.testing.assert_array_equal(one[:, which], other[:, which])
    times = program.EVENT_TIME
    np.testing.assert_allclose(one[:, times], other[:, times], rtol=0, atol=1e-10)


def test_a_record_in_a_file_is_the_same(tmp_path):
    record = finished(coach(duration=0.01))
    record.save(tmp_path / "a.nc")
    again = wt.load(tmp_path / "a.nc")
    assert str(again) == str(record)
    one, other = record.history("2 kHz"), again.history("2 kHz")
    for name in one.data_vars:
        np.testing.assert_array_equal(one[name], other[name])
    place = {"rate": 2e3, "rail": [0.1], "seat": [0, 1]}
    np.testing.assert_array_equal(record.track(**place).pad_force, again.track(**place).pad_force)
    assert float(again.energy.relative_imbalance) == float(record.energy.relative_imbalance)


def test_at_rest_nothing_moves():
    record = finished(coach(irregularity=None, speed=0.0, creep=None))
    found = record.at(np.linspace(0.0, 0.03, 7))
    np.testing.assert_allclose(found.normal_force, found.normal_force[[0] * 7], rtol=1e-6)
    assert float(found.rail_displacement.max()) < -2e-4
    below = record.track("1 kHz", seat=range(-40, 20)).pad_force  # over a ring, all of what stands on it
    weight = float(record.static_forces.sum())
    np.testing.assert_allclose(below.sum(["side", "seat"]), weight, rtol=2e-3)


def test_six_wheelsets_take_two_octets():
    axles = tuple(
        wt.vehicles.Axle(mass=1500.0, inertia=(600.0, 80.0, 600.0), position=-2.5 * i, load=5e4) for i in range(6)
    )
    record = finished(coach(vehicle=wt.Wagon(bodies=(), axles=axles), creep=None, duration=0.01))
    assert record.at([0.0, 0.01]).rail_displacement.sizes["wheelset"] == 6
    assert float(record.energy.relative_imbalance) < 1e-6
