"""Whether a run's work and energy balance."""

from __future__ import annotations

from wheeltapper.record.features.base import Feature, feature


@feature
def missing_energy() -> Feature:
    """Return the largest share of the exchanged energy that is missing at any time of the run.

    `simulate` checks it at the end of every run. Maps check it only if this feature is asked for, because each cell is
    then simulated once more, alone. In sound runs it is less than 1e-6. A vehicle of many bodies has one value for all
    its wheels. For runs by the general march it is the share that is missing in `energy` at the end of the run. This
    takes longer than the run, and `simulate` does not check it.
    """
    return Feature(
        "missing_energy", "", "largest share of the exchanged energy that is missing at any time", 0, "end",
        lambda trains: trains.missing_energy(), differentiable=False,
    )  # fmt: skip
