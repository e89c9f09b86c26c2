"""Arguments of a wrong kind: every public verb refuses them in one line, before it computes anything."""

import pickle
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt

NOT_NUMBERS = [None, "x", {"a": 1}, [1], float("nan"), -1, object(), wt.StiffTrack()]
NOT_LISTS = [value for value in NOT_NUMBERS if value != [1]]
NOT_SCENARIOS = [5, None, "none.toml", {"a": 1}, [1], float("nan"), True, object(), wt.StiffTrack(), len]
NOT_PATHS = [5, None, "", {"a": 1}, ["a"], True, object(), wt.StiffTrack()]
NOT_FEATURES = [5, None, "force_rati", {"a": 1}, {"type": ["x"]}, [5], [], float("nan"), object(), wt.StiffTrack()]
NOT_FIELDS = [5, {"a": 1}, "spede", ["vehicle.mas"], ["vehicle"], ["irregularity.9.height"], [None], object()]
NOT_METHODS = ["quick", None, 5, ["strict"], {"a": 1}]
GRID = {"speed": [5.0, 6.0]}
SITE = Path(__file__).parents[2] / "examples" / "site.toml"
PLANE = {"speed": [4.0, 5.0], "vehicle.damping": [1e3, 1e4]}


def scene(**changes):
    vehicle = wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=2e4)
    bump = wt.CosineBump(height=1e-4, length=0.05, start=0.02)
    given = {"vehicle": vehicle, "contact": wt.Hertz(constant=1.405e11), "irregularity": bump}
    return wt.Scenario(**(given | {"speed": 5.0, "duration": 0.03} | changes))


def coach():
    return wt.Scenario(vehicle=wt.Wagon.erri_b176(), speed=20.0, duration=0.01)


@cache
def gauges(**changes):
    pair = wt.sensors.RailShearForce(**{"name": "pair", "x1": 0.1, "x2": 0.5, "rate": 5e3} | changes)
    return D.Site(sensors=[pair], track=wt.tracks.Ballasted(), radius=0.46, unsprung_mass=600.0)


@cache
def record():
    return wt.simulate(scene())


@cache
def coach_record():
    return wt.simulate(coach())


def asked():
    return [wt.features.force_ratio()]


def sweep(**options):
    return wt.sweep(options.pop("scenario", scene()), options.pop("over", GRID), asked(), **options)


def wear_in(**options):
    plastic = scene(contact=wt.contact.Thornton(), rolling="point")
    return wt.wear_in(plastic, options.pop("passes", 1), **options)


D = wt.diagnosis
SIZES, HITS, SIGNALS = [1.0, 2.0, 3.0, 4.0], [0, 1, 0, 1], [1.1, 1.7, 3.2, 3.9]
NOT_NAMES = [5, {"a": 1}, "x", [5], [None], float("nan"), object()]
NOT_SHARES = [0.0, 1.0, *NOT_NUMBERS]
NOT_CHOICES = [5, "x", {"a": 1}, ["log"], float("nan"), object()]


@cache
def site():
    return wt.load(SITE)


def recording():
    return D.Recording(np.zeros(400), 20e3)


def identified(**options):
    return D.identify(recording(), SITE, **options)


def signalled(**options):
    return D.signal_response(SIZES, SIGNALS, options.pop("threshold", 2.0), **options)


WALK = {
    "simulate": (wt.simulate, NOT_SCENARIOS),
    "simulate, one of several": (lambda v: wt.simulate([scene(), v]), [*NOT_SCENARIOS, [scene()]]),
    "simulate, method": (lambda v: wt.simulate(scene(), v), NOT_METHODS),
    "simulate, threads": (lambda v: wt.simulate([scene()], threads=v), [0, *NOT_NUMBERS[1:]]),
    "sweep": (lambda v: sweep(scenario=v), NOT_SCENARIOS),
    "sweep, over": (lambda v: sweep(over=v), [5, None, "speed", {}, np.ones(2), {"spede": [1]}, {5: [1]}, object()]),
    "sweep, values": (lambda v: sweep(over={"speed": v}), [*NOT_LISTS, [], [None], ["5 kg"], [[1.0]], [float("inf")]]),
    "sweep, features": (lambda v: wt.sweep(scene(), GRID, v), NOT_FEATURES),
    "sweep, gradient": (lambda v: sweep(gradient=v), NOT_FIELDS),
    "sweep, zipped": (lambda v: sweep(zipped=v), [None, "x", 5]),
    "sweep, samples": (lambda v: sweep(samples=v), [0, 2.5, *NOT_NUMBERS[1:]]),
    "sweep, sampling": (lambda v: sweep(samples=4, sampling=v), [None, "sobel", 5, ["sobol"]]),
    "sweep, seed": (lambda v: sweep(seed=v), [2.5, *NOT_NUMBERS]),
    "sweep, method": (lambda v: sweep(method=v), NOT_METHODS),
    "sweep, threads": (lambda v: sweep(threads=v), [0, *NOT_NUMBERS[1:]]),
    "sweep, chaos_limit": (lambda v: sweep(chaos_limit=v), NOT_NUMBERS),
    "gradient": (lambda v: wt.gradient(v, asked(), ["speed"]), NOT_SCENARIOS),
    "gradient, features": (lambda v: wt.gradient(scene(), v, ["speed"]), NOT_FEATURES),
    "gradient, parameters": (lambda v: wt.gradient(scene(), asked(), v), [None, [], *NOT_FIELDS]),
    "border": (lambda v: wt.border(v, PLANE), NOT_SCENARIOS),
    "border, over": (lambda v: wt.border(scene(), v), [5, None, "speed", GRID, ["speed"], PLANE | {"speed": 4.0}]),
    "border, losses": (lambda v: wt.border(scene(), PLANE, losses=v), [0, 1.5, *NOT_NUMBERS]),
    "border, resolution": (lambda v: wt.border(scene(), PLANE, resolution=v), [1, 2.5, *NOT_NUMBERS]),
    "border, threads": (lambda v: wt.border(scene(), PLANE, threads=v), [0, *NOT_NUMBERS[1:]]),
    "modes": (wt.modes, [*NOT_SCENARIOS, scene()]),
    "reduced": (wt.reduced, [*NOT_SCENARIOS, scene()]),
    "reduced, wheelset": (lambda v: wt.reduced(coach(), v), [0, 5, 1.5, *NOT_NUMBERS]),
    "critical_speed": (wt.stability.critical_speed, [*NOT_SCENARIOS, scene(), coach()]),
    **{
        f"critical_speed, {name}": (lambda v, name=name: wt.stability.critical_speed(coach(), **{name: v}), values)
        for name, values in {
            "lowest": ["5 kg", *NOT_NUMBERS], "highest": ["5 kg", float("inf"), *NOT_NUMBERS],
            "tolerance": [0.0, 1.0, 1e-300, *NOT_NUMBERS],
        }.items()
    },
    **{
        f"{name}, site": (verb, [*NOT_SCENARIOS, scene()])
        for name, verb in {
            "synthesise": wt.synthesise, "design_site": wt.design_site,
            "diagnose": lambda v: wt.diagnose(recording(), v),
            "identify": lambda v: D.identify(recording(), v), "assess": D.assess, "information": D.information,
            "reconstructed": lambda v: D.reconstructed(recording(), v), "imitation": lambda v: D.imitation(v, [50.0]),
            "imitation_map": lambda v: D.imitation_map(v, [15e3], [1e7], [50.0]),
            "diagnose_train": lambda v: D.diagnose_train([recording()], v),
            "synthesise_train": lambda v: D.synthesise_train(v, [None]),
            "diagnose_all": lambda v: D.diagnose_all([], v),
        }.items()
    },
    **{
        f"{name}, recording": (verb, NOT_SCENARIOS)
        for name, verb in {
            "diagnose": lambda v: wt.diagnose(v, SITE), "identify": lambda v: D.identify(v, SITE),
            "reconstructed": lambda v: D.reconstructed(v, SITE),
            "diagnose_train": lambda v: D.diagnose_train(v, SITE), "a train's": lambda v: D.diagnose_train([v], SITE),
            "write_recording": lambda v: D.write_recording(v, "a.csv"),
        }.items()
    },
    **{
        f"synthesise, {name}": (lambda v, name=name: wt.synthesise(SITE, **{name: v}), values)
        for name, values in {
            "count": [0, 1.5, *NOT_NUMBERS], "seed": [1.5, *NOT_NUMBERS], "noise": NOT_NUMBERS[1:],
            "fault": [v for v in NOT_NUMBERS if v is not None], "changes": NOT_FIELDS,
            "neighbour": [0, True, float("inf"), *[v for v in NOT_NUMBERS if v not in (None, -1)]],
        }.items()
    },
    **{
        f"synthesise, a fault's {name}": (
            lambda v, name=name: wt.synthesise(SITE, fault=D.Condition("wheel flat", **{name: v})), NOT_NUMBERS[1:],
        )
        for name in ("size", "place")
    },
    "neighbour, spacing": (lambda v: D.Neighbour(spacing=v), [v for v in NOT_NUMBERS if v != -1]),
    "synthesise_train": (lambda v: D.synthesise_train(SITE, v), NOT_NUMBERS),
    "synthesise_train, axles": (lambda v: D.synthesise_train(SITE, [v]), NOT_NUMBERS[1:]),
    **{
        f"synthesise_train, {name}": (lambda v, name=name: D.synthesise_train(SITE, {1: "healthy"}, **{name: v}), more)
        for name, more in {
            "count": [0, 1.5, *NOT_NUMBERS], "positions": [[0.0, 1.0], [None], *NOT_NUMBERS[1:]],
        }.items()
    },
    **{
        f"synthesise_train, {name}": (lambda v, name=name: D.synthesise_train(SITE, [None], **{name: v}), more)
        for name, more in {
            "seed": [1.5, *NOT_NUMBERS], "speed": ["5 kg", *NOT_NUMBERS[1:]], "noise": NOT_NUMBERS[1:],
            "reach": ["5 kg", *NOT_NUMBERS],
        }.items()
    },
    "a recording": (lambda v: D.Recording(v, 20e3), [v for v in NOT_LISTS if not isinstance(v, float)]),
    "a recording, rate": (lambda v: D.Recording(np.zeros(9), v), [0, "5 m", *NOT_NUMBERS]),
    "a recording, start": (lambda v: D.Recording(np.zeros(9), 1e3, start=v), [v for v in NOT_NUMBERS if v != -1]),
    "a recording, speed": (lambda v: D.Recording(np.zeros(9), 1e3, speed=v), ["5 m", *NOT_NUMBERS[1:]]),
    "a recording, clipped": (lambda v: D.Recording(np.zeros(9), 1e3, clipped=v), [[True], *NOT_NUMBERS]),
    "diagnose, faults": (lambda v: wt.diagnose(recording(), SITE, faults=v), NOT_NAMES),
    "diagnose, noise": (lambda v: wt.diagnose(recording(), SITE, noise=v), [0.0, "1 kg", *NOT_NUMBERS[1:]]),
    "identify, unknown": (lambda v: identified(unknown=v), NOT_NAMES),
    "identify, start": (lambda v: identified(start=v), NOT_FIELDS),
    "identify, noise": (lambda v: identified(noise=v), [0.0, *NOT_NUMBERS[1:]]),
    **{
        f"design_site, {name}": (lambda v, name=name: wt.design_site(site(), **{name: v}), values)
        for name, values in {
            "parameters": NOT_NAMES, "speeds": [[], [None], ["5 kg"], *NOT_LISTS[1:]],
            "vary": [5, "x", {"a": 1}, {5: (1, 2)}, {"track.mass": 5}, object()], "criterion": [None, *NOT_CHOICES],
            "trigger": NOT_NUMBERS, "budget": [0, 1.5, *NOT_NUMBERS], "seed": [1.5, *NOT_NUMBERS],
        }.items()
    },
    **{
        f"design_site, rail.{name}": (lambda v, name=name: wt.design_site(site(), rail={name: v}), values)
        for name, values in {
            "number": [0, 1.5, *NOT_NUMBERS], "shapes": [[], None, *NOT_NAMES], "spacing": NOT_NUMBERS,
            "heights": [(2, 1), (1, 2, 3), *NOT_NUMBERS], "lengths": NOT_NUMBERS, "total_length": NOT_NUMBERS,
            "height": [(1, 2)], "largest_force": NOT_NUMBERS,
        }.items()
    },
    **{
        f"design_site, gauges, {name}": (lambda v, name=name: wt.design_site(gauges(), rail={name: v}), values)
        for name, values in {
            "number": [0, 13, 1.5, *NOT_NUMBERS], "cribs": [0, 17, [], [0, 0], [0, 16], ["x"], *NOT_LISTS],
            "flats": [{}, [], {"wheel flat": "x"}, *NOT_NAMES], "noise": NOT_NUMBERS,
            "static_force": ["5 kg", 0.0, *NOT_NUMBERS], "criterion": [None, "determinant", *NOT_CHOICES],
            "front": [5, [0], [13], [None]], "rates": [5, ["5 kg"], [0.0], [None]], "numbers": [3],
        }.items()
    },
    "design_site, gauges": (lambda v: wt.design_site(gauges(), rail=v), [5, "x", [1], {5: 1}, object()]),
    "design_site, speeds before gauges": (lambda v: wt.design_site(gauges(), speeds=v), [[], [0.0], ["5 kg"], 5]),
    **{
        f"assess, {name}": (lambda v, name=name: D.assess(site(), **{name: v}), values)
        for name, values in {
            "count": [1, 1.5, *NOT_NUMBERS], "healthy": [1, 1.5, *NOT_NUMBERS[1:]], "seed": [1.5, *NOT_NUMBERS],
            "faults": [*NOT_NAMES, {"wheel flat": "x"}, {"wheel flat": object()}], "workers": [0, *NOT_NUMBERS[1:]],
            "output": [v for v in NOT_PATHS if v is not None],
        }.items()
    },
    **{
        f"information, {name}": (lambda v, name=name: D.information(site(), **{name: v}), values)
        for name, values in {
            "parameters": NOT_NAMES, "speeds": [[], [None], ["5 kg"], *NOT_LISTS[1:]], "together": [[5], *NOT_NAMES],
            "trigger": NOT_NUMBERS, "noise": NOT_NUMBERS[1:], "rate": [0, *NOT_NUMBERS[1:]],
        }.items()
    },
    "imitation, frequencies": (lambda v: D.imitation(site(), v), [0, [0], [None], *NOT_LISTS]),
    **{
        f"imitation_map, {name}": (
            lambda v, name=name: D.imitation_map(
                site(), **({"masses": [15e3], "stiffnesses": [1e7], "frequencies": [50.0]} | {name: v})
            ),
            [0, [], [0], [None], ["5 m"], *NOT_LISTS],
        )
        for name in ("masses", "stiffnesses", "frequencies")
    },
    "reconstructed, method": (lambda v: D.reconstructed(recording(), site(), v), [None, *NOT_CHOICES]),
    **{
        f"diagnose_train, {name}": (lambda v, name=name: D.diagnose_train([recording()], site(), **{name: v}), values)
        for name, values in {
            "rules": [5, "none.toml", [5], {"a": 1}, float("nan"), object()],
            "faults": NOT_NAMES, "noise": NOT_NUMBERS[1:],
            "countries": [5, [5], {"a": 1}, float("nan"), object()], "workers": [0, *NOT_NUMBERS[1:]],
        }.items()
    },
    "read_rules": (D.read_rules, ["none.toml", *[v for v in NOT_PATHS if v is not None]]),
    "read_rules, countries": (lambda v: D.read_rules(countries=v), [5, [5], {"a": 1}, float("nan"), object()]),
    "write_recording, path": (lambda v: D.write_recording(recording(), v), ["a.foo", "none/a.csv", *NOT_PATHS]),
    "diagnose_all": (lambda v: D.diagnose_all(v, site()), [5, None, [5], {"a": 1}, float("nan"), object()]),
    "diagnose_all, output": (lambda v: D.diagnose_all([], site(), output=v), [v for v in NOT_PATHS if v is not None]),
    "diagnose_all, reading": (lambda v: D.diagnose_all([], site(), reading=v), [5, "x", [1], {"a": 1}, {5: 1}]),
    "diagnose_all, after": (lambda v: D.diagnose_all([], site(), after=v), [5, "x", [len], {"a": 1}, float("nan")]),
    "diagnose_all, workers": (lambda v: D.diagnose_all(["a"], site(), workers=v), [0, *NOT_NUMBERS[1:]]),
    "combinations": (D.combinations, NOT_SCENARIOS),
    "hit_miss": (lambda v: D.hit_miss(v, HITS), NOT_NUMBERS),
    "hit_miss, hits": (lambda v: D.hit_miss(SIZES, v), NOT_NUMBERS),
    **{
        f"hit_miss, {name}": (lambda v, name=name: D.hit_miss(SIZES, HITS, **{name: v}), values)
        for name, values in {
            "link": [None, *NOT_CHOICES], "scale": [None, *NOT_CHOICES], "bounds": NOT_CHOICES,
            "ceiling": [0, 2, *NOT_NUMBERS[1:]],
        }.items()
    },
    "signal_response": (lambda v: D.signal_response(v, SIGNALS, 2.0), NOT_NUMBERS),
    "signal_response, signals": (lambda v: D.signal_response(SIZES, v, 2.0), NOT_NUMBERS),
    **{
        f"signal_response, {name}": (lambda v, name=name: signalled(**{name: v}), values)
        for name, values in {
            "threshold": NOT_NUMBERS, "floor": [5.0, *NOT_NUMBERS[1:]],
            "saturation": NOT_NUMBERS[1:], "scale": [None, *NOT_CHOICES], "signal_scale": [None, *NOT_CHOICES],
            "bounds": NOT_CHOICES, "ceiling": [0, 2, *NOT_NUMBERS[1:]],
        }.items()
    },
    "noise_threshold": (lambda v: D.noise_threshold(v, 0.1), NOT_NUMBERS),
    "noise_threshold, rate": (lambda v: D.noise_threshold(SIZES, v), NOT_SHARES),
    "noise_threshold, level": (lambda v: D.noise_threshold(SIZES, 0.1, level=v), NOT_SHARES[:2] + NOT_SHARES[3:]),
    "noise_threshold, method": (lambda v: D.noise_threshold(SIZES, 0.1, method=v), [None, *NOT_CHOICES]),
    "noise_threshold, scale": (lambda v: D.noise_threshold(SIZES, 0.1, scale=v), [None, *NOT_CHOICES]),
    "roc": (lambda v: D.roc(v, SIZES), NOT_LISTS),
    "roc, faulty": (lambda v: D.roc(SIZES, v), NOT_LISTS),
    "false_calls": (lambda v: D.false_calls(v, 5), [6, 1.5, *NOT_NUMBERS]),
    "false_calls, axles": (lambda v: D.false_calls(0, v), [0, 1.5, *NOT_NUMBERS]),
    "false_calls, level": (lambda v: D.false_calls(0, 5, v), NOT_SHARES),
    "wear_in": (lambda v: wt.wear_in(v, 1), [*NOT_SCENARIOS, scene()]),
    "wear_in, one of several": (lambda v: wt.wear_in([v], 1), [*NOT_SCENARIOS, scene()]),
    **{
        f"wear_in, {name}": (lambda v, name=name: wear_in(**{name: v}), [*more, *NOT_NUMBERS])
        for name, more in {
            "passes": [0, 1.5], "every": [0], "samples": [0], "seed": [2.5], "hardening": [1.5],
        }.items()
    },
    "wear_in, scatter": (lambda v: wear_in(scatter=v), [5, "speed", [0.1], {5: 0.1}]),
    **{
        f"wear_in, scatter of {name}": (lambda v, name=name: wear_in(scatter={name: v}), NOT_NUMBERS)
        for name in ("speed", "load", "start")
    },
    "wear_in, method": (lambda v: wear_in(method=v), NOT_METHODS),
    "wear_in, store": (lambda v: wear_in(store=v), ["a.csv", *[v for v in NOT_PATHS if v is not None]]),
    "marks": (wt.wear.marks, [*NOT_SCENARIOS, scene()]),
    "load": (wt.load, ["a.csv", "none.toml", "none.nc", "none.zarr", *NOT_PATHS]),
    "plot": (wt.plot, [value for value in NOT_SCENARIOS if value != wt.StiffTrack()]),
    "plot, path": (lambda v: wt.plot(record(), v), ["none/a.png", *[v for v in NOT_PATHS if v is not None]]),
    "plot, features": (lambda v: wt.plot(record(), features=v), [5, {"a": 1}, object()]),
    "plot, border": (lambda v: wt.plot(record(), border=v), [5, "x", {"a": 1}, record]),
    "plot, against": (lambda v: wt.plot(record(), against=v), [5, "x", {"a": 1}, scene()]),
    "plot, wheelset": (lambda v: wt.plot(record(), wheelset=v), [0, 1.5, *NOT_NUMBERS]),
    "read_recording": (wt.read_recording, ["none.csv", "a.foo", *NOT_PATHS]),
    "history": (lambda v: record().history(v), [0, "20 kHzz", "20 m", *NOT_NUMBERS[1:]]),
    "at": (lambda v: record().at(v), ["1 m", ["1 ms", "x"], 9.0, [[0.01]], *NOT_LISTS]),
    "save": (lambda v: record().save(v), ["a.csv", "none/a.nc", *NOT_PATHS]),
    "comfort of a wheelset": (lambda v: record().comfort(v), ["car body", None]),
    "comfort, body": (lambda v: coach_record().comfort(v), ["car bodi", None, 5, ["car body"], {"a": 1}]),
    "comfort, at": (lambda v: coach_record().comfort(at=v), [5, "xyz", [1, 2], {"a": 1}, ["1 kg", 0, 0], [None] * 3]),
    "comfort, rate": (lambda v: coach_record().comfort(rate=v), [5.0, *NOT_NUMBERS]),
    "comfort, settling": (lambda v: coach_record().comfort(settling=v), [9.0, *NOT_NUMBERS]),
    "comfort, weighting": (lambda v: coach_record().comfort(vertical_weighting=v), ["Wx", None, 5, ["Wb"]]),
    "guidance of a wheelset": (lambda v: record().guidance(window=v), [0.0, 2.0]),
    "guidance, cutoff": (lambda v: coach_record().guidance(window=0, cutoff=v), [0, *NOT_NUMBERS[1:]]),
    "guidance, order": (lambda v: coach_record().guidance(window=0, order=v), [0, 3, 2.5, *NOT_NUMBERS]),
    "guidance, window": (lambda v: coach_record().guidance(window=v), [-1.0, 99.0, *NOT_NUMBERS]),
    "guidance, settling": (lambda v: coach_record().guidance(window=0, settling=v), [-1.0, 99.0, *NOT_NUMBERS]),
    "guidance, rate": (lambda v: coach_record().guidance(window=0, rate=v), [0, 30.0, *NOT_NUMBERS[1:]]),
    "wheel_unloading": (wt.features.wheel_unloading, [0, *NOT_NUMBERS]),
    "replaced": (lambda v: scene().replaced(v), [5, None, "x", [1], {5: 1}, {"": 1}, {"a..b": 1}, {"speed.x": 1}]),
    "replaced, a number": (lambda v: scene().replaced({"vehicle.mass": v}), [True, *NOT_NUMBERS]),
    "replaced, a noun": (lambda v: scene().replaced({"vehicle": v}), [5, None, "x", {"a": 1}, [1], wt.StiffTrack()]),
    "replaced, a table": (lambda v: scene().replaced({"vehicle": {}, "vehicle.mass": v}), [1500]),
    "from_toml": (wt.Scenario.from_toml, ["none.toml", *NOT_PATHS]),
    "to_toml": (lambda v: scene().to_toml(v), ["none/a.toml", *NOT_PATHS]),
    "a site's file": (wt.diagnosis.Site.from_toml, ["none.toml", *NOT_PATHS]),
    "with_element": (wt.Wagon.erri_b176().with_element, [5, None, "x", {"a": 1}, wt.StiffTrack()]),
    "without": (wt.Wagon.erri_b176().without, [5, None, "x", "primary damper 9"]),
    "impact_interval": (wt.features.impact_interval, [0, 2, 1.5, *NOT_NUMBERS]),
    "force_ratio": (wt.features.force_ratio, [0, 2, 1.5, *NOT_NUMBERS]),
    "impulse": (wt.features.impulse, [0, 1.5, *NOT_NUMBERS]),
}  # fmt: skip


def cases():
    # Numbered, not printed: processes must collect the same names, and an address is another one in each.
    return [pytest.param(verb, v, id=f"{name} {i}") for name, (verb, vs) in WALK.items() for i, v in enumerate(vs)]


@pytest.mark.parametrize(("verb", "value"), cases())
def test_a_wrong_argument_is_refused_in_one_line(verb, value, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(wt.InputError) as caught:
        verb(value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 1000
    assert not list(tmp_path.iterdir())
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_a_scenario_may_be_given_as_its_file(tmp_path):
    path = tmp_path / "scene.toml"
    scene().to_toml(path)
    for given in (path, str(path)):
        assert wt.simulate(given).scenario == scene()
    assert [one.scenario for one in wt.simulate([path, scene()])] == [scene(), scene()]


def test_an_error_in_a_file_names_the_file_and_in_a_list_the_place(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text("speed = 5", encoding="utf-8")
    with pytest.raises(wt.InputError, match=r"scene.toml: vehicle: found nothing"):
        wt.simulate([path])
    with pytest.raises(wt.InputError, match=r"^scenario.1: found 5"):
        wt.simulate([scene(), 5])


def test_rates_and_times_may_have_units():
    np.testing.assert_array_equal(record().history("1 kHz").time, record().history(1000.0).time)
    np.testing.assert_array_equal(record().at(["1 ms", "2 ms"]).time, record().at([0.001, 0.002]).time)
    np.testing.assert_array_equal(record().at("1 ms").time, record().at(0.001).time)


def test_features_may_be_given_by_name():
    from wheeltapper.ask.study import study_of

    by_name = study_of(scene(), GRID, ["force_ratio", {"type": "impulse", "impact": 2, "name": "second"}])
    assert [feature.name for feature in by_name.features] == ["force_ratio", "second"]
    assert study_of(scene(), GRID, "force_ratio").features[0].definition == asked()[0].definition
    with pytest.raises(wt.InputError, match="did you mean 'force_ratio'"):
        wt.sweep(scene(), GRID, ["force_rati"])


def test_a_site_and_a_recording_may_be_given_as_their_files(tmp_path):
    data, place = str(SITE.parent / "data" / "deck_flat.csv.gz"), str(SITE)
    found = D.reconstructed(data, place, "inertia")
    np.testing.assert_array_equal(found.force, D.reconstructed(wt.read_recording(data), site(), "inertia").force)
    np.testing.assert_array_equal(D.imitation(SITE, [50.0]), D.imitation(site(), [50.0]))
    assert D.write_recording(data, tmp_path / "again.npz") == tmp_path / "again.npz"
    with pytest.raises(wt.InputError, match=r"^recordings\.1: found 5"):
        D.diagnose_train([data, 5], place)


def test_one_country_stands_for_a_list_of_it_and_faults_are_suggested():
    assert D.read_rules(countries="SE") == D.read_rules(countries=["SE"]) != ()
    with pytest.raises(wt.InputError, match=r"^fault: found 'wheel flt'; .*\(did you mean 'wheel flat'\?\)"):
        wt.synthesise(SITE, fault="wheel flt")


def test_shares_and_speeds_may_have_units():
    assert D.false_calls(1, 1000, "95 %") == D.false_calls(1, 1000, 0.95)
    assert D.imitation_map(SITE, ["15 t"], ["10 MN/m"], ["50 Hz"]).identical(
        D.imitation_map(SITE, [15e3], [10e6], [50.0])
    )
