"""
A wheel in resonance with its contact
=====================================

A wheel on a corrugated rail is a mass on the spring of its contact, k = 3/2·C^(2/3)·N^(1/3). It is shaken with the
frequency V/λ, and most where that is √(k/m)/2π. The waves here are so low that contact is never lost.
"""  # noqa: D205, D400 - a title for the gallery

import numpy as np

import wheeltapper as wt

mass, constant, wavelength = 1500.0, 1.405e11, 0.05
scene = wt.Scenario(
    vehicle=wt.Wheelset(mass=mass, load=91_307, stiffness=2.44e6, damping=5e4),
    contact=wt.Hertz(constant=constant),
    irregularity=wt.Corrugation(amplitude=5e-7, wavelength=wavelength, start=0.05),
    rolling="point",
    speed=7.0,
    duration=0.6,
)
speeds = np.linspace(4.0, 10.0, 121)
chart = wt.sweep(scene, {"speed": speeds}, ["largest_force"])
worst = float(speeds[np.argmax(chart.largest_force.values)])
static = wt.simulate(scene).static_force
stiffness = 1.5 * constant ** (2 / 3) * static ** (1 / 3)
formula = wavelength * np.sqrt(stiffness / mass) / (2 * np.pi)
print(f"largest force at {worst:.2f} m/s, by the formula at {formula:.2f} m/s")

# %%
# The force over the speed.

figure = wt.plot(chart)

# %%
# Higher waves: the wheel leaves the rail, and the resonance bends to lower speeds, because a contact that is open part
# of the time is softer.

high = wt.sweep(scene.replaced({"irregularity.0.amplitude": 3e-5}), {"speed": speeds}, ["largest_force"])
bent = float(speeds[np.argmax(high.largest_force.values)])
print(f"where the wheel leaves the rail, largest force at {bent:.2f} m/s")
figure = wt.plot(high)

# %%
# A film of that.

record = wt.simulate(scene.replaced({"irregularity.0.amplitude": 3e-5, "speed": bent, "duration": 0.12}))
film = wt.show.animate(record, "resonance.gif", seconds=4.0, frames_per_second=15)
