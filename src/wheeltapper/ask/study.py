"""Description and checks of a study: a scenario, the fields that vary and their values, and the features."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.questions import QUESTIONS, TANGENTS
from wheeltapper.describe.noun import Noun
from wheeltapper.describe.paths import held_at
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_count, as_list, as_quantity, check_choice, check_flag
from wheeltapper.ground.errors import InputError, value_text
from wheeltapper.ground.memory import check_room
from wheeltapper.ground.needs import SEVERAL_BODIES, Need
from wheeltapper.ground.notes import Note
from wheeltapper.lower.contacts import SIDES
from wheeltapper.lower.fields import Fields
from wheeltapper.march import run
from wheeltapper.record.arguments import check_method
from wheeltapper.record.cells.door import cells_of
from wheeltapper.record.features import Feature, named

if TYPE_CHECKING:
    from wheeltapper.record.cells.base import Cells

FloatArray = NDArray[np.float64]
CHAOS_LIMIT = 1e4
"""Amplification of a small change of the start from which on a cell counts as near-chaotic, unless another limit is
given."""
BESIDE = 1e-12
"""As good as zero, and not zero: in SI units, and far below what is plausible."""
RESERVED = ("status", "parameter", "wheelset", "cell", "gradient_status", "amplification", "condition")
"""Names of variables that every chart has; no feature may have one of them."""
DERIVED = ("_gradient", "_gradient_error", "_elasticity", "_angle")
"""Endings that follow a feature's name in the names of its derivatives."""
Sampling = Literal["sobol", "latin hypercube"]
Asked = str | Feature | Sequence[str | Feature]
"""Features, or their names: one or several."""


@dataclass(frozen=True)
class Axis:
    """One varied field: its path, its values in SI units, and the unit's name."""

    path: str
    values: FloatArray
    unit: str


def wheel_axes_of(vehicle: Any) -> dict[str, list[int] | list[str]]:
    """Return the names of a vehicle's wheelsets and sides; nothing where there is but one wheel."""
    if SEVERAL_BODIES in vehicle.needs:
        return {"wheelset": [*range(1, len(vehicle.axles) + 1)], "side": [*SIDES[:2]]}
    wheelsets = len(getattr(vehicle, "positions", (0.0,)))
    return {"wheelset": [*range(1, wheelsets + 1)]} if wheelsets > 1 else {}


def needs_over(scenario: Scenario, axes: Sequence[Axis]) -> frozenset[Need]:
    """Return what a scenario needs in any cell: a field may bring something where it leaves zero."""
    ends = [{axis.path: float(end)} for axis in axes for end in (axis.values.min(), axis.values.max())]
    return scenario.needs.union(*(scenario.replaced(end).needs for end in ends))


@dataclass(frozen=True)
class Study:
    """A scenario, the cells in which some of its fields vary, and the features of each cell.

    Attributes
    ----------
    scenario
        The scenario that all cells share.
    axes
        The varied fields.
    grid
        True: the cells are all combinations of the axes' values. False: cell n has the n-th value of each axis.
    features
        The features.
    method
        "default" or "strict".
    gradient
        Paths of the fields with respect to which the features are differentiated.
    chaos_limit
        Amplification above which a cell counts as near-chaotic.
    by_differences
        Whether the derivatives are differences of whole runs: where anything has no tangents.
    """

    scenario: Scenario
    axes: tuple[Axis, ...]
    grid: bool
    features: tuple[Feature, ...]
    method: str
    gradient: tuple[str, ...] = ()
    chaos_limit: float = CHAOS_LIMIT
    by_differences: bool = False

    @property
    def shape(self) -> tuple[int, ...]:
        """Numbers of cells along the axes of the result."""
        return tuple(len(axis.values) for axis in self.axes) if self.grid else (len(self.axes[0].values),)

    @property
    def cell_count(self) -> int:
        """Number of all cells."""
        return prod(self.shape)

    def numbers_in_memory(self, cells: int) -> int:
        """Return the number of numbers in memory while `cells` cells are computed together."""
        features, parameters = len(self.features) * self.wheel_count, len(self.gradient)
        fields = len(self.axes) + len(self.gradient)
        found = features * (1 + parameters) + 3  # and status, trust, amplification; twice, because parts are joined
        return cells * (2 * found + 2 * fields + 2 * features * parameters)

    @cached_property
    def cells(self) -> type[Cells]:
        """What the march that computes the cells offers for them."""
        return cells_of(run.choose(run.SWEEP, needs_over(self.scenario, self.axes)))

    @property
    def wheel_axes(self) -> dict[str, list[int] | list[str]]:
        """Names of wheelsets and sides, each of which has a value of every feature; nothing where there is but one."""
        return wheel_axes_of(self.scenario.vehicle)

    @property
    def wheel_shape(self) -> tuple[int, ...]:
        """Numbers of wheelsets and sides, as of `wheel_axes`."""
        return tuple(len(names) for names in self.wheel_axes.values())

    @property
    def wheel_count(self) -> int:
        """Number of all wheels of a cell that have a value of every feature."""
        return prod(self.wheel_shape)

    def by_cell(self, values: FloatArray) -> FloatArray:
        """Return one value per wheel of some cells, cell after cell, with the cells along the last axis."""
        return np.moveaxis(values.reshape(-1, *self.wheel_shape), 0, -1)

    @property
    def dear_axes(self) -> tuple[int, ...]:
        """Axes along which cells share less: those that share should be computed together."""
        return tuple(number for number, axis in enumerate(self.axes) if self.grid and self.cells.is_dear(axis.path))

    @property
    def notes(self) -> tuple[Note, ...]:
        """What is asked and not computed."""
        without = ", ".join(one.name for one in self.features if not one.differentiable and self.gradient)
        return (Note(f"no gradient of {without}: counts, bounds and filtered forces have none"),) if without else ()

    def changed_values(self, block: tuple[slice, ...] | None = None) -> dict[str, FloatArray]:
        """Return the value of each varied field in all cells, or in a block of them, in C order.

        Fields of the gradient are included even if they do not vary.
        """
        parts = block or tuple(slice(0, length) for length in self.shape)
        ranges = [np.arange(part.start, part.stop) for part in parts]
        places = [place.ravel() for place in np.meshgrid(*ranges, indexing="ij")]
        if not self.grid:
            places = places * len(self.axes)
        varied = {axis.path: axis.values[place] for axis, place in zip(self.axes, places, strict=True)}
        many = len(places[0])
        held = {path: np.full(many, Fields(self.scenario)(path)) for path in self.gradient if path not in varied}
        return varied | held

    def field_values(self, path: str) -> FloatArray:
        """Return a field's value in every cell."""
        return self.changed_values()[path]


def field_at(scenario: Scenario, path: str) -> tuple[Noun, str]:
    """Return the noun that holds a continuous field, and the name of the field in it.

    Raises
    ------
    InputError
        If there is no such field, or it is no continuous number: a count, a switch, a name, or not set.
    """
    holder, name, value = held_at(scenario, path)
    if isinstance(value, bool) or not isinstance(value, float):
        what = "nothing set" if value is None else f"{value!r}, which is no continuous number"
        raise InputError("", path, what, "a field that holds a quantity")
    return holder, name


def check_differentiable(scenario: Scenario, path: str) -> None:
    """Refuse a path of no continuous field, or of one that chooses the waves of an irregularity."""
    holder, name = field_at(scenario, path)
    if name in getattr(holder, "stepwise", ()):
        found = f"a field that chooses the waves of a {type(holder).__name__}, which has no derivative by it"
        raise InputError("", path, found, "another field")


def unit_of(scenario: Scenario, path: str) -> str:
    """Return the SI unit of a field of a scenario."""
    holder, name = field_at(scenario, path)
    return field_unit(type(holder), name)


def field_unit(kind: Any, name: str) -> str:
    """Return the SI unit of a field of a kind of noun, "" of one that is no quantity."""
    from wheeltapper.ground.quantities import si_unit

    field = kind.model_fields[name]
    texts = [_path_description(field), *(_path_description(part) for part in _annotations(field.annotation))]
    return next((unit for text in texts if (unit := si_unit(text.partition(":")[0]))), "")


def _annotations(annotation: Any) -> list[Any]:
    """Return the annotations of the types inside a type: the Length in tuple[Length, ...] | None."""
    inside = [part for argument in get_args(annotation) for part in _annotations(argument)]
    return [*getattr(annotation, "__metadata__", ()), *inside]


def _path_description(field: Any) -> str:
    schema = getattr(field, "json_schema_extra", None)
    return str(schema.get("description", "")) if isinstance(schema, dict) else ""


def study_axis(question: run.Question, scenario: Scenario, path: str, values: Any) -> Axis:
    """Return a varied field with its values, each of which the question takes."""
    unit = unit_of(scenario, path)
    array = (
        values
        if isinstance(values, np.ndarray) and values.dtype.kind in "fiu"
        else _values_in_si(scenario, path, values)
    )
    array = np.atleast_1d(array).astype(float)
    if not array.size:
        raise InputError("", path, "no values", "at least one value")
    if array.ndim != 1 or not np.all(np.isfinite(array)):
        raise InputError("", path, "values that are not finite numbers in one dimension", "finite numbers")
    for extreme in (array.min(), array.max()):
        run.choose(question, scenario.replaced({path: float(extreme)}).needs, path)
    return Axis(path, array, unit)


def _values_in_si(scenario: Scenario, path: str, values: Any) -> FloatArray:
    """Return numbers, or strings with a unit, as numbers."""
    listed = list(values) if hasattr(values, "__iter__") and not isinstance(values, str) else [values]
    return np.array([value_in_si(scenario, path, value) for value in listed])


def value_in_si(scenario: Scenario, path: str, value: Any) -> float:
    """Return a value in SI units: a number as it is, anything else as the field itself reads it."""
    if isinstance(value, Real) and not isinstance(value, bool):
        return float(value)
    if value is None:  # a None would remove the field
        raise InputError("", path, "None", "numbers in SI units, or strings with a unit")
    return float(Fields(scenario.replaced({path: value}))(path))


def check_along(question: run.Question, scenario: Scenario, paths: Sequence[str]) -> None:
    """Refuse a question about a scenario, or its derivatives by some fields.

    What a field brings begins where it leaves zero: there a scenario beside this one needs more.
    """
    run.choose(question, scenario.needs)
    for path in paths:
        if Fields(scenario)(path) == 0.0:
            run.choose(question, scenario.replaced({path: BESIDE}).needs, path)


def study_of(
    scenario: Scenario, over: Mapping[str, Any], features: Asked, *,
    gradient: bool | Sequence[str] = False, zipped: bool = False, samples: int | None = None,
    sampling: Sampling = "sobol", seed: int = 0, method: str = "default", chaos_limit: float = CHAOS_LIMIT,
    question: run.Question = run.SWEEP,
) -> Study:  # fmt: skip
    """Return the study that `sweep`, or another question, computes; its arguments are those of `sweep`."""
    run.choose(question, scenario.needs)
    check_method(method)
    check_flag(zipped, "zipped")
    check_choice(sampling, "sampling", get_args(Sampling))
    seed, chaos_limit = as_count(seed, "seed", 0), as_quantity(chaos_limit, "chaos_limit", "number")
    if not isinstance(over, Mapping) or not over:
        found = "nothing" if isinstance(over, Mapping) else value_text(over)
        raise InputError("", "over", found, 'at least one field of the scenario with its values, as {"speed": [5, 6]}')
    asked = as_features(features)
    _check_names([feature.name for feature in asked], over)
    by = tuple(over) if gradient is True else tuple(as_list(gradient or (), "gradient", "True, or paths of fields"))
    axes = tuple(study_axis(question, scenario, path, values) for path, values in over.items())
    if samples is not None:
        axes = _sampled_axes(axes, samples, sampling, seed)
    side_by_side = zipped or samples is not None
    lengths = {axis.path: len(axis.values) for axis in axes}
    if side_by_side and len(set(lengths.values())) > 1:
        raise InputError("", "over", f"lists of different lengths {lengths}", "lists of one length where zipped")
    for path in by:
        check_differentiable(scenario, path)
    if by and not any(feature.differentiable for feature in asked):
        names = ", ".join(feature.name for feature in asked)
        raise InputError("", "features", f"{names}, which has no derivatives", "a feature that is no count or bound")
    check_along(question, scenario, by)
    _check_questions(asked, question, scenario)
    differ = bool(by) and has_no_tangents(scenario, by, [axis.path for axis in axes], asked)
    return Study(scenario, axes, not side_by_side, asked, method, by, chaos_limit, differ)


def _check_questions(features: tuple[Feature, ...], question: run.Question, scenario: Scenario) -> None:
    """Refuse features that ask what the march of these cells does not know."""
    marcher = run.choose(question, scenario.needs)
    for feature in features:
        other = QUESTIONS[feature.asks] if feature.asks else question
        if marcher not in other.marchers:
            raise run.refusal(other, scenario.needs, f"features.{feature.name}")


def has_no_tangents(scenario: Scenario, by: Sequence[str], varied: Sequence[str], features: Sequence[Feature]) -> bool:
    """Return whether a field, a feature, or what the scenario holds has no tangents, so that runs are differenced."""
    begun = [path for path in {*by, *varied} if Fields(scenario)(path) == 0.0]
    needs = scenario.needs.union(*(scenario.replaced({path: BESIDE}).needs for path in begun))
    marcher = run.fastest_march(TANGENTS, needs)
    return marcher is None or not cells_of(marcher).has_tangents(scenario, by, features)


def as_features(given: Asked) -> tuple[Feature, ...]:
    """Return features: for a name the built-in one, for a table the one that its `type` describes."""
    several = [given] if isinstance(given, Feature | str | dict) else as_list(given, "features", "a list of features")
    if not several:
        raise InputError("", "features", "nothing", "at least one feature")
    return tuple(one if isinstance(one, Feature) else named(one) for one in several)


def _check_names(names: Sequence[str], over: Mapping[str, Any]) -> None:
    """Refuse names of features that clash with those of a chart or a file."""
    for name in names:
        if names.count(name) > 1:
            raise InputError("", "features", f"the name {name!r} twice", "features of different names (`renamed`)")
        if name in RESERVED or name in over or any(name == f"{other}{end}" for other in names for end in DERIVED):
            raise InputError("", "features", f"the name {name!r}, which charts use", "another name (`renamed`)")
        if not re.fullmatch(r"\w[^/\\\0]*", name):
            raise InputError("", "features", f"the name {name!r}", "a name that begins with a letter, without slashes")


def _sampled_axes(axes: tuple[Axis, ...], samples: int, sampling: Sampling, seed: int) -> tuple[Axis, ...]:
    from scipy.stats import qmc

    samples = as_count(samples, "samples")
    check_room("samples", f"{samples:.4g} samples", 24.0 * samples * len(axes), "fewer samples")
    for axis in axes:
        if len(axis.values) != 2 or axis.values[0] > axis.values[1]:
            raise InputError("", axis.path, f"{len(axis.values)} values", "lowest and highest value, to sample between")
    if sampling == "sobol":
        points = qmc.Sobol(len(axes), rng=seed).random(samples)
    else:
        points = qmc.LatinHypercube(len(axes), rng=seed).random(samples)
    return tuple(
        Axis(axis.path, axis.values[0] + column * (axis.values[1] - axis.values[0]), axis.unit)
        for axis, column in zip(axes, points.T, strict=True)
    )
