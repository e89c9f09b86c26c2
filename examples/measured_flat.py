"""
A measured wheel flat
=====================

A real flat, scanned by laser at Chalmers University of Technology. It is 1.3 mm deep along the wheel's tape line, but
a 60E1 rail touches it beside that line, where the flat is 1.1 mm deep and 9 cm long (the example "The measured wheel
flat across its tread"). The scan has a noise of 0.01 mm. A smoothing spline stays at that distance from the samples.
Without it the curvature of the noise would act like corrugation.

The track is rigid here and overpredicts the forces of so long a flat several times: read them as comparisons.
"""  # noqa: D205, D400 - a title for the gallery

from pathlib import Path

import wheeltapper as wt

folder = Path("examples") if Path("examples").is_dir() else Path()
flat = wt.OutOfRound(path=folder / "data" / "wheel_flat_chalmers_60e1.csv", noise=1e-5, position=0.2)
scene = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4, radius=0.49),
    track=wt.StiffTrack(),
    contact=wt.Hertz(constant=1.405e11),
    irregularity=flat,
    speed=15.0,
    duration=0.2,
)

# %%
# The flat's middle meets the rail at 0.518 m. The wheelset leaves the rail at its beginning, flies across, and lands
# a centimetre behind the middle.

record = wt.simulate(scene)
events = record.events
print(record)
print(f"leaves the rail at {float(events.position[0]):.4f} m, lands at {float(events.position[1]):.4f} m")

# %%
# Slowly, the wheel rolls into the flat; fast, it has no time to fall. The blow is hardest between the two.

for speed in (5.0, 10.0, 15.0, 20.0, 30.0):
    passed = wt.simulate(scene.replaced({"speed": speed, "duration": 3.0 / speed}))
    force = float(passed.peaks.normal_force.max()) / passed.static_force
    print(f"{speed:4.0f} m/s: largest force {force:5.2f} of static")

# %%
figure = wt.plot(record)
