"""Bodies that elements hold to the ground beside a wheelset, and that begin away from where they rest."""

from functools import partial

import numpy as np

import wheeltapper as wt
from wheeltapper.lower.wagon import lower_wagon
from wheeltapper.march import run
from wheeltapper.march.wagon.assembly import (
    MOTION_Y,
    MOTION_Z,
    PITCH,
    PLACES,
    ROLL,
    STEP_ELEMENTS,
    STEP_TIME,
    TO_RATE,
    YAW,
)

HELD = ("x", "y", "roll", "pitch", "yaw")
AXLE = {"mass": 1500.0, "inertia": (1120.0, 112.0, 1120.0), "held": HELD, "position": 0.0}
PLACE_OF = {"y": MOTION_Y, "z": MOTION_Z, "roll": ROLL, "pitch": PITCH, "yaw": YAW}


def element(kind, name, between, **numbers):
    return partial(getattr(wt.vehicles, kind), name=name, between=between, **numbers)


def spring(name, between, stiffness, **where):
    return element("Spring", name, between, stiffness=(0.0, 0.0, stiffness), **where)


def moved(bodies, elements, begin, duration, motions=("z",), inertia=(1e3, 1e3, 1e3), method="strict"):
    """March bodies of some masses, {name: kg}, from displacements and speeds, {name: {motion: (q, v)}}.

    What slides has not slid before. Return the lowered wagon and the march.
    """
    held = tuple(motion for motion in ("x", "y", "z", "roll", "pitch", "yaw") if motion not in motions)
    frames = tuple(
        wt.vehicles.Body(name=name, mass=mass, inertia=inertia, position=(0.0, 0.0, 1.0), held=held)
        for name, mass in bodies.items()
    )
    made = tuple(make(**({"at": (0.0, 0.0, 1.0)} | make.keywords)) for make in elements)
    scene = wt.Scenario(
        vehicle=wt.Wagon(bodies=frames, axles=(wt.vehicles.Axle(**AXLE, load=1e4),), elements=made),
        contact=wt.Hertz(constant_per_wheel=7e10), profiles=wt.profiles.Cones(moving_with="wheel"), speed=9.0,
        duration=duration,
    )  # fmt: skip
    lowered = lower_wagon(scene, method)
    A, structure = lowered.assembly, lowered.structure
    start = A.start.copy()
    for name, of_motions in begin.items():
        for motion, (q, v) in of_motions.items():
            at = lowered.layout.bodies.index(name) * PLACES + PLACE_OF[motion]
            start[at], start[at + TO_RATE] = q, v
    q = start[lowered.layout.displacement_places]
    inside = A.element_inside[len(A.element_inside) - len(A.sliders) :]
    for item, place in zip(structure.sliders, inside, strict=True):
        if place >= 0:
            start[place] = item.row @ q
    lowered = lowered.with_assembly(A._replace(start=start))
    return lowered, run.march(lowered.assembly)


def changes_of(march):
    """Times at which each element changes and its piece then, [(time, element, piece)]."""
    pieces = march.steps[:, STEP_ELEMENTS:]
    step, which = np.nonzero(pieces[1:] != pieces[:-1])
    return [(march.steps[i + 1, STEP_TIME], int(j), int(pieces[i + 1, j])) for i, j in zip(step, which, strict=True)]
