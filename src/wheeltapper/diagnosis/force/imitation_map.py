"""The share of the contact force that the inertia of a deck shows, over its mass, stiffness and frequency."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wheeltapper.describe.site import Site, as_site
from wheeltapper.diagnosis.force.reconstruction import imitation
from wheeltapper.ground.arguments import as_quantities

if TYPE_CHECKING:
    import xarray as xr

TITLE = "wheeltapper imitation"
"""Title of the dataset, by which `plot` recognises it."""


def imitation_map(
    site: Site | str | Path, masses: Sequence[float], stiffnesses: Sequence[float], frequencies: Sequence[float]
) -> xr.Dataset:
    """Return the share of the dynamic contact force that the inertia of decks shows.

    Parameters
    ----------
    site
        The site, or the path of its TOML file. The damping ratio of its deck is kept: C_d grows with √(K·M).
    masses, stiffnesses
        Masses M, kg, and stiffnesses K, N/m, of the decks.
    frequencies
        Frequencies, Hz.

    Returns
    -------
    xarray.Dataset
        Over "track.mass", "track.stiffness" and "frequency": `modulus` and `phase` (rad) of the share -M·A/ΔN, and
        `error`, the modulus of its difference from one. An `error` of 0.01 is 1 % of the force at that frequency.

    Raises
    ------
    InputError
        If a mass, stiffness or frequency is not positive.
    """
    import xarray as xr

    site = as_site(site)
    masses = as_quantities(masses, "masses", "mass", "one or more positive masses, kg")
    stiffnesses = as_quantities(stiffnesses, "stiffnesses", "stiffness", "one or more positive stiffnesses, N/m")
    f = np.array(as_quantities(frequencies, "frequencies", "frequency", "one or more positive frequencies, Hz"))
    deck = site.passage.track
    share = deck.damping / np.sqrt(deck.stiffness * deck.mass) if deck.stiffness > 0.0 else 0.0
    shown = np.empty((len(masses), len(stiffnesses), len(f)), dtype=complex)
    for i, mass in enumerate(masses):
        for j, stiffness in enumerate(stiffnesses):
            changes = {"mass": mass, "stiffness": stiffness, "damping": share * np.sqrt(stiffness * mass)}
            other = site.passage.replaced({f"track.{name}": value for name, value in changes.items()})
            shown[i, j] = imitation(Site(passage=other, sensor=site.sensor), f)
    over = ("track.mass", "track.stiffness", "frequency")
    return xr.Dataset(
        {
            "modulus": (over, np.abs(shown), {"long_name": "shown over true force", "units": ""}),
            "phase": (over, np.angle(shown), {"long_name": "phase of the shown force", "units": "rad"}),
            "error": (
                over,
                np.abs(shown - 1.0),
                {"long_name": "error of the shown force over the true one", "units": ""},
            ),
        },
        {
            "track.mass": ("track.mass", np.asarray(masses, dtype=float), {"units": "kg"}),
            "track.stiffness": ("track.stiffness", np.asarray(stiffnesses, dtype=float), {"units": "N/m"}),
            "frequency": ("frequency", f, {"units": "Hz"}),
        },
        {"title": TITLE, "format": 1},
    )
