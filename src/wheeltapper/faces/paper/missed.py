"""Claims on short losses of contact, which integrators with a fixed step miss."""

from __future__ import annotations

from collections.abc import Iterator

import wheeltapper as wt
from wheeltapper.faces.paper import naive
from wheeltapper.faces.paper.claims import Measure, claim, count, relative
from wheeltapper.faces.paper.setting import HERTZ, losses, sine, step

RUNGE_KUTTA = {1e-3: 1, 5e-4: 7, 2e-4: 27, 1e-4: 35, 5e-5: 36}
"""Step in s, and how many of the 36 losses the classical Runge-Kutta method finds with it."""
BACKWARD_EULER = {2e-4: 0, 1e-4: 1, 5e-5: 3, 1e-5: 10}
"""Step in s, and how many of the 36 losses the backward Euler method finds with it."""


def benchmark() -> wt.Record:
    """Simulate the corrugation at 36 m/s with set `hertz`: dozens of losses of 0.04 to 0.24 ms."""
    return sine(-50e-6, 8e3, 36.0, 0.2, **HERTZ)


@claim("C12", "missed", "the system is sensitive to errors of the events' times")
def naive_integrators() -> Iterator[Measure]:
    """Measure how many losses integrators without event location find."""
    record = benchmark()
    yield count("losses, exactly", losses(record), 36, 1)
    for size, expected in RUNGE_KUTTA.items():
        found = naive.losses(naive.runge_kutta(record, size))
        yield count(f"losses that Runge-Kutta 4 finds, h = {size:g} s", found, expected, 1)
    for size, expected in BACKWARD_EULER.items():
        found = naive.losses(naive.backward_euler(record, size))
        yield count(f"losses that backward Euler finds, h = {size:g} s", found, expected, 1)


@claim("C13", "missed", "short losses of contact are easily missed")
def short_losses() -> Iterator[Measure]:
    """Measure the five short losses behind a step down, and what fixed steps find of them."""
    record = step(-1e-4, 8e3, 0.2)
    events = record.events
    begins = events.time.values[events.kind.values == "loss"]
    durations = 1e3 * (record.impacts.time.values - begins)
    yield count("losses", losses(record), 5)
    yield relative("shortest loss [ms]", float(durations.min()), 0.32, 2e-2)
    yield relative("longest loss [ms]", float(durations.max()), 0.92, 1e-2)
    for size in (1e-3, 5e-4, 2e-4, 1e-4, 5e-5):
        found = naive.losses(naive.backward_euler(record, size))
        yield count(f"losses that backward Euler finds, h = {size:g} s", found, 0)
    for size, expected in ((1e-3, 0), (5e-4, 4)):
        found = naive.losses(naive.runge_kutta(record, size))
        yield count(f"losses that Runge-Kutta 4 finds, h = {size:g} s", found, expected)
