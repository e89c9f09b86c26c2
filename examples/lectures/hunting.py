"""
Klingel's wave
==============

Two cones on one axle steer themselves along the track, and swing about its middle: Klingel (1883) found the wavelength
L = 2π·√(r·e/γ) from geometry alone: r is the rolling radius, e half the distance of the contacts, γ the conicity.
With creep forces the same swing grows or decays, and above a critical speed it grows.
"""  # noqa: D205, D400 - a title for the gallery

import numpy as np

import wheeltapper as wt

radius, arm, conicity = 0.46, 0.75, 0.05
axle = wt.vehicles.Axle(mass=1500, inertia=(1000, 100, 1000), position=0.0, radius=radius, load=90e3)
alone = wt.Scenario(
    vehicle=wt.Wagon(bodies=(), axles=(axle,)),
    profiles=wt.profiles.Cones(conicity=conicity, arm=arm),
    contact=wt.Hertz(constant_per_wheel=7.025e10),
    creep=wt.creep.KalkerLinear(),
    speed=1.0,
    duration=1.0,
)
klingel = 2 * np.pi * np.sqrt(radius * arm / conicity)
modes = wt.modes(alone)
swing = modes.isel(mode=np.argmin(np.abs(modes.frequency.values - alone.speed / klingel)))
print(f"wavelength {alone.speed / float(swing.frequency):.3f} m, by Klingel {klingel:.3f} m")

# %%
# A coach, whose wheelsets are held by springs, runs quietly up to its critical speed.

coach = wt.Scenario(
    vehicle=wt.vehicles.ErriB176(), contact=wt.Hertz(constant_per_wheel=7.025e10), creep=wt.creep.Polach(friction=0.35),
    speed=20.0, duration=1.0,
)  # fmt: skip
figure = wt.plot([wt.modes(coach.replaced({"speed": speed})) for speed in (40.0, 50.0, 60.0, 70.0, 80.0)])
print(f"critical speed {wt.stability.critical_speed(coach):.1f} m/s")

# %%
# The profiles that make it so.

figure = coach.profiles.plot()
