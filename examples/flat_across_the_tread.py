"""
The measured wheel flat across its tread
========================================

A rail is curved, and a wheel over a flat rests beside its deepest line. This script takes the whole surface of the
measured flat to the one line that the wheel rolls on: at each angle, how far the wheel may sink until some point of its
cross-section touches the rail. Then follows the circle along the rail, which :class:`~wheeltapper.OutOfRound` is for.

A 60E1 inclined 1:40 feels 1.14 mm at most, not 1.32 mm as along the tape line. Another rail feels another flat: one
whose head is flatter, R 300 as far as 16 mm to both sides, 0.7 mm. For that rail the program CONTACT has published
where the unloaded wheel stands, and its positions are those of this script within 0.02 mm.

Give the name of a file to write the line to; ``data/wheel_flat_chalmers_60e1.csv`` was written so.
"""  # noqa: D205, D400 - a title for the gallery

import gzip
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from wheeltapper.describe.profile.rail_60e1 import rail_60e1
from wheeltapper.describe.profile.s1002 import FLANGE_BACK, s1002
from wheeltapper.lower.laws.geometry import laid_rail

INCLINATION, GAUGE, FLANGE_BACKS, RADIUS = 1 / 40, 1.435, 1.360, 0.490  # of the rail; m
HEAD = """\
# The Chalmers flat as a 60E1 rail, inclined 1:40, feels it under a wheelset in the middle: nominal radius 0.490 m
# s_m: arc length, angle in the wheel frame times 0.490 m; dr_m: how far the wheel sinks, negative, before it touches
# derived by examples/flat_across_the_tread.py from wheel_flat_chalmers_surface.csv.gz
# whole circumference, to be closed periodically; dense (about 1 mm) for s 0.240 to 0.398 m, scan noise about 0.01 mm
# source: github.com/eve70a/CONTACT, examples/S1002_flat*, commit d431cdbd125084c79bd59df83b4ac4c63c570ac9
# data courtesy of M. Maglio and J. Nielsen, Chalmers University of Technology; Apache License 2.0
# (LICENSE-Apache-2.0.txt beside this file); changed here: one line for the surface
s_m,dr_m
"""


def surface(path):
    """Return angles (rad), places across the tread (m), and deviations of the radius there (m)."""
    with gzip.open(path, "rt", encoding="utf-8") as file:
        lines = [line.split(",") for line in file if not line.startswith("#")]
    across = np.array([float(name.removeprefix("y=")) for name in lines[0][1:]])
    rows = np.array(lines[1:], dtype=float)
    return rows[:, 0], across, rows[:, 1:]


def gap(across, rail=rail_60e1, inclination=INCLINATION):
    """Return the gap (m) of the undamaged wheel and the rail, where they touch at one place."""
    place, height = laid_rail(rail, inclination, GAUGE)
    on_track = 0.5 * FLANGE_BACKS + 1e-3 * FLANGE_BACK + across
    found = -1e-3 * s1002(1e3 * across) - np.interp(on_track, place, height)
    return found - found.min()


def felt(across, deviations, **rail):
    """Return how far the wheel sinks at each angle, m, negative; beyond the scan its last values hold."""
    fine = np.linspace(-0.034, 0.044, 781)
    room = gap(fine, **rail)
    return np.array([(np.interp(fine, across, row) - room).max() for row in deviations])


folder = Path("examples") if Path("examples").is_dir() else Path()
angles, across, deviations = surface(folder / "data" / "wheel_flat_chalmers_surface.csv.gz")
line = felt(across, deviations)
tape = deviations[:, np.argmin(np.abs(across))]

# %%
# The tape line is the wheel's middle, y = 0.

print(f"deepest along the tape line: {-1e3 * tape.min():.3f} mm; as the rail feels it: {-1e3 * line.min():.3f} mm")
for depth in (1e-4, 5e-4, 1e-3):
    lengths = [1e3 * RADIUS * np.ptp(angles[deep]) for deep in (tape < -depth, line < -depth)]
    print(f"deeper than {1e3 * depth:.1f} mm: along {lengths[0]:.0f} mm, and {lengths[1]:.0f} mm")
if len(sys.argv) > 1:
    rows = (f"{RADIUS * angle:.6f},{deviation:.7f}\n" for angle, deviation in zip(angles, line, strict=True))
    Path(sys.argv[1]).write_text(HEAD + "".join(rows), encoding="utf-8")

# %%
# The flat along both lines.

figure = Figure(figsize=(8.0, 4.5), layout="constrained")
axis = figure.subplots()
for found, name in ((tape, "along the tape line"), (line, "as the rail feels it")):
    axis.plot(1e3 * RADIUS * angles, 1e3 * found, label=name)
axis.set(xlabel="place along the tread [mm]", ylabel="deviation of the radius [mm]", xlim=(230.0, 410.0))
axis.legend(frameon=False)
