"""Other programs for dry friction, event by event: scipy's DOP853 with brackets and Brent's roots between the events.

One knows a body on one wheelset on Hertz's contact, with a spring and one friction element between them, moving
vertically; the other a body above the ground whose friction follows the force of a nest of springs that it may leave.
They share no line with the package. Sticking with a spring, the friction force is a state: f' = s·(rate of the
deflection). Rigid, body and wheelset have one acceleration, and f is what that needs.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

GRAVITY = 9.81
NODES = 12
"""Places in a step at which the sign of what makes an event is examined."""


class EventByEvent:
    """A march from event to event of a program with `start`, `first_mode`, `rates`, `gaps` and `after`."""

    scale: np.ndarray
    """Absolute error of each state that a step may have."""

    def gap_along(self, motion, mode, which, t):
        return self.gaps(t, motion(t), *mode)[which]

    def march(self, breaks, end, longest=2e-4):
        """Return all events, [(time, kind)], and the state at the end."""
        t, x, mode, events = 0.0, self.start(), self.first_mode(), []
        borders = [*sorted(b for b in breaks if b < end), end]
        quiet = np.zeros(2)
        while t < end:
            until = next(b for b in borders if b > t)
            step = solve_ivp(
                self.rates, (t, min(until, t + longest)), x, args=mode, method="DOP853", rtol=1e-13, atol=self.scale,
                dense_output=True,
            )  # fmt: skip
            times = np.linspace(t, step.t[-1], NODES * max(len(step.t) - 1, 1) + 1)
            gaps = np.array([self.gaps(time, step.sol(time), *mode) for time in times])
            found = []
            for which in range(2):
                below = np.flatnonzero((gaps[1:, which] < 0.0) & (gaps[:-1, which] >= quiet[which]))
                first = int(below[0]) if len(below) else None
                if first is not None and (first > 0 or gaps[0, which] > 0.0):
                    value = partial(self.gap_along, step.sol, mode, which)
                    found.append((brentq(value, times[first], times[first + 1], xtol=1e-16, rtol=1e-15), which))
            if not found:
                t, x = step.t[-1], step.y[:, -1]
                continue
            t, which = min(found)
            x = step.sol(t)
            mode, kind = self.after(t, x, *mode, which)
            events.append((t, kind))
            # a moment later, so that the gap that has just closed is open
            little = 1e-12
            x, t = x + little * self.rates(t, x, *mode), t + little
        return events, x


@dataclass
class QuarterWagon(EventByEvent):
    body: float
    wheelset: float
    spring: float
    contact: float  # of both wheels, N/m^1.5
    force: float
    limit: float
    series: float | None
    path: Callable[[float], float]
    begins: int = 0
    scale = np.array([1e-9, 1e-7, 1e-9, 1e-7, 1e-3]) * 1e-4

    def first_mode(self):
        return True, self.begins

    def start(self):
        sinks = ((self.body + self.wheelset) * GRAVITY / self.contact) ** (2 / 3)
        return np.array([-sinks, 0.0, -sinks, 0.0, 0.0])

    def pulls(self, t, x, touches):
        """Forces on body and wheelset but for friction, counted from rest, where springs carry the body."""
        stretch = self.spring * (x[0] - x[2])
        delta = max(self.path(t) - x[2], 0.0) * touches
        up = self.contact * delta**1.5 - (self.body + self.wheelset) * GRAVITY
        return -stretch, stretch + up

    def friction(self, t, x, touches, slides):
        if slides:
            return slides * self.force
        if self.series:
            return x[4]
        on_body, on_wheelset = self.pulls(t, x, touches)
        return (on_body / self.body - on_wheelset / self.wheelset) / (1 / self.body + 1 / self.wheelset)

    def rates(self, t, x, touches, slides):
        f = self.friction(t, x, touches, slides)
        on_body, on_wheelset = self.pulls(t, x, touches)
        grows = (self.series or 0.0) * (x[1] - x[3]) * (not slides)
        return np.array([x[1], (on_body - f) / self.body, x[3], (on_wheelset + f) / self.wheelset, grows])

    def gaps(self, t, x, touches, slides):
        """What falls through zero at an event: of the contact, and of the friction."""
        rubs = slides * (x[1] - x[3]) if slides else self.limit - abs(self.friction(t, x, touches, slides))
        return np.array([(self.path(t) - x[2]) * (1 if touches else -1), rubs])

    def after(self, t, x, touches, slides, which):
        """The mode after an event, and its name."""
        if which == 0:
            return (not touches, slides), "loss" if touches else "impact"
        if not slides:
            side = int(np.sign(self.friction(t, x, touches, 0)))
            x[4] = side * self.force
            return (touches, side), "slip"
        if self.series:
            x[4] = slides * self.force
            return (touches, 0), "stick"
        need = self.friction(t, x, touches, 0)
        if abs(need) <= self.force:
            return (touches, 0), "stick"
        return (touches, int(np.sign(need))), "slip"


STICKS, OPEN = "sticks", "open"


@dataclass
class RubbedBody(EventByEvent):
    """A body above the ground on a spring, and on a nest that presses its friction; x is its height, speed, and f.

    Heights count from rest, where the nest is pressed by `pressed`, and the spring carries the rest of the weight.
    """

    mass: float
    spring: float
    nest: Callable[[float], tuple[float, float]]  # force and stiffness over the way by which it is pressed
    pressed: float
    down: float  # friction over the nest's force, of motions downwards
    up: float
    above: float  # by so much more it begins to slide
    series: float | None
    begin: tuple[float, float]
    scale = np.array([1e-9, 1e-7, 1e-3]) * 1e-5

    def first_mode(self):
        x = self.start()
        if self.pressed < x[0]:
            return (OPEN,)
        if self.series:
            return (STICKS,)
        need, force = self.pull(x), self.nest(self.pressed - x[0])[0]
        sticks = x[1] == 0.0 and abs(need) <= self.above * self.factor(need) * force
        return (STICKS if sticks else int(np.sign(x[1] or need)),)

    def start(self):
        return np.array([*self.begin, 0.0])

    def pull(self, x):
        """Force of springs and weight beyond that at rest."""
        return self.nest(self.pressed - x[0])[0] - self.nest(self.pressed)[0] - self.spring * x[0]

    def factor(self, side):
        return self.up if side > 0 else self.down

    def friction(self, x, mode):
        if mode == OPEN:
            return 0.0
        if mode == STICKS:
            return x[2] if self.series else self.pull(x)
        return mode * self.factor(mode) * self.nest(self.pressed - x[0])[0]

    def rates(self, t, x, mode):
        f = self.friction(x, mode)
        held = mode == STICKS and not self.series
        grows = self.series * x[1] if mode == STICKS and self.series else 0.0
        return np.array([0.0 if held else x[1], 0.0 if held else (self.pull(x) - f) / self.mass, grows])

    def slip(self, x, side):
        """How fast it slides to a side: with a spring in series, that of the face behind it."""
        v = side * x[1]
        return v if not self.series else v + self.factor(side) * self.nest(self.pressed - x[0])[1] * x[1] / self.series

    def gaps(self, t, x, mode):
        """What falls through zero: of the friction, of the nest, and of the nest's corner."""
        force, _ = self.nest(self.pressed - x[0])
        left = self.pressed - x[0]
        if mode == OPEN:
            return np.array([-left, 1.0])
        if mode == STICKS:
            f = self.friction(x, mode)
            return np.array([self.above * self.factor(f) * force - abs(f), left if f == 0.0 else 1.0])
        return np.array([self.slip(x, mode), left])

    def after(self, t, x, mode, which):
        if which == 1:
            x[2] = 0.0
            return (OPEN,), "leave"
        if mode == OPEN:
            side = int(np.sign(x[1]))
            k = self.nest(1e-12)[1]
            if self.series and self.series * abs(x[1]) <= self.above * self.factor(side) * k * -x[1]:
                return (STICKS,), "meet"
            return (side,), "meet"
        if mode == STICKS:
            side = int(np.sign(self.friction(x, mode)))
            return (side,), "slip"
        if self.series:
            x[2] = self.friction(x, mode)
            return (STICKS,), "stick"
        x[1] = 0.0
        need, force = self.pull(x), self.nest(self.pressed - x[0])[0]
        if abs(need) <= self.factor(need) * force:
            return (STICKS,), "stick"
        return (int(np.sign(need)),), "slip"
