"""The figures in `tests/data`, and its reference cases as scenarios."""

import csv
import json
from functools import cache
from pathlib import Path

import numpy as np

import wheeltapper as wt

DATA = Path(__file__).resolve().parent / "data"
NAMES = ["drop_undamped_k0", "cosbump_c5e4", "step_up_R046", "flat_stiff", "flat_deck", "sine_V9"]


@cache
def reference():
    """Return the motions and static figures that were computed with 30 digits."""
    return json.loads((DATA / "core_cases.json").read_text(encoding="utf-8"))


@cache
def orbit_cases():
    """Return orbits, special points and limits that another program has checked."""
    return json.loads((DATA / "orbits.json").read_text(encoding="utf-8"))["cases"]


def rows(name):
    """Return the rows of a table."""
    with (DATA / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def irregularity(kind, **values):
    e = {name: float(value) for name, value in values.items()}
    builders = {
        "none": lambda: None,
        "cosbump": lambda: wt.CosineBump(height=e["h"], length=e["lam"], start=e["x0"]),
        "stepup": lambda: wt.Step(height=e["h"], position=e["x0"]),
        "flat": lambda: wt.WheelFlat(depth=e["h"], position=e["x0"]),
        "sine": lambda: wt.Corrugation(amplitude=-e["a"], wavelength=e["lam"], start=e["x0"]),
    }
    return builders[kind]()


def scenario(case):
    given = case["inputs"]
    shape = {k: v for k, v in given["exc"].items() if k != "type"}
    kind = given["exc"]["type"]
    deck = given.get("deck")
    start = given.get("init")
    return wt.Scenario(
        vehicle=wt.Wheelset(
            mass=float(given["m"]),
            load=float(given["P"]),
            stiffness=float(given["k"]),
            damping=float(given["c"]),
            radius=float(shape.get("R", 0.46)),
            gravity=float(given["g"]),
        ),
        track=wt.FloatingDeck(mass=float(deck["M"]), stiffness=float(deck["K"]), damping=float(deck["C"]))
        if deck
        else wt.StiffTrack(),
        contact=wt.Hertz(constant=float(given["C"])),
        irregularity=irregularity(kind, **{k: v for k, v in shape.items() if k != "V"}),
        rolling="circle" if kind in ("stepup", "flat") else "point",
        speed=float(shape.get("V", 0.0)),
        duration=float(given["t_end"]),
        start={"displacement": float(start["y"]), "velocity": float(start["v"])} if start else "equilibrium",
    )


def numbers(rows, key):
    return np.array([float(row[key]) for row in rows])
