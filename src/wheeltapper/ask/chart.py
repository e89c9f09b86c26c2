"""Computed cells as a labelled dataset: a chart."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper._version import __version__
from wheeltapper.ask.computed import STATUS, TRUST, TRUST_BY_DIFFERENCES, ComputedCells
from wheeltapper.ask.study import Study, unit_of
from wheeltapper.record.files.filled import CHART
from wheeltapper.record.labels import flag_attributes

if TYPE_CHECKING:
    import xarray as xr

FloatArray = NDArray[np.float64]


def chart_dataset(asked: Study, found: ComputedCells) -> xr.Dataset:
    """Return computed cells as a labelled dataset."""
    import xarray as xr

    dimensions = tuple(axis.path for axis in asked.axes) if asked.grid else ("cell",)
    named: dict[str, Any] = {
        axis.path: (axis.path if asked.grid else "cell", axis.values, {"units": axis.unit}) for axis in asked.axes
    }
    wheels = tuple(asked.wheel_axes)
    named |= {name: (name, np.array(each)) for name, each in asked.wheel_axes.items()}
    data: dict[str, Any] = {
        feature.name: (
            (*wheels, *dimensions), column.reshape(*asked.wheel_shape, *asked.shape),
            {"units": feature.unit, "long_name": feature.definition},
        )
        for feature, column in zip(asked.features, found.values, strict=True)
    }  # fmt: skip
    data["status"] = (dimensions, found.status.astype(np.int8).reshape(asked.shape), flag_attributes(STATUS))
    if asked.gradient:
        named["parameter"] = ("parameter", np.array(asked.gradient))
        data |= _gradient_variables(asked, found, wheels, dimensions)
    return xr.Dataset(
        data, named, chart_attributes(asked, tuple(note.sentence_of(asked.cell_count) for note in found.notes))
    )


def _gradient_variables(
    asked: Study, found: ComputedCells, wheels: tuple[str, ...], dimensions: tuple[str, ...]
) -> dict[str, Any]:
    shape, parameters, each = asked.shape, len(asked.gradient), (*asked.wheel_shape, *asked.shape)
    along = ("parameter", *wheels, *dimensions)
    held = np.stack([asked.field_values(path) for path in asked.gradient])
    held = held.reshape(parameters, *(1 for _ in wheels), -1)
    elastic, trust = {}, TRUST_BY_DIFFERENCES if asked.by_differences else TRUST
    data: dict[str, Any] = {
        "gradient_status": (dimensions, found.trust.astype(np.int8).reshape(shape), flag_attributes(trust)),
        "amplification": (
            dimensions, found.amplification.reshape(shape),
            {"units": "", "long_name": "how much a change of the start has grown when the last feature is known"},
        ),
    }  # fmt: skip
    units = [unit_of(asked.scenario, path) for path in asked.gradient]
    errors = found.gradient if found.error is None else found.error
    for feature, values, slope, error in zip(asked.features, found.values, found.gradient, errors, strict=True):
        if not feature.differentiable:
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            elastic[feature.name] = slope * held / values
        data[f"{feature.name}_gradient"] = (
            along, slope.reshape(parameters, *each),
            {
                "units": feature.unit, "parameter_units": json.dumps(units),
                "long_name": f"derivative of: {feature.definition}; per unit of the parameter",
            },
        )  # fmt: skip
        if found.error is not None:
            data[f"{feature.name}_gradient_error"] = (
                along, error.reshape(parameters, *each),
                data[f"{feature.name}_gradient"][2] | {"long_name": f"probable error of {feature.name}_gradient"},
            )  # fmt: skip
        data[f"{feature.name}_elasticity"] = (
            along, elastic[feature.name].reshape(parameters, *each),
            {"units": "", "long_name": f"d ln f / d ln p of: {feature.definition}"},
        )  # fmt: skip
        if parameters > 1:
            data[f"{feature.name}_angle"] = (
                along, _axis_angles(elastic[feature.name]).reshape(parameters, *each),
                {"units": "deg", "long_name": f"angle of the elasticities to a parameter's axis: {feature.definition}"},
            )  # fmt: skip
    if len(elastic) > 1 and parameters > 1:
        data["condition"] = (
            (*wheels, *dimensions),
            _condition_number(np.stack(list(elastic.values())).reshape(len(elastic), parameters, -1)).reshape(each),
            {"units": "", "long_name": "condition number of the elasticities of all features by all parameters"},
        )  # fmt: skip
    return data


def _axis_angles(elasticity: FloatArray) -> FloatArray:
    """Return the angle in degrees to each parameter's axis, (parameters, cells)."""
    size = np.sqrt((elasticity**2).sum(axis=0))
    with np.errstate(divide="ignore", invalid="ignore"):
        across = np.sqrt(np.maximum(size**2 - elasticity**2, 0.0))
        return np.asarray(np.degrees(np.arctan2(across, np.abs(elasticity))))


def _condition_number(elasticity: FloatArray) -> FloatArray:
    """Return the condition number of each cell's matrix, features by parameters."""
    matrices = np.moveaxis(elasticity, -1, 0)
    known = np.isfinite(matrices).all(axis=(1, 2))
    out = np.full(len(matrices), np.nan)
    if known.any():
        size = np.linalg.svd(matrices[known], compute_uv=False)
        with np.errstate(divide="ignore"):
            out[known] = size[:, 0] / size[:, -1]
    return out


def chart_attributes(asked: Study, notes: tuple[str, ...]) -> dict[str, Any]:
    """Return what a chart says of its origin."""
    import numba

    try:
        text = json.dumps(asked.scenario.model_dump(mode="json"))
    except ValueError:
        text = repr(asked.scenario)
    return {
        "title": CHART.title, "format": CHART.format, "scenario": text, "notes": json.dumps([*asked.notes, *notes]),
        "method": asked.method, "wheeltapper": __version__, "numba": numba.__version__, "numpy": np.__version__,
    }  # fmt: skip
