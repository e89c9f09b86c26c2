"""Another program for dry friction, event by event: scipy's DOP853 with brackets and Brent's roots between the events.

It knows one body on one wheelset on Hertz's contact, with a spring and one friction element between them, moving
vertically; and shares no line with the package. Sticking with a spring, the friction force is a state: f' = s·(rate of
the deflection). Rigid, body and wheelset have one acceleration, and f is what that needs.
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


@dataclass
class QuarterWagon:
    body: float
    wheelset: float
    spring: float
    contact: float  # of both wheels, N/m^1.5
    force: float
    limit: float
    series: float | None
    path: Callable[[float], float]
    begins: int = 0

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

    def gap_along(self, motion, mode, which, t):
        return self.gaps(t, motion(t), *mode)[which]

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

    def march(self, breaks, end, longest=2e-4):
        """Return all events, [(time, kind)], and the state at the end."""
        t, x, mode, events = 0.0, self.start(), (True, self.begins), []
        scale = np.array([1e-9, 1e-7, 1e-9, 1e-7, 1e-3]) * 1e-4
        borders = [*sorted(b for b in breaks if b < end), end]
        quiet = np.zeros(2)
        while t < end:
            until = next(b for b in borders if b > t)
            step = solve_ivp(
                self.rates, (t, min(until, t + longest)), x, args=mode, method="DOP853", rtol=1e-13, atol=scale,
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
