"""Claims on short losses of contact, which integrators with a fixed step miss."""

from __future__ import annotations

from collections.abc import Iterator

import wheeltapper as wt
from wheeltapper.faces.paper import naive
from wheeltapper.faces.paper.claims import PINNED, Measure, claim, program, said
from wheeltapper.faces.paper.setting import HERTZ, losses, sine, step

RUNGE_KUTTA = {1e-3: 1, 5e-4: 7, 2e-4: 26, 1e-4: 34, 5e-5: 37}
"""Step in s, and how many of the 37 losses the classical Runge-Kutta method finds with it."""
BACKWARD_EULER = {2e-4: 0, 1e-4: 1, 5e-5: 3, 1e-5: 10}
"""Step in s, and how many of the 37 losses the backward Euler method finds with it."""
FINE = 5e-6
"""Step in s with which the classical Runge-Kutta method finds every loss of the benchmarks."""
WITHOUT_EVENTS = program(f"Runge-Kutta 4 without events, step {FINE:g} s, on the same path of the wheel")
GRAZING = "rounding decides whether a step ends within a loss as short as itself"


def corrugation_benchmark() -> wt.Record:
    """Simulate the corrugation at 36 m/s with set `hertz`: dozens of losses of 0.04 to 0.24 ms."""
    return sine(-50e-6, 8e3, 36.0, 0.2, **HERTZ)


@claim("C12", "missed", "the system is sensitive to errors of the events' times")
def naive_integrators() -> Iterator[Measure]:
    """Measure how many losses integrators without event location find."""
    record = corrugation_benchmark()
    exact = losses(record)
    yield WITHOUT_EVENTS.count("losses", exact, naive.losses(naive.runge_kutta(record, FINE)))
    for size, expected in RUNGE_KUTTA.items():
        found = naive.losses(naive.runge_kutta(record, size))
        yield PINNED.count(f"losses that Runge-Kutta 4 finds, h = {size:g} s", found, expected, 1, GRAZING)
    for size, expected in BACKWARD_EULER.items():
        found = naive.losses(naive.backward_euler(record, size))
        yield PINNED.count(f"losses that backward Euler finds, h = {size:g} s", found, expected, 1, GRAZING)
        yield said(
            "sensitive",
            "section 2",
            f"part of all losses that backward Euler misses, h = {size:g} s",
            1.0 - found / exact,
        )


@claim("C13", "missed", "short losses of contact are easily missed")
def short_losses() -> Iterator[Measure]:
    """Measure the five short losses behind a step down, and what fixed steps find of them."""
    record = step(-1e-4, 8e3, 0.2)
    events = record.events
    begins = events.time.values[events.kind.values == "loss"]
    durations = 1e3 * (record.impacts.time.values - begins)
    exact = losses(record)
    yield WITHOUT_EVENTS.count("losses", exact, naive.losses(naive.runge_kutta(record, FINE)))
    yield PINNED.relative("shortest loss [ms]", float(durations.min()), 0.319062)
    yield PINNED.relative("longest loss [ms]", float(durations.max()), 0.916545)
    for size in (1e-3, 5e-4, 2e-4, 1e-4, 5e-5):
        found = naive.losses(naive.backward_euler(record, size))
        part = f"part of the losses that backward Euler finds, h = {size:g} s"
        yield said("practically none", "section 4: easy to overlook", part, found / exact)
    for size, expected in ((1e-3, 0), (5e-4, 4)):
        found = naive.losses(naive.runge_kutta(record, size))
        yield PINNED.count(f"losses that Runge-Kutta 4 finds, h = {size:g} s", found, expected)
