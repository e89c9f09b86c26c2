"""Where the error of a fitted length comes from: what is the same at every passage of a site, and what is not.

Theory: docs/theory/gauges.rst, section 16.8.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from wheeltapper.diagnosis.gauges.fit import SURER, Fit
from wheeltapper.diagnosis.gauges.passing import LENGTH


def shares_of(fit: Fit, spread: Mapping[str, float], gains: Mapping[str, float]) -> tuple[float, dict[str, float]]:
    """Return the standard deviation of a length, over the length, in parts: its own, and those of what is common.

    Parameters
    ----------
    fit
        A flat.
    spread
        Standard deviations of what was known before of track and wheel, over the values, by their names.
    gains
        The same of the gains of the fit's sensors, in their order, by the sensors' names.

    Returns
    -------
    tuple
        The part of noise, roughness, speed, load and place; and by name what the length is off by if a value that all
        passages share is off by its standard deviation. These have signs: they add up before they are squared.
    """
    row = SURER * fit.inverse[fit.names.index(LENGTH)]
    common = {name: row[number] / spread[name] for number, name in enumerate(fit.names) if name in spread}
    of_gains = zip(gains, row[len(fit.names) :], strict=False)
    common |= {f"gain of {name}": value / gains[name] for name, value in of_gains if gains[name] > 0.0}
    scale = np.sqrt(max(1.0, fit.chi / fit.readings))
    parts = {name: float(scale * value) for name, value in common.items()}
    whole = (scale * fit.deviation(LENGTH)) ** 2
    return float(np.sqrt(max(whole - sum(part**2 for part in parts.values()), 0.0))), parts
