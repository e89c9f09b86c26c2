"""Marks, and rails under many wheels: convergence, bounds, independence of the way there, files, wrong input."""

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.interpolate import CubicSpline

import wheeltapper as wt
from wheeltapper.ask.passes import Scatter, after_pass
from wheeltapper.ground.errors import InputError
from wheeltapper.lower.door import line_of
from wheeltapper.lower.laws.plastic import dissipated_by, left_after, loading_force
from wheeltapper.march.common import program as contract
from wheeltapper.march.steps.written import scratch_for
from wheeltapper.march.wheel import single
from wheeltapper.march.wheel.dense import OUT_COLUMNS, OUT_DELTA, OUT_FORCE, OUT_RESIDUAL, dense

N0 = 106_022.0


def scene(speed=36.0, length=2.0, law="Thornton", amplitude=-5e-5, **contact):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=N0 - 1500 * 9.81, stiffness=2.44e6, damping=8e3, radius=0.46),
        contact=getattr(wt.contact, law)(**({"constant": 1.405e11, "rail_share": 1.0} | contact)),
        irregularity=wt.Corrugation(amplitude=amplitude, wavelength=0.05, start=0.01),
        rolling="point",
        speed=speed,
        duration=length / speed,
    )


def fundamental(wear):
    return wear.amplitude.sel(wavelength=0.05, method="nearest").values


# -- many passes -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_above_resonance_the_crests_are_smoothed():
    wear = wt.wear_in(scene(), 100, hardening=0.0)
    amplitude = fundamental(wear)
    assert amplitude[0] == pytest.approx(5e-5, rel=1e-3)
    assert 47e-6 < amplitude[-1] < 49e-6
    assert np.all(np.diff(amplitude) < 0.0)
    force = wear.largest_force / wear.static_force
    assert 2.0 < float(force.min()) <= float(force.max()) < 2.6
    at_crests = np.interp(wear.height[0], [-5e-5, 5e-5], [0.0, 1.0]) > 0.5
    assert float(wear.permanent_indentation[-1].values[~at_crests].max()) < 1e-9
    assert np.all(np.diff(wear.plastic_work.values) < 0.0)


@pytest.mark.slow
def test_near_resonance_hardening_keeps_the_rail_bounded_and_without_it_runs_away():
    hardened = wt.wear_in(scene(speed=9.0), 60)
    force = hardened.largest_force.values / hardened.static_force
    assert force.max() < 4.3
    assert hardened.ended == "all passes made"
    assert float(hardened.permanent_indentation[-1].max()) < 18e-6
    late = hardened.permanent_indentation.sel(kept=[50, 60]).values
    np.testing.assert_allclose(late[1], late[0], atol=2e-8)
    free = wt.wear_in(scene(speed=9.0), 40, hardening=0.0)
    height = free.height.values
    assert np.ptp(height[1]) > 1.9 * np.ptp(height[0])  # after ten passes
    assert "run away" in free.ended
    assert free.sizes["pass"] < 40


@pytest.mark.slow
def test_the_pattern_converges_with_the_sampling_of_second_order():
    x = np.linspace(0.1, 1.9, 2001)
    for hardening in (0.0, 1.0):

        def mark(samples, hardening=hardening):
            wear = wt.wear_in(scene(), 6, hardening=hardening, samples=samples)
            return CubicSpline(wear.position.values, wear.permanent_indentation[-1].values)(x)

        best = mark(64)
        errors = np.array([np.abs(mark(samples) - best).max() for samples in (4, 8, 16)])
        assert errors[0] < 3e-3 * best.max()
        assert np.all(errors[:-1] / errors[1:] > 2.5)
        assert errors[0] / errors[-1] > 12.0


def test_the_pattern_converges_with_the_tolerance(monkeypatch):
    from wheeltapper.lower import numbers

    strict = wt.wear_in(scene(), 6, hardening=0.0, method="strict").permanent_indentation
    errors = []
    for tolerance in (1e-4, 1e-5, 1e-6, 1e-7):
        monkeypatch.setitem(numbers.METHODS, "default", numbers.Method(12, tolerance, 1e-11))
        wear = wt.wear_in(scene(), 6, hardening=0.0)
        errors.append(float(np.abs(wear.permanent_indentation - strict).max()))
    assert errors[0] < 3e-6 * float(strict.max())
    assert errors[0] > 10 * errors[1] > 10 * errors[-1]
    assert errors[-1] < 1e-8 * float(strict.max())


@pytest.mark.slow
def test_chunks_files_and_threads_leave_no_trace(tmp_path):
    options = {"hardening": 0.5, "scatter": {"speed": 0.02, "load": 0.05, "start": "5 cm"}, "seed": 7}
    scenes = [scene(length=0.4), scene(speed=20.0, length=0.4)]
    whole = [wt.wear_in(one, 12, **options) for one in scenes]
    for one, other in zip(whole, wt.wear_in(scenes, 12, threads=2, **options), strict=True):
        xr.testing.assert_identical(one, other)
    file = tmp_path / "wear.nc"
    for passes in (3, 4, 11, 12):
        found = wt.wear_in(scenes[0], passes, store=file, **options)
        assert found.sizes["pass"] == passes
    np.testing.assert_array_equal(found.largest_force, whole[0].largest_force)
    np.testing.assert_array_equal(found.height[-1], whole[0].height[-1])
    loaded = wt.load(file)
    np.testing.assert_array_equal(loaded.height.values, found.height.values)
    assert float(found.speed.std() / found.speed.mean()) == pytest.approx(0.02, rel=0.5)
    assert float(found.applied_load.std() / found.applied_load.mean()) == pytest.approx(0.05, rel=0.5)
    assert 0.0 <= float(found.start.min()) < float(found.start.max()) <= 0.05


def test_an_interrupted_evolution_goes_on_with_the_same_bits(tmp_path):
    def interrupt(what, done, of):
        if (what, done) == ("passes", 5):
            raise KeyboardInterrupt

    file = tmp_path / "wear.nc"
    with pytest.raises(KeyboardInterrupt):
        wt.wear_in(scene(length=0.4), 9, store=file, progress=interrupt)
    assert wt.load(file).sizes["pass"] == 5
    gone_on, at_once = wt.wear_in(scene(length=0.4), 9, store=file), wt.wear_in(scene(length=0.4), 9)
    np.testing.assert_array_equal(gone_on.height[-1], at_once.height[-1])
    np.testing.assert_array_equal(gone_on.plastic_work, at_once.plastic_work)


def test_the_parts_of_the_rail_and_the_notes_say_what_happened():
    wear = wt.wear_in(scene(speed=9.0), 2)
    parts = wear.elastic + wear.shakedown + wear.ratcheting
    np.testing.assert_allclose(parts, 1.0, rtol=1e-12)
    assert float(wear.shakedown[0]) > 0.0
    impacts = wt.simulate(scene(speed=9.0)).impacts
    assert float(wear.impacts_per_metre[0]) == len(impacts.time) / 2.0
    assert f"{1e3 * wear.patch_length:.2f} mm" in json.loads(wear.notes)[-1]
    pressure = wt.wear_in(scene(speed=9.0, yield_force=3e4), 1)
    assert float(pressure.ratcheting[0]) > 0.1


# -- a surface that has yielded --------------------------------------------------------------------------------------


def over(line, surface):
    program, law, time = line._program_over(surface, 9.0, float(line.scenario.vehicle.load), 0.0)
    march = single.march(program)
    return program._replace(pieces=march.pieces), march, law.length, time


def looked_at(program, march, times):
    out = np.empty((len(times), OUT_COLUMNS))
    S = scratch_for(program)
    dense(program.pieces, program.numbers, program.law_or_none, march.steps, np.asarray(times), out, S)
    return out


@pytest.mark.parametrize("law", ["Thornton", "Stronge", "JacksonGreen", "KogutEtsion"])
def test_a_hardened_rail_yields_where_it_has_borne_and_the_force_is_continuous_there(law):
    line = line_of(scene(speed=9.0, law=law), 0.0, 4, "strict")
    surface, first = after_pass(line, Scatter(), line.virgin, 0)
    program, march, length, _ = over(line, surface)
    yields = march.events[march.events[:, contract.EVENT_KIND] == contract.YIELD, contract.EVENT_TIME]
    assert len(yields) > 5
    before, after = looked_at(program, march, yields - 1e-9), looked_at(program, march, yields + 1e-9)
    x = program.numbers[contract.PACE] * yields
    bore = surface.spline_at(surface.mean_spline(surface.borne, surface.onset), x) / length
    depth = before[:, OUT_DELTA] + before[:, OUT_RESIDUAL]
    np.testing.assert_allclose(depth, bore, rtol=1e-6)
    hardened = bore > 1.001 * line.law.onset / length
    assert hardened.sum() > 3
    near = 1e-3 if law == "KogutEtsion" else 2e-4  # its force bends sharply just above yield
    np.testing.assert_allclose(after[hardened, OUT_FORCE], before[hardened, OUT_FORCE], rtol=near)
    np.testing.assert_allclose(before[hardened, OUT_FORCE], loading_force(program.law, bore[hardened]), rtol=near)
    _, second = after_pass(line, Scatter(), surface, 1)
    assert abs(second.plastic_work) < 0.5 * abs(first.plastic_work)
    assert first.plastic_work > 0.0 or law == "Stronge"


def test_the_marks_of_a_pass_follow_from_its_indentation():
    record = wt.simulate(scene(speed=9.0, length=0.6))
    marks = wt.wear.marks(record)
    x = marks.table.position.values
    history = record.at(x / 9.0)
    program, unit = record._lowered.program, record._lowered.length
    expected = left_after(program.law, history.indentation.values / unit) * unit
    found = marks.table.permanent_indentation.values
    assert found.max() == pytest.approx(expected.max(), rel=0.15)  # averaged over the patch
    assert found.sum() == pytest.approx(expected.sum(), rel=0.02)
    np.testing.assert_allclose(history.permanent_indentation, expected, atol=1e-12)
    work = dissipated_by(program.law, np.array([1.0, 2.0, 4.0]) * program.law[0, contract.LAW_START])
    assert work[0] == pytest.approx(0.0, abs=1e-12)
    assert np.all(np.diff(work) > 0.0)


@pytest.mark.parametrize("rolling", ["point", "circle"])
def test_marks_are_shared_saved_and_rolled_over_again(tmp_path, rolling):
    one = scene(speed=9.0, length=0.6, rail_share=0.25).replaced({"rolling": rolling})
    marks = wt.wear.marks(wt.simulate(one))
    both = marks.table.permanent_indentation.values
    np.testing.assert_allclose(marks.table.rail, -0.25 * both, rtol=1e-12)
    assert -min(marks.wheel.deviations) == pytest.approx(0.75 * both.max(), rel=0.02)
    again = one.replaced({"irregularity": [*one.irregularity, marks.rail, marks.wheel]})
    again.to_toml(tmp_path / "again.toml")
    read = wt.load(tmp_path / "again.toml")
    assert read == again
    record, before = wt.simulate(read), wt.simulate(one)
    assert abs(float(record.energy.relative_imbalance)) < 1e-9
    assert float(record.peaks.normal_force.max()) != pytest.approx(float(before.peaks.normal_force.max()), rel=1e-4)
    places = np.linspace(0.0, 0.55, 300)
    lowered = record.at(places / 9.0).constraint - before.at(places / 9.0).constraint
    assert float(lowered.min()) == pytest.approx(-both.max(), rel=0.1)


def test_marks_of_a_wheel_meet_again_after_one_turn():
    one = scene(speed=9.0, length=0.6, rail_share=0.0)
    marks = wt.wear.marks(wt.simulate(one))
    turn = 2 * np.pi * 0.46
    again = one.replaced({"irregularity": marks.wheel, "duration": (turn + 0.6) / 9.0})
    record = wt.simulate(again)
    x = np.linspace(0.05, 0.55, 400)
    first, second = (record.at((x + k * turn) / 9.0).constraint.values for k in (0, 1))
    np.testing.assert_allclose(second, first, atol=1e-12)
    np.testing.assert_allclose(first, -np.interp(x, marks.table.position, marks.table.permanent_indentation), atol=1e-7)


def test_records_with_yield_are_saved_and_read(tmp_path):
    record = wt.simulate(scene(speed=9.0, length=0.6))
    record.save(tmp_path / "record.nc")
    read = wt.load(tmp_path / "record.nc")
    xr.testing.assert_identical(read.events, record.events)
    assert "yield" in read.events.kind.values
    xr.testing.assert_identical(read.history(1e4), record.history(1e4))


@pytest.mark.slow
def test_pictures(tmp_path):
    one = scene(speed=9.0, length=0.6)
    wt.plot(wt.wear.marks(wt.simulate(one)), tmp_path / "marks.png")
    wt.plot(wt.wear_in(one, 3), tmp_path / "wear.png")
    wt.plot(wt.simulate(one), tmp_path / "record.png")
    assert all((tmp_path / f"{name}.png").stat().st_size > 5_000 for name in ("marks", "wear", "record"))


# -- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "options", "words"),
    [
        (
            {"contact": wt.Hertz(constant=1.405e11)},
            {},
            "contact: found an elastic contact, which `wear_in` does not take; allowed: an elastic-plastic contact",
        ),
        ({"rolling": "circle"}, {}, 'rolling: found "circle", which `wear_in` does not take; allowed: "point"'),
        (
            {"speed": 0.0, "irregularity": ()},
            {},
            "speed: found 0 m/s on a contact that yields, which `wear_in` does not take; allowed: more than 0 m/s",
        ),
        ({}, {"passes": 0}, "passes: found 0; allowed: a whole number, at least 1"),
        ({}, {"hardening": 1.5}, "hardening: found 1.5; allowed: 0 to 1"),
        ({}, {"scatter": {"load": -0.1}}, "scatter.load: found -0.1; allowed: 0 or more"),
        ({}, {"scatter": {"start": 3.0}}, "scatter.start: found 3 m; allowed: less than the run of 2 m"),
        ({}, {"scatter": {"sped": 0.1}}, "scatter.sped: found the unknown name 'sped'; allowed: speed, load, start"),
        ({}, {"store": "wear.zarr"}, "store: found the suffix '.zarr'; allowed: .nc"),
        ({}, {"method": "exact"}, "method: found 'exact'; allowed: 'default', 'strict'"),
    ],
)
def test_wrong_input_is_refused_with_one_message(changes, options, words):
    with pytest.raises(InputError) as raised:
        wt.wear_in(scene().replaced(changes), **({"passes": 2} | options))
    assert words in str(raised.value)


@pytest.mark.slow
def test_foreign_files_are_not_overwritten(tmp_path):
    one, file = scene(length=0.2), tmp_path / "wear.nc"
    wt.wear_in(one, 1, store=file)
    with pytest.raises(InputError, match="another scenario, or with other options"):
        wt.wear_in(one, 2, store=file, seed=1)
    other = tmp_path / "record.nc"
    wt.simulate(one).save(other)
    with pytest.raises(InputError, match="a file that wear_in did not write"):
        wt.wear_in(one, 2, store=other)
    text = Path(tmp_path / "text.nc")
    text.write_text("not netCDF")
    with pytest.raises(InputError, match="no readable netCDF file"):
        wt.wear_in(one, 2, store=text)
    with pytest.raises(InputError, match=r"found an elastic contact, which `marks` does not take"):
        wt.wear.marks(wt.simulate(one.replaced({"contact": wt.Hertz(constant=1.4e11)})))


@pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
def test_a_note_tells_of_the_worst_of_several_contacts_that_go_beyond_their_law():
    wheelset = wt.Wheelset(mass=1200, load=9e4, stiffness=1e6, damping=2e4)
    pair = wt.Scenario(
        vehicle=wt.vehicles.Wheelsets(wheelsets=(wheelset, wheelset), positions=(0.0, -2.5)), speed=25, duration=0.13,
        contact=wt.contact.KogutEtsion(yield_strength=1e8), rolling="point",
        irregularity=wt.CosineBump(height=5e-4, length=0.1, start=0.01),
    )  # fmt: skip
    record = wt.simulate(pair)
    largest = record.peaks.normal_force.groupby("wheelset").max().values
    assert largest[1] > 1.2 * largest[0] > 8e5
    assert any(f"reaches {largest.max() / 1e3:.4g} kN" in note for note in record.notes)
