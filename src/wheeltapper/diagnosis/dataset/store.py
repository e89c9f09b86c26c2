"""The store of a data set."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from functools import cached_property
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper._version import __version__
from wheeltapper.ask.computed import STATUS
from wheeltapper.ask.filled import Block, FilledStore
from wheeltapper.ask.study import wheel_axes_of
from wheeltapper.describe.sensitivity import QUANTITIES
from wheeltapper.describe.sensor.base import Sensor
from wheeltapper.diagnosis.dataset.card import card_of
from wheeltapper.diagnosis.dataset.passages import Own, Passage, longest, passage_of
from wheeltapper.diagnosis.dataset.plan import DatasetPlan
from wheeltapper.diagnosis.faults.base import fault_named
from wheeltapper.ground.memory import check_room
from wheeltapper.ground.notes import Shared
from wheeltapper.ground.quantities import si_unit
from wheeltapper.march.common.blocks import algebra_on_one_thread
from wheeltapper.record.files.filled import DATASET, Place
from wheeltapper.record.labels import flag_attributes

if TYPE_CHECKING:
    import xarray as xr

CHUNK = 100
"""Vehicles in a chunk, about, unless the plan says otherwise."""


class _Column(NamedTuple):
    """A variable of a data set: its dimensions after the passage, their sizes, its type, and its value of a passage."""

    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    kind: Any
    of: Callable[[Passage], Any]
    attrs: dict[str, Any]


def _item(field: str, key: Any) -> Callable[[Any], Any]:
    """Return a function that gives an item of a field."""
    return lambda one: getattr(one, field)[key]


class DatasetStore(FilledStore):
    """The store of a data set: readings and labels of passages.

    Parameters
    ----------
    path
        Its folder.
    spec
        The plan, as JSON has it.
    """

    kind = DATASET

    def __init__(self, path: Path, spec: dict[str, Any]) -> None:
        self.plan = DatasetPlan.model_validate(spec)
        chunk = self.plan.chunk or max(1, CHUNK // len(self.plan.vehicles))
        self._longest = longest(self.plan)
        numbers = sum(self._longest[float(one.rate)] for one in self.plan.sensors)
        together = min(chunk, self.plan.count)
        check_room("chunk", f"{together} passages", 8.0 * together * numbers, "fewer passages in a chunk")
        super().__init__(path, spec, (self.plan.count,), (together,))

    def variables(self) -> xr.Dataset:
        """Return a passage with all its variables, not computed."""
        return self._dataset([])

    def axes(self) -> dict[str, tuple[tuple[str, ...], NDArray[Any], dict[str, Any]]]:
        """Return passages, vehicles, wheels and times."""
        plan = self.plan
        out: dict[str, Any] = {
            "passage": (("passage",), np.arange(plan.count), {"long_name": "number of the passage"}),
            "vehicle": (("vehicle",), np.arange(len(plan.vehicles)), {"long_name": "number of the vehicle"}),
        }
        for rate, count in self._longest.items():
            name = self._time(rate)
            attrs = {"units": "s", "long_name": "time since the first vehicle was at x = 0"}
            out[name] = ((name,), np.arange(count) / rate, attrs)
        wheels = wheel_axes_of(plan.scenario.vehicle)
        return out | {name: ((name,), np.array(each), {}) for name, each in wheels.items()}

    def attributes(self) -> dict[str, Any]:
        """Return what the data set is, how it is made, and who may use it."""
        import numba

        plan = self.plan
        return {
            "title": DATASET.title, "format": DATASET.format, "name": plan.name, "creator": plan.creator,
            "licence": plan.licence, "card": card_of(plan), "method": plan.method, "wheeltapper": __version__,
            "numba": numba.__version__, "numpy": np.__version__, "coordinates": " ".join(self.axes()),
        }  # fmt: skip

    def computed(self, block: Block, threads: int) -> tuple[xr.Dataset, tuple[Shared, ...]]:
        """Compute the passages of a block."""
        with algebra_on_one_thread():  # more threads gain nothing: half of the work is Python's
            found = [passage_of(self.plan, number) for number in range(block[0].start, block[0].stop)]
        return self._dataset(found), ()

    def compile_first(self) -> None:
        """Compute the first passage."""
        with suppress(Exception):  # it is said with the chunk
            passage_of(self.plan, 0)

    def described(self, place: Place) -> str:
        """Return the numbers of the passages in a chunk."""
        (part,) = self.block(place)
        return f"passages {part.start} to {part.stop - 1}"

    def _time(self, rate: float) -> str:
        return "time" if len(self._longest) == 1 else f"time at {rate:g} Hz"

    def _dataset(self, passages: list[Passage]) -> xr.Dataset:
        """Return passages as variables; without any, one that is not computed."""
        import xarray as xr

        data = {}
        for column in self._columns:
            empty = -1 if np.dtype(column.kind).kind == "i" else np.nan
            values = np.full((max(len(passages), 1), *column.shape), empty, dtype=column.kind)
            for i, passage in enumerate(passages):
                values[i] = np.reshape(column.of(passage), column.shape)
            data[column.name] = (("passage", *column.dims), values, column.attrs)
        return xr.Dataset(data)

    @cached_property
    def _columns(self) -> tuple[_Column, ...]:
        """The variables: readings, what is drawn, labels, and the status."""
        plan, wheels = self.plan, wheel_axes_of(self.plan.scenario.vehicle)
        units = {one.fault: fault_named(one.fault).unit for one in plan.conditions if one.fault is not None}
        labels = tuple(one.label for one in plan.conditions)

        def each(name: str, of: Callable[[Passage], Any], kind: Any = float, **attrs: Any) -> _Column:
            return _Column(name, (), (), kind, of, attrs)

        def own(name: str, of: Callable[[Own], Any], kind: Any = float, **attrs: Any) -> _Column:
            shape = (len(plan.vehicles),)
            return _Column(name, ("vehicle",), shape, kind, lambda one: [of(v) for v in one.vehicles], attrs)

        readings = [self._readings(sensor) for sensor in plan.sensors]
        drawn = [
            (own if row.per_vehicle else each)(row.path, _item("drawn", row.path), units=row.unit) for row in plan.rows
        ]
        faulty = [
            own(f"faulty {name}", _item("wheel", i), np.int8, **flag_attributes(tuple(map(str, names))))
            for i, (name, names) in enumerate(wheels.items())
        ]
        shape = (len(plan.vehicles), *(len(names) for names in wheels.values()))
        features = [
            _Column(
                feature.name, ("vehicle", *wheels), shape, float, _item("features", i),
                {"units": feature.unit, "long_name": feature.definition},
            )
            for i, feature in enumerate(plan.labels)
        ]  # fmt: skip
        return (
            *readings,
            each("part", attrgetter("part"), np.int8, **flag_attributes(tuple(plan.parts))),
            *drawn,
            own("distance", attrgetter("distance"), units="m", long_name="distance behind the first vehicle"),
            own("fault", attrgetter("condition"), np.int8, **flag_attributes(labels)),
            own("size", attrgetter("size"), long_name="size of the fault", units_by_fault=json.dumps(units)),
            own("place", attrgetter("place"), units="", long_name="where the fault is, over the circumference"),
            *faulty,
            *features,
            each("status", attrgetter("status"), np.int8, **flag_attributes(STATUS)),
        )

    def _readings(self, sensor: Sensor) -> _Column:
        """Return the variable of a sensor; a run that ends earlier than the longest leaves NaN behind."""
        name, rate = sensor.channel, float(sensor.rate)
        length = self._longest[rate]

        def padded(passage: Passage) -> NDArray[np.float64]:
            whole = np.full(length, np.nan)
            found = passage.readings.get(name, np.empty(0))
            whole[: len(found)] = found
            return whole

        attrs = {"units": si_unit(QUANTITIES[sensor.quantity]), "long_name": f"readings: {sensor.kind}"}
        return _Column(name, (self._time(rate),), (length,), np.float32, padded, attrs)
