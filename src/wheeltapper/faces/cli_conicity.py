"""The command `conicity`: the equivalent conicity of a wheel's profile on a rail's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from wheeltapper.faces.exits import DONE, PICTURES, check_target

if TYPE_CHECKING:
    import xarray as xr

ROWS = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
"""Amplitudes that are printed, mm."""


def conicity(
    wheel: str,
    rail: str,
    *,
    right_wheel: str | None = None,
    right_rail: str | None = None,
    inclination: float = 0.025,
    gauge: str = "1435 mm",
    flange_backs: str = "1360 mm",
    radius: Annotated[tuple[str, ...], Parameter(consume_multiple=True, negative="")] = ("460 mm",),
    elastic: Annotated[bool, Parameter(negative="")] = False,
    plot: Path | None = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="")] = False,
) -> int:
    """Tell the equivalent conicity of wheels on rails over the amplitude, by EN 15302's definition.

    Parameters
    ----------
    wheel
        S1002, "EN 15302 A" (also B, C, H, I), or a file with a profile: two columns in mm, MiniProf or SIMPACK.
    rail
        60E1, "EN 15302 A" (with --inclination 0 --gauge "1435.164 mm"), or a file. A rail that was measured as it lies
        has --inclination 0.
    right_wheel
        Of the right side, where it is another one.
    right_rail
        The same of the rail.
    inclination
        Of the rails towards the track's middle; 0.025 is 1:40.
    gauge
        Distance between the rails, 14 mm below their tops.
    flange_backs
        Distance between the backs of the flanges.
    radius
        Nominal radius of the wheels; two if the right one has another.
    elastic
        The figure of contacts that are smooth, as in runs of a wagon, in place of the standard's.
    plot
        Write a picture here (.png, .pdf, .svg).
    as_json
        Print one JSON object instead of lines.
    """
    if plot is not None:
        check_target("--plot", plot, PICTURES)
    from wheeltapper.ask.conicity import conicity as asked
    from wheeltapper.describe.profile.wheel_rail import WheelRail
    from wheeltapper.record.labels import CONICITIES

    shared: dict[str, Any] = {"inclination": inclination, "gauge": gauge, "flange_backs": flange_backs}
    left = WheelRail.model_validate({"wheel": wheel, "rail": rail, **shared})
    differs = right_wheel is not None or right_rail is not None
    right = WheelRail.model_validate({"wheel": right_wheel or wheel, "rail": right_rail or rail, **shared})
    contact: Any = "elastic" if elastic else "rigid"
    found = asked(left, right=right if differs else None, radius=list(radius), contact=contact)
    figure = CONICITIES[contact]
    print(json.dumps(_as_dict(found, figure), indent=2) if as_json else "\n".join(_lines(found, figure)))
    if plot is not None:
        from wheeltapper.faces.plot import plot as draw

        draw(found, plot)
        if not as_json:
            print(f"picture: {plot}")
    return DONE


def _as_dict(found: xr.Dataset, figure: str) -> dict[str, Any]:
    """Return the figures; NaN, which JSON does not know, as null."""
    columns = {name: found[name].values.tolist() for name in ("amplitude", figure, "wavelength")}
    if "jump" in found.dims:
        columns |= {name: found[name].values.tolist() for name in ("jump_shift", "jump_of_radius")}
    whole = {**{name: found.attrs[name] for name in ("profiles", "contact", "at_3_mm", "nonlinearity")}, **columns}
    return {name: _without_nan(value) for name, value in whole.items()}


def _without_nan(value: Any) -> Any:
    if isinstance(value, list):
        return [_without_nan(one) for one in value]
    return None if value != value or value == float("inf") else value


def _lines(found: xr.Dataset, figure: str) -> list[str]:
    """Return the figures in words."""
    lines = [
        f"{found.attrs['profiles']}, {found.attrs['contact']} contact",
        f"{figure.replace('_', ' ')} at 3 mm: {found.attrs['at_3_mm']:.3f}",
        f"nonlinearity from 2 to 4 mm: {found.attrs['nonlinearity']:+.3f} per mm",
        f"{'amplitude':>10} {'conicity':>9} {'wavelength':>11}",
    ]
    for amplitude in ROWS:
        row = found.sel(amplitude=1e-3 * amplitude, method="nearest")
        lines.append(f"{amplitude:7.1f} mm {float(row[figure]):9.3f} {float(row['wavelength']):9.2f} m")
    if "jump" in found.dims:
        for at, by in zip(found["jump_shift"].values, found["jump_of_radius"].values, strict=True):
            lines.append(f"contact jumps at {1e3 * at:+.2f} mm: rolling radii by {1e3 * by:.2f} mm")
    return lines
