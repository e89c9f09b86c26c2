"""How fast small deviations of a motion grow, or die out, over a periodic irregularity."""

from __future__ import annotations

from wheeltapper.ground.arguments import as_count, check_flag
from wheeltapper.record.features.base import Feature, feature
from wheeltapper.record.trains.growth import BATCHES


@feature
def growth_exponent(waves: int = 25_000, error: bool = False) -> Feature:
    """Return the mean rate at which a small deviation grows, 1/s: the largest Lyapunov exponent.

    It is positive for chaos and for long transients; on a stable orbit it is ln|μ|/period. It is measured by exact
    tangents over so many `waves` of a periodic irregularity, after a tenth as many waves to settle. The motion begins
    at the scenario's start; the scenario's duration does not matter. `error`: return its standard error instead, from
    the scatter of 20 parts of the motion. The value is NaN if no irregularity repeats.
    """
    waves = as_count(waves, "waves", 2 * BATCHES)
    check_flag(error, "error")
    words = f"mean rate at which a small deviation grows over {waves} waves"
    if error:
        return Feature(
            "growth_exponent_error", "1/s", f"standard error of the {words}", 0, "end",
            lambda trains: trains.growth(waves).error, differentiable=False, asks="orbits",
        )  # fmt: skip
    return Feature(
        "growth_exponent",
        "1/s",
        words,
        0,
        "end",
        lambda trains: trains.growth(waves).exponent,
        differentiable=False,
        asks="orbits",
    )
