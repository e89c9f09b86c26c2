"""
A wheel flat below a laden freight wagon
========================================

A wagon of 90 t runs on two bogies. Its axle boxes stand on nests of coil springs, of which the inner ones engage under
load, and only dry friction damps them: inclined links carry one nest of each box and press it against its guide. One
wheel has a flat of 50 mm. What do the other wheels, the bogie and the body feel? Masses, springs and friction are
typical of such wagons, and are not those of a published vehicle.
"""  # noqa: D205, D400 - a title for the gallery

from matplotlib.figure import Figure

import wheeltapper as wt

PIVOTS, HALF_BASE = {1: -0.9, 2: -9.9}, 0.9  # m, from the leading wheelset
places = [pivot + end for pivot in PIVOTS.values() for end in (HALF_BASE, -HALF_BASE)]
body = wt.vehicles.Body(
    name="car body", mass="80.4 t", inertia=(85e3, 1.35e6, 1.35e6), position=(-5.4, 0.0, 1.9), held=("x",)
)
frames = [
    wt.vehicles.Body(name=f"bogie {number}", mass="2.2 t", inertia=(1500, 1500, 2800), position=(pivot, 0.0, 0.6))
    for number, pivot in PIVOTS.items()
]
axles = [wt.vehicles.Axle(mass="1.3 t", inertia=(700, 100, 700), position=x, radius=0.46) for x in places]

elements = []
for number, x in enumerate(places, 1):
    for side, y in (("left", 1.0), ("right", -1.0)):
        ends = {"between": (f"bogie {(number + 1) // 2}", f"wheelset {number}")}
        for way, beside in (("front", 0.15), ("rear", -0.15)):
            nest = ends | {"at": (x + beside, y, 0.46), "name": f"nest {number} {side} {way}", "along": "z"}
            elements.append(
                wt.vehicles.CompressionSpring(compression=("0 mm", "35 mm", "90 mm"), force=(0, 17.5e3, 86.3e3), **nest)
            )
        middle = ends | {"at": (x, y, 0.46)}
        elements += [
            wt.vehicles.Spring(name=f"guide {number} {side}", stiffness=(5e6, 2e6, 0), **middle),
            wt.vehicles.LenoirLink(
                name=f"friction {number} {side}",
                load=f"nest {number} {side} front",
                friction=0.3,
                angle="22 deg",
                **middle,
            ),
        ]
for number, x in PIVOTS.items():
    pivot = {"between": ("car body", f"bogie {number}"), "at": (x, 0.0, 0.9)}
    stiff = {"stiffness": (5e7, 5e7, 1e8), "bending": (5e5, 0.0, 0.0)}
    bowl = {"shape": "sphere", "radius": 0.19, "half_angle": "45 deg", "friction": 0.2, "series_stiffness": 1e7}
    elements.append(wt.vehicles.Spring(name=f"pivot {number}", **pivot, **stiff))
    elements.append(wt.vehicles.CentreBowl(name=f"centre bowl {number}", load=f"pivot {number}", **pivot, **bowl))
    for side, y in (("left", 0.85), ("right", -0.85)):
        bearer = pivot | {"at": (x, y, 0.9)}
        spring = {"compression": (0, 0.04), "force": (0, 20e3), "preload": "8 kN", "along": "z"}
        elements.append(wt.vehicles.CompressionSpring(name=f"side bearer {number} {side}", **bearer, **spring))
        rubs = bearer | {"along": "x", "load": f"side bearer {number} {side}", "coefficient": 0.25}
        elements.append(wt.vehicles.Friction(name=f"pad {number} {side}", series_stiffness=1e7, **rubs))
wagon = wt.Wagon(bodies=(body, *frames), axles=tuple(axles), elements=tuple(elements))
figure = wt.plot(wagon)

# %%
# The flat is below the leading wheel of the left rail, at 72 km/h.

scene = wt.Scenario(
    vehicle=wagon,
    track=wt.tracks.Ballasted.named("Zhai2004"),
    contact=wt.Hertz(constant_per_wheel=9.4e10),
    creep=wt.creep.Polach(friction=0.35),
    irregularity={"wheelset 1 left": wt.WheelFlat(length="50 mm", position=0.5, repeat=False)},
    speed="72 km/h",
    duration=0.06,
)
struck = wt.simulate(scene)
figure = wt.plot(struck)

# %%
# The rail carries the blow to the wheel behind, 1.8 m away. A wheel on the other rail, or of the other bogie, hardly
# feels it.


def added(vehicle):
    """Return the largest values of what the flat adds to the wagon's history."""
    flat, no_flat = (
        wt.simulate(scene.replaced({"vehicle": vehicle} | change)).history(rate=20e3)
        for change in ({}, {"irregularity": None})
    )
    return (flat - no_flat).max("time")


history = struck.history(rate=20e3)
figure = Figure(figsize=(8.0, 4.5), layout="constrained")
axis = figure.subplots()
for number in (1, 2, 3):
    force = history.normal_force.sel(wheelset=number, side="left")
    axis.plot(1e3 * history.time, 1e-3 * force, label=f"wheelset {number}")
axis.set(xlabel="time [ms]", ylabel="force of the left wheel [kN]", xlim=(20.0, 40.0))
axis.legend(frameon=False)
felt = added(wagon)
for number, side in ((1, "left"), (1, "right"), (2, "left"), (2, "right"), (3, "left")):
    more = 1e-3 * float(felt.normal_force.sel(wheelset=number, side=side))
    print(f"wheelset {number} {side}: {more:.1f} kN more")

# %%
# Friction that sticks is stiffer than the springs. It hands a part of the blow to the bogie's frame, and slides for one
# to three milliseconds. The body above, of 80 t, stays calm.

frictionless = added(wagon.without(*(one.name for one in elements if one.name.startswith("friction"))))
print(f"friction begins to slide {int((struck.suspension_events.kind == 'slip').sum())} times")
for name in ("bogie 1", "car body"):
    stuck, free = (float(one.acceleration.sel(body=name, motion="z")) for one in (felt, frictionless))
    print(f"{name}: up to {stuck:.2f} m/s² more, without friction {free:.3f} m/s²")

# %%
# How far does the smallest model go, a mass on its springs and on the contact? Over a joint below both rails it has the
# largest force of the wagon without friction within a hundredth. With friction that force is a twelfth smaller: while
# it sticks, the bogie's frame moves with the wheelset, and where it slides, it takes energy; the small model leaves out
# both.

joint = wt.irregularities.DippedJoint(angle="20 mrad", length="1 m", position=1.0)
over_joint = scene.replaced({"track": wt.StiffTrack(), "irregularity": joint, "duration": 0.12})
small = wt.simulate(wt.reduced(over_joint))
without = wagon.without(*(one.name for one in elements if one.name.startswith("friction")))
for words, vehicle in (("without friction", without), ("with friction", wagon)):
    whole = wt.simulate(over_joint.replaced({"vehicle": vehicle}))
    forces = [float(one.peaks.normal_force.max() / one.static_force) for one in (whole, small)]
    print(f"{words}: {forces[0]:.3f} of static in the whole wagon, {forces[1]:.3f} in the small model")
