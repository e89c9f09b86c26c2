"""Friction that follows a spring's force, and springs that only press: closed forms, and a program of the tests'."""

from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from tests.dry_friction import RubbedBody
from tests.moved_bodies import changes_of, element, moved, spring
from wheeltapper.march.wagon.assembly import MOTION_Z, PLACES, TO_RATE

GRAVITY = 9.81
TO_GROUND = ("body", "ground")


def end_of(lowered, march, name="body"):
    at = lowered.layout.bodies.index(name) * PLACES + MOTION_Z
    return march.state[at], march.state[at + TO_RATE]


@pytest.mark.parametrize("kind", ["Spring", "CompressionSpring"])
def test_swings_under_friction_that_follows_its_spring_turn_where_the_closed_form_says(kind):
    # downwards the spring seems stiffer by 1 + ε, upwards softer by 1 - ε; it begins where the spring is free
    path = Path(__file__).parents[1] / "data" / "load_friction_closed_form.csv"
    turns = np.genfromtxt(path, delimiter=",", skip_header=3)
    mass, stiffness, share = 11000.0, 2e6, 0.12
    rest = mass * GRAVITY / stiffness
    below, times, places = 0.0, [], []
    for k in range(4):
        seems = stiffness * (1.0 + share if k % 2 == 0 else 1.0 - share)
        times.append(np.pi * np.sqrt(mass / seems))
        below = 2.0 * mass * GRAVITY / seems - below
        places.append(below)
    times = np.cumsum(times)
    np.testing.assert_allclose(times, turns[:, 1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(1e3 * np.array(places), turns[:, 2], rtol=0, atol=1e-6)
    load = spring("nest", TO_GROUND, stiffness)
    if kind == "CompressionSpring":
        load = element(kind, "nest", TO_GROUND, along="z", compression=(0.0, 0.1), force=(0.0, 0.1 * stiffness))
    rubs = element("Friction", "it", TO_GROUND, along="z", load="nest", coefficient=share)
    # just below where the spring is free, where there would be nothing to begin with
    lowered, march = moved({"body": mass}, [load, rubs], {"body": {"z": (rest - 1e-12, 0.0)}}, 1.2)
    found = [(time, piece) for time, number, piece in changes_of(march) if number == len(march.steps[0]) - 4]
    np.testing.assert_allclose([time for time, _ in found], times, rtol=0, atol=1e-9)
    assert [piece for _, piece in found] == [2, 0, 2, 1]
    z, v = end_of(lowered, march)
    assert z == pytest.approx(rest - places[-1], abs=1e-9)
    assert abs(v) < 1e-12


def nest_of(stages):
    """A nest's force and stiffness over the way by which it is pressed, from corners."""
    places, force = np.array(stages[0]), np.array(stages[1])

    def nest(pressed):
        if pressed < 0.0:
            return 0.0, 0.0
        piece = min(int(np.searchsorted(places, pressed, side="right")) - 1, len(places) - 2)
        slope = (force[piece + 1] - force[piece]) / (places[piece + 1] - places[piece])
        return force[piece] + slope * (pressed - places[piece]), slope

    return nest


def kinds_of(lowered, march):
    told = lowered.element_events(march)
    mine = told.element == "it"
    names = np.array(["stick", "slip", "leave", "meet", "within", "beyond"])
    return [(time, kind) for time, kind in zip(told.time[mine], names[told.kind[mine]], strict=True) if time > 0.0]


MASS, AUX = 2800.0, 3e5
STAGES = (0.0, 0.02, 0.06), (0.0, 1.6e4, 8e4)


@pytest.mark.slow
@pytest.mark.parametrize("begin", [(0.03, 0.0), (-0.07, -0.9), (0.055, 0.4)])
@pytest.mark.parametrize(
    ("name", "fields", "series"),
    [
        ("LenoirLink", {"friction": 0.35, "angle": 0.42}, None),
        ("LenoirLink", {"friction": 0.2, "angle": 0.42, "faces": 1}, 4e6),
        ("FrictionWedge", {"friction": 0.3, "angle": 0.6335545}, None),
        ("FrictionWedge", {"friction": 0.2, "angle": 0.6335545}, 2e6),
        ("Friction", {"along": "z", "coefficient": (0.05, 0.2), "static_coefficient": (0.07, 0.28)}, 3e6),
        ("Friction", {"along": "z", "coefficient": (0.05, 0.2), "static_coefficient": (0.07, 0.28)}, None),
    ],
)
def test_rubbed_bodies_stick_slip_and_leave_when_another_program_says(name, fields, series, begin):
    if series is None and begin[0] < 0.05:  # sticking it has no speed
        begin = begin[0], 0.0
    load = element("CompressionSpring", "nest", TO_GROUND, along="z", compression=STAGES[0], force=STAGES[1])
    rubs = element(name, "it", TO_GROUND, load="nest", series_stiffness=series, **fields)
    aside = spring("aside", TO_GROUND, AUX)
    lowered, march = moved({"body": MASS}, [load, aside, rubs], {"body": {"z": begin}}, 1.0)
    if name == "LenoirLink":
        down = up = fields.get("faces", 2) * fields["friction"] * np.tan(fields["angle"])
    elif name == "FrictionWedge":
        slope, mu = np.tan(fields["angle"]), fields["friction"]
        down, up = mu / (slope - mu), mu / (slope + mu)
    else:
        up, down = fields["coefficient"]
    above = 1.4 if name == "Friction" else 1.0
    # at rest: the nest and the spring beside it share the weight, both free at the same height
    nest = nest_of(STAGES)
    low, high = 0.0, 0.06
    for _ in range(100):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if nest(middle)[0] + AUX * middle < MASS * GRAVITY else (low, middle)
    own = RubbedBody(MASS, AUX, nest, low, down, up, above, series, begin)
    expected, x = own.march([], 1.0)
    found = kinds_of(lowered, march)
    assert [kind for _, kind in found] == [kind for _, kind in expected]
    assert len(found) >= 3
    np.testing.assert_allclose([time for time, _ in found], [time for time, _ in expected], rtol=0, atol=1e-9)
    np.testing.assert_allclose(end_of(lowered, march), x[:2], rtol=0, atol=1e-9)


def test_arms_of_centre_bowls():
    bowl = wt.vehicles.CentreBowl(name="b", between=("a", "b"), at=(0, 0, 1), load="s", friction=1.0, radius=0.15)
    assert bowl.arm == pytest.approx(0.1)
    ring = bowl.model_copy(update={"inner_radius": 0.05})
    assert ring.arm == pytest.approx(2 / 3 * (0.15**3 - 0.05**3) / (0.15**2 - 0.05**2))
    assert ring.model_copy(update={"shape": "worn"}).arm == pytest.approx(0.1)
    sphere = bowl.model_copy(update={"shape": "sphere", "radius": 0.19, "half_angle": np.pi / 4})
    # moment of a cosine pressure, by quadrature over the cap
    beta = (np.arange(20000) + 0.5) * np.pi / 4 / 20000
    moment = np.sum(np.cos(beta) * (0.19 * np.sin(beta)) * np.sin(beta))
    force = np.sum(np.cos(beta) * np.cos(beta) * np.sin(beta))
    assert sphere.arm == pytest.approx(moment / force, rel=1e-6)
    assert sphere.arm == pytest.approx(0.104, abs=5e-4)
