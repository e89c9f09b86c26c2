"""Bad input about trains: one message each."""

from math import nan

import pytest

import wheeltapper as wt
from wheeltapper.describe.site import Site
from wheeltapper.diagnosis import read_rules
from wheeltapper.diagnosis.site.neighbours import Condition, Neighbour, deck_motion
from wheeltapper.diagnosis.site.synthetic import synthesise, synthesise_train
from wheeltapper.diagnosis.train import diagnose_train, train_of
from wheeltapper.ground.errors import InputError

RULE = {"name": '"a"', "quantity": '"peak_force"', "limit": '"350 kN"', "level": '"stop"'}


def site():
    passage = wt.Scenario(
        vehicle=wt.Wheelset(mass=1500, load=91_307, stiffness=2.44e6, damping=5e4),
        contact=wt.Hertz(constant=1.405e11),
        track=wt.FloatingDeck(mass=15_000, stiffness=1.5e7, damping=5e4),
        irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.009),
        speed=9.0,
        duration=0.02,
    )
    return Site(passage=passage)


def rules(path, head="", **changes):
    lines = [f"{name} = {value}" for name, value in (RULE | changes).items() if value is not None]
    path.write_text(f"{head}\n[[rule]]\n" + "\n".join(lines) + "\n", encoding="utf-8")
    return path


def refused(call, *parts):
    with pytest.raises(InputError) as caught:
        call()
    message = str(caught.value)
    assert "\n" not in message
    assert "; allowed: " in message
    for part in parts:
        assert part in message, message


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({"limit": '"350 mm"'}, ("rule.1.limit", "350 mm", "kN")),
        ({"limit": "-3"}, ("rule.1.limit", "-3", "positive force")),
        ({"limit": "true"}, ("rule.1.limit", "True")),
        ({"limit": None}, ("rule.1.limit", "nothing")),
        ({"name": None}, ("rule.1.name", "nothing")),
        ({"name": "3"}, ("rule.1.name", "3", "a text")),
        ({"level": '"panic"'}, ("rule.1.level", "panic", "warning, maintain, stop")),
        ({"quantity": '"noise"'}, ("rule.1.quantity", "noise", "dynamic_increment")),
        ({"per": '"train"'}, ("rule.1.per", "train", "wheel, axle")),
        ({"quantity": '"speed"', "limit": '"80 km/h"', "per": '"axle"'}, ("rule.1.per", "'axle' of speed", "train")),
        ({"quantity": '"left_right_ratio"', "limit": "1.2", "per": '"wheel"'}, ("rule.1.per", "axle, vehicle")),
        ({"quantity": '"flat_length"', "limit": '"6 cm"', "low_pass": '"20 Hz"'}, ("rule.1.low_pass", "no filter")),
        ({"quantity": '"static_force"', "sliding_mean": '"2 m"'}, ("rule.1.sliding_mean", "no filter")),
        ({"quantity": '"speed"'}, ("rule.1.limit", "350 kN", "km/h")),
        ({"when": '"near"'}, ("rule.1.when", "near", "exceeded, reached")),
        ({"date": '3'}, ("rule.1.date", "3", "a date")),
        ({"diameter_above": '"2 kg"'}, ("rule.1.diameter_above", "2 kg", "length")),
        ({"limits": "3"}, ("rule.1.limits", "limits", "quantity")),
        ({"head": "version = 3"}, ("version", "unknown")),
        ({"head": "format = 9"}, ("format", "9", "newer")),
    ],
)  # fmt: skip
def test_a_wrong_rule_is_named_with_its_file(tmp_path, changes, parts):
    path = rules(tmp_path / "rules.toml", **changes)
    refused(lambda: read_rules(path), str(path), *parts)


def test_files_that_hold_no_rules(tmp_path):
    path = tmp_path / "rules.toml"
    refused(lambda: read_rules(path), str(path), "no readable file")
    path.write_text("rule = 3\n", encoding="utf-8")
    refused(lambda: read_rules(path), str(path), "rule: ", "[[rule]]")
    path.write_text("format = 1\n", encoding="utf-8")
    refused(lambda: read_rules(path), str(path), "rule: found none")
    path.write_text("[[rule]\n", encoding="utf-8")
    refused(lambda: read_rules(path), str(path), "not TOML")
    twice = rules(path).read_text(encoding="utf-8")
    path.write_text(twice + twice, encoding="utf-8")
    refused(lambda: read_rules(path), str(path), "'a' twice")


def test_a_file_of_ones_own_is_compared(tmp_path):
    own = rules(tmp_path / "own.toml", quantity='"dynamic_ratio"', limit="2.5", per='"axle"')
    entry = {"verdict": "healthy", "static_force": 1e5, "largest_force": 3e5, "level_force": None}
    (read,) = read_rules(own)
    assert read.limit == 2.5
    assert train_of([entry], site(), rules=own).alarms == ()  # healthy: on level track it does not bounce
    unknown = entry | {"verdict": "not explained", "largest_force": 9e5}
    assert train_of([unknown], site(), rules=own).alarms[0].rule == read
    refused(lambda: train_of([unknown], site(), rules=[read], countries=["SE"]), "countries: found 'SE'", "no country")


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        ({"fault": "rust"}, ("fault", "rust", "wheel flat")),
        ({"size": 0.04}, ("size", "0.04", "a fault")),
        ({"fault": "wheel flat", "size": "large"}, ("size", "large", "range")),
        ({"fault": "wheel flat", "size": (0.05, 0.02)}, ("size", "0.05", "range")),
        ({"fault": "wheel flat", "size": nan}, ("size", "nan")),
        ({"fault": Condition("wheel flat", place=2.0)}, ("place", "2.0", "0 to 1")),
        ({"neighbour": "near"}, ("neighbour", "near", "spacing")),
        ({"neighbour": 0.0}, ("neighbour.spacing", "0.0")),
        ({"count": 0}, ("count", "0")),
    ],
)
def test_wrong_wishes_for_recordings(arguments, parts):
    refused(lambda: synthesise(site(), **arguments), *parts)


@pytest.mark.parametrize(
    ("axles", "arguments", "parts"),
    [
        ([], {}, ("axles", "none")),
        ([3], {}, ("axles.1", "3", "Condition")),
        ({5: "wheel flat"}, {"count": 4}, ("axles", "wheelset 5", "1 to 4")),
        ({1: "wheel flat"}, {}, ("count", "None")),
        ([None, None], {"positions": [0.0]}, ("positions", "2 distances")),
        ([None, None], {"positions": [0.0, -1.0]}, ("positions", "rise from 0")),
        ([Condition("rust")], {}, ("fault", "rust")),
    ],
)
def test_wrong_wishes_for_trains(axles, arguments, parts):
    refused(lambda: synthesise_train(site(), axles, **arguments), *parts)


def test_a_train_without_axles_and_neighbours_that_cannot_be_coupled():
    refused(lambda: diagnose_train([], site()), "recordings", "none")
    own = site().passage
    refused(
        lambda: deck_motion(own, [(2.5, own.replaced({"contact": wt.Linear(stiffness=1e9)}))]), "contact", "coupled"
    )
    played = own.replaced({"vehicle.damper_play": 5e-5})
    refused(lambda: deck_motion(own, [(2.5, played)]), "vehicle.damper_play", "play of the damper", "coupled=False")
    with pytest.raises(InputError):
        Neighbour(spacing=nan)
