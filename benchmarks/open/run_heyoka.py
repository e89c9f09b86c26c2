"""Marching by heyoka, for `run_peers.py`: Taylor series at round-off, and its own location of events.

The equations are those of `truth.Model`, with symbols in place of numbers. Where contacts are closed, the roots u of
their indentations are states and dt = Π(u/u0)·dτ, as in `truth.py`. Each leg from event to event is compiled anew.
"""

from __future__ import annotations

import math
from functools import partialmethod
from typing import Any

import heyoka as hy  # type: ignore[import-untyped]
import numpy as np
from run_peers import Guards, InTime, Leg, Vector

FAR, LONGEST = 1e9, 1e-3
"""A final value of τ that is never reached, and the longest step: roots of too long series are not found."""
NUDGE = 1e-20
"""Indentation at an impact or a loss, m: a start at exactly zero hides heyoka's next root of the same function."""
ROUNDING = 1e-14
"""Share of friction's largest force by which a slip is late: a slider that has just stuck has this force."""
for function in ("sin", "cos", "sqrt"):  # NumPy calls these methods of what is not a number
    setattr(hy.expression, function, partialmethod(getattr(hy, function)))


class Taylor(InTime):
    """The equations as symbols."""

    def height(self, t: Any) -> Vector:
        """Return height, slope and second derivative of all paths, (3, contacts)."""
        found = np.zeros((3, len(self.rows)), type(t) if isinstance(t, float) else object)
        for i, start, shape in self.now:
            found[:, i] += shape(self.speed * t - start)
        return found

    def friction(self, q: Vector) -> Vector:
        """Return the forces of the sliders."""
        own = zip(self.sliders, self.side, self.anchor, strict=True)
        return np.array([s * self.slip["force"] if s else self.slip["stiffness"] * (e @ q - at) for e, s, at in own])

    def leg(self, t: float, x: Vector, guards: Guards) -> Leg:
        """March to the next event or edge."""
        n, d = len(self.rows), len(self.mass)
        time, roots = hy.make_vars("t"), [hy.make_vars(f"u{i}") for i in range(n)]
        q, v = (np.array([hy.make_vars(f"{name}{k}") for k in range(d)], object) for name in "qv")
        found = self.rates(time, q, v, None, lambda rate, gap, r: self.forces(roots, rate))
        acceleration, rate = found[0], found[3]
        shares = [u / math.sqrt(self.depth) if on else 1.0 for u, on in zip(roots, self.touching, strict=True)]
        pace = math.prod(shares)
        system = [(time, pace), *zip(q, pace * v, strict=True), *zip(v, pace * acceleration, strict=True)]
        closed, there = np.flatnonzero(self.touching), self.look(t, x)[2]
        begun = [math.sqrt(max(there[i], NUDGE)) for i in closed]
        others = [math.prod(np.delete(shares, i)) / (2.0 * math.sqrt(self.depth)) for i in closed]
        system += [(roots[i], other * rate[i]) for i, other in zip(closed, others, strict=True)]
        falling = self.symbols(guards, q, v, roots, found, time)
        keys = [key for key in falling if self.ends(key[0])]
        state = np.array([t, *x, *begun])

        def note(i: int) -> Any:
            def at_maximum(integrator: Any, s: float, _: int) -> None:
                integrator.update_d_output(s)
                now, *unknowns = integrator.d_output[: 1 + 2 * d]
                self.note("maximum", i, now, self.look(now, np.array(unknowns))[6][i])

            return at_maximum

        down = hy.event_direction.negative
        integrator = hy.taylor_adaptive(
            [(name, hy.expression(0.0) + its) for name, its in system], state.tolist(), tol=0.0,
            t_events=[*(hy.t_event(falling[key], direction=down) for key in keys), hy.t_event(time - self.edges[0])],
            nt_events=[
                hy.nt_event(its, callback=note(key[1]), direction=down)
                for key, its in falling.items() if not self.ends(key[0])
            ],
        )  # fmt: skip
        outcome = -1 - int(integrator.propagate_until(FAR, max_delta_t=LONGEST)[0])
        if not 0 <= outcome <= len(keys):
            raise RuntimeError("heyoka has stopped without an event")
        now, *unknowns = integrator.state[: 1 + 2 * d]
        if outcome == len(keys):
            return self.edges[0], np.array(unknowns), None
        kind, i = ended = keys[outcome]
        if kind == "maximum":
            self.note("maximum", i, now, self.look(now, np.array(unknowns))[6][i])
        return now, np.array(unknowns), ended

    def forces(self, roots: list[Any], rate: Vector) -> Vector:
        """Return the contact forces from the roots of the indentations."""
        own = enumerate(self.touching)
        return np.array([self.press(roots[i], rate[i], i) if on else 0.0 for i, on in own], object)

    def symbols(
        self, guards: Guards, q: Vector, v: Vector, roots: list[Any], found: tuple[Any, ...], time: Any
    ) -> dict[tuple[str, int], Any]:
        """Return the functions whose fall through zero is an event, as `guards` names them."""
        gap, rate = found[2], found[3]
        out: dict[tuple[str, int], Any] = {}
        for kind, i in guards:
            if kind in ("loss", "impact"):
                out[kind, i] = roots[i] if kind == "loss" else NUDGE - gap[i]
            elif kind in ("release", "return"):
                out[kind, i] = (1.0 if kind == "release" else -1.0) * (1.0 + self.eta * rate[i])
            elif kind in ("yield", "recover"):
                out[kind, i] = (1.0 if kind == "yield" else -1.0) * (self.onset - roots[i])
            elif kind == "maximum":
                out[kind, i] = self.trend(roots[i], rate[i], i, found, time)
            elif kind == "stick":
                out[kind, i] = self.side[i] * (self.sliders[i] @ v)
            else:
                sign = -1.0 if kind == "slip +" else 1.0
                out[kind, i] = self.slip["force"] * (1.0 + ROUNDING) + sign * self.friction(q)[i]
        return out
