"""The command `orbits`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from wheeltapper.faces.exits import DONE, NOT_FINISHED, PICTURES, check_target
from wheeltapper.ground.errors import InputError, value_text


def orbits(
    file: Path,
    *,
    over: str,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    resume: bool = False,
    waves: int = 1,
    plot: Path | None = None,
    method: str = "default",
) -> int:
    """Follow the periodic motion over a periodic irregularity while one field varies.

    Parameters
    ----------
    file
        A scenario in TOML. Its motion from rest settles on the orbit that is followed.
    over
        The field and its range, such as speed=1:60.
    output
        Keep the branch here (.nc; opens in plain xarray).
    resume
        Continue a file that exists.
    waves
        Number of the irregularity's periods after which the motion repeats.
    plot
        Write a picture here (.png, .pdf, .svg).
    method
        default or strict.
    """
    check_target("--output", output, (".nc",))
    if plot is not None:
        check_target("--plot", plot, PICTURES)
    asked = _field_and_range(over)
    from wheeltapper.describe.scenario import Scenario
    from wheeltapper.orbits.file import follow_into

    scenario = Scenario.from_toml(file)
    try:
        found = follow_into(output, scenario, asked, waves, resume=resume, method=method)
    except InputError as error:
        raise error.at(str(file)) from error
    except KeyboardInterrupt:
        print(f"wheeltapper: interrupted; what is computed is in {output}; --resume goes on", file=sys.stderr)
        return NOT_FINISHED
    path = found.attrs["parameter"]
    values, unit = found[path].values, found[path].attrs["units"]
    print(f"{found.sizes['point']} orbits, {path} from {values.min():.6g} to {values.max():.6g} {unit}")
    for kind, value in zip(found.kind.values, found.parameter.values, strict=True):
        print(f"{kind}: {path} = {value:.10g} {unit}")
    print(f"begins: {found.attrs['begins']}; ends: {found.attrs['ends']}")
    print(f"branch: {output}")
    if plot is not None:
        from wheeltapper.faces.plot import plot as draw

        draw(found, plot)
        print(f"picture: {plot}")
    return DONE


def _field_and_range(over: str) -> dict[str, tuple[float | str, ...]]:
    """Return the field and its bounds from text such as speed=1:60 or irregularity.0.amplitude=5 µm:60 µm."""
    path, _, values = over.partition("=")
    parts = values.split(":")
    if not path.strip() or len(parts) != 2 or not all(part.strip() for part in parts):
        raise InputError("", "--over", value_text(over), "a field and its range, as speed=1:60")
    return {path.strip(): tuple(_as_number(part.strip()) for part in parts)}


def _as_number(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text
