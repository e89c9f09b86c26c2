"""The check that ends every run: as exact as the energy's own integrals need it, blind to no law, cheap."""

import warnings

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ground.outcome import Outcome
from wheeltapper.lower.build import lower
from wheeltapper.lower.lowered import balanced
from wheeltapper.march.common import program as contract
from wheeltapper.march.wheel.march import march

WHEELSET = {"mass": 1500, "load": 91307, "stiffness": 2.44e6, "damping": 2e4, "radius": 0.46}
BUMP = wt.CosineBump(height="0.2 mm", length="5 cm", start=0.009)


def scenario(**changes):
    common = {
        "vehicle": wt.Wheelset(**WHEELSET), "contact": wt.Hertz(constant=1.405e11), "irregularity": BUMP, "speed": 9.0,
        "duration": 0.06,
    }  # fmt: skip
    return wt.Scenario(**(common | changes))


SCENARIOS = {
    "Hertz": scenario(),
    "linear": scenario(contact=wt.Linear(stiffness=1e9)),
    "bilateral": scenario(contact=wt.Linear(stiffness=1e9, bilateral=True)),
    "hysteresis": scenario(contact=wt.Hertz(constant=1.405e11, hysteresis=0.5)),
    "curvature": scenario(contact=wt.Hertz(), irregularity=wt.Corrugation(amplitude=2e-5, wavelength=0.1, start=0.0)),
    "ideal step": scenario(irregularity=wt.Step(height=1e-4, position=0.05, ideal=True)),
    "flat": scenario(irregularity=wt.WheelFlat(depth=1e-4, position=0.1)),
    "deck": scenario(track=wt.FloatingDeck(mass=2e3, stiffness=1e7, damping=1e4, start=0.02, length=0.2)),
    "plastic": scenario(contact=wt.contact.Thornton(constant=1.405e11, rail_share=1.0)),
    "play": scenario(vehicle=wt.Wheelset(**WHEELSET, damper_play=1e-4)),
    "bush on a deck": scenario(
        vehicle=wt.Wheelset(**WHEELSET, bush_stiffness=1e7), track=wt.FloatingDeck(mass=2e3, stiffness=1e7)
    ),
}
UNDAMPED = scenario(vehicle=wt.Wheelset(mass=1500, load=91307, damping=0.0), duration=0.02)


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("name", SCENARIOS)
def test_a_sound_run_balances_far_below_what_is_told(name, method):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        record = wt.simulate(SCENARIOS[name], method)
    assert record.outcome is Outcome.COMPLETED
    assert balanced.missing_part(record._march) < balanced.NOTABLE
    assert not any("energy differ" in note for note in record.notes)


@pytest.mark.parametrize("name", ["Hertz", "deck", "plastic", "bilateral"])
def test_a_march_by_other_numbers_than_its_record_is_found_out(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        record = wt.simulate(SCENARIOS[name])
    for entry in (contract.DAMPING, contract.STIFFNESS):
        other = record._lowered.program.numbers.copy()
        other[entry] *= 1.05
        program = record._lowered.program._replace(numbers=other)
        missing = balanced.missing_part(record._march._replace(program=program))
        assert missing > balanced.LIMIT
        status, notes = balanced.judged_balance(contract.DONE, missing)
        assert status == balanced.UNBALANCED
        assert "the energy balance of the run is wrong by" in notes[0]


@pytest.mark.parametrize("name", ["Hertz", "undamped", "deck", "hysteresis", "curvature", "flat"])
def test_a_single_lost_step_is_found_out(name):
    lowered = lower((SCENARIOS | {"undamped": UNDAMPED})[name])
    done = march(lowered.program)
    whole = balanced.missing_part(done)
    hit = int(np.argmax(np.abs(done.steps[:, contract.B])))
    broken = done._replace(steps=np.delete(done.steps, hit, axis=0))
    assert whole < balanced.NOTABLE
    assert balanced.missing_part(broken) > balanced.NOTABLE


@pytest.mark.parametrize("name", SCENARIOS)
def test_the_last_step_of_any_march_is_checked(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        record = wt.simulate(SCENARIOS[name])
    state = record._march.state.copy()
    state[contract.B] += 0.2
    assert balanced.missing_part(record._march._replace(state=state)) > balanced.LIMIT


def test_the_last_state_tells_where_the_dampers_end_is(tmp_path):
    record = wt.simulate(SCENARIOS["bush on a deck"])
    vehicle, lowered, state = record.scenario.vehicle, record._lowered, record._march.state
    force = record.at(record.end).damper_force.item()
    assert force == pytest.approx(-vehicle.bush_stiffness * state[contract.END_DEFLECTION] * lowered.length, rel=1e-9)
    record.save(tmp_path / "saved.nc")
    loaded = wt.load(tmp_path / "saved.nc")
    np.testing.assert_array_equal(loaded._march.state, state)
    assert balanced.missing_part(loaded._march) == balanced.missing_part(record._march)


def test_a_run_whose_energy_does_not_balance_is_not_completed(monkeypatch, tmp_path):
    monkeypatch.setattr(balanced, "missing_part", lambda *_: 2e-2)
    record = wt.simulate(SCENARIOS["Hertz"])
    assert record.outcome is Outcome.UNBALANCED
    assert "completed" not in str(record)
    assert "0.02" in record.notes[-1]
    record.save(tmp_path / "kept.nc")
    assert wt.load(tmp_path / "kept.nc").outcome is Outcome.UNBALANCED


def test_what_is_lost_beyond_numbers_is_no_balance():
    assert balanced.judged_balance(contract.DONE, float("nan"))[0] == balanced.UNBALANCED
    assert balanced.judged_balance(contract.TOO_MANY_EVENTS, 1.0) == (contract.TOO_MANY_EVENTS, ())
