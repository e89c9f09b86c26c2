"""The forces of a joint, P1 and P2, and forces that are low-passed before they are compared."""

from __future__ import annotations

import numpy as np

from wheeltapper.ground.arguments import as_quantity, check_flag
from wheeltapper.record.assessment.filtering import (
    checked_filter,
    checked_rate,
    low_passed,
    note_of_ends,
    readings,
    usual_rate,
)
from wheeltapper.record.features.base import Feature, feature
from wheeltapper.record.trains.trains import Trains, Values


@feature
def P1(position: float | str = 0.0) -> Feature:  # noqa: N802 - its name in the field
    """Return P1, the first maximum of the contact force after the wheel has reached a joint, N.

    It is the force between the masses of wheel and rail, and is over after half a millisecond (Jenkins et al., Railway
    Engineering Journal 3 (1974)). The force is not filtered.

    Parameters
    ----------
    position
        Position of the joint, m.
    """
    position = as_quantity(position, "position", "length", positive=False)
    return Feature(
        "P1", "N", f"first maximum of the contact force after x = {position:g} m, per wheelset", 0, "end",
        lambda trains: trains.first_peak_after(position),
    )  # fmt: skip


@feature
def P2(cutoff: float | str = 90.0, order: int = 4, rate: float | str | None = None) -> Feature:  # noqa: N802
    """Return P2, the largest contact force below 90 Hz, N: wheel and track move together on the ballast.

    It is `filtered_force` with the cut-off that is usual for joints.

    Parameters
    ----------
    cutoff, order, rate
        As for `filtered_force`.
    """
    return filtered_force(cutoff, order, rate).renamed("P2")


@feature
def filtered_force(
    cutoff: float | str = 20.0, order: int = 4, rate: float | str | None = None, over_static: bool = False
) -> Feature:
    """Return the largest low-passed contact force, N; `over_static`: divided by the static force N0.

    The filter has no phase. It loses 3 dB at the cut-off, and 24 dB per octave beyond it if its order is 4: it is a
    Butterworth filter of half the order, forwards and backwards. 20 Hz is the cut-off of EN 14363. Since the filter
    also needs later values, the end of the run is not read for as long as the filter takes to settle (a period of the
    cut-off for the order 4). The beginning is not read either if the run does not start in equilibrium. A note says so.
    A `ModelWarning` is given if larger forces may be there, or if nothing is left: then the value is NaN. There are no
    gradients, and each cell of a map is simulated once more, alone.

    Parameters
    ----------
    cutoff
        Frequency at which 3 dB are lost, Hz.
    order
        Order of the filter, an even number.
    rate
        Samples per second; None: 100 per period of the cut-off, but at least 20 kHz.
    over_static
        Whether the force is divided by the static force.
    """
    cutoff, order = checked_filter(cutoff, order)
    check_flag(over_static, "over_static")
    rate = usual_rate(cutoff) if rate is None else checked_rate(rate, cutoff)

    def largest(trains: Trains) -> Values:
        found = _largest_forces(trains, rate, cutoff, order)
        return found / trains.static_force if over_static else found

    words = f"largest contact force below {cutoff:g} Hz (order {order}, no phase)"
    if over_static:
        words = f"{words}, over the static force"
        return Feature("filtered_force_over_static", "", words, 0, "end", largest, differentiable=False)
    return Feature("filtered_force", "N", f"{words}, per wheelset", 0, "end", largest, differentiable=False)


@feature
def wheel_unloading(cutoff: float | str = 20.0, order: int = 4, rate: float | str | None = None) -> Feature:
    """Return the wheel unloading ΔQ/Q0: the largest share of the static force that the low-passed force lacks.

    The filter, its cost and its arguments are those of `filtered_force`. For a wagon's wheels, the force is the
    vertical force of tread and flange. Rules on safety against derailment limit the unloading, each for its own
    conditions: EN 14363 for a vehicle at rest on twisted track.

    Parameters
    ----------
    cutoff, order, rate
        As for `filtered_force`.
    """
    cutoff, order = checked_filter(cutoff, order)
    rate = usual_rate(cutoff) if rate is None else checked_rate(rate, cutoff)
    return Feature(
        "wheel_unloading", "", f"largest share of the static force that the force below {cutoff:g} Hz lacks", 0, "end",
        lambda trains: 1.0 + _largest_forces(trains, rate, cutoff, order, -1.0) / trains.static_force,
        differentiable=False,
    )  # fmt: skip


def _largest_forces(trains: Trains, rate: float, cutoff: float, order: int, sign: float = 1.0) -> Values:
    """Return the largest reading of each train's low-passed forces times the sign; NaN where there is none."""
    out = np.full(trains.cell_count, np.nan)
    for train, force in enumerate(trains.force_histories(rate)):
        filtered = sign * low_passed(force, rate, cutoff, order, at_rest=trains.at_rest)
        read = readings(filtered, rate, cutoff, order, at_rest=trains.at_rest)
        if trains.is_complete[train]:
            note = note_of_ends(filtered, read, cutoff, order, at_rest=trains.at_rest)
            trains.notes.append((train, note))
        out[train] = np.fmax.reduce(read)
    return out
