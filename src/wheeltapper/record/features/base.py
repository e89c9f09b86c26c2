"""What every feature is, how it is registered and found, and features of one's own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from numbers import Number
from typing import TYPE_CHECKING, Any, Literal, TypeVar, get_args, overload

import numpy as np
from numpy.typing import NDArray

from wheeltapper.describe.registry import register, registered_in
from wheeltapper.ground.arguments import as_count, check_choice, check_flag, check_function, check_text
from wheeltapper.ground.errors import InputError, value_text, with_suggestion
from wheeltapper.ground.notes import Note
from wheeltapper.ground.outcome import Outcome
from wheeltapper.record.trains.trains import Trains, Values, notes_of_cells

if TYPE_CHECKING:
    import xarray as xr

    from wheeltapper.record.record import Record

__all__ = ["Feature", "Train", "custom", "feature", "named"]

ROOM = "wheeltapper.record.features"
Until = Literal["impact", "loss", "end"]
Maker = TypeVar("Maker", bound="Callable[..., Feature]")


@dataclass(frozen=True)
class Feature:
    """A number that is computed from an impact train.

    Attributes
    ----------
    name
        Name of its variable in a map.
    unit
        SI unit, "" for a ratio.
    definition
        One sentence.
    impacts
        How many impacts it needs; with fewer it is NaN.
    until
        When it is known: at the last of these impacts ("impact"), at the first "loss" of contact after it, or at the
        "end" of the run.
    of
        Function from the trains of some cells to one value per cell.
    differentiable
        False where it counts something: then it has no gradient.
    tally
        True if it needs impulses or the highest position, which take longer to compute than events and force maxima.
    asks
        Name of the question that a march has to answer for this feature; "": every march computes what it needs.
    of_heights
        True if it needs the highest position, whose derivatives the general march does not compute.
    """

    name: str
    unit: str
    definition: str
    impacts: int
    until: Until
    of: Callable[[Trains], Values]
    differentiable: bool = True
    tally: bool = False
    asks: str = ""
    of_heights: bool = False

    def __post_init__(self) -> None:
        for name in ("name", "unit", "definition"):
            check_text(getattr(self, name), name)
        if not self.name.strip():
            raise InputError("", "name", value_text(self.name), "a text that names a variable")
        as_count(self.impacts, "impacts", 0)
        check_choice(self.until, "until", get_args(Until))
        check_function(self.of, "of", "a function of the trains of some cells")
        for name in ("differentiable", "tally", "of_heights"):
            check_flag(getattr(self, name), name)

    def renamed(self, name: str) -> Feature:
        """Return the same feature under another name, so that a map can hold two of a kind."""
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
            A record; of a wagon's the feature has one value per wheel, for the contact of its tread.

        Returns
        -------
        xarray.DataArray
            With unit and definition: one number, of a wagon over `wheelset` and `side`. NaN where there are too few
            impacts, or the run broke off. The attribute `note` says what is to be said of it; of a doubt a
            `ModelWarning` does, too.

        Raises
        ------
        InputError
            If it is no record.
        """
        if isinstance(of, Trains):
            return self._of_trains(of)
        from wheeltapper.ground.warned import warn_of
        from wheeltapper.record.record import Record

        if not isinstance(of, Record):
            raise InputError("", self.name, f"a {type(of).__name__}", "a record: what `wheeltapper.simulate` returns")
        values, notes = self._of_record(of)
        warn_of(notes)
        return values

    def _of_record(self, record: Record) -> tuple[xr.DataArray, tuple[Note, ...]]:
        """Return the feature of a record, and what is to be said of it, which is also its attribute `note`."""
        from wheeltapper.record.labels import of_wheels
        from wheeltapper.record.trains.of_record import trains_of

        contacts = record._contacts
        values, notes = np.full(len(contacts.static_force), np.nan), tuple[Note, ...]()
        if record.outcome is Outcome.COMPLETED:
            trains = trains_of(record, self.tally)
            values = self._of_trains(trains)
            notes = tuple(shared.note for shared in notes_of_cells(trains.notes, len(values)))
        meaning = of_wheels(self.definition) if contacts.has_sides else self.definition
        labels = {"units": self.unit, "long_name": meaning} | ({"note": "; ".join(notes)} if notes else {})
        return record._per_wheel(values, labels), notes

    def _of_trains(self, trains: Trains) -> Values:
        with np.errstate(invalid="ignore", divide="ignore"):
            values = np.asarray(self.of(trains))
        known = trains.is_complete & (trains.impacts.row_counts >= self.impacts)
        return np.where(known, values, np.nan)


def feature(make: Maker) -> Maker:
    """Register a function that makes a feature: files and maps then know it by its name.

    Parameters
    ----------
    make
        Function that returns a `Feature`. It may have arguments, all with defaults. Its name becomes the feature's.
    """
    register(make, ROOM)
    return make


def check_order(first: int, second: int) -> None:
    """Refuse numbers of impacts that are not two in order."""
    if not as_count(first, "first") < as_count(second, "second"):
        raise InputError("", "features", f"impacts {first} and {second}", "two impacts, counted from 1, in order")


@dataclass(frozen=True)
class Train:
    """The impact train of one cell, as a user's own feature receives it; arrays are in order of time.

    Attributes
    ----------
    loss_time, impact_time
        Times of the losses of contact and of the impacts, s.
    closing_speed
        Indentation rate at each impact, m/s.
    peak_time, peak_force, peak_impact
        Force maxima: their times, s, the forces, N, and how many impacts came before each.
    static_force
        Static force N0, N.
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
    """Return a feature of your own.

    Parameters
    ----------
    function
        Function from the `Train` of one cell to a number, or to NaN if it has none. With gradients the train's arrays
        are complex; arithmetic and NumPy's functions carry the imaginary parts through.
    name, unit, definition
        For tables and plots.
    impacts
        How many impacts it needs; with fewer it is NaN and the function is not called.
    until
        When it is known: at the last of these impacts ("impact"), at the first "loss" after it, or at the "end" of the
        run.
    """
    check_function(function, "function", "a function from a Train to a number")
    check_text(name, "name")
    check_text(definition, "definition")

    def value_per_cell(trains: Trains) -> Values:
        long_enough = trains.is_complete & (trains.impacts.row_counts >= impacts)
        return np.array([
            _checked_number(name, function(_train_of_cell(trains, cell))) if long_enough[cell] else np.nan
            for cell in range(trains.cell_count)
        ])  # fmt: skip

    return Feature(name, unit, definition or (function.__doc__ or name).strip(), impacts, until, value_per_cell)


def _checked_number(name: str, found: Any) -> Any:
    """Return what a user's own feature has found, if it is one number."""
    found = found.item() if isinstance(found, np.ndarray) and found.ndim == 0 else found
    if not isinstance(found, Number) or np.asarray(found).dtype.kind == "O":  # such as 10**400
        raise InputError("", name, value_text(found), "one number, as what the feature's function returns")
    return found


def _train_of_cell(trains: Trains, cell: int) -> Train:
    def own_rows(rows: Any, column: str) -> NDArray[Any]:
        return np.asarray(rows.columns[column][rows.first[cell] : rows.first[cell + 1]])

    return Train(
        own_rows(trains.losses, "time"), own_rows(trains.impacts, "time"), own_rows(trains.impacts, "rate"),
        own_rows(trains.peaks, "time"), own_rows(trains.peaks, "force"),
        own_rows(trains.peaks, "impact").real.astype(int), trains.static_force[cell],
    )  # fmt: skip


def named(what: Any) -> Feature:
    """Return a registered feature from its name, or from a table with its name as `type` and its arguments.

    If the table has a `name`, the variable gets this name.
    """
    table = {"type": what} if isinstance(what, str) else dict(what) if isinstance(what, dict) else {}
    kind, name = table.pop("type", None), table.pop("name", None)
    known = registered_in(ROOM)
    if not isinstance(kind, str) or kind not in known:
        raise InputError("", "features", value_text(what), with_suggestion(str(kind), known))
    if name is not None:
        check_text(name, f"features.{kind}.name")
    try:
        made: Feature = known[kind](**table)
    except TypeError as error:
        raise InputError("", f"features.{kind}", repr(table), f"arguments of {kind} ({error})") from error
    return made if name is None else made.renamed(name)
