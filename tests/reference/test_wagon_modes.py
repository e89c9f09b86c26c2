"""Modes, critical speed and reduced model of the coach against other programs (docs/theory/wagon.rst, section 7.6)."""

import numpy as np
import pytest
from scipy.optimize import brentq

import wheeltapper as wt
from wheeltapper.lower.laws.ellipse import semi_axes
from wheeltapper.lower.laws.kalker import coefficients
from wheeltapper.record.simulate import ModelWarning

GIVEN = wt.Hertz(constant_per_wheel=7.025e10)


def scene(vehicle=None, smoothing=15e-6, **changes):
    fields = {
        "vehicle": vehicle or wt.Wagon.erri_b176(), "contact": GIVEN, "creep": wt.creep.Polach(friction=0.35),
        "profiles": wt.profiles.WheelRail(smoothing=smoothing), "speed": 20.0, "duration": 1.0,
    } | changes  # fmt: skip
    return wt.Scenario(**fields)


def test_the_modes_of_the_coach_on_fixed_wheelsets_have_their_names():
    # the reference lets the car body move lengthwise
    free = scene(wt.Wagon.erri_b176().without_dampers()).replaced({"vehicle.bodies.car body.held": ()})
    found = wt.modes(free, fixed_wheelsets=True)
    frequencies = dict(zip(found.name.values, found.frequency.values, strict=True))
    expected = {
        "car body lower sway": 0.596, "car body yaw": 0.855, "car body bounce": 1.074, "car body upper sway": 1.278,
        "car body pitch": 1.281, "bogie bounce, in phase": 7.47, "bogie roll, in phase": 9.64,
        "bogie pitch, in phase": 11.62, "bogie lateral, in phase": 12.81, "bogie yaw, in phase": 35.35,
    }  # fmt: skip
    for name, frequency in expected.items():
        assert frequencies[name] == pytest.approx(frequency, rel=5e-3), name
    np.testing.assert_allclose(found.damping_ratio, 0.0, atol=1e-6)
    bounce = found["shape"].isel(mode=list(found.name.values).index("car body bounce"))
    assert complex(bounce.sel(body="car body", motion="z")) == pytest.approx(1.0)
    assert abs(complex(bounce.sel(body="car body", motion="y"))) < 1e-6


def test_the_contact_modes_without_creep():
    free = wt.modes(scene(wt.Wagon.erri_b176(1500.0).without_dampers(), creep=None))
    assert free.frequency.values[-1] == pytest.approx(180.12, rel=1e-3)
    assert free.frequency.values[-5] == pytest.approx(153.43, rel=1e-3)
    assert free.name.values[-1].startswith("wheelset bounce")
    assert free.name.values[-5].startswith("wheelset roll")


@pytest.mark.parametrize(("smoothing", "speed"), [(5e-6, 54.0), (15e-6, 68.0), (30e-6, 80.0)])
@pytest.mark.slow
def test_the_linear_critical_speed(smoothing, speed):
    found = wt.stability.critical_speed(scene(smoothing=smoothing))
    assert found == pytest.approx(speed, rel=0.05)
    for share, grows in ((0.99, False), (1.01, True)):
        modes = wt.modes(scene(smoothing=smoothing, speed=share * found))
        assert bool((modes.damping_ratio < -1e-9).any()) == grows


def without_damping_along(element, axis):
    """Return the coach whose dampers of a kind do nothing along one axis."""
    wagon = wt.Wagon.erri_b176()
    for held in wagon.elements:
        if held.name.startswith(element):
            damping = tuple(0.0 if i == axis else value for i, value in enumerate(held.damping))
            wagon = wagon.with_element(held.model_copy(update={"damping": damping}))
    return wagon


def test_an_undamped_mode_is_named_and_is_not_taken_for_hunting():
    with pytest.warns(ModelWarning, match="undamped: 'wheelset longitudinal.* at 29.6 Hz and 1 more"):
        found = wt.stability.critical_speed(scene(without_damping_along("primary damper", 0)))
    assert found == pytest.approx(67.84, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("element", "axis"), [("primary damper", 2), ("secondary damper", 2)])
def test_a_mode_without_a_damper_of_its_own_does_not_hunt_either(element, axis):
    changed = scene(without_damping_along(element, axis))
    found = wt.stability.critical_speed(changed)
    assert found == pytest.approx(68.0, rel=0.01)
    for share, grows in ((0.999, False), (1.001, True)):
        ratios = wt.modes(changed.replaced({"speed": share * found})).damping_ratio
        assert bool((ratios < -1e-7).any()) == grows


HALF_AXLE, CONICITY, RADIUS, YAW, SIDEWAYS = 0.75, 0.05, 0.46, 2 * 2e5, 2 * 1e5


def held_wheelset(*more):
    """Return a wheelset on cones, held by springs alone; and bodies and elements beside it."""
    axle = wt.vehicles.Axle(mass=1500.0, inertia=(1120.0, 112.0, 1120.0), position=0.0, load=91_307.0)
    springs = [
        wt.vehicles.Spring(
            name=f"spring {y}", between=("wheelset 1", "ground"), at=(0.0, y, RADIUS),
            stiffness=(YAW / 2, SIDEWAYS / 2, 0.0),
        )
        for y in (1.0, -1.0)
    ]  # fmt: skip
    bodies = tuple(item for item in more if isinstance(item, wt.vehicles.Body))
    elements = (*springs, *(item for item in more if item not in bodies))
    return scene(
        wt.Wagon(bodies=bodies, axles=(axle,), elements=elements), creep=wt.creep.KalkerLinear(),
        profiles=wt.profiles.Cones(conicity=CONICITY, arm=HALF_AXLE),
    )  # fmt: skip


def textbook_critical_speed():
    """Return the critical speed of a wheelset's two motions, sideways and yaw (A. H. Wickens)."""
    force = 0.5 * (91_307.0 + 1500.0 * 9.81)
    a, b = (float(axis[0]) * force ** (1 / 3) for axis in semi_axes(
        np.array([0.5 / RADIUS]), np.array([0.5 / 0.3]), 210e9, 0.3
    ))  # fmt: skip
    c, shear = coefficients(a, b, 0.3), 210e9 / 2.6
    f11, f22, f23, f33 = a * b * c.c11, a * b * c.c22, (a * b) ** 1.5 * c.c23, (a * b) ** 2 * c.c33
    f11, f22, f23, f33 = (2 * shear * f for f in (f11, f22, f23, f33))
    inverse = np.diag([1 / 1500.0, 1 / 1120.0])
    stiffness = np.array([[SIDEWAYS, -f22], [f11 * HALF_AXLE * CONICITY / RADIUS, YAW + f23]])
    damping = np.array([[f22, f23], [-f23, f11 * HALF_AXLE**2 + f33]])

    def growth(speed):
        motion = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ stiffness, -inverse @ damping / speed]])
        return np.linalg.eigvals(motion).real.max()

    return brentq(growth, 5.0, 100.0)


def test_a_wheelset_hunts_from_the_textbooks_speed_on_and_an_undamped_neighbour_changes_nothing():
    with pytest.warns(ModelWarning, match="undamped"):  # along the track nothing but springs holds it
        alone = wt.stability.critical_speed(held_wheelset())
    assert alone == pytest.approx(textbook_critical_speed(), rel=0.01)
    bob = wt.vehicles.Body(
        name="bob", mass=1e3, inertia=(1e3, 1e3, 1e3), position=(0.0, 0.0, 2.0),
        held=("y", "z", "roll", "pitch", "yaw"),
    )  # fmt: skip
    spring = wt.vehicles.Spring(name="k", between=("bob", "ground"), at=(0.0, 0.0, 2.0), stiffness=(1e5, 0.0, 0.0))
    with pytest.warns(ModelWarning, match="undamped"):
        beside = wt.stability.critical_speed(held_wheelset(bob, spring))
    assert beside == pytest.approx(alone, rel=1e-6)


def test_what_grows_already_at_the_lowest_speed_is_refused_and_no_growth_is_infinity():
    with pytest.raises(
        wt.InputError, match=r"grows already at 90 m/s, 'bogie lateral, in phase' at 7.33 Hz; allowed: .*lowest"
    ):
        wt.stability.critical_speed(scene(), lowest=90.0)
    assert wt.stability.critical_speed(scene(), lowest=20.0, highest=40.0) == np.inf
    for low, high in ((50.0, 20.0), (0.0, 20.0)):
        with pytest.raises(wt.InputError, match="lowest, highest"):
            wt.stability.critical_speed(scene(), lowest=low, highest=high)


def test_a_loosely_held_wheelset_sways_as_its_conicity_says():
    from wheeltapper.lower.laws.patches import geometry_of

    geometry = geometry_of(wt.profiles.WheelRail(), 0.46, 0.3)
    step = 1e-4
    slope = (geometry.table_at("radius", step) - geometry.table_at("radius", -step)) / (2 * step)
    arm = geometry.table_at("place", 0.0)
    # the wheelset also rolls: u = y + R·roll, roll = 2·h'·y/(2·arm)
    assert slope == pytest.approx(0.239, rel=0.02)
    klingel = 2 * np.pi * np.sqrt(0.46 * arm / slope)
    assert klingel == pytest.approx(7.550, rel=5e-3)
    axle = wt.vehicles.Axle(mass=1500.0, inertia=(1120.0, 112.0, 1120.0), position=0.0, load=91_307.0)
    loose = {"between": ("wheelset 1", "ground"), "at": (0.0, 0.0, 0.46)}
    spring = wt.vehicles.Spring(name="k", stiffness=(1e3, 0.0, 0.0), **loose)
    speed = 1.0
    modes = wt.modes(scene(wt.Wagon(bodies=(), axles=(axle,), elements=(spring,)), speed=speed))
    swaying = modes.isel(mode=(modes.damping_ratio.values < 0.9) & (modes.frequency.values < 1.0))
    frequency = swaying.frequency.values[np.argmin(np.abs(swaying.frequency.values - speed / 7.55))]
    assert speed / frequency == pytest.approx(7.572, rel=5e-3)


def test_modes_need_a_wagon_and_hunting_needs_creep():
    core = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=9e4, stiffness=0, damping=0, radius=0.46), speed=5, duration=1
    )
    with pytest.raises(wt.InputError, match="a Wagon"):
        wt.modes(core)
    with pytest.raises(wt.InputError, match="creep law"):
        wt.stability.critical_speed(scene(creep=None))


@pytest.mark.parametrize("wheelset", [1, 4])
def test_the_reduced_model_is_a_good_one(wheelset):
    place = {1: 0.05, 4: -21.51}[wheelset]
    step = wt.Step(height=1e-4, position=place)
    coach = scene(wt.Wagon.erri_b176(1500.0), irregularity=step, speed=5.0, duration=0.06)
    core = wt.reduced(coach, wheelset=wheelset)
    assert core.vehicle.mass == 1500.0
    assert core.vehicle.damping == pytest.approx(8e3)
    assert core.irregularity[0].position == pytest.approx(0.05)
    from wheeltapper.ask.reduced import compare_responses

    found = compare_responses(wt.simulate(coach), wt.simulate(core), wheelset)
    assert found.sizes["peak"] >= 7
    np.testing.assert_allclose(found.peak_ratio, 1.0, atol=5e-3)
    np.testing.assert_allclose(found.interval_ratio.values[:-1], 1.0, atol=5e-3)
    assert np.abs(found.event_delay).max() < 1e-4


def test_what_cannot_be_reduced_is_refused():
    with pytest.raises(wt.InputError, match="1 to 4"):
        wt.reduced(scene(), wheelset=5)
    step = wt.Step(height=1e-4, position=0.05)
    with pytest.raises(wt.InputError, match="the same on both rails"):
        wt.reduced(scene(irregularity={"left": step}), wheelset=1)


@pytest.mark.slow
def test_the_critical_speed_says_how_it_takes_friction_and_what_it_is_without():
    """Elastic and rigid friction that sticks are a spring and a link; without them the coach is the plain one."""
    place = {"between": ("car body", "bogie 1"), "at": (-1.28, 1.0, 0.8), "along": "x", "force": 500.0}
    more = place | {"between": ("car body", "bogie 2"), "at": (-20.28, 1.0, 0.8), "series_stiffness": 1e7}
    held = {name: place[name] for name in ("between", "at")}
    rubbing, tied = wt.Wagon.erri_b176(), wt.Wagon.erri_b176()
    for element in (wt.vehicles.Friction(name="one", **place), wt.vehicles.Friction(name="other", **more)):
        rubbing = rubbing.with_element(element)
    tied = tied.with_element(wt.vehicles.Link(name="one", along=("x",), **held)).with_element(
        wt.vehicles.Spring(name="other", stiffness=(1e7, 0.0, 0.0), **held | {n: more[n] for n in held})
    )
    with pytest.warns(ModelWarning) as said:
        found = wt.stability.critical_speed(scene(rubbing), lowest=40.0)
    assert isinstance(found, float)
    assert found == pytest.approx(wt.stability.critical_speed(scene(tied), lowest=40.0), rel=2e-4)
    (text,) = [str(one.message) for one in said]
    assert "dry friction sticks ('one' as rigid, 'other' as its spring)" in text
    without = wt.stability.critical_speed(scene(), lowest=40.0)
    assert f"without this friction it is {without:.4g} m/s" in text
    assert abs(without / found - 1.0) > 0.05
