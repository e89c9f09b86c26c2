"""Hunt-Crossley's force is held at zero where it would pull: that is a loss, and every question counts it as one."""

import warnings

import numpy as np
import pytest

import wheeltapper as wt

WHEEL = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
WAVES = wt.Scenario(
    vehicle=WHEEL, contact=wt.Hertz(constant=1.405e11, restitution=0.5, impact_speed=0.2), rolling="point", speed=25,
    duration=0.02, irregularity=wt.Corrugation(amplitude=3e-5, wavelength=0.03, start=0.009),
)  # fmt: skip
BUMP = wt.Scenario(
    vehicle=WHEEL.model_copy(update={"damping": 5e4}), rolling="point", speed=9, duration=0.12,
    contact=wt.Hertz(constant=1.405e11, restitution=0.5, impact_speed=0.05),
    irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.009),
)  # fmt: skip
ON_DECK = {"track": wt.FloatingDeck(mass=3000, stiffness=1e8, damping=3e4)}
CASES = {
    "waves": WAVES,
    "waves on a deck": WAVES.replaced(ON_DECK),
    "bump": BUMP,
    "bump on a deck": BUMP.replaced(ON_DECK),
}


def drawn(rng):
    start, sign = rng.uniform(0.0, 0.05), rng.choice([-1, 1])
    irregularity = [
        wt.CosineBump(height=sign * rng.uniform(5e-5, 4e-4), length=rng.uniform(0.02, 0.2), start=start),
        wt.Step(height=sign * rng.uniform(3e-5, 3e-4), position=start + 0.03, ideal=bool(rng.integers(2))),
        wt.Corrugation(amplitude=rng.uniform(1e-5, 8e-5), wavelength=rng.uniform(0.03, 0.15), start=start),
        wt.WheelFlat(depth=rng.uniform(2e-5, 3e-4), position=start + 0.06),
    ][int(rng.integers(4))]
    track = wt.StiffTrack()
    if rng.uniform() < 0.4:
        place = {} if rng.uniform() < 0.5 else {"start": rng.uniform(0.02, 0.1), "length": rng.uniform(0.05, 0.4)}
        track = wt.FloatingDeck(
            mass=rng.uniform(300, 1e4), stiffness=10 ** rng.uniform(6.5, 8.5), damping=rng.uniform(0, 1e5), **place
        )
    return wt.Scenario(
        vehicle=wt.Wheelset(
            mass=rng.uniform(500, 2500), load=rng.uniform(2e4, 1.5e5), stiffness=rng.uniform(0, 1e7),
            damping=rng.uniform(0, 2e5),
        ),
        track=track,
        contact=wt.Hertz(
            constant=rng.uniform(5e10, 4e11), restitution=rng.uniform(0.05, 0.7),
            impact_speed=10 ** rng.uniform(-2, -0.3),
        ),
        irregularity=irregularity, rolling=str(rng.choice(["point", "circle"])), speed=rng.uniform(1, 40),
        duration=0.04,
    )  # fmt: skip


def check(scene):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        record = wt.simulate(scene)
    assert abs(record.energy.relative_imbalance.item()) < 1e-10, scene
    kinds = record.events.kind.values
    assert all(a != b for a, b in zip(kinds[:-1], kinds[1:], strict=True))
    free = np.diff(record.events.time.values, append=record.end)[kinds == "loss"].sum()
    if len(kinds) and kinds[0] == "loss":
        assert record.time_in_air == pytest.approx(free, rel=1e-9, abs=1e-15)


def test_energy_is_balanced_with_strong_material_damping():
    rng = np.random.default_rng(5)
    for _ in range(40):
        check(drawn(rng))


@pytest.mark.whole
@pytest.mark.slow
def test_energy_is_balanced_with_strong_material_damping_in_two_thousand_cases():
    rng = np.random.default_rng(6)
    for _ in range(2000):
        check(drawn(rng))


@pytest.mark.parametrize("name", CASES)
def test_there_is_no_force_between_a_loss_and_the_next_impact(name):
    record = wt.simulate(CASES[name], "strict")
    losses, impacts = (record.events.time.values[record.events.kind.values == kind] for kind in ("loss", "impact"))
    assert len(impacts) >= 1
    for loss, impact in zip(losses, impacts, strict=False):
        inside = record.at(np.linspace(loss, impact, 25)[1:-1])
        assert (inside.normal_force.values == 0).all()
        edge = 1e-3 * (impact - loss)
        around = record.at([loss - edge, impact + edge])
        assert (around.normal_force.values > 0).all()
        assert (around.normal_force.values < 0.05 * record.static_force).all()
        assert inside.indentation.values[0] > 0  # the force ends before the indentation does


def test_a_force_that_returns_while_indented_is_an_impact_with_negative_closing_speed():
    record = wt.simulate(WAVES)
    at = record.at(record.impacts.time.values)
    indented = at.indentation.values > 1e-9
    assert indented.any()
    expected = -1 / WAVES.contact.hysteresis_factor
    np.testing.assert_allclose(record.impacts.closing_speed.values[indented], expected, rtol=1e-12)
    assert (record.impacts.closing_speed.values[~indented] > 0).all()


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("name", CASES)
def test_maps_count_as_records_do(name, method):
    scene, f = CASES[name], wt.features
    features = [f.number_of_impacts(), f.time_in_air(), f.first_loss(), f.largest_force(), f.impulse(), f.last_loss()]
    chart = wt.sweep(scene, {"vehicle.mass": [1500.0, 1501.0]}, features, method=method).isel({"vehicle.mass": 0})
    record = wt.simulate(scene, method)
    losses = record.events.time.values[record.events.kind.values == "loss"]
    assert chart.number_of_impacts.item() == record.impacts.sizes["impact"]
    assert chart.time_in_air.item() == pytest.approx(record.time_in_air, rel=1e-9)
    assert chart.first_loss.item() == pytest.approx(losses[0], rel=1e-12)
    assert chart.last_loss.item() == pytest.approx(losses[-1], rel=1e-12)
    assert chart.largest_force.item() == pytest.approx(record.peaks.normal_force.values.max(), rel=1e-12)
    impulse = record.impacts.impulse.values[0]
    assert np.isnan(impulse) or chart.impulse.item() == pytest.approx(impulse, rel=1e-9)


def numbers(record, impacts):
    events = record.events
    losses, onsets = (events.time.values[events.kind.values == kind][:impacts] for kind in ("loss", "impact"))
    rates = record.impacts.closing_speed.values[:impacts]
    return np.concatenate([losses, onsets, rates, record.peaks.normal_force.values[:impacts], [record.time_in_air]])


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_gradients_go_through_losses_and_impacts_while_indented(name):
    scene, custom = CASES[name], wt.features.custom
    impacts = min(4, wt.simulate(scene).impacts.sizes["impact"])
    features = [
        custom(lambda train, k=k, what=what: getattr(train, what)[k], f"{what}{k}", impacts=impacts)
        for what in ("loss_time", "impact_time", "closing_speed", "peak_force")
        for k in range(impacts)
    ] + [wt.features.time_in_air()]
    paths = ["vehicle.mass", "contact.restitution", "contact.impact_speed", "speed"]
    found = wt.gradient(scene, features, paths)
    assert int(found.gradient_status) == 0
    values = np.array([float(found[feature.name]) for feature in features])
    for i, path in enumerate(paths):
        value = float(found.value[i])
        h = 2e-4 * value
        rows = [numbers(wt.simulate(scene.replaced({path: value + k * h}), "strict"), impacts) for k in (-2, -1, 1, 2)]
        expected = (rows[0] - 8 * rows[1] + 8 * rows[2] - rows[3]) / (12 * h)
        slopes = np.array([float(found[f"{feature.name}_gradient"][i]) for feature in features])
        np.testing.assert_allclose(slopes, expected, rtol=2e-6, atol=1e-7 * np.abs(values).min() / value)


def test_the_border_of_contact_is_where_the_force_first_ends():
    scene = WAVES.replaced({"duration": 0.01})
    ends = {"irregularity.0.amplitude": (0.5e-5, 3e-5), "speed": (20.0, 30.0)}
    found = wt.border(scene, ends, resolution=3)
    assert found.sizes["point"] >= 3
    for amplitude, speed in zip(found["irregularity.0.amplitude"].values, found["speed"].values, strict=True):
        near = {"speed": speed}
        kept, lost = (
            wt.simulate(scene.replaced(near | {"irregularity.0.amplitude": amplitude * (1 + d)})) for d in (-1e-6, 1e-6)
        )
        assert kept.events.sizes["event"] == 0
        assert lost.events.sizes["event"] > 0
        first = lost.at(lost.events.time.values[0])
        assert first.indentation.item() > 1e-9


@pytest.mark.parametrize("end", [{"damper_play": 2e-5}, {"bush_stiffness": 5e7}])
def test_a_damper_with_an_end_of_its_own_counts_them_too(end):
    scene = WAVES.replaced({f"vehicle.{name}": value for name, value in end.items()})
    record = wt.simulate(scene)
    assert abs(record.energy.relative_imbalance.item()) < 1e-10
    kinds = record.events.kind.values
    assert all(a != b for a, b in zip(kinds[:-1], kinds[1:], strict=True))
    assert (record.impacts.closing_speed.values < 0).any()
    free = np.diff(record.events.time.values, append=record.end)[kinds == "loss"].sum()
    assert record.time_in_air == pytest.approx(free, rel=1e-9)
