"""Runs finer than strict ones, whose features are smooth in every field: what happens in them, and how changes grow.

Each march has its own way to be made finer, to be started a little beside, and to tell what happened in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from wheeltapper.march import run
from wheeltapper.march.common import program as contract
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon.assembly import TO_RATE
from wheeltapper.record.chosen import kind_of
from wheeltapper.record.record import Record

if TYPE_CHECKING:
    from wheeltapper.describe.scenario import Scenario
    from wheeltapper.lower.build import Lowered
    from wheeltapper.lower.on_rails import LoweredOnRails
    from wheeltapper.lower.wagon import LoweredWagon
    from wheeltapper.march.general.task import Marched
    from wheeltapper.march.wagon.march import Marched as MarchedWagon
    from wheeltapper.march.wheel.march import Marched as MarchedWheel
    from wheeltapper.record.features import Feature

FloatArray = NDArray[np.float64]
FINER, SHORTER = 1e-3, 0.5
"""Tolerance of a step, and longest macro step on rails, relative to those of the strict method. Values scatter by the
errors of their steps where the number of these depends on a field; so they do by some 1e-12."""
SMALL = 1e-6
"""Change of the start by whose growth the amplification is found, in static indentations."""
DECK_END = -1.0
"""What happens to a wheel that comes on to a deck or leaves it, among kinds of events."""
HEIGHTS, VELOCITIES = range(2)
"""What is changed of the start: all wheels' heights alike, or their velocities."""


class FinerRun(NamedTuple):
    """What is read of a run.

    Attributes
    ----------
    values
        (features, ...wheels).
    happened
        The same where the same happens in the same order.
    lowered, march
        The run itself.
    """

    values: FloatArray
    happened: bytes
    lowered: Any
    march: Any


class _Way(Protocol):
    """How a march is made finer, and read."""

    def finer(self, lowered: Any) -> Any:
        """Return what was lowered for the strict method, which is of this run alone, with smaller errors."""

    def beside(self, lowered: Any, march: Any, which: int) -> tuple[Any, float]:
        """Return the same with a small change of its start, and the size of the change in the terms of `end_of`."""

    def happened(self, march: Any) -> list[NDArray[Any]]:
        """Return what happens to each contact, stop and element in its order."""

    def gentlest(self, lowered: Any, march: Any) -> float:
        """Return the smallest rate of indentation at an event of a wheel, scaled."""

    def end_of(self, lowered: Any, march: Any) -> FloatArray:
        """Return the scaled state at the end."""


def finer_run(scenario: Scenario, features: Sequence[Feature]) -> FinerRun:
    """Make a finer run than a strict one, and read features of it."""
    kind, way = kind_of(scenario), _way_of(scenario)
    lowered = way.finer(kind.lower(scenario, "strict"))
    march = run.march(lowered.program)
    record = Record(scenario, "strict", lowered, march)
    happened = [np.array([march.status]), *way.happened(march)]
    return FinerRun(
        np.array([feature(record).values for feature in features]),
        b"|".join(np.ascontiguousarray(part).tobytes() for part in happened), lowered, march,
    )  # fmt: skip


def gentlest_and_growth(scenario: Scenario, made: FinerRun) -> tuple[float, float]:
    """Return the smallest rate of indentation at an event, scaled, and how much a small change of the start grows.

    The change is one of all wheels' heights alike, or of their velocities.
    """
    way, growth = _way_of(scenario), 0.0
    for which in (HEIGHTS, VELOCITIES):
        near, size = way.beside(way.finer(kind_of(scenario).lower(scenario, "strict")), made.march, which)
        end = way.end_of(near, run.march(near.program))
        growth = max(growth, float(np.linalg.norm(end - way.end_of(made.lowered, made.march))) / size)
    return way.gentlest(made.lowered, made.march), growth


def _by_contact(rows: FloatArray, *columns: int) -> FloatArray:
    """Return some columns of events, those of each contact together in their order."""
    order = np.argsort(rows[:, contract.EVENT_CONTACT], kind="stable")
    return np.asarray(rows[order][:, [contract.EVENT_CONTACT, *columns]])


def _changes(rows: FloatArray) -> FloatArray:
    """Return rows without those that repeat the one before."""
    return np.asarray(rows[np.append(True, (rows[1:] != rows[:-1]).any(axis=1))])


def _slowest(events: FloatArray) -> float:
    return float(np.abs(events[:, contract.EVENT_RATE]).min(initial=np.inf))


class _OfWagons:
    """Steps of smaller error, and on rails shorter macro steps."""

    def finer(self, lowered: LoweredWagon) -> LoweredWagon:
        lowered.assembly.numbers[asm.STEP_TOLERANCE] *= FINER
        if lowered.below is None:
            return lowered
        track = lowered.below.track
        track = track._replace(method=track.method._replace(step=SHORTER * track.method.step))
        return replace(lowered, below=lowered.below._replace(track=track))

    def beside(self, lowered: LoweredWagon, march: MarchedWagon, which: int) -> tuple[LoweredWagon, float]:
        layout, A = lowered.layout, lowered.assembly
        named = zip(layout.displacement_places, layout.motions, strict=True)
        heights = [at for at, (body, motion) in named if motion == "z" and body.startswith("wheelset ")]
        moved = np.array(heights) + (TO_RATE if which == VELOCITIES else 0)
        A.start[moved] += SMALL / A.scales[moved]
        return lowered, SMALL * float(np.sqrt(len(moved)))

    def happened(self, march: MarchedWagon) -> list[NDArray[Any]]:
        pieces = march.steps[:, asm.STEP_ELEMENTS :].T[:, :, None]
        met = [_by_contact(rows, contract.EVENT_KIND) for rows in (march.events, march.seat_events)]
        return [*met, *(_changes(one) for one in pieces)]

    def gentlest(self, lowered: LoweredWagon, march: MarchedWagon) -> float:
        numbers = lowered.assembly.numbers
        return _slowest(march.events) * float(numbers[asm.PULSE]) / float(numbers[asm.STATIC_INDENTATION])

    def end_of(self, lowered: LoweredWagon, march: MarchedWagon) -> FloatArray:
        states = lowered.layout.state_count
        return np.asarray(march.state[:states] * lowered.assembly.scales[:states])


class _OfWheel:
    """Steps of smaller error."""

    def finer(self, lowered: Lowered) -> Lowered:
        lowered.program.numbers[contract.TOLERANCE] *= FINER
        return lowered

    def beside(self, lowered: Lowered, march: MarchedWheel, which: int) -> tuple[Lowered, float]:
        lowered.program.numbers[contract.START_HEIGHT if which == HEIGHTS else contract.START_VELOCITY] += SMALL
        return lowered, SMALL

    def happened(self, march: MarchedWheel) -> list[NDArray[Any]]:
        held = [contract.PHASE, contract.ON_DECK, *range(contract.END_MODE, march.steps.shape[1])[:1]]
        return [
            march.events[:, [contract.EVENT_KIND, contract.EVENT_CAUSE]], _changes(march.steps[:, held]),
            march.stops[:, [contract.STOP_KIND, contract.STOP_SIDE]],
        ]  # fmt: skip

    def gentlest(self, lowered: Lowered, march: MarchedWheel) -> float:
        return _slowest(march.events[march.events[:, contract.EVENT_CAUSE] == 0.0])  # the others are those of a jump

    def end_of(self, lowered: Lowered, march: MarchedWheel) -> FloatArray:
        from wheeltapper.march.wheel import dense

        row = march.at(march.state[[contract.TIME]])[0]
        return np.asarray(row[[dense.OUT_WHEEL_Y, dense.OUT_WHEEL_V, dense.OUT_DECK_Y, dense.OUT_DECK_V]])


class _OnRails:
    """On a track that gives way shorter macro steps; else the strict method, whose steps no kink makes less exact."""

    def finer(self, lowered: LoweredOnRails) -> LoweredOnRails:
        task = lowered.program
        if task.system.ring is None:
            return lowered
        return replace(lowered, program=task._replace(method=task.method._replace(step=SHORTER * task.method.step)))

    def beside(self, lowered: LoweredOnRails, march: Marched, which: int) -> tuple[LoweredOnRails, float]:
        task, (length, speed) = lowered.program, _units(lowered, march)
        bodies, wheels = task.system.bodies, len(lowered.static_force)
        began, freedoms = march.start, len(bodies.mass)
        height = began[:wheels] + march.sinking[:wheels]  # below that of first touch
        start = -np.stack([height, began[freedoms : freedoms + wheels]])
        start[which] += SMALL * (length, speed.mean())[which]
        system = task.system._replace(bodies=bodies._replace(raised=start))
        return replace(lowered, program=task._replace(system=system)), SMALL * float(np.sqrt(wheels))

    def happened(self, march: Marched) -> list[NDArray[Any]]:
        stays = _by_contact(march.seat_events, contract.EVENT_KIND, contract.EVENT_RATE)
        onsets = stays[:, 1] == contract.IMPACT  # else a rate may be zero but for rounding
        stays[:, -1] = np.where(onsets, np.sign(stays[:, -1]), 0.0)  # to which side friction slips, or a stop is met
        rows = [
            (time, DECK_END, 0.0, wheel)
            for wheel in range(march.free.shape[1])
            for time in march.changes_of(wheel)
        ]  # fmt: skip
        both = np.vstack([np.array(rows).reshape(-1, contract.EVENT_COLUMNS), march.events])
        both = both[np.argsort(both[:, contract.EVENT_TIME], kind="stable")]
        return [_by_contact(both, contract.EVENT_KIND), stays]

    def gentlest(self, lowered: LoweredOnRails, march: Marched) -> float:
        jumps = np.isin(march.events[:, contract.EVENT_TIME], march.changes)
        events, (_, speed) = march.events[~jumps], _units(lowered, march)
        events[:, contract.EVENT_RATE] /= speed[events[:, contract.EVENT_CONTACT].astype(np.int64)]
        return _slowest(events)

    def end_of(self, lowered: LoweredOnRails, march: Marched) -> FloatArray:
        length, speed = _units(lowered, march)
        freedoms = len(lowered.plane.freedoms)
        scale = np.full(len(march.state), float(speed.mean()))
        scale[:freedoms] = length
        return np.asarray(march.state / scale)


def _units(lowered: LoweredOnRails, march: Marched) -> tuple[float, FloatArray]:
    """Return the static indentation δ0, m, and δ0 over the time sqrt(m·δ0/N0) of each wheelset, m/s."""
    length = march.static_indentation
    mass = np.diag(lowered.plane.mass)[: len(lowered.static_force)]
    return length, np.sqrt(length * lowered.static_force / mass)


def _way_of(scenario: Scenario) -> _Way:
    marcher = run.choose(run.SIMULATE, scenario.needs)
    return _OfWagons() if marcher.is_of_wagons else _OnRails() if marcher.is_general else _OfWheel()
