"""How well flats are told and sized from rail gauges, on recordings of another program than the model.

uv run python benchmarks/gauges.py [--bogies 20] [--seed 1] [--healthy | --own | --train] [--file WHEELS.json]

Each bogie has two wheels 1.8 m apart on a rail of finite elements. One of them has a flat, fresh or rounded, of 25 to
60 mm; with `--healthy` none has. Drawn are speeds of 10 to 35 m/s, static forces of 30 to 110 kN and three to ten pairs
of gauges. The site states other values than the rail has: pads and ballast 10 to 20 % off, the contact's constant 5 %.
Rail and wheel are as rough as ISO 3095 allows, gains are off by 5 %, and each sample at 5 kHz has noise of 0.5 kN.

Told are what `measure_trains` says of the wheels with a flat, and of those without. Where both kinds are left open,
errors are those of the likelier one. Errors of the force are those of the largest one in the passage, as it is and
below 500 Hz. Peaks at another speed, drawn between 10 and 40 m/s, are those of the other program's wheel, with its flat
and roughness on its own track, that strikes at `STRIKES` places of a bay; their median is compared with the one that is
foreseen. CPU times are of measuring, not of the other program.

With `--own` recordings are those of the package's model: one wheel on three pairs, each value of track and wheel off by
what the site states as its uncertainty. Then a length shall be within three standard deviations of its interval.

With `--train` it is timed how long the wheels of one train of 200 axles take, of which two have a flat.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from options import parser_of

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import wheeltapper as wt
from tests import wayside
from wheeltapper.describe.paths import value_at
from wheeltapper.diagnosis import Recording, Site, measure_trains
from wheeltapper.diagnosis.gauges.known import known_of
from wheeltapper.record.assessment.filtering import low_passed

RATE, NOISE, GAIN, AXLES = 5e3, 500.0, 0.05, (0.0, 1.8)
SHEAR = 2.43e8
UNCERTAIN = {
    "track.pad_stiffness": 0.2, "track.pad_damping": 0.3, "track.ballast_stiffness": 0.2, "track.ballast_damping": 0.3,
    "contact.constant_per_wheel": 0.05, "unsprung_mass": 0.08, "radius": 0.01,
}  # fmt: skip
KINDS = ("wheel flat", "rounded flat")
BEHIND = 0.06
"""How long after a strike its peak is looked for, s."""
STRIKES, BAY = 6, 12
"""Places of a bay at which a flat strikes at another speed, and number of that bay, behind the line's start."""
FORCES = (
    ("force_error", 0.1, "largest force"), ("below_error", 0.05, "below 500 Hz"),
    ("foreseen_error", 0.12, "at another speed"), ("foreseen_below_error", 0.08, "at another speed below 500 Hz"),
)  # fmt: skip
"""What is told of forces, how far it may be off, and words for it."""
SAID = ("verdict", "size", "size_interval", "alike")
OWN_PAIRS, OWN_PLACE, OWN_WAY = 3, 6.0, 13.0
"""With `--own`: pairs of gauges, where their first bay begins, and how far the wheel rolls, m."""
THREE = 3.0 / 1.645
"""Three standard deviations over half an interval of 90 %."""
VEHICLES, VEHICLE, ITS_AXLES = 50, 14.0, (0.0, 1.8, 9.0, 10.8)
"""With `--train`: vehicles, their length, m, and where their axles are."""
STRUCK = {33: (70e3, 0.045, -1.2, False), 121: (55e3, 0.038, -0.6, True)}
"""With `--train`: axles with a flat: static force, N, length and place, m, and whether it is rounded."""
QUICK = 34
"""Seed of a fast bogie on three pairs of gauges."""


@dataclass(frozen=True)
class Drawn:
    """A bogie and what it rolls over; of its wheels `struck` has the flat, none if it is None."""

    speed: float
    loads: tuple[float, float]
    pairs: int
    struck: int | None
    length: float
    first: float
    worn: bool
    line: wayside.Line
    seed: int


def drawn(seed: int, healthy: bool) -> Drawn:
    """Return a bogie."""
    rng = np.random.default_rng(seed)
    pairs = int(rng.integers(3, 11))
    off = 1.0 + rng.choice([-1.0, 1.0], 4) * np.array([*rng.uniform(0.1, 0.2, 2), 0.15, 0.05])
    line = wayside.Line(
        [("pair", wayside.SPACING * k + 0.1, wayside.SPACING * k + 0.5) for k in range(pairs)], before=14.0,
        pad=wayside.PAD * off[0], ballast=wayside.BALLAST * off[1], pad_damping=wayside.PAD_DAMPING * off[2],
        hertz=wayside.HERTZ * off[3], shear=SHEAR, per_bay=12,
    )  # fmt: skip
    first, second = rng.uniform(30e3, 110e3, 2)
    struck, length, worn = int(rng.integers(2)), rng.uniform(0.025, 0.06), bool(rng.integers(2))
    place = float(rng.uniform(0.0, 2.0 * np.pi * wayside.RADIUS)) - 2.0 * np.pi * wayside.RADIUS
    speed = float(rng.uniform(10.0, 35.0))
    return Drawn(speed, (first, second), pairs, None if healthy else struck, length, place, worn, line, seed)


def site_of(pairs: list[tuple[float, float]]) -> Site:
    """Return a site with these pairs of gauges, m, and what is believed of its track and wheels."""
    rail = wt.tracks.Rail(
        bending_stiffness=wayside.BENDING, shear_stiffness=SHEAR, mass_per_length=wayside.RAIL_MASS, damping=1e-6
    )
    track = wt.tracks.Ballasted(
        rail=rail, spacing=wayside.SPACING, pad_stiffness=wayside.PAD, pad_damping=wayside.PAD_DAMPING,
        sleeper_mass=wayside.SLEEPER, ballast_stiffness=wayside.BALLAST, ballast_damping=wayside.BALLAST_DAMPING,
    )  # fmt: skip
    gauges = [
        wt.sensors.RailShearForce(name=str(number), x1=a, x2=b, rate=RATE, gain_uncertainty=GAIN)
        for number, (a, b) in enumerate(pairs)
    ]
    return Site(
        name="gauges", sensors=gauges, track=track, contact=wt.Hertz(constant_per_wheel=wayside.HERTZ),
        radius=wayside.RADIUS, unsprung_mass=wayside.MASS, uncertainty=UNCERTAIN,
    )  # fmt: skip


def peaks_at(one: Drawn, speed: float, strikes: int) -> tuple[float, float]:
    """Return the largest force of the flat at another speed, N, raw and below 500 Hz: medians over places of a bay."""
    assert one.struck is not None
    line, load = one.line, one.loads[one.struck]
    places = line.first + wayside.SPACING * (BAY + np.arange(strikes) / strikes)
    wheels = [wayside.Wheel(load, 10 * one.seed + k, (one.length, place), one.worn) for k, place in enumerate(places)]
    alone = line.passages(wheels, speed, wayside.FINELY)
    below = low_passed(alone.forces.T, wayside.FINELY, 500.0).T
    raw_peaks, low_peaks = [], []
    for place, raw, low in zip(places, alone.forces, below, strict=True):
        struck = (alone.x > place - 0.1) & (alone.x < place + BEHIND * speed)
        raw_peaks.append(raw[struck].max())
        low_peaks.append(low[struck].max())
    return float(np.median(raw_peaks)), float(np.median(low_peaks))


def measured(one: Drawn, strikes: int) -> list[dict[str, Any]]:
    """Return what is true and what is told of each wheel; at another speed it strikes at so many places of a bay."""
    rng = np.random.default_rng([one.seed, 1])
    wheels = []
    for axle, load in enumerate(one.loads):
        flat = (one.length, one.first) if axle == one.struck else None
        wheels.append(wayside.Wheel(load, 10 * one.seed + axle, flat, one.worn))
    alone = one.line.passages(wheels, one.speed, wayside.FINELY)
    read, _ = wayside.train_of(one.line, alone.recorded(RATE), one.speed, RATE, AXLES, (0, 1))
    spoiled = (1.0 + GAIN * rng.standard_normal((one.pairs, 1))) * read + NOISE * rng.standard_normal(read.shape)
    channels = {str(number): Recording(row, RATE, "force") for number, row in enumerate(spoiled)}
    begun = process_time()
    (train,) = measure_trains(channels, site_of([(a, b) for _, a, b in one.line.channels]), diagnosed="suspicious")
    took = process_time() - begun
    out = []
    for axle, load in enumerate(one.loads):
        said = train.axles[axle]["wheels"][0].get("finding") or {}
        row = {
            "seed": one.seed, "axle": axle, "speed": one.speed, "load": load, "pairs": one.pairs, "took": took,
            "kind": KINDS[one.worn] if axle == one.struck else "healthy", "length": one.length, "first": one.first,
            **{name: said.get(name) for name in SAID},
        }  # fmt: skip
        shown = train.wheels.get((axle + 1, None))
        if said.get("size") is not None and shown is not None:
            inside = (alone.x > shown.passing.x[0]) & (alone.x < shown.passing.x[-1])
            below = low_passed(alone.forces[axle], wayside.FINELY, 500.0)
            row["force_error"] = said["largest_force"] / float(alone.forces[axle][inside].max()) - 1.0
            row["below_error"] = said["largest_below_500"] / float(below[inside].max()) - 1.0
            speed = float(rng.uniform(10.0, 40.0))
            foreseen = shown.outlook([speed], [load]).sel(quantile="median").isel(speed=0, static_force=0)
            raw, low = peaks_at(one, speed, strikes)
            row["other_speed"] = speed
            row["foreseen_error"] = float(foreseen["largest_force"]) / raw - 1.0
            row["foreseen_below_error"] = float(foreseen["largest_below_500"]) / low - 1.0
        out.append(row)
    return out


def measured_by_own(seed: int) -> dict[str, Any]:
    """Return what is true and what is told of a wheel that the package's model has run."""
    rng = np.random.default_rng([seed, 2])
    bays = OWN_PLACE + wayside.SPACING * np.arange(OWN_PAIRS)
    site = site_of([(bay + 0.1, bay + 0.5) for bay in bays.tolist()])
    speed, load, length = rng.uniform((10.0, 30e3, 0.025), (35.0, 110e3, 0.06))
    worn, first = bool(rng.integers(2)), float(rng.uniform(0.1, 2.0 * np.pi * wayside.RADIUS))
    scene = known_of(site).scene
    off = {path: np.exp(share * rng.standard_normal()) for path, share in known_of(site).spread.items()}
    run = scene.replaced({
        **{path: float(factor * value_at(scene, path)) for path, factor in off.items()},
        "speed": speed, "duration": OWN_WAY / speed,
        "irregularity": [
            wt.WheelFlat(length=length, position=first, shape="rounded" if worn else "fresh"),
            wt.irregularities.Spectrum(curve="ISO 3095:2013", wavelengths=(0.022, 0.4), seed=seed),
        ],
    })  # fmt: skip
    run = run.replaced({"vehicle.load": load - run.vehicle.mass * 9.81})
    simulated = wt.simulate(run).recordings(site)
    spoiled = {
        name: replace(one, samples=gain * one.samples + NOISE * rng.standard_normal(one.samples.shape))
        for gain, (name, one) in zip(1.0 + GAIN * rng.standard_normal(OWN_PAIRS), simulated.items(), strict=True)
    }
    begun = process_time()
    try:
        (train,) = measure_trains(spoiled, site, diagnosed="suspicious")
        said = train.axles[0]["wheels"][0].get("finding") or {}
    except wt.InputError as error:  # of one wheel alone a strike may look like another wheel
        said = {"verdict": f"refused: {error}"}
    return {
        "seed": seed, "axle": 0, "speed": speed, "load": load, "pairs": OWN_PAIRS, "took": process_time() - begun,
        "kind": KINDS[worn], "length": length, "first": first, **{name: said.get(name) for name in SAID},
    }  # fmt: skip


def timed_train() -> str:
    """Return how long a train of 200 axles takes, without a model and with one, and what is told of its flats."""
    rng, speed = np.random.default_rng(5), 22.0
    line = wayside.Line(
        [("pair", wayside.SPACING * k + 0.1, wayside.SPACING * k + 0.5) for k in range(6)], before=14.0,
        pad=1.12 * wayside.PAD, ballast=0.88 * wayside.BALLAST, hertz=1.05 * wayside.HERTZ, shear=SHEAR, per_bay=12,
    )  # fmt: skip
    wheels = [wayside.Wheel(load, 900 + k, None, False) for k, load in enumerate((60e3, 75e3, 90e3, 50e3))]
    wheels += [wayside.Wheel(load, 950 + k, flat, worn) for k, (load, *flat, worn) in STRUCK.items()]
    passages = line.passages(wheels, speed, wayside.FINELY).recorded(RATE)
    axles = [VEHICLE * number + place for number in range(VEHICLES) for place in ITS_AXLES]
    chosen = rng.integers(0, 4, len(axles))
    chosen[list(STRUCK)] = 4, 5
    read, _ = wayside.train_of(line, passages, speed, RATE, axles, chosen)
    spoiled = (1.0 + GAIN * rng.standard_normal((len(read), 1))) * read + NOISE * rng.standard_normal(read.shape)
    channels = {str(number): Recording(row, RATE, "force") for number, row in enumerate(spoiled)}
    site = site_of([(a, b) for _, a, b in line.channels])
    begun = process_time()
    measure_trains(channels, site)
    without = process_time() - begun
    (train,) = measure_trains(channels, site, diagnosed="suspicious")
    took = process_time() - begun - without
    lines = [f"{len(train.axles)} axles: CPU {without:.1f} s without a model, {took:.1f} s with it"]
    for number, axle in enumerate(train.axles):
        said = axle["wheels"][0].get("finding") or {"verdict": "healthy"}
        if number in STRUCK or said["verdict"] != "healthy":
            true = f"{1e3 * STRUCK[number][1]:.1f} mm" if number in STRUCK else "none"
            lines.append(
                f"axle {number}: flat of {true}, told {said['verdict']} {1e3 * (said.get('size') or 0):.1f} mm"
            )
    return "\n".join(lines)


def summary(rows: list[dict[str, Any]]) -> str:
    """Return what is told of wheels with a flat, and of the others."""
    struck, sound = [one for one in rows if one["kind"] in KINDS], [one for one in rows if one["kind"] not in KINDS]
    sized = [one for one in struck if one["verdict"] in KINDS]
    refused = sum(one["verdict"] not in (None, "healthy", *KINDS) for one in struck)
    false = [one for one in sound if one["verdict"] in KINDS]
    lines = [
        f"{len(sound)} wheels without a flat: {len(false)} are given one",
        f"{len(struck)} flats: {len(sized)} sized, {refused} refused, {len(struck) - len(sized) - refused} not found",
    ]
    if sized:
        error = np.array([one["size"] - one["length"] for one in sized])
        ends = np.array([one["size_interval"] for one in sized])
        true = np.array([one["length"] for one in sized])
        covered = np.mean((ends[:, 0] <= true) & (true <= ends[:, 1]))
        halves = 0.5 * (ends[:, 1] - ends[:, 0])
        beyond = np.count_nonzero(abs(ends.mean(axis=1) - true) > THREE * halves)
        small, large, most = 1e3 * np.quantile(np.abs(error), [0.5, 0.95, 1.0])
        lines.append(
            f"length: {small:.2f} mm off in the median, {large:.2f} for 95 %, {most:.2f} at most; "
            f"{covered:.2f} in intervals of 90 %, {100 * np.median(halves / true):.1f} % wide to each side; "
            f"{beyond} beyond three standard deviations"
        )
        told = [one for one in sized if one["length"] >= 0.03 and one["speed"] <= 30.0]
        right = sum(one["verdict"] == one["kind"] and not one["alike"] for one in told)
        left = sum(bool(one["alike"]) for one in told)
        lines.append(
            f"kinds of {len(told)} of 30 mm and more up to 30 m/s: {right} told, {left} left open, "
            f"{len(told) - right - left} wrong"
        )
        for name, most, words in FORCES if "force_error" in sized[0] else ():
            off = np.array([one[name] for one in sized])
            lines.append(f"{words}: within {100 * most:.0f} % for {np.mean(abs(off) < most):.2f}, {off.mean():+.3f}")
    return "\n".join([*lines, f"CPU: {np.median([one['took'] for one in rows]):.1f} s a bogie, in the median"])


def main() -> None:
    """Print what is told of each wheel, and then of all."""
    parser = parser_of(__doc__)
    parser.add_argument("--bogies", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--healthy", action="store_true", help="no wheel has a flat")
    which.add_argument("--own", action="store_true", help="recordings of the package's model, of one wheel each")
    which.add_argument("--train", action="store_true", help="how long a train of 200 axles takes")
    parser.add_argument("--file", type=Path, help="where to write all of it")
    options = parser.parse_args()
    if options.train:
        print(timed_train())
        return
    rows: list[dict[str, Any]] = []
    for seed in [QUICK] if options.smallest else range(options.seed, options.seed + options.bogies):
        strikes = 1 if options.smallest else STRIKES
        found = [measured_by_own(seed)] if options.own else measured(drawn(seed, options.healthy), strikes)
        rows += found
        for one in found:
            size = "" if one["size"] is None else f"{1e3 * one['size']:.1f}"
            true = "" if one["kind"] not in KINDS else f"{1e3 * one['length']:.1f}"
            kinds = f"{one['kind']:13} {true:5} {one['verdict'] or 'not fitted':13} {size:5}"
            print(f"{seed} {one['axle']} {one['speed']:5.1f} m/s {one['pairs']:2} pairs: {kinds}", flush=True)
        if options.file:
            options.file.write_text(json.dumps(rows, indent=1), encoding="utf-8")
    print(summary(rows))


if __name__ == "__main__":
    main()
