"""What cannot be felt changes nothing, whichever march answers: pairs of scenes that are the same model."""

import pytest

import wheeltapper as wt
from tests.pairs import ADDED, EVENTS, FORCES, HERTZ, KINDS, TRACKS, Drawn, difference, hertz_again, is_there

from ..marks import slow

pytestmark = pytest.mark.filterwarnings("ignore::wheeltapper.record.simulate.ModelWarning")
METHODS = "default", "strict"
LAWS = {"linear": wt.Linear(stiffness=1.2e9), "hysteresis": wt.Hertz(constant=HERTZ, hysteresis=0.4)}
CHOSEN = [
    (added, kind, track, METHODS[i % 2])
    for i, (added, kind, track) in enumerate((a, k, t) for a in ADDED for k in KINDS for t in TRACKS)
    if is_there(added, kind, track) and (track != "rails" or kind == "wheelset")
]
STRICT = [one for one in CHOSEN if one[-1] == "strict"]


@pytest.mark.slow
@pytest.mark.parametrize(("added", "kind", "track", "method"), slow(CHOSEN, *STRICT))
def test_what_cannot_be_felt_changes_nothing(added, kind, track, method):
    found = difference(ADDED[added](kind, track, Drawn(height=6e-4 if track == "rails" else 2e-4)), method)
    assert found.events >= 2
    assert found.static < 1e-12
    assert found.time <= EVENTS
    assert max(found.force, found.energy) <= FORCES[method]


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("start", [0.03, -0.015], ids=["level", "on the bump"])
@pytest.mark.parametrize("lift", [0.0, 2e-4], ids=["rest", "raised"])
def test_a_stop_out_of_reach_changes_no_law(law, start, lift):
    """Also where the wheel starts on a height, from which its spring is then stretched, or above the rail."""
    pair = ADDED["a stop"]("wheelset", "stiff", Drawn(begin=start, lift=lift))
    found = difference(tuple(one.model_copy(update={"contact": LAWS[law]}) for one in pair), "strict")
    assert found.static < 1e-12
    assert found.time <= EVENTS
    assert found.force <= 1e-9


COACH = wt.Wagon.erri_b176()
ON_COACH = {
    "own law": {"contact": wt.contact.Law(hertz_again, exponent=1.5, largest="1 mm")},
    "no hysteresis": {"contact": wt.Hertz(constant_per_wheel=0.5 * HERTZ, hysteresis=1e-13)},
    "never yields": {"contact": wt.contact.Thornton(constant_per_wheel=0.5 * HERTZ, yield_force=1e9)},
}


@pytest.mark.parametrize("added", ON_COACH)
def test_what_cannot_be_felt_changes_no_coach(added):
    plain = wt.Scenario(
        vehicle=COACH, contact=wt.Hertz(constant_per_wheel=0.5 * HERTZ), speed=20.0, duration=0.03, rolling="point",
        irregularity={"wheelset 2 right": wt.CosineBump(height=2e-4, length=0.05, start=-2.5)},
    )  # fmt: skip
    one, other = (wt.simulate(scene, "strict") for scene in (plain, plain.model_copy(update=ON_COACH[added])))
    assert one.events.sizes["event"] >= 4
    for name in ("kind", "wheelset", "side"):
        assert (one.events[name].values == other.events[name].values).all()
    assert abs(one.events.time.values - other.events.time.values).max() <= EVENTS
    forces = [record.history(rate=2e4).normal_force for record in (one, other)]
    assert float(abs(forces[0] - forces[1]).max() / one.static_force) <= 1e-9


def test_rails_that_hardly_bend_differ_from_a_stiff_track_by_what_the_spring_has_from_touch_to_rest():
    """On rails a spring has no force at rest, on a stiff track none at first touch: k·δ0 of the static force."""
    scene = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6), contact=wt.Hertz(constant=HERTZ), speed=1.0,
        duration=0.001,
    )  # fmt: skip
    weight, rigid = scene.vehicle.weight, wt.simulate(scene)
    depth = float(rigid.at([0.0]).indentation.squeeze())
    assert rigid.static_force == pytest.approx(weight - 2.44e6 * depth, rel=1e-12)
    assert rigid.static_force == pytest.approx(HERTZ * depth**1.5, rel=1e-12)  # the paper, Eq. 2.3
    track = wt.tracks.Ballasted.named("rolland_UIC60_example", cutoff=1500.0, bays=40)
    assert wt.simulate(scene.replaced({"track": track})).static_force == pytest.approx(weight, rel=1e-12)
