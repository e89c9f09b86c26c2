"""Features: single numbers computed from an impact train, for records and for maps.

Each is a small object. It states how far a run has to be computed before the feature is known.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ground.arguments import as_count
from wheeltapper.ground.errors import InputError, shown, suggested
from wheeltapper.ground.outcome import Outcome
from wheeltapper.record.trains import Trains, Values

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.record.record import Record

__all__ = [
    "Feature", "Train", "contact_frequency", "custom", "decay_rate", "first_loss", "force_ratio", "impact_interval",
    "impulse", "largest_displacement", "largest_force", "last_loss", "named", "number_of_impacts", "time_in_air",
]  # fmt: skip

Until = Literal["impact", "loss", "end"]


@dataclass(frozen=True)
class Feature:
    """A number that is computed from an impact train.

    Attributes
    ----------
    name
        Name of the variable in a map.
    unit
        SI unit, "" for a ratio.
    definition
        One sentence.
    impacts
        Number of impacts that it needs; with fewer it is NaN.
    until
        When it is known: at the last of these impacts ("impact"), at the first "loss" of contact after it, or at the
        "end" of the run.
    of
        Function from the trains of some cells to one value per cell.
    differentiable
        False if it counts something, so that it has no gradient.
    tally
        True if it needs impulses or the highest position, which cost more than events and force maxima.
    """

    name: str
    unit: str
    definition: str
    impacts: int
    until: Until
    of: Callable[[Trains], Values]
    differentiable: bool = True
    tally: bool = False

    def renamed(self, name: str) -> Feature:
        """Return the same feature under another name, so that a map can have two of a kind."""
        return replace(self, name=name)

    @overload
    def __call__(self, of: Trains) -> Values: ...
    @overload
    def __call__(self, of: Record) -> xr.DataArray: ...
    def __call__(self, of: Trains | Record) -> Values | xr.DataArray:
        """Return the feature of a record, or of each train of cells.

        Parameters
        ----------
        of
            A record. For a wagon the feature has one value per wheel, for the contact of its tread.

        Returns
        -------
        xarray.DataArray
            The feature with unit and definition: one number, or for a wagon an array over `wheelset` and `side`. NaN if
            there are too few impacts, or the run was ended early.

        Raises
        ------
        InputError
            If it is no record.
        """
        if isinstance(of, Trains):
            return self._of_trains(of)
        from wheeltapper.record.record import Record
        from wheeltapper.record.record_trains import labelled, static_forces, trains_of

        if not isinstance(of, Record):
            raise InputError("", self.name, f"a {type(of).__name__}", "a record: what `wheeltapper.simulate` returns")
        whole = of.outcome is Outcome.COMPLETED
        values = self._of_trains(trains_of(of, self.tally)) if whole else np.full(static_forces(of).size, np.nan)
        return labelled(of, values, {"units": self.unit, "long_name": self.definition})

    def _of_trains(self, trains: Trains) -> Values:
        with np.errstate(invalid="ignore", divide="ignore"):
            values = np.asarray(self.of(trains))
        known = trains.whole & (trains.impacts.count >= self.impacts)
        return np.where(known, values, np.nan)


def _pair(first: int, second: int) -> None:
    if not as_count(first, "first") < as_count(second, "second"):
        raise InputError("", "features", f"impacts {first} and {second}", "two impacts, counted from 1, in order")


def _onset(trains: Trains, n: int) -> Values:
    return trains.impacts.nth("time", n)


def impact_interval(first: int = 1, second: int = 2, between: Literal["onsets", "peaks"] = "onsets") -> Feature:
    """Return the time between two impacts (the paper's Δt).

    Parameters
    ----------
    first, second
        Numbers of the two impacts, counted from one.
    between
        "onsets" of contact, or "peaks": the times of the largest force after each impact.
    """
    _pair(first, second)
    if between == "onsets":
        return Feature(
            "impact_interval", "s", f"time from the onset of impact {first} to that of impact {second}", second,
            "impact", lambda trains: _onset(trains, second) - _onset(trains, first),
        )  # fmt: skip
    if between != "peaks":
        raise InputError("", "between", shown(between), "'onsets' or 'peaks'")
    return Feature(
        "impact_interval", "s", f"time from the largest force after impact {first} to that after impact {second}",
        second, "loss", lambda trains: trains.impact_peak(second, "time") - trains.impact_peak(first, "time"),
    )  # fmt: skip


def force_ratio(first: int = 1, second: int = 2) -> Feature:
    """Return the largest force after one impact over that after another (r_N of the paper)."""
    _pair(first, second)
    return Feature(
        "force_ratio", "", f"largest force between impact {first} and the next one, over that after impact {second}",
        second, "loss",
        lambda trains: trains.impact_peak(first, "force") / trains.impact_peak(second, "force"),
    )  # fmt: skip


def largest_force(over_static: bool = False) -> Feature:
    """Return the largest maximum of the contact force, N; `over_static`: divided by the static force N0."""
    if not isinstance(over_static, bool):
        raise InputError("", "over_static", repr(over_static), "true or false")
    if over_static:
        return Feature(
            "largest_force_over_static", "", "largest maximum of the contact force, over the static force", 0, "end",
            lambda trains: trains.peaks.largest("force") / trains.static_force,
        )  # fmt: skip
    return Feature(
        "largest_force", "N", "largest maximum of the contact force, per wheelset", 0, "end",
        lambda trains: trains.peaks.largest("force"),
    )  # fmt: skip


def number_of_impacts() -> Feature:
    """Return the number of impacts."""
    return Feature(
        "number_of_impacts", "", "number of impacts", 0, "end",
        lambda trains: trains.impacts.count.astype(float), differentiable=False,
    )  # fmt: skip


def time_in_air() -> Feature:
    """Return the total time without contact, s."""

    def total(trains: Trains) -> Values:
        flights_begin = trains.losses.total(trains.losses.columns["time"])
        flights_end = trains.impacts.total(trains.impacts.columns["time"])
        flying = trains.losses.count + trains.airborne - trains.impacts.count
        return np.asarray(flights_end - flights_begin + flying * trains.end)

    return Feature("time_in_air", "s", "total time without contact", 0, "end", total)


def first_loss() -> Feature:
    """Return the time of the first loss of contact, s."""
    return Feature(
        "first_loss", "s", "time of the first loss of contact", 0, "loss",
        lambda trains: trains.losses.nth("time", 1),
    )  # fmt: skip


def last_loss() -> Feature:
    """Return the time of the last loss of contact, s."""
    return Feature(
        "last_loss", "s", "time of the last loss of contact", 0, "end", lambda trains: trains.losses.last("time")
    )


def contact_frequency() -> Feature:
    """Return the frequency of impacts: the inverse of the mean interval between them, Hz."""
    return Feature(
        "contact_frequency", "Hz", "inverse of the mean interval between the onsets of impacts", 2, "end",
        lambda trains: (trains.impacts.count - 1) / (trains.impacts.last("time") - _onset(trains, 1)),
    )  # fmt: skip


def decay_rate() -> Feature:
    """Return the rate σ at which the impact train decays, 1/s: the largest forces after the impacts fit exp(-σ·t)."""

    def rate(trains: Trains) -> Values:
        peaks = trains.impact_peaks
        time, height, owner = peaks.columns["time"], np.log(peaks.columns["force"]), peaks.owner
        many = peaks.count
        middle_time, middle = peaks.total(time) / many, peaks.total(height) / many
        off = time - middle_time[owner]
        return np.asarray(-peaks.total(off * (height - middle[owner])) / peaks.total(off * off))

    return Feature(
        "decay_rate", "1/s", "rate at which the largest forces after impacts decay (least squares of their logarithms)",
        2, "end", rate,
    )  # fmt: skip


def impulse(impact: int = 1) -> Feature:
    """Return the impulse of the contact force from an impact to the next loss of contact, N s."""
    impact = as_count(impact, "impact")
    return Feature(
        "impulse", "N s", f"impulse of the contact force from impact {impact} to the next loss of contact", impact,
        "loss", lambda trains: trains.impulse(impact), tally=True,
    )  # fmt: skip


def largest_displacement() -> Feature:
    """Return the largest upward displacement of the wheel's centre, m."""
    return Feature(
        "largest_displacement", "m", "largest upward displacement of the wheel's centre", 0, "end",
        lambda trains: trains.highest, tally=True,
    )  # fmt: skip


@dataclass(frozen=True)
class Train:
    """The impact train of one cell, for features of the user; arrays in order of time.

    Attributes
    ----------
    loss_time, impact_time
        s.
    closing_speed
        Indentation rate at each impact, m/s.
    peak_time, peak_force, peak_impact
        Force maxima: time, s, force, N, and number of impacts before.
    static_force
        N0, N.
    """

    loss_time: NDArray[Any]
    impact_time: NDArray[Any]
    closing_speed: NDArray[Any]
    peak_time: NDArray[Any]
    peak_force: NDArray[Any]
    peak_impact: NDArray[Any]
    static_force: float


def custom(
    function: Callable[[Train], float], name: str, unit: str = "", definition: str = "", impacts: int = 0,
    until: Until = "end",
) -> Feature:  # fmt: skip
    """Return a feature that a function of the user computes.

    Parameters
    ----------
    function
        Function from the `Train` of one cell to a number, NaN if it has none. With gradients the arrays of the train
        are complex; arithmetic and NumPy's functions then propagate the derivatives.
    name, unit, definition
        Texts for tables and plots.
    impacts
        Number of impacts that it needs; with fewer it is NaN and the function is not called.
    until
        When it is known: at the last of these impacts ("impact"), at the first "loss" after it, or at the "end" of the
        run.
    """

    def each(trains: Trains) -> Values:
        long_enough = trains.whole & (trains.impacts.count >= impacts)
        values = [function(_train(trains, cell)) if long_enough[cell] else np.nan for cell in range(trains.cells)]
        return np.asarray(values)

    return Feature(name, unit, definition or (function.__doc__ or name).strip(), impacts, until, each)


def _train(trains: Trains, cell: int) -> Train:
    def part(rows: Any, column: str) -> NDArray[Any]:
        return np.asarray(rows.columns[column][rows.first[cell] : rows.first[cell + 1]])

    return Train(
        part(trains.losses, "time"), part(trains.impacts, "time"), part(trains.impacts, "rate"),
        part(trains.peaks, "time"), part(trains.peaks, "force"), part(trains.peaks, "impact").real.astype(int),
        trains.static_force[cell],
    )  # fmt: skip


BUILT_IN: dict[str, Callable[..., Feature]] = {
    make.__name__: make
    for make in (
        impact_interval, force_ratio, largest_force, number_of_impacts, time_in_air, first_loss, last_loss,
        contact_frequency, decay_rate, impulse, largest_displacement,
    )
}  # fmt: skip


def named(what: Any) -> Feature:
    """Return a built-in feature from its name, or from a table with its name as `type` and its arguments.

    A `name` in the table is the name of the variable.
    """
    table = {"type": what} if isinstance(what, str) else dict(what) if isinstance(what, dict) else {}
    kind, name = table.pop("type", None), table.pop("name", None)
    if not isinstance(kind, str) or kind not in BUILT_IN:
        raise InputError("", "features", shown(what), suggested(str(kind), BUILT_IN))
    if name is not None and not isinstance(name, str):
        raise InputError("", f"features.{kind}.name", shown(name), "a text")
    try:
        feature = BUILT_IN[kind](**table)
    except TypeError as error:
        raise InputError("", f"features.{kind}", repr(table), f"arguments of {kind} ({error})") from error
    return feature if name is None else feature.renamed(name)
