"""The card of a data set: what it holds, how it was made, how it is read, and what it is not."""

from __future__ import annotations

from wheeltapper._version import __version__
from wheeltapper.diagnosis.dataset.plan import DatasetPlan
from wheeltapper.diagnosis.faults.base import fault_named


def card_of(plan: DatasetPlan) -> str:
    """Return the card, in Markdown."""
    scenario = plan.scenario
    vehicles = "" if len(plan.vehicles) == 1 else f", {len(plan.vehicles)} of them in a row"
    ends = f"{float(plan.way):g} m" if plan.way is not None else f"{float(scenario.duration):g} s"
    lines = [
        f"# {plan.name or 'Passages of railway wheels'}",
        "",
        f"{plan.count} simulated passages of a {type(scenario.vehicle).__name__}{vehicles} over a "
        f"{type(scenario.track).__name__}, each {ends} long, made with wheeltapper {__version__} "
        f"(method {plan.method}, seed {plan.seed}).",
        "",
        f"Licence: {plan.licence}." + (f" Creator: {plan.creator}." if plan.creator else ""),
        "",
        "## What is drawn",
        "",
        "| variable | drawn | unit | for each |",
        "|---|---|---|---|",
        *(
            f"| {row.path} | {row.draw.words} | {row.unit or '-'} | {'vehicle' if row.per_vehicle else 'passage'} |"
            for row in plan.rows
        ),
        "",
        "| fault | share | size | place on the wheel |",
        "|---|---|---|---|",
        *_fault_rows(plan),
        "",
        "| part | share |",
        "|---|---|",
        *(f"| {name} | {share:.3g} |" for name, share in zip(plan.parts, plan.part_shares, strict=True)),
        "",
        "## Sensors",
        "",
        "| variable | kind | rate, Hz | noise of a sample |",
        "|---|---|---|---|",
        *(
            f"| {sensor.channel} | {sensor.kind} | {float(sensor.rate):g} | "
            f"{plan.noises.get(sensor.channel, 'as the sensor states')} |"
            for sensor in plan.sensors
        ),
        "",
        "## How to read it",
        "",
        "Open the folder with `xarray.open_zarr(path)`. `part`, `fault` and `status` are numbers; their attribute "
        "`flag_meanings` names them in order. Readings are NaN after the end of a run, and everywhere where `status` "
        "is not 0: such a run was not completed. `size` and `place` are NaN without a fault.",
        "",
        "## What it is not",
        "",
        "Recordings of a model, not of a railway. The model is exact for what the scenario describes; a real track has "
        "more: rails that differ, neighbours that are felt, drifting gauges. Test what you train on recordings of "
        "another origin.",
    ]
    if len(plan.vehicles) > 1:
        lines += ["", "Vehicles of a train do not feel each other: each was simulated alone, and readings are summed."]
    return "\n".join(lines) + "\n"


def _fault_rows(plan: DatasetPlan) -> list[str]:
    rows = []
    for one, share in zip(plan.conditions, plan.shares, strict=True):
        if share == 0.0:
            continue
        size, place = "-", "-"
        if one.fault is not None:
            fault = fault_named(one.fault)
            given = fault.usual if one.size is None else one.size
            ends = given if isinstance(given, tuple) else (given,)
            size = f"{fault.size} {' to '.join(f'{end:g}' for end in ends)} {fault.unit}".rstrip()
            place = "anywhere" if one.place is None else f"{one.place:g} of the circumference"
        rows.append(f"| {one.label} | {share:.3g} | {size} | {place} |")
    return rows
