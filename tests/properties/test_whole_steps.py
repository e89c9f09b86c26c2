"""Macro steps below a wagon that are solved at once, against the march that resolves them, on the same modes."""

import numpy as np
import pytest
from scipy.signal import find_peaks

import wheeltapper as wt
from tests.earlier import earlier
from wheeltapper.ground.outcome import Outcome
from wheeltapper.lower import wagon_on_rails
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.record.files.earlier import _assembly_of, _parts_of, _rails_below

from ..marks import slow

COACH = wt.Wagon.erri_b176(1620.0)
TRACK = wt.tracks.Ballasted.example | {"cutoff": 3000.0, "bays": 90, "first_sleeper": 0.21}
EVEN = wt.tracks.Ballasted(**TRACK)
ROLLING = wt.tracks.Ballasted(
    **TRACK, sleeper_roll_inertia=120.0, ballast_roll_stiffness=7e7, ballast_roll_damping=2e4
)  # fmt: skip
SLAB = wt.tracks.Slab(**wt.tracks.Slab.example | {"cutoff": 2500.0, "bays": 120})
RIPPLES = wt.Corrugation(amplitude=6e-5, wavelength=0.083, start=0.3)
CASES = {
    "a flat": {"irregularity": wt.WheelFlat(length="47 mm", position=0.6, repeat=False), "duration": 0.06},
    "waves on the left": {"irregularity": {"left": RIPPLES}, "speed": 31.0, "track": ROLLING},
    "a joint": {
        "irregularity": wt.irregularities.DippedJoint(angle=0.009, length=0.7, position=0.9),
        "speed": 44.0,
        "rolling": "point",
    },
    "flanges": {"irregularity": {"right": RIPPLES}, "profiles": wt.profiles.WheelRail(gauge=1.4221)},
    "slowly": {"irregularity": {"right": wt.Step(height=-2e-4, position=0.05)}, "speed": 1.7, "duration": 0.06},
    "without dampers": {"vehicle": COACH.without_dampers(), "creep": wt.creep.Fastsim(friction=0.31), "track": SLAB},
    "no creep": {"creep": None, "irregularity": None, "speed": 63.0},
}
PEAK_WITHIN = 2.5e-5
"""Seconds between the readings of a force in which maxima are looked for."""


def coach(**changes):
    fields = {
        "vehicle": COACH, "contact": wt.Hertz(constant_per_wheel=8.1e10, curvature=False), "speed": 17.0,
        "creep": wt.creep.Polach(friction=0.28), "track": EVEN, "duration": 0.04, "irregularity": RIPPLES,
    }  # fmt: skip
    return wt.Scenario(**fields | changes)


def resolved(scenario, monkeypatch):
    """Return a record whose macro steps are all marched, finely."""
    with monkeypatch.context() as patch:
        patch.setattr(wagon_on_rails, "AT_ONCE", ())
        patch.setitem(wagon_on_rails.TOLERANCES, "default", 1e-9)
        record = wt.simulate(scenario)
    assert record.outcome is Outcome.COMPLETED
    return record


def at_once(record):
    """Return which steps of a record were solved at once."""
    lanes = asm.LANES * len(record._lowered.assembly.kinds)
    return record._march.steps[:, asm.STEP_CLOSED] >= 2.0**lanes


@pytest.mark.slow
@pytest.mark.parametrize("name", slow(CASES, "slowly", "flanges"))
def test_steps_at_once_are_those_that_are_marched(name, monkeypatch):
    scenario = coach(**CASES[name])
    one, other = wt.simulate(scenario), resolved(scenario, monkeypatch)
    assert not at_once(other).any()
    assert at_once(one).sum() > 0.6 * len(one._march.rails.free)
    assert list(one.events.event.values) == list(other.events.event.values)
    np.testing.assert_allclose(one.events.time, other.events.time, rtol=0, atol=2e-10)
    times = np.linspace(0.0, float(scenario.duration), 1237)
    here, there = one.at(times), other.at(times)
    apart = np.abs(here.normal_force - there.normal_force) / other.static_force
    assert float(apart.max()) < 1e-5  # where a force begins; it moves with its event
    assert float(np.median(apart)) < 1e-8
    for quantity in ("rail_displacement", "displacement"):
        if quantity in here:
            np.testing.assert_allclose(here[quantity], there[quantity], rtol=0, atol=1e-9)
    assert float(one.energy.relative_imbalance) < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("method", ["default", "strict"])
def test_no_maximum_of_a_force_is_lost_where_two_macro_steps_meet(method):
    scenario = coach(irregularity={"left": RIPPLES}, speed=26.8, duration=0.12)
    record = wt.simulate(scenario, method)
    times = np.arange(0.0, 0.12, PEAK_WITHIN)
    forces = record.at(times).normal_force
    for side in ("left", "right"):
        for wheelset in range(4):
            read = forces.sel(side=side).isel(wheelset=wheelset).values
            found, _ = find_peaks(read, prominence=1e-3 * record.static_force)
            mine = (record.peaks.side == side) & (record.peaks.wheelset == forces.wheelset[wheelset])
            logged = record.peaks.time.values[mine.values]
            assert len(found) > 5
            away = np.abs(times[found][:, None] - logged).min(axis=1)
            assert away.max() < 2.0 * PEAK_WITHIN
            assert np.diff(np.sort(logged)).min() > 1e-7  # none twice


def test_energy_closes_where_a_path_breaks_on_the_end_of_a_macro_step():
    slab = wt.tracks.Slab(**wt.tracks.Slab.example | {"cutoff": 1000.0, "bays": 160})
    bump = wt.CosineBump(height=2e-4, length=0.05, start=0.005)
    fields = {
        "contact": wt.Hertz(), "irregularity": {"both": bump}, "rolling": "point", "track": slab, "speed": 9.0,
        "creep": wt.creep.Polach(friction=0.35), "duration": 0.007,
    }  # fmt: skip
    record = wt.simulate(coach(**fields))
    ends = record._march.rails.ends
    assert np.abs(ends - 0.005 / 9.0).min() < 1e-12  # there the curvature of the path jumps, and the contact's constant
    assert at_once(record).sum() > 20
    assert float(record.energy.relative_imbalance) < 1e-7


def test_a_force_at_its_maximum_is_that_of_the_record():
    record = wt.simulate(coach(duration=0.03))
    order = np.argsort(record.peaks.time.values)
    read = record.at(record.peaks.time.values[order]).normal_force
    for row, number in enumerate(order):
        peak = record.peaks.isel(peak=number)
        value = float(read.isel(time=row).sel(side=peak.side, wheelset=peak.wheelset))
        assert value == pytest.approx(float(peak.normal_force), abs=1e-6 * record.static_force)


def test_a_file_tells_which_steps_were_solved_at_once(tmp_path):
    record = wt.simulate(coach(duration=0.02))
    record.save(tmp_path / "a.nc")
    again = wt.load(tmp_path / "a.nc")
    np.testing.assert_array_equal(at_once(record), at_once(again))
    times = np.linspace(0.0, 0.02, 301)
    np.testing.assert_array_equal(record.at(times).normal_force, again.at(times).normal_force)


def test_files_of_before_have_all_macro_steps_marched(tmp_path):
    _, data = earlier("wagon_on_slab", 2, tmp_path)
    A, parts = _assembly_of(_parts_of(data, "assembly")), _parts_of(data, "task")
    marched = A.rails.copy()
    marched[asm.RAIL_AT_ONCE] = 0.0
    before = A._replace(rails=np.delete(A.rails, [asm.RAIL_FORCE, asm.RAIL_AT_ONCE]))
    np.testing.assert_array_equal(_rails_below(parts, before, 9.0).assembly.rails, marched)
    np.testing.assert_array_equal(_rails_below(parts, A, 9.0).assembly.rails, A.rails)
    with pytest.raises(wt.InputError, match="another track"):
        _rails_below(parts, A._replace(rails=A.rails[:5]), 9.0)
