"""When contact is lost and regained, how often, and for how long."""

from __future__ import annotations

from typing import Literal

import numpy as np

from wheeltapper.ground.arguments import check_choice
from wheeltapper.record.features.base import Feature, check_order, feature
from wheeltapper.record.trains.trains import Trains, Values


def _onset_times(trains: Trains, n: int) -> Values:
    return trains.impacts.nth_entry("time", n)


@feature
def impact_interval(first: int = 1, second: int = 2, between: Literal["onsets", "peaks"] = "onsets") -> Feature:
    """Return the time between two impacts (the paper's Δt).

    Parameters
    ----------
    first, second
        Which impacts, counted from one.
    between
        "onsets" of contact, or the "peaks": the times of the largest force after each.
    """
    check_order(first, second)
    check_choice(between, "between", ("onsets", "peaks"))
    if between == "onsets":
        return Feature(
            "impact_interval", "s", f"time from the onset of impact {first} to that of impact {second}", second,
            "impact", lambda trains: _onset_times(trains, second) - _onset_times(trains, first),
        )  # fmt: skip
    return Feature(
        "impact_interval", "s", f"time from the largest force after impact {first} to that after impact {second}",
        second, "loss", lambda trains: trains.impact_peak(second, "time") - trains.impact_peak(first, "time"),
    )  # fmt: skip


@feature
def number_of_impacts() -> Feature:
    """Return the number of impacts."""
    return Feature(
        "number_of_impacts", "", "number of impacts", 0, "end",
        lambda trains: trains.impacts.row_counts.astype(float), differentiable=False,
    )  # fmt: skip


@feature
def time_in_air() -> Feature:
    """Return the total time without contact, s."""

    def total(trains: Trains) -> Values:
        flights_begin = trains.losses.total_over_rows(trains.losses.columns["time"])
        flights_end = trains.impacts.total_over_rows(trains.impacts.columns["time"])
        flying = trains.losses.row_counts + trains.is_airborne_at_start - trains.impacts.row_counts
        return np.asarray(flights_end - flights_begin + flying * trains.end_time)

    return Feature("time_in_air", "s", "total time without contact", 0, "end", total)


@feature
def first_loss() -> Feature:
    """Return the time of the first loss of contact, s."""
    return Feature(
        "first_loss", "s", "time of the first loss of contact", 0, "loss",
        lambda trains: trains.losses.nth_entry("time", 1),
    )  # fmt: skip


@feature
def last_loss() -> Feature:
    """Return the time of the last loss of contact, s."""
    return Feature(
        "last_loss", "s", "time of the last loss of contact", 0, "end", lambda trains: trains.losses.last_entry("time")
    )


@feature
def contact_frequency() -> Feature:
    """Return how often contact is regained: the inverse of the mean interval between impacts, Hz."""
    return Feature(
        "contact_frequency", "Hz", "inverse of the mean interval between the onsets of impacts", 2, "end",
        lambda trains: (trains.impacts.row_counts - 1) / (trains.impacts.last_entry("time") - _onset_times(trains, 1)),
    )  # fmt: skip
