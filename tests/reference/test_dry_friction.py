"""Dry friction and piecewise linear dampers of wagons against closed forms and two programs of the tests' own."""

from functools import partial
from itertools import product

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq, linprog

import wheeltapper as wt
from tests.dry_friction import QuarterWagon
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march import run
from wheeltapper.march.wagon.assembly import MOTION_Z, PLACES, ROLL, STEP_ELEMENTS, STEP_TIME, TO_RATE
from wheeltapper.march.wagon.resting import confine, decide_rest

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


@pytest.mark.slow
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


def beside(bodies, elements, moved, duration, motions=("z",)):
    """March bodies that elements hold to the ground, from displacements and velocities, {name: (z, v, roll, ω)}.

    Return the times at which each friction element changes and its piece then, [(time, element, piece)], and the end.
    """
    axle = wt.vehicles.Axle(**AXLE, load=1e4)
    held = tuple(
        wt.vehicles.Body(
            name=name, mass=mass, inertia=INERTIA, position=(0.0, 0.0, 1.0), held=tuple(set(HELD) - set(motions))
        )
        for name, mass in bodies.items()
    )
    at = {"at": (0.0, 0.0, 1.0)}
    scene = wt.Scenario(
        vehicle=wt.Wagon(bodies=held, axles=(axle,), elements=tuple(make(**at | make.keywords) for make in elements)),
        contact=wt.Hertz(constant_per_wheel=CONTACT), profiles=wt.profiles.Cones(moving_with="wheel"), speed=SPEED,
        duration=duration,
    )  # fmt: skip
    lowered = lower_wagon(scene, "strict")
    start = lowered.assembly.start.copy()
    places = {name: lowered.layout.bodies.index(name) * PLACES for name in bodies}
    for name, numbers in moved.items():
        for at_motion, (q, v) in zip((MOTION_Z, ROLL), np.reshape(numbers, (-1, 2)), strict=False):
            start[places[name] + at_motion], start[places[name] + at_motion + TO_RATE] = q, v
    march = run.march(lowered.assembly._replace(start=start))
    pieces = march.steps[:, STEP_ELEMENTS:]
    step, which = np.nonzero(pieces[1:] != pieces[:-1])
    kept = (MOTION_Z, ROLL)[: len(motions)]
    ends = [march.state[places[name] + motion + TO_RATE * k] for name in bodies for motion in kept for k in (0, 1)]
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


# -- several at rest --------------------------------------------------------------------------------------------------


def both(bounds):
    """The same bounds back and forth."""
    return np.column_stack([bounds, bounds])


def of_all_states(Y, free, bounds):
    """Accelerations a = free - Y·f and the least forces within bounds, by trying all 3ⁿ states."""
    back, forth = np.broadcast_to(bounds.T, (2, len(free)))
    found, scale = [], np.abs(free) + np.abs(Y) @ np.maximum(back, forth)
    for state in product((-1.0, 0.0, 1.0), repeat=len(free)):
        side = np.array(state)
        inside, f = side == 0.0, np.where(side > 0.0, forth, -back * (side < 0.0))
        f[inside] = np.linalg.pinv(Y[np.ix_(inside, inside)], rcond=1e-10) @ (free - Y @ f)[inside]
        a = free - Y @ f
        rests = np.abs(np.where(inside, a, np.minimum(side * a, 0.0))) <= 1e-9 * scale
        if rests.all() and ((-back * (1.0 + 1e-9) <= f) & (f <= forth * (1.0 + 1e-9))).all():
            found.append((f @ f, tuple(a), tuple(f)))
    return (np.array(one) for one in min(found)[1:])


def drawn_rest(draw, count):
    """Random rows of sliders on bodies, some of them alike or dependent; Y, accelerations without them, and bounds."""
    width = int(draw.integers(1, count + 1))
    rows = draw.integers(-2, 3, (count, width)) * 1.0 if draw.random() < 0.6 else draw.normal(size=(count, width))
    rows[~rows.any(axis=1), 0] = 1.0
    Y = rows @ np.diag(10 ** draw.uniform(-1.0, 1.0, width)) @ rows.T
    bounds = draw.choice([1.0, 2.0, 3.0], count) if draw.random() < 0.5 else draw.uniform(0.2, 3.0, count)
    free = Y @ (draw.uniform(-1.3, 1.3, count) * bounds)
    return Y, free if draw.random() < 0.5 else rows @ draw.integers(-6, 7, width), bounds


@pytest.mark.slow
def test_rest_is_the_only_one_of_all_states():
    draw = np.random.default_rng(20)
    for count in [1, 2, 3, 4, 5] * 12 + [8] * 3:
        Y, free, bounds = drawn_rest(draw, count)
        a, least = of_all_states(Y, free, bounds)
        f, ends = np.zeros((2, len(free)))
        confine(Y, free, both(bounds), f, ends)
        np.testing.assert_allclose(free - Y @ f, a, rtol=0, atol=1e-9 * (np.abs(free) + np.abs(Y) @ bounds).max())
        np.testing.assert_allclose(f, least, rtol=0, atol=1e-8)


@pytest.mark.slow
def test_rest_with_other_bounds_to_each_side_is_the_only_one_of_all_states():
    draw = np.random.default_rng(24)
    for count in [1, 2, 3, 4, 5] * 12 + [8] * 3:
        Y, free, bounds = drawn_rest(draw, count)
        sides = np.column_stack([bounds, bounds * draw.choice([0.3, 1.0, 2.0], count)])
        a, least = of_all_states(Y, free, sides)
        f, ends = np.zeros((2, len(free)))
        confine(Y, free, sides, f, ends)
        np.testing.assert_allclose(free - Y @ f, a, rtol=0, atol=1e-9 * (np.abs(free) + np.abs(Y) @ sides.max(1)).max())
        np.testing.assert_allclose(f, least, rtol=0, atol=1e-8)


@pytest.mark.slow
def test_who_moves_has_the_force_that_slides():
    # again by all states: with the limits, then with the lower force of those that move
    draw = np.random.default_rng(21)
    for count in [1, 2, 3, 4, 5] * 10:
        Y, free, forces = drawn_rest(draw, count)
        limits = forces * draw.choice([1.0, 1.5], len(free))
        bounds = limits.copy()
        while True:
            a, _ = of_all_states(Y, free, bounds)
            moves = np.abs(a) > 1e-6 * (np.abs(free) + np.abs(Y) @ bounds)
            if (bounds[moves] == forces[moves]).all():
                break
            bounds[moves] = forces[moves]
        ends = np.zeros(len(free))
        sides = decide_rest(Y, free, np.ones(len(free)), both(limits), both(forces), np.zeros(len(free)), ends)
        np.testing.assert_array_equal(sides, np.sign(a) * moves)


def test_ties_within_rounding_go_together():
    # a body (m, J) on two equal sliders ±b from its middle, b² > J/m, where it is pulled with both limits: if one went
    # alone, the other would need (2·limit/m - (1/m - b²/J)·force)/(1/m + b²/J) and stay
    rows = np.array([[1.0, 1.0], [1.0, -1.0]])
    Y = rows @ np.diag([1 / 5000.0, 1 / 1000.0]) @ rows.T
    limits, forces = np.full(2, 3600.0), np.full(2, 3000.0)
    for uneven in (0.0, 1e-13, -1e-13):
        need = Y @ (limits * np.array([1.0 + uneven, 1.0 - uneven]))
        sides = decide_rest(Y, need, np.ones(2), both(limits), both(forces), np.zeros(2), np.zeros(2))
        assert list(sides) == [1.0, 1.0]
    sides = decide_rest(Y, Y @ (limits * 0.9999), np.ones(2), both(limits), both(forces), np.zeros(2), np.zeros(2))
    assert list(sides) == [0.0, 0.0]


def test_one_at_its_limit_slides_alone_however_small_its_part():
    # independent rows of very different inertias, all but one of the forces inside of their limits
    draw = np.random.default_rng(22)
    for count in [1, 2, 3, 4, 5] * 10:
        rows = draw.normal(size=(count, count))
        Y = rows @ np.diag(10 ** draw.uniform(-2.5, 2.5, count)) @ rows.T
        forces = 10 ** draw.uniform(1.0, 4.0, count)
        limits = forces * draw.choice([1.0, 1.5], count)
        which = int(draw.integers(count))
        f = limits * draw.uniform(-0.9, 0.9, count)
        f[which] = limits[which] * (1.0 + 1e-11)
        ends = np.zeros(count)
        sides = decide_rest(Y, Y @ f, np.ones(count), both(limits), both(forces), np.zeros(count), ends)
        assert sides[which] == 1.0
        if limits[which] == forces[which]:  # its force goes on as it was, and so do the others
            assert np.abs(sides).sum() == 1.0


def test_dependent_ones_hold_as_long_as_any_forces_can():
    # the largest load that forces within the limits carry is that of a linear program
    draw = np.random.default_rng(23)
    for count in [3, 4, 5, 6] * 12:
        places = draw.choice([-1.0, 0.0, 1.0, 0.3, -0.62], (count, 2))
        rows = np.column_stack([np.ones(count), places])[:, : draw.integers(1, 4)]
        Y = rows @ np.diag(10 ** draw.uniform(-4.0, -2.0, rows.shape[1])) @ rows.T
        limits = 10 ** draw.uniform(2.0, 4.0, count)
        load = Y @ (limits * draw.uniform(-1.0, 1.0, count))
        box = [*zip(-limits, limits, strict=True), (0.0, None)]
        best = linprog(np.append(np.zeros(count), -1.0), A_eq=np.column_stack([Y, -load]) / np.abs(load).max(),
                       b_eq=np.zeros(count), bounds=box)  # fmt: skip
        ends, stuck = np.zeros(count), np.ones(count)
        below, at, above = (
            decide_rest(Y, -best.fun * share * load, stuck, both(limits), both(limits), np.zeros(count), ends)
            for share in (1.0 - 1e-7, 1.0 + 1e-9, 1.0 + 1e-4)
        )
        assert not below.any()
        assert at.any()
        np.testing.assert_array_equal(at, above)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("numbers", "begin"),
    [
        (((300.0, 420.0), (450.0, 450.0)), (0.03, 0.0, 0.02, 0.0)),
        (((300.0, 420.0), (450.0, 700.0)), (0.02, 0.0, -0.04, 0.0)),
        (((900.0, 1200.0), (250.0, 250.0)), (-0.025, 0.0, 0.03, 0.0)),
    ],
)  # fmt: skip
def test_two_unequal_ones_below_a_body_agree_with_matrix_exponentials(numbers, begin):
    # a body that goes up and down and rolls on springs at ±1 m, with sliders at 0.9 m and -0.6 m
    mass, stiffness, at, end = 800.0, np.array([4e5, 3e5]), np.array([0.9, -0.6]), 1.5
    arms, rows = np.array([[1.0, 1.0], [1.0, -1.0]]), np.column_stack([np.ones(2), at])
    W = np.diag([1.0 / mass, 1.0 / INERTIA[0]])
    elements = [
        partial(wt.vehicles.Spring, name=f"spring {k}", between=("body", "ground"), at=(0.0, y, 1.0),
                stiffness=(0.0, 0.0, stiffness[k]))
        for k, (_, y) in enumerate(arms)
    ] + [
        friction(f"it {k}", ("body", "ground"), at=(0.0, y, 1.0), force=numbers[k][0], static_force=numbers[k][1])
        for k, y in enumerate(at)
    ]  # fmt: skip
    changes, ends = beside({"body": mass}, elements, {"body": begin}, end, ("z", "roll"))
    Y, stretch = rows @ W @ rows.T, -W @ arms.T @ np.diag(stiffness) @ arms
    force, limit = np.array(numbers).T

    def pulls_of(x, sides):
        f, held = sides * force, sides == 0.0
        need = rows @ stretch @ x[[0, 2]] - Y @ f
        f[held] = np.linalg.solve(Y[np.ix_(held, held)], need[held])
        return f

    def generator(sides):
        held = sides == 0.0
        H = rows[held].T @ np.linalg.solve(Y[np.ix_(held, held)], rows[held])
        A = np.zeros((5, 5))
        A[0, 1] = A[2, 3] = 1.0
        A[np.ix_([1, 3], [0, 2])] = stretch - W @ H @ stretch
        A[[1, 3], 4] = -(np.eye(2) - W @ H) @ W @ rows.T @ (sides * force)
        return A

    def decided(x, sides, stuck, at_rest):
        """Try all states of those at rest: with what they hold, then with less of those that move."""
        bounds = np.where(stuck, limit * (1.0 - 1e-10), force)
        while True:
            for state in product((-1.0, 0.0, 1.0), repeat=2):
                new = np.where(at_rest, state, sides)
                held, f = new == 0.0, np.where(at_rest, new * bounds, sides * force)
                need = rows @ stretch @ x[[0, 2]]
                f[held] = np.linalg.solve(Y[np.ix_(held, held)], (need - Y @ f)[held])
                a = need - Y @ f
                fits = np.where(held, np.abs(f) <= bounds, new * a > 0.0)
                if fits[at_rest].all():
                    break
            lower = at_rest & (new != 0.0) & (bounds > force)
            if not lower.any():
                return new
            bounds = np.where(lower, force, bounds)

    def gaps(x, sides):
        v = rows @ x[[1, 3]]
        return np.where(sides == 0.0, limit - np.abs(pulls_of(x, sides)), sides * v)

    def gap_after(tau, A, begin, sides, k):
        return gaps(expm(A * tau) @ begin, sides)[k]

    t, x, grid, moment = 0.0, np.append(begin, 1.0), 2e-4, 1e-9  # x = (z, v, roll, ω, 1)
    at_rest = np.ones(2, dtype=bool)
    sides, expected = decided(x, np.zeros(2), at_rest, at_rest), []
    while t < end:
        A, begin = generator(sides), x
        small, low, here = expm(A * grid), moment, expm(A * moment) @ begin
        while True:
            high, there = low + grid, small @ here
            closed = np.flatnonzero(gaps(there, sides) <= 0.0)
            if high > end - t or len(closed):
                break
            low, here = high, there
        taus = [brentq(gap_after, low, high, args=(A, begin, sides, k), xtol=1e-15) for k in closed]
        tau = min(taus, default=np.inf)
        if t + tau > end:
            x = expm(A * (end - t)) @ begin
            break
        t, x = t + tau, expm(A * tau) @ begin
        stuck = sides == 0.0
        new = decided(x, sides, stuck, stuck | (np.abs(rows @ x[[1, 3]]) < 1e-11))
        expected += [(t, int(k), 1 + int(new[k])) for k in np.flatnonzero(new != sides)]
        sides = new
    assert len(expected) >= 8
    assert [what[1:] for what in changes] == [what[1:] for what in expected]
    np.testing.assert_allclose([what[0] for what in changes], [what[0] for what in expected], rtol=0, atol=1e-9)
    np.testing.assert_allclose(ends, x[:4], rtol=0, atol=1e-8)


# -- dampers ----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
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
