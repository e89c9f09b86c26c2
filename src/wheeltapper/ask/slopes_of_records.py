"""Derivatives of features of wagons: the march has no tangents, so they are differences of strict runs.

A strict run with its own step control is a smooth function of each field, down to rounding, as long as the same happens
in it in the same order. Where it does not, there is no derivative, and a note says so (docs/decisions/0034).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask import cells as status_of
from wheeltapper.ask.by_records import computed_by_records, scenario_of_cell
from wheeltapper.ask.cells import ComputedCells
from wheeltapper.ask.differences import Slope, slope_at
from wheeltapper.ground.notes import Note, Shared, shared_notes
from wheeltapper.ground.progress import progress_counter
from wheeltapper.lower.fields import Fields
from wheeltapper.march import assembly as asm
from wheeltapper.march import program as contract
from wheeltapper.march import run
from wheeltapper.march.assembly import TO_RATE
from wheeltapper.record.kinds import kind_of
from wheeltapper.record.record import Record
from wheeltapper.record.simulate import side_by_side

if TYPE_CHECKING:
    from wheeltapper.ask.study import Study
    from wheeltapper.describe.scenario import Scenario
    from wheeltapper.march.multibody import MultibodyMarch
    from wheeltapper.record.features import Feature

FloatArray = NDArray[np.float64]
GRAZING = 1e-3
"""Rate of indentation at an event, in static indentations and the time in which a wheelset on its contacts turns by one
radian of phase, below which a derivative means little."""
FINER, SHORTER = 1e-3, 0.5
"""Tolerance of a step, and longest macro step of rails, relative to those of the strict method. Values scatter by the
errors of their steps where the number of these depends on a field; so they do by some 1e-12."""
SMALL = 1e-6
"""Change of the start by whose growth the amplification is found, in static indentations."""
OTHER_ORDER = (
    "as little as that changes, other contacts are lost or made, or corners of elements passed, or in another order"
)
CORNER = "its slopes on both sides differ"
"""Why there is no derivative."""


class _Run(NamedTuple):
    """What is read of a strict run."""

    values: FloatArray  # (features, …wheels)
    happened: bytes
    march: MultibodyMarch


def _strict_run(scenario: Scenario, features: tuple[Feature, ...], changes: FloatArray | None = None) -> _Run:
    """Make a finer run than a strict one, perhaps with changes of the states that it starts from."""
    lowered: Any = kind_of(scenario).lower(scenario, "strict")
    lowered.assembly.numbers[asm.STEP_TOLERANCE] *= FINER  # what was lowered is of this run alone
    if changes is not None:
        lowered.assembly.start[: len(changes)] += changes
    if lowered.below is not None:
        track = lowered.below.track
        track = track._replace(method=track.method._replace(step=SHORTER * track.method.step))
        lowered = replace(lowered, below=lowered.below._replace(track=track))
    march = run.march(lowered.program)
    record = Record(scenario, "strict", lowered, march)
    return _Run(np.array([feature(record).values for feature in features]), _happened(march), march)


def _happened(march: MultibodyMarch) -> bytes:
    """Return what happens to each contact and in each element, in order, and how the run ended."""
    by_contact = np.argsort(march.events[:, contract.EVENT_CONTACT], kind="stable")
    told = [np.array([march.status]), march.events[by_contact][:, [contract.EVENT_CONTACT, contract.EVENT_KIND]]]
    elements = march.steps[:, asm.STEP_ELEMENTS :].T
    told += [pieces[np.append(True, pieces[1:] != pieces[:-1])] for pieces in elements]
    return b"|".join(np.ascontiguousarray(part).tobytes() for part in told)


def slopes_of_records(asked: Study, changed: dict[str, FloatArray], threads: int) -> ComputedCells:
    """Compute some cells of a study with derivatives: those in which the varied fields have the given values."""
    plain = computed_by_records(replace(asked, gradient=()), changed, threads)
    wheels, cells = asked.wheel_shape, len(plain.status)
    gradient = np.full((len(asked.features), len(asked.gradient), *wheels, cells), np.nan)
    error, trust, growth = gradient.copy(), plain.trust.copy(), plain.amplification.copy()
    whole = [int(cell) for cell in np.flatnonzero(plain.status == status_of.COMPLETE)]
    scenarios = {cell: scenario_of_cell(asked, changed, cell) for cell in whole}
    smooth = tuple(feature for feature in asked.features if feature.differentiable)
    rows = [row for row, feature in enumerate(asked.features) if feature.differentiable]
    bases, missing = dict[int, _Run](), list[tuple[int, int, str, int]]()

    def begin(cell: int) -> None:
        bases[cell] = _strict_run(scenarios[cell], smooth)
        gentlest, growth[cell] = _gentlest_and_growth(scenarios[cell], bases[cell].march)
        if gentlest < GRAZING:
            trust[cell] = status_of.GRAZING
        elif growth[cell] > asked.chaos_limit:
            trust[cell] = status_of.NEAR_CHAOTIC

    def differentiate(task: tuple[int, int]) -> None:
        cell, number = task
        base, path = bases[cell], asked.gradient[number]

        def beside(value: float) -> FloatArray | None:
            found = _strict_run(scenarios[cell].replaced({path: value}), smooth)
            return found.values if found.happened == base.happened else None

        slope = slope_at(beside, base.values, float(Fields(scenarios[cell])(path)))
        gradient[rows, number, ..., cell], error[rows, number, ..., cell] = slope.value, slope.error
        lost = np.isnan(slope.value) & ~np.isnan(base.values)
        if lost.any():
            trust[cell] = status_of.NOT_DIFFERENTIABLE
            missing.extend((cell, *which, number) for which in _reasons(lost, slope))

    if smooth:
        count = progress_counter("derivatives", len(whole) * (1 + len(asked.gradient)))
        side_by_side(begin, whole, threads, lambda: count(1))
        tasks = [(cell, number) for cell in whole for number in range(len(asked.gradient))]
        side_by_side(differentiate, tasks, threads, lambda: count(1))
    shared = shared_notes((*plain.notes, *(Shared(note, 1) for note in _missing_notes(asked, smooth, missing))))
    return replace(plain, gradient=gradient, error=error, trust=trust, amplification=growth, notes=shared)


def _reasons(lost: NDArray[np.bool_], slope: Slope) -> list[tuple[int, str]]:
    """Return the features without a derivative, by number, with the reason."""
    rows = [row for row in range(len(lost)) if lost[row].any()]
    return [(row, CORNER if slope.at_corner[row][lost[row]].any() else OTHER_ORDER) for row in rows]


def _missing_notes(asked: Study, features: tuple[Feature, ...], missing: list[tuple[int, int, str, int]]) -> list[Note]:
    """Return notes on what has no derivative, from (cell, feature, reason, field): one for each of the first three."""
    out = []
    for (_, row, why), group in groupby(sorted(missing), key=lambda one: one[:3]):
        name, paths = features[row].name, ", ".join(asked.gradient[one[3]] for one in group)
        out.append(Note(f"{name} has no derivative by {paths}: {why}", f"no derivative of {name}"))
    return out


def _gentlest_and_growth(scenario: Scenario, march: MultibodyMarch) -> tuple[float, float]:
    """Return the smallest rate of indentation at an event, scaled, and how much a small change of the start grows.

    The change is one of all wheelsets' heights alike, or of their velocities.
    """
    lowered: Any = kind_of(scenario).lower(scenario, "strict")
    A, layout = lowered.assembly, lowered.layout
    length, time = float(A.numbers[asm.STATIC_INDENTATION]), float(A.numbers[asm.PULSE])
    gentlest = float(np.abs(march.events[:, contract.EVENT_RATE]).min(initial=np.inf)) * time / length
    scales, places = A.scales[: layout.state_count], layout.displacement_places
    named = zip(places, layout.motions, strict=True)
    heights = np.array([at for at, (body, motion) in named if motion == "z" and body.startswith("wheelset ")])
    growth = 0.0
    for moved in (heights, heights + TO_RATE):
        change = np.zeros(layout.state_count)
        change[moved] = SMALL / scales[moved]
        other = _strict_run(scenario, (), change).march
        grown = (other.state - march.state)[: layout.state_count] * scales
        growth = max(growth, float(np.linalg.norm(grown) / np.linalg.norm(change * scales)))
    return gentlest, growth
