"""Recordings of trains by a program of its own: a finite-element rail on sleepers, Newmark's steps, wheels on Hertz
springs over roughness and flats, and gauges that read what stands on a piece of rail.

Nothing of it is shared with the package. The track is linear, so that a train is the sum of its wheels: `Line.passages`
computes many wheels side by side, each alone on its own copy of the rail, and `Line.train` adds them up in time. Wheels
do not feel each other through the rail, and both rails do not know of each other.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy import sparse
from scipy.linalg import cho_solve_banded, cholesky_banded, solve_toeplitz
from scipy.linalg.lapack import dpbtrs
from scipy.signal import butter, sosfiltfilt

RADIUS, MASS, HERTZ = 0.46, 600.0, 9.4125e10
BENDING, RAIL_MASS = 2.1e11 * 3.04e-5, 60.2  # 60E1
PAD, PAD_DAMPING, SLEEPER, BALLAST, BALLAST_DAMPING = 2e8, 3e4, 150.0, 8e7, 6e4
PER_BAY, SPACING = 6, 0.6
FINELY = 20e3
"""Steps a second, at least."""
GAUGE = 0.1
"""Length over which a shear gauge takes the mean, m: about what a rail's web does."""
ISO_3095 = {
    0.4: 17.1, 0.315: 15.0, 0.25: 13.0, 0.2: 11.0, 0.16: 9.0, 0.125: 7.0, 0.1: 4.9, 0.08: 2.9, 0.063: 0.9, 0.05: -1.1,
    0.04: -3.2, 0.0315: -5.0, 0.025: -5.6, 0.02: -6.2,
}  # fmt: skip
"""ISO 3095:2013, limit of the rail's roughness: wavelength, m, and level of the third of an octave, dB over 1 um."""


def roughness(seed):
    """Return a path with the roughness of the limit, m, as a function of places."""
    rng = np.random.default_rng(seed)
    waves = np.concatenate([length * 2.0 ** rng.uniform(-1 / 6, 1 / 6, 6) for length in ISO_3095])
    sizes = np.repeat([np.sqrt(2.0 / 6.0) * 1e-6 * 10.0 ** (level / 20.0) for level in ISO_3095.values()], 6)
    phases = rng.uniform(0.0, 2.0 * np.pi, len(waves))
    return lambda x: sum(a * np.cos(2.0 * np.pi * x / w + p) for a, w, p in zip(sizes, waves, phases, strict=True))


def flat(length, first):
    """Return the path over a fresh flat that meets the rail at `first` and at each turn of the wheel, m."""
    turn = 2.0 * np.pi * RADIUS

    def path(x):
        u = np.maximum(0.5 * length - np.abs((x - first + 0.5 * turn) % turn - 0.5 * turn), 0.0)
        return -(u**2) / (RADIUS + np.sqrt(RADIUS**2 - u**2))

    return path


def worn_flat(length, first):
    """Return the path over a flat that wear has rounded: the circle over a haversine of depth l^2/16R, m.

    That is the least, over places of the circumference, of how far the surface lies below the circle through them.
    """
    along = np.linspace(-0.7, 0.7, 2801)
    missing = np.where(np.abs(along) < 0.5, (1.0 + np.cos(2.0 * np.pi * along)) / 32.0, 0.0)
    rolled = np.linspace(-0.6, 0.6, 601)
    least = np.array([np.min(missing + 0.5 * (v - along) ** 2) for v in rolled])
    turn = 2.0 * np.pi * RADIUS

    def path(x):
        u = (x - first + 0.5 * turn) % turn - 0.5 * turn
        return -(length**2) / RADIUS * np.interp(u / length, rolled, least, left=0.0, right=0.0)

    return path


@dataclass(frozen=True)
class Wheel:
    """A wheel: its static force, N, the seed of its roughness (None: smooth), its flat's length and place, m.

    `worn`: the flat is one that wear has rounded. `waves` are orders of the circumference with amplitude, m, and phase.
    """

    load: float
    seed: int | None = None
    flat: tuple[float, float] | None = None
    worn: bool = False
    waves: tuple[tuple[int, float, float], ...] = ()

    def path(self, x):
        """Return the height of the path of its centre at places, m, upwards."""
        rough = 0.0 * x if self.seed is None else roughness(self.seed)(x)
        shape = worn_flat if self.worn else flat
        rough = rough + sum(size * np.cos(order * x / RADIUS + phase) for order, size, phase in self.waves)
        return rough + (0.0 if self.flat is None else shape(*self.flat)(x))


@dataclass(frozen=True)
class Passages:
    """What wheels do alone: places x of the wheel, m, forces (wheel, x), readings (wheel, channel, x), N."""

    x: np.ndarray
    forces: np.ndarray
    readings: np.ndarray

    def recorded(self, rate):
        """Return the same sampled less often, with channels that went through a recorder's filter before."""
        every = round(FINELY / rate)
        filtered = sosfiltfilt(butter(4, 0.4 * rate, fs=FINELY, output="sos"), self.readings, axis=-1)
        return Passages(self.x[::every], self.forces[:, ::every], filtered[..., ::every])


@dataclass
class Line:
    """A rail on sleepers at the multiples of 0.6 m, with channels: ("pair", x1, x2), ("pad", x), ("sleeper", x).

    With a shear stiffness, N, it is one of Timoshenko's rails, without rotary inertia; else one of Euler's.
    """

    channels: list
    before: float = 6.0
    run_in: float = 3.0
    pad: float = PAD
    pad_damping: float = PAD_DAMPING
    ballast: float = BALLAST
    rail_mass_per_metre: float = RAIL_MASS
    shear: float = np.inf
    per_bay: int = PER_BAY
    hertz: float = HERTZ
    size: int = field(init=False)

    def __post_init__(self):
        ends = [x for _, *places in self.channels for x in places]
        self.first = SPACING * np.floor((min(ends) - self.before) / SPACING)
        bays = int(np.ceil((max(ends) + self.before - self.first) / SPACING))
        nodes = bays * self.per_bay + 1
        self.length = h = SPACING / self.per_bay
        self.nodes = self.first + h * np.arange(nodes)
        seats = np.arange(0, nodes, self.per_bay)
        before = np.zeros(nodes, dtype=int)
        before[seats[:-1] + 1] = 1
        self.deflections = 2 * np.arange(nodes) + np.cumsum(before)  # a sleeper's stands after its node
        self.tops, self.sleepers = self.deflections[seats], self.deflections[seats] + 2
        self.seats = self.nodes[seats]
        self.size = 2 * nodes + len(seats)
        self.sheared = c = 12.0 * BENDING / (self.shear * h**2)
        bend = BENDING / h**3 / (1.0 + c) * np.array(
            [[12, 6 * h, -12, 6 * h], [6 * h, (4 + c) * h * h, -6 * h, (2 - c) * h * h], [-12, -6 * h, 12, -6 * h],
             [6 * h, (2 - c) * h * h, -6 * h, (4 + c) * h * h]])  # fmt: skip
        places, weights = np.polynomial.legendre.leggauss(4)
        shapes = self._element_shapes(0.5 * (places + 1.0))
        mass = self.rail_mass_per_metre * 0.5 * h * (weights * shapes) @ shapes.T
        tops, own = self._at(self.tops), self._at(self.sleepers)
        pads = tops + own - self._at(self.tops, self.sleepers) - self._at(self.sleepers, self.tops)
        self.rail_mass = self._chain(mass)
        self.mass = self.rail_mass + SLEEPER * own
        self.stiffness = self._chain(bend) + self.pad * pads + self.ballast * own
        self.damping = 1e-6 * self._chain(bend) + self.pad_damping * pads + BALLAST_DAMPING * own

    def _chain(self, element):
        d = self.deflections
        ends = np.stack([d[:-1], d[:-1] + 1, d[1:], d[1:] + 1])
        rows, columns = np.repeat(ends, 4, axis=0), np.tile(ends, (4, 1))
        values = np.repeat(element.reshape(16, 1), ends.shape[1], axis=1)
        return sparse.csr_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(self.size, self.size))

    def _at(self, rows, columns=None):
        where = (rows, rows if columns is None else columns)
        return sparse.csr_matrix((np.ones(len(rows)), where), shape=(self.size, self.size))

    def _factor(self, matrix):
        upper = np.zeros((6, self.size))
        for k in range(6):
            upper[5 - k, k:] = matrix.diagonal(k)
        return cholesky_banded(upper), False

    def _shapes(self, x):
        """Return the degrees of freedom beside places, (4, place), and the shares with which a force acts on them."""
        number, s = np.divmod((np.atleast_1d(x) - self.first) / self.length, 1.0)
        before, behind = self.deflections[number.astype(int)], self.deflections[number.astype(int) + 1]
        return np.array([before, before + 1, behind, behind + 1]), self._element_shapes(s)

    def _element_shapes(self, s):
        """Return how an element deflects between its ends, 0 to 1, by each of its unknowns, (4, place)."""
        c, h = self.sheared, self.length
        shapes = [
            1 - 3 * s**2 + 2 * s**3 + c * (1 - s), h * (s - 2 * s**2 + s**3 + 0.5 * c * (s - s**2)),
            3 * s**2 - 2 * s**3 + c * s, h * (s**3 - s**2 - 0.5 * c * (s - s**2)),
        ]  # fmt: skip
        return np.array(shapes) / (1.0 + c)

    def window(self, channel, x):
        """Return what a pair of gauges reads of 1 N at x that moves slowly."""
        _, x1, x2 = self.channels[channel]
        return np.clip((x - x1) / GAUGE + 0.5, 0, 1) - np.clip((x - x2) / GAUGE + 0.5, 0, 1)

    def _readers(self):
        """Return matrices that give all readings from displacements, speeds and accelerations."""
        stiff, damp, inert = np.zeros((3, len(self.channels), self.size))
        for row, (kind, *places) in enumerate(self.channels):
            if kind == "pair":
                shape = np.zeros(self.size)
                shape[self.deflections] = self.window(row, self.nodes)
                inert[row] = -(self.rail_mass @ shape)
                shares = self.window(row, self.seats)
                stiff[row, self.tops], stiff[row, self.sleepers] = -self.pad * shares, self.pad * shares
                damp[row, self.tops], damp[row, self.sleepers] = -self.pad_damping * shares, self.pad_damping * shares
                continue
            seat = int(np.argmin(abs(self.seats - places[0])))
            top, own = self.tops[seat], self.sleepers[seat]
            if kind == "pad":
                stiff[row, [top, own]], damp[row, [top, own]] = (
                    (self.pad, -self.pad),
                    (self.pad_damping, -self.pad_damping),
                )
            else:
                stiff[row, own], damp[row, own] = self.ballast, BALLAST_DAMPING
        return stiff, damp, inert

    @property
    def way(self):
        """Where the wheels run, m."""
        return self.first + self.run_in, self.nodes[-1] - self.run_in

    def passages(self, wheels, speed, rate):
        """Return what wheels do on the line, each alone, at samples of this rate; steps are at most 50 us."""
        a, b = self.way
        every = int(np.ceil(FINELY / rate))
        x = a + speed / (every * rate) * np.arange(int((b - a) / speed * rate) * every)
        return self.along(wheels, x[None, :], rate, every)

    def recorded(self, wheels, speed, rate):
        """Return what wheels do, with channels that went through a recorder's filter before they were sampled."""
        return self.passages(wheels, speed, FINELY).recorded(rate)

    def along(self, wheels, x, rate, every):
        """Return what wheels do alone that are at the places x, m, (wheel or 1, step), `every` steps a sample.

        While none of them moves, nothing changes.
        """
        h = 1.0 / (every * rate)
        loads, one = np.array([wheel.load for wheel in wheels]), np.arange(len(x))
        readers = sparse.csr_matrix(np.hstack(self._readers()))
        held_by = sparse.hstack([self.mass, self.damping], format="csr")
        factor, _ = self._factor(self.stiffness + 2.0 / h * self.damping + 4.0 / h**2 * self.mass)
        dofs, shapes = self._shapes(x[:, 0])
        each = np.broadcast_to(np.arange(len(x)), len(wheels)) if len(x) > 1 else np.zeros(len(wheels), dtype=int)
        own_column = np.arange(len(wheels))
        force = np.zeros((self.size, len(wheels)))
        force[dofs[:, each], own_column] = shapes[:, each] * loads
        u = cho_solve_banded(self._factor(self.stiffness), force)
        v, acc = np.zeros_like(u), np.zeros_like(u)
        paths = np.array([wheel.path(x[k]) for wheel, k in zip(wheels, each, strict=True)])
        path = paths[:, 0]
        wheel_u = (
            (shapes[:, each] * u[dofs[:, each], own_column]).sum(axis=0) + (loads / self.hertz) ** (2.0 / 3.0) - path
        )
        wheel_v, wheel_a = np.zeros((2, len(wheels)))
        count = x.shape[1] // every
        forces, readings = np.empty((len(wheels), count)), np.empty((len(wheels), len(self.channels), count))
        own, now = 0.25 * h**2 / MASS, loads.copy()
        loaded = np.zeros((self.size, len(wheels) + len(x)), order="F")
        still = np.all(np.diff(x, axis=1, prepend=x[:, :1] - 1.0) == 0.0, axis=0)
        calm = np.convolve(still, np.ones(int(0.2 / h)), "full")[: len(still)] >= int(0.2 / h)
        for step in range(count * every):
            at = x[:, step]
            if step and not calm[step]:
                dofs, shapes = self._shapes(at)
                loaded[:] = 0.0
                loaded[:, : len(wheels)] = held_by @ np.vstack([4 / h**2 * u + 4 / h * v + acc, 2 / h * u + v])
                loaded[dofs, one + len(wheels)] = shapes
                solved, _ = dpbtrs(factor, loaded, overwrite_b=True)
                solved = np.ascontiguousarray(solved)
                free, unit = solved[:, : len(wheels)], solved[:, len(wheels) :]
                gives = (shapes * unit[dofs, one]).sum(axis=0)[each] + own
                fallen = wheel_u + h * wheel_v + 0.25 * h**2 * wheel_a + own * loads
                path = paths[:, step]
                risen = (shapes[:, each] * free[dofs[:, each], own_column]).sum(axis=0)
                now = _contact(fallen + path - risen, gives, now, self.hertz)
                new = free + unit[:, each] * now
                change = 4 / h**2 * (new - u) - 4 / h * v - acc
                v, u, acc = v + 0.5 * h * (acc + change), new, change
                fall = (loads - now) / MASS
                wheel_u = wheel_u + h * wheel_v + 0.25 * h**2 * (wheel_a + fall)
                wheel_v, wheel_a = wheel_v + 0.5 * h * (wheel_a + fall), fall
            if step % every == 0:
                forces[:, step // every] = now
                seen = readers @ np.vstack([u, v, acc])
                for row, (kind, *_) in enumerate(self.channels):
                    stands = now * self.window(row, at)[each] if kind == "pair" else 0.0
                    readings[:, row, step // every] = seen[row] + stands
        return Passages(x[0, ::every], forces, readings)

    def influence(self, x):
        """Return what each channel reads of 1 N that stands at x, (channel, x)."""
        factor, readers = self._factor(self.stiffness), self._readers()[0]
        loads = np.zeros((self.size, len(x)))
        for column, place in enumerate(x):
            dofs, shapes = self._shapes(place)
            loads[dofs[:, 0], column] = shapes[:, 0]
        read = readers @ cho_solve_banded(factor, loads)
        for row, (kind, *_) in enumerate(self.channels):
            read[row] += self.window(row, x) if kind == "pair" else 0.0
        return read


def _contact(open_deflection, gives, guess, hertz):
    """Return forces N with N = C·δ^1.5 and δ = open_deflection - gives·N, by Newton."""
    n = np.maximum(guess, 1.0)
    for _ in range(12):
        d = np.maximum(open_deflection - gives * n, 0.0)
        root = np.sqrt(d)
        before, n = n, np.maximum(n - (n - hertz * d * root) / (1.0 + 1.5 * hertz * root * gives), 0.0)
        if (abs(n - before) <= 1e-12 * n).all():
            break
    return n


def train_of(line, passages, speed, rate, axles, chosen):
    """Return readings (channel, time) of a train at constant speed, and the time at which each axle is at x = 0.

    `axles` are distances behind the leading one, m, `chosen` the number of each axle's passage.
    """
    a, b = line.way
    out = np.zeros((len(line.channels), int((axles[-1] + (b - a) + 2.0) / speed * rate) + 1))
    times = []
    for behind, number in zip(axles, chosen, strict=True):
        first = round((0.5 + behind) / speed * rate)
        readings = passages.readings[number]
        out[:, first : first + readings.shape[1]] += readings
        times.append(first / rate - a / speed)
    return out, np.array(times)


def slow_train(line, lead, axles, loads):
    """Return readings (channel, time) of slow axles; `lead` is where the leading one is at each time, m."""
    x = np.linspace(*line.way, 1600)
    shown = line.influence(x)
    out = np.zeros((len(line.channels), len(lead)))
    for behind, load in zip(axles, loads, strict=True):
        for row, one in zip(out, shown, strict=True):
            row += load * np.interp(lead - behind, x, one, left=0.0, right=0.0)
    return out


def spoiled(readings, rate, windows, level, gains, drift, rng, *, colour=0.0):
    """Return readings with wrong gains, drift over the record, N, and noise `level` dB below the rms under axles.

    The noise has a density that falls with frequency as f^-colour above 1 Hz: 0 is white, 1 pink.
    """
    out = gains[:, None] * readings
    time = np.arange(readings.shape[1]) / rate
    for row in range(len(out)):
        rms = np.sqrt(np.mean(readings[row][windows[row]] ** 2))
        slow = np.sin(2.0 * np.pi * time / max(3.0 * time[-1], 1e-9) + rng.uniform(0, 6.28))
        noise = coloured(rng.standard_normal(out.shape[1]), rate, colour)
        out[row] += rng.normal(0, 1) * drift * slow + rms * 10.0 ** (-level / 20.0) * noise
    return out


def coloured(white, rate, colour):
    """Return noise whose density falls as f^-colour above 1 Hz, of the same standard deviation as white noise of 1."""
    if not colour:
        return white
    shape = np.maximum(np.fft.rfftfreq(len(white), 1.0 / rate), 1.0) ** (-0.5 * colour)
    found = np.fft.irfft(np.fft.rfft(white) * shape, len(white))
    return found / found.std()


def least_deviation(shapes, rate, colour):
    """Return the least standard deviation of a force that any unbiased estimate has, over that of the noise.

    It is that of the first of several pulses of unknown forces, whose shapes are known, (pulse, sample); the noise is
    Gaussian, and coloured as by `coloured` (Cramér and Rao; of a linear model the weighted least squares reach it).
    """
    correlation = np.fft.irfft(np.maximum(np.fft.rfftfreq(2**20, 1.0 / rate), 1.0) ** -colour)[: shapes.shape[1]]
    information = shapes @ solve_toeplitz(correlation / correlation[0], shapes.T)
    return np.sqrt(np.linalg.inv(information)[0, 0])


def low_passed(samples, rate, cutoff=500.0):
    """Return samples after a Butterworth filter of order 4 that runs both ways."""
    return sosfiltfilt(butter(4, cutoff, fs=rate, output="sos"), samples)


# -- trains without a track: trapezes, for tests of what is done with recordings ---------------------------------------

WAGON = (0.0, 1.8, 9.0, 10.8)


def plain_train(sensors, *, speed=20.0, wagons=3, rate=10e3, flat=None, noise=1e3, seed=1, turned=False):
    """Return readings, N, by the sensors' names, of wagons 14.4 m apart; `flat` is axle (from 0) and side of a wheel.

    The loads are always the same, so that a train is the same train at its next passage. `turned`: it passes the other
    way round.
    """
    axles = np.array([14.4 * wagon + axle for wagon in range(wagons) for axle in WAGON])
    known = np.random.default_rng(77)
    loads = {side: 1e3 * known.uniform(40, 110, len(axles)) for side in ("left", "right")}
    t = np.arange(0, (axles[-1] + 14) / speed, 1 / rate)
    rng, out = np.random.default_rng(seed), {}
    for one in sensors:
        edges = [one.x1 - GAUGE / 2, one.x1 + GAUGE / 2, one.x2 - GAUGE / 2, one.x2 + GAUGE / 2]
        force = np.zeros(len(t))
        for number, behind in enumerate(axles):
            x = speed * t - 5.0 - behind
            struck = np.zeros(len(t))
            if flat == (number, one.side):
                for place in 0.35 + 2 * np.pi * RADIUS * np.arange(-2, 12):
                    late = (x - place) / speed
                    struck += np.where(late > 0.0, 3.0 * np.exp(-np.clip(late, 0.0, 1.0) / 1e-3), 0.0)
            force += loads[one.side][number] * np.interp(x, edges, [0.0, 1.0, 1.0, 0.0]) * (1.0 + struck)
        out[one.name] = (force[::-1] if turned else force) + noise * rng.standard_normal(len(t))
    return out
