"""A plain program of a wheel on the modes of a track: Newmark's average acceleration with fixed steps.

The force in a step follows from Newton's method on one scalar equation. Where the contact closes or opens in a step,
its length is bisected until the event lies at its end; the next step goes on from there.
"""

from __future__ import annotations

import numba
import numpy as np
from numpy.typing import NDArray

from wheeltapper.march.general.march import Prepared
from wheeltapper.march.general.replay import path_heights

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
SETTLED = 1e-13
"""Length of a step, s, below which bisection stops."""


class Newmark:
    """One free wheel with Hertz's contact, prepared for some step, s."""

    def __init__(self, prepared: Prepared, step: float) -> None:
        system, start = prepared.system, prepared.start
        ring, (contact,) = system.ring, system.contacts
        assert ring is not None
        self.contact, self.speed, self.step = contact, system.speed, step
        self.ring = (
            ring.rates, ring.weights, ring.turns, ring.edges, ring.deflection, ring.drive, ring.residual, ring.spacing,
        )  # fmt: skip
        self.wheel = float(system.bodies.mass[0, 0]), float(system.bodies.load[0]), contact.law.numbers[0]
        self.modes, self.offset = start.modes, float(start.offsets[0])
        self.fine = 0.125 * step * system.speed

    def __call__(self, duration: float) -> FloatArray:
        """March from rest, and return the times of losses and impacts, s."""
        x = np.arange(0.0, duration * self.speed + 4.0 * self.fine, self.fine)
        heights = path_heights(self.contact, x)
        return np.asarray(
            newmark(
                *self.ring,
                *self.wheel,
                self.modes.copy(),
                self.offset,
                heights,
                self.fine,
                self.speed,
                self.step,
                duration,
            )
        )


@numba.njit(cache=False, fastmath=True, error_model="numpy")
def newmark(
    rates: ComplexArray, weights: FloatArray, turns: ComplexArray, edges: FloatArray, deflection: ComplexArray,
    drive: ComplexArray, residual: FloatArray, spacing: float, mass: float, load: float, constant: float,
    modes: ComplexArray, offset: float, heights: FloatArray, fine: float, speed: float, step: float, duration: float,
) -> list[float]:  # fmt: skip
    """March; heights of the path are given at every `fine` m, finer than the steps, and linear in between."""
    count = len(rates)
    shows, takes = np.empty(count, np.complex128), np.empty(count, np.complex128)
    before, trial = np.zeros(count, np.complex128), np.empty(count, np.complex128)
    events = [0.0][:0]
    t, y, v, N, bay = 0.0, 0.0, 0.0, load, 0
    closed, first = True, True
    length = step
    while t < duration:
        x = speed * (t + length)
        next_bay = int(x / spacing + 1e-12)
        inside = x - next_bay * spacing
        element = min(np.searchsorted(edges, inside, side="right") - 1, len(edges) - 2)
        zeta = (2.0 * inside - edges[element] - edges[element + 1]) / (edges[element + 1] - edges[element])
        if first:
            _shapes(drive, 0, -1.0, before)
        _shapes(deflection, element, zeta, shows)
        _shapes(drive, element, zeta, takes)
        local = 0.0
        for k in range(residual.shape[1] - 1, -1, -1):
            local = local * zeta + residual[element, k]
        gap = 0.0
        answer = local + 0.25 * length * length / mass
        for n in range(count):
            over = 1.0 / (1.0 - 0.5 * length * rates[n])
            now = ((1.0 + 0.5 * length * rates[n]) * modes[n] + 0.5 * length * N * before[n]) * over
            if next_bay != bay:
                now *= turns[n]
            trial[n] = now
            gap -= weights[n] * (shows[n] * now).real
            answer += weights[n] * 0.5 * length * (shows[n] * takes[n] * over).real
        place = x / fine
        cell = int(place)
        gap += heights[cell] + (place - cell) * (heights[cell + 1] - heights[cell])
        gap += offset + y + length * v + 0.25 * length * length * ((load - N) + load) / mass
        delta = max(gap, 0.0)
        if closed and gap > 0.0:
            for _ in range(50):
                root = np.sqrt(delta)
                change = (delta + answer * constant * delta * root - gap) / (1.0 + 1.5 * answer * constant * root)
                delta = max(delta - change, 0.0)
                if abs(change) < 1e-18:
                    break
        if closed == (gap <= 0.0) and length > SETTLED:  # an event lies in this step: half of it
            length *= 0.5
            continue
        new = constant * delta**1.5 if closed else 0.0
        acceleration = (load - N) / mass
        later = (load - new) / mass
        y += length * v + 0.25 * length * length * (acceleration + later)
        v += 0.5 * length * (acceleration + later)
        for n in range(count):
            modes[n] = trial[n] + 0.5 * length * new * takes[n] / (1.0 - 0.5 * length * rates[n])
            before[n] = takes[n]
        t += length
        N, bay, first = new, next_bay, False
        if closed == (gap <= 0.0):
            events.append(t)
            closed = not closed
            N = 0.0
            length = step
        elif length < step:  # bisection goes on behind the part that is done
            length = max(0.5 * length, SETTLED)
    return events


@numba.njit(cache=False, fastmath=True)
def _shapes(table: ComplexArray, element: int, zeta: float, out: ComplexArray) -> None:
    """Write polynomials of one element at a place."""
    degree = table.shape[1] - 1
    for n in range(len(out)):
        total = table[element, degree, n]
        for k in range(degree - 1, -1, -1):
            total = total * zeta + table[element, k, n]
        out[n] = total
