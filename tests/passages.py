"""Passages of wheelsets over a deck by a second program, for recordings whose truth the package has not computed.

It shares no code with the package and takes plain numbers in SI units. The classical Runge-Kutta method integrates the
equations of motion in time with a fixed small step. Steps end at every sample, at every kink of the path, where a wheel
enters or leaves the deck, and where a damper with play meets a stop or the wheel turns there. The path of the wheel's
centre is the highest position at which no point of the wheel's outline is below the rail: a search over the outline at
each position, for a wheel that is turned as it rolls. Nothing is unrolled or scaled, and no event of the contact is
looked for.

Wheel    m·ÿ = N - P - m·g - k·y - F,  N = C·max(0, δ)^1.5,  δ = path + Y - y (Y = 0 off the deck)
Deck     M·Ÿ = -Σ(N - N0) - K·Y - C_d·Ẏ over the wheels that are on it: N0 replaces N for the others
Damper   F = c·ẏ; with play only at a stop and outwards; with a bush F = k_b·(y - z) = c·ż
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from math import asin, ceil, inf, pi, sqrt

import numba
import numpy as np
from scipy import signal

STEP = 2.5e-6
"""Longest step in time, s."""
GRID = 5e-5
"""Distance of the positions at which the path over the bump or a flat is computed, m; cubic interpolation between."""
WAVES = 8
"""The same distance is this much longer where the wheel is only out of round."""
ANGLE = 1e-3
"""Distance of the points of the outline in the first search, rad; all that may be highest are then refined."""
JUMP = 4e-3
"""If the point of contact moves more than this from one position to the next, m, there is a kink between them."""
FINER = 64
"""The sensor's filter is computed at this multiple of the sample rate."""


@dataclass(frozen=True)
class Wheelset:
    """One wheelset, as for `wheeltapper.Wheelset`, and what is wrong with its wheels.

    The flat is a chord whose middle first meets the rail at `flat_position`, then every 2πR. Out of round: `amplitude`
    times the cosine of `order` times the angle, zero where the wheel meets the rail at `round_position`. `ahead` is the
    distance by which it runs ahead of the wheelset whose trigger starts the clock.
    """

    mass: float = 1500.0
    load: float = 91_307.0
    stiffness: float = 2.44e6
    damping: float = 5e4
    radius: float = 0.46
    gravity: float = 9.81
    play: float = 0.0
    play_start: float = 0.0
    bush: float = inf
    flat: float = 0.0
    flat_position: float = 0.0
    order: int = 12
    amplitude: float = 0.0
    round_position: float = 0.0
    ahead: float = 0.0


@dataclass(frozen=True)
class Passage:
    """A wheelset, its neighbours, the deck, the bump and the contact. The defaults are those of examples/site.toml.

    The deck reaches from `deck_start` to `deck_start + deck_length`; it is endless by default. `spinning`: the wheel
    turns steadily, V/R. Otherwise it rolls without slip, also about the ends of a flat.
    """

    wheelset: Wheelset = Wheelset()
    neighbours: tuple[Wheelset, ...] = ()
    speed: float = 9.0
    constant: float = 1.405e11
    deck_mass: float = 15_000.0
    deck_stiffness: float = 1.5e7
    deck_damping: float = 5e4
    deck_start: float = -inf
    deck_length: float = inf
    bump_height: float = 2e-4
    bump_length: float = 0.05
    bump_start: float = 0.009
    spinning: bool = False

    @property
    def deck_end(self):
        """Position of the exit, m."""
        return self.deck_start + self.deck_length if np.isfinite(self.deck_length) else inf


@dataclass(frozen=True)
class Sensor:
    """As for `wheeltapper.diagnosis.Sensor`; `noise` is a density, m/s²/√Hz."""

    rate: float = 20_000.0
    noise: float = 6.66e-4
    range: float = 80.0
    bits: int | None = 16
    cutoff: float | None = None
    order: int = 8

    @property
    def spread(self):
        """Standard deviation of a sample's noise, m/s²."""
        return self.noise * sqrt(0.5 * self.rate)


@dataclass(frozen=True)
class Wrongs:
    """What is wrong with clock, gauge and recording.

    Standard deviations of the trigger (s), of the speed gauge (over the speed), and of each sample's time (s); error of
    the clock's rate; number of spikes and their size (m/s²); stretches without samples, as (start, end) in s.
    """

    trigger: float = 0.0
    gauge: float = 0.0
    jitter: float = 0.0
    clock: float = 0.0
    spikes: int = 0
    spike: float = 50.0
    gaps: tuple[tuple[float, float], ...] = ()


@dataclass
class Recorded:
    """Samples at a sensor's rate from the trigger on (NaN in gaps), the gauge's reading, and the truth.

    `clean` is what the sensor would show without noise, limits and damage; `late` the trigger's error, s.
    """

    samples: np.ndarray
    clipped: np.ndarray
    rate: float
    speed: float
    truth: Passage
    clean: np.ndarray
    late: float = 0.0


# -- the path of the centre -------------------------------------------------------------------------------------------


@numba.njit(cache=True)
def _turned(x, middle, half, radius, spinning):
    """Return the angle by which a flat is past the lowest point when the centre is at x."""
    away = abs(x - middle)
    if spinning:
        angle = away / radius
    elif away >= half:
        angle = np.arcsin(half / radius) + (away - half) / radius
    else:  # about the end of the flat, which stays where it is
        angle = np.arcsin(half / radius) - np.arcsin((half - away) / radius)
    return angle if x >= middle else -angle


@numba.njit(cache=True)
def _height(psi, x, rail, wheel, theta):
    """Return how high the point of the outline at the angle psi from below lifts the centre.

    rail: height, length, start of the bump. wheel: radius, half-angle of the flat, order, amplitude, angle of the wave.
    """
    radius, half, order, amplitude, wave = wheel
    lost = 0.0
    phi = psi - theta
    if abs(phi) < half:
        lost = radius * (1.0 - np.cos(half) / np.cos(phi))
    if amplitude != 0.0:
        lost -= amplitude * np.cos(order * (psi + wave))
    at = x + (radius - lost) * np.sin(psi) - rail[2]
    ground = 0.0
    if 0.0 < at < rail[1]:
        ground = rail[0] * np.sin(np.pi * at / rail[1]) ** 2
    return -2.0 * radius * np.sin(0.5 * psi) ** 2 - lost * np.cos(psi) + ground


@numba.njit(cache=True)
def _highest(x, rail, wheel, theta, reach, angle):
    """Return the height of the centre over x, and the distance from x to the point of contact."""
    count = int(reach / angle) + 2
    rough = np.empty(2 * count + 1)
    for i in range(2 * count + 1):
        rough[i] = _height((i - count) * angle, x, rail, wheel, theta)
    top, contact = -1e300, 0.0
    least = rough.max() - 0.2 * wheel[0] * angle  # no part of the outline is steeper against the rail
    for i in range(1, 2 * count):
        if rough[i] >= least and rough[i] >= rough[i - 1] and rough[i] >= rough[i + 1]:
            psi = _refined((i - 1 - count) * angle, (i + 1 - count) * angle, x, rail, wheel, theta)
            here = _height(psi, x, rail, wheel, theta)
            if here > top:
                top, contact = here, wheel[0] * np.sin(psi)
    return top, contact


@numba.njit(cache=True)
def _refined(left, right, x, rail, wheel, theta):
    """Return the angle of the highest point between two angles, by golden sections."""
    ratio = 0.6180339887498949
    a, b = right - ratio * (right - left), left + ratio * (right - left)
    fa, fb = _height(a, x, rail, wheel, theta), _height(b, x, rail, wheel, theta)
    for _ in range(50):
        if fa > fb:
            right, b, fb = b, a, fa
            a = right - ratio * (right - left)
            fa = _height(a, x, rail, wheel, theta)
        else:
            left, a, fa = a, b, fb
            b = left + ratio * (right - left)
            fb = _height(b, x, rail, wheel, theta)
    return 0.5 * (left + right)


@numba.njit(cache=True)
def _over(xs, rail, wheel, flats, half, placed, spinning, reach, angle):
    """Return heights over xs, and distances to the points of contact; flats: positions at which flats meet the rail."""
    heights, contacts = np.empty(len(xs)), np.empty(len(xs))
    own = wheel.copy()
    for i, x in enumerate(xs):
        theta = np.pi
        if len(flats):
            nearest = flats[np.argmin(np.abs(flats - x))]
            theta = _turned(x, nearest, half, wheel[0], spinning)
            theta = -theta  # the flat comes from ahead: before its middle it is at positive angles
        own[4] = (x - placed) / wheel[0]
        heights[i], contacts[i] = _highest(x, rail, own, theta, reach, angle)
    return heights, contacts


@dataclass
class Path:
    """Heights of the centre over the distance from the trigger, on pieces that are smooth inside.

    Between pieces the path is level. starts, steps, firsts, counts: for each piece its start, the distance of its
    points, the index of its first height, and their number.
    """

    starts: np.ndarray
    ends: np.ndarray
    steps: np.ndarray
    firsts: np.ndarray
    counts: np.ndarray
    heights: np.ndarray

    def at(self, xs):
        """Return heights at some distances."""
        out = np.zeros(len(xs))
        for i, x in enumerate(xs):
            piece = int(np.searchsorted(self.starts, x, side="right")) - 1
            if piece >= 0 and x <= self.ends[piece]:
                out[i] = _interpolated(
                    x, self.starts[piece], self.steps[piece], self.firsts[piece], self.counts[piece], self.heights
                )
        return out


def path_of(passage, wheelset, end, grid=GRID, angle=ANGLE):
    """Return the path of a wheelset's centre from x = 0 to `end`, m."""
    radius, half = wheelset.radius, 0.5 * wheelset.flat
    rail = np.array([passage.bump_height, passage.bump_length, passage.bump_start])
    turn = 2.0 * pi * radius
    wheel = np.array([radius, asin(half / radius), float(wheelset.order), wheelset.amplitude, 0.0])
    flats = np.arange(wheelset.flat_position, end + turn, turn) if half else np.empty(0)
    margin = 1e-3 + wheelset.amplitude * wheelset.order
    hop = sqrt(2.0 * radius * abs(passage.bump_height)) + half + margin
    spans = _joined(
        [(passage.bump_start - hop, passage.bump_start + passage.bump_length + hop)]
        + [(middle - half - margin, middle + half + margin) for middle in flats],
        end,
    )
    parts = [(*span, grid, hop + half) for span in spans]
    if wheelset.amplitude:
        ends = [0.0, *(place for span in spans for place in span), end]
        parts += [(a, b, WAVES * grid, margin) for a, b in zip(ends[::2], ends[1::2], strict=True) if b > a]
    pieces = []
    for start, stop, apart, far in sorted(parts):

        def over(xs, reach=far / radius):
            placed = wheelset.round_position
            return _over(xs, rail, wheel, flats, half, placed, passage.spinning, reach, angle)

        xs = _spread(start, stop, apart)
        borders = [start, *_kinks(xs, over(xs)[1], over), stop]
        for a, b in pairwise(borders):
            if b > a:
                xs = _spread(a, b, apart)
                asked = np.clip(xs, a + 1e-9 * (b - a), b - 1e-9 * (b - a))  # at a kink either side may be found
                pieces.append((a, b, over(asked)[0]))
    counts = np.array([len(heights) for _, _, heights in pieces], dtype=np.int64)
    starts, ends = (np.array([piece[i] for piece in pieces]) for i in (0, 1))
    return Path(
        starts,
        ends,
        (ends - starts) / (counts - 1),
        np.concatenate([[0], np.cumsum(counts)])[:-1].astype(np.int64),
        counts,
        np.concatenate([heights for _, _, heights in pieces]) if pieces else np.empty(0),
    )


def _joined(spans, end):
    """Return the parts of spans between 0 and `end`, in order; those that overlap as one."""
    out = []
    for start, stop in sorted(spans):
        start, stop = max(start, 0.0), min(stop, end)
        if stop <= start:
            continue
        if out and start <= out[-1][1]:
            out[-1] = out[-1][0], max(stop, out[-1][1])
        else:
            out.append((start, stop))
    return out


def _spread(start, stop, apart):
    """Return points from start to stop that are no further apart than `apart`."""
    return np.linspace(start, stop, max(ceil((stop - start) / apart), 8) + 1)


def _kinks(xs, contacts, over):
    """Return the positions at which the wheel touches at two points."""
    out = []
    for i in np.flatnonzero(np.abs(np.diff(contacts)) > JUMP):
        left, right = xs[i], xs[i + 1]
        before, after = contacts[i], contacts[i + 1]
        for _ in range(50):
            middle = 0.5 * (left + right)
            here = over(np.array([middle]))[1][0]
            if abs(here - before) < abs(here - after):
                left = middle
            else:
                right = middle
        out.append(0.5 * (left + right))
    return out


# -- the motion -------------------------------------------------------------------------------------------------------


@numba.njit(cache=True)
def _interpolated(x, start, step, first, count, heights):
    """Return the cubic through the four nearest points."""
    place = (x - start) / step
    i = min(max(int(place) - 1, 0), count - 4)
    s = place - i
    a, b, c, d = heights[first + i], heights[first + i + 1], heights[first + i + 2], heights[first + i + 3]
    return (
        -a * (s - 1.0) * (s - 2.0) * (s - 3.0) / 6.0
        + b * s * (s - 2.0) * (s - 3.0) / 2.0
        - c * s * (s - 1.0) * (s - 3.0) / 2.0
        + d * s * (s - 1.0) * (s - 2.0) / 6.0
    )


RIGID, BUSH, PLAY = 0, 1, 2
MASS, LOAD, STIFFNESS, DAMPING, KIND, GAP, SOFT, STATIC, AHEAD = range(9)


@numba.njit(cache=True)
def _rates(t, s, out, wheels, deck, constant, speed, on, piece, table, heights, side):
    """Compute the derivatives of the state: for each wheel y, v, z; then Y and its rate."""
    many = len(wheels)
    pushed = 0.0
    depth, rate = s[3 * many], s[3 * many + 1]
    for j in range(many):
        y, v, z = s[3 * j], s[3 * j + 1], s[3 * j + 2]
        w = wheels[j]
        path = 0.0
        if piece[j] >= 0:
            row = table[piece[j]]
            path = _interpolated(speed * t + w[AHEAD], row[0], row[1], int(row[2]), int(row[3]), heights)
        delta = path - y
        if on[j]:
            delta += depth
        force = 0.0
        if delta > 0.0:
            force = constant * delta * np.sqrt(delta)
        if on[j]:
            pushed += force - w[STATIC]
        pull, moved = 0.0, 0.0
        if w[KIND] == RIGID:
            pull = w[DAMPING] * v
        elif w[KIND] == BUSH:
            pull = w[SOFT] * (y - z)
            moved = pull / w[DAMPING]
        elif side[j] != 0:
            pull, moved = w[DAMPING] * v, v
        out[3 * j] = v
        out[3 * j + 1] = (force - w[LOAD] - w[STIFFNESS] * y - pull) / w[MASS]
        out[3 * j + 2] = moved
    out[3 * many] = rate
    out[3 * many + 1] = (-pushed - deck[1] * depth - deck[2] * rate) / deck[0]


@numba.njit(cache=True)
def _stepped(t, h, s, work, wheels, deck, constant, speed, on, piece, table, heights, side):
    """Advance the state from row 0 of `work` by one step of the classical Runge-Kutta method, into `s`."""
    start, k1, k2, k3, k4, there = work[0], work[1], work[2], work[3], work[4], work[5]
    _rates(t, start, k1, wheels, deck, constant, speed, on, piece, table, heights, side)
    there[:] = start + 0.5 * h * k1
    _rates(t + 0.5 * h, there, k2, wheels, deck, constant, speed, on, piece, table, heights, side)
    there[:] = start + 0.5 * h * k2
    _rates(t + 0.5 * h, there, k3, wheels, deck, constant, speed, on, piece, table, heights, side)
    there[:] = start + h * k3
    _rates(t + h, there, k4, wheels, deck, constant, speed, on, piece, table, heights, side)
    s[:] = start + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@numba.njit(cache=True)
def _passed(s, j, wheels, side):
    """Return by how much a wheel has passed a stop of its damper, or turned away from one; negative before."""
    y, v, z = s[3 * j], s[3 * j + 1], s[3 * j + 2]
    return -side[j] * v if side[j] != 0 else abs(y - z) - wheels[j, GAP]


@numba.njit(cache=True)
def _marched(stops, ons, pieces, wheels, deck, constant, speed, table, heights, first, step, out):
    """March from stop to stop; write the deck's acceleration and the wheels' forces at each stop to `out`."""
    many = len(wheels)
    size = 3 * many + 2
    s, work, side = first.copy(), np.empty((6, size)), np.zeros(many, dtype=np.int64)
    slopes = np.empty(size)
    for n in range(len(stops) - 1):
        on, piece = ons[n], pieces[n]
        count = int(np.ceil((stops[n + 1] - stops[n]) / step))
        h = (stops[n + 1] - stops[n]) / max(count, 1)
        for i in range(count):
            t, left = stops[n] + i * h, h
            while left > 0.0:
                work[0, :] = s
                _stepped(t, left, s, work, wheels, deck, constant, speed, on, piece, table, heights, side)
                who, share = -1, 1.0
                for j in range(many):
                    if wheels[j, KIND] == PLAY and _passed(s, j, wheels, side) > 0.0:
                        low, high = 0.0, share  # the first stop that is reached, by bisection
                        for _ in range(40):
                            middle = 0.5 * (low + high)
                            _stepped(
                                t, middle * left, s, work, wheels, deck, constant, speed, on, piece, table, heights,
                                side,
                            )  # fmt: skip
                            if _passed(s, j, wheels, side) > 0.0:
                                high = middle
                            else:
                                low = middle
                        who, share = j, high
                        _stepped(
                            t, share * left, s, work, wheels, deck, constant, speed, on, piece, table, heights, side
                        )
                if who < 0:
                    break
                if side[who] != 0:
                    side[who] = 0
                else:
                    side[who] = 1 if s[3 * who] > s[3 * who + 2] else -1
                    if side[who] * s[3 * who + 1] <= 0.0:
                        side[who] = 0
                for j in range(many):  # the end of a damper at rest in its gap
                    if wheels[j, KIND] == PLAY and side[j] == 0:
                        off = s[3 * j] - s[3 * j + 2]
                        gap = wheels[j, GAP]
                        if abs(off) > gap:
                            s[3 * j + 2] = s[3 * j] - (gap if off > 0.0 else -gap)
                t += share * left
                left -= share * left
        _rates(stops[n + 1], s, slopes, wheels, deck, constant, speed, on, piece, table, heights, side)
        out[n + 1] = slopes[size - 1]


def static(wheelset, constant):
    """Return the static indentation, m, and force, N."""
    weight = wheelset.load + wheelset.mass * wheelset.gravity
    low, high = 0.0, (weight / constant) ** (2.0 / 3.0)
    for _ in range(200):
        middle = 0.5 * (low + high)
        above = constant * middle**1.5 + wheelset.stiffness * middle > weight
        low, high = (low, middle) if above else (middle, high)
    return high, constant * high**1.5


def acceleration(passage, times, step=STEP, grid=GRID, angle=ANGLE):
    """Return the deck's acceleration at rising times after the trigger, m/s²; zero before it."""
    wheelsets = (passage.wheelset, *passage.neighbours)
    begins = min(0.0, *(-one.ahead / passage.speed for one in wheelsets)) if passage.neighbours else 0.0
    end = max(float(times[-1]), 0.0)
    reach = [passage.speed * end + one.ahead for one in wheelsets]
    paths = [path_of(passage, one, far + 1e-6, grid, angle) for one, far in zip(wheelsets, reach, strict=True)]
    borders = [begins]
    for one, path in zip(wheelsets, paths, strict=True):
        places = [*path.starts, *path.ends, passage.deck_start, passage.deck_end]
        borders += [(place - one.ahead) / passage.speed for place in places if np.isfinite(place)]
    asked = times[times >= begins]
    stops = np.unique(np.concatenate([[begins], asked, [b for b in borders if begins < b < end]]))
    middles = 0.5 * (stops[1:] + stops[:-1])
    ons, pieces = (np.empty((len(middles), len(wheelsets)), dtype=kind) for kind in (np.bool_, np.int64))
    rows, offset, before = [], 0, 0
    for j, (one, path) in enumerate(zip(wheelsets, paths, strict=True)):
        place = passage.speed * middles + one.ahead
        ons[:, j] = (place >= passage.deck_start) & (place < passage.deck_end)
        here = np.searchsorted(path.starts, place, side="right") - 1
        inside = (here >= 0) & (place <= path.ends[here]) if len(path.starts) else np.zeros(len(place), dtype=bool)
        pieces[:, j] = np.where(inside, here + offset, -1)
        rows += list(zip(path.starts, path.steps, path.firsts + before, path.counts, strict=True))
        offset, before = offset + len(path.starts), before + len(path.heights)
    wheels, first = np.empty((len(wheelsets), 9)), np.zeros(3 * len(wheelsets) + 2)
    for j, one in enumerate(wheelsets):
        depth, force = static(one, passage.constant)
        kind = PLAY if one.play else BUSH if np.isfinite(one.bush) else RIGID
        weight = one.load + one.mass * one.gravity
        soft = one.bush if kind == BUSH else 0.0
        wheels[j] = one.mass, weight, one.stiffness, one.damping, kind, one.play, soft, force, one.ahead
        high = paths[j].at([one.ahead + passage.speed * begins])[0]
        first[3 * j] = high - depth
        first[3 * j + 2] = high - depth + one.play_start * one.play
    deck = np.array([passage.deck_mass, passage.deck_stiffness, passage.deck_damping])
    out = np.zeros(len(stops))
    _marched(
        stops, ons, pieces, wheels, deck, passage.constant, passage.speed, np.array(rows, dtype=float).reshape(-1, 4),
        np.concatenate([path.heights for path in paths]), first, step, out,
    )  # fmt: skip
    found = np.zeros(len(times))
    found[times >= begins] = out[np.searchsorted(stops, asked)]
    return found


# -- the recording ----------------------------------------------------------------------------------------------------


def shown(passage, sensor, times, step=STEP):
    """Return what the sensor's filter lets pass at some times after the trigger, m/s²."""
    if sensor.cutoff is None:
        return acceleration(passage, times, step)
    finer = np.arange(min(times[0], 0.0), times[-1] + 4.0 / sensor.rate, 1.0 / (FINER * sensor.rate))
    sections = signal.butter(sensor.order, sensor.cutoff, fs=FINER * sensor.rate, output="sos")
    passed = signal.sosfilt(sections, acceleration(passage, finer, step))
    return np.interp(times, finer, passed)


def recorded(passage, sensor, duration, random, wrongs=Wrongs(), step=STEP):
    """Return the recording of a passage, with noise, limits, and what is wrong with clock, gauge and file."""
    count = int(duration * sensor.rate) + 1
    stated = np.arange(count) / sensor.rate
    noise = sensor.spread * random.standard_normal(count)
    late = wrongs.trigger * float(random.standard_normal())
    speed = passage.speed * (1.0 + wrongs.gauge * float(random.standard_normal()))
    off = wrongs.jitter * random.standard_normal(count)
    true = np.maximum.accumulate(late + stated * (1.0 + wrongs.clock) + off)
    clean = shown(passage, sensor, true, step)
    samples = clean + noise
    if wrongs.spikes:
        samples[random.integers(0, count, wrongs.spikes)] += wrongs.spike * random.choice([-1, 1], wrongs.spikes)
    clipped = np.abs(samples) >= sensor.range
    samples = np.clip(samples, -sensor.range, sensor.range)
    if sensor.bits is not None and np.isfinite(sensor.range):
        unit = sensor.range / 2 ** (sensor.bits - 1)
        samples = unit * np.floor(samples / unit + 0.5)
    for begin, stop in wrongs.gaps:
        samples[(stated >= begin) & (stated < stop)] = np.nan
    return Recorded(samples, clipped & np.isfinite(samples), sensor.rate, speed, passage, clean, late)


# -- what is drawn ----------------------------------------------------------------------------------------------------


def faulty(wheelset, fault, size, place):
    """Return a wheelset with a fault of some size.

    Sizes: mass of the bogie that moves with a broken spring, kg; damping or mass over the healthy one; half the play,
    m; length of a flat, m; amplitude out of round, m. `place`: where a flat first meets the rail, m; the start of the
    end in its play, -1 to 1; the crest of a wheel out of round, m.
    """
    if fault == "healthy":
        return wheelset
    if fault == "broken spring":
        return replace(wheelset, mass=wheelset.mass + size, load=wheelset.load - size * wheelset.gravity)
    if fault in ("lost damper", "weak damper"):
        return replace(wheelset, damping=size * wheelset.damping)
    if fault == "mass deviation":
        return replace(wheelset, mass=size * wheelset.mass)
    if fault == "free play":
        return replace(wheelset, play=size, play_start=place)
    if fault == "soft bush":
        return replace(wheelset, bush=size)
    if fault == "wheel flat":
        return replace(wheelset, flat=size, flat_position=place)
    if fault == "out of round":
        return replace(wheelset, amplitude=size, round_position=place)
    raise ValueError(fault)


def sized(fault, passage, random):
    """Return a size and a place of a fault, drawn for a passage."""
    turn = 2.0 * pi * passage.wheelset.radius
    start = passage.deck_start if np.isfinite(passage.deck_start) else 0.0
    uniform = random.uniform(size=2)
    if fault == "broken spring":
        return 670.0, 0.0
    if fault == "lost damper":
        return 0.2, 0.0
    if fault == "mass deviation":
        off = 0.1 + 0.15 * uniform[0]
        return (1.0 + off if uniform[1] < 0.5 else 1.0 - off), 0.0
    if fault == "free play":
        return 30e-6 * (400.0 / 30.0) ** uniform[0], 2.0 * uniform[1] - 1.0
    if fault == "soft bush":
        return 2e6 * 10.0 ** uniform[0], 0.0
    if fault == "wheel flat":
        return 0.02 + 0.06 * uniform[0], start + 0.15 + (turn - start - 0.15) * uniform[1]
    if fault == "out of round":
        return 2e-5 * 10.0 ** uniform[0], turn * uniform[1]
    return 0.0, 0.0


SHARES = {"load": 0.1, "bump_height": 0.05, "constant": 0.05}
"""Standard deviations of the site's uncertain numbers over their values, as examples/site.toml states them."""


def drawn(stated, fault, random, speeds=(5.0, 12.0), shares=SHARES):
    """Return a passage with a fault, its uncertain numbers drawn, with the size and the place of the fault."""
    speed = float(random.uniform(*speeds))
    off = {name: 1.0 + share * float(random.standard_normal()) for name, share in shares.items()}
    own = {name: getattr(stated.wheelset, name) * factor for name, factor in off.items() if hasattr(Wheelset, name)}
    rest = {name: getattr(stated, name) * factor for name, factor in off.items() if not hasattr(Wheelset, name)}
    size, place = sized(fault, stated, random)
    wheelset = faulty(replace(stated.wheelset, **own), fault, size, place)
    return replace(stated, wheelset=wheelset, speed=speed, **rest), size, place
