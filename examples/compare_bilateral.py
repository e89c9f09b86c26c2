"""
A contact that pulls
====================

Many studies of the wheel on corrugated rail let the contact pull: a linear spring, always closed. Here a wheelset meets
corrugation at its contact resonance, once with such a spring and once with Hertz's contact, which can only push. Both
have the same stiffness at rest.
"""  # noqa: D205, D400 - a title for the gallery

from math import sqrt

import wheeltapper as wt

unilateral = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=8e3, radius=0.46),
    track=wt.StiffTrack(),
    contact=wt.Hertz(constant=1.405e11),
    irregularity=wt.Corrugation(amplitude="-50 um", wavelength="5 cm", start=0.05),
    rolling="point",
    speed=9.0,
    duration=0.05,
)
indentation = -float(wt.simulate(unilateral).at([0.0]).wheel_displacement[0])
spring = wt.Linear(stiffness=1.5 * 1.405e11 * sqrt(indentation), bilateral=True)
bilateral = unilateral.replaced({"contact": spring})

# %%
# The spring's resonance climbs without bounds; what stops the real wheel is that it lifts off.

real, pulled = wt.simulate(unilateral), wt.simulate(bilateral)
static = real.static_force
largest = float(real.peaks.normal_force.max()) / static
largest_pulled = float(pulled.peaks.normal_force.max()) / static
pull = -float(pulled.history(rate=50e3).normal_force.min()) / static
print(f"one-sided contact: {real.impacts.sizes['impact']} impacts, largest force {largest:.2f} of static")
print(f"two-sided contact: no impact, largest force {largest_pulled:.1f}, and it pulls with up to {pull:.1f} of static")

# %%
figure = wt.plot(real)

# %%
figure = wt.plot(pulled)
