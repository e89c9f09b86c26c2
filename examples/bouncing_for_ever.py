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
# From which speed and which kick: where motions end that begin at rest on the rail, but with a velocity. Between the
# two folds of the branch a kick makes the wheel bounce for ever: the faster it runs, the smaller a kick.

kicks = {"speed": np.linspace(2.5, 7.5, 26), "start.velocity": np.linspace(-0.8, 0.8, 41)}
fates = wt.orbits.fates(scene, kicks, settle=300)
figure = wt.plot(fates)

# %%
# The speeds to avoid, against the depth: both motions exist between the two borders. What to grind, for which speed.
# Only the ratio of speed and wavelength counts for a wheel whose centre follows the rail: with 10 cm the speeds are
# twice as high.

folds = np.flatnonzero(branch.kind.values == "fold")
ends, jump = (branch.isel(special=folds[np.argmin(np.abs(branch.parameter.values[folds] - v))]) for v in (lower, upper))
depths = {"irregularity.0.amplitude": np.arange(50e-6, 9e-6, -5e-6)}
figure = wt.plot([wt.orbits.trace(calm, special, depths) for special in (ends, jump)])

# %%
# A bouncing that has begun ends only on a much smoother rail.

depth = wt.orbits.follow(bouncing, {"irregularity.0.amplitude": (5e-6, 6e-5)})
(ground,) = depth.parameter.values[depth.kind.values == "fold"]
print(f"at 5 m/s grinding to {1e6 * ground:.2f} µm ends the bouncing")
figure = wt.plot(depth)

# %%
# What it does to the rail: five passages, each from the settled motion. The bouncing wheel hammers the crests down. The
# calm one presses the troughs deeper, on a rail that yields at 1.2 times the static force.

law = wt.contact.Thornton(constant=1.405e11, yield_force=1.2 * calm.record.static_force)
yielding = {"contact": law, "duration": 0.2}
worn = [wt.wear_in(orbit.record.scenario.replaced(yielding), 5, every=1) for orbit in (calm, bouncing)]
for rail, name in zip(worn, ("calm", "bouncing"), strict=True):
    amplitude = 1e6 * rail.amplitude.sel(wavelength=0.05, method="nearest").values
    print(f"{name}: {amplitude[0]:.2f} µm become {amplitude[-1]:.2f} µm")
figure = wt.plot(worn[1])
