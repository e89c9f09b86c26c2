"""
A corrugated rail that makes a wheel bounce for ever
====================================================

On a corrugation of 50 µm and 5 cm a wheel has two motions at one speed: one keeps contact, the other leaves the rail
once in each wave and never stops. Which speeds are they, which kick begins it, and which grinding depth ends it? The
rail is rigid: a real track bounces less.
"""  # noqa: D205, D400 - a title for the gallery

import numpy as np

import wheeltapper as wt

scene = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4),
    contact=wt.Hertz(constant=1.405e11),
    irregularity=wt.Corrugation(amplitude="50 µm", wavelength="5 cm", start=0.0),
    rolling="point",
    speed=5.0,
    duration=1.0,
)
calm = wt.orbits.find(scene)
bouncing = wt.orbits.find(scene, start={"displacement": 2.04e-4, "velocity": -0.199})
figure = wt.plot(bouncing)

# %%
# The branch of orbits over the speed. A wheel that speeds up jumps at the upper fold; one that slows down bounces until
# the lower one.

branch = wt.orbits.follow(calm, {"speed": (2.5, 30.0)})
lower, upper = np.sort(branch.parameter.values[branch.kind.values == "fold"])[[0, -1]]
print(f"two motions from {lower:.3f} to {upper:.3f} m/s")
figure = wt.plot(branch)

# %%
# Where motions end that begin beside the orbits, at 5 m/s: a kick of some 0.2 m/s is enough.

starts = {"start.displacement": np.linspace(-4e-4, 4e-4, 40), "start.velocity": np.linspace(-0.4, 0.4, 40)}
fates = wt.orbits.fates(scene, starts, settle=300)
figure = wt.plot(fates)

# %%
# The border of the jump in the plane of speed and depth: what to grind, for which speed.

fold = branch.isel(special=int(np.flatnonzero(np.isclose(branch.parameter, upper))[0]))
border = wt.orbits.trace(calm, fold, {"irregularity.0.amplitude": np.arange(45e-6, 10e-6, -10e-6)})
figure = wt.plot(border)

# %%
# A bouncing that has begun ends only on a much smoother rail.

depth = wt.orbits.follow(bouncing, {"irregularity.0.amplitude": (5e-6, 6e-5)})
(ends,) = depth.parameter.values[depth.kind.values == "fold"]
print(f"at 5 m/s grinding to {1e6 * ends:.2f} µm ends the bouncing")
figure = wt.plot(depth)
