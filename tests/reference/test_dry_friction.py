"""Dry friction and piecewise linear dampers of wagons against closed forms and two programs of the tests' own."""

from functools import partial

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import wheeltapper as wt
from tests.dry_friction import QuarterWagon
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march import run
from wheeltapper.march.assembly import PLACES, STEP_ELEMENTS, STEP_TIME, TO_RATE

HELD = ("x", "y", "roll", "pitch", "yaw")
AXLE = {"mass": 1500.0, "inertia": (1120.0, 112.0, 1120.0), "held": HELD, "position": 0.0}
INERTIA = (1e3, 1e3, 1e3)
BODY, SPRING, CONTACT, SPEED = 5000.0, 1e6, 7e10, 9.0
HEIGHT, LENGTH, START = 5e-4, 0.1, 0.02
PLACE = {"between": ("body", "wheelset 1"), "at": (0.0, 0.0, 0.8)}


def bump(t):
    x = SPEED * t - START
    return 0.5 * HEIGHT * (1.0 - np.cos(2.0 * np.pi * x / LENGTH)) if 0.0 < x < LENGTH else 0.0


def quarter_wagon(*elements, duration=0.1, method="strict", **changes):
    body = wt.vehicles.Body(name="body", mass=BODY, inertia=INERTIA, position=(0.0, 0.0, 1.0), held=HELD)
    spring = wt.vehicles.Spring(name="spring", stiffness=(0.0, 0.0, SPRING), **PLACE)
    fields = {
        "vehicle": wt.Wagon(bodies=(body,), axles=(wt.vehicles.Axle(**AXLE),), elements=(spring, *elements)),
        "contact": wt.Hertz(constant_per_wheel=CONTACT), "profiles": wt.profiles.Cones(moving_with="wheel"),
        "irregularity": wt.CosineBump(height=HEIGHT, length=LENGTH, start=START), "rolling": "point",
        "speed": SPEED, "duration": duration,
    } | changes  # fmt: skip
    return wt.simulate(wt.Scenario(**fields), method)


def events_of(record):
    """Time and kind of the events of elements and of the left wheels, in order."""
    wheels, elements = record.events, record.suspension_events
    wheels = wheels.isel(event=wheels.side.values == "left")
    both = [zip(found.time.values, found.kind.values, strict=True) for found in (wheels, elements)]
    return sorted((*both[0], *both[1]))


@pytest.mark.parametrize(
    ("force", "limit", "series"),
    [
        (500.0, 500.0, 1e7), (3000.0, 4000.0, 5e6), (2e4, 2e4, 3e7),
        (500.0, 500.0, None), (1.2e4, 1.2e4, None), (1.2e4, 1.4e4, None),
    ],
)  # fmt: skip
def test_a_quarter_wagon_sticks_and_slips_when_another_program_says(force, limit, series):
    own = QuarterWagon(BODY, AXLE["mass"], SPRING, 2 * CONTACT, force, limit, series, bump)
    expected, _ = own.march([START / SPEED, (START + LENGTH) / SPEED], 0.1)
    element = wt.vehicles.Friction(
        name="it", along="z", force=force, static_force=limit, series_stiffness=series, **PLACE
    )
    found = events_of(quarter_wagon(element))
    assert [kind for _, kind in found] == [kind for _, kind in expected]
    kinds = {kind for _, kind in found}
    assert {"loss", "impact", "slip"} <= kinds
    assert "stick" in kinds or force == 500.0
    np.testing.assert_allclose([time for time, _ in found], [time for time, _ in expected], rtol=0, atol=1e-9)
    coarse = events_of(quarter_wagon(element, method="default"))
    np.testing.assert_allclose([t for t, _ in coarse], [t for t, _ in expected], rtol=0, atol=1e-7)


# -- bodies beside the wheelset, moved at the start ------------------------------------------------------------------


def beside(bodies, elements, moved, duration):
    """March bodies that elements hold to the ground, from displacements and velocities along z, {name: (z, v)}.

    Return the times at which each friction element changes and its piece then, [(time, element, piece)], and the end.
    """
    axle = wt.vehicles.Axle(**AXLE, load=1e4)
    held = tuple(
        wt.vehicles.Body(name=name, mass=mass, inertia=INERTIA, position=(0.0, 0.0, 1.0), held=HELD)
        for name, mass in bodies.items()
    )
    at = {"at": (0.0, 0.0, 1.0)}
    scene = wt.Scenario(
        vehicle=wt.Wagon(bodies=held, axles=(axle,), elements=tuple(make(**at) for make in elements)),
        contact=wt.Hertz(constant_per_wheel=CONTACT), profiles=wt.profiles.Cones(moving_with="wheel"), speed=SPEED,
        duration=duration,
    )  # fmt: skip
    lowered = lower_wagon(scene, "strict")
    start = lowered.assembly.start.copy()
    for name, (z, v) in moved.items():
        at_z = lowered.layout.bodies.index(name) * PLACES + 2
        start[at_z], start[at_z + TO_RATE] = z, v
    march = run.march(lowered.assembly._replace(start=start))
    pieces = march.steps[:, STEP_ELEMENTS:]
    step, which = np.nonzero(pieces[1:] != pieces[:-1])
    ends = [
        march.state[lowered.layout.bodies.index(name) * PLACES + 2 + TO_RATE * k] for name in bodies for k in (0, 1)
    ]
    return [
        (march.steps[i + 1, STEP_TIME], int(j), int(pieces[i + 1, j])) for i, j in zip(step, which, strict=True)
    ], ends


def spring(name, between, stiffness):
    return partial(wt.vehicles.Spring, name=name, between=between, stiffness=(0.0, 0.0, stiffness))


def friction(name, between, **numbers):
    return partial(wt.vehicles.Friction, name=name, between=between, along="z", **numbers)


def test_free_vibrations_decay_by_a_constant_amount_and_stop():
    # m·z'' + k·z = ∓F: half periods of π/ω, each shorter by 2·F/k; it stays where k·|z| is within F
    mass, stiffness, force, begin = 800.0, 5e5, 900.0, 0.0205
    elements = [spring("spring", ("body", "ground"), stiffness), friction("it", ("body", "ground"), force=force)]
    changes, (z, v) = beside({"body": mass}, elements, {"body": (begin, 0.0)}, 1.0)
    halves = int(np.ceil((begin - force / stiffness) / (2.0 * force / stiffness)))
    turns = np.arange(1, halves + 1) * np.pi / np.sqrt(stiffness / mass)
    np.testing.assert_allclose([time for time, _, _ in changes], turns, rtol=0, atol=1e-9)
    assert [piece for _, _, piece in changes] == [2 if k % 2 == 0 else 0 for k in range(halves - 1)] + [1]
    assert z == pytest.approx((-1) ** halves * (begin - 2 * halves * force / stiffness), abs=1e-10)
    assert abs(v) < 1e-12


@pytest.mark.parametrize("series", [None, 3e6])
def test_a_mass_on_a_belt_sticks_and_slips_as_matrix_exponentials_say(series):
    # the belt is a heavy body that moves; while it sticks, friction is stronger than while it slides
    mass, belt, stiffness, weak, force, limit, speed, end = 60.0, 4e4, 4e4, 2e4, 300.0, 520.0, 0.1, 2.0
    elements = [
        spring("spring", ("body", "ground"), stiffness), spring("weak", ("belt", "ground"), weak),
        friction("it", ("belt", "body"), force=force, static_force=limit, series_stiffness=series),
    ]  # fmt: skip
    begin = 0.0 if series else speed  # what sticks without a spring moves with the belt from the start
    moved = {"body": (0.0, begin), "belt": (0.0, speed)}
    changes, ends = beside({"body": mass, "belt": belt}, elements, moved, end)

    # x = (z, v, z of belt, v of belt, f, 1); f on the body upwards
    def generator(side):
        A = np.zeros((6, 6))
        A[0, 1] = A[2, 3] = 1.0
        A[1, 0], A[1, 4], A[3, 2], A[3, 4] = -stiffness / mass, 1.0 / mass, -weak / belt, -1.0 / belt
        if side == 0 and series:
            A[4, 1], A[4, 3] = -series, series
        if side == 0 and not series:  # one acceleration
            A[1] = A[3] = 0.0
            A[1, 0] = A[3, 0] = -stiffness / (mass + belt)
            A[1, 2] = A[3, 2] = -weak / (mass + belt)
        return A

    def pull(x):  # of what sticks
        if series:
            return x[4]
        return (x[0] * stiffness / mass - x[2] * weak / belt) / (1.0 / mass + 1.0 / belt)

    t, x, side, expected, grid = 0.0, np.array([0.0, begin, 0.0, speed, 0.0, 1.0]), 0, [], 1e-4
    while t < end:
        A, begin = generator(side), x.copy()

        def gap(tau, A=A, begin=begin, side=side):
            x = expm(A * tau) @ begin
            return side * (x[3] - x[1]) if side else limit - abs(pull(x))

        small, tau = expm(A * grid), grid
        at = small @ begin
        while t + tau < end and (side * (at[3] - at[1]) if side else limit - abs(pull(at))) > 0.0:
            at, tau = small @ at, tau + grid
        if t + tau >= end:
            x, t = expm(A * (end - t)) @ begin, end
            break
        tau = brentq(gap, max(tau - grid, 1e-9), tau, xtol=1e-15)
        t, x = t + tau, expm(A * tau) @ begin
        if side == 0:
            side = int(np.sign(pull(x)))
            x[4] = side * force
        elif series or abs(pull(x)) <= force:
            side = 0
        else:
            side = int(np.sign(pull(x)))
            x[4] = side * force
        expected.append((t, 1 + side))
    found = [(time, piece) for time, _, piece in changes]
    assert len(expected) >= 10
    assert [piece for _, piece in found] == [piece for _, piece in expected]
    np.testing.assert_allclose([time for time, _ in found], [time for time, _ in expected], rtol=0, atol=1e-9)
    np.testing.assert_allclose(ends, x[:4], rtol=0, atol=1e-8)


# -- dampers ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("series", [None, 2e7])
@pytest.mark.parametrize(
    ("rate", "force"),
    [((0.0, 0.02, 0.1), (0.0, 2e3, 2.4e3)), ((-0.1, -0.01, 0.0, 0.05, 0.2), (-3e3, -2e3, 0.0, 1e3, 1.5e3))],
)
def test_a_blow_off_damper_agrees_with_another_integrator(rate, force, series):
    element = wt.vehicles.Damper(name="it", along="z", rate=rate, force=force, series_stiffness=series, **PLACE)
    record = quarter_wagon(element, duration=0.04)
    rates, forces = np.array(rate), np.array(force)
    if rate[0] == 0.0:
        rates, forces = (np.concatenate([-one[:0:-1], one[1:]]) for one in (rates, forces))
    places, values = (forces, rates) if series else (rates, forces)
    slopes = np.diff(values) / np.diff(places)

    class Damped(QuarterWagon):
        """`slides` is the present piece of the force over the rate, or of the rate over the force."""

        def on_piece(self, x, k):
            return values[k] + slopes[k] * (x - places[k])

        def friction(self, t, x, touches, slides):
            return x[4] if series else self.on_piece(x[1] - x[3], slides)

        def rates(self, t, x, touches, slides):
            out = QuarterWagon.rates(self, t, x, touches, slides)
            out[4] = series * (x[1] - x[3] - self.on_piece(x[4], slides)) if series else 0.0
            return out

        def gaps(self, t, x, touches, slides):
            here = x[4] if series else x[1] - x[3]
            low = here - places[slides] if slides > 0 else 1.0
            high = places[slides + 1] - here if slides < len(slopes) - 1 else 1.0
            return np.array([QuarterWagon.gaps(self, t, x, touches, 0)[0], min(low, high) + 1e-13])

        def after(self, t, x, touches, slides, which):
            if which == 0:
                return QuarterWagon.after(self, t, x, touches, slides, which)
            here = x[4] if series else x[1] - x[3]
            return (touches, slides + (1 if here > 0.5 * (places[slides] + places[slides + 1]) else -1)), "corner"

    first = int(np.searchsorted(places, 0.0)) - 1
    own = Damped(BODY, AXLE["mass"], SPRING, 2 * CONTACT, 0.0, 1.0, series, bump, begins=first)
    expected, state = own.march([START / SPEED, (START + LENGTH) / SPEED], 0.04)
    assert "corner" in {kind for _, kind in expected}
    expected = [(time, kind) for time, kind in expected if kind != "corner"]
    found = events_of(record)
    assert [kind for _, kind in found] == [kind for _, kind in expected]
    assert len(found) >= 5
    np.testing.assert_allclose([time for time, _ in found], [time for time, _ in expected], rtol=0, atol=1e-9)
    z = record.at([record.end]).displacement.sel(motion="z", body="body").item()
    assert z == pytest.approx(state[0], abs=1e-10)
    assert float(record.energy.dissipated) > 1.0
    assert float(record.energy.relative_imbalance) < 1e-9
