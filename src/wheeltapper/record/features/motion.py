"""How the wheel moves."""

from __future__ import annotations

from wheeltapper.record.features.base import Feature, feature


@feature
def largest_displacement() -> Feature:
    """Return the largest upward displacement of the wheel's centre, m."""
    return Feature(
        "largest_displacement", "m", "largest upward displacement of the wheel's centre", 0, "end",
        lambda trains: trains.highest_position, tally=True, of_heights=True,
    )  # fmt: skip
