"""
Twice the speed over a joint
============================

A dipped joint turns the wheel's path by an angle, as a kink would. The first peak, P1, is the blow of the wheel's mass
on its contact: it grows with the speed. The second, P2, is the wheelset together with the track, moving as a whole.
Jenkins and others (1974) gave formulas for both: P1 - P0 and P2 - P0 are proportional to angle times speed.
"""  # noqa: D205, D400 - a title for the gallery

import wheeltapper as wt

scene = wt.Scenario(
    vehicle=wt.Wheelset(mass="1200 kg", load="188.228 kN"),  # with the weight 100 kN per wheel
    track=wt.tracks.Ballasted.named("Zhai2004"),
    contact=wt.Hertz(constant=1.8825e11),
    irregularity=wt.irregularities.DippedJoint(angle="10 mrad", length=1.0, position=1.5),
    speed=20.0,
    duration=0.15,
)
study = wt.tracks.joint_forces(scene, [20.0, 40.0])
static = 200e3
first, second = ((study[name] - static).values for name in ("P1", "P2"))
print(f"twice the speed: P1 - P0 grows {first[1] / first[0]:.3f} times, P2 - P0 {second[1] / second[0]:.3f} times")
formula = (study.P1_jenkins - static).values
print(f"by the formulas P1 - P0 grows {formula[1] / formula[0]:.3f} times")

# %%
# The forces of the slower run over those of the faster one.

runs = [wt.simulate(scene.replaced({"speed": speed, "duration": 3.0 / speed})) for speed in (20.0, 40.0)]
figure = wt.plot(runs)

# %%
# The rail and its sleepers give way below the wheel.

film = wt.show.animate(runs[0], "joint.gif", start="50 ms", stop="110 ms", seconds=5.0, frames_per_second=15)
