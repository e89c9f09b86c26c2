"""
A week of traffic with one growing flat
=======================================

A wagon with two wheelsets passes four pairs of gauges on each rail once a day, empty or loaded. One of its wheels has
a flat that grows from 25 to 40 mm. On Thursday it does not pass. This script writes what the gauges record. The page
"A week of traffic" of the user guide reads it as a detector does.

The track is not what the site states, and the gauges have wrong gains, as in life.
"""  # noqa: D205, D400 - a title for the gallery

import gzip
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import wheeltapper as wt

folder = Path("examples") if Path("examples").is_dir() else Path()
site = wt.load(folder / "week.toml")
RATE, NOISE, WHEELBASE, FLAT_AXLE = 5e3, 0.5, 9.0, 2  # Hz, kN, m
AHEAD, BEHIND = 4.8, 6.2  # m, of a wheel's run before x = 0, whole bays, and behind it

# %%
# Day, speed (m/s), static force of a wheel (kN), length of the flat (mm), and where along the rail it strikes (m).

DAYS = (
    ("2026-11-02T06-40", 19.0, 62.0, 25.0, 1.7),
    ("2026-11-03T06-42", 22.0, 48.0, 27.5, 0.3),
    ("2026-11-04T06-39", 17.0, 85.0, 30.0, 2.4),
    ("2026-11-06T06-44", 24.0, 55.0, 35.0, 1.1),
    ("2026-11-07T06-40", 20.0, 88.0, 37.5, 0.8),
    ("2026-11-08T06-41", 21.0, 70.0, 40.0, 2.0),
)

# %%
# Each wheel is a run of its own on a rough rail. The track below the gauges is linear, so that the readings of wheels
# add up.

stated = site.track
track = stated.model_copy(
    update={
        "pad_stiffness": 0.93 * stated.pad_stiffness,
        "ballast_stiffness": 1.1 * stated.ballast_stiffness,
    }
)
MASS = 0.97 * site.unsprung_mass  # kg
TURN = 2.0 * np.pi * site.radius  # m
GAINS = 1.0 + 0.04 * np.random.default_rng(7).standard_normal(8)


def wheel(side, speed, load, seed, flat=None):
    """Return what the pairs of a rail read of a wheel, kN, (sensors, samples)."""
    rough = [
        wt.irregularities.Spectrum(curve="ISO 3095:2013", wavelengths=(0.022, 0.446), seed=one)
        for one in (seed, {"left": 1, "right": 2}[side])
    ]
    flats = []
    if flat is not None:  # it has struck before it comes to the gauges
        length, place = flat
        flats = [wt.WheelFlat(length=1e-3 * length, position=(place + AHEAD) % TURN)]
    vehicle = wt.Wheelset(
        mass=MASS, load=1e3 * load - MASS * 9.81, stiffness=0.0, damping=0.0, radius=site.radius, wheels=1
    )
    scene = wt.Scenario(
        vehicle=vehicle,
        track=track,
        contact=wt.Hertz(curvature=False),  # a constant, as fits of wheels have it
        speed=speed,
        duration=(AHEAD + BEHIND) / speed,
        irregularity=[*flats, *rough],
    )
    moved = [
        one.model_copy(update={"x1": one.x1 + AHEAD, "x2": one.x2 + AHEAD, "gain": gain})
        for one, gain in zip(site.sensors, GAINS, strict=True)
        if one.side == side
    ]
    run = wt.simulate(scene)
    return 1e-3 * np.stack([one.samples for one in run.recordings(moved).values()])


def passage(number):
    """Return what the gauges record on a day, kN, (samples, sensors)."""
    _, speed, load, length, place = DAYS[number]
    rng, out = np.random.default_rng(number), []
    for side in ("left", "right"):
        total = np.zeros((4, round((WHEELBASE + AHEAD + BEHIND + 4.0) / speed * RATE)))
        for axle in (1, 2):
            flat = (length, place) if (axle, side) == (FLAT_AXLE, "left") else None
            read = wheel(side, speed, load * rng.uniform(0.95, 1.05), int(rng.integers(1_000_000)), flat)
            first = round((2.0 + WHEELBASE * (axle - 1)) / speed * RATE)
            total[:, first : first + read.shape[1]] += read
        out.append(total)
    whole = np.concatenate(out).T
    return whole + NOISE * rng.standard_normal(whole.shape)


# %%
# A file for each day. Its name has the time and the wagon's number.

output = Path("week")
output.mkdir(exist_ok=True)
names = ",".join(f"{one.name} [kN]" for one in site.sensors)
for number, (day, *_) in enumerate(DAYS):
    table = passage(number)
    rows = "\n".join(",".join(f"{one:.1f}" for one in row) for row in table)
    text = f"# rate: {RATE:g} Hz\n# {names}\n{rows}\n"
    (output / f"{day}_id=2380417.csv.gz").write_bytes(gzip.compress(text.encode(), mtime=0))
    print(f"{day}: the largest reading is {table.max():.1f} kN")

# %%
# The readings of the left rail on the last day. The second wheel strikes.

figure = Figure(figsize=(8.0, 4.5), layout="constrained")
axis = figure.subplots()
for number in range(4):
    axis.plot(np.arange(len(table)) / RATE, table[:, number], linewidth=1.0, label=site.sensors[number].name)
axis.set(xlabel="time [s]", ylabel="reading [kN]", xlim=(0.2, 1.1))
axis.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, frameon=False)
