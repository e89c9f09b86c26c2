"""
A falling wheel, and Hertz's formula
====================================

A wheelset without load meets the rail at 0.5 m/s. Hertz (1882) gives the largest force and the duration of an elastic
impact in closed form: N = C^(2/5)·(5/4·m·v²)^(3/5), and T = 2.943·δ/v. Gravity, which they leave out, adds 2 %.
"""  # noqa: D205, D400 - a title for the gallery

import wheeltapper as wt

mass, constant, speed = 1500.0, 1.405e11, 0.5
drop = wt.Scenario(
    vehicle=wt.Wheelset(mass=mass),
    contact=wt.Hertz(constant=constant),
    speed=0.0,
    duration=0.02,
    start={"displacement": 1e-6, "velocity": -speed},
)
record = wt.simulate(drop)
impact = record.impacts.isel(impact=0)
force = constant**0.4 * (1.25 * mass * speed**2) ** 0.6
duration = 2.943 * (force / constant) ** (2 / 3) / speed
print(f"largest force {float(impact.peak_force) / 1e3:.1f} kN, by Hertz {force / 1e3:.1f} kN")
print(f"over Hertz's formula: {float(impact.peak_force) / force:.4f}")
print(f"contact lasts {1e3 * float(impact.duration):.3f} ms, by Hertz {1e3 * duration:.3f} ms")

# %%
# The same as a film: the indentation is seen as the part of the wheel's arc that lies in the rail.

film = wt.show.animate(record, "falling_wheel.gif", stop="10 ms", seconds=3.0, frames_per_second=15)

# %%
# Force and motion over time.

figure = wt.plot(record)
