"""Pictures of faults, of what is believed of their sizes, and of wheelsets that pass together."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from wheeltapper.ask.study import field_unit
from wheeltapper.describe.paths import held_at
from wheeltapper.describe.scenario import Scenario
from wheeltapper.diagnosis.faults.base import PLAIN, Fault, fault_named
from wheeltapper.diagnosis.inference.problem import Prior
from wheeltapper.diagnosis.site.neighbours import Condition, Neighbour, ends_of
from wheeltapper.faces.panels import BLUE, COLOURS, RED, in_unit, legend_above, panels, with_unit, words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from wheeltapper.record.record import Record

FloatArray = NDArray[np.float64]
POINTS, SAMPLES = 401, 4000
"""Points of a density, and uniform samples of a force."""
FAR = 4.0
"""How far from the centre a density is drawn, standard deviations."""
INTERVAL = 1.645
"""Half of the central 90 % of a normal distribution, standard deviations."""
LINE = 125
"""Letters of a line of a title."""
RADIUS = 0.46
"""Radius of a drawn wheelset, m."""


# -- faults -----------------------------------------------------------------------------------------------------------


@cache
def reference_passage() -> Scenario:
    """Return the healthy passage in which a fault is shown: a wheelset over a bump of 0.2 mm on a deck."""
    return Scenario.of(
        {
            "vehicle": {
                "type": "Wheelset", "mass": 1500.0, "load": 91307.0, "stiffness": 2.44e6, "damping": 5e4,
                "radius": RADIUS,
            },
            "track": {"type": "FloatingDeck", "mass": 15e3, "stiffness": 1.5e7, "damping": 5e4},
            "contact": {"type": "Hertz", "constant": 1.405e11},
            "irregularity": [{"type": "CosineBump", "height": 2e-4, "length": 0.05, "start": 0.009}],
            "speed": 9.0, "duration": 0.4,
        }
    )  # fmt: skip


def draw_fault(fault: Fault) -> Figure:
    """Draw the contact force with and without a fault of its usual size, and what is believed of what it changes."""
    from matplotlib.figure import Figure

    from wheeltapper.record.simulate import simulated_scenario

    healthy = reference_passage()
    faulty = fault.passage(healthy)
    believed = fault.believed(healthy)
    figure = Figure(figsize=(10.0, 6.8 if believed else 4.0))
    grid = figure.add_gridspec(
        2 if believed else 1, max(1, len(believed)), height_ratios=(1.3, 1.0)[: 1 + bool(believed)]
    )
    force = figure.add_subplot(grid[0, :])
    for passage, label, colour in ((healthy, "healthy", BLUE), (faulty, fault.name, RED)):
        times, values = _force_of(simulated_scenario(passage, "default", lambda notes: None))
        force.plot(1e3 * times, values / 1e3, color=colour, linewidth=0.9, label=label)
    force.set(xlabel="time [ms]", ylabel="contact force [kN]")
    force.set_title("a wheelset over a bump of 0.2 mm on a deck, at 9 m/s")
    legend_above(force, 2)
    for number, (path, prior) in enumerate(believed.items()):
        axis = figure.add_subplot(grid[1, number])
        _draw_density(axis, prior, *_name_unit_factor(fault, faulty, path))
        axis.set_title(_prior_words(prior))
    size = f"{fault.size} {_number(fault.usual)} {fault.unit}".rstrip()
    title = fill(f"{fault.name} ({fault.part}): {fault.meaning.rstrip('.')}; here: {size}", LINE)
    figure.suptitle(title, x=0.02, ha="left", fontsize=9)
    return figure


def _force_of(record: Record) -> tuple[FloatArray, FloatArray]:
    """Return the contact force at uniform times, with every event and maximum between them."""
    times = np.unique(
        np.concatenate([np.linspace(0.0, record.end, SAMPLES), record._events["time"], record._peaks["time"]])
    )
    return times, np.asarray(record.at(times).normal_force.values)


def _name_unit_factor(fault: Fault, faulty: Scenario, path: str) -> tuple[str, str, float]:
    """Return how a field is printed: its name, its unit, and the factor from SI to that unit."""
    known = {**PLAIN, **fault.fields}.get(path)
    if known is not None:
        return known
    holder, name, _ = held_at(faulty, path)
    return words(path), field_unit(type(holder), name), 1.0


def _number(value: float) -> str:
    return f"{value:.4g}"


# -- priors -----------------------------------------------------------------------------------------------------------


def draw_prior(prior: Prior) -> Figure:
    """Draw the density of a prior over the values of its field, with the central 90 %."""
    figure, (axis,) = panels(1, 3.6)
    _draw_density(axis, prior, "value", "unit of the field", 1.0)
    legend_above(axis)
    figure.suptitle(f"prior of a field: {_prior_words(prior)}", x=0.02, ha="left")
    return figure


def _prior_words(prior: Prior) -> str:
    centre, deviation = _number(prior.centre), _number(prior.deviation)
    if prior.kind == "flat":
        return "positive, and nothing else is known"
    if prior.is_flat:
        return "nothing is known"
    return {
        "normal": f"normal about {centre} with a deviation of {_number(100.0 * prior.deviation)} %",
        "lognormal": f"lognormal about {centre}, deviation of the logarithm {deviation}",
        "uniform": f"uniform between {_number(prior.centre - prior.deviation)} and "
        f"{_number(prior.centre + prior.deviation)}",
        "shift": f"normal about {centre} with a deviation of {deviation}",
    }[prior.kind]


def _draw_density(axis: Axes, prior: Prior, name: str, unit: str, factor: float) -> None:
    """Draw a density over its largest value; that of a lognormal prior is one of the logarithm, and its axis is so."""
    scale = abs(prior.centre) or 1.0
    from_centre = np.linspace(-FAR, FAR, POINTS)
    if prior.is_flat:
        values = prior.centre + scale * np.linspace(-1.0 if prior.kind == "flat" else -2.0, 2.0, POINTS)
        density, inside = np.ones(POINTS), np.zeros(POINTS, dtype=bool)
    elif prior.kind == "uniform":
        values = prior.centre + prior.deviation * np.linspace(-1.4, 1.4, POINTS)
        density = (np.abs(values - prior.centre) <= prior.deviation).astype(float)
        inside = np.abs(values - prior.centre) <= 0.9 * prior.deviation
    else:
        density, inside = np.exp(-0.5 * from_centre**2), np.abs(from_centre) <= INTERVAL
        width = prior.deviation * (scale if prior.kind == "normal" else 1.0)
        values = prior.centre + width * from_centre
        if prior.kind == "lognormal":
            values = prior.centre * np.exp(prior.deviation * from_centre)
            axis.set_xscale("log")
    if factor == 1.0 and unit:
        factor, unit = in_unit(prior.centre, unit)
    axis.plot(factor * values, density, color=BLUE, label="density")
    axis.fill_between(factor * values, density, where=inside, color=BLUE, alpha=0.2, linewidth=0, label="central 90 %")
    axis.axvline(factor * prior.centre, color=RED, linewidth=0.9, linestyle="--", label="centre")
    of = "density of the logarithm" if prior.kind == "lognormal" else "density"
    axis.set(xlabel=with_unit(name, unit or "ratio"), ylabel=f"{of} over its largest", ylim=(0.0, 1.1))


# -- wheelsets that pass together -------------------------------------------------------------------------------------


def draw_condition(condition: Condition) -> Figure:
    """Draw a wheelset with its fault in words."""
    return _draw_row([(0.0, _condition_words(condition))], f"a wheelset: {_condition_words(condition)}")


def draw_neighbour(neighbour: Neighbour) -> Figure:
    """Draw where a neighbour runs beside the wheelset of interest."""
    return draw_neighbours([neighbour])


def draw_neighbours(neighbours: Sequence[Neighbour]) -> Figure:
    """Draw where several neighbours run beside the wheelset of interest."""
    row = [(0.0, "wheelset of interest"), *((float(one.spacing), _condition_words(one)) for one in neighbours)]
    where = [
        f"{_number(abs(float(one.spacing)))} m {'ahead' if one.spacing > 0.0 else 'behind'} ({_condition_words(one)})"
        for one in neighbours
    ]
    return _draw_row(row, f"{len(where)} neighbour{'s' * (len(where) > 1)}: {', '.join(where)}")


def _condition_words(condition: Condition) -> str:
    if condition.fault is None:
        return condition.label
    fault = fault_named(condition.fault)
    low, high = ends_of(fault.usual if condition.size is None else condition.size)
    size = _number(low) if low == high else f"{_number(low)} to {_number(high)}"
    named = "" if condition.name in (None, condition.fault) else f"{condition.name}: "
    return f"{named}{fault.name}, {fault.size} {size} {fault.unit}".rstrip()


def _draw_row(row: Sequence[tuple[float, str]], title: str) -> Figure:
    """Draw wheelsets on a rail, each with words above it; the first one is that of interest."""
    figure, (axis,) = panels(1, 3.2, 9.0)
    turn = np.linspace(0.0, 2.0 * np.pi, 121)
    for number, (x, said) in enumerate(row):
        colour = RED if number == 0 else COLOURS[0]
        axis.plot(x + RADIUS * np.cos(turn), RADIUS * (1.0 + np.sin(turn)), color=colour, linewidth=1.6)
        axis.annotate(
            fill(said, 22), (x, 2.0 * RADIUS), (0, 4 + 26 * (number % 2)), textcoords="offset points", ha="center",
            va="bottom", fontsize=8, color=colour,
        )  # fmt: skip
    places: Any = [x for x, _ in row]
    room = max(1.5, 0.1 * (max(places) - min(places)))
    low, high = min(places) - room, max(places) + room
    axis.plot([low, high], [0.0, 0.0], color="0.4", linewidth=2.5)
    axis.set(
        xlabel="position ahead of the wheelset of interest [m]", ylabel="height [m]", xlim=(low, high),
        ylim=(-0.2, 2.6), aspect="equal" if high - low < 12.0 else "auto",
    )  # fmt: skip
    figure.suptitle(fill(title, LINE), x=0.02, ha="left", fontsize=9)
    return figure
