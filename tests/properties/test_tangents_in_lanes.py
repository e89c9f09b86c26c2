"""Gradients of cells in lanes against those of the same cells alone, whose steps are differentiated one by one."""

import numpy as np
import pytest

import wheeltapper as wt
from tests.properties.test_lanes import CASES, PERIODIC
from wheeltapper.lower.fields import Fields
from wheeltapper.lower.many import LoweredCells
from wheeltapper.march.common import program as contract
from wheeltapper.march.common.program import Program
from wheeltapper.march.steps.layout import TURNED_ROWS
from wheeltapper.march.steps.tangent_path import LANES
from wheeltapper.march.steps.written import scratch_of_cells
from wheeltapper.march.wheel import gradients
from wheeltapper.march.wheel.single import march
from wheeltapper.march.wheel.tangent import Changes, Made, Rates, tangent_kernel

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
SHAPES = {"CosineBump": "length", "Corrugation": "wavelength", "Step": "position"}
SCENES = {
    **{name: scene for name, scene in CASES.items() if not scene.vehicle.damper_end},
    "without end, rolling circle": PERIODIC["rolling circle"],
    "without end, deck": PERIODIC["deck"],
    "without end, hysteresis": PERIODIC["hysteresis"],
}


def turned_cells(scene, method="default", count=5, **last):
    """Cells of a scene, with changes by the vehicle, the speed, the irregularity and the deck."""
    draw = np.random.default_rng(2)
    changed = {
        "vehicle.mass": draw.uniform(900, 2000, count),
        "vehicle.damping": draw.uniform(1e4, 1.2e5, count),
        "speed": draw.uniform(3, 20, count),
    }
    fixed = [f"irregularity.0.{SHAPES[type(scene.irregularities[0]).__name__]}"]
    fixed += ["track.mass", "track.stiffness"] if hasattr(scene.track, "mass") else []
    fixed += ["contact.hysteresis"] if getattr(scene.contact, "hysteresis", None) else []
    parameters = [*changed, *fixed][: gradients.PARAMETERS]
    many = LoweredCells(scene, changed | {path: np.full(count, Fields(scene)(path)) for path in parameters[3:]}, method)
    for column, value in last.items():
        many.cells.numbers[:, getattr(contract, column)] = value
    return many.turned([many.direction_along(path) for path in parameters])


def alone(cells, turns, cell):
    """The same of one cell: events, peaks, derivatives of both, and the smallest distance to grazing."""
    first = cells.first[cell]
    pieces = cells.pieces[first : first + cells.many[cell]]
    found = march(Program(pieces, cells.numbers[cell]))
    of_events, of_peaks = (np.zeros((len(table), 2, LANES)) for table in (found.events, found.peaks))
    start = np.zeros((2, LANES))
    start[0, gradients.BY_HEIGHT] = start[1, gradients.BY_VELOCITY] = 1.0
    made = Made(pieces, cells.numbers[cell], found.steps, found.state, found.events, found.peaks)
    along = Changes(turns.numbers[cell], start, turns.bends, first, turns.table)
    rates = Rates(of_events, of_peaks, np.zeros((4, LANES)), np.zeros(LANES), np.zeros((0, LANES)))
    no_times, no_samples = np.zeros(0), np.zeros((0, gradients.QUANTITIES, gradients.SAMPLED))
    S = scratch_of_cells(cells.numbers, cells.pieces, turned=True, lossy=True)
    gentlest = tangent_kernel(made, along, rates, 0.0, no_times, no_samples, S, np.zeros((TURNED_ROWS, LANES)), None)
    return found, of_events, of_peaks, gentlest


def rows_of(ends, cell):
    return slice(ends[cell - 1] if cell else 0, ends[cell])


def assert_close(ours, theirs):
    """Derivatives of one kind along one direction are equal to 1e-9 of the largest one.

    A force does not change with the place of a step, but is computed from times that do: this leaves rounding.
    """
    assert ours.shape == theirs.shape
    np.testing.assert_array_equal(np.isnan(ours), np.isnan(theirs))
    size = np.nanmax(np.abs(theirs), axis=0, initial=0.0)
    rounding = 1e-13 * size.max(axis=0, initial=0.0)
    assert np.all(np.nan_to_num(np.abs(ours - theirs)) <= 1e-9 * size + rounding)


def assert_gradients_of_single_cells(cells, turns):
    marched, tangents = gradients.march_block(cells, turns)
    for cell in range(len(cells.first)):
        found, of_events, of_peaks, gentlest = alone(cells, turns, cell)
        events, peaks = rows_of(marched.event_ends, cell), rows_of(marched.peak_ends, cell)
        assert len(found.events) + len(found.peaks) > 2
        np.testing.assert_allclose(marched.events[events], found.events, rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(marched.peaks[peaks], found.peaks, rtol=1e-11, atol=1e-11)
        assert_close(tangents.events[events], of_events)
        assert_close(tangents.peaks[peaks], of_peaks)
        assert tangents.gentlest[cell] == pytest.approx(gentlest, rel=1e-9)


# Over a corrugation motions are chaotic: what is left of a digit after some impacts is not compared.
@pytest.mark.few(10)
@pytest.mark.parametrize("name", SCENES)
def test_gradients_in_lanes_are_those_of_single_cells(name):
    chaotic = "corrugation" in name or "without end" in name
    assert_gradients_of_single_cells(*turned_cells(SCENES[name], **({"LAST_IMPACT": 3} if chaotic else {})))


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["bump", "default", "deck", "everything"])
def test_strict_gradients_in_lanes_are_those_of_single_cells(name):
    assert_gradients_of_single_cells(*turned_cells(SCENES[name], "strict"))


@pytest.mark.parametrize("tally", [False, True])
@pytest.mark.parametrize("name", ["default", "corrugation under a rolling circle", "everything"])
def test_gradients_do_not_depend_on_company(name, tally):
    cells, turns = turned_cells(SCENES[name], count=11)
    marched, tangents = gradients.march_block(cells, turns, tally)
    for cell in (0, 6, 10):
        one = slice(cell, cell + 1)
        some = gradients.CellTangents(turns.numbers[one], turns.bends, turns.table)
        _, own = gradients.march_block(cells.part(one), some, tally)
        np.testing.assert_array_equal(tangents.events[rows_of(marched.event_ends, cell)], own.events)
        np.testing.assert_array_equal(tangents.peaks[rows_of(marched.peak_ends, cell)], own.peaks)
        np.testing.assert_array_equal(tangents.amplification[one], own.amplification)
        if tally:
            np.testing.assert_array_equal(tangents.highest[one], own.highest)


def all_gradients(cells, turns, threads):
    """Everything that a march of all cells tells, by the first cell of a block."""
    found = {}

    def keep(block, marched, tangents):
        ends = marched.event_ends, marched.peak_ends
        for cell in range(block.start, block.stop):
            events, peaks = (rows_of(rows, cell - block.start) for rows in ends)
            found[cell] = np.concatenate([tangents.events[events].ravel(), tangents.peaks[peaks].ravel()])

    gradients.march_all(cells, turns, threads, keep)
    return np.concatenate([found[cell] for cell in range(len(cells.first))])


def test_neither_threads_nor_memory_change_a_bit_of_the_gradients(monkeypatch):
    cells, turns = turned_cells(SCENES["default"], count=2 * gradients.GRADIENT_BLOCK + 7)
    one, three = (all_gradients(cells, turns, threads) for threads in (1, 3))
    np.testing.assert_array_equal(one, three)
    monkeypatch.setattr(gradients, "MOST_STEPS", 2000)
    assert gradients.march_block(cells, turns) is None
    np.testing.assert_array_equal(one, all_gradients(cells, turns, 2))


def test_a_cell_that_waits_in_vain_has_the_gradients_of_what_it_has_seen():
    cells, turns = turned_cells(SCENES["bump"], count=13, LAST_IMPACT=9)
    marched, tangents = gradients.march_block(cells, turns)
    waiting = 0
    for cell in range(len(cells.first)):
        found, of_events, of_peaks, _ = alone(cells, turns, cell)
        events, peaks = rows_of(marched.event_ends, cell), rows_of(marched.peak_ends, cell)
        waiting += peaks.stop - peaks.start < len(found.peaks)
        assert_close(tangents.events[events], of_events)
        assert_close(tangents.peaks[peaks], of_peaks[: peaks.stop - peaks.start])
    assert 1 < waiting < 12


UNDAMPED = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=95285, stiffness=2.4e6),
    contact=wt.Hertz(constant=1.9e11, hysteresis=0.0),
    irregularity=wt.CosineBump(height=0.5e-3, length=50e-3, start=0.01),
    rolling="point",
    speed=5,
    duration=0.05,
)
UNDAMPED_DECK = UNDAMPED.replaced({"track": wt.FloatingDeck(mass=15_000, stiffness=1.5e7)})


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "path", "step"),
    [
        (UNDAMPED, "contact.hysteresis", 1e-3), (UNDAMPED, "vehicle.damping", 20.0),
        (UNDAMPED_DECK, "contact.hysteresis", 1e-3), (UNDAMPED_DECK, "track.damping", 50.0),
    ],
    ids=["hysteresis", "damping", "hysteresis on a deck", "damping of a deck"],
)  # fmt: skip
def test_a_derivative_by_what_is_zero_is_that_of_what_is_not(scene, path, step):
    """Without the term another function makes the steps; what is differentiated counts as there."""
    force = wt.features.largest_force()
    values = wt.sweep(scene, {path: step * np.arange(5)}, [force], method="strict")[force.name].values
    found = wt.sweep(scene, {path: [0.0]}, [force], gradient=True, method="strict")[f"{force.name}_gradient"].values
    one_sided = values @ np.array([-25.0, 48.0, -36.0, 16.0, -3.0]) / (12.0 * step)
    assert found.ravel()[0] == pytest.approx(one_sided, rel=1e-8)
