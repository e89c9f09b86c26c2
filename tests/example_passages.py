"""Writes the recordings in examples/data/passages: `uv run python -m tests.example_passages`."""

import gzip
from pathlib import Path

import numpy as np

import wheeltapper as wt
from tests.wayside import Line, Wheel, spoiled, train_of

EXAMPLES = Path(__file__).parents[1] / "examples"
RATE, AXLES = 5e3, np.concatenate([14.4 * wagon + np.array([0.0, 1.8, 9.0, 10.8]) for wagon in range(3)])
FLAT = (6, "right", 0.04)
"""Axle (from 0), side and length of a flat, m."""
PASSAGES = {"2026-11-02T08-12_id=4711.csv.gz": 20.0, "2026-11-09T08-14_id=4711.csv.gz": 24.0}
"""Files, and speeds in m/s."""


def wheels_of(side, seed):
    """Return the wheels of one side: loads of three wagons, one of them empty, rough rail, and perhaps a flat."""
    loads = np.repeat([95e3, 32e3, 110e3], 4) * np.random.default_rng(seed).uniform(0.94, 1.06, 12)
    flat = {FLAT[0]: (FLAT[2], 0.7)} if side == FLAT[1] else {}
    return [Wheel(load, 100 + seed, flat.get(axle)) for axle, load in enumerate(loads)]


def recorded(sensors, speed, seed):
    """Return readings of all sensors, N, (sensor, time): gains wrong by some per cent, noise 40 dB below."""
    out = {}
    for number, side in enumerate(("left", "right")):
        own = [one for one in sensors if one.side == side]
        line = Line([("pair", one.x1, one.x2) for one in own], before=9.0)
        passages = line.passages(wheels_of(side, number), speed, RATE)
        readings, _ = train_of(line, passages, speed, RATE, AXLES, range(len(AXLES)))
        loaded = np.abs(readings) > 5e3
        rng = np.random.default_rng([seed, number])
        gains = np.random.default_rng(number).uniform(0.96, 1.04, len(own))
        for one, samples in zip(own, spoiled(readings, RATE, loaded, 40, gains, 500.0, rng), strict=True):
            out[one.name] = samples
    return out


def main():
    """Write them."""
    sensors = wt.load(EXAMPLES / "detector.toml").sensors
    folder = EXAMPLES / "data/passages"
    folder.mkdir(exist_ok=True)
    for seed, (name, speed) in enumerate(PASSAGES.items()):
        found = recorded(sensors, speed, seed)
        header = f"rate: {RATE:g} Hz\n" + ",".join(f"{one.name} [kN]" for one in sensors)
        table = np.column_stack([found[one.name] for one in sensors]) / 1e3
        with gzip.GzipFile(folder / name, "wb", mtime=0) as file:
            np.savetxt(file, table, header=header, fmt="%.1f", delimiter=",")


if __name__ == "__main__":
    main()
