"""Integrators with a fixed step and without events; that they miss losses of contact is a claim of the paper.

They march m·y'' = -(P + m·g) - k·y - c·y' + C·max(y_k - y, 0)^1.5 over the exact path y_k of a record, and count a
loss of contact wherever a step ends out of contact and began in it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import wheeltapper as wt
from wheeltapper.describe.vehicle.wheelset import Wheelset

FloatArray = NDArray[np.float64]


def _path_at_steps(record: wt.Record, step: float, n: int) -> FloatArray:
    times = np.arange(n + 1) * step
    return np.asarray(record.at(np.minimum(times, record.end)).constraint.values)


def _acceleration_function(record: wt.Record) -> Callable[[float, float, float], float]:
    """Return y''(path, y, v)."""
    vehicle = record.scenario.vehicle
    assert isinstance(vehicle, Wheelset)
    m, k, c, constant = vehicle.mass, vehicle.stiffness, vehicle.damping, record.contact_constant
    weight = vehicle.load + m * vehicle.gravity

    def acceleration(path: float, y: float, v: float) -> float:
        return float((-weight - k * y - c * v + constant * max(path - y, 0.0) ** 1.5) / m)

    return acceleration


def runge_kutta(record: wt.Record, step: float) -> FloatArray:
    """Return the indentation y_k - y at the steps' ends, by the classical method of order 4."""
    a = _acceleration_function(record)
    n = round(record.end / step)
    path = _path_at_steps(record, 0.5 * step, 2 * n)
    y, v = _start_state(record)
    out = [path[0] - y]
    for i in range(n):
        p0, p1, p2 = path[2 * i : 2 * i + 3]
        v1, a1 = v, a(p0, y, v)
        v2, a2 = v + 0.5 * step * a1, a(p1, y + 0.5 * step * v1, v + 0.5 * step * a1)
        v3, a3 = v + 0.5 * step * a2, a(p1, y + 0.5 * step * v2, v + 0.5 * step * a2)
        v4, a4 = v + step * a3, a(p2, y + step * v3, v + step * a3)
        y += step / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4)
        v += step / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        out.append(p2 - y)
    return np.array(out)


def backward_euler(record: wt.Record, step: float) -> FloatArray:
    """Return the indentation at the steps' ends, by the implicit method of order 1."""
    a = _acceleration_function(record)
    vehicle: Any = record.scenario.vehicle
    stiffness, damping = vehicle.stiffness / vehicle.mass, vehicle.damping / vehicle.mass
    hardening = 1.5 * record.contact_constant / vehicle.mass
    n = round(record.end / step)
    path = _path_at_steps(record, step, n)
    y, v = _start_state(record)
    out = [path[0] - y]
    for p in path[1:]:
        new = v
        for _ in range(50):
            place = y + step * new
            gap = new - v - step * a(p, place, new)
            slope = 1.0 + step * (damping + step * (stiffness + hardening * max(p - place, 0.0) ** 0.5))
            new -= gap / slope
            if abs(gap) < 1e-13:
                break
        v = new
        y += step * v
        out.append(p - y)
    return np.array(out)


def _start_state(record: wt.Record) -> tuple[float, float]:
    first = record.at(0.0)
    return float(first.wheel_displacement[0]), float(first.wheel_velocity[0])


def losses(indentation: FloatArray) -> int:
    """Return the number of losses of contact that the ends of the steps show."""
    touching = indentation > 0.0
    return int(np.sum(touching[:-1] & ~touching[1:]))
