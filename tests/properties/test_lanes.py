"""Cells in lockstep against the same cells one after the other: equal events, equal numbers, whatever the company."""

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.lower.many import LoweredCells
from wheeltapper.march.common import program as contract
from wheeltapper.march.wheel.apart import motions_kernel, start_lanes
from wheeltapper.march.wheel.ensemble import AT_THEIR_STARTS, end_motions, march_in_lanes, march_one_by_one
from wheeltapper.march.wheel.lanes import lanes_kernel
from wheeltapper.march.wheel.pool import VISITS, pool_of
from wheeltapper.march.wheel.single import march

BUMP = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4), contact=wt.Hertz(constant=1.405e11),
    rolling="point", speed=9, duration=0.25, irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.009),
)  # fmt: skip
CORRUGATION = BUMP.replaced({
    "irregularity": wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=0.01), "duration": 0.4,
})  # fmt: skip
CASES = {
    "bump": BUMP,
    "bump under a rolling circle": BUMP.replaced({"rolling": "circle"}),
    "corrugation from x = 0.01 m": CORRUGATION,
    "corrugation without end": CORRUGATION.replaced({
        "irregularity": wt.Corrugation(amplitude=-5e-5, wavelength=0.05, start=-1.0)
    }),
    "corrugation under a rolling circle": CORRUGATION.replaced({"rolling": "circle", "duration": 0.1}),
    "dip that is hardly felt": BUMP.replaced({"irregularity.0.height": -2e-5}),
    "ideal step up": BUMP.replaced({"irregularity": wt.Step(height=1e-4, position=0.1, ideal=True)}),
    "ideal step down": BUMP.replaced({"irregularity": wt.Step(height=-1e-4, position=0.1, ideal=True)}),
    "step down": BUMP.replaced({"irregularity": wt.Step(height=-1e-4, position=0.1), "rolling": "circle"}),
    "two irregularities": BUMP.replaced({
        "irregularity": [
            wt.CosineBump(height=2e-4, length=0.05, start=0.009), wt.Step(height=1e-4, position=0.07, ideal=True),
        ],
    }),
    "start in flight": BUMP.replaced({"start": {"displacement": 2e-4, "velocity": 0.0}}),
    "default": BUMP.replaced({"rolling": "circle", "contact": wt.Hertz()}),
    "default on a corrugation": CORRUGATION.replaced({"rolling": "circle", "contact": wt.Hertz(), "duration": 0.1}),
    "stiff suspension": BUMP.replaced({"vehicle.stiffness": 2e9}),
    "linear contact": BUMP.replaced({"contact": wt.Linear(stiffness=1e9)}),
    "deck": BUMP.replaced({"track": wt.FloatingDeck(mass=15000, stiffness=1.5e7, damping=5e4)}),
    "short deck": BUMP.replaced({
        "track": wt.FloatingDeck(mass=3000, stiffness=1e8, damping=5e4, start=0.02, length=0.3), "rolling": "circle",
        "contact": wt.Hertz(),
    }),
    "deck under a corrugation": CORRUGATION.replaced({
        "track": wt.FloatingDeck(mass=15000, stiffness=1.5e7, damping=5e4)
    }),
    "everything": BUMP.replaced({
        "track": wt.FloatingDeck(mass=3000, stiffness=1e8, damping=5e4), "rolling": "circle",
        "contact": wt.Hertz(hysteresis=0.2),
    }),
    "hysteresis": BUMP.replaced({"contact": wt.Hertz(constant=1.405e11, hysteresis=0.1)}),
    "bilateral": BUMP.replaced({"contact": wt.Linear(stiffness=1e9, bilateral=True)}),
    "bush": BUMP.replaced({"vehicle.bush_stiffness": 1e7}),
    "bush on a corrugation": CORRUGATION.replaced({"vehicle.bush_stiffness": 3e7}),
    "bush, start in flight": BUMP.replaced({
        "vehicle.bush_stiffness": 1e7, "start": {"displacement": 2e-4, "velocity": 0.1}
    }),
    "bush and everything": BUMP.replaced({
        "track": wt.FloatingDeck(mass=3000, stiffness=1e8, damping=5e4, start=0.02, length=0.3), "rolling": "circle",
        "contact": wt.Hertz(hysteresis=0.2), "vehicle.bush_stiffness": 1e7,
    }),
    "play": BUMP.replaced({"vehicle.damper_play": 2e-5}),
    "play and bush on a deck": BUMP.replaced({
        "vehicle.damper_play": 2e-5, "vehicle.bush_stiffness": 1e7,
        "track": wt.FloatingDeck(mass=15000, stiffness=1.5e7, damping=5e4),
    }),
}  # fmt: skip


def cells(scene, count=37, seed=1, **last):
    draw = np.random.default_rng(seed)
    changed = {
        "vehicle.mass": draw.uniform(900, 2000, count),
        "vehicle.damping": draw.uniform(1e4, 1.2e5, count),
        "speed": draw.uniform(3, 20, count),
    }
    made = LoweredCells(scene, changed).cells
    for column, value in last.items():
        made.numbers[:, getattr(contract, column)] = value
    return made


def assert_same(lanes, apart):
    np.testing.assert_array_equal(lanes.status, apart.status)
    np.testing.assert_array_equal(lanes.airborne, apart.airborne)
    for ours, theirs, ours_ends, their_ends in (
        (lanes.events, apart.events, lanes.event_ends, apart.event_ends),
        (lanes.peaks, apart.peaks, lanes.peak_ends, apart.peak_ends),
    ):
        np.testing.assert_array_equal(ours_ends, their_ends)
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("name", CASES)
def test_lanes_find_what_single_cells_find(name):
    # Bouncing over a corrugation is chaotic: a difference grows 2.2 times from event to event, from 3e-15 at the first
    # to 3e-10 at the eighth impact.
    made = cells(CASES[name], **({"LAST_IMPACT": 8} if "corrugation" in name else {}))
    assert_same(march_in_lanes(made), march_one_by_one(made))


@pytest.mark.parametrize("last", [{"LAST_IMPACT": 3}, {"LAST_LOSS": 2}, {"EVENT_LIMIT": 5}])
@pytest.mark.parametrize("name", ["bump", "corrugation without end", "step down"])
def test_lanes_stop_where_single_cells_stop(name, last):
    made = cells(CASES[name], **last)
    ours, theirs = march_in_lanes(made), march_one_by_one(made)
    assert (ours.status == (contract.TOO_MANY_EVENTS if "EVENT_LIMIT" in last else contract.ENOUGH)).any()
    assert_same(ours, without_lower_maxima(ours, theirs))
    np.testing.assert_allclose(ours.end, theirs.end, rtol=1e-9)


def without_lower_maxima(ours, theirs):
    """Leave out what lanes leave out: the last maxima of cells that wait in vain, each lower than the one before."""
    kept = np.zeros(len(theirs.peaks), dtype=bool)
    counts = np.diff(ours.peak_ends, prepend=0)
    ends = theirs.peak_ends
    for cell, (begin, end) in enumerate(zip(ends - np.diff(ends, prepend=0), ends, strict=True)):
        kept[begin : begin + counts[cell]] = True
        if counts[cell] < end - begin:
            assert ours.status[cell] == contract.DONE
            assert counts[cell] > 0
            rest = theirs.peaks[begin + counts[cell] - 1 : end, contract.PEAK_FORCE]
            assert np.all(np.diff(rest) < 0.0)
    return theirs._replace(peaks=theirs.peaks[kept], peak_ends=ours.peak_ends)


def test_cells_that_can_never_leave_the_rail_again_end_at_once():
    made = cells(BUMP, LAST_IMPACT=9)
    ours, theirs = march_in_lanes(made), march_one_by_one(made)
    waiting = np.diff(ours.peak_ends, prepend=0) < np.diff(theirs.peak_ends, prepend=0)
    assert waiting.sum() > 5
    np.testing.assert_array_equal(ours.event_ends, theirs.event_ends)
    np.testing.assert_array_equal(ours.status, theirs.status)
    np.testing.assert_array_equal(ours.end[waiting], made.numbers[waiting, contract.END])


@pytest.mark.parametrize("name", CASES)
def test_a_cell_does_not_depend_on_its_company(name):
    made = cells(CASES[name])
    whole = march_in_lanes(made)
    for cell in (0, 17, 36):
        alone = march_in_lanes(made.part(slice(cell, cell + 1)))
        begin = whole.event_ends[cell - 1] if cell else 0
        np.testing.assert_array_equal(whole.events[begin : whole.event_ends[cell]], alone.events)
        begin = whole.peak_ends[cell - 1] if cell else 0
        np.testing.assert_array_equal(whole.peaks[begin : whole.peak_ends[cell]], alone.peaks)


def test_more_events_than_there_is_room_for_at_first():
    made = cells(CASES["corrugation without end"].replaced({"duration": 2.0}), count=3)
    lanes = march_in_lanes(made)
    assert np.diff(lanes.event_ends, prepend=0).min() > 200
    assert (np.diff(lanes.events[: lanes.event_ends[0], contract.EVENT_TIME]) > 0).all()


def test_a_motion_that_grows_beyond_all_numbers_is_said():
    made = cells(BUMP)
    made.numbers[5, contract.START_VELOCITY] = np.nan
    ours = march_in_lanes(made)
    assert ours.status[5] == contract.NOT_FINITE
    assert (np.delete(ours.status, 5) == contract.DONE).all()


@pytest.mark.parametrize(
    "name", ["bump", "bump under a rolling circle", "corrugation under a rolling circle", "default", "deck", "bush"]
)
def test_lanes_do_nearly_all_of_the_work(name):
    made = cells(CASES[name], count=64)
    pool = pool_of(*made)
    start_lanes(AT_THEIR_STARTS, pool)
    while not lanes_kernel(pool):
        pool = pool.larger()
    events, peaks, apart = pool.used[: VISITS + 1]
    assert events + peaks > 64 * 10
    assert apart < 0.05 * (events + peaks)


ROLLING = CORRUGATION.replaced({
    "irregularity": wt.Corrugation(amplitude=5e-5, wavelength=0.05, start=-1.0), "rolling": "circle",
    "contact": wt.Hertz(),
})  # fmt: skip
PERIODIC = {
    "point": CASES["corrugation without end"],
    "rolling circle": ROLLING,
    "deck": ROLLING.replaced({"track": wt.FloatingDeck(mass=15000, stiffness=1.5e7, damping=5e4)}),
    "hysteresis": ROLLING.replaced({"contact": wt.Hertz(hysteresis=0.1)}),
}


def waves(scene, many, method="default", count=37):
    """Cells of one speed that march over some waves, from different heights and velocities."""
    draw = np.random.default_rng(5)
    changed = {
        "start.displacement": draw.uniform(-4e-4, 2e-4, count),
        "start.velocity": draw.uniform(-0.2, 0.2, count),
    }
    lowered = LoweredCells(scene.replaced({"duration": 1.0}), changed, method)
    lowered.cells.numbers[:, contract.END] = many * 0.05 / scene.speed / lowered.units.time
    return lowered


def final_motions(lowered):
    """The same by single marches."""
    out = []
    for cell in range(len(lowered.cells.first)):
        program = lowered.program(cell)
        found = march(program)
        pool = pool_of(*lowered.cells.part(slice(cell, cell + 1)))
        pool.rows[0, : len(found.state)] = found.state
        row = np.empty((1, 4))
        motions_kernel(pool, row)
        out.append(row[0])
    return np.array(out)


@pytest.mark.parametrize(
    ("name", "method"),
    [
        *((name, "default") for name in PERIODIC),
        ("rolling circle", "strict"),
        *(pytest.param(name, "strict", marks=pytest.mark.slow) for name in PERIODIC if name != "rolling circle"),
    ],
)
def test_motions_after_one_wave_are_those_of_single_marches(name, method):
    lowered = waves(PERIODIC[name], 1, method)
    found, status = end_motions(lowered.cells, 1)
    assert (status == contract.DONE).all()
    np.testing.assert_allclose(found, final_motions(lowered), rtol=0, atol=1e-12)


@pytest.mark.parametrize("name", PERIODIC)
def test_a_march_may_go_on_from_where_it_ended(name):
    once, thrice = waves(PERIODIC[name], 1), waves(PERIODIC[name], 3)
    motions = AT_THEIR_STARTS
    for _ in range(3):
        motions, _ = end_motions(once.cells, 1, motions)
    np.testing.assert_allclose(motions, end_motions(thrice.cells, 1)[0], rtol=0, atol=3e-9)


def test_the_number_of_threads_changes_no_bit_of_the_motions():
    once = waves(PERIODIC["rolling circle"], 1, count=600)
    one, three = (end_motions(once.cells, threads)[0] for threads in (1, 3))
    np.testing.assert_array_equal(one, three)


def test_the_motion_of_a_cell_that_ends_alone_is_its_last_one():
    made = cells(CASES["bilateral"])
    assert made.numbers[:, contract.BILATERAL].all()
    pool = pool_of(*made)
    start_lanes(AT_THEIR_STARTS, pool)
    while not lanes_kernel(pool):
        pool = pool.larger()
    np.testing.assert_array_equal(pool.rows[:, contract.TIME], made.numbers[:, contract.END])
