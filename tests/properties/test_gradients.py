"""Exact derivatives through all impacts, against central differences of the strict mode."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import wheeltapper as wt

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
WHEEL = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4)
BUMP = wt.Scenario(
    vehicle=WHEEL, contact=wt.Hertz(constant=1.405e11), rolling="point", speed=9, duration=0.12,
    irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.009),
)  # fmt: skip
LIGHT = WHEEL.model_copy(update={"damping": 2e4})
OF_THE_VEHICLE = ["vehicle.mass", "vehicle.load", "vehicle.stiffness", "vehicle.damping", "speed"]
OF_THE_BUMP = ["irregularity.0.height", "irregularity.0.length", "irregularity.0.start"]
CASES = {
    # name: scenario, parameters, how many impacts
    "bump": (BUMP, [*OF_THE_VEHICLE, "vehicle.gravity", "contact.constant", *OF_THE_BUMP], 10),
    "bump, circle": (BUMP.replaced({"rolling": "circle"}), [*OF_THE_BUMP, "vehicle.radius"], 5),
    "corrugation": (
        BUMP.replaced({
            "irregularity": wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=0.01),
            "vehicle.damping": 1e5, "duration": 0.3,
        }),
        [*OF_THE_VEHICLE, "irregularity.0.amplitude", "irregularity.0.wavelength", "irregularity.0.start"], 12,
    ),
    "corrugation, circle": (
        BUMP.replaced({
            "irregularity": wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=0.01),
            "vehicle.damping": 1e5, "duration": 0.3, "rolling": "circle",
        }),
        ["irregularity.0.amplitude", "irregularity.0.wavelength", "vehicle.radius", "vehicle.mass"], 12,
    ),
    "step up, circle": (
        BUMP.replaced({"irregularity": wt.Step(height=1e-4, position=0.1), "rolling": "circle"}),
        ["irregularity.0.height", "irregularity.0.position", "vehicle.radius", "speed"], 3,
    ),
    "step down, circle": (
        BUMP.replaced({
            "irregularity": wt.Step(height=-1e-4, position=0.1), "rolling": "circle", "vehicle.damping": 1e4,
        }),
        ["irregularity.0.height", "irregularity.0.position", "vehicle.radius", "speed"], 3,
    ),
    "ideal step, where the force jumps": (
        BUMP.replaced({"irregularity": wt.Step(height=1e-4, position=0.1, ideal=True), "vehicle.damping": 1e4}),
        ["irregularity.0.height", "irregularity.0.position", "vehicle.mass", "speed"], 4,
    ),
    "flat of a rolling wheel": (
        BUMP.replaced({"irregularity": wt.WheelFlat(depth=2e-4, position=0.1), "rolling": "circle", "duration": 0.45}),
        ["irregularity.0.depth", "irregularity.0.position", "vehicle.radius", "vehicle.mass"], 2,
    ),
    "two irregularities": (
        BUMP.replaced({"irregularity": [
            wt.CosineBump(height=2e-4, length=0.05, start=0.009), wt.Step(height=1e-4, position=0.07, ideal=True),
        ]}),
        [*OF_THE_BUMP, "irregularity.1.height", "irregularity.1.position"], 6,
    ),
    "deck and hysteresis": (
        BUMP.replaced({
            "vehicle": LIGHT, "track": wt.FloatingDeck(mass=3000, stiffness=1e8, damping=3e4),
            "contact": wt.Hertz(constant=1.405e11, hysteresis=0.1),
            "irregularity": wt.CosineBump(height=3e-4, length=0.05, start=0.02),
        }),
        ["vehicle.mass", "track.mass", "track.stiffness", "track.damping", "contact.hysteresis", "speed"], 5,
    ),
    "on and off a deck": (
        BUMP.replaced({
            "vehicle": LIGHT, "track": wt.FloatingDeck(mass=3000, stiffness=1e8, damping=3e4, start=0.05, length=0.3),
            "irregularity": wt.CosineBump(height=3e-4, length=0.05, start=0.02),
        }),
        ["track.mass", "track.start", "track.length", "speed", "irregularity.0.start"], 5,
    ),
    "restitution, computed constant": (
        BUMP.replaced({"contact": wt.Hertz(restitution=0.7, impact_speed=0.2)}),
        ["contact.restitution", "contact.impact_speed", "contact.youngs_modulus", "contact.poisson", "vehicle.mass"], 2,
    ),
    "constant that follows the curvature": (
        BUMP.replaced({"contact": wt.Hertz(), "vehicle.damping": 2e4}),
        ["irregularity.0.height", "irregularity.0.length", "vehicle.radius", "contact.rail_radius"], 4,
    ),
    "constant that follows the curvature, circle": (
        BUMP.replaced({"contact": wt.Hertz(), "rolling": "circle"}),
        ["irregularity.0.height", "irregularity.0.length", "vehicle.radius", "contact.rail_radius"], 4,
    ),
    "drop": (
        wt.Scenario(
            vehicle=LIGHT, contact=wt.Hertz(constant=1.405e11), start={"displacement": 1e-3, "velocity": -0.1},
            speed=0, duration=0.1,
        ),
        ["start.displacement", "start.velocity", "vehicle.gravity", "vehicle.damping", "vehicle.mass"], 3,
    ),
    "linear": (BUMP.replaced({"contact": wt.Linear(stiffness=1.5e9)}), ["contact.stiffness", "vehicle.mass"], 4),
    "out of round": (
        BUMP.replaced({
            "irregularity": wt.OutOfRound(orders=(8, 20), amplitudes=(2e-4, 5e-5), phases=(0.3, 0.1)), "speed": 20,
            "rolling": "circle",
        }),
        ["irregularity.0.amplitudes.0", "irregularity.0.phases.1", "vehicle.mass"], 2,
    ),
}  # fmt: skip


def everything(impacts):
    """Return features that are each time and each force maximum."""
    custom = wt.features.custom
    times = [
        custom(lambda train, k=k: train.impact_time[k], f"time{k}", "s", impacts=impacts, until="loss")
        for k in range(impacts)
    ]
    return times + [
        custom(lambda train, k=k: train.peak_force[k], f"force{k}", "N", impacts=impacts, until="loss")
        for k in range(impacts)
    ]


def differences(scene, path, value, step, impacts):
    rows = []
    for k in (-2, -1, 1, 2):
        record = wt.simulate(scene.replaced({path: value + k * step}), "strict")
        rows.append(np.concatenate([record.impacts.time.values[:impacts], record.peaks.normal_force.values[:impacts]]))
    return (rows[0] - 8 * rows[1] + 8 * rows[2] - rows[3]) / (12 * step)


@pytest.mark.few(6)
@pytest.mark.parametrize("name", [name for name in CASES if name != "linear"])
def test_gradients_of_impulses_and_of_the_highest_position(name):
    scene, parameters, impacts = CASES[name]
    features = [wt.features.impulse(k + 1).renamed(f"impulse{k + 1}") for k in range(min(impacts, 3))]
    features.append(wt.features.largest_displacement())
    found = wt.gradient(scene, features, parameters)
    for i, path in enumerate(parameters):
        value = float(found.value[i])
        step = 3e-4 * abs(value)
        rows = []
        for k in (-2, -1, 1, 2):
            chart = wt.sweep(
                scene.replaced({path: value + k * step}),
                {"vehicle.mass": [mass_of(scene, path, value + k * step)]},
                features,
                method="strict",
            )
            rows.append(np.array([float(chart[feature.name][0]) for feature in features]))
        expected = (rows[0] - 8 * rows[1] + 8 * rows[2] - rows[3]) / (12 * step)
        slopes = np.array([float(found[f"{feature.name}_gradient"][i]) for feature in features])
        sizes = np.array([float(found[feature.name]) for feature in features])
        fitted = scene.rolling == "circle" or getattr(scene.contact, "follows_curvature", False)
        noise = (1e-7 if fitted else 1e-10) * np.abs(sizes) / abs(value)
        known = np.isfinite(expected)
        assert known.sum() >= 2
        np.testing.assert_array_equal(known, np.isfinite(slopes))
        assert np.all(np.abs(slopes - expected)[known] < (1e-6 * np.abs(expected) + 10 * noise)[known]), path


def mass_of(scene, path, value):
    return value if path == "vehicle.mass" else scene.vehicle.mass


@pytest.mark.few(7)
@pytest.mark.parametrize("name", CASES)
def test_gradients_agree_with_differences_of_the_strict_mode(name):
    scene, parameters, impacts = CASES[name]
    found = wt.gradient(scene, everything(impacts), parameters)
    assert int(found.gradient_status) == 0
    for i, path in enumerate(parameters):
        value = float(found.value[i])
        expected = differences(scene, path, value, 3e-4 * abs(value), impacts)
        slopes = np.array(
            [float(found[f"{kind}{k}_gradient"][i]) for kind in ("time", "force") for k in range(impacts)]
        )
        sizes = np.array([float(found[f"{kind}{k}"]) for kind in ("time", "force") for k in range(impacts)])
        # Differences between separate fits carry what these leave, over the step.
        fitted = scene.rolling == "circle" or getattr(scene.contact, "follows_curvature", False)
        noise = (1e-7 if fitted else 1e-10) * sizes / abs(value)
        assert np.all(np.abs(slopes - expected) < 1e-6 * np.abs(expected) + 10 * noise), path


ROUGH = wt.irregularities.Spectrum(curve="ISO 3095:2013", wavelengths=(0.02, 0.4), added=15.0, seed=3)
FAR = [
    wt.CosineBump(height=h, length=length, start=start)
    for h, length, start in ((4e-4, 0.05, 90.0), (2e-4, 0.08, 89.99))
]


@pytest.mark.parametrize(
    ("items", "path", "duration"),
    [
        (FAR, "irregularity.0.start", 3.05),
        ([ROUGH, FAR[0].moved(-89.7)], "irregularity.0.position", 0.05),
        ([ROUGH, ROUGH.model_copy(update={"seed": 4, "position": 100.0})], "irregularity.1.position", 0.05),
    ],
)
def test_places_have_derivatives_wherever_they_are(items, path, duration):
    """A spectrum begins whole periods before the run; how many changes at the place zero."""
    scene = BUMP.replaced({"irregularity": items, "speed": 30.0, "duration": duration})
    asked = [wt.features.first_loss(), wt.features.largest_force(), wt.features.time_in_air()]
    found = wt.gradient(scene, asked, [path])
    index, field = int(path.split(".")[1]), path.split(".")[2]
    step, rows = 1e-5, []
    for k in (-2, -1, 1, 2):
        record = wt.simulate(scene.replaced({path: getattr(items[index], field) + k * step}), "strict")
        rows.append(np.array([float(each(record)) for each in asked]))
    expected = (rows[0] - 8 * rows[1] + 8 * rows[2] - rows[3]) / (12 * step)
    slopes = [float(found[f"{each.name}_gradient"][0]) for each in asked]
    np.testing.assert_allclose(slopes, expected, rtol=1e-5)


WAVES = wt.Corrugation(amplitude=2e-6, wavelength=0.05, start=0.01)
ROUND = wt.OutOfRound(orders=(20, 31), amplitudes=(2e-5, 1e-5))


@pytest.mark.parametrize(
    ("first", "path", "step"), [(WAVES, "irregularity.0.wavelength", 1e-8), (ROUND, "vehicle.radius", 1e-7)]
)
def test_waves_have_derivatives_after_a_thousand_of_them(first, path, step):
    """A bump behind 60 m of waves meets them in a phase that depends on their number."""
    bump = wt.CosineBump(height=4e-4, length=0.06, start=60.0)
    scene = BUMP.replaced({"irregularity": [first, bump], "speed": 30.0, "duration": 2.02})
    asked = [wt.features.last_loss(), wt.features.largest_force()]
    found = wt.gradient(scene, asked, [path])
    held, rows = float(found.value[0]), []
    for k in (-2, -1, 1, 2):
        record = wt.simulate(scene.replaced({path: held + k * step}), "strict")
        rows.append(np.array([float(each(record)) for each in asked]))
    expected = (rows[0] - 8 * rows[1] + 8 * rows[2] - rows[3]) / (12 * step)
    np.testing.assert_allclose([float(found[f"{each.name}_gradient"][0]) for each in asked], expected, rtol=1e-5)


def test_a_wave_that_would_become_two_has_no_derivative():
    scene = BUMP.replaced({"irregularity": [WAVES, wt.CosineBump(height=4e-4, length=0.05, start=0.1)]})
    with pytest.raises(wt.InputError, match=r"^irregularity\.0\.wavelength: found the length of one of two waves"):
        wt.gradient(scene, "largest_force", ["irregularity.0.wavelength"])


@pytest.mark.parametrize("field", ["period", "wavelengths.0"])
def test_fields_that_choose_the_waves_of_a_spectrum_have_no_derivative(field):
    scene = BUMP.replaced({"irregularity": ROUGH.model_copy(update={"period": 150.0}), "duration": 0.05})
    with pytest.raises(
        wt.InputError, match=rf"^irregularity\.0\.{field}: found a field that chooses the waves of a Spec"
    ):
        wt.gradient(scene, "largest_force", [f"irregularity.0.{field}"])


def test_default_and_strict_gradients_are_the_same():
    features = everything(10)
    default, strict = (
        wt.gradient(BUMP, features, OF_THE_VEHICLE + OF_THE_BUMP, method=m) for m in ("default", "strict")
    )
    for feature in features:
        pair = [record[f"{feature.name}_gradient"].values for record in (default, strict)]
        np.testing.assert_allclose(*pair, rtol=1e-7, atol=1e-9 * np.abs(pair[1]).max())


def test_a_map_holds_the_gradients_of_its_cells():
    over = {"vehicle.damping": [2e4, 5e4, 1e5], "vehicle.mass": [1200.0, 1500.0]}
    features = [wt.features.impact_interval(), wt.features.force_ratio()]
    chart = wt.sweep(BUMP, over, features, gradient=True)
    plain = wt.sweep(BUMP, over, features)
    for name in ("impact_interval", "force_ratio"):
        np.testing.assert_allclose(chart[name], plain[name], rtol=1e-14)
    for i, damping in enumerate(over["vehicle.damping"]):
        for j, mass in enumerate(over["vehicle.mass"]):
            scene = BUMP.replaced({"vehicle.damping": damping, "vehicle.mass": mass})
            one = wt.gradient(scene, features, list(over))
            cell = chart.isel({"vehicle.damping": i, "vehicle.mass": j})
            for name in ("impact_interval_gradient", "force_ratio_elasticity", "force_ratio_angle", "condition"):
                np.testing.assert_allclose(cell[name], one[name], rtol=1e-12)
    assert (chart.condition >= 1).all()


def test_a_gradient_by_fields_that_do_not_vary():
    chart = wt.sweep(
        BUMP, {"speed": [8.0, 9.0]}, [wt.features.first_loss()], gradient=["irregularity.0.height", "speed"]
    )
    assert chart.parameter.values.tolist() == ["irregularity.0.height", "speed"]
    alone = wt.gradient(BUMP, [wt.features.first_loss()], ["irregularity.0.height"])
    assert float(chart.first_loss_gradient[0, 1]) == pytest.approx(float(alone.first_loss_gradient[0]), rel=1e-12)


def test_moving_everything_along_the_rail_moves_only_the_times():
    found = wt.gradient(BUMP, everything(5), ["irregularity.0.start"])
    for k in range(5):
        assert float(found[f"time{k}_gradient"][0]) == pytest.approx(1 / 9, rel=1e-9)
        assert abs(float(found[f"force{k}_gradient"][0])) < 1e-8 * float(found[f"force{k}"]) / 0.05


def test_a_longer_run_ends_later_and_changes_nothing_else():
    air = wt.features.time_in_air()
    flying = BUMP.replaced({"duration": 0.0045})  # ends in flight
    assert float(wt.gradient(flying, [air], ["duration"]).time_in_air_gradient[0]) == pytest.approx(1.0, rel=1e-12)
    landed = wt.gradient(BUMP, [air, wt.features.largest_force()], ["duration"])
    assert float(landed.time_in_air_gradient[0]) == 0.0
    assert float(landed.largest_force_gradient[0]) == 0.0


@pytest.mark.parametrize(
    ("length", "position"),
    [(0.04377536973301918, 0.016833079862064934), (0.07632510970879307, 0.06536523648343796),
     (0.07827404478805525, 0.02113657721308422), (0.0675421101126794, 0.06200302792328245)],
)  # fmt: skip
def test_a_flat_whose_chord_is_touched_in_a_dot(length, position):
    """Rounding may leave the chord a run of the last digit's length; it is none."""
    wheel = WHEEL.model_copy(update={"radius": 0.46})
    flat = wt.WheelFlat(length=length, position=position)
    one = wt.Scenario(vehicle=wheel, speed=9.0, duration=0.4, irregularity=flat)
    assert wt.simulate(one).impacts.sizes["impact"] > 5
    force = wt.features.largest_force()
    found = wt.gradient(one.replaced({"contact": BUMP.contact}), [force], ["irregularity.0.length"])
    assert np.isfinite(found.largest_force.values).all()


def test_a_cell_that_grazes_is_flagged_and_not_smoothed():
    """A dip of 0.064 07 mm is where contact begins to be lost (docs/theory/accuracy.rst, section 10.3)."""
    dip = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=85_285), contact=wt.Hertz(constant=9e10), rolling="point", speed=5,
        irregularity=wt.CosineBump(height=-6.4070e-5, length=0.02, start=0.05), duration=0.2,
    )  # fmt: skip
    depths = [-6.40700e-5, -8e-5]
    chart = wt.sweep(dip, {"irregularity.0.height": depths}, [wt.features.first_loss()], gradient=True)
    losses = [
        int((wt.simulate(dip.replaced({"irregularity.0.height": d})).events.kind == "loss").sum()) for d in depths
    ]
    assert losses[1] > 0
    for i, many in enumerate(losses):
        assert np.isnan(chart.first_loss[i]) == (many == 0)
    near = -6.40690e-5 * (1.0 + 2e-8) ** np.arange(5000)
    lost = ~np.isnan(wt.sweep(dip, {"irregularity.0.height": near}, [wt.features.first_loss()]).first_loss.values)
    assert not lost[0]
    assert lost[-1]
    just = float(near[lost][0])
    grazing = wt.gradient(dip.replaced({"irregularity.0.height": just}), [wt.features.first_loss()], ["vehicle.mass"])
    assert int(grazing.gradient_status) == 1


def test_a_chaotic_cell_is_marked():
    wild = BUMP.replaced({
        "irregularity": wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=0.0), "vehicle.damping": 2e4,
        "speed": 14.0, "duration": 1.5,
    })  # fmt: skip
    found = wt.gradient(wild, [wt.features.last_loss()], ["vehicle.mass"])
    assert float(found.amplification) > 1e4
    assert int(found.gradient_status) == 2
    assert int(wt.gradient(wild, [wt.features.last_loss()], ["vehicle.mass"], chaos_limit=1e300).gradient_status) == 0


def test_what_has_no_gradient_is_refused_by_name():
    interval = wt.features.impact_interval()
    for path in ("vehicle.wheels", "rolling", "irregularity.0.ideal", "contact.hysteresis"):
        with pytest.raises(wt.InputError, match=path):
            wt.gradient(BUMP.replaced({"irregularity": wt.Step(height=1e-4, position=0.01)}), [interval], [path])
    counted = wt.gradient(BUMP, [interval, wt.features.number_of_impacts()], ["speed"])
    assert float(counted.number_of_impacts) == 11.0
    assert "number_of_impacts_gradient" not in counted


FREE = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307), contact=wt.Hertz(constant=1.405e11), speed=0, duration=0.02
)
DEEPEST = (2.5 * (91_307 + 1500 * 9.81) / 1.405e11) ** (2 / 3)  # a wheel let go there just touches at its highest point


@pytest.mark.parametrize("method", ["default", "strict"])
def test_a_start_with_zero_indentation_and_rate_grazes_and_has_no_derivative(method):
    scene = FREE.replaced({"start": {"displacement": 0.0, "velocity": 0.0}})
    feature = wt.features.largest_force()
    found = wt.gradient(scene, [feature], ["start.displacement", "vehicle.mass"], method=method)
    assert int(found.gradient_status) == found.gradient_status.attrs["flag_meanings"].split().index("grazing")
    assert np.isnan(found.largest_force_gradient.values).all()
    assert found.largest_force.item() == pytest.approx(2.5 * (91_307 + 1500 * 9.81), rel=1e-6)


@pytest.mark.parametrize(("short", "grazes"), [(1e-8, True), (1e-4, False)])
@pytest.mark.parametrize("damping", [0.0, 1e-12])  # the second leaves the straight-line code
def test_a_grazing_that_is_missed_by_a_hair_is_flagged(short, grazes, damping):
    scene = FREE.replaced({
        "start": {"displacement": -DEEPEST * (1 - short), "velocity": 0.0}, "contact.hysteresis": damping or None,
    })  # fmt: skip
    found = wt.gradient(scene, [wt.features.largest_force()], ["start.displacement"])
    assert wt.simulate(scene).events.sizes["event"] == 0
    assert int(found.gradient_status) == int(grazes)


def test_a_derivative_that_nobody_knows_leaves_the_value_alone():
    scene = BUMP.replaced({"irregularity": wt.Step(height=-3e-4, position=0.02, ideal=True)})
    rate = wt.features.custom(lambda train: train.loss_time[0] + train.closing_speed[0], "sum", impacts=1, until="loss")
    jump = BUMP.replaced({
        "irregularity": wt.Step(height=2e-3, position=0.01, ideal=True),
        "start": {"displacement": 1e-3, "velocity": 0.6},
    })  # fmt: skip
    speed = wt.features.custom(lambda train: train.closing_speed[0], "closing", "m/s", impacts=1, until="impact")
    assert np.isfinite(float(wt.gradient(scene, [rate], ["vehicle.mass"])["sum"]))
    found = wt.gradient(jump, [speed], ["vehicle.mass"])
    assert found.closing.item() == pytest.approx(wt.simulate(jump).impacts.closing_speed.values[0], rel=1e-9)
    assert np.isnan(found.closing_gradient.values).all()


RISING = {"speed": 9.0, "duration": 1.5e-3, "rolling": "point"}  # the force grows until the end


@pytest.mark.parametrize(
    "track", [wt.StiffTrack(), wt.tracks.Ballasted.named("rolland_UIC60_example")], ids=["stiff", "rails"]
)
def test_a_force_without_a_maximum_is_that_of_the_end_with_gradients_too(track):
    vehicle = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4, radius=0.46)
    bump = wt.CosineBump(height=2e-4, length=0.2, start=0.0)
    scene = wt.Scenario(vehicle=vehicle, track=track, contact=wt.Hertz(constant=1.405e11), irregularity=bump, **RISING)
    asked = [wt.features.largest_force(), wt.features.largest_force(over_static=True)]
    static = wt.simulate(scene).static_force
    found = wt.gradient(scene, asked, ["speed", "vehicle.mass"])
    if track == wt.StiffTrack():
        weight, sunk = 91_307 + 1500 * 9.81, (static / 1.405e11) ** (2 / 3)

        def motion(time, state):
            path = 1e-4 * (1.0 - np.cos(2.0 * np.pi * 9.0 * time / 0.2))
            force = 1.405e11 * max(path - state[0], 0.0) ** 1.5
            return state[1], (force - weight - 2.44e6 * state[0] - 5e4 * state[1]) / 1500

        end = solve_ivp(motion, (0.0, 1.5e-3), (-sunk, 0.0), method="DOP853", rtol=1e-12, atol=1e-16).y[0, -1]
        expected = 1.405e11 * (1e-4 * (1.0 - np.cos(2.0 * np.pi * 9.0 * 1.5e-3 / 0.2)) - end) ** 1.5
        assert float(found.largest_force) == pytest.approx(expected, rel=1e-9)
    plain = wt.sweep(scene, {"speed": [9.0]}, asked)
    for name in ("largest_force", "largest_force_over_static"):
        assert float(found[name]) == pytest.approx(float(plain[name][0]), rel=1e-12)
        assert np.isnan(found[f"{name}_gradient"]).all()
    assert "the largest one is that at the run's start or end, without a derivative" in found.attrs["notes"]
    assert float(found.largest_force) == pytest.approx(static * float(found.largest_force_over_static), rel=1e-12)
