"""Derivatives by differences of runs where nothing has tangents: closed forms, exact tangents, another program."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import wheeltapper as wt
from tests import pieces
from tests.reference import test_kinks_of_suspensions as others
from wheeltapper.ask.cells import compute_cells
from wheeltapper.ask.chart import chart_dataset
from wheeltapper.ask.computed import TRUST_BY_DIFFERENCES
from wheeltapper.ask.study import study_of
from wheeltapper.lower.fields import Fields

from ..marks import slow

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
TINY = 1e-30
"""Of a complex step: the imaginary part of a function is its derivative, times this."""
WHEEL = {"mass": 1340.0, "load": 86e3, "stiffness": 1.9e6, "damping": 4e4}
SCENE = wt.Scenario(
    vehicle=wt.Wheelset(**WHEEL), contact=wt.Hertz(constant=1.7e11), speed=11.0, duration=0.012, rolling="point",
    irregularity=wt.CosineBump(height=2.1e-4, length=0.06, start=0.006),
)  # fmt: skip
BALLASTED = wt.tracks.Ballasted.named("rolland_Nordborg", bays=40, cutoff=1500.0)
SLAB = wt.tracks.Slab(**wt.tracks.Slab.example | {"cutoff": 1000, "bays": 160})
FEATURES = ["largest_force", "first_loss", "time_in_air", "impulse"]


def status_of(found):
    return TRUST_BY_DIFFERENCES[int(found.gradient_status)]


def by_differences(scene, features, paths):
    """Return the gradient by differences, also where there are tangents."""
    here = {path: [float(Fields(scene)(path))] for path in paths}
    asked = study_of(scene, here, features, gradient=tuple(paths), zipped=True)
    forced = replace(asked, by_differences=True)
    return asked, chart_dataset(forced, compute_cells(forced, forced.changed_values(), 2)).isel(cell=0)


# -- which road -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "paths", "features", "exact"),
    [
        pytest.param({}, ["speed", "vehicle.mass"], FEATURES, True, id="a wheelset"),
        pytest.param({"track": SLAB}, ["speed", "vehicle.mass"], FEATURES, True, id="on rails"),
        pytest.param({"track": SLAB}, ["track.pad_stiffness"], FEATURES, False, id="a field of rails"),
        pytest.param({"track": SLAB}, ["speed"], ["largest_displacement"], False, id="a height on rails"),
        pytest.param({}, ["vehicle.mass", "vehicle.damper_play"], FEATURES, False, id="play that may begin"),
        pytest.param({"contact": wt.contact.Thornton(constant=1.7e11)}, ["speed"], FEATURES, False, id="a yield"),
        pytest.param({"vehicle.damper_play": 3e-5}, ["speed"], FEATURES, False, id="play"),
        pytest.param({"vehicle.bush_stiffness": 2e7}, ["speed"], FEATURES, False, id="a bush"),
        pytest.param({"vehicle.bush_stiffness": 2e7, "track": SLAB}, ["speed"], FEATURES, True, id="a bush on rails"),
    ],
)
def test_tangents_are_taken_wherever_all_that_is_asked_has_them(changes, paths, features, exact):
    scene = SCENE.replaced(changes)
    here = {path: [float(Fields(scene)(path))] for path in paths}
    assert study_of(scene, here, features, gradient=tuple(paths), zipped=True).by_differences is not exact


def test_what_is_asked_has_the_same_form_on_both_roads():
    asked, differenced = by_differences(SCENE, FEATURES, ["speed", "vehicle.mass"])
    exact = wt.gradient(SCENE, FEATURES, ["speed", "vehicle.mass"])
    assert not asked.by_differences
    for name in FEATURES:
        assert exact[f"{name}_gradient"].dims == differenced[f"{name}_gradient"].dims
        assert f"{name}_gradient_error" in differenced
        assert f"{name}_gradient_error" not in exact
    assert exact.gradient_status.attrs["flag_meanings"] == "exact grazing near_chaotic"
    assert differenced.gradient_status.attrs["flag_meanings"] == " ".join(TRUST_BY_DIFFERENCES)


@pytest.mark.slow
@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("changes", "paths"),
    [
        pytest.param({}, ["speed", "vehicle.mass", "contact.constant", "duration"], id="a wheelset"),
        pytest.param(
            {
                "track": wt.FloatingDeck(mass=9e3, stiffness=2e7, damping=4e4),
                "contact": wt.Hertz(constant=1.7e11, hysteresis=0.2),
            },
            ["speed", "track.mass", "contact.hysteresis"], id="on a deck, damped",
        ),
        pytest.param(
            {"vehicle": wt.vehicles.Bogie(**wt.vehicles.Bogie.example)}, ["speed", "vehicle.frame_mass"], id="a bogie",
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {
                "track": BALLASTED, "speed": 34.0, "duration": 0.03,
                "irregularity": wt.Corrugation(amplitude=1.8e-4, wavelength=0.06, start=0.1),
            },
            ["speed", "vehicle.mass", "vehicle.load", "contact.constant", "irregularity.0.amplitude"], id="on rails",
            marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_they_are_the_exact_ones_where_both_are(changes, paths):
    scene = SCENE.replaced(changes)
    _, found = by_differences(scene, FEATURES, paths)
    exact = wt.gradient(scene, FEATURES, paths, method="strict")
    assert status_of(found) == "by_differences"
    assert int(wt.simulate(scene).impacts.sizes["impact"]) >= 1
    for name in FEATURES:
        known = np.isfinite(exact[f"{name}_gradient"].values)
        own, true = (one[f"{name}_gradient"].values[known] for one in (found, exact))
        weak = 1e-3 * np.abs(exact[name].values / exact.value.values.reshape(-1, *[1] * exact[name].ndim))
        scale = np.maximum(np.abs(true), np.broadcast_to(np.nan_to_num(weak), known.shape)[known])
        assert (np.abs(own - true) <= 2e-9 * scale + 3.0 * found[f"{name}_gradient_error"].values[known]).all()
    assert float(found.amplification) == pytest.approx(float(exact.amplification), rel=0.6)


# -- closed forms -----------------------------------------------------------------------------------------------------


STIFF, RUB, SERIES, DROP = 8.7e7, 31e3, 4.3e7, 2.6e-3
FREE = wt.Scenario(
    vehicle=wt.Wheelset(mass=1270.0, load=7.1e4, friction=RUB, friction_stiffness=SERIES, stiffness=0.0, damping=0.0),
    contact=wt.Linear(stiffness=STIFF, bilateral=True), speed=5.0, duration=0.15,
    start={"displacement": DROP, "velocity": 0.0},
)  # fmt: skip


def turning_points(weight, stiff, rub, series, drop, count):
    """Return how far a mass on a spring with dry friction in series with a spring is away as it turns, and turns.

    From one turn to the next the friction's spring first goes from one limit to the other, and takes nothing; then it
    slides: ½·k·(a² - b²) = F·(a + b - 2·F/s). Before the first turn it begins without force, and keeps F²/(2·s).
    """
    a = drop + weight / stiff
    out = []
    for number in range(count):
        # ½k(a² - b²) = F(a + b) - c, a quadratic equation of b
        c = 2.0 * rub**2 / series if number else rub**2 / series - 0.5 * rub**2 / series
        b = (-rub + np.sqrt(rub**2 + stiff * (stiff * a**2 - 2.0 * rub * a + 2.0 * c))) / stiff
        out.append(b)
        a = b
    return out


@pytest.mark.slow
def test_the_decay_by_coulomb_friction_has_the_derivatives_of_the_closed_form():
    """Every second turn is a lowest one, with a maximum of the force W + k·a."""
    weight = 7.1e4 + 1270.0 * 9.81
    peaks = [
        wt.features.custom(lambda train, k=k: train.peak_force[k], f"peak {k}", "N") for k in range(3)
    ]  # fmt: skip
    paths = [
        "vehicle.friction",
        "vehicle.friction_stiffness",
        "contact.stiffness",
        "start.displacement",
        "vehicle.load",
    ]
    found = wt.gradient(FREE, peaks, paths)
    assert status_of(found) == "by_differences"
    numbers = {"friction": RUB, "friction_stiffness": SERIES, "stiffness": STIFF, "displacement": DROP, "load": weight}

    def forces(**changed):
        held = [changed.get(name, number) for name, number in numbers.items()]
        rub, series, stiff, drop, heavy = held
        return [heavy + stiff * a for a in turning_points(heavy, stiff, rub, series, drop, 5)[::2]]

    np.testing.assert_allclose([float(found[one.name]) for one in peaks], forces(), rtol=1e-10)
    for i, name in enumerate(numbers):
        true = np.imag(forces(**{name: numbers[name] * (1 + 1j * TINY)})) / TINY / numbers[name]
        own = np.array([float(found[f"{one.name}_gradient"][i]) for one in peaks])
        error = np.array([float(found[f"{one.name}_gradient_error"][i]) for one in peaks])
        np.testing.assert_allclose(own, true, rtol=3e-8)
        assert (np.abs(own - true) <= 10.0 * error + 1e-11 * np.abs(true)).all()


@pytest.mark.slow
def test_where_friction_just_does_not_slip_there_is_no_derivative_by_it():
    """Stuck, the mass swings about where both springs rest; the friction's spring goes through twice that way."""
    weight = 7.1e4 + 1270.0 * 9.81
    limit = 2.0 * SERIES * (STIFF * (DROP + weight / STIFF)) / (STIFF + SERIES)
    path = "vehicle.friction"
    at, above, below = (
        wt.gradient(FREE.replaced({path: limit * ratio}), ["largest_force"], [path]) for ratio in (1.0, 1.3, 0.7)
    )
    assert status_of(at) == "not_differentiable"
    assert np.isnan(at.largest_force_gradient).all()
    assert "largest_force has no derivative by vehicle.friction (NaN): even for a tiny change other" in at.notes
    assert status_of(above) == status_of(below) == "by_differences"
    assert above.largest_force_gradient.item() == 0.0
    assert below.largest_force_gradient.item() < 0.0


CONSTANT, FALL = 1.52e11, 1.3e-3
SPOT = wt.Scenario(
    vehicle=wt.Wheelset(mass=1410.0, load=6.6e4, stiffness=0.0, damping=0.0),
    contact=wt.contact.Thornton(constant=CONSTANT, yield_force=9e4), speed=0.0, duration=0.01,
    start={"displacement": FALL, "velocity": 0.0},
)  # fmt: skip


def crushing_force(load, constant, onset, fall, mass=1410.0):
    """Return the largest force of a fall on Thornton's contact, where it has taken what the weight has done."""
    weight, yields = load + mass * 9.81, (onset / constant) ** (2.0 / 3.0)

    def left(d):
        elastic = 0.4 * constant * yields**2.5
        beyond = onset * (d - yields) + 0.75 * onset / yields * (d - yields) ** 2
        return weight * (fall + d) - elastic - beyond

    deepest = brentq(left, yields, 1.0, xtol=1e-18, rtol=1e-15)
    return onset * (1.5 * deepest / yields - 0.5)


def test_a_fall_on_a_contact_that_yields_has_the_derivatives_of_its_balance_of_energy():
    numbers = {
        "vehicle.load": 6.6e4,
        "contact.constant": CONSTANT,
        "contact.yield_force": 9e4,
        "start.displacement": FALL,
    }
    found = wt.gradient(SPOT, ["largest_force"], list(numbers))
    assert status_of(found) == "by_differences"
    assert "yield" in wt.simulate(SPOT).events.kind.values
    held = list(numbers.values())
    assert float(found.largest_force) == pytest.approx(crushing_force(*held), rel=1e-9)
    for i, number in enumerate(held):
        step = 1e-3 * number
        near = {k: crushing_force(*(n + k * step * (j == i) for j, n in enumerate(held))) for k in range(-3, 4)}
        true = sum(w * (near[k] - near[-k]) for k, w in {1: 3 / 4, 2: -3 / 20, 3: 1 / 60}.items()) / step
        assert float(found.largest_force_gradient[i]) == pytest.approx(true, rel=3e-8)


# -- another program --------------------------------------------------------------------------------------------------


def times_by_another_program(kinks, changes):
    """Return the sums of all times at which contact is lost and made, and what happens, by exact pieces."""
    held = others.WHEEL | others.KINKS[kinks] | changes
    fields = {name: held[name] for name in others.KINKS[kinks]}
    waves = tuple((*wave, 0.0) for wave in others.WAVES)
    contact = pieces.Contact(0, others.CONTACT, others.static_of(held), waves)
    elements = others.elements_of(fields, np.ones(1), held["stiffness"], held["damping"])
    found = pieces.run(np.diag([held["mass"]]), [[0.0]], [[0.0]], [contact], elements, others.SPEED, 0.05)
    told = [(time, what) for time, family, _, what in found if family == "contact"]
    sums = [sum(time for time, what in told if what == kind) for kind in ("loss", "impact")]
    return np.array(sums), [(family, number, what) for _, family, number, what in found]


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("kinks", "names"),
    [
        pytest.param("friction", ["friction", "friction_stiffness", "mass"], marks=pytest.mark.slow),
        ("bumpstops", ["bumpstop_gap", "bumpstop_stiffness"]),
        ("blow-off", ["blow_off_force"]),
        pytest.param("all", ["friction", "bumpstop_gap", "blow_off_force"], marks=pytest.mark.slow),
    ],
)
def test_they_are_central_differences_of_another_program(kinks, names):
    scene = others.corrugated(wt.Wheelset(**others.WHEEL, **others.KINKS[kinks]))
    features = [
        wt.features.custom(lambda train: train.loss_time.sum(), "losses", "s"),
        wt.features.custom(lambda train: train.impact_time.sum(), "impacts", "s"),
    ]
    found = wt.gradient(scene, features, [f"vehicle.{name}" for name in names])
    assert status_of(found) == "by_differences"
    for i, name in enumerate(names):
        held = (others.WHEEL | others.KINKS[kinks])[name]
        near = {k: times_by_another_program(kinks, {name: held * (1 + k * 1e-3)}) for k in (-2, -1, 0, 1, 2)}
        assert all(near[k][1] == near[0][1] for k in near)
        assert len(near[0][1]) >= 19
        true = (near[-2][0] - 8 * near[-1][0] + 8 * near[1][0] - near[2][0]) / (12 * 1e-3 * held)
        own = np.array([found[f"{one.name}_gradient"][i].item() for one in features])
        error = np.array([found[f"{one.name}_gradient_error"][i].item() for one in features])
        np.testing.assert_allclose(own, true, rtol=1e-6)
        assert (np.abs(own - true) <= 4.0 * error + 2e-8 * np.abs(true)).all()


# -- differences of another kind --------------------------------------------------------------------------------------


VOIDED = wt.tracks.Ballasted.named("rolland_UIC60_example").model_copy(
    update={"bays": 40, "cutoff": 1500.0, "anomalies": (wt.tracks.HangingSleeper(seat=1, void="0.05 mm"),)}
)
CASES = {
    "a yield while rolling": ({"contact": wt.contact.Thornton(constant=1.7e11)}, ["vehicle.mass", "speed"]),
    "play": ({"vehicle.damper_play": 2e-5}, ["vehicle.damper_play", "vehicle.damping"]),
    "play and a bush": ({"vehicle.damper_play": 2e-5, "vehicle.bush_stiffness": 3e7}, ["vehicle.bush_stiffness"]),
    "a bumpstop and corners": (
        {
            "vehicle": wt.Wheelset(
                **WHEEL, bumpstop_gap=4e-5, bumpstop_stiffness=2e7, spring_corners=((-5e-5, 1e7),), blow_off_force=3e3
            )
        },
        ["vehicle.bumpstop_gap", "vehicle.blow_off_force", "vehicle.bumpstop_stiffness"],
    ),
    "a void": (
        {"track": VOIDED, "speed": 30.0, "duration": 0.04, "irregularity": ()},
        ["vehicle.load", "track.anomalies.0.void", "track.ballast_stiffness"],
    ),
    "a wagon that yields": (
        {"vehicle": wt.Wagon.erri_b176(), "contact": wt.contact.Thornton(constant_per_wheel=8.5e10, yield_force=1.2e5)},
        ["vehicle.axles.0.mass", "vehicle.bodies.0.mass"],
    ),
}  # fmt: skip


@pytest.mark.few(1)
@pytest.mark.parametrize("name", slow(CASES, "a void", "a wagon that yields", "a bumpstop and corners"))
def test_they_are_those_of_plain_strict_runs(name):
    changes, paths = CASES[name]
    scene = SCENE.replaced(changes)
    found = wt.gradient(scene, ["largest_force", "time_in_air"], paths)
    assert status_of(found) == "by_differences"
    for i, path in enumerate(paths):
        held = float(Fields(scene)(path))
        near = [
            [feature(wt.simulate(scene.replaced({path: held * (1 + k * 2e-4)}), "strict")).values
             for feature in (wt.features.largest_force(), wt.features.time_in_air())]
            for k in (-2, -1, 1, 2)
        ]  # fmt: skip
        for j, feature in enumerate(("largest_force", "time_in_air")):
            a, b, c, d = (np.asarray(one[j]) for one in near)
            true = (a - 8 * b + 8 * c - d) / (12 * 2e-4 * held)
            known, own = np.isfinite(true), found[f"{feature}_gradient"].values[i]
            np.testing.assert_array_equal(np.isfinite(own), known)
            weak = np.broadcast_to(1e-3 * np.abs(found[feature].values / held), known.shape)[known]
            assert (np.abs(own - true)[known] <= 2e-5 * np.maximum(np.abs(true[known]), weak)).all()


def test_notes_tell_what_happens_otherwise():
    play = SCENE.replaced({"vehicle.damper_play": 0.0})
    found = wt.gradient(play, ["largest_force"], ["vehicle.damper_play"])
    assert status_of(found) == "not_differentiable"
    assert "stops and corners of elements" in json.loads(found.notes)[-1]
