"""One suite over every contact law: statics, sign of the force, energy, agreement of the methods, description.

The laws are those of the registry, with the example that each class gives, and variants of some.
"""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ask.questions import GRADIENT
from wheeltapper.describe.contact.base import Contact
from wheeltapper.ground.needs import OWN_LAW
from wheeltapper.lower.build import table_of
from wheeltapper.lower.numbers import METHODS
from wheeltapper.march import run

from . import samples

VARIANTS = {
    "per wheel": wt.Hertz(constant_per_wheel=7e10),
    "computed": wt.Hertz(rail_radius=0.3, curvature=False),
    "following the curvature": wt.Hertz(constant=1.405e11, curvature=True),
    "damped": wt.Hertz(constant=1.405e11, hysteresis=0.3),
    "by restitution": wt.Hertz(constant=1.405e11, restitution=0.8, impact_speed=0.2),
    "given force at yield": wt.contact.Stronge(constant=1.405e11, yield_force=1.5e5),
    "given strength": wt.contact.JacksonGreen(constant=1.405e11, yield_strength="500 MPa"),
    "given hardness": wt.contact.KogutEtsion(constant=1.405e11, hardness="1.2 GPa"),
    "linear, bilateral": wt.Linear(stiffness=1.9e9, bilateral=True),
}


TRACKS = {"stiff": wt.StiffTrack(), "deck": wt.FloatingDeck(mass=5000, stiffness=2e7, damping=1e4)}


def laws():
    return samples(Contact) | VARIANTS


LAWS = laws()


def takes(question, law, track=TRACKS["stiff"]):
    """Tell whether a question about a law is answered."""
    return run.fastest_march(question, law.needs | track.needs) is not None


def scene(law, height=1.5e-4, duration=0.06, **fields):
    return wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4),
        contact=law,
        irregularity=wt.CosineBump(height=height, length=0.06, start=0.05) if height else None,
        rolling="point",
        speed=8,
        duration=duration,
        **fields,
    )


@pytest.mark.parametrize("name", sorted(LAWS))
def test_at_rest_the_force_balances_weight_and_suspension(name):
    record = wt.simulate(scene(LAWS[name], height=0.0, duration=0.02))
    history = record.history(1e4)
    np.testing.assert_allclose(history.wheel_acceleration, 0.0, atol=1e-8)
    np.testing.assert_allclose(history.normal_force, record.static_force, rtol=1e-10)
    assert not set(record.events.kind.values) & {"loss", "impact"}


@pytest.mark.parametrize(
    ("name", "track"),
    [(name, at) for name, law in sorted(LAWS.items()) for at, track in TRACKS.items() if takes(run.ENERGY, law, track)],
)
def test_energy_closes_and_only_a_bilateral_contact_pulls(name, track):
    record = wt.simulate(scene(LAWS[name], track=TRACKS[track]))
    terms = [abs(float(v)) for k, v in record.energy.items() if k != "imbalance"]
    assert abs(float(record.energy.imbalance)) < 1e-8 * max(terms)
    lowest = float(record.history(1e5).normal_force.min())
    if "bilateral" in name:
        assert lowest < 0.0
        assert len(record.events.time) == 0
    else:
        assert lowest == 0.0
        assert len(record.impacts.time) >= 2


@pytest.mark.parametrize("name", sorted(LAWS))
def test_both_methods_agree(name):
    default, strict = (wt.simulate(scene(LAWS[name]), method) for method in ("default", "strict"))
    assert default.events.kind.values.tolist() == strict.events.kind.values.tolist()
    np.testing.assert_allclose(default.events.time, strict.events.time, rtol=0, atol=1e-10)
    np.testing.assert_allclose(default.peaks.normal_force, strict.peaks.normal_force, rtol=1e-8)


@pytest.mark.parametrize("name", sorted(LAWS))
def test_a_law_is_a_frozen_value_that_survives_its_file(name, tmp_path):
    law = LAWS[name]
    with pytest.raises(wt.InputError, match="never changes"):
        law.stiffness = 1.0
    file = tmp_path / "scenario.toml"
    if any(callable(getattr(law, field)) for field in type(law).model_fields):
        with pytest.raises(wt.InputError, match="contact: found a Law, which holds a Python function"):
            scene(law).to_toml(file)
        return
    scene(law).to_toml(file)
    assert wt.Scenario.from_toml(file).contact == law


def numbers_of(law):
    return [field for field, value in law.model_dump().items() if type(value) is float and value > 0.0]


@pytest.mark.slow
@pytest.mark.few(8)
@pytest.mark.parametrize(
    "name", sorted(name for name, law in LAWS.items() if takes(GRADIENT, law) and OWN_LAW not in law.needs)
)
def test_gradients_by_the_laws_own_numbers_are_differences(name):
    """Those of elastic-plastic laws are differences themselves, of other steps; own laws have tables instead."""
    law, features = LAWS[name], [wt.features.largest_force()]
    fields = [f"contact.{field}" for field in numbers_of(law) if field in law.model_fields_set]
    assert fields
    found = wt.gradient(scene(law), features, fields, method="strict").largest_force_gradient
    for field in fields:
        middle = getattr(law, field.removeprefix("contact."))
        step = 1e-4 * middle
        ends = wt.sweep(scene(law), {field: [middle - step, middle + step]}, features, method="strict").largest_force
        slope = float(ends[1] - ends[0]) / (2.0 * step)
        assert found.sel(parameter=field).item() == pytest.approx(slope, rel=1e-5, abs=1e-7 * float(ends[0]) / middle)


def test_laws_give_different_answers_in_one_process():
    largest = [float(wt.simulate(scene(law)).peaks.normal_force.max()) for law in LAWS.values()]
    assert len({round(value, 3) for value in largest}) == len(LAWS)


@pytest.mark.parametrize("rolling", ["point", "circle"])
def test_strict_tables_of_a_factor_do_not_follow_rounding(rolling):
    """Fitted with its level, a path of 0.1 mm was cut a million times: rounding of the level looked like a bend."""
    following = scene(LAWS["following the curvature"]).replaced({"rolling": rolling})
    table, _ = table_of(following, 0.5, METHODS["strict"])
    assert len(table.rows) < 100


@pytest.mark.parametrize("exponent", [1.25, 1.5, 2.5])
def test_a_contact_in_flight_stores_nothing_whatever_its_power(exponent):
    """In flight an indentation is negative, of which only some powers are numbers."""
    scale = 1.4e5 / 1e-4**exponent
    law = wt.contact.Law(lambda delta: scale * delta**exponent, exponent=exponent)
    lost, hit = wt.simulate(scene(law)).events.time.values[:2]
    record = wt.simulate(scene(law, duration=0.5 * float(lost + hit)))
    assert float(record.at([record.end]).normal_force[0]) == 0.0
    force = float(record.static_force)
    stored = force * (force / scale) ** (1.0 / exponent) / (exponent + 1.0)
    assert float(record.energy.elastic_contact) == pytest.approx(-stored, rel=1e-6)
    assert abs(float(record.energy.relative_imbalance)) < 1e-9
