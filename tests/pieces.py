"""A program of its own for vehicles of straight stretches: matrix exponentials between events, bracketed roots.

M·y'' + C·y' + K·y = Σ contacts·(N - N0) - Σ compression·F, y upwards from rest. Contacts are linear, over paths that
are waves; the elements are dry friction with an elastic slider, and springs and dampers with corners. One freedom may
be a deck that lies below a contact for some time only, and takes N0 - N then. Nothing of the package is used.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

STEP = 2e-5
"""Longest time, s, between two looks at what may happen."""


@dataclass
class Contact:
    """N = stiffness·δ, δ = N0/stiffness + path - y[freedom]; the path is Σ amplitude·sin(number·(x + offset)).

    Between two times `on` y[deck] is added to δ.
    """

    freedom: int
    stiffness: float
    static: float
    waves: tuple = ()
    pulls: bool = False
    closed: bool = True
    deck: int = -1
    on: tuple = (np.inf, np.inf)
    carried: bool = False


@dataclass
class Friction:
    compression: np.ndarray
    force: float
    stiffness: float
    side: int = 0
    anchor: float = 0.0


@dataclass
class Corners:
    """Force over u = compression·y, or its rate: 0 at zero, slopes[i] up to places[i], slopes[-1] behind the last."""

    compression: np.ndarray
    places: list
    slopes: list
    by_rate: bool = False
    stretch: int = field(default=-1)

    def __post_init__(self):
        self.stretch = sum(place < 0 for place in self.places)
        forces = np.zeros(len(self.places))
        for k in range(self.stretch, len(self.places)):
            before = 0.0 if k == self.stretch else self.places[k - 1]
            forces[k] = (0.0 if k == self.stretch else forces[k - 1]) + self.slopes[k] * (self.places[k] - before)
        for k in range(self.stretch - 1, -1, -1):
            after = 0.0 if k == self.stretch - 1 else self.places[k + 1]
            known = 0.0 if k == self.stretch - 1 else forces[k + 1]
            forces[k] = known + self.slopes[k + 1] * (self.places[k] - after)
        self.forces = forces

    def line(self):
        """Return force at u = 0 and slope of the present stretch."""
        slope = self.slopes[self.stretch]
        if not len(self.places):
            return 0.0, slope
        corner = min(self.stretch, len(self.places) - 1)
        return self.forces[corner] - slope * self.places[corner], slope


def _root(guard, A, state, until):
    return brentq(lambda h: guard @ expm(A * h) @ state, 0.0, until, xtol=1e-18, rtol=1e-15)


def run(mass, damping, stiffness, contacts, elements, speed, duration, start=None):
    """Return all events in order: time, "contact" or "element", its number, and what happens."""
    n = len(mass)
    waves = [(i, *wave) for i, one in enumerate(contacts) for wave in one.waves]
    size = 2 * n + 2 * len(waves) + 1
    state = np.zeros(size)
    state[-1] = 1.0
    for k, (_, _, number, offset) in enumerate(waves):
        state[2 * n + 2 * k : 2 * n + 2 * k + 2] = np.sin(number * offset), np.cos(number * offset)
    paths = np.zeros((len(contacts), size))
    for k, (i, amplitude, _, _) in enumerate(waves):
        paths[i, 2 * n + 2 * k] = amplitude
    if start is not None:
        state[: 2 * n] = start
    else:
        for i in range(len(contacts)):  # everything rests where the paths begin
            paths[i, -1] -= paths[i] @ state
    unit = np.eye(size)
    place = {id(one): np.pad(one.compression, (0, size - n)) for one in elements}
    rate = {id(one): np.pad(one.compression, (n, size - 2 * n)) for one in elements}

    def gap(one, i):
        below = unit[one.deck] if one.carried else 0.0
        return one.static / one.stiffness * unit[-1] + paths[i] - unit[one.freedom] + below

    def flow():
        A = np.zeros((size, size))
        A[:n, n : 2 * n] = np.eye(n)
        force = np.zeros((n, size))
        force[:, :n], force[:, n : 2 * n] = -np.asarray(stiffness), -np.asarray(damping)
        for i, one in enumerate(contacts):
            presses = -one.static * unit[-1]
            if one.closed:
                presses = presses + one.stiffness * gap(one, i)
            force[one.freedom] += presses
            if one.carried:
                force[one.deck] -= presses
        for one in elements:
            if isinstance(one, Friction):
                pushes = one.side * one.force * unit[-1]
                if not one.side:
                    pushes = one.stiffness * (place[id(one)] - one.anchor * unit[-1])
            else:
                level, slope = one.line()
                pushes = level * unit[-1] + slope * (rate if one.by_rate else place)[id(one)]
            force -= np.outer(one.compression, pushes)
        A[n : 2 * n] = np.linalg.solve(mass, force)
        for k, (_, _, number, _) in enumerate(waves):
            A[2 * n + 2 * k, 2 * n + 2 * k + 1] = number * speed
            A[2 * n + 2 * k + 1, 2 * n + 2 * k] = -number * speed
        return A

    def guards():
        """Return what, where it rises above zero, ends the present mode, with what is told."""
        out = []
        for i, one in enumerate(contacts):
            if not one.pulls:
                out.append(
                    ((-1 if one.closed else 1) * gap(one, i), ("contact", i, "loss" if one.closed else "impact"))
                )
        for i, one in enumerate(elements):
            if isinstance(one, Friction):
                if one.side:
                    out.append((-one.side * rate[id(one)], ("element", i, "sticks")))
                else:
                    for side in (1, -1):
                        reach = side * (place[id(one)] - one.anchor * unit[-1]) - one.force / one.stiffness * unit[-1]
                        out.append((reach, ("element", i, f"slides {side}")))
                continue
            u = (rate if one.by_rate else place)[id(one)]
            if one.stretch < len(one.places):
                out.append((u - one.places[one.stretch] * unit[-1], ("element", i, "up")))
            if one.stretch > 0:
                out.append((one.places[one.stretch - 1] * unit[-1] - u, ("element", i, "down")))
        return out

    def change(told):
        family, i, what = told
        if family == "contact":
            contacts[i].closed = what == "impact"
            return
        one = elements[i]
        if what == "sticks":
            one.anchor = place[id(one)] @ state - one.side * one.force / one.stiffness
            one.side = 0
        elif what.startswith("slides"):
            one.side = int(what.split()[1])
        else:
            one.stretch += 1 if what == "up" else -1

    def come_to(time):
        """Take contacts on to the deck and off it; what they then indent decides whether they press."""
        for i, one in enumerate(contacts):
            carried = one.on[0] <= time < one.on[1]
            if carried == one.carried:
                continue
            one.carried = carried
            if not one.pulls and (gap(one, i) @ state > 0.0) != one.closed:
                one.closed = not one.closed
                events.append((time, "contact", i, "impact" if one.closed else "loss"))

    events, time = [], 0.0
    ends = sorted({time for one in contacts for time in one.on if 0.0 < time < duration})
    come_to(0.0)
    A = flow()
    whole = expm(A * STEP)
    while time < duration:
        step = min([STEP, *(end - time for end in ends[:1])])
        later = (whole if step == STEP else expm(A * step)) @ state
        found = []
        for guard, told in guards():
            if guard @ later > 0.0:
                at = 0.0
                if guard @ state < 0.0:
                    at = _root(guard, A, state, step)
                found.append((at, told))
        if not found:
            state, time = later, time + step
            if step != STEP or time in ends:
                time = ends.pop(0)
                come_to(time)
                A = flow()
                whole = expm(A * STEP)
            continue
        at, told = min(found)
        state, time = expm(A * at) @ state, time + at
        if time <= duration:
            events.append((time, *told))
        change(told)
        A = flow()
        whole = expm(A * STEP)
    return events
