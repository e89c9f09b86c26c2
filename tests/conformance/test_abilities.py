"""Every question about every kind of scenario: it is answered, or refused by the one function with its one sentence."""

import random
import runpy
from functools import cache, lru_cache
from itertools import combinations, product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.ask import questions
from wheeltapper.ask.motion import motion_at
from wheeltapper.ask.trajectory import trajectory
from wheeltapper.describe.placement import Placement
from wheeltapper.describe.scenario import Start
from wheeltapper.diagnosis.faults.imbalance import imbalance
from wheeltapper.diagnosis.inference.problem import slopes_of
from wheeltapper.diagnosis.site.neighbours import coupled_motion, superposed
from wheeltapper.ground.needs import BILATERAL, DAMPER_PLAY, Need
from wheeltapper.ground.outcome import Outcome
from wheeltapper.march import run

DOCS = Path(__file__).parents[2] / "docs"
WHEELSET = {"mass": 1500, "load": 91_307, "stiffness": 2.44e6, "damping": 5e4}
BUMP = wt.CosineBump(height=1e-4, length=0.05, start=0.005)
HALF = 1.405e11 / 2


DURATION = 0.007
"""On a stiff rail the bump makes the wheel leave it after 4 ms, and meet it again after 6 ms."""
QUICK = {"cutoff": 1000, "bays": 160}
"""A track that costs little: of slow modes only."""


def own_force(delta):
    return 2 * HALF * delta**1.5


KINDS = {
    "vehicle": {
        "wheelset": wt.Wheelset(**WHEELSET),
        "play": wt.Wheelset(**WHEELSET, damper_play=5e-5),
        "bush": wt.Wheelset(**WHEELSET, bush_stiffness=1e8),
        "friction": wt.Wheelset(**WHEELSET, friction=2e3, friction_stiffness=1e7),
        "corners": wt.Wheelset(
            **WHEELSET, bumpstop_gap=1e-4, bumpstop_stiffness=1e7, spring_corners=((-1e-4, 1e6),), blow_off_force=2e3
        ),
        "wagon": wt.Wagon.erri_b176(),
        "wheelsets": wt.vehicles.Wheelsets(wheelsets=(WHEELSET, WHEELSET), positions=(0.0, -2.56)),
        "bogie": wt.vehicles.Bogie(**wt.vehicles.Bogie.example),
    },
    "contact": {
        "given": wt.Hertz(constant_per_wheel=HALF),
        "computed": wt.Hertz(),
        "hysteresis": wt.Hertz(constant_per_wheel=HALF, hysteresis=0.1),
        "linear": wt.Linear(stiffness=1.2e9),
        "bilateral": wt.Linear(stiffness=1.2e9, bilateral=True),
        "Thornton": wt.contact.Thornton(constant_per_wheel=HALF, yield_force=1.3e5),
        "own": wt.contact.Law(own_force),
    },
    "track": {
        "stiff": wt.StiffTrack(),
        "deck": wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4),
        "scale": wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4, start=0.02, length=3.0),
        "rails": wt.tracks.Slab(**wt.tracks.Slab.example | QUICK),
    },
    "start": {"equilibrium": "equilibrium", "dropped": Start(displacement=1e-5)},
    "rolling": {"circle": "circle", "point": "point"},
    "creep": {"none": None, "Polach": wt.creep.Polach(friction=0.35)},
    "profiles": {"default": wt.profiles.WheelRail(), "cones": wt.profiles.Cones()},
    "irregularity": {"level": (), "bump": (BUMP,), "places": {"both": BUMP}},
    "speed": {"moving": 9.0, "standing": 0.0},
}


class Cell(NamedTuple):
    """What is asked, by which method, and the names of what the scenario consists of."""

    question: str
    method: str
    vehicle: str
    contact: str
    track: str
    start: str
    rolling: str
    creep: str
    profiles: str
    irregularity: str
    speed: str


def fields(kinds):
    return {name: KINDS[name][kind] for name, kind in zip(KINDS, kinds, strict=True)} | {"duration": DURATION}


@cache
def needs(kinds):
    """Return what a scenario would need, whether it can be made or not."""
    given = fields(kinds)
    given["irregularity"] = Placement(given["irregularity"]) if kinds[7] == "places" else given["irregularity"]
    return wt.Scenario.model_construct(**given).needs


@cache
def every_kind():
    """Return all scenarios but those that cannot be for another reason: at rest, nothing is rolled over, or creeps."""
    return [each for each in product(*KINDS.values()) if each[8] == "moving" or (each[5], each[7]) == ("none", "level")]


def one_for_all_needs(kinds):
    """Return one scenario of each vehicle for all that need the same: nothing else decides which march takes it."""
    shuffled = random.Random(1).sample(kinds, len(kinds))
    return [*{(kind[0], needs(kind)): kind for kind in shuffled}.values()]


def cells_of(questions, kinds):
    return [
        Cell(one, method, *each)
        for each in kinds
        for one in questions
        for method in (("default",) if one in WITHOUT_METHOD else ("default", "strict"))
    ]


@cache
def is_taken(question, needed):
    return run.fastest_march(question, needed) is not None


def can_be_made(kinds):
    return is_taken(run.SIMULATE, needs(kinds))


def is_answered(cell):
    return can_be_made(cell[2:]) and is_taken(questions.QUESTIONS[cell.question], needs(cell[2:]))


@cache
def every_cell():
    """Return all cells that are answered, and all that are refused."""
    cells = cells_of(QUESTIONS, every_kind())
    return [cell for cell in cells if is_answered(cell)], [cell for cell in cells if not is_answered(cell)]


def pairwise(cells):
    """Return some of the cells, in which every pair of values occurs that occurs in any."""
    shuffled = random.Random(1).sample(cells, min(len(cells), 8000))
    pairs = {cell: set(combinations(enumerate(cell), 2)) for cell in shuffled}
    left, chosen = set().union(*pairs.values()), []
    while left:
        wanted = min(left)
        holding = [cell for cell in shuffled if wanted in pairs[cell]]
        chosen.append(max(holding[:60], key=lambda cell: len(pairs[cell] & left)))
        left -= pairs[chosen[-1]]
    return sorted(chosen, key=lambda cell: cell[2:])


# -- what is asked ----------------------------------------------------------------------------------------------------


@lru_cache(maxsize=4)
def record_of(scenario, method):
    record = wt.simulate(scenario, method)
    assert record.outcome is Outcome.COMPLETED
    return record


def is_finite(*values):
    return all(np.all(np.isfinite(np.asarray(value, dtype=float))) for value in values)


def simulate(scenario, method):
    assert is_finite(record_of(scenario, method).events.time)


def history(scenario, method):
    found = record_of(scenario, method).history("2 kHz")
    assert is_finite(*found.data_vars.values())


def energy(scenario, method):
    assert abs(float(record_of(scenario, method).energy.relative_imbalance)) < 1e-6


def track(scenario, method):
    found = record_of(scenario, method).track("2 kHz", rail=[0.0], seat=[0])
    assert is_finite(*found.data_vars.values())


def features(scenario, method):
    assert wt.features.time_in_air()(record_of(scenario, method)).max() < scenario.duration


def damper_events(scenario, method):
    stops = record_of(scenario, method).damper_events
    assert DAMPER_PLAY in scenario.needs or stops.sizes["damper_event"] == 0


def suspension_events(scenario, method):
    assert is_finite(record_of(scenario, method).suspension_events.time)


def comfort(scenario, method):
    found = record_of(scenario, method).comfort()
    assert is_finite(found.weighted_rms, found.vibration_dose)  # for others the run is too short


def guidance(scenario, method):
    found = record_of(scenario, method).guidance(window=0, cutoff=None)  # the run is too short for a filter
    assert is_finite(found.guiding_force, found.unloading, found.sum_of_guiding_forces, found.t_gamma)


def mass_and_load(scenario):
    """Return the paths of the mass and the load of a vehicle's first wheelset."""
    vehicle = scenario.vehicle
    if hasattr(vehicle, "wheelsets"):
        return "vehicle.wheelsets.0.mass", "vehicle.wheelsets.0.load"
    if hasattr(vehicle, "axles"):
        return "vehicle.axles.0.mass", "vehicle.axles.0.load"
    if hasattr(vehicle, "wheelset_mass"):
        return "vehicle.wheelset_mass", "vehicle.wheel_load"
    return "vehicle.mass", "vehicle.load"


def sweep(scenario, method):
    over = {mass_and_load(scenario)[0]: [1500, 1510]}
    found = wt.sweep(scenario, over, ["time_in_air"], method=method)
    assert is_finite(found.time_in_air)
    assert not found.status.any()


def gradient(scenario, method):
    found = wt.gradient(scenario, ["time_in_air"], [mass_and_load(scenario)[0]], method=method)
    assert is_finite(found.time_in_air, found.time_in_air_gradient)
    assert found.status == 0


def border(scenario, method):
    over = dict(zip(mass_and_load(scenario), ([1400, 1500], [8e4, 9e4]), strict=True))
    assert is_finite(wt.border(scenario, over, resolution=2, method=method).margin)


def motion(scenario, method):
    times = np.linspace(0.0, scenario.duration, 9)
    forces = record_of(scenario, method).at(times).normal_force
    np.testing.assert_allclose(motion_at(scenario, times, method).force, forces, rtol=0, atol=1e-3)


def derivatives(scenario, method):
    found = trajectory(scenario, ("vehicle.mass",), np.linspace(0.0, scenario.duration, 9), method)
    assert is_finite(found.force, found.deck_acceleration, found.of_force, found.of_deck_acceleration)


def site(scenario):
    return wt.diagnosis.Site(passage=scenario, sensor=wt.diagnosis.Sensor(rate=20e3, noise=6.66e-4))


def diagnose(scenario, _):
    (recording,) = wt.synthesise(site(scenario), vary=False, noise=0.0)
    assert is_finite(slopes_of(scenario, ("vehicle.mass",), recording.times))


def information(scenario, _):
    assert is_finite(wt.diagnosis.information(site(scenario), ["vehicle.mass"]).factors)


def neighbours(felt):
    def ask(scenario, _):
        assert is_finite(felt(scenario, [(0.01, scenario)]).at(np.linspace(0.0, 0.005, 5)))

    return ask


def wear_in(scenario, method):
    assert wt.wear_in(scenario, 1, method=method).attrs["ended"] == "all passes made"


def marks(scenario, method):
    assert is_finite(wt.wear.marks(record_of(scenario, method)).table.rail)


def modes(scenario, _):
    assert is_finite(wt.modes(scenario).frequency)


def critical_speed(scenario, _):
    assert wt.stability.critical_speed(scenario, lowest=20.0, highest=22.0) > 20.0


def reduced(scenario, _):
    assert wt.reduced(scenario).vehicle.mass == 1813.0


def aside(scenario, _):
    assert imbalance(scenario, 0.01).vehicle.bodies[0].position[1] == 0.01


def orbits(scenario, method):
    """Ask over the same bump again and again: what happens once has no orbits."""
    items = scenario.irregularity
    again = items if isinstance(items, Placement) else tuple(wt.Repeated(of=item, period=0.1) for item in items)
    repeated = scenario.model_copy(update={"irregularity": again})
    found = wt.orbits.returns(repeated, {"vehicle.mass": [1500, 1510]}, 2, 2, method=method)
    assert is_finite(found.displacement, found.velocity, found.largest_force)


QUESTIONS = {
    "simulate": simulate,
    "history": history,
    "energy": energy,
    "features": features,
    "damper_events": damper_events,
    "suspension_events": suspension_events,
    "track": track,
    "comfort": comfort,
    "guidance": guidance,
    "sweep": sweep,
    "gradient": gradient,
    "border": border,
    "motion_at": motion,
    "trajectory": derivatives,
    "diagnose": diagnose,
    "information": information,
    "coupled=True": neighbours(coupled_motion),
    "coupled=False": neighbours(superposed),
    "wear_in": wear_in,
    "marks": marks,
    "modes": modes,
    "critical_speed": critical_speed,
    "reduced": reduced,
    "imbalance": aside,
    "orbits": orbits,
}


WITHOUT_METHOD = (
    "diagnose", "information", "coupled=True", "coupled=False", "modes", "critical_speed", "reduced", "imbalance"
)  # fmt: skip
"""Nothing of these depends on the method, so that they are asked once."""
MANY_RUNS = ("sweep", "gradient", "border")
"""Each cell takes several runs. They are asked vehicle by vehicle, because the longest group decides when all end."""
ASKED_OF_A_RECORD = (
    "simulate", "history", "energy", "features", "damper_events", "suspension_events", "track", "comfort", "guidance",
    "motion_at", "marks",
)  # fmt: skip
"""These ask the record of the same run: they are asked together, so that each scenario is marched once for all."""


IN_PAIRS_FIRST = ("wear_in",)
"""Others that take long: `.ci/run --all` asks them in full, as it does with those of a record."""


def is_dear(cell, in_full):
    """Whether such cells are asked in pairs of values: of those that are answered, many runs and strict records.

    A record refuses only once its run has been made: what it refuses is as dear as what it answers.
    """
    if not in_full:
        return True
    strict = cell.question in ASKED_OF_A_RECORD and cell.method == "strict"
    return is_answered(cell) and (cell.question in MANY_RUNS or strict)


def in_pairs_and_in_full(names, vehicles, words):
    yield pytest.param(names, vehicles, False, id=f"{words}, in pairs")
    yield pytest.param(names, vehicles, True, id=words, marks=pytest.mark.whole)


def groups():
    """Return questions and vehicles that are asked together; wagons first, so that only one process compiles theirs."""
    for one in sorted(KINDS["vehicle"], key=lambda name: name != "wagon"):
        yield from in_pairs_and_in_full(ASKED_OF_A_RECORD, (one,), f"of a record of {one}")
        yield from (pytest.param((name,), (one,), True, id=f"{name} of {one}") for name in MANY_RUNS)
    for name in QUESTIONS:
        if name in IN_PAIRS_FIRST:
            yield from in_pairs_and_in_full((name,), (*KINDS["vehicle"],), name)
        elif name not in (*ASKED_OF_A_RECORD, *MANY_RUNS):
            yield pytest.param((name,), (*KINDS["vehicle"],), True, id=name)


def asked(cell):
    QUESTIONS[cell.question](wt.Scenario(**fields(cell[2:])), cell.method)


def check_refused(cell):
    """Ask, and hold what is said to what the one function says."""
    before = (
        [run.SIMULATE, run.DIAGNOSE] if cell.question == "information" else [run.SIMULATE]
    )  # as what is asked is made
    rooms = [*before, questions.QUESTIONS[cell.question]]
    expected = next(
        run.refusal(room, needs(cell[2:])) for room in rooms if run.fastest_march(room, needs(cell[2:])) is None
    )
    with pytest.raises(wt.InputError) as caught:
        asked(cell)
    found = caught.value
    assert (found.found, found.allowed) == (expected.found, expected.allowed)
    assert found.field in (expected.field, f"passage.{expected.field}")
    assert found.allowed


# -- tests ------------------------------------------------------------------------------------------------------------


def test_every_question_is_asked():
    assert [*QUESTIONS] == [*questions.QUESTIONS]


@pytest.mark.slow
@pytest.mark.whole
def test_what_is_covered_is_answered():
    for cell in pairwise(every_cell()[0]):
        try:
            asked(cell)
        except Exception as error:
            raise AssertionError(cell) from error


@pytest.mark.slow
def test_what_is_not_covered_is_refused_with_the_one_sentence():
    for cell in pairwise(every_cell()[1]):
        check_refused(cell)


@pytest.mark.slow
def test_what_no_march_takes_is_refused_as_it_is_made():
    """Before anything is asked of it, so that one question stands for all."""
    wrong = [kinds for kinds in every_kind() if not can_be_made(kinds)]
    assert len(wrong) > 1000
    for cell in cells_of(["history"], wrong):
        check_refused(cell)


@pytest.mark.slow
@pytest.mark.parametrize(("names", "vehicles", "in_full"), [*groups()])
def test_whatever_is_needed_is_answered_or_refused(names, vehicles, in_full):
    kinds = [kinds for kinds in every_kind() if kinds[0] in vehicles and can_be_made(kinds)]
    cells = cells_of(names, one_for_all_needs(kinds))
    dear, others = ([cell for cell in cells if is_dear(cell, in_full) == wanted] for wanted in (True, False))
    answered, refused = ([cell for cell in dear if is_answered(cell) == wanted] for wanted in (True, False))
    for cell in [*others, *pairwise(answered), *pairwise(refused)]:
        try:
            (asked if is_answered(cell) else check_refused)(cell)
        except Exception as error:
            raise AssertionError(cell) from error


def test_whatever_is_covered_can_be_simulated():
    for question in questions.QUESTIONS.values():
        for marcher in question.marchers:
            for need in question.covered_by(marcher):
                together = marcher.requires | question.requires | {need}
                assert question.missing_needs(marcher, together) == ()
                assert run.fastest_march(run.SIMULATE, together) is not None, (question.name, need.name)


def test_a_need_that_no_march_has_heard_of_is_refused_by_its_own_words():
    new = Need("rubber", "contact", "a contact of rubber", "a contact of steel")
    for question in questions.QUESTIONS.values():
        asked_for = question.requires | question.marchers[0].requires | {new}
        with pytest.raises(
            wt.InputError, match=r"contact: found a contact of rubber, which .* allowed: a contact of steel"
        ):
            run.choose(question, frozenset(asked_for))


def test_the_page_of_abilities_is_the_one_that_the_data_make():
    module = runpy.run_path(str(DOCS / "abilities.py"))
    for made in ("page", "table"):
        assert module[made.upper()].read_text(encoding="utf-8") == module[made](), "run: python docs/abilities.py"
    assert sorted(one for names in module["GROUPS"].values() for one in names) == sorted(questions.QUESTIONS)


def test_whatever_can_be_simulated_can_be_mapped_and_differentiated():
    """Only a contact that pulls, which is never lost, has no border but that of a wheel's march, which finds none."""
    for marcher in run.MARCHERS:
        for needs in (marcher.requires | {need} for need in marcher.covers):
            assert run.fastest_march(run.SWEEP, needs) is not None
            assert run.fastest_march(questions.GRADIENT, needs) is not None
            assert run.fastest_march(questions.BORDER, needs - {BILATERAL}) is not None
