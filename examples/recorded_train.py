"""
A recorded train: loads, and a wheel that strikes
=================================================

Six pairs of shear gauges on two rails have recorded three wagons. Which axles passed, how heavy are they, and which
wheel strikes? This needs no model of the track. The recording is simulated, with a finite-element rail on sleepers,
noise and wrong gains.
"""  # noqa: D205, D400 - a title for the gallery

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import wheeltapper as wt

folder = Path("examples") if Path("examples").is_dir() else Path()
recording = folder / "data" / "passages" / "2026-11-09T08-14_id=4711.csv.gz"
site = wt.load(folder / "detector.toml")
(train,) = wt.diagnosis.measure_trains(recording, site)
for vehicle in train.vehicles:
    first, last = vehicle["first_axle"], vehicle["last_axle"]
    print(f"axles {first} to {last}: {vehicle['load'] / 9.81e3:.1f} t")
figure = wt.plot(train)

# %%
# The table of the train has a row for each wheel. A wheel of the empty wagon strikes. Its largest force between the
# gauges is less than what any wheel of the other wagons bears at rest: no limit of the force would find it.

wheels = train.to_dataframe()
(struck,) = wheels[wheels.strikes > 0].itertuples()
print(f"axle {struck.axle} {struck.side} strikes: it bears {struck.static_kn:.2f} kN, at most {struck.peak_kn:.1f} kN")
print(f"speed {struck.speed_kmh:.1f} km/h; the heaviest wheel bears {wheels.static_kn.max():.1f} kN")

# %%
# The readings of its rail. Each turn of the wheel makes a blow, shown in red. All gauges feel it, wherever the wheel
# is. ``wheeltapper report`` draws the readings of striking wheels for a folder of recordings, with a page for each
# train.

(wheel,) = (one for one in train.axles[struck.axle - 1]["wheels"] if one["side"] == struck.side)
blow = max(wheel["strikes"], key=lambda one: one["excess"])
turn = 2 * np.pi * site.radius / (struck.speed_kmh / 3.6)  # s
channels = wt.diagnosis.read_channels(recording, site)
pairs = [one.name for one in site.sensors if one.side == struck.side]
figure = Figure(figsize=(8.0, 6.0), layout="constrained")
axes = figure.subplots(len(pairs), sharex=True, sharey=True)
for axis, pair in zip(axes, pairs, strict=True):
    samples = channels[pair].samples
    axis.plot(np.arange(len(samples)) / channels[pair].rate, 1e-3 * samples, linewidth=1.0)
    for number in range(-3, 4):
        axis.axvline(blow["time"] + number * turn, color="tab:red", linewidth=4.0, alpha=0.3)
    axis.set(title=pair, ylabel="force [kN]", xlim=(blow["time"] - 0.45, blow["time"] + 0.35))
axes[-1].set_xlabel("time [s]")
