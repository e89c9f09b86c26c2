"""Whether a run's work and energy balance."""

from __future__ import annotations

from wheeltapper.record.features.base import Feature, feature


@feature
def missing_energy() -> Feature:
    """Return the largest share of the exchanged energy that is missing at any time of the run.

    `simulate` checks it at the end of every run; maps do so only where this feature is asked for, because each cell is
    then marched once more, alone. Sound runs lack less than 1e-6. A vehicle of many bodies has one value for all its
    wheels. Of the general march it is what `energy` lacks at the end of the run: that takes longer than the run, and is
    not checked by `simulate`.
    """
    return Feature(
        "missing_energy", "", "largest share of the exchanged energy that is missing at any time", 0, "end",
        lambda trains: trains.missing_energy(), differentiable=False,
    )  # fmt: skip
