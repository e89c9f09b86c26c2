"""How well pairs of gauges on a stated track find and size flats, by what they will show of them.

Theory: docs/theory/gauges.rst, section 16.9.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.sensor.rail_shear_force import RailShearForce
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis.detection.roc import FalseCalls, false_calls
from wheeltapper.diagnosis.faults.base import Sizes
from wheeltapper.diagnosis.gauges.foreseen import FOUND, Flat, Foreseen, smallest_found
from wheeltapper.diagnosis.gauges.known import known_of
from wheeltapper.diagnosis.gauges.passing import passing_without_readings
from wheeltapper.diagnosis.gauges.scan import SCREENED
from wheeltapper.diagnosis.gauges.sizing import OWN_LENGTH, SMALLEST
from wheeltapper.diagnosis.gauges.verdicts import INTERVAL, NAMES
from wheeltapper.ground.arguments import as_names, as_quantities, as_quantity
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.progress import Progress, progress_shown, report
from wheeltapper.ground.shown import Shown
from wheeltapper.march.common.blocks import algebra_on_one_thread

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]
SHAPES = {name: shape for shape, name in NAMES.items()}
"""Shapes of flats by the names of faults."""
LENGTHS = (0.015, 0.02, 0.03, 0.04, 0.06)
"""Of flats, m, if none are asked for."""
OF_RANGE = 5
"""So many lengths of a range are computed."""
SPEED, FORCE, NOISE = 20.0, 80e3, 500.0
"""Speed, m/s, static force of a wheel, N, and standard deviation of a sample's noise, N, if none are asked for."""
PLACES = 24
"""Places of the circumference."""
FASTEST = 5000.0
"""Sensors are read at about this rate at most, Hz."""


@dataclass(frozen=True, eq=False)
class GaugePerformance(Shown):
    """How well a site with gauges on a track finds and sizes flats.

    Attributes
    ----------
    site
        The site.
    chart
        Over `side`, `fault`, `speed`, `static_force`, `size` and `place` (on the wheel, as a share of its turn):
        `probability` of detection and `deviation` of the length, m. Over all but `size`: `smallest`, the length that is
        found with a probability of 90 %, m; infinite if none of the sizes is.
    false_calls
        Wheels without a flaw for which the scan demands a fit. They are counted before that fit.
    """

    site: Site
    chart: xr.Dataset
    false_calls: FalseCalls

    @property
    def blind(self) -> xr.DataArray:
        """Shares of the circumference on which a flat is found in less than nine of ten passages."""
        blind: xr.DataArray = (self.chart.probability < FOUND).mean("place")
        return blind

    def to_dict(self) -> dict[str, Any]:
        """Return the numbers, for JSON."""
        return {
            "format": 1,
            "site": self.site.name,
            "false_calls_per_1000": self.false_calls.per_thousand,
            "false_calls_per_1000_interval_95": [self.false_calls.lower, self.false_calls.upper],
            "flats": self._rows(),
        }

    def __str__(self) -> str:
        calls = self.false_calls
        lines = [
            f"{calls.axles} wheels without a flaw: {calls.per_thousand:.3g} of 1,000 are fitted in vain "
            f"(95 %: {calls.lower:.3g} to {calls.upper:.3g})",
            f"{'side':6} {'fault':13} {'m/s':>5} {'kN':>5} {'mm':>6} {'found':>7} {'blind':>7} {'± mm (90 %)':>12}",
        ]
        lines += [
            f"{row['side']:6} {row['fault']:13} {row['speed']:5.3g} {1e-3 * row['static_force']:5.3g} "
            f"{1e3 * row['size']:6.1f} {row['probability']:7.3f} {row['blind']:7.3f} "
            f"{1e3 * row['half_interval_90']:12.2f}"
            for row in self._rows()
        ]
        return "\n".join(lines)

    def _rows(self) -> list[dict[str, Any]]:
        """Return means over the circumference, a row for each flat."""
        axes = ("side", "fault", "speed", "static_force", "size")
        chance, sd = (self.chart[name].transpose(*axes, "place") for name in ("probability", "deviation"))
        rows = []
        for index in np.ndindex(chance.shape[:-1]):
            if np.isnan(chance.values[index]).any():
                continue  # a size of another fault
            own = {axis: self.chart[axis].values[i].item() for axis, i in zip(axes, index, strict=True)}
            own |= {
                "probability": float(chance.values[index].mean()),
                "blind": float(self.blind.transpose(*axes)[index]),
            }
            rows.append(own | {"half_interval_90": INTERVAL * float(np.sqrt((sd.values[index] ** 2).mean()))})
        return rows


def assess_gauges(
    site: Site, faults: Mapping[str, Sizes] | Sequence[str] | None, count: int, seed: int, progress: Progress,
    speeds: Any = None, static_forces: Any = None, noise: Any = None,
) -> GaugePerformance:  # fmt: skip
    """Return how well a site with gauges on a track finds and sizes flats; see `assess`."""
    import xarray as xr

    lengths = lengths_of_flats(faults)
    sizes = sorted({one for several in lengths.values() for one in several})
    paces = [SPEED] if speeds is None else as_quantities(speeds, "speeds", "speed", "one or more speeds")
    loads = [FORCE] if static_forces is None else as_quantities(static_forces, "static_forces", "force", "forces, N")
    noise = NOISE if noise is None else as_quantity(noise, "noise", "force")
    rails = pairs_by_side(site)
    shape = len(rails), len(lengths), len(paces), len(loads), len(sizes), PLACES
    chance, deviation = np.full(shape, np.nan), np.full(shape, np.nan)
    smallest, calls, drawn = np.full((*shape[:4], PLACES), np.inf), 0, 0
    wheels = list(product(enumerate(rails.values()), enumerate(paces), enumerate(loads)))
    with progress_shown(progress, "wheels"), algebra_on_one_thread():
        for number, ((r, pairs), (i, speed), (j, load)) in enumerate(wheels):
            seen = foreseen_of(site, pairs, speed, load, noise)
            calls += int((seen.gains_without_a_flaw(count, seed) >= SCREENED).sum())
            drawn += count
            for f, (name, own) in enumerate(lengths.items()):
                for one in own:
                    flat, at = Flat(one, SHAPES[name]), (r, f, i, j, sizes.index(one))
                    chance[at] = seen.found(flat, PLACES) if one >= SMALLEST else 0.0
                    deviation[at] = np.hypot(seen.deviation(flat, PLACES), OWN_LENGTH * one)
                columns = [sizes.index(one) for one in own]
                smallest[r, f, i, j] = smallest_found(np.array(own), chance[r, f, i, j, columns])
            report("wheels", number + 1, len(wheels))
    axes = ("side", "fault", "speed", "static_force", "size", "place")
    chart = xr.Dataset(
        {
            "probability": (axes, chance), "deviation": (axes, deviation, {"units": "m"}),
            "smallest": ((*axes[:4], "place"), smallest, {"units": "m"}),
        },
        {
            "side": list(rails), "fault": list(lengths), "speed": paces, "static_force": loads, "size": sizes,
            "place": np.arange(PLACES) / PLACES,
        },
        {"title": "wheeltapper gauges"},
    )  # fmt: skip
    return GaugePerformance(site, chart, false_calls(calls, drawn))


def pairs_by_side(site: Site) -> dict[str, tuple[RailShearForce, ...]]:
    """Return the pairs of shear gauges of each rail of a site with a track."""
    if site.track is None:
        raise InputError("", "track", "none", "a site with the track below its gauges")
    pairs = [one for one in site.sensors if isinstance(one, RailShearForce)]
    if not pairs:
        raise InputError("", "sensor", "no pair of rail shear gauges", "one or more of them on the track")
    sides = dict.fromkeys(one.side for one in pairs)
    return {side or "both": tuple(one for one in pairs if one.side == side) for side in sides}


def foreseen_of(site: Site, pairs: Sequence[RailShearForce], speed: float, force: float, noise: float) -> Foreseen:
    """Return what pairs of gauges of a site will show of wheels; `noise` is that of a sample at their rate, N."""
    fastest = float(pairs[0].rate)
    every = max(1, int(fastest / FASTEST))
    left = noise * (1.0 if every == 1 else np.sqrt(0.8 / every))
    passing = passing_without_readings(pairs, fastest / every, float(left), speed, force)
    return Foreseen(passing, known_of(site), np.array([max(one.gain_uncertainty, 1e-4) for one in pairs]))


def lengths_of_flats(
    faults: Mapping[str, Sizes] | Sequence[str] | None, field: str = "faults"
) -> dict[str, list[float]]:  # fmt: skip
    """Return the lengths of flats that are computed, rising, by the names of faults."""
    if isinstance(faults, Mapping):
        given = dict(faults)
    else:
        given = dict.fromkeys(SHAPES if faults is None else as_names(faults, field, "flats, or their lengths by name"))
    out = {}
    for name, size in given.items():
        if name not in SHAPES:
            raise InputError("", field, repr(name), f"flats, of a site with gauges: {', '.join(map(repr, SHAPES))}")
        ends = (
            []
            if size is None
            else as_quantities(size if isinstance(size, list | tuple) else [size], field, "length", "lengths, m")
        )
        if len(ends) > 2 or (len(ends) == 2 and ends[0] >= ends[1]):
            raise InputError("", field, value_text(size), "a length, or the shortest and the longest one, m")
        out[name] = (
            [*LENGTHS] if not ends else np.linspace(ends[0], ends[-1], OF_RANGE if len(ends) == 2 else 1).tolist()
        )
    if not out:
        raise InputError("", field, value_text(faults), f"one or more of {', '.join(map(repr, SHAPES))}")
    return out
