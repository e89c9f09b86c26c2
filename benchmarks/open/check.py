"""Method B: collocation at Gauss's points, in which forces are smooth in the root of the time to an impact or a loss.

    python benchmarks/open/check.py [NAME ...]    compare with the files of benchmarks/open/truth

The equations are those of README.md, one family after the other, in heights above first touch. In a step the forces of
the contacts are found by substitution, the modes of rails by their exponentials. Events are roots of the step's
polynomials. A loss ends a step that is smooth in the root of the time to it; its length is found by secants.
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from reading import HERE, STATE, Row, names, ordered, read, read_modes

Real = np.longdouble
PI = 4 * np.arctan(Real(1))
NODES, SMALL, LOOKS = 14, 2e-16, 24
Array = np.ndarray[Any, Any]
Key = tuple[str, int]


# -- Legendre's polynomials on [0, 1] ----------------------------------------------------------------------------------


def legendre(z: Any, most: int) -> Array:
    """Return P_0 … P_most at z, by rows."""
    p = [np.ones_like(z), z]
    for n in range(1, most):
        p.append(((2 * n + 1) * z * p[n] - n * p[n - 1]) / (n + 1))
    return np.array(p)


Z = np.polynomial.legendre.leggauss(NODES)[0].astype(Real)
for _ in range(3):
    P = legendre(Z, NODES)
    Z -= P[NODES] * (1 - Z * Z) / (NODES * (P[NODES - 1] - Z * P[NODES]))
P = legendre(Z, NODES)
TO_SERIES = (2 * np.arange(NODES)[:, None] + 1) * P[:NODES] * (1 - Z * Z) / (NODES * P[NODES - 1]) ** 2
"""From values at the nodes to Legendre's coefficients."""


def integrals(theta: Any) -> Array:
    """Return weights of the nodes in the integral from 0 to each theta, (thetas, nodes)."""
    p = legendre(2 * np.atleast_1d(theta) - 1, NODES)
    rows = [(p[1] + p[0]) / 2] + [(p[m + 1] - p[m - 1]) / (2 * (2 * m + 1)) for m in range(1, NODES)]
    return np.asarray(np.array(rows).T @ TO_SERIES)


THETA = (1 + Z) / 2
INNER = integrals(THETA)
LOOK = np.linspace(Real(0), Real(1), LOOKS + 1)
LOOK_ROWS = integrals(LOOK)


def value(series: Array, theta: Any) -> Any:
    """Return a Legendre series at theta."""
    return legendre(np.array([2 * theta - 1]), NODES - 1)[:, 0] @ series


def derivative(series: Array, theta: Any) -> Any:
    """Return its derivative by theta."""
    p, slope = legendre(np.array([2 * theta - 1]), NODES - 1)[:, 0], [Real(0), Real(1)]
    for n in range(1, NODES - 1):
        slope.append((2 * n + 1) * p[n] + slope[n - 1])
    return 2 * (np.array(slope) @ series)


def bisected(function: Callable[[Any], Any], low: Any, high: Any) -> Any:
    """Return the root between two places, at which the signs differ."""
    rises = function(high) > 0
    for _ in range(64):
        middle = (low + high) / 2
        low, high = (low, middle) if (function(middle) > 0) == rises else (middle, high)
    return (low + high) / 2


# -- the equations -----------------------------------------------------------------------------------------------------


def path_edges(path: dict[str, Any]) -> list[Any]:
    """Return where a path has a kink or an end, in X from its own start."""
    if path["shape"] in ("sine", "jump"):
        return [Real(0)]
    if path["shape"] == "bump":
        return [Real(0), path["length"]]
    h = abs(path["depth" if path["shape"] == "flat" else "height"])
    reach = np.sqrt(h * (2 * path["radius"] - h))
    if path["shape"] == "flat":
        return [-reach, Real(0), reach]
    return [-reach, Real(0)] if path["height"] > 0 else [Real(0), reach]


def path_height(path: dict[str, Any], x: Any, middle: Any) -> tuple[Any, Any]:
    """Return height and slope at X; `middle` says in which piece."""
    edges, shape, zero = path_edges(path), path["shape"], 0 * x
    piece = sum(edge <= middle for edge in edges)
    if piece == 0:
        return zero, zero
    if shape == "jump":
        return zero + path["height"], zero
    if shape == "sine":
        k = 2 * PI / path["length"]
        return path["height"] * np.sin(k * x), path["height"] * k * np.cos(k * x)
    if piece == len(edges):
        return (zero + path["height"] if shape == "step" else zero), zero
    if shape == "bump":
        k = 2 * PI / path["length"]
        return path["height"] / 2 * (1 - np.cos(k * x)), path["height"] / 2 * k * np.sin(k * x)
    centre, top = Real(0), zero
    if shape == "flat":
        centre = edges[0] if piece == 1 else edges[2]
    elif path["height"] > 0:
        top = path["height"]
    angle = np.arcsin((x - centre) / path["radius"])
    return top - 2 * path["radius"] * np.sin(angle / 2) ** 2, -np.tan(angle)


class Problem:
    """One case: what it says, and the regime that holds."""

    def __init__(self, case: dict[str, Any]) -> None:
        self.case, self.V, self.law = case, case["speed"], case["contact"]["law"]
        self.C, self.eta = case["contact"]["constant"], case["contact"].get("hysteresis", Real(0))
        self.rails, self.bogie, w = "track" in case, case.get("bogie", {}), case.get("wheel", {})
        self.P = self.bogie["wheel_load"] if self.bogie else w["load"] + w["mass"] * w["gravity"]
        if "body" in case:
            self.P += case["body"]["mass"] * w["gravity"]
        k = Real(0) if self.rails or self.bogie else w["stiffness"]
        self.sunk = bisected(lambda d: self.elastic(d) + k * d - self.P, Real(0), Real("0.001"))
        self.N0 = self.P - k * self.sunk
        self.contacts = 2 if self.bogie else 1
        self.lag = [Real(0), self.bogie["wheelbase"]] if self.bogie else [Real(0)]
        self.sliders = self.contacts if "friction" in case else 0
        self.slides, self.anchors = [0] * self.sliders, [Real(0)] * self.sliders
        self.closed, self.released = [True] * self.contacts, [False] * self.contacts
        self.plastic = self.law == "thornton"
        self.flowing, self.left, self.hard = False, Real(0), self.C  # yielding, δ_r, and the constant of the spot
        if self.plastic:
            self.NY = case["contact"]["yield_force"]
            self.dY = self.limit = np.cbrt((self.NY / self.C) ** 2)
        if self.rails:
            self.read_rails()

    def elastic(self, delta: Any) -> Any:
        """Return the force of the virgin contact, without damping."""
        return self.C * delta if self.law == "linear" else self.C * delta * np.sqrt(delta)

    def read_rails(self) -> None:
        """Read the modes, and let the rail rest under the wheel."""
        rows = read_modes(self.case["track"]["modes"], Real)
        count = 1 + max(int(row["mode"]) for row in rows if row["quantity"] == "rate")
        part = {"re": 1, "im": np.clongdouble(1j)}
        self.lam = np.zeros(count, np.clongdouble)
        self.shapes = {key: np.zeros((2, 9, count), np.clongdouble) for key in ("Phi", "Psi")}
        self.soft, (waves, self.weight) = np.zeros((2, 15), Real), np.zeros((2, count), Real)
        for row in rows:
            key, n, p = row["quantity"], row["mode"], row["powers"]
            if key == "rate":
                self.lam[int(n)] += part[row["part"]] * p[0]
            elif key in self.shapes:
                self.shapes[key][int(row["element"]), :, int(n)] += part[row["part"]] * np.array(p)
            elif key == "r":
                self.soft[int(row["element"])] = p
            else:
                (waves if key == "wave" else self.weight)[int(n)] = p[0]
        self.turn = np.exp(np.clongdouble(2j) * PI * waves / self.case["track"]["bays"])
        phi, psi, r = self.rail_at(np.array([Real(0)]), Real("0.01"))
        self.a0 = -psi[0] / self.lam * self.N0
        self.packed = self.sunk + r[0] * self.N0 + self.deflection(phi, self.a0)[0]

    def rail_at(self, x: Array, middle: Any) -> tuple[Array, Array, Array]:
        """Return Φ and Ψ, (places, modes), and r; `middle` says in which element."""
        half = self.case["track"]["spacing"] / 2
        number = int(np.floor(middle / half))
        tower = (2 * (x - number * half) / half - 1)[:, None] ** np.arange(15)
        phi, psi = (tower[:, :9] @ self.shapes[key][number % 2] for key in ("Phi", "Psi"))
        return phi, psi, tower @ self.soft[number % 2]

    def deflection(self, phi: Array, a: Array) -> Array:
        """Return what the modes show below the wheel."""
        return np.asarray((phi * a).real @ self.weight)

    def placed(self) -> list[tuple[int, dict[str, Any], Any]]:
        """Return each contact with each of its paths, and how far behind the front wheel's start the path begins."""
        return [
            (i, path, path["start"] + lag)
            for path in self.case.get("path", [])
            for i, lag in enumerate(self.lag)
            if path.get("contact", i + 1) == i + 1
        ]

    def paths(self, t: Array, middle: Any) -> tuple[Array, Array]:
        """Return the heights of all paths and their rates, (contacts, times)."""
        y, rate = np.zeros((2, self.contacts, len(t)), Real)
        for i, path, start in self.placed():
            height, slope = path_height(path, self.V * t - start, self.V * middle - start)
            y[i] += height
            rate[i] += self.V * slope
        return y, rate

    def edges(self) -> list[Any]:
        """Return the times at which a step has to end, and note which of them begin a bay."""
        end, V, self.seats = self.case["duration"], self.V, dict[Any, bool]()
        found = {(edge + start) / V for _, path, start in self.placed() for edge in path_edges(path)}
        if self.rails:
            half = self.case["track"]["spacing"] / 2
            self.seats = {n * half / V: n % 2 == 0 for n in range(1, int(end * V / half) + 1)}
        return [*sorted(t for t in found | set(self.seats) if 0 < t < end), end]

    def start(self) -> tuple[Array, Array]:
        """Return heights and velocities at time zero."""
        q, v = np.zeros((2, 4 if self.bogie else 2 if {"deck", "body"} & set(self.case) else 1), Real)
        q[: self.contacts] = 0 if self.rails else -self.sunk
        if "start" in self.case:
            q[0], v[0] = self.case["start"]["displacement"], self.case["start"]["velocity"]
            self.closed[0] = bool(q[0] < 0)
        return q, v

    def gap(self, path: Array, q: Array) -> Array:
        """Return δ over rails that do not give way, (contacts, times)."""
        return np.asarray(path + q[1] - q[:1] if "deck" in self.case else path - q[: self.contacts] - self.left)

    def compression(self, q: Any, j: int, still: Any = 0) -> Any:
        """Return by how much a suspension is compressed beyond `still`; of velocities, its rate."""
        if self.bogie:
            b = self.bogie["wheelbase"] / 2
            return q[j] - q[2] + (b if j else -b) * q[3] - still
        return q[0] - (q[1] if "body" in self.case else 0) - still

    def slider(self, q: Any, j: int) -> Any:
        """Return the force of a slider."""
        rule = self.case["friction"]
        if self.slides[j]:
            return self.slides[j] * rule["force"] + 0 * q[0]
        return rule["stiffness"] * (self.compression(q, j, -self.sunk) - self.anchors[j])

    def accelerations(self, q: Array, v: Array, N: Array) -> Array:
        """Return the accelerations of a family's bodies."""
        f = [self.slider(q, j) for j in range(self.sliders)] or [0 * q[0]] * self.contacts
        if self.bogie:
            b = self.bogie
            F = [
                b["primary_stiffness"] * self.compression(q, j, -self.sunk)
                + b["primary_damping"] * self.compression(v, j)
                + f[j]
                for j in range(2)
            ]
            z = (F[0] + F[1] - b["secondary_stiffness"] * q[2] - b["secondary_damping"] * v[2]) / b["frame_mass"]
            pitch = b["wheelbase"] / 2 * (F[0] - F[1]) / b["pitch_inertia"]
            return np.array([*((N[j] - self.N0 - F[j]) / b["wheelset_mass"] for j in range(2)), z, pitch])
        w = self.case["wheel"]
        pull = -self.P - w["stiffness"] * q[0] - w["damping"] * v[0] + N[0] - f[0]
        if "body" in self.case:
            d = self.case["body"]
            spring = d["stiffness"] * self.compression(q, 0, -self.sunk) + d["damping"] * self.compression(v, 0)
            return np.array([(pull - spring) / w["mass"], (spring + f[0]) / d["mass"]])
        if "deck" in self.case:
            d = self.case["deck"]
            down = self.N0 - N[0] - d["stiffness"] * q[1] - d["damping"] * v[1]
            return np.array([pull / w["mass"], down / d["mass"]])
        return np.array([pull / w["mass"]])

    def force(self, i: int, gap: Any, rate: Any, r: Any) -> Any:
        """Return the force of a closed contact whose gap is δ + r·N."""
        if self.released[i]:
            return 0 * gap
        if self.flowing:
            return self.NY * (Real(3) / 2 * (gap + self.left) / self.dY - Real(1) / 2)
        delta = gap = np.maximum(gap, 0)
        if self.law == "linear":
            return self.C * delta
        for _ in range(40 if self.rails else 0):
            excess = delta + r * self.C * delta * np.sqrt(delta) - gap
            way = excess / (1 + r * self.C * Real("1.5") * np.sqrt(delta))
            delta = np.maximum(delta - way, 0)
            if np.max(np.abs(way)) < 1e-22:
                break
        return self.hard * delta * np.sqrt(delta) * (1 + self.eta * rate)


# -- the march ---------------------------------------------------------------------------------------------------------


class Step:
    """A solved step from t0 over h; `after`: the time of an impact, `before`: whether it ends in a loss."""

    def __init__(self, of: Problem, t0: Any, start: Any, h: Any, after: Any = None, before: bool = False) -> None:
        self.of, self.t0, self.start, self.h, self.before = of, t0, start, h, before
        self.after, self.middle = None if before else after, t0 + h / 2
        q0, v0, a0 = start
        t, self.jac = self.when(THETA)
        path, self.path_rate = of.paths(t, self.middle)
        q, v = (np.repeat(one[:, None], NODES, axis=1) for one in (q0, v0))
        N, r, w = np.zeros((of.contacts, NODES), Real), np.zeros(NODES, Real), np.zeros(NODES, Real)
        if of.rails:
            phi, psi, r = of.rail_at(of.V * t, of.V * self.middle)
            grow = np.exp(np.multiply.outer(t - t0, of.lam))
        for _ in range(60):
            if of.rails:
                a = grow * (a0 + INNER @ (psi / grow * (N[0] * self.jac)[:, None]))
                w = of.deflection(phi, a) - of.packed
            self.gap, rate = of.gap(path, q) - w, of.gap(self.path_rate, v) + of.left
            closed = enumerate(of.closed)
            new = np.array([of.force(i, self.gap[i], rate[i], r) if on else 0 * t for i, on in closed])
            self.acc = of.accelerations(q, v, new)
            old, v = v, v0[:, None] + (self.acc * self.jac) @ INNER.T
            q = q0[:, None] + (v * self.jac) @ INNER.T
            change = max(np.max(np.abs(new - N)) / of.N0, np.max(np.abs(v - old)))
            N = new
            if change < 2e-18:
                break
        self.v, self.series = v, N @ TO_SERIES.T
        self.drive = psi * N[0][:, None] if of.rails else None
        force = np.abs((N * self.jac / h) @ TO_SERIES.T)[:, -2:].max() / of.N0
        pull = np.abs((self.acc * self.jac / h) @ TO_SERIES.T)[:, -2:].max(axis=1)
        tail = max(force, (pull / np.abs(self.acc).max(axis=1).clip(1)).max() * 1e-2)
        self.good = bool(change < 1e-16 and tail < SMALL)

    def when(self, theta: Any) -> tuple[Any, Any]:
        """Return the time at theta and its derivative."""
        if self.before:
            return self.t0 + self.h * (1 - (1 - theta) ** 2), 2 * self.h * (1 - theta)
        if self.after is None:
            return self.t0 + self.h * theta, self.h + 0 * theta
        low, high = np.sqrt(self.t0 - self.after), np.sqrt(self.t0 + self.h - self.after)
        sigma = low + (high - low) * theta
        return self.after + sigma**2, 2 * sigma * (high - low)

    def state(self, theta: Any, row: Array | None = None) -> tuple[Any, ...]:
        """Return positions, velocities and modes at theta."""
        row = integrals(theta)[0] if row is None else row
        q0, v0, a0 = self.start
        v, q = v0 + (self.acc * self.jac) @ row, q0 + (self.v * self.jac) @ row
        if self.drive is None:
            return q, v, None
        t, now = self.when(THETA)[0], self.when(theta)[0]
        back = np.exp(np.multiply.outer(now - t, self.of.lam))
        return q, v, np.exp(self.of.lam * (now - self.t0)) * a0 + row @ (back * self.drive * self.jac[:, None])

    def guards(self, theta: Any, row: Array | None = None) -> dict[Key, Any]:
        """Return what ends the present regime where it rises above zero."""
        of, (q, v, a) = self.of, self.state(theta, row)
        t = np.atleast_1d(self.when(theta)[0])
        path, path_rate = of.paths(t, self.middle)
        gap, rate = of.gap(path, q[:, None])[:, 0], (of.gap(path_rate, v[:, None]) + of.left)[:, 0]
        if of.rails:
            phi, _, _ = of.rail_at(of.V * t, of.V * self.middle)
            gap = gap - of.deflection(phi, a)[0] + of.packed
        out: dict[Key, Any] = {}
        for i, on in enumerate(of.closed):
            out["loss" if on else "impact", i] = -gap[i] if on else gap[i]
            if on and of.eta:
                grip = 1 + of.eta * rate[i]
                out["return" if of.released[i] else "release", i] = grip if of.released[i] else -grip
            if on and of.plastic and not of.flowing:
                out["yield", i] = gap[i] - of.limit
            if on and of.flowing:
                out["turn" if of.V == 0 else "recover", i] = -rate[i] if of.V == 0 else of.limit - gap[i]
        for j in range(of.sliders):
            if of.slides[j]:
                out["stick", j] = -of.slides[j] * of.compression(v, j)
            else:
                f, most = of.slider(q, j), of.case["friction"]["force"]
                out["up", j], out["down", j] = f - most, -f - most
        return out

    def event(self) -> tuple[Any, Key] | None:
        """Return the first root of a guard."""
        found = list[tuple[Any, Key]]()
        looks = [self.guards(x, row) for x, row in zip(LOOK, LOOK_ROWS, strict=True)]
        for key in looks[0]:

            def guard(x: Any, key: Key = key) -> Any:
                return self.guards(x)[key]

            g = np.array([look[key] for look in looks])
            tiny = np.abs(g).max() * 1e-12
            for k in range(LOOKS):
                if g[k + 1] > 0 and g[k] < (0 if k else -tiny):
                    found.append((bisected(guard, LOOK[k], LOOK[k + 1]), key))
                    break
        return min(found, key=lambda one: one[0]) if found else None


class March:
    """Method B."""

    def __init__(self, case: dict[str, Any]) -> None:
        self.of, self.rows, self.steps, self.losing = Problem(case), list[Row](), 0, 0
        self.least, self.rises = case["ask"]["maxima_above"], [False] * self.of.contacts
        self.edges = self.of.edges()

    def run(self) -> list[Row]:
        """Return the answer."""
        of, t, h, touched = self.of, Real(0), Real("1e-5"), None
        state: tuple[Any, ...] = (*of.start(), of.a0 if of.rails else None)
        while self.edges:
            room, event = self.edges[0] - t, None
            step = self.to_loss(t, state, min(h, room)) if h > 1e-9 else None
            if step is None:
                step = Step(of, t, state, min(h, room), touched if any(of.closed) else None)
                pressing = [i for i, on in enumerate(of.closed) if on and not of.released[i]]
                good = step.good and all(step.gap[i].min() >= 0 for i in pressing)
                event = step.event() if good else None
                if not good or (event and event[1] in [("loss", i) for i in pressing]):
                    h = min(h, room) / 2
                    if h < 1e-16:
                        raise RuntimeError(f"no step at {t}")
                    continue
            self.steps += 1
            full = step.h >= room and event is None
            self.maxima(step, event[0] if event else Real(1))
            if event:
                step = Step(of, t, state, step.when(event[0])[0] - t, step.after)
            elif not step.before and step.h > h * Real("0.9"):
                h *= Real("1.3")
            state = step.state(Real(1), LOOK_ROWS[-1])
            t = self.edges[0] if full else t + step.h
            kind, i = ("loss", self.losing) if step.before else event[1] if event else ("", 0)
            touched = t if kind == "impact" else touched
            if kind:
                self.change(kind, i, t, state)
            if full:
                state = self.pass_edge(t, state)
        q, v, _ = state
        if not of.rails:
            q = q + of.sunk * (np.arange(len(q)) < of.contacts)
        both = zip(STATE, (q, v), strict=True)
        return [*self.rows, *(Row(kind, k, of.case["duration"], one) for kind, x in both for k, one in enumerate(x, 1))]

    def to_loss(self, t: Any, state: Any, h: Any) -> Step | None:
        """Return a step that ends in a loss, if one is near."""
        of, short = self.of, h / 1000
        trial = Step(of, t, state, short)
        begin, end = trial.guards(Real(0), LOOK_ROWS[0]), trial.guards(Real(1), LOOK_ROWS[-1])
        for i, on in enumerate(of.closed):
            key = ("loss", i)
            if not on or of.released[i] or end[key] <= begin[key]:
                continue
            two = -begin[key] / (end[key] - begin[key]) * short
            one, before = two * Real("0.99"), None
            for _ in range(25):
                if not 0 < one < min(3 * h, self.edges[0] - t):
                    break
                step = Step(of, t, state, one, before=True)
                here = step.guards(Real(1), LOOK_ROWS[-1])[key]
                if before is not None and abs(one - before[0]) < 1e-18 * t:
                    event = step.event()
                    safe = event is None or (event[1] == key and event[0] > 1 - 1e-6)
                    if step.good and safe and step.gap[i].min() > 0:
                        self.losing = i
                        return step
                    break
                slope: Any = (here - before[1]) / (one - before[0]) if before and here != before[1] else None
                before, one = (one, here), one - here / slope if slope else two
        return None

    def maxima(self, step: Step, until: Any) -> None:
        """Note the maxima of the forces in a step."""
        for i, series in enumerate(step.series):
            if not self.of.closed[i]:
                self.rises[i] = False
                continue
            places = LOOK[until >= LOOK]
            places = np.append(places, until) if places[-1] < until else places
            places[0] += 1e-6 if step.after == step.t0 else 0  # where time has no slope over theta
            places[-1] -= 1e-6 if step.before else 0
            slopes = [derivative(series, x) for x in places]

            def slope(x: Any, series: Array = series) -> Any:
                return derivative(series, x)

            if self.rises[i] and slopes[0] < 0:
                self.peak(i, step, places[0])
            for k in range(len(places) - 1):
                if slopes[k] > 0 >= slopes[k + 1]:
                    self.peak(i, step, bisected(slope, places[k], places[k + 1]))
            self.rises[i] = bool(slopes[-1] > 0)

    def peak(self, i: int, step: Step, theta: Any) -> None:
        """Note a maximum, once."""
        N, t = value(step.series[i], theta), step.when(theta)[0]
        known = any(row[:2] == ("maximum", i + 1) and abs(row.time - t) < 1e-10 for row in self.rows)
        if self.least < N and not known:
            self.rows.append(Row("maximum", i + 1, t, N))

    def change(self, kind: str, i: int, t: Any, state: Any) -> None:
        """Note an event and go over to the next regime."""
        of, said = self.of, kind
        if kind in ("loss", "impact"):
            said = "" if of.released[i] else kind
            of.closed[i], of.released[i], self.rises[i] = kind == "impact", False, False
        elif kind in ("release", "return"):
            of.released[i] = kind == "release"
            said = "loss" if of.released[i] else "impact"
        elif kind in ("yield", "recover"):
            of.flowing = kind == "yield"
            said = "yield" if of.flowing else ""
        elif kind == "turn":
            deepest = -state[0][0]
            N = of.NY * (Real(3) / 2 * deepest / of.dY - Real(1) / 2)
            of.limit = of.dY * (N / of.NY) / np.sqrt(deepest / of.dY)
            of.left, of.flowing, self.rises[i] = deepest - of.limit, False, True
            of.hard = N / of.limit / np.sqrt(of.limit)
            said = ""
        elif kind == "stick":
            rule = of.case["friction"]
            slid = of.slides[i] * rule["force"] / rule["stiffness"]
            of.anchors[i], of.slides[i] = of.compression(state[0], i, -of.sunk) - slid, 0
        else:
            of.slides[i], said = (1 if kind == "up" else -1), "slip"
        if said:
            self.rows.append(Row(said, i + 1, t, None))

    def pass_edge(self, t: Any, state: Any) -> tuple[Any, ...]:
        """Go over an edge of the paths or of the track."""
        of, (q, v, a) = self.of, state
        self.edges.pop(0)
        if of.seats.get(t):
            a = a * of.turn
        if self.edges and any(path["shape"] == "jump" for path in of.case.get("path", [])):
            path, _ = of.paths(np.array([t]), (t + self.edges[0]) / 2)
            if of.closed[0] and of.gap(path, q[:, None])[0, 0] < 0:
                self.change("loss", 0, t, state)
        return q, v, a


def differences(name: str, found: list[Row]) -> tuple[float, float, float]:
    """Return the largest differences to the truth: of times over duration, of forces and of the state at the end."""
    case = read(name, Real)
    with (HERE / "truth" / f"{name}.csv").open(encoding="utf-8", newline="") as file:
        truth = [Row(kind, int(n), Real(t), Real(x) if x else None) for kind, n, t, x in list(csv.reader(file))[1:]]
    found = ordered(found)
    if [row[:2] for row in truth] != [row[:2] for row in found]:
        raise RuntimeError(f"{name}: other rows")
    pairs = list(zip(truth, found, strict=True))
    top = max(row.value for row in truth if row.kind == "maximum")
    time = max(abs(a.time - b.time) for a, b in pairs) / case["duration"]
    force = max(abs(a.value - b.value) for a, b in pairs if a.kind == "maximum") / top
    end = max(abs(a.value - b.value) / case["ask"][a.kind] for a, b in pairs if a.kind in STATE)
    return float(time), float(force), float(end)


def main() -> None:
    lines = ["case,times,forces,state"]
    for name in sys.argv[1:] or names():
        march = March(read(name, Real))
        lines.append(name + "".join(f",{one:.0e}" for one in differences(name, march.run())))
        print(f"{lines[-1]}  ({march.steps} steps)", flush=True)
    if not sys.argv[1:]:
        (HERE / "agreement.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
