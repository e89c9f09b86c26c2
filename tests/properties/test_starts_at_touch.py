"""A start within rounding of the rail is one on the rail, and one a hair above it falls and strikes the rail."""

from math import sqrt

import numpy as np
import pytest
from scipy.optimize import brentq

import wheeltapper as wt
from wheeltapper.lower.build import lower
from wheeltapper.march.common import program as contract
from wheeltapper.march.steps import layout
from wheeltapper.march.steps.written import scratch_for
from wheeltapper.march.wheel import single

from ..marks import slow

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
MASS, CONSTANT, GRAVITY = 1500.0, 1.405e11, 9.81
HAIRS = (5e-324, 1e-300, 1e-30, 1e-20, 1e-18, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9)
VELOCITIES = (0.0, -0.1, 0.1, 1e-3, -1e-9, 1e-9, -1e-12, 1e-12, -1e-300, 1e-300)
DROP = wt.Scenario(
    vehicle=wt.Wheelset(mass=MASS), contact=wt.Hertz(constant=CONSTANT), speed=0.0, duration=0.02,
    start={"displacement": 0.0, "velocity": 0.0},
)  # fmt: skip


def started(scene, displacement, velocity):
    return scene.replaced({"start": {"displacement": displacement, "velocity": velocity}})


# -- closed forms ------------------------------------------------------------------------------------------------------


def fall(height, velocity):
    """Return time and closing speed of a wheel that falls freely on a rail below it."""
    closing = sqrt(velocity**2 + 2.0 * GRAVITY * height)
    return 2.0 * height / (closing - velocity) if velocity <= 0.0 else (closing + velocity) / GRAVITY, closing


def largest_force(height, velocity):
    """Return the largest force of a first impact, or of the indentation of the start, by the energy (2/5)·C·δ^2.5."""
    energy = 0.5 * MASS * velocity**2 + MASS * GRAVITY * height + 0.4 * CONSTANT * max(-height, 0.0) ** 2.5
    static = (MASS * GRAVITY / CONSTANT) ** (2 / 3)
    deepest = brentq(lambda d: 0.4 * CONSTANT * d**2.5 - MASS * GRAVITY * d - energy, static, 1e-2, xtol=1e-18)
    return CONSTANT * deepest**1.5


@pytest.mark.parametrize("method", ["default", "strict"])
@pytest.mark.parametrize("velocity", [0.0, -0.1, 1e-3])
def test_a_wheel_let_go_a_hair_above_the_rail_strikes_it_as_one_that_falls(velocity, method):
    for height in HAIRS:
        record = wt.simulate(started(DROP, height, velocity), method)
        when, closing = fall(height, velocity)
        assert record.events.kind.values[0] == "impact"
        assert record.events.time.values[0] == pytest.approx(when, rel=1e-9, abs=1e-20)
        assert record.impacts.closing_speed.values[0] == pytest.approx(closing, rel=1e-9, abs=1e-20)
        assert record.peaks.normal_force.values[0] == pytest.approx(largest_force(height, velocity), rel=1e-9)


def test_maps_over_starts_through_the_touch_hold_the_closed_form_in_every_cell():
    displacements = np.linspace(-4e-4, 8e-4, 40)
    assert 0.0 < np.abs(displacements).min() < 1e-19  # rounding keeps it off zero
    over = {"start.displacement": [*displacements, 0.0, *HAIRS], "start.velocity": [-0.1, 0.0]}
    found = wt.sweep(DROP.replaced({"duration": 0.25}), over, ["largest_force"])
    expected = [[largest_force(height, v) for v in over["start.velocity"]] for height in over["start.displacement"]]
    assert np.all(found.status == 0)
    np.testing.assert_allclose(found.largest_force, expected, rtol=1e-7)
    of_height = wt.sweep(started(DROP, 0.0, -0.1), {"start.displacement": HAIRS}, ["largest_force"], gradient=True)
    force = largest_force(0.0, -0.1)
    steepness = 1.5 * CONSTANT ** (2 / 3) * force ** (1 / 3)
    slope = steepness * MASS * GRAVITY / (force - MASS * GRAVITY)  # of the force over the deepest point, and of that
    np.testing.assert_allclose(of_height.largest_force_gradient.squeeze(), slope, rtol=1e-5)


# -- continuity --------------------------------------------------------------------------------------------------------

SPRUNG = {"mass": MASS, "load": 91_307.0, "stiffness": 2.44e6, "damping": 5e4}
HERTZ = wt.Hertz(constant=CONSTANT)
DECK = wt.FloatingDeck(mass=15e3, stiffness=1.5e7, damping=5e4)
BUMP = {"speed": 9.0, "irregularity": wt.CosineBump(height=2e-4, length=0.05, start=0.0)}
POINT = BUMP | {"rolling": "point"}
PAIR = wt.vehicles.Wheelsets(wheelsets=(SPRUNG, SPRUNG | {"mass": 1300.0}), positions=(0.0, -2.5))
AXLE = {
    "vehicle": wt.Wagon(
        bodies=(), axles=(wt.vehicles.Axle(mass=1e4, inertia=(1120.0, 112.0, 1120.0), position=0.0),)
    ),
    "profiles": wt.profiles.Cones(), "contact": wt.Hertz(constant_per_wheel=0.5 * CONSTANT),
}  # fmt: skip
CASES = {
    "a free wheel": {"vehicle": wt.Wheelset(mass=MASS)},
    "Hertz on a deck": {"track": DECK},
    "Hertz over a bump": BUMP,
    "curvature on a deck over a bump": {"contact": wt.Hertz(constant=CONSTANT, curvature=True), "track": DECK} | POINT,
    "hysteresis": {"contact": wt.Hertz(constant=CONSTANT, hysteresis=0.2)} | POINT,
    "restitution on a deck": {
        "contact": wt.Hertz(constant=CONSTANT, restitution=0.6, impact_speed=0.1), "track": DECK
    },
    "linear": {"contact": wt.Linear(stiffness=1.2e9)},
    "bilateral": {"contact": wt.Linear(stiffness=1.2e9, bilateral=True)} | BUMP,
    "Thornton on a spot": {"contact": wt.contact.Thornton(constant=CONSTANT)},
    "Thornton over a bump": {"contact": wt.contact.Thornton(constant=CONSTANT)} | POINT,
    "Stronge": {"contact": wt.contact.Stronge(constant=CONSTANT)},
    "Kogut and Etsion on a deck": {"contact": wt.contact.KogutEtsion(constant=CONSTANT), "track": DECK},
    "play": {"vehicle": wt.Wheelset(**SPRUNG, damper_play=5e-5)},
    "a bush on a deck over a bump": {"vehicle": wt.Wheelset(**SPRUNG, bush_stiffness=1e7), "track": DECK} | BUMP,
    "without gravity": {"vehicle": wt.Wheelset(**SPRUNG, gravity=0.0)},
    "own law": {"contact": wt.contact.Law(lambda d: CONSTANT * d**1.5)},
    "own law of exponent 1": {"contact": wt.contact.Law(lambda d: 1.2e9 * d, exponent=1.0)},
    "own law of exponent 3": {"contact": wt.contact.Law(lambda d: 1e17 * d**3, exponent=3.0)},
    "wheelsets": {"vehicle": PAIR},
    "wheelsets on a deck": {"vehicle": PAIR, "track": DECK} | POINT,
    "a wagon": AXLE,
    "a wagon's linear contacts on a deck": AXLE | {"contact": wt.Linear(stiffness=1.2e9), "track": DECK},
    "a wagon's hysteresis": AXLE | {"contact": wt.Hertz(constant_per_wheel=0.5 * CONSTANT, hysteresis=0.5)} | POINT,
    "rails on sleepers": {"track": wt.tracks.Ballasted(**wt.tracks.Ballasted.example), "duration": 2e-3, "speed": 9.0},
}  # fmt: skip
LONG = (
    "rails on sleepers", "Kogut and Etsion on a deck", "Thornton over a bump", "Thornton on a spot", "Stronge",
    "a bush on a deck over a bump",
)  # fmt: skip
FEW = ("own law", "own law of exponent 1", "own law of exponent 3", *list(CASES)[-6:])
"""Slower ones, with fewer starts."""


@pytest.mark.slow
@pytest.mark.few(6)
@pytest.mark.parametrize("name", slow(CASES, *LONG))
def test_motions_from_starts_within_a_hair_of_the_touch_are_those_from_the_touch(name):
    """The vibration of the contact takes some 4 ms: meanwhile it enlarges a change of the start by less than ten."""
    given = {"vehicle": wt.Wheelset(**SPRUNG), "contact": HERTZ, "speed": 0.0, "duration": 5e-3} | CASES[name]
    hairs, velocities = (HAIRS[::6], (0.0, -0.1)) if name in FEW else (HAIRS[1::2], VELOCITIES)
    scene = wt.Scenario(**given)
    times = np.linspace(0.0, scene.duration, 41)
    for velocity in velocities:
        touching = wt.simulate(started(scene, 0.0, velocity), "strict").at(times)
        for height in (*hairs, *(-hair for hair in hairs)):
            found = wt.simulate(started(scene, height, velocity), "strict").at(times)
            moved = "wheel_displacement" if "wheel_displacement" in found else "displacement"
            for variable, stiff in ((moved, 1.0), ("normal_force", 5e9)):
                near = stiff * (10.0 * abs(height) + 1e-13)
                np.testing.assert_allclose(
                    found[variable], touching[variable], rtol=0, atol=near, err_msg=f"{height} m, {velocity} m/s"
                )


# -- what rounding leaves ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", [1e-12, -1e-12, 1.0])
@pytest.mark.parametrize("gap", [-3e-16, 0.0, 3e-16])
def test_a_flight_that_rounding_has_left_at_the_rail_lands_on_it(gap, rate):
    """Such a state lies between two steps, where the first of them ends within rounding of the impact."""
    program = lower(DROP, "default").program
    tables, S = np.zeros((64, contract.STEP_COLUMNS)), scratch_for(program)
    events, peaks = np.zeros((64, contract.EVENT_COLUMNS)), np.zeros((64, contract.PEAK_COLUMNS))
    single.start_kernel(program.pieces, program.numbers, events, S)
    S[layout.STATE + contract.PHASE] = contract.FLIGHT
    S[layout.STATE + contract.A], S[layout.STATE + contract.B] = gap, -rate
    while events[0, contract.EVENT_KIND] != contract.IMPACT or not S[layout.COUNT + layout.EVENTS]:
        args = program.pieces, program.numbers, None, tables, events, peaks, tables[:0], S
        assert single.advance_kernel(*args) == contract.RUNNING
    assert S[layout.STATE + contract.TIME] < 1e-6


@pytest.mark.parametrize("track", [wt.StiffTrack(), DECK], ids=["stiff", "deck"])
@pytest.mark.parametrize("share", [1.0, 1.0 - 1e-12, 1.0 + 1e-12, 1.0 + 1e-9])
def test_a_wheel_let_go_on_a_crest_that_falls_as_fast_as_it_meets_the_rail_again(share, track):
    """The path's acceleration is that of the free wheel at first, and less afterwards: the wheel hardly ever leaves."""
    speed, length = 9.0, 0.05
    fall, rate = GRAVITY + SPRUNG["load"] / MASS, 2.0 * np.pi * speed / length
    height = 2.0 * share * fall / rate**2
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=MASS, load=SPRUNG["load"]), track=track, contact=HERTZ, rolling="point", speed=speed,
        irregularity=wt.CosineBump(height=height, length=length, start=-length / 2), duration=4e-3,
        start={"displacement": height, "velocity": 0.0},
    )  # fmt: skip
    beside = started(scene, height - 1e-9, 0.0)
    times = np.linspace(0.0, 2.7e-3, 28)
    found, near = (wt.simulate(one, "strict").at(times).wheel_displacement for one in (scene, beside))
    np.testing.assert_allclose(found, near, rtol=0, atol=1e-8)


def test_the_basin_of_an_orbit_has_no_stripe_at_the_touch():
    waves = wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=0.1)
    scene = DROP.replaced({
        "vehicle": wt.Wheelset(**SPRUNG | {"damping": 2e4}), "irregularity": waves, "rolling": "point", "speed": 5.0,
    })  # fmt: skip
    near = np.linspace(-4e-4, 8e-4, 40)[13]
    over = {"start.displacement": [0.0, near, -near, *HAIRS[:8]], "start.velocity": [-0.1, 0.0, 0.05]}
    found = wt.orbits.fates(scene, over, 300)
    for variable in ("orbit", "waves", "losses"):
        assert np.all(found[variable] == found[variable][0]), variable
