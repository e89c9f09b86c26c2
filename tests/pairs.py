"""Pairs of scenes that are the same model: to one something is added that cannot be felt. Answers have to be equal.

`python -m tests.pairs 400` draws so many pairs, and prints a table of the largest differences of each addition.
"""

import sys
import warnings
from typing import NamedTuple

import numpy as np

import wheeltapper as wt

HERTZ = 1.405e11
WHEEL = {"mass": 1500.0, "load": 91_307.0, "stiffness": 2.44e6, "damping": 4e4, "radius": 0.46}
FRAME = {
    "wheelset_mass": 1200.0, "frame_mass": 2600.0, "pitch_inertia": 1500.0, "wheelbase": 2.56,
    "primary_stiffness": 2.4e6, "primary_damping": 3e4, "secondary_stiffness": 8e5, "secondary_damping": 4e4,
    "wheel_load": 1e5,
}  # fmt: skip
BALLAST = wt.tracks.Ballasted.named("rolland_UIC60_example").model_copy(update={"cutoff": 1500.0, "bays": 60})
DECK = wt.FloatingDeck(mass=800.0, stiffness=2e7, damping=2e4)
TRACKS = {"stiff": wt.StiffTrack(), "deck": DECK, "rails": BALLAST}
FAR = {
    "a stop": {"bumpstop_gap": 0.5, "rebound_gap": 0.4, "bumpstop_stiffness": 1e7},
    "a corner": {"spring_corners": ((-0.3, 1e6), (0.4, 5e6))},
    "a blow-off": {"blow_off_force": 1e9, "blow_off_damping": 1e3},
    "no friction": {"friction": 0.0, "friction_stiffness": 1e7},
}
"""Fields of a suspension that no motion here meets."""


def hertz_again(delta):
    return HERTZ * delta**1.5


class Drawn(NamedTuple):
    """Numbers of a scene."""

    speed: float = 9.0
    height: float = 2e-4
    length: float = 0.05
    begin: float = 0.03
    mass: float = 1500.0
    damping: float = 4e4
    lift: float = 0.0

    @classmethod
    def of(cls, seed):
        """Return numbers of a seed; the path may have a height under the wheel at the start."""
        draw = np.random.default_rng(seed)
        lengths = draw.uniform(0.02, 0.4)
        return cls(
            float(draw.uniform(3.0, 30.0)), float(draw.uniform(-6e-4, 6e-4) * np.sqrt(lengths)), float(lengths),
            float(draw.choice([0.03, -0.3 * lengths])), float(draw.uniform(800.0, 2000.0)),
            float(draw.uniform(5e3, 8e4)), float(draw.choice([0.0, 2e-4])),
        )  # fmt: skip


def vehicle_of(kind, drawn, **fields):
    one = WHEEL | {"mass": drawn.mass, "damping": drawn.damping} | fields
    if kind == "wheelset":
        return wt.Wheelset(**one)
    if kind == "wheelsets":
        return wt.vehicles.Wheelsets(wheelsets=(one, one), positions=(0.0, -1.8))
    return wt.vehicles.Bogie(**FRAME, **{f"primary_{name}": value for name, value in fields.items()})


def scene_of(kind, track, drawn, **changes):
    bump = wt.CosineBump(height=drawn.height, length=drawn.length, start=drawn.begin)
    start = {"start": {"displacement": drawn.lift, "velocity": -0.02}} if drawn.lift else {}
    given = {
        "vehicle": vehicle_of(kind, drawn), "track": TRACKS[track], "contact": wt.Hertz(constant=HERTZ),
        "irregularity": bump, "rolling": "point", "speed": drawn.speed, "duration": 0.06,
    }  # fmt: skip
    return wt.Scenario(**given | start | changes)


def own_law(kind, track, drawn):
    law = wt.contact.Law(hertz_again, exponent=1.5, largest="1 mm")
    return scene_of(kind, track, drawn), scene_of(kind, track, drawn, contact=law)


def far(name):
    def made(kind, track, drawn):
        return scene_of(kind, track, drawn), scene_of(kind, track, drawn, vehicle=vehicle_of(kind, drawn, **FAR[name]))

    return made


def no_loss(kind, track, drawn):
    lossless = wt.Hertz(constant=HERTZ, hysteresis=1e-13)
    return scene_of(kind, track, drawn), scene_of(kind, track, drawn, contact=lossless)


def never_yields(kind, track, drawn):
    return scene_of(kind, track, drawn), scene_of(
        kind, track, drawn, contact=wt.contact.Thornton(constant=HERTZ, yield_force=1e9)
    )


def wheel_far_behind(kind, track, drawn):
    """A second wheelset on its own suspension that no track joins to the first."""
    fields = WHEEL | {"mass": drawn.mass, "damping": drawn.damping}
    pair = wt.vehicles.Wheelsets(wheelsets=(fields, fields), positions=(0.0, -40.0))
    return scene_of("wheelset", track, drawn), scene_of("wheelset", track, drawn, vehicle=pair)


def heavy_deck(kind, track, drawn):
    deck = wt.FloatingDeck(mass=1e15, stiffness=0.0)
    plain = scene_of(kind, track, drawn)
    return plain, plain.model_copy(update={"track": deck})


def never_met(kind, track, drawn):
    """An irregularity behind the end of the run."""
    behind = wt.CosineBump(height=1e-3, length=0.1, start=drawn.speed * 0.06 + 30.0)
    plain = scene_of(kind, track, drawn)
    return plain, plain.model_copy(update={"irregularity": (*plain.irregularity, behind)})


def stiff_bush(kind, track, drawn):
    return scene_of(kind, track, drawn), scene_of(
        kind, track, drawn, vehicle=vehicle_of(kind, drawn, bush_stiffness=9e5 * drawn.damping)
    )


ADDED = {
    "own law": own_law, **{name: far(name) for name in FAR}, "no hysteresis": no_loss, "never yields": never_yields,
    "a wheelset far behind": wheel_far_behind, "a heavy deck": heavy_deck, "an irregularity never met": never_met,
}  # fmt: skip
"""What is added, by name: a function of vehicle, track and numbers that returns both scenes."""
KINDS = ("wheelset", "wheelsets", "bogie")


def is_there(added, kind, track):
    """Return whether an addition makes sense there."""
    if added == "a wheelset far behind":
        return (kind, track) == ("wheelset", "stiff")
    if added == "a heavy deck":
        return track == "stiff"
    return True


class Difference(NamedTuple):
    """Differences of two records: events, or -1 where they are not the same; of times, s, and forces over static.

    The last one is that of the terms of energy over the energy exchanged, infinite where their names differ; only where
    all events and all wheels are compared.
    """

    events: int
    time: float
    force: float
    static: float
    energy: float


FIRST_EVENTS = 5
"""Events of each wheel that are compared where a run amplifies differences; later ones double them again and again."""
CALM = 1e4
"""Amplification up to which all events are compared."""


def difference(pair, method):
    """Return how far the second of two scenes is from the first; wheels that only it has are not compared."""
    plain, added = (wt.simulate(one, method) for one in pair)
    count = plain.static_forces.values.size
    told, until = [events_of(record, count) for record in (plain, added)], plain.end
    calm = amplification(pair[0], plain, method) <= CALM
    if not calm:
        told = [[wheel[:FIRST_EVENTS] for wheel in wheels] for wheels in told]
        until = min([until, *(wheel[-1][0] for wheel in told[0] if len(wheel) == FIRST_EVENTS)])
    static = float(abs(added.static_force / plain.static_force - 1.0))
    if [[what for _, what in wheel] for wheel in told[0]] != [[what for _, what in wheel] for wheel in told[1]]:
        return Difference(-1, np.inf, np.inf, static, np.inf)
    shifts = [
        abs(one - other)
        for before, after in zip(*told, strict=True)
        for (one, _), (other, _) in zip(before, after, strict=True)
    ]
    times = np.linspace(0.0, until, 997)[:-1]
    forces = [np.atleast_2d(record.at(times).normal_force.values.T)[:count] for record in (plain, added)]
    apart = float(np.abs(forces[1] - forces[0]).max() / plain.static_force)
    comparable = calm and added.static_forces.values.size == count  # another wheel has an energy of its own
    energy = energies_apart(plain.energy, added.energy) if comparable else 0.0
    return Difference(len(shifts), max(shifts, default=0.0), apart, static, energy)


def energies_apart(before, after):
    """Return the largest difference of any term of two energy balances over the energy that the first exchanged."""
    if list(before) != list(after):
        return np.inf
    joules = [name for name in before if before[name].units == "J" and name != "exchanged"]
    return max(abs(float(after[name] - before[name])) for name in joules) / float(before.exchanged)


def events_of(record, count):
    """Return times and kinds of the events of each wheel."""
    events = record.events
    wheels = events.wheelset.values if "wheelset" in events.coords else np.ones(events.sizes["event"], dtype=int)
    rows = list(zip(events.time.values.tolist(), events.kind.values.tolist(), strict=True))
    return [[row for row, wheel in zip(rows, wheels, strict=True) if wheel == one] for one in range(1, count + 1)]


EVENTS = 1e-9
"""Largest difference of times, s."""
FORCES = {"default": 1.5e-9, "strict": 1e-9}
"""Largest difference of forces over the static one, and of energies over what is exchanged. By default that of the
wheel's own march from its strict one, which is 1.1e-9 on a light deck."""
SMALL, PERIOD = 1e-9, 1e-3
"""A relative change of the speed, and about the period of the wheel on the contact, s."""


def amplification(scene, record, method):
    """Return by how much a small change of the speed moves an event, in periods, over that change."""
    moved = wt.simulate(scene.replaced({"speed": float(scene.speed) * (1.0 + SMALL)}), method)
    before, after = record.events.time.values, moved.events.time.values
    return np.abs(after - before).max(initial=0.0) / PERIOD / SMALL if len(before) == len(after) else np.inf


def main(count):
    warnings.simplefilter("ignore")
    worst = {}
    for seed in range(count):
        draw = np.random.default_rng(10_000 + seed)
        choices = [
            (added, kind, track)
            for added in ADDED
            for kind in KINDS
            for track in TRACKS
            if is_there(added, kind, track)
        ]
        added, kind, track = choices[seed % len(choices)]
        method = str(draw.choice(["default", "strict"]))
        found = difference(ADDED[added](kind, track, Drawn.of(seed)), method)
        worst.setdefault((added, method), []).append((found, kind, track, seed))
        if not (found.time <= EVENTS and found.force <= FORCES[method]):
            print("beyond:", added, kind, track, method, seed, found, flush=True)
    for (added, method), rows in sorted(worst.items()):
        met = [found for found, *_ in rows if found.events >= 0]
        time, force, energy = (
            max((getattr(one, name) for one in met), default=0.0) for name in ("time", "force", "energy")
        )
        print(
            f"{added:28s} {method:8s} {len(rows):3d} pairs, {len(rows) - len(met)} of other events, "
            f"{sum(one.events for one in met):5d} events, {time:.1e} s, {force:.1e} of static, "
            f"{energy:.1e} of the energy"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]))
