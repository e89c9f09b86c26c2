"""Files of records: those of older formats are loaded, what broke off too, and plain xarray finds every contact."""

import pickle
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import wheeltapper as wt
from tests.earlier import EARLIER, earlier
from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.describe.scenario import Start
from wheeltapper.ground.outcome import Outcome
from wheeltapper.ground.warned import ModelWarning
from wheeltapper.lower import door
from wheeltapper.march.common import program as contract

WHEELSET = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91307, stiffness=2.44e6, damping=5e4, radius=0.46),
    contact=wt.Hertz(constant=1.405e11), irregularity=wt.CosineBump(height=4e-4, length=0.05, start=0.05),
    speed=9.0, duration=0.02,
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "version"), EARLIER)
def test_a_file_of_an_earlier_format_answers_as_when_it_was_written(tmp_path, kind, version):
    path, data = earlier(kind, version, tmp_path)
    assert data.attrs["format"] == version
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


@pytest.mark.slow
def test_a_file_of_format_1_saved_again_has_the_axis_of_contacts(tmp_path):
    path, old = earlier("wagon", 1, tmp_path)
    record = wt.load(path)
    record.save(tmp_path / "new.nc")
    with xr.open_dataset(tmp_path / "new.nc", engine="h5netcdf") as opened:
        data = opened.load()
    assert data.attrs["format"] == 3
    assert data.static_force.dims == ("contact",)
    np.testing.assert_array_equal(data.static_force, old.static_force.values.ravel())
    sides = np.array(data.contact_side.attrs["flag_meanings"].split())[data.contact_side]
    assert list(sides[data.event_contact]) == list(record.events.side.values) == ["right", "right"]
    assert list(data.contact_wheelset.values[data.peak_contact]) == list(record.peaks.wheelset.values)
    assert wt.load(tmp_path / "new.nc").impacts.identical(record.impacts)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "names"), [("wheelset", ()), ("wagon", ("wheelset", "side", "surface"))])
def test_tables_of_several_wheels_name_them_as_coordinates(tmp_path, kind, names):
    record = wt.load(earlier(kind, 1, tmp_path)[0])
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
    name = f"_lowered_{kind}"
    made = getattr(door, name)
    monkeypatch.setattr(door, name, lambda scenario, method: change(made(scenario, method)))


def test_a_record_that_is_not_finite_is_loaded(tmp_path, monkeypatch):
    def far_too_stiff(lowered):
        numbers = lowered.program.numbers.copy()
        numbers[contract.CUBIC] = 1e300
        return replace(lowered, program=lowered.program._replace(numbers=numbers))

    spoilt("wheel", far_too_stiff, monkeypatch)
    record = wt.simulate(WHEELSET)
    assert record.outcome is Outcome.NOT_FINITE
    record.save(tmp_path / "a.nc")
    again = wt.load(tmp_path / "a.nc")
    assert str(again) == str(record)
    np.testing.assert_array_equal(again.at([0.0, record.end]).normal_force, record.at([0.0, record.end]).normal_force)


def test_a_wagon_s_record_that_does_not_balance_is_loaded(tmp_path, monkeypatch):
    def unstable(lowered):
        return replace(lowered, assembly=lowered.assembly._replace(columns=-1e4 * lowered.assembly.columns))

    scenario = wt.load(earlier("wagon", 1, tmp_path)[0]).scenario
    spoilt("wagon", unstable, monkeypatch)
    record = wt.simulate(scenario)
    assert record.outcome is Outcome.UNBALANCED
    record.save(tmp_path / "a.nc")
    assert str(wt.load(tmp_path / "a.nc")) == str(record)


def cubic(delta):
    return 1.4e11 * delta**1.5 * (1.0 + 200.0 * delta)


def damped(delta, rate):
    return 1.4e11 * delta**1.5 * (1.0 + 0.1 * rate)


@pytest.mark.slow
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


BUMP = wt.CosineBump(height=4e-4, length=0.05, start=0.05)
YIELDING = {"contact": wt.contact.Thornton(constant=1.405e11, yield_force=1.2e5), "rolling": "point"}
PAIR = wt.vehicles.Wheelsets(wheelsets=(WHEELSET.vehicle, WHEELSET.vehicle), positions=(0.0, -0.1))
DECK = wt.FloatingDeck(mass=500, stiffness=5e7, damping=1e4)
COACH = wt.Scenario.from_toml("examples/coach_step.toml").replaced({"duration": 0.01})
SLAB = wt.tracks.Slab(**wt.tracks.Slab.example | {"cutoff": 1000, "bays": 160})
KEPT = {
    "deck": WHEELSET.replaced({"track": DECK}),
    "spot that remembers": wt.Scenario(
        vehicle=WHEELSET.vehicle, contact=YIELDING["contact"], speed=0.0, duration=0.05,
        start=Start(displacement=2e-3),
    ),
    "marks of a wheel before": WHEELSET.replaced(
        {"vehicle": PAIR, "duration": 0.04, "irregularity.0.height": 1e-4, **YIELDING}
    ),
    "slab": WHEELSET.replaced({"track": SLAB}),
    "coach": COACH,
    "coach that yields": COACH.replaced({
        "contact": wt.contact.Thornton(constant_per_wheel=7e10, yield_force=9e4), "rolling": "point", "speed": 20.0,
        "duration": 0.14,
    }),
    "coach on a slab": COACH.replaced({"track": SLAB}),
}  # fmt: skip


CHANGED_PATHS = ("spot that remembers", "marks of a wheel before", "coach that yields")
"""Those whose march has changed the paths of wheels, so that files keep these."""


@pytest.mark.slow
@pytest.mark.few(4)
@pytest.mark.parametrize("name", KEPT)
def test_a_record_comes_back_to_the_same_bits_from_what_it_was_made_of_and_its_log(tmp_path, name):
    record = wt.simulate(KEPT[name])
    record.save(tmp_path / "a.nc")
    with xr.open_dataset(tmp_path / "a.nc", engine="h5netcdf") as opened:
        assert not any(str(one).startswith(("program", "assembly", "task")) for one in opened.variables)
        assert ("march_pieces" in opened) == (name in CHANGED_PATHS)
    again = wt.load(tmp_path / "a.nc")
    assert again.scenario == record.scenario
    assert again.notes == record.notes
    for table in ("events", "peaks", "impacts", "energy"):
        assert getattr(again, table).identical(getattr(record, table))
    assert again.history(5000.0).identical(record.history(5000.0))
    again.save(tmp_path / "b.nc")
    assert wt.load(tmp_path / "b.nc").history(5000.0).identical(record.history(5000.0))


@pytest.mark.parametrize("name", KEPT)
def test_a_record_goes_to_another_process_and_answers_there(name):
    record = wt.simulate(KEPT[name])
    assert record.impacts.sizes["impact"] >= 0
    again = pickle.loads(pickle.dumps(record))
    assert again.energy.identical(record.energy)
    assert again.history(2000.0).identical(record.history(2000.0))


@pytest.mark.parametrize("name", ["deck", "marks of a wheel before", "coach that yields"])
def test_impacts_are_where_the_table_of_events_has_them(name):
    record = wt.simulate(KEPT[name])
    hits = record.events.isel(event=record.events.kind.values == "impact")
    assert hits.sizes["event"] > 0
    for column in ("time", "position", *record.impacts.coords):
        np.testing.assert_array_equal(record.impacts[column], hits[column])
        assert record.impacts[column].attrs == record.events[column].attrs


def surface(path):
    x = np.linspace(0.0, 1.0, 201)
    np.savetxt(path, np.column_stack([x, 1e-4 * np.sin(9.0 * x) ** 2]))
    return path


def worn_rail(path):
    y = np.linspace(-36.5, 36.5, 293)
    np.savetxt(path, np.column_stack([y, rail_60e1(y) - 0.1 * np.exp(-((y / 9.0) ** 2))]))
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scenario", "change"),
    [
        (WHEELSET, lambda path: {"irregularity": wt.Measured(path=surface(path), beyond="flat", start=0.02)}),
        (WHEELSET, lambda path: {"irregularity": wt.OutOfRound(path=surface(path), noise=1e-6)}),
        (COACH, lambda path: {"irregularity": {"left": (wt.Measured(path=surface(path), beyond="flat"),)}}),
        (COACH, lambda path: {"profiles": wt.profiles.WheelRail(rail=worn_rail(path))}),
    ],
)
def test_a_record_holds_the_files_that_its_scenario_names(tmp_path, scenario, change):
    path = tmp_path / "surface.txt"
    record = wt.simulate(scenario.replaced(change(path)))
    path.write_text("something else")  # what was read is kept
    record.save(tmp_path / "a.nc")
    path.unlink()
    again = wt.load(tmp_path / "a.nc")
    assert again.scenario == record.scenario._with_data()
    assert again.scenario._with_data() is again.scenario
    times = np.linspace(0.0, record.end, 50)
    assert again.at(times).identical(record.at(times))
    assert wt.simulate(again.scenario).at(times).identical(record.at(times))
    changed = again.scenario.replaced({"duration": 0.5 * float(record.scenario.duration)})
    assert wt.simulate(changed).outcome is Outcome.COMPLETED


@pytest.mark.slow
@pytest.mark.parametrize(("change", "said"), [(1e-4, "largest difference to the stored events is"), (0.3, "events")])
def test_a_history_that_this_version_makes_otherwise_is_marched_again_and_says_so(tmp_path, monkeypatch, change, said):
    record = wt.simulate(WHEELSET)
    record.save(tmp_path / "a.nc")

    def stiffer(lowered):
        numbers = lowered.program.numbers.copy()
        numbers[contract.CUBIC] *= 1.0 + change
        return replace(lowered, program=lowered.program._replace(numbers=numbers))

    spoilt("wheel", stiffer, monkeypatch)
    again = wt.load(tmp_path / "a.nc")
    assert again.events.identical(record.events)
    assert again.peaks.identical(record.peaks)
    with pytest.warns(ModelWarning, match=f"the file .wheeltapper.* is not what this version computes.*{said}"):
        history = again.history(5000.0)
    assert any("the run was computed again" in note for note in again.notes)
    assert again.events.identical(record.events)
    assert not history.identical(record.history(5000.0))
    assert history.identical(wt.simulate(WHEELSET).history(5000.0))


def test_a_log_that_no_longer_fits_the_path_is_marched_again_with_the_events_of_the_file(tmp_path, monkeypatch):
    record = wt.simulate(WHEELSET)
    record.save(tmp_path / "a.nc")

    def of_fewer_pieces(lowered):
        pieces = lowered.program.pieces[:1].copy()
        pieces[0, contract.STOP] = np.inf
        numbers = lowered.program.numbers.copy()
        numbers[contract.LOOP] = 1
        return replace(lowered, program=lowered.program._replace(pieces=pieces, numbers=numbers))

    spoilt("wheel", of_fewer_pieces, monkeypatch)
    with pytest.warns(ModelWarning, match="computed again: it has 0 events where the file has [1-9]"):
        again = wt.load(tmp_path / "a.nc")
    assert again.events.identical(record.events)
    assert again.peaks.identical(record.peaks)
    assert again.outcome is record.outcome
    assert again.history(5000.0).identical(wt.simulate(WHEELSET).history(5000.0))


@pytest.mark.slow
def test_an_orbit_on_a_deck_comes_back_on_its_own_path(tmp_path):
    scenario = wt.Scenario(
        vehicle=WHEELSET.vehicle, track=wt.FloatingDeck(mass=2e4, stiffness=5e8, damping=2e5), speed=9.0, duration=1.0,
        contact=wt.Hertz(constant=1.405e11), irregularity=wt.Corrugation(amplitude=1e-5, wavelength=0.05, start=0.0),
    )  # fmt: skip
    record = wt.orbits.find(scenario).record
    record.save(tmp_path / "a.nc")
    again = wt.load(tmp_path / "a.nc")
    assert again.history(5000.0).identical(record.history(5000.0))


OWN = """
import sys, wheeltapper as wt
class Ramp(wt.irregularities.Irregularity):
    \"\"\"A ramp.\"\"\"
    example = {"height": 1e-4}
    height: float = 1e-4
    def course(self, radius):
        return wt.CosineBump(height=self.height, length=0.05, start=0.05).course(radius)
"""


@pytest.mark.slow
def test_a_class_that_the_loading_process_lacks_is_named_and_tables_stay_readable(tmp_path):
    made = OWN + (
        "wt.simulate(wt.Scenario(vehicle=wt.Wheelset(mass=1500, load=91307), irregularity=Ramp(), speed=9.0, "
        "duration=0.02)).save(sys.argv[1])\n"
    )
    path = tmp_path / "a.nc"
    subprocess.run([sys.executable, "-c", made, str(path)], check=True, capture_output=True)
    with pytest.raises(wt.InputError) as error:
        wt.load(path)
    assert "'Ramp'" in str(error.value)
    assert "xarray.open_dataset" in str(error.value)
    assert "\n" not in str(error.value)
    with xr.open_dataset(path, engine="h5netcdf") as opened:
        assert opened.sizes["peak"] > 0
    told = OWN + "print(len(wt.load(sys.argv[1]).history(5000.0).time))\n"
    done = subprocess.run([sys.executable, "-c", told, str(path)], check=True, capture_output=True, text=True)
    assert int(done.stdout) > 90
