"""Method A: extrapolation (Gragg, Bulirsch, Stoer) of the regularised equations, in numbers with 64 bits of mantissa.

    python benchmarks/open/truth.py [NAME ...]    write the answers to benchmarks/open/truth

Where contacts are closed, the root u of the indentation of each is a state of its own, and dt = Π(u/u0)·dτ. All
unknowns are analytic in τ, also where u passes zero. An event is a root of a function of the state: the step is
repeated with the length that Newton's method gives, until it ends there. All families are one system (`Model`).
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from reading import HERE, STATE, Row, names, read, read_modes, write

Long = np.longdouble
PI = Long("3.14159265358979323846264338327950288")
SEQUENCE = tuple(range(2, 18, 2))
TOLERANCE = 3e-16
LOOKS = 6
"""Places of a step in which the signs of all functions are looked at."""
TINY = 1e-12
"""Share of a function's size within which it is zero."""
Vector = np.ndarray[Any, Any]
Shape = Callable[[Any], tuple[Any, Any, Any]]
Key = tuple[str, int]


def level(height: Any) -> Shape:
    """Return a level path: height, slope and second derivative over X."""
    return lambda x: (height, 0 * x, 0 * x)


def wave(mean: Any, amplitude: Any, k: Any, phase: Any) -> Shape:
    """Return mean + amplitude·sin(k·X + phase)."""

    def shape(x: Any) -> tuple[Any, Any, Any]:
        sine, cosine = amplitude * np.sin(k * x + phase), amplitude * np.cos(k * x + phase)
        return mean + sine, k * cosine, -k * k * sine

    return shape


def arc(radius: Any, corner: Any, up: Any) -> Shape:
    """Return the path of a circle's centre about a corner."""

    def shape(x: Any) -> tuple[Any, Any, Any]:
        s = x - corner
        root = np.sqrt(radius * radius - s * s)
        return up - s * s / (radius + root), -s / root, -radius * radius / root**3

    return shape


def pieces(path: dict[str, Any], pi: Any) -> list[tuple[Any, Shape]]:
    """Return where each piece of a path begins, in X from the path's start, and the path there."""
    kind, zero = path["shape"], 0 * path["start"]
    if kind == "jump":
        return [(zero, level(path["height"]))]
    if kind == "sine":
        return [(zero, wave(zero, path["height"], 2 * pi / path["length"], zero))]
    if kind == "bump":
        half = path["height"] / 2
        return [(zero, wave(half, half, 2 * pi / path["length"], -pi / 2)), (path["length"], level(zero))]
    radius, h = path["radius"], path["depth" if kind == "flat" else "height"]
    reach = np.sqrt(2 * radius * abs(h) - h * h)
    if kind == "flat":
        return [(-reach, arc(radius, -reach, zero)), (zero, arc(radius, reach, zero)), (reach, level(zero))]
    if h > 0:
        return [(-reach, arc(radius, zero, h)), (zero, level(h))]
    return [(zero, arc(radius, zero, zero)), (reach, level(h))]


class Ring:
    """The modes of the rails."""

    def __init__(self, track: dict[str, Any], number: Any, pi: Any) -> None:
        rows, one = read_modes(track["modes"], number), np.result_type(number, np.complex64)
        self.spacing, self.elements = track["spacing"], track["elements"]
        n = self.count = 1 + max(int(row["mode"] or 0) for row in rows)
        self.rates, waves, self.weights = np.zeros(n, one), np.zeros(n, number), np.zeros(n, number)
        self.table = np.zeros((self.elements, 15, 2 * n + 1), one)  # Φ, Ψ and r by powers
        start = {"Phi": 0, "Psi": n, "r": 2 * n}
        for row in rows:
            key, mode, unit = row["quantity"], int(row["mode"] or 0), 1j if row["part"] == "im" else 1
            if key in start:
                powers = np.array(row["powers"])
                self.table[int(row["element"]), : len(powers), start[key] + mode] += unit * powers
            elif key == "rate":
                self.rates[mode] += unit * row["powers"][0]
            else:
                (waves if key == "wave" else self.weights)[mode] = row["powers"][0]
        phase = 2 * pi * waves / track["bays"]
        self.turns = np.cos(phase) + 1j * np.sin(phase)

    def at(self, x: Any, step: int) -> tuple[Any, ...]:
        """Return Φ, Φ', Ψ, r and r' at x, in the element `step`, counted from x = 0."""
        width, n = self.spacing / self.elements, self.count
        powers = (2 * (x / width - step) - 1) ** np.arange(15)
        slopes = np.append(0 * x, np.arange(1, 15) * powers[:-1]) * 2 / width
        here, there = powers @ self.table[step % self.elements], slopes @ self.table[step % self.elements]
        return here[:n], there[:n], here[n : 2 * n], here[-1].real, there[-1].real


class Model:
    """The equations of all families as one, displacements q from the static state.

    M·q'' = Σ b·(N - N0) - K·q - C·q' - Σ e·f,  D = δ0 + path - b·q - rail = δ + r·N,  f = k_f·(e·q - anchor) or ±F.
    """

    def __init__(self, case: dict[str, Any], number: Any = Long, pi: Any = PI) -> None:
        self.case, self.number, zero = case, number, number(0)
        self.speed, self.end = case["speed"], case["duration"]
        self.law, self.constant = case["contact"]["law"], case["contact"]["constant"]
        self.eta = case["contact"].get("hysteresis", zero)
        self.set_bodies(case)
        self.touching, self.released = [True] * len(self.rows), [False] * len(self.rows)
        self.slip: Any = case.get("friction")
        self.side, self.anchor = [0] * len(self.sliders), [zero] * len(self.sliders)
        self.memory, self.yielding, self.residual, self.factor = self.speed == 0, False, zero, self.constant
        if self.law == "thornton":
            self.yield_force = case["contact"]["yield_force"]
            self.yield_depth = (self.yield_force / self.constant) ** (number(2) / 3)
            self.onset = np.sqrt(self.yield_depth)
        self.set_paths(case, pi)
        q, v = np.zeros((2, len(self.mass)), number)
        if "start" in case:
            q[0], v[0] = case["start"]["displacement"] + self.depth, case["start"]["velocity"]
            self.touching[0] = bool(case["start"]["displacement"] < 0)
        self.ring: Ring | None = None
        self.step, self.rail0 = 0, zero
        self.state = np.concatenate([[zero], np.full(len(self.rows), np.sqrt(self.depth)), q, v])
        if "track" in case:
            self.ring = Ring(case["track"], number, pi)
            phi, _, psi, r, _ = self.ring.at(zero, 0)
            a = -psi * self.static / self.ring.rates
            self.rail0 = np.sum(self.ring.weights * (phi * a).real) + r * self.static
            self.state = np.concatenate([self.state, a.view(number)])

    def set_bodies(self, case: dict[str, Any]) -> None:
        """Set masses, matrices, and the rows of contacts and sliders."""
        number = self.number
        if "bogie" in case:
            b = case["bogie"]
            half, self.static, self.behind = b["wheelbase"] / 2, b["wheel_load"], [number(0), b["wheelbase"]]
            self.mass = np.array([b["wheelset_mass"], b["wheelset_mass"], b["frame_mass"], b["pitch_inertia"]])
            springs = np.array([[1, 0, -1, -half], [0, 1, -1, half]], number)
            frame = np.diag(np.array([0, 0, 1, 0], number))
            self.stiffness = b["primary_stiffness"] * springs.T @ springs + b["secondary_stiffness"] * frame
            self.damping = b["primary_damping"] * springs.T @ springs + b["secondary_damping"] * frame
            self.rows, self.sliders = np.eye(2, 4, dtype=number), springs[: 2 * ("friction" in case)]
            self.depth = self.indentation(self.static)
            return
        w: Any = case["wheel"]
        other: Any = case.get("deck") or case.get("body")
        weight = w["load"] + (w["mass"] + (other["mass"] if "body" in case else 0)) * w["gravity"]
        guide = number(0) if "track" in case else w["stiffness"]  # on rails without force in the static state
        self.depth, self.behind = self.indentation(weight, guide), [number(0)]
        self.static = weight - guide * self.depth
        tie = np.array([[1, -1], [-1, 1]] if "body" in case else [[0, 0], [0, 1]], number)
        size, both = (2 if other else 1), other or {"mass": w["mass"], "stiffness": 0, "damping": 0}
        self.mass = np.array([w["mass"], both["mass"]])[:size]
        first = np.diag(np.array([1, 0], number))
        self.stiffness = (w["stiffness"] * first + both["stiffness"] * tie)[:size, :size]
        self.damping = (w["damping"] * first + both["damping"] * tie)[:size, :size]
        self.rows = np.array([[1, -1 if "deck" in case else 0]], number)[:, :size]
        self.sliders = np.array([[1, -1]], number)[: "friction" in case, :size]

    def indentation(self, weight: Any, stiffness: Any = 0) -> Any:
        """Return δ0, which balances N(δ0) + k·δ0 = weight."""
        if self.law == "linear":
            return weight / (self.constant + stiffness)
        u = (weight / self.constant) ** (self.number(1) / 3)
        for _ in range(60):
            wrong = self.constant * u**3 + stiffness * u**2 - weight
            u -= wrong / (3 * self.constant * u**2 + 2 * stiffness * u)
        return u * u

    def set_paths(self, case: dict[str, Any], pi: Any) -> None:
        """Set the pieces of all paths, and the times at which a piece or an element of the track begins."""
        self.courses = [
            (i, path["start"] + behind, pieces(path, pi))
            for path in case.get("path", [])
            for i, behind in enumerate(self.behind)
            if path.get("contact", i + 1) == i + 1
        ]
        edges = {(start + x) / self.speed for _, start, course in self.courses for x, _ in course}
        self.seats: list[Any] = []
        if "track" in case:
            width = case["track"]["spacing"] / case["track"]["elements"]
            self.seats = [k * width / self.speed for k in range(1, int(self.end * self.speed / width) + 1)]
        self.edges = [*sorted(t for t in edges | set(self.seats) if 0 < t < self.end), self.end]
        self.enter(self.edges[0] / 2)

    def enter(self, middle: Any) -> None:
        """Take the pieces of the paths that hold at a time."""
        self.now = []
        for i, start, course in self.courses:
            before = [shape for x, shape in course if start + x <= middle * self.speed]
            self.now += [(i, start, shape) for shape in before[-1:]]

    def height(self, t: Any) -> Vector:
        """Return height, slope and second derivative of all paths, (3, contacts)."""
        found = np.zeros((3, len(self.rows)), self.number)
        for i, start, shape in self.now:
            found[:, i] += shape(self.speed * t - start)
        return found

    def friction(self, q: Vector) -> Vector:
        """Return the forces of the sliders."""
        rule, own = self.slip, zip(self.sliders, self.side, self.anchor, strict=True)
        return np.array([s * rule["force"] if s else rule["stiffness"] * (e @ q - at) for e, s, at in own], self.number)

    def press(self, u: Any, rate: Any, i: int) -> Any:
        """Return the force of a closed contact of the indentation u², which grows at `rate`."""
        if self.released[i]:
            return 0 * u
        if self.law == "linear":
            return self.constant * u * u
        if self.yielding:
            return self.yield_force * (1 + ((u * u + self.residual) / self.yield_depth - 1) * 3 / 2)
        return self.factor * u**3 * (1 + self.eta * rate)

    def rates(self, t: Any, q: Vector, v: Vector, a: Any, force: Callable[..., Vector]) -> tuple[Any, ...]:
        """Return q'', a', D, D' without r'·N, r, r' by time and N; `force` gives N of D' without rails, of D and r."""
        y, slope, _ = self.height(t)
        gap = self.depth - self.residual + y - self.rows @ q
        rate = self.speed * slope - self.rows @ v
        r = r1 = self.number(0)
        da = None
        if self.ring:
            phi, phi1, psi, r, r1 = self.ring.at(self.speed * t, self.step)
            gap = gap + self.rail0 - np.sum(self.ring.weights * (phi * a).real)
        N = force(rate, gap, r)
        if self.ring:
            da = self.ring.rates * a + psi * N[0]
            rate = rate - np.sum(self.ring.weights * (self.speed * phi1 * a + phi * da).real)
        pull = self.rows.T @ (N - self.static) - self.stiffness @ q - self.damping @ v
        if len(self.sliders):
            pull -= self.sliders.T @ self.friction(q)
        return pull / self.mass, da, gap, rate, r, r1 * self.speed, N

    def trend(self, u: Any, rate: Any, i: int, found: tuple[Any, ...], t: Any) -> Any:
        """Return what has the sign of N', from what `rates` has found."""
        if not self.eta:
            return rate - found[5] * found[6][i]
        second = self.speed**2 * self.height(t)[2, i] - self.rows[i] @ found[0]
        return 3 * rate * (1 + self.eta * rate) / 2 + u * u * self.eta * second

    def switch(self, kind: str, i: int, q: Vector) -> str:
        """Go over to what holds behind an event; return what an answer calls it, or nothing."""
        if kind in ("loss", "impact"):
            said = "" if self.released[i] else kind
            self.touching[i], self.released[i] = kind == "impact", False
            return said
        if kind in ("release", "return"):
            self.released[i] = kind == "release"
            return "loss" if kind == "release" else "impact"
        if kind in ("yield", "recover"):
            self.yielding = kind == "yield"
            return "yield" if self.yielding else ""
        if kind == "stick":
            self.anchor[i] = self.sliders[i] @ q - self.side[i] * self.slip["force"] / self.slip["stiffness"]
            self.side[i] = 0
            return "stick"
        self.side[i] = 1 if kind == "slip +" else -1
        return "slip"

    def unload(self, u: Any, N: Any) -> Any:
        """Flatten the spot at the largest indentation u² of its surface; return the root of what is left of it."""
        depth = u * u + self.residual
        left = self.yield_depth * N / self.yield_force / np.sqrt(depth / self.yield_depth)
        self.residual, self.onset, self.yielding = depth - left, np.sqrt(left), False
        self.factor = N / self.onset**3
        return self.onset

    def next_edge(self) -> Any:
        """Go over an edge of paths or track; return the factors of the modes where a bay begins."""
        t = self.edges.pop(0)
        if self.edges:
            self.enter((t + self.edges[0]) / 2)
        if self.ring and t in self.seats:
            self.step += 1
            return self.ring.turns if self.step % self.ring.elements == 0 else None
        return None


class Walk(Model):
    """Method A: the state is t, u of each contact, q, q' and the amplitudes."""

    def __init__(self, case: dict[str, Any]) -> None:
        super().__init__(case)
        self.found: list[Row] = []
        self.least, self.steps = case["ask"]["maxima_above"], 0
        n, d = len(self.rows), len(self.mass)
        parts: list[Any] = [[1e-2], np.full(n, np.sqrt(self.depth)), np.full(d, self.depth)]
        parts.append(np.full(d, case["ask"]["velocity"]))
        if self.ring:
            parts.append(np.full(2 * self.ring.count, np.abs(self.state[1 + n + 2 * d :]).max()))
        self.scales = np.concatenate(parts)

    def split(self, y: Vector) -> tuple[Any, ...]:
        """Return t, u, q, q' and the amplitudes."""
        n, d = len(self.rows), len(self.mass)
        t, u, q, v, a = np.split(y, np.cumsum([1, n, d, d]))
        return t[0], u, q, v, a.view(self.ring.rates.dtype) if self.ring else None

    def look(self, y: Vector) -> tuple[Any, ...]:
        """Return what `rates` returns."""
        t, u, q, v, a = self.split(y)

        def force(rate: Vector, gap: Vector, r: Any) -> Vector:
            own = enumerate(self.touching)
            return np.array([self.press(u[i], rate[i], i) if on else self.number(0) for i, on in own])

        return self.rates(t, q, v, a, force)

    def slope(self, y: Vector) -> Vector:
        """Return dy/dτ."""
        _, u, _, v, _ = self.split(y)
        acceleration, da, _, rate, r, r1, N = self.look(y)
        shares = np.where(self.touching, u / np.sqrt(self.depth), Long(1))
        s, du = np.prod(shares), np.zeros(len(u), Long)
        for i, on in enumerate(self.touching):
            if on:
                others = np.prod(np.delete(shares, i)) / np.sqrt(self.depth)
                du[i] = others * (rate[i] - r1 * N[i]) / (2 + 3 * r * self.constant * u[i])
        parts = [[s], du, s * v, s * acceleration]
        return np.concatenate(parts if da is None else [*parts, (s * da).view(Long)])

    def extrapolated(self, y: Vector, h: Any) -> tuple[Vector, float]:
        """Return the state after a step, and its error in units of the scales."""
        first, before = self.slope(y), list[Vector]()
        for j, n in enumerate(SEQUENCE):
            z0, z1 = y, y + h / n * first
            for _ in range(n - 1):
                z0, z1 = z1, z0 + 2 * h / n * self.slope(z1)
            row = [(z1 + z0 + h / n * self.slope(z1)) / 2]
            for k in range(j):
                row.append(row[k] + (row[k] - before[k]) / (Long(n * n) / SEQUENCE[j - k - 1] ** 2 - 1))
            before = row
        return row[-1], float(np.max(np.abs(row[-1] - row[-2]) / self.scales))

    def guards(self, y: Vector, least: float) -> dict[Key, Any]:
        """Return functions that end a step where they fall through zero; maxima only of forces above `least`."""
        t, u, q, v, _ = self.split(y)
        found = self.look(y)
        gap, rate, N = found[2], found[3], found[6]
        out: dict[Key, Any] = {("edge", 0): self.edges[0] - t}
        for i, on in enumerate(self.touching):
            out["loss" if on else "impact", i] = u[i] if on else -gap[i]
            if on and self.eta:
                grip = 1 + self.eta * rate[i]
                out["return" if self.released[i] else "release", i] = -grip if self.released[i] else grip
            if on and self.law == "thornton" and not (self.yielding and self.memory):
                far = self.onset - u[i]
                out["recover" if self.yielding else "yield", i] = -far if self.yielding else far
            if on and N[i] > least:
                out["maximum", i] = self.trend(u[i], rate[i], i, found, t)
        for j, e in enumerate(self.sliders):
            if self.side[j]:
                out["stick", j] = self.side[j] * (e @ v)
            else:
                f = self.friction(q)[j]
                out["slip +", j], out["slip -", j] = self.slip["force"] - f, self.slip["force"] + f
        return out

    def run(self) -> list[Row]:
        """Return the answer."""
        y, h = self.state, Long("1e-5")
        while self.edges:
            later, error = self.extrapolated(y, h)
            better = Long(min(max(0.9 * (TOLERANCE / max(error, 1e-30)) ** (1 / 15), 0.3), 1.5))
            if error > TOLERANCE:
                h *= better
                continue
            self.steps += 1
            caught = self.first(y, later, h)
            if caught is None:
                y, h = later, h * better
                continue
            y = caught[0]
            for kind, i in sorted(caught[1], key=lambda key: key[0] != "maximum"):
                self.change(y, kind, i)
        both = zip(STATE, self.split(y)[2:4], strict=True)
        return [*self.found, *(Row(kind, k, self.end, one) for kind, x in both for k, one in enumerate(x, 1))]

    def first(self, y: Vector, later: Vector, h: Any) -> tuple[Vector, list[Key]] | None:
        """Return the state at the first event of a step, with all events of that instant, or None."""
        f0, f1 = self.slope(y), self.slope(later)
        looks = []
        for x in np.arange(LOOKS + 1, dtype=Long) / LOOKS:  # on Hermite's cubic
            state = (1 - x) ** 2 * ((1 + 2 * x) * y + x * h * f0) + x * x * ((3 - 2 * x) * later + (x - 1) * h * f1)
            looks.append(self.guards(state, 0.9 * self.least))
        found, sizes = [], {}
        for key in sorted(set().union(*looks)):
            g = [look.get(key, Long(0)) for look in looks]
            sizes[key] = TINY * max(map(abs, g))
            for k in range(LOOKS):
                if g[k + 1] < 0 and g[k] > (0 if k else sizes[key]):
                    found.append(((k + g[k] / (g[k] - g[k + 1])) / LOOKS * h, key))
                    break
        for guess, key in sorted(found):
            at = self.refined(y, guess, key)
            if at is None:
                continue
            held = self.guards(at, 0)
            for other in (other for _, other in found if held.get(other, 0) < -sizes[other]):
                before = self.refined(y, guess, other)
                if before is not None and before[0] < at[0]:
                    at, key = before, other
            held = self.guards(at, 0)
            return at, [key, *(k for _, k in found if k != key and abs(held.get(k, 1)) <= sizes[k])]
        return None

    def refined(self, y: Vector, h: Any, key: Key) -> Vector | None:
        """Return the state where a function is zero, by Newton's method on the length of the step."""
        small = Long("1e-8")
        for _ in range(12):
            state, _ = self.extrapolated(y, h)
            along = small * self.slope(state) * h
            here, after, before = (self.guards(state + way, 0)[key] for way in (0 * along, along, -along))
            change = here * 2 * small / (after - before) * h
            h -= change
            if not h > 0:
                return None
            if abs(change) < 1e-17 * h:
                break
        return self.extrapolated(y, h)[0]

    def change(self, y: Vector, kind: str, i: int) -> None:
        """Note an event, and go over to what holds behind it."""
        t, u, q, _, _ = self.split(y)
        if kind == "edge":
            self.pass_edge(y)
            return
        if kind == "maximum":
            N = self.look(y)[6][i]
            if self.least < N:
                self.found.append(Row(kind, i + 1, t, N))
            if self.yielding and self.memory:
                u[i] = self.unload(u[i], N)
            return
        said = self.switch(kind, i, q)
        if kind in ("loss", "impact"):
            u[i] = 0
        if said:
            self.found.append(Row(said, i + 1, t, None))

    def pass_edge(self, y: Vector) -> None:
        """Go over to the next pieces of the paths, the next element of the track."""
        y[0] = t = self.edges[0]
        _, u, _, _, a = self.split(y)
        before, high = self.look(y), self.height(t)[0]
        turns = self.next_edge()
        if turns is not None:
            a *= turns
        jump = self.height(t)[0] - high
        for i in np.flatnonzero(np.abs(jump) > 1e-12).tolist():
            left = u[i] ** 2 + jump[i]
            if left <= 0 and self.touching[i]:
                self.touching[i] = False
                self.found.append(Row("loss", i + 1, t, None))
            u[i] = np.sqrt(max(left, 0))
        after = self.look(y)
        for i, on in enumerate(self.touching):
            rose, rises = (self.trend(u[i], one[3][i], i, one, t) for one in (before, after))
            if on and after[6][i] > self.least and rose > 0 > rises:
                self.found.append(Row("maximum", i + 1, t, after[6][i]))


def main() -> None:
    for name in sys.argv[1:] or names():
        walk = Walk(read(name, Long))
        rows = walk.run()
        write(HERE / "truth" / f"{name}.csv", rows)
        kinds = [row.kind for row in rows if row.kind not in STATE]
        counts = ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
        print(f"{name}: {counts}; {walk.steps} steps", flush=True)


if __name__ == "__main__":
    main()
