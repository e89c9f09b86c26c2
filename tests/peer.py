"""An independent solution of a wheelset on a deck or a stiff rail, in SI units and in time, by SciPy's DOP853.

Written from the equations of motion alone, with an event and a restart at every change of the regime. It shares no code
with the package.
"""

from dataclasses import dataclass, field
from math import pi

import numpy as np
from scipy.integrate import solve_ivp

EXACT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-15}


@dataclass
class Wheel:
    mass: float
    load: float
    stiffness: float
    damping: float
    constant: float
    speed: float
    height: float = 0.0  # of a cosine bump
    length: float = 0.05
    start: float = 0.05
    hysteresis: float = 0.0
    factor: object = None  # of the position
    deck: tuple = None  # mass, stiffness, damping
    entry: float = -np.inf  # times
    leave: float = np.inf
    gravity: float = 9.81
    events: list = field(default_factory=list)

    def path(self, t):
        """Height, velocity and acceleration of the bump under the wheel."""
        x = self.speed * t - self.start
        if not 0.0 <= x <= self.length:
            return 0.0, 0.0, 0.0
        k = 2 * pi / self.length
        w = k * self.speed
        h = 0.5 * self.height
        return h * (1 - np.cos(k * x)), h * w * np.sin(k * x), h * w * w * np.cos(k * x)

    def on(self, t):
        return self.deck is not None and self.entry <= t < self.leave

    def indentation(self, t, s, on):
        y, v, _ = self.path(t)
        return y + (s[2] if on else 0.0) - s[0], v + (s[3] if on else 0.0) - s[1]

    def force(self, t, s, on):
        d, rate = self.indentation(t, s, on)
        factor = self.factor(self.speed * t) if self.factor else 1.0
        return factor * self.constant * max(d, 0.0) ** 1.5 * (1 + self.hysteresis * rate)

    def static(self):
        weight = self.load + self.mass * self.gravity
        d = (weight / self.constant) ** (2 / 3)
        for _ in range(50):
            d -= (self.constant * d**1.5 - weight + self.stiffness * d) / (
                1.5 * self.constant * d**0.5 + self.stiffness
            )
        return d, self.constant * d**1.5

    def solve(self, end):
        """Return times and kinds of losses and impacts, and the final state (y, v, Y, Z)."""
        d0, prestress = self.static()
        s, t = np.array([-d0, 0.0, 0.0, 0.0]), 0.0
        breaks = sorted({end, *(x for x in (self.start / self.speed, (self.start + self.length) / self.speed,
                                            self.entry, self.leave) if 0 < x < end)})  # fmt: skip
        touching, pulling, found = True, False, []
        while t < end:
            stop = next(b for b in breaks if b > t)
            on = self.on(0.5 * (t + stop))
            touching = self.indentation(t, s, on)[0] > 0 if t in breaks else touching

            def rates(t, s, on=on, touching=touching, pulling=pulling):
                n = self.force(t, s, on) if touching and not pulling else 0.0
                a = (
                    -self.load - self.mass * self.gravity - self.stiffness * s[0] - self.damping * s[1] + n
                ) / self.mass
                b = 0.0
                if self.deck:
                    m, k, c = self.deck
                    b = (-(n - prestress if on else 0.0) - k * s[2] - c * s[3]) / m
                return [s[1], a, s[3], b]

            def touch(t, s, on=on):
                return self.indentation(t, s, on)[0]

            def pull(t, s, on=on):
                return 1 + self.hysteresis * self.indentation(t, s, on)[1]

            touch.terminal, touch.direction = True, -1 if touching else 1
            pull.terminal, pull.direction = True, 1 if pulling else -1
            watched = [touch, pull] if touching and self.hysteresis else [touch]
            nudge = min(1e-9, 0.5 * (stop - t))
            first = solve_ivp(rates, (t, t + nudge), s, **EXACT)  # away from the event just handled
            out = solve_ivp(rates, (t + nudge, stop), first.y[:, -1], events=watched, **EXACT)
            t, s = out.t[-1], out.y[:, -1]
            if out.status == 1 and len(out.t_events[0]):
                if not pulling:  # else the force has ended before the indentation
                    found.append((t, "loss" if touching else "impact"))
                touching, pulling = not touching, False
            elif out.status == 1:
                pulling = not pulling
                found.append((t, "loss" if pulling else "impact"))
            else:
                t = stop
                now = self.indentation(t, s, self.on(t + 1e-12))[0] > 0
                if now != touching:
                    if not pulling:
                        found.append((t, "impact" if now else "loss"))
                    touching, pulling = now, False
        return found, s
