"""Run the cases with this package, by its public interface.

python benchmarks/open/run_wheeltapper.py RESULTS_FOLDER [--method strict] [--case NAME]
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from reading import Row, names, read, write

import wheeltapper as wt

HELD = ("x", "y", "roll", "pitch", "yaw")


def irregularity(path: dict[str, Any]) -> Any:
    """Return one irregularity."""
    x, shape = path["start"], path["shape"]
    if shape == "bump":
        return wt.CosineBump(height=path["height"], length=path["length"], start=x)
    if shape == "sine":
        return wt.Corrugation(amplitude=path["height"], wavelength=path["length"], start=x)
    if shape == "flat":
        return wt.WheelFlat(depth=path["depth"], position=x, repeat=False)
    return wt.Step(height=path["height"], position=x, ideal=shape == "jump")


def vehicle(case: dict[str, Any]) -> Any:
    """Return the vehicle."""
    rub: Any = case.get("friction")
    if "bogie" in case:
        more = {"primary_friction": rub["force"], "primary_friction_stiffness": rub["stiffness"]} if rub else {}
        return wt.vehicles.Bogie(**case["bogie"], **more)
    wheel = dict(case["wheel"])
    if "body" not in case:
        more = {"friction": rub["force"], "friction_stiffness": rub["stiffness"]} if rub else {}
        return wt.Wheelset(**wheel, **more, wheels=1 if "track" in case else 2)
    place: dict[str, Any] = {"between": ("body", "wheelset 1"), "at": (0.0, 0.0, 0.8)}
    body = case["body"]
    elements = (
        wt.vehicles.Spring(name="spring", stiffness=(0.0, 0.0, body["stiffness"]), **place),
        wt.vehicles.Friction(
            name="it", along="z", force=rub["force"], series_stiffness=rub["stiffness"], **place
        ),
    )  # fmt: skip
    inertia = (1e3, 1e3, 1e3)
    return wt.Wagon(
        bodies=(
            wt.vehicles.Body(name="body", mass=body["mass"], inertia=inertia, position=(0.0, 0.0, 1.0), held=HELD),
        ),
        axles=(wt.vehicles.Axle(mass=wheel["mass"], inertia=inertia, held=HELD, position=0.0, load=wheel["load"]),),
        elements=elements,
    )


def scenario(case: dict[str, Any]) -> wt.Scenario:
    """Return a case as a scenario."""
    law, more, wagon = dict(case["contact"]), dict[str, Any](), "body" in case
    kind, constant = law.pop("law"), law.pop("constant")
    track: Any = wt.StiffTrack()
    if kind == "thornton":
        contact: Any = wt.contact.Thornton(constant=constant, **law)
    elif kind == "linear":
        contact = wt.Linear(stiffness=constant)
    else:
        contact = wt.Hertz(constant_per_wheel=constant / 2) if wagon else wt.Hertz(constant=constant, **law)
    if "deck" in case:
        track = wt.FloatingDeck(**case["deck"])
    if "track" in case:
        track = wt.tracks.Ballasted.named(
            "rolland_UIC60_example", bays=case["track"]["bays"], cutoff=case["track"]["cutoff"]
        )
    paths = case.get("path", [])
    alone = [path for path in paths if "contact" in path]
    both = [irregularity(path) for path in paths if "contact" not in path]
    placed: Any = both
    if alone:
        placed = {"both": both} | {f"wheelset {one['contact']}": irregularity(one) for one in alone}
    if "start" in case:
        more["start"] = case["start"]
    if wagon:
        more["profiles"] = wt.profiles.Cones(moving_with="wheel")
    round_ = any(path["shape"] in ("flat", "step") for path in paths)
    return wt.Scenario(
        vehicle=vehicle(case), track=track, contact=contact, irregularity=placed, speed=case["speed"],
        duration=case["duration"], rolling="circle" if round_ else "point", **more,
    )  # fmt: skip


def rows_of(case: dict[str, Any], record: Any) -> Iterator[Row]:
    """Return a record as rows."""
    above, wagon = case["ask"]["maxima_above"], "body" in case
    events, peaks = record.events, record.peaks
    if wagon:  # both wheels do the same, and share the force
        events = events.isel(event=events.side.values == "left")
        peaks = peaks.isel(peak=peaks.side.values == "left")
    own = zip(events.kind.values, events.contact.values, events.time.values, strict=True)
    yield from (Row(str(kind), 1 if wagon else int(i) + 1, t, None) for kind, i, t in own)
    for i, t, force in zip(peaks.contact.values, peaks.time.values, peaks.normal_force.values, strict=True):
        if force * (1 + wagon) > above:
            yield Row("maximum", 1 if wagon else int(i) + 1, t, force * (1 + wagon))
    if "friction" in case:
        elements = record.suspension_events
        for t, element, kind in zip(elements.time.values, elements.element.values, elements.kind.values, strict=True):
            yield Row(str(kind), 1 if wagon else int(element.split()[-1]), t, None)
    for kind in ("displacement", "velocity"):
        values = state(case, record, kind)
        yield from (Row(kind, k, case["duration"], x) for k, x in enumerate(values, 1))


def state(case: dict[str, Any], record: Any, kind: str) -> np.ndarray[Any, Any]:
    """Return displacements from the static state, or velocities, at the end."""
    both = record.at(np.array([0.0, case["duration"]]))
    if "body" in case:
        values = both[kind].sel(motion="z", body=["wheelset 1", "body"]).values
    else:
        ending = "_velocity" if kind == "velocity" else ""
        parts = [f"wheel_{kind}", f"deck_{kind}", "frame" + ending, "frame_pitch" + ending]
        values = np.hstack([both[part].values.reshape(2, -1) for part in parts if part in both])
    if kind == "velocity":
        return np.asarray(values[1])
    if "start" in case:  # the wheel alone moves
        return np.asarray(values[1] + (float(record.static_force) / case["contact"]["constant"]) ** (2.0 / 3.0))
    return np.asarray(values[1] - values[0])


def run(name: str, method: Any) -> list[Row]:
    """Return the answer to a case."""
    case = read(name)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return list(rows_of(case, wt.simulate(scenario(case), method)))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--method", default="default", choices=("default", "strict"))
    parser.add_argument("--case", choices=names())
    options = parser.parse_args()
    for name in [options.case] if options.case else names():
        write(options.folder / f"{name}.csv", run(name, options.method))


if __name__ == "__main__":
    main()
