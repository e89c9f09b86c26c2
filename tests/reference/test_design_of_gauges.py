"""Designed places of gauges, against the deviations that `Foreseen` tells of each layout, and against all layouts."""

import re
from functools import cache
from itertools import combinations

import numpy as np
import pytest

import wheeltapper as wt
from tests.looks import flaws
from wheeltapper.diagnosis.gauges.design import _Asked, _Judge
from wheeltapper.diagnosis.gauges.foreseen import Flat, Foreseen
from wheeltapper.diagnosis.gauges.performance import PLACES, foreseen_of
from wheeltapper.diagnosis.gauges.sizing import OWN_LENGTH
from wheeltapper.faces.cli import main

from .test_sizes_of_trains import PAIRS, UNCERTAIN, site

FEW = {path: UNCERTAIN[path] for path in ("track.pad_stiffness", "unsprung_mass")}


def first_pair_alone(**changes):
    return site(sensors=site().sensors[:1], **changes)


@cache
def judge(cribs, all_that_is_uncertain=False):
    asked = _Asked(first_pair_alone(**({} if all_that_is_uncertain else {"uncertainty": FEW})), None, {"cribs": cribs})
    return _Judge(asked)


def foreseen_deviations(asked, cribs):
    """Return what `Foreseen` tells of a layout, m: by the whole covariance of its own readings."""
    seen = foreseen_of(asked.site, asked.pairs(cribs), asked.speeds[0], asked.force, asked.noise)
    return seen.deviation(asked.flats[0], PLACES)


def root_mean_square(values):
    return float(np.sqrt((np.asarray(values) ** 2).mean()))


@pytest.mark.slow
@pytest.mark.few(1)
@pytest.mark.parametrize("cribs", [(0, 1, 2), (0, 2, 5)])
def test_a_layout_has_the_deviations_that_are_foreseen_of_it(cribs):
    """Both begin at the same place, so that places of the flat are the same."""
    (deviations,) = judge(6).layout(cribs).deviations
    assert deviations == pytest.approx(foreseen_deviations(judge(6).asked, cribs), rel=0.01)


def test_a_layout_farther_on_is_as_good():
    """Seats are alike; other places of the flat are asked for, which changes the mean by some tenths of a per cent."""
    one, other = judge(6).layout((0, 1, 2)), judge(6).layout((3, 4, 5))
    assert one.value == pytest.approx(other.value, rel=0.015)


@pytest.mark.slow
def test_the_best_of_all_small_layouts_is_found():
    here = judge(6)
    best = here.best_layout(3, None)
    assert best.cribs == min((here.layout(one) for one in combinations(range(6), 3)), key=lambda one: one.value).cribs


@pytest.mark.slow
@pytest.mark.whole
def test_exchange_finds_nearly_the_best_of_all_layouts_of_three_pairs_in_ten_cribs():
    """It is the third of 120, and 0.25 % above the best."""
    here = judge(10, True)
    best = here.best_layout(3, None)
    tried = len(here.layouts)
    everything = sorted(here.layout(one).value for one in combinations(range(10), 3))
    assert tried < 0.3 * len(everything)
    assert best.value <= everything[4]
    assert best.value < 1.005 * everything[0] < 0.96 * everything[len(everything) // 2]


@pytest.mark.slow
def test_a_designed_site_is_as_good_as_it_is_assessed(tmp_path, capsys, monkeypatch):
    first_pair_alone(uncertainty=FEW).to_toml(tmp_path / "site.toml")
    rail = {"number": 2, "cribs": 4, "front": (1,), "rates": ("2500 Hz",), "flats": {"wheel flat": 0.03}}
    found = wt.design_site(tmp_path / "site.toml", speeds=[20.0], rail=rail)

    assessed = wt.diagnosis.assess(found.site, {"wheel flat": 0.03}, count=2)
    assert found.best.with_model == pytest.approx(root_mean_square(assessed.chart.deviation), rel=0.01)
    assert found.gains["every crib"] == found.even[0].value / found.best.value > 1.0
    assert 1.0 < found.gains_with_model["every crib"] < found.gains["every crib"]
    ((rate, _),) = found.rates.values()
    assert rate > found.best.value  # half the rate, with the same noise of a sample
    assert [len(one.cribs) for one in found.front] == [1, 2]
    assert found.front[0].value > 1.2 * found.front[1].value
    chart = found.chart()
    assert chart.instrumented.sum("crib").values.max() == 2
    assert float(chart.value.where(chart.kind == "designed", drop=True).min()) == found.best.value

    assert flaws(wt.plot(found)) == []

    def designed(place, **options):
        asked.update(options)
        return found

    asked = {}
    monkeypatch.setattr("wheeltapper.diagnosis.site.design.design_site", designed)
    words = ["--number", "2", "--cribs", "4", "--front", "1", "--rates", "2500 Hz", "--flats", "wheel flat=0.03"]
    files = ["--output", str(tmp_path / "designed.toml"), "--plot", str(tmp_path / "design.svg"), "--speeds", "20"]
    assert main(["design", str(tmp_path / "site.toml"), *words, *files]) == 0
    assert asked == {"speeds": (20.0,), "rail": rail}
    assert str(found) in capsys.readouterr().out
    assert wt.load(tmp_path / "designed.toml") == found.site
    away = [one.x1 - PAIRS[0][0] for one in found.site.sensors]
    assert away == pytest.approx([0.6 * crib for crib in found.best.cribs])


def test_both_rails_get_the_same_pairs_and_other_sensors_stay():
    left, other = site().sensors[0].model_copy(update={"side": "left"}), wt.sensors.PadForce(name="pad", x=6.0)
    right = left.model_copy(update={"side": "right", "name": "right"})
    asked = _Asked(site(sensors=[left, right, other]), None, {"number": 2, "cribs": [-1, 1, 4]})
    pairs = [(one.name, one.side, getattr(one, "x1", None)) for one in asked.site_with((-1, 4)).sensors]
    assert pairs == [
        ("left crib -1", "left", -0.5), ("right crib -1", "right", -0.5), ("left crib 4", "left", 2.5),
        ("right crib 4", "right", 2.5), ("pad", None, None),
    ]  # fmt: skip
    assert asked.even(2) == {"every second crib": (-1, 1), "every third crib": (1, 4)}


def test_the_worst_tenth_may_be_the_criterion():
    here = judge(6)
    other = _Judge.__new__(_Judge)
    other.__dict__ |= {**here.__dict__, "layouts": {}}
    other.asked = _Asked(here.asked.site, None, {"cribs": 6, "criterion": "90 % quantile"})
    layout = other.layout((0, 2, 5))
    assert layout.value == pytest.approx(np.quantile(layout.deviations, 0.9))
    assert layout.value > here.layout((0, 2, 5)).value


@pytest.mark.slow
@pytest.mark.whole
def test_six_pairs_are_better_in_every_second_crib_than_in_every_crib():
    """The ratio at other places of the flat than those of the search, by the whole covariance."""
    found = wt.design_site(first_pair_alone())
    asked = _Asked(first_pair_alone(), None, None)
    layouts = {"designed": found.best.cribs, **asked.even(6)}
    seen = {
        kind: root_mean_square(Foreseen.deviation(
            foreseen_of(asked.site, asked.pairs(cribs), 20.0, asked.force, asked.noise), Flat(0.03, "fresh"), 48,
        )) for kind, cribs in layouts.items()
    }  # fmt: skip
    print({kind: 1e3 * value for kind, value in seen.items()}, found)
    assert seen["every crib"] / seen["every second crib"] == pytest.approx(1.08, abs=0.02)
    assert seen["every crib"] / seen["designed"] > 1.07
    assert found.gains["every crib"] == pytest.approx(seen["every crib"] / seen["designed"], abs=0.015)
    with_model = {kind: np.hypot(value, OWN_LENGTH * 0.03) for kind, value in seen.items()}
    expected = with_model["every crib"] / with_model["designed"]
    assert found.gains_with_model["every crib"] == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize(
    ("changed", "given", "said"),
    [
        ({}, {"budget": 50}, "budget: found given, with a site that has a track; allowed: none of it"),
        ({}, {"rail": {"pairs": 3}}, "rail.pairs: found the unknown name 'pairs'"),
        ({}, {"rail": {"number": 7, "cribs": 6}}, "rail.number: found 7; allowed: a whole number, 1 to 6"),
        ({"sensors": [], "static_force": 8e4}, {}, "sensor: found no pair of rail shear gauges"),
        ({"track": site().track.model_copy(update={"first_sleeper": 0.3})}, {}, "sensors: found the pair '0' with a"),
        (
            {"sensors": [
                site().sensors[0].model_copy(update={"side": "left"}),
                site().sensors[1].model_copy(update={"side": "right"}),
            ]},
            {}, "sensors: found first pairs '0' and '1' that differ",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_asked_of_gauges_is_refused(changed, given, said):
    with pytest.raises(wt.InputError, match=re.escape(said)):
        wt.design_site(site(**{"sensors": site().sensors[:1], **changed}), **given)


def test_a_deck_takes_nothing_of_gauges():
    with pytest.raises(wt.InputError, match=r"rail\.cribs: found the unknown name 'cribs'"):
        wt.design_site("examples/site.toml", rail={"cribs": 6})
