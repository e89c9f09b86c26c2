"""How large the contact force becomes, and how it decays from impact to impact."""

from __future__ import annotations

import numpy as np

from wheeltapper.ground.arguments import as_count, check_flag
from wheeltapper.record.features.base import Feature, check_order, feature
from wheeltapper.record.trains.trains import Trains, Values


@feature
def force_ratio(first: int = 1, second: int = 2) -> Feature:
    """Return the largest force after one impact over that after another (r_N of the paper)."""
    check_order(first, second)
    return Feature(
        "force_ratio", "", f"largest force between impact {first} and the next one, over that after impact {second}",
        second, "loss",
        lambda trains: trains.impact_peak(first, "force") / trains.impact_peak(second, "force"),
    )  # fmt: skip


@feature
def largest_force(over_static: bool = False) -> Feature:
    """Return the largest maximum of the contact force, N; `over_static`: divided by the static force N0.

    If the force has no maximum within the run, the value is the larger one of the forces at its start and its end.
    """
    check_flag(over_static, "over_static")
    if over_static:
        return Feature(
            "largest_force_over_static", "", "largest maximum of the contact force, over the static force", 0, "end",
            lambda trains: trains.largest_force / trains.static_force,
        )  # fmt: skip
    return Feature(
        "largest_force", "N", "largest maximum of the contact force, per wheelset", 0, "end",
        lambda trains: trains.largest_force,
    )  # fmt: skip


@feature
def decay_rate() -> Feature:
    """Return the rate σ at which the impact train decays, 1/s: the largest forces after the impacts fit exp(-σ·t)."""

    def rate(trains: Trains) -> Values:
        peaks = trains.impact_peaks
        time, height, owner = peaks.columns["time"], np.log(peaks.columns["force"]), peaks.row_cells
        many = peaks.row_counts
        middle_time, middle = peaks.total_over_rows(time) / many, peaks.total_over_rows(height) / many
        off = time - middle_time[owner]
        return np.asarray(-peaks.total_over_rows(off * (height - middle[owner])) / peaks.total_over_rows(off * off))

    return Feature(
        "decay_rate", "1/s", "rate at which the largest forces after impacts decay (least squares of their logarithms)",
        2, "end", rate,
    )  # fmt: skip


@feature
def impulse(impact: int = 1) -> Feature:
    """Return the impulse of the contact force from an impact to the next loss of contact, N s."""
    impact = as_count(impact, "impact")
    return Feature(
        "impulse", "N s", f"impulse of the contact force from impact {impact} to the next loss of contact", impact,
        "loss", lambda trains: trains.impact_impulse(impact), tally=True,
    )  # fmt: skip
