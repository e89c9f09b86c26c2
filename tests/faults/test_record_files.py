"""Files of records: those of older formats are loaded, what broke off too, and plain xarray finds every contact."""

import lzma
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from wheeltapper.ground.outcome import Outcome
from wheeltapper.march.common import program as contract
from wheeltapper.record import wagon, wheel

DATA = Path(__file__).resolve().parents[1] / "data"
WHEELSET = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91307, stiffness=2.44e6, damping=5e4, radius=0.46),
    contact=wt.Hertz(constant=1.405e11), irregularity=wt.CosineBump(height=4e-4, length=0.05, start=0.05),
    speed=9.0, duration=0.02,
)  # fmt: skip


def older(kind, folder):
    """Unpack a file of format 1; return its path and its contents."""
    path = folder / f"{kind}.nc"
    path.write_bytes(lzma.decompress((DATA / f"record_{kind}_format_1.nc.xz").read_bytes()))
    with xr.open_dataset(path, engine="h5netcdf") as opened:
        return path, opened.load()


@pytest.mark.parametrize("kind", ["wheelset", "wagon"])
def test_a_file_of_format_1_answers_as_when_it_was_written(tmp_path, kind):
    path, data = older(kind, tmp_path)
    assert data.attrs["format"] == 1
    record = wt.load(path)
    assert str(record) == data.attrs["summary"]
    for name, found in {
        "event_time": record.events.time, "position": record.events.position, "event_contact": record.events.contact,
        "indentation_rate": record.events.indentation_rate, "peak_time": record.peaks.time,
        "peak_normal_force": record.peaks.normal_force,
    }.items():  # fmt: skip
        np.testing.assert_array_equal(found, data[name])
    since = {"dissipated": "dissipated_suspension", "friction": "dissipated_creep"} if kind == "wagon" else {}
    for name in (str(one).removeprefix("energy_") for one in data if str(one).startswith("energy_")):
        value = float(record.energy[since.get(name, name)])
        assert value == pytest.approx(float(data[f"energy_{name}"]), rel=1e-9, abs=1e-9)
    times = np.linspace(0.0, record.end, 7)
    again = wt.simulate(record.scenario)
    for name, values in record.at(times).items():
        np.testing.assert_allclose(values, again.at(times)[name], rtol=1e-6, atol=1e-6)


def test_a_file_of_format_1_saved_again_has_the_axis_of_contacts(tmp_path):
    path, old = older("wagon", tmp_path)
    record = wt.load(path)
    record.save(tmp_path / "new.nc")
    with xr.open_dataset(tmp_path / "new.nc", engine="h5netcdf") as opened:
        data = opened.load()
    assert data.attrs["format"] == 2
    assert data.static_force.dims == ("contact",)
    np.testing.assert_array_equal(data.static_force, old.static_force.values.ravel())
    sides = np.array(data.contact_side.attrs["flag_meanings"].split())[data.contact_side]
    assert list(sides[data.event_contact]) == list(record.events.side.values) == ["right", "right"]
    assert list(data.contact_wheelset.values[data.peak_contact]) == list(record.peaks.wheelset.values)
    assert wt.load(tmp_path / "new.nc").impacts.identical(record.impacts)


@pytest.mark.parametrize(("kind", "names"), [("wheelset", ()), ("wagon", ("wheelset", "side", "surface"))])
def test_tables_of_several_wheels_name_them_as_coordinates(tmp_path, kind, names):
    record = wt.load(older(kind, tmp_path)[0])
    for table in (record.events, record.peaks, record.impacts):
        assert set(table.coords) == set(names)
        assert len(table.sizes) == 1
    assert set(names) - {"surface"} == set(record.static_forces.dims)
    assert record.at([0.001]).normal_force.dims == ("time", *names[:2])
    assert float(record.static_forces.max()) == record.static_force


def test_each_surface_of_a_wheel_is_a_contact_of_its_own(tmp_path):
    axle = wt.vehicles.Axle(
        mass=1500.0, inertia=(1120.0, 112.0, 1120.0), position=0.0, held=("x", "roll", "pitch", "yaw")
    )
    tied = wt.vehicles.Spring(
        name="tie", between=("wheelset 1", "ground"), at=(0.0, 0.0, 0.46), stiffness=(0.0, 1e5, 0.0)
    )
    record = wt.simulate(
        wt.Scenario(vehicle=wt.Wagon(bodies=(), axles=(axle,), elements=(tied,)), speed=20.0, duration=0.002)
    )
    contacts = record._contacts
    assert list(contacts.labels["surface"]) == ["tread", "tread", "flange", "flange"]
    assert list(contacts.labels["side"]) == ["left", "right", "left", "right"]
    rows = np.zeros((4, contract.EVENT_COLUMNS))
    rows[:, contract.EVENT_CONTACT] = contacts.lanes[::-1]
    np.testing.assert_array_equal(contacts.contact_of_rows(rows), [3, 2, 1, 0])
    record.save(tmp_path / "a.nc")
    np.testing.assert_array_equal(wt.load(tmp_path / "a.nc").static_forces, record.static_forces)


def spoilt(kind, change, monkeypatch):
    """Let scenarios of a kind be lowered with other numbers, as no valid scenario has them."""
    name = "lower" if kind is wheel else "lower_wagon"
    made = getattr(kind, name)
    monkeypatch.setattr(kind, name, lambda scenario, method: change(made(scenario, method)))


def test_a_record_that_is_not_finite_is_loaded(tmp_path, monkeypatch):
    def far_too_stiff(lowered):
        numbers = lowered.program.numbers.copy()
        numbers[contract.CUBIC] = 1e300
        return replace(lowered, program=lowered.program._replace(numbers=numbers))

    spoilt(wheel, far_too_stiff, monkeypatch)
    record = wt.simulate(WHEELSET)
    assert record.outcome is Outcome.NOT_FINITE
    record.save(tmp_path / "a.nc")
    again = wt.load(tmp_path / "a.nc")
    assert str(again) == str(record)
    np.testing.assert_array_equal(again.at([0.0, record.end]).normal_force, record.at([0.0, record.end]).normal_force)


def test_a_wagon_s_record_that_does_not_balance_is_loaded(tmp_path, monkeypatch):
    def unstable(lowered):
        return replace(lowered, assembly=lowered.assembly._replace(columns=-1e4 * lowered.assembly.columns))

    scenario = wt.load(older("wagon", tmp_path)[0]).scenario
    spoilt(wagon, unstable, monkeypatch)
    record = wt.simulate(scenario)
    assert record.outcome is Outcome.UNBALANCED
    record.save(tmp_path / "a.nc")
    assert str(wt.load(tmp_path / "a.nc")) == str(record)


def cubic(delta):
    return 1.4e11 * delta**1.5 * (1.0 + 200.0 * delta)


def damped(delta, rate):
    return 1.4e11 * delta**1.5 * (1.0 + 0.1 * rate)


@pytest.mark.parametrize("force", [cubic, damped, lambda delta: 1.3e11 * delta**1.5])
def test_a_record_with_a_law_of_ones_own_comes_back_with_its_function(force, tmp_path):
    record = wt.simulate(WHEELSET.replaced({"contact": wt.contact.Law(force)}))
    record.save(tmp_path / "a.nc")
    again = wt.load(tmp_path / "a.nc", law=force)
    assert str(again) == str(record)
    assert again.scenario == record.scenario
    times = np.linspace(0.0, record.end, 50)
    np.testing.assert_array_equal(again.at(times).normal_force, record.at(times).normal_force)
    name = f"{force.__module__}.{force.__qualname__}"
    for given, found in (
        (None, f"the name of a Python function, {name!r}"),
        (lambda delta: force(delta, 0.0) if force is damped else (1.0 + 1e-9) * force(delta), "returns other forces"),
        ("a text", "contact, force"),
    ):
        with pytest.raises(wt.InputError) as error:
            wt.load(tmp_path / "a.nc", law=given)
        if given != "a text":
            assert found in str(error.value)
            assert f"with the function that the record was made with, {name}" in str(error.value)


def test_a_function_for_a_record_without_a_law_of_ones_own_is_refused(tmp_path):
    wt.simulate(WHEELSET).save(tmp_path / "a.nc")
    with pytest.raises(wt.InputError, match="law: found a function; allowed: none, as this record's contact is no"):
        wt.load(tmp_path / "a.nc", law=cubic)
