"""
A bump on the rail
==================

A heavily damped wheelset rolls over a bump of 0.2 mm: first a phase of vibro-impacts, then contact vibrations that
decay (Fig. 2a of the paper). The interval between impacts tells the unsprung mass, the ratio of their forces the
damping.
"""  # noqa: D205, D400 - a title for the gallery

import wheeltapper as wt

scene = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4, radius=0.46),
    track=wt.StiffTrack(),
    contact=wt.Hertz(constant=1.405e11),
    irregularity=wt.CosineBump(height="0.2 mm", length="50 mm", start=0.009),
    rolling="point",
    speed=9.0,
    duration=0.12,
)
record = wt.simulate(scene)
print(record)

# %%
# Eleven impacts; each comes sooner and is weaker than the one before.

impacts = record.impacts
interval = float(impacts.interval[0])
force_ratio = float(impacts.force_ratio[0])
print(f"first interval {1e3 * interval:.4f} ms, first force ratio {force_ratio:.4f}")

# %%
# The same wheelset with a broken spring that drags along a part of the bogie, at the same load on the rail:

added = 670.0
heavier = wt.simulate(scene.replaced({"vehicle.mass": 1500 + added, "vehicle.load": 91_307 - added * 9.81}))
change = float(heavier.impacts.interval[0]) / interval - 1.0
print(f"with {added:.0f} kg more the first interval is {100 * change:.1f} % longer")

# %%
# The whole motion; flights are shaded.

figure = wt.plot(record)
