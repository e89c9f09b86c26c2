"""Arguments of a wrong kind to what verbs return: each is refused in one line, or it works sensibly."""

import inspect
from functools import cache
from pathlib import Path

import numpy as np
import pint
import pytest

import wheeltapper as wt
from wheeltapper.record.assessment import comfort

Q = pint.UnitRegistry().Quantity
F, D = wt.features, wt.diagnosis
ANYTHING = [
    "x", "", "20 kHz", b"x", -1, 0, True, 10**400, 1e308, float("nan"), float("inf"), None, object(), len, [], {},
    set(), [None], ["x"], (1, 2, 3), {"a": 1}, Q(3, "kg"), Q([1, 2], "ms"), Q([[1.0]], "m"), np.array([1 + 2j]),
    np.zeros((2, 2, 2)), np.datetime64("2020"),
]  # fmt: skip
QUIET = np.zeros(500)


@cache
def record():
    vehicle = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
    bump = wt.CosineBump(height=1e-4, length=0.05, start=0.02)
    return wt.simulate(
        wt.Scenario(vehicle=vehicle, contact=wt.Hertz(constant=1.405e11), irregularity=bump, speed=5.0, duration=0.03)
    )


@cache
def coach_record():
    return wt.simulate(wt.Scenario(vehicle=wt.Wagon.erri_b176(), speed=20.0, duration=0.01))


def recording(**changes):
    return D.Recording(**({"samples": QUIET, "rate": 1e3} | changes))


def custom(**changes):
    return F.custom(**({"function": lambda train: 1.0, "name": "a"} | changes))


def feature(**changes):
    return F.Feature(**({"name": "a", "unit": "", "definition": "", "impacts": 0, "until": "end", "of": len} | changes))


def ride(**changes):
    rows = dict.fromkeys(("longitudinal", "lateral", "vertical"), QUIET)
    return comfort.ride_comfort(**(rows | {"rate": 1e3} | changes))


def written():
    D.write_recording(recording(), "a.npz")
    return "a.npz"


RESULTS = {record: wt.Record, coach_record: wt.Record, recording: D.Recording, F.force_ratio: F.Feature}
VERBS = {
    "a feature": lambda of: F.force_ratio()(of),
    "a recording": recording,
    "a feature's": feature,
    "custom": custom,
    "custom's result": lambda found: custom(function=lambda train: found)(record()),
    "ride_comfort": ride,
    "running_rms": lambda **given: comfort.running_rms(**({"weighted": QUIET, "rate": 1e3, "seconds": 0.1} | given)),
    "weighted": lambda **given: comfort.weighted(**({"acceleration": QUIET, "rate": 1e3, "name": "Wd"} | given)),
    "weighting": lambda **given: comfort.weighting(**({"name": "Wd", "frequency": 1.0} | given)),
    "comfort": lambda **given: comfort.comfort(**({"record": coach_record()} | given)),
    "read_recording": lambda **given: wt.read_recording(**({"path": written()} | given)),
    "load": lambda largest: wt.load(saved(), largest=largest),
    "plot": lambda **given: wt.plot(**({"what": record()} | given)),
    "impact_interval": lambda between: F.impact_interval(between=between),
    "largest_force": F.largest_force,
    "named": F.named,
}
ARGUMENTS = {
    "a recording": ("samples", "rate", "quantity", "start", "clipped", "speed", "source", "notes", "truth"),
    "a feature's": ("name", "unit", "definition", "impacts", "until", "of", "differentiable", "tally"),
    "custom": ("function", "name", "unit", "definition", "impacts", "until"),
    "ride_comfort": ("longitudinal", "lateral", "vertical", "rate", "vertical_weighting", "settling"),
    "running_rms": ("weighted", "rate", "seconds"), "weighted": ("acceleration", "rate", "name"),
    "weighting": ("name", "frequency"), "comfort": ("record", "body", "at", "rate", "vertical_weighting", "settling"),
    "read_recording": ("path", "quantity", "unit", "rate", "column", "time", "speed", "largest", "apart"),
    "plot": ("what", "path", "features", "border", "against", "wheelset"),
}  # fmt: skip


def saved():
    if not Path("r.nc").exists():
        record().save("r.nc")
    return "r.nc"


def methods():
    for make, kind in RESULTS.items():
        for name, method in inspect.getmembers(kind, inspect.isfunction):
            named = [p.name for p in inspect.signature(method).parameters.values() if p.kind < p.VAR_POSITIONAL]
            named += [p.name for p in inspect.signature(method).parameters.values() if p.kind == p.KEYWORD_ONLY]
            for argument in named[1:] if not name.startswith("_") else ():
                yield pytest.param(make, name, argument, id=f"{make.__name__}.{name} {argument}")


def arguments():
    for name, verb in VERBS.items():
        for argument in ARGUMENTS.get(name, (None,)):
            yield pytest.param(verb, argument, id=f"{name} {argument or ''}")


def refused_or_answered(call):
    for value in ANYTHING:
        try:
            call(value)
            told = ""
        except wt.InputError as error:
            told = str(error)
        assert "\n" not in told
        assert len(told) < 1000


@pytest.mark.filterwarnings("ignore:forces below 20 Hz are not read")  # of a run of 10 ms
@pytest.mark.parametrize(("make", "method", "argument"), list(methods()))
def test_a_method_refuses_a_wrong_argument_in_one_line_or_answers(make, method, argument, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    needed = {"sensors": wt.sensors.DeckAcceleration()} if method == "recordings" else {}
    refused_or_answered(lambda value: getattr(make(), method)(**needed | {argument: value}))


@pytest.mark.filterwarnings("ignore:.*file extension")
@pytest.mark.parametrize(("verb", "argument"), list(arguments()))
def test_a_verb_refuses_a_wrong_argument_in_one_line_or_answers(verb, argument, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    refused_or_answered(verb if argument is None else lambda value: verb(**{argument: value}))


def test_no_times_have_no_samples():
    for of in (record(), coach_record()):
        assert of.at([]).sizes["time"] == 0


def test_times_samples_and_rates_may_have_units():
    np.testing.assert_array_equal(record().at(Q([1, 2], "ms")).time, [0.001, 0.002])
    np.testing.assert_array_equal(record().at([Q(1, "ms"), "2 ms"]).time, [0.001, 0.002])
    np.testing.assert_allclose(recording(samples=Q([1.0], "mm/s^2")).samples, [1e-3])
    assert len(recording().until("20 ms").samples) == 20
    np.testing.assert_array_equal(ride(rate="1 kHz", settling="0.1 s")["weighted_rms"], 0.0)
    for given in ({"samples": Q([1.0], "kN")}, {"quantity": "acceleration"}, {"notes": [5]}, {"source": None}):
        with pytest.raises(wt.InputError):
            recording(**given)


def test_only_a_chart_has_features_and_a_border_to_draw():
    for options in ({"features": ["force_ratio"]}, {"border": wt.border(record().scenario, PLANE, resolution=2)}):
        with pytest.raises(wt.InputError, match=r"None, unless `what` is a chart"):
            wt.plot(record(), **options)


PLANE = {"speed": [4.0, 5.0], "vehicle.damping": [1e3, 1e4]}


def test_what_a_user_s_own_feature_raises_comes_out_as_it_is_and_what_it_returns_is_a_number():
    def fails(train):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        custom(function=fails)(record())
    with pytest.raises(wt.InputError, match="a: found 'many'; allowed: one number"):
        custom(function=lambda train: "many")(record())
    with pytest.raises(wt.InputError, match="a: found 'many'; allowed: one number"):
        wt.sweep(record().scenario, {"speed": [5.0, 6.0]}, [custom(function=lambda train: "many")])


def test_rates_at_which_a_weighting_would_be_wrong_are_refused():
    for rate in (249.0, 1e7):
        with pytest.raises(wt.InputError, match="250 to 1e"):
            comfort.weighted(QUIET, rate, "Wk")


@pytest.mark.parametrize("wrong", ["x", None, 5, ["marching"]])
def test_progress_is_true_false_or_a_function(wrong):
    with pytest.raises(wt.InputError, match=r"^progress: found .*; allowed: True, False, or a function"):
        wt.simulate(record().scenario, progress=wrong)


def test_what_a_progress_function_raises_comes_out_of_every_verb_as_it_is():
    class MineError(Exception):
        pass

    def stop(what, done, total):
        raise MineError

    scene = record().scenario
    for verb in (
        lambda: wt.simulate(scene, progress=stop),
        lambda: wt.simulate([scene, scene], progress=stop),
        lambda: wt.sweep(scene, {"speed": [5.0, 6.0]}, ["force_ratio"], progress=stop),
        lambda: wt.sweep(scene, {"speed": np.linspace(5, 6, 600)}, ["force_ratio"], threads=2, progress=stop),
        lambda: wt.stability.critical_speed(coach_record().scenario.replaced(CREEP), progress=stop),
    ):
        with pytest.raises(MineError):
            verb()


CREEP = {"creep": wt.creep.Polach()}
