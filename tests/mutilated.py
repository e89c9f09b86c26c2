"""Trains by the program of `tests.wayside`, spoiled as recordings are: stopped, cut off, exchanged, without samples.

Each kind has what an honest answer says. `told_of` gives the faults of the answer to one of them;
`python -m tests.mutilated 0 16` prints a table of 16 of each kind.
"""

import sys
from functools import cache

import numpy as np

from tests.wayside import RADIUS, Line, coloured, slow_train
from wheeltapper.diagnosis import Recording, Site, measure_trains
from wheeltapper.ground.errors import InputError

RATE = 5e3
KINDS = (
    "plain", "backwards", "two trains", "drift", "stopped", "turned round", "cut off", "gap in one", "gap in all",
    "exchanged rails", "exchanged places", "sign", "gain", "dead", "clock", "missing", "unit", "no forces",
    "long pulses",
)  # fmt: skip
REFUSED = ("unit", "no forces", "long pulses")
OF_A_CHANNEL = ("exchanged rails", "exchanged places", "sign", "gain", "dead", "clock", "missing")
RIGHT_LOADS = ("plain", "backwards", "two trains", "drift", "stopped", "gap in one", *OF_A_CHANNEL)


@cache
def line_of(pairs):
    return Line([("pair", 0.6 * k + 0.1, 0.6 * k + 0.5) for k in range(pairs)])


@cache
def site_of(pairs):
    """Return a site with so many pairs on each rail."""
    sensors = [
        {"kind": "rail shear force", "name": f"{side} {number}", "side": side, "x1": x1, "x2": x2}
        for side in ("left", "right") for number, (_, x1, x2) in enumerate(line_of(pairs).channels)
    ]  # fmt: skip
    return Site(sensor=sensors, radius=RADIUS)


def axles_of(rng):
    """Return the axles of vehicles of one kind, m behind the leading one."""
    if rng.random() < 0.75:
        base, between = rng.choice([1.8, 2.1, 2.5]), rng.uniform(6, 14)
        own = np.array([0.0, base, between, between + base])
    else:
        own = np.array([0.0, rng.uniform(5, 9)])
    return (own + (own[-1] + rng.uniform(2.5, 4.0)) * np.arange(rng.integers(2, 9))[:, None]).ravel()


def lead_of(rng, kind, axles, end):
    """Return where the leading axle is at each sample, m, and the usual speed."""
    speed, begin = rng.uniform(5, 36), -5.0
    total = axles[-1] + end + 2.0 - begin
    if kind not in ("stopped", "turned round"):
        return begin + speed * np.arange(0.0, total / speed, 1.0 / RATE), speed
    brakes, starts, waits = rng.uniform(0.5, 1.2), rng.uniform(0.4, 1.0), rng.uniform(2.0, 10.0)
    way = rng.uniform(8.0, axles[-1] + 3.0) - begin
    speed = min(speed, 12.0, 0.98 * np.sqrt(2.0 * brakes * way))
    free = (way - 0.5 * speed**2 / brakes) / speed
    stops = free + speed / brakes
    runs = stops + waits + speed / starts
    back = kind == "turned round"
    last = runs + ((way if back else total - way) / speed) + 2.0
    after = -speed if back else speed
    speeds = np.interp(
        np.arange(0.0, last, 1.0 / RATE),
        [0, free, stops, stops + waits, runs, last],
        [speed, speed, 0, 0, after, after],
    )
    return begin + np.cumsum(speeds) / RATE, speed


class Spoiled:
    """A train of a kind, its recordings, and what is known of it."""

    def __init__(self, kind, seed):
        rng = np.random.default_rng([KINDS.index(kind), seed])
        self.kind, self.pairs = kind, int(rng.choice([6, 16]))
        line, self.site = line_of(self.pairs), site_of(self.pairs)
        self.axles = axles_of(rng)
        loads = rng.uniform(3e4, 1.1e5, (len(self.axles), 1)) * (1.0 + 0.1 * rng.standard_normal((len(self.axles), 2)))
        self.loads = loads.sum(axis=1)
        lead, self.speed = lead_of(rng, kind, self.axles, line.way[1])
        self.rows = {}
        for k, side in enumerate(("left", "right")):
            for number, row in enumerate(slow_train(line, lead, self.axles, loads[:, k])):
                if kind == "long pulses":
                    _, x1, x2 = line.channels[number]
                    reach = rng.uniform(3.0, 6.0)
                    row = sum(
                        load * np.maximum(1.0 - np.abs(lead - behind - 0.5 * (x1 + x2)) / reach, 0.0)
                        for behind, load in zip(self.axles, loads[:, k], strict=True)
                    )
                rough = 1.0 + 0.01 * coloured(rng.standard_normal(len(row)), RATE, 1.0)
                noise = rng.uniform(200, 800) * rng.standard_normal(len(row)) + 2e3 * rng.standard_normal()
                self.rows[f"{side} {number}"] = row * rough + noise
        self.wrong = set()
        self.spoil(rng)

    def spoil(self, rng):
        """Spoil the recordings."""
        names = list(self.rows)
        one = str(rng.choice(names))
        samples = len(self.rows[one])
        if self.kind in OF_A_CHANNEL or self.kind == "gap in one":
            self.wrong = {one}
        match self.kind:
            case "backwards":
                self.rows = {name: row[::-1] for name, row in self.rows.items()}
                self.axles, self.loads = self.axles[-1] - self.axles[::-1], self.loads[::-1]
            case "two trains":
                gap = int(rng.uniform(10, 20) * RATE)
                self.rows = {
                    name: np.concatenate([row, 300.0 * rng.standard_normal(gap) + np.median(row), row])
                    for name, row in self.rows.items()
                }
            case "drift":
                self.rows[one] = self.rows[one] + np.linspace(0.0, rng.uniform(2e4, 1e5), samples)
            case "cut off":
                last = int(rng.uniform(0.3, 0.8) * samples)
                self.rows = {name: row[:last] for name, row in self.rows.items()}
            case "gap in one" | "gap in all":
                first = int(rng.uniform(0.2, 0.7) * samples)
                last = first + int(rng.uniform(0.05, 0.5) * RATE)
                for name in [one] if self.kind == "gap in one" else names:
                    self.rows[name][first:last] = np.nan
            case "exchanged rails":
                side, number = one.split()
                other = f"{'right' if side == 'left' else 'left'} {number}"
                self.exchange(one, other)
            case "exchanged places":
                side, number = one.split()
                rest = [name for name in names if name.startswith(side) and name != one]
                self.exchange(one, str(rng.choice(rest)))
            case "sign":
                self.rows[one] = -self.rows[one]
            case "gain":
                self.rows[one] = float(rng.choice([0.3, 0.45, 2.2, 3.0])) * self.rows[one]
            case "dead":
                self.rows[one] = 300.0 * rng.standard_normal(samples)
            case "clock":
                self.rows[one] = np.roll(self.rows[one], int(rng.choice([-1, 1]) * rng.uniform(0.02, 0.2) * RATE))
            case "missing":
                del self.rows[one]
            case "unit":
                self.rows = {name: 1e-3 * row for name, row in self.rows.items()}
            case "no forces":
                t = np.arange(samples) / RATE
                for name in names:
                    walk = 1e3 * np.cumsum(rng.standard_normal(samples))
                    wave = 5e4 * np.sin(2.0 * np.pi * rng.uniform(0.2, 3.0) * t) + 1e3 * rng.standard_normal(samples)
                    self.rows[name] = walk if rng.random() < 0.5 else wave

    def exchange(self, one, other):
        """Exchange two channels."""
        self.rows[one], self.rows[other] = self.rows[other], self.rows[one]
        self.wrong = {one, other}

    def answer(self):
        """Return the trains that are found; None where the recordings are refused."""
        recordings = {name: Recording(row, RATE, "force") for name, row in self.rows.items()}
        try:
            return measure_trains(recordings, self.site, rules=[])
        except InputError:
            return None


USUAL = ("forces are from the recording", "a strike is not seen", "gains of single channels")


def told_of(kind, seed):
    """Return what is wrong with the answer to a spoiled train, in words; nothing, if it is honest."""
    spoiled = Spoiled(kind, seed)
    trains = spoiled.answer()
    if kind in REFUSED:
        return [] if not trains else [f"{len(trains[0].axles)} axles, not refused"]
    if trains is None:
        return ["refused"]
    faults = []
    if len(trains) != (2 if kind in ("two trains", "turned round") else 1):
        return [f"{len(trains)} trains"]
    for train in trains:
        notes = [note for note in train.notes if not note.startswith(USUAL)]
        text = " ".join(notes)
        if any(wheel["strikes"] for axle in train.axles for wheel in axle["wheels"]):
            faults.append("a false strike")
        whole = len(train.axles) == len(spoiled.axles)
        if kind in RIGHT_LOADS:
            if not whole:
                faults.append(f"{len(train.axles)} axles of {len(spoiled.axles)}")
                continue
            found = np.array([np.nan if axle["static_force"] is None else axle["static_force"] for axle in train.axles])
            off = np.abs(found / spoiled.loads - 1.0)
            if not off.max() < 0.02:
                faults.append(f"loads off by {100 * off.max():.1f} %")
            places = np.array([axle["place"] for axle in train.axles])
            unseen = "it may have stood" in text
            if np.abs(places - spoiled.axles).max() > 0.3 and not unseen:
                faults.append(f"places off by {np.abs(places - spoiled.axles).max():.1f} m")
        if kind == "stopped" and "the train stopped" not in text and "it may have stood" not in text:
            faults.append("the stop is not told")
        if kind == "turned round" and "turned round" not in text:
            faults.append("the turn is not told")
        if kind == "cut off" and not whole and not ("the recording ends while" in text or "in no vehicle" in text or (
            len(spoiled.axles) % len(train.axles) == 0 or len(train.axles) % train.vehicles[0]["axles"] == 0
        )):  # fmt: skip
            faults.append("the end is not told")
        if kind == "gap in all" and not whole and "most channels have no samples" not in text:
            faults.append("the gap is not told")
        if kind in OF_A_CHANNEL and not all(repr(name) in text for name in spoiled.wrong):
            faults.append(f"{sorted(spoiled.wrong)} is not named: {text[:200]}")
        if len(notes) > (5 if kind.startswith("gap") else 3):
            faults.append(f"{len(notes)} notes")
    return faults


def main(first, last):
    """Print a table of all kinds: how many of the trains with these seeds have an honest answer, and the faults."""
    for kind in KINDS:
        faults = {seed: told for seed in range(first, last) if (told := told_of(kind, seed))}
        print(f"{kind:18s} {last - first - len(faults)} of {last - first}  {faults or ''}", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
