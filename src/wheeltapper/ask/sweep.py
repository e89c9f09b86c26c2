"""The verbs `sweep` and `gradient`: features over many cells of a scenario, and their derivatives in one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wheeltapper.ask.cells import compute_cells
from wheeltapper.ask.chart import chart_dataset
from wheeltapper.ask.questions import GRADIENT
from wheeltapper.ask.reading_gradients import Sensors, are_sensors, reading_gradients
from wheeltapper.ask.study import CHAOS_LIMIT, Asked, Sampling, field_at, study_of
from wheeltapper.describe.scenario import Scenario
from wheeltapper.ground.arguments import as_count, as_list
from wheeltapper.ground.memory import check_room
from wheeltapper.ground.progress import Progress, progress_shown
from wheeltapper.ground.warned import warn_of
from wheeltapper.lower.fields import Fields
from wheeltapper.march import run
from wheeltapper.march.common.blocks import core_count
from wheeltapper.record.arguments import as_scenario

if TYPE_CHECKING:
    import xarray as xr


def sweep(
    scenario: Scenario | str | Path,
    over: Mapping[str, Any],
    features: Asked,
    *,
    gradient: bool | Sequence[str] = False,
    zipped: bool = False,
    samples: int | None = None,
    sampling: Sampling = "sobol",
    seed: int = 0,
    method: str = "default",
    threads: int | None = None,
    chaos_limit: float = CHAOS_LIMIT,
    progress: Progress = True,
) -> xr.Dataset:
    """Compute features over many cells in which some fields of a scenario vary.

    Parameters
    ----------
    scenario
        The scenario that all cells share; or the path of its TOML file.
    over
        Values of continuous fields, by their paths ("vehicle.damping", "irregularity.0.height", "speed"): numbers in SI
        units or strings with a unit. The cells are all combinations of the values.
    features
        From `wheeltapper.features`, or their names, as ["force_ratio"]. A run ends as soon as all of them are known.
    gradient
        True: also compute the features' exact derivatives with respect to the varied fields, through all impacts. Or
        the paths of the fields with respect to which to differentiate. What has no tangents is differenced, see below.
    zipped
        True: the lists of `over` have the same length, and cell n has the n-th value of each.
    samples, sampling, seed
        If `samples` is given, `over` holds lowest and highest values, and `samples` cells are drawn between them, as a
        "sobol" sequence or a "latin hypercube".
    method
        "default" or "strict".
    threads
        Number of threads; by default one per core. The result does not depend on it.
    chaos_limit
        Cells in which a small change of the start grows by more than this are marked as near-chaotic.
    progress
        As for `wheeltapper.simulate`.

    Returns
    -------
    xarray.Dataset
        One variable per feature with its unit and definition, NaN if a cell has too few impacts, and `status` per cell.
        Their dimensions are named by the paths, or "cell" if the cells do not form a grid. With gradients there are
        more: for each feature its `_gradient`, its `_elasticity` d ln f / d ln p and, for two parameters or more, its
        `_angle` to each parameter's axis; `condition` of all features by all parameters; `amplification`; and
        `gradient_status`. In a "grazing" cell an event hardly happens, so that the derivative means little.

        Where a scenario, a field or a feature has no tangents (wagons, contacts that yield, dampers with ends, friction
        and other kinks of suspensions, anomalies; on rails fields of the track and highest positions), derivatives are
        extrapolated from differences of runs that are finer than "strict" ones. The same events must happen in these
        runs in the same order: losses, impacts, onsets of yield, stops, friction that slips or sticks, corners of
        elements, voids. The `_gradient_error` of each derivative is its probable error, mostly below 1e-8 of the
        derivative. Where both are NaN there is no derivative: near the field's value other events happen, or the slopes
        on its two sides differ; a note says which. Such cells are "not_differentiable", the others "by_differences".

    Raises
    ------
    InputError
        If a path names no continuous field, or no cell can be computed. If only some cannot, their status is "refused",
        and a `ModelWarning` states the first reason.
    """
    asked = study_of(
        as_scenario(scenario), over, features, gradient=gradient, zipped=zipped, samples=samples, sampling=sampling,
        seed=seed, method=method, chaos_limit=chaos_limit,
    )  # fmt: skip
    check_room(
        "over", f"{asked.cell_count:.4g} cells", 8.0 * asked.numbers_in_memory(asked.cell_count),
        "fewer cells, or `wheeltapper sweep`, which keeps a few chunks at a time,",
    )  # fmt: skip
    held = core_count() if threads is None else as_count(threads, "threads")
    with progress_shown(progress, "cells"):
        found = compute_cells(asked, asked.changed_values(), held)
    found.check_refusals()
    warn_of([note.sentence_of(asked.cell_count) for note in found.notes])
    return chart_dataset(asked, found)


def gradient(
    scenario: Scenario | str | Path,
    features: Asked | Sensors,
    parameters: Sequence[str],
    *,
    method: str = "default",
    chaos_limit: float = CHAOS_LIMIT,
) -> xr.Dataset:
    """Compute features of one scenario, or readings of sensors, and their derivatives, through all impacts.

    Parameters
    ----------
    scenario
        What to simulate, or the path of its TOML file.
    features
        From `wheeltapper.features`, or their names. Or sensors, or a site with sensors, as `Record.recordings` takes
        them, all of one rate.
    parameters
        Paths of the continuous fields with respect to which to differentiate. For readings also fields of sensors, as
        "sensors.left 1.gain"; a sensor without a name is called by its kind, as in "sensors.pad force.x".
    method, chaos_limit
        As for `sweep`.

    Returns
    -------
    xarray.Dataset
        For features, the variables of `sweep` with gradients, for one cell; with several wheelsets on rails over
        `wheelset`, with wagons over `wheelset` and `side`; with errors where derivatives are differences. For sensors,
        each reading over `time`, by its sensor's name. Its derivatives at fixed times (`_gradient`), and their errors
        (`_gradient_error`), are also over `parameter`. The error is zero where the derivative is exact.

    Raises
    ------
    InputError
        If a path names no continuous field, or one that chooses the waves of an irregularity; or if sensors differ in
        their rates, or read nothing of this run.

    Notes
    -----
    The reading of a pair of gauges jumps where a wheel passes one of them. If a parameter shifts this jump in time, the
    derivative is an impulse there. Two samples share its area, before the recorder's filter if there is one, so that a
    low-pass of the derivative is the derivative of the low-passed reading. Derivatives of accelerations of rails and
    sleepers grow beyond bounds towards an impact, because the force does not begin smoothly there.
    """
    import numpy as np

    scenario = as_scenario(scenario)
    run.choose(GRADIENT, scenario.needs)
    parameters = as_list(parameters, "parameters", 'paths of continuous fields, as ["vehicle.damping"]')
    asked_for: Any = features
    if are_sensors(asked_for):
        return reading_gradients(scenario, asked_for, parameters, method)
    for path in parameters:
        field_at(scenario, path)
    here = {path: [float(Fields(scenario)(path))] for path in parameters}
    asked = study_of(
        scenario, here, asked_for, gradient=tuple(parameters), zipped=True, method=method, chaos_limit=chaos_limit,
        question=GRADIENT,
    )  # fmt: skip
    computed = compute_cells(asked, asked.changed_values(), core_count() if asked.by_differences else 1)
    computed.check_refusals()
    warn_of([note.sentence_of(1) for note in computed.notes])
    found = chart_dataset(asked, computed).isel(cell=0)
    return found.drop_vars(
        [name for name in found.coords if name not in ("parameter", "wheelset", "side")]
    ).assign_coords(value=("parameter", np.array([here[path][0] for path in parameters])))
