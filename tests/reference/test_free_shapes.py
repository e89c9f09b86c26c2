"""Treads of free shape that gauges show, on recordings of finite elements, and their derivatives on exact runs."""

from dataclasses import dataclass

import numpy as np
import pytest

from tests.reference.test_gauges import PAIRS, SCENE, SENSORS, SPREAD, TURN, passages, passing_of
from tests.wayside import RADIUS, Wheel
from wheeltapper.diagnosis.gauges.answers import Answers, touching
from wheeltapper.diagnosis.gauges.finding import WheelFinding
from wheeltapper.diagnosis.gauges.known import Known
from wheeltapper.diagnosis.gauges.passing import Runs, Tread, passing_without_readings
from wheeltapper.diagnosis.gauges.sizing import problem_of, sized_flat, values_of
from wheeltapper.diagnosis.gauges.tread_parts import parts_of, reached

KNOWN = Known(SCENE, SPREAD)


@dataclass(frozen=True)
class Shaped(Wheel):
    """A wheel with hollows, or what is built up: cosine waves of a depth, m (missing material positive), a length and a
    place, m, and with a skew: the deepest point is so much of the length ahead of the middle."""

    hollows: tuple[tuple[float, float, float, float], ...] = ()

    def surface(self, arc):
        """Return the deviation of the tread, m, at arcs, m."""
        out = 0.0 * arc
        for depth, length, place, skew in self.hollows:
            u = ((arc - place + 0.5 * TURN) % TURN - 0.5 * TURN) / length
            inside = np.interp(u, [-0.5, skew, 0.5], [-np.pi, 0.0, np.pi])
            out = out - 0.5 * depth * (1.0 + np.cos(inside))
        return out

    def path(self, x):
        """Return the path of the centre of a circle that rolls over the surface."""
        arc, beside = np.linspace(0.0, TURN, 14452, endpoint=False), np.arange(-300, 301)
        step = arc[1]
        both = self.surface(arc)[(np.arange(len(arc))[:, None] + beside) % len(arc)]
        rolled = (both - 0.5 * (beside * step) ** 2 / RADIUS).max(axis=1)
        return Wheel.path(self, x) + np.interp(x % TURN, np.append(arc, TURN), np.append(rolled, rolled[0]))


def tread_of(hollow, count=231):
    """Return a tread with a hollow."""
    return Tread(Shaped(0.0, hollows=(hollow,)).surface(np.arange(count) * TURN / count), -1.4)


def test_a_circle_touches_a_hollow_ahead_and_behind():
    """A smooth tread v touches where its slope is that of the circle: x = v - R·h'(v)."""
    depth, length, middle = 3e-4, 0.12, 1.2
    arc = middle + np.linspace(-0.05, 0.05, 9)
    slope = 0.5 * depth * np.sin(2.0 * np.pi * (arc - middle) / length) * 2.0 * np.pi / length
    found = touching(tread_of((depth, length, middle, 0.0)), RADIUS, (arc - RADIUS * slope) / RADIUS)
    np.testing.assert_allclose(found * RADIUS, arc, atol=1.5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("depth", [0.0, 6e-4])
def test_derivatives_by_a_tread_are_those_of_exact_runs(depth):
    """Differences of runs; in the hollow of 0.6 mm the force falls to 5 kN."""
    passing = passing_without_readings(SENSORS, 5e3, 500.0, 20.0, 8e4)
    runs, values = Runs(passing, SCENE), values_of(passing, KNOWN)
    problem = problem_of(runs, values, SPREAD, np.full(len(PAIRS), 0.05), 800.0)
    tread, by = tread_of((depth, 0.1, 1.3, 0.0)), 5e-6
    columns = Answers(problem, values, tread).columns(RADIUS)
    for place in (20, 104, 107):  # beside the hollow, and in it
        raised = tread.deviations + by * (np.arange(231) == place)
        change = problem.read(values, Tread(raised, tread.place)) - problem.read(values, tread)
        exact = problem.band.taken(change) / by
        assert np.sqrt(np.mean((columns[:, place] - exact) ** 2)) < 0.05 * np.sqrt(np.mean(exact**2))


def test_a_rail_reaches_into_a_deep_hollow_as_far_as_a_chord():
    """Into a box, 40 mm long, as far as into a flat of that length."""
    arc = np.arange(3000) * TURN / 3000
    box = np.where(abs(arc - 1.0) < 0.02, -2e-3, 0.0)
    found = reached(box[:, None], RADIUS)[:, 0]
    assert found.min() == pytest.approx(-(0.04**2) / (8.0 * RADIUS), rel=0.06)
    assert found[abs(arc - 1.0) > 0.022] == pytest.approx(0.0, abs=1e-9)


def test_parts_of_a_tread_are_its_hollows_and_what_is_built_up():
    hollows = ((8e-4, 0.09, 0.02, 0.0), (-5e-4, 0.15, 1.9, 0.0), (1e-4, 0.1, 1.0, 0.0))
    deviations = Shaped(0.0, hollows=hollows).surface(np.arange(361) * TURN / 361)
    found = parts_of(deviations, np.zeros((361, 1)), RADIUS)
    assert [one.size for one in found] == pytest.approx([-8e-4, 5e-4], rel=0.02)  # the third is too small
    assert [one.length for one in found] == pytest.approx([0.06, 0.1], rel=0.02)  # two thirds of a cosine wave
    assert [one.angle * RADIUS for one in found] == pytest.approx([0.02, 1.9], abs=1e-3)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("speed", "load", "hollows"),
    [
        (20.0, 73e3, ((6e-4, 0.1, 1.3, 0.0),)),
        (15.0, 60e3, ((5e-4, 0.08, 0.5, 0.0), (5e-4, 0.08, 0.5 + TURN / 3.0, 0.0))),
        (25.0, 85e3, ((-4e-4, 0.15, 1.9, 0.0),)),
    ],
)
def test_treads_of_free_shape_are_told_with_depth_length_and_place(speed, load, hollows):
    x, readings = passages(speed, (Shaped(load, seed=40, hollows=hollows),))
    passing = passing_of(x, readings[0], speed, load, 3)
    finding = WheelFinding(sized_flat(passing, KNOWN, np.full(len(PAIRS), 0.05)), passing, KNOWN)
    assert finding.verdict == "not explained"
    assert finding.probabilities["other"] > 0.99
    free = finding.free_shape
    assert free.reduced < 1.3
    assert len(free.parts) == len(hollows)
    for part in free.parts:
        depth, length, place, _ = min(hollows, key=lambda one: abs(apart(one[2], free.place(part))))
        assert part.size == pytest.approx(-depth, rel=0.2)
        assert min(part.size_interval) < -depth < max(part.size_interval)
        assert part.length == pytest.approx(2.0 / 3.0 * length, rel=0.25)
        assert abs(apart(place, free.place(part))) < 0.012
    told = finding.to_dict()["free_shape"]
    assert len(told["deviations"]) == len(told["standard_deviations"])
    assert ("hollow" if hollows[0][0] > 0.0 else "built-up") in str(finding)


def apart(one, other):
    """Return how far places are apart on the circumference, m."""
    return (one - other + 0.5 * TURN) % TURN - 0.5 * TURN
