"""The modes of both rails below a vehicle with many bodies at any time, from the logs of its march.

The modes of each way in which the rails move follow from the moments of the forces on them, which are states of the
vehicle. They are read where macro steps end, and at the asked times; all else is as below the contacts of the general
march.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wheeltapper.march.common.program import FloatArray, IntArray
from wheeltapper.march.general.replay import At, Modes, Starts, TrackRun, modes_under
from wheeltapper.march.general.tables import without_bodies
from wheeltapper.march.wagon import assembly as asm
from wheeltapper.march.wagon import wheel_rows as wheel
from wheeltapper.march.wagon.assembly import HALF
from wheeltapper.march.wagon.multibody import MultibodyMarch
from wheeltapper.march.wagon.rails.march import LEFT_RAIL, RIGHT_RAIL, OnRails
from wheeltapper.march.wagon.rails.modes import fours_of, tables_for
from wheeltapper.march.wagon.replay import replay

DIFFERENCED, OF_MACRO_STEP = 1e-3, 0.2
"""Distance over which the forces' rates are differenced, in steps of the vehicle, which count as long as this part of a
macro step at most; its square is the relative error."""
FORCE_ROWS = np.array([wheel.NORMAL, wheel.NORMAL_RATE])


class RailAt(NamedTuple):
    """A track at some times: its modes, and forces with two derivatives, SI units.

    These are of the wheelsets, and then of the sleepers over voids, (times, wheelsets and sleepers). Of a change of the
    speed, `moved` are the forces themselves with their derivatives, whose places move by t.
    """

    modes: Modes
    force: FloatArray
    force_rate: FloatArray
    force_bend: FloatArray
    moved: tuple[FloatArray, FloatArray, FloatArray] | None = None


def _with_checkpoints(run: TrackRun) -> TrackRun:
    """Return the same with the modes at the start of every MODES_EVERY-th macro step."""
    known = Starts(run).checkpoints()
    return run._replace(modes=np.stack([known.real, known.imag], axis=1))


def _ways(values: FloatArray, axis: int) -> FloatArray:
    """Return values of the left and the right rail, along an axis, as those of both ways to move."""
    left, right = np.take(values, LEFT_RAIL, axis), np.take(values, RIGHT_RAIL, axis)
    return np.stack([0.5 * (left + right), 0.5 * (left - right)], axis)


class RailsReplay:
    """What the rails do over a march, together and against one another; times are asked for in rising order."""

    def __init__(self, task: OnRails, march: MultibodyMarch) -> None:
        self._task, self._march, track = task, march, task.track
        self._entries = track.entries
        made = [tables_for(track, way, float(march.end)) for way in range(len(track.rings))]
        self._grid, self._force = made[0].grid, track.units.force
        moments, self._runs = self._moments_of_macro_steps(), []
        for way, (ring, amplitudes) in enumerate(zip(track.rings, task.modes, strict=True)):
            held = amplitudes[np.argsort(np.abs(ring.rates), kind="stable")]
            begins, tables = np.stack([held.real, held.imag])[np.newaxis], without_bodies(made[way], track.method)
            run = TrackRun(ring, tables, made[way].grid, self._force, moments[:, way], begins)
            self._runs.append(_with_checkpoints(run))
        self._starts = [Starts(run) for run in self._runs]

    def _macro_steps(self) -> IntArray:
        """Return the macro step of each step of the vehicle."""
        begins, lengths = self._march.steps[:, asm.STEP_TIME], self._march.steps[:, asm.STEP_LENGTH]
        return np.asarray(np.floor(self._grid.steps(begins + 0.5 * lengths)).astype(np.int64))

    def _moments_of_macro_steps(self) -> FloatArray:
        """Return the moments of both ways at the ends of all macro steps, and of the last one at the end of the march.

        They are (steps, 2, wheelsets, nodes).
        """
        macro, begins = self._macro_steps(), self._march.steps[:, asm.STEP_TIME]
        ends = np.append(begins[np.flatnonzero(np.diff(macro)) + 1], self._march.end)
        states, _, _ = replay(self._march, np.nextafter(ends, 0.0), FORCE_ROWS[:0])
        return self._as_moments(states)

    def _as_moments(self, states: FloatArray) -> FloatArray:
        """Return the moments of both ways from states, in units of the tables: (times, 2, wheelsets, nodes)."""
        fours, nodes = self._task.track.fours, self._task.track.method.nodes
        begin = int(self._task.assembly.rails[asm.RAIL_STATES])
        held = states[:, begin : begin + 2 * fours * nodes * HALF].reshape(-1, 2, fours, nodes, HALF) / self._force
        return _ways(np.moveaxis(held, 3, 4).reshape(-1, 2, fours * HALF, nodes)[:, :, self._entries], 1)

    def _forces(self, rows: FloatArray) -> FloatArray:
        """Return forces and their rates of both ways from rows of the contacts: (times, 2, ways, entries)."""
        found, A = rows.reshape(len(rows), 2, -1, 2, HALF), self._task.assembly
        fours = fours_of(len(self._task.track.places))
        wheels = found[:, :, : A.wheel_octets].reshape(len(rows), 2, -1, fours, 2, HALF)  # treads, perhaps flanges
        summed = np.where(wheels[:, :1] > 0.0, wheels, 0.0).sum(axis=2)
        summed = np.concatenate([summed, found[:, :, A.wheel_octets :]], axis=2)
        return _ways(np.moveaxis(summed, 2, 3).reshape(len(rows), 2, 2, -1)[..., self._entries], 2)

    def at(self, times: FloatArray, bends: bool = True) -> list[RailAt]:
        """Return both ways at rising times, s; without `bends` there are no second derivatives."""
        steps = self._march.steps
        row = np.clip(np.searchsorted(steps[:, asm.STEP_TIME], times, side="right") - 1, 0, None)
        begin, length = steps[row, asm.STEP_TIME], steps[row, asm.STEP_LENGTH]
        length = np.minimum(length, OF_MACRO_STEP * self._grid.seconds(self._macro_steps()[row]))
        away = np.where(times - begin < 0.5 * length, DIFFERENCED, -DIFFERENCED) * length  # within the same step
        asked = np.stack([times, times + away, times + 2.0 * away][: 3 if bends else 1])
        order = np.argsort(asked, axis=None, kind="stable")
        states, _, rows = replay(self._march, asked.ravel()[order], FORCE_ROWS)
        back = np.argsort(order, kind="stable").reshape(asked.shape)
        force, rate = np.moveaxis(self._forces(rows[back[0]]), 1, 0)
        bend = np.full_like(force, np.nan)
        if bends:
            near, far = (self._forces(rows[some])[:, 1] for some in back[1:])
            bend = (4.0 * near - far - 3.0 * rate) / (2.0 * away[:, None, None])
        moments, step = self._as_moments(states[back[0]]), self._macro_steps()[row]
        seconds = self._grid.seconds(step)
        theta = np.clip((times - self._grid.times(step)) / seconds, 0.0, 1.0)
        out = []
        for way, (run, starts) in enumerate(zip(self._runs, self._starts, strict=True)):
            felt = [
                At(
                    force[:, way, i] / self._force, rate[:, way, i] * seconds / self._force,
                    bend[:, way, i] * seconds**2 / self._force, moments[:, way, i],
                )
                for i in range(len(self._entries))
            ]  # fmt: skip
            modes = modes_under(run, step, theta, felt, starts, bends)
            out.append(RailAt(modes, force[:, way], rate[:, way], bend[:, way]))
        return out
