"""Run the cases with general solvers, on the equations of motion in time that `truth.Model` states.

    python benchmarks/open/run_peers.py RESULTS_FOLDER [--program dop853] [--case NAME]

`dop853` (SciPy) and `cvode` (SUNDIALS' Adams method by scikit-sundae) are what a careful user writes: events, a restart
at each of them, tolerances of 1e-12. `heyoka` gets the regularised equations (`run_heyoka.py`), but for rails: they
would be compiled at each of their elements. `naive` is SciPy's RK45 with its default tolerances over the whole
duration. It looks for losses and maxima at its own steps, and runs what needs no other change of the equations.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from reading import Row, names, read, write
from scipy.integrate import solve_ivp
from truth import Model

TOLERANCE = 1e-12
LONGEST = 1e-4
"""Longest step, s. A longer one in flight goes over the whole flight, and the impact is not seen."""
STILL = 1e-8
"""m/s; a contact whose indentation changes more slowly is at an extreme."""
AT_ROOT = 2
"""CVODE's status where it stopped at a root."""
Vector = np.ndarray[Any, Any]
Guards = dict[tuple[str, int], Callable[[float, Vector], float]]
Leg = tuple[float, Vector, tuple[str, int] | None]


class InTime(Model):
    """The equations in time: unknowns are displacements, velocities and the amplitudes of modes."""

    def __init__(self, case: dict[str, Any]) -> None:
        super().__init__(case, np.float64, math.pi)
        self.unknowns = self.state[1 + len(self.rows) :]
        self.found: list[Row] = []
        self.least = case["ask"]["maxima_above"]
        d, count = len(self.mass), len(self.unknowns)
        self.scales = np.concatenate([np.full(d, self.depth), np.full(d, 0.1), np.full(count - 2 * d, 1.0)])
        self.scales[2 * d :] = np.abs(self.unknowns[2 * d :]).max(initial=0.0)

    def look(self, t: float, x: Vector) -> tuple[Any, ...]:
        """Return what `rates` returns."""
        d = len(self.mass)
        a = np.ascontiguousarray(x[2 * d :]).view(complex) if self.ring else None
        return self.rates(t, x[:d], x[d : 2 * d], a, self.pressed)

    def pressed(self, rate: Vector, gap: Vector, r: Any) -> Vector:
        """Return the contact forces from gaps δ + r·N."""
        own = enumerate(self.touching)
        return np.array([self.press(self.root(gap[i], r), rate[i], i) if on else 0.0 for i, on in own])

    def root(self, gap: float, r: float) -> float:
        """Return the square root of δ, where δ + r·C·δ^1.5 is the gap."""
        u = math.sqrt(max(gap, 0.0))
        for _ in range(8 if r and u else 0):
            u -= (u * u + r * self.constant * u**3 - gap) / (2 * u + 3 * r * self.constant * u * u)
        return u

    def slope(self, t: float, x: Vector) -> Vector:
        """Return the derivative of the unknowns."""
        found, d = self.look(t, x), len(self.mass)
        more = [found[1].view(float)] if self.ring else []
        return np.concatenate([x[d : 2 * d], found[0], *more])

    def trend_of(self, t: float, x: Vector, i: int) -> float:
        """Return what has the sign of N'."""
        found = self.look(t, x)
        return float(self.trend(self.root(found[2][i], found[4]), found[3][i], i, found, t))

    def guards(self) -> Guards:
        """Return the functions whose fall through zero is an event; all of them but a maximum end a leg."""
        d = len(self.mass)
        out: Guards = {}
        for i, on in enumerate(self.touching):
            out["loss" if on else "impact", i] = self.signed(1 if on else -1, lambda t, x, i=i: self.look(t, x)[2][i])
            if not on:
                continue
            out["maximum", i] = self.signed(1, lambda t, x, i=i: self.trend_of(t, x, i))
            if self.eta:
                free = self.released[i]
                grip = self.signed(-1 if free else 1, lambda t, x, i=i: 1 + self.eta * self.look(t, x)[3][i])
                out["return" if free else "release", i] = grip
            if self.law == "thornton" and not (self.yielding and self.memory):
                far = self.signed(-1 if self.yielding else 1, lambda t, x, i=i: self.onset**2 - self.look(t, x)[2][i])
                out["recover" if self.yielding else "yield", i] = far
        for j, e in enumerate(self.sliders):
            if self.side[j]:
                out["stick", j] = self.signed(self.side[j], lambda t, x, e=e: e @ x[d : 2 * d])
                continue
            for sign, kind in ((-1, "slip +"), (1, "slip -")):
                out[kind, j] = self.signed(
                    sign, lambda t, x, j=j, s=sign: self.friction(x[:d])[j] + s * self.slip["force"]
                )
        return out

    @staticmethod
    def signed(sign: int, function: Callable[..., Any]) -> Callable[[float, Vector], float]:
        """Return a function times a sign."""
        return lambda t, x: float(sign * function(t, x))

    def ends(self, kind: str) -> bool:
        """Return whether an event ends a leg."""
        return kind != "maximum" or (self.yielding and self.memory)

    def leg(self, t: float, x: Vector, guards: Guards) -> Leg:
        """March to the next event or edge by DOP853."""
        events = []
        for (kind, _), guard in guards.items():
            guard.direction, guard.terminal = -1.0, self.ends(kind)  # type: ignore[attr-defined]
            events.append(guard)
        run: Any = solve_ivp(
            self.slope, (t, self.edges[0]), x, "DOP853", events=events, rtol=TOLERANCE, atol=TOLERANCE * self.scales,
            max_step=LONGEST,
        )  # fmt: skip
        if run.status < 0:
            raise RuntimeError(run.message)
        ended = None
        for key, times, states in zip(guards, run.t_events, run.y_events, strict=True):
            for now, there in zip(times, states, strict=True) if key[0] == "maximum" else ():
                self.note("maximum", key[1], now, self.look(now, there)[6][key[1]])
            ended = key if len(times) and self.ends(key[0]) else ended
        return float(run.t[-1]), run.y[:, -1].copy(), ended

    def run(self) -> list[Row]:
        """Return the answer."""
        t, x = 0.0, self.unknowns
        while self.edges:
            t, x, ended = self.leg(t, x, self.guards())
            before = [self.trend_of(t, x, i) for i in range(len(self.rows))]
            if ended:
                self.change(*ended, t, x)
            else:
                self.pass_edge(t, x)
            soon = t + 1e-7, x + 1e-7 * self.slope(t, x)
            for i, on in enumerate(self.touching):  # maxima at kinks, and in the instant of another event
                rising = before[i] > -STILL if ended else before[i] > 0
                if on and rising and self.trend_of(t, x, i) < STILL and self.trend_of(*soon, i) < 0:
                    self.note("maximum", i, t, self.look(t, x)[6][i])
        return [*self.found, *state_rows(self, x)]

    def note(self, kind: str, i: int, t: float, value: Any = None) -> None:
        """Note an event, or a maximum that is asked for and not yet known."""
        known = any(row[:2] == (kind, i + 1) and abs(row.time - t) < 1e-9 for row in self.found)
        if value is None or (value > self.least and not known):
            self.found.append(Row(kind, i + 1, t, value))

    def change(self, kind: str, i: int, t: float, x: Vector) -> None:
        """Go over to what holds behind an event."""
        if kind == "maximum":
            found = self.look(t, x)
            self.unload(math.sqrt(found[2][i]), found[6][i])
            return
        said = self.switch(kind, i, x[: len(self.mass)])
        if said:
            self.note(said, i, t)

    def pass_edge(self, t: float, x: Vector) -> None:
        """Go over to the next pieces of the paths, the next element of the track."""
        turns = self.next_edge()
        if turns is not None:
            x[2 * len(self.mass) :] = (x[2 * len(self.mass) :].view(complex) * turns).view(float)
        gap = self.look(t, x)[2]
        for i in np.flatnonzero([on and gap[i] < -1e-9 for i, on in enumerate(self.touching)]):
            self.touching[i] = False
            self.note("loss", int(i), t)


class Cvode(InTime):
    """The same, by CVODE."""

    def leg(self, t: float, x: Vector, guards: Guards) -> Leg:
        """March to the next event or edge."""
        from sksundae.cvode import CVODE  # type: ignore[import-untyped]

        keys, end = list(guards), self.edges[0]

        def slope(now: float, unknowns: Vector, out: Vector) -> None:
            out[:] = self.slope(now, unknowns)

        def roots(now: float, unknowns: Vector, out: Vector) -> None:
            out[:] = [guard(now, unknowns) for guard in guards.values()]

        roots.terminal = [self.ends(kind) for kind, _ in keys]  # type: ignore[attr-defined]
        roots.direction = [-1] * len(keys)  # type: ignore[attr-defined]
        solver = CVODE(
            slope, method="Adams", rtol=TOLERANCE, atol=TOLERANCE * self.scales, eventsfn=roots, num_events=len(keys),
            max_num_steps=1_000_000, max_step=LONGEST,
        )  # fmt: skip
        solver.init_step(t, x)
        while True:
            run = solver.step(end, tstop=end)
            if not run.success:
                raise RuntimeError(run.message)
            if run.status != AT_ROOT:
                return float(end), run.y.copy(), None
            now, there = float(run.t_events[-1]), run.y_events[-1].copy()
            hit = [key for key, found in zip(keys, run.i_events[-1], strict=True) if found]
            for kind, i in hit:
                if kind == "maximum":
                    self.note("maximum", i, now, self.look(now, there)[6][i])
            for key in hit:
                if self.ends(key[0]):
                    return now, there, key


def state_rows(model: InTime, x: Vector) -> list[Row]:
    """Return the rows of the state at the end."""
    q, v = np.split(x[: 2 * len(model.mass)], 2)
    both = (("displacement", q), ("velocity", v))
    return [Row(kind, k, model.end, one) for kind, values in both for k, one in enumerate(values, 1)]


def naive(case: dict[str, Any]) -> list[Row]:
    """Return what RK45 finds that knows of no events."""
    model = InTime(case)

    def slope(t: float, x: Vector) -> Vector:
        model.enter(t)
        return model.slope(t, x)

    run: Any = solve_ivp(slope, (0.0, model.end), model.unknowns)
    gaps, forces = [], []
    for t, x in zip(run.t, run.y.T, strict=True):
        model.enter(t)
        found = model.look(t, x)
        gaps.append(found[2])
        forces.append(found[6])
    for i in range(len(model.rows)):
        gap, force = np.array(gaps)[:, i], np.array(forces)[:, i]
        for k in range(1, len(gap)):
            if (gap[k] > 0) != (gap[k - 1] > 0):
                share = gap[k - 1] / (gap[k - 1] - gap[k])
                model.note("impact" if gap[k] > 0 else "loss", i, run.t[k - 1] + (run.t[k] - run.t[k - 1]) * share)
            if k + 1 < len(gap) and force[k - 1] < force[k] >= force[k + 1]:
                model.note("maximum", i, run.t[k], force[k])
    return [*model.found, *state_rows(model, run.y[:, -1])]


def run(name: str, program: str) -> list[Row] | None:
    """Return the answer of a program to a case, or None where it does not run it."""
    case = read(name)
    if program == "heyoka":
        from run_heyoka import Taylor

        return None if "track" in case else Taylor(case).run()
    if program != "naive":
        return (InTime if program == "dop853" else Cvode)(case).run()
    left_out = case["family"] in ("rails", "plastic") or "friction" in case or "start" in case
    return None if left_out else naive(case)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--program", default="dop853", choices=("dop853", "cvode", "heyoka", "naive"))
    parser.add_argument("--case", choices=names())
    options = parser.parse_args()
    for name in [options.case] if options.case else names():
        rows = run(name, options.program)
        if rows is not None:
            write(options.folder / f"{name}.csv", rows)


if __name__ == "__main__":
    main()
