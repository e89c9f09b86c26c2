"""Wrong arguments of what verbs return, wrong callbacks and wrong flags: refused in one line."""

from functools import cache
from math import inf
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.diagnosis.inference.estimate import Estimate
from wheeltapper.diagnosis.site.design import Design
from wheeltapper.diagnosis.site.design_search import Candidate
from wheeltapper.diagnosis.site.layout import Layout, RailFeature
from wheeltapper.diagnosis.site.neighbours import Condition

D = wt.diagnosis
SITE = Path(__file__).parents[2] / "examples" / "site.toml"
ANYTHING = [None, 5.5, "x", "", {"a": 1}, [1], [None], float("nan"), -1, object(), wt.StiffTrack(), len]
NOT_NUMBERS = [None, "x", "", "5 kg", {"a": 1}, [1], object(), wt.StiffTrack(), len]
NOT_SIZES = [0.0, -1, inf, float("nan"), [None], ["x"], *[v for v in NOT_NUMBERS if v != [1]]]
NOT_LEVELS = [0.0, 1.0, -1, float("nan"), *NOT_NUMBERS]
NOT_PATHS = [None, "", 5, True, {"a": 1}, ["a"], object(), "none/a.toml"]
NOT_FLAGS = [None, 1, 0, "no", [True], object()]
NOT_CALLBACKS = [5, "print", [print], {"a": 1}, object(), wt.StiffTrack()]


@cache
def site():
    return wt.load(SITE)


@cache
def quiet():
    return D.Recording(0.07 * np.random.default_rng(1).standard_normal(4000), 20e3)


@cache
def estimate():
    paths = ("vehicle.mass", "vehicle.damping")
    return Estimate(paths, np.array([1500.0, 2e4]), np.diag([1e-4, 4e-4]), 100.0, 100, True, site().passage, 0.07)


@cache
def information():
    return D.information(site(), speeds=[8.0, 10.0])


@cache
def design():
    layout = Layout((RailFeature("bump", 1e-3, 0.1, 0.05),), {})
    one = Candidate("designed", layout, 1.0, 1.0, 2e5, 0.1)
    return Design(site(), information(), "determinant", one, one, one, one, (one,))


@cache
def detection(bounds=None):
    sizes = np.linspace(1.0, 8.0, 40)
    return D.hit_miss(sizes, sizes + np.tile([-1.0, 1.0], 20) > 4.0, bounds=bounds)


@cache
def curve():
    return D.roc([0.0, 1.0, 2.0], [1.5, 3.0, 4.0])


@cache
def finding():
    return wt.diagnose(quiet(), site())


@cache
def train():
    return D.diagnose_train([quiet()], site())


@cache
def rule():
    return D.read_rules()[0]


@cache
def fault():
    return D.CATALOGUE["wheel flat"]


def trained(**options):
    return D.synthesise_train(site(), [None], **options)


WALK = {
    "estimate": (lambda v: estimate()[v], [*ANYTHING, "vehicle.mas"]),
    "estimate, deviation": (lambda v: estimate().deviation(v), [*ANYTHING, "vehicle.mas"]),
    "estimate, correlation": (lambda v: estimate().correlation("vehicle.mass", v), [*ANYTHING, "vehicle.mas"]),
    "estimate, interval": (lambda v: estimate().interval(v), [*ANYTHING, "vehicle.mas"]),
    "estimate, level": (lambda v: estimate().interval("vehicle.mass", v), NOT_LEVELS),
    "information, rows": (lambda v: information().rows(v), [2, *ANYTHING]),
    "information, deviation": (lambda v: information().deviation(v), [*ANYTHING, "vehicle.mas"]),
    "information, index": (lambda v: information().index(v), [*ANYTHING, "vehicle.mas"]),
    "information, correlation": (lambda v: information().correlation(v, "speed"), [*ANYTHING, "vehicle.mas"]),
    "information, passage": (lambda v: information().correlation("speed", "speed", v), [2, *ANYTHING]),
    "combinations, passage": (lambda v: D.combinations(information(), v), [2, *ANYTHING]),
    "combinations, limit": (lambda v: D.combinations(information(), limit=v), [0.0, -1, *NOT_NUMBERS]),
    "design, front": (lambda v: design().front(v), [*ANYTHING, "largest_forc"]),
    "design, file": (lambda v: design().to_toml(v), NOT_PATHS),
    **{
        f"detection, {name}": (verb, values)
        for name, (verb, values) in {
            "at": (lambda v: detection().at(v), NOT_SIZES),
            "lower": (lambda v: detection().lower(v), NOT_SIZES),
            "lower, level": (lambda v: detection().lower(3.0, v), [0.5, *NOT_LEVELS]),
            "size": (lambda v: detection().size(v), NOT_LEVELS),
            "size, level": (lambda v: detection().size(0.9, v), [0.5, *[v for v in NOT_LEVELS if v is not None]]),
            "ceiling_interval": (lambda v: detection().ceiling_interval(v), [0.5, *NOT_LEVELS]),
        }.items()
    },
    "roc, rate_at": (lambda v: curve().rate_at(v), [-0.1, 1.1, float("nan"), *NOT_NUMBERS]),
    "roc, threshold_at": (lambda v: curve().threshold_at(v), [-0.1, 1.1, float("nan"), *NOT_NUMBERS]),
    "roc, interval": (lambda v: curve().interval(v), NOT_LEVELS),
    "finding, score": (lambda v: finding().score(v), [*ANYTHING, "wheels"]),
    "a train, alarms_at": (lambda v: train().alarms_at(v), [0, 2, *ANYTHING]),
    "a rule, raised_by": (lambda v: rule().raised_by(v), NOT_NUMBERS),
    "a fault, passage": (lambda v: fault().passage(v), [*ANYTHING, site()]),
    "a fault, size": (lambda v: fault().passage(site().passage, v), [inf, -1, *NOT_NUMBERS[1:]]),
    "a fault, place": (lambda v: fault().passage(site().passage, 0.05, v), [-0.1, 1.1, float("nan"), *NOT_NUMBERS]),
    "diagnose_train, name": (lambda v: D.diagnose_train([quiet()], site(), name=v), [None, 5, ["x"], object()]),
    "diagnose_train, date": (lambda v: D.diagnose_train([quiet()], site(), date=v), [None, 5, ["x"], object()]),
    "synthesise, name": (lambda v: wt.synthesise(site(), fault=Condition(name=v)), [5, ["x"], object()]),
    "synthesise, vary": (lambda v: wt.synthesise(site(), vary=v), NOT_FLAGS),
    "synthesise, coupled": (lambda v: wt.synthesise(site(), coupled=v), NOT_FLAGS),
    "synthesise_train, vary": (lambda v: trained(vary=v), NOT_FLAGS),
    "synthesise_train, coupled": (lambda v: trained(coupled=v), NOT_FLAGS),
    "design_site, one_gauge": (lambda v: wt.design_site(site(), one_gauge=v), NOT_FLAGS),
    "design_site, progress": (lambda v: wt.design_site(site(), progress=v), NOT_CALLBACKS),
    "diagnose_all, raising": (lambda v: D.diagnose_all([], site(), raising=v), NOT_FLAGS),
    "diagnose_all, progress": (lambda v: D.diagnose_all([], site(), progress=v), NOT_CALLBACKS),
    "diagnose_all, after": (lambda v: D.diagnose_all([], site(), after=v), NOT_CALLBACKS),
    "assess, progress": (lambda v: D.assess(site(), progress=v), NOT_CALLBACKS),
    "modes, fixed_wheelsets": (
        lambda v: wt.modes(wt.Scenario(vehicle=wt.Wagon.erri_b176(), speed=20.0, duration=0.01), fixed_wheelsets=v),
        NOT_FLAGS,
    ),
    "signal_response, seen_only": (
        lambda v: D.signal_response([1.0, 2.0, 3.0, 4.0], [1.1, 1.7, 3.2, 3.9], 2.0, seen_only=v), NOT_FLAGS,
    ),
}  # fmt: skip


def cases():
    return [pytest.param(verb, v, id=f"{name} {i}") for name, (verb, vs) in WALK.items() for i, v in enumerate(vs)]


@pytest.mark.parametrize(("verb", "value"), cases())
def test_a_wrong_argument_is_refused_in_one_line(verb, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(wt.InputError) as caught:
        verb(value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 1000
    assert not list(tmp_path.iterdir())


def test_a_right_argument_is_not_refused(tmp_path):
    assert estimate().interval("vehicle.mass", "90 %") == estimate().interval("vehicle.mass")
    assert information().rows(np.int64(1)).shape == information().rows(0).shape
    assert detection().at([[2.0, 3.0]]).shape == (1, 2)
    assert finding().score("wheel") == -inf
    assert rule().raised_by("1 MN") == rule().raised_by(1e6)
    assert not rule().raised_by(float("nan"))
    assert design().front("total_length") == design().candidates
    design().to_toml(tmp_path / "site.toml")
    assert wt.load(tmp_path / "site.toml") == site()


@pytest.mark.slow
def test_whole_numbers_of_numpy_and_texts_are_numbers(tmp_path):
    vehicle = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
    bump = wt.CosineBump(height=1e-4, length=0.05, start=0.02)
    given = {"vehicle": vehicle, "irregularity": bump, "speed": 5.0, "duration": 0.03}
    plastic = wt.Scenario(**given, contact=wt.contact.Thornton(), rolling="point")
    one, every = np.int64(1), np.int64(2)
    found = wt.wear_in(plastic, one, every=every, samples=np.int64(2), store=tmp_path / "a.nc")
    assert found.identical(wt.wear_in(plastic, 1, every=2, samples=2, store=tmp_path / "a.nc"))
    elastic = wt.Scenario(**given, contact=wt.Hertz(constant=1.405e11))
    limits = [
        wt.gradient(elastic, ["force_ratio"], ["speed"], chaos_limit=limit).gradient_status.values
        for limit in ("1000", 1000.0)
    ]
    assert limits[0] == limits[1]


def test_the_search_of_critical_speeds_takes_a_file(tmp_path):
    scene = wt.Scenario(vehicle=wt.Wagon.erri_b176(), speed=20.0, duration=0.01)
    scene.to_toml(tmp_path / "coach.toml")
    with pytest.raises(wt.InputError, match="creep: found none"):
        wt.stability.critical_speed(tmp_path / "coach.toml")
