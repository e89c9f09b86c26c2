"""What is foreseen of flats before gauges, against simulated passages over rough rails on tracks that differ."""

import json
import re
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.diagnosis.gauges.fit import fitted, moved
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
from wheeltapper.diagnosis.gauges.sizing import _weighed, problem_of
from wheeltapper.faces.cli import main

from .test_sizes_of_trains import RATE, site

NOISE, LENGTHS, PLACES = 500.0, np.linspace(0.012, 0.024, 9), 48


@dataclass(eq=False)
class RoughRuns(Runs):
    """Runs over a rail with the roughness of ISO 3095."""

    seed: int = 0

    def scenario(self, values, shape):
        smooth = super().scenario(values, shape)
        rough = wt.irregularities.Spectrum(curve="ISO 3095:2013", seed=self.seed)
        return smooth.replaced({"irregularity": [*smooth.irregularities, rough], "rolling": "point"})


@cache
def foreseen(speed=20.0):
    place = site()
    passing = passing_without_readings(place.sensors, RATE, NOISE, speed, 8e4)
    return Foreseen(passing, known_of(place), np.full(len(place.sensors), 0.05))


def simulated(seed):
    """Return length, place over the circumference (0 to 1), and whether the scan finds the flat."""
    rng, here = np.random.default_rng([7, seed]), foreseen()
    passing, values = here.runs.passing, dict(here.values)
    for path, share in here.known.spread.items():
        values = moved(values, path, share * rng.standard_normal())
    values |= {
        SPEED: values[SPEED] * (1.0 + 1.3e-3 * rng.standard_normal()), ADVANCE: 2e-3 * rng.standard_normal(),
        LENGTH: rng.uniform(LENGTHS[0], LENGTHS[-1]),
    }  # fmt: skip
    around = rng.uniform()
    turn = 2.0 * np.pi * here.values["vehicle.radius"]
    values[POSITION] = here.places(1)[0] + turn * around
    read = RoughRuns(passing, here.known.scene, seed=seed + 1).readings(values, "fresh")
    told = read * (1.0 + 0.05 * rng.standard_normal(read.shape[1])) + NOISE * rng.standard_normal(read.shape)
    seen = here.scan.seen(told, passing.used)
    return values[LENGTH], around, seen.candidates[0].gain >= SCREENED


def agreement(count):
    """Return expected and found shares of flats, in all and by length, and the deviation of the first by chance."""
    rows = np.array([simulated(seed) for seed in range(count)])
    chances = np.array([foreseen().found(Flat(one, "fresh"), PLACES) for one in LENGTHS])
    number = np.rint(rows[:, 1] * PLACES).astype(int) % PLACES
    expected = np.array([np.interp(own, LENGTHS, chances[:, k]) for own, k in zip(rows[:, 0], number, strict=True)])
    parts = np.digitize(rows[:, 0], LENGTHS[2:-1:2])
    by_length = [(expected[parts == k].mean(), rows[parts == k, 2].mean()) for k in range(4)]
    chance = np.sqrt((expected * (1.0 - expected)).sum()) / count
    return expected.mean(), rows[:, 2].mean(), chance, by_length


@pytest.mark.slow
def test_the_chance_of_finding_a_flat_is_that_of_simulated_passages():
    expected, found, chance, _ = agreement(500)
    assert abs(expected - found) < 3.0 * chance + 0.03


def test_the_length_is_known_as_well_as_by_a_fit_of_exact_readings():
    here, place = foreseen(), 5
    at = float(here.places(12)[place])
    values = {**here.values, LENGTH: 0.04, POSITION: at}
    passing = replace(here.runs.passing, readings=here.runs.readings(values, "fresh"))
    problem = problem_of(Runs(passing, here.known.scene), here.values, here.known.spread, here._gain_spread, 800.0)
    weighed = _weighed(problem, here.values, values, "fresh")
    track = [path for path in here.known.spread if path.startswith("track.")]
    own = [path for path in here.known.spread if path not in track]
    fit = fitted(weighed, values, "fresh", (LENGTH, POSITION, FORCE, ADVANCE, SPEED, *own), track, steps=1)
    assert here.deviation(Flat(0.04, "fresh"), 12)[place] == pytest.approx(0.04 * fit.deviation(LENGTH), rel=0.25)


def test_a_site_of_gauges_is_assessed_and_drawn(tmp_path, capsys):
    place = site(sensors=site().sensors[:2])
    place.to_toml(tmp_path / "site.toml")
    words = ["--faults", "wheel flat=0.03", "--count", "20", "--output", str(tmp_path / "found.json")]
    assert main(["assess", str(tmp_path / "site.toml"), *words, "--plot", str(tmp_path / "found.svg")]) == 0
    assert "wheel flat" in capsys.readouterr().out
    (row,) = json.loads((tmp_path / "found.json").read_text())["flats"]
    assert 0.0 < row["probability"] <= 1.0
    assert row["half_interval_90"] > 1.645 * 0.025 * 0.03


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
