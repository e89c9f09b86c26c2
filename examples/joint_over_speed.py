"""
A joint over speed
==================

A dipped joint of 20 mrad: P1, P2 and the largest force by the exact march, beside the formulas of Jenkins and others
(1974), which take the track as one mass. They lie above: a rail carries waves away, and falls away before the joint.
"""  # noqa: D205, D400 - a title for the gallery

import wheeltapper as wt

scene = wt.Scenario(
    vehicle=wt.Wheelset(mass="1200 kg", load="188.228 kN"),  # with the weight 100 kN per wheel
    track=wt.tracks.Ballasted(
        rail="60E1", spacing=0.6, pad_stiffness="180 kN/mm", pad_damping="18 kN s/m", sleeper_mass=150,
        ballast_stiffness="105 kN/mm", ballast_damping="48 kN s/m",
    ),
    contact=wt.Hertz(constant=1.8825e11),
    irregularity=wt.irregularities.DippedJoint(angle="20 mrad", length=1.0, position=3.0),
    speed="90 km/h",
    duration=0.22,
)  # fmt: skip
study = wt.tracks.joint_forces(scene, [10, 15, 20, 25, 30, 35, 40, 45, 50])
figure = wt.plot(study)
exact, formula = float(study.P2[-1]) / 2e3, float(study.P2_jenkins[-1]) / 2e3
print(f"P2 at 50 m/s: {exact:.1f} kN per wheel, by the formula {formula:.1f}")

# %%
# Softer pads that damp more: P1 is larger, P2 lower.
soft = wt.tracks.joint_forces(scene.replaced({"track": wt.tracks.Ballasted.named("Zhai2004")}), study.speed.values)
figure = wt.plot(soft)
print(f"P2 at 50 m/s on softer pads: {float(soft.P2[-1]) / 2e3:.1f} kN per wheel")

# %%
# What limits say of the fastest run, each a copy of a document that changes.
fastest = wt.simulate(scene.replaced({"speed": 50.0, "duration": 0.15}))
limits = wt.limits.check(fastest, countries=["GB", "SE", "EU"])
figure = wt.plot(limits)
print(f"{len(limits.exceeded)} of {len(limits)} limits are exceeded")
