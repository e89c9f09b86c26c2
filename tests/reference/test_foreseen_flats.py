"""What is foreseen of flats before gauges, against exact runs and fits of them."""

import json
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.diagnosis.gauges.fit import fitted
from wheeltapper.diagnosis.gauges.foreseen import Flat, Foreseen
from wheeltapper.diagnosis.gauges.known import known_of
from wheeltapper.diagnosis.gauges.passing import (
    ADVANCE,
    FORCE,
    LENGTH,
    POSITION,
    SPEED,
    Runs,
    passing_without_readings,
)
from wheeltapper.diagnosis.gauges.scan import SCREENED
from wheeltapper.diagnosis.gauges.sizing import OWN_LENGTH, _weighed, problem_of
from wheeltapper.faces.cli import main

from .test_sizes_of_trains import RATE, site

NOISE = 500.0


@cache
def foreseen(speed=20.0):
    place = site()
    passing = passing_without_readings(place.sensors, RATE, NOISE, speed, 8e4)
    return Foreseen(passing, known_of(place), np.full(len(place.sensors), 0.05))


@pytest.mark.slow
@pytest.mark.parametrize("shape", ["fresh", "rounded"])
def test_the_gain_of_a_flat_is_foreseen(shape):
    here, places = foreseen(), foreseen().places(12)
    added = here.scan.weights.over(here._added(here._coarse, here.values, Flat(0.0165, shape), places))
    roots = np.sqrt(here.scan.gains(here.scan.explained(added)))
    level = here.runs.readings(here.values, shape)
    for number in (0, 2, 7, 11):
        values = {**here.values, LENGTH: 0.0165, POSITION: float(places[number])}
        strikes = here._coarse.band.smooth(here.runs.readings(values, shape) - level)
        left = here.scan.weights.over(here._coarse.band.taken(strikes))[:, None]
        (exact,) = here.scan.gains(here.scan.explained(left))
        assert roots[number] == pytest.approx(np.sqrt(exact), rel=0.06)


@pytest.mark.whole
@pytest.mark.slow
def test_as_many_flats_are_found_as_foreseen():
    """500 wheels with a flat somewhere, roughness and noise, on sites that are off as far as is unknown of them."""
    here, rng, hits, expected = foreseen(), np.random.default_rng(5), 0, []
    problem, turn = here._coarse, 2.0 * np.pi * here.values["vehicle.radius"]
    for length in (0.0115, 0.012, 0.0125, 0.013, 0.014):
        expected.append(here.found(Flat(length, "fresh"), 24).mean())
        for _ in range(100):
            values = {**here.values, LENGTH: length, POSITION: float(here.places(1)[0] + turn * rng.random())}
            for name, share in here.known.spread.items():
                values[name] *= float(np.exp(share * rng.standard_normal()))
            added = problem.band.taken(problem.read(values, "fresh") - here.scan.level)
            added += problem.rough @ rng.standard_normal(problem.rough.shape[1])
            added += problem.band.noise * rng.standard_normal(len(added))
            left = here.scan.explained(here.scan.weights.over(added)[:, None])
            hits += int(here.scan.gains(left)[0] > SCREENED)
    assert 0.3 < np.mean(expected) < 0.8
    assert hits / 500 == pytest.approx(np.mean(expected), abs=0.06)


@pytest.mark.slow
def test_the_length_is_known_as_well_as_by_a_fit_of_exact_readings():
    here, place = foreseen(), 5
    at = float(here.places(12)[place])
    values = {**here.values, LENGTH: 0.04, POSITION: at}
    passing = replace(here.runs.passing, readings=here.runs.readings(values, "fresh"))
    problem = problem_of(Runs(passing, here.known.scene), here.values, here.known.spread, here._gain_spread, 800.0)
    weighed = _weighed(problem, values, "fresh")
    fit = fitted(weighed, values, "fresh", (LENGTH, POSITION, FORCE, ADVANCE, SPEED, *here.known.spread), steps=1)
    assert here.deviation(Flat(0.04, "fresh"), 12)[place] == pytest.approx(0.04 * fit.deviation(LENGTH), rel=0.25)


@pytest.mark.slow
def test_a_site_of_gauges_is_assessed_and_drawn(tmp_path, capsys):
    place = site(sensors=site().sensors[:2])
    place.to_toml(tmp_path / "site.toml")
    words = ["--faults", "wheel flat=0.03", "--count", "20", "--output", str(tmp_path / "found.json")]
    assert main(["assess", str(tmp_path / "site.toml"), *words, "--plot", str(tmp_path / "found.svg")]) == 0
    assert "wheel flat" in capsys.readouterr().out
    (row,) = json.loads((tmp_path / "found.json").read_text())["flats"]
    assert 0.0 < row["probability"] <= 1.0
    assert row["half_interval_90"] > 1.645 * OWN_LENGTH * 0.03


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"faults": ["broken spring"]}, "faults: found 'broken spring'; allowed: flats"),
        ({"workers": 2}, "workers: found given, with a site that has a track"),
        ({"speeds": []}, "speeds: found"),
        ({"faults": {"wheel flat": (0.05, 0.02)}}, "faults: found"),
    ],
)
def test_what_cannot_be_asked_of_gauges_is_refused(given, said):
    with pytest.raises(wt.InputError, match=re.escape(said)):
        wt.diagnosis.assess(site(), **given)


def test_a_deck_takes_nothing_of_gauges():
    with pytest.raises(wt.InputError, match="noise: found given, with a site that has no track"):
        wt.diagnosis.assess("examples/site.toml", noise="1 kN")
